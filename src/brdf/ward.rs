//! Isotropic Ward (1992).

use super::microfacet::HalfAngle;
use super::params::{DIFFUSE, Model, ROUGHNESS, SPECULAR};
use std::f64::consts::PI;

pub(super) const MODEL: Model = Model {
    name: "ward",
    help: "Diffuse, and the isotropic lobe of Ward 1992",
    formula: "diffuse/pi + specular exp(-tan^2(h)/alpha^2) / (4 pi alpha^2 sqrt((n.i)(n.o)))",
    params: &[DIFFUSE, SPECULAR, ROUGHNESS],
};

/// The lobe without its factor, for the cosines `ci` and `co` of light and viewer with the normal.
#[inline]
pub(super) fn lobe(half: HalfAngle, ci: f64, co: f64, alpha: f64) -> f64 {
    // Grazing values are unbounded; MIN_POSITIVE keeps them finite where the product of the cosines underflows.
    let cosines = (ci * co).max(f64::MIN_POSITIVE).sqrt();
    (-half.tan2() / (alpha * alpha)).exp() / (4.0 * PI * alpha * alpha * cosines)
}
