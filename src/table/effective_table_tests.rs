//! Tables of surfaces whose `S` is known in closed form: between the nodes they must be right within a stated error.

use super::super::bake::{BakeAids, BakeRecipe, ValuesOfPairs, build};
use super::super::guide::GuideLobes;
use super::*;
use crate::brdf::{Brdf, Distribution};
use crate::direction::{MIN_COSINE, Pair};
use crate::error::Error;
use crate::filter::{Effective, Quality, Summary};
use crate::geometry::Tile;
use crate::material::{SmallScale, Surface, Tint};
use glam::DVec2;
use std::f64::consts::PI;

/// A V-groove along y with faces at `tilt` to the horizontal; flat for 0.
#[derive(Clone, Debug)]
pub(in super::super) struct Groove {
    pub tilt: f64,
    pub brdf: Brdf,
    /// Added to `S` at (wi, wo) in a way that is not symmetric.
    pub not_reciprocal: bool,
}

impl Groove {
    pub fn new(tilt_deg: f64, brdf: Brdf) -> Self {
        Self { tilt: tilt_deg.to_radians(), brdf, not_reciprocal: false }
    }

    /// The two faces: normal, and which part of it is seen from `w`, from the ridge down.
    ///
    /// In the cross plane the face from the bottom (0, -t) to the ridge (1, 0) is cut off by the ridge (-1, 0): a direction of
    /// slope `m = w.z / |w.x|` sees the part `2 m / (t + m)` of it if it comes from that side, all of it otherwise.
    fn faces(&self, w: DVec3) -> [(DVec3, f64); 2] {
        let (sin, cos) = self.tilt.sin_cos();
        [1.0, -1.0].map(|side| {
            let n = DVec3::new(-side * sin, 0.0, cos);
            let part = if n.dot(w) <= 0.0 {
                0.0
            } else if w.x * side < 0.0 {
                let (t, m) = (self.tilt.tan(), w.z / w.x.abs());
                (2.0 * m / (t + m)).min(1.0)
            } else {
                1.0
            };
            (n, part)
        })
    }

    /// The exact value.
    pub fn value(&self, pair: &Pair) -> Value {
        let (Some(wi), Some(wo)) = (above_horizon(pair.wi), above_horizon(pair.wo)) else { return Value::default() };
        let mut value = Value::default();
        let skew = if self.not_reciprocal { 1.0 + 0.3 * wi.x } else { 1.0 };
        for ((n, seen_i), (_, seen_o)) in self.faces(wi).into_iter().zip(self.faces(wo)) {
            // Each face covers half of the footprint, its area is that over cos(tilt).
            let area = 0.5 / self.tilt.cos();
            let fr = self.brdf.eval(n, wi, wo);
            let weight = area * n.dot(wi).max(0.0) * n.dot(wo).max(0.0) * seen_i.min(seen_o) * skew;
            for (s, fr) in value.s.iter_mut().zip(fr) {
                *s += weight * fr;
            }
            value.av += area * n.dot(wo).max(0.0) * seen_o;
        }
        value.s_se = value.s.map(|s| 0.01 * s);
        value.fbar = value.s.map(|s| if value.av > 0.0 { s / value.av } else { 0.0 });
        value.fhat = value.fbar.map(|f| f / wi.z);
        value
    }

    /// The values as the filter would give them, with an error of the facets.
    pub fn values(&self, relative_rms: f64) -> impl FnMut(&[Pair], &Quality, std::ops::Range<f64>) -> Result<Effective, Error> {
        let groove = self.clone();
        move |pairs, _, _| {
            let summary = Summary { method: "direct", facets: 2, relative_rms, ..Summary::default() };
            Ok(Effective { values: pairs.iter().map(|p| groove.value(p)).collect(), summary })
        }
    }

    /// The same as a surface, for the guide.
    pub fn surface(&self) -> SmallScale {
        let depth = self.tilt.tan();
        let at = |x: f64, y: f64| DVec3::new(x, y, if x == 1.0 { -depth } else { 0.0 });
        let tile = Tile {
            vertices: vec![at(0.0, 0.0), at(1.0, 0.0), at(2.0, 0.0), at(0.0, 1.0), at(1.0, 1.0), at(2.0, 1.0)],
            triangles: vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
            part_of_triangle: vec![0; 4],
            parts: vec!["side".into()],
            uv: None,
            period: DVec2::new(2.0, 1.0),
            grid: None,
            notes: Vec::new(),
        };
        let surface = Surface { part: "*".into(), brdf: self.brdf.clone(), tint: Tint::Uniform([1.0; 3]), line: 1 };
        SmallScale { tile, surfaces: vec![surface], surface_of_triangle: vec![0; 4], bounces: 0 }
    }

