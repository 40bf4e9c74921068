//! The reference method against effective BRDFs that an independent path tracer has computed (`tests/data/truth/README.md`).

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Method, Quality, effective};
use biscale::material::Material;
use glam::DVec3;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];

fn file(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests/data/truth", name].iter().collect()
}

/// The numbers of a CSV file, without its header.
fn rows(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(file(name)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

fn reference(tile: &str, brdf: &str, quality: Quality) -> Effective {
    let pairs: Vec<Pair> = rows(&format!("{tile}.pairs.csv"))
        .iter()
        .map(|r| Pair { wi: DVec3::new(r[0], r[1], r[2]).normalize(), wo: DVec3::new(r[3], r[4], r[5]).normalize() })
        .collect();
    let small = Material::load(&file(&format!("{tile}.{brdf}.toml"))).unwrap().build().unwrap();
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    effective(&small, &pairs, &Quality { method: Method::Reference, ..quality }, &control).unwrap()
}

/// How far results are from the truth, pooled: relative L2, and the share of the values within 3 combined standard errors.
fn compare(results: &[Effective], truth: &[Vec<f64>]) -> (f64, f64) {
    let (mut error, mut energy, mut within, mut count) = (0.0, 0.0, 0.0, 0.0);
    for (value, row) in results.iter().flat_map(|result| result.values.iter().zip(truth)) {
        for c in 0..3 {
            let (expected, se) = (row[c], row[3 + c].max(1e-4 * row[c] + 1e-8));
            let off = value.fbar[c] - expected;
            error += off * off;
            energy += expected * expected;
            count += 1.0;
            within += f64::from(u8::from(off.abs() <= 3.0 * se.hypot(value.se[c])));
        }
    }
    ((error / energy).sqrt(), within / count)
}

#[test]
fn direct_light_is_within_its_standard_errors_of_the_truth() {
    for tile in TILES {
        for (brdf, tolerance) in [("diffuse", 0.01), ("ggx_0.30", 0.02), ("ggx_0.05", 0.05)] {
            let truth = rows(&format!("{tile}.{brdf}.expected.csv"));
            let results = [1, 2].map(|seed| reference(tile, brdf, Quality { tolerance, seed, ..Quality::default() }));
            let (l2, within) = compare(&results, &truth);
            assert!(within >= 0.95, "{tile}.{brdf}: {within} of the values within 3 standard errors");
            assert!(l2 <= tolerance, "{tile}.{brdf}: relative L2 {l2} for a tolerance of {tolerance}");
            for (k, (value, row)) in results.iter().flat_map(|result| result.values.iter().zip(&truth)).enumerate() {
                assert!((value.av - row[6]).abs() < 0.02, "{tile}.{brdf}, pair {}: av {} instead of {}", k % 64, value.av, row[6]);
            }
        }
    }
}

#[test]
fn paths_of_24_events_match_the_truth_with_all_interreflections() {
    for tile in TILES {
        let truth = rows(&format!("{tile}.diffuse_full.expected.csv"));
        let result = reference(tile, "diffuse", Quality { tolerance: 0.008, bounces: Some(23), ..Quality::default() });
        let estimate = result.summary.relative_rms;
        let (l2, within) = compare(&[result], &truth);
        assert!(l2 <= 0.01, "{tile}: relative L2 {l2}, estimated {estimate}");
        assert!(within >= 0.95, "{tile}: {within} of the values within 3 standard errors");
        // Direct light alone would not do.
        let direct = reference(tile, "diffuse", Quality { tolerance: 0.02, ..Quality::default() });
        assert!(compare(&[direct], &truth).0 > 0.02, "{tile} has hardly any interreflections: the test proves nothing");
    }
}
