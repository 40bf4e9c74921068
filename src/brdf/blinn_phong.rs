//! Blinn-Phong: a power of the cosine between normal and half vector, normalised so that `specular = 1` reflects all light along the normal
//! for exponent 0 (`docs/brdf.md`).

use super::microfacet::HalfAngle;
use super::params::{DIFFUSE, EXPONENT, Fallback, Model, Param, SPECULAR, Value};
use std::f64::consts::PI;

pub(super) const MODEL: Model = Model {
    name: "blinn-phong",
    help: "Diffuse, and a power of the cosine between normal and half vector",
    formula: "diffuse/pi + specular (e+2)/(2 pi) (n.h)^e",
    params: &[
        DIFFUSE,
        SPECULAR,
        Param {
            key: "exponent",
            value: Value::Number(Fallback::Required(50.0), EXPONENT),
            help: "The exponent e: the larger, the narrower the lobe",
        },
    ],
};

/// The lobe without its factor.
#[inline]
pub(super) fn lobe(half: HalfAngle, exponent: f64) -> f64 {
    (exponent + 2.0) / (2.0 * PI) * half.cos_power(exponent)
}
