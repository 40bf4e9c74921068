//! A few pairs of a list that stand for all of it.

use super::query::{Query, QueryEntry};
use crate::direction::Pair;
use crate::numerics::cast::truncate_usize;
use crate::numerics::low_discrepancy::hash;

/// About `count` pairs of a list: those between some of the directions, since each direction costs. One direction is kept of each stratum of like
/// elevation, by chance, since grids repeat their azimuths; the lowest errs most, and would count too much if it were always there.
pub(super) fn subset(pairs: &[Pair], query: &Query, count: usize) -> Vec<Pair> {
    // Half the directions make a quarter of the pairs of a table. Of a list that is none, pairs are left out all the same.
    let keep_one_in = truncate_usize((query.pairs.len() as f64 / count as f64).sqrt().round().max(1.0));
    let mut rising: Vec<u32> = (0_u32..).take(query.directions.len()).collect();
    rising.sort_by(|&a, &b| query.directions[a as usize].z.total_cmp(&query.directions[b as usize].z).then(a.cmp(&b)));
    let mut kept = vec![false; query.directions.len()];
    for (k, stratum) in (0_u32..).zip(rising.chunks(keep_one_in)) {
        kept[stratum[hash(k) as usize % stratum.len()] as usize] = true;
    }
    let chosen = |entry: &QueryEntry| query.pairs[entry.pair as usize].iter().all(|&d| kept[d as usize]);
    let subset: Vec<Pair> = query.entries.iter().zip(pairs).filter(|(e, _)| e.as_ref().is_some_and(chosen)).map(|(_, p)| *p).collect();
    if subset.len() >= count / 2 { subset } else { pairs.iter().step_by(pairs.len().div_ceil(count).max(1)).copied().collect() }
}
