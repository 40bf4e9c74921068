//! `biscale bake`: the effective BRDF as a whole table.

use crate::common::bounces::Bounces;
use crate::common::flags::Flags;
use crate::common::options::{CommonArgs, QualityArgs};
use crate::common::output::{self, Target};
use crate::common::progress;
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::material::Material;
use biscale::numerics::cast::index_u32;
use biscale::table::is_effective_brdf;
use biscale::table::{BakeAids, BakeForecast, BakeRecipe, MIN_RINGS, bake_with};
use biscale::table::{EffectiveTable, TableError, max_rings};
use biscale::toml_reader::Source;
use clap::Args;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Arguments of `biscale bake`.
#[derive(Args, Debug)]
pub struct BakeArgs {
    /// Material file
    pub(crate) material: PathBuf,
    /// File to write: `.exr`, see docs/table-format.md
    #[arg(long, short, value_name = "OUT.exr")]
    output: PathBuf,
    /// Rings of directions; without it as many as the tolerance needs. N rings are 1 + 3 N (N + 1) directions
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(RINGS), allow_negative_numbers = true)]
    resolution: Option<u16>,
    /// Replace an output that exists and was not made by this command
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    quality: QualityArgs,
}

/// Rings that can be asked for; of a surface that is not reciprocal fewer fit, and the library says so.
const RINGS: std::ops::RangeInclusive<i64> = whole(MIN_RINGS)..=whole(max_rings(true));

/// A number of rings, a few dozen, as clap compares it.
const fn whole(rings: usize) -> i64 {
    index_u32(rings) as i64
}

/// Seconds from which on a forecast is told. Chosen, not measured.
const TOLD_FROM: f64 = 20.0;
/// How far a forecast may be off: see `docs/performance.md`, "Forecasts".
const SPREAD: [f64; 2] = [0.4, 1.6];

/// Formats that formats.md promises for later.
const LATER: [(&str, &str); 3] = [("bsdf", "RGL"), ("binary", "MERL"), ("xml", "Klems")];

/// Runs the command.
///
/// # Errors
/// Bad input, those of the filter, and i/o; nothing is written then.
pub fn run(args: &BakeArgs, common: &CommonArgs) -> Result<()> {
    let quality = args.quality.quality()?;
    check_ending(&args.output)?;
    let target = Target::new(&args.output, args.force, &[&args.material], is_effective_brdf)?;
    let start = Instant::now();
    let source = Source::read(&args.material)?;
    let material = Material::parse(&source)?;
    quality.method_for(&material)?;
    let bounces = Bounces::of(&quality, material.bounces);
    let surface = material.build()?;
    let loaded = Instant::now();
    let recipe = BakeRecipe { name: &material.name, material: &source.text, quality, rings: args.resolution.map(usize::from) };
    let kept = kept_beside(&args.output);
    let work = |control: &Control<'_>, say: &progress::Say<'_>| {
        let forecast = |forecast: &BakeForecast| {
            let told = forecast.seconds >= TOLD_FROM || common.verbose;
            say(forecast.seconds, if told { foretold(forecast, args.quality.tolerance, bounces) } else { String::new() });
        };
        bake_with(&surface, &recipe, &BakeAids { forecast: &forecast, kept: Some(&kept) }, control)
    };
    let advice = match bounces.number {
        0 => "a smaller `--resolution` takes less",
        _ => "a smaller `--resolution` takes less, and so does direct light alone, with `--bounces 0`",
    };
    let table = match args.resolution {
        // One table, whose share of the progress tells what is left.
        Some(_) => progress::with_advice(common, advice, |control| work(control, &|_, _| {})),
        None => progress::with_forecast(common, work),
    };
    let table = table.inspect_err(|error| {
        // Whatever went wrong, what is computed stays: hours of work, or a file that is not ours.
        if matches!(error, Error::Interrupted) && kept.exists() {
            output::tell(common, &format!("what is computed is kept in {}: the same command goes on from there", kept.display()));
        }
    })?;
    let baked = Instant::now();
    target.write_file(|file| table.write(std::io::BufWriter::new(file)))?;
    // The table is whole. One that cannot be removed is found by the next bake, which begins it anew.
    let _ = std::fs::remove_file(&kept);
    let milliseconds = Milliseconds {
        load: (loaded - start).as_secs_f64() * 1e3,
        bake: (baked - loaded).as_secs_f64() * 1e3,
        write: baked.elapsed().as_secs_f64() * 1e3,
    };
    let summary = Summary::new(&table, bounces, milliseconds, args.quality.notes(), &common.flags);
    if common.json {
        return output::print_json(&Object { output: &args.output, summary });
    }
    output::tell(common, &summary.to_string());
    output::tell(common, &format!("wrote {}", args.output.display()));
    Ok(())
}

