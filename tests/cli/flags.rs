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

#[test]
fn errors_have_the_colours_that_are_asked_for() {
    let folder = Folder::new();
    for (arguments, coloured) in [
        (&["check", "no.toml"][..], false),
        (&["--color", "always", "check", "no.toml"], true),
        (&["check", "no.toml", "--color=always"], true),
        (&["check", "no.toml", "--color=never"], false),
        // Wrong arguments, which clap tells.
        (&["eval", "--color=always"], true),
        (&["eval"], false),
    ] {
        let said = folder.run(arguments);
        assert_eq!(said.status, 2);
        let head = if coloured { "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m" } else { "error:" };
        assert!(said.stderr.starts_with(head), "{arguments:?}: {:?}", said.stderr);
        assert_eq!(said.stderr.contains('\u{1b}'), coloured, "{arguments:?}: {:?}", said.stderr);
    }
}

#[test]
fn the_version_is_an_object_where_json_is_asked_for() {
    let said = Folder::new().run(["--json", "--version"]);
    assert_eq!((said.status, said.stderr.as_str()), (0, ""));
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(object["version"], env!("CARGO_PKG_VERSION"));
    assert!(["commit", "features", "target", "profile"].iter().all(|key| object[key].is_string()), "{object}");
}

#[test]
fn details_are_told_where_they_are_asked_for() {
    let folder = Folder::new();
    let eval = ["eval", "m.toml", "--pairs", "p.csv", "-o", "o.csv"];
    let (plain, verbose) = (folder.run(eval), folder.run(eval.iter().chain(&["--verbose"])));
    assert!(!plain.stderr.contains("samples were expected") && plain.stderr.contains("wrote o.csv"), "{}", plain.stderr);
    assert!(verbose.stderr.contains("samples were expected"), "{}", verbose.stderr);
    let json: Value = serde_json::from_str(&folder.run(eval.iter().chain(&["--json"])).stdout).unwrap();
    assert!(json["summary"]["details"][0].as_str().unwrap().starts_with("auto chose direct"), "{json}");
}
