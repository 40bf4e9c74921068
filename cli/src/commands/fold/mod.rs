//! `biscale fold`: sheets to print, cut, fold and glue.

mod args;
mod made;
mod outputs;
mod strips;
mod verify;

pub use args::FoldArgs;

use crate::common::options::CommonArgs;
use crate::common::output;
use crate::common::progress;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale_fabricate::design::{FoldRecipe, Source, Texture};
use biscale_fabricate::drawing::{Look, assembly_page, sheets};
use biscale_fabricate::formats::{Content, side_by_side};
use biscale_fabricate::paper::Paper;
use biscale_fabricate::preview::{self, Preview};
use biscale_fabricate::surface::{check_widths, prepare};
use biscale_fabricate::unfold::{Effort, TabStyle, room, unfold};
use biscale_fabricate::wrap::{self, Target, Wrap};
use made::{Made, sidecar, size_text};
use outputs::Outputs;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// Bad input, those of the steps, and i/o; nothing is written then.
pub fn run(args: &FoldArgs, common: &CommonArgs) -> Result<u8> {
    if let (Some(file), Some(against)) = (&args.verify, &args.against) {
        return verify::run(file, against, common);
    }
    let (Some(material), Some(out)) = (&args.material, &args.output) else {
        return Err(BadInput::new("there is nothing to fold", "name a material file and an output with -o").into());
    };
    let format = args.sheet.format(out)?;
    let paper = args.sheet.paper()?;
    paper.check()?;
    let outputs = Outputs::new(out, args.force, material)?;
    let start = Instant::now();
    let source = Source::load(material)?;
    let in_file = |bad: BadInput| Error::from(if bad.file.is_none() && bad.field.is_none() { bad.in_file(material) } else { bad });
    let recipe = args.recipe(&source, paper)?;
    if source.weave().is_some() && !args.sheet.facets {
        return strips::run(args, common, &source, material, &recipe, paper, format, &outputs);
    }
    let made = progress::with_control(common, |control| {
        make(args, &source, material, &recipe, paper, control).map_err(|e| match e {
            Error::BadInput(bad) => in_file(bad),
            other => other,
        })
    })?;
    let milliseconds = start.elapsed().as_secs_f64() * 1e3;
    let mut recipe_json = json!(recipe);
    recipe_json["margin_mm"] = json!(paper.margin);
    recipe_json["design_volume_mm3"] = json!(made.volume);
    let placed = side_by_side(&made.pattern, &made.sheets);
    let content = Content {
        title: &made.title,
        pages: &made.sheets.pages,
        mesh: &made.mesh,
        pattern: &made.pattern,
        placed: &placed,
        recipe: &recipe_json,
    };
    let files = format.files(&content)?;
    let summary = made.summary(milliseconds);
    let names = outputs.write(&files, &sidecar(&made, &recipe_json, &summary))?;
    if common.json {
        output::print_json(&json!({ "outputs": names, "summary": summary }))?;
        return Ok(0);
    }
    output::tell(common, &made.tell(milliseconds, &names));
    Ok(0)
}

/// Inner radius of folds that a preview rounds them by, mm, if none is given.
const PREVIEW_RADIUS: f64 = 0.3;

/// The wrap sheet, if one is asked for.
fn wrap_sheet(args: &FoldArgs, source: &Source, recipe: &FoldRecipe, paper: Paper, title: &str) -> Result<Option<(Wrap, Value)>> {
    let Some(on) = &args.shape.on else { return Ok(None) };
    let target = Target::parse(on)?;
    let fit = target.fit(source.period(recipe.scale), recipe.thickness);
    let wrap = wrap::wrap(target, fit, recipe.thickness, &source.colours(), paper, title)?;
    let told = json!({
        "target": target,
        "fit": fit,
        "dictionary": "DICT_5X5_100",
        "seam_mm": wrap::SEAM,
        "origin_mm": wrap.parts[0].origin_mm,
        "turned": wrap.turned,
        "join_mm": wrap::JOIN,
        "joined_size_mm": wrap.size.to_array(),
        "cut_margins_mm": wrap.margins,
        "pages": wrap.parts,
        "markers": wrap.markers,
        "patches": wrap.patches,
    });
    Ok(Some((wrap, told)))
}

