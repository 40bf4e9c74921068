//! Facets at random, as Wu et al. (2011, section 3.2) place them: what the low-rank method as published uses. Everything else uses
//! [`super::sample`], whose errors are smaller and known.

use super::density::Density;
use super::samples::{ALIGNMENT, Facets, Sample};
use super::surface::Surface;
use crate::material::{SmallScale, Tint};
use crate::numerics::low_discrepancy::{fraction, hash};
use crate::numerics::random::hash_64;
use glam::DVec3;
use kdtree::KdTree;
use kdtree::distance::squared_euclidean;
use rayon::prelude::*;

/// Points that tell the area of a facet, on average.
const POINTS_A_FACET: usize = 100;
/// Points that are looked up by one task.
const CHUNK: usize = 4096;

/// `count` facets at points chosen at random, with a density that is that of the area. The area that each stands for is the share of many
/// more random points that are nearer to it than to any other facet: nearer in space, not along the surface, as in the paper.
pub fn random(small: &SmallScale, surface: &Surface, count: usize, seed: u32) -> Facets {
    let density = Density::uniform(surface);
    let stream = u64::from(hash(seed)) << 32;
    // Points of the facets, then those that tell their areas.
    let point = |k: usize| {
        let [first, second] = [0, 1].map(|d| {
            let bits = hash_64(stream ^ (2 * k as u64 + d));
            let upper = (bits >> 32) as u32;
            fraction(upper)
        });
        let (triangle, along, _, place) = density.locate(first);
        (triangle, surface.barycentric(triangle, along, second), place)
    };
    let position =
        |triangle: usize, weights: [f64; 3]| -> DVec3 { surface.corners(triangle).iter().zip(weights).map(|(v, w)| *v * w).sum() };
    let points: Vec<(usize, [f64; 3], f64)> = (0..count).map(point).collect();
    let mut tree = KdTree::new(3);
    for (k, (triangle, weights, _)) in points.iter().enumerate() {
        tree.add(position(*triangle, *weights).to_array(), k).expect("positions are finite and have three coordinates");
    }
    let probes = count * POINTS_A_FACET;
    let nearest: Vec<Vec<usize>> = (0..probes)
        .into_par_iter()
        .chunks(CHUNK)
        .map(|chunk| {
            let nearest = |k: usize| {
                let (triangle, weights, _) = point(count + k);
                let found = tree.nearest(&position(triangle, weights).to_array(), 1, &squared_euclidean);
                *found.expect("as above")[0].1
            };
            chunk.into_iter().map(nearest).collect()
        })
        .collect();
    let mut hits = vec![0_u32; count];
    for k in nearest.into_iter().flatten() {
        hits[k] += 1;
    }
    let tinted = small.surfaces.iter().any(|s| matches!(s.tint, Tint::Image(_)));
    let mut facets = Facets { samples: count, tint: tinted.then(Default::default), ..Facets::default() };
    for g in (0..).take(surface.groups.len()) {
        let start = facets.triangle.len();
        for (&(triangle, barycentric, place), hits) in points.iter().zip(&hits).filter(|(p, _)| surface.group[p.0] == g) {
            let weight = density.total * f64::from(*hits) / POINTS_A_FACET as f64;
            let triangle = u32::try_from(triangle).expect("triangles are counted in u32");
            facets.push(small, surface, Some(&Sample { triangle, barycentric, weight, place }));
        }
        while !facets.triangle.len().is_multiple_of(ALIGNMENT) {
            facets.push(small, surface, None);
        }
        facets.ranges.push(start..facets.triangle.len());
    }
    facets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use std::path::Path;

    #[test]
    fn areas_sum_to_that_of_the_surface_and_each_is_about_the_share_of_one() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/truth/weave.diffuse.toml");
        let small = Material::load(&path).unwrap().build().unwrap();
        let surface = Surface::new(&small, None);
        let facets = random(&small, &surface, 500, 3);
        let sum: f64 = facets.weight.iter().map(|&w| f64::from(w)).sum::<f64>() / facets.samples as f64;
        let expected = surface.areas.iter().sum::<f64>() / surface.footprint();
        assert!((sum / expected - 1.0).abs() < 1e-5, "{sum} for {expected}");
        let areas: Vec<f64> = facets.weight.iter().filter(|w| **w > 0.0).map(|&w| f64::from(w)).collect();
        assert!(areas.len() > 490 && facets.ranges.len() == surface.groups.len());
        // Cells of random points in a plane have areas with a standard deviation of .53 of the mean.
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        let spread = (areas.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / areas.len() as f64).sqrt() / mean;
        assert!((0.4..0.75).contains(&spread), "{spread}");
        assert_eq!(facets.weight, random(&small, &surface, 500, 3).weight);
        assert_ne!(facets.weight, random(&small, &surface, 500, 4).weight);
    }
}
