//! Which directions and pairs a list of pairs needs, each once.

use crate::direction::{Pair, above_horizon};
use crate::numerics::cast::halves;
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Directions on one side of a square block of pairs that the sums take at once.
const BLOCK_SIDE: u32 = 64;
/// Most pairs of a task, so that short lists are shared among threads too.
const TASK_PAIRS: usize = 4096;

/// What a list of pairs needs.
#[derive(Clone, Debug, Default)]
pub struct Query {
    /// The distinct directions above the horizon.
    pub directions: Vec<DVec3>,
    /// The distinct pairs, as places in `directions` of the light's and of the viewer's, sorted so that neighbours share directions.
    pub pairs: Vec<[u32; 2]>,
    /// For each pair of the list its place in `pairs`, and the places of its own two directions; `None` below the horizon.
    pub entries: Vec<Option<QueryEntry>>,
    /// Places of the list above the horizon, by their place in `pairs`.
    pub order: Vec<u32>,
    /// Whether a pair and its reverse are one.
    pub symmetric: bool,
}

/// One pair of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueryEntry {
    /// Place in [`Query::pairs`].
    pub pair: u32,
    /// Place of the viewer's direction.
    pub viewer: u32,
}

/// Bits of a place within a block.
const IN_BLOCK: u32 = BLOCK_SIDE.ilog2();

/// Orders pairs by the blocks of their directions, then by the directions.
fn key(i: u32, o: u32) -> u64 {
    let (i, o, low) = (u64::from(i), u64::from(o), u64::from(BLOCK_SIDE - 1));
    (i >> IN_BLOCK) << (32 + IN_BLOCK) | (o >> IN_BLOCK) << (2 * IN_BLOCK) | (i & low) << IN_BLOCK | o & low
}

/// The pair of a [`key`].
fn unkey(key: u64) -> [u32; 2] {
    let low = u64::from(BLOCK_SIDE - 1);
    let high = u64::from(u32::MAX >> IN_BLOCK);
    let i = (key >> (32 + IN_BLOCK)) << IN_BLOCK | key >> IN_BLOCK & low;
    let o = (key >> (2 * IN_BLOCK) & high) << IN_BLOCK | key & low;
    [halves(i)[1], halves(o)[1]]
}

impl Query {
    /// The query of `list`. With `symmetric` a pair and its reverse are one.
    ///
    /// # Panics
    /// With more than 2^32 pairs.
    pub fn new(list: &[Pair], symmetric: bool) -> Self {
        let mut places: FxHashMap<[u64; 3], u32> = FxHashMap::default();
        let mut directions = Vec::new();
        let mut place = |w: DVec3| {
            let w = above_horizon(w)?;
            let key = (w + DVec3::ZERO).to_array().map(f64::to_bits);
            Some(*places.entry(key).or_insert_with(|| {
                directions.push(w);
                u32::try_from(directions.len() - 1).expect("fewer than 2^32 directions")
            }))
        };
        // Lists are mostly loops over lights and viewers: one of the two often stays the same.
        let mut last = (Pair { wi: DVec3::NAN, wo: DVec3::NAN }, [None; 2]);
        let placed: Vec<[Option<u32>; 2]> = list
            .iter()
            .map(|pair| {
                let i = if pair.wi == last.0.wi { last.1[0] } else { place(pair.wi) };
                let o = if pair.wo == last.0.wo { last.1[1] } else { place(pair.wo) };
                last = (*pair, [i, o]);
                last.1
            })
            .collect();
        // Each pair's key with its place in the list; sorted, equal keys are neighbours.
        let mut keys: Vec<(u64, u32)> = (0_u32..)
            .zip(&placed)
            .filter_map(|(k, &[i, o])| {
                let (i, o) = (i?, o?);
                Some((if symmetric && o < i { key(o, i) } else { key(i, o) }, k))
            })
            .collect();
        keys.par_sort_unstable();
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        let mut entries = vec![None; list.len()];
        let mut before = None;
        let order = keys.iter().map(|&(_, k)| k).collect();
        for (key, k) in keys {
            if before.replace(key) != Some(key) {
                pairs.push(unkey(key));
            }
            let pair = u32::try_from(pairs.len() - 1).expect("fewer than 2^32 pairs");
            entries[k as usize] = placed[k as usize][1].map(|viewer| QueryEntry { pair, viewer });
        }
        Self { directions, pairs, entries, order, symmetric }
    }

    /// Cuts `pairs` into tasks: runs that lie in one block of directions.
    pub fn tasks(&self) -> Vec<Range<usize>> {
        let block = |[i, o]: [u32; 2]| (i / BLOCK_SIDE, o / BLOCK_SIDE);
        let mut tasks = Vec::new();
        let mut start = 0;
        for end in 1..=self.pairs.len() {
            if end == self.pairs.len() || block(self.pairs[end]) != block(self.pairs[start]) || end - start == TASK_PAIRS {
                tasks.push(start..end);
                start = end;
            }
        }
        tasks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_pairs_by_block_and_give_them_back() {
        let places = [0, 1, 31, 32, 33, 1_000_000, u32::MAX - 32, u32::MAX];
        let pairs: Vec<[u32; 2]> = places.iter().flat_map(|&i| places.iter().map(move |&o| [i, o])).collect();
        for &[i, o] in &pairs {
            assert_eq!(unkey(key(i, o)), [i, o]);
            for &[j, p] in &pairs {
                let by_block = |[i, o]: [u32; 2]| (i / BLOCK_SIDE, o / BLOCK_SIDE, i, o);
                assert_eq!(key(i, o).cmp(&key(j, p)), by_block([i, o]).cmp(&by_block([j, p])), "{i},{o} against {j},{p}");
            }
        }
    }

    #[test]
    fn a_pair_and_its_reverse_are_one_where_they_may_be_and_each_keeps_its_viewer() {
        let (a, b, below) = (DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.6, 0.0, -0.8));
        let list = [(a, b), (b, a), (a, b), (a, below), (a, a)].map(|(wi, wo)| Pair { wi, wo });
        let query = Query::new(&list, true);
        assert_eq!(query.directions, [a, b]);
        assert_eq!(query.pairs, [[0, 0], [0, 1]]);
        let entry = |pair, viewer| Some(QueryEntry { pair, viewer });
        assert_eq!(query.entries, [entry(1, 1), entry(1, 0), entry(1, 1), None, entry(0, 0)]);
        let query = Query::new(&list, false);
        assert_eq!(query.pairs, [[0, 0], [0, 1], [1, 0]]);
        assert_eq!(query.entries, [entry(1, 1), entry(2, 0), entry(1, 1), None, entry(0, 0)]);
    }
}
