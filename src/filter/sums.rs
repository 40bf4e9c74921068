//! Direct sums over facets: `S` and `av` of many pairs, for eight sets of facets at once.
//!
//! A task is a run of pairs between few directions. For each block of facets, what depends on one direction ([`Side`] and the
//! visibility bit) is worked out once a direction; what depends on the half vector ([`Shape`]) once a pair, [`LANES`] facets at a
//! time. Lane `l` belongs to set `l mod 8`, so the eight sums that the standard error needs cost nothing. Chunks of facets that one
//! of the two directions does not see at all are skipped.
//!
//! Additions happen in an order that the data alone fixes, with no fused operations: the bits are the same at any number of
//! threads and any width of the machine's registers.

use super::demand::Demand;
use super::estimate::PairSums;
use super::lobes::{Half, Lanes, Lobe, Shape, Side};
use crate::brdf::Measured;
use crate::facets::{Facets, Group, LANES, SETS};
use crate::simd::{self, Kernel};
use crate::visibility::Bits;
use glam::DVec3;
use std::ops::Range;

/// Chunks of a block of facets; one bit each of a `u32`.
const BLOCK_CHUNKS: usize = 32;
/// Facets of a block: what one direction needs of it, 4 KiB, stays in the caches for all pairs of a task.
const BLOCK: usize = BLOCK_CHUNKS * LANES;
/// Blocks after which sums in f32 are added to sums in f64, so that no addend gets lost.
const FLUSH_BLOCKS: usize = 64;

/// One block of facets as one direction sees it.
pub struct View {
    /// `n·w` where the facet is seen, else 0.
    cosine: [Lanes; BLOCK_CHUNKS],
    /// The lobe's [`Side`] times the root of the facet's weight where the facet is seen, else 0.
    side: [Lanes; BLOCK_CHUNKS],
    /// Bit `k`: some facet of chunk `k` is seen.
    chunks: u32,
}

impl View {
    /// Facets of a block.
    pub const FACETS: usize = BLOCK;

    /// `n·w` of a chunk of facets where `bits` say that the facet is seen, else 0.
    #[inline(always)]
    pub fn cosine(facets: &Facets, chunk: usize, direction: DVec3, bits: &[u64]) -> Lanes {
        masked_cosine(facets, chunk, direction, seen(bits, chunk))
    }
}

impl Lobe<'_> {
    /// `fr (n·i)(n·o)` without the colour of a chunk of facets whose cosines are given: 0 where one of them is.
    #[inline(always)]
    pub fn chunk(&self, facets: &Facets, chunk: usize, i: (&Lanes, DVec3), o: (&Lanes, DVec3), half: &Half) -> Lanes {
        let mut value = [0.0; LANES];
        if let Some(measured) = self.whole {
            let (wi, wo) = (i.1.as_vec3(), o.1.as_vec3());
            for l in 0..LANES {
                if i.0[l] > 0.0 && o.0[l] > 0.0 {
                    let fr = measured.eval_f32(facets.normal_of(chunk + l), wi, wo);
                    value[l] = (fr[0] + fr[1] + fr[2]) / 3.0 * i.0[l] * o.0[l];
                }
            }
            return value;
        }
        let (sin2, cos2) = half_angle_narrow(facets, chunk, half);
        let shape = self.shape.eval(&sin2, &cos2);
        let (side_i, side_o) = (self.side.eval(i.0), self.side.eval(o.0));
        for l in 0..LANES {
            value[l] = if i.0[l] > 0.0 && o.0[l] > 0.0 { side_i[l] * side_o[l] * shape[l] } else { 0.0 };
        }
        value
    }
}

/// Sums over the facets of `weight (n·w)+ V(w)` for one direction, a set each: `av/A` times the number of samples.
pub fn visible_area(facets: &Facets, direction: DVec3, bits: &[u64]) -> [f64; SETS] {
    simd::run(VisibleArea { facets, direction, bits })
}

struct VisibleArea<'a> {
    facets: &'a Facets,
    direction: DVec3,
    bits: &'a [u64],
}

