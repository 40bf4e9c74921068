//! How many rays each pair gets, round by round, and the plan that repeats it.

use super::tally::{Estimate, Tally};
use crate::filter::plan::{BATCHES, MAX_RAYS, ReferencePlan};
use crate::filter::quality::Quality;
use crate::filter::tolerance::{SAFETY, keeps};
use crate::numerics::words::percent;
use std::collections::BinaryHeap;

/// How the rounds are planned.
struct RoundParams {
    /// Rays of each batch in the first round: 2,048 a pair. Fewer can miss a narrow highlight altogether, and then show no error. Chosen, not measured.
    first_rays: u32,
    /// Fewest rays of each batch in the first round, when a budget leaves no time for more. Chosen, not measured.
    fewest_rays: u32,
    /// Most doublings of one pair in a round: errors of few rays are known too badly to go further on their word. Chosen, not measured.
    doublings_a_round: u32,
    /// Rounds aim this much below the tolerance, so that the last one need not be followed by another for a hair's breadth. Chosen, not measured.
    aim: f64,
    /// Share of the time left that a round may plan for: clocks and predictions are rough. Chosen, not measured.
    time_share: f64,
    /// Share of the time left that the first round may take: what it finds must be followed. Chosen, not measured.
    first_share: f64,
    /// Noise, as a share of the squared bias, below which more rays change the whole error by less than an eighth.
    least_noise: f64,
}

const PARAMS: RoundParams =
    RoundParams { first_rays: 128, fewest_rays: 8, doublings_a_round: 2, aim: 0.95, time_share: 0.9, first_share: 0.5, least_noise: 0.25 };

/// Makes a plan while it is carried out, or repeats one.
pub(super) struct RoundPlanner {
    plan: ReferencePlan,
    /// The rounds that are left of a plan that is repeated.
    repeats: Option<std::vec::IntoIter<u32>>,
    tolerance: f64,
    /// Moment at which the budget ends.
    deadline: Option<f64>,
    /// How often the caller asked for each pair.
    weights: Vec<f64>,
    rays: u64,
    seconds: f64,
    /// Share of all work that is done, and rays that are believed to be left.
    share: f64,
    left: f64,
    out_of_time: bool,
    /// Whether rays that were given up could change the values by more than the tolerance, however many others there are.
    too_many_given_up: bool,
}

/// A pair that could be doubled.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Squared error that a ray more would take away.
    gain: f64,
    pair: usize,
    error: f64,
    rays: u32,
    doublings: u32,
}

