//! The reference method: fresh rays from the viewer for every pair, no facets and no clusters, optionally with
//! interreflections.
//!
//! Parallel rays start uniformly over one period above the surface. Those that meet a front face see the visible projected
//! area: their share times `cos(theta_o)` is `av`, and the mean of `fr (n·wi)+ V(wi)` over them is `fbar`. A ray that meets a
//! back face sees black and is not in `av`; one that passes through a gap is not either.
//!
//! Each pair has [`BATCHES`] independent randomised sequences. With `S_r` the light and `a_r` the front share of batch `r`,
//! and `q = mean S / mean a`, the squared standard error is `sum (S_r - q a_r)^2 / (R mean(a)^2)` (`numerics.md`,
//! section 3.6); averaging the ratios of the batches would be biased. Rays that are given up after
//! [`MAX_PERIODS`](crate::visibility::MAX_PERIODS) cells add what they could have changed.
//!
//! Samples go where they help: until the relative RMS error meets the tolerance, the pair is doubled whose doubling takes away
//! most squared error for its rays. A plan is the list of those doublings' counts, one a round.

mod paths;
mod rounds;

use super::demand::Demand;
use super::{Control, Effective, Quality, Summary, Value};
use crate::direction::{MIN_COSINE, Pair};
use crate::error::Result;
use crate::material::SmallScale;
use paths::{Scene, Sequence, Sums};
use rayon::prelude::*;
use rounds::{Plan, PlanMaker};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Independent sequences of a pair, whose spread gives its standard error: at 16 the error of the error is 18 %.
const BATCHES: usize = 16;
/// Most rays from the viewer for one pair. What a tolerance needs beyond them is said in a note.
pub const MAX_RAYS: u32 = 1 << 22;
/// To keep a tolerance, stop when this times the estimate is within it (`numerics.md`, section 3.6).
const SAFETY: f64 = 1.5;
/// Pairs and rays of each that tell how fast this machine is, when there is a budget.
const PILOT_PAIRS: usize = 64;
const PILOT_RAYS: u32 = 64;
/// Pairs whose sums are held beside the tallies.
const PAIRS_AT_ONCE: usize = 4096;
/// Rays between two looks at whether the caller wants to stop.
const RAYS_PER_CHECK: u32 = 1024;

/// The rays of one pair so far.
#[derive(Clone, Debug)]
struct Tally {
    /// Rays of each batch.
    rays: u32,
    /// Light of each batch, and its rays that met a front face.
    batches: [([f64; 3], u32); BATCHES],
    /// Over all batches; see [`Sums`].
    doubtful: [f64; 3],
    range: [[f64; 3]; 2],
    lost: u32,
}

/// Mean and error of one pair.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    /// Mean light of a ray, its standard error.
    light: [f64; 3],
    light_se: [f64; 3],
    /// Share of the rays that meet a front face.
    front: f64,
    fbar: [f64; 3],
    se: [f64; 3],
    /// By how much rays that were given up could change `fbar`: part of `se`.
    given_up: [f64; 3],
}

pub(super) fn reference(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    let start = (control.clock)();
    let plan = quality.plan.as_deref().map(Plan::parse).transpose()?;
    let bounces = plan.as_ref().map_or(quality.bounces, |plan| plan.bounces);
    let demand = Demand::new(pairs, false);
    let scene = Scene::new(small)?;
    control.check()?;
    let tracer = Tracer { scene: &scene, demand: &demand, bounces, seed: quality.seed, control };
    let ready = (control.clock)();

    let mut weights = vec![0.0; demand.pairs.len()];
    for wanted in demand.wanted.iter().flatten() {
        weights[wanted.pair as usize] += 1.0;
    }
    let mut maker = PlanMaker::new(plan, bounces, quality, start, weights);
    if maker.needs_pilot() {
        let (rays, seconds) = tracer.pilot()?;
        maker.learn(rays, seconds, (control.clock)());
    }
    let mut tallies = vec![Tally::default(); demand.pairs.len()];
    let mut estimates = vec![Estimate::default(); demand.pairs.len()];
    let mut wanted: Vec<(usize, u32)> = (0..tallies.len()).map(|pair| (pair, maker.first_rays())).collect();
    while !wanted.is_empty() {
        tracer.trace(&mut tallies, &wanted, &mut maker)?;
        for &(pair, _) in &wanted {
            estimates[pair] = tallies[pair].estimate();
        }
        wanted = maker.next_round(&tallies, &estimates, (control.clock)());
    }
    (control.progress)("rays", 1.0);

    let values: Vec<Value> = demand
        .wanted
        .iter()
        .map(|wanted| match wanted {
            None => Value::default(),
            Some(wanted) => {
                let [light, viewer] = demand.pairs[wanted.pair as usize].map(|d| demand.directions[d as usize].z);
                estimates[wanted.pair as usize].value(light, viewer)
            }
        })
        .collect();
    let relative_rms = relative_rms(values.iter().map(|v| (v.fbar, v.se)));
    let mut notes = maker.notes(relative_rms);
    let given_up = estimates.iter().filter(|e| e.bias() > 0.0).count();
    if given_up > 0 {
        notes.push(format!(
            "rays of {given_up} pairs passed {} periods and count as free; what they could change is in the errors",
            crate::visibility::MAX_PERIODS
        ));
    }
    let holes = estimates.iter().filter(|e| e.front == 0.0).count();
    if holes > 0 {
        notes.push(format!("{holes} pairs see no front face: their values are 0"));
    }
    let most = tallies.iter().map(|t| t.rays as usize * BATCHES).max().unwrap_or(0);
    let summary = Summary {
        method: "reference",
        plan: maker.plan().to_string(),
        facets: most,
        clusters: most,
        directions: demand.directions.len(),
        stages: vec![("prepare", 1e3 * (ready - start)), ("rays", 1e3 * ((control.clock)() - ready))],
        relative_rms,
        low_rank: Vec::new(),
        notes,
    };
    Ok(Effective { values, summary })
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
struct Tracer<'a> {
    scene: &'a Scene<'a>,
    demand: &'a Demand,
    bounces: u32,
    seed: u64,
    control: &'a Control<'a>,
}

