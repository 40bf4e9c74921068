//! Fit files to begin with: a commented one, and one for a capture folder.

use crate::fit_file::default_moves;
use crate::fit_file::material_text::MaterialText;
use crate::fit_file::spec::USUAL_BOUNCES;
use crate::fit_file::structure::{Reflectance, Structure};
use biscale::error::{BadInput, Result};
use biscale::formats::capture::{self, Capture};
use biscale::geometry::Geometry;
use biscale::material::{Material, MaterialValues};
use biscale::toml_reader::Source;
use std::fmt::Write as _;
use std::path::Path;

/// A commented fit file with every key, for photographs whose camera, light and shape are given by hand.
pub const BY_HAND: &str = include_str!("fit_template.toml");

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
    let mut text = head(&capture.name, relative, &format!("{relative}/{guess}"));
    text.push_str(&candidates(&material));
    text.push_str("\n# What may move. `bounds` holds it in; equal bounds hold it fast.\n");
    text.push_str(&default_moves::tables(&values, &material, &mut written)?);
    Ok(text)
}

/// The candidates that a fit file offers, as comments: the structures of the guess's own kind, each with both reflectances.
fn candidates(material: &Material) -> String {
    let structures: &[Structure] = match material.geometry {
        Geometry::Weave(_) => &Structure::WEAVES,
        Geometry::Grooves(_) => &[Structure::Grooves, Structure::VGrooves],
        _ => &[],
    };
    let quoted = |names: &[&str]| names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
    let names: Vec<&str> = structures.iter().map(|s| s.name()).collect();
    let mut text = "\n# What else it may be: each structure with each reflectance, from the lengths and colours of the start material. The photographs choose, and the\n\
                    # report says what cannot be told apart. It takes several times as long; without these lines the start material alone is fitted.\n"
        .to_owned();
    if !names.is_empty() {
        let _ = writeln!(text, "# structures = [{}]", quoted(&names));
    }
    let _ = writeln!(text, "# reflectances = [{}]", quoted(&Reflectance::NAMES));
    text
}

/// What comes before the tables: the capture's name, its folder and the start material, as the fit file names them.
fn head(name: &str, folder: &str, material: &str) -> String {
    let quoted = |text: &str| toml_edit::Value::from(text).to_string().trim().to_owned();
    format!(
        "# The question that `biscale fit` answers; docs/fit.md says what each key means.\nformat = 1\nname = {}\n\n\
         # The folder that `biscale capture` wrote: photographs, cameras, lights and shape.\ncapture = {}\n\
         # Where the search begins: what the close-up tells.\nmaterial = {}\n\
         # Reflections after the first: threads and grooves light each other. 0 is direct light only, and faster.\nbounces = {USUAL_BOUNCES}\n",
        quoted(name),
        quoted(folder),
        quoted(material),
    )
}
