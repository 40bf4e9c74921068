//! The whole fit: photographs in, material out.

use super::deadline::stopped_when;
use super::finish::{self, Ending};
use super::options::{Options, REPORT_SHARE};
use super::outcome::{Better, Outcome};
use super::prepared::Prepared;
use super::stages::Search;
use super::stopwatch::Stopwatch;
use super::watcher::Watcher;
use crate::fit_file::spec::Spec;
use crate::residuals::model::Model;
use crate::search::{Entry, Memory, SearchShared, Told, Trace};
use biscale::error::Result;
use biscale::filter::Control;
use std::sync::atomic::AtomicBool;

/// Fits.
///
/// The same fit file, options and seed give the same result at any thread count, unless the time limit or the user ends the search. With
/// `memory`, the evaluations of an earlier run of the same fit, the search goes on where that one ended.
///
/// The time limit is that of all of it: the search ends when [`REPORT_SHARE`] of it is left, and what of the report does not fit into that is left out
/// and named. It waits for the photographs, for the first point that makes a surface, for the objective of the best one, and, with `memory`, until the earlier
/// run was gone through again.
///
/// # Errors
/// Bad input; failures of the filter. Not `Interrupted` once the search has evaluated anything: then the outcome is the best so far.
pub fn fit(spec: &Spec, options: &Options, memory: &Memory, watcher: Watcher<'_>, control: &Control<'_>) -> Result<Outcome> {
    let mut watch = Stopwatch::new(control);
    let began = watch.last;
    (control.progress)("photographs", 0.0);
    let prepared = Prepared::new(spec, control)?;
    watch.lap("photographs");
    let better = |entry: &Entry, model: &Model<'_>| {
        let Entry { stage, objective, point, .. } = entry;
        (watcher.better)(&Better { stage: *stage, objective: *objective, point, model, photographs: &prepared.distant });
    };
    let kept = |shared: &SearchShared<'_>, model: &Model<'_>| {
        let coordinates = || model.variables.iter().map(|v| v.name(spec, &model.unknowns)).collect();
        (watcher.evaluated)(&|| Trace { coordinates: coordinates(), entries: shared.trace_with_memory() });
    };
    let told = Told { better: &better, kept: &kept };
    let Some(limit) = options.time_limit else {
        let shared = SearchShared::new(control, None, memory, told);
        let found = Search { prepared: &prepared, options, shared: &shared }.run(&mut watch)?;
        return finish::finish(&prepared, options, &shared, found, Ending { control, deadline: None }, watch);
    };
    let stop = AtomicBool::new(false);
    let limited = Control { cancel: &stop, ..*control };
    let shared = SearchShared::new(&limited, Some(began + (1.0 - REPORT_SHARE) * limit), memory, told);
    // What an earlier run evaluated is gone through in any case: else a search that is resumed again and again might never get on.
    let over = || control.check().is_err() || (memory.is_empty() && shared.is_late());
    let found = stopped_when(&stop, over, || Search { prepared: &prepared, options, shared: &shared }.run(&mut watch))?;
    let deadline = if memory.is_empty() { began + limit } else { (began + limit).max((control.clock)() + REPORT_SHARE * limit) };
    finish::finish(&prepared, options, &shared, found, Ending { control, deadline: Some(deadline) }, watch)
}
