//! `biscale fold` of a weave: strips of paper.

use super::folded::{preview_text, written};
use super::job::FoldJob;
use crate::common::options::CommonArgs;
use crate::common::output;
use crate::common::progress;
use biscale::error::{Error, Result};
use biscale::geometry::weave::Weave;
use biscale_fabricate::drawing::strip_pages;
use biscale_fabricate::formats::{CREATOR, Content, Format};
use biscale_fabricate::mesh::Mesh;
use biscale_fabricate::unfold::{self, Pattern};
use serde_json::{Value, json};

/// Writes the strips of a weave.
///
/// # Errors
/// A format that needs facets; strips that do not fit; i/o.
pub(super) fn run(job: &FoldJob<'_>, weave: &Weave, common: &CommonArgs) -> Result<u8> {
    if matches!(job.format, Format::Fold | Format::OrigamiSimulator) {
        return Err(Error::Unsupported {
            what: "a weave as a folding pattern".into(),
            remedy: "it is made of strips: name an output that ends in .pdf, .svg, .png or .dxf, or fold tubes with `facets`".into(),
        });
    }
    let (source, recipe) = (job.source, &job.recipe);
    let title = format!("{}, {} x {} repeats", source.name(job.path), recipe.periods[0], recipe.periods[1]);
    let (strips, pages, wrap, preview) = progress::with_control(common, |control| {
        (control.progress)("drawing", 0.0);
        let scale = recipe.scale * source.unit_mm();
        let strips = unfold::strips(weave, scale, recipe.periods, |part| source.colour_of_part(part));
        let mut pages = strip_pages(&strips, job.paper, &job.args.look(&title), job.args.force).map_err(Error::from)?;
        let wrap = job.wrap_sheet(&title)?.map(|(wrap, told)| {
            pages.splice(0..0, wrap.pages);
            told
        });
        control.check()?;
        let preview = job.preview(control)?;
        Ok((strips, pages, wrap, preview))
    })?;
    let recipe = job.recipe_json();
    let (mesh, pattern) = (Mesh { vertices: vec![], facets: vec![], edges: vec![], notes: vec![] }, Pattern::default());
    let chosen = job.args.sheet.written(&pages);
    let content = Content { title: &title, pages: &chosen, mesh: &mesh, pattern: &pattern, placed: &[], recipe: &recipe };
    let files = job.format.files(&content)?;
    let warps = strips.iter().filter(|s| s.warp).count();
    let wefts = strips.len() - warps;
    let notes = common.flags.in_texts(source.notes());
    let summary = json!({
        "title": title, "strips": strips.len(), "warps": warps, "wefts": wefts, "pages": pages.len(), "preview": preview, "notes": notes,
    });
    let strip = |s: &unfold::Strip| -> Value {
        let over: Vec<u8> = s.crossings.iter().map(|c| u8::from(c.over)).collect();
        json!({ "strip": s.name, "length_mm": s.size.x, "width_mm": s.size.y, "over": over })
    };
    let sidecar = json!({
        "creator": CREATOR,
        "format": 1,
        "recipe": recipe,
        "summary": summary,
        "pages": pages.iter().map(|p| json!({ "size_mm": p.size.to_array() })).collect::<Vec<_>>(),
        "strips": strips.iter().map(strip).collect::<Vec<_>>(),
        "wrap": wrap,
    });
    let names = job.outputs.write(&files, &sidecar)?;
    if common.json {
        output::print_json(&json!({ "outputs": names, "summary": summary }))?;
        return Ok(0);
    }
    let mut text = format!("{title}: {warps} warp and {wefts} weft strips, {} pages", pages.len());
    for note in &notes {
        text.push_str(&format!("\nnote: {note}"));
    }
    text.push_str(&preview_text(preview.as_ref()));
    text.push_str(&written(&names));
    output::tell(common, &text);
    Ok(0)
}
