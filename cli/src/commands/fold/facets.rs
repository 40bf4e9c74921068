//! `biscale fold` of a surface: facets, unfolded into pieces.

use super::folded::{FoldedDesign, sidecar, size_text};
use super::job::FoldJob;
use crate::common::options::CommonArgs;
use crate::common::output;
use crate::common::progress;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale::numerics::cast::truncate_u64;
use biscale_fabricate::design::{Source, Texture};
use biscale_fabricate::drawing::{Look, Sheets, assembly_pages, sheets};
use biscale_fabricate::formats::{Content, side_by_side};
use biscale_fabricate::mesh::Mesh;
use biscale_fabricate::sheet_recipe::SheetRecipe;
use biscale_fabricate::surface::{check_widths, prepare};
use biscale_fabricate::unfold::{Effort, Pattern, Tab, room, unfold};
use serde_json::json;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Tabs narrower than this are told, mm. Chosen, not measured: what a drop of glue covers.
const NARROW_TAB: f64 = 2.0;

/// Share of the progress that is done when the pattern is unfolded.
const UNFOLDED: f64 = 0.9;

/// Writes the pattern of a surface; `start` is when the command began.
///
/// # Errors
/// Those of the steps; i/o.
pub(super) fn run(job: &FoldJob<'_>, common: &CommonArgs, start: Instant) -> Result<u8> {
    let mut folded = progress::with_control(common, |control| fold(job, control).map_err(|error| placed(error, job)))?;
    folded.notes = common.flags.in_texts(folded.notes);
    let milliseconds = start.elapsed().as_secs_f64() * 1e3;
    let mut recipe = job.recipe_json();
    recipe["design_volume_mm3"] = json!(folded.volume);
    recipe["sheet"] = json!(SheetRecipe { svg_dpi: job.args.sheet.svg_dpi.map(f64::from), ..folded.sheets.recipe.clone() });
    let placed = side_by_side(&folded.pattern, &folded.sheets);
    let pages = job.args.sheet.written(&folded.sheets.pages);
    let content =
        Content { title: &folded.title, pages: &pages, mesh: &folded.mesh, pattern: &folded.pattern, placed: &placed, recipe: &recipe };
    let files = job.format.files(&content)?;
    let summary = folded.summary();
    let names = job.outputs.write(&files, &sidecar(&folded, &recipe, &summary))?;
    if common.json {
        output::print_json(&json!({ "outputs": names, "milliseconds": (milliseconds * 1e3).round() / 1e3, "summary": summary }))?;
        return Ok(0);
    }
    output::tell(common, &folded.tell(milliseconds, &names));
    Ok(0)
}

/// A mistake that is neither at a field nor in a file is one of the design.
fn placed(error: Error, job: &FoldJob<'_>) -> Error {
    match error {
        Error::BadInput(bad) if bad.file.is_none() && bad.field.is_none() => bad.in_file(job.path).into(),
        other => other,
    }
}

/// From the design to the sheets.
fn fold(job: &FoldJob<'_>, control: &Control<'_>) -> Result<FoldedDesign> {
    let (args, source, recipe, paper) = (job.args, job.source, &job.recipe, job.paper);
    (control.progress)("surface", 0.0);
    let (mut mesh, textured) = prepare(source, recipe)?;
    let texture = if textured { Texture::new(source, recipe.scale, recipe.periods) } else { None };
    if let Some(texture) = &texture {
        texture.tint(&mut mesh);
    }
    let mut notes = source.notes();
    notes.extend(mesh.notes.iter().cloned());
    notes.extend(check_parts(job, &mesh)?);
    notes.extend(check_widths(&mesh, recipe.scale, args.force)?);
    control.check()?;
    let title = format!("{}, {}", source.name(job.path), size_text(&mesh));
    let wrap = job.wrap_sheet(&title)?;
    let pattern = unfolded(job, &mesh, texture.is_some(), &mut notes, control)?;
    (control.progress)("drawing", UNFOLDED);
    let period = if matches!(source, Source::Material(_)) { source.period(recipe.scale).x } else { 0.0 };
    let look = Look { period, ..args.look(&title) };
    let assembly = assembly_pages(&mesh, &pattern, paper, &title);
    let mut sheets: Sheets = sheets(&mesh, &pattern, paper, &look, texture.as_ref(), assembly)?;
    notes.extend(missing_texts(&sheets.recipe));
    let wrap = wrap.map(|(wrap, told)| {
        sheets.places.iter_mut().for_each(|p| p.page += wrap.pages.len());
        sheets.recipe.wrap_pages = wrap.pages.len();
        sheets.pages.splice(0..0, wrap.pages);
        told
    });
    let volume = volume(job, &mesh);
    let preview = job.preview(control)?;
    Ok(FoldedDesign { title, mesh, pattern, sheets, notes, volume, wrap, preview })
}

