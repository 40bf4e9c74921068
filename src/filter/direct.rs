//! The direct method: facets shared by all pairs, visibility for exactly the wanted directions, direct sums.
//!
//! How many samples a tolerance needs is found by trying: 2,048 spread by area, or more where the triangles are many; if those leave much
//! to do, a pilot run of at least 8,192 shows where samples are worth most, and these are doubled, sums made so far being kept, until the estimated error meets the tolerance. All but
//! short lists of pairs try this on a part of the list: the whole then mostly takes one round.

use super::demand::{Demand, Wanted};
use super::estimate::{PairSums, Spread};
use super::importance::{self, Known};
use super::plan::{MAX_SAMPLES, Plan, WIDTHS};
use super::prepared::{self, BATCH, Batch, Filled, Materials, Prepared, Tracer};
use super::{Control, Effective, Quality, Summary, Value};
use crate::brdf::Brdf;
use crate::clusters::SPREAD_PER_ALPHA;
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{ALIGNMENT, Clustering, Runs, SETS};
use crate::low_discrepancy::hash;
use crate::material::{SmallScale, Surface, Tint};
use glam::DVec3;
use std::ops::Range;

/// Fewest samples without a budget: below this the spread of eight sets says little.
pub const MIN_SAMPLES: u32 = 2048;
/// Most samples to start with.
const MOST_FIRST: u32 = 1 << 14;
/// Fewest samples with one, or where they are known to be enough.
const MIN_BUDGET_SAMPLES: u32 = 256;
/// Most bytes of visibility bits that a long list keeps.
const MAX_BITS: usize = 256 << 20;
/// Longer lists of distinct pairs choose the number of samples on a part of about [`PART`] pairs.
const LONG: usize = 1 << 15;
/// Most pairs of the part of a list on which the number of samples is chosen, the share of the list that it is, and fewest: what costs less than
/// rounds on the whole list, and still tells its error.
const PART: usize = 1 << 13;
const PART_SHARE: usize = 24;
const LEAST_PART: usize = 64;
/// Lists from so many pairs, or directions, on find their samples on a part. Directions cost: a table of so many has four times those of its part, and a list
/// that repeats none of its directions at least as many times those of the smallest part.
const WORTH_A_PART_PAIRS: usize = 1024;
const WORTH_A_PART_DIRECTIONS: usize = 512;
/// Lists of more distinct pairs begin with clusters of unequal normals. On shorter ones equal normals, or facets one by one, are as fast, more exact,
/// and may go where they are worth most (`biscale study`, tables of 272 and 600 directions).
const WIDE: usize = 1 << 18;
/// Samples after which, if many more are needed, they go where a pilot run of as many finds them worth most; or the first samples, if those
/// are more.
const PILOT_SAMPLES: u32 = 8192;
/// Samples go where the pilot run finds them worth most if that makes the variance so many times smaller: else it costs a round for nothing.
const WORTH_WEIGHING: f64 = 1.5;
/// Stretches of the surface that the pilot run tells apart.
const STRETCHES: usize = 1024;
/// To keep a tolerance, stop when this times the estimate is within it: an estimate is within 1.5 of its own true error in
/// most runs only (`numerics.md`, section 3.6).
const SAFETY: f64 = 1.5;
/// Share of a budget that may be planned for: clocks and predictions are rough.
const PLANNED: f64 = 0.85;
/// Share of a budget up to which a run counts as within it.
const OVERDRAWN: f64 = 1.2;

/// Most clusters: of a surface that needs more, each facet is summed by itself. A cluster fills up words of 64 facets.
const MOST_CLUSTERS: usize = 64;
/// The same for long lists, which take more samples.
const MOST_CLUSTERS_LONG: usize = 2048;
/// About so many pairs of a list tell the bias of clusters (`numerics.md`, section 3.6). Few grazing viewers make most of it.
const BIAS_PAIRS: usize = 2048;
/// Samples up to which directions are looked into that hardly any sample sees.
pub const MOST_SEARCH: u32 = 1 << 18;
/// The same as samples times pairs: about a second.
const MOST_SEARCH_SUMS: usize = 1 << 30;
/// Share of a tolerance that this bias may take.
const BIAS_SHARE: f64 = 0.4;

/// Sums so far: for each pair, and for each direction, a value a set.
struct Accumulated {
    samples: u32,
    pairs: Vec<PairSums>,
    areas: Vec<[f64; SETS]>,
}

