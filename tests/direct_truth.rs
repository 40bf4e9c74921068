//! The direct method against effective BRDFs made by an independent path tracer (`tests/data/truth/README.md`).

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::filter::{Effective, Method, Quality};
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
            let cancel = AtomicBool::new(false);
            let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
            let quality = Quality { method: Method::Direct, plan: Some(plan.to_owned()), ..Quality::default() };
            let psnr = truth.psnr(&effective(&truth.surface, &truth.pairs, &quality, &control).unwrap());
            assert!(psnr >= 48.0, "{tile} {brdf} by {plan}: {psnr:.1} dB");
        }
    }
}
