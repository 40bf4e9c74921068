//! The method, from a surface and pairs to values with errors.

use super::clustering::{ClusteredTracer, clustered};
use super::params::PARAMS;
use super::rounds::{Asked, repeat_rounds, round_by_round, samples_by_part, weight_by_pilot};
use super::run::{DirectRun, Outcome, StartHint};
use super::{long_list, part};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::control::Control;
use crate::filter::facet_sampler::FacetSampler;
use crate::filter::plan::Plan;
use crate::filter::prepared::Prepared;
use crate::filter::quality::Quality;
use crate::filter::query::Query;
use crate::filter::tolerance::keeps;
use crate::filter::value::{Effective, Summary};
use crate::material::SmallScale;
use crate::numerics::seed;
use crate::numerics::words::percent;
use crate::visibility::MAX_PERIODS;

/// Effective values by the direct method.
pub(in crate::filter) fn direct(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    Ok(traced(small, pairs, quality, control, StartHint::UNKNOWN)?.effective)
}

/// The same where something is known of the samples that will be needed; and how many directions too few samples see.
pub(in crate::filter) fn direct_from(
    small: &SmallScale,
    pairs: &[Pair],
    quality: &Quality,
    control: &Control<'_>,
    start: StartHint,
) -> Result<(Effective, usize)> {
    let traced = traced(small, pairs, quality, control, start)?;
    Ok((traced.effective, traced.undersampled))
}

/// Computes the values of a surface by the direct method, as [`effective`](crate::filter::effective()) does, and keeps the facets that they need and what
/// these see: a bit a facet and direction, and about 60 bytes a facet.
///
/// # Errors
/// Those of [`effective`](crate::filter::effective()).
pub fn prepare<'a>(small: &SmallScale, pairs: &'a [Pair], quality: &Quality, control: &Control<'_>) -> Result<(Prepared<'a>, Effective)> {
    let DirectResult { effective, sampler, samples, .. } = traced(small, pairs, quality, control, StartHint::UNKNOWN)?;
    Ok((Prepared::new(&sampler, pairs, Query::new(pairs, small.is_reciprocal()), samples, control)?, effective))
}

/// Values, and what finds facets and their visibility as it did for them.
struct DirectResult<'a> {
    effective: Effective,
    sampler: FacetSampler<'a>,
    /// Samples that the values are from.
    samples: u32,
    /// Directions that too few of the samples see.
    undersampled: usize,
}

/// The values with what they were made by: clusters, then the number of samples on a part of the list, then the list itself.
fn traced<'a>(
    small: &'a SmallScale,
    pairs: &[Pair],
    quality: &Quality,
    control: &Control<'a>,
    start: StartHint,
) -> Result<DirectResult<'a>> {
    let began = (control.clock)();
    let spent = || (control.clock)() - began;
    let plan = quality.plan.as_ref().map(Plan::as_direct).transpose()?;
    let symmetric = small.is_reciprocal();
    let query = Query::new(pairs, symmetric);
    let directions = query.directions.len();
    let long = query.pairs.len() > PARAMS.long_list;
    // A short budget is better spent on the list itself. A plan says where its pilot run was.
    let in_part = long || plan.map_or(quality.budget.is_none() && part::worth_a_part(&query), |plan| plan.by_part);
    let part = if in_part { part::to_try(pairs, &query) } else { Vec::new() };
    let (tried, tried_query) = if in_part { (&part[..], Query::new(&part, symmetric)) } else { (pairs, query.clone()) };
    let ClusteredTracer { sampler, narrowed, bias } =
        clustered(small, pairs, &query, plan, quality.tolerance, seed::fold(quality.seed), control)?;
    let mut run = DirectRun::new(small, sampler, tried, tried_query, control, start);
    run.seconds[0] = spent();

    let asked = Asked { quality, spent: &spent };
    if in_part && plan.is_none() {
        run.share = 0.0..PARAMS.part_progress;
    } else if long {
        // The pilot run of a plan is nothing beside the list.
        run.share = 0.0..0.0;
    }
    let found = match plan {
        Some(plan) => {
            weight_by_pilot(&mut run, plan)?;
            Some(plan)
        }
        None => in_part.then(|| samples_by_part(&mut run, asked, pairs.len(), long)).transpose()?,
    };
    let mut outcome = match (plan, found) {
        (_, Some(found)) if long => long_list::whole(&mut run, pairs, query, found, asked)?,
        (plan, found) => {
            if in_part {
                run.set_list(pairs, query);
            }
            match plan {
                Some(plan) => repeat_rounds(&mut run, plan)?,
                None => round_by_round(&mut run, asked, 1.0, found)?,
            }
        }
    };
    outcome.plan.narrowed = narrowed;
    let notes = notes(&outcome, pairs, quality, spent());
    let mut details: Vec<String> = outcome.add_bias(bias).into_iter().collect();
    details.extend(outcome.add_given_up(run.sampler.given_up(), directions));
    Ok(result(run, outcome, directions, [notes, details]))
}

