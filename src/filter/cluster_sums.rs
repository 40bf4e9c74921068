//! Sums over normal clusters: popcounts of visibility bits times one BRDF value a cluster.
//!
//! The plain twin of this file is `sums.rs`, facet by facet; clusters of equal normals give the same sums, wider ones differ by a bias
//! that the caller measures.

use super::estimate::PairSums;
use super::lobes::{Half, Lanes, Lobe, Shape, Side};
use crate::bvndf::both_see;
use crate::clusters::Cluster;
use crate::facets::{LANES, SETS};
use crate::simd::{self, Kernel};
use glam::DVec3;
use std::ops::Range;

/// [`LANES`] clusters, structure of arrays.
#[derive(Clone, Copy, Default)]
struct Chunk {
    normal: [Lanes; 3],
    tangents: [[Lanes; 3]; 2],
    moment: [Lanes; 6],
    /// Inverse of the widened squared roughness, xx, xy, yy.
    inverse: [Lanes; 3],
    /// Height of the widened lobe over that of the narrow one.
    height: Lanes,
}

/// The clusters of a surface under one lobe.
pub struct ClusteredLobe<'a> {
    lobe: &'a Lobe<'a>,
    chunks: Vec<Chunk>,
}

impl<'a> ClusteredLobe<'a> {
    /// Widens a lobe by the spread of each cluster.
    #[expect(clippy::cast_possible_truncation, reason = "the sums are in f32")]
    pub fn new(lobe: &'a Lobe<'a>, clusters: &[&Cluster]) -> Self {
        let alpha2 = match lobe.shape {
            Shape::Ggx(a2) => f64::from(a2),
            Shape::Beckmann(inverse) | Shape::Ward(inverse) => 1.0 / f64::from(inverse),
            // Not widened: such surfaces have clusters of equal normals only.
            Shape::Constant | Shape::Power(_) => 1.0,
        };
        let chunk = |clusters: &[&Cluster]| {
            let mut chunk = Chunk::default();
            for (l, cluster) in clusters.iter().enumerate() {
                let [xx, xy, yy] = cluster.covariance.map(|c| 2.0 * c);
                let (a, d) = (alpha2 + xx, alpha2 + yy);
                let determinant = a * d - xy * xy;
                chunk.height[l] = (alpha2 / determinant.sqrt()) as f32;
                for (lane, value) in chunk.inverse.iter_mut().zip([d / determinant, -xy / determinant, a / determinant]) {
                    lane[l] = value as f32;
                }
                for (lane, value) in chunk.moment.iter_mut().zip(cluster.moment) {
                    lane[l] = value as f32;
                }
                for c in 0..3 {
                    chunk.normal[c][l] = cluster.normal[c] as f32;
                    for (t, tangent) in cluster.tangents.iter().enumerate() {
                        chunk.tangents[t][c][l] = tangent[c] as f32;
                    }
                }
            }
            chunk
        };
        Self { lobe, chunks: clusters.chunks(LANES).map(chunk).collect() }
    }
}

/// A pair of directions, the words of their visibility bits, and what the half vector says.
pub struct ClusteredPair<'a> {
    /// To the light.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
    /// Words of all facets.
    pub bits: [&'a [u64]; 2],
    /// Their half vector.
    pub half: Half,
}

/// Adds to `sums` the sums over the clusters of a surface, whose facets are the words `ranges` and stand for `weight` each.
pub fn add_clusters(pair: &ClusteredPair<'_>, ranges: &[Range<usize>], lobes: &[ClusteredLobe<'_>], weight: f64, sums: &mut PairSums) {
    simd::run(Add { pair, ranges, lobes, weight, sums });
}

struct Add<'a> {
    pair: &'a ClusteredPair<'a>,
    ranges: &'a [Range<usize>],
    lobes: &'a [ClusteredLobe<'a>],
    weight: f64,
    sums: &'a mut PairSums,
}

