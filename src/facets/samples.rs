//! Facets: samples of the surface by a low-discrepancy sequence.

use super::density::Density;
use super::surface::Surface;
use crate::material::{SmallScale, Tint};
use crate::numerics::cast::{index_u32, narrow};
use crate::numerics::low_discrepancy::{fraction, sobol_2d};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Replicates: interleaved subsets of facets whose spread gives the standard error.
pub const REPLICATES: usize = 8;
/// The facets of one surface start at a multiple of this and are filled up to one: a word of visibility bits.
pub const ALIGNMENT: usize = 64;
/// Triangle of a facet that only fills up.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Facets, structure of arrays. All arrays have the same length, a multiple of [`ALIGNMENT`].
#[derive(Clone, Debug, Default)]
pub struct Facets {
    /// Position, in units of the larger period.
    pub position: Vec<DVec3>,
    /// Place of the triangle in [`Surface::triangles`], or [`NO_TRIANGLE`].
    pub triangle: Vec<u32>,
    /// Components of the unit normal.
    pub normal: [Vec<f32>; 3],
    /// Area over the footprint `A` that the facet stands for, times the number of samples of its block; 0 where it only fills up.
    pub weight: Vec<f32>,
    /// How far along the surface's area the facet lies, in 0..1.
    pub along: Vec<f32>,
    /// Components of the tint, where a surface has an image of them.
    pub tint: Option<[Vec<f32>; 3]>,
    /// For each group its facets.
    pub ranges: Vec<Range<usize>>,
    /// Samples, without those that only fill up.
    pub samples: usize,
}

/// Samples to make facets of: for each replicate a run of the sequence. `rows`, the length of all runs, is a power of two, and each start is a
/// multiple of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Runs {
    /// First sample of each replicate.
    pub starts: [u32; REPLICATES],
    /// Samples of each replicate.
    pub rows: u32,
}

impl Runs {
    /// Part `part` of `parts` of the samples `start..start + length`, the eighths of which are the replicates.
    pub fn of_block(start: u32, length: u32, part: u32, parts: u32) -> Self {
        let (set, rows) = (length / REPLICATES as u32, length / REPLICATES as u32 / parts);
        let mut starts = [start + part * rows; REPLICATES];
        for (r, s) in (0..).zip(&mut starts) {
            *s += r * set;
        }
        Self { starts, rows }
    }
}

/// Facets of some samples of the sequence `seed`.
pub fn sample(small: &SmallScale, surface: &Surface, density: &Density, runs: Runs, seed: u32) -> Facets {
    let rows = runs.rows as usize;
    let samples = rows * REPLICATES;
    // One row a stretch of the surface, one column a replicate.
    let mut table = vec![Sample { triangle: NO_TRIANGLE, barycentric: [0.0; 3], weight: 0.0, place: 0.0 }; samples];
    for (set, start) in runs.starts.into_iter().enumerate() {
        for t in start..start + runs.rows {
            let [first, second] = sobol_2d(t, seed);
            let row = ((u64::from(first) * rows as u64) >> 32) as usize;
            let (triangle, along, weight, place) = density.locate(fraction(first));
            let barycentric = surface.barycentric(triangle, along, fraction(second));
            let slot = &mut table[row * REPLICATES + set];
            debug_assert_eq!(slot.triangle, NO_TRIANGLE, "two samples of a set in one stratum");
            *slot = Sample { triangle: index_u32(triangle), barycentric, weight, place };
        }
    }
    let holds = |row: &[Sample], g: u32| row.iter().any(|f| surface.group[f.triangle as usize] == g);
    let mut facets = Facets { samples, ..Facets::default() };
    let tinted = small.surfaces.iter().any(|s| matches!(s.tint, Tint::Image(_)));
    facets.tint = tinted.then(Default::default);
    let mut next = 0;
    for g in (0..).take(surface.groups.len()) {
        let start = facets.triangle.len();
        // A row at the seam of two groups is looked at for both.
        while next > 0 && holds(&table[(next - 1) * REPLICATES..next * REPLICATES], g) {
            next -= 1;
        }
        while next < rows && holds(&table[next * REPLICATES..(next + 1) * REPLICATES], g) {
            for sample in &table[next * REPLICATES..(next + 1) * REPLICATES] {
                let mine = surface.group[sample.triangle as usize] == g;
                facets.push(small, surface, mine.then_some(sample));
            }
            next += 1;
        }
        while !facets.triangle.len().is_multiple_of(ALIGNMENT) {
            facets.push(small, surface, None);
        }
        facets.ranges.push(start..facets.triangle.len());
    }
    facets
}

