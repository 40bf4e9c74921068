//! A part of a list of pairs, on which what the whole needs is found more cheaply.

use crate::direction::Pair;
use crate::filter::demand::{Demand, Wanted};
use crate::numerics::low_discrepancy::hash;

/// Most pairs of the part of a list on which the number of samples is chosen, the share of the list that it is, and fewest: what costs less than
/// rounds on the whole list, and still tells its error.
const PART: usize = 1 << 13;
const PART_SHARE: usize = 24;
const LEAST_PART: usize = 64;
/// Lists from so many pairs, or directions, on find their samples on a part. Directions cost: a table of so many has four times those of its part, and a list
/// that repeats none of its directions at least as many times those of the smallest part.
const WORTH_A_PART_PAIRS: usize = 1024;
const WORTH_A_PART_DIRECTIONS: usize = 512;

/// Whether the samples that a list needs are found more cheaply on a part of it.
pub(super) fn worth_a_part(demand: &Demand) -> bool {
    demand.pairs.len() >= WORTH_A_PART_PAIRS || demand.directions.len() >= WORTH_A_PART_DIRECTIONS
}

/// The part of a list on which the number of samples is chosen.
pub(super) fn to_try(pairs: &[Pair], demand: &Demand) -> Vec<Pair> {
    part_of(pairs, demand, (demand.pairs.len() / PART_SHARE).clamp(LEAST_PART, PART))
}

/// A part of a list, of about `count` pairs: those between some of the directions, since each direction costs.
pub(in crate::filter) fn part_of(pairs: &[Pair], demand: &Demand, count: usize) -> Vec<Pair> {
    // Half the directions make a quarter of the pairs of a table. Of a list that is none, pairs are left out all the same.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the whole numbers")]
    let keep_one_in = (demand.pairs.len() as f64 / count as f64).sqrt().round().max(1.0) as usize;
    // One of so many of like elevation, by chance, since grids repeat their azimuths. The lowest errs most: always there, it would count too much.
    let mut rising: Vec<u32> = (0_u32..).take(demand.directions.len()).collect();
    rising.sort_by(|&a, &b| demand.directions[a as usize].z.total_cmp(&demand.directions[b as usize].z).then(a.cmp(&b)));
    let mut kept = vec![false; demand.directions.len()];
    for (k, stratum) in (0_u32..).zip(rising.chunks(keep_one_in)) {
        kept[stratum[hash(k) as usize % stratum.len()] as usize] = true;
    }
    let chosen = |wanted: &Wanted| demand.pairs[wanted.pair as usize].iter().all(|&d| kept[d as usize]);
    let part: Vec<Pair> = demand.wanted.iter().zip(pairs).filter(|(w, _)| w.as_ref().is_some_and(chosen)).map(|(_, p)| *p).collect();
    if part.len() >= count / 2 { part } else { pairs.iter().step_by(pairs.len().div_ceil(count).max(1)).copied().collect() }
}
