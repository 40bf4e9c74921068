//! 1,725,153 pairs, nothing precomputed: as many as the matrix of Wu et al. 2011 has rows.
//!
//! The paper precomputes a matrix of small-scale BRDF values over 1,725,153 pairs of directions (93,409 s and 460 MB for Cook-Torrance of
//! roughness .2), so that an edit costs little. Here the effective values of all unordered pairs of 1857 directions of the hemisphere are
//! computed from nothing but the surface: what any edit costs.
//!
//! usage: `cargo bench --bench paper_matrix -- [--directions N] [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::brdf::Distribution;
use biscale::direction::Pair;
use biscale::filter::Quality;

/// 1857 * 1858 / 2 = 1,725,153.
const DIRECTIONS: usize = 1857;
/// The directions are the centres of 1857 cells of equal solid angle of the hemisphere.
const THETA_DEG: f64 = 90.0;
/// Roughness of the paper's example.
const ALPHA: f64 = 0.2;
/// Cases that are recipes at their default values; the others are tiles of the truth tests.
const RECIPES: [&str; 2] = ["grooves", "pyramids"];

fn main() {
    let mut arguments = common::arguments();
    let count = arguments.iter().position(|a| a == "--directions").map(|at| arguments.drain(at..at + 2).nth(1));
    let count = count.flatten().map_or(DIRECTIONS, |n| n.parse().expect("a number after --directions"));
    let directions = common::spread_directions(count, THETA_DEG);
    let brdf = common::lobe(ALPHA, Distribution::Beckmann);
    println!("| case | pairs | facets | clusters | estimated error | CPU s | wall s | peak MiB | stages, ms |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for case in ["weave", "bumpy", "grooves", "pyramids", "rods"] {
        if !arguments.is_empty() && !arguments.iter().any(|a| a == case) {
            continue;
        }
        let small =
            if RECIPES.contains(&case) { common::cover(common::recipe(case), brdf.clone()) } else { common::covered(case, brdf.clone()) };
        common::reset_peak();
        let pairs = || (0..count).flat_map(|o| (o..count).map(move |i| (i, o)));
        let pairs: Vec<Pair> = pairs().map(|(i, o)| Pair { wi: directions[i], wo: directions[o] }).collect();
        let (effective, cost) = common::measure(|| common::run(&small, &pairs, &Quality::default()));
        println!(
            "| {case} | {} | {} | {} | {:.2} % | {:.2} | {:.2} | {:.0} | {} |",
            pairs.len(),
            effective.summary.facets,
            effective.summary.clusters,
            100.0 * effective.summary.relative_rms,
            cost.cpu,
            cost.wall,
            common::peak_mib().unwrap_or(f64::NAN),
            common::stages(&effective)
        );
    }
}
