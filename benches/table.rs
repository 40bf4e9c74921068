//! A table of 132 x 132 directions: CPU seconds at the noise of a Mitsuba 3 program.
//!
//! The other side is `scripts/peers/mitsuba_table.py`; `scripts/compare_peers.sh` runs both. *Noise* is measured as there: the median
//! over the pairs of twelve of the directions of the relative standard deviation of a value over six seeds. For each case the
//! tolerance is lowered until the noise is within the other side's.
//!
//! *Geometry edit*: all that follows a change of the geometry, from the tile's triangles on. *Material edit*: all that follows a
//! change of the BRDF: facets and visibility are kept.
//!
//! usage: `cargo bench --bench table -- [--json] [--noise N] [CASE...]`     with `--noise` for all cases instead of the listed one

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::brdf::Brdf;
use biscale::direction::Pair;
use biscale::filter::{Quality, Value, prepare};
use biscale::material::SmallScale;
use biscale::numerics::statistics::median;
use common::Cost;

struct Case {
    name: &'static str,
    tile: &'static str,
    brdf: Brdf,
    /// Noise of the other side, and its CPU seconds, on the machine of `docs/performance.md`.
    peer: (f64, f64),
}

fn cases() -> [Case; 6] {
    let case = |name, tile, brdf, noise, cpu| Case { name, tile, brdf, peer: (noise, cpu) };
    [
        case("weave-diffuse", "weave", common::diffuse(), 0.0051, 6.9),
        case("weave-ggx-0.3", "weave", common::ggx(0.3), 0.0044, 30.0),
        case("weave-ggx-0.05", "weave", common::ggx(0.05), 0.024, 24.0),
        case("bumpy-diffuse", "bumpy", common::diffuse(), 0.003, 8.6),
        case("rods-diffuse", "rods", common::diffuse(), 0.006, 91.0),
        case("vgroove-diffuse", "vgroove", common::diffuse(), 0.006, 2.0),
    ]
}

/// Directions of the table, the same as the other side's.
const DIRECTIONS: usize = 132;
/// Largest elevation from z, degrees.
const THETA_DEG: f64 = 85.0;
/// Twelve of them: `numpy.random.default_rng(0).choice(132, 12, False)`.
const SUBSET: [usize; 12] = [102, 2, 62, 77, 38, 22, 33, 5, 85, 105, 120, 9];
const SEEDS: u64 = 6;
/// Relative deviations are taken from at least this: a value of 0 has none.
const FLOOR: f64 = 1e-4;
/// Loosest tolerance tried, tightest, and the step between.
const TOLERANCES: (f64, f64, f64) = (0.16, 0.0005, std::f64::consts::FRAC_1_SQRT_2);

/// What one setting gave, means over the seeds.
struct Outcome {
    tolerance: f64,
    noise: f64,
    cost: Cost,
    facets: Vec<usize>,
    /// Milliseconds of the stages of the last run.
    stages: String,
}

/// What one run gave: values, facets, milliseconds of the stages.
struct Ran {
    values: Vec<Value>,
    facets: usize,
    stages: String,
}

/// Runs with each seed.
fn outcome(tolerance: f64, mut run: impl FnMut(u64) -> (Ran, Cost)) -> Outcome {
    let mut values = vec![Vec::new(); SUBSET.len() * SUBSET.len()];
    let (mut cost, mut facets, mut stages) = (Cost::default(), Vec::new(), String::new());
    for seed in 0..SEEDS {
        let (ran, c) = run(seed);
        cost.cpu += c.cpu / SEEDS as f64;
        cost.wall += c.wall / SEEDS as f64;
        facets.push(ran.facets);
        for (k, list) in values.iter_mut().enumerate() {
            let (viewer, light) = (SUBSET[k / SUBSET.len()], SUBSET[k % SUBSET.len()]);
            list.push(ran.values[viewer * DIRECTIONS + light].fbar[0]);
        }
        stages = ran.stages;
    }
    let relative = values.iter().map(|v| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        let variance = v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (v.len() - 1) as f64;
        variance.sqrt() / mean.max(FLOOR)
    });
    facets.sort_unstable();
    Outcome { tolerance, noise: median(relative.collect()).unwrap(), cost, facets, stages }
}