impl Kernel for VisibleArea<'_> {
    type Output = [f64; SETS];

    #[inline(always)]
    fn run(self) -> [f64; SETS] {
        let Self { facets, direction, bits } = self;
        let mut sums = [0.0; SETS];
        for block in blocks(0..facets.triangle.len()) {
            let mut acc = [0.0; LANES];
            for chunk in block.step_by(LANES) {
                let mask = seen(bits, chunk);
                if mask != 0 {
                    let cosine = masked_cosine(facets, chunk, direction, mask);
                    let weight = lanes(&facets.weight, chunk);
                    for l in 0..LANES {
                        acc[l] += cosine[l] * weight[l];
                    }
                }
            }
            for (l, a) in acc.iter().enumerate() {
                sums[l % SETS] += f64::from(*a);
            }
        }
        sums
    }
}

/// Adds to `sums`, one element a pair of `task`, the sums over the facets of all surfaces; `lobes` holds each surface's.
pub fn add_pairs(
    facets: &Facets,
    bits: &Bits,
    demand: &Demand,
    task: Range<usize>,
    groups: &[Group],
    lobes: &[Vec<Lobe<'_>>],
    sums: &mut [PairSums],
) {
    let pairs = &demand.pairs[task];
    let mut used: Vec<u32> = pairs.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let local = |d: u32| used.binary_search(&d).expect("collected above");
    let pairs: Vec<Local> = pairs
        .iter()
        .map(|&[i, o]| {
            let (wi, wo) = (demand.directions[i as usize], demand.directions[o as usize]);
            Local { i: local(i), o: local(o), wi, wo, half: Half::new(wi, wo) }
        })
        .collect();
    let directions: Vec<(DVec3, &[u64])> = used.iter().map(|&d| (demand.directions[d as usize], bits.row(d as usize))).collect();
    for (range, group) in facets.ranges.iter().zip(groups) {
        for lobe in &lobes[usize::from(group.surface)] {
            simd::run(AddLobe { facets, range: range.clone(), directions: &directions, pairs: &pairs, lobe, sums });
        }
    }
}

/// A pair of a task, its directions by their place in the task.
struct Local {
    i: usize,
    o: usize,
    wi: DVec3,
    wo: DVec3,
    half: Half,
}

fn blocks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    range.clone().step_by(BLOCK).map(move |start| start..(start + BLOCK).min(range.end))
}

#[inline(always)]
fn lanes(values: &[f32], chunk: usize) -> Lanes {
    values[chunk..chunk + LANES].try_into().expect("facets come in whole chunks")
}

/// The visibility bits of a chunk.
#[inline(always)]
fn seen(bits: &[u64], chunk: usize) -> u32 {
    (bits[chunk / 64] >> (chunk % 64)) as u32 & 0xFFFF
}

/// `n·w` where the facet is seen, else 0.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the sums are in f32")]
fn masked_cosine(facets: &Facets, chunk: usize, direction: DVec3, mask: u32) -> Lanes {
    let w = direction.to_array().map(|x| x as f32);
    let n = [0, 1, 2].map(|c| lanes(&facets.normal[c], chunk));
    let mut cosine = [0.0; LANES];
    for l in 0..LANES {
        let c = (n[0][l] * w[0] + n[1][l] * w[1] + n[2][l] * w[2]).clamp(0.0, 1.0);
        cosine[l] = if mask >> l & 1 == 1 { c } else { 0.0 };
    }
    cosine
}

#[inline(always)]
fn view(facets: &Facets, block: Range<usize>, direction: DVec3, bits: &[u64], side: Side, view: &mut View) {
    view.chunks = 0;
    for (k, chunk) in block.step_by(LANES).enumerate() {
        let mask = seen(bits, chunk);
        if mask == 0 {
            continue;
        }
        view.chunks |= 1 << k;
        let cosine = masked_cosine(facets, chunk, direction, mask);
        let weight = lanes(&facets.weight, chunk);
        let mut value = side.eval(&cosine);
        for l in 0..LANES {
            value[l] = if mask >> l & 1 == 1 { value[l] * weight[l].sqrt() } else { 0.0 };
        }
        view.cosine[k] = cosine;
        view.side[k] = value;
    }
}

struct AddLobe<'a> {
    facets: &'a Facets,
    range: Range<usize>,
    directions: &'a [(DVec3, &'a [u64])],
    pairs: &'a [Local],
    lobe: &'a Lobe<'a>,
    sums: &'a mut [PairSums],
}

