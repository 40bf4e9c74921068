//! How many samples a list gets, round by round, and their sums.

use super::Start;
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{ALIGNMENT, Runs, SETS};
use crate::filter::demand::Demand;
use crate::filter::estimate::{PairSums, Spread};
use crate::filter::importance::{self, Known};
use crate::filter::plan::{MAX_SAMPLES, Plan};
use crate::filter::prepared::{self, BATCH, Batch, Filled, Materials, Prepared, Tracer};
use crate::filter::{Control, Quality, Value};
use crate::material::SmallScale;
use glam::DVec3;
use std::ops::Range;

/// Fewest samples without a budget: below this the spread of eight sets says little.
const MIN_SAMPLES: u32 = 2048;
/// Most samples to start with.
const MOST_FIRST: u32 = 1 << 14;
/// Fewest samples with one, or where they are known to be enough.
pub(super) const MIN_BUDGET_SAMPLES: u32 = 256;

/// Most bytes of visibility bits that a long list keeps.
const MAX_BITS: usize = 256 << 20;

/// Samples after which, if many more are needed, they go where a pilot run of as many finds them worth most; or the first samples, if those
/// are more.
const PILOT_SAMPLES: u32 = 8192;
/// Samples go where the pilot run finds them worth most if that makes the variance so many times smaller: else it costs a round for nothing.
const WORTH_WEIGHING: f64 = 1.5;
/// Stretches of the surface that the pilot run tells apart.
const STRETCHES: usize = 1024;

/// To keep a tolerance, stop when this times the estimate is within it: an estimate is within 1.5 of its own true error in
/// most runs only (`numerics.md`, section 3.6).
pub(super) const SAFETY: f64 = 1.5;
/// Share of a budget that may be planned for: clocks and predictions are rough.
const PLANNED: f64 = 0.85;
/// Share of what may be planned for that finding the samples on a part of a list may take.
const PART_BUDGET: f64 = 0.25;

/// Samples up to which directions are looked into that hardly any sample sees.
pub(in crate::filter) const MOST_SEARCH: u32 = 1 << 18;
/// The same as samples times pairs: about a second.
const MOST_SEARCH_SUMS: usize = 1 << 30;

/// Sums so far: for each pair, and for each direction, a value a set.
struct Accumulated {
    samples: u32,
    pairs: Vec<PairSums>,
    areas: Vec<[f64; SETS]>,
}

/// A run of the method over a list that is not long.
pub(super) struct Run<'a, 'p> {
    pub(super) small: &'a SmallScale,
    pub(super) tracer: Tracer<'a>,
    pub(super) pairs: &'p [Pair],
    pub(super) demand: Demand,
    pub(super) tasks: Vec<Range<usize>>,
    pub(super) control: Control<'a>,
    /// Seconds of the stages: preparation, facets, visibility, sums.
    pub(super) seconds: [f64; 4],
    /// Samples of the last block, and its seconds for facets, visibility and sums: what tells what more would cost.
    pub(super) last_block: (u32, [f64; 3]),
    /// Samples that will probably be needed.
    pub(super) wanted: u32,
    /// What is known of the samples that will be needed.
    pub(super) start: Start,
}

/// Values, their relative RMS error, and how they were made.
pub(super) struct Outcome {
    pub(super) values: Vec<Value>,
    pub(super) relative_rms: f64,
    pub(super) plan: Plan,
    /// Directions for which [`prepared::barely_seen`] holds.
    pub(super) barely_seen: usize,
}

impl Run<'_, '_> {
    /// Samples to start with: to project all triangles along a direction costs as much as some samples, which a round with fewer would
    /// save nothing by leaving out. What is expected to be needed is not tried with much less, but for the pilot run: a quarter of it, or, where
    /// that costs less than to project the triangles once more, all.
    pub(super) fn first(&self) -> u32 {
        let triangles = u32::try_from(self.tracer.surface.triangles.len()).unwrap_or(u32::MAX);
        let fewest = self.start.enough.clamp(MIN_BUDGET_SAMPLES, MIN_SAMPLES);
        let least = (triangles / 2).clamp(fewest, MOST_FIRST).next_power_of_two();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturates")]
        let worth_a_round = (f64::from(triangles) * prepared::PROJECTED_TRIANGLE / prepared::PROJECTED_FACET) as u32;
        let expected = (self.start.expected / 4).max(self.start.expected.min(worth_a_round)).max(1);
        // Rounded down: what lies below the pilot run counts among the samples that are kept.
        least.max((1 << expected.ilog2()).min(PILOT_SAMPLES))
    }

