//! A function of the angle to an axis as a sum of lobes about that axis: how a small-scale BRDF, as a function of the facet's normal about the half
//! vector, becomes spherical Gaussians.
//!
//! Sharpnesses stand in a geometric row from a constant to sharper than the function's peak; amplitudes are non-negative least squares, or signed ones
//! where the function falls faster than a Gaussian does. A GGX lobe is such a
//! sum by itself: `1 / (1 + x)² = ∫ t e^(-t (1 + x)) dt`, and the integral over `log t` is a sum that converges exponentially with the spacing.

use crate::numerics::linear_algebra::Cholesky;
use crate::numerics::non_negative::non_negative_least_squares;
use std::f64::consts::FRAC_PI_2;

/// Angles for each factor of 2, from [`SMALLEST_ANGLE`] of the width on.
const ANGLES_PER_OCTAVE: usize = 6;
/// Smallest angle, in widths: below it the peak is flat.
const SMALLEST_ANGLE: f64 = 0.05;
/// Least sharpness of the sharpest lobe, times the width squared. `exp(-θ²/w²)` has 2.
const SHARPEST: f64 = 8.0;
/// Least sharpness beside the constant: a lobe with half its value at 60 degrees.
const BLUNTEST: f64 = 0.5;
/// Where the energy of a ring, `θ²` times the value, is below this share of the largest, errors count as if it were that.
const NEGLIGIBLE_ENERGY: f64 = 1e-2;
/// Amplitudes below this share of the fit's largest are left out.
const NEGLIGIBLE_AMPLITUDE: f64 = 1e-9;
/// A relative error that lobes of positive amplitude need not be better than.
const GOOD: f64 = 0.01;
/// Share of the diagonal that is added where amplitudes may be negative: they stay within some hundred times the function, so that sums in f32 keep four digits.
const RIDGE: f64 = 1e-8;
/// The same of a second harmonic, of the mean of the diagonal. Chosen, not measured.
const HARMONIC_RIDGE: f64 = 1e-6;

/// A function of the angle to an axis, 0 to a right angle, never negative.
pub struct ZonalProfile<'a> {
    /// The value at an angle.
    pub value: &'a dyn Fn(f64) -> f64,
    /// Angle by which it falls to a third or so of its peak; a right angle or more for a function without peak.
    pub width: f64,
}

/// A sum of lobes about one axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ZonalFit {
    /// Sharpness and amplitude of each lobe, the bluntest first.
    pub lobes: Vec<[f64; 2]>,
    /// Root mean square of the relative error over rings of equal ratio of angles; rings that hold hardly any energy count less.
    pub relative_rms: f64,
}

/// Sharpnesses of sums, and the angles at which functions are compared with them.
#[derive(Clone, Debug)]
pub struct ZonalBasis {
    sharpness: Vec<f64>,
    /// A geometric row of angles, the largest first.
    pub angles: Vec<f64>,
}

impl ZonalBasis {
    /// For functions of a width, with sharpnesses that grow by the factor `ratio`: 2 is within 1 % of a GGX lobe everywhere, 4 within 10.
    ///
    /// # Panics
    /// If `ratio` is not above 1 or the width not positive.
    pub fn new(width: f64, ratio: f64) -> Self {
        assert!(ratio > 1.0 && width > 0.0, "ratio {ratio}, width {width}");
        let width = width.min(FRAC_PI_2);
        Self { sharpness: row_of_sharpness(width, ratio), angles: angles(width) }
    }

    /// What a relative error counts at each angle, for a function with these values: `weights` are shares of the energy of a ring that count at all.
    fn scale(&self, values: &[f64], weights: &[f64]) -> Option<Vec<f64>> {
        let weighted = || self.angles.iter().zip(values).zip(weights);
        let energy = weighted().map(|((a, v), w)| a * a * v * w).fold(0.0, f64::max);
        (energy > 0.0).then(|| weighted().map(|((a, v), w)| w / (v * w + NEGLIGIBLE_ENERGY * energy / (a * a))).collect())
    }

