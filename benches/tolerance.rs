//! Accuracy against time: the default method at four tolerances, against effective BRDFs made by an independent path tracer.
//!
//! *True* is the relative RMS deviation of `fbar` from `tests/data/truth`, the truth's own standard error taken out; with the estimate it
//! is the root of the mean square over the seeds.
//!
//! usage: `cargo bench --bench tolerance -- [--seeds N] [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::direction::Pair;
use biscale::filter::Quality;
use glam::DVec3;

const CASES: [&str; 5] = ["weave.diffuse", "weave.ggx_0.30", "weave.ggx_0.05", "bumpy.ggx_0.30", "rods.diffuse"];
const TOLERANCES: [f64; 4] = [0.02, 0.01, 0.005, 0.002];
const SEEDS: u64 = 8;

fn main() {
    let mut arguments = common::arguments();
    let seeds = arguments.iter().position(|a| a == "--seeds").map(|at| arguments.drain(at..at + 2).nth(1));
    let seeds = seeds.flatten().map_or(SEEDS, |n| n.parse().expect("a number after --seeds"));
    println!("| case | tolerance | facets | estimated | true | CPU ms | wall ms |");
    println!("|---|---|---|---|---|---|---|");
    for case in CASES {
        if !arguments.is_empty() && !arguments.iter().any(|a| a == case) {
            continue;
        }
        let small = common::truth(case);
        let tile = case.split_once('.').expect("a tile and a BRDF").0;
        let direction = |v: &[f64]| DVec3::from_slice(v).normalize();
        let rows = common::truth_rows(&format!("{tile}.pairs.csv"));
        let pairs: Vec<Pair> = rows.iter().map(|r| Pair { wi: direction(&r[..3]), wo: direction(&r[3..]) }).collect();
        let expected = common::truth_rows(&format!("{case}.expected.csv"));
        for tolerance in TOLERANCES {
            let (mut cpu, mut wall, mut estimated, mut deviation, mut facets) = (0.0, 0.0, 0.0, 0.0, Vec::new());
            for seed in 0..seeds {
                let (got, cost) = common::measure(|| common::run(&small, &pairs, &Quality { tolerance, seed, ..Quality::default() }));
                cpu += 1e3 * cost.cpu / seeds as f64;
                wall += 1e3 * cost.wall / seeds as f64;
                estimated += got.summary.relative_rms.powi(2) / seeds as f64;
                facets.push(got.summary.facets);
                let (mut squares, mut energy) = (0.0, 0.0);
                for (value, row) in got.values.iter().zip(&expected) {
                    for c in 0..3 {
                        // Stratification makes the truth's own error too small on flat facets: see its README.
                        let own = row[3 + c].max(1e-4 * row[c] + 1e-8);
                        squares += (value.fbar[c] - row[c]).powi(2) - own * own;
                        energy += row[c] * row[c];
                    }
                }
                deviation += squares / energy / seeds as f64;
            }
            facets.sort_unstable();
            println!(
                "| {case} | {tolerance} | {} | {:.3} % | {:.3} % | {cpu:.1} | {wall:.1} |",
                facets[facets.len() / 2],
                100.0 * estimated.sqrt(),
                100.0 * deviation.max(0.0).sqrt()
            );
        }
    }
}
