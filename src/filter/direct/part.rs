//! The part of a list of pairs on which what the whole needs is found more cheaply.

use super::params::PARAMS;
use crate::direction::Pair;
use crate::filter::query::Query;
use crate::filter::subset::subset;

/// Whether the samples that a list needs are found more cheaply on a part of it.
pub(super) fn worth_a_part(query: &Query) -> bool {
    query.pairs.len() >= PARAMS.part_pairs || query.directions.len() >= PARAMS.part_directions
}

/// The part of a list on which the number of samples is chosen.
pub(super) fn to_try(pairs: &[Pair], query: &Query) -> Vec<Pair> {
    subset(pairs, query, (query.pairs.len() / PARAMS.part_one_in).clamp(PARAMS.part_least, PARAMS.part_most))
}
