//! Values and their standard errors from the sums of eight interleaved replicates of facets.
//!
//! With `S_r` and `a_r`, the `av` of each replicate, and `q = mean S / mean a`, the spread of `S_r - q a_r` gives the standard error that eight
//! independent replicates would have (`numerics.md`, section 3.6). The replicates share one low-discrepancy sequence and err less together; by how
//! much is read off the spread of pairs and of fours of them, pooled over all values: see [`Spread::correction`].

use super::query::Query;
use super::sums::PairSums;
use super::value::Value;
use crate::direction::{MIN_COSINE, Pair};
use crate::facets::REPLICATES;
use crate::simd::{self, Kernel};
use rayon::prelude::*;

/// Squared deviations, pooled over values, of eight replicates, of four pairs of replicates, and of two fours of them; and the squared values.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spread {
    groups: [f64; 3],
    energy: f64,
}

/// The value of a pair whose light's direction has z component `cos_i`, from sums over `samples` samples; its standard errors are
/// those of independent replicates. Adds to `spread`.
#[inline(always)]
pub fn value(s: &PairSums, area: &[f64; REPLICATES], samples: u32, cos_i: f64, spread: &mut Spread) -> Value {
    let scale = REPLICATES as f64 / f64::from(samples);
    let mut a = [0.0; REPLICATES];
    for r in 0..REPLICATES {
        a[r] = area[r] * scale;
    }
    let mean_a = mean(&a);
    let (inverse_a, inverse_cos) = (1.0 / mean_a, 1.0 / cos_i.max(MIN_COSINE));
    let mut value = Value { av: mean_a, ..Value::default() };
    for c in 0..3 {
        let mut own = [0.0; REPLICATES];
        for r in 0..REPLICATES {
            own[r] = s[r][c] * scale;
        }
        value.s[c] = mean(&own);
        value.s_se[c] = variances_of_mean(&own, value.s[c])[0].sqrt();
        if mean_a > 0.0 {
            let q = value.s[c] * inverse_a;
            for r in 0..REPLICATES {
                own[r] = (own[r] - q * a[r]) * inverse_a;
            }
            // Their mean is 0: q is the ratio of the means.
            let variances = variances_of_mean(&own, 0.0);
            for k in 0..3 {
                spread.groups[k] += variances[k];
            }
            spread.energy += q * q;
            value.fbar[c] = q;
            value.fhat[c] = q * inverse_cos;
            value.se[c] = variances[0].sqrt();
        }
    }
    value
}

#[inline(always)]
fn mean(sets: &[f64; REPLICATES]) -> f64 {
    simd::sum(*sets) / REPLICATES as f64
}

/// Variances of the mean of all replicates, from the spread of the replicates, of the means of neighbouring two, and of neighbouring four.
#[inline(always)]
fn variances_of_mean(sets: &[f64; REPLICATES], mean: f64) -> [f64; 3] {
    let mut ones = [0.0; REPLICATES];
    for r in 0..REPLICATES {
        ones[r] = sets[r] - mean;
    }
    let (mut twos, mut fours) = ([0.0; REPLICATES / 2], [0.0; REPLICATES / 4]);
    for r in 0..REPLICATES / 2 {
        twos[r] = 0.5 * (ones[2 * r] + ones[2 * r + 1]);
    }
    for r in 0..REPLICATES / 4 {
        fours[r] = 0.5 * (twos[2 * r] + twos[2 * r + 1]);
    }
    [variance(&ones), variance(&twos), variance(&fours)]
}

/// The variance of the mean of `N` numbers with these deviations from it.
#[inline(always)]
fn variance<const N: usize>(deviations: &[f64; N]) -> f64 {
    let mut squares = *deviations;
    for r in 0..N {
        squares[r] *= squares[r];
    }
    simd::sum(squares) * (1.0 / (N * (N - 1)) as f64)
}

impl Spread {
    /// Factor, at most 1, from the standard error of independent replicates to that of replicates that share a sequence.
    ///
    /// Were the replicates independent, groups of any size would tell the same variance of the mean. Where the error of a sequence falls
    /// faster than that of random samples, larger groups tell less. Let `b` be the slope of a line through the logarithms of the three variances
    /// against the logarithm (base 2) of the group's size, weighted by their degrees of freedom. All eight replicates are three doublings of one, so
    /// the variance falls by `exp(3 b)` and the standard error by `exp(3 b / 2)`. `b` is held between 0, that of random samples, and that of an
    /// error that falls as `samples^-.86`: noise must not promise more (`docs/numerics.md`, section 3.6).
    pub fn correction(&self) -> f64 {
        /// Degrees of freedom of eight, four and two groups.
        const WEIGHTS: [f64; 3] = [7.0, 3.0, 1.0];
        /// Change of the logarithm of the variance a doubling, beyond that of random samples: `ln(2 · 2^(-2 · .86))`.
        const STEEPEST: f64 = -0.5;
        if self.groups.iter().any(|&g| g <= 0.0) {
            return 1.0;
        }
        let y = self.groups.map(f64::ln);
        let total: f64 = WEIGHTS.iter().sum();
        let mean_x = (WEIGHTS[1] + 2.0 * WEIGHTS[2]) / total;
        let mean_y = (0..3).map(|k| WEIGHTS[k] * y[k]).sum::<f64>() / total;
        let (mut xy, mut xx) = (0.0, 0.0);
        for k in 0..3 {
            let x = k as f64 - mean_x;
            xy += WEIGHTS[k] * x * (y[k] - mean_y);
            xx += WEIGHTS[k] * x * x;
        }
        let slope = (xy / xx).clamp(STEEPEST, 0.0);
        // Three doublings from one replicate to all eight; half of it for a standard error.
        (1.5 * slope).exp()
    }

