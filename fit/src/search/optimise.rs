//! The optimisers, all on the unit box: an objective in, the best point out.
//!
//! Nelder-Mead (1965) with the coefficients of Gao and Han 2012 and projection onto the box is the default; CMA-ES and BOBYQA are there to compare it
//! with. All come from the crate `basin`. A point that cannot be evaluated is infinitely bad.

use crate::search::params::PARAMS;
use basin::{
    Bobyqa, BoundedCmaEs, BoxBounds, ConstraintDescription, ConstraintSet, ConstraintSolveError, Constraints, CostFunction, DenseMatrix,
    Executor, NelderMead, PointState, PopulationProgress, SimplexProgress, StepOutcome,
};
use biscale::error::{Error, Result};
use serde::Serialize;
use std::cell::RefCell;
use std::fmt;

/// Volume of the simplex over that of one with all edges as long as its longest, at which it counts as degenerate.
pub const DEGENERATE: f64 = 1e-8;

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

struct Problem<'a> {
    objective: &'a dyn Fn(&[f64]) -> Result<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    most: usize,
    /// Evaluations, and the best one.
    done: RefCell<(usize, Vec<f64>, f64)>,
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
        if done.0 >= self.most {
            return Err(Halt::Enough);
        }
        let value = (self.objective)(x).map_err(Halt::Failed)?;
        done.0 += 1;
        // Not a number is no better than infinity.
        let value = if value.is_finite() { value } else { PARAMS.infeasible };
        if value < done.2 || done.1.is_empty() {
            done.1.clone_from(x);
            done.2 = value;
        }
        Ok(value)
    }
}

/// A simplex with a corner at `point`; its edges run along the axes, inward where they would leave the box.
pub fn simplex(point: &[f64], step: f64) -> Vec<Vec<f64>> {
    let mut corners = vec![point.to_vec()];
    for i in 0..point.len() {
        let mut corner = point.to_vec();
        corner[i] += if point[i] + step > 1.0 { -step } else { step };
        corner[i] = corner[i].clamp(0.0, 1.0);
        corners.push(corner);
    }
    corners
}

/// Volume of a simplex over that of the orthogonal one whose edges are as long as its longest.
pub fn relative_volume(corners: &[Vec<f64>]) -> f64 {
    let n = corners.len() - 1;
    let mut edges: Vec<Vec<f64>> = corners[1..].iter().map(|c| c.iter().zip(&corners[0]).map(|(a, b)| a - b).collect()).collect();
    let longest = edges.iter().map(|e| e.iter().map(|v| v * v).sum::<f64>().sqrt()).fold(0.0, f64::max);
    if longest == 0.0 {
        return 0.0;
    }
    // The determinant, by Gram and Schmidt.
    let mut volume = 1.0;
    for i in 0..n {
        let length = edges[i].iter().map(|v| v * v).sum::<f64>().sqrt();
        volume *= length / longest;
        if length == 0.0 {
            return 0.0;
        }
        let (head, tail) = edges.split_at_mut(i + 1);
        let axis = &head[i];
        for edge in tail {
            let along = edge.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>() / (length * length);
            edge.iter_mut().zip(axis).for_each(|(e, a)| *e -= along * a);
        }
    }
    volume
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
    let n = start.len();
    let problem = Problem {
        objective,
        lower: vec![0.0; n],
        upper: vec![1.0; n],
        most: limits.evaluations,
        done: RefCell::new((0, start.to_vec(), f64::INFINITY)),
    };
    if n == 0 {
        let value = objective(start)?;
        return Ok(Minimum { point: Vec::new(), objective: value, evaluations: 1, converged: true, restarts: 0 });
    }
    let outcome = match optimiser {
        Optimiser::NelderMead => nelder_mead(&problem, start, limits),
        // In one dimension there is no covariance to adapt, and no quadratic to interpolate.
        _ if n == 1 => nelder_mead(&problem, start, limits),
        Optimiser::Cmaes => cmaes(&problem, start, limits, seed),
        Optimiser::Bobyqa => bobyqa(&problem, start, limits),
        // It needs residuals, and is asked for elsewhere where there are any.
        Optimiser::Lm => nelder_mead(&problem, start, limits),
    };
    let (converged, restarts) = match outcome {
        Ok(ended) => ended,
        Err(ConstraintSolveError::Evaluation(Halt::Enough)) => (false, 0),
        Err(ConstraintSolveError::Evaluation(Halt::Failed(error))) => return Err(error),
        Err(other) => return Err(Error::Numeric(format!("the optimiser failed: {other:?}; please report this"))),
    };
    let (evaluations, point, value) = problem.done.into_inner();
    let value = if value >= PARAMS.infeasible { f64::INFINITY } else { value };
    Ok(Minimum { point, objective: value, evaluations, converged, restarts })
}