impl Tracer<'_> {
    /// Brings the batches of some pairs to a number of rays each.
    fn trace(&self, tallies: &mut [Tally], wanted: &[(usize, u32)], maker: &mut PlanMaker) -> Result<()> {
        let planned: u64 = wanted.iter().map(|&(pair, rays)| u64::from(rays - tallies[pair].rays) * BATCHES as u64).sum();
        let (from_share, to_share) = maker.shares(planned);
        let traced = AtomicU64::new(0);
        let start = (self.control.clock)();
        for wanted in wanted.chunks(PAIRS_AT_ONCE) {
            let tasks: Vec<(usize, usize, u32, u32)> = wanted
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
        maker.traced(planned, (self.control.clock)() - start);
        Ok(())
    }

    /// Traces a few rays of pairs from the whole list, and says how many in how many seconds.
    fn pilot(&self) -> Result<(u64, f64)> {
        let pairs = self.demand.pairs.len();
        let start = (self.control.clock)();
        let stride = pairs.div_ceil(PILOT_PAIRS).max(1);
        (0..pairs).into_par_iter().step_by(stride).try_for_each(|pair| self.batch(pair, 0, 0..PILOT_RAYS).map(drop))?;
        let rays = pairs.div_ceil(stride) as u64 * u64::from(PILOT_RAYS);
        Ok((rays, (self.control.clock)() - start))
    }

    /// Some rays of one batch of one pair.
    fn batch(&self, pair: usize, batch: usize, rays: Range<u32>) -> Result<Sums> {
        let [wi, wo] = self.demand.pairs[pair].map(|d| self.demand.directions[d as usize]);
        let sequence = Sequence::new(self.seed, pair, batch);
        let mut sums = Sums::default();
        for index in rays {
            if index % RAYS_PER_CHECK == 0 {
                self.control.check()?;
            }
            self.scene.add_path(wi, wo, self.bounces, sequence, index, &mut sums);
        }
        Ok(sums)
    }
}

impl Default for Tally {
    fn default() -> Self {
        let Sums { doubtful, range, lost, .. } = Sums::default();
        Self { rays: 0, batches: Default::default(), doubtful, range, lost }
    }
}

impl Tally {
    fn add(&mut self, batch: usize, sums: &Sums) {
        self.batches[batch].1 += sums.front;
        self.lost += sums.lost;
        for c in 0..3 {
            self.batches[batch].0[c] += sums.colour[c];
            self.doubtful[c] += sums.doubtful[c];
            self.range[0][c] = self.range[0][c].min(sums.range[0][c]);
            self.range[1][c] = self.range[1][c].max(sums.range[1][c]);
        }
    }

    fn estimate(&self) -> Estimate {
        let n = f64::from(self.rays);
        let batches = BATCHES as f64;
        let rays = n * batches;
        let front_rays: u32 = self.batches.iter().map(|b| b.1).sum();
        if front_rays == 0 {
            return Estimate::default();
        }
        let front = f64::from(front_rays) / rays;
        let mut estimate = Estimate { front, ..Estimate::default() };
        for c in 0..3 {
            let light = self.batches.iter().map(|b| b.0[c]).sum::<f64>() / rays;
            let q = light / front;
            // Spread of S_r - q a_r around its mean.
            let spread = |q: f64, mean: f64| {
                let squares: f64 = self.batches.iter().map(|b| ((b.0[c] - q * f64::from(b.1)) / n - mean).powi(2)).sum();
                squares / (batches * (batches - 1.0))
            };
            // Stratified rays can agree in all batches and yet be off by a part of a ray each. Sixteen batches that agree leave room
            // for a chance of up to 1/6 (95 %) that one ray of a batch should differ: no mean is known better than to what one ray
            // can change, a third of that.
            let least = if front_rays < rays as u32 { 0.0 } else { self.range[0][c] };
            let step = (self.range[1][c] - self.range[0][c]) / rays;
            let light_step = (self.range[1][c] - least) / rays;
            // Rays that were given up could be dark, or see anything that the others do.
            let change = (self.doubtful[c] + q * f64::from(self.lost)) / rays;
            estimate.light[c] = light;
            estimate.light_se[c] = (spread(0.0, light) + light_step * light_step + change * change).sqrt();
            estimate.fbar[c] = q;
            estimate.se[c] = (spread(q, 0.0) + step * step + change * change).sqrt() / front;
            estimate.given_up[c] = change / front;
        }
        estimate
    }
}

impl Estimate {
    /// Values for the cosines of the light and of the viewer.
    fn value(&self, light: f64, viewer: f64) -> Value {
        Value {
            s: self.light.map(|x| x * viewer),
            s_se: self.light_se.map(|x| x * viewer),
            fbar: self.fbar,
            se: self.se,
            fhat: self.fbar.map(|x| x / light.max(MIN_COSINE)),
            av: self.front * viewer,
        }
    }

    /// Squared error of `fbar` that more rays can take away.
    fn noise(&self) -> f64 {
        (self.se.iter().map(|x| x * x).sum::<f64>() - self.bias()).max(0.0)
    }

    /// Squared error of `fbar` that they cannot.
    fn bias(&self) -> f64 {
        self.given_up.iter().map(|x| x * x).sum()
    }
}

#[cfg(test)]
#[path = "reference_tests.rs"]
mod tests;
