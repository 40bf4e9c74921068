//! As published: visibility and `N` on the pairs of a coarse map, `M` on those of a fine one; values at the pairs of the query between these.

use super::cache::CacheLookup;
use super::choices::Colours;
use super::map::Map;
use super::materials::{Product, Row};
use super::normals::{Bins, PairRows};
use super::precomputed::{Precomputed, Settings};
use super::run::{LowRankRun, RawValues, Stage, colour_of, products};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::plan::{LowRankPlan, MapSides};
use crate::filter::query::{Query, QueryEntry};
use crate::filter::value::LowRankFacts;
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::randomized_svd::{Factors, Rows};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Seed of the random vectors for `M`: always the same, so that a stored one can be used (section 3.7).
const SEED_OF_M: u64 = 1;
/// Share of the progress of a surface that `M` makes where no cache has it; the sums make the rest. Chosen, not measured.
const MATRIX_M_PROGRESS: f64 = 0.9;
/// Entries of the table computed between two looks at whether the caller wants to stop.
const ENTRIES_PER_CHECK: usize = 1 << 14;

/// The coarse map, and what facets see of its directions.
struct Coarse {
    map: Map,
    /// Rows of `N`.
    pairs: PairRows,
    seen: VisibleFacets,
}

impl Coarse {
    /// Factor that a row of `N` is scaled by.
    fn row_weight(&self, [a, b]: [usize; 2]) -> f64 {
        (self.map.solid_angles[a] * self.map.solid_angles[b]).sqrt()
    }

    /// Visible area over the footprint from a direction: the share of its cosine that is visible, interpolated between the map's directions. The area itself would
    /// not fall to 0 at the horizon, beyond the outermost cells, where a picture divides it by the cosine.
    fn area_from(&self, w: DVec3) -> f64 {
        w.z * self.map.around(w).iter().map(|&(d, share)| share * self.seen.areas[d] / self.map.directions[d].z).sum::<f64>()
    }

    /// Visible area over the footprint between the map's directions, from the cells around one and their weights: what goes with rows of `N` between them.
    fn area(&self, around: &[(usize, f64)]) -> f64 {
        around.iter().map(|&(d, share)| share * self.seen.areas[d]).sum()
    }
}

/// Values of a list by a plan of `rates`, with `directions` pixels on a side of the coarse map.
pub(super) fn by_maps(
    run: &mut LowRankRun<'_>,
    plan: &LowRankPlan,
    directions: usize,
    rates: MapSides,
    list: &[Pair],
) -> Result<RawValues> {
    let projection = run.choices.projection;
    let [energy_of_n, energy] = plan.energy();
    let settings = Settings { projection, least_directions: directions, largest: rates, energy, seed: SEED_OF_M };
    let map = Map::hemisphere(projection, directions);
    let facets = run.facets(plan);
    let seen = run.see(facets, &map.directions)?;
    let coarse = Coarse { pairs: PairRows { count: map.directions.len(), reciprocal: true }, map, seen };
    let query = Query::new(list, false);
    let mut fbar = vec![[0.0; 3]; query.pairs.len()];
    let mut facts = Vec::new();
    let mut bins = 0;
    let whole = run.share.clone();
    let surfaces = run.small.surfaces.len();
    for surface in 0..surfaces {
        let at = |done: f64| whole.start + (whole.end - whole.start) * (surface as f64 + done) / surfaces as f64;
        run.share = at(0.0)..at(MATRIX_M_PROGRESS);
        let m = precomputed(run, surface, &settings)?;
        let began = run.now();
        run.share = at(MATRIX_M_PROGRESS)..at(1.0);
        run.details.extend(insufficient(surface, &m, &settings));
        let one = OneSurface::new(run, &coarse, &m, surface, energy_of_n)?;
        interpolate(run, &query, &m.directions, |i, o| one.fbar(i, o), &mut fbar)?;
        bins += one.bins.normals.len();
        facts.push(one.facts(surface));
        run.took(Stage::Sums, began);
    }
    let area: Vec<f64> = query.directions.iter().map(|&w| coarse.area_from(w)).collect();
    let at = |entry: &Option<QueryEntry>| match entry {
        Some(e) => (fbar[e.pair as usize].map(|f| f.max(0.0) * area[e.viewer as usize]), area[e.viewer as usize]),
        None => ([0.0; 3], 0.0),
    };
    Ok(RawValues { pairs: query.entries.iter().map(at).collect(), facts, directions: coarse.map.directions.len(), bins })
}

