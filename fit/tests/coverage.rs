//! Photographs with faults, both drawn at random and fitted: how often numbers that are reported without a flag lie within one and two standard
//! deviations of the truth, and whether a failure names its cause. `scripts/coverage.py` makes tables and plots of what this writes.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Options, Outcome};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use support::drawn::{Drawn, drawn};
use support::material;
use support::question::run;
use support::rows::{Looked, compare_with_truth, truths};
use support::scene::photographed;

/// Starts of each search: its own and one of each number of sides. Photographs with faults have the minima of those without, which eight starts
/// find as well.
const STARTS: usize = 3;
/// Standard deviations from which on a number that a fit reports without a flag is a confident error.
const CONFIDENT: f64 = 4.0;

/// A number or a text of the environment.
fn asked<T: std::str::FromStr>(name: &str, otherwise: T) -> T {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

fn fitted(drawn: &Drawn) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let tables = drawn.tables(photographed(&drawn.scene, folder.path()));
    let outcome = run(folder.path(), &tables, &drawn.scene.start, drawn.scene.moves, &Options { starts: STARTS, ..Options::default() });
    if std::env::var("SHOW").is_ok() {
        let spec = Spec::load(&folder.path().join("fit.toml")).unwrap();
        compare_with_truth(&Looked::new(&spec, &material(&drawn.scene.truth)), &outcome, &drawn.scene.truth, &drawn.scene.faults);
    }
    outcome
}

/// A field of a table.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "'"))
}

/// The numbers of fit `k` as rows of a table, and how far the worst is off that has no flag, in standard deviations.
fn numbers(k: u64, drawn: &Drawn, outcome: &Outcome) -> (String, f64) {
    let known = &outcome.identified.known;
    let (mut rows, mut worst) = (String::new(), 0.0_f64);
    for (known, truth) in known.iter().zip(truths(known.iter().map(|k| &k.name[..]), &drawn.scene.truth)) {
        let Some(truth) = truth else { continue };
        let flagged = known.not_identified || (known.scale_assumed && drawn.scales_all);
        let _ = writeln!(rows, "{k},{},{},{},{truth},{}", quoted(&known.name), known.value, known.sigma, u8::from(flagged));
        if !flagged {
            let off = ((known.value - truth) / known.sigma).abs();
            worst = if off.is_nan() || known.sigma <= 0.0 { f64::INFINITY } else { worst.max(off) };
        }
    }
    // Numbers of another structure are wrong, whatever they are called.
    let is_another = drawn.fault == "structure" && !drawn.size.is_empty();
    (rows, if is_another { f64::INFINITY } else { worst })
}

/// Numbers of the fits that a table has already.
fn there(file: &Path) -> Vec<u64> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    text.lines().skip(1).filter_map(|line| line.split(',').next()?.parse().ok()).collect()
}

fn append(file: &Path, head: &str, rows: &str) {
    let text = if file.exists() { rows.to_owned() } else { format!("{head}\n{rows}") };
    std::fs::OpenOptions::new().create(true).append(true).open(file).unwrap().write_all(text.as_bytes()).unwrap();
}

/// `COUNT` fits from `FROM` on, of seed `SEED`, into `numbers.csv` and `fits.csv` of `OUT/seed-SEED`; those that are there are not made again,
/// and not judged again: `scripts/coverage.py` counts all.
/// With `FAULT`, all have a fault of that kind; with `SHOW`, what is found, and what pulls it from the truth, is printed as well.
#[test]
#[ignore = "takes hours"]
fn no_fit_of_drawn_faults_is_confidently_wrong() {
    let (from, count, seed): (u64, u64, u64) = (asked("FROM", 0), asked("COUNT", 300), asked("SEED", 1));
    let other = std::env::var("FAULT").ok();
    let out = asked("OUT", PathBuf::from("coverage")).join(format!("seed-{seed}"));
    std::fs::create_dir_all(&out).unwrap();
    let file = out.join("fits.csv");
    let mut confident = Vec::new();
    for k in (from..from + count).filter(|k| !there(&file).contains(k)) {
        let drawn = drawn(k, seed, other.as_deref());
        let outcome = fitted(&drawn);
        let passed = outcome.failures.is_empty();
        let (rows, worst) = numbers(k, &drawn, &outcome);
        let causes: Vec<&str> = outcome.causes.iter().map(|c| &c.remedy[..]).collect();
        let named = |cause: &str| drawn.cause.iter().any(|word| cause.contains(word));
        let place = causes.iter().position(|cause| named(cause)).map_or(-1, |at| i64::try_from(at).unwrap());
        let seconds: f64 = outcome.seconds.iter().map(|s| s.1).sum();
        let errors = [
            outcome.training,
            outcome.validations.first().map_or(f64::NAN, |v| v.0.relative_rms),
            outcome.near.as_ref().map_or(f64::NAN, |n| n.relative_rms),
        ];
        let row = format!(
            "{k},{},{},{},{},{worst:.2},{},{},{place},{},{},{seconds:.1}",
            drawn.surface,
            quoted(drawn.fault),
            quoted(&drawn.size),
            if passed { "pass" } else { "fail" },
            errors.map(|e| format!("{e:.4}")).join(","),
            u8::from(!drawn.cause.is_empty()),
            quoted(&outcome.failures.join("; ")),
            quoted(&causes.join("; ")),
        );
        println!("{row}");
        if std::env::var("SHOW").is_ok() {
            outcome.identified.known.iter().for_each(|k| println!("    {} {:.4} +/- {:.4}", k.name, k.value, k.sigma));
            outcome.notes.iter().for_each(|note| println!("    note: {note}"));
            println!("    {:?}", outcome.starts[0].registration);
        }
        let head = "fit,surface,fault,size,verdict,worst,training,validation,close_up,has_cause,cause_place,failures,causes,seconds";
        append(&file, head, &format!("{row}\n"));
        append(&out.join("numbers.csv"), "fit,name,value,sigma,truth,flagged", &rows);
        if passed && (worst.is_nan() || worst > CONFIDENT) {
            confident.push(row);
        }
    }
    assert!(confident.is_empty(), "passed, and over {CONFIDENT} standard deviations off: {confident:#?}");
}
