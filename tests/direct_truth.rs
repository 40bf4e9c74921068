//! The direct method against effective BRDFs made by an independent path tracer (`tests/data/truth/README.md`).

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::direction::Pair;
use biscale::filter::{Effective, Method, Quality};
use glam::DVec3;
use support::truth::Truth;

/// Material, and the PSNR in dB that default settings must reach.
const CASES: [(&str, &str, f64); 15] = [
    ("vgroove", "diffuse", 48.0),
    ("vgroove", "ggx_0.30", 48.0),
    ("vgroove", "ggx_0.05", 43.0),
    ("pyramid", "diffuse", 48.0),
    ("pyramid", "ggx_0.30", 48.0),
    ("pyramid", "ggx_0.05", 43.0),
    ("rods", "diffuse", 48.0),
    ("rods", "ggx_0.30", 48.0),
    ("rods", "ggx_0.05", 43.0),
    ("weave", "diffuse", 48.0),
    ("weave", "ggx_0.30", 48.0),
    ("weave", "ggx_0.05", 43.0),
    ("bumpy", "diffuse", 48.0),
    ("bumpy", "ggx_0.30", 48.0),
    ("bumpy", "ggx_0.05", 43.0),
];

fn direct(truth: &Truth, tolerance: f64, seed: u64) -> Effective {
    truth.run(&Quality { method: Method::Direct, tolerance, seed, ..Quality::default() })
}

#[test]
fn default_settings_reach_the_asked_psnr_and_their_standard_errors_hold_over_sixteen_seeds() {
    for (tile, brdf, least) in CASES {
        let truth = Truth::load(tile, brdf);
        let (mut within, mut all) = (0, 0);
        for seed in 0..16 {
            let got = direct(&truth, Quality::default().tolerance, seed);
            let psnr = truth.psnr(&got);
            assert!(psnr >= least, "{tile} {brdf}, seed {seed}: {psnr:.1} dB, should be {least}");
            let (w, a) = truth.within(&got);
            assert!(w as f64 >= 0.8 * a as f64, "{tile} {brdf}, seed {seed}: {w} of {a} values within 3 standard errors");
            within += w;
            all += a;
        }
        assert!(within as f64 >= 0.95 * all as f64, "{tile} {brdf}: {within} of {all} values within 3 standard errors");
    }
}

#[test]
fn a_tolerance_of_two_thousandths_reaches_58_db() {
    for (tile, brdf, _) in CASES {
        let truth = Truth::load(tile, brdf);
        let psnr = truth.psnr(&direct(&truth, 0.002, 1));
        assert!(psnr >= 58.0, "{tile} {brdf}: {psnr:.1} dB");
    }
}

#[test]
fn visible_area_agrees_with_the_truth() {
    for (tile, brdf, _) in CASES {
        let truth = Truth::load(tile, brdf);
        for (value, row) in direct(&truth, 0.005, 2).values.iter().zip(&truth.expected) {
            assert!((value.av - row[6]).abs() < 0.01, "{tile} {brdf}: {} for {}", value.av, row[6]);
        }
    }
}

/// The plan of one surface may be given to another, whose facets are counted by clusters of normals.
#[test]
fn a_plan_that_spreads_facets_unevenly_is_right_on_every_surface() {
    for (tile, brdf) in [("vgroove", "diffuse"), ("pyramid", "ggx_0.30"), ("bumpy", "ggx_0.30")] {
        let truth = Truth::load(tile, brdf);
        for plan in ["direct:8192x1", "direct:8192x1:weighted"] {
            let psnr = truth.psnr(&support::direct(&truth.surface, &truth.pairs, plan));
            assert!(psnr >= 48.0, "{tile} {brdf} by {plan}: {psnr:.1} dB");
        }
    }
}

/// Where the pilot run of weighted samples was is in the plan: a run to a tolerance tries on a part of the list, one in a budget on all of it.
#[test]
fn a_plan_repeats_the_bits_of_runs_with_and_without_a_budget() {
    let truth = Truth::load("weave", "ggx_0.30");
    let direction = |k: u32| support::direction(f64::from(k) * 89.0 / 48.0, f64::from(k) * 2.4);
    let pairs: Vec<Pair> = (0..48 * 48).map(|k| Pair { wi: direction(k % 48), wo: direction(k / 48) }).collect();
    for (budget, how) in [(None, ":weighted-by-part"), (Some(1e9), ":weighted")] {
        let asked = Quality { method: Method::Direct, tolerance: 0.002, budget, ..Quality::default() };
        let first = support::run(&truth.surface, &pairs, &asked);
        let plan = first.summary.plan_text();
        assert!(plan.ends_with(how), "{plan}");
        let again = support::direct(&truth.surface, &pairs, &plan);
        assert_eq!(again.values, first.values, "{plan}");
    }
}

/// Clusters of unequal normals err where viewers graze the surface, which `fbar` counts as much as elsewhere and `S` does not.
#[test]
fn the_error_of_clusters_of_normals_is_not_understated() {
    let truth = Truth::load("weave", "diffuse");
    // All pairs of 280 directions uniform in projected solid angle: a list long enough for wide clusters.
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let direction = |k: u32| {
        let (square, turn) = ((f64::from(k) + 0.5) / 280.0, golden * f64::from(k));
        DVec3::new(square.sqrt() * turn.cos(), square.sqrt() * turn.sin(), (1.0 - square).sqrt()).normalize()
    };
    let pairs: Vec<Pair> = (0..280 * 280).map(|k| Pair { wi: direction(k % 280), wo: direction(k / 280) }).collect();
    // The same facets by clusters and, as narrow as they come, by equal normals: their difference is what the clusters cost.
    let [wide, equal] = ["direct:8192x1", "direct:8192x1:narrowed3"].map(|plan| support::direct(&truth.surface, &pairs, plan));
    let exact: Vec<[f64; 3]> = equal.values.iter().map(|v| v.fbar).collect();
    let bias = support::relative_rms(&wide, &exact);
    let told = wide.summary.relative_rms.powi(2) - equal.summary.relative_rms.powi(2);
    assert!(bias > 1e-3, "these clusters cost nothing: {bias}");
    assert!(
        told.max(0.0).sqrt() > 0.6 * bias,
        "clusters cost {bias}, and the errors with and without them are {} and {}",
        wide.summary.relative_rms,
        equal.summary.relative_rms
    );
}
