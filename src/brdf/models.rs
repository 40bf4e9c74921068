//! The closed set of models, and `fr` of each. To add one, follow the steps at the head of `mod.rs`.

use super::facet::{Colour, half_vector};
use super::measured::Measured;
use super::microfacet::{Distribution, HalfAngle};
use super::{blinn_phong, cook_torrance, lambert, ward};
use crate::numerics::stable_bytes::StableBytes;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

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
        /// `e`, within [`EXPONENT`](super::EXPONENT).
        exponent: f64,
    },
    /// `diffuse/pi + specular D G F / (4 (n·i)(n·o))`.
    CookTorrance {
        /// Diffuse reflectance.
        diffuse: Colour,
        /// Factor of the lobe.
        specular: Colour,
        /// Roughness, within [`ALPHA`](super::ALPHA).
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
        /// Roughness, within [`ALPHA`](super::ALPHA).
        alpha: f64,
    },
    /// A table, or a fit of one; not necessarily reciprocal.
    Measured(Arc<Measured>),
}

impl Brdf {
    /// All that [`eval`](Self::eval) depends on, for hashes that are kept in files. A table is told by its numbers, not by the name of its file. A tag
    /// is never given to another model.
    pub fn write(&self, out: &mut StableBytes<'_>) {
        match self {
            Self::Lambert { albedo } => {
                out.tag(1);
                out.reals(albedo);
            }
            Self::BlinnPhong { diffuse, specular, exponent } => {
                out.tag(2);
                [diffuse, specular].into_iter().for_each(|colour| out.reals(colour));
                out.reals(&[*exponent]);
            }
            Self::CookTorrance { diffuse, specular, alpha, distribution, f0 } => {
                out.tag(3);
                [diffuse, specular].into_iter().for_each(|colour| out.reals(colour));
                out.reals(&[*alpha]);
                out.tag(match distribution {
                    Distribution::Ggx => 1,
                    Distribution::Beckmann => 2,
                });
                out.option(f0.as_ref(), |out, colour| out.reals(colour));
            }
            Self::Ward { diffuse, specular, alpha } => {
                out.tag(4);
                [diffuse, specular].into_iter().for_each(|colour| out.reals(colour));
                out.reals(&[*alpha]);
            }
            Self::Measured(measured) => {
                out.tag(5);
                measured.write(out);
            }
        }
    }

    /// Whether `fr(wi, wo)` and `fr(wo, wi)` are the same by construction: of all but RGL tables.
    pub fn is_reciprocal(&self) -> bool {
        !matches!(self, Self::Measured(measured) if !measured.is_reciprocal())
    }

    /// Roughness `alpha` of the narrowest lobe, that of a Beckmann lobe of about its width; 1 without a lobe.
    pub fn roughness(&self) -> f64 {
        match self {
            Self::Lambert { .. } => 1.0,
            Self::CookTorrance { alpha, .. } | Self::Ward { alpha, .. } => *alpha,
            // The usual equivalence of Blinn's exponent and Beckmann's roughness (Walter et al. 2007, section 5.2: e = 2 / alpha² - 2).
            Self::BlinnPhong { exponent, .. } => (2.0 / (exponent + 2.0)).sqrt(),
            Self::Measured(measured) => measured.lobe_alpha(),
        }
    }

    /// `fr`, in 1/sr, of a facet with unit normal `n` for unit directions to the light and to the viewer.
    ///
    /// 0 when `wi` or `wo` is not above the facet; finite and never negative.
    ///
    /// ```
    /// use biscale::brdf::{Brdf, Distribution};
    /// use glam::DVec3;
    ///
    /// let (n, wi) = (DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
    /// let mirrored = DVec3::new(-0.6, 0.0, 0.8);
    /// let paint = Brdf::CookTorrance { diffuse: [0.2; 3], specular: [0.5; 3], alpha: 0.1, distribution: Distribution::Ggx, f0: None };
    /// // 20 times brighter in the mirror's direction than off it, and the same when light and viewer trade places.
    /// assert!(paint.eval(n, wi, mirrored)[0] > 20.0 * paint.eval(n, wi, n)[0]);
    /// assert_eq!(paint.eval(n, wi, n), paint.eval(n, n, wi));
    /// // Facets are one-sided.
    /// assert_eq!(paint.eval(n, wi, -n), [0.0; 3]);
    /// ```
    pub fn eval(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Colour {
        let (ci, co) = (n.dot(wi), n.dot(wo));
        if !(ci > 0.0 && co > 0.0) {
            return [0.0; 3];
        }
        let half = || HalfAngle::between(n, half_vector(n, wi, wo));
        let sum = |diffuse: &Colour, specular: &Colour, lobe: f64| std::array::from_fn(|c| diffuse[c] / PI + specular[c] * lobe);
        match self {
            Self::Lambert { albedo } => lambert::eval(albedo),
            Self::BlinnPhong { diffuse, specular, exponent } => sum(diffuse, specular, blinn_phong::lobe(half(), *exponent)),
            Self::CookTorrance { diffuse, specular, alpha, distribution, f0 } => {
                let lobe = cook_torrance::lobe(half(), ci, co, *alpha, *distribution);
                let fresnel = cook_torrance::fresnel(*f0, wi, wo);
                std::array::from_fn(|c| diffuse[c] / PI + specular[c] * fresnel[c] * lobe)
            }
            Self::Ward { diffuse, specular, alpha } => sum(diffuse, specular, ward::lobe(half(), ci, co, *alpha)),
            Self::Measured(measured) => measured.eval(n, wi, wo),
        }
    }
}
