//! `biscale render`: the large-scale appearance, as an image.

use crate::common::bounces::Bounces;
use crate::common::filter_summary::Stages;
use crate::common::options::{self, CommonArgs, QualityArgs};
use crate::common::output::{self, Target};
use crate::common::progress;
use biscale::error::{BadInput, Result};
use biscale::filter::Quality;
use biscale::numerics::words::percent;
use biscale::render::{
    EnvironmentReport, Exposure, LightSampling, Lighting, Rendered, ResponseReport, SOFTWARE, Scene, SceneMaterial, render,
};
use biscale::toml_reader::Source;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What every image of this command says of who made it.
const MARK: &str = "biscale render ";

/// How a picture that takes long takes less.
const ADVICE: &str = "a looser `--tolerance`, fewer `lights` of an environment or fewer `samples` of the camera take less";
/// The same where a material is computed with reflections after the first, which costs more than all of these.
const ADVICE_FOR_BOUNCES: &str =
    "reflections after the first are what takes so long: `--bounces 0` leaves them out, and a looser `--tolerance` takes less";

/// Arguments of `biscale render`.
#[derive(Args, Debug)]
#[command(after_help = "A .png shows radiance times 2^EXPOSURE, clamped to 0..1 and sRGB-encoded: no other tone mapping. \
                        An .exr holds linear radiance in 32-bit floats.")]
pub struct RenderArgs {
    /// Scene file; `biscale new scene` writes an example
    pub(crate) scene: PathBuf,
    /// Image to write, .exr or .png; may be given for both
    #[arg(long, short, value_name = "IMAGE", required = true)]
    output: Vec<PathBuf>,
    /// Material file to take in the place of the first object's own
    #[arg(long, value_name = "MATERIAL")]
    material: Option<PathBuf>,
    /// How the environment lights the scene, in the place of what the scene says
    #[arg(long, value_name = "LIGHTING")]
    lighting: Option<LightingArg>,
    /// Stops by which the .png is brighter than the radiance, or `auto`; in the place of what the scene says
    #[arg(long, value_name = "STOPS", value_parser = exposure, allow_negative_numbers = true)]
    exposure: Option<Exposure>,
    /// Write the share of each pixel that objects cover as a channel of its own
    #[arg(long)]
    alpha: bool,
    /// Replace an output that exists and was not made by this command
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    quality: QualityArgs,
}

/// How an environment lights a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LightingArg {
    /// By directional lights that are drawn from it
    Sampled,
    /// As a whole, by tables and spherical Gaussians
    Sg,
}

impl From<LightingArg> for Lighting {
    fn from(argument: LightingArg) -> Self {
        match argument {
            LightingArg::Sampled => Self::Sampled,
            LightingArg::Sg => Self::SphericalGaussians,
        }
    }
}

/// A format of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Png,
}

