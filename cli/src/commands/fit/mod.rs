//! `biscale fit`: photographs to a material, and how far to trust it.

mod files;
mod flip;
mod pictures;
mod report;
mod report_choice;
mod report_plots;
mod surface;
mod trade;

use crate::common::cost;
use crate::common::exit;
use crate::common::interrupt;
use crate::common::options::{self, CommonArgs};
use crate::common::output::{self, MadeFolder, Target};
use crate::common::progress;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale::toml_reader::suggest;
use biscale_fit::fit_file::candidate::Candidate;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Better, Choice, Early, Options, Outcome, Watcher, candidates, choose};
use biscale_fit::search::optimise::Optimiser;
use biscale_fit::search::{Memory, Trace};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between two pictures of the best guess so far.
const BETWEEN_PICTURES: Duration = Duration::from_secs(2);
/// Time between two states of the evaluations on disk: what a killed process loses. Chosen, not measured: short beside the hours that a search may take.
const BETWEEN_CHECKPOINTS: Duration = Duration::from_secs(1);
/// Seconds that an interrupted fit has for its report.
const PATIENCE: u64 = 60;

/// Arguments of `biscale fit`.
#[derive(Args, Debug)]
#[command(
    after_help = "Writes into FOLDER: material.toml, fit.json, report.html, pictures.png and evaluations.csv; the evaluations of an earlier run \
                        that is not resumed are kept as evaluations-1.csv. Exit status 1 when the fit fails its own checks; the files are written \
                        all the same. The verdict is printed, with --quiet nothing else but why a fit failed. Ctrl-C ends the search with the \
                        best so far."
)]
pub struct FitArgs {
    /// Fit file; `biscale new fit` writes one
    pub(crate) fit: PathBuf,
    /// Folder for the material and the report, made if it is not there
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// What looks for the best parameters
    #[arg(long, value_enum, default_value_t = OptimiserArg::NelderMead)]
    optimizer: OptimiserArg,
    /// Run all optimisers, and Nelder-Mead at several tolerances, and write how they compare; the material is that of --optimizer
    #[arg(long)]
    compare_optimizers: bool,
    /// Whether colours are solved for at every step, or move with everything else
    #[arg(long, value_enum, default_value_t = Colours::Projected)]
    colours: Colours,
    /// Starts of the search, spread over the bounds; the first one is where the fit file says
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=256), allow_negative_numbers = true)]
    starts: u16,
    /// Wall time for all of it, such as 30s or 2m: it ends with the best so far, and what of the report does not fit is left out and named
    #[arg(long, value_name = "TIME", value_parser = options::time, allow_hyphen_values = true)]
    time_limit: Option<Duration>,
    /// Go on where an earlier run into the same folder ended, by its evaluations.csv
    #[arg(long)]
    resume: bool,
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// Fit the candidate of this name alone, without a choice; `biscale check` lists the names
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Replace files that exist and were not made by this command, and keep no evaluations of an earlier run
    #[arg(long)]
    force: bool,
}

/// `--optimizer`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum OptimiserArg {
    /// Nelder and Mead 1965, with bounds and the coefficients of Gao and Han 2012, ended by steps of lm
    NelderMead,
    /// Covariance matrix adaptation, with bounds
    Cmaes,
    /// Quadratic models without derivatives (Powell 2009)
    Bobyqa,
    /// Levenberg and Marquardt, by derivatives of the residuals
    Lm,
}

/// `--colours`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colours {
    /// By least squares at every step
    Projected,
    /// By the search, with everything else
    Joint,
}

impl OptimiserArg {
    fn optimiser(self) -> Optimiser {
        match self {
            Self::NelderMead => Optimiser::NelderMead,
            Self::Cmaes => Optimiser::Cmaes,
            Self::Bobyqa => Optimiser::Bobyqa,
            Self::Lm => Optimiser::Lm,
        }
    }
}

/// The files of an output folder.
struct Folder {
    material: Target,
    json: Target,
    report: Target,
    folder: MadeFolder,
}

impl Folder {
    fn new(args: &FitArgs, inputs: &[&Path]) -> Result<Self> {
        let folder = MadeFolder::create(&args.output)?;
        let target = |name: &str| {
            Target::new(&folder.path().join(name), args.force, inputs, |file| {
                output::has_mark(file, files::MADE) || output::has_creator(file, files::MADE)
            })
        };
        // Written again and again, and looked at anew each time.
        target(PICTURES)?;
        target(files::EVALUATIONS)?;
        Ok(Self { material: target("material.toml")?, json: target("fit.json")?, report: target("report.html")?, folder })
    }
}

/// Name of the pictures.
const PICTURES: &str = "pictures.png";

impl Folder {
    fn write_pictures(&self, png: &[u8]) -> Result<()> {
        self.replaced(PICTURES)?.write(|out| out.write_all(png))
    }

