//! A density of directions as a sum of lobes: a von Mises-Fisher mixture by expectation maximisation on the sphere (Banerjee et al. 2005; Han et al.
//! 2007), made to work where directions are few, equal, or all over the sphere.
//!
//! The start is deterministic (k-means on the directions), the likelihood is summed with log-sum-exp, and `1 - R` of a lobe is the mean of `|n - x|² / 2`: from
//! the length of a mean it cancels, and a sharpness of 1e7 comes out negative in f32.

use crate::numerics::clustering::{Weighted, k_means};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Largest sharpness of a lobe: that of directions that are all the same.
pub const MAX_SHARPNESS: f64 = 1e8;
/// Most rounds, for lobes that creep on while the likelihood hardly grows. Chosen, not measured.
const ROUNDS: usize = 100;
/// Most looks at a direction by a lobe, of all rounds together: many lobes, which k-means has placed well, have fewer rounds.
const LOOKS: usize = 1 << 24;
/// A round that raises the mean log likelihood by less ends the search: a share of 1e-6 of the density.
const SETTLED: f64 = 1e-6;
/// Lobes with a smaller share of the weight are dropped.
const LEAST_SHARE: f64 = 1e-9;
/// Two lobes are one if their sharpness differs by less than this factor
const MERGED_RATIO: f64 = 1.1;
/// and their axes by less than this, in standard deviations of a lobe squared.
const MERGED_DISTANCE: f64 = 1e-2;
/// Directions of a chunk of the sums, which are added up in the order of the chunks.
const CHUNK: usize = 512;
/// A term that is smaller than the largest by this factor's exponential adds nothing to a sum of f64.
const NEGLIGIBLE: f64 = -40.0;

/// A direction, and how much it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedDirection {
    /// Unit vector.
    pub direction: DVec3,
    /// Weight; what does not weigh more than 0 is left out.
    pub weight: f64,
}

/// One lobe of a mixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MixtureLobe {
    /// Unit axis.
    pub axis: DVec3,
    /// Sharpness, 0 to [`MAX_SHARPNESS`].
    pub sharpness: f64,
    /// Share of the weight; those of a mixture add up to 1.
    pub share: f64,
}

/// Lobes whose weighted densities add up to one density.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mixture {
    /// The lobes, the largest share first.
    pub lobes: Vec<MixtureLobe>,
}

/// How many lobes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// So many, or as many as there are distinct directions.
    Fixed(usize),
    /// The power of two up to `most` with the smallest Bayesian information criterion (Schwarz 1978): `(4 J - 1) ln N - 2 N` times the mean log
    /// likelihood, for `N` distinct directions.
    Criterion {
        /// Most lobes.
        most: usize,
    },
}

impl MixtureLobe {
    /// Logarithm of the lobe's density, 1/sr, at a squared distance `d2` from its axis.
    fn log_density(&self, d2: f64) -> f64 {
        let k = self.sharpness;
        // ln (k / (2 pi (1 - e^(-2k)))), which is 1 / (4 pi) at 0.
        let normalisation = if k < 1e-8 { (1.0 / (4.0 * PI)).ln() } else { (k / (2.0 * PI)).ln() - (-(-2.0 * k).exp_m1()).ln() };
        normalisation - 0.5 * k * d2
    }
}

impl Mixture {
    /// The mixture of some directions, which are distinct (see [`distinct`]). Without any it has no lobe; with one, one lobe of [`MAX_SHARPNESS`].
    pub fn fit(directions: &[WeightedDirection], order: Order) -> Self {
        match order {
            Order::Fixed(lobes) => Self::of_order(directions, lobes),
            Order::Criterion { most } => {
                let count = directions.len() as f64;
                let criterion =
                    |m: &Self| (4.0 * m.lobes.len() as f64 - 1.0) * count.ln() - 2.0 * count * m.mean_log_likelihood(directions);
                let orders = std::iter::successors(Some(1_usize), |j| Some(2 * j)).take_while(|&j| j <= most.max(1));
                let mixtures: Vec<Self> = orders.map(|lobes| Self::of_order(directions, lobes)).collect();
                mixtures.into_iter().min_by(|a, b| criterion(a).total_cmp(&criterion(b))).unwrap_or_default()
            }
        }
    }

