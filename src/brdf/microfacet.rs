//! Microfacet distributions and Smith's shadowing, in forms that hold from mirror-like to rough.
//!
//! With unit `n` and `h` and `d = |n - h|²`, `sin²(h) = d (1 - d/4)` and `n·h = 1 - d/2`: exact near `n = h`, where
//! `1 - (n·h)²` cancels.

use glam::DVec3;
use std::f64::consts::PI;

/// Shape of the distribution of microfacet normals, with its Smith shadowing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Trowbridge-Reitz.
    Ggx,
    /// Beckmann, with the rational G1 of Walter et al. 2007.
    Beckmann,
}

/// Angle between the normal and the half vector.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfAngle {
    /// Its cosine; 0 from 90 degrees on.
    pub cos: f64,
    /// Its squared sine, in `0..=1`.
    pub sin2: f64,
}

impl HalfAngle {
    /// Between unit vectors.
    pub fn between(n: DVec3, h: DVec3) -> Self {
        let d = (n - h).length_squared();
        let cos = 1.0 - 0.5 * d;
        if cos > 0.0 { Self { cos, sin2: d * (1.0 - 0.25 * d) } } else { Self { cos: 0.0, sin2: 1.0 } }
    }

    /// Squared tangent; infinite at 90 degrees.
    pub fn tan2(self) -> f64 {
        self.sin2 / (self.cos * self.cos)
    }

    /// `cos^exponent`: through the sine where the cosine keeps too few digits for exponents of 1e6.
    pub fn cos_power(self, exponent: f64) -> f64 {
        if self.sin2 < 0.5 { (0.5 * exponent * (-self.sin2).ln_1p()).exp() } else { self.cos.powf(exponent) }
    }
}

impl Distribution {
    /// `D(h)` in 1/sr: its integral times `n·h` over the hemisphere is 1.
    pub(super) fn ndf(self, h: HalfAngle, alpha: f64) -> f64 {
        let (a2, cos2) = (alpha * alpha, h.cos * h.cos);
        if cos2 <= 0.0 {
            return 0.0;
        }
        match self {
            // cos² (alpha² - 1) + 1, without the cancellation at cos = 1
            Self::Ggx => a2 / (PI * (cos2 * a2 + h.sin2).powi(2)),
            Self::Beckmann => {
                let tan2 = h.sin2 / cos2;
                // 1/cos⁴ = (1 + tan²)², which the exponential outruns before it overflows.
                let exponential = (-tan2 / a2).exp();
                if exponential > 0.0 { exponential * (1.0 + tan2).powi(2) / (PI * a2) } else { 0.0 }
            }
        }
    }

    /// Smith's `G1` for a direction whose cosine with the normal is `cos`, in `0..=1`.
    pub fn g1(self, cos: f64, alpha: f64) -> f64 {
        (cos * self.g1_over_cos(cos, alpha)).min(1.0)
    }

