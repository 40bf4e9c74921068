//! Tasks: runs of pairs between few directions, whose sums are made together.

use crate::facets::REPLICATES;
use crate::filter::lobes::Half;
use crate::filter::query::Query;
use crate::visibility::Bits;
use glam::DVec3;
use std::ops::Range;

/// Sums of a pair: RGB for each replicate.
pub type PairSums = [[f64; 3]; REPLICATES];

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
pub fn of_task<'a>(bits: &'a Bits, query: &Query, task: Range<usize>) -> (Vec<(DVec3, &'a [u64])>, Vec<TaskPair>) {
    let pairs = &query.pairs[task];
    let mut used: Vec<u32> = pairs.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |d: u32| used.binary_search(&d).expect("collected above");
    let pair = |&[i, o]: &[u32; 2]| {
        let (wi, wo) = (query.directions[i as usize], query.directions[o as usize]);
        TaskPair { i: place(i), o: place(o), wi, wo, half: Half::new(wi, wo) }
    };
    let pairs = pairs.iter().map(pair).collect();
    (used.iter().map(|&d| (query.directions[d as usize], bits.row(d as usize))).collect(), pairs)
}

/// Cuts a row of `width` items a pair into one slice a task.
pub fn split_by_task<'s, T>(mut rows: &'s mut [T], tasks: &[Range<usize>], width: usize) -> Vec<&'s mut [T]> {
    let mut slices = Vec::with_capacity(tasks.len());
    for task in tasks {
        let (slice, rest) = rows.split_at_mut(width * task.len());
        slices.push(slice);
        rows = rest;
    }
    slices
}