    pub fn table(&self, rings: usize) -> EffectiveTable {
        let recipe = BakeRecipe { rings: Some(rings), ..recipe() };
        build(&recipe, GuideLobes::of(&self.surface()).as_ref(), &BakeAids::none(), &mut self.values(0.0)).unwrap()
    }
}

pub(in super::super) fn recipe() -> BakeRecipe<'static> {
    BakeRecipe { name: "groove", material: "format = 1\n", quality: Quality::default(), rings: None }
}

pub(in super::super) fn lambert(albedo: f64) -> Brdf {
    Brdf::Lambert { albedo: [albedo, 0.5 * albedo, 0.0] }
}

fn ggx(alpha: f64) -> Brdf {
    Brdf::CookTorrance { diffuse: [0.2; 3], specular: [0.5, 0.4, 0.3], alpha, distribution: Distribution::Ggx, f0: None }
}

/// Pairs spread over the product of the hemispheres, uniform in projected solid angle (a Kronecker sequence).
fn pairs(n: usize) -> Vec<Pair> {
    let direction = |u: f64, v: f64| {
        let (sin, cos) = (2.0 * PI * v).sin_cos();
        DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt())
    };
    // Powers of the root of x^5 = x + 1 (Roberts' generalised golden ratio in four dimensions).
    let steps = [1, 2, 3, 4].map(|k| 1.167_303_978_261_418_7_f64.powi(-k));
    let at = |i: usize, k: usize| (0.5 + (i + 1) as f64 * steps[k]).fract();
    (0..n).map(|i| Pair { wi: direction(at(i, 0), at(i, 1)), wo: direction(at(i, 2), at(i, 3)) }).collect()
}

/// Relative RMS difference of `fbar` at pairs that `bake` did not use.
fn error(table: &EffectiveTable, truth: &Groove) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for pair in pairs(20_000) {
        let (got, expected) = (table.eval(pair.wi, pair.wo).fbar, truth.value(&pair).fbar);
        off += (0..3).map(|c| (got[c] - expected[c]).powi(2)).sum::<f64>();
        all += expected.iter().map(|e| e * e).sum::<f64>();
    }
    (off / all).sqrt()
}

#[test]
fn a_flat_lambertian_is_exact_everywhere_down_to_the_horizon() {
    let table = Groove::new(0.0, lambert(0.8)).table(4);
    let at = |theta: f64, phi: f64| DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
    for theta_i in [0.0, 0.3, 1.0, 1.5, 1.56] {
        for theta_o in [0.0, 0.7, 1.2, 1.55] {
            let (wi, wo) = (at(theta_i, 0.4), at(theta_o, 2.0));
            let value = table.eval(wi, wo);
            for (got, albedo) in value.fhat.iter().zip([0.8, 0.4, 0.0]) {
                assert!((got - albedo / PI).abs() < 2e-6, "{got} at {theta_i}, {theta_o}");
            }
            assert!((value.av / wo.z - 1.0).abs() < 2e-6, "av {} for {}", value.av, wo.z);
        }
    }
}

#[test]
fn visible_area_of_a_closed_surface_is_its_footprint_times_the_cosine() {
    let table = Groove::new(50.0, lambert(0.8)).table(5);
    for pair in pairs(500) {
        let value = table.eval(pair.wi, pair.wo);
        assert!((value.av / pair.wo.z - 1.0).abs() < 1e-5, "av {} for {}", value.av, pair.wo.z);
    }
}

#[test]
fn a_diffuse_groove_between_the_nodes_converges_with_the_square_of_the_rings() {
    let groove = Groove::new(40.0, lambert(0.8));
    for (rings, allowed) in [(6, 0.04), (12, 0.012), (24, 0.004)] {
        let error = error(&groove.table(rings), &groove);
        assert!(error < allowed, "{rings} rings: relative RMS {error:.4}, allowed {allowed}");
    }
}

#[test]
fn lobes_narrower_than_the_grid_are_kept_by_the_guide() {
    for (alpha, allowed) in [(0.05, 0.08), (0.1, 0.045)] {
        let groove = Groove::new(30.0, ggx(alpha));
        let mut table = groove.table(16);
        assert!(table.guide().is_some());
        let guided = error(&table, &groove);
        table.guide = None;
        let plain = error(&table, &groove);
        assert!(guided < allowed && plain > 3.5 * guided, "alpha {alpha}: {guided:.4} with, {plain:.4} without the guide");
    }
}

