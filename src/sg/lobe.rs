//! One lobe, in f32: stable from sharpness 0 to 1e8 at any argument.
//!
//! `w·x - 1` cancels where a sharp lobe has its value, so it is taken from `|w - x|² / 2`; `sinh` of eq. 4 and 10 overflows from a sharpness of 44 on, so the
//! integral of a product is written with `g(x) = (e^x - 1) / x` of a number that is never positive (`docs/numerics.md`, section 4).

use glam::Vec3;
use std::f32::consts::PI;

/// `amplitude · exp(sharpness (w·axis - 1))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Unit axis.
    pub axis: Vec3,
    /// Sharpness, 0 (a constant) to 1e8.
    pub sharpness: f32,
    /// Value at the axis.
    pub amplitude: f32,
}

impl Lobe {
    /// The lobe with an integral of 1 over the sphere: a von Mises-Fisher density, 1/sr.
    pub fn density(axis: Vec3, sharpness: f32) -> Self {
        Self { axis, sharpness, amplitude: 1.0 / (4.0 * PI * g(-2.0 * sharpness)) }
    }

    /// The value towards a unit direction.
    pub fn eval(&self, w: Vec3) -> f32 {
        self.amplitude * (-0.5 * self.sharpness * w.distance_squared(self.axis)).exp()
    }

    /// The integral over the sphere, `2 pi a (1 - e^(-2 l)) / l` (eq. 9).
    pub fn integral(&self) -> f32 {
        4.0 * PI * self.amplitude * g(-2.0 * self.sharpness)
    }

    /// The product of two lobes, which is a lobe.
    pub fn product(&self, other: &Self) -> Self {
        let sum = self.sharpness * self.axis + other.sharpness * other.axis;
        let sharpness = sum.length();
        // Two constants, or opposite lobes of equal sharpness: any axis does.
        let axis = sum.try_normalize().unwrap_or(self.axis);
        Self { axis, sharpness, amplitude: self.amplitude * other.amplitude * self.overlap(other, sharpness) }
    }

    /// `∫ G1 G2 dw` over the sphere (eq. 4 and 11), relative error below 1e-5.
    pub fn product_integral(&self, other: &Self) -> f32 {
        let d2 = self.axis.distance_squared(other.axis);
        self.amplitude * other.amplitude * integral_of_product(self.sharpness, other.sharpness, d2)
    }

    /// The same as one lobe in the other's axis (eq. 14): a model, exact where the axes meet. Its largest error is 1.2 % of the peak where both have a
    /// sharpness of 10, and .04 % for 40 and 512.
    ///
    /// The amplitude is the exact integral where the axes meet, which is eq. 14 for sharp lobes and stays finite for constants.
    pub fn product_closure(&self, other: &Self) -> Self {
        let sum = self.sharpness + other.sharpness;
        // Not l1 l2 / (l1 + l2), which is 0 / 0 for two constants.
        let sharpness = if sum > 0.0 { self.sharpness * (other.sharpness / sum) } else { 0.0 };
        Self { axis: other.axis, sharpness, amplitude: 4.0 * PI * self.amplitude * other.amplitude * g(-2.0 * sum) }
    }

    /// `exp(L - l1 - l2)`, for the length `L` of the sum of the axes times their sharpness.
    fn overlap(&self, other: &Self, length: f32) -> f32 {
        let sum = self.sharpness + other.sharpness + length;
        if sum > 0.0 { (-(self.sharpness * (other.sharpness / sum)) * self.axis.distance_squared(other.axis)).exp() } else { 1.0 }
    }
}

/// `∫ G1 G2 dw` of lobes with amplitude 1, sharpness `l1` and `l2`, and axes a squared distance `d2` apart:
///
/// ```text
/// 4 pi exp(-l1 l2 d2 / (L + l1 + l2)) g(-2 L),   L² = (l1 + l2)² - l1 l2 d2
/// ```
#[inline(always)]
pub fn integral_of_product(l1: f32, l2: f32, d2: f32) -> f32 {
    let sum = l1 + l2;
    if sum <= 0.0 {
        return 4.0 * PI;
    }
    let reduced = l1 * (l2 / sum);
    let length = sum * (1.0 - (reduced / sum) * d2).max(0.0).sqrt();
    4.0 * PI * (-reduced * d2 * (sum / (length + sum))).exp() * g(-2.0 * length)
}

