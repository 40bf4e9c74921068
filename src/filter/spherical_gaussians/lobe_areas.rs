//! What a pair sees of each lobe of the normals, from the facets that belong to it.
//!
//! By *responsibilities*: each facet belongs to the lobes by the shares that the mixture has of its normal. The visible projected area
//! `(n·wi)+ (n·wo)+ V(wi) V(wo) dA` of a lobe is a sum over its facets, so no area is lost or negative; and the share of the area facing both
//! directions that is visible is what the lobe's density is multiplied by where the cosines are known better, near the half vector.

use super::normals::NormalLobes;
use crate::facets::{Facets, NO_TRIANGLE};
use crate::filter::plan::AmplitudeFit;
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::{index_u32, narrow};
use crate::sg::{Lobe, MAX_SHARPNESS};
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::DVec3;
use std::ops::Range;

/// A facet does not count for a lobe that has less of it; the others share it. Chosen, not measured: errors are measured with it.
const LEAST_SHARE: f64 = 1e-3;

/// What a pair sees of one lobe, over the footprint; a number a channel where facets have colours, else one in the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LobeArea {
    /// `∫ (n·wi)+ (n·wo)+ V(wi) V(wo) dA` of the lobe's facets.
    pub projected: [f32; 3],
    /// The lobe's area times the share of its facets facing both directions that both see.
    pub visible: [f32; 3],
}

/// The facets that count for each lobe of a surface.
pub struct LobeFacets<'a> {
    seen: &'a VisibleFacets,
    /// Facets, those of one lobe after those of another, filled up to whole lanes with facets of weight 0.
    members: Vec<u32>,
    /// Weight of each member over the footprint, for each channel.
    weights: Vec<Vec<Lanes>>,
    /// Chunks of lanes of each lobe.
    chunks: Vec<Range<usize>>,
    /// Area over the footprint of each lobe, by channel.
    pub areas: Vec<[f32; 3]>,
}

impl<'a> LobeFacets<'a> {
    /// For the facets `range` of a surface and its lobes.
    pub fn new(seen: &'a VisibleFacets, range: Range<usize>, lobes: &NormalLobes, fit: AmplitudeFit, tinted: bool) -> Self {
        let facets = &seen.facets;
        let count = lobes.densities.len();
        let own: Vec<usize> = range.filter(|&f| facets.triangle[f] != NO_TRIANGLE).collect();
        let mut members: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
        let mut shares = vec![0.0; count];
        let mixture = lobes.mixture.weighted();
        for &f in &own {
            let normal = facets.normal_of(f);
            match fit {
                AmplitudeFit::Responsibilities => {
                    mixture.responsibilities(normal.as_dvec3(), &mut shares);
                    shares.iter_mut().filter(|s| **s < LEAST_SHARE).for_each(|s| *s = 0.0);
                    let sum: f64 = shares.iter().sum();
                    shares.iter_mut().for_each(|s| *s /= sum);
                }
                AmplitudeFit::LeastSquares | AmplitudeFit::NonNegative => {
                    // A facet's normal is a lobe of the largest sharpness: a peak of no width has twice its area in the Gaussian of any width that comes
                    // nearest to it.
                    let facet = Lobe::density(normal, narrow(MAX_SHARPNESS));
                    for (share, lobe) in shares.iter_mut().zip(&lobes.densities) {
                        let peak = Lobe { amplitude: 1.0, ..*lobe };
                        *share = f64::from(peak.product_integral(&facet));
                    }
                }
            }
            members.iter_mut().zip(&shares).filter(|(_, s)| **s > 0.0).for_each(|(m, &s)| m.push((index_u32(f), s)));
        }
        let channels = if tinted { 3 } else { 1 };
        let mut of = Self { seen, members: Vec::new(), weights: vec![Vec::new(); channels], chunks: Vec::new(), areas: Vec::new() };
        for lobe in &members {
            of.push(facets, lobe);
        }
        of
    }

    /// Adds the members of a lobe.
    fn push(&mut self, facets: &Facets, lobe: &[(u32, f64)]) {
        let first = self.members.len() / LANES;
        let mut area = [0.0; 3];
        for chunk in lobe.chunks(LANES) {
            for (c, weights) in self.weights.iter_mut().enumerate() {
                let mut lanes = [0.0; LANES];
                for (lane, &(f, share)) in lanes.iter_mut().zip(chunk) {
                    let tint = facets.tint.as_ref().map_or(1.0, |tint| f64::from(tint[c][f as usize]));
                    let weight = share * tint * f64::from(facets.weight[f as usize]) / facets.samples as f64;
                    area[c] += weight;
                    *lane = narrow(weight);
                }
                weights.push(lanes);
            }
            let filled = chunk.iter().map(|m| m.0).chain(std::iter::repeat(chunk[0].0)).take(LANES);
            self.members.extend(filled);
        }
        self.chunks.push(first..self.members.len() / LANES);
        self.areas.push(area.map(narrow));
    }

    /// Channels that differ.
    pub fn channels(&self) -> usize {
        self.weights.len()
    }

    /// Lobes.
    pub fn lobes(&self) -> usize {
        self.chunks.len()
    }

    /// Lanes of a view of all members.
    pub fn view_len(&self) -> usize {
        self.members.len() / LANES
    }

    /// Appends how a direction sees the members: the cosine where a facet is seen, minus it where it is faced and hidden, 0 where it is turned away.
    pub fn view(&self, direction: DVec3, bits: &[u64], views: &mut Vec<Lanes>) {
        let facets = &self.seen.facets;
        let w = direction.as_vec3();
        for members in self.members.chunks_exact(LANES) {
            views.push(std::array::from_fn(|l| {
                let f = members[l] as usize;
                let cosine = facets.normal_of(f).dot(w).clamp(0.0, 1.0);
                if bits[f / 64] >> (f % 64) & 1 == 1 { cosine } else { -cosine }
            }));
        }
    }
}

/// Sums over the facets of each lobe for one pair.
pub struct PairAreas<'a> {
    /// The facets.
    pub facets: &'a LobeFacets<'a>,
    /// How each of the two directions sees the members.
    pub views: [&'a [Lanes]; 2],
    /// One a lobe.
    pub areas: &'a mut [LobeArea],
}

impl Kernel for PairAreas<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let LobeFacets { weights, chunks, areas, .. } = self.facets;
        let [to_light, to_viewer] = self.views;
        for ((out, chunks), area) in self.areas.iter_mut().zip(chunks).zip(areas) {
            for (c, weights) in weights.iter().enumerate() {
                let (mut projected, mut visible, mut facing) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
                for k in chunks.clone() {
                    let (a, b, w) = (&to_light[k], &to_viewer[k], &weights[k]);
                    for l in 0..LANES {
                        let seen = if a[l] > 0.0 && b[l] > 0.0 { w[l] } else { 0.0 };
                        let faced = if a[l] != 0.0 && b[l] != 0.0 { w[l] } else { 0.0 };
                        projected[l] += seen * (a[l] * b[l]);
                        visible[l] += seen;
                        facing[l] += faced;
                    }
                }
                let [projected, visible, facing] = [projected, visible, facing].map(simd::sum);
                out.projected[c] = projected;
                out.visible[c] = if facing > 0.0 { area[c] * (visible / facing) } else { 0.0 };
            }
        }
    }
}
