//! The search from one start: with an optimiser that sees the objective only, or along the derivatives of the residuals.

use crate::parallel::in_parallel;
use crate::residuals::equations::Evaluated;
use crate::residuals::model::Model;
use crate::residuals::unknowns::Variable;
use crate::search::descent::{self, Evaluate};
use crate::search::optimise::{self, Limits, Minimum, Optimiser};
use crate::search::params::PARAMS;
use crate::search::starts::Start;
use crate::search::trace::{Entry, SearchShared, Stage};
use biscale::error::{Error, Result};
use std::cell::Cell;
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
        let Minimum { converged: now, restarts: begun, objective, .. } = found;
        restarts += begun;
        converged = now;
        let little = before.is_finite() && objective > before - task.limits.cost * before.max(1.0);
        if task.confirm <= 0.0 || confirmations == PARAMS.confirmations || (confirmations > 0 && now && little) {
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
    shared: &'a SearchShared<'a>,
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
fn descend(model: &Model<'_>, start: &Start, task: &Task, shared: &SearchShared<'_>) -> Result<Start> {
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