impl Kernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { pair, ranges, lobes, weight, sums } = self;
        let colours: Vec<[f64; 3]> = {
            let i_dot_h = 0.5 * (pair.wi + pair.wo).length();
            lobes.iter().map(|l| l.lobe.colour_at(i_dot_h).map(|c| c * weight)).collect()
        };
        for (k, ranges) in ranges.chunks(LANES).enumerate() {
            let mut counts = [[0; SETS]; LANES];
            let mut any = 0;
            for (count, range) in counts.iter_mut().zip(ranges) {
                *count = both_see(&pair.bits[0][range.clone()], &pair.bits[1][range.clone()]);
                any |= count.iter().fold(0, |a, &b| a | b);
            }
            if any == 0 {
                continue;
            }
            for (lobe, colour) in lobes.iter().zip(&colours) {
                let values = lobe.values(&lobe.chunks[k], pair, &counts);
                for (value, count) in values.iter().zip(&counts).take(ranges.len()) {
                    for (set, &n) in sums.iter_mut().zip(count) {
                        for c in 0..3 {
                            set[c] += colour[c] * f64::from(value[c]) * f64::from(n);
                        }
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn dot(n: &[Lanes; 3], w: [f32; 3]) -> Lanes {
    std::array::from_fn(|l| n[0][l] * w[0] + n[1][l] * w[1] + n[2][l] * w[2])
}

impl ClusteredLobe<'_> {
    /// `fr (n·i)(n·o)` without the colour, for three channels, of each cluster of a chunk.
    #[inline(always)]
    fn values(&self, chunk: &Chunk, pair: &ClusteredPair<'_>, counts: &[[u32; SETS]; LANES]) -> [[f32; 3]; LANES] {
        let (i, o) = (pair.wi.as_vec3().to_array(), pair.wo.as_vec3().to_array());
        if let Some(measured) = self.lobe.whole {
            return std::array::from_fn(|l| {
                if counts[l] == [0; SETS] {
                    return [0.0; 3];
                }
                let n = glam::Vec3::new(chunk.normal[0][l], chunk.normal[1][l], chunk.normal[2][l]);
                let factor = n.dot(i.into()).max(0.0) * n.dot(o.into()).max(0.0);
                measured.eval_f32(n, i.into(), o.into()).map(|fr| fr * factor)
            });
        }
        let mut value = [0.0; LANES];
        if self.lobe.shape == Shape::Constant && self.lobe.side == Side::Cosine {
            let m = &chunk.moment;
            for l in 0..LANES {
                let xy =
                    m[3][l] * (i[0] * o[1] + i[1] * o[0]) + m[4][l] * (i[0] * o[2] + i[2] * o[0]) + m[5][l] * (i[1] * o[2] + i[2] * o[1]);
                // Products of i and o first: they have the same bits both ways round.
                let squares = m[0][l] * (i[0] * o[0]) + m[1][l] * (i[1] * o[1]) + m[2][l] * (i[2] * o[2]);
                value[l] = (squares + xy).max(0.0);
            }
        } else {
            let clamp = |c: Lanes| c.map(|c| c.clamp(0.0, 1.0));
            let (side_i, side_o) = (self.lobe.side.eval(&clamp(dot(&chunk.normal, i))), self.lobe.side.eval(&clamp(dot(&chunk.normal, o))));
            let shape = self.widened(chunk, pair.half.h);
            for l in 0..LANES {
                value[l] = side_i[l] * side_o[l] * shape[l];
            }
        }
        value.map(|v| [v; 3])
    }

    /// The lobe's [`Shape`] at the half vector, widened by the spread of each cluster.
    #[inline(always)]
    fn widened(&self, chunk: &Chunk, h: [f32; 3]) -> Lanes {
        let (x, y, z) = (dot(&chunk.tangents[0], h), dot(&chunk.tangents[1], h), dot(&chunk.normal, h));
        // The isotropic shapes by sin² and cos², at roughness 1 along the scaled axes: sin² / alpha² becomes a quadratic form.
        let (mut form, mut cos2) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            form[l] = chunk.inverse[0][l] * x[l] * x[l] + 2.0 * chunk.inverse[1][l] * x[l] * y[l] + chunk.inverse[2][l] * y[l] * y[l];
            cos2[l] = z[l] * z[l];
        }
        match self.lobe.shape {
            Shape::Ggx(a2) => {
                let unit = Shape::Ggx(1.0).eval(&form, &cos2);
                std::array::from_fn(|l| unit[l] * chunk.height[l] / (a2 * a2))
            }
            Shape::Beckmann(_) => {
                let unit = Shape::Beckmann(1.0).eval(&form, &cos2);
                std::array::from_fn(|l| unit[l] * chunk.height[l])
            }
            Shape::Ward(_) => {
                let unit = Shape::Ward(1.0).eval(&form, &cos2);
                std::array::from_fn(|l| unit[l] * chunk.height[l])
            }
            // The form is sin² itself here.
            shape => shape.eval(&form, &cos2),
        }
    }
}
