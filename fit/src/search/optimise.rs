//! The optimisers, all on the unit box: an objective in, the best point out.
//!
//! Nelder and Mead's simplex ([`nelder_mead`]) is the default; CMA-ES and BOBYQA, of the crate `basin`, are there to
//! compare it with. A point that cannot be evaluated is infinitely bad.

use crate::search::params::PARAMS;
use basin::{
    Bobyqa, BoundedCmaEs, BoxBounds, ConstraintDescription, ConstraintSet, ConstraintSolveError, Constraints, CostFunction, DenseMatrix,
    Executor, PointState, PopulationProgress, StepOutcome,
};
use biscale::error::{Error, Result};
use biscale::numerics::nelder_mead::{self, Coefficients, SimplexParams, axis_simplex};
use serde::Serialize;
use std::cell::RefCell;
use std::fmt;

/// Which optimiser.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Optimiser {
    /// Nelder-Mead with bounds.
    #[default]
    NelderMead,
    /// Covariance matrix adaptation (Hansen), with bounds.
    Cmaes,
    /// Quadratic models without derivatives (Powell 2009).
    Bobyqa,
    /// Levenberg and Marquardt on the residuals: `descent`.
    Lm,
}

impl Optimiser {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::NelderMead, Self::Cmaes, Self::Bobyqa, Self::Lm];

    /// As the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::NelderMead => "nelder-mead",
            Self::Cmaes => "cmaes",
            Self::Bobyqa => "bobyqa",
            Self::Lm => "lm",
        }
    }
}

/// When to stop, and how far to look first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Size of the first simplex, or of the first trust region.
    pub step: f64,
    /// Largest distance in a coordinate at which the points count as one.
    pub size: f64,
    /// Largest difference of the objective, as a share of the best one (or of 1, if that is smaller), at which they do.
    pub cost: f64,
    /// Most evaluations.
    pub evaluations: usize,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// The best point.
    pub point: Vec<f64>,
    /// Its objective.
    pub objective: f64,
    /// Evaluations.
    pub evaluations: usize,
    /// Whether it stopped because the points came together, and not for want of evaluations.
    pub converged: bool,
    /// How often a simplex degenerated, and a new one was begun with.
    pub restarts: usize,
}

impl Limits {
    /// The same for corners of a simplex in the unit box.
    fn simplex(self, evaluations: usize) -> SimplexParams {
        SimplexParams {
            coefficients: Coefficients::Adaptive,
            bounds: [0.0, 1.0],
            size: self.size,
            cost: self.cost,
            cost_floor: 1.0,
            flat: PARAMS.flat,
            evaluations,
        }
    }
}

/// Looks for the least objective from `start`.
///
/// # Errors
/// Those of the objective.
pub fn minimise(
    optimiser: Optimiser,
    objective: &dyn Fn(&[f64]) -> Result<f64>,
    start: &[f64],
    limits: Limits,
    seed: u64,
) -> Result<Minimum> {
    if start.is_empty() {
        let value = objective(start)?;
        return Ok(Minimum { point: Vec::new(), objective: value, evaluations: 1, converged: true, restarts: 0 });
    }
    match optimiser {
        // In one dimension there is no covariance to adapt, and no quadratic to interpolate.
        Optimiser::Cmaes if start.len() > 1 => compared(objective, start, limits, |problem| cmaes(problem, start, limits, seed)),
        Optimiser::Bobyqa if start.len() > 1 => compared(objective, start, limits, |problem| bobyqa(problem, start, limits)),
        // The last needs residuals, and is asked for elsewhere where there are any.
        Optimiser::NelderMead | Optimiser::Cmaes | Optimiser::Bobyqa | Optimiser::Lm => from_simplices(objective, start, limits),
    }
}

/// Searches of Nelder and Mead from the best point so far, with ever smaller first simplices, until one does not grow flat.
fn from_simplices(objective: &dyn Fn(&[f64]) -> Result<f64>, start: &[f64], limits: Limits) -> Result<Minimum> {
    let mut found = Minimum { point: start.to_vec(), objective: f64::INFINITY, evaluations: 0, converged: false, restarts: 0 };
    let mut step = limits.step;
    loop {
        let params = limits.simplex(limits.evaluations - found.evaluations);
        let corners = axis_simplex(&found.point, &vec![step; start.len()], params.bounds);
        let ended = nelder_mead::minimise(objective, corners, &params)?;
        found.evaluations += ended.evaluations;
        found.converged = ended.outcome.converged();
        if ended.value < found.objective {
            (found.point, found.objective) = (ended.point, ended.value);
        }
        if !ended.flat || found.restarts == PARAMS.restarts {
            return Ok(found);
        }
        step = (0.5 * step).max(limits.size);
        found.restarts += 1;
    }
}

/// Why an evaluation was not made.
enum Halt {
    /// Enough evaluations.
    Enough,
    /// The objective failed.
    Failed(Error),
}

impl fmt::Debug for Halt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Enough => f.write_str("enough evaluations"),
            Self::Failed(error) => error.fmt(f),
        }
    }
}

/// The objective as the optimisers of `basin` see it.
struct Problem<'a> {
    objective: &'a dyn Fn(&[f64]) -> Result<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    most: usize,
    done: RefCell<Done>,
}

