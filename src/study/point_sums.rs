//! Plain sums over facets: what the place of the facets and the numbers that are summed make of the error, all else being equal.
//!
//! Every placement turns into facets in the same way: a point of the unit square is a place along the surface's area and one across a
//! triangle. Visibility is exact. `f64` evaluates each facet's BRDF and adds in 64 bits; `f32` is the kernel of the method `direct`, which
//! works in lanes of 32 bits and adds their sums of 32,768 facets in 64.

use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{self, Density, Facets, NO_TRIANGLE, REPLICATES, Surface};
use crate::filter::{Control, Effective, FacetSums, Query, QueryEntry, Summary, Value, Views, lobes, visible_area};
use crate::material::{SmallScale, Tint};
use crate::numerics::cast::halves;
use crate::numerics::low_discrepancy::{fraction, sobol_2d};
use crate::numerics::random::hash_64;
use crate::numerics::seed::fold;
use crate::visibility::{Bits, Occlusion, PeriodicBvh, is_grazing, raster};
use rayon::prelude::*;

/// Where facets are placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// Independent of each other.
    Random,
    /// One at a random place in each of as many stretches of equal area.
    Stratified,
    /// Owen-scrambled Sobol' points, as the method `direct` places them.
    LowDiscrepancy,
}

impl Placement {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Random, Self::Stratified, Self::LowDiscrepancy];

    /// As files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Stratified => "stratified",
            Self::LowDiscrepancy => "low-discrepancy",
        }
    }

    /// `count` points of the unit square.
    fn points(self, count: u32, seed: u64) -> Vec<[f64; 2]> {
        let stream = hash_64(seed);
        // Each half of the word is one number.
        let random = |k: u32| halves(hash_64(stream ^ u64::from(k))).map(fraction);
        let scramble = fold(seed);
        (0..count)
            .map(|k| match self {
                Self::Random => random(k),
                Self::Stratified => {
                    let [first, second] = random(k);
                    [(f64::from(k) + first) / f64::from(count), second]
                }
                Self::LowDiscrepancy => sobol_2d(k, scramble).map(fraction),
            })
            .collect()
    }
}

/// Numbers that are summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits, in lanes.
    F32,
    /// 64 bits.
    F64,
}

impl Precision {
    /// Both.
    pub const ALL: [Self; 2] = [Self::F32, Self::F64];

    /// As files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

/// Pairs over which sums of 32 bits are compared with those of 64.
const COMPARED: usize = 32;

/// Facets and what they see of the directions of a query.
struct Seen<'a> {
    small: &'a SmallScale,
    surface: Surface,
    facets: Facets,
    query: Query,
    bits: Bits,
}

/// Values by plain sums over `count` facets. They have no standard errors: one sum tells none.
///
/// # Errors
/// `Interrupted`; [`crate::Error::Numeric`] for a surface that rays cannot be traced on.
pub fn sums(
    small: &SmallScale,
    pairs: &[Pair],
    placement: Placement,
    precision: Precision,
    count: u32,
    seed: u64,
    control: &Control<'_>,
) -> Result<Effective> {
    let clock = control.clock;
    let begun = clock();
    let surface = Surface::new(small, None);
    let facets = facets::at_places(small, &surface, &Density::uniform(&surface), &placement.points(count, seed));
    let mut seen = Seen { small, surface, facets, query: Query::new(pairs, false), bits: Bits::default() };
    let sampled = clock();
    seen.see(control)?;
    (control.progress)("sums", 0.5);
    let traced = clock();
    let query = &seen.query;
    let totals = match precision {
        Precision::F64 => query.pairs.par_iter().map(|&pair| seen.plain(pair)).collect(),
        Precision::F32 => seen.lanes(),
    };
    let areas: Vec<f64> = (0..query.directions.len())
        .into_par_iter()
        .map(|d| match precision {
            Precision::F64 => seen.plain_area(d),
            Precision::F32 => visible_area(&seen.facets, query.directions[d], seen.bits.row(d)).iter().sum(),
        })
        .collect();
    control.check()?;
    let value = |entry: &Option<_>, pair: &Pair| {
        let Some(QueryEntry { pair: k, viewer }) = entry else { return Value::default() };
        let (light, av) = (pair.wi.z.max(crate::direction::MIN_COSINE), areas[*viewer as usize] / f64::from(count));
        let s: [f64; 3] = totals[*k as usize].map(|total: f64| total / f64::from(count));
        let fbar = if av > 0.0 { s.map(|x| x / av) } else { [0.0; 3] };
        Value { s, fbar, fhat: fbar.map(|x| x / light), av, ..Value::default() }
    };
    let values = query.entries.iter().zip(pairs).map(|(entry, pair)| value(entry, pair)).collect();
    let mut notes = Vec::new();
    if precision == Precision::F32 {
        let difference = seen.difference(&totals);
        notes.push(format!("sums in 32 bits differ by {difference:.1e}, relative RMS, from the same sums in 64"));
    }
    let stages = [("facets", sampled - begun), ("visibility", traced - sampled), ("sums", clock() - traced)];
    let summary = Summary {
        method: "points",
        facets: count as usize,
        clusters: count as usize,
        directions: query.directions.len(),
        stages: stages.into_iter().map(|(name, seconds)| (name, 1e3 * seconds)).collect(),
        notes,
        ..Summary::default()
    };
    Ok(Effective { values, summary })
}

