//! `biscale btf make`.

use crate::common::options::{self, CommonArgs};
use crate::common::output::{self, Target};
use crate::common::progress;
use biscale::bounded_file::{MAX_TEXT_BYTES, read_bounded};
use biscale::btf::{BtfAbout, BtfFile, BtfQuestion, BtfSummary, BtfWriter, DirectionSet, PlaneHeight, ReferencePlane, ViewLights, render};
use biscale::error::{BadInput, Error, Result};
use biscale::material::Material;
use biscale::toml_reader::Source;
use clap::Args;
use glam::DVec3;
use serde::Serialize;
use std::fmt;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// Arguments of `biscale btf make`.
#[derive(Args, Debug)]
pub struct MakeArgs {
    /// Material file
    pub(super) material: PathBuf,
    /// File to write: `.npz`, see docs/btf.md
    #[arg(long, short, value_name = "OUT.btf.npz")]
    output: PathBuf,
    /// Texels of the tile: N across and along, or `WxH`
    #[arg(long, value_name = "N", default_value = "64", value_parser = texels)]
    texels: [usize; 2],
    /// Directions of the views and of the lights: ubo81, ubo151, or a file with `theta phi` in degrees or `x y z` a line
    #[arg(long, value_name = "SET", default_value = "ubo81")]
    directions: String,
    /// Directions of the lights, where these are others
    #[arg(long, value_name = "SET")]
    lights: Option<String>,
    /// Height of the plane whose texels show the surface: middle (halfway between its lowest and highest point), top, or a z in the tile's unit
    #[arg(long, value_name = "HEIGHT", default_value = "middle", value_parser = plane, allow_negative_numbers = true)]
    plane: PlaneHeight,
    /// Standard error of the texels to stay within, root mean square over that of their values
    #[arg(long, value_name = "ERROR", default_value_t = 0.01, value_parser = options::tolerance, allow_negative_numbers = true)]
    tolerance: f64,
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Replace an output that exists and was not made by this command
    #[arg(long)]
    force: bool,
}

/// Most texels along either side, and most of all images together. Chosen, not measured: 20 GB in the file.
const MOST_TEXELS: usize = 2048;
/// Most texels of the images of one view together, which are held at once: 5 GB. Chosen, not measured.
const MOST_HELD: f64 = 1e8;
/// Most periods that the plane may lie from z = 0: farther away texels lose their digits. Chosen, not measured.
const MOST_PERIODS: f64 = 1e4;
/// See [`MOST_TEXELS`].
const MOST_VALUES: f64 = 3.5e9;

fn texels(text: &str) -> std::result::Result<[usize; 2], String> {
    let sides: Option<Vec<usize>> = text.split(['x', 'X']).map(|n| n.trim().parse().ok()).collect();
    let sides = match sides.as_deref() {
        Some(&[n]) => [n, n],
        Some(&[width, height]) => [width, height],
        _ => return Err("write a whole number, or `WxH`, such as 64 or 64x32".to_owned()),
    };
    if sides.iter().all(|n| (1..=MOST_TEXELS).contains(n)) { Ok(sides) } else { Err(format!("use 1 to {MOST_TEXELS} texels along a side")) }
}

fn plane(text: &str) -> std::result::Result<PlaneHeight, String> {
    match text {
        "middle" => Ok(PlaneHeight::Middle),
        "top" => Ok(PlaneHeight::Top),
        other => {
            let z = other.parse().ok().filter(|z: &f64| z.is_finite());
            z.map(PlaneHeight::At).ok_or_else(|| "write middle, top, or a number".to_owned())
        }
    }
}

/// The directions of a name or a file.
fn directions(of: &str, flag: &str) -> Result<Vec<DVec3>> {
    if let Some(set) = DirectionSet::named(of) {
        return Ok(set.directions);
    }
    let path = Path::new(of);
    let bytes = read_bounded(path, MAX_TEXT_BYTES, "a list of directions is short").map_err(|error| match error {
        Error::BadInput(bad) => {
            BadInput::new(format!("{of}: {}", bad.problem), "name ubo81, ubo151, or a file of directions").at_field(flag).into()
        }
        error => error,
    })?;
    let text = biscale::text_file::decode(&bytes);
    Ok(DirectionSet::parse(&text).map_err(|bad| bad.in_file(path))?.directions)
}

