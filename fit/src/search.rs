//! The search: many starts on a coarse model, the best of them on a fine one, and a last look with more samples.
//!
//! Every start is a search of its own, with samples of its own that stay the same (common random numbers) until it restarts. Starts run in parallel, each on one thread,
//! so that nothing depends on how many there are. Every evaluation is kept; a search that begins with the evaluations of an
//! earlier one makes the same steps up to where that one ended.

use crate::descent::{self, Evaluate};
use crate::equations::Evaluated;
use crate::model::{Indirect, Model};
use crate::optimise::{self, Found, Limits, Optimiser};
use crate::unknowns::Variable;
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::low_discrepancy::{fraction, hash};
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Distance, in any coordinate of the unit box, from which on two minima are two.
pub const APART: f64 = 0.1;

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

    fn recall(&self, stage: Stage, start: usize, evaluation: usize, point: &[f64]) -> Option<f64> {
        self.0.get(&(stage, start, evaluation)).filter(|(p, _)| p == point).map(|(_, f)| *f)
    }
}

/// What all searches share.
pub struct Shared<'a> {
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

impl<'a> Shared<'a> {
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

    fn note(&self, entry: Entry, model: &Model<'_>) {
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

/// One start of a search.
#[derive(Clone, Debug, Serialize)]
pub struct Start {
    /// Its number.
    pub number: usize,
    /// The point where it stands.
    pub point: Vec<f64>,
    /// The objective there.
    pub objective: f64,
    /// Evaluations of all stages, those between them included that find at what height the periods of the close-up were laid.
    pub evaluations: usize,
    /// Whether the last search of it ended because its points came together.
    pub converged: bool,
    /// Restarts after a simplex had degenerated, or to confirm.
    pub restarts: usize,
    /// Which surfaces the kinds of the close-up were taken for.
    pub choice: usize,
    /// Height at which the periods of the close-up were laid on top of each other, once it is known, and what its standard deviations are multiplied by.
    pub laid: Option<[f64; 2]>,
    /// Light that was reflected more than once, once it is known.
    #[serde(skip)]
    pub indirect: Option<Arc<Indirect>>,
}

/// Points of a Latin hypercube: in each coordinate one point in each of `count` equal parts.
pub fn latin_hypercube(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    #[expect(clippy::cast_possible_truncation, reason = "both halves of the seed are used")]
    let seed = hash(seed as u32 ^ hash((seed >> 32) as u32));
    let mut points = vec![vec![0.0; dimensions]; count];
    for d in 0..dimensions {
        let number = |k: usize, salt: u32| hash(hash(seed ^ salt) ^ hash((k as u32) << 8 | d as u32));
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&k| (number(k, 0x51ed), k));
        for (part, &k) in order.iter().enumerate() {
            points[k][d] = (part as f64 + fraction(number(k, 0x7a3b))) / count as f64;
        }
    }
    points
}

/// Where the starts begin: the first one where the fit file says, the others spread over the bounds; all with the lights as they were given.
pub fn starts(model: &Model<'_>, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let spread = latin_hypercube(count.saturating_sub(1), model.variables.len(), seed);
    let own = |variable: &Variable| match variable {
        Variable::Parameter(k) => model.spec.parameters[*k].to_unit(model.spec.parameters[*k].start),
        Variable::Light { .. } | Variable::Linear(_) => 0.5,
    };
    let first: Vec<f64> = model.variables.iter().map(own).collect();
    let mut points = vec![first];
    points.extend(spread.into_iter().map(|mut point| {
        for (u, variable) in point.iter_mut().zip(&model.variables) {
            if matches!(variable, Variable::Light { .. }) {
                *u = 0.5;
            }
        }
        point
    }));
    points.truncate(count.max(1));
    points
}

/// Does the work of each item on as many threads as the machine lends, each by itself on one; results in the order of the items.
///
/// # Errors
/// The first error, by the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(usize, &T) -> Result<R> + Sync) -> Result<Vec<R>> {
    let threads = rayon::current_num_threads().clamp(1, items.len().max(1));
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<Option<Result<R>>>> = Mutex::new((0..items.len()).map(|_| None).collect());
    let worker = || -> Result<()> {
        // What the library does in parallel is done by this thread alone.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|e| Error::Numeric(format!("cannot start a thread: {e}")))?;
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { return Ok(()) };
            let result = pool.install(|| work(at, item));
            results.lock().unwrap_or_else(std::sync::PoisonError::into_inner)[at] = Some(result);
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.into_iter().map(|r| r.expect("every item was worked on")).collect()
}

/// What one search is told.
#[derive(Clone, Copy, Debug)]
pub struct Task {
    /// Part of the search.
    pub stage: Stage,
    /// Which optimiser.
    pub optimiser: Optimiser,
    /// When to stop.
    pub limits: Limits,
    /// Size of the first simplex after the first search, to confirm; 0 for none.
    pub confirm: f64,
    /// Seed of what is random.
    pub seed: u64,
}

/// Most small simplices that confirm a minimum.
const MOST_CONFIRMATIONS: usize = 4;

/// Searches from where `start` stands.
///
/// # Errors
/// Those of the model; not `Interrupted`: a search that must end gives the best so far.
pub fn search(model: &Model<'_>, start: &Start, task: &Task, shared: &Shared<'_>) -> Result<Start> {
    let linear_moves = model.variables.iter().any(|v| matches!(v, Variable::Linear(_)));
    if task.optimiser == Optimiser::Lm && !start.point.is_empty() && !linear_moves {
        return descend(model, start, task, shared);
    }
    let count = Cell::new(0);
    let ended = Cell::new(false);
    let objective = |point: &[f64]| -> Result<f64> {
        let evaluation = count.get();
        let objective = match shared.memory.recall(task.stage, start.number, evaluation, point) {
            Some(known) => known,
            None => {
                if shared.must_end() {
                    ended.set(true);
                    return Err(Error::Interrupted);
                }
                match model.objective(point, shared.control) {
                    Err(Error::Interrupted) => {
                        ended.set(true);
                        return Err(Error::Interrupted);
                    }
                    other => other?,
                }
            }
        };
        count.set(evaluation + 1);
        shared.note(Entry { stage: task.stage, start: start.number, evaluation, objective, point: point.to_vec() }, model);
        Ok(objective)
    };
    // What was best before an error ended a search is in the trace of this closure only.
    let best: std::cell::RefCell<(Vec<f64>, f64)> = std::cell::RefCell::new((start.point.clone(), f64::INFINITY));
    let tracked = |point: &[f64]| -> Result<f64> {
        let value = objective(point)?;
        let mut best = best.borrow_mut();
        if value < best.1 {
            *best = (point.to_vec(), value);
        }
        Ok(value)
    };
    let mut limits = task.limits;
    let (mut restarts, mut confirmations, mut converged) = (0, 0, false);
    loop {
        let from = best.borrow().0.clone();
        let before = best.borrow().1;
        limits.evaluations = task.limits.evaluations.saturating_sub(count.get());
        if limits.evaluations == 0 {
            break;
        }
        let found = match optimise::minimise(task.optimiser, &tracked, &from, limits, task.seed ^ start.number as u64) {
            Ok(found) => found,
            Err(Error::Interrupted) if ended.get() => break,
            Err(error) => return Err(error),
        };
        let Found { converged: now, restarts: begun, objective, .. } = found;
        restarts += begun;
        converged = now;
        let little = before.is_finite() && objective > before - task.limits.cost * before.max(1.0);
        if task.confirm <= 0.0 || confirmations == MOST_CONFIRMATIONS || (confirmations > 0 && now && little) {
            break;
        }
        limits.step = task.confirm;
        confirmations += 1;
        restarts += 1;
    }
    let (point, value) = best.into_inner();
    Ok(Start {
        point,
        objective: value,
        evaluations: start.evaluations + count.get(),
        converged: converged && !ended.get(),
        restarts: start.restarts + restarts,
        ..start.clone()
    })
}

/// What a descent asks of the model, noted as any evaluation.
struct Noted<'a> {
    model: &'a Model<'a>,
    number: usize,
    stage: Stage,
    shared: &'a Shared<'a>,
    count: AtomicUsize,
    best: Mutex<(Vec<f64>, f64)>,
}

