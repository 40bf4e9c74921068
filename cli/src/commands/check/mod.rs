//! `biscale check`: validates files and says what would be done; does nothing.

mod fit;
mod material;
mod scene;
mod shoot;
mod would_run;

use crate::common::exit;
use crate::common::file_kind::FileKind;
use crate::common::interrupt;
use crate::common::options::{CommonArgs, QualityArgs};
use crate::common::output::{self, Description};
use biscale::error::{Error, Result};
use biscale::filter::Quality;
use biscale::material::Material;
use biscale::render::Scene;
use biscale::toml_reader::Source;
use biscale_capture::shoot::Shoot;
use biscale_fit::fit_file::spec::Spec;
use clap::Args;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// Arguments of `biscale check`.
#[derive(Args, Debug)]
pub struct CheckArgs {
    /// Material, scene, shoot and fit files
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    quality: QualityArgs,
}

/// Runs the command: every file is looked at, also after a bad one. Returns the exit status.
///
/// # Errors
/// Only those of the command itself; mistakes in the files are reported, and count in the status.
pub fn run(args: &CheckArgs, common: &CommonArgs) -> Result<u8> {
    let quality = args.quality.quality()?;
    // Options that contradict each other are no file's mistake.
    quality.method_to_run(0)?;
    let mut outcomes = Vec::new();
    let mut status = 0;
    for file in &args.files {
        if interrupt::flag().load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let result = AnyReport::of(file, &quality).map_err(|error| common.flags.in_error(error));
        let outcome = Outcome { file: file.display().to_string(), result };
        match &outcome.result {
            Ok(_) if common.json => {}
            Ok(report) if common.quiet => output::print(&format!("{}: {}\n", outcome.file, report.verdict()))?,
            Ok(report) => output::print(&format!("{}: {}\n{report}", outcome.file, report.verdict()))?,
            Err(error) => {
                output::say_error(&error.to_string());
                // Bad input weighs most: it is what this command looks for.
                let this = exit::status(error);
                status = if status == exit::BAD_INPUT { status } else { this };
            }
        }
        outcomes.push(outcome);
    }
    for note in args.quality.notes() {
        output::tell(common, &format!("note: {}", common.flags.in_text(&note)));
    }
    if common.json {
        output::print_json(&Object { ok: status == 0, files: outcomes })?;
    }
    Ok(status)
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object {
    ok: bool,
    files: Vec<Outcome>,
}

/// What became of one file.
struct Outcome {
    file: String,
    result: Result<AnyReport>,
}

/// What a good file means.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
enum AnyReport {
    Material(Box<material::Report>),
    Scene(scene::Report),
    Fit(Box<fit::Report>),
    Shoot(shoot::Report),
}

impl fmt::Display for AnyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Material(report) => report.fmt(f),
            Self::Scene(report) => report.fmt(f),
            Self::Fit(report) => report.fmt(f),
            Self::Shoot(report) => report.fmt(f),
        }
    }
}

impl AnyReport {
    /// How good the file is, in a word or two.
    fn verdict(&self) -> &'static str {
        match self {
            Self::Shoot(report) if report.is_doubtful() => "readable, but doubtful",
            _ => "ok",
        }
    }

    fn of(file: &Path, quality: &Quality) -> Result<Self> {
        let source = Source::read(file)?;
        Ok(match FileKind::of(&source) {
            FileKind::Fit => Self::Fit(Box::new(fit::Report::of(&Spec::parse(&source)?)?)),
            FileKind::Shoot => Self::Shoot(shoot::Report::of(&Shoot::parse(&source)?)?),
            FileKind::Scene => Self::Scene(scene::Report::of(&Scene::parse(&source)?, quality)?),
            FileKind::Material => Self::Material(Box::new(material::Report::of(&Material::parse(&source)?, quality)?)),
        })
    }
}

impl Serialize for Outcome {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Entry<'a> {
            file: &'a str,
            ok: bool,
            #[serde(skip_serializing_if = "Option::is_none")]
            report: Option<&'a AnyReport>,
            #[serde(skip_serializing_if = "Option::is_none")]
            error: Option<Description>,
        }
        let report = self.result.as_ref().ok();
        let error = self.result.as_ref().err().map(Description::new);
        Entry { file: &self.file, ok: report.is_some(), report, error }.serialize(serializer)
    }
}
