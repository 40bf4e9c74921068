//! Is an asked tolerance kept, and is the reported error true? The table of `docs/error-estimates.md`.
//!
//! Surfaces of every kind under diffuse, glossy and narrow BRDFs, each asked for four tolerances with sixteen seeds by `--method auto`. The truth is the
//! reference method, whose own relative RMS standard error is at most a fifth of the smallest tolerance; it is taken out in squares. Truths
//! are kept in `target/accuracy`, since they take most of the time.
//!
//! `--table` asks for all pairs of 60 directions in place of 48 pairs, and for three tolerances: of a list so long the samples are found on a part.
//!
//! usage: `cargo bench --bench accuracy -- [--seeds N] [--table] [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::direction::Pair;
use biscale::filter::{Effective, Method, Quality};
use biscale::material::{Material, SmallScale};
use std::fmt::Write;
use std::path::Path;

/// What is asked.
struct Question {
    pairs: Vec<Pair>,
    tolerances: &'static [f64],
    /// Standard error of the truth, a fifth of the smallest tolerance.
    truth: f64,
    /// What the files of its truths are called after.
    suffix: &'static str,
}

const SEEDS: u64 = 16;
/// Most runs of the reference for a truth.
const MOST_RUNS: usize = 4;
const PAIRS: usize = 48;
const DIRECTIONS: usize = 60;
const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];
const SAMPLES: [&str; 6] = ["grooves-two-hue", "pyramids-pentagon", "hammered", "shot-silk", "velvet-rods", "studs"];

/// Values of the pairs by the reference method, three channels each, and the sum of their squared standard errors.
fn truth(case: &str, small: &SmallScale, question: &Question) -> (Vec<[f64; 3]>, f64) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/accuracy");
    let path = folder.join(format!("{case}{}.csv", question.suffix));
    if !path.exists() {
        // Of narrow lobes one run's most rays may be too few: the mean of several then is the truth.
        let mut runs: Vec<Effective> = Vec::new();
        let own = |runs: &[Effective]| runs.iter().map(|r| r.summary.relative_rms.powi(2)).sum::<f64>().sqrt() / runs.len() as f64;
        while runs.is_empty() || own(&runs) > question.truth {
            assert!(runs.len() < MOST_RUNS, "{case}: the reference reaches {} in {MOST_RUNS} runs", own(&runs));
            // It stops where 1.5 times its estimate is within the tolerance.
            let seed = 1_000 + runs.len() as u64;
            let quality = Quality { method: Method::Reference, tolerance: 1.5 * question.truth, seed, ..Quality::default() };
            runs.push(common::run(small, &question.pairs, &quality));
        }
        let count = runs.len() as f64;
        let mut text = String::new();
        for k in 0..question.pairs.len() {
            let mean = |c: usize| runs.iter().map(|r| r.values[k].fbar[c]).sum::<f64>() / count;
            let se = |c: usize| runs.iter().map(|r| r.values[k].se[c].powi(2)).sum::<f64>().sqrt() / count;
            writeln!(text, "{},{},{},{},{},{}", mean(0), mean(1), mean(2), se(0), se(1), se(2)).unwrap();
        }
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(&path, text).unwrap();
    }
    let (mut values, mut squares) = (Vec::new(), 0.0);
    for line in std::fs::read_to_string(&path).unwrap().lines() {
        let row: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        values.push([row[0], row[1], row[2]]);
        squares += row[3..].iter().map(|x| x * x).sum::<f64>();
    }
    (values, squares)
}

/// Squared relative RMS error of a result, the truth's own taken out.
fn error(got: &Effective, truth: &[[f64; 3]], own: f64) -> f64 {
    let (mut squares, mut energy) = (-own, 0.0);
    for (value, truth) in got.values.iter().zip(truth) {
        for c in 0..3 {
            squares += (value.fbar[c] - truth[c]).powi(2);
            energy += truth[c].powi(2);
        }
    }
    squares.max(0.0) / energy
}