impl Kernel for AddLobe<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        add_lobe(self.facets, self.range, self.directions, self.pairs, self.lobe, self.sums);
    }
}

#[inline(always)]
fn add_lobe(facets: &Facets, range: Range<usize>, directions: &[(DVec3, &[u64])], pairs: &[Local], lobe: &Lobe<'_>, sums: &mut [PairSums]) {
    if let Some(measured) = lobe.whole {
        return add_whole(facets, range, directions, pairs, lobe, measured, sums);
    }
    let empty = || View { cosine: [[0.0; LANES]; BLOCK_CHUNKS], side: [[0.0; LANES]; BLOCK_CHUNKS], chunks: 0 };
    let mut views: Vec<View> = directions.iter().map(|_| empty()).collect();
    let channels = if facets.tint.is_some() { 3 } else { 1 };
    let mut acc: Vec<Lanes> = vec![[0.0; LANES]; pairs.len() * channels];
    let mut until_flush = FLUSH_BLOCKS;
    for block in blocks(range.clone()) {
        for ((direction, bits), v) in directions.iter().zip(&mut views) {
            view(facets, block.clone(), *direction, bits, lobe.side, v);
        }
        match (&facets.tint, lobe.shape, lobe.shape.is_narrow()) {
            (Some(tint), shape, narrow) => add_tinted(facets, &block, &views, pairs, (shape, narrow), tint, &mut acc),
            (None, Shape::Constant, _) => add_constant(&views, pairs, &mut acc),
            // Matched here, outside the loops, so that each shape gets loops of its own.
            (None, Shape::Ggx(a2), false) => add_wide(&views, pairs, Shape::Ggx(a2), &mut acc),
            (None, Shape::Beckmann(a), false) => add_wide(&views, pairs, Shape::Beckmann(a), &mut acc),
            (None, Shape::Ward(a), false) => add_wide(&views, pairs, Shape::Ward(a), &mut acc),
            (None, Shape::Power(e), false) => add_wide(&views, pairs, Shape::Power(e), &mut acc),
            (None, shape, true) => add_narrow(facets, &block, &views, pairs, shape, &mut acc),
        }
        until_flush -= 1;
        if until_flush == 0 {
            flush(&mut acc, channels, pairs, lobe, sums);
            until_flush = FLUSH_BLOCKS;
        }
    }
    flush(&mut acc, channels, pairs, lobe, sums);
}

/// Adds the sums in f32 to the sets, coloured, and clears them.
fn flush(acc: &mut [Lanes], channels: usize, pairs: &[Local], lobe: &Lobe<'_>, sums: &mut [PairSums]) {
    for ((acc, pair), sums) in acc.chunks_exact_mut(channels).zip(pairs).zip(sums) {
        let colour = lobe.colour_at(0.5 * (pair.wi + pair.wo).length());
        for (r, set) in sums.iter_mut().enumerate() {
            for c in 0..3 {
                let lanes = &acc[c.min(channels - 1)];
                set[c] += colour[c] * (f64::from(lanes[r]) + f64::from(lanes[r + SETS]));
            }
        }
        acc.fill([0.0; LANES]);
    }
}

/// The chunks that both directions see.
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

#[inline(always)]
fn common_chunks(a: &View, b: &View) -> CommonChunks {
    CommonChunks(a.chunks & b.chunks)
}

#[inline(always)]
fn add_constant(views: &[View], pairs: &[Local], acc: &mut [Lanes]) {
    for (pair, acc) in pairs.iter().zip(acc) {
        let (i, o) = (&views[pair.i], &views[pair.o]);
        let mut sum = *acc;
        for k in common_chunks(i, o) {
            for l in 0..LANES {
                sum[l] += i.side[k][l] * o.side[k][l];
            }
        }
        *acc = sum;
    }
}

/// `sin²` and `cos²` of the half angle from `n·h`.
#[inline(always)]
fn half_angle_wide(i: &View, o: &View, k: usize, half: &Half) -> (Lanes, Lanes) {
    let (mut sin2, mut cos2) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let cos = (i.cosine[k][l] + o.cosine[k][l]) * half.inverse_length;
        cos2[l] = (cos * cos).min(1.0);
        sin2[l] = 1.0 - cos2[l];
    }
    (sin2, cos2)
}

