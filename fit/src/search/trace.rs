//! The evaluations of a search: kept, told to the caller, and recalled from an earlier run.

use crate::residuals::model::Model;
use biscale::filter::Control;
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

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

/// Evaluations with what their points mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Names of the coordinates of a point.
    pub coordinates: Vec<String>,
    /// By stage, start and number.
    pub entries: Vec<Entry>,
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

    /// What is recalled, in no order.
    fn entries(&self) -> impl Iterator<Item = Entry> {
        let entry = |(&(stage, start, evaluation), (point, objective)): (&_, &(Vec<f64>, f64))| Entry {
            stage,
            start,
            evaluation,
            objective: *objective,
            point: point.clone(),
        };
        self.0.iter().map(entry)
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
    /// Who is told of evaluations.
    pub told: Told<'a>,
    best: Mutex<f64>,
    /// Whether a point that makes a surface was evaluated.
    found: AtomicBool,
    evaluations: AtomicUsize,
}

/// Who is told of evaluations; both may be called from any thread.
#[derive(Clone, Copy)]
pub struct Told<'a> {
    /// Of every one that is better than all before it of its stage.
    pub better: &'a (dyn Fn(&Entry, &Model<'_>) + Sync),
    /// Of every one, after it was kept.
    pub kept: &'a (dyn Fn(&SearchShared<'_>, &Model<'_>) + Sync),
}

impl<'a> SearchShared<'a> {
    /// Nothing evaluated yet.
    pub fn new(control: &'a Control<'a>, deadline: Option<f64>, memory: &'a Memory, told: Told<'a>) -> Self {
        let (trace, best, found) = (Mutex::new(Vec::new()), Mutex::new(f64::INFINITY), AtomicBool::new(false));
        Self { control, deadline, memory, trace, expected: AtomicUsize::new(1), told, best, found, evaluations: AtomicUsize::new(0) }
    }

    /// Whether the search must end early.
    pub fn must_end(&self) -> bool {
        self.control.check().is_err() || self.is_late()
    }

    /// Whether the time is over. It lets evaluations pass until one makes a surface: without any there is no best so far.
    pub fn is_late(&self) -> bool {
        self.found.load(Ordering::Relaxed) && self.deadline.is_some_and(|d| (self.control.clock)() >= d)
    }

    /// Evaluations so far, those between the stages included.
    pub fn evaluations(&self) -> usize {
        self.evaluations.load(Ordering::Relaxed)
    }

    /// Counts evaluations that are not kept.
    pub fn count(&self, evaluations: usize) {
        self.evaluations.fetch_add(evaluations, Ordering::Relaxed);
    }

    /// Begins a stage, whose bests are not compared with those of the stage before.
    pub fn begin_stage(&self, evaluations: usize) {
        *self.best.lock().unwrap_or_else(PoisonError::into_inner) = f64::INFINITY;
        self.expected.fetch_add(evaluations, Ordering::Relaxed);
    }

    pub(super) fn note(&self, entry: Entry, model: &Model<'_>) {
        self.count(1);
        self.found.fetch_or(entry.objective.is_finite(), Ordering::Relaxed);
        let is_better = {
            let mut best = self.best.lock().unwrap_or_else(PoisonError::into_inner);
            let is_better = entry.objective < *best;
            *best = best.min(entry.objective);
            is_better
        };
        if is_better {
            (self.told.better)(&entry, model);
        }
        let done = {
            let mut trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner);
            trace.push(entry);
            trace.len()
        };
        (self.told.kept)(self, model);
        let share = done as f64 / self.expected.load(Ordering::Relaxed).max(1) as f64;
        (self.control.progress)("search", 0.05 + 0.75 * share.min(1.0));
    }

    /// The trace in an order that does not depend on threads.
    pub fn sorted_trace(&self) -> Vec<Entry> {
        let mut trace = self.trace.lock().unwrap_or_else(PoisonError::into_inner).clone();
        trace.sort_by_key(order);
        trace
    }

    /// The same with the evaluations of the earlier run that were not come to again: what a search that ends here must not lose.
    pub fn trace_with_memory(&self) -> Vec<Entry> {
        let mut trace = self.sorted_trace();
        let known = trace.len();
        let others = self.memory.entries().filter(|e| trace.binary_search_by_key(&order(e), order).is_err());
        let others: Vec<Entry> = others.collect();
        trace.extend(others);
        if trace.len() > known {
            trace.sort_by_key(order);
        }
        trace
    }
}

/// The place of an evaluation in a trace.
fn order(entry: &Entry) -> (usize, usize, usize) {
    (entry.stage as usize, entry.start, entry.evaluation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_that_ends_while_it_goes_through_an_earlier_one_keeps_what_that_one_evaluated() {
        let entry = |stage, start, evaluation| Entry { stage, start, evaluation, objective: 2.0, point: vec![0.5] };
        let earlier = [entry(Stage::Explore, 0, 0), entry(Stage::Explore, 1, 0), entry(Stage::Refine, 0, 0), entry(Stage::Explore, 0, 1)];
        let memory = Memory::new(earlier.clone());
        let control = Control::quiet();
        let shared = SearchShared::new(&control, None, &memory, Told { better: &|_, _| {}, kept: &|_, _| {} });
        shared.trace.lock().unwrap().extend([earlier[0].clone(), entry(Stage::Explore, 2, 0)]);
        let expected = [earlier[0].clone(), earlier[3].clone(), earlier[1].clone(), entry(Stage::Explore, 2, 0), earlier[2].clone()];
        assert_eq!(shared.trace_with_memory(), expected);
        assert_eq!(shared.sorted_trace().len(), 2);
    }
}
