//! Visible area: `av` of one direction.

use super::views::{blocks, lanes, masked_cosine, seen};
use crate::facets::{Facets, REPLICATES};
use crate::simd::{self, Kernel, LANES};
use glam::DVec3;

/// Sums over the facets of `weight (n·w)+ V(w)` for one direction, a replicate each: `av` times the number of samples.
pub fn visible_area(facets: &Facets, direction: DVec3, bits: &[u64]) -> [f64; REPLICATES] {
    simd::run(VisibleArea { facets, direction, bits })
}

struct VisibleArea<'a> {
    facets: &'a Facets,
    direction: DVec3,
    bits: &'a [u64],
}

impl Kernel for VisibleArea<'_> {
    type Output = [f64; REPLICATES];

    #[inline(always)]
    fn run(self) -> [f64; REPLICATES] {
        let Self { facets, direction, bits } = self;
        let mut sums = [0.0; REPLICATES];
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
                sums[l % REPLICATES] += f64::from(*a);
            }
        }
        sums
    }
}
