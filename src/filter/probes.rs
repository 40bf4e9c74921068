//! How far values of an approximation are off: of the methods that put few numbers in the place of many facets.
//!
//! For up to [`PROBES`] pairs of the list the same facets are also summed one by one, with what they see of exactly these directions: the
//! spread of eight replicates of them is the error of the facets, the difference from their sums the bias of all that is approximated.

use super::estimate::{CompleteSums, Spread};
use super::facet_sampler::{Batch, FacetSampler};
use super::plan::MAX_FACETS;
use super::query::Query;
use super::subset::subset;
use super::sums::{self, Materials};
use super::tolerance::{SAFETY, needed};
use super::value::Value;
use crate::direction::{MIN_COSINE, Pair};
use crate::error::Result;
use crate::facets::{Facets, REPLICATES};
use crate::material::SmallScale;
use crate::numerics::cast::index_u32;
use rustc_hash::FxHashMap;

/// Pairs on which errors are measured: twice the 256 that `docs/numerics.md`, section 3.6, asks for.
const PROBES: usize = 512;

/// `S` of a pair, and visible area over the footprint from its viewer.
pub type RawValue = ([f64; 3], f64);

/// Errors of an approximation, relative RMS.
#[derive(Clone, Copy, Debug)]
pub struct ApproximationErrors {
    /// Of the facets.
    pub facets: f64,
    /// Of what stands for them.
    pub bias: f64,
}

impl ApproximationErrors {
    /// Both together.
    pub fn total(self) -> f64 {
        self.facets.hypot(self.bias)
    }
}

/// Pairs on which errors are measured.
pub struct Probes {
    pairs: Vec<Pair>,
    /// The place of each in the list.
    places: Vec<usize>,
    query: Query,
}

impl Probes {
    /// Those of a list.
    pub fn new(small: &SmallScale, list: &[Pair]) -> Self {
        let chosen = if list.len() <= PROBES { list.to_vec() } else { subset(list, &Query::new(list, small.is_reciprocal()), PROBES) };
        let key = |p: &Pair| [p.wi, p.wo].map(|w| w.to_array().map(f64::to_bits));
        let first: FxHashMap<_, usize> = list.iter().enumerate().rev().map(|(k, p)| (key(p), k)).collect();
        let places = chosen.iter().map(|p| first[&key(p)]).collect();
        Self { query: Query::new(&chosen, false), pairs: chosen, places }
    }

    /// The same of a list that is the probes themselves.
    pub fn alone(&self) -> Self {
        Self { places: (0..self.pairs.len()).collect(), pairs: self.pairs.clone(), query: self.query.clone() }
    }

    /// The pairs.
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// Values of the probes by sums over `facets` one by one, and the relative RMS error that their spread tells.
    pub fn exact(&self, small: &SmallScale, sampler: &FacetSampler<'_>, facets: Facets) -> Result<(Vec<Value>, f64)> {
        let query = &self.query;
        let bits = sampler.see(&facets, &query.directions)?;
        let samples = u32::try_from(facets.samples).expect("fewer than 2^32 facets");
        let batch = Batch { facets, bits, seconds: [0.0; 2] };
        let mut areas = vec![[0.0; REPLICATES]; query.directions.len()];
        sums::add_areas(&batch, &query.directions, &mut areas);
        let lobes = sums::surface_lobes(&small.surfaces);
        let materials = Materials::new(&sampler.surface.groups, &lobes, false);
        let mut of_pairs = vec![[[0.0; 3]; REPLICATES]; query.pairs.len()];
        sums::add_pairs(&batch, query, &query.tasks(), &materials, &mut of_pairs);
        let (mut values, mut spread) = (vec![Value::default(); self.pairs.len()], Spread::default());
        CompleteSums { query, list: &self.pairs, sums: &of_pairs, first: 0, areas: &areas, samples }.write(
            &query.order,
            &mut values,
            &mut spread,
        );
        Ok((values, spread.relative_rms()))
    }

    /// As many facets, from `first` on, as bring their relative RMS error within `allowed`, or the most that there may be; with the values of the probes
    /// and the error by `exact`, the sums over so many facets.
    pub fn facets_within(
        allowed: f64,
        first: usize,
        mut exact: impl FnMut(usize) -> Result<(Vec<Value>, f64)>,
    ) -> Result<(usize, Vec<Value>, f64)> {
        let mut facets = first;
        loop {
            let (values, relative_rms) = exact(facets)?;
            let factor = SAFETY * relative_rms / allowed;
            if factor <= 1.0 || facets == MAX_FACETS {
                return Ok((facets, values, relative_rms));
            }
            facets = (needed(index_u32(facets), factor) as usize).clamp(2 * facets, MAX_FACETS);
        }
    }

    /// Relative RMS difference between `exact` values of the probes and the `raw` ones of the whole list.
    pub fn relative_difference(&self, exact: &[Value], raw: &[RawValue]) -> f64 {
        let (mut difference, mut energy) = (0.0, 0.0);
        for (value, &place) in exact.iter().zip(&self.places) {
            let (s, av) = raw[place];
            for c in 0..3 {
                let fbar = if av > 0.0 { s[c] / av } else { 0.0 };
                difference += (fbar - value.fbar[c]).powi(2);
                energy += value.fbar[c].powi(2);
            }
        }
        if energy > 0.0 { (difference / energy).sqrt() } else { difference.sqrt() }
    }
}

/// Values with standard errors that, over all of them, are the relative RMS `error`: half of it in proportion to each, half alike for all,
/// as approximations err beside peaks as much as in them.
pub fn values_with_error(pairs: &[Pair], raw: &[RawValue], error: f64) -> Vec<Value> {
    let mut values: Vec<Value> = pairs
        .iter()
        .zip(raw)
        .map(|(pair, &(s, av))| {
            if av <= 0.0 {
                return Value::default();
            }
            let fbar = s.map(|s| s / av);
            let cosine = pair.wi.z.max(MIN_COSINE);
            Value { s, fbar, fhat: fbar.map(|f| f / cosine), av, ..Value::default() }
        })
        .collect();
    let seen = values.iter().filter(|v| v.av > 0.0).count();
    let energy: f64 = values.iter().flat_map(|v| v.fbar).map(|f| f * f).sum::<f64>() / (3 * seen).max(1) as f64;
    for value in values.iter_mut().filter(|v| v.av > 0.0) {
        for c in 0..3 {
            value.se[c] = error * (0.5 * (value.fbar[c] * value.fbar[c] + energy)).sqrt();
            value.s_se[c] = value.se[c] * value.av;
        }
    }
    values
}