/// Says which texts found no place on the sheets.
fn missing_texts(recipe: &SheetRecipe) -> Option<String> {
    let counts = [
        (recipe.without_name.len(), "names of pieces"),
        (recipe.without_number.len(), "numbers at edges"),
        (recipe.without_angle.len(), "fold angles"),
    ];
    let told: Vec<String> = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    (!told.is_empty()).then(|| format!("{} found no place in type that is read", told.join(", ")))
}

/// Says of how many parts a surface is; refuses one with holes where it must be closed.
fn check_parts(job: &FoldJob<'_>, mesh: &Mesh) -> Result<Option<String>> {
    let holes = mesh.border_loops();
    if job.args.shape.closed && holes > 0 {
        let problem = format!("the surface has {holes} holes, or borders");
        return Err(BadInput::new(problem, "close them in a mesh program, or leave `closed` out").at_field("closed").into());
    }
    let parts = mesh.components().len();
    Ok((parts > 1).then(|| format!("the surface has {parts} separate parts: nothing but glue holds them together")))
}

/// The pattern that the search finds within its effort and time.
fn unfolded(job: &FoldJob<'_>, mesh: &Mesh, textured: bool, notes: &mut Vec<String>, control: &Control<'_>) -> Result<Pattern> {
    let tabs = job.args.sheet.tabs();
    let default = Effort::default();
    let work = truncate_u64(default.work as f64 * job.args.search.effort);
    let effort = Effort { seed: job.args.search.seed, work, ..default };
    let begin = (control.clock)();
    let limit = job.args.search.time_limit.map_or(f64::INFINITY, |t| t.as_secs_f64());
    let late = AtomicBool::new(false);
    let stop = |share: f64| {
        (control.progress)("unfolding", UNFOLDED * share);
        let over = (control.clock)() - begin > limit;
        late.fetch_or(over, Ordering::Relaxed);
        over || control.check().is_err()
    };
    let (mut pattern, bare) = unfold(mesh, textured, room(job.paper, tabs), tabs, effort, &stop)?;
    pattern.flat_angle = job.args.sheet.flat_angle.to_radians();
    control.check()?;
    if late.into_inner() {
        notes.push("stopped by the time limit: the pattern depends on the machine's speed".to_owned());
    }
    if bare > 0 && !job.args.sheet.no_tabs {
        notes.push(format!("{bare} glued edges have no place for a tab: join them with tape"));
    }
    notes.extend(narrow_tabs(&pattern));
    Ok(pattern)
}

/// Says how many tabs are too narrow for fingers.
fn narrow_tabs(pattern: &Pattern) -> Option<String> {
    let widths = pattern.pieces.iter().flat_map(|p| &p.tabs).map(Tab::width);
    let (count, narrow, least) = widths.fold((0_usize, 0_usize, f64::INFINITY), |(count, narrow, least), w| {
        (count + 1, narrow + usize::from(w < NARROW_TAB), least.min(w))
    });
    (narrow > 0)
        .then(|| format!("{narrow} of {count} tabs are narrower than {NARROW_TAB} mm, the least {least:.1} mm: join these edges with tape"))
}

/// Volume between the design and a plane through its lowest point, mm³: of the design's own triangles where they are folded as they are; a reduced
/// or thick one is its own design.
fn volume(job: &FoldJob<'_>, mesh: &Mesh) -> f64 {
    let recipe = &job.recipe;
    if recipe.thickness == 0.0 && recipe.max_facets.is_none() && recipe.slope_tolerance_deg.is_none() {
        job.source.triangles(recipe.scale, recipe.periods).volume()
    } else {
        mesh.volume()
    }
}
