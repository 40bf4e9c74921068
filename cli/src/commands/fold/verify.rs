//! `biscale fold --verify`: reads a written pattern again and refolds it.

use crate::common::options::CommonArgs;
use crate::common::output;
use biscale::bounded_file::{MAX_DATA_BYTES, read_bounded};
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::weave::Weave;
use biscale_fabricate::design::{FoldRecipe, Source, Texture};
use biscale_fabricate::surface::prepare;
use biscale_fabricate::verify::{ReadPattern, read_fold, read_svg, verify, verify_strips};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Checks a file, and prints the verdict in one line, with `--quiet`, too; returns the exit status.
///
/// # Errors
/// Files that cannot be read or are none of this program's; i/o.
pub fn run(file: &Path, against: &Path, common: &CommonArgs) -> Result<u8> {
    let (seen, files) = read(file)?;
    let recipe: FoldRecipe = serde_json::from_value(seen.recipe.clone())
        .map_err(|e| BadInput::new(format!("the file keeps no recipe: {e}"), "name a file that `biscale fold` wrote").in_file(file))?;
    let margin = seen.recipe.get("margin_mm").and_then(serde_json::Value::as_f64).unwrap_or(0.0);
    let source = Source::load(against)?;
    let scale = biscale_fabricate::design::check_scale(recipe.scale)?;
    // Refuses what a file asks for beyond all measure.
    source.periods(matches!(source, Source::Material(_)).then_some(biscale_fabricate::design::Extent::Periods(recipe.periods)), scale)?;
    if let (Some(weave), false) = (source.weave(), seen.strips.is_empty()) {
        return strips(&seen, weave, scale * source.unit_mm(), &recipe, margin, file, common);
    }
    let (mut design, textured) = prepare(&source, &recipe).map_err(|bad| bad.in_file(against))?;
    if let Some(texture) = Texture::new(&source, recipe.scale, recipe.periods).filter(|_| textured) {
        texture.tint(&mut design);
    }
    let report = verify(&seen, &design, margin).map_err(|bad| bad.in_file(file))?;
    let fine = report.failures.is_empty();
    if common.json {
        output::print_json(&json!({ "files": files, "report": report, "ok": fine }))?;
    } else {
        output::tell(common, &report.lines());
        for failure in &report.failures {
            output::say(&format!("wrong: {failure}"));
        }
        output::print(if fine { "the pattern folds to the design\n" } else { "the pattern is not right\n" })?;
    }
    Ok(if fine { 0 } else { 1 })
}

/// The same for the strips of a weave.
fn strips(seen: &ReadPattern, weave: &Weave, scale: f64, recipe: &FoldRecipe, margin: f64, file: &Path, common: &CommonArgs) -> Result<u8> {
    let wrong = verify_strips(seen, weave, scale, recipe.periods, margin).map_err(|bad| bad.in_file(file))?;
    if common.json {
        output::print_json(&json!({ "strips": seen.strips.len(), "failures": wrong, "ok": wrong.is_empty() }))?;
    } else {
        wrong.iter().for_each(|w| output::say(&format!("wrong: {w}")));
        let end = if wrong.is_empty() { "they weave to the design" } else { "the pattern is not right" };
        output::print(&format!("{} strips, {} crossings; {end}\n", seen.strips.len(), seen.crossings.len()))?;
    }
    Ok(u8::from(!wrong.is_empty()))
}

/// Reads all pages of a pattern: `OUT.svg`, or `OUT-1.svg` and those that follow it.
fn read(file: &Path) -> Result<(ReadPattern, Vec<PathBuf>)> {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let text = |path: &Path| -> Result<String> {
        let bytes = read_bounded(path, MAX_DATA_BYTES, "name an SVG or FOLD file")?;
        String::from_utf8(bytes).map_err(|_| BadInput::new("this is no text", "name an SVG or FOLD file").in_file(path).into())
    };
    let placed = |bad: BadInput| Error::from(bad.in_file(file));
    match ending.as_str() {
        "fold" => Ok((read_fold(&text(file)?).map_err(placed)?, vec![file.to_path_buf()])),
        "svg" => {
            let mut files = vec![file.to_path_buf()];
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            if let Some(stem) = stem.strip_suffix("-1") {
                files.extend((2..).map(|k| file.with_file_name(format!("{stem}-{k}.svg"))).take_while(|p| p.is_file()));
            }
            let pages = files.iter().map(|f| text(f)).collect::<Result<Vec<_>>>()?;
            Ok((read_svg(&pages).map_err(placed)?, files))
        }
        _ => Err(BadInput::new(format!("the ending .{ending} is not one that can be verified"), "name an SVG or FOLD file")
            .in_file(file)
            .into()),
    }
}
