//! How many samples a list gets, round by round.

use super::params::PARAMS;
use super::run::{DirectRun, Outcome};
use crate::error::Result;
use crate::filter::facet_sampler::{BATCH, Batch};
use crate::filter::importance;
use crate::filter::plan::DirectPlan;
use crate::filter::quality::Quality;
use crate::filter::tolerance::{MARGIN, MAX_SAMPLES, SAFETY, keeps, needed, required};
use crate::filter::value::Value;

/// What a caller asks of the rounds.
#[derive(Clone, Copy)]
pub(super) struct Asked<'q> {
    pub quality: &'q Quality,
    /// Seconds since the run began.
    pub spent: &'q dyn Fn() -> f64,
}

/// Finds, on the part of a list that `run` is of, the samples with which to begin on the whole list of so many `pairs`, which may be `long`.
pub(super) fn samples_by_part(run: &mut DirectRun<'_, '_>, asked: Asked<'_>, pairs: usize, long: bool) -> Result<DirectPlan> {
    let first = run.first();
    if !long && run.start.enough <= first {
        return Ok(DirectPlan::samples_by_area(first));
    }
    // The budget must leave time for the whole.
    let tried = round_by_round(run, asked, PARAMS.part_budget, None)?;
    let samples = match asked.quality.budget {
        // Rounds double, so the last one overshoots: the number between them is predicted from the measured error. A short list needs no margin, since
        // one more doubling keeps the samples it has; a long list starts each round anew, and gets one. Where the part is under-sampled the
        // whole is, too.
        None => {
            let margin = if long { MARGIN } else { 1.0 };
            let target = required(tried.plan.samples(), SAFETY * tried.relative_rms / asked.quality.tolerance, margin).max(first);
            if run.wants_more_to_see(1, target, pairs) { target.max(tried.seen_from) } else { target }
        }
        Some(_) => tried.plan.samples(),
    };
    Ok(DirectPlan { start: samples, doublings: 0, by_part: tried.plan.weighted && !long, ..tried.plan })
}

/// Finds the samples that a tolerance needs, or a budget allows; `share` of the budget is for this. Begins with what a part of the list
/// `found`, and keeps its density.
pub(super) fn round_by_round(run: &mut DirectRun<'_, '_>, asked: Asked<'_>, share: f64, found: Option<DirectPlan>) -> Result<Outcome> {
    let Asked { quality, spent } = asked;
    let budget = quality.budget.map(|b| b * PARAMS.planned * share);
    let mut plan = match found {
        Some(found) => DirectPlan { start: found.samples(), doublings: 0, ..found },
        None => DirectPlan::samples_by_area(if budget.is_some() { PARAMS.min_budget_samples } else { run.first() }),
    };
    let mut block_began = spent();
    let mut seen_from = 0;
    let (mut total, mut batch) = run.block(0, plan.start)?;
    loop {
        let per_sample = (spent() - block_began) / f64::from(total.samples >> u32::from(plan.doublings > 0));
        let affordable = |samples: u32| budget.is_none_or(|b| spent() + per_sample * f64::from(samples) <= b);
        let (values, relative_rms) = run.values(&total);
        let target = needed(total.samples, SAFETY * relative_rms / quality.tolerance);
        run.target = target;
        let undersampled = run.undersampled(&total);
        let must_see_more = run.wants_more_to_see(undersampled, total.samples, run.query.pairs.len());
        seen_from = if must_see_more { 2 * total.samples } else { seen_from.min(total.samples) };
        let met = keeps(relative_rms, quality.tolerance) && !must_see_more;
        if met || total.samples == MAX_SAMPLES || !affordable(total.samples) {
            return Ok(Outcome { values, relative_rms, plan, undersampled, seen_from });
        }
        block_began = spent();
        let round = Round { plan, found: found.is_some(), samples: total.samples, target };
        let importance = round.importance(run, batch.as_ref(), &values);
        let weighted = importance.is_some();
        match affordable_block(round.new_block(run, weighted), if weighted { total.samples } else { 2 * total.samples }, affordable) {
            Some(samples) => {
                if let Some(importance) = importance {
                    run.weight_samples(&importance);
                    plan.weighted = true;
                }
                (total, batch) = run.block(0, samples)?;
                plan = DirectPlan { start: samples, doublings: 0, ..plan };
            }
            None => {
                total = total.merge(&run.block(total.samples, total.samples)?.0);
                plan.doublings += 1;
            }
        }
    }
}

