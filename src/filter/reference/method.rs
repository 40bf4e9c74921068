//! The method, from a surface and pairs to values with errors.

use super::rays::Sums;
use super::rounds::RoundPlanner;
use super::tally::{Estimate, Tally};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::control::Control;
use crate::filter::plan::{BATCHES, Plan};
use crate::filter::quality::Quality;
use crate::filter::query::{Query, QueryEntry};
use crate::filter::value::{Effective, Summary, Value};
use crate::material::SmallScale;
use crate::numerics::cast::index_u32;
use crate::transport::{PathSequence, TransportScene};
use crate::visibility::MAX_PERIODS;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Pairs that tell how fast this machine is, when there is a budget. Chosen, not measured.
const PILOT_PAIRS: usize = 64;
/// Rays of each of them. Chosen, not measured.
const PILOT_RAYS: u32 = 64;
/// Pairs whose sums are held beside the tallies: 16 batches of about 100 bytes each, 7 MB in all. Chosen, not measured.
const PAIRS_AT_ONCE: usize = 4096;
/// Rays between two looks at whether the caller wants to stop. Chosen, not measured.
const RAYS_PER_CHECK: u32 = 1024;

/// Effective values by fresh rays from the viewer of each pair.
pub(in crate::filter) fn reference(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    let start = (control.clock)();
    let plan = quality.plan.as_ref().map(Plan::as_reference).transpose()?;
    let bounces = quality.bounces_of(small.bounces);
    let query = Query::new(pairs, false);
    let scene = TransportScene::new(small)?;
    control.check()?;
    let sampler = FacetSampler { scene: &scene, query: &query, bounces, seed: quality.seed, control };
    let ready = (control.clock)();

    let mut planner = RoundPlanner::new(plan, bounces, quality, start, weights(&query));
    if planner.needs_pilot() {
        let (rays, seconds) = sampler.pilot()?;
        planner.learn(rays, seconds, (control.clock)());
    }
    let mut tallies = vec![Tally::default(); query.pairs.len()];
    let mut estimates = vec![Estimate::default(); query.pairs.len()];
    let mut round: Vec<(usize, u32)> = (0..tallies.len()).map(|pair| (pair, planner.first_rays())).collect();
    while !round.is_empty() {
        sampler.trace(&mut tallies, &round, &mut planner)?;
        for &(pair, _) in &round {
            estimates[pair] = tallies[pair].estimate();
        }
        round = planner.next_round(&tallies, &estimates, (control.clock)());
    }
    (control.progress)("rays", 1.0);

    let values = values(&query, &estimates);
    let relative_rms = relative_rms(values.iter().map(|v| (v.fbar, v.se)));
    let notes = notes(&planner, &estimates, relative_rms);
    let most = tallies.iter().map(|t| t.rays as usize * BATCHES).max().unwrap_or(0);
    let summary = Summary {
        method: "reference",
        plan: Some(Plan::Reference(planner.plan().clone())),
        facets: most,
        clusters: most,
        directions: query.directions.len(),
        stages: vec![("prepare", 1e3 * (ready - start)), ("rays", 1e3 * ((control.clock)() - ready))],
        relative_rms,
        low_rank: Vec::new(),
        notes,
        details: Vec::new(),
    };
    Ok(Effective { values, summary })
}

/// How often the list asks for each distinct pair.
fn weights(query: &Query) -> Vec<f64> {
    let mut weights = vec![0.0; query.pairs.len()];
    for entry in query.entries.iter().flatten() {
        weights[entry.pair as usize] += 1.0;
    }
    weights
}

/// The values of the list.
fn values(query: &Query, estimates: &[Estimate]) -> Vec<Value> {
    let value = |entry: &QueryEntry| {
        let [light, viewer] = query.pairs[entry.pair as usize].map(|d| query.directions[d as usize].z);
        estimates[entry.pair as usize].value(light, viewer)
    };
    query.entries.iter().map(|entry| entry.as_ref().map_or_else(Value::default, value)).collect()
}

