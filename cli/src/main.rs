//! The command `biscale`: one file a command, and what they share in `options`, `output`, `progress` and `interrupt`.

mod bake;
mod cache;
mod capture;
mod check;
mod check_fit;
mod check_scene;
mod check_shoot;
mod compare;
mod eval;
mod fit;
mod fold;
mod interrupt;
mod kind;
mod later;
mod new;
mod options;
mod output;
#[cfg(feature = "capture")]
mod output_folder;
mod pairs;
mod plot;
mod png_file;
mod progress;
mod render;
mod report;
mod study;

use biscale::error::{Error, Result};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use kind::Kind;
use options::CommonArgs;
use std::process::ExitCode;

/// Bad input or arguments.
const BAD_INPUT: u8 = 2;
/// Everything else that fails.
const FAILED: u8 = 1;

/// Effective BRDFs of bi-scale materials: from a small-scale surface to its look from afar
#[derive(Parser, Debug)]
#[command(name = "biscale", version, subcommand_required = true, arg_required_else_help = true, max_term_width = 100)]
#[command(after_help = "Exit status: 0 done; 2 bad input or arguments; 130 interrupted; 1 anything else.")]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: CommonArgs,
}

/// In the order of the work.
#[derive(Subcommand, Debug)]
enum Command {
    /// Write a commented file with every parameter
    New(new::NewArgs),
    /// Validate files and say what would be done; does nothing
    Check(check::CheckArgs),
    /// Effective BRDF at listed directions
    Eval(eval::EvalArgs),
    /// Effective BRDF as a whole table
    Bake(bake::BakeArgs),
    /// Pictures: polar plots of the effective BRDF, a view of the surface
    Plot(plot::PlotArgs),
    /// The large-scale appearance, as an image
    Render(render::RenderArgs),
    /// How far two images are apart: PSNR, relative RMS, FLIP
    Compare(compare::CompareArgs),
    /// Error against time, for every method and setting
    Study(study::StudyArgs),
    /// One run of a study, in a process of its own
    #[command(hide = true)]
    StudyRun(study::child::RunArgs),
    /// Folding pattern: sheets to print, cut, fold and glue
    Fold(Box<fold::FoldArgs>),
    /// Photographs to calibrated measurements
    Capture(capture::CaptureArgs),
    /// Photographs to a material, and how far to trust it
    Fit(fit::FitArgs),
    /// Precomputed BRDFs of the low-rank method: list or clear them
    Cache(cache::CacheArgs),
    /// The interactive editor (not built yet)
    Edit(later::LaterArgs),
}

fn main() -> ExitCode {
    let json_wanted = std::env::args_os().any(|a| a == "--json");
    let cli = match Cli::command().try_get_matches().and_then(|m| Cli::from_arg_matches(&m)) {
        Ok(cli) => cli,
        Err(e) => {
            if json_wanted && e.use_stderr() {
                // The exit status tells the same, should standard output be closed.
                let _ = output::print_json(&output::Failure::arguments(&e));
            }
            let _ = e.print();
            return if e.use_stderr() { ExitCode::from(BAD_INPUT) } else { ExitCode::SUCCESS };
        }
    };
    interrupt::install();
    // A panic is a bug. It has said what it is; the exit status stays one of those documented.
    match std::panic::catch_unwind(|| run(&cli).map_err(|error| explained(error, &cli.command))) {
        Ok(Ok(status)) => ExitCode::from(status),
        Ok(Err(error)) => ExitCode::from(fail(&error, cli.common.json)),
        Err(_) => ExitCode::from(FAILED),
    }
}

/// Runs the command. A command that did its work and has bad news all the same returns the exit status.
fn run(cli: &Cli) -> Result<u8> {
    let threads = usize::from(cli.common.threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| Error::Numeric(format!("cannot start {threads} threads: {e}")))?;
    match &cli.command {
        Command::New(args) => new::run(args, &cli.common)?,
        Command::Check(args) => return check::run(args, &cli.common),
        Command::Eval(args) => eval::run(args, &cli.common)?,
        Command::Bake(args) => bake::run(args, &cli.common)?,
        Command::Plot(args) => plot::run(args, &cli.common)?,
        Command::Render(args) => render::run(args, &cli.common)?,
        Command::Compare(args) => compare::run(args, &cli.common)?,
        Command::Study(args) => study::run(args, &cli.common)?,
        Command::StudyRun(args) => study::child::run(args, &cli.common)?,
        Command::Fold(args) => return fold::run(args, &cli.common),
        Command::Capture(args) => return capture::run(args, &cli.common),
        Command::Fit(args) => return fit::run(args, &cli.common),
        Command::Cache(args) => cache::run(args, &cli.common)?,
        Command::Edit(_) => later::run("edit")?,
    }
    Ok(0)
}

/// The error of a command whose file may be of another kind than it takes.
fn explained(error: Error, command: &Command) -> Error {
    let (wanted, path) = match command {
        Command::Eval(args) => (Kind::Material, Some(&args.material)),
        Command::Bake(args) => (Kind::Material, Some(&args.material)),
        Command::Plot(args) => (Kind::Material, Some(&args.input)),
        Command::Study(args) => (Kind::Material, Some(&args.material)),
        Command::Fold(args) => (Kind::Material, args.material.as_ref()),
        Command::Render(args) => (Kind::Scene, Some(&args.scene)),
        Command::Capture(args) => (Kind::Shoot, Some(&args.shoot)),
        Command::Fit(args) => (Kind::Fit, Some(&args.fit)),
        Command::New(_) | Command::Check(_) | Command::Compare(_) | Command::StudyRun(_) | Command::Cache(_) | Command::Edit(_) => {
            return error;
        }
    };
    match path {
        Some(path) => kind::explain(error, wanted, path),
        None => error,
    }
}

/// Says what went wrong and returns the exit status.
fn fail(error: &Error, json: bool) -> u8 {
    if output::is_broken_pipe(error) {
        return 0;
    }
    if json {
        // The exit status and standard error tell the same, should standard output be closed.
        let _ = output::print_json(&output::Failure::new(error));
    }
    output::say(&format!("error: {error}"));
    status(error)
}

/// The exit status of an error.
fn status(error: &Error) -> u8 {
    match error {
        Error::BadInput(_) => BAD_INPUT,
        Error::Interrupted => interrupt::STATUS,
        Error::Unsupported { .. } | Error::Io { .. } | Error::Numeric(_) => FAILED,
    }
}
