//! Improved: the rows of both matrices are the pairs of the query themselves.

use super::map::Map;
use super::materials::Row;
use super::normals::Bins;
use super::run::{LowRankRun, RawValues, Stage, colour_of, products};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::plan::LowRankPlan;
use crate::filter::query::{Query, QueryEntry};
use crate::filter::value::LowRankFacts;
use crate::filter::visible_facets::VisibleFacets;
use crate::material::Surface;
use crate::numerics::randomized_svd::{Factors, Rows};
use rayon::prelude::*;
use std::ops::Range;

/// Pairs whose matrices are held at once. Chosen, not measured.
const PAIRS_AT_ONCE: usize = 1 << 16;

/// Values of a list by a plan, with `side` pixels on a side of the map of normals.
pub(super) fn by_pairs(run: &mut LowRankRun<'_>, plan: &LowRankPlan, side: usize, list: &[Pair]) -> Result<RawValues> {
    let facets = run.facets(plan);
    let query = Query::new(list, run.small.is_reciprocal());
    let seen = run.see(facets, &query.directions)?;
    let map = Map::sphere(run.choices.projection, side);
    let mut s_of_pair = vec![[0.0; 3]; query.pairs.len()];
    let mut facts: Vec<LowRankFacts> = Vec::new();
    let mut bins_of_all = 0;
    for (s, surface) in run.small.surfaces.iter().enumerate() {
        let began = run.now();
        let bins = Bins::new(&seen.facets, seen.facets.ranges[s].clone(), &map, run.choices.normals);
        bins_of_all += bins.normals.len();
        let one = OneSurface { surface, seen: &seen, bins: &bins, query: &query, energy: plan.energy() };
        for (part, (pairs, values)) in query.pairs.chunks(PAIRS_AT_ONCE).zip(s_of_pair.chunks_mut(PAIRS_AT_ONCE)).enumerate() {
            let fact = LowRankFacts { surface: s, ..one.add(run, pairs, values)? };
            match facts.last_mut().filter(|f| f.surface == s) {
                Some(before) => before.unite(&fact),
                None => facts.push(fact),
            }
            let done = ((part + 1) * PAIRS_AT_ONCE) as f64 / query.pairs.len().max(PAIRS_AT_ONCE) as f64;
            run.report("sums", (s as f64 + done.min(1.0)) / run.small.surfaces.len() as f64);
        }
        run.took(Stage::Sums, began);
    }
    let at = |entry: &Option<QueryEntry>| match entry {
        Some(e) => (s_of_pair[e.pair as usize].map(|s| s.max(0.0)), seen.areas[e.viewer as usize]),
        None => ([0.0; 3], 0.0),
    };
    let pairs = query.entries.iter().map(at).collect();
    Ok(RawValues { pairs, facts, directions: query.directions.len(), bins: bins_of_all })
}

/// What the matrices of one surface are made of.
struct OneSurface<'r> {
    surface: &'r Surface,
    seen: &'r VisibleFacets,
    bins: &'r Bins,
    query: &'r Query,
    /// Shares of the power of `N` and of `M` that are kept.
    energy: [f64; 2],
}

impl OneSurface<'_> {
    /// Adds to `values` those of the surface at `pairs`, and says what its matrices were.
    fn add(&self, run: &LowRankRun<'_>, pairs: &[[u32; 2]], values: &mut [[f64; 3]]) -> Result<LowRankFacts> {
        let (count, columns) = (self.bins.normals.len(), self.bins.columns(&self.seen.facets));
        let channels = columns / count.max(1);
        // Columns count by the area that they stand for.
        let scale: Vec<f64> = self.bins.areas.iter().map(|a| a.sqrt().max(f64::MIN_POSITIVE)).collect();
        let n = self.factor_n(run, pairs, channels, &scale)?;
        let m = self.factor_m(run, pairs, &scale)?;
        let products = products(self.bins, channels, (&n).into(), (&m).into(), |j| j);
        let colour = colour_of(self.surface, run.choices.colours, &[1.0; 3]);
        values.par_iter_mut().enumerate().for_each(|(k, value)| {
            let of_n = Row::mixture(n.rank(), std::iter::once((n.left.row(k).iter().copied(), 1.0, 1.0)));
            for c in 0..3 {
                let of_m = Row::mixture(m.rank(), std::iter::once((m.left.row(3 * k + c).iter().copied(), 1.0, 1.0)));
                value[c] += colour[c] * products[c % products.len()].at(&of_n, &of_m);
            }
        });
        Ok(LowRankFacts {
            surface: 0,
            n_size: [pairs.len(), columns],
            n_rank: n.rank(),
            n_energy: n.energy,
            m_size: [3 * pairs.len(), count],
            m_rank: m.rank(),
            m_energy: m.energy,
            m_bytes: size_of::<f64>() * (m.left.nrows() * m.rank() + m.right.nrows() * m.rank() + m.mean.len()),
        })
    }

    /// `N`: a row a pair.
    fn factor_n(&self, run: &LowRankRun<'_>, pairs: &[[u32; 2]], channels: usize, scale: &[f64]) -> Result<Factors> {
        let VisibleFacets { facets, bits, .. } = self.seen;
        let columns = self.bins.columns(facets);
        let write = |rows: Range<usize>, out: &mut [f64]| {
            for (k, row) in rows.zip(out.chunks_exact_mut(columns.max(1))) {
                self.bins.write_row(facets, bits, pairs[k].map(|d| d as usize), row);
                for (j, x) in row.iter_mut().enumerate() {
                    *x /= scale[j / channels];
                }
            }
        };
        run.factor(&Rows { rows: pairs.len(), columns, write: &write }, self.energy[0])
    }

    /// `M`: three rows a pair, one a channel.
    fn factor_m(&self, run: &LowRankRun<'_>, pairs: &[[u32; 2]], scale: &[f64]) -> Result<Factors> {
        let count = self.bins.normals.len();
        let write = |rows: Range<usize>, out: &mut [f64]| {
            let (mut of_pair, mut values) = (None, vec![[0.0; 3]; count]);
            for (k, row) in rows.zip(out.chunks_exact_mut(count.max(1))) {
                if of_pair != Some(k / 3) {
                    of_pair = Some(k / 3);
                    let [wi, wo] = pairs[k / 3].map(|d| self.query.directions[d as usize]);
                    for (value, &n) in values.iter_mut().zip(&self.bins.normals) {
                        let factor = n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
                        *value = if factor > 0.0 { self.surface.brdf.eval(n, wi, wo).map(|fr| fr * factor) } else { [0.0; 3] };
                    }
                }
                for ((x, value), scale) in row.iter_mut().zip(&values).zip(scale) {
                    *x = value[k % 3] * scale;
                }
            }
        };
        run.factor(&Rows { rows: 3 * pairs.len(), columns: count, write: &write }, self.energy[1])
    }
}