    /// Samples of the pilot run.
    fn pilot(&self) -> u32 {
        PILOT_SAMPLES.max(self.first())
    }

    /// Whether directions that hardly any sample sees are worth more samples: an error that no sample has seen is not in the estimate.
    fn search(&self, barely_seen: usize, samples: u32, pairs: usize) -> bool {
        // Clusters are counted by words.
        let sums = (samples as usize).saturating_mul(pairs) / if self.tracer.is_clustered() { ALIGNMENT } else { 1 };
        barely_seen > 0 && samples < MOST_SEARCH && sums < MOST_SEARCH_SUMS
    }

    /// Finds, on a part of a list that may be `long`, the samples with which to begin on the whole.
    pub(super) fn find(&mut self, quality: &Quality, spent: &dyn Fn() -> f64, long: bool) -> Result<Plan> {
        let first = self.first();
        if !long && self.start.enough <= first {
            return Ok(Plan { start: first, doublings: 0, weighted: false, by_part: false, narrowed: 0 });
        }
        // The budget must leave time for the whole.
        let tried = self.adapt(quality, spent, PART_BUDGET, None)?;
        let samples = match quality.budget {
            // Rounds overshoot: between them the error tells. Too few are doubled where that costs little more than having had
            // them at once; a long list has each round anew.
            None => {
                let margin = if long { MARGIN } else { 1.0 };
                required(tried.plan.samples(), SAFETY * tried.relative_rms / quality.tolerance, margin).max(first)
            }
            Some(_) => tried.plan.samples(),
        };
        Ok(Plan { start: samples, doublings: 0, by_part: tried.plan.weighted && !long, ..tried.plan })
    }

    /// Finds the samples that a tolerance needs, or a budget allows; `share` of the budget is for this. Begins with what a part of the list
    /// `found`, and keeps its density.
    pub(super) fn adapt(&mut self, quality: &Quality, spent: &dyn Fn() -> f64, share: f64, found: Option<Plan>) -> Result<Outcome> {
        let budget = quality.budget.map(|b| b * PLANNED * share);
        let pilot = self.pilot();
        let mut plan = match found {
            Some(found) => Plan { start: found.samples(), doublings: 0, ..found },
            None => Plan {
                start: if budget.is_some() { MIN_BUDGET_SAMPLES } else { self.first() },
                doublings: 0,
                weighted: false,
                by_part: false,
                narrowed: 0,
            },
        };
        let mut block_began = spent();
        let (mut total, mut batch) = self.block(0, plan.start)?;
        loop {
            let per_sample = (spent() - block_began) / f64::from(total.samples >> u32::from(plan.doublings > 0));
            let (values, relative_rms) = self.values(&total);
            let wanted = needed(total.samples, SAFETY * relative_rms / quality.tolerance);
            self.wanted = wanted;
            let affordable = |samples: u32| budget.is_none_or(|b| spent() + per_sample * f64::from(samples) <= b);
            let barely_seen = prepared::barely_seen(&self.tracer.surface, &self.demand.directions, &total.areas).len();
            let met = SAFETY * relative_rms <= quality.tolerance && !self.search(barely_seen, total.samples, self.demand.pairs.len());
            if met || total.samples == MAX_SAMPLES || !affordable(total.samples) {
                return Ok(Outcome { values, relative_rms, plan, barely_seen });
            }
            block_began = spent();
            let pays = wanted > 2 * total.samples && !self.tracer.is_clustered();
            let importance = (pays && found.is_none() && !plan.weighted && total.samples == pilot && plan.doublings == 0)
                .then(|| self.importance(batch.as_ref().expect("a pilot run fits one batch"), &values))
                .filter(|importance| importance::gain(importance) >= WORTH_WEIGHING);
            let weigh = importance.is_some();
            let fresh = if !pays {
                None
            } else if weigh {
                // Weighted samples are worth two to four others.
                Some((wanted / 4).max(pilot))
            } else if found.is_none() && !plan.weighted && total.samples < pilot && wanted >= 4 * pilot {
                Some(pilot)
            } else {
                self.one_block_pays(total.samples, wanted).then_some(wanted)
            };
            // As many as the budget allows; fewer than there are would be worth it only if they are weighted.
            let least = if weigh { total.samples } else { 2 * total.samples };
            let halvings = |samples: u32| std::iter::successors(Some(samples), |s| Some(s / 2)).take_while(move |&s| s >= least);
            let fresh = fresh.and_then(|samples| halvings(samples).find(|&s| affordable(s)));
            match fresh {
                Some(samples) => {
                    if let Some(importance) = importance {
                        self.tracer.density = self.tracer.density.weighted(&importance);
                        plan.weighted = true;
                    }
                    (total, batch) = self.block(0, samples)?;
                    plan = Plan { start: samples, doublings: 0, ..plan };
                }
                None => {
                    total = total.merge(&self.block(total.samples, total.samples)?.0);
                    plan.doublings += 1;
                }
            }
        }
    }

