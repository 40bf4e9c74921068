//! How far values of an approximation are off: of the methods that put few numbers in the place of many facets.
//!
//! On some pairs of the list, the *probes*, facets are also summed one by one, with what they see of exactly these directions. While settings are looked
//! for these are the facets of the approximation: the spread of their eight replicates is the error of the facets, the difference from their sums the bias of
//! all that is approximated. The error that a caller is told is measured against four times as many other facets ([`Probes::measure`]): it is the
//! error of these values, and no expectation over all that might have come out.

use super::control::Control;
use super::estimate::{CompleteSums, Spread};
use super::facet_sampler::{Batch, FacetSampler};
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
use crate::numerics::low_discrepancy::hash;
use rustc_hash::FxHashMap;

/// Pairs on which errors are measured: twice the 256 that `docs/numerics.md`, section 3.6, asks for.
const PROBES: usize = 512;
/// Of those that are drawn when values are known: how many by the squares of these. Each of them may have two directions of its own, and directions cost.
const BY_VALUE: usize = 128;
/// Facets of the sums that values are measured against, as a multiple of their own.
const MORE_FACETS: usize = 4;
/// The least facets of these sums: so many cost little, and fewer err alike for all seeds on tiles of a few facets (V-groove, twice 2,048: .56 of the true error was told).
const LEAST_FACETS: usize = 1 << 14;

/// `S` of a pair, and visible area over the footprint from its viewer.
pub type RawValue = ([f64; 3], f64);

/// Errors of an approximation, relative RMS.
#[derive(Clone, Copy, Debug)]
pub struct ApproximationErrors {
    /// Of the facets, from the spread of their replicates.
    pub facets: f64,
    /// Of what stands for them, from their sums one by one.
    pub bias: f64,
    /// Of both together, from the sums over other facets.
    pub total: f64,
}

/// Pairs on which errors are measured.
pub struct Probes {
    pairs: Vec<Pair>,
    /// The place of each in the list.
    places: Vec<usize>,
    /// How many pairs of the list each stands for.
    weights: Vec<f64>,
    query: Query,
}

impl Probes {
    /// Those of a list of which no value is known.
    pub fn new(small: &SmallScale, list: &[Pair]) -> Self {
        let chosen = if list.len() <= PROBES { list.to_vec() } else { subset(list, &Query::new(list, small.is_reciprocal()), PROBES) };
        let key = |p: &Pair| [p.wi, p.wo].map(|w| w.to_array().map(f64::to_bits));
        let first: FxHashMap<_, usize> = list.iter().enumerate().rev().map(|(k, p)| (key(p), k)).collect();
        let places: Vec<usize> = chosen.iter().map(|p| first[&key(p)]).collect();
        Self { query: Query::new(&chosen, false), weights: vec![1.0; chosen.len()], pairs: chosen, places }
    }

    /// Those of a list whose values are `raw`: pairs that are bright, on which a few may decide, are drawn by the squares of their values beside the others.
    pub fn by_value(small: &SmallScale, list: &[Pair], raw: &[RawValue]) -> Self {
        let mut probes = Self::new(small, list);
        if list.len() <= PROBES {
            return probes;
        }
        let squares: Vec<f64> = raw.iter().map(|value| fbar(value).iter().map(|f| f * f).sum()).collect();
        let total: f64 = squares.iter().sum();
        if total <= 0.0 {
            return probes;
        }
        let even = probes.pairs.len() as f64 / list.len() as f64;
        // Systematic: one draw of each of so many equal shares of the energy, by chance within it, since grids repeat.
        let (mut drawn, mut energy) = (0, 0.0);
        let draw = |k: u32| (f64::from(k) + f64::from(hash(k)) / 4_294_967_296.0) / BY_VALUE as f64 * total;
        for (place, square) in squares.iter().enumerate() {
            energy += square;
            let before = drawn;
            while (drawn as usize) < BY_VALUE && draw(drawn) < energy {
                drawn += 1;
            }
            if drawn > before {
                probes.places.push(place);
            }
        }
        // A pair counts by the inverse of how often either draw takes it (balance heuristic; Veach 1997, section 9.2.2).
        probes.places.sort_unstable();
        probes.places.dedup();
        let chance = |place: usize| even + (BY_VALUE as f64 * squares[place] / total).min(1.0);
        probes.weights = probes.places.iter().map(|&place| 1.0 / chance(place)).collect();
        probes.pairs = probes.places.iter().map(|&place| list[place]).collect();
        probes.query = Query::new(&probes.pairs, false);
        probes
    }

    /// The same of a list that is the probes themselves.
    pub fn alone(&self) -> Self {
        Self {
            places: (0..self.pairs.len()).collect(),
            pairs: self.pairs.clone(),
            weights: self.weights.clone(),
            query: self.query.clone(),
        }
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
        let error = spread.correction() * self.relative_rms(values.iter().map(|value| (value.se, value.fbar)));
        Ok((values, error))
    }

    /// As many facets, from `first` to `most`, as bring their relative RMS error within `allowed`, or the most; with the values of the probes and the error by
    /// `exact`, the sums over so many facets.
    pub fn facets_within(
        allowed: f64,
        [first, most]: [usize; 2],
        mut exact: impl FnMut(usize) -> Result<(Vec<Value>, f64)>,
    ) -> Result<(usize, Vec<Value>, f64)> {
        let mut facets = first;
        loop {
            let (values, relative_rms) = exact(facets)?;
            let factor = SAFETY * relative_rms / allowed;
            if factor <= 1.0 || facets >= most {
                return Ok((facets, values, relative_rms));
            }
            facets = (needed(index_u32(facets), factor) as usize).max(2 * facets).min(most);
        }
    }

