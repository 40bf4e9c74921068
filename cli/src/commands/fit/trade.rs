//! How optimisers and tolerances compare: evaluations against the error that they end with.

use crate::common::cost::cpu_seconds;
use biscale::error::Result;
use biscale::filter::Control;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Effort, Options, Watcher, fit};
use biscale_fit::search::Memory;
use biscale_fit::search::optimise::Optimiser;
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
    /// CPU seconds, where the system tells.
    #[serde(skip)]
    pub cpu_seconds: Option<f64>,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, evaluations, of_winner, objective, training, validation, seconds, cpu_seconds } = self;
        let cpu = cpu_seconds.map_or(String::new(), |s| format!(", {s:.1} CPU s"));
        let validation = validation.map_or("-".to_owned(), |v| format!("{:.2} %", 100.0 * v));
        write!(
            f,
            "{what}: {evaluations} evaluations ({of_winner} of the winner), {seconds:.1} s{cpu}, objective {objective:.4}, training {:.2} %, \
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
    let plain = Effort { descent: false, ..default };
    let with = |optimiser, effort| Options { optimiser, effort, ..options.clone() };
    let mut ways = vec![
        ("nelder-mead, then lm".to_owned(), with(Optimiser::NelderMead, default)),
        ("nelder-mead alone".to_owned(), with(Optimiser::NelderMead, plain)),
    ];
    for optimiser in [Optimiser::Cmaes, Optimiser::Bobyqa, Optimiser::Lm] {
        ways.push((format!("{} alone", optimiser.name()), with(optimiser, default)));
    }
    for (first, last) in [(0.1, 0.1), (0.1, 0.001), (0.02, 0.02), (0.02, 0.001), (0.004, 0.001)] {
        let effort = Effort { size: [first, last], cost: [first, last], ..default };
        ways.push((format!("tolerance {first} first, {last} at the end"), with(Optimiser::NelderMead, effort)));
    }
    ways.push(("fine model from the start".to_owned(), with(Optimiser::NelderMead, Effort { coarse_first: false, ..plain })));
    ways.push(("joint colours".to_owned(), Options { joint: true, ..with(Optimiser::NelderMead, plain) }));
    let count = ways.len() as f64;
    let mut lines = Vec::new();
    for (k, (what, options)) in ways.into_iter().enumerate() {
        let (began, cpu) = ((control.clock)(), cpu_seconds());
        let progress = |_: &str, share: f64| (control.progress)("comparing", (k as f64 + share) / count);
        let outcome = fit(spec, &options, &Memory::default(), Watcher::NOBODY, &Control { progress: &progress, ..*control })?;
        control.check()?;
        lines.push(Line {
            what,
            evaluations: outcome.evaluations,
            of_winner: outcome.starts.first().map_or(0, |s| s.evaluations),
            objective: outcome.objective,
            training: outcome.training,
            validation: outcome.validations.iter().map(|(v, _)| v.relative_rms).reduce(f64::max),
            seconds: (control.clock)() - began,
            cpu_seconds: cpu.zip(cpu_seconds()).map(|(before, after)| after - before),
        });
    }
    Ok(lines)
}