#[test]
fn the_resolution_follows_the_tolerance_and_keeps_it() {
    let mut before = 0;
    for tolerance in [0.05, 0.01, 0.004] {
        let groove = Groove::new(35.0, lambert(0.7));
        let recipe = BakeRecipe { quality: Quality { tolerance, ..Quality::default() }, ..recipe() };
        let table = build(&recipe, None, &BakeAids::none(), &mut groove.values(0.25 * tolerance)).unwrap();
        let about = &table.about.error;
        assert!(about.relative_rms <= tolerance && about.facets == 0.25 * tolerance && about.probes == 10_000, "{about:?}");
        // The estimate must hold at other pairs: to a factor, since a hundredth of the pairs, viewed along the groove near
        // the horizon, makes two thirds of the squared error here.
        let other = error(&table, &groove);
        assert!((0.5..2.0).contains(&(other / about.interpolation)), "{other} at other pairs, {about:?}");
        assert!(table.grid().rings() > before, "{} rings for {tolerance}", table.grid().rings());
        before = table.grid().rings();
    }
}

#[test]
fn a_table_that_misses_the_tolerance_says_why() {
    let groove = Groove::new(35.0, lambert(0.7));
    let coarse = build(&BakeRecipe { rings: Some(4), ..recipe() }, None, &BakeAids::none(), &mut groove.values(0.001)).unwrap();
    assert!(coarse.about.notes.iter().any(|n| n.contains("too coarse")), "{:?}", coarse.about.notes);
    let noisy = build(&recipe(), None, &BakeAids::none(), &mut groove.values(0.03)).unwrap();
    assert!(noisy.about.notes.iter().any(|n| n.contains("values themselves")), "{:?}", noisy.about.notes);
    assert!(noisy.about.error.relative_rms < 0.034, "{:?}", noisy.about.error);
}

#[test]
fn s_is_symmetric_to_the_last_bit_and_never_negative() {
    let table = Groove::new(40.0, ggx(0.1)).table(7);
    for pair in pairs(3000) {
        let (there, back) = (table.eval(pair.wi, pair.wo), table.eval(pair.wo, pair.wi));
        assert_eq!(there.s, back.s, "{pair:?}");
        assert!(there.s.iter().chain(&there.s_se).all(|s| *s >= 0.0 && s.is_finite()), "{there:?} at {pair:?}");
    }
}

#[test]
fn a_surface_that_is_not_reciprocal_keeps_both_halves() {
    let groove = Groove { not_reciprocal: true, ..Groove::new(30.0, lambert(0.7)) };
    let table = groove.table(12);
    assert!(!table.is_reciprocal());
    assert!(table.about.notes.iter().any(|n| n.contains("not reciprocal")));
    assert!(error(&table, &groove) < 0.015);
    assert!(Groove::new(30.0, lambert(0.7)).table(4).is_reciprocal());
}

#[test]
fn a_white_table_returns_no_more_than_it_gets() {
    // White furnace: Int fbar dwi over the hemisphere is 1 for a flat white surface, at most 1 for any other.
    let n = 400;
    let integral = |table: &EffectiveTable, wo: DVec3| -> f64 {
        let mut sum = 0.0;
        for ring in 0..n {
            for turn in 0..n {
                // Midpoints, uniform in solid angle.
                let z = (f64::from(ring) + 0.5) / f64::from(n);
                let (sin, cos) = (2.0 * PI * (f64::from(turn) + 0.5) / f64::from(n)).sin_cos();
                let rho = (1.0 - z * z).sqrt();
                sum += table.eval(DVec3::new(rho * cos, rho * sin, z), wo).fbar[0];
            }
        }
        2.0 * PI * sum / f64::from(n * n)
    };
    let directions = [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.995, 0.01).normalize()];
    let (flat, groove) = (Groove::new(0.0, lambert(1.0)).table(8), Groove::new(45.0, lambert(1.0)).table(8));
    for wo in directions {
        let whole = integral(&flat, wo);
        assert!((whole - 1.0).abs() < 1e-4, "flat: {whole} from {wo}");
        let part = integral(&groove, wo);
        assert!(part < 1.0 && part > 0.5, "groove: {part} from {wo}");
    }
}

