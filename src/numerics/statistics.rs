//! Medians, ranks, quantiles and relative RMS errors: one definition of each.
//!
//! Three quantities are called "the median" or "a quantile", and they differ for short lists. Here each has its name:
//!
//! | function | of `n` sorted values `x₀ ≤ x₁ ≤ …` |
//! |---|---|
//! | [`median`] | the middle one, or the mean of the two in the middle |
//! | [`upper_median`] | `x` at `⌊n / 2⌋`: always one of the values, in linear time |
//! | [`rank`] | `x` at `⌊p (n - 1)⌋`: always one of the values, in linear time |
//! | [`quantile`] | linear between `x` at `⌊p (n - 1)⌋` and the next (Hyndman and Fan 1996, type 7) |

use super::cast::truncate_usize;
use std::cmp::Ordering;

/// A floating-point number, ordered with its NaNs at the ends.
pub trait Float: Copy {
    /// As `f64::total_cmp`.
    fn order(&self, other: &Self) -> Ordering;
}

impl Float for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Float for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

/// The middle value, or the mean of the two in the middle; `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| values[n / 2].midpoint(values[(n - 1) / 2]))
}

/// The value at `⌊n / 2⌋` of the sorted list, the upper of the two in the middle; `None` of nothing. Reorders the values.
pub fn upper_median<T: Float>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, T::order).1)
}

/// The value at `⌊share (n - 1)⌋` of the sorted list, for a `share` in `0..=1`; `None` of nothing. Reorders the values.
pub fn rank<T: Float>(values: &mut [T], share: f64) -> Option<T> {
    let last = values.len().checked_sub(1)?;
    let k = truncate_usize(last as f64 * share).min(last);
    Some(*values.select_nth_unstable_by(k, T::order).1)
}

/// The quantile for a `share` in `0..=1`, linear between the two nearest values; `None` of nothing.
pub fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let at = share * last as f64;
    let below = truncate_usize(at).min(last);
    Some(values[below] + (at - below as f64) * (values[(below + 1).min(last)] - values[below]))
}

/// The arithmetic mean; 0 of nothing.
pub fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    values.sum::<f64>() / count.max(1) as f64
}

/// The mean of values that count as their weights, `∑ w x / ∑ w`, of pairs `(x, w)`; `None` if the weights do not sum to a positive number.
pub fn weighted_mean(values: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
    let (sum, weight) = values.into_iter().fold((0.0, 0.0), |(sum, weight), (x, w)| (sum + w * x, weight + w));
    (weight > 0.0).then(|| sum / weight)
}

/// The root of the mean square; 0 of nothing.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for x in values {
        squares += x * x;
        count += 1.0;
    }
    if count > 0.0 { f64::sqrt(squares / count) } else { 0.0 }
}

/// Relative RMS error `sqrt(error / energy)` of the sum of squared errors and that of squared values; where all `count` values are 0 the
/// absolute one, `sqrt(error / count)`.
pub fn relative_rms(error: f64, energy: f64, count: usize) -> f64 {
    (error / if energy > 0.0 { energy } else { count.max(1) as f64 }).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_ranks_of_short_lists_are_as_defined() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(upper_median(&mut [4.0_f32, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(upper_median::<f64>(&mut []), None);
        assert_eq!(rank(&mut [4.0, 1.0, 3.0, 2.0], 0.5), Some(2.0));
        assert_eq!(rank(&mut [4.0, 1.0, 3.0, 2.0], 1.0), Some(4.0));
        assert_eq!(rank::<f32>(&mut [], 0.5), None);
    }

    #[test]
    fn a_quantile_lies_between_its_neighbours() {
        assert_eq!(quantile(vec![3.0, 1.0, 2.0], 0.75), Some(2.5));
        assert_eq!(quantile(vec![3.0, 1.0, 2.0], 1.0), Some(3.0));
        assert_eq!(quantile(vec![], 0.5), None);
        // The median is the quantile of one half.
        for n in 1..8 {
            let values: Vec<f64> = (0..n).map(|k| f64::from(k * k)).collect();
            assert_eq!(quantile(values.clone(), 0.5), median(values));
        }
    }

    #[test]
    fn what_is_not_a_number_comes_last() {
        assert_eq!(upper_median(&mut [f64::NAN, 1.0, 2.0]), Some(2.0));
        assert_eq!(rank(&mut [f64::NAN, 2.0, 1.0], 0.0), Some(1.0));
    }

    #[test]
    fn means_and_root_mean_squares() {
        assert_eq!(mean([1.0, 2.0, 6.0].into_iter()), 3.0);
        assert_eq!(mean([0.0; 0].into_iter()), 0.0);
        assert_eq!(weighted_mean([(1.0, 1.0), (4.0, 2.0)]), Some(3.0));
        assert_eq!(weighted_mean([(1.0, 0.0)]), None);
        assert_eq!(rms([3.0, -4.0, 0.0, 0.0]), 2.5);
        assert_eq!(rms([]), 0.0);
        assert_eq!(relative_rms(4.0, 16.0, 9), 0.5);
        assert_eq!(relative_rms(36.0, 0.0, 9), 2.0);
        assert_eq!(relative_rms(0.0, 0.0, 0), 0.0);
    }
}
