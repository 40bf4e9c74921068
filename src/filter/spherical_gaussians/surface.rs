//! One surface: the lobes of its normals with a row of amplitudes a pair, and the lobes of its BRDF -> `S` of each pair.

use super::amplitudes::AmplitudeLayout;
use super::brdf_lobes::{BrdfLobe, MeasuredSums, brdf_lobes};
use super::integrals::{PairIntegral, Room};
use crate::brdf::Colour;
use crate::filter::plan::{BrdfLobes, SphericalGaussianPlan};
use crate::filter::query::Query;
use crate::material::{Surface, Tint};
use crate::sg::Lobe;
use crate::simd;
use rayon::prelude::*;
use std::ops::Range;

/// Lobes of a surface's normals, and what its amplitudes mean.
pub struct SurfaceLobes<'a> {
    /// How all was fitted.
    pub plan: &'a SphericalGaussianPlan,
    /// The lobes, with an integral of 1.
    pub densities: &'a [Lobe],
    /// What the numbers of a row mean.
    pub layout: &'a AmplitudeLayout,
}

/// Lobes of a surface's BRDF.
pub struct SurfaceBrdf<'a> {
    /// Constant part.
    pub constant: Colour,
    /// Sums of lobes about the half vector.
    pub sums: Vec<BrdfLobe<'a>>,
}

impl<'a> SurfaceBrdf<'a> {
    /// Those of a surface; colours of facets are in the amplitudes.
    pub fn new(surface: &'a Surface, kind: BrdfLobes, measured: &MeasuredSums) -> Self {
        let tint = if let Tint::Uniform(tint) = surface.tint { tint } else { [1.0; 3] };
        let (constant, sums) = brdf_lobes(&surface.brdf, tint, kind, measured);
        Self { constant, sums }
    }

    /// Spherical Gaussians of the BRDF.
    pub fn lobes(&self) -> usize {
        self.sums.iter().map(|b| b.sharpness.iter().flatten().filter(|l| **l > 0.0).count()).sum()
    }

    /// The largest relative RMS error of a sum of them.
    pub fn error(&self) -> f64 {
        self.sums.iter().map(|b| b.relative_rms).fold(0.0, f64::max)
    }
}

impl SurfaceLobes<'_> {
    /// Adds `S` of the pairs `range` of the query, whose amplitudes are `rows`.
    pub fn integrate(&self, brdf: &SurfaceBrdf<'_>, query: &Query, range: Range<usize>, rows: &[f32], values: &mut [[f64; 3]]) {
        if self.densities.is_empty() {
            return;
        }
        let rows = values.par_iter_mut().zip(rows.par_chunks_exact(self.layout.row())).zip(&query.pairs[range]);
        rows.for_each_init(Room::default, |room, ((value, row), pair)| {
            let integral = PairIntegral {
                normals: self.densities,
                layout: self.layout,
                row,
                fit: self.plan.amplitudes,
                integral: self.plan.integral,
                constant: brdf.constant,
                brdf: &brdf.sums,
                directions: pair.map(|d| query.directions[d as usize]),
                room,
            };
            let s = simd::run(integral);
            (0..3).for_each(|c| value[c] += s[c]);
        });
    }
}
