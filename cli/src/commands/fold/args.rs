//! Arguments of `biscale fold`, and what they mean to the library.

use crate::common::options::time;
use crate::common::output;
use crate::common::paper;
use biscale::error::{BadInput, Result};
use biscale_fabricate::design::{Extent, FoldRecipe, Source, check_scale};
use biscale_fabricate::drawing::{Layer, Look, Page, SILHOUETTE_INSET, only, perforated};
use biscale_fabricate::formats::Format;
use biscale_fabricate::paper::Paper;
use biscale_fabricate::unfold::{FLAT_ANGLE_DEG, TabStyle, room};
use biscale_fabricate::wrap::Target;
use clap::{Args, ValueEnum};
use glam::DVec2;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of `biscale fold`.
#[derive(Args, Debug)]
pub struct FoldArgs {
    /// Material file, or a mesh: .obj, .ply, .stl
    #[arg(required_unless_present = "verify", conflicts_with = "verify")]
    pub(crate) material: Option<PathBuf>,
    /// File to write: .pdf, .svg, .png, .dxf, .fold; several pages become OUT-1.svg ...; OUT.json tells what is where
    #[arg(long, short, value_name = "OUT", required_unless_present = "verify", conflicts_with = "verify")]
    pub(super) output: Option<PathBuf>,
    /// Check this file (.svg, the first of several pages, or .fold) in place of writing one
    #[arg(long, value_name = "FILE", requires = "against")]
    pub(super) verify: Option<PathBuf>,
    /// The material or mesh that the file was made from
    #[arg(long, value_name = "MATERIAL", requires = "verify")]
    pub(super) against: Option<PathBuf>,
    /// Replace outputs that exist, and fold facets narrower than 2 mm
    #[arg(long)]
    pub(super) force: bool,
    #[command(flatten)]
    pub(super) shape: ShapeArgs,
    #[command(flatten)]
    pub(super) sheet: SheetArgs,
    #[command(flatten)]
    pub(super) search: SearchArgs,
}

/// What is made.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Size")]
pub(super) struct ShapeArgs {
    /// Size of the sheet in mm, rounded to whole periods (default 120x80)
    #[arg(long, value_name = "WxH", value_parser = size, conflicts_with = "periods", allow_hyphen_values = true)]
    pub(super) size: Option<DVec2>,
    /// Periods in x and y, in place of a size
    #[arg(long, value_name = "NxM", value_parser = periods, allow_hyphen_values = true)]
    pub(super) periods: Option<[u32; 2]>,
    /// Printed mm for one mm of the design, or for one unit of a mesh file
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    pub(super) scale: f64,
    /// Thickness of the paper in mm: folds take their bend allowance
    #[arg(long, value_name = "MM", default_value_t = 0.0, value_parser = millimetres::<0, 20>, allow_negative_numbers = true)]
    pub(super) paper_thickness: f64,
    /// Reduce the surface to at most so many facets
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(super) max_facets: Option<usize>,
    /// Reduce the surface until its normals are off by so many degrees (RMS)
    #[arg(long, value_name = "DEGREES", value_parser = degrees, allow_negative_numbers = true)]
    pub(super) slope_tolerance: Option<f64>,
    /// Cut facets that are larger than the page
    #[arg(long)]
    pub(super) split: bool,
    /// Refuse a surface with holes
    #[arg(long)]
    pub(super) closed: bool,
    /// Wrap sheet for a large object, such as cylinder:radius=40,height=100 (plane, cone, box), with markers for `biscale capture`
    #[arg(long, value_name = "TARGET", conflicts_with_all = ["size", "periods"])]
    pub(super) on: Option<String>,
    /// Compare the effective BRDF of the folded paper with the design's: what does crafting change?
    #[arg(long)]
    pub(super) preview: bool,
    /// Where the paper keeps its length, from the inner side of a fold, as a share of its thickness
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, value_parser = share, allow_negative_numbers = true)]
    pub(super) k_factor: f64,
    /// Inner radius of folds in mm; by default 0 for --paper-thickness (pressed sharp) and 0.3 for --preview (as they are seen)
    #[arg(long, value_name = "MM", value_parser = millimetres::<0, 20>, allow_negative_numbers = true)]
    pub(super) fold_radius: Option<f64>,
}