impl Format {
    /// The ending says the format.
    fn of(path: &Path) -> Result<Self> {
        match &*output::ending(path) {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png),
            _ => Err(output::unknown_ending(path, "name a file that ends in .exr or .png")),
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, those of the filter, and i/o; nothing is written before the picture is made.
pub fn run(args: &RenderArgs, common: &CommonArgs) -> Result<()> {
    let quality = args.quality.quality()?;
    let formats = args.output.iter().map(|path| Format::of(path)).collect::<Result<Vec<_>>>()?;
    let target = |path: &PathBuf| Target::new(path, args.force, &[&args.scene], |file| output::has_mark(file, MARK));
    let targets = args.output.iter().map(target).collect::<Result<Vec<_>>>()?;
    Target::check_distinct(&targets)?;
    let start = Instant::now();
    let mut scene = Scene::parse_with(&Source::read(&args.scene)?, args.material.as_deref())?;
    if let Some(lighting) = args.lighting {
        set_lighting(&mut scene, lighting.into())?;
    }
    let loaded = start.elapsed().as_secs_f64() * 1e3;
    let bounces = scene.materials.iter().any(|m| quality.bounces_of(m.material.bounces) > 0);
    let advice = if bounces { ADVICE_FOR_BOUNCES } else { ADVICE };
    let rendered = progress::with_advice(common, advice, |control| render(&scene, &quality, control))?;
    let notes = common.flags.in_texts(rendered.notes.iter().cloned().chain(args.quality.notes()).collect());
    let mut summary = Summary::new(&scene, &rendered, &quality, loaded, notes, common.verbose);
    let stops = match args.exposure.unwrap_or(scene.exposure) {
        Exposure::Stops(stops) => stops,
        Exposure::Auto => rendered.picture.auto_exposure(),
    };
    if formats.contains(&Format::Png) {
        let clipped = rendered.picture.clipped(stops);
        summary.shown = Some(Shown { exposure: stops, clipped });
        let auto = rendered.picture.auto_exposure();
        if auto < stops {
            summary.notes.push(format!(
                "{} of the pixels are brighter than white and are cut: `--exposure auto` would take {auto:.1} stops and cut {}",
                percent(clipped),
                percent(rendered.picture.clipped(auto))
            ));
        }
    }
    let comment = format!("{}: {}", scene.name, summary.how());
    for (target, format) in targets.iter().zip(&formats) {
        match format {
            Format::Exr => {
                target.write_file(|file| rendered.picture.write_exr(io::BufWriter::new(file), args.alpha, &comment))?;
            }
            Format::Png => {
                let pixels = rendered.picture.to_srgb(stops, args.alpha);
                let size = [scene.camera.width, scene.camera.height];
                let png = output::png::encode(size, &pixels, args.alpha, SOFTWARE, &comment)?;
                target.write(|out| out.write_all(&png))?;
            }
        }
    }
    if common.json {
        return output::print_json(&Object { outputs: &args.output, summary });
    }
    output::tell(common, &summary.to_string());
    for file in &args.output {
        output::tell(common, &format!("wrote {}", file.display()));
    }
    Ok(())
}

/// Reads `--exposure`.
fn exposure(text: &str) -> Result<Exposure, String> {
    if text.trim() == Exposure::AUTO {
        return Ok(Exposure::Auto);
    }
    options::exposure(text).map(Exposure::Stops).map_err(|e| format!("{e}, or auto"))
}

/// Has the environment light the scene another way.
fn set_lighting(scene: &mut Scene, lighting: Lighting) -> Result<()> {
    let Some(surroundings) = &mut scene.environment else {
        let bad = BadInput::new("the scene has no environment", "add an [environment] to it, or leave out `--lighting`");
        return Err(bad.in_file(&scene.file).into());
    };
    surroundings.lighting = lighting;
    Ok(())
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object<'a> {
    outputs: &'a [PathBuf],
    summary: Summary<'a>,
}

/// What was rendered. Shown as a few lines of text, or serialised.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    scene: &'a str,
    width: u32,
    height: u32,
    samples: u32,
    lights: usize,
    /// Pairs of a visible point and a light that reaches it.
    lamps: u64,
    seed: u64,
    tolerance: f64,
    milliseconds: Stages,
    materials: Vec<Material<'a>>,
    /// How an environment was sampled, if it was.
    light_sampling: Option<Sampling>,
    /// How bright a .png is, if one was written.
    shown: Option<Shown>,
    /// How the light of an environment as a whole was made.
    environment: Option<Environment<'a>>,
    notes: Vec<String>,
    /// How it was done, for who knows the methods: text shows it where it is asked for.
    details: Vec<String>,
    #[serde(skip)]
    verbose: bool,
}

/// How the light of an environment was made.
#[derive(Debug, Serialize)]
struct Environment<'a> {
    sites: usize,
    maps_bytes: usize,
    light_bytes: usize,
    responses: Vec<Response<'a>>,
    /// Against a small picture of the view whose environment was sampled; none where that shows no object.
    compared_pixels: Option<usize>,
    compared_lights: Option<u32>,
    relative_rms_difference: Option<f64>,
    noise_of_comparison: Option<f64>,
}

