//! How optimisers and tolerances compare: evaluations against the error that they end with.

use biscale::error::Result;
use biscale::filter::Control;
use biscale_fit::optimise::Optimiser;
use biscale_fit::run::{Effort, Options, fit};
use biscale_fit::search::Memory;
use biscale_fit::spec::Spec;
use serde::Serialize;
use std::fmt;

/// One way to search, and what came of it.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// In words.
    pub what: String,
    /// Evaluations of all starts.
    pub evaluations: usize,
    /// Evaluations of the winning start.
    pub of_winner: usize,
    /// Objective that it ended with.
    pub objective: f64,
    /// Training error.
    pub training: f64,
    /// The largest validation error, if there are photographs for it.
    pub validation: Option<f64>,
    /// Wall seconds of the search.
    #[serde(skip)]
    pub seconds: f64,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, evaluations, of_winner, objective, training, validation, seconds } = self;
        let validation = validation.map_or("-".to_owned(), |v| format!("{:.2} %", 100.0 * v));
        write!(
            f,
            "{what}: {evaluations} evaluations ({of_winner} of the winner), {seconds:.1} s, objective {objective:.4}, training {:.2} %, \
             validation {validation}",
            100.0 * training
        )
    }
}

/// Runs all of them.
///
/// # Errors
/// Those of the fit.
pub fn compare(spec: &Spec, options: &Options, control: &Control<'_>) -> Result<Vec<Line>> {
    let default = Effort::default();
    let loose = Effort { size: [0.05, 0.05], cost: [0.05, 0.05], ..default };
    let tight = Effort { size: [0.005, 0.001], cost: [0.005, 0.0005], ..default };
    let at_once = Effort { coarse_first: false, ..default };
    let mut ways: Vec<(String, Options)> =
        Optimiser::ALL.map(|optimiser| (optimiser.name().to_owned(), Options { optimiser, ..options.clone() })).into();
    let nelder_mead = Options { optimiser: Optimiser::NelderMead, ..options.clone() };
    for (what, effort) in [("loose tolerance", loose), ("tight tolerance", tight), ("fine model from the start", at_once)] {
        ways.push((format!("nelder-mead, {what}"), Options { effort, ..nelder_mead.clone() }));
    }
    ways.push(("nelder-mead, joint colours".to_owned(), Options { joint: true, ..nelder_mead }));
    let count = ways.len() as f64;
    let mut lines = Vec::new();
    for (k, (what, options)) in ways.into_iter().enumerate() {
        let began = (control.clock)();
        let progress = |_: &str, share: f64| (control.progress)("comparing", (k as f64 + share) / count);
        let outcome = fit(spec, &options, &Memory::default(), &|_| {}, &Control { progress: &progress, ..*control })?;
        control.check()?;
        lines.push(Line {
            what,
            evaluations: outcome.trace.len(),
            of_winner: outcome.starts.first().map_or(0, |s| s.evaluations),
            objective: outcome.objective,
            training: outcome.training,
            validation: outcome.validations.iter().map(|(v, _)| v.relative_rms).reduce(f64::max),
            seconds: (control.clock)() - began,
        });
    }
    Ok(lines)
}
