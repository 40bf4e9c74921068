//! Baking: the table of an effective BRDF, as fine as an asked error needs.
//!
//! 10,000 *probe* pairs off the nodes, uniform in projected solid angle, are computed first (1,000 stratified directions to
//! the light, each with ten of as many to the viewer: few directions make them cheap, but the error sits in few grazing ones: with
//! 200 it was found up to three times too large or too small, see the tests). They give the plan, the error of the facets and, compared with
//! what a table interpolates there, its bias. Tables are refined from [`FIRST_RINGS`] rings on until the two errors, added in
//! squares, keep the tolerance, or to [`max_rings`].
//!
//! A table's error falls as a power of its rings that two cheap tables tell, its cost rises as `rings⁴`: each finer table is as fine as that
//! power asks for.

use super::effective_table::{EffectiveTable, TableError, TableOrigin, max_rings, value_count, value_index};
use super::forecast::{BakeForecast, Costs, FACET_SHARE, Refinement};
use super::grid::{HemisphereGrid, node_count};
use super::guide::GuideLobes;
use super::kept_blocks::{BlockValues, KeptBlocks};
use crate::brdf::Colour;
use crate::direction::Pair;
use crate::error::{BadInput, Error, Result};
use crate::filter::{Control, Effective, Plan, Quality, RisingShare, Value, effective};
use crate::material::SmallScale;
use crate::numerics::cast::{narrow, truncate_usize};
use crate::numerics::hash::Fnv1a;
use crate::numerics::random::{Random, mix};
use crate::numerics::words::percent;
use glam::DVec3;
use std::f64::consts::TAU;
use std::ops::Range;
use std::path::Path;

/// What is to be baked.
#[derive(Clone, Debug)]
pub struct BakeRecipe<'a> {
    /// Name of the material, for the file.
    pub name: &'a str,
    /// Text of the material file, for the file.
    pub material: &'a str,
    /// How to compute values. `tolerance` is the whole table's.
    pub quality: Quality,
    /// Rings of the table, if the caller wants them fixed; else as many as `quality.tolerance` needs.
    pub rings: Option<usize>,
}

/// What helps with a long bake.
#[derive(Clone, Copy)]
pub struct BakeAids<'a> {
    /// Told what the next table will take, before it is begun. Not told where the clock stands still.
    pub forecast: &'a dyn Fn(&BakeForecast),
    /// A file in which the blocks of tables are kept while they are made, and found by the next bake of the same: see [`KeptBlocks`]. The caller
    /// removes it once the table is stored.
    pub kept: Option<&'a Path>,
}

impl BakeAids<'static> {
    /// None.
    pub fn none() -> Self {
        Self { forecast: &|_| {}, kept: None }
    }
}

/// Rings of the first table that is tried.
pub const FIRST_RINGS: usize = 8;
/// Fewest rings that a caller may ask for.
pub const MIN_RINGS: usize = 4;
/// Strata of the probes' directions: in the square of the sine of the polar angle, and in azimuth.
const PROBE_STRATA: [usize; 2] = [25, 40];
/// Directions to the light, and as many to the viewer, of the probe pairs.
const PROBE_DIRECTIONS: usize = PROBE_STRATA[0] * PROBE_STRATA[1];
/// Directions to the viewer that each direction to the light meets, at random.
const PARTNERS: usize = 10;
/// The first so many probes are also looked at the other way round, to see whether `S` is symmetric.
const REVERSED: usize = 1000;
/// Probes that choose how fine the guide is.
const GUIDE_PROBES: usize = 2000;
/// Relative difference of `S` both ways round up to which a surface counts as reciprocal: rounding of sums in `f32`.
const SYMMETRIC: f64 = 1e-4;
/// How many times its expectation the squared difference may be where both ways have rays of their own (`reference`). Chosen, not measured: squares of few rays have long tails.
/// An asymmetry that hides below this is less than the noise, and is in the error that the probes find.
const SYMMETRIC_NOISE: f64 = 2.0;
/// Pairs of one call: its values and what the sums need stay far below the table's own size.
const BLOCK: usize = 500_000;
/// Shares of the progress that the probes and the first table make, until it is known what the last one will cost. Chosen, not measured.
const PROBES_PROGRESS: f64 = 0.05;

