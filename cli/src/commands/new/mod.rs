//! `biscale new`: a commented file with every parameter.

mod board;

use crate::common::options::CommonArgs;
use crate::common::output::{self, Target};
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::weave::read_wif;
use biscale::material::Material;
use biscale::render::SCENE_TEMPLATE;
use biscale::toml_reader::Source;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};

/// The material that the objects of [`SCENE_TEMPLATE`] name, beside the scene.
const SCENE_MATERIAL: &str = "material.toml";

/// Warp and weft of a draft without colours.
const NO_COLOURS: [[f64; 3]; 2] = [[0.7, 0.7, 0.7], [0.1, 0.2, 0.5]];

/// Arguments of `biscale new`.
#[derive(Args, Debug)]
pub struct NewArgs {
    /// What to write: a material of one geometry kind, or another file
    kind: Kind,
    /// The file to write, `-` for standard output; `new fit` also takes a folder that `capture` wrote before it
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// A weaving program's file that a weave is made after, with its colours
    #[arg(long, value_name = "DRAFT.wif")]
    wif: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    board: board::BoardArgs,
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
    /// To print for `capture`: a calibration board and a sheet with markers for the sample, as PDF with a sidecar
    Board,
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
    if args.wif.is_some() && args.kind != Kind::Weave {
        return Err(BadInput::new(format!("a draft is of no use to `biscale new {kind}`"), "write `biscale new weave`")
            .at_field("wif")
            .into());
    }
    if let (Some(option), true) = (args.board.given(), args.kind != Kind::Board) {
        return Err(BadInput::new(format!("this is of no use to `biscale new {kind}`"), "write `biscale new board`")
            .at_field(option)
            .into());
    }
    if args.kind == Kind::Board {
        return board::run(&args.board, file, args.force, common);
    }
    let text = match args.kind {
        Kind::Weave if args.wif.is_some() => after_draft(args.wif.as_deref().unwrap_or(file), file)?,
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

/// A material after the draft `wif`, for the file `file`: each of its colours is a part.
fn after_draft(wif: &Path, file: &Path) -> Result<String> {
    let draft = read_wif(wif, true)?;
    let quoted = |text: &str| serde_json::Value::from(text).to_string();
    let head = |wif: &str, name: &str| {
        format!(
            "format = 1\nname = {}\nunit = \"mm\"\n# Reflections after the first that its look includes, 0 to 64 (default 0, direct light only)\n# bounces = 4\n\n[geometry]\nkind = \"weave\"\nwif = {}\n",
            quoted(name),
            quoted(wif)
        )
    };
    let name = wif.file_stem().unwrap_or_default().to_string_lossy();
    // Which colours become parts is known once the cloth is made.
    let absolute = std::path::absolute(wif).unwrap_or_else(|_| wif.to_path_buf()).display().to_string();
    let all = "\n[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n";
    let trial = Source { path: wif.to_path_buf(), text: head(&absolute, &name) + all };
    let parts = Material::parse(&trial)?.build()?.tile.parts;
    let mut text = format!(
        "# Cloth after the draft {}. Widths, gaps and colours are its own; `biscale new weave -` shows every parameter.\n{}",
        wif.file_name().unwrap_or_default().to_string_lossy().replace(char::is_control, " "),
        head(&seen_from(wif, file), &name)
    );
    for (place, part) in parts.iter().enumerate() {
        let own = part.split_once('-').and_then(|(_, entry)| draft.palette.get(&entry.parse().ok()?));
        let [r, g, b] = own.copied().unwrap_or(NO_COLOURS[place % NO_COLOURS.len()]).map(|c| (c * 1e3).round() / 1e3);
        let whose = if own.is_some() { "the draft's colour, linear RGB" } else { "the draft has no colours: choose one" };
        text += &format!(
            "\n# {whose}\n[[surface]]\npart = {}\nbrdf = {{ model = \"lambert\", albedo = [{r:?}, {g:?}, {b:?}] }}\n",
            quoted(part)
        );
    }
    Ok(text)
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