/// The values and their summary.
fn result<'a>(run: DirectRun<'a, '_>, outcome: Outcome, directions: usize, [notes, details]: [Vec<String>; 2]) -> DirectResult<'a> {
    let Outcome { values, relative_rms, plan, undersampled, .. } = outcome;
    let facets = plan.samples() as usize;
    let summary = Summary {
        method: "direct",
        plan: Some(Plan::Direct(plan)),
        facets,
        clusters: if run.sampler.is_clustered() { run.sampler.surface.groups.len() } else { facets },
        directions,
        stages: ["prepare", "facets", "visibility", "sums"].into_iter().zip(run.seconds.map(|s| 1e3 * s)).collect(),
        relative_rms,
        low_rank: Vec::new(),
        notes,
        details,
    };
    DirectResult { effective: Effective { values, summary }, sampler: run.sampler, samples: plan.samples(), undersampled }
}

impl Outcome {
    /// Adds the bias of clusters to all errors, and says so.
    fn add_bias(&mut self, bias: f64) -> Option<String> {
        if bias > 0.0 {
            self.add_relative_error(bias);
            Some(format!("clusters of unequal normals err by {}, which the errors include", percent(bias)))
        } else {
            None
        }
    }

    /// Adds the rays that were given up, and count as free, to the errors of all values, and says so.
    ///
    /// Their share is that of the samples of this result, though rays of earlier rounds count too: rather too large than too small.
    fn add_given_up(&mut self, rays: usize, directions: usize) -> Option<String> {
        if rays == 0 {
            return None;
        }
        let share = rays as f64 / (f64::from(self.plan.samples()) * directions as f64);
        self.add_relative_error(share);
        Some(format!(
            "{rays} rays ({} of all) passed {MAX_PERIODS} periods without an answer and count as free; the errors include them",
            percent(share)
        ))
    }

    /// Adds an error that is the same share of every value.
    fn add_relative_error(&mut self, share: f64) {
        self.relative_rms = self.relative_rms.hypot(share);
        for value in &mut self.values {
            for c in 0..3 {
                value.se[c] = value.se[c].hypot(share * value.fbar[c]);
                value.s_se[c] = value.s_se[c].hypot(share * value.s[c]);
            }
        }
    }
}

/// What a user should know of a run that took `spent` seconds.
fn notes(outcome: &Outcome, pairs: &[Pair], quality: &Quality, spent: f64) -> Vec<String> {
    let mut notes = Vec::new();
    if quality.plan.is_none() && !keeps(outcome.relative_rms, quality.tolerance) {
        let why = if quality.budget.is_some() {
            "the budget is spent"
        } else {
            "more samples would not fit the memory that this method allows itself"
        };
        notes.push(format!("the tolerance of {} is not met: {why}", percent(quality.tolerance)));
    }
    let fewest = outcome.plan.samples() == PARAMS.min_budget_samples;
    if let Some(budget) = quality.budget.filter(|b| fewest && spent > PARAMS.overdrawn * b) {
        notes.push(format!("the budget of {budget} s is less than the {spent:.3} s that the fewest samples take here"));
    }
    if outcome.undersampled > 0 {
        notes.push(format!(
            "{} directions see so few of the samples that what they show may be missed: `method reference` finds it",
            outcome.undersampled
        ));
    }
    // Directions below the horizon are black, and no news.
    let above = |pair: &Pair| pair.wi.z >= 0.0 && pair.wo.z >= 0.0;
    let black = outcome.values.iter().zip(pairs).filter(|(v, pair)| v.av == 0.0 && above(pair)).count();
    if black > 0 {
        notes.push(format!("{black} pairs see no front face: their values are 0"));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::plan::DirectPlan;
    use crate::filter::value::Value;

    #[test]
    fn rays_that_were_given_up_are_in_the_error_of_every_value() {
        let value = Value { s: [0.2; 3], s_se: [0.003; 3], fbar: [0.4; 3], se: [0.003; 3], ..Value::default() };
        let plan = DirectPlan::samples_by_area(1000);
        let mut outcome = Outcome { values: vec![value], relative_rms: 0.003, plan, undersampled: 0, seen_from: 0 };
        assert_eq!(outcome.add_given_up(0, 5), None);
        assert_eq!((outcome.values[0], outcome.relative_rms), (value, 0.003));
        // 50 of 1,000 samples in 5 directions: 1 %.
        let note = outcome.add_given_up(50, 5).unwrap();
        assert!(note.starts_with("50 rays (1.0 % of all)"), "{note}");
        assert!((outcome.relative_rms - 0.003_f64.hypot(0.01)).abs() < 1e-15);
        assert!(
            (outcome.values[0].se[1] - 0.003_f64.hypot(0.004)).abs() < 1e-15
                && (outcome.values[0].s_se[2] - 0.003_f64.hypot(0.002)).abs() < 1e-15
        );
    }
}