    /// The same with at most so many lobes.
    fn of_order(directions: &[WeightedDirection], lobes: usize) -> Self {
        if directions.is_empty() {
            return Self::default();
        }
        let mut mixture = Self::start(directions, lobes);
        let mut before = f64::NEG_INFINITY;
        for _ in 0..ROUNDS.min(LOOKS / (directions.len() * mixture.lobes.len()).max(1)).max(1) {
            let (next, log_likelihood) = mixture.improved(directions);
            if next.lobes.is_empty() {
                break;
            }
            mixture = next;
            if log_likelihood - before < SETTLED {
                break;
            }
            before = log_likelihood;
        }
        mixture.merge();
        mixture.lobes.sort_by(|a, b| b.share.total_cmp(&a.share));
        mixture
    }

    /// Lobes of clusters.
    fn start(directions: &[WeightedDirection], lobes: usize) -> Self {
        let points: Vec<Weighted<3>> = directions.iter().map(|d| Weighted { point: d.direction.to_array(), weight: d.weight }).collect();
        let (labels, count) = k_means(&points, lobes.clamp(1, directions.len().max(1)));
        let mut moments = vec![Moments::default(); count];
        for (d, label) in directions.iter().zip(&labels) {
            if let Some(label) = label {
                moments[*label].add(d.direction, d.weight);
            }
        }
        for moment in &mut moments {
            moment.fix_axis();
        }
        for (d, label) in directions.iter().zip(&labels) {
            if let Some(label) = label {
                moments[*label].add_spread(d.direction, d.weight);
            }
        }
        Self::of_moments(&moments)
    }

    fn of_moments(moments: &[Moments]) -> Self {
        let total: f64 = moments.iter().map(|m| m.weight).sum();
        let lobes = moments.iter().filter(|m| m.weight > LEAST_SHARE * total).map(|m| m.lobe(total)).collect();
        Self { lobes }
    }

    /// One round: the expectation of what each lobe has of each direction, the lobes that make these most likely, and the mean log likelihood before.
    fn improved(&self, directions: &[WeightedDirection]) -> (Self, f64) {
        let terms = self.weighted();
        // What each lobe has of each direction, a row a direction.
        let count = self.lobes.len();
        let mut shares = vec![0.0; count * directions.len()];
        let parts: Vec<(Vec<Moments>, f64)> = shares
            .par_chunks_mut(count * CHUNK)
            .zip(directions.par_chunks(CHUNK))
            .map(|(rows, chunk)| {
                let (mut moments, mut log_likelihood) = (vec![Moments::default(); count], 0.0);
                for (row, d) in rows.chunks_exact_mut(count).zip(chunk) {
                    log_likelihood += d.weight * terms.responsibilities(d.direction, row);
                    moments.iter_mut().zip(&*row).for_each(|(m, share)| m.add(d.direction, share * d.weight));
                }
                (moments, log_likelihood)
            })
            .collect();
        let mut moments = vec![Moments::default(); count];
        let mut log_likelihood = 0.0;
        for (part, part_likelihood) in parts {
            moments.iter_mut().zip(&part).for_each(|(sum, m)| sum.unite(m));
            log_likelihood += part_likelihood;
        }
        moments.iter_mut().for_each(Moments::fix_axis);
        let spreads: Vec<Vec<f64>> = shares
            .par_chunks(count * CHUNK)
            .zip(directions.par_chunks(CHUNK))
            .map(|(rows, chunk)| {
                let mut part = moments.clone();
                part.iter_mut().for_each(|m| m.spread = 0.0);
                for (row, d) in rows.chunks_exact(count).zip(chunk) {
                    part.iter_mut().zip(row).for_each(|(m, share)| m.add_spread(d.direction, share * d.weight));
                }
                part.iter().map(|m| m.spread).collect()
            })
            .collect();
        for spread in spreads {
            moments.iter_mut().zip(spread).for_each(|(m, s)| m.spread += s);
        }
        let total: f64 = directions.iter().map(|d| d.weight).sum();
        (Self::of_moments(&moments), log_likelihood / total)
    }