    /// Relative RMS difference between `exact` values of the probes and the `raw` ones of the whole list.
    pub fn relative_difference(&self, exact: &[Value], raw: &[RawValue]) -> f64 {
        self.relative_rms(exact.iter().zip(&self.places).map(|(value, &place)| {
            let fbar = fbar(&raw[place]);
            (std::array::from_fn(|c| fbar[c] - value.fbar[c]), value.fbar)
        }))
    }

    /// The relative RMS error of the `raw` values of the whole list that were made of `facets` facets of a sampler with the seed `seed`: the difference on
    /// the probes from sums over [`MORE_FACETS`] times as many others.
    pub fn measure(&self, small: &SmallScale, seed: u32, control: &Control<'_>, facets: usize, raw: &[RawValue]) -> Result<f64> {
        // Another seed scrambles the sequence in another way.
        let sampler = FacetSampler::new(small, None, hash(seed), control);
        let (exact, own) = self.exact(small, &sampler, sampler.low_discrepancy((MORE_FACETS * facets).max(LEAST_FACETS)))?;
        let difference = self.relative_difference(&exact, raw);
        // Both err independently, so the error of these sums is in the difference; no more than half of its square is taken off, which is
        // what as many facets would add.
        Ok((difference * difference - (own * own).min(0.5 * difference * difference)).sqrt())
    }

    /// Root of the weighted mean square of errors over that of values, both by channel, or of the errors where all values are 0.
    fn relative_rms(&self, probes: impl Iterator<Item = ([f64; 3], [f64; 3])>) -> f64 {
        let (mut errors, mut energy) = (0.0, 0.0);
        let square = |x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>();
        for ((error, value), weight) in probes.zip(&self.weights) {
            errors += weight * square(error);
            energy += weight * square(value);
        }
        if energy > 0.0 { (errors / energy).sqrt() } else { errors.sqrt() }
    }
}

/// The cosine-weighted BRDF of a value; 0 where nothing is visible.
fn fbar((s, av): &RawValue) -> [f64; 3] {
    if *av > 0.0 { s.map(|s| s / av) } else { [0.0; 3] }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;
    use crate::material::{Surface, Tint};
    use crate::visibility::test_tiles::flat;
    use glam::{DVec2, DVec3};

    fn plane() -> SmallScale {
        let tile = flat(DVec2::ONE, 0.0);
        let surface = Surface { part: "*".into(), brdf: Brdf::Lambert { albedo: [0.5; 3] }, tint: Tint::Uniform([1.0; 3]), line: 1 };
        SmallScale { surface_of_triangle: vec![0; tile.triangles.len()], tile, surfaces: vec![surface], bounces: 0 }
    }

    /// Pairs of 80 directions.
    fn list() -> Vec<Pair> {
        let direction = |k: u32| {
            let (sin, cos) = (2.4 * f64::from(k)).sin_cos();
            DVec3::new(cos, sin, 0.02 * f64::from(k) + 0.1).normalize()
        };
        (0..80).flat_map(|i| (0..80).map(move |o| Pair { wi: direction(i), wo: direction(o) })).collect()
    }

    #[test]
    fn a_few_bright_pairs_on_which_the_error_is_are_found() {
        let (small, list) = (plane(), list());
        // 3 of 6,400 hold 99 % of the energy and err by a tenth; the others by a half.
        let exact: Vec<f64> = (0..list.len()).map(|k| if [700, 3001, 6200].contains(&k) { 500.0 } else { 1.0 }).collect();
        let error = |e: f64| if e > 1.0 { 1.1 * e } else { 1.5 * e };
        let raw: Vec<RawValue> = exact.iter().map(|e| ([2.0 * error(*e); 3], 2.0)).collect();
        let expected = {
            let square = |x: f64| x * x;
            let errors: f64 = exact.iter().map(|e| square(error(*e) - e)).sum();
            (errors / exact.iter().map(|e| square(*e)).sum::<f64>()).sqrt()
        };
        let told = |probes: &Probes| {
            let values: Vec<Value> = probes.places.iter().map(|&k| Value { fbar: [exact[k]; 3], ..Value::default() }).collect();
            probes.relative_difference(&values, &raw)
        };
        let by_value = Probes::by_value(&small, &list, &raw);
        let without = Probes::new(&small, &list);
        assert!(by_value.pairs.len() <= without.pairs.len() + BY_VALUE, "{}", by_value.pairs.len());
        assert!((told(&by_value) / expected - 1.0).abs() < 0.02, "{} for {expected}", told(&by_value));
        assert!(told(&without) > 2.0 * expected, "without them the dark pairs are all there is");
        // Each stands for the pairs that it was drawn from.
        let of_list: f64 = by_value.weights.iter().sum();
        assert!((of_list / list.len() as f64 - 1.0).abs() < 0.1, "{of_list}");
        let dark: Vec<RawValue> = vec![([0.0; 3], 1.0); list.len()];
        assert_eq!(Probes::by_value(&small, &list, &dark).places, Probes::new(&small, &list).places);
    }

    #[test]
    fn the_error_of_values_is_measured_against_other_facets() {
        let (small, list) = (plane(), list());
        // A plane has no error of facets: what is measured is what was put in.
        let raw: Vec<RawValue> = list.iter().map(|p| ([1.03 * 0.5 / std::f64::consts::PI * p.wi.z * p.wo.z; 3], p.wo.z)).collect();
        let probes = Probes::by_value(&small, &list, &raw);
        let measured = probes.measure(&small, 7, &Control::quiet(), 256, &raw).unwrap();
        assert!((measured - 0.03).abs() < 1e-3, "{measured}");
    }
}
