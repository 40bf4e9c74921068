//! Arguments of `biscale study`.

use crate::common::options;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `biscale study`.
#[derive(Args, Debug)]
#[command(
    after_help = "Writes study.csv (a line a run), report.html, pareto.svg and .png, placement.svg and .png, and what makes them again. \
                        A study that was interrupted goes on where it stopped. See docs/study.md."
)]
pub struct StudyArgs {
    /// Material file
    pub(crate) material: PathBuf,
    /// Folder for the results, made if it is not there
    #[arg(long, short, value_name = "FOLDER")]
    pub(super) output: PathBuf,
    /// Pairs to ask, as for `eval`, in place of the study's own two questions
    #[arg(long, value_name = "PAIRS.csv")]
    pub(super) pairs: Option<PathBuf>,
    /// Methods to try; `points` are plain sums over facets placed in several ways
    #[arg(long, value_enum, value_name = "METHODS", value_delimiter = ',', default_values_t = TriedMethod::ALL)]
    pub(super) methods: Vec<TriedMethod>,
    /// A short ladder and a rougher truth, for a first look
    #[arg(long)]
    pub(super) quick: bool,
    /// Seed of the questions and of the runs
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub(super) seed: u64,
    /// Runs of each setting, each with a seed of its own [default: 3, with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000), allow_negative_numbers = true)]
    pub(super) seeds: Option<u64>,
    /// Wall time of one run: one that takes longer is stopped
    #[arg(long, value_name = "TIME", default_value = "2m", value_parser = options::time, allow_hyphen_values = true)]
    pub(super) time_limit: Duration,
    /// Relative RMS error that the truth is computed to [default: 0.001, with --quick 0.005]
    #[arg(long, value_name = "ERROR", value_parser = options::tolerance, allow_negative_numbers = true)]
    pub(super) truth_tolerance: Option<f64>,
    /// Wall time for the truth of each question: then it is as exact as it got [default: 1m, with --quick 10s]
    #[arg(long, value_name = "TIME", value_parser = options::time, allow_hyphen_values = true)]
    pub(super) truth_time: Option<Duration>,
    /// Make no pictures of a sphere and a ring
    #[arg(long)]
    pub(super) no_pictures: bool,
    /// Begin anew in a folder that holds another study, or files that this command did not make
    #[arg(long)]
    pub(super) force: bool,
}

/// A method of `--methods`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TriedMethod {
    Auto,
    Direct,
    Lowrank,
    Sg,
    Reference,
    Points,
}

impl TriedMethod {
    /// All of them.
    const ALL: [Self; 6] = [Self::Auto, Self::Direct, Self::Lowrank, Self::Sg, Self::Reference, Self::Points];
}

impl std::fmt::Display for TriedMethod {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Direct => "direct",
            Self::Lowrank => "lowrank",
            Self::Sg => "sg",
            Self::Reference => "reference",
            Self::Points => "points",
        })
    }
}