/// Values of pairs, from any source: pairs, how to compute them, and the share of the whole work that this call is.
pub type ValuesOfPairs<'a> = dyn FnMut(&[Pair], &Quality, Range<f64>) -> Result<Effective> + 'a;

/// The effective BRDF of `surface` as a table.
///
/// # Errors
/// Those of [`effective`]; [`Error::BadInput`] for a number of rings out of range, [`Error::Unsupported`] for a budget.
///
/// ```
/// use biscale::table::{BakeRecipe, bake};
/// use biscale::{Control, EffectiveTable, Material, Quality};
/// use glam::DVec3;
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
/// let surface = Material::load(path.as_ref())?.build()?;
/// // Four rings of directions: fast, and coarse.
/// let quality = Quality { tolerance: 0.1, ..Quality::default() };
/// let recipe = BakeRecipe { name: "pyramids", material: "", quality, rings: Some(4) };
/// let table = bake(&surface, &recipe, &Control::quiet())?;
///
/// // Stored and loaded, it says the same between its nodes.
/// let folder = tempfile::tempdir().expect("a folder");
/// let file = folder.path().join("table.exr");
/// table.save(&file)?;
/// let (wi, wo) = (DVec3::new(0.6, 0.0, 0.8), DVec3::Z);
/// assert_eq!(EffectiveTable::load(&file)?.eval(wi, wo), table.eval(wi, wo));
/// assert!(table.eval(wi, wo).fbar[0] > 0.0);
/// # Ok::<(), biscale::Error>(())
/// ```
pub fn bake(surface: &SmallScale, recipe: &BakeRecipe<'_>, control: &Control<'_>) -> Result<EffectiveTable> {
    bake_with(surface, recipe, &BakeAids::none(), control)
}

/// [`bake`], with what helps if it takes long.
///
/// # Errors
/// As [`bake`], and those of the file of kept blocks.
pub fn bake_with(surface: &SmallScale, recipe: &BakeRecipe<'_>, aids: &BakeAids<'_>, control: &Control<'_>) -> Result<EffectiveTable> {
    let mut table = build(recipe, GuideLobes::of(surface).as_ref(), aids, &mut |pairs, quality, share| {
        control.part(share, |control| effective(surface, pairs, quality, control))
    })?;
    table.about.notes.splice(..0, surface.tile.notes.iter().cloned());
    Ok(table)
}

/// The table whose values come from `values`; `lobes` are what a guide is made of.
pub fn build(
    recipe: &BakeRecipe<'_>,
    lobes: Option<&GuideLobes<'_>>,
    aids: &BakeAids<'_>,
    values: &mut ValuesOfPairs<'_>,
) -> Result<EffectiveTable> {
    let BakeRecipe { quality, rings: fixed, .. } = recipe;
    check_rings(*fixed, max_rings(true))?;
    if quality.budget.is_some() {
        let remedy = "set the time by `tolerance` or `resolution`".into();
        return Err(Error::Unsupported { what: "a budget of time for a whole table".into(), remedy });
    }
    let mut done = RisingShare::default();
    let probes = Probes::compute(quality, 0.0..done.step(PROBES_PROGRESS, 1.0, false).1, values)?;
    check_rings(*fixed, max_rings(probes.reciprocal))?;
    let facets = probes.summary.relative_rms;
    let wanted = Refinement::wanted(quality.tolerance, facets);
    let guide = lobes.map(|l| l.guide(probes.mean_s(), &probes.directions(GUIDE_PROBES)));
    let limit = max_rings(probes.reciprocal);
    let mut tables = Tables {
        reciprocal: probes.reciprocal,
        quality: Quality { plan: probes.summary.plan.clone(), ..facet_quality(quality) },
        kept: aids.kept.map(|path| KeptBlocks::open(path, probes.fingerprint(recipe))).transpose()?,
        costs: Costs::default(),
        values,
    };
    tables.costs.add(&probes.summary, probes.pairs.len());
    let mut rings = fixed.unwrap_or(FIRST_RINGS);
    // What is left after the first tables is known only once they are made.
    let mut left = PROBES_PROGRESS.recip();
    let mut before = None;
    loop {
        let is_last = rings == limit || fixed.is_some();
        let (from, to) = done.step(1.0, if is_last { 1.0 } else { left }, is_last);
        let mut table = tables.fill(rings, from..to)?;
        let plain = probes.error_of(&table);
        table.guide.clone_from(&guide);
        let mut interpolation = if guide.is_some() { probes.error_of(&table) } else { plain };
        if plain <= interpolation {
            table.guide = None;
            interpolation = plain;
        }
        if interpolation <= wanted || is_last {
            let error = TableError { relative_rms: facets.hypot(interpolation), facets, interpolation, probes: probes.pairs.len() };
            table.about = about(recipe, &probes, &table, error)?;
            return Ok(table);
        }
        let refinement = Refinement { rings, reciprocal: probes.reciprocal, tolerance: quality.tolerance, facets, interpolation, before };
        before = Some((rings, interpolation));
        let (next, is_expected_last) = refinement.next(wanted);
        rings = next;
        if !is_expected_last {
            continue;
        }
        left = 1.0;
        let blocks = |rings: usize| blocks(node_count(rings), probes.reciprocal);
        let forecast = refinement.forecast(rings, &tables.costs, &blocks);
        if forecast.seconds > 0.0 {
            (aids.forecast)(&forecast);
        }
    }
}