/// An exposure in stops, and the share of the pixels that it cuts.
#[derive(Clone, Copy, Debug, Serialize)]
struct Shown {
    exposure: f64,
    clipped: f64,
}

/// Lights that stand for an environment.
#[derive(Clone, Copy, Debug, Serialize)]
struct Sampling {
    lights: u32,
    /// Whether the tolerance chose their number.
    chosen: bool,
    /// Relative RMS that drawing the lights makes.
    error_of_lights: f64,
    pixels: usize,
}

impl From<LightSampling> for Sampling {
    fn from(LightSampling { lights, chosen, relative_rms, pixels }: LightSampling) -> Self {
        Self { lights, chosen, error_of_lights: relative_rms, pixels }
    }
}

/// How a material's response to the environment was found.
#[derive(Debug, Serialize)]
struct Response<'a> {
    material: &'a str,
    method: &'static str,
    plan: &'a str,
    #[serde(flatten)]
    bounces: Bounces,
    rings: usize,
    texels: usize,
    lobes: usize,
    pairs: usize,
    relative_rms_error: f64,
    values_error: f64,
    response_error: f64,
}

impl<'a> Environment<'a> {
    fn new(scene: &'a Scene, report: &'a EnvironmentReport, quality: &Quality) -> Self {
        let response = |(material, r): (&'a SceneMaterial, &'a ResponseReport)| Response {
            material: &material.material.name,
            method: r.method,
            plan: &r.plan,
            bounces: Bounces::of(quality, material.material.bounces),
            rings: r.rings,
            texels: r.side * r.side,
            lobes: r.lobes,
            pairs: r.pairs,
            relative_rms_error: r.relative_rms(),
            values_error: r.error[0],
            response_error: r.error[1],
        };
        Self {
            sites: report.sites,
            maps_bytes: report.bytes[0],
            light_bytes: report.bytes[1],
            responses: scene.materials.iter().zip(&report.responses).map(response).collect(),
            compared_pixels: report.error.map(|e| e.pixels),
            compared_lights: report.error.map(|e| e.lights),
            relative_rms_difference: report.error.map(|e| e.relative_rms),
            noise_of_comparison: report.error.map(|e| e.noise),
        }
    }

    /// In one line a material, and one about the picture.
    fn how(&self) -> String {
        let percent = |e: f64| format!("{:.2} %", 100.0 * e);
        let line = |r: &Response<'_>| {
            format!(
                "{}: {}{}, response of {} pairs on {} rings and {} texels, {} lobes, relative RMS error {} (values {}, response {})",
                r.material,
                r.method,
                r.bounces.after_comma(),
                r.pairs,
                r.rings,
                r.texels,
                r.lobes,
                percent(r.relative_rms_error),
                percent(r.values_error),
                percent(r.response_error),
            )
        };
        let mut lines: Vec<String> = self.responses.iter().map(line).collect();
        let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
        lines.push(format!(
            "environment: {} sites, {:.1} MiB of light, {:.1} MiB of maps",
            self.sites,
            mib(self.light_bytes),
            mib(self.maps_bytes)
        ));
        if let (Some(pixels), Some(lights), Some(difference), Some(noise)) =
            (self.compared_pixels, self.compared_lights, self.relative_rms_difference, self.noise_of_comparison)
        {
            let text = format!(
                "difference from {lights} sampled lights at {pixels} pixels: {} RMS, of which drawing the lights makes {}",
                percent(difference),
                percent(noise)
            );
            lines.push(text);
        }
        lines.join("\n")
    }
}