/// `M` of a surface, from the cache if it is there.
fn precomputed(run: &mut LowRankRun<'_>, surface: usize, settings: &Settings) -> Result<Precomputed> {
    let began = run.now();
    let brdf = &run.small.surfaces[surface].brdf;
    let cache = run.quality.cache.as_ref();
    if let Some(cache) = cache {
        match cache.find(brdf, settings) {
            CacheLookup::Hit(matrix) => {
                run.took(Stage::MatrixM, began);
                return Ok(*matrix);
            }
            CacheLookup::Missing => {}
            CacheLookup::Unusable(why) => run.notes.push(format!("of the cache, {why}: computed again")),
        }
    }
    let stage = format!("matrix M of surface {} of {}", surface + 1, run.small.surfaces.len());
    let matrix = Precomputed::compute(brdf, settings, &|share| {
        run.report(&stage, share);
        run.control.check()
    })?;
    if let Some(cache) = cache
        && let Err(why) = cache.keep(brdf, settings, &matrix)
    {
        run.notes.push(format!("matrix M is not kept in the cache: {why}"));
    }
    run.took(Stage::MatrixM, began);
    Ok(matrix)
}

/// Where an `M` is coarser than the paper asks for.
fn insufficient(surface: usize, m: &Precomputed, settings: &Settings) -> Vec<String> {
    let mut notes = Vec::new();
    if m.rates.insufficient() {
        notes.push(format!(
            "surface {}: the largest maps allowed for M, {} directions and {} normals, miss {:.1} and {:.1} % of the BRDF's power",
            surface + 1,
            m.directions.directions.len(),
            m.normals.directions.len(),
            100.0 * m.rates.missed_by_directions,
            100.0 * m.rates.missed_by_normals
        ));
    }
    if m.energy < settings.energy {
        notes.push(format!("surface {}: M keeps {:.1} % of its power in {} vectors", surface + 1, 100.0 * m.energy, m.rank()));
    }
    notes
}

/// The table of one surface: `fbar` at the pairs of `M`'s directions.
struct OneSurface<'m> {
    coarse: &'m Coarse,
    m: &'m Precomputed,
    n: Factors,
    bins: Bins,
    /// Columns of `N`.
    columns: usize,
    /// One for each channel of colour weights, or the one for all.
    products: Vec<Product>,
    colour: [f64; 3],
    /// The coarse cells around each of `M`'s directions, and their weights.
    around: Vec<Vec<(usize, f64)>>,
    /// Visible area over the footprint from each of `M`'s directions.
    area: Vec<f64>,
}

impl<'m> OneSurface<'m> {
    fn new(run: &LowRankRun<'_>, coarse: &'m Coarse, m: &'m Precomputed, surface: usize, energy: f64) -> Result<Self> {
        let VisibleFacets { facets, bits, .. } = &coarse.seen;
        let bins = Bins::new(facets, facets.ranges[surface].clone(), &m.normals, run.choices.normals);
        let columns = bins.columns(facets);
        let channels = columns / bins.normals.len().max(1);
        let write = |rows: Range<usize>, out: &mut [f64]| {
            for (k, row) in rows.zip(out.chunks_exact_mut(columns.max(1))) {
                let pair = coarse.pairs.directions_of(k);
                bins.write_row(facets, bits, pair, row);
                let weight = coarse.row_weight(pair);
                for (j, x) in row.iter_mut().enumerate() {
                    *x *= weight / m.column_weight(bins.cells[j / channels]);
                }
            }
        };
        let n = run.factor(&Rows { rows: coarse.pairs.rows(), columns, write: &write }, energy)?;
        let products = products(&bins, channels, (&n).into(), m.basis(), |j| bins.cells[j]);
        let colour = colour_of(&run.small.surfaces[surface], Colours::Principal, &m.colour);
        let around: Vec<Vec<(usize, f64)>> = m.directions.directions.iter().map(|&w| coarse.map.around(w)).collect();
        let area = around.iter().map(|a| coarse.area(a)).collect();
        Ok(Self { coarse, m, n, bins, columns, products, colour, around, area })
    }

