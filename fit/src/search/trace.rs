//! The evaluations of a search: kept, counted, told to the caller, and recalled from an earlier run.

use crate::residuals::model::Model;
use biscale::filter::Control;
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Part of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// All starts, coarse.
    Explore,
    /// The best starts, fine.
    Refine,
    /// The best one, once more.
    Polish,
}

impl Stage {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explore => "explore",
            Self::Refine => "refine",
            Self::Polish => "polish",
        }
    }
}

/// An evaluation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// Part of the search.
    pub stage: Stage,
    /// Which start.
    pub start: usize,
    /// Which evaluation of that start in that part, from 0.
    pub evaluation: usize,
    /// The objective; infinite where the numbers make no surface.
    pub objective: f64,
    /// The point of the unit box.
    pub point: Vec<f64>,
}

/// Evaluations of an earlier run, by stage, start and number.
#[derive(Clone, Debug, Default)]
pub struct Memory(FxHashMap<(Stage, usize, usize), (Vec<f64>, f64)>);

impl Memory {
    /// Of a trace.
    pub fn new(entries: impl IntoIterator<Item = Entry>) -> Self {
        Self(entries.into_iter().map(|e| ((e.stage, e.start, e.evaluation), (e.point, e.objective))).collect())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn recall(&self, stage: Stage, start: usize, evaluation: usize, point: &[f64]) -> Option<f64> {
        self.0.get(&(stage, start, evaluation)).filter(|(p, _)| p == point).map(|(_, f)| *f)
    }
}

/// What all searches share.
pub struct SearchShared<'a> {
    /// The caller's.
    pub control: &'a Control<'a>,
    /// The seconds of the clock after which no evaluation begins, if there are such.
    pub deadline: Option<f64>,
    /// Earlier evaluations.
    pub memory: &'a Memory,
    /// All evaluations so far.
    pub trace: Mutex<Vec<Entry>>,
    /// Evaluations that are expected in all.
    pub expected: AtomicUsize,
    /// Told every evaluation that is better than all before it of its stage.
    pub better: &'a (dyn Fn(&Entry, &Model<'_>) + Sync),
    best: Mutex<f64>,
}

impl<'a> SearchShared<'a> {
    /// Nothing evaluated yet.
    pub fn new(
        control: &'a Control<'a>,
        deadline: Option<f64>,
        memory: &'a Memory,
        better: &'a (dyn Fn(&Entry, &Model<'_>) + Sync),
    ) -> Self {
        let (trace, best) = (Mutex::new(Vec::new()), Mutex::new(f64::INFINITY));
        Self { control, deadline, memory, trace, expected: AtomicUsize::new(1), better, best }
    }

    /// Whether the search must end early. A time limit lets one evaluation pass: without any there is no best so far.
    pub fn must_end(&self) -> bool {
        let evaluated = || !self.trace.lock().unwrap_or_else(std::sync::PoisonError::into_inner).is_empty();
        self.control.check().is_err() || self.deadline.is_some_and(|d| (self.control.clock)() >= d && evaluated())
    }

    /// Begins a stage, whose bests are not compared with those of the stage before.
    pub fn begin_stage(&self, evaluations: usize) {
        *self.best.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = f64::INFINITY;
        self.expected.fetch_add(evaluations, Ordering::Relaxed);
    }

    pub(super) fn note(&self, entry: Entry, model: &Model<'_>) {
        let is_better = {
            let mut best = self.best.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let is_better = entry.objective < *best;
            *best = best.min(entry.objective);
            is_better
        };
        if is_better {
            (self.better)(&entry, model);
        }
        let mut trace = self.trace.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        trace.push(entry);
        let share = trace.len() as f64 / self.expected.load(Ordering::Relaxed).max(1) as f64;
        (self.control.progress)("search", 0.05 + 0.75 * share.min(1.0));
    }

    /// The trace in an order that does not depend on threads.
    pub fn sorted_trace(&self) -> Vec<Entry> {
        let mut trace = self.trace.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone();
        trace.sort_by_key(|e| (e.stage as usize, e.start, e.evaluation));
        trace
    }
}
