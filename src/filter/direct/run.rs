//! Sums of blocks of samples, and the values that they give.

use super::params::PARAMS;
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{ALIGNMENT, REPLICATES, Runs};
use crate::filter::control::{Control, RisingShare};
use crate::filter::estimate::{self, CompleteSums, Spread};
use crate::filter::facet_sampler::{BATCH, Batch, FacetSampler};
use crate::filter::importance::{self, PilotValue};
use crate::filter::plan::DirectPlan;
use crate::filter::query::Query;
use crate::filter::sums::{self, Materials, PairSums};
use crate::filter::value::Value;
use crate::material::SmallScale;
use std::ops::Range;

/// What is known beforehand of the samples that will be needed.
#[derive(Clone, Copy, Debug)]
pub(in crate::filter) struct StartHint {
    /// So many are certainly enough.
    pub enough: u32,
    /// About so many are expected to be needed.
    pub expected: u32,
}

impl StartHint {
    /// Nothing.
    pub const UNKNOWN: Self = Self { enough: u32::MAX, expected: 1 };
}

/// Sums so far: for each pair, and for each direction, a value a replicate.
pub(super) struct Accumulated {
    pub samples: u32,
    pub pairs: Vec<PairSums>,
    pub areas: Vec<[f64; REPLICATES]>,
}

/// What a block of samples cost: what tells what more would.
#[derive(Clone, Copy)]
pub(super) struct BlockCost {
    pub samples: u32,
    /// Seconds for facets, visibility and sums.
    pub seconds: [f64; 3],
}

/// A run of the method over a list that is not long.
pub(super) struct DirectRun<'a, 'p> {
    pub small: &'a SmallScale,
    pub sampler: FacetSampler<'a>,
    pub pairs: &'p [Pair],
    pub query: Query,
    pub tasks: Vec<Range<usize>>,
    pub control: Control<'a>,
    /// Seconds of the stages: preparation, facets, visibility, sums.
    pub seconds: [f64; 4],
    pub last_block: BlockCost,
    /// Samples that will probably be needed: for the progress that is reported.
    pub target: u32,
    /// Progress of the list at hand, and the share of the whole work that is its own.
    pub done: RisingShare,
    pub share: Range<f64>,
    pub start: StartHint,
}

/// Values, their relative RMS error, and how they were made.
pub(super) struct Outcome {
    pub values: Vec<Value>,
    pub relative_rms: f64,
    pub plan: DirectPlan,
    /// Directions that too few samples see: [`sums::undersampled`].
    pub undersampled: usize,
    /// Samples below which under-sampled directions asked for more; 0 where they did not.
    pub seen_from: u32,
}

impl<'a, 'p> DirectRun<'a, 'p> {
    /// A run over `pairs`, whose query is `query`.
    pub fn new(
        small: &'a SmallScale,
        sampler: FacetSampler<'a>,
        pairs: &'p [Pair],
        query: Query,
        control: &Control<'a>,
        start: StartHint,
    ) -> Self {
        Self {
            small,
            sampler,
            pairs,
            tasks: query.tasks(),
            query,
            control: *control,
            seconds: [0.0; 4],
            last_block: BlockCost { samples: 1, seconds: [0.0; 3] },
            target: if start.expected > 1 { start.expected } else { PARAMS.pilot_samples },
            done: RisingShare::default(),
            share: 0.0..1.0,
            start,
        }
    }

    /// Goes on with another list, which is the rest of the work.
    pub fn set_list(&mut self, pairs: &'p [Pair], query: Query) {
        (self.pairs, self.tasks, self.query) = (pairs, query.tasks(), query);
        (self.done, self.share) = (RisingShare::default(), self.share.end..1.0);
    }

    /// Tells that this share of the list at hand is done.
    pub fn report(&self, stage: &str, done: f64) {
        (self.control.progress)(stage, self.share.start + done * (self.share.end - self.share.start));
    }

    /// Samples of the pilot run.
    pub fn pilot(&self) -> u32 {
        PARAMS.pilot_samples.max(self.first())
    }

    /// Samples to start with: to project all triangles along a direction costs as much as some samples, which a round with fewer would
    /// save nothing by leaving out. What is expected to be needed is not tried with much less, but for the pilot run: a quarter of it, or, where
    /// that costs less than to project the triangles once more, all.
    pub fn first(&self) -> u32 {
        let triangles = u32::try_from(self.sampler.surface.triangles.len()).unwrap_or(u32::MAX);
        let fewest = self.start.enough.clamp(PARAMS.min_budget_samples, PARAMS.min_samples);
        let least = (triangles / 2).clamp(fewest, PARAMS.most_first).next_power_of_two();
        let worth_a_round = self.sampler.samples_worth_a_projection();
        let expected = (self.start.expected / 4).max(self.start.expected.min(worth_a_round)).max(1);
        // Rounded down: what lies below the pilot run counts among the samples that are kept.
        least.max((1 << expected.ilog2()).min(PARAMS.pilot_samples))
    }