    /// Relative RMS error of the values, or the absolute one if all are 0.
    pub fn relative_rms(&self) -> f64 {
        let error = self.groups[0].sqrt() * self.correction();
        if self.energy > 0.0 { error / self.energy.sqrt() } else { error }
    }

    /// The spread of these values and others.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { groups: std::array::from_fn(|k| self.groups[k] + other.groups[k]), energy: self.energy + other.energy }
    }
}

/// Sums of some pairs, complete.
pub(super) struct CompleteSums<'a> {
    /// What the list needs.
    pub query: &'a Query,
    /// The list.
    pub list: &'a [Pair],
    /// Sums of the pairs from `first` on.
    pub sums: &'a [PairSums],
    /// Place of the first pair in [`Query::pairs`].
    pub first: usize,
    /// Sums of visible area, one a direction.
    pub areas: &'a [[f64; REPLICATES]],
    /// Samples that were summed over.
    pub samples: u32,
}

impl CompleteSums<'_> {
    /// Writes the values at the places `order` of the list, and adds to their spread.
    pub fn write(&self, order: &[u32], values: &mut [Value], spread: &mut Spread) {
        /// Values worked out at once; the same at any number of threads, as the sums of their spreads must be.
        const CHUNK: usize = 2048;
        let chunks: Vec<(Vec<Value>, Spread)> =
            order.par_chunks(CHUNK).map(|order| simd::run(Evaluate { complete: self, order })).collect();
        for (order, (chunk, of_chunk)) in order.chunks(CHUNK).zip(chunks) {
            for (&k, value) in order.iter().zip(chunk) {
                values[k as usize] = value;
            }
            *spread = spread.and(of_chunk);
        }
    }
}

struct Evaluate<'a> {
    complete: &'a CompleteSums<'a>,
    order: &'a [u32],
}

impl Kernel for Evaluate<'_> {
    type Output = (Vec<Value>, Spread);

    #[inline(always)]
    fn run(self) -> (Vec<Value>, Spread) {
        let CompleteSums { query, list, sums, first, areas, samples } = *self.complete;
        let mut spread = Spread::default();
        let mut values = Vec::with_capacity(self.order.len());
        for &k in self.order {
            let entry = query.entries[k as usize].expect("ordered places have entries");
            let area = &areas[entry.viewer as usize];
            values.push(value(&sums[entry.pair as usize - first], area, samples, list[k as usize].wi.z, &mut spread));
        }
        (values, spread)
    }
}

/// Applies [`Spread::correction`] to the standard errors of values.
pub(super) fn correct(values: &mut [Value], spread: &Spread) {
    let factor = spread.correction();
    for value in values {
        for c in 0..3 {
            value.se[c] *= factor;
            value.s_se[c] *= factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_sets_give_the_textbook_standard_error() {
        let mut sums = [[0.0; 3]; REPLICATES];
        for (r, s) in sums.iter_mut().enumerate() {
            *s = [r as f64; 3];
        }
        let mut spread = Spread::default();
        // Means 0..8 over an area of exactly 1: standard deviation of 0..8 over the root of 8.
        let value = value(&sums, &[1.0; REPLICATES], REPLICATES as u32, 1.0, &mut spread);
        assert!((value.fbar[0] - 3.5).abs() < 1e-12);
        assert!((value.se[0] - (6.0_f64 / 8.0).sqrt()).abs() < 1e-12, "{}", value.se[0]);
    }

    #[test]
    fn noise_that_area_and_sum_share_cancels() {
        let area = [1.0, 1.1, 0.9, 1.05, 0.95, 1.2, 0.8, 1.0];
        let value = value(&area.map(|a| [0.3 * a; 3]), &area, REPLICATES as u32, 1.0, &mut Spread::default());
        assert!((value.fbar[1] - 0.3).abs() < 1e-12 && value.se[1] < 1e-12, "{value:?}");
    }

    #[test]
    fn nothing_visible_is_zero_and_not_nan() {
        let value = value(&[[0.0; 3]; REPLICATES], &[0.0; REPLICATES], 2048, 0.0, &mut Spread::default());
        assert_eq!(value, Value::default());
    }

    #[test]
    fn the_correction_lies_between_random_samples_and_the_steepest_fall() {
        let spread = |groups| Spread { groups, energy: 1.0 };
        assert_eq!(spread([1.0, 1.2, 1.5]).correction(), 1.0);
        assert!((spread([1.0, 0.8, 0.64]).correction() - 0.512_f64.sqrt()).abs() < 1e-12);
        assert!((spread([1.0, 0.1, 0.01]).correction() - (-0.75_f64).exp()).abs() < 1e-12);
        assert_eq!(spread([0.0; 3]).correction(), 1.0);
    }
}
