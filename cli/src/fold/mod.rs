//! `biscale fold`: sheets to print, cut, fold and glue.

mod check;
mod weave;

use crate::options::{CommonArgs, time};
use crate::output::{self, Target};
use crate::progress;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale_fabricate::assembly;
use biscale_fabricate::design::{Extent, Recipe, Source, check_scale};
use biscale_fabricate::fold::{check_widths, room, surface, unfold};
use biscale_fabricate::layout::Paper;
use biscale_fabricate::mesh::Mesh;
use biscale_fabricate::output::{Content, Format, side_by_side};
use biscale_fabricate::pattern::Pattern;
use biscale_fabricate::preview::{self, Preview};
use biscale_fabricate::sheets::{Look, SILHOUETTE_INSET, Sheets, sheets};
use biscale_fabricate::target;
use biscale_fabricate::texture::Texture;
use biscale_fabricate::unfold::search::Effort;
use biscale_fabricate::unfold::tabs::TabStyle;
use biscale_fabricate::wrap::{self, Wrap};
use clap::{Args, ValueEnum};
use glam::DVec2;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Arguments of `biscale fold`.
#[derive(Args, Debug)]
pub struct FoldArgs {
    /// Material file, or a mesh: .obj, .ply, .stl
    #[arg(required_unless_present = "verify", conflicts_with = "verify")]
    material: Option<PathBuf>,
    /// File to write: .pdf, .svg, .png, .dxf, .fold; several pages become OUT-1.svg ...; OUT.json tells what is where
    #[arg(long, short, value_name = "OUT", required_unless_present = "verify", conflicts_with = "verify")]
    output: Option<PathBuf>,
    /// Check this file (.svg, the first of several pages, or .fold) in place of writing one
    #[arg(long, value_name = "FILE", requires = "against")]
    verify: Option<PathBuf>,
    /// The material or mesh that the file was made from
    #[arg(long, value_name = "MATERIAL", requires = "verify")]
    against: Option<PathBuf>,
    /// Replace outputs that exist, and fold facets narrower than 2 mm
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    sheet: SheetArgs,
    #[command(flatten)]
    search: SearchArgs,
}

/// What is made.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Size")]
struct ShapeArgs {
    /// Size of the sheet in mm, rounded to whole periods (default 120x80)
    #[arg(long, value_name = "WxH", value_parser = size, conflicts_with = "periods", allow_hyphen_values = true)]
    size: Option<DVec2>,
    /// Periods in x and y, in place of a size
    #[arg(long, value_name = "NxM", value_parser = periods, allow_hyphen_values = true)]
    periods: Option<[u32; 2]>,
    /// Printed mm for one mm of the design, or for one unit of a mesh file
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    /// Thickness of the paper in mm: folds take their bend allowance
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = millimetres::<0, 20>, allow_negative_numbers = true)]
    paper_thickness: f64,
    /// Reduce the surface to at most so many facets
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    max_facets: Option<usize>,
    /// Reduce the surface until its normals are off by so many degrees (RMS)
    #[arg(long, value_name = "DEGREES", value_parser = degrees, allow_negative_numbers = true)]
    slope_tolerance: Option<f64>,
    /// Cut facets that are larger than the page
    #[arg(long)]
    split: bool,
    /// Refuse a surface with holes
    #[arg(long)]
    closed: bool,
    /// Wrap sheet for a large object, such as cylinder:radius=40,height=100 (plane, cone, box), with markers for `biscale capture`
    #[arg(long, value_name = "TARGET", conflicts_with_all = ["size", "periods"])]
    on: Option<String>,
    /// Compare the effective BRDF of the folded paper with the design's: what does crafting change?
    #[arg(long)]
    preview: bool,
    /// Where the paper keeps its length, from the inner side of a fold, as a share of its thickness
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, value_parser = share, allow_negative_numbers = true)]
    k_factor: f64,
    /// Inner radius of folds in mm, for --paper-thickness and --preview
    #[arg(long, value_name = "MM", default_value_t = 0.3, value_parser = millimetres::<0, 20>, allow_negative_numbers = true)]
    fold_radius: f64,
}

