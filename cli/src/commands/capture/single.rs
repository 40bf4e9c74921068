//! `biscale capture PHOTOGRAPH`: what one photograph of a surface tells by itself.

use super::args::CaptureArgs;
use crate::common::exit;
use crate::common::options::CommonArgs;
use crate::common::output::{self, OutputFolder};
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::weave::read_wif;
use biscale_capture::photo;
use biscale_capture::single::{Single, look};
use biscale_capture::weave::WeaveOptions;
use serde_json::{Value, json};
use std::path::Path;

/// First words of `creator` in a folder of this command.
const CREATOR: &str = "biscale capture of one photograph";
/// The file that tells all, and the material.
const FILES: [&str; 2] = ["single.json", "guess.toml"];

/// Whether a file is a photograph, or would be one if it were converted, by its ending.
pub(super) fn is_photograph(path: &Path) -> bool {
    let ending = photo::ending(path);
    photo::ENDINGS.contains(&&*ending) || (ending != "toml" && photo::is_convertible(path))
}

/// Looks at the photograph, writes what it tells and a material, and says it. Returns the exit status: 1 if nothing repeats in it.
///
/// # Errors
/// Bad input and i/o; nothing is written then.
pub(super) fn run(args: &CaptureArgs, common: &CommonArgs) -> Result<u8> {
    let Some(folder) = &args.output else {
        let remedy = format!("write `biscale capture {} -o seen`", args.shoot.display());
        return Err(BadInput::new("the folder to write is not named", remedy).at_field("output").into());
    };
    let made_here = |folder: &Path| output::has_creator(&folder.join(FILES[0]), CREATOR);
    let target = OutputFolder::new(folder, args.force, made_here)?;
    let draft = match &args.wif {
        Some(file) => Some(read_wif(file, false)?.draft),
        None => args.weave.clone(),
    };
    let single = look(&args.shoot, &WeaveOptions { draft })?;
    let told = described(&single, &args.shoot);
    let text = serde_json::to_vec_pretty(&told).map_err(|e| Error::Numeric(format!("cannot write {}: {e}", FILES[0])))?;
    target.write(|part| {
        let write = |name: &str, bytes: &[u8]| {
            let path = part.join(name);
            std::fs::write(&path, bytes).map_err(|source| Error::Io { action: "write", path, source })
        };
        write(FILES[0], &text)?;
        single.material.as_ref().map_or(Ok(()), |material| write(FILES[1], material.as_bytes()))
    })?;
    let recognised = single.analysis.weave.is_some() || single.analysis.relief.is_some();
    if common.json {
        output::print_json(&told)?;
    } else if common.quiet {
        output::print(&format!("{}: {}\n", args.shoot.display(), verdict(&single)))?;
    } else {
        output::tell(common, &summary(&single, folder));
    }
    Ok(if recognised { 0 } else { exit::FAILED })
}

fn described(single: &Single, file: &Path) -> Value {
    let pairs = |list: &[(&str, String)]| list.iter().map(|(what, value)| json!({ "what": what, "value": value })).collect::<Vec<_>>();
    json!({
        "creator": format!("{CREATOR} {}", env!("CARGO_PKG_VERSION")),
        "format": 1,
        "photograph": file.file_name().unwrap_or_default().to_string_lossy(),
        "known": pairs(&single.known),
        "doubts": single.doubts,
        "unknown": single.unknown.iter().map(|(what, by)| json!({ "what": what, "told_by": by })).collect::<Vec<_>>(),
        "analysis": single.analysis.to_json(),
        "material": single.material.as_ref().map(|_| FILES[1]),
    })
}

/// What was recognised, or why nothing was.
fn verdict(single: &Single) -> String {
    match (single.known.first(), single.doubts.first()) {
        (Some((what, value)), _) => format!("{what} {value}"),
        (None, Some(doubt)) => format!("nothing is known: {doubt}"),
        (None, None) => "nothing is known".to_owned(),
    }
}

fn summary(single: &Single, folder: &Path) -> String {
    let mut lines = vec!["known:".to_owned()];
    lines.extend(single.known.iter().map(|(what, value)| format!("  {what}: {value}")));
    if single.known.is_empty() {
        lines.push("  nothing".into());
    }
    lines.extend(single.doubts.iter().map(|doubt| format!("doubtful: {doubt}")));
    lines.push("not known, and what would tell it:".into());
    lines.extend(single.unknown.iter().map(|(what, by)| format!("  {what}: {by}")));
    match &single.material {
        Some(_) => lines.push(format!("wrote {}, a material that may look so; `biscale plot` draws it", folder.join(FILES[1]).display())),
        None => lines.push(format!("wrote {}", folder.join(FILES[0]).display())),
    }
    lines.join("\n")
}
