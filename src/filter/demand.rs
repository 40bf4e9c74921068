//! Which directions and pairs a list of pairs needs, each once.

use crate::direction::{Pair, above_horizon};
use glam::DVec3;
use std::collections::HashMap;
use std::ops::Range;

/// Directions on one side of a square block of pairs that the sums take at once.
const BLOCK_SIDE: u32 = 32;
/// Most pairs of a task, so that short lists are shared among threads too.
const TASK_PAIRS: usize = 1024;

/// What a list of pairs needs.
#[derive(Clone, Debug, Default)]
pub struct Demand {
    /// The distinct directions above the horizon.
    pub directions: Vec<DVec3>,
    /// The distinct pairs, as places in `directions` of the light's and of the viewer's, sorted so that neighbours share directions.
    pub pairs: Vec<[u32; 2]>,
    /// For each pair of the list its place in `pairs`, and the places of its own two directions; `None` below the horizon.
    pub wanted: Vec<Option<Wanted>>,
}

/// One pair of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Place in [`Demand::pairs`].
    pub pair: u32,
    /// Place of the viewer's direction.
    pub viewer: u32,
}

impl Demand {
    /// The demand of `list`. With `symmetric` a pair and its reverse are one.
    ///
    /// # Panics
    /// With more than 2^32 pairs.
    pub fn new(list: &[Pair], symmetric: bool) -> Self {
        let mut places: HashMap<[u64; 3], u32> = HashMap::new();
        let mut directions = Vec::new();
        let mut place = |w: DVec3| {
            let w = above_horizon(w)?;
            let key = (w + DVec3::ZERO).to_array().map(f64::to_bits);
            Some(*places.entry(key).or_insert_with(|| {
                directions.push(w);
                u32::try_from(directions.len() - 1).expect("fewer than 2^32 directions")
            }))
        };
        let placed: Vec<Option<[u32; 2]>> = list.iter().map(|pair| Some([place(pair.wi)?, place(pair.wo)?])).collect();
        let key = |[i, o]: [u32; 2]| {
            let [i, o] = if symmetric && o < i { [o, i] } else { [i, o] };
            (i / BLOCK_SIDE, o / BLOCK_SIDE, i, o)
        };
        let mut keys: Vec<_> = placed.iter().flatten().map(|&p| key(p)).collect();
        keys.sort_unstable();
        keys.dedup();
        let wanted = placed
            .iter()
            .map(|p| {
                let [i, o] = (*p)?;
                let pair = keys.binary_search(&key([i, o])).expect("every pair has its key");
                Some(Wanted { pair: u32::try_from(pair).expect("fewer than 2^32 pairs"), viewer: o })
            })
            .collect();
        Self { directions, pairs: keys.into_iter().map(|(_, _, i, o)| [i, o]).collect(), wanted }
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
