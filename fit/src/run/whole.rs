//! The whole fit: photographs in, material out.

use super::finish;
use super::options::Options;
use super::outcome::{Better, Outcome};
use super::prepared::Prepared;
use super::stages::Search;
use super::stopwatch::Stopwatch;
use crate::fit_file::spec::Spec;
use crate::residuals::model::Model;
use crate::search::{Entry, Memory, SearchShared};
use biscale::error::Result;
use biscale::filter::Control;

/// Fits.
///
/// The same fit file, options and seed give the same result at any thread count, unless the time limit or the user ends the search. With
/// `memory`, the evaluations of an earlier run of the same fit, the search goes on where that one ended.
///
/// # Errors
/// Bad input; failures of the filter. Not `Interrupted` once the search has evaluated anything: then the outcome is the best so far.
pub fn fit(
    spec: &Spec,
    options: &Options,
    memory: &Memory,
    better: &(dyn Fn(&Better<'_>) + Sync),
    control: &Control<'_>,
) -> Result<Outcome> {
    let mut watch = Stopwatch { control, last: (control.clock)(), parts: Vec::new() };
    let deadline = options.time_limit.map(|t| (control.clock)() + t);
    (control.progress)("photographs", 0.0);
    let prepared = Prepared::new(spec, control)?;
    watch.lap("photographs");
    let told = |entry: &Entry, model: &Model<'_>| {
        let Entry { stage, objective, point, .. } = entry;
        better(&Better { stage: *stage, objective: *objective, point, model, photographs: &prepared.distant });
    };
    let shared = SearchShared::new(control, deadline, memory, &told);
    let found = Search { prepared: &prepared, options, shared: &shared }.run(&mut watch)?;
    finish::finish(&prepared, options, &shared, found, watch)
}
