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
use super::lobes::{Half, Lobe, Shape, Side, cosines, half_angles};
use crate::facets::{Facets, Group, SETS};
use crate::simd::{self, Kernel, LANES, Lanes};
use crate::visibility::Bits;
use glam::DVec3;
use std::ops::Range;

/// Chunks of a block of facets; one bit each of a `u32`.
const BLOCK_CHUNKS: usize = 32;
/// Facets of a block: what one direction needs of it, 4 KiB, stays in the caches for all pairs of a task.
const BLOCK: usize = BLOCK_CHUNKS * LANES;
/// Blocks after which sums in f32 are added to sums in f64, so that no addend gets lost.
const FLUSH_BLOCKS: usize = 64;

/// One block of facets as each direction of a task sees it.
#[derive(Debug, Default)]
pub struct Views {
    /// `n·w` where the facet is seen, [`BLOCK_CHUNKS`] a direction.
    cosine: Vec<Lanes>,
    /// The lobe's [`Side`] times the root of the facet's weight where the facet is seen, else 0; [`BLOCK_CHUNKS`] a direction.
    side: Vec<Lanes>,
    /// For each direction: bit `k` says that some facet of chunk `k` is seen.
    chunks: Vec<u32>,
}

/// Facets of a block.
pub const BLOCK_FACETS: usize = BLOCK;

/// `n·w` of a chunk of facets where `bits` say that the facet is seen, else 0.
#[inline(always)]
pub fn seen_cosine(facets: &Facets, chunk: usize, direction: DVec3, bits: &[u64]) -> Lanes {
    masked_cosine(facets, chunk, direction, seen(bits, chunk))
}

/// Sums over the facets of `weight (n·w)+ V(w)` for one direction, a set each: `av` times the number of samples.
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

/// A pair of a task, its directions by their place in the task.
#[derive(Clone, Copy, Debug)]
pub struct TaskPair {
    /// Place of the direction to the light.
    pub i: usize,
    /// Place of the direction to the viewer.
    pub o: usize,
    /// To the light.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
    /// Their half vector.
    pub half: Half,
}

