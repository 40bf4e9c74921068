//! `biscale bake` through the binary: its exit statuses, what it replaces, and that `eval` reads what it wrote.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::cases::Wrong::{Arguments, File};
use support::cases::try_all;
use support::{Folder, Said};

/// A small table of the flat tile.
const SMALL: [&str; 7] = ["bake", "m.toml", "-o", "out.exr", "--resolution", "4", "--quiet"];

fn done(said: &Said) {
    assert_eq!(said.status, 0, "{}", said.stderr);
}

#[test]
fn wrong_bakes_are_refused_before_the_work() {
    try_all(&[
        ("no output", Arguments(&["bake", "m.toml"]), 2, &["--output"]),
        ("an unknown ending", Arguments(&["bake", "m.toml", "-o", "out.png"]), 2, &["out.png", "--output", ".exr"]),
        ("no ending", Arguments(&["bake", "m.toml", "-o", "out"]), 2, &["out", "no ending", ".exr"]),
        ("a format not built yet", Arguments(&["bake", "m.toml", "-o", "out.binary"]), 1, &["MERL", "not supported", ".exr"]),
        ("a folder that is missing", Arguments(&["bake", "m.toml", "-o", "no/out.exr"]), 2, &["no/out.exr", "no folder"]),
        ("a material that is not there", Arguments(&["bake", "no.toml", "-o", "out.exr"]), 2, &["no.toml", "no such file"]),
        ("no rings", Arguments(&["bake", "m.toml", "-o", "out.exr", "--resolution", "0"]), 2, &["--resolution", "0"]),
        ("a million rings", Arguments(&["bake", "m.toml", "-o", "out.exr", "--resolution", "1000000"]), 2, &["--resolution", "1000000"]),
        ("a table that is text", File("m.toml", b"a picture"), 2, &["m.toml:1", "not valid TOML"]),
        ("a table that is cut", File("m.toml", b"\x76\x2f\x31\x01\x02\0\0\0chan"), 2, &["m.toml", "OpenEXR"]),
    ]);
}

#[test]
fn eval_reads_a_table_between_its_nodes() {
    let folder = Folder::new();
    done(&folder.run(SMALL));
    let said = folder.run(["eval", "out.exr", "--pairs", "p.csv", "--json"]);
    done(&said);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(object["summary"]["method"], "table");
    for row in object["rows"].as_array().unwrap() {
        let (fhat, expected) = (row["fhat_r"].as_f64().unwrap(), 0.5 / std::f64::consts::PI);
        assert!((fhat / expected - 1.0).abs() < 0.1, "fhat {fhat} of a flat diffuse surface and not {expected}");
    }
}

#[test]
fn a_table_is_replaced_by_its_command_and_any_other_file_only_by_force() {
    let folder = Folder::new();
    done(&folder.run(SMALL));
    done(&folder.run(SMALL));
    folder.write("out.exr", "a picture of mine");
    let said = folder.run(SMALL);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert_eq!(folder.read("out.exr"), "a picture of mine");
    done(&folder.run(SMALL.iter().chain(&["--force"])));
    done(&folder.run(["eval", "out.exr", "--pairs", "p.csv"]));
}

#[test]
fn the_same_material_gives_the_same_values_at_any_thread_count() {
    let folder = Folder::new();
    let values = |threads: &str| {
        done(&folder.run(SMALL.iter().chain(&["--threads", threads])));
        folder.run(["eval", "out.exr", "--pairs", "p.csv"]).stdout
    };
    assert_eq!(values("1"), values("2"));
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_bake_says_what_it_keeps_and_goes_on_from_there() {
    use std::time::{Duration, Instant};
    let folder = Folder::new();
    let sample = support::project("samples/pyramids.toml");
    let bake: Vec<&std::ffi::OsStr> = ["bake".as_ref(), sample.as_os_str()]
        .into_iter()
        .chain(["-o", "out.exr", "--resolution", "24", "--tolerance", "0.05"].map(AsRef::as_ref))
        .collect();
    let kept = folder.path("out.exr.unfinished");
    let mut child = folder.command(&bake).stderr(std::process::Stdio::piped()).spawn().unwrap();
    // Until the first of three blocks is there.
    let begun = Instant::now();
    while std::fs::metadata(&kept).map_or(0, |m| m.len()) < 1000 {
        assert!(begun.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none(), "no block is kept");
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let said = Said::from(child.wait_with_output().unwrap());
    assert_eq!(said.status, 130, "{}", said.stderr);
    assert!(said.stderr.contains("out.exr.unfinished") && kept.exists() && !folder.path("out.exr").exists(), "{}", said.stderr);
    done(&folder.run(&bake));
    assert!(!kept.exists());
    let resumed = std::fs::read(folder.path("out.exr")).unwrap();
    done(&folder.run(&bake));
    assert!(std::fs::read(folder.path("out.exr")).unwrap() == resumed, "the bits differ");
}
