//! Is an asked tolerance kept, and is the reported error true? The table of `docs/accuracy.md`.
//!
//! Surfaces of every kind under diffuse, glossy and narrow BRDFs, each asked for four tolerances with sixteen seeds by `--method auto`. The truth is the
//! reference method, whose own relative RMS standard error is at most a fifth of the smallest tolerance; it is taken out in squares. Truths
//! are kept in `target/accuracy`, since they take most of the time.
//!
//! usage: `cargo bench --bench accuracy -- [--seeds N] [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::direction::Pair;
use biscale::filter::{Effective, Method, Quality};
use biscale::material::{Material, SmallScale};
use std::fmt::Write;
use std::path::Path;

const TOLERANCES: [f64; 4] = [0.1, 0.03, 0.01, 0.003];
/// Standard error of the truth, a fifth of the smallest tolerance.
const TRUTH: f64 = 0.003 / 5.0;
const SEEDS: u64 = 16;
const PAIRS: usize = 48;
const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];
const SAMPLES: [&str; 6] = ["grooves-two-hue", "pyramids-pentagon", "hammered", "shot-silk", "velvet-rods", "studs"];

/// Values of the pairs by the reference method, three channels each, and the sum of their squared standard errors.
fn truth(case: &str, small: &SmallScale, pairs: &[Pair]) -> (Vec<[f64; 3]>, f64) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/accuracy");
    let path = folder.join(format!("{case}.csv"));
    if !path.exists() {
        // It stops where 1.5 times its estimate is within the tolerance.
        let quality = Quality { method: Method::Reference, tolerance: 1.5 * TRUTH, seed: 1_000, ..Quality::default() };
        let got = common::run(small, pairs, &quality);
        assert!(got.summary.relative_rms <= TRUTH, "{case}: the reference reaches {}", got.summary.relative_rms);
        let mut text = String::new();
        for v in &got.values {
            let [r, g, b] = v.fbar;
            let [x, y, z] = v.se;
            writeln!(text, "{r},{g},{b},{x},{y},{z}").unwrap();
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
    let pairs = common::projected_pairs(PAIRS);
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
        let (truth, own) = truth(case, small, &pairs);
        for tolerance in TOLERANCES {
            let (mut kept, mut largest, mut single) = (0, 0.0_f64, 0);
            let (mut squares, mut reported, mut cpu) = (0.0, 0.0, 0.0);
            for seed in 0..seeds {
                let (got, cost) = common::measure(|| common::run(small, &pairs, &Quality { tolerance, seed, ..Quality::default() }));
                let square = error(&got, &truth, own);
                let told = got.summary.relative_rms;
                squares += square / seeds as f64;
                reported += told * told / seeds as f64;
                cpu += 1e3 * cost.cpu / seeds as f64;
                kept += usize::from(square.sqrt() <= tolerance);
                largest = largest.max(square.sqrt() / tolerance);
                // Below the truth's own error nothing can be said.
                let known = square.sqrt().max(TRUTH);
                single += usize::from((1.0 / 2.5..=2.5).contains(&(told.max(TRUTH) / known)));
            }
            let ratio = reported.sqrt().max(TRUTH) / squares.sqrt().max(TRUTH);
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