    /// The sum nearest to a function with these values, at least 0, at the angles.
    pub fn fit(&self, values: &[f64], weights: &[f64]) -> ZonalFit {
        let Some(scale) = self.scale(values, weights) else { return ZonalFit::default() };
        let (mut matrix, right) = self.normal_equations(values, &scale, lobe);
        let of = |amplitudes: Vec<f64>| {
            let fit = ZonalFit { lobes: self.kept(&amplitudes), relative_rms: 0.0 };
            let squares = self.angles.iter().zip(values).zip(&scale).map(|((a, v), s)| (s * (fit.eval(*a) - v)).powi(2));
            ZonalFit { relative_rms: (squares.sum::<f64>() / self.angles.len() as f64).sqrt(), ..fit }
        };
        let positive = of(non_negative_least_squares(&matrix, &right));
        if positive.relative_rms <= GOOD {
            return positive;
        }
        // What falls faster than a Gaussian is a difference of some.
        let count = self.sharpness.len();
        (0..count).for_each(|k| matrix[k * count + k] *= 1.0 + RIDGE);
        match Cholesky::new(&matrix, count).map(|cholesky| of(cholesky.solve(&right))) {
            Some(signed) if signed.relative_rms < 0.5 * positive.relative_rms => signed,
            _ => positive,
        }
    }

    /// Sharpness `l` and amplitude of each term of a second harmonic in azimuth: of the sum of `l (n_x² - n_y²) G_l(n)` nearest to `f(θ) cos 2φ`, with `f`
    /// given by its values at the angles. Errors count in relation to the zonal function that it goes with, `zonal`.
    pub fn fit_second_harmonic(&self, values: &[f64], zonal: &[f64], weights: &[f64]) -> Vec<[f64; 2]> {
        let Some(scale) = self.scale(zonal, weights) else { return Vec::new() };
        let (mut matrix, right) = self.normal_equations(values, &scale, |l, angle| l * angle.sin().powi(2) * lobe(l, angle));
        let count = self.sharpness.len();
        let trace: f64 = (0..count).map(|k| matrix[k * count + k]).sum();
        // The constant has no such term.
        (0..count).for_each(|k| matrix[k * count + k] += HARMONIC_RIDGE * trace / count as f64);
        Cholesky::new(&matrix, count).map_or_else(Vec::new, |cholesky| self.kept(&cholesky.solve(&right)))
    }

    /// Normal equations of a sum of `term(sharpness, angle)`, each row scaled.
    fn normal_equations(&self, values: &[f64], scale: &[f64], term: impl Fn(f64, f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let count = self.sharpness.len();
        let (mut matrix, mut right) = (vec![0.0; count * count], vec![0.0; count]);
        for ((angle, value), scale) in self.angles.iter().zip(values).zip(scale) {
            let row: Vec<f64> = self.sharpness.iter().map(|&l| scale * term(l, *angle)).collect();
            for i in 0..count {
                right[i] += row[i] * value * scale;
                for j in 0..count {
                    matrix[i * count + j] += row[i] * row[j];
                }
            }
        }
        (matrix, right)
    }

    /// Sharpnesses and amplitudes that count.
    fn kept(&self, amplitudes: &[f64]) -> Vec<[f64; 2]> {
        let largest = amplitudes.iter().map(|a| a.abs()).fold(0.0, f64::max);
        let terms = self.sharpness.iter().zip(amplitudes);
        terms.filter(|(_, a)| a.abs() > NEGLIGIBLE_AMPLITUDE * largest).map(|(&l, &a)| [l, a]).collect()
    }
}

impl ZonalFit {
    /// The fit whose sharpnesses grow by the factor `ratio`, as [`ZonalBasis::new`] has it.
    pub fn new(profile: &ZonalProfile<'_>, ratio: f64) -> Self {
        let basis = ZonalBasis::new(profile.width, ratio);
        let values: Vec<f64> = basis.angles.iter().map(|&a| (profile.value)(a).max(0.0)).collect();
        basis.fit(&values, &vec![1.0; values.len()])
    }