/// The file beside a table in which its blocks are kept while it is made.
fn kept_beside(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".unfinished");
    name.into()
}

/// What a long bake will take, and what looser tolerances would.
fn foretold(forecast: &BakeForecast, tolerance: f64, bounces: Bounces) -> String {
    let BakeForecast { rings, values, seconds, relative_rms, looser } = forecast;
    let [least, most] = SPREAD.map(|times| progress::duration(times * seconds));
    let mut text = format!(
        "{:.1} million values on {rings} rings of directions will take about {} to compute, {least} to {most}",
        *values as f64 / 1e6,
        progress::duration(*seconds)
    );
    for (tolerance, seconds) in looser {
        text += &format!("; `--tolerance {tolerance}` about {}", progress::duration(*seconds));
    }
    if bounces.number > 0 {
        text += &format!("; these are with {bounces}: direct light alone, with `--bounces 0`, takes less");
    }
    if *relative_rms > tolerance {
        text += &format!(
            ".\nThe table's error will be about {:.1} %, over the tolerance of {} %: more rings than {rings} do not fit",
            100.0 * relative_rms,
            100.0 * tolerance
        );
    }
    text + ". Ctrl-C keeps what is computed."
}

/// The ending says the format.
fn check_ending(path: &Path) -> Result<()> {
    let ending = output::ending(path);
    if ending == "exr" {
        return Ok(());
    }
    if let Some((_, format)) = LATER.iter().find(|(known, _)| *known == ending) {
        return Err(Error::Unsupported {
            what: format!("writing the {format} format (.{ending})"),
            remedy: "name a file that ends in .exr".into(),
        });
    }
    Err(output::unknown_ending(path, "name a file that ends in .exr"))
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object<'a> {
    output: &'a Path,
    summary: Summary<'a>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Milliseconds {
    load: f64,
    bake: f64,
    write: f64,
}

/// What was made. Shown as a few lines of text, or serialised.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    material: &'a str,
    method: &'a str,
    /// What `--plan` takes to repeat the bits.
    plan: &'a str,
    #[serde(flatten)]
    bounces: Bounces,
    seed: u64,
    rings: usize,
    directions: usize,
    /// Values in the table.
    pairs: usize,
    reciprocal: bool,
    /// Rings of the guide, 0 without one.
    guide_rings: usize,
    facets: usize,
    error: TableError,
    tolerance: f64,
    milliseconds: Milliseconds,
    notes: Vec<String>,
}

impl<'a> Summary<'a> {
    fn new(table: &'a EffectiveTable, bounces: Bounces, milliseconds: Milliseconds, notes: Vec<String>, flags: &Flags) -> Self {
        let about = &table.about;
        Self {
            material: &about.name,
            method: &about.method,
            plan: &about.plan,
            bounces,
            seed: about.seed,
            rings: table.grid().rings(),
            directions: table.grid().nodes().len(),
            pairs: table.values(),
            reciprocal: table.is_reciprocal(),
            guide_rings: table.guide().map_or(0, |g| g.rings),
            facets: about.facets,
            error: about.error,
            tolerance: about.tolerance,
            milliseconds,
            notes: flags.in_texts(about.notes.iter().cloned().chain(notes).collect()),
        }
    }
}

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let guide = if self.guide_rings > 0 { format!(", guided by {} rings of half vectors", self.guide_rings) } else { String::new() };
        writeln!(f, "{}: {} rings of directions ({}), {} values{guide}", self.material, self.rings, self.directions, self.pairs)?;
        writeln!(f, "method {}, {} facets", self.method, self.facets)?;
        if self.bounces.is_told() {
            writeln!(f, "{}", self.bounces)?;
        }
        let Milliseconds { load, bake, write } = self.milliseconds;
        writeln!(f, "milliseconds: load {load:.1}, bake {bake:.1}, write {write:.1}")?;
        let percent = |e: f64| format!("{:.3} %", e * 100.0);
        let TableError { relative_rms, facets, interpolation, probes } = self.error;
        write!(
            f,
            "estimated relative RMS error between the nodes: {} (facets {}, interpolation {} at {probes} pairs)",
            percent(relative_rms),
            percent(facets),
            percent(interpolation)
        )?;
        if !self.plan.is_empty() {
            write!(f, "\nplan: {} (seed {})", self.plan, self.seed)?;
        }
        for note in &self.notes {
            write!(f, "\nnote: {note}")?;
        }
        Ok(())
    }
}