#[test]
fn values_are_finite_at_the_horizon_and_0_below() {
    let at = |theta_deg: f64, phi: f64| {
        let (sin, cos) = theta_deg.to_radians().sin_cos();
        DVec3::new(sin * phi.cos(), sin * phi.sin(), cos)
    };
    for brdf in [lambert(0.8), ggx(0.05)] {
        let groove = Groove::new(60.0, brdf);
        let table = groove.table(9);
        for theta in [89.0, 89.9, 89.99, 90.0] {
            for turn in 0..24 {
                let phi = f64::from(turn) * PI / 11.7;
                for wi in [DVec3::Z, at(theta, 1.0), at(theta, phi + PI)] {
                    let value = table.eval(wi, at(theta, phi));
                    let numbers = value.s.iter().chain(&value.fbar).chain(&value.fhat).chain(&value.se);
                    assert!(numbers.into_iter().all(|v| v.is_finite() && *v >= 0.0), "{value:?} at {theta}, {phi}");
                    assert!(value.av > 0.0, "{value:?}");
                }
            }
        }
        assert_eq!(table.eval(DVec3::Z, at(91.0, 0.0)), Value::default());
        assert_eq!(table.eval(at(90.1, 0.0), DVec3::Z).s, [0.0; 3]);
        let exactly = DVec3::new(1.0, 0.0, 0.0);
        let lifted = DVec3::new((1.0 - MIN_COSINE * MIN_COSINE).sqrt(), 0.0, MIN_COSINE);
        assert_eq!(table.eval(exactly, DVec3::Z), table.eval(lifted, DVec3::Z));
    }
}

#[test]
fn a_grazing_diffuse_value_goes_to_its_limit() {
    // fhat of a diffuse groove along its own direction does not depend on the elevation.
    let groove = Groove::new(30.0, lambert(0.8));
    let table = groove.table(16);
    for elevation in [0.2, 0.05, 0.01, 1e-3] {
        let wo = DVec3::new(0.0, (1.0_f64 - elevation * elevation).sqrt(), elevation);
        for wi in [DVec3::Z, DVec3::new(0.3, 0.2, 0.9).normalize()] {
            let (got, expected) = (table.eval(wi, wo).fhat[0], groove.value(&Pair { wi, wo }).fhat[0]);
            assert!((got / expected - 1.0).abs() < 0.05, "{got} for {expected} at elevation {elevation}");
        }
    }
}

#[test]
fn a_black_surface_has_an_absolute_error_of_0() {
    let table = Groove::new(30.0, lambert(0.0)).table(4);
    assert_eq!(table.about.error.relative_rms, 0.0);
    assert_eq!(table.eval(DVec3::Z, DVec3::Z).fbar, [0.0; 3]);
}

#[test]
fn what_cannot_be_baked_is_refused_before_any_work() {
    let never: &mut ValuesOfPairs<'_> = &mut |_, _, _| panic!("no value should be asked for");
    for rings in [0, 3, 37, usize::MAX] {
        let text = build(&BakeRecipe { rings: Some(rings), ..recipe() }, None, &BakeAids::none(), never).unwrap_err().to_string();
        assert!(text.contains("resolution") && text.contains("4 to 36"), "{text}");
    }
    let quality = Quality { budget: Some(1.0), ..Quality::default() };
    assert!(matches!(build(&BakeRecipe { quality, ..recipe() }, None, &BakeAids::none(), never), Err(Error::Unsupported { .. })));
    let stopped: &mut ValuesOfPairs<'_> = &mut |_, _, _| Err(Error::Interrupted);
    assert!(matches!(build(&recipe(), None, &BakeAids::none(), stopped), Err(Error::Interrupted)));
}

#[test]
fn a_value_that_is_not_finite_never_gets_into_a_table() {
    let mut calls = 0;
    let groove = Groove::new(30.0, lambert(0.5));
    let mut exact = groove.values(0.0);
    let values: &mut ValuesOfPairs<'_> = &mut |pairs, quality, share| {
        calls += 1;
        let mut result = exact(pairs, quality, share)?;
        if calls == 2 {
            result.values[5].s[1] = f64::NAN;
        }
        Ok(result)
    };
    assert!(matches!(build(&recipe(), None, &BakeAids::none(), values), Err(Error::Numeric(_))));
}

#[test]
fn the_largest_tables_keep_within_their_memory() {
    assert_eq!((max_rings(true), max_rings(false)), (36, 30));
    assert!(value_count(max_rings(true), true) * 24 < 200_000_000);
}

#[test]
fn every_pair_has_one_place() {
    for reciprocal in [true, false] {
        let nodes = node_count(2);
        let mut seen = vec![0; value_count(2, reciprocal)];
        for wi in 0..nodes {
            for wo in 0..nodes {
                seen[value_index(nodes, reciprocal, wi, wo)] += 1;
            }
        }
        let (least, most) = (seen.iter().min(), seen.iter().max());
        assert_eq!((least, most), (Some(&1), Some(if reciprocal { &2 } else { &1 })));
    }
}
