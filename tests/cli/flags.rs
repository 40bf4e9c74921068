//! Errors of the library name fields; the command prints the flags that set them.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::Folder;

/// Arguments, and what the message must hold.
type Case = (&'static [&'static str], &'static [&'static str]);

const CASES: [Case; 12] = [
    (&["eval", "m.toml", "--pairs", "p.csv", "--plan", "fast"], &["--plan"]),
    (&["eval", "m.toml", "--pairs", "p.csv", "--method", "direct", "--bounces", "2"], &["--bounces"]),
    (&["eval", "m.toml", "--pairs", "p.csv", "--method", "sg", "--budget", "1s"], &["--method direct"]),
    (&["eval", "m.toml", "--pairs", "p.csv", "--device", "gpu"], &["--device gpu"]),
    (&["eval", "m.toml", "--pairs", "p.csv", "--method", "lowrank", "--budget", "1s"], &["--method direct"]),
    (&["bake", "m.toml", "-o", "m.txt"], &["m.txt: --output: "]),
    (&["bake", "m.toml", "-o", "m.exr", "--budget", "1s"], &["--tolerance", "--resolution"]),
    (&["plot", "m.toml", "-o", "out", "--incidence", "0,1,2,3,4,5,6"], &["--incidence"]),
    (&["fold", "m.toml", "-o", "m.pdf", "--scale", "-1"], &["--scale"]),
    (&["fold", "m.toml", "-o", "m.pdf", "--page", "a9"], &["--page"]),
    (&["fold", "m.toml", "-o", "m.pdf", "--svg-dpi", "96"], &["--svg-dpi"]),
    (&["study-run", "m.toml", "--setting", "fast", "--seed", "0", "--pairs", "p.csv"], &["--setting"]),
];

#[test]
fn a_mistake_at_a_field_is_printed_with_its_flag() {
    let folder = Folder::new();
    for (arguments, words) in CASES {
        let said = folder.run(arguments);
        assert!(said.status == 2 || said.status == 1, "{arguments:?}: {}", said.stderr);
        for word in words {
            assert!(said.stderr.contains(word), "{arguments:?}: no {word:?} in {}", said.stderr);
        }
        let name = words[0].trim_start_matches('-').split(' ').next().unwrap();
        assert!(!said.stderr.contains(&format!("`{name}`")), "{arguments:?}: a field and not a flag in {}", said.stderr);
    }
}

#[test]
fn json_names_the_flag_too() {
    let said = Folder::new().run(["eval", "m.toml", "--pairs", "p.csv", "--plan", "fast", "--json"]);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(object["error"]["field"], "--plan");
    assert!(object["error"]["message"].as_str().unwrap().starts_with("--plan: "), "{object}");
}

#[test]
fn a_mistake_in_a_line_of_a_file_is_about_the_keys_of_that_file() {
    let folder = Folder::new();
    folder.write("scene.toml", "format = 1\nmaterial = 5\n");
    let said = folder.run(["render", "scene.toml", "-o", "out.png"]);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert!(!said.stderr.contains("--material"), "{}", said.stderr);
}