    /// `fbar` from `M`'s direction `i` to its direction `o`: `N` between its own directions, `M` at these.
    fn fbar(&self, i: usize, o: usize) -> [f64; 3] {
        let Self { coarse, m, n, products, .. } = self;
        if self.area[o] <= 0.0 {
            return [0.0; 3];
        }
        let both = self.around[i].iter().flat_map(|&(a, x)| self.around[o].iter().map(move |&(b, y)| (coarse.pairs.row_of(a, b), x * y)));
        let weight = |row: usize| coarse.row_weight(coarse.pairs.directions_of(row));
        let of_n = Row::mixture(n.rank(), both.map(|(k, share)| (n.left.row(k).iter().copied(), share, weight(k))));
        let row = m.pairs.row_of(i, o);
        let of_m = Row::mixture(m.rank(), std::iter::once((m.row(row), 1.0, m.row_weight(row))));
        std::array::from_fn(|c| self.colour[c] * products[c % products.len()].at(&of_n, &of_m) / self.area[o])
    }

    /// What the matrices were.
    fn facts(&self, surface: usize) -> LowRankFacts {
        let Self { m, n, .. } = self;
        LowRankFacts {
            surface,
            n_size: [self.coarse.pairs.rows(), self.columns],
            n_rank: n.rank(),
            n_energy: n.energy,
            m_size: [m.pairs.rows(), m.normals.directions.len()],
            m_rank: m.rank(),
            m_energy: m.energy,
            m_bytes: m.bytes(),
        }
    }
}

/// Adds to `values` of the pairs of `query` the linear interpolation between the cells of `map` of what `table` has there.
fn interpolate(
    run: &LowRankRun<'_>,
    query: &Query,
    map: &Map,
    table: impl Fn(usize, usize) -> [f64; 3] + Sync,
    values: &mut [[f64; 3]],
) -> Result<()> {
    let around: Vec<Vec<(usize, f64)>> = query.directions.iter().map(|&w| map.around(w)).collect();
    let cells = map.directions.len();
    let of_pair = |[i, o]: [u32; 2]| {
        let (i, o) = (&around[i as usize], &around[o as usize]);
        i.iter().flat_map(move |&(a, x)| o.iter().map(move |&(b, y)| (a * cells + b, x * y)))
    };
    let mut needed = vec![false; cells * cells];
    for &pair in &query.pairs {
        for (cell, _) in of_pair(pair) {
            needed[cell] = true;
        }
    }
    let needed: Vec<usize> = (0..needed.len()).filter(|&k| needed[k]).collect();
    let mut entries = vec![[0.0; 3]; cells * cells];
    for (done, chunk) in needed.chunks(ENTRIES_PER_CHECK).enumerate() {
        run.control.check()?;
        let found: Vec<[f64; 3]> = chunk.par_iter().map(|&k| table(k / cells, k % cells)).collect();
        for (&k, value) in chunk.iter().zip(found) {
            entries[k] = value;
        }
        run.report("sums", ((done + 1) * ENTRIES_PER_CHECK) as f64 / needed.len().max(ENTRIES_PER_CHECK) as f64);
    }
    values.par_iter_mut().zip(&query.pairs).for_each(|(value, &pair)| {
        for (cell, share) in of_pair(pair) {
            for (v, x) in value.iter_mut().zip(entries[cell]) {
                *v += share * x;
            }
        }
    });
    Ok(())
}