/// Whether it converged, and how often it restarted.
type Ended = Result<(bool, usize), ConstraintSolveError<Halt>>;

/// Whether the values of some points are as close as `limits` asks.
fn level(costs: &[f64], limits: Limits) -> bool {
    let best = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let worst = costs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    worst - best <= limits.cost * best.max(1.0)
}

/// Searches of Nelder and Mead from the best point so far, with ever smaller first simplices, until one does not degenerate.
fn nelder_mead(problem: &Problem<'_>, start: &[f64], limits: Limits) -> Ended {
    let (mut from, mut step, mut restarts) = (start.to_vec(), limits.step, 0);
    loop {
        let (converged, degenerate) = one_nelder_mead(problem, &from, Limits { step, ..limits })?;
        if !degenerate || restarts == PARAMS.restarts {
            return Ok((converged, restarts));
        }
        from.clone_from(&problem.done.borrow().1);
        step = (0.5 * step).max(limits.size);
        restarts += 1;
    }
}

fn one_nelder_mead(problem: &Problem<'_>, start: &[f64], limits: Limits) -> Result<(bool, bool), ConstraintSolveError<Halt>> {
    let solver = NelderMead::<Vec<f64>>::adaptive()
        .with_absolute_simplex_size_tolerance(None)
        .with_relative_simplex_size_tolerance(None)
        .with_absolute_simplex_cost_tolerance(None)
        .with_relative_simplex_cost_tolerance(None)
        .projected();
    let corners = SimplexProgress::from_simplex(simplex(start, limits.step));
    let mut stepper = Executor::new(problem, solver, corners).into_stepper()?;
    loop {
        if let Some((corners, costs)) = stepper.state().evaluated_vertices() {
            let apart = |c: &Vec<f64>| c.iter().zip(&corners[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if corners.iter().map(apart).fold(0.0, f64::max) <= limits.size && level(costs, limits) {
                return Ok((true, false));
            }
            if relative_volume(corners) < DEGENERATE {
                return Ok((false, true));
            }
        }
        if let StepOutcome::Stopped(_) = stepper.step()? {
            return Ok((true, false));
        }
    }
}

fn cmaes(problem: &Problem<'_>, start: &[f64], limits: Limits, seed: u64) -> Ended {
    let solver = BoundedCmaEs::<Vec<f64>, DenseMatrix>::new(seed, limits.step);
    let mut stepper = Executor::new(problem, solver, PopulationProgress::<Vec<f64>>::from_point(start.to_vec())).into_stepper()?;
    loop {
        if let StepOutcome::Stopped(_) = stepper.step()? {
            return Ok((true, 0));
        }
        let narrow = stepper.solver().sigma().is_some_and(|sigma| sigma <= limits.size);
        if narrow && stepper.state().evaluated_members().is_some_and(|(_, costs)| level(costs, limits)) {
            return Ok((true, 0));
        }
    }
}

fn bobyqa(problem: &Problem<'_>, start: &[f64], limits: Limits) -> Ended {
    let solver = Bobyqa::new().with_initial_radius(limits.step).with_final_radius(limits.size.min(0.5 * limits.step));
    Executor::new(problem, solver, PointState::new(start.to_vec())).run()?;
    Ok((true, 0))
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

    #[test]
    fn a_first_simplex_at_the_bounds_is_turned_inward() {
        let corners = simplex(&[1.0, 0.0, 0.95], 0.2);
        assert!(relative_volume(&corners) > 0.1 && corners.iter().flatten().all(|v| (0.0..=1.0).contains(v)), "{corners:?}");
        assert!(relative_volume(&[vec![0.0, 0.0], vec![1.0, 0.0], vec![0.5, 0.0]]) < DEGENERATE);
    }
}
