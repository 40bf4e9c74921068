//! The random numbers of a path: a padded, Owen-scrambled Sobol' sequence.

use crate::numerics::low_discrepancy::{fraction, hash, sobol_2d, sobol_3d};
use crate::numerics::seed::fold_with;

/// One randomised sequence of paths. Sequences of other seeds or indices are independent, so that the spread of their means tells an error.
#[derive(Clone, Copy, Debug)]
pub struct PathSequence {
    seed: u32,
}

/// Random numbers of one surface event, each in `0..1`.
#[derive(Clone, Copy, Debug)]
pub(super) struct EventNumbers {
    /// Choose the direction; stratified over the paths.
    pub direction: [f64; 3],
    /// Decides whether the path goes on; not stratified.
    pub survival: f64,
}

impl PathSequence {
    /// The sequence of a seed and of indices: of a pair of directions and a batch, or of a texel.
    pub fn new(seed: u64, indices: &[u32]) -> Self {
        Self { seed: fold_with(seed, indices) }
    }

    /// Two numbers in `0..1` for where path `index` starts; aligned blocks of `2^k` paths are stratified in both.
    pub fn start(self, index: u32) -> [f64; 2] {
        let [x, y, _] = self.event(index, 0).direction;
        [x, y]
    }

    /// Numbers for event `event` of path `index`; event 0 is the start.
    ///
    /// Each event has a sequence of its own, in an order shuffled so that aligned blocks of paths take aligned blocks of it
    /// ("padding", Burley 2020, "Practical Hash-based Owen Scrambling", section 5): stratification stays, correlation goes.
    pub(super) fn event(self, index: u32, event: u32) -> EventNumbers {
        let seed = hash(self.seed ^ hash(event));
        // The shuffle is an Owen scramble of the index itself, from its highest bit down. Scrambled from its lowest bit it would be a scramble of
        // the radical inverse, which is what the first dimension of every event is made of: one event's number would tell the next one's.
        let order = if event == 0 { index } else { sobol_2d(index.reverse_bits(), !seed)[0] };
        EventNumbers { direction: sobol_3d(order, seed).map(fraction), survival: fraction(hash(index ^ hash(seed.rotate_left(16)))) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::cast::truncate_usize;

    /// Place of a number among 16 equal steps of `0..1`.
    fn sixteenth(x: f64) -> usize {
        truncate_usize(16.0 * x)
    }

    #[test]
    fn numbers_of_one_event_do_not_tell_those_of_another() {
        // 4,096 paths in the 256 cells of two numbers of two events: 16 a cell, if these are independent. A cell's count is Poisson's or more even;
        // 40 would be 6 standard deviations off.
        for (seed, events) in [(0, [0, 1]), (1, [1, 2]), (2, [0, 5])] {
            let sequence = PathSequence::new(seed, &[3, 1]);
            let paths: Vec<[[f64; 3]; 2]> = (0..4096).map(|index| events.map(|event| sequence.event(index, event).direction)).collect();
            for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                let mut cells = [0_u32; 256];
                paths.iter().for_each(|[first, second]| cells[16 * sixteenth(first[a]) + sixteenth(second[b])] += 1);
                let (fewest, most) = (cells.iter().min(), cells.iter().max());
                assert!(fewest > Some(&0) && most < Some(&40), "events {events:?}, numbers {a} and {b}: {fewest:?} to {most:?} a cell");
            }
        }
    }

    #[test]
    fn aligned_blocks_of_paths_are_stratified_at_every_event() {
        let sequence = PathSequence::new(7, &[0, 2]);
        for event in [0, 1, 6] {
            for block in (0..1024_u32).step_by(16) {
                let mut strata: Vec<usize> =
                    (block..block + 16).map(|index| sixteenth(sequence.event(index, event).direction[0])).collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..16).collect::<Vec<_>>(), "event {event}, paths from {block}");
            }
        }
    }

    #[test]
    fn starts_of_sixteen_paths_fill_every_sixteenth_and_every_cell_of_four_by_four() {
        let sequence = PathSequence::new(5, &[77]);
        for block in [0, 16, 4096] {
            let starts: Vec<[f64; 2]> = (block..block + 16).map(|index| sequence.start(index)).collect();
            let distinct = |key: &dyn Fn(&[f64; 2]) -> usize| starts.iter().map(key).collect::<std::collections::HashSet<_>>().len();
            assert_eq!(distinct(&|s| sixteenth(s[0])), 16, "x of paths from {block}");
            assert_eq!(distinct(&|s| sixteenth(s[1])), 16, "y of paths from {block}");
            assert_eq!(distinct(&|s| 4 * (sixteenth(s[0]) / 4) + sixteenth(s[1]) / 4), 16, "cells of paths from {block}");
        }
    }
}
