//! How far values are from the truth, whose own error is known.
//!
//! The truth is an estimate `t = f + noise` with standard errors `s`. Of values `v` with the error `e = v - f` the squared difference is
//! `sum (v - t)² = sum e² - 2 sum e noise + sum noise²`: its mean is `sum e² + sum s²`, so `s²` is taken off. What is left scatters about
//! `sum e²` by the other two terms. Within a pair the channels share their rays: their noise counts as one.

use crate::numerics::statistics::quantile;

/// The truth at some pairs, and its standard errors: `fbar`, RGB.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Values, 1/sr.
    pub value: Vec<[f64; 3]>,
    /// Standard errors.
    pub se: Vec<[f64; 3]>,
}

/// How far values are from the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Relative RMS error `sqrt(sum e² / sum t²)` over all pairs and channels, the truth's own noise taken off in squares; 0 where that
    /// is more than the whole difference. Absolute where the truth is 0 everywhere.
    pub error: f64,
    /// What the error is below with 97.7 % probability: two standard deviations of the truth's noise above it.
    pub at_most: f64,
    /// Peak signal-to-noise ratio, dB: `20 log10(largest truth / RMS difference)`, nothing taken off; infinite without a difference.
    pub psnr: f64,
    /// 95th percentile of `|v - t| / t` over the values above 1 % of the largest; 0 if there are none.
    pub p95: f64,
    /// `sum (v - t) / sum t`, over the same values.
    pub bias: f64,
}

/// Share of the largest value from which relative differences count.
const FLOOR: f64 = 0.01;

impl Truth {
    /// Relative RMS standard error, or the absolute one if all values are 0.
    pub fn relative_rms(&self) -> f64 {
        let square = |v: &Vec<[f64; 3]>| v.iter().flatten().map(|x| x * x).sum::<f64>();
        (square(&self.se) / scale(square(&self.value), self.value.len())).sqrt()
    }
}

/// What squares are divided by.
fn scale(energy: f64, pairs: usize) -> f64 {
    if energy > 0.0 { energy } else { (3 * pairs).max(1) as f64 }
}

/// The deviation of `values` from `truth`, pair by pair.
///
/// # Panics
/// If they are not of one length.
pub fn deviation(values: &[[f64; 3]], truth: &Truth) -> Deviation {
    assert!(values.len() == truth.value.len() && values.len() == truth.se.len(), "values and truth of the same pairs");
    let (mut squares, mut noise, mut variance, mut energy) = (0.0, 0.0, 0.0, 0.0);
    for ((v, t), s) in values.iter().zip(&truth.value).zip(&truth.se) {
        let (mut own, mut mixed) = (0.0, 0.0);
        for c in 0..3 {
            let d = v[c] - t[c];
            squares += d * d;
            energy += t[c] * t[c];
            own += s[c] * s[c];
            mixed += d.abs() * s[c];
        }
        noise += own;
        variance += 4.0 * mixed * mixed + 2.0 * own * own;
    }
    let scale = scale(energy, values.len());
    let excess = squares - noise;
    let peak = truth.value.iter().flatten().fold(0.0_f64, |a, &b| a.max(b));
    let rms = (squares / (3 * values.len()).max(1) as f64).sqrt();
    let counted: Vec<(f64, f64)> =
        values.iter().flatten().zip(truth.value.iter().flatten()).filter(|(_, t)| **t > FLOOR * peak).map(|(v, t)| (v - t, *t)).collect();
    let total: f64 = counted.iter().map(|c| c.1).sum();
    Deviation {
        error: (excess.max(0.0) / scale).sqrt(),
        at_most: ((excess.max(0.0) + 2.0 * variance.sqrt()) / scale).sqrt(),
        psnr: if rms > 0.0 { 20.0 * (peak / rms).log10() } else { f64::INFINITY },
        p95: quantile(counted.iter().map(|(d, t)| d.abs() / t).collect(), 0.95).unwrap_or(0.0),
        bias: if total > 0.0 { counted.iter().map(|c| c.0).sum::<f64>() / total } else { 0.0 },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::low_discrepancy::gaussian;

    #[test]
    fn the_noise_of_the_truth_is_taken_off_in_squares() {
        const PAIRS: usize = 2000;
        // Values off by 3 % at random, a truth off by 2 %.
        let noisy = |seed, k, c: usize, by: f64| 1.0 + by * gaussian(seed, (3 * k + c) as u64);
        for seed in 0..4 {
            let values: Vec<[f64; 3]> = (0..PAIRS).map(|k| std::array::from_fn(|c| noisy(2 * seed, k, c, 0.03))).collect();
            let value = (0..PAIRS).map(|k| std::array::from_fn(|c| noisy(2 * seed + 1, k, c, 0.02))).collect();
            let truth = Truth { value, se: vec![[0.02; 3]; PAIRS] };
            let d = deviation(&values, &truth);
            assert!((d.error - 0.03).abs() < 0.0012, "{d:?}");
            assert!(d.at_most > 0.03 && d.at_most < 0.034, "{d:?}");
            assert!((truth.relative_rms() - 0.02).abs() < 1e-4);
            // The truth itself cannot be told from values without error.
            let own = deviation(&vec![[1.0; 3]; PAIRS], &truth);
            assert!(own.error < 0.005 && own.at_most < 0.009, "{own:?}");
        }
    }

    #[test]
    fn psnr_percentile_and_bias_are_those_of_the_differences() {
        let truth = Truth { value: vec![[2.0, 1.0, 0.0], [1.0, 1.0, 1.0]], se: vec![[0.0; 3]; 2] };
        let d = deviation(&[[2.2, 1.1, 0.0], [1.1, 1.1, 1.1]], &truth);
        assert!((d.bias - 0.1).abs() < 1e-12 && (d.p95 - 0.1).abs() < 1e-12 && (d.error - 0.1).abs() < 1e-12, "{d:?}");
        assert!((d.at_most - d.error).abs() < 1e-12);
        let rms = f64::sqrt((0.04 + 4.0 * 0.01) / 6.0);
        assert!((d.psnr - 20.0 * (2.0 / rms).log10()).abs() < 1e-9, "{d:?}");
        assert_eq!(deviation(&truth.value, &truth).psnr, f64::INFINITY);
    }

    #[test]
    fn a_black_truth_gives_absolute_errors_and_no_nan() {
        let truth = Truth { value: vec![[0.0; 3]; 3], se: vec![[0.0; 3]; 3] };
        let d = deviation(&[[0.5; 3]; 3], &truth);
        assert!((d.error - 0.5).abs() < 1e-12 && d.p95 == 0.0 && d.bias == 0.0, "{d:?}");
        let nothing = deviation(&[], &Truth::default());
        assert_eq!((nothing.error, nothing.psnr), (0.0, f64::INFINITY));
    }
}