impl Evaluate for Noted<'_> {
    fn evaluate(&self, points: &[Vec<f64>], linear: Option<&[f64]>) -> Result<Vec<Option<Evaluated>>> {
        let Self { model, number, stage, shared, .. } = *self;
        let first = self.count.fetch_add(points.len(), Ordering::Relaxed);
        in_parallel(points, |k, point| {
            let evaluation = first + k;
            // Residuals are not kept: what an earlier run evaluated is evaluated again.
            if shared.must_end() && shared.memory.recall(stage, number, evaluation, point).is_none() {
                return Err(Error::Interrupted);
            }
            let evaluated = model.evaluate_with(point, linear, shared.control)?;
            let objective = evaluated.as_ref().map_or(f64::INFINITY, |e| e.objective);
            // With colours that are held for derivatives it is no candidate.
            if linear.is_none() {
                let mut best = self.best.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                if objective < best.1 {
                    *best = (point.clone(), objective);
                }
            }
            shared.note(Entry { stage, start: number, evaluation, objective, point: point.clone() }, model);
            Ok(evaluated)
        })
    }
}

/// [`search`] by the derivatives of the residuals.
fn descend(model: &Model<'_>, start: &Start, task: &Task, shared: &Shared<'_>) -> Result<Start> {
    let best = Mutex::new((start.point.clone(), f64::INFINITY));
    let noted = Noted { model, number: start.number, stage: task.stage, shared, count: AtomicUsize::new(0), best };
    let converged = match descent::descend(model, &start.point, task.limits, &noted) {
        Ok(found) => found.converged,
        Err(Error::Interrupted) => false,
        Err(error) => return Err(error),
    };
    let (point, objective) = noted.best.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let evaluations = start.evaluations + noted.count.into_inner();
    Ok(Start { point, objective, evaluations, converged, ..start.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latin_hypercube_has_one_point_in_each_part_of_each_coordinate() {
        for count in [1, 7, 8] {
            let points = latin_hypercube(count, 5, 42);
            for d in 0..5 {
                let mut parts: Vec<usize> = points.iter().map(|p| (p[d] * count as f64) as usize).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..count).collect::<Vec<_>>());
            }
            assert_ne!(points, latin_hypercube(count, 5, 43));
        }
    }

    #[test]
    fn work_is_done_once_each_and_comes_in_order_and_errors_are_passed_on() {
        let items: Vec<usize> = (0..20).collect();
        assert_eq!(in_parallel(&items, |at, &item| Ok(at * 100 + item)).unwrap(), (0..20).map(|k| k * 101).collect::<Vec<_>>());
        let failed = in_parallel(&items, |_, &item| if item == 3 { Err(Error::Numeric("three".into())) } else { Ok(()) });
        assert!(failed.unwrap_err().to_string().contains("three"));
    }
}
