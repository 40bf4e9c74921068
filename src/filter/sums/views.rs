//! What a direction sees of a block of facets.

use crate::facets::Facets;
use crate::filter::lobes::{Masking, cosines};
use crate::simd::{LANES, Lanes};
use glam::DVec3;
use std::ops::Range;

/// Chunks of a block of facets; one bit each of a `u32`.
pub const BLOCK_CHUNKS: usize = 32;
/// Facets of a block: what one direction needs of it, 4 KiB, stays in the caches for all pairs of a task.
pub const BLOCK_FACETS: usize = BLOCK_CHUNKS * LANES;
/// One block of facets as each direction of a task sees it.
#[derive(Debug, Default)]
pub struct Views {
    /// `n·w` where the facet is seen, [`BLOCK_CHUNKS`] a direction.
    cosine: Vec<Lanes>,
    /// The lobe's [`Masking`] times the root of the facet's weight where the facet is seen, else 0; [`BLOCK_CHUNKS`] a direction.
    masking: Vec<Lanes>,
    /// For each direction: bit `k` says that some facet of chunk `k` is seen.
    chunks: Vec<u32>,
}

/// `n·w` of a chunk of facets where `bits` say that the facet is seen, else 0.
#[inline(always)]
pub fn seen_cosine(facets: &Facets, chunk: usize, direction: DVec3, bits: &[u64]) -> Lanes {
    masked_cosine(facets, chunk, direction, seen(bits, chunk))
}

pub fn blocks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    range.clone().step_by(BLOCK_FACETS).map(move |start| start..(start + BLOCK_FACETS).min(range.end))
}

#[inline(always)]
pub fn lanes(values: &[f32], chunk: usize) -> Lanes {
    values[chunk..chunk + LANES].try_into().expect("facets come in whole chunks")
}

/// The visibility bits of a chunk.
#[inline(always)]
pub fn seen(bits: &[u64], chunk: usize) -> u32 {
    (bits[chunk / 64] >> (chunk % 64)) as u32 & 0xFFFF
}

/// `n·w` where the facet is seen, else 0.
#[inline(always)]
pub fn masked_cosine(facets: &Facets, chunk: usize, direction: DVec3, mask: u32) -> Lanes {
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
    pub fn resize(&mut self, directions: usize) {
        self.cosine.resize(directions * BLOCK_CHUNKS, [0.0; LANES]);
        self.masking.resize(directions * BLOCK_CHUNKS, [0.0; LANES]);
        self.chunks.resize(directions, 0);
    }

    /// Fills in what direction number `d` sees of a block of facets, whose weights have the roots `roots`.
    #[inline(always)]
    pub fn see(
        &mut self,
        d: usize,
        facets: &Facets,
        block: Range<usize>,
        roots: &[Lanes; BLOCK_CHUNKS],
        (direction, bits): (DVec3, &[u64]),
        masking: Masking,
    ) {
        let at = d * BLOCK_CHUNKS;
        let mut chunks = 0;
        for (k, chunk) in block.step_by(LANES).enumerate() {
            let mask = seen(bits, chunk);
            if mask == 0 {
                // Read all the same where another direction sees the chunk; the cosines of an earlier block do no harm.
                self.masking[at + k] = [0.0; LANES];
                continue;
            }
            chunks |= 1 << k;
            let cosine = masked_cosine(facets, chunk, direction, mask);
            let mut value = masking.eval(&cosine);
            // Where the facet is not seen the cosine is 0, and every masking with it.
            for l in 0..LANES {
                value[l] *= roots[k][l];
            }
            self.cosine[at + k] = cosine;
            self.masking[at + k] = value;
        }
        self.chunks[d] = chunks;
    }

    #[inline(always)]
    pub fn of(&self, d: usize) -> View<'_> {
        let range = d * BLOCK_CHUNKS..(d + 1) * BLOCK_CHUNKS;
        View {
            cosine: self.cosine[range.clone()].try_into().expect("so many chunks"),
            masking: self.masking[range].try_into().expect("so many chunks"),
            chunks: self.chunks[d],
        }
    }
}

/// A block of facets as one direction sees it.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub cosine: &'a [Lanes; BLOCK_CHUNKS],
    pub masking: &'a [Lanes; BLOCK_CHUNKS],
    pub chunks: u32,
}