impl Candidate {
    fn new(pair: usize, error: f64, rays: u32, doublings: u32) -> Option<Self> {
        let possible = error > 0.0 && 2 * rays <= MAX_RAYS / BATCHES as u32 && doublings < PARAMS.doublings_a_round;
        possible.then(|| Self { gain: 0.5 * error / f64::from(rays), pair, error, rays, doublings })
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.gain.total_cmp(&other.gain).then(other.pair.cmp(&self.pair))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

impl RoundPlanner {
    /// `start` is the moment at which the budget began; `weights` says how often the caller asked for each pair.
    pub fn new(plan: Option<ReferencePlan>, bounces: u32, quality: &Quality, start: f64, weights: Vec<f64>) -> Self {
        let repeats = plan.as_ref().map(|p| p.doublings.clone().into_iter());
        let deadline = quality.budget.filter(|_| plan.is_none()).map(|seconds| start + seconds);
        let first = plan.map_or(PARAMS.first_rays, |p| p.first);
        Self {
            plan: ReferencePlan { bounces, first, doublings: Vec::new() },
            repeats,
            tolerance: quality.tolerance,
            deadline,
            left: f64::from(first) * (BATCHES * weights.len()) as f64,
            weights,
            rays: 0,
            seconds: 0.0,
            share: 0.0,
            out_of_time: false,
            too_many_given_up: false,
        }
    }

    /// Whether the time is limited, so that a pilot has to tell how far it goes.
    pub fn needs_pilot(&self) -> bool {
        self.deadline.is_some()
    }

    /// Chooses the first round by the speed of a pilot, so that it takes half of the time at most.
    pub fn learn(&mut self, rays: u64, seconds: f64, now: f64) {
        let Some(deadline) = self.deadline else { return };
        let possible = PARAMS.first_share * (deadline - now) * rays as f64 / seconds.max(1e-9) / (BATCHES * self.weights.len()) as f64;
        while self.plan.first > PARAMS.fewest_rays && f64::from(self.plan.first) > possible {
            self.plan.first /= 2;
        }
        self.left = f64::from(self.plan.first) * (BATCHES * self.weights.len()) as f64;
    }

    /// Rays of each batch in the first round.
    pub fn first_rays(&self) -> u32 {
        self.plan.first
    }

    /// The plan so far.
    pub fn plan(&self) -> &ReferencePlan {
        &self.plan
    }

    /// Share of all work that is done before a round, and at its end, if it traces `rays`. It never falls.
    pub fn shares(&self, rays: u64) -> (f64, f64) {
        let part = rays as f64 / self.left.max(rays as f64);
        (self.share, self.share + (1.0 - self.share) * part)
    }

    /// A round has traced `rays`.
    pub fn traced(&mut self, rays: u64, seconds: f64) {
        self.share = self.shares(rays).1;
        self.rays += rays;
        self.seconds += seconds;
    }

    /// The pairs to go on with and their new rays per batch; none when all is done.
    pub fn next_round(&mut self, tallies: &[Tally], estimates: &[Estimate], now: f64) -> Vec<(usize, u32)> {
        let weighted = |of: fn(&Estimate) -> f64| estimates.iter().zip(&self.weights).map(|(e, w)| w * of(e)).sum::<f64>();
        let (error, bias) = (weighted(Estimate::noise), weighted(Estimate::bias));
        let energy = weighted(|e| e.fbar.iter().map(|x| x * x).sum());
        let scale = if energy > 0.0 { energy } else { 3.0 * self.weights.iter().sum::<f64>() };
        // A bias does not shrink with more rays: where it is too large alone, noise is only made small beside it.
        let squared = |relative: f64| (relative / SAFETY).powi(2) * scale - bias;
        self.too_many_given_up = squared(self.tolerance) < 0.0;
        let target = squared(PARAMS.aim * self.tolerance).max(PARAMS.least_noise * bias);
        let limit = match &mut self.repeats {
            Some(rounds) => rounds.next().unwrap_or(0),
            None if error <= squared(self.tolerance) || error <= target => 0,
            None => u32::MAX,
        };
        let repeating = self.repeats.is_some();
        let speed = self.rays as f64 / self.seconds.max(1e-9);
        let affordable = self.deadline.map_or(f64::INFINITY, |deadline| PARAMS.time_share * (deadline - now) * speed);

        let candidate = |pair: usize, error, rays, doublings| Candidate::new(pair, error, rays, doublings);
        let mut heap: BinaryHeap<Candidate> = estimates
            .iter()
            .zip(tallies)
            .enumerate()
            .filter_map(|(pair, (e, t))| candidate(pair, self.weights[pair] * e.noise(), t.rays, 0))
            .collect();
        let mut rays: Vec<u32> = tallies.iter().map(|t| t.rays).collect();
        let (mut expected, mut cost, mut count) = (error, 0.0, 0);
        while count < limit && (repeating || expected > target) {
            let Some(next) = heap.pop() else { break };
            let price = f64::from(next.rays) * BATCHES as f64;
            if cost + price > affordable {
                self.out_of_time = true;
                break;
            }
            cost += price;
            expected -= 0.5 * next.error;
            count += 1;
            rays[next.pair] *= 2;
            heap.extend(candidate(next.pair, 0.5 * next.error, 2 * next.rays, next.doublings + 1));
        }
        if count > 0 {
            self.plan.doublings.push(count);
            // Errors fall with the root of the number of rays at least.
            let more = if target > 0.0 { (error / target - 1.0).max(0.0) * self.rays as f64 } else { 4.0 * cost };
            self.left = more.min(affordable).max(cost);
        }
        rays.into_iter().zip(tallies).enumerate().filter(|(_, (n, t))| *n > t.rays).map(|(pair, (n, _))| (pair, n)).collect()
    }

    /// Why the tolerance was missed, if it was.
    pub fn notes(&self, relative_rms: f64) -> Vec<String> {
        if self.repeats.is_some() || keeps(relative_rms, self.tolerance) {
            return Vec::new();
        }
        let why = if self.out_of_time {
            "the time is over".to_owned()
        } else if self.too_many_given_up {
            "rays that are given up could change more, and further rays would not help".to_owned()
        } else {
            format!("no pair may have more than {MAX_RAYS} rays")
        };
        let (tolerance, error) = (percent(self.tolerance), percent(relative_rms));
        vec![format!("the tolerance of {tolerance} is not met: {why}; the estimated relative RMS error is {error}")]
    }
}
