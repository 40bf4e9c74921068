//! `biscale fold`: sheets to print, cut, fold and glue.

mod args;
mod facets;
mod folded;
mod job;
mod outputs;
mod strips;
mod verify;

pub use args::FoldArgs;

use crate::common::options::CommonArgs;
use biscale::error::{BadInput, Result};
use biscale_fabricate::design::Source;
use job::FoldJob;
use outputs::Outputs;
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
    let recipe = args.recipe(&source, paper)?;
    let job = FoldJob { args, source: &source, path: material, recipe, paper, format, outputs };
    match job.weave() {
        Some(weave) => strips::run(&job, weave, common),
        None => facets::run(&job, common, start),
    }
}
