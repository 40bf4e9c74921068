//! The examples run: `cargo test` builds them beside the tests.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

use std::process::Command;

#[test]
fn every_example_runs() {
    // target/debug/deps/examples-HASH: the examples are in target/debug/examples.
    let folder = std::env::current_exe().unwrap().ancestors().nth(2).unwrap().join("examples");
    let out = tempfile::tempdir().unwrap();
    for (name, file) in [("evaluate", None), ("bake", Some("table.exr")), ("render", Some("picture.exr")), ("custom_brdf_study", None)] {
        let program = folder.join(name);
        assert!(program.exists(), "{} is not there: `cargo build --examples` makes it", program.display());
        let made = Command::new(&program).args(file.map(|f| out.path().join(f))).output().unwrap();
        assert!(made.status.success(), "{name}: {}", String::from_utf8_lossy(&made.stderr));
        assert!(file.is_none_or(|f| out.path().join(f).exists()), "{name} wrote nothing");
    }
}
