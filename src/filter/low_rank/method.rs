//! The method, from a surface and pairs to values with errors (Wu et al. 2011, sections 3.2 to 3.7).
//!
//! Facets; what they see; for each surface `N` and `M` by their factors; their product. How far the values are off: `errors`.

use super::choices::MatrixRows;
use super::errors::{adapt, errors, raw_values};
use super::run::{LowRankRun, RawValues, Stage};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::control::Control;
use crate::filter::plan::{LowRankPlan, Plan, Variant};
use crate::filter::probes::{ApproximationErrors, Probes, values_with_error};
use crate::filter::quality::{Method, Quality};
use crate::filter::query::Query;
use crate::filter::tolerance::measured_keeps;
use crate::filter::value::{Effective, Summary};
use crate::filter::visible_facets::VisibleFacets;
use crate::material::SmallScale;
use crate::numerics::words::percent;
use crate::visibility::MAX_PERIODS;

/// Effective values by the low-rank method.
pub(in crate::filter) fn low_rank(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    let given = quality.plan.as_ref().map(Plan::as_low_rank).transpose()?;
    let variant = given.map_or_else(|| quality.variant_of(Method::LowRank), |plan| plan.variant());
    let mut run = LowRankRun::new(small, variant, quality, control);
    let plan = match (given, variant) {
        (Some(plan), _) => plan,
        (None, Variant::Paper) => LowRankPlan::PAPER,
        (None, Variant::Improved) => {
            let most = VisibleFacets::most(Query::new(pairs, small.is_reciprocal()).directions.len());
            adapt(&mut run, &Probes::new(small, pairs), most)?
        }
    };
    let raw = raw_values(&mut run, &plan, pairs)?;
    let errors = errors(&mut run, &plan, pairs, &raw.pairs)?;
    if given.is_none() && !measured_keeps(errors.total, quality.tolerance) {
        let why = match variant {
            Variant::Paper => "the published method has fixed settings; `variant improved` or `method direct` look for those that keep it",
            Variant::Improved => "no settings that this method allows itself keep it; `method direct` does",
        };
        run.notes.push(format!("the tolerance of {} is not met: {why}", percent(quality.tolerance)));
    }
    Ok(result(run, &plan, pairs, raw, errors))
}

/// The values and their summary.
fn result(mut run: LowRankRun<'_>, plan: &LowRankPlan, pairs: &[Pair], raw: RawValues, errors: ApproximationErrors) -> Effective {
    run.details.push(format!(
        "relative RMS error of the facets {}, of bins, cuts{} {}",
        percent(errors.facets),
        if run.choices.rows == MatrixRows::Maps { " and interpolation" } else { "" },
        percent(errors.bias)
    ));
    let given_up = run.sampler.given_up();
    let mut error = errors.total;
    if given_up > 0 {
        // As in the direct method: their share is an error of every value.
        error = error.hypot(given_up as f64 / (plan.facets() as f64 * raw.directions as f64));
        run.details
            .push(format!("{given_up} rays passed {MAX_PERIODS} periods without an answer and count as free; the errors include them"));
    }
    let summary = Summary {
        method: match plan.variant() {
            Variant::Paper => "lowrank",
            Variant::Improved => "lowrank improved",
        },
        plan: Some(Plan::LowRank(*plan)),
        facets: plan.facets(),
        clusters: raw.bins,
        directions: raw.directions,
        stages: Stage::NAMES.into_iter().zip(run.seconds.map(|s| 1e3 * s)).collect(),
        relative_rms: error,
        low_rank: raw.facts,
        notes: run.notes,
        details: run.details,
    };
    Effective { values: values_with_error(pairs, &raw.pairs, error), summary }
}
