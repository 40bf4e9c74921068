//! Facets of a surface and what they see, kept for a list of pairs: all that stays the same when only its materials change.

use super::control::Control;
use super::estimate::{CompleteSums, Spread, correct};
use super::facet_sampler::{BATCH, Batch, FacetSampler};
use super::query::Query;
use super::sums::{Materials, add_areas, add_pairs, surface_lobes, undersampled};
use super::value::Value;
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{Group, REPLICATES, Runs, Surface};
use crate::material;
use glam::DVec3;

/// Pairs whose sums are held at once when a long list is evaluated: 192 bytes each.
const GROUP_PAIRS: usize = 1 << 17;

/// Facets that know what they see, for a list of pairs. After an edit of materials only [`Prepared::evaluate`] must run again.
pub struct Prepared<'a> {
    pairs: &'a [Pair],
    query: Query,
    batches: Vec<Batch>,
    areas: Vec<[f64; REPLICATES]>,
    groups: Vec<Group>,
    samples: u32,
}

impl<'a> Prepared<'a> {
    /// The first `samples` samples of `facet_sampler` and what they see; `query` is that of `pairs`.
    pub(super) fn new(sampler: &FacetSampler<'_>, pairs: &'a [Pair], query: Query, samples: u32, control: &Control<'_>) -> Result<Self> {
        let parts = samples.div_ceil(BATCH);
        let mut batches = Vec::with_capacity(parts as usize);
        for part in 0..parts {
            batches.push(sampler.batch(Runs::of_block(0, samples, part, parts), &query.directions)?);
            (control.progress)("visibility", f64::from(part + 1) / f64::from(parts));
        }
        let mut areas = vec![[0.0; REPLICATES]; query.directions.len()];
        for batch in &batches {
            add_areas(batch, &query.directions, &mut areas);
        }
        Ok(Self { pairs, query, batches, areas, groups: sampler.surface.groups.clone(), samples })
    }

    /// Gives the query back, for another number of samples.
    pub(super) fn into_query(self) -> Query {
        self.query
    }

    /// Directions for which [`undersampled`] holds, on the surface that the samples lie on.
    pub(super) fn undersampled(&self, surface: &Surface) -> Vec<DVec3> {
        undersampled(surface, &self.query.directions, &self.areas)
    }

    /// Seconds that sampling and visibility took.
    pub(super) fn seconds(&self) -> [f64; 2] {
        self.batches.iter().fold([0.0; 2], |s, b| [s[0] + b.seconds[0], s[1] + b.seconds[1]])
    }

    /// Values of the pairs, in their order, with corrected standard errors, and their relative RMS error, under `surfaces`: those of the
    /// small-scale surface, with other BRDFs or uniform tints.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted) when `control` asks to stop.
    pub fn evaluate(&self, surfaces: &[material::Surface], control: &Control<'_>) -> Result<(Vec<Value>, f64)> {
        let lobes = surface_lobes(surfaces);
        let materials = Materials::new(&self.groups, &lobes, true);
        // An edit may bring a table that is not reciprocal; directions and what they see stay.
        let both_ways = (self.query.symmetric && !material::are_reciprocal(surfaces)).then(|| Query::new(self.pairs, false));
        let query = both_ways.as_ref().unwrap_or(&self.query);
        let tasks = query.tasks();
        // By pair, so that a group of pairs fills in its values and is forgotten.
        let order = &query.order;
        let pair_of = |k: u32| query.entries[k as usize].expect("ordered places have entries").pair as usize;
        let mut values = vec![Value::default(); self.pairs.len()];
        let mut spread = Spread::default();
        let (mut next_task, mut next_place) = (0, 0);
        while next_task < tasks.len() {
            control.check()?;
            let first = tasks[next_task].start;
            let end = next_task + tasks[next_task..].partition_point(|t| t.end <= first + GROUP_PAIRS).max(1);
            let group = &tasks[next_task..end];
            let last = group[group.len() - 1].end;
            let mut sums = vec![[[0.0; 3]; REPLICATES]; last - first];
            for batch in &self.batches {
                add_pairs(batch, query, group, &materials, &mut sums);
            }
            let place = next_place + order[next_place..].partition_point(|&k| pair_of(k) < last);
            let complete = CompleteSums { query, list: self.pairs, sums: &sums, first, areas: &self.areas, samples: self.samples };
            complete.write(&order[next_place..place], &mut values, &mut spread);
            next_place = place;
            (control.progress)("sums", last as f64 / query.pairs.len() as f64);
            next_task = end;
        }
        correct(&mut values, &spread);
        Ok((values, spread.relative_rms()))
    }
}
