//! Cook-Torrance: microfacets with Smith's shadowing, and Schlick's F where there is one.

use super::facet::Colour;
use super::microfacet::{Distribution, HalfAngle};
use super::params::{DIFFUSE, Fallback, Model, Param, REFLECTANCE, ROUGHNESS, SPECULAR, Value};
use glam::DVec3;

pub(super) const MODEL: Model = Model {
    name: "cook-torrance",
    help: "Diffuse, and microfacets with Smith's shadowing",
    formula: "diffuse/pi + specular D G F / (4 (n.i)(n.o))",
    params: &[
        DIFFUSE,
        SPECULAR,
        ROUGHNESS,
        Param { key: "distribution", value: Value::Choice(&["ggx", "beckmann"]), help: "Distribution D of the microfacets' normals" },
        Param {
            key: "f0",
            value: Value::Colour(Fallback::Without("F = 1"), REFLECTANCE),
            help: "Reflectance at normal incidence, of Schlick's F",
        },
    ],
};

/// The distributions in the order of the words of `distribution`.
pub(super) const DISTRIBUTIONS: [Distribution; 2] = [Distribution::Ggx, Distribution::Beckmann];

/// `D G / (4 (n·i)(n·o))`, for the cosines `ci` and `co` of light and viewer with the normal.
#[inline]
pub(super) fn lobe(half: HalfAngle, ci: f64, co: f64, alpha: f64, distribution: Distribution) -> f64 {
    let shadowing = distribution.g1_over_cos(ci, alpha) * distribution.g1_over_cos(co, alpha);
    0.25 * distribution.ndf(half, alpha) * shadowing
}

/// Schlick's F; 1 without `f0`.
#[inline]
pub(super) fn fresnel(f0: Option<Colour>, wi: DVec3, wo: DVec3) -> Colour {
    // i·h = |i + o| / 2
    let grazing = (1.0 - 0.5 * (wi + wo).length()).clamp(0.0, 1.0).powi(5);
    f0.map_or([1.0; 3], |f| f.map(|f| f + (1.0 - f) * grazing))
}
