//! What may move in a material where nothing else is said, as tables of a fit file.

use crate::fit_file::material_text::MaterialText;
use biscale::brdf::Brdf;
use biscale::error::Result;
use biscale::geometry::params::{Param, Unit, Value};
use biscale::geometry::{self, Geometry};
use biscale::material::{Material, MaterialValues, NumberKey, Surface};
use biscale::toml_reader::Range;
use std::fmt::Write as _;

/// Factors by which a number may differ from its guess. Chosen, not measured.
const AROUND: [f64; 2] = [0.5, 2.0];
/// The same of lengths that the close-up tells. Chosen, not measured.
const NEAR: [f64; 2] = [0.6, 1.6];

/// Degrees by which an angle may differ from its guess. Chosen, not measured.
const AROUND_DEG: f64 = 20.0;
/// Bounds of a roughness. Chosen, not measured: below, a highlight is narrower than a direction bin; above, it is no highlight.
const ALPHAS: [f64; 2] = [0.05, 0.8];
/// Bounds of an exponent, about those of [`ALPHAS`] (`alpha² = 2 / (e + 2)`). Chosen, not measured.
const EXPONENTS: [f64; 2] = [2.0, 2000.0];
/// Widest thread, over the distance of threads: gaps do not close all the way.
const WIDEST_THREAD: f64 = 0.995;

/// The `[[parameter]]` and `[[colour]]` tables of all that photographs may tell of a material, within bounds about its own numbers.
///
/// # Errors
/// Those of the keys of its numbers.
pub fn tables(values: &MaterialValues, material: &Material, written: &mut MaterialText) -> Result<String> {
    let mut text = String::new();
    for Move { key, bounds, rest } in moves(&material.geometry, written) {
        let _ = write!(text, "\n[[parameter]]\nkey = \"geometry.{key}\"\nbounds = [{}, {}]\n", bounds[0], bounds[1]);
        if let Some((other, sum)) = rest {
            // The period is what the close-up tells best.
            let _ = writeln!(text, "rest = {{ key = \"geometry.{other}\", sum = {sum} }}");
        }
    }
    push_roughness(&mut text, &material.surfaces, |key| Ok(written.number(values.number_key(key).map_err(|b| b.in_file(&values.file))?)))?;
    push_colours(&mut text, &material.surfaces);
    Ok(text)
}

/// One roughness for all parts of a model, unless their guesses differ; `guess` reads the number of a key.
fn push_roughness(text: &mut String, surfaces: &[Surface], mut guess: impl FnMut(&str) -> Result<Option<f64>>) -> Result<()> {
    let rough = |brdf: &Brdf| match brdf {
        Brdf::BlinnPhong { .. } => Some("exponent"),
        Brdf::CookTorrance { .. } | Brdf::Ward { .. } => Some("alpha"),
        Brdf::Lambert { .. } | Brdf::Measured(_) => None,
    };
    for (key, bounds) in [("exponent", EXPONENTS), ("alpha", ALPHAS)] {
        let parts: Vec<&str> = surfaces.iter().filter(|s| rough(&s.brdf) == Some(key)).map(|s| &*s.part).collect();
        let Some((first, others)) = parts.split_first() else { continue };
        let own = guess(&format!("surface.{first}.brdf.{key}"))?.unwrap_or(bounds[0]);
        let (low, high) = (bounds[0].min(own), bounds[1].max(own));
        let _ = write!(text, "\n[[parameter]]\nkey = \"surface.{first}.brdf.{key}\"\nbounds = [{low}, {high}]\nlog = true\n");
        if !others.is_empty() {
            let same: Vec<String> = others.iter().map(|p| format!("\"surface.{p}.brdf.{key}\"")).collect();
            let _ = writeln!(text, "same = [{}]", same.join(", "));
        }
    }
    Ok(())
}

/// All colours of all surfaces.
fn push_colours(text: &mut String, surfaces: &[Surface]) {
    text.push_str("\n# Colours are solved for. A grey one has the same value in all channels; highlights of what is no metal are grey.\n");
    for surface in surfaces {
        let keys: &[&str] = match surface.brdf {
            Brdf::Lambert { .. } => &["brdf.albedo"],
            Brdf::Measured(_) => &["tint"],
            Brdf::BlinnPhong { .. } | Brdf::CookTorrance { .. } | Brdf::Ward { .. } => &["brdf.diffuse", "brdf.specular"],
        };
        for key in keys {
            let _ = write!(text, "\n[[colour]]\nkey = \"surface.{}.{key}\"\n", surface.part);
        }
    }
}

/// A number of a geometry that may move.
#[derive(Debug)]
struct Move {
    key: &'static str,
    bounds: [f64; 2],
    /// Another number that makes the sum of both this.
    rest: Option<(&'static str, f64)>,
}

/// The numbers of a geometry that photographs may tell, with bounds around their guess.
fn moves(geometry: &Geometry, written: &mut MaterialText) -> Vec<Move> {
    let name = geometry.kind();
    let params = geometry::describe(name).map_or(&[][..], |d| d.params);
    let declared = |key: &str| params.iter().find(|p: &&Param| p.key == key).map(|p| p.value);
    let mut number = |key: &'static str| written.number(NumberKey::Geometry(key));
    let mut found: Vec<Move> = Vec::new();
    if name == "weave" {
        // Width and gap add up to the distance of the threads, which the close-up tells.
        for (width, gap) in [("warp_width", "warp_gap"), ("weft_width", "weft_gap")] {
            if let (Some(w), Some(g)) = (number(width), number(gap)) {
                let sum = w + g;
                let bounds = [(NEAR[0] * w).min(0.5 * sum), (NEAR[1] * w).min(WIDEST_THREAD * sum).max(w)];
                found.push(Move { key: width, bounds, rest: Some((gap, sum)) });
            }
        }
    }
    for param in params {
        let taken = found.iter().any(|m| m.key == param.key || m.rest.is_some_and(|(other, _)| other == param.key));
        // The period says nothing from afar; it comes from the close-up.
        if taken || param.key == "period" || param.key == "scale" || param.key == "seed" {
            continue;
        }
        let Some(Value::Number { unit, range: Range { min, max }, .. }) = declared(param.key) else { continue };
        let Some(own) = number(param.key).filter(|v| *v != 0.0) else { continue };
        let bounds = match unit {
            Unit::Degrees => [own - AROUND_DEG, own + AROUND_DEG],
            Unit::Length | Unit::One => [AROUND[0] * own, AROUND[1] * own],
        };
        found.push(Move { key: param.key, bounds: [bounds[0].max(min), bounds[1].min(max)], rest: None });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::toml_reader::Source;

    #[test]
    fn the_bounds_of_a_guess_hold_it_and_keep_the_distance_of_the_threads() {
        let text = geometry::template("weave").unwrap();
        let source = Source { path: "m.toml".into(), text };
        let material = MaterialValues::parse(&source).unwrap().material().unwrap();
        let found = moves(&material.geometry, &mut MaterialText::new(&source).unwrap());
        let width = found.iter().find(|m| m.key == "warp_width").unwrap();
        assert!(
            width.bounds[0] < 0.42
                && width.bounds[1] > 0.42
                && width.rest.is_some_and(|(key, sum)| key == "warp_gap" && (sum - 0.504).abs() < 1e-9)
        );
        assert!(found.iter().any(|m| m.key == "warp_height") && !found.iter().any(|m| m.key == "warp_gap"), "{found:?}");
    }
}