/// As many samples of a new block as the budget allows, halved until they are; fewer than `least` would not be worth it.
fn affordable_block(samples: Option<u32>, least: u32, affordable: impl Fn(u32) -> bool) -> Option<u32> {
    let halvings = std::iter::successors(Some(samples?), |s| Some(s / 2)).take_while(|&s| s >= least);
    halvings.into_iter().find(|&s| affordable(s))
}

/// Where the rounds are.
struct Round {
    plan: DirectPlan,
    /// Whether a part of the list has found the density of the samples.
    found: bool,
    /// Samples so far.
    samples: u32,
    /// Samples that will probably be needed.
    target: u32,
}

impl Round {
    /// Whether so many more samples are needed that it pays to begin anew: clustered facets must all stand for the same.
    fn pays(&self, run: &DirectRun<'_, '_>) -> bool {
        self.target > 2 * self.samples && !run.sampler.is_clustered()
    }

    /// Whether nobody has yet looked where samples are worth most.
    fn is_unweighted(&self) -> bool {
        !self.found && !self.plan.weighted
    }

    /// Where samples are worth most, if this round was the pilot run and it pays to follow it.
    fn importance(&self, run: &DirectRun<'_, '_>, batch: Option<&Batch>, values: &[Value]) -> Option<Vec<f64>> {
        let is_pilot = self.is_unweighted() && self.samples == run.pilot() && self.plan.doublings == 0;
        (self.pays(run) && is_pilot)
            .then(|| run.importance(batch.expect("a pilot run fits one batch"), values))
            .filter(|importance| importance::gain(importance) >= PARAMS.least_gain)
    }

    /// Samples of a block that begins anew, if that is better than to double those that there are.
    fn new_block(&self, run: &DirectRun<'_, '_>, weighted: bool) -> Option<u32> {
        let pilot = run.pilot();
        if !self.pays(run) {
            None
        } else if weighted {
            Some((self.target / PARAMS.samples_per_weighted).max(pilot))
        } else if self.is_unweighted() && self.samples < pilot && self.target >= 4 * pilot {
            Some(pilot)
        } else {
            self.one_block_pays(run).then_some(self.target)
        }
    }

    /// Whether the samples that are needed cost less in one block than by doubling those that there are: each block projects all triangles.
    fn one_block_pays(&self, run: &DirectRun<'_, '_>) -> bool {
        let rounds_saved = f64::from((self.target / self.samples).ilog2()) - 1.0;
        self.target <= BATCH && run.sampler.costs_more_than_samples(rounds_saved, self.samples)
    }
}

/// Puts samples where the pilot run of a plan says they are worth most, if the plan had one.
pub(super) fn weight_by_pilot(run: &mut DirectRun<'_, '_>, plan: DirectPlan) -> Result<()> {
    if plan.weighted {
        let (total, batch) = run.block(0, run.pilot())?;
        let (values, _) = run.values(&total);
        let importance = run.importance(&batch.expect("a pilot run fits one batch"), &values);
        run.weight_samples(&importance);
    }
    Ok(())
}

/// Sums the samples of a plan, in the blocks in which they were found: the same bits.
pub(super) fn repeat_rounds(run: &mut DirectRun<'_, '_>, plan: DirectPlan) -> Result<Outcome> {
    run.target = plan.samples();
    let (mut total, _) = run.block(0, plan.start)?;
    for _ in 0..plan.doublings {
        total = total.merge(&run.block(total.samples, total.samples)?.0);
    }
    let (values, relative_rms) = run.values(&total);
    Ok(Outcome { values, relative_rms, plan, undersampled: run.undersampled(&total), seen_from: 0 })
}