    /// Unites lobes that nothing tells apart: their Gram matrix would be singular.
    fn merge(&mut self) {
        let alike = |a: &MixtureLobe, b: &MixtureLobe| {
            let (low, high) = (a.sharpness.min(b.sharpness), a.sharpness.max(b.sharpness));
            high <= MERGED_RATIO * low + 1e-3 && low * a.axis.distance_squared(b.axis) < MERGED_DISTANCE
        };
        let mut k = 0;
        while k < self.lobes.len() {
            let Some(other) = (k + 1..self.lobes.len()).find(|&j| alike(&self.lobes[k], &self.lobes[j])) else {
                k += 1;
                continue;
            };
            let (a, b) = (self.lobes[k], self.lobes.remove(other));
            let share = a.share + b.share;
            let axis = (a.axis * a.share + b.axis * b.share).try_normalize().unwrap_or(a.axis);
            self.lobes[k] = MixtureLobe { axis, sharpness: (a.sharpness * a.share + b.sharpness * b.share) / share, share };
        }
    }

    /// Mean log likelihood of some directions.
    pub fn mean_log_likelihood(&self, directions: &[WeightedDirection]) -> f64 {
        let terms = self.weighted();
        let mut row = vec![0.0; self.lobes.len()];
        let total: f64 = directions.iter().map(|d| d.weight).sum();
        directions.iter().map(|d| d.weight * terms.responsibilities(d.direction, &mut row)).sum::<f64>() / total
    }

    /// Its lobes with what responsibilities need, for many directions.
    pub fn weighted(&self) -> WeightedLobes<'_> {
        WeightedLobes { lobes: &self.lobes, at_axis: self.lobes.iter().map(|l| l.share.ln() + l.log_density(0.0)).collect() }
    }
}

/// Lobes with the logarithm of each one's weighted density at its axis.
pub struct WeightedLobes<'a> {
    lobes: &'a [MixtureLobe],
    at_axis: Vec<f64>,
}

impl WeightedLobes<'_> {
    /// Writes the share that each lobe has of a direction, which add up to 1, and gives the log likelihood of the direction.
    pub fn responsibilities(&self, direction: DVec3, shares: &mut [f64]) -> f64 {
        for ((share, lobe), at_axis) in shares.iter_mut().zip(self.lobes).zip(&self.at_axis) {
            *share = at_axis - 0.5 * lobe.sharpness * direction.distance_squared(lobe.axis);
        }
        let largest = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut sum = 0.0;
        for share in &mut *shares {
            let below = *share - largest;
            *share = if below > NEGLIGIBLE { below.exp() } else { 0.0 };
            sum += *share;
        }
        shares.iter_mut().for_each(|share| *share /= sum);
        largest + sum.ln()
    }
}

/// Weighted moments of some directions.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    weight: f64,
    sum: DVec3,
    /// Unit vector of `sum`, once that is complete.
    axis: DVec3,
    /// Weighted sum of `|n - axis|² / 2`: the weight times `1 - R`.
    spread: f64,
}

impl Moments {
    fn add(&mut self, direction: DVec3, weight: f64) {
        self.weight += weight;
        self.sum += weight * direction;
    }

    fn unite(&mut self, other: &Self) {
        self.weight += other.weight;
        self.sum += other.sum;
    }

    fn fix_axis(&mut self) {
        // Directions that cancel have no mean: their lobe is a constant.
        self.axis = self.sum.try_normalize().unwrap_or(DVec3::Z);
    }

    fn add_spread(&mut self, direction: DVec3, weight: f64) {
        self.spread += 0.5 * weight * direction.distance_squared(self.axis);
    }

    fn lobe(&self, total: f64) -> MixtureLobe {
        MixtureLobe { axis: self.axis, sharpness: sharpness_of(self.spread / self.weight), share: self.weight / total }
    }
}

/// The sharpness `k` of a lobe whose directions have a mean of length `R = 1 - q`: the root of `coth k - 1/k = R`.
fn sharpness_of(q: f64) -> f64 {
    /// From here on `coth k` is 1 to the last bit, so that `k = 1 / q`.
    const COTH_IS_ONE: f64 = 20.0;
    if q <= 1.0 / COTH_IS_ONE {
        return (1.0 / q.max(1.0 / MAX_SHARPNESS)).min(MAX_SHARPNESS);
    }
    let mean = (1.0 - q).max(0.0);
    // Within 5 % (Banerjee et al. 2005, eq. 4.4); two steps of Newton's method make that 6e-6.
    let mut k = mean * (3.0 - mean * mean) / (1.0 - mean * mean);
    for _ in 0..2 {
        // The series, where both terms of coth k - 1/k are large and nearly equal.
        let (value, slope) = if k < 0.05 {
            (k / 3.0 - k.powi(3) / 45.0, 1.0 / 3.0 - k * k / 15.0)
        } else {
            let coth = 1.0 / k.tanh();
            (coth - 1.0 / k, 1.0 - coth * coth + 1.0 / (k * k))
        };
        k = (k - (value - mean) / slope).max(0.0);
    }
    k
}

