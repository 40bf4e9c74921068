//! `biscale fold` of a weave: strips of paper.

use super::FoldArgs;
use super::made::{preview_text, written};
use super::outputs::Outputs;
use crate::common::options::CommonArgs;
use crate::common::output;
use crate::common::progress;
use biscale::error::{Error, Result};
use biscale_fabricate::design::{FoldRecipe, Source};
use biscale_fabricate::drawing::strip_pages;
use biscale_fabricate::formats::{Content, Format};
use biscale_fabricate::mesh::Mesh;
use biscale_fabricate::paper::Paper;
use biscale_fabricate::unfold::{self, Pattern};
use serde_json::json;
use std::path::Path;

/// Writes the strips of a weave.
///
/// # Errors
/// A format that needs facets; strips that do not fit; i/o.
#[expect(clippy::too_many_arguments, reason = "what `fold::run` has read, for one of its two ways")]
pub fn run(
    args: &FoldArgs,
    common: &CommonArgs,
    source: &Source,
    path: &Path,
    recipe: &FoldRecipe,
    paper: Paper,
    format: Format,
    outputs: &Outputs,
) -> Result<u8> {
    if matches!(format, Format::Fold | Format::OrigamiSimulator) {
        return Err(Error::Unsupported {
            what: "a weave as a folding pattern".into(),
            remedy: "it is made of strips: name an output that ends in .pdf, .svg, .png or .dxf, or fold tubes with --facets".into(),
        });
    }
    let weave = source.weave().expect("the caller has looked");
    let scale = recipe.scale * source.unit_mm();
    let title = format!("{}, {} x {} repeats", source.name(path), recipe.periods[0], recipe.periods[1]);
    let (strips, pages, wrap, preview) = progress::with_control(common, |control| {
        (control.progress)("drawing", 0.0);
        let strips = unfold::strips(weave, scale, recipe.periods, |part| source.colour_of_part(part));
        let mut pages = strip_pages(&strips, paper, &args.look(&title), args.force).map_err(Error::from)?;
        let wrap = super::wrap_sheet(args, source, recipe, paper, &title)?.map(|(wrap, told)| {
            pages.splice(0..0, wrap.pages);
            told
        });
        control.check()?;
        let preview = super::preview_of(args, source, recipe, control)?;
        Ok((strips, pages, wrap, preview))
    })?;
    let mut recipe_json = json!(recipe);
    recipe_json["margin_mm"] = json!(paper.margin);
    let (mesh, pattern) = (Mesh { vertices: vec![], facets: vec![], edges: vec![], notes: vec![] }, Pattern::default());
    let content = Content { title: &title, pages: &pages, mesh: &mesh, pattern: &pattern, placed: &[], recipe: &recipe_json };
    let files = format.files(&content)?;
    let warps = strips.iter().filter(|s| s.warp).count();
    let summary = json!({ "title": title, "strips": strips.len(), "warps": warps, "wefts": strips.len() - warps, "pages": pages.len(), "preview": preview, "notes": source.notes() });
    let told: Vec<_> = strips
        .iter()
        .map(|s| json!({ "strip": s.name, "length_mm": s.size.x, "width_mm": s.size.y, "over": s.crossings.iter().map(|c| u8::from(c.over)).collect::<Vec<_>>() }))
        .collect();
    let sidecar = json!({
        "creator": biscale_fabricate::formats::CREATOR,
        "format": 1,
        "recipe": recipe_json,
        "summary": summary,
        "pages": pages.iter().map(|p| json!({ "size_mm": p.size.to_array() })).collect::<Vec<_>>(),
        "strips": told,
        "wrap": wrap,
    });
    let names = outputs.write(&files, &sidecar)?;
    if common.json {
        output::print_json(&json!({ "outputs": names, "summary": summary }))?;
        return Ok(0);
    }
    let mut text = format!("{title}: {warps} warp and {} weft strips, {} pages", strips.len() - warps, pages.len());
    for note in source.notes() {
        text.push_str(&format!("\nnote: {note}"));
    }
    text.push_str(&preview_text(preview.as_ref()));
    text.push_str(&written(&names));
    output::tell(common, &text);
    Ok(0)
}
