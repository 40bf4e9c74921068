//! How effective values would be computed.

use crate::common::bounces::Bounces;
use biscale::error::Result;
use biscale::filter::{Method, MethodToRun, Quality, Variant};
use biscale::material::Material;

/// How effective values of a material would be computed, in one line.
///
/// # Errors
/// Those of [`Quality::method_for`].
pub fn would_run(quality: &Quality, material: &Material) -> Result<String> {
    let method = match quality.method_for(material)? {
        MethodToRun::PredictedDirect | MethodToRun::Direct => "direct",
        MethodToRun::LowRank => match quality.variant_of(Method::LowRank) {
            Variant::Paper => "lowrank",
            Variant::Improved => "lowrank improved",
        },
        MethodToRun::SphericalGaussian => match quality.variant_of(Method::SphericalGaussian) {
            Variant::Paper => "sg",
            Variant::Improved => "sg improved",
        },
        MethodToRun::Reference => "reference",
    };
    let bounces = Bounces::of(quality, material.bounces);
    let until = match (&quality.plan, quality.budget) {
        (Some(plan), _) => format!("by the plan {plan}"),
        (None, Some(seconds)) => format!("for {seconds} s"),
        (None, None) => format!("to a relative RMS error of {} %", digits(quality.tolerance * 100.0)),
    };
    Ok(format!("method {method}, {until}, {bounces}, seed {}", quality.seed))
}

/// A number with six significant digits at most.
pub fn digits(x: f64) -> String {
    format!("{x:.5e}").parse::<f64>().unwrap_or(x).to_string()
}
