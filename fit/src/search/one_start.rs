//! The search from one start: with an optimiser that sees the objective only, or along the derivatives of the residuals.

use crate::parallel::in_parallel;
use crate::residuals::equations::Evaluated;
use crate::residuals::model::Model;
use crate::residuals::unknowns::Variable;
use crate::search::descent::{self, Evaluate};
use crate::search::optimise::{self, Limits, Optimiser};
use crate::search::params::PARAMS;
use crate::search::starts::Start;
use crate::search::trace::{Entry, SearchShared, Stage};
use biscale::error::{Error, Result};
use std::cell::RefCell;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

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

/// Searches from where `start` stands.
///
/// # Errors
/// Those of the model; not `Interrupted`: a search that must end gives the best so far.
pub fn search(model: &Model<'_>, start: &Start, task: &Task, shared: &SearchShared<'_>) -> Result<Start> {
    let linear_moves = model.variables.iter().any(|v| matches!(v, Variable::Linear(_)));
    if task.optimiser == Optimiser::Lm && !start.point.is_empty() && !linear_moves {
        return descend(model, start, task, shared);
    }
    let progress = RefCell::new(Progress { evaluations: 0, must_end: false, best: Best::unknown(start) });
    let tracked = Tracked { model, number: start.number, stage: task.stage, shared, progress };
    let Confirmed { converged, restarts } = confirm(&tracked, task)?;
    let Progress { evaluations, must_end, best } = tracked.progress.into_inner();
    Ok(Start {
        point: best.point,
        objective: best.objective,
        evaluations: start.evaluations + evaluations,
        converged: converged && !must_end,
        restarts: start.restarts + restarts,
        ..start.clone()
    })
}

/// How a search that may have been repeated ended.
struct Confirmed {
    converged: bool,
    restarts: usize,
}

/// Searches, and then again from the best point with small first simplices, until one of them finds little more.
fn confirm(tracked: &Tracked<'_>, task: &Task) -> Result<Confirmed> {
    let mut limits = task.limits;
    let mut confirmed = Confirmed { converged: false, restarts: 0 };
    let mut confirmations = 0;
    loop {
        let Best { point: from, objective: before } = tracked.progress.borrow().best.clone();
        limits.evaluations = task.limits.evaluations.saturating_sub(tracked.progress.borrow().evaluations);
        if limits.evaluations == 0 {
            return Ok(confirmed);
        }
        let seed = task.seed ^ tracked.number as u64;
        let found = match optimise::minimise(task.optimiser, &|point| tracked.evaluate(point), &from, limits, seed) {
            Ok(found) => found,
            Err(Error::Interrupted) if tracked.progress.borrow().must_end => return Ok(confirmed),
            Err(error) => return Err(error),
        };
        confirmed.restarts += found.restarts;
        confirmed.converged = found.converged;
        let little = before.is_finite() && found.objective > before - task.limits.cost * before.max(1.0);
        let enough = confirmations == PARAMS.confirmations || (confirmations > 0 && found.converged && little);
        if task.confirm <= 0.0 || enough {
            return Ok(confirmed);
        }
        limits.step = task.confirm;
        confirmations += 1;
        confirmed.restarts += 1;
    }
}

/// The evaluations of one search: recalled where an earlier run made them, noted, and the best of them kept even if an error ends the search.
struct Tracked<'a> {
    model: &'a Model<'a>,
    number: usize,
    stage: Stage,
    shared: &'a SearchShared<'a>,
    progress: RefCell<Progress>,
}

/// How far a search is.
struct Progress {
    evaluations: usize,
    /// Whether an evaluation was refused since the search must end.
    must_end: bool,
    best: Best,
}

/// The best point so far, and the objective there.
#[derive(Clone)]
struct Best {
    point: Vec<f64>,
    objective: f64,
}

impl Best {
    /// Where a search begins.
    fn unknown(start: &Start) -> Self {
        Self { point: start.point.clone(), objective: f64::INFINITY }
    }

    fn consider(&mut self, point: &[f64], objective: f64) {
        if objective < self.objective {
            *self = Self { point: point.to_vec(), objective };
        }
    }
}

impl Tracked<'_> {
    fn evaluate(&self, point: &[f64]) -> Result<f64> {
        let Self { model, number: start, stage, shared, .. } = *self;
        let mut progress = self.progress.borrow_mut();
        let evaluation = progress.evaluations;
        let objective = match shared.memory.recall(stage, start, evaluation, point) {
            Some(known) => Ok(known),
            None if shared.must_end() => Err(Error::Interrupted),
            None => model.objective(point, shared.control),
        };
        progress.must_end |= matches!(objective, Err(Error::Interrupted));
        let objective = objective?;
        progress.evaluations += 1;
        progress.best.consider(point, objective);
        shared.note(Entry { stage, start, evaluation, objective, point: point.to_vec() }, model);
        Ok(objective)
    }
}

/// What a descent asks of the model, noted as any evaluation.
struct Noted<'a> {
    model: &'a Model<'a>,
    number: usize,
    stage: Stage,
    shared: &'a SearchShared<'a>,
    /// Points that were asked for: numbers of evaluations do not depend on which of them ends first.
    asked: AtomicUsize,
    evaluated: AtomicUsize,
    best: Mutex<Best>,
}

impl Evaluate for Noted<'_> {
    fn evaluate(&self, points: &[Vec<f64>], linear: Option<&[f64]>) -> Result<Vec<Option<Evaluated>>> {
        let Self { model, number, stage, shared, .. } = *self;
        let first = self.asked.fetch_add(points.len(), Ordering::Relaxed);
        in_parallel(points, |k, point| {
            let evaluation = first + k;
            // Residuals are not kept: what an earlier run evaluated is evaluated again.
            if shared.must_end() && shared.memory.recall(stage, number, evaluation, point).is_none() {
                return Err(Error::Interrupted);
            }
            let evaluated = model.evaluate_with(point, linear, shared.control)?;
            self.evaluated.fetch_add(1, Ordering::Relaxed);
            let objective = evaluated.as_ref().map_or(f64::INFINITY, |e| e.objective);
            // With colours that are held for derivatives it is no candidate.
            if linear.is_none() {
                self.best.lock().unwrap_or_else(std::sync::PoisonError::into_inner).consider(point, objective);
            }
            shared.note(Entry { stage, start: number, evaluation, objective, point: point.clone() }, model);
            Ok(evaluated)
        })
    }
}

/// [`search`] by the derivatives of the residuals.
fn descend(model: &Model<'_>, start: &Start, task: &Task, shared: &SearchShared<'_>) -> Result<Start> {
    let best = Mutex::new(Best::unknown(start));
    let (asked, evaluated) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let noted = Noted { model, number: start.number, stage: task.stage, shared, asked, evaluated, best };
    let converged = match descent::descend(model, &start.point, task.limits, &noted) {
        Ok(found) => found.converged,
        Err(Error::Interrupted) => false,
        Err(error) => return Err(error),
    };
    let Best { point, objective } = noted.best.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let evaluations = start.evaluations + noted.evaluated.into_inner();
    Ok(Start { point, objective, evaluations, converged, ..start.clone() })
}
