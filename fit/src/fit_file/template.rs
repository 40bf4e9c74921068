//! Fit files to begin with: a commented one, and one for a capture folder.

use crate::fit_file::material_text::MaterialText;
use biscale::brdf::Brdf;
use biscale::error::{BadInput, Result};
use biscale::formats::capture::{self, Capture};
use biscale::geometry::params::{Param, Unit, Value};
use biscale::geometry::{self, Geometry};
use biscale::material::{MaterialValues, NumberPlace};
use biscale::toml_reader::{Range, Source};
use std::fmt::Write as _;
use std::path::Path;

/// A commented fit file with every key, for photographs whose camera, light and shape are given by hand.
pub const BY_HAND: &str = include_str!("fit_template.toml");

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

/// A fit file for a folder that `biscale capture` wrote: its guess is the start, and all that it does not fix may move. `relative` is how
/// the fit file will name the folder.
///
/// # Errors
/// Bad input, for a folder that is none, or has no guess.
pub fn for_capture(folder: &Path, relative: &str) -> Result<String> {
    let capture = Capture::read(folder)?;
    let Some(guess) = &capture.material else {
        let file = folder.join(capture::FILE_NAME);
        let remedy = "write the start material yourself, and a fit file with `biscale new fit FILE`";
        return Err(BadInput::new("the capture has no guess of the material", remedy).in_file(&file).into());
    };
    let source = Source::read(&folder.join(guess))?;
    let values = MaterialValues::parse(&source)?;
    let material = values.material()?;
    let mut written = MaterialText::new(&source)?;
    let quoted = |text: &str| toml_edit::Value::from(text).to_string().trim().to_owned();
    let mut text = format!(
        "# The question that `biscale fit` answers; docs/fit.md says what each key means.\nformat = 1\nname = {}\n\n\
         # The folder that `biscale capture` wrote: photographs, cameras, lights and shape.\ncapture = {}\n\
         # Where the search begins: what the close-up tells.\nmaterial = {}\n\
         # Reflections after the first: threads and grooves light each other. 0 is direct light only, and faster.\nbounces = 4\n",
        quoted(&capture.name),
        quoted(relative),
        quoted(&format!("{relative}/{guess}")),
    );
    text.push_str("\n# What may move. `bounds` holds it in; equal bounds hold it fast.\n");
    for (key, bounds, rest) in moves(&material.geometry, &mut written) {
        let _ = write!(text, "\n[[parameter]]\nkey = \"geometry.{key}\"\nbounds = [{}, {}]\n", bounds[0], bounds[1]);
        if let Some((other, sum)) = rest {
            // The period is what the close-up tells best.
            let _ = writeln!(text, "rest = {{ key = \"geometry.{other}\", sum = {sum} }}");
        }
    }
    // One roughness for all parts of a model, unless their guesses differ.
    let rough = |brdf: &Brdf| match brdf {
        Brdf::BlinnPhong { .. } => Some(("exponent", EXPONENTS)),
        Brdf::CookTorrance { .. } | Brdf::Ward { .. } => Some(("alpha", ALPHAS)),
        Brdf::Lambert { .. } | Brdf::Measured(_) => None,
    };
    for key in ["exponent", "alpha"] {
        let parts: Vec<&str> =
            material.surfaces.iter().filter(|s| rough(&s.brdf).is_some_and(|(k, _)| k == key)).map(|s| &*s.part).collect();
        let Some((first, others)) = parts.split_first() else { continue };
        let bounds = if key == "alpha" { ALPHAS } else { EXPONENTS };
        let place = values.place(&format!("surface.{first}.brdf.{key}")).map_err(|b| b.in_file(&source.path))?;
        let own = written.number(place).unwrap_or(bounds[0]);
        let (low, high) = (bounds[0].min(own), bounds[1].max(own));
        let _ = write!(text, "\n[[parameter]]\nkey = \"surface.{first}.brdf.{key}\"\nbounds = [{low}, {high}]\nlog = true\n");
        if !others.is_empty() {
            let same: Vec<String> = others.iter().map(|p| format!("\"surface.{p}.brdf.{key}\"")).collect();
            let _ = writeln!(text, "same = [{}]", same.join(", "));
        }
    }
    text.push_str("\n# Colours are solved for. A grey one has the same value in all channels; highlights of what is no metal are grey.\n");
    for surface in &material.surfaces {
        let keys: &[&str] = match surface.brdf {
            Brdf::Lambert { .. } => &["brdf.albedo"],
            Brdf::Measured(_) => &["tint"],
            Brdf::BlinnPhong { .. } | Brdf::CookTorrance { .. } | Brdf::Ward { .. } => &["brdf.diffuse", "brdf.specular"],
        };
        for key in keys {
            let _ = write!(text, "\n[[colour]]\nkey = \"surface.{}.{key}\"\n", surface.part);
        }
    }
    Ok(text)
}

type Move = (&'static str, [f64; 2], Option<(&'static str, f64)>);

/// The numbers of a geometry that photographs may tell, with bounds around their guess.
fn moves(geometry: &Geometry, written: &mut MaterialText) -> Vec<Move> {
    let name = geometry.kind();
    let params = geometry::describe(name).map_or(&[][..], |d| d.params);
    let declared = |key: &str| params.iter().find(|p: &&Param| p.key == key).map(|p| p.value);
    let mut number = |key: &'static str| written.number(NumberPlace::Geometry(key));
    let mut found: Vec<Move> = Vec::new();
    if name == "weave" {
        // Width and gap add up to the distance of the threads, which the close-up tells.
        for (width, gap) in [("warp_width", "warp_gap"), ("weft_width", "weft_gap")] {
            if let (Some(w), Some(g)) = (number(width), number(gap)) {
                let sum = w + g;
                found.push((width, [(NEAR[0] * w).min(0.5 * sum), (NEAR[1] * w).min(WIDEST_THREAD * sum).max(w)], Some((gap, sum))));
            }
        }
    }
    for param in params {
        let taken = found.iter().any(|(key, _, rest)| *key == param.key || rest.is_some_and(|(other, _)| other == param.key));
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
        found.push((param.key, [bounds[0].max(min), bounds[1].min(max)], None));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_of_a_guess_hold_it_and_keep_the_distance_of_the_threads() {
        let text = geometry::template("weave").unwrap();
        let source = Source { path: "m.toml".into(), text };
        let material = MaterialValues::parse(&source).unwrap().material().unwrap();
        let found = moves(&material.geometry, &mut MaterialText::new(&source).unwrap());
        let width = found.iter().find(|m| m.0 == "warp_width").unwrap();
        assert!(
            width.1[0] < 0.42 && width.1[1] > 0.42 && width.2.is_some_and(|(key, sum)| key == "warp_gap" && (sum - 0.504).abs() < 1e-9)
        );
        assert!(found.iter().any(|m| m.0 == "warp_height") && !found.iter().any(|m| m.0 == "warp_gap"), "{found:?}");
    }
}
