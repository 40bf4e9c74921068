//! How finely `M` must be sampled: the two maps whose cells are its rows and columns (Wu et al. 2011, section 3.7).
//!
//! Both sides are found by bisection: the fewest pixels that represent the turned BRDFs above an asked quality, which is a share of their
//! total power. A share is an integral over normals, lights and viewers, by importance sampling of the BRDF.

use super::map::{Map, Projection};
use super::materials::along_colour;
use crate::brdf::{Brdf, Colour};
use crate::filter::plan::MapSides;
use crate::numerics::low_discrepancy::fraction;
use crate::numerics::random::hash_64;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;

/// Share of the power that interpolation between directions may miss (section 5).
const DIRECTIONS_THRESHOLD: f64 = 0.02;
/// Share of the power that nearest normals may miss (section 5).
const NORMALS_THRESHOLD: f64 = 0.01;
/// Side of the smallest map of normals.
const SMALLEST: usize = 2;
/// Samples of an integral.
const SAMPLES: u32 = 1 << 14;

/// Sides that suit a BRDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// The sides.
    pub sides: MapSides,
    /// Share of the power that interpolation between the directions misses.
    pub missed_by_directions: f64,
    /// Share of the power that nearest normals miss.
    pub missed_by_normals: f64,
}

impl Rates {
    /// Whether the largest maps that were allowed are too coarse: the paper's fate of mirror-like BRDFs.
    pub fn insufficient(&self) -> bool {
        self.missed_by_directions > DIRECTIONS_THRESHOLD || self.missed_by_normals > NORMALS_THRESHOLD
    }
}

/// A normal, a light and a viewer, with the value there and its weight.
struct Sample {
    n: DVec3,
    wi: DVec3,
    wo: DVec3,
    value: f64,
    /// One over the density.
    weight: f64,
}

/// Samples of the integral of `f²` over the sphere of normals and the hemispheres of lights and viewers: half of the viewers where the BRDF
/// reflects to.
fn samples(brdf: &Brdf, colour: &Colour) -> Vec<Sample> {
    const SEED: u64 = 0x7261_7465_7300_0000;
    let uniform = |k: u32, d: u64| {
        let upper = (hash_64(SEED ^ (u64::from(k) << 3 | d)) >> 32) as u32;
        fraction(upper)
    };
    let direction = |z: f64, turn: f64| {
        let (sin, cos) = (TAU * turn).sin_cos();
        DVec3::new(cos, sin, 0.0) * (1.0 - z * z).max(0.0).sqrt() + DVec3::Z * z
    };
    let sample = |k: u32| {
        let u = |d: u64| uniform(k, d);
        let (n, wi) = (direction(2.0 * u(0) - 1.0, u(1)), direction(u(2), u(3)));
        let wo = if k.is_multiple_of(2) { brdf.sample(n, wi, [u(4), u(5), u(6)])?.0 } else { direction(u(4), u(5)) };
        let density = 0.5 / TAU + 0.5 * brdf.pdf(n, wi, wo);
        (wo.z > 0.0).then(|| Sample { n, wi, wo, value: along_colour(brdf, colour, n, wi, wo), weight: 4.0 * PI * TAU / density })
    };
    (0..SAMPLES).into_par_iter().filter_map(sample).collect()
}

/// Share of the power that `approximate` misses.
fn missed(samples: &[Sample], approximate: impl Fn(&Sample) -> f64 + Sync) -> f64 {
    let add =
        |[miss, power]: [f64; 2], s: &Sample| [miss + s.weight * (approximate(s) - s.value).powi(2), power + s.weight * s.value * s.value];
    let parts: Vec<[f64; 2]> = samples.par_chunks(1024).map(|chunk| chunk.iter().fold([0.0; 2], add)).collect();
    let [miss, power] = parts.iter().fold([0.0; 2], |[a, b], p| [a + p[0], b + p[1]]);
    if power > 0.0 { miss / power } else { 0.0 }
}