/// How it is drawn.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Sheets")]
struct SheetArgs {
    /// Paper: a4, a3, letter, each also as a4-landscape ..., or roll:WIDTH in mm
    #[arg(long, value_name = "PAPER", default_value = "a4")]
    page: String,
    /// Border without anything, mm
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = millimetres::<0, 1000>, allow_negative_numbers = true)]
    margin: f64,
    /// Width of the glue tabs, mm
    #[arg(long, value_name = "MM", default_value_t = 5.0, value_parser = millimetres::<1, 50>, allow_negative_numbers = true)]
    tab: f64,
    /// White facets
    #[arg(long)]
    no_colours: bool,
    /// No numbers at the edges
    #[arg(long)]
    no_numbers: bool,
    /// No angles at the folds
    #[arg(long)]
    no_angles: bool,
    /// A mirrored page after each, for the back of the paper
    #[arg(long)]
    back: bool,
    /// Marks that a cutter looks for
    #[arg(long, value_enum, value_name = "KIND")]
    registration: Option<Registration>,
    /// Sizes in an SVG as pixels at so many to the inch (72, 96) and not in mm
    #[arg(long, value_name = "DPI", value_parser = clap::value_parser!(u16).range(10..=2400), allow_negative_numbers = true)]
    svg_dpi: Option<u16>,
    /// Write SVG for Origami Simulator, one file a piece
    #[arg(long)]
    origami_simulator: bool,
    /// Fold the threads of a weave as tubes, and do not weave strips
    #[arg(long)]
    facets: bool,
}

/// How it is searched.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = "Search")]
struct SearchArgs {
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// How long to search, as a factor: 10 searches ten times as long
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = effort, allow_negative_numbers = true)]
    effort: f64,
    /// Stop searching after this time, such as 10s, with the best so far
    #[arg(long, value_name = "TIME", value_parser = time, allow_hyphen_values = true)]
    time_limit: Option<Duration>,
}

/// `--registration`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Registration {
    /// Silhouette's square and two corners
    Silhouette,
}

/// Reads `120x80`.
fn size(text: &str) -> Result<DVec2, String> {
    let remedy = "write width and height in mm, such as 120x80";
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(|| format!("not a size; {remedy}"))?;
    match (w.trim().parse::<f64>(), h.trim().parse::<f64>()) {
        (Ok(w), Ok(h)) if (0.1..=1e5).contains(&w) && (0.1..=1e5).contains(&h) => Ok(DVec2::new(w, h)),
        (Ok(_), Ok(_)) => Err(format!("out of range (0.1 to 100000); {remedy}")),
        _ => Err(format!("not a size; {remedy}")),
    }
}

/// Reads `8x6`.
fn periods(text: &str) -> Result<[u32; 2], String> {
    let remedy = "write two whole numbers from 1 to 10000, such as 8x6";
    let (n, m) = text.split_once(['x', 'X']).ok_or_else(|| format!("not a number of periods; {remedy}"))?;
    match (n.trim().parse::<u32>(), m.trim().parse::<u32>()) {
        (Ok(n), Ok(m)) if (1..=10_000).contains(&n) && (1..=10_000).contains(&m) => Ok([n, m]),
        _ => Err(format!("not a number of periods; {remedy}")),
    }
}

/// Reads a length in a range.
fn millimetres<const LOW: u32, const HIGH: u32>(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (f64::from(LOW)..=f64::from(HIGH)).contains(&v) => Ok(v),
        _ => Err(format!("write a length in mm from {LOW} to {HIGH}")),
    }
}

fn degrees(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v > 0.0 && v <= 90.0 => Ok(v),
        _ => Err("write an angle in degrees, above 0 to 90".to_owned()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.0..=1.0).contains(&v) => Ok(v),
        _ => Err("write a share from 0 to 1; paper has 0.5".to_owned()),
    }
}

fn effort(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (0.01..=10_000.0).contains(&v) => Ok(v),
        _ => Err("write a factor from 0.01 to 10000".to_owned()),
    }
}

/// Papers by name, mm, upright.
const PAPERS: [(&str, f64, f64); 4] = [("a4", 210.0, 297.0), ("a3", 297.0, 420.0), ("letter", 215.9, 279.4), ("a2", 420.0, 594.0)];