/// What the facets may take of the whole tolerance.
fn facet_quality(quality: &Quality) -> Quality {
    Quality { tolerance: quality.tolerance * FACET_SHARE.sqrt(), ..quality.clone() }
}

fn check_rings(rings: Option<usize>, limit: usize) -> Result<()> {
    match rings {
        Some(n) if !(MIN_RINGS..=limit).contains(&n) => {
            let problem = format!("{n} rings of directions are out of range");
            let remedy =
                format!("ask for {MIN_RINGS} to {limit} (a table of {limit} takes {} MB)", value_count(limit, true) * 24 / 1_000_000);
            Err(BadInput::new(problem, remedy).at_field("resolution").into())
        }
        _ => Ok(()),
    }
}

fn about(recipe: &BakeRecipe<'_>, probes: &Probes, table: &EffectiveTable, error: TableError) -> Result<TableOrigin> {
    if !error.relative_rms.is_finite() {
        return Err(Error::Numeric(format!("the table's error came out as {}", error.relative_rms)));
    }
    let mut notes = probes.summary.notes.clone();
    if error.relative_rms > recipe.quality.tolerance {
        let limit = max_rings(table.reciprocal);
        let reason = if error.facets > error.interpolation {
            "the values themselves are that far off".to_owned()
        } else if table.grid.rings() == limit {
            format!("{limit} rings of directions, the most that fit into memory, are too coarse for its lobes")
        } else {
            format!("{} rings of directions, as asked for, are too coarse for its lobes", table.grid.rings())
        };
        let (error, tolerance) = (error.relative_rms, recipe.quality.tolerance);
        notes.push(format!("the table's relative RMS error is {}, over the tolerance of {}: {reason}", percent(error), percent(tolerance)));
    }
    if !table.reciprocal {
        notes.push("the surface is not reciprocal: both S(wi,wo) and S(wo,wi) are stored".to_owned());
    }
    Ok(TableOrigin {
        program: concat!("biscale ", env!("CARGO_PKG_VERSION")).to_owned(),
        name: recipe.name.to_owned(),
        material: recipe.material.to_owned(),
        method: probes.summary.method.to_owned(),
        plan: probes.summary.plan_text(),
        seed: recipe.quality.seed,
        bounces: probes.summary.bounces(),
        tolerance: recipe.quality.tolerance,
        facets: probes.summary.facets,
        error,
        notes,
    })
}

/// What makes tables, and keeps the blocks that are made.
struct Tables<'a, 'v> {
    reciprocal: bool,
    quality: Quality,
    kept: Option<KeptBlocks>,
    /// What the blocks of the last table cost, or the probes before the first.
    costs: Costs,
    values: &'a mut ValuesOfPairs<'v>,
}

