//! How far the values of the low-rank method are off, and the settings that keep a tolerance.
//!
//! For up to [`PROBES`] of the wanted pairs the same facets are also summed one by one, with what they see of exactly these directions: the
//! spread of eight sets of them is the error of the facets, the difference from their sums the bias of all that is low-rank, binned or
//! interpolated.

use super::method::Run;
use super::plan::{MAX_FACETS, MAX_NORMALS, Plan};
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::SETS;
use crate::filter::Value;
use crate::filter::demand::Demand;
use crate::filter::direct::{needed, part_of};
use crate::filter::estimate::Spread;
use crate::filter::prepared::{self, Batch, Filled, Materials};
use crate::material::SmallScale;
use rustc_hash::FxHashMap;

/// Pairs on which errors are measured.
const PROBES: usize = 512;
/// To keep a tolerance, stop when this times the estimate is within it (`numerics.md`, section 3.6).
pub(super) const SAFETY: f64 = 1.5;

/// Errors of a run, relative RMS.
#[derive(Clone, Copy)]
pub(super) struct Errors {
    pub(super) facets: f64,
    pub(super) bias: f64,
}

impl Errors {
    pub(super) fn total(self) -> f64 {
        self.facets.hypot(self.bias)
    }
}

/// Pairs on which errors are measured.
pub(super) struct Probes {
    pairs: Vec<Pair>,
    /// The place of each in the list.
    places: Vec<usize>,
    demand: Demand,
}

impl Probes {
    pub(super) fn new(small: &SmallScale, list: &[Pair]) -> Self {
        let chosen = if list.len() <= PROBES { list.to_vec() } else { part_of(list, &Demand::new(list, small.is_reciprocal()), PROBES) };
        let key = |p: &Pair| [p.wi, p.wo].map(|w| w.to_array().map(f64::to_bits));
        let first: FxHashMap<_, usize> = list.iter().enumerate().rev().map(|(k, p)| (key(p), k)).collect();
        let places = chosen.iter().map(|p| first[&key(p)]).collect();
        Self { demand: Demand::new(&chosen, false), pairs: chosen, places }
    }
}

impl Run<'_> {
    /// Errors on the probes of values that a plan gave.
    pub(super) fn errors(&mut self, plan: &Plan, probes: &Probes, raw: &[([f64; 3], f64)]) -> Result<Errors> {
        let (exact, facets) = self.exact(plan, probes)?;
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
        Ok(Errors { facets, bias })
    }

    /// Values of the probes by sums over a plan's facets one by one, and the relative RMS error that their spread tells.
    fn exact(&mut self, plan: &Plan, probes: &Probes) -> Result<(Vec<Value>, f64)> {
        let facets = self.facets(plan);
        let began = self.now();
        let demand = &probes.demand;
        let bits = self.tracer.see(&facets, &demand.directions)?;
        let samples = u32::try_from(facets.samples).expect("at most MAX_FACETS");
        let batch = Batch { facets, bits, seconds: [0.0; 2] };
        let mut areas = vec![[0.0; SETS]; demand.directions.len()];
        prepared::add_areas(&batch, &demand.directions, &mut areas);
        let lobes = prepared::surface_lobes(&self.small.surfaces);
        let materials = Materials::new(&self.tracer.surface.groups, &lobes, false);
        let mut sums = vec![[[0.0; 3]; SETS]; demand.pairs.len()];
        prepared::add_pairs(&batch, demand, &demand.tasks(), &materials, &mut sums);
        let (mut values, mut spread) = (vec![Value::default(); probes.pairs.len()], Spread::default());
        Filled { demand, list: &probes.pairs, sums: &sums, first: 0, areas: &areas, samples }.write(
            &demand.order,
            &mut values,
            &mut spread,
        );
        self.took(2, began);
        Ok((values, spread.relative_rms()))
    }

    /// The improved variant's plan for the tolerance: facets until their error on the probes is small enough, then a map of normals until
    /// the bias is.
    pub(super) fn adapt(&mut self, probes: &Probes) -> Result<Plan> {
        /// Shares of the tolerance that the facets and the bias may take: together less than all of it.
        const FACETS: f64 = 0.85;
        const BIAS: f64 = 0.45;
        let tolerance = self.quality.tolerance;
        let Plan::Improved { mut facets, mut normals, energy } = Plan::first(tolerance) else { unreachable!("the first plan is improved") };
        loop {
            let plan = Plan::Improved { facets, normals, energy };
            let (_, relative_rms) = self.exact(&plan, probes)?;
            (self.control.progress)("settings", 0.5);
            let factor = SAFETY * relative_rms / (FACETS * tolerance);
            if factor <= 1.0 || facets == MAX_FACETS {
                break;
            }
            let samples = u32::try_from(facets).expect("at most MAX_FACETS");
            facets = (needed(samples, factor) as usize).clamp(2 * facets, MAX_FACETS);
        }
        loop {
            let plan = Plan::Improved { facets, normals, energy };
            let raw = self.raw(&plan, &probes.pairs)?;
            let alone = Probes { places: (0..probes.pairs.len()).collect(), pairs: probes.pairs.clone(), demand: probes.demand.clone() };
            let errors = self.errors(&plan, &alone, &raw.pairs)?;
            if SAFETY * errors.bias <= BIAS * tolerance || normals == MAX_NORMALS {
                return Ok(plan);
            }
            normals *= 2;
        }
    }
}
