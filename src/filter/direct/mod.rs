//! The direct method: facets shared by all pairs, visibility for exactly the wanted directions, direct sums.
//!
//! How many samples a tolerance needs is found by trying: 2,048 spread by area, or more where the triangles are many; if those leave much
//! to do, a pilot run of at least 8,192 shows where samples are worth most, and these are doubled, sums made so far being kept, until the estimated error meets the tolerance. All but
//! short lists of pairs try this on a part of the list: the whole then mostly takes one round.

mod part;
mod rounds;

pub(super) use part::part_of;
pub(super) use rounds::{MOST_SEARCH, needed};

use super::demand::Demand;
use super::plan::{Plan, WIDTHS};
use super::prepared::Tracer;
use super::{Control, Effective, Quality, Summary};
use crate::brdf::Brdf;
use crate::clusters::SPREAD_PER_ALPHA;
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::Clustering;
use crate::material::{SmallScale, Surface, Tint};
use crate::numerics::low_discrepancy::hash;
use rounds::{MIN_BUDGET_SAMPLES, Outcome, Run, SAFETY};

/// Longer lists of distinct pairs choose the number of samples on a part, and each round on the whole is a new one: their sums are not kept.
const LONG: usize = 1 << 15;
/// Lists of more distinct pairs begin with clusters of unequal normals. On shorter ones equal normals, or facets one by one, are as fast, more exact,
/// and may go where they are worth most (`biscale study`, tables of 272 and 600 directions).
const WIDE: usize = 1 << 18;
/// Share of a budget up to which a run counts as within it.
const OVERDRAWN: f64 = 1.2;

/// Most clusters: of a surface that needs more, each facet is summed by itself. A cluster fills up words of 64 facets.
const MOST_CLUSTERS: usize = 64;
/// The same for long lists, which take more samples.
const MOST_CLUSTERS_LONG: usize = 2048;
/// About so many pairs of a list tell the bias of clusters (`numerics.md`, section 3.6). Few grazing viewers make most of it.
const BIAS_PAIRS: usize = 2048;
/// Share of a tolerance that this bias may take.
const BIAS_SHARE: f64 = 0.4;

/// Values, and what finds facets and their visibility as it did for them.
pub(super) struct Traced<'a> {
    pub effective: Effective,
    pub tracer: Tracer<'a>,
    /// Samples that the values are from.
    pub samples: u32,
    /// Directions for which [`super::prepared::barely_seen`] holds.
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
    let in_part = long || plan.map_or(quality.budget.is_none() && part::worth_a_part(&demand), |plan| plan.by_part);
    let part: Vec<Pair>;
    let (tried, part_demand) = if in_part {
        part = part::to_try(pairs, &demand);
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
    let found = match plan {
        Some(plan) => {
            run.weigh_as(plan)?;
            Some(plan)
        }
        None => in_part.then(|| run.find(quality, &spent, pairs.len(), long)).transpose()?,
    };
    let mut outcome = match (plan, found) {
        (_, Some(found)) if long => run.whole(pairs, demand, found, quality, &spent)?,
        (plan, found) => {
            if in_part {
                (run.pairs, run.tasks, run.demand) = (pairs, demand.tasks(), demand);
            }
            match plan {
                Some(plan) => run.repeat(plan)?,
                None => run.adapt(quality, &spent, 1.0, found)?,
            }
        }
    };
    outcome.plan.narrowed = narrowed;
    let mut notes = notes(&outcome, pairs, quality, spent());
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

/// What a user should know of a run that took `spent` seconds.
fn notes(outcome: &Outcome, pairs: &[Pair], quality: &Quality, spent: f64) -> Vec<String> {
    let mut notes = Vec::new();
    if quality.plan.is_none() && SAFETY * outcome.relative_rms > quality.tolerance {
        let why = if quality.budget.is_some() {
            "the budget is spent"
        } else {
            "more samples would not fit the memory that this method allows itself"
        };
        notes.push(format!("the tolerance of {} is not met: {why}", quality.tolerance));
    }
    if let Some(budget) = quality.budget.filter(|b| spent > OVERDRAWN * b && outcome.plan.samples() == MIN_BUDGET_SAMPLES) {
        notes.push(format!("the budget of {budget} s is less than the {:.3} s that the fewest samples take here", spent));
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
    notes
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
