//! Sums over normal clusters: popcounts of visibility bits times one BRDF value a cluster.
//!
//! The plain twin of this file is `facets.rs`, facet by facet; clusters of equal normals give the same sums, wider ones differ by a bias
//! that the caller measures.

use super::task::{PairSums, TaskPair};
use crate::bvndf::{WORDS_PER_BYTES, both_see, by_replicate};
use crate::clusters::Cluster;
use crate::facets::REPLICATES;
use crate::filter::lobes::{Lobe, Masking, Shape, cosines};
use crate::numerics::cast::narrow;
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::{DVec3, Vec3};
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
                chunk.height[l] = narrow(alpha2 / determinant.sqrt());
                for (lane, value) in chunk.inverse.iter_mut().zip([d / determinant, -xy / determinant, a / determinant]) {
                    lane[l] = narrow(value);
                }
                for (lane, value) in chunk.moment.iter_mut().zip(cluster.moment) {
                    lane[l] = narrow(value);
                }
                for c in 0..3 {
                    chunk.normal[c][l] = narrow(cluster.normal[c]);
                    for (t, tangent) in cluster.tangents.iter().enumerate() {
                        chunk.tangents[t][c][l] = narrow(tangent[c]);
                    }
                }
            }
            chunk
        };
        Self { lobe, chunks: clusters.chunks(LANES).map(chunk).collect() }
    }
}

/// What each direction of a task sees of the clusters of a surface: memory that one task after another uses.
#[derive(Debug, Default)]
pub struct ClusterViews {
    /// For each direction and chunk of clusters: bit `l` says that some facet of cluster `l` is seen.
    seen: Vec<u16>,
    /// For each direction the words of the clusters, turned by [`by_replicate`].
    words: Vec<u64>,
    /// For each lobe, direction and chunk: the lobe's [`Masking`] at the mean normals.
    masking: Vec<Lanes>,
}

/// The clusters of one surface, for a task.
pub struct Clustered<'a> {
    /// The words of each cluster's facets.
    pub ranges: &'a [Range<usize>],
    /// The surface's lobes.
    pub lobes: &'a [ClusteredLobe<'a>],
    /// What a facet stands for.
    pub weight: f64,
}

impl Clustered<'_> {
    /// Adds to `sums`, one element a pair, the sums over the clusters; `directions` are those of the task, with their bits.
    pub fn add(&self, directions: &[(DVec3, &[u64])], pairs: &[TaskPair], views: &mut ClusterViews, sums: &mut [PairSums]) {
        simd::run(Add { clustered: self, directions, pairs, views, sums });
    }
}

struct Add<'a> {
    clustered: &'a Clustered<'a>,
    directions: &'a [(DVec3, &'a [u64])],
    pairs: &'a [TaskPair],
    views: &'a mut ClusterViews,
    sums: &'a mut [PairSums],
}

