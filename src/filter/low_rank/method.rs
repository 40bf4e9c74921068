//! The method, from a surface and pairs to values with errors (Wu et al. 2011, sections 3.2 to 3.7).
//!
//! Facets; what they see; for each surface `N` and `M` by their factors; their product. How far the values are off: [`super::errors`].

use super::cache::Found;
use super::errors::{Probes, SAFETY};
use super::map::Map;
use super::materials::{Basis, Product, Row};
use super::normals::{Bins, PairRows};
use super::plan::Plan;
use super::precomputed::{Precomputed, Settings};
use super::{Choices, Colours, Grid, Placing, Variant};
use crate::direction::{MIN_COSINE, Pair};
use crate::error::{BadInput, Error, Result};
use crate::facets::{self, Facets, Runs};
use crate::filter::demand::Demand;
use crate::filter::prepared::Tracer;
use crate::filter::{Control, Effective, LowRankFacts, Quality, Summary, Value, sums};
use crate::material::{SmallScale, Surface, Tint};
use crate::numerics::low_discrepancy::hash;
use crate::numerics::randomized_svd::{self, Factors, Params, Rows};
use crate::visibility::Bits;
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Pairs of which the improved variant holds the matrices at once.
const PAIRS_AT_ONCE: usize = 1 << 16;
/// Seed of the random vectors for `M`: always the same, so that a stored one can be used (section 3.7).
const SEED_OF_M: u64 = 1;
/// Most bytes of visibility bits.
const MAX_BITS: usize = 512 << 20;

/// What a run works with.
pub(super) struct Run<'a> {
    pub(super) small: &'a SmallScale,
    pub(super) quality: &'a Quality,
    pub(super) control: &'a Control<'a>,
    pub(super) tracer: Tracer<'a>,
    choices: Choices,
    /// Milliseconds of preparing `M`, facets, visibility, `N` and products.
    seconds: [f64; 4],
    notes: Vec<String>,
}

/// Facets, and what they see of some directions.
struct Seen {
    facets: Facets,
    bits: Bits,
    /// Visible area over the footprint, one a direction.
    areas: Vec<f64>,
}

/// Values of a list of pairs before their errors are known.
pub(super) struct Raw {
    /// `S` of each pair, and visible area over the footprint from its viewer.
    pub(super) pairs: Vec<([f64; 3], f64)>,
    facts: Vec<LowRankFacts>,
    directions: usize,
    bins: usize,
}

pub(in crate::filter) fn low_rank(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    if quality.budget.is_some() {
        let what = "a budget with the method lowrank".to_owned();
        return Err(Error::Unsupported { what, remedy: "leave --budget out, or ask for --method direct, which keeps one".to_owned() });
    }
    let given = quality.plan.as_deref().map(Plan::parse).transpose()?;
    let variant = given.map_or(quality.variant, |plan| plan.variant());
    #[expect(clippy::cast_possible_truncation, reason = "both halves of the seed are used")]
    let seed = hash(hash(quality.seed as u32) ^ (quality.seed >> 32) as u32);
    let mut run = Run {
        small,
        quality,
        control,
        tracer: Tracer::new(small, None, seed, control),
        choices: variant.choices(),
        seconds: [0.0; 4],
        notes: Vec::new(),
    };
    let probes = Probes::new(small, pairs);
    let plan = match (given, variant) {
        (Some(plan), _) => plan,
        (None, Variant::Paper) => Plan::PAPER,
        (None, Variant::Improved) => run.adapt(&probes)?,
    };
    let raw = run.raw(&plan, pairs)?;
    let errors = run.errors(&plan, &probes, &raw.pairs)?;
    if given.is_none() && SAFETY * errors.total() > quality.tolerance {
        let why = match variant {
            Variant::Paper => "the published method has fixed settings; --variant improved or --method direct look for those that keep it",
            Variant::Improved => "no settings that this method allows itself keep it; --method direct does",
        };
        run.notes.push(format!("the tolerance of {} is not met: {why}", quality.tolerance));
    }
    run.notes.push(format!(
        "relative RMS of the facets {:.1e}; of bins, cuts{} {:.1e}",
        errors.facets,
        if run.choices.grid == Grid::Maps { " and interpolation" } else { "" },
        errors.bias
    ));
    let values = values(pairs, &raw.pairs, errors.total());
    let names = ["matrix M", "facets", "visibility", "sums"];
    let lost = run.tracer.lost();
    if lost > 0 {
        run.notes.push(format!("{lost} rays passed 65,536 periods without an answer and count as free"));
    }
    let summary = Summary {
        method: match variant {
            Variant::Paper => "lowrank",
            Variant::Improved => "lowrank improved",
        },
        plan: plan.to_string(),
        facets: plan.facets(),
        clusters: raw.bins,
        directions: raw.directions,
        stages: names.into_iter().zip(run.seconds.map(|s| 1e3 * s)).collect(),
        relative_rms: errors.total(),
        low_rank: raw.facts,
        notes: run.notes,
    };
    Ok(Effective { values, summary })
}