    /// `G1 / cos`, finite down to grazing directions: what `fr` has, since it divides by both cosines.
    pub(super) fn g1_over_cos(self, cos: f64, alpha: f64) -> f64 {
        if cos <= 0.0 {
            return 0.0;
        }
        let sin2 = (1.0 - cos * cos).max(0.0);
        match self {
            // 2 / (1 + sqrt(1 + alpha² tan²)), numerator and denominator times cos
            Self::Ggx => 2.0 / (cos + (cos * cos + alpha * alpha * sin2).sqrt()),
            Self::Beckmann => {
                let spread = alpha * sin2.sqrt();
                let c = cos / spread; // 1 / (alpha tan); infinite along the normal
                if c < 1.6 { (3.535 + 2.181 * c) / (1.0 + 2.276 * c + 2.577 * c * c) / spread } else { 1.0 / cos }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Distribution; 2] = [Distribution::Ggx, Distribution::Beckmann];

    fn at(theta: f64) -> HalfAngle {
        HalfAngle::between(DVec3::Z, DVec3::new(theta.sin(), 0.0, theta.cos()))
    }

    #[test]
    fn distributions_of_projected_area_integrate_to_one() {
        for distribution in BOTH {
            for alpha in [1e-3, 0.05, 0.3, 1.0] {
                // 2 pi D cos sin dtheta, midpoint rule in ln(tan theta), which resolves any lobe
                let (low, high, steps) = (-20.0, 20.0, 40_000);
                let width = (high - low) / f64::from(steps);
                let sum: f64 = (0..steps)
                    .map(|k| {
                        let tan = (low + (f64::from(k) + 0.5) * width).exp();
                        let (cos, sin) = (1.0 / tan.hypot(1.0), tan / tan.hypot(1.0));
                        // theta' = tan / (1 + tan²)
                        distribution.ndf(at(tan.atan()), alpha) * cos * sin * 2.0 * PI * (tan * cos * cos) * width
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 1e-6, "{distribution:?} alpha {alpha}: {sum}");
            }
        }
    }

    #[test]
    fn distributions_have_their_textbook_values() {
        for alpha in [0.05, 0.3, 1.0] {
            for theta in [0.0_f64, 0.02, 0.4, 1.2] {
                let (c2, t2, a2) = (theta.cos().powi(2), theta.tan().powi(2), alpha * alpha);
                let ggx = a2 / (PI * (c2 * (a2 - 1.0) + 1.0).powi(2));
                let beckmann = (-t2 / a2).exp() / (PI * a2 * c2 * c2);
                for (distribution, expected) in BOTH.into_iter().zip([ggx, beckmann]) {
                    let got = distribution.ndf(at(theta), alpha);
                    assert!((got - expected).abs() <= 1e-12 * expected, "{distribution:?} {alpha} {theta}: {got} not {expected}");
                }
            }
        }
    }

    #[test]
    fn a_mirror_like_lobe_keeps_its_digits_beside_the_peak() {
        // GGX alpha 1e-3 at theta = 1e-5, 1e-4 (mpmath, 40 digits): 1e-6 / (pi (cos² (1e-6 - 1) + 1)²)
        for (theta, expected) in [(1e-5, 318_246.233_818_222_4), (1e-4, 312_037.930_112_702_1)] {
            let got = Distribution::Ggx.ndf(at(theta), 1e-3);
            assert!((got / expected - 1.0).abs() < 1e-9, "{got} not {expected}");
        }
    }

    #[test]
    fn shadowing_has_its_textbook_values() {
        for alpha in [1e-3, 0.3, 1.0] {
            for theta in [1e-6_f64, 0.3, 1.0, 1.5] {
                let (cos, tan) = (theta.cos(), theta.tan());
                let c = 1.0 / (alpha * tan);
                let ggx = 2.0 / (1.0 + (alpha * tan).hypot(1.0));
                let rational = (3.535 * c + 2.181 * c * c) / (1.0 + 2.276 * c + 2.577 * c * c);
                for (distribution, expected) in BOTH.into_iter().zip([ggx, if c < 1.6 { rational } else { 1.0 }]) {
                    let got = distribution.g1(cos, alpha);
                    assert!((got - expected).abs() < 1e-9, "{distribution:?} {alpha} {theta}: {got} not {expected}");
                }
            }
        }
    }

    #[test]
    fn shadowing_is_full_along_the_normal_and_vanishes_at_the_horizon() {
        for distribution in BOTH {
            for alpha in [1e-3, 0.3, 1.0] {
                assert_eq!(distribution.g1(1.0, alpha), 1.0);
                assert!(distribution.g1(1e-12, alpha) < 1e-8);
                assert_eq!(distribution.g1(0.0, alpha), 0.0);
                for cos in [f64::MIN_POSITIVE, 5e-324] {
                    let value = distribution.g1_over_cos(cos, alpha);
                    assert!(value.is_finite() && value > 0.0, "{distribution:?} alpha {alpha} at {cos:e}: {value}");
                }
            }
        }
    }

    #[test]
    fn a_power_of_the_cosine_agrees_with_the_plain_one_and_survives_a_million() {
        for theta in [0.0_f64, 0.3, 0.8, 1.2] {
            for exponent in [0.0, 1.0, 37.5] {
                let (got, expected) = (at(theta).cos_power(exponent), theta.cos().powf(exponent));
                assert!((got - expected).abs() < 1e-13, "cos^{exponent} at {theta}: {got} not {expected}");
            }
        }
        // cos(1e-3)^1e6 = exp(-0.500000083333...)
        assert!((at(1e-3).cos_power(1e6) - (-0.500_000_083_333_355_6_f64).exp()).abs() < 1e-12);
        assert_eq!(at(1.6).cos_power(0.0), 1.0);
    }
}
