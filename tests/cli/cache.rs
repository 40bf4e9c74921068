//! `biscale cache`, and what `--method lowrank` keeps there.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::{Folder, Said};

fn run(folder: &Folder, arguments: &[&str]) -> Said {
    folder.run(arguments)
}

fn done(said: &Said) {
    assert_eq!(said.status, 0, "{}", said.stderr);
}

const EVAL: [&str; 6] = ["eval", "m.toml", "--pairs", "p.csv", "--plan", "lowrank:paper:facets=500:directions=8:rates=8x12"];

#[test]
fn what_the_low_rank_method_computes_is_kept_listed_used_and_cleared() {
    let folder = Folder::new();
    let empty = run(&folder, &["cache", "list"]);
    done(&empty);
    assert!(empty.stdout.starts_with("0 files"), "{}", empty.stdout);
    let first = run(&folder, &EVAL);
    done(&first);
    let listed = run(&folder, &["cache", "list"]);
    assert!(listed.stdout.contains("Lambert") && listed.stdout.contains("\n1 files"), "{}", listed.stdout);
    let json: Value = serde_json::from_str(&run(&folder, &["cache", "list", "--json"]).stdout).unwrap();
    let entry = &json["entries"][0];
    assert!(entry["bytes"].as_u64().unwrap() > 100 && entry["label"].as_str().unwrap().contains("Lambert"), "{json}");
    let again = run(&folder, &EVAL);
    assert_eq!(first.stdout, again.stdout);
    // Damaged: told, computed again, replaced.
    std::fs::write(entry["path"].as_str().unwrap(), "damaged").unwrap();
    assert!(run(&folder, &["cache", "list"]).stdout.contains("damaged"));
    let mended = run(&folder, &EVAL);
    assert!(mended.stderr.contains("computed again") && mended.stdout == first.stdout, "{}", mended.stderr);
    let cleared: Value = serde_json::from_str(&run(&folder, &["cache", "clear", "--json"]).stdout).unwrap();
    assert_eq!(cleared["files"], 1);
    assert!(run(&folder, &["cache", "list"]).stdout.starts_with("0 files"));
    let uncached = run(&folder, &[&EVAL[..], &["--no-cache"]].concat());
    assert_eq!(uncached.stdout, first.stdout);
    assert!(!folder.path("cache").exists(), "--no-cache kept something");
}

#[test]
fn a_cache_that_cannot_be_written_is_told_and_the_result_is_there() {
    let folder = Folder::new();
    folder.write("cache", "a file in its place");
    let said = run(&folder, &EVAL);
    done(&said);
    assert!(said.stderr.contains("is not kept") && said.stdout.lines().count() == 3, "{}", said.stderr);
    assert_eq!(run(&folder, &["cache", "list"]).status, 1);
}

#[test]
fn the_summary_says_what_the_matrices_were() {
    let folder = Folder::new();
    let said = run(&folder, &[&EVAL[..], &["--json"]].concat());
    done(&said);
    let json: Value = serde_json::from_str(&said.stdout).unwrap();
    let facts = &json["summary"]["low_rank"][0];
    assert!(facts["n_rank"].as_u64().unwrap() <= 1 && facts["m_energy"].as_f64().unwrap() >= 0.98, "{json}");
    assert_eq!(json["summary"]["method"], "lowrank");
    let improved = run(&folder, &["eval", "m.toml", "--pairs", "p.csv", "--method", "lowrank", "--variant", "improved", "--json"]);
    let json: Value = serde_json::from_str(&improved.stdout).unwrap();
    assert_eq!(json["summary"]["method"], "lowrank improved");
    assert!(json["summary"]["relative_rms_error"].as_f64().unwrap() <= 0.005, "{json}");
}

#[test]
fn budgets_bounces_and_plans_that_are_none_are_refused_with_a_remedy() {
    let folder = Folder::new();
    let lowrank = ["eval", "m.toml", "--pairs", "p.csv", "--method", "lowrank"];
    for (more, status, remedy) in [
        (&["--budget", "1s"][..], 1, "--method direct"),
        (&["--bounces", "2"][..], 2, "--method reference"),
        (&["--plan", "lowrank:paper:facets=7"][..], 2, "lowrank:paper:facets=4096"),
        (&["--plan", "direct:2048x1"][..], 2, "lowrank:paper"),
    ] {
        let said = run(&folder, &[&lowrank[..], more].concat());
        assert_eq!((said.status, said.stdout.as_str()), (status, ""), "{more:?}: {}", said.stderr);
        assert!(said.stderr.contains(remedy), "{more:?}: {}", said.stderr);
    }
    assert_eq!(run(&folder, &["cache"]).status, 2);
}
