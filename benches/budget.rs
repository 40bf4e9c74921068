//! Wall seconds that a run takes against those that it was given.
//!
//! Lists of three lengths on the tiles of the truth tests, each at budgets from a hundredth of a second to some seconds, with a tolerance
//! that none of them meets. What counts is the largest share of its budget that a run took.
//!
//! usage: `cargo bench --bench budget -- [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::brdf::Brdf;
use biscale::direction::Pair;
use biscale::filter::Quality;

/// Lists of all pairs of so many directions.
const LISTS: [(&str, usize); 3] = [("81 pairs", 9), ("17,424 pairs", 132), ("160,000 pairs", 400)];
const BUDGETS: [f64; 5] = [0.01, 0.03, 0.1, 0.5, 3.0];

fn main() {
    let arguments = common::arguments();
    println!("| case | list | budget, s | wall s | share of the budget | samples | estimated error |");
    println!("|---|---|---|---|---|---|---|");
    let mut worst = 0.0_f64;
    for tile in ["vgroove", "weave", "bumpy", "rods"] {
        for (name, brdf) in [("diffuse", common::diffuse()), ("ggx-0.05", common::ggx(0.05))] {
            let case = format!("{tile}-{name}");
            if !arguments.is_empty() && !arguments.contains(&case) {
                continue;
            }
            worst = worst.max(run(&case, tile, &brdf));
        }
    }
    println!("\nlargest share: {:.2}", worst);
}

/// Runs all lists and budgets, and gives the largest share.
fn run(case: &str, tile: &str, brdf: &Brdf) -> f64 {
    let small = common::covered(tile, brdf.clone());
    let mut worst = 0.0_f64;
    for (list, directions) in LISTS {
        let pairs: Vec<Pair> = common::all_pairs(&common::spread_directions(directions, 85.0));
        for budget in BUDGETS {
            let quality = Quality { tolerance: 1e-6, budget: Some(budget), ..Quality::default() };
            let (effective, cost) = common::measure(|| common::run(&small, &pairs, &quality));
            let share = cost.wall / budget;
            worst = worst.max(share);
            println!(
                "| {case} | {list} | {budget} | {:.3} | {share:.2} | {} | {:.2} % |",
                cost.wall,
                effective.summary.facets,
                100.0 * effective.summary.relative_rms
            );
        }
    }
    worst
}
