//! The direct method against effective BRDFs made by an independent path tracer (`tests/data/truth/README.md`).

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Method, Quality, effective};
use biscale::material::{Material, SmallScale};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

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

/// One tile under one BRDF, and what it should look like.
struct Truth {
    surface: SmallScale,
    pairs: Vec<Pair>,
    /// `fbar` and its standard error, three channels each, and `av`.
    expected: Vec<Vec<f64>>,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/truth")
}

fn table(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(folder().join(name)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

impl Truth {
    fn load(tile: &str, brdf: &str) -> Self {
        let surface = Material::load(&folder().join(format!("{tile}.{brdf}.toml"))).unwrap().build().unwrap();
        let direction = |v: &[f64]| DVec3::from_slice(v).normalize();
        let pairs = table(&format!("{tile}.pairs.csv")).iter().map(|r| Pair { wi: direction(&r[..3]), wo: direction(&r[3..]) }).collect();
        Self { surface, pairs, expected: table(&format!("{tile}.{brdf}.expected.csv")) }
    }

    fn run(&self, tolerance: f64, seed: u64) -> Effective {
        let cancel = AtomicBool::new(false);
        let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        let quality = Quality { method: Method::Direct, tolerance, seed, ..Quality::default() };
        effective(&self.surface, &self.pairs, &quality, &control).unwrap()
    }

    /// PSNR in dB, peak = largest expected value.
    fn psnr(&self, got: &Effective) -> f64 {
        let peak = self.expected.iter().flat_map(|row| &row[..3]).fold(0.0_f64, |a, &b| a.max(b));
        let squares: f64 = self.channels(got).map(|(got, _, expected, _)| (got - expected).powi(2)).sum();
        10.0 * (peak * peak * 3.0 * self.pairs.len() as f64 / squares).log10()
    }

    /// Values within three combined standard errors, and all values.
    fn within(&self, got: &Effective) -> (usize, usize) {
        // Stratification makes the truth's own error too small on flat facets: see its README.
        let near = |&(got, se, expected, expected_se): &(f64, f64, f64, f64)| {
            (got - expected).abs() <= 3.0 * se.hypot(expected_se.max(1e-4 * expected + 1e-8))
        };
        (self.channels(got).filter(near).count(), self.channels(got).count())
    }

    /// Value, its standard error, expected value and its standard error.
    fn channels<'a>(&'a self, got: &'a Effective) -> impl Iterator<Item = (f64, f64, f64, f64)> + 'a {
        let pairs = got.values.iter().zip(&self.expected);
        pairs.flat_map(|(v, row)| (0..3).map(move |c| (v.fbar[c], v.se[c], row[c], row[3 + c])))
    }
}

#[test]
fn default_settings_reach_the_asked_psnr_and_their_standard_errors_hold_over_sixteen_seeds() {
    for (tile, brdf, least) in CASES {
        let truth = Truth::load(tile, brdf);
        let (mut within, mut all) = (0, 0);
        for seed in 0..16 {
            let got = truth.run(Quality::default().tolerance, seed);
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
        let psnr = truth.psnr(&truth.run(0.002, 1));
        assert!(psnr >= 58.0, "{tile} {brdf}: {psnr:.1} dB");
    }
}

#[test]
fn visible_area_agrees_with_the_truth() {
    for (tile, brdf, _) in CASES {
        let truth = Truth::load(tile, brdf);
        for (value, row) in truth.run(0.005, 2).values.iter().zip(&truth.expected) {
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
