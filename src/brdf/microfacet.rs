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
    /// Beckmann, with Walter et al.'s rational G1.
    Beckmann,
}

/// `tan²` of the angle between unit vectors `n` and `h`; infinite from 90 degrees on.
pub(super) fn tan2(n: DVec3, h: DVec3) -> f64 {
    let d = (n - h).length_squared();
    let cos = 1.0 - 0.5 * d;
    if cos <= 0.0 { f64::INFINITY } else { d * (1.0 - 0.25 * d) / (cos * cos) }
}

/// `alpha²`, and `sin²` and `cos` of the angle between unit vectors `n` and `h`.
fn angle(n: DVec3, h: DVec3, alpha: f64) -> (f64, f64, f64) {
    let d = (n - h).length_squared();
    (alpha * alpha, d * (1.0 - 0.25 * d), 1.0 - 0.5 * d)
}

impl Distribution {
    /// `D(h)`: its integral times `n·h` over the hemisphere is 1.
    pub fn ndf(self, n: DVec3, h: DVec3, alpha: f64) -> f64 {
        let (a2, sin2, cos) = angle(n, h, alpha);
        if cos <= 0.0 {
            return 0.0;
        }
        let cos2 = cos * cos;
        match self {
            // cos² (alpha² - 1) + 1, without the cancellation at cos = 1
            Self::Ggx => a2 / (PI * (cos2 * a2 + sin2).powi(2)),
            Self::Beckmann => (-sin2 / (cos2 * a2)).exp() / (PI * a2 * cos2 * cos2),
        }
    }

    /// Smith's `G1` for a direction whose cosine with the normal is `cos`, in `0..=1`.
    pub fn g1(self, cos: f64, alpha: f64) -> f64 {
        if cos <= 0.0 {
            return 0.0;
        }
        let tan2 = (1.0 - cos * cos).max(0.0) / (cos * cos);
        match self {
            Self::Ggx => 2.0 / (1.0 + (1.0 + alpha * alpha * tan2).sqrt()),
            Self::Beckmann => {
                let c = 1.0 / (alpha * tan2.sqrt());
                if c < 1.6 { (3.535 * c + 2.181 * c * c) / (1.0 + 2.276 * c + 2.577 * c * c) } else { 1.0 }
            }
        }
    }
}