/// The directions of a task, each with its bits, and its pairs.
pub fn of_task<'a>(bits: &'a Bits, demand: &Demand, task: Range<usize>) -> (Vec<(DVec3, &'a [u64])>, Vec<TaskPair>) {
    let pairs = &demand.pairs[task];
    let mut used: Vec<u32> = pairs.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |d: u32| used.binary_search(&d).expect("collected above");
    let pair = |&[i, o]: &[u32; 2]| {
        let (wi, wo) = (demand.directions[i as usize], demand.directions[o as usize]);
        TaskPair { i: place(i), o: place(o), wi, wo, half: Half::new(wi, wo) }
    };
    let pairs = pairs.iter().map(pair).collect();
    (used.iter().map(|&d| (demand.directions[d as usize], bits.row(d as usize))).collect(), pairs)
}

/// Adds to `sums`, one element a pair of `task`, the sums over the facets of all surfaces; `lobes` holds each surface's, `views` is
/// memory that one task after another uses.
#[expect(clippy::too_many_arguments, reason = "what a task is made of, and memory to use")]
pub fn add_pairs(
    facets: &Facets,
    bits: &Bits,
    demand: &Demand,
    task: Range<usize>,
    groups: &[Group],
    lobes: &[Vec<Lobe<'_>>],
    views: &mut Views,
    sums: &mut [PairSums],
) {
    let (directions, pairs) = of_task(bits, demand, task);
    for (range, group) in facets.ranges.iter().zip(groups) {
        for lobe in &lobes[usize::from(group.surface)] {
            simd::run(AddLobe { facets, range: range.clone(), directions: &directions, pairs: &pairs, lobe, views, sums });
        }
    }
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
fn masked_cosine(facets: &Facets, chunk: usize, direction: DVec3, mask: u32) -> Lanes {
    let mut cosine = cosines(&normals(facets, chunk), direction.as_vec3());
    for l in 0..LANES {
        let c = cosine[l].clamp(0.0, 1.0);
        cosine[l] = if mask >> l & 1 == 1 { c } else { 0.0 };
    }
    cosine
}

/// The normals of a chunk.
#[inline(always)]
pub fn normals(facets: &Facets, chunk: usize) -> [Lanes; 3] {
    // Not by `map`, whose closure the compiler may leave out of line.
    [lanes(&facets.normal[0], chunk), lanes(&facets.normal[1], chunk), lanes(&facets.normal[2], chunk)]
}

impl Views {
    fn resize(&mut self, directions: usize) {
        self.cosine.resize(directions * BLOCK_CHUNKS, [0.0; LANES]);
        self.side.resize(directions * BLOCK_CHUNKS, [0.0; LANES]);
        self.chunks.resize(directions, 0);
    }

    /// Fills in what direction number `d` sees of a block of facets, whose weights have the roots `roots`.
    #[inline(always)]
    fn see(
        &mut self,
        d: usize,
        facets: &Facets,
        block: Range<usize>,
        roots: &[Lanes; BLOCK_CHUNKS],
        (direction, bits): (DVec3, &[u64]),
        side: Side,
    ) {
        let at = d * BLOCK_CHUNKS;
        let mut chunks = 0;
        for (k, chunk) in block.step_by(LANES).enumerate() {
            let mask = seen(bits, chunk);
            if mask == 0 {
                // Read all the same where another direction sees the chunk; the cosines of an earlier block do no harm.
                self.side[at + k] = [0.0; LANES];
                continue;
            }
            chunks |= 1 << k;
            let cosine = masked_cosine(facets, chunk, direction, mask);
            let mut value = side.eval(&cosine);
            // Where the facet is not seen the cosine is 0, and every side with it.
            for l in 0..LANES {
                value[l] *= roots[k][l];
            }
            self.cosine[at + k] = cosine;
            self.side[at + k] = value;
        }
        self.chunks[d] = chunks;
    }

    #[inline(always)]
    fn of(&self, d: usize) -> View<'_> {
        let range = d * BLOCK_CHUNKS..(d + 1) * BLOCK_CHUNKS;
        View {
            cosine: self.cosine[range.clone()].try_into().expect("so many chunks"),
            side: self.side[range].try_into().expect("so many chunks"),
            chunks: self.chunks[d],
        }
    }
}

/// A block of facets as one direction sees it.
#[derive(Clone, Copy)]
struct View<'a> {
    cosine: &'a [Lanes; BLOCK_CHUNKS],
    side: &'a [Lanes; BLOCK_CHUNKS],
    chunks: u32,
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
        if lobe.whole.is_some() {
            return add_whole(facets, range, directions, pairs, lobe, sums);
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
                views.see(d, facets, block.clone(), &roots, direction, lobe.side);
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

/// Adds the sums in f32 to the sets, coloured, and clears them.
fn flush(acc: &mut [Lanes], channels: usize, pairs: &[TaskPair], lobe: &Lobe<'_>, sums: &mut [PairSums]) {
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
        let side = &i.side[k];
        for l in 0..LANES {
            for p in 0..N {
                sums[p][l] += side[l] * o[p].side[k][l];
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
            sums[p][l] += i.side[k][l] * o[p].side[k][l] * values[p][l];
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
                    sum[l] += i.side[k][l] * o.side[k][l] * value[l] * tint[l];
                }
            }
        }
    }
}

/// Facets that a light and a viewer both see, waiting for a table's values: a table costs much more than to gather them.
#[derive(Default)]
struct Waiting {
    facets: [usize; LANES],
    normals: [Lanes; 3],
    count: usize,
}

impl Waiting {
    fn push(&mut self, facets: &Facets, facet: usize) {
        self.facets[self.count] = facet;
        for (normals, all) in self.normals.iter_mut().zip(&facets.normal) {
            normals[self.count] = all[facet];
        }
        self.count += 1;
    }

    /// Adds those that wait.
    fn add(&mut self, facets: &Facets, pair: &TaskPair, lobe: &Lobe<'_>, sums: &mut PairSums) {
        let values = lobe.table_values(&self.normals, pair.wi, pair.wo);
        for (l, &f) in self.facets[..self.count].iter().enumerate() {
            for c in 0..3 {
                let tint = facets.tint.as_ref().map_or(1.0, |t| t[c][f]);
                sums[f % SETS][c] += lobe.colour[c] * f64::from(tint * facets.weight[f] * values[c][l]);
            }
        }
        self.count = 0;
    }
}

/// Facet by facet, for tables, which do not split.
fn add_whole(
    facets: &Facets,
    range: Range<usize>,
    directions: &[(DVec3, &[u64])],
    pairs: &[TaskPair],
    lobe: &Lobe<'_>,
    sums: &mut [PairSums],
) {
    for (pair, sums) in pairs.iter().zip(sums) {
        let (bi, bo) = (directions[pair.i].1, directions[pair.o].1);
        let mut waiting = Waiting::default();
        for word in range.start / 64..range.end / 64 {
            let mut both = bi[word] & bo[word];
            while both != 0 {
                waiting.push(facets, word * 64 + both.trailing_zeros() as usize);
                both &= both - 1;
                if waiting.count == LANES {
                    waiting.add(facets, pair, lobe, sums);
                }
            }
        }
        if waiting.count > 0 {
            waiting.add(facets, pair, lobe, sums);
        }
    }
}