impl Tables<'_, '_> {
    /// All values of a table of `rings` rings.
    fn fill(&mut self, rings: usize, share: Range<f64>) -> Result<EffectiveTable> {
        let reciprocal = self.reciprocal;
        let grid = HemisphereGrid::new(rings);
        let count = node_count(rings);
        let total = value_count(rings, reciprocal);
        let mut planes: [Vec<f32>; 6] = std::array::from_fn(|_| vec![0.0; total]);
        let mut av = vec![0.0_f32; count];
        let mut done = 0;
        let before = std::mem::take(&mut self.costs);
        for (number, (to_light, to_view)) in blocks(count, reciprocal).into_iter().enumerate() {
            let places = |o: usize| to_light.clone().filter(move |&i| !reciprocal || i <= o).map(move |i| (i, o));
            let places: Vec<(usize, usize)> = to_view.clone().flat_map(places).collect();
            let at = |n: usize| share.start + (share.end - share.start) * n as f64 / total as f64;
            let block = self.block(&grid, [rings, number], &places, at(done)..at(done + places.len()))?;
            done += places.len();
            for (&(i, o), (s, of_viewer)) in places.iter().zip(block.values()) {
                let index = value_index(count, reciprocal, i, o);
                for c in 0..6 {
                    planes[c][index] = s[c];
                }
                av[o] = of_viewer;
            }
        }
        if !self.costs.is_known() {
            // All blocks were kept.
            self.costs = before;
        }
        if planes.iter().chain([&av]).flatten().any(|v| !v.is_finite() || *v < 0.0) {
            return Err(Error::Numeric("a value of the table is negative or not finite".to_owned()));
        }
        Ok(EffectiveTable { grid, reciprocal, planes, av, guide: None, about: TableOrigin::default() })
    }

    /// The values of one block, `[rings, number]`, from the file of kept ones if they are there.
    fn block(&mut self, grid: &HemisphereGrid, name: [usize; 2], places: &[(usize, usize)], share: Range<f64>) -> Result<BlockValues> {
        let pairs: Vec<Pair> = places.iter().map(|&(i, o)| Pair { wi: grid.nodes()[i], wo: grid.nodes()[o] }).collect();
        if let Some(kept) = &mut self.kept
            && let Some(block) = kept.find(name, &pairs)?
        {
            return Ok(block);
        }
        let result = (self.values)(&pairs, &self.quality, share)?;
        self.costs.add(&result.summary, pairs.len());
        let mut block = BlockValues::default();
        for Value { s, s_se, av, .. } in &result.values {
            block.push([s[0], s[1], s[2], s_se[0], s_se[1], s_se[2]].map(narrow), narrow(*av));
        }
        if let Some(kept) = &mut self.kept {
            kept.keep(name, &pairs, &block)?;
        }
        Ok(block)
    }
}

/// The pairs of `count` nodes as rectangles of at most [`BLOCK`] (light, viewer); of a reciprocal table those with
/// `light <= viewer`. Square ones: each distinct direction is traced once a block.
fn blocks(count: usize, reciprocal: bool) -> Vec<(Range<usize>, Range<usize>)> {
    let side = BLOCK.isqrt();
    let groups = count.div_ceil(side);
    let group = |g: usize| g * count / groups..(g + 1) * count / groups;
    (0..groups).flat_map(|o| (0..if reciprocal { o + 1 } else { groups }).map(move |i| (group(i), group(o)))).collect()
}

/// Pairs off the nodes with their values.
struct Probes {
    pairs: Vec<Pair>,
    values: Vec<Value>,
    reciprocal: bool,
    summary: crate::filter::Summary,
}

