//! What one view shows of the facets, and the sums of their light in each texel.
//!
//! Facets are spread over the surface, and each lands in the texel that shows it. So one set of visibility bits, a row a direction, serves all pairs of
//! views and lights. Sums are kept for each of the eight replicates of the facets ([`crate::facets`]): their spread is the standard error.

use super::reference_plane::ReferencePlane;
use crate::facets::{Facets, Group, NO_TRIANGLE, REPLICATES};
use crate::filter::{Half, Lobe, cosines};
use crate::numerics::cast::{index_u32, narrow};
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::DVec3;
use std::ops::Range;

/// Sums of a texel and a replicate: light of the three channels.
pub type Sum = [f32; 4];

/// The facets that a view shows, in chunks of [`LANES`].
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Their places among all facets; those that fill up a chunk repeat one, with weight 0.
    facet: Vec<u32>,
    normal: [Vec<f32>; 3],
    /// `n·wo`.
    cosine: Vec<f32>,
    /// The weight of [`Facets::weight`].
    weight: Vec<f32>,
    /// Texel times [`REPLICATES`] plus replicate.
    place: Vec<u32>,
    tint: Option<[Vec<f32>; 3]>,
    /// For each group of facets its chunks.
    ranges: Vec<Range<usize>>,
    /// By texel and replicate the projected area that is seen, in the unit of the sums of light.
    pub area: Vec<f32>,
}

/// What all views and lights share.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    pub facets: &'a Facets,
    pub groups: &'a [Group],
    /// The lobes of each surface.
    pub lobes: &'a [Vec<Lobe<'a>>],
    pub plane: &'a ReferencePlane,
    /// Unit of the facets' positions.
    pub unit: f64,
}

impl Seen {
    /// What is seen from `wo`, where `bits` is its row of visibility bits.
    pub fn new(scene: Scene<'_>, wo: DVec3, bits: &[u64]) -> Self {
        let Scene { facets, plane, unit, .. } = scene;
        let mut seen =
            Self { area: vec![0.0; plane.count() * REPLICATES], tint: facets.tint.as_ref().map(|_| Default::default()), ..Self::default() };
        for range in &facets.ranges {
            let start = seen.facet.len();
            for f in range.clone() {
                if bits[f / 64] >> (f % 64) & 1 == 0 || facets.triangle[f] == NO_TRIANGLE {
                    continue;
                }
                let cosine = facets.normal_of(f).dot(wo.as_vec3());
                if cosine > 0.0 {
                    let place = plane.texel(facets.position[f] * unit, wo) * REPLICATES + f % REPLICATES;
                    seen.area[place] += facets.weight[f] * cosine;
                    seen.push(facets, f, cosine, facets.weight[f], place);
                }
            }
            while seen.facet.len() > start && !seen.facet.len().is_multiple_of(LANES) {
                let last = seen.facet.len() - 1;
                let (facet, cosine, place) = (seen.facet[last] as usize, seen.cosine[last], seen.place[last] as usize);
                seen.push(facets, facet, cosine, 0.0, place);
            }
            seen.ranges.push(start..seen.facet.len());
        }
        seen
    }

    fn push(&mut self, facets: &Facets, facet: usize, cosine: f32, weight: f32, place: usize) {
        self.facet.push(index_u32(facet));
        (0..3).for_each(|k| self.normal[k].push(facets.normal[k][facet]));
        self.cosine.push(cosine);
        self.weight.push(weight);
        self.place.push(index_u32(place));
        if let (Some(tint), Some(of)) = (&mut self.tint, &facets.tint) {
            (0..3).for_each(|k| tint[k].push(of[k][facet]));
        }
    }

    /// Adds the light of all facets that both see to `sums`, by texel and replicate; `bits` is the row of `wi`.
    pub fn add_light(&self, scene: Scene<'_>, wo: DVec3, (wi, bits): (DVec3, &[u64]), sums: &mut [Sum]) {
        simd::run(AddLight { seen: self, scene, wo, wi, bits, sums });
    }
}

struct AddLight<'a> {
    seen: &'a Seen,
    scene: Scene<'a>,
    wo: DVec3,
    wi: DVec3,
    bits: &'a [u64],
    sums: &'a mut [Sum],
}

impl Kernel for AddLight<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { seen, scene, wo, wi, bits, sums } = self;
        let half = Half::new(wi, wo);
        let i_dot_h = 0.5 * (wi + wo).length();
        for (range, group) in seen.ranges.iter().zip(scene.groups) {
            for lobe in &scene.lobes[usize::from(group.surface)] {
                let colour = lobe.colour_at(i_dot_h).map(narrow);
                for chunk in range.clone().step_by(LANES) {
                    let normals: [Lanes; 3] = std::array::from_fn(|k| lanes(&seen.normal[k], chunk));
                    let mut cos_i = cosines(&normals, wi.as_vec3());
                    let mut any = false;
                    for l in 0..LANES {
                        let facet = seen.facet[chunk + l];
                        let lit = bits[(facet / 64) as usize] >> (facet % 64) & 1 == 1 && cos_i[l] > 0.0;
                        cos_i[l] = if lit { cos_i[l] } else { 0.0 };
                        any |= lit;
                    }
                    if !any {
                        continue;
                    }
                    let cos_o = lanes(&seen.cosine, chunk);
                    let mut light = if lobe.table.is_some() {
                        let mut values = lobe.table_values(&normals, wi, wo);
                        for l in 0..LANES {
                            (0..3).for_each(|c| values[c][l] = if cos_i[l] > 0.0 { colour[c] * values[c][l] } else { 0.0 });
                        }
                        values
                    } else {
                        let value = lobe.at_normals(&normals, [&cos_i, &cos_o], [wi, wo], &half);
                        std::array::from_fn(|c| value.map(|v| colour[c] * v))
                    };
                    if let Some(tint) = &seen.tint {
                        for c in 0..3 {
                            let tint = lanes(&tint[c], chunk);
                            (0..LANES).for_each(|l| light[c][l] *= tint[l]);
                        }
                    }
                    for l in 0..LANES {
                        let weight = seen.weight[chunk + l];
                        let sum = &mut sums[seen.place[chunk + l] as usize];
                        (0..3).for_each(|c| sum[c] += weight * light[c][l]);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn lanes(of: &[f32], at: usize) -> Lanes {
    let mut out = [0.0; LANES];
    out.copy_from_slice(&of[at..at + LANES]);
    out
}
