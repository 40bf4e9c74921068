//! Direct sums over facets: `S` and `av` of many pairs, for eight replicates of facets at once.
//!
//! A task is a run of pairs between few directions. For each block of facets, what depends on one direction ([`Masking`](crate::filter::lobes::Masking) and the
//! visibility bit) is worked out once a direction; what depends on the half vector ([`Shape`]) once a pair, [`LANES`] facets at a
//! time. Lane `l` belongs to replicate `l mod 8`, so the eight sums that the standard error needs cost nothing. Chunks of facets that one
//! of the two directions does not see at all are skipped.
//!
//! Additions happen in an order that the data alone fixes, with no fused operations: the bits are the same at any number of
//! threads and any width of the machine's registers.

use super::tables;
use super::task::{PairSums, TaskPair, of_task};
use super::views::{BLOCK_CHUNKS, View, Views, blocks, lanes, normals};
use crate::facets::{Facets, Group, REPLICATES};
use crate::filter::lobes::{Half, Lobe, Shape, half_angles};
use crate::filter::query::Query;
use crate::simd::{self, Kernel, LANES, Lanes};
use crate::visibility::Bits;
use glam::DVec3;
use std::ops::Range;

/// Blocks after which sums in f32 are added to sums in f64, so that no addend gets lost.
const FLUSH_BLOCKS: usize = 64;

/// What the sums over facets are made of: facets and what they see of the directions of a query, and the lobes of their surfaces.
#[derive(Clone, Copy)]
pub struct FacetSums<'a> {
    /// The facets.
    pub facets: &'a Facets,
    /// One row a direction of `query`.
    pub bits: &'a Bits,
    /// The pairs.
    pub query: &'a Query,
    /// The groups of the facets.
    pub groups: &'a [Group],
    /// The lobes of each surface.
    pub lobes: &'a [Vec<Lobe<'a>>],
}

impl FacetSums<'_> {
    /// Adds to `sums`, one element a pair of `task`, the sums over the facets of all surfaces; `views` is memory that one task after another uses.
    pub fn add(&self, task: Range<usize>, views: &mut Views, sums: &mut [PairSums]) {
        let Self { facets, bits, query, groups, lobes } = *self;
        let (directions, pairs) = of_task(bits, query, task);
        for (range, group) in facets.ranges.iter().zip(groups) {
            for lobe in &lobes[usize::from(group.surface)] {
                simd::run(AddLobe { facets, range: range.clone(), directions: &directions, pairs: &pairs, lobe, views, sums });
            }
        }
    }
}

struct AddLobe<'a> {
    facets: &'a Facets,
    range: Range<usize>,
    directions: &'a [(DVec3, &'a [u64])],
    pairs: &'a [TaskPair],
    lobe: &'a Lobe<'a>,
    views: &'a mut Views,
    sums: &'a mut [PairSums],
}

impl Kernel for AddLobe<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { facets, range, directions, pairs, lobe, views, sums } = self;
        if lobe.table.is_some() {
            return tables::add_table(facets, range, directions, pairs, lobe, sums);
        }
        views.resize(directions.len());
        let channels = if facets.tint.is_some() { 3 } else { 1 };
        let mut acc: Vec<Lanes> = vec![[0.0; LANES]; pairs.len() * channels];
        let mut until_flush = FLUSH_BLOCKS;
        for block in blocks(range.clone()) {
            let mut roots = [[0.0; LANES]; BLOCK_CHUNKS];
            for (k, chunk) in block.clone().step_by(LANES).enumerate() {
                let weight = lanes(&facets.weight, chunk);
                for l in 0..LANES {
                    roots[k][l] = weight[l].sqrt();
                }
            }
            for (d, &direction) in directions.iter().enumerate() {
                views.see(d, facets, block.clone(), &roots, direction, lobe.masking);
            }
            match (&facets.tint, lobe.shape, lobe.shape.is_narrow()) {
                (Some(tint), shape, narrow) => add_tinted(facets, &block, views, pairs, (shape, narrow), tint, &mut acc),
                // Matched here, outside the loops, so that each shape gets loops of its own.
                (None, Shape::Constant, _) => add_runs(&Constant { views }, pairs, &mut acc),
                (None, Shape::Ggx(a2), false) => add_runs(&Wide { views, shape: Shape::Ggx(a2) }, pairs, &mut acc),
                (None, Shape::Beckmann(a), false) => add_runs(&Wide { views, shape: Shape::Beckmann(a) }, pairs, &mut acc),
                (None, Shape::Ward(a), false) => add_runs(&Wide { views, shape: Shape::Ward(a) }, pairs, &mut acc),
                (None, Shape::Power(e), false) => add_runs(&Wide { views, shape: Shape::Power(e) }, pairs, &mut acc),
                (None, shape, true) => add_runs(&Narrow { views, shape, facets, start: block.start }, pairs, &mut acc),
            }
            until_flush -= 1;
            if until_flush == 0 {
                flush(&mut acc, channels, pairs, lobe, sums);
                until_flush = FLUSH_BLOCKS;
            }
        }
        flush(&mut acc, channels, pairs, lobe, sums);
    }
}