    /// Whether `wanted` samples cost less in one block than by doubling the `samples` that there are: each block projects all triangles.
    fn one_block_pays(&self, samples: u32, wanted: u32) -> bool {
        let rounds_saved = f64::from((wanted / samples).ilog2()) - 1.0;
        let triangles = self.tracer.surface.triangles.len() as f64;
        wanted <= BATCH && rounds_saved * triangles * prepared::PROJECTED_TRIANGLE > f64::from(samples) * prepared::PROJECTED_FACET
    }

    /// Puts samples where the pilot run of a plan says.
    pub(super) fn weigh_as(&mut self, plan: Plan) -> Result<()> {
        if plan.weighted {
            let (total, batch) = self.block(0, self.pilot())?;
            let (values, _) = self.values(&total);
            let importance = self.importance(&batch.expect("a pilot run fits one batch"), &values);
            self.tracer.density = self.tracer.density.weighted(&importance);
        }
        Ok(())
    }

    /// Sums the samples of a plan.
    pub(super) fn repeat(&mut self, plan: Plan) -> Result<Outcome> {
        let (mut total, _) = self.block(0, plan.start)?;
        for _ in 0..plan.doublings {
            total = total.merge(&self.block(total.samples, total.samples)?.0);
        }
        let (values, relative_rms) = self.values(&total);
        let barely_seen = prepared::barely_seen(&self.tracer.surface, &self.demand.directions, &total.areas).len();
        Ok(Outcome { values, relative_rms, plan, barely_seen })
    }

    /// The whole of a long list, with the density, and at first the number of samples, that its part found.
    pub(super) fn whole(
        &mut self,
        pairs: &[Pair],
        demand: Demand,
        plan: Plan,
        quality: &Quality,
        spent: &dyn Fn() -> f64,
    ) -> Result<Outcome> {
        let most = (MAX_BITS * 8 / demand.directions.len().max(1)).clamp(MIN_SAMPLES as usize, MAX_SAMPLES as usize);
        let most = u32::try_from(most).map_or(MAX_SAMPLES, |m| 1 << m.ilog2());
        let mut samples = plan.samples().min(most);
        if let (Some(budget), None) = (quality.budget, &quality.plan) {
            // What a sample costs here, from what it cost on the part.
            let (tried, [facets, visibility, sums]) = self.last_block;
            let directions = demand.directions.len() as f64 / self.demand.directions.len().max(1) as f64;
            let longer = demand.pairs.len() as f64 / self.demand.pairs.len().max(1) as f64;
            let per_sample = (facets + visibility * directions + sums * longer) / f64::from(tried);
            while samples > MIN_BUDGET_SAMPLES && spent() + per_sample * f64::from(samples) > PLANNED * budget {
                samples /= 2;
            }
        }
        let mut demand = Some(demand);
        loop {
            let list = demand.take().expect("put back below");
            let round_began = spent();
            let prepared = Prepared::new(&self.tracer, pairs, list, samples)?;
            let [facets, visibility] = prepared.seconds();
            self.seconds[1] += facets;
            self.seconds[2] += visibility;
            let hidden = prepared.barely_seen(&self.tracer.surface);
            let barely_seen = hidden.len();
            let searching = self.search(barely_seen, samples, pairs.len());
            let last = quality.plan.is_some() || 2 * samples > most;
            if searching && !last && quality.budget.is_none() {
                // What does not see enough need not be summed.
                samples = self.enough_to_see(&hidden, 2 * samples, most, pairs.len())?;
                demand = Some(prepared.into_demand());
                continue;
            }
            let summing = spent();
            let (values, relative_rms) = prepared.evaluate(&self.small.surfaces, &self.control)?;
            self.seconds[3] += spent() - summing;
            let met = SAFETY * relative_rms <= quality.tolerance && !searching;
            let affordable = quality.budget.is_none_or(|b| spent() + 2.0 * (spent() - round_began) <= PLANNED * b);
            if met || !affordable || last {
                return Ok(Outcome { values, relative_rms, plan: Plan { start: samples, doublings: 0, ..plan }, barely_seen });
            }
            samples *= 2;
            demand = Some(prepared.into_demand());
        }
    }