impl SheetArgs {
    fn paper(&self) -> Result<Paper> {
        let bad = |problem: String| {
            let remedy = "write a4, a3, a2 or letter, with -landscape if it lies, or roll:WIDTH in mm from 50 to 2000";
            Error::from(BadInput::new(problem, remedy).at_field("--page"))
        };
        let inset = if self.registration.is_some() { SILHOUETTE_INSET } else { 0.0 };
        let text = self.page.to_ascii_lowercase();
        let margin = self.margin;
        if let Some(width) = text.strip_prefix("roll:") {
            let width = width.parse::<f64>().ok().filter(|w| (50.0..=2000.0).contains(w));
            let width = width.ok_or_else(|| bad(format!("\"{}\" is no roll", self.page)))?;
            return Ok(Paper { name: "roll", size: DVec2::new(width, 2000.0), roll: true, margin, inset });
        }
        let (name, lies) = text.strip_suffix("-landscape").map_or((text.as_str(), false), |n| (n, true));
        let Some(&(name, w, h)) = PAPERS.iter().find(|(n, ..)| *n == name) else {
            return Err(bad(format!("\"{}\" is no paper", self.page)));
        };
        let size = if lies { DVec2::new(h, w) } else { DVec2::new(w, h) };
        Ok(Paper { name, size, roll: false, margin, inset })
    }