/// `sin²` and `cos²` of the half angle from `n - h`, which does not cancel.
#[inline(always)]
fn half_angle_narrow(facets: &Facets, chunk: usize, half: &Half) -> (Lanes, Lanes) {
    let n = [0, 1, 2].map(|c| lanes(&facets.normal[c], chunk));
    let (mut sin2, mut cos2) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        let d = [n[0][l] - half.h[0], n[1][l] - half.h[1], n[2][l] - half.h[2]];
        let d2 = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).min(2.0);
        sin2[l] = d2 * (1.0 - 0.25 * d2);
        cos2[l] = (1.0 - 0.5 * d2) * (1.0 - 0.5 * d2);
    }
    (sin2, cos2)
}

#[inline(always)]
fn add_wide(views: &[View], pairs: &[Local], shape: Shape, acc: &mut [Lanes]) {
    for (pair, acc) in pairs.iter().zip(acc) {
        let (i, o) = (&views[pair.i], &views[pair.o]);
        let mut sum = *acc;
        for k in common_chunks(i, o) {
            let (sin2, cos2) = half_angle_wide(i, o, k, &pair.half);
            let value = shape.eval(&sin2, &cos2);
            for l in 0..LANES {
                sum[l] += i.side[k][l] * o.side[k][l] * value[l];
            }
        }
        *acc = sum;
    }
}

#[inline(always)]
fn add_narrow(facets: &Facets, block: &Range<usize>, views: &[View], pairs: &[Local], shape: Shape, acc: &mut [Lanes]) {
    for (pair, acc) in pairs.iter().zip(acc) {
        let (i, o) = (&views[pair.i], &views[pair.o]);
        let mut sum = *acc;
        for k in common_chunks(i, o) {
            let (sin2, cos2) = half_angle_narrow(facets, block.start + k * LANES, &pair.half);
            let value = shape.eval(&sin2, &cos2);
            for l in 0..LANES {
                sum[l] += i.side[k][l] * o.side[k][l] * value[l];
            }
        }
        *acc = sum;
    }
}

/// The same with a tint for each facet: three sums a pair.
#[inline(always)]
fn add_tinted(
    facets: &Facets,
    block: &Range<usize>,
    views: &[View],
    pairs: &[Local],
    (shape, narrow): (Shape, bool),
    tint: &[Vec<f32>; 3],
    acc: &mut [Lanes],
) {
    for (pair, acc) in pairs.iter().zip(acc.chunks_exact_mut(3)) {
        let (i, o) = (&views[pair.i], &views[pair.o]);
        for k in common_chunks(i, o) {
            let chunk = block.start + k * LANES;
            let (sin2, cos2) = if narrow { half_angle_narrow(facets, chunk, &pair.half) } else { half_angle_wide(i, o, k, &pair.half) };
            let value = shape.eval(&sin2, &cos2);
            for (sum, tint) in acc.iter_mut().zip(tint) {
                let tint = lanes(tint, chunk);
                for l in 0..LANES {
                    sum[l] += i.side[k][l] * o.side[k][l] * value[l] * tint[l];
                }
            }
        }
    }
}

/// Facet by facet, for tables, which do not split.
fn add_whole(
    facets: &Facets,
    range: Range<usize>,
    directions: &[(DVec3, &[u64])],
    pairs: &[Local],
    lobe: &Lobe<'_>,
    measured: &Measured,
    sums: &mut [PairSums],
) {
    for (pair, sums) in pairs.iter().zip(sums) {
        let (bi, bo) = (directions[pair.i].1, directions[pair.o].1);
        let (wi, wo) = (pair.wi.as_vec3(), pair.wo.as_vec3());
        for word in range.start / 64..range.end / 64 {
            let mut both = bi[word] & bo[word];
            while both != 0 {
                let f = word * 64 + both.trailing_zeros() as usize;
                both &= both - 1;
                let n = facets.normal_of(f);
                let fr = measured.eval_f32(n, wi, wo);
                let factor = facets.weight[f] * n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
                for c in 0..3 {
                    let tint = facets.tint.as_ref().map_or(1.0, |t| t[c][f]);
                    sums[f % SETS][c] += lobe.colour[c] * f64::from(tint * factor * fr[c]);
                }
            }
        }
    }
}
