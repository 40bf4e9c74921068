//! `biscale new`: a commented file with every parameter.

use crate::common::options::CommonArgs;
use crate::common::output::{self, Target};
use biscale::error::{BadInput, Error, Result};
use biscale::render::SCENE_TEMPLATE;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};

/// The material that the objects of [`SCENE_TEMPLATE`] name, beside the scene.
const SCENE_MATERIAL: &str = "material.toml";

/// Arguments of `biscale new`.
#[derive(Args, Debug)]
pub struct NewArgs {
    /// What to write: a material of one geometry kind, or another file
    kind: Kind,
    /// The file to write, `-` for standard output; `new fit` also takes a folder that `capture` wrote before it
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
}

/// What can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Parallel grooves: V-shaped, flat-bottomed or sawtooth
    Grooves,
    /// Pyramids with a base of n corners
    Pyramids,
    /// Thin rods that stand or lie on a floor
    Rods,
    /// Woven threads, from a draft or a WIF file
    Weave,
    /// Heights from an image or a scan
    HeightField,
    /// Triangles from an OBJ, PLY or STL file
    Mesh,
    /// A scene for `render`
    Scene,
    /// A list of photographs for `capture`
    Shoot,
    /// The question that `fit` answers: photographs, what may move
    Fit,
}

/// Runs the command.
///
/// # Errors
/// Bad input if the file exists, or for a folder that is no capture's; unsupported for a kind that this build lacks.
pub fn run(args: &NewArgs, common: &CommonArgs) -> Result<()> {
    let kind = args.kind.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default();
    let unsupported = || Error::Unsupported { what: format!("`biscale new {kind}`"), remedy: "it is not built yet in this version".into() };
    let (folder, file) = match &args.files[..] {
        [file] => (None, file),
        [folder, file] if args.kind == Kind::Fit => (Some(folder), file),
        _ => return Err(BadInput::new("two files are given", format!("write `biscale new {kind} FILE`")).at_field("FILE").into()),
    };
    let text = match args.kind {
        Kind::Scene => SCENE_TEMPLATE.to_owned(),
        Kind::Fit => match folder {
            Some(folder) => biscale_fit::fit_file::template::for_capture(folder, &seen_from(folder, file))?,
            None => biscale_fit::fit_file::template::BY_HAND.to_owned(),
        },
        Kind::Shoot => biscale_capture::shoot::TEMPLATE.to_owned(),
        _ => biscale::geometry::template(&kind).ok_or_else(unsupported)?,
    };
    // The user edits this file: it is never recognised as ours to overwrite.
    let target = Target::new(file, args.force, &[], |_| false)?;
    if target.is_stdout() && common.json {
        return output::print_json(&json!({ "kind": kind, "text": text }));
    }
    target.write(|out| out.write_all(text.as_bytes()))?;
    if common.json {
        return output::print_json(&json!({ "kind": kind, "file": file.display().to_string() }));
    }
    if !target.is_stdout() {
        let beside = file.with_file_name(SCENE_MATERIAL);
        let need = match args.kind {
            Kind::Scene if !beside.exists() => format!("`biscale new grooves {}` writes the material that it names, ", beside.display()),
            _ => String::new(),
        };
        output::tell(common, &format!("wrote {}; {need}`biscale check {}` says what it means", file.display(), file.display()));
    }
    Ok(())
}

/// The folder as a file names it by a path relative to its own: as it was given where both are relative to the same place.
fn seen_from(folder: &Path, file: &Path) -> String {
    let beside = file.parent().filter(|p| !p.as_os_str().is_empty());
    let path = match beside {
        None => folder.to_path_buf(),
        Some(beside) => folder
            .strip_prefix(beside)
            .map_or_else(|_| std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf()), Path::to_path_buf),
    };
    // The file may lie in the folder itself.
    if path.as_os_str().is_empty() { ".".to_owned() } else { path.display().to_string() }
}