/// How it is drawn.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Sheets")]
pub(super) struct SheetArgs {
    /// Paper: a5, a4, a3, a2, letter, legal, tabloid, each also as a4-landscape ..., 200x300 in mm, 12x12in, or roll:WIDTH in mm
    #[arg(long, value_name = "PAPER", default_value = "a4")]
    pub(super) page: String,
    /// Border without anything, mm
    #[arg(long, value_name = "MM", default_value_t = 10.0, value_parser = millimetres::<0, 1000>, allow_negative_numbers = true)]
    pub(super) margin: f64,
    /// Width of the glue tabs, mm
    #[arg(long, value_name = "MM", default_value_t = 5.0, value_parser = millimetres::<1, 50>, allow_negative_numbers = true)]
    pub(super) tab: f64,
    /// No glue tabs: edges are joined with tape
    #[arg(long, conflicts_with = "tab")]
    pub(super) no_tabs: bool,
    /// White facets
    #[arg(long)]
    pub(super) no_colours: bool,
    /// No numbers at the edges
    #[arg(long)]
    pub(super) no_numbers: bool,
    /// Folds below this angle in degrees are neither scored nor labelled
    #[arg(long, value_name = "DEGREES", default_value_t = FLAT_ANGLE_DEG, value_parser = degrees, allow_negative_numbers = true)]
    pub(super) flat_angle: f64,
    /// No angles at the folds
    #[arg(long)]
    pub(super) no_angles: bool,
    /// A mirrored page after each, for the back of the paper
    #[arg(long)]
    pub(super) back: bool,
    /// Fold lines and texts on the back only; the front shows colours and the lines to cut (with --back)
    #[arg(long, requires = "back")]
    pub(super) clean_front: bool,
    /// Write this layer only, for a cutter; several times for several
    #[arg(long, value_enum, value_name = "LAYER")]
    pub(super) only: Vec<OnlyLayer>,
    /// Folds as rows of cuts of LENGTH mm with GAP mm between, such as 2,1, for a cutter that does not score (with --only)
    #[arg(long, value_name = "LENGTH,GAP", value_parser = perforation, requires = "only", allow_hyphen_values = true)]
    pub(super) perforate: Option<[f64; 2]>,
    /// Marks that a cutter looks for
    #[arg(long, value_enum, value_name = "KIND")]
    pub(super) registration: Option<Registration>,
    /// Sizes in an SVG as pixels at so many to the inch (72, 96) and not in mm
    #[arg(long, value_name = "DPI", value_parser = clap::value_parser!(u16).range(10..=2400), allow_negative_numbers = true)]
    pub(super) svg_dpi: Option<u16>,
    /// Write SVG for Origami Simulator, one file a piece
    #[arg(long)]
    pub(super) origami_simulator: bool,
    /// Fold the threads of a weave as tubes, and do not weave strips
    #[arg(long)]
    pub(super) facets: bool,
}

/// How it is searched.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = "Search")]
pub(super) struct SearchArgs {
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub(super) seed: u64,
    /// How long to search, as a factor: 10 searches ten times as long
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = effort, allow_negative_numbers = true)]
    pub(super) effort: f64,
    /// Stop searching after this time, such as 10s, with the best so far
    #[arg(long, value_name = "TIME", value_parser = time, allow_hyphen_values = true)]
    pub(super) time_limit: Option<Duration>,
}

/// `--registration`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Registration {
    /// Silhouette's square and two corners
    Silhouette,
}

/// `--only`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum OnlyLayer {
    /// Lines to cut
    Cut,
    /// Lines to fold
    Score,
    /// Colours and texts
    Print,
    /// Marks that a cutter looks for
    Registration,
}

impl OnlyLayer {
    fn layer(self) -> Layer {
        match self {
            Self::Cut => Layer::Cut,
            Self::Score => Layer::Score,
            Self::Print => Layer::Print,
            Self::Registration => Layer::Registration,
        }
    }
}