/// A run of the method over a list that is not long.
struct Run<'a, 'p> {
    small: &'a SmallScale,
    tracer: Tracer<'a>,
    pairs: &'p [Pair],
    demand: Demand,
    tasks: Vec<Range<usize>>,
    control: Control<'a>,
    /// Seconds of the stages: preparation, facets, visibility, sums.
    seconds: [f64; 4],
    /// Samples of the last block, and its seconds for facets, visibility and sums: what tells what more would cost.
    last_block: (u32, [f64; 3]),
    /// Samples that will probably be needed.
    wanted: u32,
    /// What is known of the samples that will be needed.
    start: Start,
}

/// Values, their relative RMS error, and how they were made.
struct Outcome {
    values: Vec<Value>,
    relative_rms: f64,
    plan: Plan,
    /// Directions for which [`prepared::barely_seen`] holds.
    barely_seen: usize,
}

/// Values, and what finds facets and their visibility as it did for them.
pub(super) struct Traced<'a> {
    pub effective: Effective,
    pub tracer: Tracer<'a>,
    /// Samples that the values are from.
    pub samples: u32,
    /// Directions for which [`prepared::barely_seen`] holds.
    barely_seen: usize,
}

pub(super) fn direct(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    Ok(traced(small, pairs, quality, control, Start::UNKNOWN)?.effective)
}

/// What is known of the samples that will be needed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// So many are certainly enough.
    pub enough: u32,
    /// About so many are expected to be needed.
    pub expected: u32,
}

impl Start {
    /// Nothing.
    pub const UNKNOWN: Self = Self { enough: u32::MAX, expected: 1 };
}

/// The same where something is known of the samples; and how many directions see so few of the samples that what
/// they show may be missed.
pub(super) fn from(
    small: &SmallScale,
    pairs: &[Pair],
    quality: &Quality,
    control: &Control<'_>,
    start: Start,
) -> Result<(Effective, usize)> {
    let traced = traced(small, pairs, quality, control, start)?;
    Ok((traced.effective, traced.barely_seen))
}