    /// The value at an angle.
    pub fn eval(&self, angle: f64) -> f64 {
        self.lobes.iter().map(|&[l, a]| a * lobe(l, angle)).sum()
    }
}

/// `exp(l (cos θ - 1))`.
fn lobe(sharpness: f64, angle: f64) -> f64 {
    (-2.0 * sharpness * (0.5 * angle).sin().powi(2)).exp()
}

/// 0, and the powers of the ratio from the bluntest to the sharpest: sums of all widths share them, so that integrals with them can be kept.
fn row_of_sharpness(width: f64, ratio: f64) -> Vec<f64> {
    let power = |value: f64| value.ln() / ratio.ln();
    // A power that is whole but for rounding is that one.
    let last = (power(SHARPEST / (width * width)) - 1e-9).ceil();
    let powers = std::iter::successors(Some((power(BLUNTEST) + 1e-9).ceil()), |k| Some(k + 1.0)).take_while(|k| *k <= last);
    std::iter::once(0.0).chain(powers.map(|k| ratio.powf(k))).collect()
}

/// A geometric row of angles up to nearly a right angle, where most functions end.
fn angles(width: f64) -> Vec<f64> {
    let step = 2.0_f64.powf(-1.0 / ANGLES_PER_OCTAVE as f64);
    std::iter::successors(Some(0.95 * FRAC_PI_2), |a| Some(a * step)).take_while(|a| *a > SMALLEST_ANGLE * width).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ggx(alpha: f64) -> impl Fn(f64) -> f64 {
        move |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let root = cos * cos * alpha * alpha + sin * sin;
            (alpha * alpha / root).powi(2)
        }
    }

    #[test]
    fn a_ggx_lobe_is_a_sum_of_lobes_at_any_roughness() {
        for alpha in [0.001, 0.05, 0.3, 0.9] {
            let value = ggx(alpha);
            for (ratio, allowed) in [(2.0, 0.01), (3.0, 0.05), (4.0, 0.1)] {
                let fit = ZonalFit::new(&ZonalProfile { value: &value, width: alpha }, ratio);
                assert!(fit.relative_rms < allowed, "alpha {alpha}, ratio {ratio}: {fit:?}");
            }
        }
    }

    #[test]
    fn a_second_harmonic_comes_back() {
        let basis = ZonalBasis::new(0.05, 2.0);
        // Half of a GGX lobe a few widths away, none of it at the axis.
        let zonal: Vec<f64> = basis.angles.iter().map(|&a| ggx(0.05)(a)).collect();
        let values: Vec<f64> = basis.angles.iter().zip(&zonal).map(|(a, v)| 0.5 * v * a.sin().powi(2) / (a.sin().powi(2) + 0.01)).collect();
        let terms = basis.fit_second_harmonic(&values, &zonal, &vec![1.0; zonal.len()]);
        for ((angle, expected), zonal) in basis.angles.iter().zip(&values).zip(&zonal).filter(|((a, _), _)| **a < 1.0) {
            let got: f64 = terms.iter().map(|&[l, a]| a * l * angle.sin().powi(2) * lobe(l, *angle)).sum();
            assert!((got - expected).abs() < 0.1 * zonal, "{angle}: {got} for {expected} beside {zonal}");
        }
        assert!(basis.fit_second_harmonic(&vec![0.0; values.len()], &zonal, &vec![1.0; values.len()]).is_empty());
    }

    #[test]
    fn cosine_powers_beckmann_lobes_and_constants_come_back() {
        for (exponent, allowed) in [(5.0, 0.05), (20.0, 0.03), (512.0, 0.03), (1e4, 0.03)] {
            let value = |angle: f64| angle.cos().max(0.0).powf(exponent);
            let fit = ZonalFit::new(&ZonalProfile { value: &value, width: (2.0_f64 / exponent).sqrt() }, 2.0);
            assert!(fit.relative_rms < allowed && (fit.eval(0.0) - 1.0).abs() < allowed, "{exponent}: {fit:?}");
        }
        for alpha in [0.02, 0.2, 0.5_f64] {
            let value = |angle: f64| (-(angle.tan() / alpha).powi(2)).exp() / angle.cos().powi(4);
            let fit = ZonalFit::new(&ZonalProfile { value: &value, width: alpha }, 2.0);
            let largest = fit.lobes.iter().map(|l| l[1].abs()).fold(0.0, f64::max);
            assert!(fit.relative_rms < 0.1 && largest < 300.0, "Beckmann {alpha}: {fit:?}");
        }
        let fit = ZonalFit::new(&ZonalProfile { value: &|_| 0.25, width: 2.0 }, 2.0);
        assert!(fit.relative_rms < 1e-6 && (fit.eval(0.7) - 0.25).abs() < 1e-6, "{fit:?}");
        assert_eq!(ZonalFit::new(&ZonalProfile { value: &|_| 0.0, width: 0.1 }, 2.0), ZonalFit::default());
    }
}
