//! Ctrl-C: the command ends with status 130 and leaves nothing. Signals are sent with `kill`, so this is for Linux.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![cfg(target_os = "linux")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use support::{Folder, project};

/// The bit of SIGINT in the signal masks of `/proc`.
const SIGINT_BIT: u64 = 1 << 1;

fn send(signal: &str, child: &Child) {
    let status = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status().unwrap();
    assert!(status.success(), "kill -{signal}");
}

/// Whether the process listens to SIGINT yet.
fn listens(child: &Child) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    mask.is_some_and(|m| m & SIGINT_BIT != 0)
}

#[test]
fn a_long_computation_shows_progress_and_stops_at_ctrl_c() {
    for signal in ["INT", "TERM"] {
        let folder = Folder::new();
        let before = folder.snapshot();
        let data = |name: &str| project(&format!("tests/data/truth/{name}"));
        let mut child = folder
            .command(["eval", "-o", "out.csv", "--tolerance", "0.000001", "--pairs"])
            .arg(data("weave.pairs.csv"))
            .arg(data("weave.ggx_0.05.toml"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        // The first line comes when the work has lasted a second.
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert!(line.contains(" % after "), "no progress: {line:?}");
        send(signal, &child);
        let mut rest = String::new();
        stderr.read_to_string(&mut rest).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(130), "{rest}");
        assert!(rest.contains("interrupted") && !rest.contains("panicked"), "{rest}");
        assert!(folder.snapshot() == before, "something was left");
    }
}

#[test]
fn a_command_that_waits_for_input_ends_too() {
    let folder = Folder::new();
    let before = folder.snapshot();
    let mut child = folder
        .command(["eval", "m.toml", "--pairs", "-", "-o", "out.csv"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // `wait` would close it, which the command would take for the end of the pairs.
    let _open = child.stdin.take();
    while !listens(&child) {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    send("INT", &child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(folder.snapshot() == before, "something was left");
}

/// While the first starts still explore; nothing says how far the others are.
#[test]
fn a_fit_that_is_interrupted_writes_all_that_it_has() {
    let folder = Folder::new();
    let mut child = folder
        .command(["fit", "-o", "out", "--quiet"])
        .arg(project("samples/fit/fit.toml"))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The first picture is that of the first evaluation.
    while !folder.path("out/pictures.png").is_file() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    send("INT", &child);
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{said}");
    let fit: serde_json::Value = serde_json::from_str(&folder.read("out/fit.json")).unwrap();
    assert_eq!(fit["search"]["ended_early"], "interrupted", "{}", fit["search"]);
    for file in ["material.toml", "report.html", "pictures.png", "evaluations.csv"] {
        assert!(folder.path(&format!("out/{file}")).metadata().unwrap().len() > 0, "{file}");
    }
    assert_eq!(folder.run(["check", "out/material.toml"]).status, 0);
    let files = std::fs::read_dir(folder.path("out")).unwrap().count();
    assert_eq!(files, 5, "something half written was left");
}