/// The directions that weigh something, equal ones united, in the order in which they first occur.
pub fn distinct(directions: &[WeightedDirection]) -> Vec<WeightedDirection> {
    let mut places = rustc_hash::FxHashMap::default();
    let mut distinct: Vec<WeightedDirection> = Vec::new();
    for d in directions.iter().filter(|d| d.weight > 0.0 && d.direction.is_finite()) {
        let key = (d.direction + DVec3::ZERO).to_array().map(f64::to_bits);
        let place = *places.entry(key).or_insert(distinct.len());
        match distinct.get_mut(place) {
            Some(known) => known.weight += d.weight,
            None => distinct.push(*d),
        }
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::Random;
    use proptest::prelude::*;

    /// Draws from a von Mises-Fisher density (Wood 1994; exact inversion in three dimensions).
    fn draw(random: &mut Random, axis: DVec3, sharpness: f64) -> DVec3 {
        let u = random.unit();
        // 1 - cos, which does not cancel for sharp lobes.
        let versine = if sharpness > 0.0 { -(u + (1.0 - u) * (-2.0 * sharpness).exp()).ln() / sharpness } else { 2.0 * u };
        let angle = 2.0 * PI * random.unit();
        let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
        let (x, y) = axis.any_orthonormal_pair();
        (axis * (1.0 - versine) + sin * (angle.cos() * x + angle.sin() * y)).normalize()
    }

    fn planted(lobes: &[MixtureLobe], count: usize, seed: u64) -> Vec<WeightedDirection> {
        let mut random = Random::new(seed);
        let of = |lobe: &MixtureLobe| -> Vec<WeightedDirection> {
            (0..count).map(|_| WeightedDirection { direction: draw(&mut random, lobe.axis, lobe.sharpness), weight: lobe.share }).collect()
        };
        lobes.iter().flat_map(of).collect()
    }

    fn lobe(axis: [f64; 3], sharpness: f64, share: f64) -> MixtureLobe {
        MixtureLobe { axis: DVec3::from(axis).normalize(), sharpness, share }
    }

    fn fit(directions: &[WeightedDirection], order: Order) -> Mixture {
        Mixture::fit(&distinct(directions), order)
    }

    #[test]
    fn planted_mixtures_come_back() {
        for sharpness in [1.0, 10.0, 100.0, 1e4, 1e5, 1e7] {
            let truth = [lobe([0.0, 0.0, 1.0], sharpness, 1.0)];
            let found = fit(&planted(&truth, 4000, 1), Order::Fixed(1)).lobes[0];
            // Standard deviation of the estimate: 1.6 % of the sharpness for sharp lobes, 4 % at 1.
            assert!((found.sharpness / sharpness - 1.0).abs() < 0.08, "{sharpness}: {found:?}");
            assert!(found.axis.distance(DVec3::Z) < 4.0 / (4000.0 * sharpness).sqrt(), "{sharpness}: {found:?}");
        }
        for sharpness in [30.0, 1e3, 1e7] {
            let truth = [
                lobe([0.0, 0.0, 1.0], sharpness, 0.5),
                lobe([1.0, 0.0, 1.0], 2.0 * sharpness, 0.3),
                lobe([0.0, -1.0, 0.5], sharpness, 0.2),
            ];
            let found = fit(&planted(&truth, 3000, 7), Order::Fixed(3));
            for (f, t) in found.lobes.iter().zip(truth) {
                assert!((f.share - t.share).abs() < 0.02 && (f.sharpness / t.sharpness - 1.0).abs() < 0.15, "{sharpness}: {found:?}");
                assert!(f.axis.distance(t.axis) < 0.1 / sharpness.sqrt(), "{sharpness}: {found:?}");
            }
        }
    }

    #[test]
    fn the_criterion_finds_as_many_lobes_as_there_are() {
        let truth = [lobe([0.0, 0.0, 1.0], 200.0, 0.5), lobe([1.0, 0.0, 1.0], 200.0, 0.5)];
        let found = fit(&planted(&truth, 2000, 3), Order::Criterion { most: 16 });
        assert_eq!(found.lobes.len(), 2, "{found:?}");
        // A flat surface, a pyramid.
        let flat = vec![WeightedDirection { direction: DVec3::Z, weight: 0.1 }; 10];
        assert_eq!(fit(&flat, Order::Criterion { most: 8 }).lobes, [lobe([0.0, 0.0, 1.0], MAX_SHARPNESS, 1.0)]);
        let sides = [[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]];
        let pyramid: Vec<_> = sides.iter().map(|s| WeightedDirection { direction: DVec3::from(*s).normalize(), weight: 2.0 }).collect();
        for order in [Order::Criterion { most: 16 }, Order::Fixed(8), Order::Fixed(4)] {
            let found = fit(&pyramid, order);
            assert_eq!(found.lobes.len(), 4, "{found:?}");
            assert!(found.lobes.iter().all(|l| l.sharpness > 0.99 * MAX_SHARPNESS && (l.share - 0.25).abs() < 1e-12), "{found:?}");
        }
    }

    #[test]
    fn directions_all_over_the_sphere_are_a_constant_and_none_are_no_lobe() {
        let all = planted(&[lobe([0.0, 0.0, 1.0], 0.0, 1.0)], 4000, 5);
        let found = fit(&all, Order::Fixed(1)).lobes[0];
        // The mean of 4,000 directions is about 1 / sqrt(4000) long, and the sharpness three times that.
        assert!(found.sharpness < 0.15, "{found:?}");
        assert_eq!(fit(&[], Order::Fixed(3)).lobes, []);
        assert_eq!(fit(&[WeightedDirection { direction: DVec3::Z, weight: 0.0 }], Order::Criterion { most: 4 }).lobes, []);
    }

    #[test]
    fn sharpness_solves_its_equation() {
        for k in [1e-3, 0.02, 0.3, 1.0, 5.0, 12.0, 19.0, 21.0, 1e3] {
            let q = 1.0 - (1.0 / f64::tanh(k) - 1.0 / k);
            // For small k the equation itself cancels.
            assert!((sharpness_of(q) / k - 1.0).abs() < 2e-5, "{k}: {}", sharpness_of(q));
        }
        assert_eq!([sharpness_of(1.0), sharpness_of(1.5), sharpness_of(0.0)], [0.0, 0.0, MAX_SHARPNESS]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn no_lobe_is_empty_or_not_a_number(
            points in prop::collection::vec((-1.0_f64..1.0, -1.0_f64..1.0, -1.0_f64..1.0, 0.0_f64..2.0), 1..60),
            copies in 1_usize..4,
            order in 1_usize..20,
        ) {
            let directions: Vec<WeightedDirection> = points
                .iter()
                .filter_map(|&(x, y, z, weight)| Some(WeightedDirection { direction: DVec3::new(x, y, z).try_normalize()?, weight }))
                .flat_map(|d| std::iter::repeat_n(d, copies))
                .collect();
            for order in [Order::Fixed(order), Order::Criterion { most: order }] {
                let found = fit(&directions, order);
                prop_assert!(found.lobes.len() <= 20);
                for l in &found.lobes {
                    prop_assert!(l.axis.is_normalized() && (0.0..=MAX_SHARPNESS).contains(&l.sharpness) && l.share > 0.0, "{:?}", found);
                }
                let total: f64 = found.lobes.iter().map(|l| l.share).sum();
                let weighs = directions.iter().any(|d| d.weight > 0.0);
                prop_assert!(!weighs && found.lobes.is_empty() || (total - 1.0).abs() < 1e-6, "{:?}", found);
                let mut shares = vec![0.0; found.lobes.len()];
                for d in &directions {
                    found.weighted().responsibilities(d.direction, &mut shares);
                    let sum: f64 = shares.iter().sum();
                    prop_assert!(found.lobes.is_empty() || (sum - 1.0).abs() < 1e-12, "{sum}");
                }
            }
        }
    }
}