    fn write_evaluations(&self, trace: &Trace, mark: &str) -> Result<()> {
        self.replaced(files::EVALUATIONS)?.write(|out| files::write_trace(out, trace, mark))
    }

    /// A file that is written again and again: what was there before was looked at when the folder was.
    fn replaced(&self, name: &str) -> Result<Target> {
        Target::new(&self.folder.path().join(name), true, &[], |_| true)
    }
}

/// Runs the command. Returns the exit status: 1 when the fit fails its own checks, that of an interrupt after one.
///
/// # Errors
/// Bad input, those of the fit, and i/o.
pub fn run(args: &FitArgs, common: &CommonArgs) -> Result<u8> {
    let begun = Instant::now();
    let question = Spec::load(&args.fit)?;
    let mut options = Options {
        optimiser: args.optimizer.optimiser(),
        starts: usize::from(args.starts),
        joint: args.colours == Colours::Joint,
        seed: args.seed,
        time_limit: args.time_limit.map(|t| t.as_secs_f64()),
        ..Options::default()
    };
    let candidates = candidates(&question);
    let inputs: Vec<&Path> =
        candidates.iter().map(|c| &*c.material_file).chain([&*args.fit]).chain(question.photographs.iter().map(|p| &*p.file)).collect();
    let folder = Folder::new(args, &inputs)?;
    let (spec, choice) = chosen(question, &candidates, &options, args, common)?;
    let mark = files::mark(&spec, &options);
    let evaluations = folder.folder.path().join(files::EVALUATIONS);
    let memory = if args.resume { files::read_trace(&evaluations, &mark)? } else { Memory::default() };
    let kept = if args.resume || args.force { None } else { files::keep_earlier(&evaluations)? };
    interrupt::be_patient(PATIENCE);
    // What was read until now took its share of the limit.
    options.time_limit = options.time_limit.map(|limit| (limit - begun.elapsed().as_secs_f64()).max(0.0));
    let done = progress::with_control(common, |control| {
        let shown = Mutex::new(Instant::now());
        let better = |better: &Better<'_>| show(better, &shown, &folder, control);
        let kept = Mutex::new(Instant::now());
        let evaluated = |trace: &dyn Fn() -> Trace| keep(trace, &kept, &folder, &mark);
        let outcome = biscale_fit::run::fit(&spec, &options, &memory, Watcher { better: &better, evaluated: &evaluated }, control)?;
        folder.write_evaluations(&outcome.trace, &mark)?;
        let compared = if args.compare_optimizers { trade::compare(&spec, &options, control)? } else { Vec::new() };
        Ok((outcome, compared))
    });
    let kept = kept.and_then(|kept| files::without_repetition(kept, &evaluations));
    let (mut outcome, compared) = done?;
    if let Some(failure) = choice.as_ref().and_then(Choice::failure).filter(|_| !outcome.failures.is_empty()) {
        outcome.failures.push(failure);
    }
    let choice = choice.as_ref();
    let seconds = begun.elapsed().as_secs_f64();
    write(&folder, (&spec, choice), &options, &outcome, &compared)?;
    if common.json {
        let times: serde_json::Map<String, serde_json::Value> = outcome.seconds.iter().map(|(n, s)| ((*n).to_owned(), json!(s))).collect();
        output::print_json(&json!({
            "outputs": args.output, "earlier_evaluations": kept, "seconds": seconds, "cpu_seconds": cost::cpu_seconds(), "parts": times, "fit": files::summary((&spec, choice), &options, &outcome, &compared),
        }))?;
    } else {
        tell(common, args, (&outcome, choice), &compared, seconds)?;
        if let Some(kept) = kept {
            output::tell(
                common,
                &format!(
                    "note: this run began anew; the evaluations of an earlier one are kept as {}: as evaluations.csv in a folder of its own, with `--resume`, \
                     they go on",
                    kept.display()
                ),
            );
        }
    }
    Ok(match outcome.ended_early {
        Some(Early::Interrupted) => interrupt::STATUS,
        _ if outcome.failures.is_empty() => 0,
        _ => exit::FAILED,
    })
}

/// The question of the fit file asked of one material: the one that `--only` names, or the one that the photographs show.
fn chosen(question: Spec, all: &[Candidate], options: &Options, args: &FitArgs, common: &CommonArgs) -> Result<(Spec, Option<Choice>)> {
    if let Some(name) = &args.only {
        let names: Vec<&str> = all.iter().map(|c| &*c.name).collect();
        let found = all
            .iter()
            .find(|c| c.name == *name)
            .ok_or_else(|| BadInput::new(format!("no candidate is called \"{name}\""), suggest(name, &names)).at_field("only"))?;
        return Ok((question.of(found), None));
    }
    if question.candidates.is_empty() {
        return Ok((question, None));
    }
    let choice = progress::with_control(common, |control| choose(&question, options, control))?;
    let spec = question.of(&all[choice.chosen]);
    Ok((spec, Some(choice)))
}

