//! The commands as a whole: help, what is not built yet, `new`, `check`, and the documentation that must agree with them.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::{Folder, MATERIAL, PLANE, project};

/// All commands, in the order of the work.
const COMMANDS: [&str; 15] =
    ["new", "list", "check", "eval", "bake", "btf", "plot", "render", "compare", "study", "fold", "capture", "fit", "cache", "edit"];
/// Those that say that they are not built yet.
const LATER: [&str; 1] = ["edit"];
/// Commands of a command.
const OF_BTF: [&str; 4] = ["make", "image", "ptm", "pca"];
/// Set to write `docs/commands.md` anew in place of comparing it.
const UPDATE: &str = "BISCALE_UPDATE_DOCS";

fn help(arguments: &[&str]) -> String {
    let output = Folder::new().command(arguments).env("COLUMNS", "100").output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn help_lists_the_commands_in_the_order_of_the_work() {
    let help = help(&["--help"]);
    let listed = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names: Vec<&str> = listed.lines().filter_map(|l| l.split_whitespace().next()).filter(|n| *n != "help").collect();
    assert_eq!(names, COMMANDS);
}

#[test]
fn the_documentation_of_the_commands_is_their_help() {
    let mut text = String::from(
        "# Commands\n\nWhat `biscale --help` says, and each command's `--help`. A test compares this page with the program; after a\n\
         change `BISCALE_UPDATE_DOCS=1 cargo test -p biscale-cli --test commands` writes it anew. Formats and the meaning of the\n\
         options are in [formats.md](formats.md).\n",
    );
    let mut add = |title: &str, help: &str| {
        let help: Vec<&str> = help.lines().map(str::trim_end).collect();
        text += &format!("\n## {title}\n\n```text\n{}\n```\n", help.join("\n").trim_end());
    };
    add("biscale", &help(&["--help"]));
    for command in COMMANDS {
        add(&format!("biscale {command}"), &help(&[command, "--help"]));
        for part in OF_BTF.into_iter().filter(|_| command == "btf") {
            add(&format!("biscale btf {part}"), &help(&["btf", part, "--help"]));
        }
    }
    let page = project("docs/commands.md");
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(&page, &text).unwrap();
    }
    assert!(
        std::fs::read_to_string(&page).unwrap_or_default() == text,
        "docs/commands.md is not what the program says; run with {UPDATE}=1"
    );
}

#[test]
fn every_command_takes_json_and_quiet() {
    for command in COMMANDS {
        let help = help(&[command, "--help"]);
        assert!(help.contains("--json") && help.contains("--quiet"), "{command}:\n{help}");
    }
}

#[test]
fn commands_that_are_not_built_yet_say_so_whatever_they_are_given() {
    let folder = Folder::new();
    let before = folder.snapshot();
    for command in LATER {
        for arguments in [&[command][..], &[command, "m.toml", "-o", "out", "--some", "option"]] {
            let said = folder.run(arguments);
            assert_eq!((said.status, said.stdout.as_str()), (1, ""), "{arguments:?}: {}", said.stderr);
            assert!(said.stderr.contains(command) && said.stderr.contains("not built yet"), "{arguments:?}: {}", said.stderr);
        }
    }
    assert_eq!(folder.run(["new", "fit", "captured", "x.toml"]).status, 2, "new fit");
    assert!(folder.snapshot() == before, "something was written");
}

#[test]
fn the_version_is_printed() {
    let short = concat!("biscale ", env!("CARGO_PKG_VERSION"));
    assert_eq!(help(&["-V"]).trim_end(), short);
    let long = help(&["--version"]);
    let lines: Vec<&str> = long.trim_end().lines().collect();
    assert_eq!((lines.len(), lines[0]), (5, short), "{long}");
    for (line, key) in lines[1..].iter().zip(["commit", "features", "target", "profile"]) {
        assert!(line.strip_prefix(key).is_some_and(|value| value.len() > 1), "{long}");
    }
    assert_eq!(long.contains("features capture"), cfg!(feature = "capture"), "{long}");
}

#[test]
fn without_arguments_the_help_is_shown_as_an_error() {
    let said = Folder::new().run(&[] as &[&str]);
    assert_eq!((said.status, said.stdout.as_str()), (2, ""));
    assert!(said.stderr.contains("Commands:"), "{}", said.stderr);
}

#[test]
fn a_new_file_of_every_kind_is_a_good_one() {
    let folder = Folder::new();
    folder.write("surface.obj", PLANE);
    for kind in ["grooves", "pyramids", "rods", "weave", "mesh"] {
        let file = format!("{kind}.toml");
        let said = folder.run(["new", kind, &file]);
        assert_eq!(said.status, 0, "{}", said.stderr);
        assert!(said.stderr.contains(&file) && said.stdout.is_empty(), "{}", said.stderr);
        let said = folder.run(["check", &file]);
        assert_eq!(said.status, 0, "{}", said.stderr);
        assert!(said.stdout.starts_with(&format!("{file}: ok\n")), "{}", said.stdout);
        assert!(!said.stdout.contains("warning"), "{}", said.stdout);
    }
}

