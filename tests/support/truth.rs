//! Effective BRDFs made by an independent path tracer (`tests/data/truth/README.md`).

use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Quality, effective};
use biscale::material::{Material, SmallScale};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// One tile under one BRDF, and what it should look like.
pub struct Truth {
    pub surface: SmallScale,
    pub pairs: Vec<Pair>,
    /// `fbar` and its standard error, three channels each, and `av`.
    pub expected: Vec<Vec<f64>>,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/truth")
}

fn table(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(folder().join(name)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

impl Truth {
    pub fn load(tile: &str, brdf: &str) -> Self {
        let surface = Material::load(&folder().join(format!("{tile}.{brdf}.toml"))).unwrap().build().unwrap();
        let direction = |v: &[f64]| DVec3::from_slice(v).normalize();
        let pairs = table(&format!("{tile}.pairs.csv")).iter().map(|r| Pair { wi: direction(&r[..3]), wo: direction(&r[3..]) }).collect();
        Self { surface, pairs, expected: table(&format!("{tile}.{brdf}.expected.csv")) }
    }

    /// Runs a method; the clock stands still.
    pub fn run(&self, quality: &Quality) -> Effective {
        let cancel = AtomicBool::new(false);
        let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        effective(&self.surface, &self.pairs, quality, &control).unwrap()
    }

    /// PSNR in dB, peak = largest expected value.
    pub fn psnr(&self, got: &Effective) -> f64 {
        let peak = self.expected.iter().flat_map(|row| &row[..3]).fold(0.0_f64, |a, &b| a.max(b));
        let squares: f64 = self.channels(got).map(|(got, _, expected, _)| (got - expected).powi(2)).sum();
        10.0 * (peak * peak * 3.0 * self.pairs.len() as f64 / squares).log10()
    }

    /// Relative RMS difference of `fbar`.
    pub fn relative_error(&self, got: &Effective) -> f64 {
        let squares: f64 = self.channels(got).map(|(got, _, expected, _)| (got - expected).powi(2)).sum();
        let energy: f64 = self.channels(got).map(|(_, _, expected, _)| expected * expected).sum();
        (squares / energy).sqrt()
    }

    /// Values within three combined standard errors, and all values.
    pub fn within(&self, got: &Effective) -> (usize, usize) {
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