    fn format(&self, path: &Path) -> Result<Format> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let format = match ending.as_str() {
            "svg" if self.origami_simulator => Format::OrigamiSimulator,
            "svg" => Format::Svg { dpi: self.svg_dpi.map(f64::from) },
            "pdf" => Format::Pdf,
            "png" => Format::Png,
            "fold" => Format::Fold,
            "dxf" => Format::Dxf,
            _ => {
                let problem = if ending.is_empty() {
                    "the name has no ending, which says the format".into()
                } else {
                    format!("the ending .{ending} is not known")
                };
                let remedy = "name a file that ends in .pdf, .svg, .png, .dxf or .fold";
                return Err(BadInput::new(problem, remedy).in_file(path).at_field("--output").into());
            }
        };
        if ending != "svg" && (self.origami_simulator || self.svg_dpi.is_some()) {
            let field = if self.origami_simulator { "--origami-simulator" } else { "--svg-dpi" };
            return Err(BadInput::new("this is an option of SVG", "name an output that ends in .svg, or leave it out")
                .at_field(field)
                .into());
        }
        Ok(format)
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, those of the steps, and i/o; nothing is written then.
pub fn run(args: &FoldArgs, common: &CommonArgs) -> Result<u8> {
    if let (Some(file), Some(against)) = (&args.verify, &args.against) {
        return check::run(file, against, common);
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
        return weave::run(args, common, &source, material, &recipe, paper, format, &outputs);
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

/// What was made.
struct Made {
    title: String,
    mesh: Mesh,
    pattern: Pattern,
    sheets: Sheets,
    notes: Vec<String>,
    /// Volume between the design and a plane through its lowest point, mm³.
    volume: f64,
    /// What the sidecar tells of the wrap sheet.
    wrap: Option<Value>,
    preview: Option<Preview>,
}

impl FoldArgs {
    fn recipe(&self, source: &Source, paper: Paper) -> Result<Recipe> {
        let scale = check_scale(self.shape.scale)?;
        if let Some(on) = &self.shape.on {
            let target = target::Target::parse(on)?;
            if matches!(source, Source::Mesh(..)) {
                let bad = BadInput::new("a mesh file has no period to put on a target", "leave --on out, or write a material file");
                return Err(bad.at_field("--on").into());
            }
            let fit = target.fit(source.period(scale), self.shape.paper_thickness);
            let periods = source.periods(Some(Extent::Periods([fit.around, fit.along])), scale)?;
            return Ok(self.recipe_of(scale, periods, paper));
        }
        let extent = self.shape.size.map(Extent::Size).or(self.shape.periods.map(Extent::Periods));
        Ok(self.recipe_of(scale, source.periods(extent, scale)?, paper))
    }

    fn recipe_of(&self, scale: f64, periods: [u32; 2], paper: Paper) -> Recipe {
        let split = self.shape.split.then(|| room(paper, TabStyle { width: self.sheet.tab }).size.to_array());
        Recipe {
            scale,
            periods,
            thickness: self.shape.paper_thickness,
            fold_radius: self.shape.fold_radius,
            k_factor: self.shape.k_factor,
            max_facets: self.shape.max_facets,
            slope_tolerance_deg: self.shape.slope_tolerance,
            split,
        }
    }

    fn look(&self, title: &str) -> Look {
        Look {
            title: title.to_owned(),
            period: 0.0,
            colours: !self.sheet.no_colours,
            angles: !self.sheet.no_angles,
            numbers: !self.sheet.no_numbers,
            silhouette: self.sheet.registration == Some(Registration::Silhouette),
            back: self.sheet.back,
        }
    }
}

/// The wrap sheet, if one is asked for.
fn wrap_sheet(args: &FoldArgs, source: &Source, recipe: &Recipe, paper: Paper, title: &str) -> Result<Option<(Wrap, Value)>> {
    let Some(on) = &args.shape.on else { return Ok(None) };
    let target = target::Target::parse(on)?;
    let fit = target.fit(source.period(recipe.scale), recipe.thickness);
    let wrap = wrap::wrap(target, fit, recipe.thickness, &source.colours(), paper, title)?;
    let told = json!({
        "target": target,
        "fit": fit,
        "dictionary": "DICT_5X5_100",
        "seam_mm": target::SEAM,
        "origin_mm": wrap.parts[0].origin_mm,
        "turned": wrap.turned,
        "join_mm": wrap::JOIN,
        "joined_size_mm": wrap.size.to_array(),
        "pages": wrap.parts,
        "markers": wrap.markers,
        "patches": wrap.patches,
    });
    Ok(Some((wrap, told)))
}

fn make(args: &FoldArgs, source: &Source, path: &Path, recipe: &Recipe, paper: Paper, control: &Control<'_>) -> Result<Made> {
    (control.progress)("surface", 0.0);
    let (mut mesh, textured) = surface(source, recipe)?;
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
        return Err(BadInput::new(problem, "close them in a mesh program, or leave --closed out").at_field("--closed").into());
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
    sheets.pages.push(assembly::page(&mesh, &pattern, paper, &title));
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

fn preview_of(args: &FoldArgs, source: &Source, recipe: &Recipe, control: &Control<'_>) -> Result<Option<Preview>> {
    if !args.shape.preview {
        return Ok(None);
    }
    let Source::Material(material) = source else {
        return Err(BadInput::new("a mesh file has no BRDF to compare", "leave --preview out, or write a material file")
            .at_field("--preview")
            .into());
    };
    let printed = recipe.scale * source.unit_mm();
    let seed = args.search.seed;
    match source.weave().filter(|_| !args.sheet.facets) {
        Some(weave) => preview::preview_strips(&material.1, weave, printed, recipe.thickness, seed, control),
        None => preview::preview(&material.1, printed, args.shape.fold_radius, recipe.thickness, seed, control),
    }
    .map(Some)
}

/// The files written, as a line of its own.
fn written(names: &[PathBuf]) -> String {
    let list = match names {
        [one, rest @ .., last] if rest.len() > 1 => format!("{} ... {}", one.display(), last.display()),
        _ => names.iter().map(|n| n.display().to_string()).collect::<Vec<_>>().join(", "),
    };
    format!("\nwrote {list}")
}

/// What a preview says, as a line of its own; nothing without one.
fn preview_text(preview: Option<&Preview>) -> String {
    let Some(p) = preview else { return String::new() };
    let sampling = if p.sampling_rms > 0.0 { format!("sampling alone {:.1} %, ", 100.0 * p.sampling_rms) } else { String::new() };
    format!(
        "\npreview: {} change the effective BRDF by {:.1} % (relative RMS of {} pairs; {sampling}error {:.1} %)",
        p.crafted.text(),
        100.0 * p.relative_rms,
        p.pairs,
        100.0 * p.error
    )
}

fn size_text(mesh: &Mesh) -> String {
    let low = mesh.vertices.iter().copied().fold(glam::DVec3::INFINITY, glam::DVec3::min);
    let high = mesh.vertices.iter().copied().fold(glam::DVec3::NEG_INFINITY, glam::DVec3::max);
    let d = high - low;
    format!("{:.0} x {:.0} x {:.0} mm", d.x, d.y, d.z)
}

impl Made {
    fn summary(&self, milliseconds: f64) -> Value {
        let (least, _) = self.mesh.narrowest();
        json!({
            "title": self.title,
            "facets": self.mesh.facets.len(),
            "pieces": self.pattern.pieces.len(),
            "glued_edges": self.pattern.glued.len(),
            "folds": self.pattern.pieces.iter().map(|p| p.folds.iter().filter(|f| f.angle != 0.0).count()).sum::<usize>(),
            "pages": self.sheets.pages.len(),
            "narrowest_facet_mm": least,
            "milliseconds": (milliseconds * 1e3).round() / 1e3,
            "preview": self.preview,
            "notes": self.notes,
        })
    }

    fn tell(&self, milliseconds: f64, names: &[PathBuf]) -> String {
        let kinds: std::collections::BTreeSet<usize> = self.pattern.pieces.iter().map(|p| p.like).collect();
        let mut text = format!(
            "{}: {} facets in {} pieces ({} different), {} glued edges, {} pages; {milliseconds:.0} ms",
            self.title,
            self.mesh.facets.len(),
            self.pattern.pieces.len(),
            kinds.len(),
            self.pattern.glued.len(),
            self.sheets.pages.len()
        );
        for note in &self.notes {
            text.push_str(&format!("\nnote: {note}"));
        }
        text.push_str(&preview_text(self.preview.as_ref()));
        text.push_str(&written(names));
        text
    }
}

/// What other programs want to know of the sheets, in mm.
fn sidecar(made: &Made, recipe: &Value, summary: &Value) -> Value {
    let pieces: Vec<Value> = made
        .pattern
        .pieces
        .iter()
        .zip(&made.sheets.places)
        .enumerate()
        .map(|(k, (piece, place))| {
            let moved = piece.moved(place.x, place.shift);
            let (l, h) = moved.outline.iter().flatten().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
            json!({
                "piece": piece.name,
                "copy": piece.copy,
                "copies": piece.copies,
                "like": made.pattern.pieces[piece.like].name,
                "alike": made.pattern.alike(k),
                "page": place.page + 1,
                "low_mm": l.to_array(),
                "high_mm": h.to_array(),
                "facets": piece.facets.len(),
            })
        })
        .collect();
    let pages: Vec<Value> = made.sheets.pages.iter().map(|p| json!({ "size_mm": p.size.to_array() })).collect();
    json!({
        "creator": biscale_fabricate::fold_file::CREATOR,
        "format": 1,
        "recipe": recipe,
        "summary": summary,
        "pages": pages,
        "pieces": pieces,
        "wrap": made.wrap,
        "order": assembly::order(&made.mesh, &made.pattern).iter().map(|&k| &made.pattern.pieces[k]).filter(|p| p.copy == 1).map(|p| p.name).collect::<Vec<_>>(),
    })
}

/// The files to be written: checked as far as their names are known before the work.
struct Outputs {
    out: PathBuf,
    material: PathBuf,
    force: bool,
}

impl Outputs {
    fn new(out: &Path, force: bool, material: &Path) -> Result<Self> {
        let outputs = Self { out: out.to_path_buf(), material: material.to_path_buf(), force };
        // How many pages there will be is not known yet; one and the sidecar stand for all.
        outputs.target(out)?;
        outputs.target(&out.with_extension("json"))?;
        Ok(outputs)
    }

    fn target(&self, path: &Path) -> Result<Target> {
        Target::new(path, self.force, &[&self.material], made_here)
    }

    /// `OUT.svg`, or `OUT-1.svg` and so on.
    fn numbered(&self, k: usize, count: usize) -> PathBuf {
        if count == 1 {
            return self.out.clone();
        }
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        let ending = self.out.extension().unwrap_or_default().to_string_lossy();
        self.out.with_file_name(format!("{stem}-{}.{ending}", k + 1))
    }

    fn write(&self, files: &[Vec<u8>], sidecar: &Value) -> Result<Vec<PathBuf>> {
        let mut names: Vec<PathBuf> = (0..files.len()).map(|k| self.numbered(k, files.len())).collect();
        let targets: Vec<Target> = names.iter().map(|n| self.target(n)).collect::<Result<_>>()?;
        let beside = self.out.with_extension("json");
        let beside_target = self.target(&beside)?;
        for (target, bytes) in targets.iter().zip(files) {
            target.write(|out| out.write_all(bytes))?;
        }
        let text = serde_json::to_vec_pretty(sidecar).map_err(|e| Error::Numeric(format!("cannot write the sidecar: {e}")))?;
        beside_target.write(|out| out.write_all(&text))?;
        names.push(beside);
        Ok(names)
    }
}

/// Whether a file was written by this command: it says so.
fn made_here(path: &Path) -> bool {
    let says = |text: &[u8]| std::fs::read(path).is_ok_and(|bytes| bytes.windows(text.len()).any(|w| w == text));
    says(biscale_fabricate::fold_file::CREATOR.as_bytes())
}