/// What was evaluated so far.
struct Done {
    evaluations: usize,
    best: Vec<f64>,
    value: f64,
}

impl Constraints for &Problem<'_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.lower), Some(&self.upper)))
    }
}

impl CostFunction for &Problem<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Halt;

    fn cost(&self, x: &Vec<f64>) -> Result<f64, Halt> {
        let mut done = self.done.borrow_mut();
        if done.evaluations >= self.most {
            return Err(Halt::Enough);
        }
        let value = (self.objective)(x).map_err(Halt::Failed)?;
        done.evaluations += 1;
        // Not a number is no better than infinity.
        let value = if value.is_finite() { value } else { PARAMS.infeasible };
        if value < done.value {
            done.best.clone_from(x);
            done.value = value;
        }
        Ok(value)
    }
}

/// Whether an optimiser of `basin` came to its end.
type Ended = Result<bool, ConstraintSolveError<Halt>>;

/// Runs an optimiser of `basin`.
fn compared(
    objective: &dyn Fn(&[f64]) -> Result<f64>,
    start: &[f64],
    limits: Limits,
    run: impl FnOnce(&Problem<'_>) -> Ended,
) -> Result<Minimum> {
    let n = start.len();
    let done = RefCell::new(Done { evaluations: 0, best: start.to_vec(), value: f64::INFINITY });
    let problem = Problem { objective, lower: vec![0.0; n], upper: vec![1.0; n], most: limits.evaluations, done };
    let converged = match run(&problem) {
        Ok(converged) => converged,
        Err(ConstraintSolveError::Evaluation(Halt::Enough)) => false,
        Err(ConstraintSolveError::Evaluation(Halt::Failed(error))) => return Err(error),
        Err(other) => return Err(Error::Numeric(format!("the optimiser failed: {other:?}; please report this"))),
    };
    let Done { evaluations, best, value } = problem.done.into_inner();
    let objective = if value >= PARAMS.infeasible { f64::INFINITY } else { value };
    Ok(Minimum { point: best, objective, evaluations, converged, restarts: 0 })
}

fn cmaes(problem: &Problem<'_>, start: &[f64], limits: Limits, seed: u64) -> Ended {
    let solver = BoundedCmaEs::<Vec<f64>, DenseMatrix>::new(seed, limits.step);
    let mut stepper = Executor::new(problem, solver, PopulationProgress::<Vec<f64>>::from_point(start.to_vec())).into_stepper()?;
    let together = limits.simplex(limits.evaluations);
    loop {
        if let StepOutcome::Stopped(_) = stepper.step()? {
            return Ok(true);
        }
        let narrow = stepper.solver().sigma().is_some_and(|sigma| sigma <= limits.size);
        if narrow && stepper.state().evaluated_members().is_some_and(|(_, costs)| together.level(costs)) {
            return Ok(true);
        }
    }
}

fn bobyqa(problem: &Problem<'_>, start: &[f64], limits: Limits) -> Ended {
    let solver = Bobyqa::new().with_initial_radius(limits.step).with_final_radius(limits.size.min(0.5 * limits.step));
    Executor::new(problem, solver, PointState::new(start.to_vec())).run()?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { step: 0.2, size: 1e-5, cost: 1e-9, evaluations: 4000 };

    /// A narrow curved valley in the unit box, its end at (.7, .49, ..).
    fn valley(x: &[f64]) -> f64 {
        let mut sum = (x[0] - 0.7).powi(2);
        for w in x.windows(2) {
            sum += 30.0 * (w[1] - w[0] * w[0]).powi(2);
        }
        sum
    }

    #[test]
    fn every_optimiser_finds_the_end_of_a_valley() {
        for optimiser in Optimiser::ALL {
            for n in 1..5 {
                let found = minimise(optimiser, &|x| Ok(valley(x)), &vec![0.2; n], LIMITS, 3).unwrap();
                assert!(found.objective < 1e-5, "{} in {n}: {found:?}", optimiser.name());
            }
        }
    }

    #[test]
    fn points_that_cannot_be_evaluated_are_walked_around_and_the_box_is_kept() {
        let inside = |x: &[f64]| {
            assert!(x.iter().all(|v| (0.0..=1.0).contains(v)));
            Ok(if x[0] + x[1] > 1.2 { f64::NAN } else { (x[0] - 1.0).powi(2) + (x[1] - 0.1).powi(2) })
        };
        let found = minimise(Optimiser::NelderMead, &inside, &[0.3, 0.3], LIMITS, 0).unwrap();
        assert!((found.point[0] - 1.0).abs() < 1e-3 && (found.point[1] - 0.1).abs() < 1e-2, "{found:?}");
    }

    #[test]
    fn a_budget_ends_the_search_and_an_error_is_passed_on() {
        let limits = Limits { evaluations: 17, ..LIMITS };
        let found = minimise(Optimiser::NelderMead, &|x| Ok(valley(x)), &[0.2; 3], limits, 0).unwrap();
        assert!(found.evaluations == 17 && !found.converged, "{found:?}");
        let failed = minimise(Optimiser::NelderMead, &|_| Err(Error::Interrupted), &[0.2; 3], LIMITS, 0);
        assert!(matches!(failed, Err(Error::Interrupted)));
    }
}