/// The values with what they were made by.
pub(super) fn traced<'a>(
    small: &'a SmallScale,
    pairs: &[Pair],
    quality: &Quality,
    control: &Control<'a>,
    start: Start,
) -> Result<Traced<'a>> {
    let began = (control.clock)();
    let symmetric = small.is_reciprocal();
    let demand = Demand::new(pairs, symmetric);
    let directions = demand.directions.len();
    #[expect(clippy::cast_possible_truncation, reason = "both halves of the seed are used")]
    let seed = hash(hash(quality.seed as u32) ^ (quality.seed >> 32) as u32);
    let long = demand.pairs.len() > LONG;
    let plan = quality.plan.as_deref().map(Plan::parse).transpose()?;
    // A short budget is better spent on the list itself. A plan says where its pilot run was.
    let in_part = long || plan.map_or(quality.budget.is_none() && worth_a_part(&demand), |plan| plan.by_part);
    let part: Vec<Pair>;
    let (tried, part_demand) = if in_part {
        part = part_of(pairs, &demand, (demand.pairs.len() / PART_SHARE).clamp(LEAST_PART, PART));
        (&part[..], Demand::new(&part, symmetric))
    } else {
        (pairs, demand.clone())
    };
    let tasks = part_demand.tasks();
    let probes = if long { part_of(pairs, &demand, BIAS_PAIRS) } else { Vec::new() };
    // Clusters of unequal normals are a model, whose error must leave room for that of the samples. A plan repeats what was chosen for
    // the tolerance of its day.
    let widest = if demand.pairs.len() > WIDE { 0 } else { WIDTHS.len() - 1 };
    let mut narrowed = plan.map_or(if long { widest } else { 0 }, |plan| plan.narrowed);
    // Clusters count facets, which must all stand for the same: where a plan spreads them unevenly, whatever surface it was made for, each
    // is summed by itself.
    let even = !plan.is_some_and(|plan| plan.weighted);
    let tracer = |narrowed: usize| {
        let clustering = clustering(small, long, WIDTHS[narrowed]).filter(|_| even);
        Tracer::new(small, clustering.as_ref(), seed, control)
    };
    let mut run = Run {
        small,
        tracer: tracer(narrowed),
        pairs: tried,
        demand: part_demand,
        tasks,
        control: *control,
        seconds: [0.0; 4],
        last_block: (1, [0.0; 3]),
        wanted: 0,
        start,
    };
    let mut bias = run.cluster_bias(&probes)?;
    while bias > BIAS_SHARE * quality.tolerance && plan.is_none() {
        narrowed += 1;
        run.tracer = tracer(narrowed);
        bias = run.cluster_bias(&probes)?;
    }
    run.seconds[0] = (control.clock)() - began;
    let spent = || (control.clock)() - began;
    let mut notes = Vec::new();
    let mut outcome = if in_part {
        let found = match plan {
            Some(plan) => {
                run.weigh_as(plan)?;
                plan
            }
            None if !long && run.start.enough <= run.first() => {
                Plan { start: run.first(), doublings: 0, weighted: false, by_part: false, narrowed: 0 }
            }
            // On a part of a list the budget must leave time for the whole.
            None => {
                let tried = run.adapt(quality, &spent, 0.25, None)?;
                let samples = match quality.budget {
                    // Rounds overshoot: between them the error tells. Too few are doubled where that costs little more than having had
                    // them at once; a long list has each round anew.
                    None => {
                        required(tried.plan.samples(), SAFETY * tried.relative_rms / quality.tolerance, if long { MARGIN } else { 1.0 })
                            .max(run.first())
                    }
                    Some(_) => tried.plan.samples(),
                };
                Plan { start: samples, doublings: 0, by_part: tried.plan.weighted && !long, ..tried.plan }
            }
        };
        if long {
            run.whole(pairs, demand, found, quality, &spent)?
        } else {
            (run.pairs, run.tasks, run.demand) = (pairs, demand.tasks(), demand);
            match plan {
                Some(plan) => run.repeat(plan)?,
                None => run.adapt(quality, &spent, 1.0, Some(found))?,
            }
        }
    } else {
        match plan {
            Some(plan) => {
                run.weigh_as(plan)?;
                run.repeat(plan)?
            }
            None => run.adapt(quality, &spent, 1.0, None)?,
        }
    };
    outcome.plan.narrowed = narrowed;
    if quality.plan.is_none() && SAFETY * outcome.relative_rms > quality.tolerance {
        let why = if quality.budget.is_some() {
            "the budget is spent"
        } else {
            "more samples would not fit the memory that this method allows itself"
        };
        notes.push(format!("the tolerance of {} is not met: {why}", quality.tolerance));
    }
    if let Some(budget) = quality.budget.filter(|b| spent() > OVERDRAWN * b && outcome.plan.samples() == MIN_BUDGET_SAMPLES) {
        notes.push(format!("the budget of {budget} s is less than the {:.3} s that the fewest samples take here", spent()));
    }
    if outcome.barely_seen > 0 {
        notes.push(format!(
            "{} directions see so few of the samples that what they show may be missed: `--method reference` finds it",
            outcome.barely_seen
        ));
    }
    // Directions below the horizon are black, and no news.
    let above = |pair: &Pair| pair.wi.z >= 0.0 && pair.wo.z >= 0.0;
    let black = outcome.values.iter().zip(pairs).filter(|(v, pair)| v.av == 0.0 && above(pair)).count();
    if black > 0 {
        notes.push(format!("{black} pairs see no front face: their values are 0"));
    }
    if bias > 0.0 {
        outcome.relative_rms = outcome.relative_rms.hypot(bias);
        for value in &mut outcome.values {
            for c in 0..3 {
                value.se[c] = value.se[c].hypot(bias * value.fbar[c]);
                value.s_se[c] = value.s_se[c].hypot(bias * value.s[c]);
            }
        }
        notes.push(format!("clusters of unequal normals err by {bias:.1e}, relative RMS; the errors include it"));
    }
    let lost = run.tracer.lost();
    if lost > 0 {
        let asked = f64::from(outcome.plan.samples()) * directions as f64;
        let share = lost as f64 / asked;
        outcome.relative_rms = outcome.relative_rms.hypot(share);
        notes.push(format!("{lost} rays ({:.2e} of all) passed 65,536 periods without an answer and count as free", share));
    }
    let names = ["prepare", "facets", "visibility", "sums"];
    let samples = outcome.plan.samples() as usize;
    let summary = Summary {
        method: "direct",
        plan: outcome.plan.to_string(),
        facets: samples,
        clusters: if run.tracer.is_clustered() { run.tracer.surface.groups.len() } else { samples },
        directions,
        stages: names.into_iter().zip(run.seconds.map(|s| 1e3 * s)).collect(),
        relative_rms: outcome.relative_rms,
        low_rank: Vec::new(),
        notes,
    };
    let (samples, barely_seen) = (outcome.plan.samples(), outcome.barely_seen);
    Ok(Traced { effective: Effective { values: outcome.values, summary }, tracer: run.tracer, samples, barely_seen })
}