/// Adds the sums in f32 to the replicates, coloured, and clears them.
fn flush(acc: &mut [Lanes], channels: usize, pairs: &[TaskPair], lobe: &Lobe<'_>, sums: &mut [PairSums]) {
    for ((acc, pair), sums) in acc.chunks_exact_mut(channels).zip(pairs).zip(sums) {
        let colour = lobe.colour_at(0.5 * (pair.wi + pair.wo).length());
        for (r, set) in sums.iter_mut().enumerate() {
            for c in 0..3 {
                let lanes = &acc[c.min(channels - 1)];
                set[c] += colour[c] * (f64::from(lanes[r]) + f64::from(lanes[r + REPLICATES]));
            }
        }
        acc.fill([0.0; LANES]);
    }
}

/// The chunks that two directions see.
///
/// An iterator and not a function that takes a closure: a closure that is too large to be inlined would be compiled for the oldest
/// processor, and the sums would take three times as long.
struct CommonChunks(u32);

impl Iterator for CommonChunks {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let chunk = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (chunk < BLOCK_CHUNKS).then_some(chunk)
    }
}

/// `sin²` and `cos²` of the half angles of `N` pairs of the same light from `n·h`.
#[inline(always)]
fn half_angles_wide<const N: usize>(i: &Lanes, o: &[&Lanes; N], half: &[Half; N]) -> ([Lanes; N], [Lanes; N]) {
    let (mut sin2, mut cos2) = ([[0.0; LANES]; N], [[0.0; LANES]; N]);
    for l in 0..LANES {
        for p in 0..N {
            let cos = (i[l] + o[p][l]) * half[p].inverse_length;
            cos2[p][l] = (cos * cos).min(1.0);
            sin2[p][l] = 1.0 - cos2[p][l];
        }
    }
    (sin2, cos2)
}

/// How the sums of `N` pairs with the same light grow by a chunk of facets.
///
/// Pairs come by light, and neighbours see nearly the same: what the light sees is loaded once for two of them. Loops run over lanes outside and pairs inside: the other way round the compiler makes vectors of pairs.
trait Summand {
    /// What the directions see.
    fn views(&self) -> &Views;
    /// Adds the facets of chunk `k` of the block.
    fn add<const N: usize>(&self, k: usize, i: View<'_>, o: &[View<'_>; N], half: &[Half; N], sums: &mut [Lanes; N]);
}

/// Sums of products of the sides.
struct Constant<'a> {
    views: &'a Views,
}

/// Sums under a shape, whose half angle comes from the cosines.
struct Wide<'a> {
    views: &'a Views,
    shape: Shape,
}

/// Sums under a narrow shape.
struct Narrow<'a> {
    views: &'a Views,
    shape: Shape,
    facets: &'a Facets,
    /// First facet of the block.
    start: usize,
}

impl Summand for Constant<'_> {
    #[inline(always)]
    fn views(&self) -> &Views {
        self.views
    }

    #[inline(always)]
    fn add<const N: usize>(&self, k: usize, i: View<'_>, o: &[View<'_>; N], _: &[Half; N], sums: &mut [Lanes; N]) {
        let masking = &i.masking[k];
        for l in 0..LANES {
            for p in 0..N {
                sums[p][l] += masking[l] * o[p].masking[k][l];
            }
        }
    }
}

