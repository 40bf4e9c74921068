//! Small-scale BRDFs: how one facet reflects.
//!
//! All are isotropic and one-sided: 0 when the light or the viewer is not above the facet. They come in the exact form of
//! `docs/brdf.md`. The set is closed, so it is an enum: hot loops match once, outside.

mod check;
mod measured;
mod microfacet;
pub mod params;
mod sampling;
#[cfg(test)]
mod tests;

pub use check::{PeakAlbedo, Reciprocity};
pub use measured::{MIN_FACET_COSINE, Measured, fit_names};
pub use microfacet::Distribution;
pub use params::MODELS;

pub use crate::simd::{LANES, Lanes};

use crate::toml_reader::{Range, range};
use glam::DVec3;
use microfacet::HalfAngle;
use std::f64::consts::PI;
use std::sync::Arc;

/// Linear RGB.
pub type Colour = [f64; 3];

/// Smallest and largest roughness `alpha`.
pub const ALPHA: Range = range(1e-3, 1.0);
/// Smallest and largest Blinn-Phong exponent.
pub const EXPONENT: Range = range(0.0, 1e6);

/// How one facet reflects.
#[derive(Clone, Debug, PartialEq)]
pub enum Brdf {
    /// `albedo / pi`.
    Lambert {
        /// Share of the light that is reflected.
        albedo: Colour,
    },
    /// `diffuse/pi + specular (e+2)/(2 pi) (n·h)^e`.
    BlinnPhong {
        /// Diffuse reflectance.
        diffuse: Colour,
        /// Factor of the lobe.
        specular: Colour,
        /// `e`, within [`EXPONENT`].
        exponent: f64,
    },
    /// `diffuse/pi + specular D G F / (4 (n·i)(n·o))`.
    CookTorrance {
        /// Diffuse reflectance.
        diffuse: Colour,
        /// Factor of the lobe.
        specular: Colour,
        /// Roughness, within [`ALPHA`].
        alpha: f64,
        /// Shape of D and G.
        distribution: Distribution,
        /// Reflectance at normal incidence of Schlick's F; without it F = 1.
        f0: Option<Colour>,
    },
    /// `diffuse/pi + specular exp(-tan²(h)/alpha²) / (4 pi alpha² sqrt((n·i)(n·o)))` (isotropic Ward 1992).
    Ward {
        /// Diffuse reflectance.
        diffuse: Colour,
        /// Factor of the lobe.
        specular: Colour,
        /// Roughness, within [`ALPHA`].
        alpha: f64,
    },
    /// A table, or a fit of one; not necessarily reciprocal.
    Measured(Arc<Measured>),
}

/// Unit half vector; `n` for directions that are exactly opposite, which lie in the plane of the facet.
fn half_vector(n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
    (wi + wo).try_normalize().unwrap_or(n)
}

impl Brdf {
    /// Whether `fr(wi, wo)` and `fr(wo, wi)` are the same by construction: of all but RGL tables.
    pub fn is_reciprocal(&self) -> bool {
        !matches!(self, Self::Measured(measured) if !measured.is_reciprocal())
    }

    /// `fr`, in 1/sr, of a facet with unit normal `n` for unit directions to the light and to the viewer.
    ///
    /// 0 when `wi` or `wo` is not above the facet; finite and never negative.
    pub fn eval(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Colour {
        let (ci, co) = (n.dot(wi), n.dot(wo));
        if !(ci > 0.0 && co > 0.0) {
            return [0.0; 3];
        }
        let half = || HalfAngle::between(n, half_vector(n, wi, wo));
        let lobe = |diffuse: &Colour, specular: &Colour, value: f64| std::array::from_fn(|c| diffuse[c] / PI + specular[c] * value);
        match self {
            Self::Lambert { albedo } => albedo.map(|a| a / PI),
            Self::BlinnPhong { diffuse, specular, exponent } => {
                lobe(diffuse, specular, (exponent + 2.0) / (2.0 * PI) * half().cos_power(*exponent))
            }
            Self::CookTorrance { diffuse, specular, alpha, distribution, f0 } => {
                let shadowing = distribution.g1_over_cos(ci, *alpha) * distribution.g1_over_cos(co, *alpha);
                let value = 0.25 * distribution.ndf(half(), *alpha) * shadowing;
                // i·h = |i + o| / 2
                let grazing = (1.0 - 0.5 * (wi + wo).length()).clamp(0.0, 1.0).powi(5);
                let fresnel = f0.map_or([1.0; 3], |f| f.map(|f| f + (1.0 - f) * grazing));
                std::array::from_fn(|c| diffuse[c] / PI + specular[c] * fresnel[c] * value)
            }
            Self::Ward { diffuse, specular, alpha } => {
                // Grazing values are unbounded; MIN_POSITIVE keeps them finite where the product of the cosines underflows.
                let cosines = (ci * co).max(f64::MIN_POSITIVE).sqrt();
                lobe(diffuse, specular, (-half().tan2() / (alpha * alpha)).exp() / (4.0 * PI * alpha * alpha * cosines))
            }
            Self::Measured(measured) => measured.eval(n, wi, wo),
        }
    }
}