/// How the values of one material were made.
#[derive(Debug, Serialize)]
struct Material<'a> {
    material: &'a str,
    method: &'static str,
    plan: &'a str,
    #[serde(flatten)]
    bounces: Bounces,
    facets: usize,
    rings: usize,
    cells: usize,
    /// Pairs of directions that were computed, and those of a whole table of the same grid.
    pairs: usize,
    full_table_pairs: usize,
    guided: bool,
    gaps: bool,
    relative_rms_error: f64,
    facets_error: f64,
    interpolation_error: f64,
}

impl<'a> Summary<'a> {
    fn new(scene: &'a Scene, rendered: &'a Rendered, quality: &Quality, loaded: f64, notes: Vec<String>, verbose: bool) -> Self {
        let made = scene.materials.iter().zip(&rendered.materials).filter_map(|(m, made)| Some((m, made.as_ref()?)));
        let materials = made.map(|(material, made)| Material {
            material: &material.material.name,
            method: made.method,
            plan: &made.plan,
            bounces: Bounces::of(quality, material.material.bounces),
            facets: made.facets,
            rings: made.rings,
            cells: made.cells,
            pairs: made.pairs,
            full_table_pairs: made.full_table,
            guided: made.guided,
            gaps: made.gaps,
            relative_rms_error: made.relative_rms(),
            facets_error: made.error[0],
            interpolation_error: made.error[1],
        });
        let mut stages = vec![("load", loaded)];
        stages.extend(&rendered.stages);
        Self {
            scene: &scene.name,
            width: scene.camera.width,
            height: scene.camera.height,
            samples: scene.camera.samples,
            lights: rendered.lights,
            lamps: rendered.lamps,
            seed: quality.seed,
            tolerance: quality.tolerance,
            milliseconds: Stages(stages),
            materials: materials.collect(),
            light_sampling: rendered.light_sampling.map(Sampling::from),
            shown: None,
            environment: rendered.environment.as_ref().map(|report| Environment::new(scene, report, quality)),
            notes,
            details: rendered.details.clone(),
            verbose,
        }
    }

    /// How the values were made, in one line a material.
    fn how(&self) -> String {
        let percent = |e: f64| format!("{:.2} %", 100.0 * e);
        let line = |m: &Material<'_>| {
            let share = m.full_table_pairs as f64 / m.pairs.max(1) as f64;
            format!(
                "{}: {}{}, {} facets, {} pairs on {} rings ({share:.1} times fewer than a full table{}{}), relative RMS error {} (facets {}, \
                 interpolation {})",
                m.material,
                m.method,
                m.bounces.after_comma(),
                m.facets,
                m.pairs,
                m.rings,
                if m.guided { ", guided" } else { "" },
                if m.gaps { "; rays pass" } else { "" },
                percent(m.relative_rms_error),
                percent(m.facets_error),
                percent(m.interpolation_error),
            )
        };
        let lines = self.materials.iter().map(line).chain(self.environment.iter().map(Environment::how));
        lines.collect::<Vec<String>>().join("\n")
    }
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { scene, width, height, samples, lights, .. } = self;
        writeln!(f, "{scene}: {width} x {height} pixels of {samples} samples, {lights} lights")?;
        if !self.materials.is_empty() || self.environment.is_some() {
            writeln!(f, "{}", self.how())?;
        }
        if let Some(Sampling { lights, chosen, error_of_lights, pixels }) = self.light_sampling {
            let by = if chosen { ", as many as the tolerance asks for or the most that are taken" } else { "" };
            let error = format!("{:.2} %", 100.0 * error_of_lights);
            writeln!(f, "{lights} lights stand for the environment{by}: relative RMS error {error}, at {pixels} pixels")?;
        }
        if let Some(Shown { exposure, clipped }) = self.shown {
            writeln!(f, "exposure {exposure:.1} stops: {:.2} % of the pixels are cut at white", 100.0 * clipped)?;
        }
        write!(f, "{}", self.milliseconds)?;
        for note in &self.notes {
            write!(f, "\nnote: {note}")?;
        }
        for detail in self.details.iter().filter(|_| self.verbose) {
            write!(f, "\n{detail}")?;
        }
        Ok(())
    }
}
