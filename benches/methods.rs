//! Which method is fastest for a tolerance: CPU seconds of `direct` and of `reference` over surfaces, BRDFs, lengths of the list and
//! tolerances, each against the other and against what `auto` takes. What the model of `--method auto` was made from, and is judged by.
//!
//! usage: `cargo bench --bench methods -- [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::direction::Pair;
use biscale::filter::{Method, Quality};

const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];
/// All pairs of so many directions, of which one is the light's and one the viewer's.
const LISTS: [usize; 4] = [1, 4, 12, 40];
const TOLERANCES: [f64; 3] = [0.03, 0.01, 0.003];
/// Longest wall time of a run that is waited for.
const LONGEST: f64 = 20.0;

fn main() {
    let arguments = common::arguments();
    println!("| case | pairs | tolerance | direct CPU ms | reference CPU ms | auto CPU ms | auto takes | auto over the best |");
    println!("|---|---|---|---|---|---|---|---|");
    let mut worst = 0.0_f64;
    for tile in TILES {
        for brdf in ["diffuse", "ggx_0.30", "ggx_0.05"] {
            let case = format!("{tile}.{brdf}");
            if !arguments.is_empty() && !arguments.contains(&case) {
                continue;
            }
            let small = common::truth(&case);
            for side in LISTS {
                let lights = common::spread_directions(side, 75.0);
                let viewers = common::spread_directions(side + 1, 70.0);
                let pairs: Vec<Pair> = viewers[..side].iter().flat_map(|&wo| lights.iter().map(move |&wi| Pair { wi, wo })).collect();
                for tolerance in TOLERANCES {
                    let run = |method: Method| {
                        let quality = Quality { method, tolerance, budget: Some(LONGEST), ..Quality::default() };
                        let (got, cost) = common::measure(|| common::run(&small, &pairs, &quality));
                        let met = 1.5 * got.summary.relative_rms <= tolerance;
                        (met.then_some(1e3 * cost.cpu), got.summary.method)
                    };
                    let ([(direct, _), (reference, _)], (auto, takes)) = ([run(Method::Direct), run(Method::Reference)], run(Method::Auto));
                    let best = direct.unwrap_or(f64::INFINITY).min(reference.unwrap_or(f64::INFINITY));
                    let ratio = auto.unwrap_or(f64::INFINITY) / best;
                    worst = worst.max(ratio);
                    let show = |x: Option<f64>| x.map_or("not met".to_owned(), |x| format!("{x:.1}"));
                    println!(
                        "| {case} | {} | {tolerance} | {} | {} | {} | {takes} | {ratio:.2} |",
                        pairs.len(),
                        show(direct),
                        show(reference),
                        show(auto)
                    );
                }
            }
        }
    }
    println!("\nauto takes at most {worst:.2} times what the best of the two does");
}