impl Probes {
    fn compute(quality: &Quality, share: Range<f64>, values: &mut ValuesOfPairs<'_>) -> Result<Self> {
        let mut stream = Random::from_state(mix(quality.seed));
        let mut random = || stream.unit();
        let [rows, columns] = PROBE_STRATA;
        let mut stratified = |i: usize| {
            let (u, v) = (((i / columns) as f64 + random()) / rows as f64, ((i % columns) as f64 + random()) / columns as f64);
            projected_uniform(u, v)
        };
        let to_light: Vec<DVec3> = (0..PROBE_DIRECTIONS).map(&mut stratified).collect();
        let to_view: Vec<DVec3> = (0..PROBE_DIRECTIONS).map(&mut stratified).collect();
        let mut any = || to_view[truncate_usize(random() * PROBE_DIRECTIONS as f64)];
        let mut pairs: Vec<Pair> = Vec::with_capacity(PROBE_DIRECTIONS * PARTNERS + REVERSED);
        for _ in 0..PARTNERS {
            pairs.extend(to_light.iter().map(|&wi| Pair { wi, wo: any() }));
        }
        let count = pairs.len();
        pairs.extend_from_within(..REVERSED);
        for pair in &mut pairs[count..] {
            std::mem::swap(&mut pair.wi, &mut pair.wo);
        }
        let Effective { mut values, summary } = values(&pairs, &facet_quality(quality), share)?;
        let (mut difference, mut sum, mut noise) = (0.0, 0.0, 0.0);
        for (there, back) in values[..REVERSED].iter().zip(&values[count..]) {
            for c in 0..3 {
                difference += (there.s[c] - back.s[c]).powi(2);
                sum += there.s[c].powi(2);
                noise += there.s_se[c].powi(2) + back.s_se[c].powi(2);
            }
        }
        // The other methods share their facets between all pairs: noise is the same both ways.
        let allowed = if matches!(summary.plan, Some(Plan::Reference(_))) { SYMMETRIC_NOISE * noise } else { 0.0 };
        pairs.truncate(count);
        values.truncate(count);
        Ok(Self { pairs, values, reciprocal: difference <= SYMMETRIC * SYMMETRIC * sum + allowed, summary })
    }

    /// What tells a bake from any other: the values of all probes, which the surface and every option of it go into, and the program's version.
    fn fingerprint(&self, recipe: &BakeRecipe<'_>) -> u64 {
        let mut hash = Fnv1a::default();
        hash.add(concat!("biscale ", env!("CARGO_PKG_VERSION")).as_bytes());
        hash.add(self.summary.plan_text().as_bytes());
        hash.add(&recipe.quality.seed.to_le_bytes());
        for value in &self.values {
            value.s.iter().chain(&value.s_se).chain([&value.av]).for_each(|v| hash.add(&v.to_le_bytes()));
        }
        hash.value()
    }

    /// About `count` of the pairs, from all over.
    fn directions(&self, count: usize) -> Vec<(DVec3, DVec3)> {
        self.pairs.iter().step_by(self.pairs.len() / count).map(|p| (p.wi, p.wo)).collect()
    }

    /// Mean of `S`, 1/sr.
    fn mean_s(&self) -> Colour {
        std::array::from_fn(|c| self.values.iter().map(|v| v.s[c]).sum::<f64>() / self.values.len() as f64)
    }

    /// Relative RMS difference of what `table` gives for `fbar` at the probes; absolute where all are 0.
    fn error_of(&self, table: &EffectiveTable) -> f64 {
        let (mut off, mut all) = (0.0, 0.0);
        for (pair, value) in self.pairs.iter().zip(&self.values) {
            let at = table.eval(pair.wi, pair.wo);
            for c in 0..3 {
                off += (at.fbar[c] - value.fbar[c]).powi(2);
                all += value.fbar[c].powi(2);
            }
        }
        if all > 0.0 { (off / all).sqrt() } else { (off / (3 * self.pairs.len()) as f64).sqrt() }
    }
}

/// A direction uniform in projected solid angle from two numbers in `0..1` (Malley's method).
fn projected_uniform(u: f64, v: f64) -> DVec3 {
    let (sin, cos) = (TAU * v).sin_cos();
    let radius = u.sqrt();
    DVec3::new(radius * cos, radius * sin, (1.0 - u).sqrt())
}

#[cfg(test)]
#[path = "bake_tests.rs"]
mod tests;