/// Writes the best guess so far beside its photograph, if the last one is old enough.
fn show(better: &Better<'_>, shown: &Mutex<Instant>, folder: &Folder, control: &Control<'_>) {
    let Ok(mut last) = shown.try_lock() else { return };
    if last.elapsed() < BETWEEN_PICTURES {
        return;
    }
    let Ok(Some(rgb)) = better.picture(0, control) else { return };
    if let Ok(png) = pictures::panels(&[pictures::Pair::new(better.photographs[0], &rgb)]) {
        // A picture that cannot be written must not stop the work; the last one, with the report, must.
        let _ = folder.write_pictures(&png);
    }
    *last = Instant::now();
}

/// Writes the evaluations so far, if those on disk are old enough.
fn keep(trace: &dyn Fn() -> Trace, kept: &Mutex<Instant>, folder: &Folder, mark: &str) {
    let Ok(mut last) = kept.try_lock() else { return };
    if last.elapsed() >= BETWEEN_CHECKPOINTS {
        // As with pictures: evaluations that cannot be written must not stop the work; the last ones must.
        let _ = folder.write_evaluations(&trace(), mark);
        *last = Instant::now();
    }
}

fn write(
    folder: &Folder,
    (spec, choice): (&Spec, Option<&Choice>),
    options: &Options,
    outcome: &Outcome,
    compared: &[trade::Line],
) -> Result<()> {
    let mut text = outcome.text.clone();
    text.rebase(spec.material_file.parent().unwrap_or(Path::new("")));
    text.set_name(&spec.name);
    let material = format!("{}\n{}", files::MATERIAL_MARK, text.text());
    let json = serde_json::to_vec_pretty(&files::summary((spec, choice), options, outcome, compared))
        .map_err(|e| Error::Numeric(format!("cannot write the result as JSON: {e}; please report this")))?;
    let png = pictures::panels(&pictures::of(outcome))?;
    let html = report::page((spec, choice), options, outcome, compared)?;
    folder.material.write(|out| out.write_all(material.as_bytes()))?;
    folder.json.write(|out| out.write_all(&json))?;
    // Without any the picture of the search stays.
    if !outcome.compared.is_empty() {
        folder.write_pictures(&png)?;
    }
    folder.report.write(|out| out.write_all(html.as_bytes()))
}

/// Prints the verdict, and says the rest; why a fit failed is an error, which `--quiet` does not silence.
fn tell(
    common: &CommonArgs,
    args: &FitArgs,
    (outcome, choice): (&Outcome, Option<&Choice>),
    compared: &[trade::Line],
    seconds: f64,
) -> Result<()> {
    let verdict = if outcome.failures.is_empty() { "PASS" } else { "FAIL" };
    let verdict = if outcome.failures.is_empty() && outcome.validations.is_empty() { "not validated" } else { verdict };
    let evaluations = outcome.evaluations;
    let winner = outcome.starts.first();
    let early = match outcome.ended_early {
        Some(Early::Interrupted) => ", interrupted",
        Some(Early::TimeLimit) => ", ended by the time limit",
        None => "",
    };
    output::print(&format!(
        "{verdict}: training error {:.2} %, {evaluations} evaluations ({} of the winning start), {seconds:.1} s{early}\n",
        100.0 * outcome.training,
        winner.map_or(0, |s| s.evaluations)
    ))?;
    if let Some(choice) = choice {
        output::print(&format!("chosen: {}\n", choice.sentence()))?;
    }
    for known in &outcome.identified.known {
        output::tell(common, &format!("  {}", files::line(known)));
    }
    for (validation, _) in &outcome.validations {
        output::tell(
            common,
            &format!(
                "validation {}: {:?}, error {:.2} % ({:.2} times training), Delta E ITP {:.2}, light {:.0} degrees away",
                validation.photograph,
                validation.verdict,
                100.0 * validation.relative_rms,
                validation.ratio,
                validation.delta_e_itp,
                validation.angle_deg
            ),
        );
    }
    for line in compared {
        output::tell(common, &line.to_string());
    }
    for failure in &outcome.failures {
        output::say(&format!("failure: {}", common.flags.in_text(failure)));
    }
    for cause in &outcome.causes {
        output::tell(common, &format!("likely cause: {}", common.flags.in_text(&cause.remedy)));
    }
    for note in &outcome.notes {
        output::tell(common, &format!("note: {}", common.flags.in_text(note)));
    }
    if let Some(early) = outcome.ended_early {
        let why = if early == Early::Interrupted { "it was interrupted" } else { "the time limit was reached" };
        output::tell(common, &format!("note: the search ended early, {why}; --resume goes on"));
    }
    output::tell(common, &format!("wrote {}", args.output.display()));
    Ok(())
}
