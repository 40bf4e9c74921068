//! What a study comes to, in a few lines or as JSON.

use super::folder::{self, Folder};
use super::plan::StudyPlan;
use super::points;
use super::record::DONE;
use biscale::study::{Asked, Truth};
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;

/// What a study comes to. Shown as a few lines of text, or serialised.
#[derive(Debug, Serialize)]
pub struct StudySummary<'a> {
    material: &'a str,
    /// What light is studied, where the material asks for more.
    #[serde(skip_serializing_if = "Option::is_none")]
    light: Option<String>,
    files: Vec<PathBuf>,
    /// Runs that were made now, and those that are not done: cannot be done, failed, took too long.
    runs_made: usize,
    settings: usize,
    settings_not_done: usize,
    /// Relative RMS error of the truth of each question.
    truth_error: Vec<(&'static str, f64)>,
    frontier: Vec<OnFrontier>,
}

/// A setting on the frontier.
#[derive(Debug, Serialize)]
struct OnFrontier {
    question: &'static str,
    setting: String,
    cpu_s: f64,
    error: f64,
    /// Whether the error is only a bound: the truth is not exact enough to tell it.
    error_is_bound: bool,
}

impl<'a> StudySummary<'a> {
    /// Gathers it; `runs_made` are those made now.
    pub fn new(plan: &'a StudyPlan, folder: &Folder, points: &[points::Point], truths: &[(Asked, Truth)], runs_made: usize) -> Self {
        let mut frontier = Vec::new();
        for (asked, _) in truths {
            let (competing, best) = points::competing(points, *asked);
            frontier.extend(best.iter().map(|&k| OnFrontier {
                question: asked.name(),
                setting: competing[k].work.to_string(),
                cpu_s: competing[k].cpu_s,
                error: competing[k].shown_error(),
                error_is_bound: !competing[k].is_resolved(),
            }));
        }
        Self {
            material: &plan.material.name,
            light: (plan.small.bounces > 0).then(|| plan.direct_light()),
            files: folder.written(),
            runs_made,
            settings: points.len(),
            settings_not_done: points.iter().filter(|p| p.status != DONE).count(),
            truth_error: truths.iter().map(|(asked, truth)| (asked.name(), truth.relative_rms())).collect(),
            frontier,
        }
    }
}

impl fmt::Display for StudySummary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} settings, {} of them not done; {} runs made now",
            self.material, self.settings, self.settings_not_done, self.runs_made
        )?;
        if let Some(light) = &self.light {
            writeln!(f, "{light}")?;
        }
        for (name, error) in &self.truth_error {
            writeln!(f, "truth of the {name}: relative RMS error {:.3} %", 100.0 * error)?;
        }
        for best in &self.frontier {
            let OnFrontier { question, setting, cpu_s, error, error_is_bound } = best;
            let bound = if *error_is_bound { "at most " } else { "" };
            writeln!(f, "{question}: {:.1} CPU ms, error {bound}{:.3} %: {setting}", 1e3 * cpu_s, 100.0 * error)?;
        }
        let report = self.files.iter().find(|p| p.ends_with(folder::REPORT)).expect("the report is written");
        write!(f, "wrote {} and {} files that it refers to or is made of", report.display(), self.files.len() - 1)
    }
}