    /// `samples`, or so many times two as these few `directions` need for [`Self::search`] to end, up to `most`.
    fn enough_to_see(&mut self, directions: &[DVec3], mut samples: u32, most: u32, pairs: usize) -> Result<u32> {
        while 2 * samples <= most && self.search(directions.len(), samples, pairs) {
            let mut areas = vec![[0.0; SETS]; directions.len()];
            let parts = samples.div_ceil(BATCH);
            for part in 0..parts {
                let batch = self.tracer.batch(Runs::of_block(0, samples, part, parts), directions)?;
                self.seconds[1] += batch.seconds[0];
                self.seconds[2] += batch.seconds[1];
                prepared::add_areas(&batch, directions, &mut areas);
            }
            if prepared::barely_seen(&self.tracer.surface, directions, &areas).is_empty() {
                break;
            }
            samples *= 2;
        }
        Ok(samples)
    }

    /// Sums of the samples `start..start + length`; and the batch, if it is one.
    fn block(&mut self, start: u32, length: u32) -> Result<(Accumulated, Option<Batch>)> {
        let lobes = prepared::surface_lobes(&self.small.surfaces);
        let materials = Materials::new(&self.tracer.surface.groups, &lobes, true);
        let mut sums = Accumulated {
            samples: start + length,
            pairs: vec![[[0.0; 3]; SETS]; self.demand.pairs.len()],
            areas: vec![[0.0; SETS]; self.demand.directions.len()],
        };
        let parts = length.div_ceil(BATCH);
        let mut last = None;
        self.last_block = (length, [0.0; 3]);
        for part in 0..parts {
            let batch = self.tracer.batch(Runs::of_block(start, length, part, parts), &self.demand.directions)?;
            let began = (self.control.clock)();
            prepared::add_areas(&batch, &self.demand.directions, &mut sums.areas);
            prepared::add_pairs(&batch, &self.demand, &self.tasks, &materials, &mut sums.pairs);
            let summed = (self.control.clock)() - began;
            for (k, seconds) in [batch.seconds[0], batch.seconds[1], summed].into_iter().enumerate() {
                self.seconds[1 + k] += seconds;
                self.last_block.1[k] += seconds;
            }
            last = Some(batch);
            let done = f64::from(start) + f64::from(length) * f64::from(part + 1) / f64::from(parts);
            (self.control.progress)("samples", done / f64::from(self.wanted.max(start + length)));
        }
        Ok((sums, last.filter(|_| parts == 1)))
    }