impl Run<'_, '_> {
    /// Samples to start with: to project all triangles along a direction costs as much as some samples, which a round with fewer would
    /// save nothing by leaving out. What is expected to be needed is not tried with much less, but for the pilot run: a quarter of it, or, where
    /// that costs less than to project the triangles once more, all.
    fn first(&self) -> u32 {
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

    /// Finds the samples that a tolerance needs, or a budget allows; `share` of the budget is for this. Begins with what a part of the list
    /// `found`, and keeps its density.
    fn adapt(&mut self, quality: &Quality, spent: &dyn Fn() -> f64, share: f64, found: Option<Plan>) -> Result<Outcome> {
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
    fn weigh_as(&mut self, plan: Plan) -> Result<()> {
        if plan.weighted {
            let (total, batch) = self.block(0, self.pilot())?;
            let (values, _) = self.values(&total);
            let importance = self.importance(&batch.expect("a pilot run fits one batch"), &values);
            self.tracer.density = self.tracer.density.weighted(&importance);
        }
        Ok(())
    }

    /// Sums the samples of a plan.
    fn repeat(&mut self, plan: Plan) -> Result<Outcome> {
        let (mut total, _) = self.block(0, plan.start)?;
        for _ in 0..plan.doublings {
            total = total.merge(&self.block(total.samples, total.samples)?.0);
        }
        let (values, relative_rms) = self.values(&total);
        let barely_seen = prepared::barely_seen(&self.tracer.surface, &self.demand.directions, &total.areas).len();
        Ok(Outcome { values, relative_rms, plan, barely_seen })
    }

    /// The whole of a long list, with the density, and at first the number of samples, that its part found.
    fn whole(&mut self, pairs: &[Pair], demand: Demand, plan: Plan, quality: &Quality, spent: &dyn Fn() -> f64) -> Result<Outcome> {
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
    fn cluster_bias(&self, probes: &[Pair]) -> Result<f64> {
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

/// Whether the samples that a list needs are found more cheaply on a part of it.
fn worth_a_part(demand: &Demand) -> bool {
    demand.pairs.len() >= WORTH_A_PART_PAIRS || demand.directions.len() >= WORTH_A_PART_DIRECTIONS
}

/// A part of a list, of about `count` pairs: those between some of the directions, since each direction costs.
pub(super) fn part_of(pairs: &[Pair], demand: &Demand, count: usize) -> Vec<Pair> {
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

/// How the triangles may be clustered: equal normals, and for long lists also those that the narrowest lobe of each surface tells little
/// apart, `width` of the widest that clusters come in; for short lists, whose cost is the visibility, measuring their bias would cost
/// more than they save. `None` where an image tints each facet by itself.
fn clustering(small: &SmallScale, long: bool, width: f64) -> Option<Clustering> {
    let uniform = small.surfaces.iter().all(|s| matches!(s.tint, Tint::Uniform(_)));
    let spread = |s: &Surface| match &s.brdf {
        _ if !long => 0.0,
        Brdf::Lambert { .. } => width * SPREAD_PER_ALPHA,
        Brdf::CookTorrance { alpha, .. } | Brdf::Ward { alpha, .. } => width * SPREAD_PER_ALPHA * alpha,
        // These do not widen.
        Brdf::BlinnPhong { .. } | Brdf::Measured(_) => 0.0,
    };
    let most = if long { MOST_CLUSTERS_LONG } else { MOST_CLUSTERS };
    uniform.then(|| Clustering { spread: small.surfaces.iter().map(spread).collect(), most })
}

/// One round too many costs more than a few samples too many.
const MARGIN: f64 = 1.2;

/// Samples, a power of two, that bring an error down by `factor`, if it is more than 1.
pub(super) fn needed(samples: u32, factor: f64) -> u32 {
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
