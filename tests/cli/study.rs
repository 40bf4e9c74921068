//! `biscale study` through the binary: short studies, gone on with, refused, stopped.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use std::collections::BTreeMap;
use support::{Folder, Said, project};

/// A short study of the grooves sample, with its own questions.
fn grooves(folder: &Folder, more: &[&str]) -> Said {
    let mut command = folder.command(["study", "-o", "out", "--quick", "--json"]);
    Said::from(command.args(more).arg(project("samples/grooves-two-hue.toml")).output().unwrap())
}

/// A very short study of the plane: its list of pairs, and few methods.
const PLANE: [&str; 9] = ["study", "m.toml", "-o", "out", "--quick", "--no-pictures", "--pairs", "p.csv", "--methods"];

fn object(said: &Said) -> Value {
    assert_eq!(said.status, 0, "{}", said.stderr);
    serde_json::from_str(&said.stdout).unwrap()
}

/// The rows of `study.csv`, each by column.
fn rows(folder: &Folder) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.path("out/study.csv")).unwrap();
    reader.deserialize().map(|row| row.unwrap()).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

#[test]
fn a_short_study_measures_every_method_and_writes_plots_and_a_report() {
    let folder = Folder::new();
    let summary = object(&grooves(&folder, &["--no-pictures"]));
    let rows = rows(&folder);
    let find = |question: &str, setting: &str| {
        let found = rows.iter().find(|r| r["question"] == question && r["setting"] == setting);
        found.unwrap_or_else(|| panic!("no {question} {setting}"))
    };
    for question in ["list", "table"] {
        assert!(number(find(question, "truth"), "estimated_error") < 0.005);
        for row in rows.iter().filter(|r| r["question"] == question && r["status"] == "done" && r["setting"] != "truth") {
            assert!(number(row, "error_at_most") >= number(row, "error") && number(row, "wall_s") > 0.0, "{row:?}");
            if cfg!(target_os = "linux") {
                assert!(number(row, "cpu_s") > 0.0 && number(row, "peak_mib") > number(row, "added_mib"), "{row:?}");
            }
        }
        let error = |setting| number(find(question, setting), "error");
        assert!(error("direct:256x1") > 2.0 * error("direct:4096x1"), "more facets, less error");
        assert!(number(find(question, "direct:tolerance=0.01"), "error_at_most") < 0.01);
    }
    let [chance, sobol] = ["random", "low-discrepancy"].map(|p| number(find("list", &format!("points:{p}:f64:2048")), "error"));
    assert!(chance > 3.0 * sobol, "{chance} at random, {sobol} by low discrepancy");
    let paper = find("table", "lowrank:paper:facets=512:directions=13:rates=24x32:energy=0.995,0.98");
    let facts: Value = serde_json::from_str(&paper["low_rank"]).unwrap();
    assert!(facts.as_array().unwrap().len() == 2 && facts[0]["m_rank"].as_u64().unwrap() > 0, "{paper:?}");
    assert!(number(paper, "error") < 0.5, "{paper:?}");
    assert!(rows.iter().any(|r| r["setting"].starts_with("lowrank:paper") && !r["precomputed_s"].is_empty()), "M was never computed");
    assert!(!folder.path("out/.lowrank-cache").exists(), "compressed BRDFs are left behind");
    let bounces = find("list", "reference:tolerance=0.01:bounces=4");
    assert!(number(bounces, "bias") > 0.05, "grooves of this albedo reflect light more than once: {bounces:?}");
    let report = folder.read("out/report.html");
    for words in [
        "<h1>two-hue grooves",
        "<h2>Frontier of the list",
        "<h2>Frontier of the table",
        "<h2>What each setting buys",
        "<h2>Tolerances",
        "<h2>Placement and precision",
        "<h2>Interreflections",
        "<h2>Ranks and the energy kept",
        "<h2>PSNR",
        "Table 4",
    ] {
        assert!(report.contains(words), "the report lacks {words:?}");
    }
    assert!(!report.contains("NaN") && !report.contains("inf"), "{report}");
    assert_eq!(report.matches("<svg").count(), 2, "the plots of errors and of placements stand in the page");
    assert!(!report.contains("src=\"pictures") && !report.contains("href=\"p"), "the page needs another file");
    for name in ["pareto", "placement"] {
        let svg = folder.read(&format!("out/{name}.svg"));
        roxmltree::Document::parse(&svg).unwrap();
        assert!(svg.contains("made by biscale study") && svg.contains("two-hue grooves") && !svg.contains("NaN"), "{name}");
        assert!(std::fs::read(folder.path(&format!("out/{name}.png"))).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
    for file in summary["files"].as_array().unwrap() {
        assert!(folder.path(file.as_str().unwrap()).is_file(), "{file} is named and not there");
    }
    let frontier = summary["frontier"].as_array().unwrap();
    assert!(frontier.len() > 3 && frontier.iter().all(|f| f["error"].as_f64().unwrap() < 0.1), "{frontier:?}");
}

#[test]
fn pictures_are_rendered_compared_and_not_made_twice() {
    let folder = Folder::new();
    let study = || object(&grooves(&folder, &["--methods", "direct,lowrank", "--pairs", "p.csv"]));
    study();
    let report = folder.read("out/report.html");
    for scene in ["sphere", "ring"] {
        for name in ["direct-rough", "lowrank-paper", "lowrank-improved"] {
            let panels = format!("pictures/{scene}-direct-fine-and-{name}.png");
            let png = std::fs::read(folder.path(&format!("out/{panels}"))).unwrap();
            assert!(png.starts_with(b"\x89PNG") && report.contains(&biscale::formats::svg::png_url(&png)), "{panels} is not in the report");
        }
        assert_eq!(folder.run(["check", &format!("out/pictures/{scene}.toml")]).status, 0);
    }
    assert!(!report.contains("interreflections against"), "the method reference was not asked for");
    let made = |name: &str| std::fs::metadata(folder.path(name)).unwrap().modified().unwrap();
    let before = made("out/pictures/ring-direct-fine.exr");
    study();
    assert_eq!(made("out/pictures/ring-direct-fine.exr"), before, "a picture was made again");
    assert_eq!(folder.read("out/report.html"), report);
}

#[test]
fn a_study_goes_on_where_it_stopped() {
    let folder = Folder::new();
    let study = |more: &[&str]| object(&folder.run(PLANE.iter().copied().chain(["direct,auto", "--json"]).chain(more.iter().copied())));
    let made = study(&[])["runs_made"].as_u64().unwrap();
    assert!(made > 5, "{made}");
    let whole = folder.read("out/study.csv");
    assert_eq!(study(&[])["runs_made"], 0);
    assert_eq!(folder.read("out/study.csv"), whole, "a study that is done was done again");
    // As an interrupt may leave it: without its last two lines, the latter in half.
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    let cut = lines[..lines.len() - 2].concat() + &lines[lines.len() - 1][..9];
    folder.write("out/study.csv", cut);
    std::fs::remove_file(folder.path("out/report.html")).unwrap();
    assert_eq!(study(&[])["runs_made"], 2);
    assert_eq!(rows(&folder).len(), lines.len() - 1);
    assert!(folder.path("out/report.html").is_file());
    let seeds = study(&["--seeds", "2"])["runs_made"].as_u64().unwrap();
    assert_eq!(seeds, made - 1, "another seed for every setting, and the same truth");
}

#[test]
fn another_study_is_refused_and_leaves_all_as_it_was() {
    let folder = Folder::new();
    let study = |more: &[&str]| folder.run(PLANE.iter().copied().chain(["auto"]).chain(more.iter().copied()));
    assert_eq!(study(&[]).status, 0);
    let before = folder.snapshot();
    let said = study(&["--seed", "4"]);
    assert_eq!(said.status, 2);
    assert!(said.stderr.contains("another seed") && said.stderr.contains("--force"), "{}", said.stderr);
    folder.write("m.toml", folder.read("m.toml").replace("albedo = 0.5", "albedo = 0.6"));
    let said = study(&[]);
    assert!(said.status == 2 && said.stderr.contains("another material"), "{}", said.stderr);
    folder.write("m.toml", folder.read("m.toml").replace("albedo = 0.6", "albedo = 0.5"));
    assert!(folder.snapshot() == before, "something was written");
    assert_eq!(study(&["--seed", "4", "--force"]).status, 0);
    assert!(rows(&folder).iter().all(|r| r["seed"] == "4"), "runs of the old study stay");
}

#[test]
fn a_run_that_takes_too_long_is_stopped_and_said_to_be() {
    let folder = Folder::new();
    let mut command = folder.command(["study", "-o", "out", "--quick", "--json", "--no-pictures", "--methods", "reference"]);
    // A sharp lobe on a weave: tenths of a second even for a rough answer.
    command.args(["--truth-tolerance", "0.5", "--time-limit", "5ms"]).arg(project("tests/data/truth/weave.ggx_0.05.toml"));
    let summary = object(&Said::from(command.output().unwrap()));
    assert!(summary["settings"].as_u64().unwrap() > 1 && summary["settings"] == summary["settings_not_done"], "{summary}");
    assert!(rows(&folder).iter().filter(|r| r["setting"] != "truth").all(|r| r["status"] == "timed-out"));
    assert!(folder.read("out/report.html").contains("<h2>Not done</h2>"));
}

#[test]
fn wrong_arguments_are_refused_before_anything_is_written() {
    let folder = Folder::new();
    folder.write("none.csv", "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n");
    std::fs::create_dir(folder.path("theirs")).unwrap();
    folder.write("theirs/report.html", "mine");
    let before = folder.snapshot();
    for (arguments, words) in [
        (&["study", "missing.toml", "-o", "out"][..], "missing.toml"),
        (&["study", "m.toml", "-o", "p.csv"], "no folder"),
        (&["study", "m.toml", "-o", "theirs"], "report.html of other origin"),
        (&["study", "m.toml", "-o", "out", "--pairs", "none.csv"], "there are no pairs"),
        (&["study", "m.toml", "-o", "out", "--methods", "fast"], "fast"),
        (&["study", "m.toml", "-o", "out", "--seeds", "0"], "--seeds"),
        (&["study", "m.toml", "-o", "out", "--time-limit", "3"], "unit"),
        (&["study-run", "m.toml", "--pairs", "p.csv", "--seed", "1", "--setting", "direct"], "no setting"),
    ] {
        let said = folder.run(arguments);
        assert_eq!(said.status, 2, "{arguments:?}: {}", said.stderr);
        assert!(said.stderr.contains(words), "{arguments:?}: {}", said.stderr);
    }
    assert!(folder.snapshot() == before, "something was written");
}

/// Signals are sent with `kill`, so this is for Linux.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_study_keeps_its_runs_and_goes_on() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let folder = Folder::new();
    let mut command = folder.command(["study", "-o", "out", "--quick", "--no-pictures"]);
    let mut child = command.arg(project("samples/grooves-two-hue.toml")).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while std::fs::read_to_string(folder.path("out/study.csv")).unwrap_or_default().lines().count() < 8 {
        assert!(begun.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none(), "no runs, or too fast to be stopped");
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let kept = rows(&folder).len();
    assert!(kept >= 7 && !folder.path("out/report.html").exists(), "{kept} runs");
    let made = object(&grooves(&folder, &["--no-pictures"]))["runs_made"].as_u64().unwrap();
    assert_eq!(rows(&folder).len() as u64, kept as u64 + made);
}
