//! `scripts/setup.sh` on machines that lack something, played with made-up tools.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![cfg(unix)]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Output};
use support::project;

/// Tools of the machine that the script may use in every case.
const PLAIN: [&str; 9] = ["sh", "dirname", "sed", "id", "mktemp", "rm", "cut", "env", "cat"];

/// Runs the script where only [`PLAIN`] and these made-up tools are there.
fn setup(made_up: &[(&str, &str)]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = std::env::var_os("PATH").unwrap();
    for tool in PLAIN {
        let real = std::env::split_paths(&path).map(|p| p.join(tool)).find(|p| p.exists()).unwrap();
        std::os::unix::fs::symlink(real, folder.path().join(tool)).unwrap();
    }
    for (tool, script) in made_up {
        let file = folder.path().join(tool);
        std::fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let Output { status, stderr, .. } = Command::new(project("scripts/setup.sh")).env("PATH", folder.path()).output().unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

#[test]
fn a_missing_compiler_is_installed_and_said() {
    let (status, said) = setup(&[("apt-get", "echo apt-get $* >&2"), ("sudo", "exec \"$@\"")]);
    assert_eq!(status, Some(1), "the made-up apt-get installs nothing: {said}");
    for word in [
        "no working C and C++ compiler",
        "installing with apt-get: gcc g++",
        "apt-get update",
        "apt-get install",
        "-y",
        "still cannot link",
    ] {
        assert!(said.contains(word), "no {word:?} in:\n{said}");
    }
}

#[test]
fn without_apt_get_the_packages_are_named() {
    let (status, said) = setup(&[]);
    assert_eq!(status, Some(1));
    assert!(said.contains("please install: gcc"), "{said}");
}

#[test]
fn a_missing_or_old_toolchain_is_reported_with_the_way_to_get_one() {
    let (compiler, other) = (("cc", "exit 0"), ("c++", "exit 0"));
    for (tools, word) in [
        (vec![compiler, other], "there is no cargo"),
        (vec![compiler, other, ("cargo", "echo cargo 1.85.0")], "cargo is 1.85.0 and 1.95 is needed"),
        (vec![compiler, other, ("cargo", "echo cargo 0.99.0")], "cargo is 0.99.0 and 1.95 is needed"),
        (vec![compiler, other, ("cargo", "echo error >&2; exit 1")], "cargo does not run"),
        (vec![compiler, other, ("cargo", "echo cargo 2.0.0"), ("rustc", "echo rustc 1.94.1")], "rustc is 1.94.1 and 1.95 is needed"),
    ] {
        let (status, said) = setup(&tools);
        assert_eq!(status, Some(1), "{said}");
        assert!(said.contains(word) && said.contains("https://rustup.rs"), "no {word:?} in:\n{said}");
    }
}

#[test]
fn a_machine_that_has_everything_is_left_alone() {
    let (status, said) = setup(&[
        ("cc", "exit 0"),
        ("c++", "exit 0"),
        ("cargo", "case $1 in --version) echo cargo 1.95.0;; fetch) exit 0;; esac"),
        ("rustc", "case $1 in --version) echo rustc 1.100.0-nightly;; *) echo host: some-host;; esac"),
    ]);
    assert_eq!((status, said.as_str()), (Some(0), ""));
}
