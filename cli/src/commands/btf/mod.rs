//! `biscale btf`: bidirectional texture functions, between the look from near and that from afar.

mod image;
mod make;
mod pca;
mod ptm;

use crate::common::options::CommonArgs;
use biscale::error::Result;
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Arguments of `biscale btf`.
#[derive(Args, Debug)]
pub struct BtfArgs {
    #[command(subcommand)]
    command: BtfCommand,
}

#[derive(Debug, Subcommand)]
enum BtfCommand {
    /// Images of a material's tile from many sides in many lights, with standard errors
    Make(make::MakeArgs),
    /// One image of a BTF, as a picture
    Image(image::ImageArgs),
    /// All lights of one view as a polynomial texture map, which other programs relight
    Ptm(ptm::PtmArgs),
    /// What clusters and principal components make of a BTF: their errors and sizes
    Pca(pca::PcaArgs),
}

impl BtfArgs {
    /// The material file, of a command that takes one.
    pub(crate) fn material(&self) -> Option<&PathBuf> {
        match &self.command {
            BtfCommand::Make(args) => Some(&args.material),
            BtfCommand::Image(_) | BtfCommand::Ptm(_) | BtfCommand::Pca(_) => None,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Those of the command; nothing is written then.
pub fn run(args: &BtfArgs, common: &CommonArgs) -> Result<()> {
    match &args.command {
        BtfCommand::Make(args) => make::run(args, common),
        BtfCommand::Image(args) => image::run(args, common),
        BtfCommand::Ptm(args) => ptm::run(args, common),
        BtfCommand::Pca(args) => pca::run(args, common),
    }
}