impl Kernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { clustered: Clustered { ranges, lobes, weight }, directions, pairs, views, sums } = self;
        let chunks = ranges.len().div_ceil(LANES);
        let places = views.see(ranges, lobes, directions);
        // One number a replicate for each lobe, three for a table.
        let mut acc = vec![[0.0_f32; REPLICATES]; lobes.len()];
        let mut tables = vec![[[0.0_f32; REPLICATES]; 3]; lobes.len()];
        let mut values = vec![[0.0; LANES]; lobes.len()];
        let mut table_values = vec![[[0.0; LANES]; 3]; lobes.len()];
        let mut both = Vec::new();
        for (pair, sums) in pairs.iter().zip(sums) {
            let words = [views.words_of(pair.i, directions.len()), views.words_of(pair.o, directions.len())];
            acc.fill([0.0; REPLICATES]);
            tables.fill([[0.0; REPLICATES]; 3]);
            for k in 0..chunks {
                let mut left = views.seen[pair.i * chunks + k] & views.seen[pair.o * chunks + k];
                if left == 0 {
                    continue;
                }
                for (j, lobe) in lobes.iter().enumerate() {
                    if lobe.lobe.table.is_some() {
                        table_values[j] = lobe.lobe.table_values(&lobe.chunks[k].normal, pair.wi, pair.wo);
                    } else {
                        let masking = |d: usize| &views.masking[(j * directions.len() + d) * chunks + k];
                        values[j] = lobe.values(&lobe.chunks[k], pair, masking(pair.i), masking(pair.o));
                    }
                }
                let of_chunk = &places[k * LANES..places.len().min((k + 1) * LANES)];
                let first = of_chunk[0].start;
                let of_all = first..of_chunk[of_chunk.len() - 1].end;
                see_both(&words[0][of_all.clone()], &words[1][of_all], &mut both);
                while left != 0 {
                    let l = left.trailing_zeros() as usize;
                    left &= left - 1;
                    let count = counts(&both[of_chunk[l].start - first..of_chunk[l].end - first]);
                    for j in 0..lobes.len() {
                        let value = values[j][l];
                        for r in 0..REPLICATES {
                            acc[j][r] += value * count[r];
                        }
                        if lobes[j].lobe.table.is_some() {
                            for c in 0..3 {
                                for r in 0..REPLICATES {
                                    tables[j][c][r] += table_values[j][c][l] * count[r];
                                }
                            }
                        }
                    }
                }
            }
            let i_dot_h = 0.5 * (pair.wi + pair.wo).length();
            for (j, lobe) in lobes.iter().enumerate() {
                add_colours(lobe.lobe, i_dot_h, *weight, &acc[j], &tables[j], sums);
            }
        }
    }
}

/// Adds to the sums of a pair what a lobe adds up to: of a table each channel by itself, of a formula one number times its colour.
#[inline(always)]
fn add_colours(
    lobe: &Lobe<'_>,
    i_dot_h: f64,
    weight: f64,
    formula: &[f32; REPLICATES],
    table: &[[f32; REPLICATES]; 3],
    sums: &mut PairSums,
) {
    let colour = lobe.colour_at(i_dot_h);
    for r in 0..REPLICATES {
        for c in 0..3 {
            let total = if lobe.table.is_some() { table[c][r] } else { formula[r] };
            sums[r][c] += weight * colour[c] * f64::from(total);
        }
    }
}

/// Facets of each word that both directions see, packed.
#[inline(always)]
fn see_both(light: &[u64], viewer: &[u64], both: &mut Vec<u64>) {
    both.resize(light.len().max(both.len()), 0);
    let both = &mut both[..light.len()];
    let viewer = &viewer[..light.len()];
    for w in 0..light.len() {
        both[w] = both_see(light[w], viewer[w]);
    }
}

/// Facets of a cluster that both directions see, for each replicate, from those of its words.
#[inline(always)]
fn counts(packed: &[u64]) -> [f32; REPLICATES] {
    let mut counts = [0.0; REPLICATES];
    for words in packed.chunks(WORDS_PER_BYTES) {
        let mut sum = 0;
        for word in words {
            sum += word;
        }
        let bytes = sum.to_le_bytes();
        for r in 0..REPLICATES {
            counts[r] += f32::from(bytes[r]);
        }
    }
    counts
}

impl ClusterViews {
    #[inline(always)]
    fn words_of(&self, d: usize, directions: usize) -> &[u64] {
        let words = self.words.len() / directions;
        &self.words[d * words..(d + 1) * words]
    }