/// Runs the command.
///
/// # Errors
/// Bad input, those of the renderer, and i/o; nothing is written then.
pub fn run(args: &MakeArgs, common: &CommonArgs) -> Result<()> {
    if output::ending(&args.output) != "npz" {
        return Err(output::unknown_ending(&args.output, "use .npz"));
    }
    let target = Target::new(&args.output, args.force, &[&args.material], |path| BtfFile::open(path).is_ok())?;
    if target.is_stdout() {
        return Err(BadInput::new("a BTF is written from several places at once", "name a file").at_field("output").into());
    }
    let source = Source::read(&args.material)?;
    let material = Material::parse(&source)?;
    let small = material.build()?;
    let views = directions(&args.directions, "directions")?;
    let lights = args.lights.as_deref().map_or_else(|| Ok(views.clone()), |lights| directions(lights, "lights"))?;
    let plane = ReferencePlane::new(&small.tile, args.plane, args.texels);
    if plane.z.abs() > MOST_PERIODS * small.tile.period.min_element() {
        let what = format!("a plane at {} lies more than {MOST_PERIODS} periods from the surface", plane.z);
        return Err(BadInput::new(what, "use middle, top, or a height near the surface").at_field("plane").into());
    }
    let values = plane.count() as f64 * views.len() as f64 * lights.len() as f64;
    if plane.count() as f64 * lights.len() as f64 > MOST_HELD {
        let what =
            format!("{} images of one view, of {} x {} texels, do not fit into memory", lights.len(), args.texels[0], args.texels[1]);
        return Err(BadInput::new(what, "use fewer texels, or fewer lights and several files").into());
    }
    if values > MOST_VALUES {
        let what = format!(
            "{} images of {} x {} texels are {:.1} billion",
            views.len() * lights.len(),
            args.texels[0],
            args.texels[1],
            values / 1e9
        );
        return Err(BadInput::new(what, format!("use fewer texels or directions: at most {:.1} billion", MOST_VALUES / 1e9)).into());
    }
    let asked: Vec<ViewLights> = views.iter().map(|&wo| ViewLights { wo, lights: lights.clone() }).collect();
    let question = BtfQuestion { plane, views: &asked, tolerance: args.tolerance, seed: args.seed };
    let mut notes = Vec::new();
    if small.bounces > 0 {
        notes.push(format!("direct light only: the material's {} reflections after the first are not in a BTF yet", small.bounces));
    }
    let mut failed = None;
    let mut made = None;
    let written = progress::with_control(common, |control| {
        target.write_file(|file| {
            let mut writer = BtfWriter::new(BufWriter::new(file), args.texels, &views, &lights)?;
            let path = &args.output;
            let mut sink = |_, images| writer.push(&images).map_err(|source| Error::Io { action: "write", path: path.clone(), source });
            match render(&small, question, control, &mut sink) {
                Ok(summary) => {
                    notes.extend(told(&summary, args.tolerance));
                    let about = BtfAbout {
                        name: material.name.clone(),
                        material: source.text.clone(),
                        notes: notes.clone(),
                        ..BtfAbout::new(&plane)
                    };
                    writer.finish(&about.rendered(&summary, args.tolerance, args.seed))?;
                    made = Some(summary);
                    Ok(())
                }
                Err(error) => {
                    failed = Some(error);
                    Err(io::Error::other("not rendered"))
                }
            }
        })
    });
    if let Some(error) = failed {
        return Err(error);
    }
    written?;
    let summary = Summary::new(&made.unwrap_or_default(), args, [views.len(), lights.len()], notes);
    if common.json {
        return output::print_json(&Object { output: &args.output, summary });
    }
    output::tell(common, &summary.to_string());
    output::tell(common, &format!("wrote {}", args.output.display()));
    Ok(())
}

/// What a summary should make the user know.
fn told(summary: &BtfSummary, tolerance: f64) -> Vec<String> {
    let mut notes = Vec::new();
    if summary.relative_rms > tolerance {
        notes.push(format!(
            "the standard error is {:.2} %, over the tolerance of {:.2} %: no more samples fit, or other images than the ones looked at first are worse",
            100.0 * summary.relative_rms,
            100.0 * tolerance
        ));
    }
    if summary.filled > 0 {
        notes.push(format!("{} texels of all views show what no sample fell on; they have what a neighbour shows", summary.filled));
    }
    if summary.given_up > 0 {
        notes.push(format!("{} rays were given up among the periods and counted as free", summary.given_up));
    }
    notes
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object<'a> {
    output: &'a Path,
    summary: Summary,
}

/// What was made. Shown as a few lines of text, or serialised.
#[derive(Debug, Serialize)]
struct Summary {
    texels: [usize; 2],
    views: usize,
    lights: usize,
    samples: usize,
    relative_rms: f64,
    tolerance: f64,
    seed: u32,
    notes: Vec<String>,
}

impl Summary {
    fn new(made: &BtfSummary, args: &MakeArgs, [views, lights]: [usize; 2], notes: Vec<String>) -> Self {
        let BtfSummary { samples, relative_rms, .. } = *made;
        Self { texels: args.texels, views, lights, samples, relative_rms, tolerance: args.tolerance, seed: args.seed, notes }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { texels: [width, height], views, lights, samples, relative_rms, .. } = self;
        writeln!(f, "{views} views in {lights} lights, {width} x {height} texels each: {samples} samples of the surface")?;
        write!(f, "standard error {:.2} % of the texels, root mean square", 100.0 * relative_rms)?;
        self.notes.iter().try_for_each(|note| write!(f, "\nnote: {note}"))
    }
}
