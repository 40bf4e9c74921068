//! Who looks on while a fit runs.

use super::outcome::Better;
use crate::search::Trace;

/// What a caller is told while the search runs, from any thread.
#[derive(Clone, Copy)]
pub struct Watcher<'a> {
    /// Told every guess that is better than all before it of its stage.
    pub better: &'a (dyn Fn(&Better<'_>) + Sync),
    /// Called after every evaluation with a way to all evaluations so far, those of an earlier run included: what a caller keeps of them,
    /// [`Memory`](crate::search::Memory) makes the search go on from.
    pub evaluated: &'a (dyn Fn(&dyn Fn() -> Trace) + Sync),
}

impl Watcher<'static> {
    /// Nobody.
    pub const NOBODY: Self = Self { better: &|_| {}, evaluated: &|_| {} };
}