impl Seen<'_> {
    /// Finds the visibility of all directions: by projection, or by rays where the projection spans too many periods.
    fn see(&mut self, control: &Control<'_>) -> Result<()> {
        let Self { small, surface, facets, query, bits } = self;
        let words = facets.triangle.len() / 64;
        let rays = query.directions.iter().any(|&w| is_grazing(surface, w)).then(|| PeriodicBvh::new(&small.tile)).transpose()?;
        *bits = Bits { words, rows: vec![0; words * query.directions.len()] };
        let rows = bits.rows.par_chunks_mut(words.max(1)).zip(&query.directions);
        rows.for_each_init(raster::Scratch::default, |scratch, (row, &w)| {
            if control.check().is_err() {
                return;
            }
            let Some(rays) = rays.as_ref().filter(|_| is_grazing(surface, w)) else {
                return raster::visible(surface, facets, w, scratch, row);
            };
            for (f, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
                if triangle != NO_TRIANGLE && surface.normals[triangle as usize].dot(w) > 0.0 {
                    let from = surface.tile_triangle[triangle as usize] as usize;
                    let free = rays.occluded(from, position * surface.unit, w) != Occlusion::Blocked;
                    row[f / 64] |= u64::from(free) << (f % 64);
                }
            }
        });
        control.check()
    }

    /// `sum weight fr (n·wi)(n·wo)` over the facets that both directions of a pair see, in 64 bits.
    fn plain(&self, [i, o]: [u32; 2]) -> [f64; 3] {
        let (wi, wo) = (self.query.directions[i as usize], self.query.directions[o as usize]);
        let (seen_i, seen_o) = (self.bits.row(i as usize), self.bits.row(o as usize));
        let mut sum = [0.0; 3];
        for (word, (a, b)) in seen_i.iter().zip(seen_o).enumerate() {
            let mut both = a & b;
            while both != 0 {
                let f = 64 * word + both.trailing_zeros() as usize;
                both &= both - 1;
                let triangle = self.facets.triangle[f] as usize;
                let n = self.surface.normals[triangle];
                let covering = &self.small.surfaces[usize::from(self.surface.surface[triangle])];
                let value = covering.brdf.eval(n, wi, wo);
                let tint = self.tint(f, &covering.tint);
                let factor = f64::from(self.facets.weight[f]) * n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
                for c in 0..3 {
                    sum[c] += factor * value[c] * tint[c];
                }
            }
        }
        sum
    }

    fn tint(&self, facet: usize, tint: &Tint) -> [f64; 3] {
        match (tint, &self.facets.tint) {
            (Tint::Uniform(tint), _) => *tint,
            (Tint::Image(_), Some(of_facet)) => std::array::from_fn(|c| f64::from(of_facet[c][facet])),
            (Tint::Image(_), None) => [1.0; 3],
        }
    }

    /// `sum weight (n·w)` over the facets that a direction sees, in 64 bits.
    fn plain_area(&self, direction: usize) -> f64 {
        let (w, row) = (self.query.directions[direction], self.bits.row(direction));
        let facets = self.facets.triangle.iter().enumerate().filter(|(f, _)| row[f / 64] >> (f % 64) & 1 == 1);
        facets.map(|(f, &t)| f64::from(self.facets.weight[f]) * self.surface.normals[t as usize].dot(w).max(0.0)).sum()
    }

    /// The sums of all pairs by the kernel of the method `direct`.
    fn lanes(&self) -> Vec<[f64; 3]> {
        let of = |brdf, tint: &Tint| lobes(brdf, if let Tint::Uniform(tint) = tint { *tint } else { [1.0; 3] });
        let of_surfaces: Vec<_> = self.small.surfaces.iter().map(|s| of(&s.brdf, &s.tint)).collect();
        let Self { facets, bits, query, .. } = self;
        let sums = FacetSums { facets, bits, query, groups: &self.surface.groups, lobes: &of_surfaces };
        let tasks = query.tasks();
        let totals: Vec<Vec<[[f64; 3]; REPLICATES]>> = tasks
            .into_par_iter()
            .map(|task| {
                let mut of_task = vec![[[0.0; 3]; REPLICATES]; task.len()];
                sums.add(task, &mut Views::default(), &mut of_task);
                of_task
            })
            .collect();
        totals.into_iter().flatten().map(|sets| std::array::from_fn(|c| sets.iter().map(|set| set[c]).sum())).collect()
    }

    /// Relative RMS difference of `totals` from sums in 64 bits, over some pairs.
    fn difference(&self, totals: &[[f64; 3]]) -> f64 {
        let step = totals.len().div_ceil(COMPARED).max(1);
        let (mut squares, mut energy) = (0.0, 0.0);
        for k in (0..totals.len()).step_by(step) {
            for (a, b) in totals[k].iter().zip(self.plain(self.query.pairs[k])) {
                squares += (a - b).powi(2);
                energy += b * b;
            }
        }
        if energy > 0.0 { (squares / energy).sqrt() } else { squares.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Method, Quality, effective};
    use crate::material::Material;
    use crate::study::list;
    use std::path::Path;
    use std::sync::atomic::AtomicBool;

    fn tile(name: &str) -> SmallScale {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/truth/{name}.toml"));
        Material::load(&path).unwrap().build().unwrap()
    }

    fn with_control<T>(work: impl FnOnce(&Control<'_>) -> T) -> T {
        let cancel = AtomicBool::new(false);
        work(&Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 })
    }

    fn run(small: &SmallScale, pairs: &[Pair], placement: Placement, precision: Precision, count: u32, seed: u64) -> Vec<Value> {
        with_control(|control| sums(small, pairs, placement, precision, count, seed, control).unwrap().values)
    }

    fn distance(a: &[Value], b: &[Value]) -> f64 {
        let (mut squares, mut energy) = (0.0, 0.0);
        for (a, b) in a.iter().zip(b) {
            for c in 0..3 {
                squares += (a.fbar[c] - b.fbar[c]).powi(2);
                energy += b.fbar[c].powi(2);
            }
        }
        f64::sqrt(squares / energy)
    }

    #[test]
    fn plain_sums_agree_with_the_direct_method_and_in_both_precisions() {
        let pairs = list(40, 9).pairs;
        for name in ["weave.diffuse", "bumpy.ggx_0.30", "rods.diffuse"] {
            let small = tile(name);
            let quality = Quality { method: Method::Direct, tolerance: 0.003, ..Quality::default() };
            let direct = with_control(|control| effective(&small, &pairs, &quality, control).unwrap().values);
            let [narrow, wide] = Precision::ALL.map(|p| run(&small, &pairs, Placement::LowDiscrepancy, p, 16_384, 4));
            let off = distance(&wide, &direct);
            assert!(off < 0.03, "{name}: {off} from the direct method");
            let off = distance(&narrow, &wide);
            assert!(off > 0.0 && off < 1e-4, "{name}: {off} between the precisions");
        }
    }

    #[test]
    fn strata_beat_chance() {
        let pairs = list(40, 9).pairs;
        let small = tile("bumpy.ggx_0.30");
        let quality = Quality { method: Method::Direct, tolerance: 0.001, ..Quality::default() };
        let direct = with_control(|control| effective(&small, &pairs, &quality, control).unwrap().values);
        let rms = |placement| {
            let off = |seed| distance(&run(&small, &pairs, placement, Precision::F64, 1024, seed), &direct).powi(2);
            f64::sqrt((0..4).map(off).sum::<f64>() / 4.0)
        };
        let [random, stratified, sobol] = Placement::ALL.map(rms);
        assert!(stratified < 0.7 * random && sobol < 0.7 * random, "random {random}, stratified {stratified}, low-discrepancy {sobol}");
    }

    #[test]
    fn a_stratum_has_one_point_each() {
        for placement in [Placement::Stratified, Placement::LowDiscrepancy] {
            let mut strata: Vec<u32> = placement.points(64, 5).iter().map(|p| (p[0] * 64.0) as u32).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..64).collect::<Vec<_>>());
        }
    }
}