    /// What clusters of unequal normals cost: the relative RMS difference of `fbar` from sums facet by facet, over the pairs `probes`. Not of `S`: a
    /// grazing viewer sees little, and counts as much as any.
    pub(super) fn cluster_bias(&self, probes: &[Pair]) -> Result<f64> {
        let groups = &self.tracer.surface.groups;
        if !groups.iter().any(|g| g.cluster.is_some_and(|c| c.covariance != [0.0; 3])) {
            return Ok(0.0);
        }
        let demand = Demand::new(probes, false);
        let batch = self.tracer.batch(Runs::of_block(0, PILOT_SAMPLES, 0, 1), &demand.directions)?;
        let lobes = prepared::surface_lobes(&self.small.surfaces);
        let sums = |by_clusters| {
            let mut sums = vec![[[0.0; 3]; SETS]; demand.pairs.len()];
            prepared::add_pairs(&batch, &demand, &demand.tasks(), &Materials::new(groups, &lobes, by_clusters), &mut sums);
            sums
        };
        let (by_clusters, by_facets) = (sums(true), sums(false));
        let mut areas = vec![[0.0; SETS]; demand.directions.len()];
        prepared::add_areas(&batch, &demand.directions, &mut areas);
        let total = |s: &PairSums, c: usize| s.iter().map(|set| set[c]).sum::<f64>();
        let (mut difference, mut energy) = (0.0, 0.0);
        for ((a, b), [_, viewer]) in by_clusters.iter().zip(&by_facets).zip(&demand.pairs) {
            let area: f64 = areas[*viewer as usize].iter().sum();
            for c in 0..3 {
                if area > 0.0 {
                    difference += ((total(a, c) - total(b, c)) / area).powi(2);
                    energy += (total(b, c) / area).powi(2);
                }
            }
        }
        Ok(if energy > 0.0 { (difference / energy).sqrt() } else { 0.0 })
    }

    /// Where further samples are worth most, by a pilot run whose values were `values`.
    fn importance(&self, pilot: &Batch, values: &[Value]) -> Vec<f64> {
        let lobes = prepared::surface_lobes(&self.small.surfaces);
        let known = |k: usize| Known { q: values[k].fbar.iter().sum::<f64>() / 3.0, a: values[k].av };
        importance::importance(&pilot.facets, &pilot.bits, &self.demand, &self.tracer.surface.groups, &lobes, known, STRETCHES)
    }

    /// Values, and their relative RMS error.
    fn values(&self, sums: &Accumulated) -> (Vec<Value>, f64) {
        let mut spread = Spread::default();
        let mut values = vec![Value::default(); self.pairs.len()];
        let Accumulated { samples, pairs, areas } = sums;
        let filled = Filled { demand: &self.demand, list: self.pairs, sums: pairs, first: 0, areas, samples: *samples };
        filled.write(&self.demand.order, &mut values, &mut spread);
        prepared::correct(&mut values, &spread);
        (values, spread.relative_rms())
    }
}

/// One round too many costs more than a few samples too many.
const MARGIN: f64 = 1.2;

/// Samples, a power of two, that bring an error down by `factor`, if it is more than 1.
pub(in crate::filter) fn needed(samples: u32, factor: f64) -> u32 {
    if factor > 1.0 { required(samples, factor, MARGIN) } else { samples }
}

/// `margin` times as many samples as make an error `factor` times smaller, or larger, rounded up to a power of two: errors fall with the
/// samples to about this power (measured: .63 to .8).
fn required(samples: u32, factor: f64, margin: f64) -> u32 {
    const RATE: f64 = 0.75;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let wanted = (margin * f64::from(samples) * factor.powf(1.0 / RATE)).clamp(1.0, f64::from(MAX_SAMPLES)) as u32;
    wanted.next_power_of_two()
}

impl Accumulated {
    /// Sums of these samples and of as many new ones: neighbouring sets are united, so that each stays a run of the sequence.
    fn merge(&self, new: &Self) -> Self {
        fn unite<T: Copy>(old: &[T; SETS], new: &[T; SETS], add: impl Fn(T, T) -> T) -> [T; SETS] {
            let half = |sets: &[T; SETS], r: usize| add(sets[2 * r], sets[2 * r + 1]);
            std::array::from_fn(|r| if r < SETS / 2 { half(old, r) } else { half(new, r - SETS / 2) })
        }
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        Self {
            samples: new.samples,
            pairs: self.pairs.iter().zip(&new.pairs).map(|(a, b)| unite(a, b, add)).collect(),
            areas: self.areas.iter().zip(&new.areas).map(|(a, b)| unite(a, b, |x, y| x + y)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_samples_are_asked_for_where_more_error_must_go() {
        assert_eq!(needed(2048, 0.5), 2048);
        assert_eq!(needed(2048, 2.0), 8192);
        assert_eq!(needed(2048, 1.65), 8192);
        assert_eq!(needed(2048, f64::INFINITY), MAX_SAMPLES);
        assert_eq!(required(8192, 0.5, 1.0), 4096);
        assert_eq!(required(8192, 0.0, 1.0), 1);
    }
}