/// Reads `2,1`.
fn perforation(text: &str) -> Result<[f64; 2], String> {
    let remedy = "write the length of a cut and of a gap in mm, from 0.1 to 50, such as 2,1";
    let (cut, gap) = text.split_once(',').ok_or_else(|| format!("not two lengths; {remedy}"))?;
    match (cut.trim().parse::<f64>(), gap.trim().parse::<f64>()) {
        (Ok(c), Ok(g)) if (0.1..=50.0).contains(&c) && (0.1..=50.0).contains(&g) => Ok([c, g]),
        _ => Err(format!("not two lengths; {remedy}")),
    }
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

impl SheetArgs {
    /// What tabs are like.
    pub(super) fn tabs(&self) -> TabStyle {
        TabStyle { width: if self.no_tabs { 0.0 } else { self.tab } }
    }

    /// The pages as they are written: all of them, or what a cutter wants.
    pub(super) fn written(&self, pages: &[Page]) -> Vec<Page> {
        if self.only.is_empty() {
            return pages.to_vec();
        }
        let layers: Vec<Layer> = self.only.iter().map(|l| l.layer()).collect();
        let pages = self.perforate.map_or_else(|| pages.to_vec(), |cuts| perforated(pages, cuts));
        // Pages that have nothing on these layers are no work for a machine.
        only(&pages, &layers).into_iter().filter(|page| !page.items.is_empty()).collect()
    }

    pub(super) fn paper(&self) -> Result<Paper> {
        let inset = if self.registration.is_some() { SILHOUETTE_INSET } else { 0.0 };
        paper::parse(&self.page, self.margin, inset)
    }

    pub(super) fn format(&self, path: &Path) -> Result<Format> {
        let ending = output::ending(path);
        let format = match ending.as_str() {
            "svg" if self.origami_simulator => Format::OrigamiSimulator,
            "svg" => Format::Svg { dpi: self.svg_dpi.map(f64::from) },
            "pdf" => Format::Pdf,
            "png" => Format::Png,
            "fold" => Format::Fold,
            "dxf" => Format::Dxf,
            _ => return Err(output::unknown_ending(path, "name a file that ends in .pdf, .svg, .png, .dxf or .fold")),
        };
        if ending != "svg" && (self.origami_simulator || self.svg_dpi.is_some()) {
            let field = if self.origami_simulator { "origami_simulator" } else { "svg_dpi" };
            return Err(BadInput::new("this is an option of SVG", "name an output that ends in .svg, or leave it out")
                .at_field(field)
                .into());
        }
        Ok(format)
    }
}

impl FoldArgs {
    pub(super) fn recipe(&self, source: &Source, paper: Paper) -> Result<FoldRecipe> {
        let scale = check_scale(self.shape.scale)?;
        if let Some(on) = &self.shape.on {
            let target = Target::parse(on)?;
            if matches!(source, Source::Mesh(..)) {
                let bad = BadInput::new("a mesh file has no period to put on a target", "leave --on out, or write a material file");
                return Err(bad.at_field("on").into());
            }
            let fit = target.fit(source.period(scale), self.shape.paper_thickness);
            let periods = source.periods(Some(Extent::Periods([fit.around, fit.along])), scale)?;
            return Ok(self.recipe_of(scale, periods, paper));
        }
        let extent = self.shape.size.map(Extent::Size).or(self.shape.periods.map(Extent::Periods));
        Ok(self.recipe_of(scale, source.periods(extent, scale)?, paper))
    }

    fn recipe_of(&self, scale: f64, periods: [u32; 2], paper: Paper) -> FoldRecipe {
        let split = self.shape.split.then(|| room(paper, self.sheet.tabs()).size.to_array());
        FoldRecipe {
            scale,
            periods,
            thickness: self.shape.paper_thickness,
            fold_radius: self.shape.fold_radius.unwrap_or(0.0),
            k_factor: self.shape.k_factor,
            max_facets: self.shape.max_facets,
            slope_tolerance_deg: self.shape.slope_tolerance,
            split,
        }
    }

    pub(super) fn look(&self, title: &str) -> Look {
        Look {
            title: title.to_owned(),
            period: 0.0,
            colours: !self.sheet.no_colours,
            angles: !self.sheet.no_angles,
            numbers: !self.sheet.no_numbers,
            silhouette: self.sheet.registration == Some(Registration::Silhouette),
            back: self.sheet.back,
            clean_front: self.sheet.clean_front,
        }
    }
}
