//! Sums facet by facet for measured tables, whose values do not split into factors of one direction.

use super::task::{PairSums, TaskPair};
use crate::facets::{Facets, REPLICATES};
use crate::filter::lobes::Lobe;
use crate::simd::{LANES, Lanes};
use glam::DVec3;
use std::ops::Range;

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
                sums[f % REPLICATES][c] += lobe.colour[c] * f64::from(tint * facets.weight[f] * values[c][l]);
            }
        }
        self.count = 0;
    }
}

/// Facet by facet, for tables, which do not split.
pub fn add_table(
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
