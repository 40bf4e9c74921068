//! How far the values of the low-rank method are off, and the settings that keep a tolerance.
//!
//! They are measured on [`Probes`].

use super::by_maps::by_maps;
use super::by_pairs::by_pairs;
use super::run::{LowRankRun, RawValues, Stage};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::control::RisingShare;
use crate::filter::plan::{LowRankPlan, MAX_NORMALS};
use crate::filter::probes::{ApproximationErrors, Probes, RawValue};
use crate::filter::tolerance::SAFETY;
use crate::filter::value::Value;

/// Share of the tolerance that the facets may take when the improved variant looks for its settings. In squares this and [`BIAS_SHARE`] are less than
/// all of it: `.85² + .45² = .93`.
const FACET_SHARE: f64 = 0.85;
/// Share of the tolerance that bins and cuts may take.
const BIAS_SHARE: f64 = 0.45;

/// Values of a list by a plan.
pub(super) fn raw_values(run: &mut LowRankRun<'_>, plan: &LowRankPlan, list: &[Pair]) -> Result<RawValues> {
    match *plan {
        LowRankPlan::Paper { directions, rates, .. } => by_maps(run, plan, directions, rates, list),
        LowRankPlan::Improved { normals, .. } => by_pairs(run, plan, normals, list),
    }
}

/// Errors of the values `raw` of a list that a plan gave.
pub(super) fn errors(run: &mut LowRankRun<'_>, plan: &LowRankPlan, list: &[Pair], raw: &[RawValue]) -> Result<ApproximationErrors> {
    let probes = Probes::by_value(run.small, list, raw);
    let (exact, facets) = exact(run, plan, &probes)?;
    let began = run.now();
    let total = probes.measure(run.small, run.sampler.seed, run.control, plan.facets(), raw)?;
    run.took(Stage::Visibility, began);
    Ok(ApproximationErrors { facets, bias: probes.relative_difference(&exact, raw), total })
}

/// Values of the probes by sums over a plan's facets one by one, and the relative RMS error that their spread tells.
fn exact(run: &mut LowRankRun<'_>, plan: &LowRankPlan, probes: &Probes) -> Result<(Vec<Value>, f64)> {
    let facets = run.facets(plan);
    let began = run.now();
    let exact = probes.exact(run.small, &run.sampler, facets);
    run.took(Stage::Visibility, began);
    exact
}

/// Share of the progress that finding the settings may make. Chosen, not measured.
const SETTINGS_PROGRESS: f64 = 0.5;
/// Settings that are expected to be tried. Chosen, not measured.
const SETTINGS_TRIED: f64 = 3.0;

/// The improved variant's plan for the tolerance: facets, `most` at most, until their error on the probes is small enough, then a map of normals until
/// the bias is.
pub(super) fn adapt(run: &mut LowRankRun<'_>, probes: &Probes, most: usize) -> Result<LowRankPlan> {
    let tolerance = run.quality.tolerance;
    let LowRankPlan::Improved { facets, mut normals, energy } = LowRankPlan::first(tolerance) else {
        unreachable!("the first plan is improved")
    };
    let (facets, exact, _) = Probes::facets_within(FACET_SHARE * tolerance, [facets, most], |facets| {
        exact(run, &LowRankPlan::Improved { facets, normals, energy }, probes)
    })?;
    let alone = probes.alone();
    let mut done = RisingShare::default();
    loop {
        let (from, to) = done.step(1.0, SETTINGS_TRIED, false);
        run.share = SETTINGS_PROGRESS * from..SETTINGS_PROGRESS * to;
        let plan = LowRankPlan::Improved { facets, normals, energy };
        let raw = raw_values(run, &plan, probes.pairs())?;
        if SAFETY * alone.relative_difference(&exact, &raw.pairs) <= BIAS_SHARE * tolerance || normals == MAX_NORMALS {
            run.share = run.share.end..1.0;
            return Ok(plan);
        }
        normals *= 2;
    }
}
