//! What a table will cost, from what values cost so far: before the hours are spent.

use super::effective_table::{max_rings, value_count};
use super::grid::node_count;
use crate::filter::Summary;
use crate::numerics::cast::truncate_usize;
use std::ops::Range;

/// A finer table is made a little finer than the law of its errors says.
const MARGIN: f64 = 1.05;
/// The order of linear interpolation: errors fall as its power of the rings where the table is smooth. With shadows and lobes they fall slower: as the
/// power 1.27 (rods, shot silk) to 1.46 (studs, V grooves), so the order is measured on two tables before a dear one is made.
const SMOOTH_ORDER: f64 = 2.0;
/// Orders that two tables may tell: noise of the probes can look like any. Chosen, not measured.
const ORDERS: [f64; 2] = [0.8, 2.5];
/// Rings of the second table where more than [`DEAR_RINGS`] are needed: it has 110,000 values, and 16 rings have 333,000. Chosen, not measured.
const SECOND_RINGS: usize = 12;
const DEAR_RINGS: usize = 16;
/// Share of the squared tolerance that the facets may use.
pub(super) const FACET_SHARE: f64 = 0.5;
/// The samples that a tolerance needs grow as its power of so much: `1 / .75`, see `filter/tolerance.rs`.
const SAMPLES_POWER: f64 = 4.0 / 3.0;
/// Looser tolerances that a forecast tells of, in tolerances that were asked for. Chosen, not measured.
const LOOSER: [f64; 2] = [2.0, 4.0];

/// What the table that comes next, probably the last, will take.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeForecast {
    /// Rings of directions.
    pub rings: usize,
    /// Values in the table.
    pub values: usize,
    /// Seconds from now on: see `docs/performance.md`, "Forecasts", for how far that is off.
    pub seconds: f64,
    /// Relative RMS error that it will have, by how those of the tables before fell.
    pub relative_rms: f64,
    /// Tolerances that are looser, and the seconds that the same would take with them.
    pub looser: Vec<(f64, f64)>,
}

/// What values cost in the calls so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Costs {
    /// Seconds of what is done once a direction, visibility, and the directions of all calls.
    seeing: (f64, usize),
    /// Seconds of the rest, and the pairs of all calls.
    rest: (f64, usize),
}

impl Costs {
    /// Adds a call over so many pairs.
    pub fn add(&mut self, summary: &Summary, pairs: usize) {
        let seconds =
            |wanted: &[&str]| summary.stages.iter().filter(|(name, _)| wanted.contains(name)).map(|(_, ms)| 1e-3 * ms).sum::<f64>();
        let all = summary.stages.iter().map(|(_, ms)| 1e-3 * ms).sum::<f64>();
        let seeing = seconds(&["facets", "visibility"]);
        self.seeing = (self.seeing.0 + seeing, self.seeing.1 + summary.directions);
        self.rest = (self.rest.0 + all - seeing, self.rest.1 + pairs);
    }

    /// Whether there was a call.
    pub fn is_known(&self) -> bool {
        self.rest.1 > 0
    }

    /// Seconds of a table in such blocks.
    pub fn seconds(&self, rings: usize, reciprocal: bool, blocks: &[(Range<usize>, Range<usize>)]) -> f64 {
        let visits: usize = blocks.iter().map(|(i, o)| if i == o { i.len() } else { i.len() + o.len() }).sum();
        let each = |(seconds, count): (f64, usize)| seconds / count.max(1) as f64;
        each(self.seeing) * visits.max(node_count(rings)) as f64 + each(self.rest) * value_count(rings, reciprocal) as f64
    }
}

/// The error of a table so far, and what its tolerance leaves to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refinement {
    pub rings: usize,
    pub reciprocal: bool,
    pub tolerance: f64,
    /// Relative RMS error of the values at the nodes.
    pub facets: f64,
    /// Relative RMS error of the interpolation.
    pub interpolation: f64,
    /// Rings and error of the interpolation of the table before, if there was one.
    pub before: Option<(usize, f64)>,
}

impl Refinement {
    /// What a tolerance leaves to the interpolation: where the facets alone miss it, a bias of half their error adds no more than an eighth to it.
    pub fn wanted(tolerance: f64, facets: f64) -> f64 {
        (tolerance * tolerance - facets * facets).max(facets * facets / 4.0).sqrt()
    }

    /// The power of the rings that the errors fall with.
    fn order(&self) -> f64 {
        let [least, most] = ORDERS;
        match self.before {
            Some((rings, error)) => ((error / self.interpolation).ln() / (self.rings as f64 / rings as f64).ln()).clamp(least, most),
            None => SMOOTH_ORDER,
        }
    }

    /// Rings that bring the error of the interpolation down to this.
    fn rings_for(&self, wanted: f64) -> usize {
        let limit = max_rings(self.reciprocal);
        let factor = (self.interpolation / wanted).powf(1.0 / self.order());
        let finer = truncate_usize((MARGIN * self.rings as f64 * factor).ceil().min(limit as f64));
        finer.clamp((self.rings + 1).min(limit), limit)
    }

    /// Rings of the next table, and whether its error is expected to be small enough: a cheap one may come first, to tell the order.
    pub fn next(&self, wanted: f64) -> (usize, bool) {
        let rings = self.rings_for(wanted);
        if self.before.is_none() && rings > DEAR_RINGS && self.rings < SECOND_RINGS { (SECOND_RINGS, false) } else { (rings, true) }
    }

    /// What a table of `next` rings will take, which has such `blocks` and such `costs`.
    pub fn forecast(&self, next: usize, costs: &Costs, blocks: &dyn Fn(usize) -> Vec<(Range<usize>, Range<usize>)>) -> BakeForecast {
        let seconds = costs.seconds(next, self.reciprocal, &blocks(next));
        let interpolation = self.interpolation * (self.rings as f64 / next as f64).powf(self.order());
        let looser = LOOSER.map(|times| {
            let tolerance = times * self.tolerance;
            // Fewer samples are taken then, down to the share of the tolerance that they may use.
            let facets = (self.facets * times).min(tolerance * FACET_SHARE.sqrt());
            let rings = self.rings_for(Self::wanted(tolerance, facets));
            let seconds = costs.seconds(rings, self.reciprocal, &blocks(rings)) * times.powf(-SAMPLES_POWER);
            (tolerance, seconds)
        });
        BakeForecast {
            rings: next,
            values: value_count(next, self.reciprocal),
            seconds,
            relative_rms: self.facets.hypot(interpolation),
            looser: looser.into(),
        }
    }
}
