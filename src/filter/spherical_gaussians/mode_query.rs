//! A query, and the pairs of its list that modes of visibility are learnt from.
//!
//! Modes of a part of a list fit that part better than the whole, so a search for settings on a part learns them from pairs of the whole, as what it looks for will.

use super::modes::SAMPLE_PAIRS;
use crate::direction::Pair;
use crate::filter::query::Query;
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::truncate_usize;
use crate::numerics::low_discrepancy::hash;

/// A query, and pairs to learn modes from.
pub struct ModeQuery {
    /// What the list needs, and after it what those pairs need.
    pub query: Query,
    /// Those pairs, as places in [`Query::directions`].
    pub learnt_from: Vec<[u32; 2]>,
}

impl ModeQuery {
    /// Of a whole list: a pair of each of [`SAMPLE_PAIRS`] runs, by chance, since grids repeat.
    pub fn new(list: &[Pair], symmetric: bool) -> Self {
        let query = Query::new(list, symmetric);
        let runs = SAMPLE_PAIRS.min(query.pairs.len());
        let start = |k: usize| k * query.pairs.len() / runs;
        let of_run = |k: u32| {
            let run = start(k as usize)..start(k as usize + 1);
            query.pairs[run.start + truncate_usize(f64::from(hash(k)) / 4_294_967_296.0 * run.len() as f64)]
        };
        let learnt_from = (0_u32..).take(runs).map(of_run).collect();
        Self { query, learnt_from }
    }

    /// The most facets for which memory is there.
    pub fn most_facets(&self) -> usize {
        VisibleFacets::most(self.query.directions.len())
    }

    /// Of some pairs, with modes learnt from those that this list has them from.
    pub fn with_its_modes(&self, pairs: &[Pair]) -> Self {
        let pair = |[i, o]: [u32; 2]| Pair { wi: self.query.directions[i as usize], wo: self.query.directions[o as usize] };
        let list: Vec<Pair> = pairs.iter().copied().chain(self.learnt_from.iter().map(|p| pair(*p))).collect();
        let mut query = Query::new(&list, self.query.symmetric);
        let entries = query.entries.split_off(pairs.len());
        let learnt_from = entries.iter().flatten().map(|entry| query.pairs[entry.pair as usize]).collect();
        Self { query, learnt_from }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_part_of_a_list_learns_from_the_pairs_of_the_whole() {
        let direction = |k: u32| DVec3::new(f64::from(k).sin(), f64::from(k).cos(), 0.5 + 0.01 * f64::from(k)).normalize();
        let list: Vec<Pair> = (0..40).flat_map(|i| (0..40).map(move |o| Pair { wi: direction(i), wo: direction(o) })).collect();
        for symmetric in [false, true] {
            let whole = ModeQuery::new(&list, symmetric);
            assert_eq!(whole.learnt_from.len(), SAMPLE_PAIRS);
            let part = whole.with_its_modes(&list[5..7]);
            let directions = |q: &ModeQuery| -> Vec<[DVec3; 2]> {
                let mut pairs: Vec<_> = q.learnt_from.iter().map(|p| p.map(|d| q.query.directions[d as usize])).collect();
                // A pair and its reverse see the same.
                pairs.iter_mut().for_each(|p| p.sort_by(|a, b| a.z.total_cmp(&b.z)));
                pairs
            };
            assert_eq!(directions(&part), directions(&whole));
            assert_eq!(part.query.entries.len(), 2);
        }
    }

    #[test]
    fn a_list_of_nothing_above_the_horizon_has_none() {
        let below = Pair { wi: -DVec3::Z, wo: DVec3::Z };
        let query = ModeQuery::new(&[below], true);
        assert!(query.learnt_from.is_empty());
        assert!(query.with_its_modes(&[below]).learnt_from.is_empty());
    }
}