impl Summand for Wide<'_> {
    #[inline(always)]
    fn views(&self) -> &Views {
        self.views
    }

    #[inline(always)]
    fn add<const N: usize>(&self, k: usize, i: View<'_>, o: &[View<'_>; N], half: &[Half; N], sums: &mut [Lanes; N]) {
        let mut cosines = [&i.cosine[k]; N];
        for p in 0..N {
            cosines[p] = &o[p].cosine[k];
        }
        let (sin2, cos2) = half_angles_wide(&i.cosine[k], &cosines, half);
        add_values(self.shape.eval(&sin2, &cos2), k, i, o, sums);
    }
}

impl Summand for Narrow<'_> {
    #[inline(always)]
    fn views(&self) -> &Views {
        self.views
    }

    #[inline(always)]
    fn add<const N: usize>(&self, k: usize, i: View<'_>, o: &[View<'_>; N], half: &[Half; N], sums: &mut [Lanes; N]) {
        let (sin2, cos2) = half_angles(&normals(self.facets, self.start + k * LANES), half);
        add_values(self.shape.eval(&sin2, &cos2), k, i, o, sums);
    }
}

#[inline(always)]
fn add_values<const N: usize>(values: [Lanes; N], k: usize, i: View<'_>, o: &[View<'_>; N], sums: &mut [Lanes; N]) {
    for l in 0..LANES {
        for p in 0..N {
            sums[p][l] += i.masking[k][l] * o[p].masking[k][l] * values[p][l];
        }
    }
}

/// Adds a block of facets to the sums of all pairs, two of the same light at once where there are two (four were slower: too few registers).
#[inline(always)]
fn add_runs(summand: &impl Summand, pairs: &[TaskPair], acc: &mut [Lanes]) {
    let mut at = 0;
    while at < pairs.len() {
        let rest = &pairs[at..];
        if rest.len() > 1 && rest[1].i == rest[0].i {
            add_run::<2>(summand, rest, &mut acc[at..]);
            at += 2;
        } else {
            add_run::<1>(summand, rest, &mut acc[at..]);
            at += 1;
        }
    }
}

#[inline(always)]
fn add_run<const N: usize>(summand: &impl Summand, pairs: &[TaskPair], acc: &mut [Lanes]) {
    let views = summand.views();
    let i = views.of(pairs[0].i);
    let (mut o, mut half, mut sums) = ([i; N], [pairs[0].half; N], [[0.0; LANES]; N]);
    let mut chunks = 0;
    for p in 0..N {
        o[p] = views.of(pairs[p].o);
        half[p] = pairs[p].half;
        sums[p] = acc[p];
        chunks |= o[p].chunks;
    }
    for k in CommonChunks(chunks & i.chunks) {
        summand.add(k, i, &o, &half, &mut sums);
    }
    acc[..N].copy_from_slice(&sums);
}

/// The same with a tint for each facet: three sums a pair.
#[inline(always)]
fn add_tinted(
    facets: &Facets,
    block: &Range<usize>,
    views: &Views,
    pairs: &[TaskPair],
    (shape, narrow): (Shape, bool),
    tint: &[Vec<f32>; 3],
    acc: &mut [Lanes],
) {
    for (pair, acc) in pairs.iter().zip(acc.chunks_exact_mut(3)) {
        let (i, o) = (views.of(pair.i), views.of(pair.o));
        for k in CommonChunks(i.chunks & o.chunks) {
            let chunk = block.start + k * LANES;
            let (sin2, cos2) = if narrow {
                half_angles(&normals(facets, chunk), &[pair.half])
            } else {
                half_angles_wide(&i.cosine[k], &[&o.cosine[k]], &[pair.half])
            };
            let [value] = shape.eval(&sin2, &cos2);
            for (sum, tint) in acc.iter_mut().zip(tint) {
                let tint = lanes(tint, chunk);
                for l in 0..LANES {
                    sum[l] += i.masking[k][l] * o.masking[k][l] * value[l] * tint[l];
                }
            }
        }
    }
}