/// What a user should know of the result.
fn notes(planner: &RoundPlanner, estimates: &[Estimate], relative_rms: f64) -> Vec<String> {
    let mut notes = planner.notes(relative_rms);
    let given_up = estimates.iter().filter(|e| e.bias() > 0.0).count();
    if given_up > 0 {
        notes.push(format!(
            "rays of {given_up} pairs passed {} periods and count as free; what they could change is in the errors",
            MAX_PERIODS
        ));
    }
    let holes = estimates.iter().filter(|e| e.front == 0.0 && e.bias() == 0.0).count();
    if holes > 0 {
        notes.push(format!("{holes} pairs see no front face: their values are 0"));
    }
    notes
}

/// Relative RMS error of values with standard errors; absolute if all are 0.
fn relative_rms(values: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> f64 {
    let (mut count, mut energy, mut error) = (0, 0.0, 0.0);
    for (fbar, se) in values {
        count += 3;
        energy += fbar.iter().map(|x| x * x).sum::<f64>();
        error += se.iter().map(|x| x * x).sum::<f64>();
    }
    if energy > 0.0 {
        (error / energy).sqrt()
    } else if count > 0 {
        (error / f64::from(count)).sqrt()
    } else {
        0.0
    }
}

/// Everything that tracing needs to know.
struct FacetSampler<'a> {
    scene: &'a TransportScene<'a>,
    query: &'a Query,
    bounces: u32,
    seed: u64,
    control: &'a Control<'a>,
}

impl FacetSampler<'_> {
    /// Brings the batches of some pairs to a number of rays each.
    fn trace(&self, tallies: &mut [Tally], round: &[(usize, u32)], planner: &mut RoundPlanner) -> Result<()> {
        let planned: u64 = round.iter().map(|&(pair, rays)| u64::from(rays - tallies[pair].rays) * BATCHES as u64).sum();
        let (from_share, to_share) = planner.shares(planned);
        let traced = AtomicU64::new(0);
        let start = (self.control.clock)();
        for part in round.chunks(PAIRS_AT_ONCE) {
            let tasks: Vec<(usize, usize, u32, u32)> = part
                .iter()
                .flat_map(|&(pair, rays)| (0..BATCHES).map(move |batch| (pair, batch, rays)))
                .map(|(pair, batch, rays)| (pair, batch, tallies[pair].rays, rays))
                .collect();
            let sums: Vec<Sums> = tasks
                .par_iter()
                .map(|&(pair, batch, from, to)| {
                    let sums = self.batch(pair, batch, from..to)?;
                    let rays = u64::from(to - from);
                    let done = traced.fetch_add(rays, Ordering::Relaxed) + rays;
                    (self.control.progress)("rays", from_share + (to_share - from_share) * done as f64 / planned as f64);
                    Ok(sums)
                })
                .collect::<Result<_>>()?;
            for (&(pair, batch, _, to), sums) in tasks.iter().zip(&sums) {
                tallies[pair].rays = to;
                tallies[pair].add(batch, sums);
            }
        }
        planner.traced(planned, (self.control.clock)() - start);
        Ok(())
    }

    /// Traces a few rays of pairs from the whole list, and says how many in how many seconds.
    fn pilot(&self) -> Result<(u64, f64)> {
        let pairs = self.query.pairs.len();
        let start = (self.control.clock)();
        let stride = pairs.div_ceil(PILOT_PAIRS).max(1);
        (0..pairs).into_par_iter().step_by(stride).try_for_each(|pair| self.batch(pair, 0, 0..PILOT_RAYS).map(drop))?;
        let rays = pairs.div_ceil(stride) as u64 * u64::from(PILOT_RAYS);
        Ok((rays, (self.control.clock)() - start))
    }

    /// Some rays of one batch of one pair.
    fn batch(&self, pair: usize, batch: usize, rays: Range<u32>) -> Result<Sums> {
        let [wi, wo] = self.query.pairs[pair].map(|d| self.query.directions[d as usize]);
        let sequence = PathSequence::new(self.seed, &[index_u32(pair), index_u32(batch)]);
        let mut sums = Sums::default();
        for index in rays {
            if index % RAYS_PER_CHECK == 0 {
                self.control.check()?;
            }
            sums.add_path(self.scene, Pair { wi, wo }, self.bounces, sequence, index);
        }
        Ok(sums)
    }
}

#[cfg(test)]
#[path = "method_tests.rs"]
mod tests;