    /// Looks at the clusters whose words are `ranges` from all directions, and gives the places of each cluster's words in [`Self::words`].
    #[inline(always)]
    fn see(&mut self, ranges: &[Range<usize>], lobes: &[ClusteredLobe<'_>], directions: &[(DVec3, &[u64])]) -> Vec<Range<usize>> {
        let chunks = ranges.len().div_ceil(LANES);
        let mut places = Vec::with_capacity(ranges.len());
        let mut total = 0;
        for range in ranges {
            places.push(total..total + range.len());
            total += range.len();
        }
        self.seen.clear();
        self.words.clear();
        for &(_, bits) in directions {
            for ranges in ranges.chunks(LANES) {
                let mut seen = 0;
                for (l, range) in ranges.iter().enumerate() {
                    let mut any = 0;
                    for &word in &bits[range.clone()] {
                        any |= word;
                        self.words.push(by_replicate(word));
                    }
                    seen |= u16::from(any != 0) << l;
                }
                self.seen.push(seen);
            }
        }
        self.masking.clear();
        for lobe in lobes {
            for (d, (w, _)) in directions.iter().enumerate() {
                let w = w.as_vec3();
                for k in 0..chunks {
                    let mut cosine = [0.0; LANES];
                    if self.seen[d * chunks + k] != 0 {
                        cosine = cosines(&lobe.chunks[k].normal, w);
                        for l in 0..LANES {
                            cosine[l] = cosine[l].clamp(0.0, 1.0);
                        }
                    }
                    self.masking.push(lobe.lobe.masking.eval(&cosine));
                }
            }
        }
        places
    }
}

impl ClusteredLobe<'_> {
    /// `fr (n·i)(n·o)` without the colour of each cluster of a chunk; `masking_i` and `masking_o` are the lobe's [`Masking`] at their mean normals.
    #[inline(always)]
    fn values(&self, chunk: &Chunk, pair: &TaskPair, masking_i: &Lanes, masking_o: &Lanes) -> Lanes {
        let mut value = [0.0; LANES];
        if self.lobe.shape == Shape::Constant && self.lobe.masking == Masking::Cosine {
            let (i, o) = (pair.wi.as_vec3(), pair.wo.as_vec3());
            // Products of i and o: they have the same bits both ways round.
            let square = [i.x * o.x, i.y * o.y, i.z * o.z];
            let mixed = [i.x * o.y + i.y * o.x, i.x * o.z + i.z * o.x, i.y * o.z + i.z * o.y];
            let m = &chunk.moment;
            for l in 0..LANES {
                let squares = m[0][l] * square[0] + m[1][l] * square[1] + m[2][l] * square[2];
                value[l] = (squares + (m[3][l] * mixed[0] + m[4][l] * mixed[1] + m[5][l] * mixed[2])).max(0.0);
            }
        } else {
            let shape = self.widened(chunk, pair.half.h);
            for l in 0..LANES {
                value[l] = masking_i[l] * masking_o[l] * shape[l];
            }
        }
        value
    }

    /// The lobe's [`Shape`] at the half vector, widened by the spread of each cluster.
    #[inline(always)]
    fn widened(&self, chunk: &Chunk, h: [f32; 3]) -> Lanes {
        let h = Vec3::from_array(h);
        let (x, y, z) = (cosines(&chunk.tangents[0], h), cosines(&chunk.tangents[1], h), cosines(&chunk.normal, h));
        // The isotropic shapes by sin² and cos², at roughness 1 along the scaled axes: sin² / alpha² becomes a quadratic form.
        let (mut form, mut cos2) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            form[l] = chunk.inverse[0][l] * x[l] * x[l] + 2.0 * chunk.inverse[1][l] * x[l] * y[l] + chunk.inverse[2][l] * y[l] * y[l];
            cos2[l] = z[l] * z[l];
        }
        let (shape, factor) = match self.lobe.shape {
            Shape::Ggx(a2) => (Shape::Ggx(1.0), 1.0 / (a2 * a2)),
            Shape::Beckmann(_) => (Shape::Beckmann(1.0), 1.0),
            Shape::Ward(_) => (Shape::Ward(1.0), 1.0),
            // The form is sin² itself here, and the height 1.
            shape => (shape, 1.0),
        };
        let [mut value] = shape.eval(&[form], &[cos2]);
        for l in 0..LANES {
            value[l] *= chunk.height[l] * factor;
        }
        value
    }
}