fn main() {
    let mut arguments = common::arguments();
    let seeds = arguments.iter().position(|a| a == "--seeds").map(|at| arguments.drain(at..at + 2).nth(1));
    let seeds = seeds.flatten().map_or(SEEDS, |n| n.parse().expect("a number after --seeds"));
    let table = arguments.iter().position(|a| a == "--table").map(|at| arguments.remove(at)).is_some();
    let mut cases: Vec<(String, SmallScale)> = Vec::new();
    for tile in TILES {
        for brdf in ["diffuse", "ggx_0.30", "ggx_0.05"] {
            cases.push((format!("{tile}.{brdf}"), common::truth(&format!("{tile}.{brdf}"))));
        }
    }
    for sample in SAMPLES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("samples/{sample}.toml"));
        cases.push((sample.to_owned(), Material::load(&path).unwrap().build().unwrap()));
    }
    let question = if table {
        let directions: Vec<_> = common::projected_pairs(DIRECTIONS).iter().map(|p| p.wo).collect();
        let pairs = common::all_pairs(&directions);
        Question { pairs, tolerances: &[0.1, 0.03, 0.01], truth: 0.002, suffix: "-table" }
    } else {
        let pairs = common::projected_pairs(PAIRS);
        Question { pairs, tolerances: &[0.1, 0.03, 0.01, 0.003], truth: 0.0006, suffix: "" }
    };
    println!(
        "| case | tolerance | within | worst, of the tolerance | RMS of the errors | reported | reported over true | single runs within 2.5 | CPU ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let (mut runs, mut within, mut worst, mut singles) = (0, 0, 0.0_f64, 0);
    let (mut combinations, mut near) = (0, 0);
    for (case, small) in &cases {
        if !arguments.is_empty() && !arguments.iter().any(|a| a == case) {
            continue;
        }
        let (truth, own) = truth(case, small, &question);
        for &tolerance in question.tolerances {
            let (mut kept, mut largest, mut single) = (0, 0.0_f64, 0);
            let (mut squares, mut reported, mut cpu) = (0.0, 0.0, 0.0);
            for seed in 0..seeds {
                let (got, cost) =
                    common::measure(|| common::run(small, &question.pairs, &Quality { tolerance, seed, ..Quality::default() }));
                let square = error(&got, &truth, own);
                let told = got.summary.relative_rms;
                squares += square / seeds as f64;
                reported += told * told / seeds as f64;
                cpu += 1e3 * cost.cpu / seeds as f64;
                kept += usize::from(square.sqrt() <= tolerance);
                largest = largest.max(square.sqrt() / tolerance);
                // Below the truth's own error nothing can be said.
                let known = square.sqrt().max(question.truth);
                single += usize::from((1.0 / 2.5..=2.5).contains(&(told.max(question.truth) / known)));
            }
            let ratio = reported.sqrt().max(question.truth) / squares.sqrt().max(question.truth);
            println!(
                "| {case} | {tolerance} | {kept}/{seeds} | {largest:.2} | {:.4} | {:.4} | {ratio:.2} | {single}/{seeds} | {cpu:.1} |",
                squares.sqrt(),
                reported.sqrt()
            );
            runs += seeds;
            within += kept;
            worst = worst.max(largest);
            singles += single;
            combinations += 1;
            near += usize::from((1.0 / 1.5..=1.5).contains(&ratio));
        }
    }
    println!(
        "\n{combinations} combinations, {runs} runs: within the tolerance {within} ({:.1} %), worst {worst:.2} of it;",
        share(within, runs)
    );
    println!("reported within 1.5 of the RMS over seeds in {near} combinations ({:.1} %),", share(near, combinations));
    println!("within 2.5 of a single run's in {singles} runs ({:.1} %)", share(singles, runs));
}

fn share(some: usize, all: impl TryInto<u32>) -> f64 {
    100.0 * some as f64 / f64::from(all.try_into().unwrap_or(u32::MAX))
}