fn make(args: &FoldArgs, source: &Source, path: &Path, recipe: &FoldRecipe, paper: Paper, control: &Control<'_>) -> Result<Made> {
    (control.progress)("surface", 0.0);
    let (mut mesh, textured) = prepare(source, recipe)?;
    let texture = if textured { Texture::new(source, recipe.scale, recipe.periods) } else { None };
    if let Some(texture) = &texture {
        texture.tint(&mut mesh);
    }
    let mut notes = source.notes();
    notes.extend(mesh.notes.iter().cloned());
    let parts = mesh.components().len();
    if parts > 1 {
        notes.push(format!("the surface has {parts} separate parts: nothing but glue holds them together"));
    }
    let holes = mesh.border_loops();
    if args.shape.closed && holes > 0 {
        let problem = format!("the surface has {holes} holes, or borders");
        return Err(BadInput::new(problem, "close them in a mesh program, or leave --closed out").at_field("closed").into());
    }
    notes.extend(check_widths(&mesh, recipe.scale, args.force)?);
    control.check()?;
    let title = format!("{}, {}", source.name(path), size_text(&mesh));
    let wrap = wrap_sheet(args, source, recipe, paper, &title)?;
    let tabs = TabStyle { width: args.sheet.tab };
    let default = Effort::default();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a positive number far below 2^63")]
    let effort = Effort { seed: args.search.seed, work: (default.work as f64 * args.search.effort) as u64, ..default };
    let begin = (control.clock)();
    let limit = args.search.time_limit.map_or(f64::INFINITY, |t| t.as_secs_f64());
    let late = std::sync::atomic::AtomicBool::new(false);
    let stop = |share: f64| {
        (control.progress)("unfolding", 0.9 * share);
        let over = (control.clock)() - begin > limit;
        late.fetch_or(over, std::sync::atomic::Ordering::Relaxed);
        over || control.check().is_err()
    };
    let (pattern, bare) = unfold(&mesh, texture.is_some(), room(paper, tabs), tabs, effort, &stop)?;
    control.check()?;
    if late.into_inner() {
        notes.push("stopped by the time limit: the pattern depends on the machine's speed".to_owned());
    }
    if bare > 0 {
        notes.push(format!("{bare} glued edges have no place for a tab: join them with tape"));
    }
    (control.progress)("drawing", 0.92);
    let period = if matches!(source, Source::Material(_)) { source.period(recipe.scale).x } else { 0.0 };
    let look = Look { period, ..args.look(&title) };
    let mut sheets = sheets(&mesh, &pattern, paper, &look, texture.as_ref())?;
    if sheets.missed > 0 {
        notes.push(format!("{} numbers found no place at their edges", sheets.missed));
    }
    sheets.pages.push(assembly_page(&mesh, &pattern, paper, &title));
    let wrap = wrap.map(|(wrap, told)| {
        sheets.places.iter_mut().for_each(|p| p.page += wrap.pages.len());
        sheets.pages.splice(0..0, wrap.pages);
        told
    });
    // Of the design's own triangles where they are folded as they are; a reduced or thick one is its own design.
    let volume = if recipe.thickness == 0.0 && recipe.max_facets.is_none() && recipe.slope_tolerance_deg.is_none() {
        source.triangles(recipe.scale, recipe.periods).volume()
    } else {
        mesh.volume()
    };
    let preview = preview_of(args, source, recipe, control)?;
    Ok(Made { title, mesh, pattern, sheets, notes, volume, wrap, preview })
}

fn preview_of(args: &FoldArgs, source: &Source, recipe: &FoldRecipe, control: &Control<'_>) -> Result<Option<Preview>> {
    if !args.shape.preview {
        return Ok(None);
    }
    let Source::Material(material) = source else {
        return Err(BadInput::new("a mesh file has no BRDF to compare", "leave --preview out, or write a material file")
            .at_field("preview")
            .into());
    };
    let printed = recipe.scale * source.unit_mm();
    let seed = args.search.seed;
    match source.weave().filter(|_| !args.sheet.facets) {
        Some(weave) => preview::preview_strips(&material.1, weave, printed, recipe.thickness, seed, control),
        None => preview::preview(&material.1, printed, args.shape.fold_radius.unwrap_or(PREVIEW_RADIUS), recipe.thickness, seed, control),
    }
    .map(Some)
}