/// Values with standard errors that, over all of them, are the relative RMS `error`: half of it in proportion to each, half alike for all,
/// as cuts and interpolation err beside peaks as much as in them.
fn values(pairs: &[Pair], raw: &[([f64; 3], f64)], error: f64) -> Vec<Value> {
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

impl Run<'_> {
    pub(super) fn now(&self) -> f64 {
        (self.control.clock)()
    }

    /// Adds the time since `began` to a stage.
    pub(super) fn took(&mut self, stage: usize, began: f64) {
        self.seconds[stage] += self.now() - began;
    }

    pub(super) fn facets(&mut self, plan: &Plan) -> Facets {
        let began = self.now();
        let facets = match self.choices.placing {
            Placing::Random => facets::random(self.small, &self.tracer.surface, plan.facets(), self.tracer.seed),
            Placing::LowDiscrepancy => {
                let count = u32::try_from(plan.facets()).expect("at most MAX_FACETS");
                let runs = Runs::of_block(0, count, 0, 1);
                facets::sample(self.small, &self.tracer.surface, &self.tracer.density, runs, self.tracer.seed)
            }
        };
        self.took(1, began);
        facets
    }

    fn see(&mut self, facets: Facets, directions: &[DVec3]) -> Result<Seen> {
        self.control.check()?;
        let bytes = facets.triangle.len() / 8 * directions.len();
        if bytes > MAX_BITS {
            let problem = format!("{} facets and {} directions need {} MB of visibility", facets.samples, directions.len(), bytes >> 20);
            return Err(BadInput::new(problem, "ask for fewer facets or pairs, or for --method direct").into());
        }
        let began = self.now();
        let bits = self.tracer.see(&facets, directions)?;
        let area = |(d, &w): (usize, &DVec3)| sums::visible_area(&facets, w, bits.row(d)).iter().sum::<f64>() / facets.samples as f64;
        let areas = directions.par_iter().enumerate().map(area).collect();
        self.took(2, began);
        Ok(Seen { facets, bits, areas })
    }

    /// Values of a list by a plan.
    pub(super) fn raw(&mut self, plan: &Plan, list: &[Pair]) -> Result<Raw> {
        match *plan {
            Plan::Paper { directions, rates, energy, .. } => {
                let projection = self.choices.projection;
                let settings = Settings { projection, least_directions: directions, largest: rates, energy: energy[1], seed: SEED_OF_M };
                self.by_maps(plan, directions, &settings, list)
            }
            Plan::Improved { normals, .. } => self.by_pairs(plan, normals, list),
        }
    }

    /// Factors of a matrix, and with as many random vectors as its energy asks for if the variant lets them grow.
    fn factor(&self, matrix: &Rows<'_>, energy: f64, seed: u64) -> Result<Factors> {
        let Choices { iteration, projected, grows, .. } = self.choices;
        let mut projection = projected;
        loop {
            let params = Params { projection, iteration, energy, seed };
            let factors = randomized_svd::factor(matrix, &params, &|| self.control.check())?;
            // Cuts near the rounding of the power itself cannot be told from it.
            let enough = factors.energy >= energy.min(1.0 - 1e-12) || projection >= matrix.rows.min(matrix.columns);
            if enough || !grows {
                return Ok(factors);
            }
            projection *= 2;
        }
    }

    /// `M` of a surface, from the cache if it is there.
    fn precomputed(&mut self, surface: usize, settings: &Settings) -> Result<Precomputed> {
        let began = self.now();
        let brdf = &self.small.surfaces[surface].brdf;
        let cache = self.quality.cache.as_ref();
        if let Some(cache) = cache {
            match cache.find(brdf, settings) {
                Found::Hit(matrix) => {
                    self.took(0, began);
                    return Ok(*matrix);
                }
                Found::Missing => {}
                Found::Unusable(why) => self.notes.push(format!("of the cache, {why}: computed again")),
            }
        }
        let stage = format!("matrix M of surface {} of {}", surface + 1, self.small.surfaces.len());
        let matrix = Precomputed::compute(brdf, settings, &|share| {
            (self.control.progress)(&stage, share);
            self.control.check()
        })?;
        if let Some(cache) = cache
            && let Err(why) = cache.keep(brdf, settings, &matrix)
        {
            self.notes.push(format!("matrix M is not kept in the cache: {why}"));
        }
        self.took(0, began);
        Ok(matrix)
    }

    /// As published: visibility and `N` on the pairs of a coarse map, `M` on those of a fine one; values at the wanted pairs between these.
    fn by_maps(&mut self, plan: &Plan, side: usize, settings: &Settings, list: &[Pair]) -> Result<Raw> {
        let projection = self.choices.projection;
        let coarse = Map::hemisphere(projection, side);
        let facets = self.facets(plan);
        let seen = self.see(facets, &coarse.directions)?;
        let pairs = PairRows { count: coarse.directions.len(), reciprocal: true };
        let demand = Demand::new(list, false);
        let mut fbar = vec![[0.0; 3]; demand.pairs.len()];
        let mut facts = Vec::new();
        let mut bins_of_all = 0;
        for (s, surface) in self.small.surfaces.iter().enumerate() {
            let m = self.precomputed(s, settings)?;
            let began = self.now();
            if m.rates.insufficient() {
                self.notes.push(format!(
                    "surface {}: the largest maps allowed for M, {} directions and {} normals, miss {:.1} and {:.1} % of the BRDF's power",
                    s + 1,
                    m.directions.directions.len(),
                    m.normals.directions.len(),
                    100.0 * m.rates.missed_by_directions,
                    100.0 * m.rates.missed_by_normals
                ));
            }
            if m.energy < settings.energy {
                self.notes.push(format!("surface {}: M keeps {:.1} % of its power in {} vectors", s + 1, 100.0 * m.energy, m.rank()));
            }
            let bins = Bins::new(&seen.facets, seen.facets.ranges[s].clone(), &m.normals, self.choices.normals);
            bins_of_all += bins.normals.len();
            let row_weight = |[a, b]: [usize; 2]| (coarse.solid_angles[a] * coarse.solid_angles[b]).sqrt();
            let columns = bins.columns(&seen.facets);
            let channels = columns / bins.normals.len().max(1);
            let write = |rows: Range<usize>, out: &mut [f64]| {
                for (k, row) in rows.zip(out.chunks_exact_mut(columns.max(1))) {
                    let pair = pairs.directions_of(k);
                    bins.write_row(&seen.facets, &seen.bits, pair, row);
                    let weight = row_weight(pair);
                    for (j, x) in row.iter_mut().enumerate() {
                        *x *= weight / m.column_weight(bins.cells[j / channels]);
                    }
                }
            };
            let n = self.factor(&Rows { rows: pairs.rows(), columns, write: &write }, plan.energy()[0], self.quality.seed)?;
            facts.push(LowRankFacts {
                surface: s,
                n_size: [pairs.rows(), columns],
                n_rank: n.rank(),
                n_energy: n.energy,
                m_size: [m.pairs.rows(), m.normals.directions.len()],
                m_rank: m.rank(),
                m_energy: m.energy,
                m_bytes: m.bytes(),
            });
            let products = products(&bins, channels, (&n).into(), m.basis(), |j| bins.cells[j]);
            let colour = of_surface(surface, Colours::Principal, &m.colour);
            // N between its own directions, at those of M.
            let around: Vec<Vec<(usize, f64)>> = m.directions.directions.iter().map(|&w| coarse.around(w)).collect();
            let area: Vec<f64> = around.iter().map(|a| a.iter().map(|&(d, share)| share * seen.areas[d]).sum()).collect();
            let table = |i: usize, o: usize| -> [f64; 3] {
                if area[o] <= 0.0 {
                    return [0.0; 3];
                }
                let both = around[i].iter().flat_map(|&(a, x)| around[o].iter().map(move |&(b, y)| (pairs.row_of(a, b), x * y)));
                let weight = |row: usize| row_weight(pairs.directions_of(row));
                let of_n = Row::mixture(n.rank(), both.map(|(k, share)| (n.left.row(k).iter().copied(), share, weight(k))));
                let row = m.pairs.row_of(i, o);
                let of_m = Row::mixture(m.rank(), std::iter::once((m.row(row), 1.0, m.row_weight(row))));
                std::array::from_fn(|c| colour[c] * products[c % channels].at(&of_n, &of_m) / area[o])
            };
            self.interpolate(&demand, &m.directions, table, &mut fbar)?;
            self.took(3, began);
        }
        // The visible area as the table has it, between the coarse directions.
        let area: Vec<f64> =
            demand.directions.iter().map(|&w| coarse.around(w).iter().map(|&(d, share)| share * seen.areas[d]).sum()).collect();
        let at = |wanted: &Option<crate::filter::demand::Wanted>| match wanted {
            Some(w) => (fbar[w.pair as usize].map(|f| f.max(0.0) * area[w.viewer as usize]), area[w.viewer as usize]),
            None => ([0.0; 3], 0.0),
        };
        let values = demand.wanted.iter().map(at).collect();
        Ok(Raw { pairs: values, facts, directions: coarse.directions.len(), bins: bins_of_all })
    }

    /// Adds to `values` of the pairs of `demand` the linear interpolation between the cells of `map` of what `table` has there.
    fn interpolate(
        &self,
        demand: &Demand,
        map: &Map,
        table: impl Fn(usize, usize) -> [f64; 3] + Sync,
        values: &mut [[f64; 3]],
    ) -> Result<()> {
        /// Entries computed between two looks at whether the caller wants to stop.
        const CHUNK: usize = 1 << 14;
        let around: Vec<Vec<(usize, f64)>> = demand.directions.iter().map(|&w| map.around(w)).collect();
        let cells = map.directions.len();
        let of_pair = |[i, o]: [u32; 2]| {
            let (i, o) = (&around[i as usize], &around[o as usize]);
            i.iter().flat_map(move |&(a, x)| o.iter().map(move |&(b, y)| (a * cells + b, x * y)))
        };
        let mut needed = vec![false; cells * cells];
        for &pair in &demand.pairs {
            for (cell, _) in of_pair(pair) {
                needed[cell] = true;
            }
        }
        let needed: Vec<usize> = (0..needed.len()).filter(|&k| needed[k]).collect();
        let mut entries = vec![[0.0; 3]; cells * cells];
        for (done, chunk) in needed.chunks(CHUNK).enumerate() {
            self.control.check()?;
            let found: Vec<[f64; 3]> = chunk.par_iter().map(|&k| table(k / cells, k % cells)).collect();
            for (&k, value) in chunk.iter().zip(found) {
                entries[k] = value;
            }
            (self.control.progress)("sums", ((done + 1) * CHUNK) as f64 / needed.len().max(CHUNK) as f64);
        }
        values.par_iter_mut().zip(&demand.pairs).for_each(|(value, &pair)| {
            for (cell, share) in of_pair(pair) {
                for (v, x) in value.iter_mut().zip(entries[cell]) {
                    *v += share * x;
                }
            }
        });
        Ok(())
    }

    /// Improved: the rows are the wanted pairs themselves.
    fn by_pairs(&mut self, plan: &Plan, side: usize, list: &[Pair]) -> Result<Raw> {
        let facets = self.facets(plan);
        let demand = Demand::new(list, self.small.is_reciprocal());
        let seen = self.see(facets, &demand.directions)?;
        let map = Map::sphere(self.choices.projection, side);
        let mut s_of_pair = vec![[0.0; 3]; demand.pairs.len()];
        let mut facts: Vec<LowRankFacts> = Vec::new();
        let mut bins_of_all = 0;
        for (s, surface) in self.small.surfaces.iter().enumerate() {
            let began = self.now();
            let bins = Bins::new(&seen.facets, seen.facets.ranges[s].clone(), &map, self.choices.normals);
            bins_of_all += bins.normals.len();
            for (part, (pairs, values)) in demand.pairs.chunks(PAIRS_AT_ONCE).zip(s_of_pair.chunks_mut(PAIRS_AT_ONCE)).enumerate() {
                let found = self.part(surface, &seen, &bins, &demand, pairs, plan.energy(), values)?;
                let fact = LowRankFacts { surface: s, ..found };
                match facts.last_mut().filter(|f| f.surface == s) {
                    Some(before) => before.unite(&fact),
                    None => facts.push(fact),
                }
                (self.control.progress)("sums", ((part + 1) * PAIRS_AT_ONCE) as f64 / demand.pairs.len().max(PAIRS_AT_ONCE) as f64);
            }
            self.took(3, began);
        }
        let at = |wanted: &Option<crate::filter::demand::Wanted>| match wanted {
            Some(w) => (s_of_pair[w.pair as usize].map(|s| s.max(0.0)), seen.areas[w.viewer as usize]),
            None => ([0.0; 3], 0.0),
        };
        let values = demand.wanted.iter().map(at).collect();
        Ok(Raw { pairs: values, facts, directions: demand.directions.len(), bins: bins_of_all })
    }

    /// Adds to `values` those of one surface at `pairs`, and says what its matrices were.
    #[expect(clippy::too_many_arguments, reason = "what the matrices of a part are made of")]
    fn part(
        &self,
        surface: &Surface,
        seen: &Seen,
        bins: &Bins,
        demand: &Demand,
        pairs: &[[u32; 2]],
        energy: [f64; 2],
        values: &mut [[f64; 3]],
    ) -> Result<LowRankFacts> {
        let columns = bins.columns(&seen.facets);
        let count = bins.normals.len();
        let channels = columns / count.max(1);
        // Columns count by the area that they stand for.
        let scale: Vec<f64> = bins.areas.iter().map(|a| a.sqrt().max(f64::MIN_POSITIVE)).collect();
        let write_n = |rows: Range<usize>, out: &mut [f64]| {
            for (k, row) in rows.zip(out.chunks_exact_mut(columns.max(1))) {
                bins.write_row(&seen.facets, &seen.bits, pairs[k].map(|d| d as usize), row);
                for (j, x) in row.iter_mut().enumerate() {
                    *x /= scale[j / channels];
                }
            }
        };
        // Three rows a pair: one a channel.
        let write_m = |rows: Range<usize>, out: &mut [f64]| {
            let (mut of_pair, mut values) = (None, vec![[0.0; 3]; count]);
            for (k, row) in rows.zip(out.chunks_exact_mut(count.max(1))) {
                if of_pair != Some(k / 3) {
                    of_pair = Some(k / 3);
                    let [wi, wo] = pairs[k / 3].map(|d| demand.directions[d as usize]);
                    for (value, &n) in values.iter_mut().zip(&bins.normals) {
                        let factor = n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
                        *value = if factor > 0.0 { surface.brdf.eval(n, wi, wo).map(|fr| fr * factor) } else { [0.0; 3] };
                    }
                }
                for ((x, value), scale) in row.iter_mut().zip(&values).zip(&scale) {
                    *x = value[k % 3] * scale;
                }
            }
        };
        let n = self.factor(&Rows { rows: pairs.len(), columns, write: &write_n }, energy[0], self.quality.seed)?;
        let m = self.factor(&Rows { rows: 3 * pairs.len(), columns: count, write: &write_m }, energy[1], self.quality.seed)?;
        let products = products(bins, channels, (&n).into(), (&m).into(), |j| j);
        let colour = of_surface(surface, self.choices.colours, &[1.0; 3]);
        values.par_iter_mut().enumerate().for_each(|(k, value)| {
            let of_n = Row::mixture(n.rank(), std::iter::once((n.left.row(k).iter().copied(), 1.0, 1.0)));
            for c in 0..3 {
                let of_m = Row::mixture(m.rank(), std::iter::once((m.left.row(3 * k + c).iter().copied(), 1.0, 1.0)));
                value[c] += colour[c] * products[c % channels].at(&of_n, &of_m);
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
            m_bytes: 8 * (m.left.nrows() * m.rank() + m.right.nrows() * m.rank() + m.mean.len()),
        })
    }
}

/// Products for each channel of colour weights, or the one for all: column `j` of `N` goes with column `of_bin(j)` of `M`.
fn products(bins: &Bins, channels: usize, n: Basis<'_>, m: Basis<'_>, of_bin: impl Fn(usize) -> usize) -> Vec<Product> {
    let of_channel = |c: usize| {
        let columns: Vec<[usize; 2]> = (0..bins.normals.len()).map(|j| [channels * j + c, of_bin(j)]).collect();
        Product::new(n, m, &columns)
    };
    (0..channels.max(1)).map(of_channel).collect()
}

/// What turns a number along a colour direction, or one of each channel, into a colour of a surface.
fn of_surface(surface: &Surface, colours: Colours, direction: &[f64; 3]) -> [f64; 3] {
    // Image tints are in N.
    let tint = if let Tint::Uniform(tint) = surface.tint { tint.map(f64::from) } else { [1.0; 3] };
    match colours {
        Colours::Principal => std::array::from_fn(|c| tint[c] * direction[c]),
        Colours::Three => tint,
    }
}
