//! Lambert: the same radiance in all directions.

use super::facet::Colour;
use super::params::{Fallback, Model, Param, REFLECTANCE, Value};
use std::f64::consts::PI;

pub(super) const MODEL: Model = Model {
    name: "lambert",
    help: "Perfectly diffuse",
    formula: "albedo/pi",
    params: &[Param {
        key: "albedo",
        value: Value::Colour(Fallback::Required(0.5), REFLECTANCE),
        help: "Share of the light that is reflected",
    }],
};

/// `fr` of a facet that both directions are above.
#[inline]
pub(super) fn eval(albedo: &Colour) -> Colour {
    albedo.map(|a| a / PI)
}
