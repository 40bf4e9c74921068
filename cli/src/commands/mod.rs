//! The commands, in the order of the work: one file or folder each.

mod bake;
mod btf;
mod cache;
mod capture;
mod check;
mod compare;
mod eval;
mod fit;
mod fold;
mod list;
mod new;
mod plot;
mod render;
mod study;
mod unbuilt;

use crate::common::file_kind::{self, FileKind};
use crate::common::options::CommonArgs;
use biscale::error::{Error, Result};
use clap::Subcommand;

/// In the order of the work.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Write a commented file with every parameter
    New(new::NewArgs),
    /// List what is built in: BRDFs
    List(list::ListArgs),
    /// Validate files and say what would be done; does nothing
    Check(check::CheckArgs),
    /// Effective BRDF at listed directions
    Eval(eval::EvalArgs),
    /// Effective BRDF as a whole table
    Bake(bake::BakeArgs),
    /// Bidirectional texture functions: the look between near and far
    Btf(btf::BtfArgs),
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
    StudyRun(study::RunArgs),
    /// Folding pattern: sheets to print, cut, fold and glue
    Fold(Box<fold::FoldArgs>),
    /// Photographs to calibrated measurements
    Capture(capture::CaptureArgs),
    /// Photographs to a material, and how far to trust it
    Fit(fit::FitArgs),
    /// Precomputed BRDFs of the low-rank method: list or clear them
    Cache(cache::CacheArgs),
    /// The interactive editor (not built yet)
    Edit(unbuilt::UnbuiltArgs),
}

impl Command {
    /// Runs the command. One that did its work and has bad news all the same returns the exit status.
    ///
    /// # Errors
    /// Those of the command.
    pub fn run(&self, common: &CommonArgs) -> Result<u8> {
        self.dispatch(common).map_err(|error| self.explained(error))
    }

    fn dispatch(&self, common: &CommonArgs) -> Result<u8> {
        match self {
            Self::New(args) => new::run(args, common)?,
            Self::List(args) => list::run(args, common)?,
            Self::Check(args) => return check::run(args, common),
            Self::Eval(args) => eval::run(args, common)?,
            Self::Bake(args) => bake::run(args, common)?,
            Self::Btf(args) => btf::run(args, common)?,
            Self::Plot(args) => plot::run(args, common)?,
            Self::Render(args) => render::run(args, common)?,
            Self::Compare(args) => compare::run(args, common)?,
            Self::Study(args) => study::run(args, common)?,
            Self::StudyRun(args) => study::run_one(args, common)?,
            Self::Fold(args) => return fold::run(args, common),
            Self::Capture(args) => return capture::run(args, common),
            Self::Fit(args) => return fit::run(args, common),
            Self::Cache(args) => cache::run(args, common)?,
            Self::Edit(_) => unbuilt::run("edit")?,
        }
        Ok(0)
    }

    /// The error of a command whose file may be of another kind than it takes.
    fn explained(&self, error: Error) -> Error {
        let (wanted, path) = match self {
            Self::Eval(args) => (FileKind::Material, Some(&args.material)),
            Self::Bake(args) => (FileKind::Material, Some(&args.material)),
            // Of several the error names the one.
            Self::Plot(args) => (FileKind::Material, args.inputs.first().filter(|_| args.inputs.len() == 1)),
            Self::Study(args) => (FileKind::Material, Some(&args.material)),
            Self::Fold(args) => (FileKind::Material, args.material.as_ref()),
            Self::Render(args) => (FileKind::Scene, Some(&args.scene)),
            Self::Capture(args) => (FileKind::Shoot, Some(&args.shoot)),
            Self::Fit(args) => (FileKind::Fit, Some(&args.fit)),
            Self::Btf(args) => (FileKind::Material, args.material()),
            Self::New(_) | Self::List(_) | Self::Check(_) | Self::Compare(_) | Self::StudyRun(_) | Self::Cache(_) | Self::Edit(_) => {
                return error;
            }
        };
        match path {
            Some(path) => file_kind::explain(error, wanted, path),
            None => error,
        }
    }
}
