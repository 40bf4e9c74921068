//! Small-scale BRDFs: how one facet reflects.
//!
//! All are isotropic and one-sided: 0 when the light or the viewer is not above the facet. They come in the exact form of
//! `docs/formats.md`. The set is closed, so it is an enum: hot loops match once, outside.

mod microfacet;

pub use microfacet::Distribution;

use crate::error::Result;
use crate::toml_reader::{Range, TableReader, range};
use glam::DVec3;
use std::f64::consts::PI;

/// Linear RGB.
pub type Colour = [f64; 3];

/// Smallest and largest roughness `alpha`.
pub const ALPHA: Range = range(1e-3, 1.0);
/// Smallest and largest Blinn-Phong exponent.
pub const EXPONENT: Range = range(0.0, 1e6);
/// Albedo, diffuse, specular and f0 are reflectances.
const REFLECTANCE: Range = range(0.0, 1.0);

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
}

/// The models, as material files name them.
pub const MODELS: [&str; 4] = ["lambert", "blinn-phong", "cook-torrance", "ward"];

impl Brdf {
    /// Reads a `brdf` table.
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let model = table.choice("model", &MODELS)?.ok_or_else(|| table.missing("model", "\"lambert\""))?;
        let diffuse = || -> Result<Colour> { Ok(table.colour("diffuse", REFLECTANCE)?.unwrap_or([0.0; 3])) };
        let specular = || table.colour("specular", REFLECTANCE)?.ok_or_else(|| table.missing("specular", "0.5"));
        let alpha = || table.f64("alpha", ALPHA)?.ok_or_else(|| table.missing("alpha", "0.2"));
        let brdf = match MODELS[model] {
            "lambert" => Self::Lambert { albedo: table.colour("albedo", REFLECTANCE)?.ok_or_else(|| table.missing("albedo", "0.5"))? },
            "blinn-phong" => Self::BlinnPhong {
                diffuse: diffuse()?,
                specular: specular()?,
                exponent: table.f64("exponent", EXPONENT)?.ok_or_else(|| table.missing("exponent", "50"))?,
            },
            "cook-torrance" => Self::CookTorrance {
                diffuse: diffuse()?,
                specular: specular()?,
                alpha: alpha()?,
                distribution: match table.choice("distribution", &["ggx", "beckmann"])? {
                    Some(1) => Distribution::Beckmann,
                    _ => Distribution::Ggx,
                },
                f0: table.colour("f0", REFLECTANCE)?,
            },
            "ward" => Self::Ward { diffuse: diffuse()?, specular: specular()?, alpha: alpha()? },
            _ => unreachable!("choice returns a place in MODELS"),
        };
        table.finish()?;
        Ok(brdf)
    }

    /// `fr`, in 1/sr, of a facet with unit normal `n` for unit directions to the light and to the viewer.
    pub fn eval(&self, n: DVec3, wi: DVec3, wo: DVec3) -> Colour {
        let (ci, co) = (n.dot(wi), n.dot(wo));
        if ci <= 0.0 || co <= 0.0 {
            return [0.0; 3];
        }
        let sum = wi + wo;
        // |i + o| is 0 only for opposite directions, which cannot both lie above a facet.
        let h = sum / sum.length();
        let lobe = |diffuse: &Colour, specular: &Colour, value: f64| std::array::from_fn(|c| diffuse[c] / PI + specular[c] * value);
        match self {
            Self::Lambert { albedo } => albedo.map(|a| a / PI),
            Self::BlinnPhong { diffuse, specular, exponent } => {
                // (n·h)^e by the angle between them: n·h itself keeps too few digits at e = 1e6.
                let power = (0.5 * exponent * (-(n - h).length_squared() * (1.0 - 0.25 * (n - h).length_squared())).ln_1p()).exp();
                lobe(diffuse, specular, (exponent + 2.0) / (2.0 * PI) * power)
            }
            Self::CookTorrance { diffuse, specular, alpha, distribution, f0 } => {
                let value = distribution.ndf(n, h, *alpha) * distribution.g1(ci, *alpha) * distribution.g1(co, *alpha) / (4.0 * ci * co);
                let grazing = (1.0 - wi.dot(h)).clamp(0.0, 1.0).powi(5);
                let fresnel = f0.map_or([1.0; 3], |f| f.map(|f| f + (1.0 - f) * grazing));
                std::array::from_fn(|c| diffuse[c] / PI + specular[c] * fresnel[c] * value)
            }
            Self::Ward { diffuse, specular, alpha } => {
                let value = (-microfacet::tan2(n, h) / (alpha * alpha)).exp() / (4.0 * PI * alpha * alpha * (ci * co).sqrt());
                lobe(diffuse, specular, value)
            }
        }
    }
}