/// Sides for a BRDF along its colour direction, none above `largest`, and that of directions not below `least_directions`.
pub fn find(brdf: &Brdf, colour: &Colour, projection: Projection, least_directions: usize, largest: MapSides) -> Rates {
    let samples = samples(brdf, colour);
    let by_normals = |side: usize| {
        let map = Map::sphere(projection, side);
        missed(&samples, |s| along_colour(brdf, colour, map.directions[map.nearest(s.n)], s.wi, s.wo))
    };
    let by_directions = |side: usize| {
        let map = Map::hemisphere(projection, side);
        missed(&samples, |s| {
            let (to_light, to_viewer) = (map.around(s.wi), map.around(s.wo));
            let mut sum = 0.0;
            for &(i, a) in &to_light {
                for &(o, b) in &to_viewer {
                    sum += a * b * along_colour(brdf, colour, s.n, map.directions[i], map.directions[o]);
                }
            }
            sum
        })
    };
    let (normals, missed_by_normals) = bisect(SMALLEST..=largest.normals, NORMALS_THRESHOLD, by_normals);
    let (directions, missed_by_directions) = bisect(least_directions..=largest.directions, DIRECTIONS_THRESHOLD, by_directions);
    Rates { sides: MapSides { directions, normals }, missed_by_directions, missed_by_normals }
}

/// The smallest side whose error is within the threshold, if the error falls with the side, and its error; the largest if none is.
fn bisect(sides: RangeInclusive<usize>, threshold: f64, error: impl Fn(usize) -> f64) -> (usize, f64) {
    let (mut low, mut high) = (*sides.start().min(sides.end()), *sides.end());
    let mut of_high = None;
    while low < high {
        let middle = usize::midpoint(low, high);
        let e = error(middle);
        if e <= threshold {
            (high, of_high) = (middle, Some(e));
        } else {
            low = middle + 1;
        }
    }
    (high, of_high.unwrap_or_else(|| error(high)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Distribution;
    use crate::filter::plan::LARGEST_MAPS;

    fn cook_torrance(alpha: f64) -> Brdf {
        Brdf::CookTorrance { diffuse: [0.0; 3], specular: [1.0; 3], alpha, distribution: Distribution::Beckmann, f0: None }
    }

    fn rates(brdf: &Brdf, largest: MapSides) -> Rates {
        find(brdf, &[1.0 / 3.0_f64.sqrt(); 3], Projection::Paraboloid, SMALLEST, largest)
    }

    #[test]
    fn the_largest_maps_are_those_that_the_paper_clamps_to() {
        let directions = Map::hemisphere(Projection::Paraboloid, LARGEST_MAPS.directions).directions.len();
        let normals = Map::sphere(Projection::Paraboloid, LARGEST_MAPS.normals).directions.len();
        assert!((1_600_000..1_725_153).contains(&(directions * (directions + 1) / 2)), "{directions} directions");
        assert!((6_300..6_500).contains(&normals), "{normals} normals");
    }

    #[test]
    fn narrower_lobes_need_finer_maps_and_mirrors_more_than_there_is() {
        let lambert = rates(&Brdf::Lambert { albedo: [0.5; 3] }, LARGEST_MAPS);
        assert!(!lambert.insufficient() && lambert.sides.directions < 20 && lambert.sides.normals < 24, "{lambert:?}");
        let (wide, narrow) = (rates(&cook_torrance(0.5), LARGEST_MAPS), rates(&cook_torrance(0.2), LARGEST_MAPS));
        assert!(wide.sides.directions < narrow.sides.directions && wide.sides.normals < narrow.sides.normals, "{wide:?}, {narrow:?}");
        let mirror = rates(&cook_torrance(0.01), LARGEST_MAPS);
        assert!(mirror.insufficient() && mirror.sides == LARGEST_MAPS, "{mirror:?}");
    }

    #[test]
    fn one_pixel_fewer_is_not_enough() {
        let found = rates(&cook_torrance(0.5), LARGEST_MAPS);
        assert!(found.missed_by_directions <= DIRECTIONS_THRESHOLD && found.missed_by_normals <= NORMALS_THRESHOLD, "{found:?}");
        let fewer = MapSides { directions: found.sides.directions - 1, normals: found.sides.normals - 1 };
        let less = rates(&cook_torrance(0.5), fewer);
        assert!(less.missed_by_directions > DIRECTIONS_THRESHOLD && less.missed_by_normals > NORMALS_THRESHOLD, "{less:?}");
    }

    #[test]
    fn black_needs_nothing() {
        let black = rates(&Brdf::Lambert { albedo: [0.0; 3] }, LARGEST_MAPS);
        assert_eq!((black.missed_by_directions, black.missed_by_normals), (0.0, 0.0));
    }
}