/// `(e^x - 1) / x`, 1 at 0, for `x <= 0`.
#[inline(always)]
pub(super) fn g(x: f32) -> f32 {
    /// Below this `e^x` is nothing beside 1.
    const END_OF_EXP: f32 = -20.0;
    if x < END_OF_EXP {
        -1.0 / x
    } else if x < 0.0 {
        x.exp_m1() / x
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lobe(axis: [f32; 3], sharpness: f32) -> Lobe {
        Lobe { axis: Vec3::from(axis).normalize(), sharpness, amplitude: 1.0 }
    }

    /// Sharpness 0, and 1e-8 to 1e8.
    fn sharpnesses() -> impl Iterator<Item = f32> {
        std::iter::once(0.0).chain((-16_i16..=16).map(|k| 10_f32.powf(0.5 * f32::from(k))))
    }

    fn axes() -> [Lobe; 8] {
        [
            [0.0, 0.0, 1.0],
            [1e-4, 0.0, 1.0],
            [0.01, 0.02, 1.0],
            [0.3, -0.2, 1.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, -1.0],
            [1e-3, 0.0, -1.0],
            [0.0, 0.0, -1.0],
        ]
        .map(|axis| lobe(axis, 1.0))
    }

    #[test]
    fn no_value_is_negative_or_not_finite() {
        for l1 in sharpnesses() {
            for l2 in sharpnesses() {
                for (a, b) in axes().iter().flat_map(|a| axes().map(|b| (*a, b))) {
                    let (a, b) = (Lobe { sharpness: l1, ..a }, Lobe { sharpness: l2, ..b });
                    let product = a.product(&b);
                    let closure = a.product_closure(&b);
                    let numbers = [
                        a.eval(b.axis),
                        a.integral(),
                        a.product_integral(&b),
                        product.amplitude,
                        product.sharpness,
                        product.integral(),
                        closure.amplitude,
                        closure.sharpness,
                        closure.eval(a.axis),
                        Lobe::density(a.axis, l1).amplitude,
                    ];
                    assert!(numbers.iter().all(|x| x.is_finite() && *x >= 0.0), "{a:?} and {b:?}: {numbers:?}");
                    assert!(product.axis.is_normalized(), "{a:?} and {b:?}: axis {}", product.axis);
                }
            }
        }
    }

    #[test]
    fn the_integral_of_a_product_is_that_of_the_reference() {
        // Made with 60 digits by tests/data/spherical_gaussians.py.
        let table = include_str!("../../tests/data/spherical_gaussians.csv");
        let mut worst = 0.0_f64;
        let rows = table.lines().filter(|l| !l.starts_with('#')).skip(1);
        for row in rows.clone() {
            let numbers: Vec<f64> = row.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect();
            let [l1, l2, x1, y1, z1, x2, y2, z2, expected] = numbers[..] else { panic!("{row}") };
            #[expect(clippy::cast_possible_truncation, reason = "the numbers of the table are f32")]
            let of = |l: f64, axis: [f64; 3]| Lobe { axis: Vec3::from(axis.map(|v| v as f32)), sharpness: l as f32, amplitude: 1.0 };
            let (a, b) = (of(l1, [x1, y1, z1]), of(l2, [x2, y2, z2]));
            for got in [a.product_integral(&b), b.product_integral(&a)] {
                let got = f64::from(got);
                if expected < f64::from(f32::MIN_POSITIVE) {
                    assert!(got <= f64::from(f32::MIN_POSITIVE), "{row}: {got}");
                    continue;
                }
                worst = worst.max((got / expected - 1.0).abs());
            }
        }
        assert!(rows.count() > 1000 && worst < 1e-5, "worst relative error {worst:e}");
    }

    #[test]
    fn the_closure_errs_as_it_says() {
        // Shares of the peak, by docs/numerics.md, section 4.
        for (l1, l2, allowed) in [(10.0, 10.0, 0.0125), (40.0, 512.0, 0.0005), (1e4, 1e6, 1e-5)] {
            let peak = lobe([0.0, 0.0, 1.0], l1).product_integral(&lobe([0.0, 0.0, 1.0], l2));
            let worst = (0..=180_u8)
                .map(|degrees| {
                    let angle = f32::from(degrees).to_radians();
                    let (a, b) = (lobe([0.0, 0.0, 1.0], l1), lobe([angle.sin(), 0.0, angle.cos()], l2));
                    ((a.product_closure(&b).eval(a.axis) - a.product_integral(&b)) / peak).abs()
                })
                .fold(0.0, f32::max);
            assert!(worst < allowed && worst > 0.0, "{l1} and {l2}: {worst}");
        }
    }

    #[test]
    fn a_product_is_the_product_and_a_density_integrates_to_one() {
        let (a, b) = (lobe([0.1, 0.2, 0.9], 30.0), lobe([-0.1, 0.3, 0.8], 7.0));
        let product = a.product(&b);
        for w in axes().map(|l| l.axis) {
            let expected = a.eval(w) * b.eval(w);
            // An exponent of -74 in f32 is 5e-6 off.
            assert!((product.eval(w) - expected).abs() <= 3e-5 * expected, "{w}: {} for {expected}", product.eval(w));
        }
        assert!((product.integral() / a.product_integral(&b) - 1.0).abs() < 1e-5);
        for sharpness in sharpnesses() {
            let integral = Lobe::density(Vec3::Z, sharpness).integral();
            assert!((integral - 1.0).abs() < 1e-6, "{sharpness}: {integral}");
        }
    }
}