    /// Whether so many `undersampled` directions are worth more samples. Undersampled features do not contribute to the variance estimate: the estimated error
    /// alone must not end the rounds.
    pub fn wants_more_to_see(&self, undersampled: usize, samples: u32, pairs: usize) -> bool {
        // Clusters are counted by words.
        let sums = (samples as usize).saturating_mul(pairs) / if self.sampler.is_clustered() { ALIGNMENT } else { 1 };
        undersampled > 0 && samples < PARAMS.most_search && sums < PARAMS.most_search_sums
    }

    /// Sums of the samples `start..start + length`; and the batch, if it is one.
    pub fn block(&mut self, start: u32, length: u32) -> Result<(Accumulated, Option<Batch>)> {
        let lobes = sums::surface_lobes(&self.small.surfaces);
        let materials = Materials::new(&self.sampler.surface.groups, &lobes, true);
        let mut total = Accumulated {
            samples: start + length,
            pairs: vec![[[0.0; 3]; REPLICATES]; self.query.pairs.len()],
            areas: vec![[0.0; REPLICATES]; self.query.directions.len()],
        };
        let parts = length.div_ceil(BATCH);
        let mut last = None;
        self.last_block = BlockCost { samples: length, seconds: [0.0; 3] };
        let last_round = self.target == start + length;
        let (from, to) = self.done.step(f64::from(length), f64::from(self.target.saturating_sub(start)), last_round);
        for part in 0..parts {
            let batch = self.sampler.batch(Runs::of_block(start, length, part, parts), &self.query.directions)?;
            let began = (self.control.clock)();
            sums::add_areas(&batch, &self.query.directions, &mut total.areas);
            sums::add_pairs(&batch, &self.query, &self.tasks, &materials, &mut total.pairs);
            let summed = (self.control.clock)() - began;
            for (k, seconds) in [batch.seconds[0], batch.seconds[1], summed].into_iter().enumerate() {
                self.seconds[1 + k] += seconds;
                self.last_block.seconds[k] += seconds;
            }
            last = Some(batch);
            self.report("samples", from + (to - from) * f64::from(part + 1) / f64::from(parts));
        }
        Ok((total, last.filter(|_| parts == 1)))
    }

    /// Directions of the list that too few of the samples see.
    pub fn undersampled(&self, total: &Accumulated) -> usize {
        sums::undersampled(&self.sampler.surface, &self.query.directions, &total.areas).len()
    }

    /// Where further samples are worth most, by a pilot run whose values were `values`.
    pub fn importance(&self, pilot: &Batch, values: &[Value]) -> Vec<f64> {
        let lobes = sums::surface_lobes(&self.small.surfaces);
        let known = |k: usize| PilotValue { q: values[k].fbar.iter().sum::<f64>() / 3.0, a: values[k].av };
        importance::importance(pilot, &self.query, &self.sampler.surface.groups, &lobes, known, PARAMS.stretches)
    }

    /// Puts samples where `importance` says.
    pub fn weight_samples(&mut self, importance: &[f64]) {
        self.sampler.density = self.sampler.density.weighted(importance);
    }

    /// Values, and their relative RMS error.
    pub fn values(&self, total: &Accumulated) -> (Vec<Value>, f64) {
        let mut spread = Spread::default();
        let mut values = vec![Value::default(); self.pairs.len()];
        let Accumulated { samples, pairs, areas } = total;
        let complete = CompleteSums { query: &self.query, list: self.pairs, sums: pairs, first: 0, areas, samples: *samples };
        complete.write(&self.query.order, &mut values, &mut spread);
        estimate::correct(&mut values, &spread);
        (values, spread.relative_rms())
    }
}

impl Accumulated {
    /// Sums of these samples and of as many new ones: neighbouring replicates are united, so that each stays a run of the sequence.
    pub fn merge(&self, new: &Self) -> Self {
        fn unite<T: Copy>(old: &[T; REPLICATES], new: &[T; REPLICATES], add: impl Fn(T, T) -> T) -> [T; REPLICATES] {
            let half = |sets: &[T; REPLICATES], r: usize| add(sets[2 * r], sets[2 * r + 1]);
            std::array::from_fn(|r| if r < REPLICATES / 2 { half(old, r) } else { half(new, r - REPLICATES / 2) })
        }
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        Self {
            samples: new.samples,
            pairs: self.pairs.iter().zip(&new.pairs).map(|(a, b)| unite(a, b, add)).collect(),
            areas: self.areas.iter().zip(&new.areas).map(|(a, b)| unite(a, b, |x, y| x + y)).collect(),
        }
    }
}