/// Facets at places that a caller chose: how far along the area of `density`, and across the triangle found there, each in 0..1. Their replicates
/// mean nothing.
pub(crate) fn at_places(small: &SmallScale, surface: &Surface, density: &Density, places: &[[f64; 2]]) -> Facets {
    let mut samples: Vec<Sample> = places
        .iter()
        .map(|&[first, second]| {
            let (triangle, along, weight, place) = density.locate(first);
            let barycentric = surface.barycentric(triangle, along, second);
            Sample { triangle: index_u32(triangle), barycentric, weight, place }
        })
        .collect();
    samples.sort_by(|a, b| a.place.total_cmp(&b.place));
    let mut facets = Facets { samples: samples.len(), ..Facets::default() };
    facets.tint = small.surfaces.iter().any(|s| matches!(s.tint, Tint::Image(_))).then(Default::default);
    let mut rest = &samples[..];
    for g in (0..).take(surface.groups.len()) {
        let start = facets.triangle.len();
        // Triangles are sorted by group.
        let (mine, others) = rest.split_at(rest.partition_point(|s| surface.group[s.triangle as usize] <= g));
        for sample in mine {
            facets.push(small, surface, Some(sample));
        }
        while !facets.triangle.len().is_multiple_of(ALIGNMENT) {
            facets.push(small, surface, None);
        }
        facets.ranges.push(start..facets.triangle.len());
        rest = others;
    }
    facets
}

impl Facets {
    /// Normal of a facet.
    pub fn normal_of(&self, facet: usize) -> Vec3 {
        Vec3::new(self.normal[0][facet], self.normal[1][facet], self.normal[2][facet])
    }
}

/// One sample of the surface.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    pub triangle: u32,
    pub barycentric: [f64; 3],
    /// Area over the footprint that it stands for, times the number of samples.
    pub weight: f64,
    /// How far along the whole area it lies.
    pub place: f64,
}

impl Facets {
    pub(super) fn push(&mut self, small: &SmallScale, surface: &Surface, sample: Option<&Sample>) {
        let (mut position, mut normal, mut weight, mut tint) = (DVec3::ZERO, DVec3::Z, 0.0, [0.0; 3]);
        if let Some(sample) = sample {
            let t = sample.triangle as usize;
            let bary = sample.barycentric;
            let corners = surface.corners(t);
            position = corners[0] * bary[0] + corners[1] * bary[1] + corners[2] * bary[2];
            normal = surface.normals[t];
            weight = sample.weight;
            tint = match &small.surfaces[usize::from(surface.surface[t])].tint {
                // Uniform tints are part of the lobes' colours.
                Tint::Uniform(_) => [1.0; 3],
                Tint::Image(image) => {
                    let uv =
                        small.tile.uv.as_ref().expect("Material::build refuses an image without uv")[surface.tile_triangle[t] as usize];
                    image.lookup(uv[0] * bary[0] + uv[1] * bary[1] + uv[2] * bary[2])
                }
            };
        }
        self.triangle.push(sample.map_or(NO_TRIANGLE, |s| s.triangle));
        self.position.push(position);
        for (component, value) in self.normal.iter_mut().zip(normal.to_array()) {
            component.push(narrow(value));
        }
        self.weight.push(narrow(weight));
        self.along.push(narrow(sample.map_or(0.0, |s| s.place)));
        if let Some(components) = &mut self.tint {
            for (component, value) in components.iter_mut().zip(tint) {
                component.push(value);
            }
        }
    }
}
