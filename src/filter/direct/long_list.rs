//! The whole of a list that is too long for its sums to be kept.

use super::params::PARAMS;
use super::rounds::Asked;
use super::run::{BlockCost, DirectRun, Outcome};
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{REPLICATES, Runs};
use crate::filter::control::{Control, RisingShare};
use crate::filter::facet_sampler::BATCH;
use crate::filter::plan::DirectPlan;
use crate::filter::prepared::Prepared;
use crate::filter::query::Query;
use crate::filter::sums;
use crate::filter::tolerance::{MAX_SAMPLES, keeps};
use glam::DVec3;

/// The values of a long list `pairs` with its `query`, with the density, and at first the number of samples, that its part found.
pub(super) fn whole(run: &mut DirectRun<'_, '_>, pairs: &[Pair], query: Query, plan: DirectPlan, asked: Asked<'_>) -> Result<Outcome> {
    let Asked { quality, spent } = asked;
    let control: Control<'_> = run.control;
    let most = most_samples(query.directions.len());
    let mut samples = plan.samples().min(most);
    if let (Some(budget), None) = (quality.budget, &quality.plan) {
        let per_sample = seconds_a_sample(run, &query);
        while samples > PARAMS.min_budget_samples && spent() + per_sample * f64::from(samples) > PARAMS.planned * budget {
            samples /= 2;
        }
    }
    let seeing = share_of_visibility(run, &query);
    let whole = run.share.end..1.0;
    let mut done = RisingShare::default();
    let mut query = Some(query);
    loop {
        let round_began = spent();
        let last = quality.plan.is_some() || 2 * samples > most;
        // The samples that the part found are expected to do: only the share that is kept for surprises is left after this round.
        let (from, to) = done.step(1.0, 1.0, last);
        let [from, to] = [from, to].map(|share| whole.start + share * (whole.end - whole.start));
        let seen = from + seeing * (to - from);
        let found = query.take().expect("put back below");
        let prepared = control.part(from..seen, |control| Prepared::new(&run.sampler, pairs, found, samples, control))?;
        let [facets, visibility] = prepared.seconds();
        run.seconds[1] += facets;
        run.seconds[2] += visibility;
        let hidden = prepared.undersampled(&run.sampler.surface);
        let undersampled = hidden.len();
        let must_see_more = run.wants_more_to_see(undersampled, samples, pairs.len());
        if must_see_more && !last && quality.budget.is_none() {
            // What does not see enough need not be summed.
            samples = enough_to_see(run, &hidden, 2 * samples, most, pairs.len())?;
            query = Some(prepared.into_query());
            continue;
        }
        let summing = spent();
        let (values, relative_rms) = control.part(seen..to, |control| prepared.evaluate(&run.small.surfaces, control))?;
        run.seconds[3] += spent() - summing;
        let met = keeps(relative_rms, quality.tolerance) && !must_see_more;
        let affordable = quality.budget.is_none_or(|b| spent() + 2.0 * (spent() - round_began) <= PARAMS.planned * b);
        if met || !affordable || last {
            return Ok(Outcome {
                values,
                relative_rms,
                plan: DirectPlan { start: samples, doublings: 0, ..plan },
                undersampled,
                seen_from: 0,
            });
        }
        samples *= 2;
        query = Some(prepared.into_query());
    }
}

/// Most samples whose visibility bits are kept for so many directions.
fn most_samples(directions: usize) -> u32 {
    let most = (PARAMS.max_bit_bytes * 8 / directions.max(1)).clamp(PARAMS.min_samples as usize, MAX_SAMPLES as usize);
    u32::try_from(most).map_or(MAX_SAMPLES, |m| 1 << m.ilog2())
}

/// What a sample costs on a list with this query, from what it cost on the part that `run` is of.
fn seconds_a_sample(run: &DirectRun<'_, '_>, query: &Query) -> f64 {
    let BlockCost { samples: tried, seconds: [facets, visibility, sums] } = run.last_block;
    let directions = query.directions.len() as f64 / run.query.directions.len().max(1) as f64;
    let longer = query.pairs.len() as f64 / run.query.pairs.len().max(1) as f64;
    (facets + visibility * directions + sums * longer) / f64::from(tried)
}

/// Share of the time of a round that visibility takes on a list with this query, from what it took on the part that `run` is of; half where nothing is
/// known.
fn share_of_visibility(run: &DirectRun<'_, '_>, query: &Query) -> f64 {
    let BlockCost { seconds: [facets, visibility, sums], .. } = run.last_block;
    let directions = query.directions.len() as f64 / run.query.directions.len().max(1) as f64;
    let seeing = facets + visibility * directions;
    let all = seeing + sums * query.pairs.len() as f64 / run.query.pairs.len().max(1) as f64;
    if all > 0.0 { seeing / all } else { 0.5 }
}

/// `samples`, or so many times two as these few `directions` need for [`DirectRun::wants_more_to_see`] to end, up to `most`.
fn enough_to_see(run: &mut DirectRun<'_, '_>, directions: &[DVec3], mut samples: u32, most: u32, pairs: usize) -> Result<u32> {
    while 2 * samples <= most && run.wants_more_to_see(directions.len(), samples, pairs) {
        let mut areas = vec![[0.0; REPLICATES]; directions.len()];
        let parts = samples.div_ceil(BATCH);
        for part in 0..parts {
            let batch = run.sampler.batch(Runs::of_block(0, samples, part, parts), directions)?;
            run.seconds[1] += batch.seconds[0];
            run.seconds[2] += batch.seconds[1];
            sums::add_areas(&batch, directions, &mut areas);
        }
        if sums::undersampled(&run.sampler.surface, directions, &areas).is_empty() {
            break;
        }
        samples *= 2;
    }
    Ok(samples)
}