/// The first of ever tighter tolerances whose noise is within `noise`.
fn at_noise(noise: f64, mut run: impl FnMut(f64, u64) -> (Ran, Cost)) -> Outcome {
    let (mut tolerance, tightest, step) = TOLERANCES;
    loop {
        let outcome = outcome(tolerance, |seed| run(tolerance, seed));
        if outcome.noise <= noise || tolerance < tightest {
            return outcome;
        }
        tolerance *= step;
    }
}

fn geometry_edit(small: &SmallScale, pairs: &[Pair], noise: f64) -> Outcome {
    at_noise(noise, |tolerance, seed| {
        let quality = Quality { tolerance, seed, ..Quality::default() };
        let (e, cost) = common::measure(|| common::run(small, pairs, &quality));
        (Ran { facets: e.summary.facets, stages: common::stages(&e), values: e.values }, cost)
    })
}

/// The BRDF before a material edit.
fn before(brdf: &Brdf) -> Brdf {
    match brdf {
        Brdf::CookTorrance { alpha, .. } => common::ggx(1.2 * alpha),
        _ => Brdf::Lambert { albedo: [0.3; 3] },
    }
}

fn material_edit(small: &SmallScale, pairs: &[Pair], noise: f64) -> Outcome {
    let first = common::cover(small.clone(), before(&small.surfaces[0].brdf));
    at_noise(noise, |tolerance, seed| {
        let quality = Quality { tolerance, seed, ..Quality::default() };
        common::with_control(|control| {
            let (prepared, before) = prepare(&first, pairs, &quality, control).expect("fits the memory");
            let ((values, _), cost) = common::measure(|| prepared.evaluate(&small.surfaces, control).expect("nothing stops it"));
            (Ran { values, facets: before.summary.facets, stages: String::new() }, cost)
        })
    })
}

fn main() {
    let mut arguments = common::arguments();
    let json = arguments.iter().position(|a| a == "--json").map(|at| arguments.remove(at)).is_some();
    let noise = arguments.iter().position(|a| a == "--noise").map(|at| {
        let number = arguments.drain(at..at + 2).nth(1).expect("a number after --noise");
        number.parse::<f64>().expect("a number after --noise")
    });
    let pairs = common::all_pairs(&common::spread_directions(DIRECTIONS, THETA_DEG));
    if !json {
        println!("| case | edit | tolerance | facets | noise | CPU s | wall s | peak MiB | times less CPU | stages, ms |");
        println!("|---|---|---|---|---|---|---|---|---|---|");
    }
    for case in cases() {
        if !arguments.is_empty() && !arguments.iter().any(|a| a == case.name) {
            continue;
        }
        let noise = noise.unwrap_or(case.peer.0);
        let small = common::covered(case.tile, case.brdf.clone());
        for (edit, run) in [("geometry", geometry_edit as fn(&SmallScale, &[Pair], f64) -> Outcome), ("material", material_edit)] {
            common::reset_peak();
            let o = run(&small, &pairs, noise);
            let peak = common::peak_mib().unwrap_or(f64::NAN);
            let (facets, cost) = (o.facets[o.facets.len() / 2], o.cost);
            if json {
                println!(
                    "{{\"case\": \"{}\", \"edit\": \"{edit}\", \"tolerance\": {:.5}, \"facets\": {facets}, \"noise\": {:.6}, \"cpu_s\": {:.5}, \"wall_s\": {:.5}, \"peak_mib\": {peak:.0}}}",
                    case.name, o.tolerance, o.noise, cost.cpu, cost.wall
                );
            } else {
                println!(
                    "| {} | {edit} | {:.4} | {facets} | {:.2} % | {:.4} | {:.4} | {peak:.0} | {:.0} | {} |",
                    case.name,
                    o.tolerance,
                    100.0 * o.noise,
                    cost.cpu,
                    cost.wall,
                    case.peer.1 / cost.cpu,
                    o.stages
                );
            }
        }
    }
}