#[test]
fn a_new_height_field_asks_for_its_image() {
    let folder = Folder::new();
    assert_eq!(folder.run(["new", "height-field", "new.toml"]).status, 0);
    let said = folder.run(["check", "new.toml"]);
    assert_eq!(said.status, 2);
    assert!(said.stderr.contains("geometry.file: there is no file \"heights.png\""), "{}", said.stderr);
}

#[test]
fn check_warns_of_what_a_brdf_does_not_keep() {
    let folder = Folder::new();
    let lambert = "{ model = \"lambert\", albedo = 0.5 }";
    for (brdf, words) in [
        ("{ model = \"blinn-phong\", specular = 1.0, exponent = 5 }", &["largest directional albedo", "times the light"][..]),
        ("{ model = \"cook-torrance\", diffuse = 0.7, specular = 0.7, alpha = 0.3 }", &["diffuse + specular reach 1.4"]),
        ("{ model = \"measured\", name = \"gold-metallic-paint\" }", &["built-in fit gold-metallic-paint", "neural fit"]),
    ] {
        folder.write("m.toml", MATERIAL.replace(lambert, brdf));
        let said = folder.run(["check", "m.toml"]);
        assert_eq!(said.status, 0, "{}", said.stderr);
        for word in words {
            assert!(said.stdout.contains(word), "no {word:?} in:\n{}", said.stdout);
        }
    }
}

#[test]
fn new_replaces_a_file_only_by_force_even_its_own() {
    let folder = Folder::new();
    assert_eq!(folder.run(["new", "mesh", "new.toml"]).status, 0);
    folder.write("new.toml", folder.read("new.toml").replace("0.5", "0.9"));
    let edited = folder.read("new.toml");
    assert_eq!(folder.run(["new", "mesh", "new.toml"]).status, 2);
    assert_eq!(folder.read("new.toml"), edited);
    assert_eq!(folder.run(["new", "mesh", "new.toml", "--force"]).status, 0);
    assert_ne!(folder.read("new.toml"), edited);
}

#[test]
fn new_writes_to_standard_output_and_as_json() {
    let folder = Folder::new();
    let text = folder.run(["new", "mesh", "-"]).stdout;
    assert!(text.contains("[geometry]"), "{text}");
    let object: Value = serde_json::from_str(&folder.run(["new", "mesh", "-", "--json"]).stdout).unwrap();
    assert_eq!(object["text"], text);
    let object: Value = serde_json::from_str(&folder.run(["new", "mesh", "new.toml", "--json"]).stdout).unwrap();
    assert_eq!(object["file"], "new.toml");
    assert_eq!(folder.read("new.toml"), text);
}

#[test]
fn check_says_what_a_material_is_and_what_would_be_done() {
    let folder = Folder::new();
    let before = folder.snapshot();
    let said = folder.run(["check", "m.toml", "--tolerance", "0.01"]);
    assert_eq!((said.status, said.stderr.as_str()), (0, ""));
    for word in
        ["m.toml: ok", "plane", "1 x 1 mm", "2 triangles", "low", "high", "area 0.5 mm^2 (50.0 %)", "lambert, albedo 0.5", "1 %", "memory"]
    {
        assert!(said.stdout.contains(word), "no {word:?} in:\n{}", said.stdout);
    }
    assert!(folder.snapshot() == before, "check wrote something");
}

#[test]
fn check_warns_of_a_surface_that_covers_nothing() {
    let folder = Folder::new();
    let all = MATERIAL.replace("part = \"*\"", "part = \"low\"") + &MATERIAL[MATERIAL.find("[[surface]]").unwrap()..].replace('*', "high");
    folder.write("m.toml", all + &MATERIAL[MATERIAL.find("[[surface]]").unwrap()..]);
    let said = folder.run(["check", "m.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stdout.contains("warning   the surface of part \"*\" (line 15) covers nothing"), "{}", said.stdout);
}

#[test]
fn check_with_json_tells_good_files_from_bad_ones() {
    let folder = Folder::new();
    folder.write("bad.toml", "format = 3\n");
    let said = folder.run(["check", "--json", "m.toml", "bad.toml"]);
    assert_eq!(said.status, 2);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(object["ok"], false);
    let [good, bad] = &object["files"].as_array().unwrap()[..] else { panic!("{object}") };
    assert!(good["ok"] == true && good["report"]["triangles"] == 2 && good["report"]["period"][0] == 1.0, "{good}");
    assert!(bad["ok"] == false && bad["error"]["field"] == "format" && bad["error"]["line"] == 1, "{bad}");
}
