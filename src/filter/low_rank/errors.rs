//! How far the values of the low-rank method are off, and the settings that keep a tolerance.
//!
//! For up to [`PROBES`] pairs of the list the same facets are also summed one by one, with what they see of exactly these directions: the
//! spread of eight replicates of them is the error of the facets, the difference from their sums the bias of all that is low-rank, binned or
//! interpolated.

use super::by_maps::by_maps;
use super::by_pairs::by_pairs;
use super::run::{LowRankRun, RawValues, Stage};
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::REPLICATES;
use crate::filter::estimate::{CompleteSums, Spread};
use crate::filter::plan::{LowRankPlan, MAX_FACETS, MAX_NORMALS};
use crate::filter::query::Query;
use crate::filter::subset::subset;
use crate::filter::sums::{self, Materials};
use crate::filter::tolerance::{SAFETY, needed};
use crate::filter::tracer::Batch;
use crate::filter::value::Value;
use crate::material::SmallScale;
use rustc_hash::FxHashMap;

/// Pairs on which errors are measured: twice the 256 that `docs/numerics.md`, section 3.6, asks for.
const PROBES: usize = 512;
/// Share of the tolerance that the facets may take when the improved variant looks for its settings. In squares this and [`BIAS_SHARE`] are less than
/// all of it: `.85² + .45² = .93`.
const FACET_SHARE: f64 = 0.85;
/// Share of the tolerance that bins and cuts may take.
const BIAS_SHARE: f64 = 0.45;

/// Errors of a run, relative RMS.
#[derive(Clone, Copy)]
pub(super) struct LowRankErrors {
    pub facets: f64,
    pub bias: f64,
}

impl LowRankErrors {
    pub fn total(self) -> f64 {
        self.facets.hypot(self.bias)
    }
}

/// Pairs on which errors are measured.
pub(super) struct Probes {
    pairs: Vec<Pair>,
    /// The place of each in the list.
    places: Vec<usize>,
    query: Query,
}

impl Probes {
    pub fn new(small: &SmallScale, list: &[Pair]) -> Self {
        let chosen = if list.len() <= PROBES { list.to_vec() } else { subset(list, &Query::new(list, small.is_reciprocal()), PROBES) };
        let key = |p: &Pair| [p.wi, p.wo].map(|w| w.to_array().map(f64::to_bits));
        let first: FxHashMap<_, usize> = list.iter().enumerate().rev().map(|(k, p)| (key(p), k)).collect();
        let places = chosen.iter().map(|p| first[&key(p)]).collect();
        Self { query: Query::new(&chosen, false), pairs: chosen, places }
    }
}

/// Values of a list by a plan.
pub(super) fn raw_values(run: &mut LowRankRun<'_>, plan: &LowRankPlan, list: &[Pair]) -> Result<RawValues> {
    match *plan {
        LowRankPlan::Paper { directions, rates, .. } => by_maps(run, plan, directions, rates, list),
        LowRankPlan::Improved { normals, .. } => by_pairs(run, plan, normals, list),
    }
}

/// Errors on the probes of values that a plan gave.
pub(super) fn errors(run: &mut LowRankRun<'_>, plan: &LowRankPlan, probes: &Probes, raw: &[([f64; 3], f64)]) -> Result<LowRankErrors> {
    let (exact, facets) = exact(run, plan, probes)?;
    let (mut difference, mut energy) = (0.0, 0.0);
    for (value, &place) in exact.iter().zip(&probes.places) {
        let (s, av) = raw[place];
        for c in 0..3 {
            let fbar = if av > 0.0 { s[c] / av } else { 0.0 };
            difference += (fbar - value.fbar[c]).powi(2);
            energy += value.fbar[c].powi(2);
        }
    }
    let bias = if energy > 0.0 { (difference / energy).sqrt() } else { difference.sqrt() };
    Ok(LowRankErrors { facets, bias })
}

/// Values of the probes by sums over a plan's facets one by one, and the relative RMS error that their spread tells.
fn exact(run: &mut LowRankRun<'_>, plan: &LowRankPlan, probes: &Probes) -> Result<(Vec<Value>, f64)> {
    let facets = run.facets(plan);
    let began = run.now();
    let query = &probes.query;
    let bits = run.tracer.see(&facets, &query.directions)?;
    let samples = u32::try_from(facets.samples).expect("at most MAX_FACETS");
    let batch = Batch { facets, bits, seconds: [0.0; 2] };
    let mut areas = vec![[0.0; REPLICATES]; query.directions.len()];
    sums::add_areas(&batch, &query.directions, &mut areas);
    let lobes = sums::surface_lobes(&run.small.surfaces);
    let materials = Materials::new(&run.tracer.surface.groups, &lobes, false);
    let mut of_pairs = vec![[[0.0; 3]; REPLICATES]; query.pairs.len()];
    sums::add_pairs(&batch, query, &query.tasks(), &materials, &mut of_pairs);
    let (mut values, mut spread) = (vec![Value::default(); probes.pairs.len()], Spread::default());
    CompleteSums { query, list: &probes.pairs, sums: &of_pairs, first: 0, areas: &areas, samples }.write(
        &query.order,
        &mut values,
        &mut spread,
    );
    run.took(Stage::Visibility, began);
    Ok((values, spread.relative_rms()))
}

/// The improved variant's plan for the tolerance: facets until their error on the probes is small enough, then a map of normals until
/// the bias is.
pub(super) fn adapt(run: &mut LowRankRun<'_>, probes: &Probes) -> Result<LowRankPlan> {
    let tolerance = run.quality.tolerance;
    let LowRankPlan::Improved { mut facets, mut normals, energy } = LowRankPlan::first(tolerance) else {
        unreachable!("the first plan is improved")
    };
    loop {
        let plan = LowRankPlan::Improved { facets, normals, energy };
        let (_, relative_rms) = exact(run, &plan, probes)?;
        (run.control.progress)("settings", 0.5);
        let factor = SAFETY * relative_rms / (FACET_SHARE * tolerance);
        if factor <= 1.0 || facets == MAX_FACETS {
            break;
        }
        let samples = u32::try_from(facets).expect("at most MAX_FACETS");
        facets = (needed(samples, factor) as usize).clamp(2 * facets, MAX_FACETS);
    }
    loop {
        let plan = LowRankPlan::Improved { facets, normals, energy };
        let raw = raw_values(run, &plan, &probes.pairs)?;
        let alone = Probes { places: (0..probes.pairs.len()).collect(), pairs: probes.pairs.clone(), query: probes.query.clone() };
        let found = errors(run, &plan, &alone, &raw.pairs)?;
        if SAFETY * found.bias <= BIAS_SHARE * tolerance || normals == MAX_NORMALS {
            return Ok(plan);
        }
        normals *= 2;
    }
}
