//! Small nonlinear least squares: Levenberg and Marquardt's method with numeric derivatives, a thin layer over `basin`.
//!
//! ```text
//! minimise |r(x)|² over x:      (JᵀJ + μ D) h = -Jᵀr,   D = diag(JᵀJ),   x <- x + h where that lowers |r|²
//! ```
//!
//! Marquardt (1963) with the running maximum of `D` of Moré (1978). For up to about twenty unknowns and smooth residuals: poses, colour
//! matrices. Dense, without bounds, without weights (multiply the residuals). Unknowns are counted in units that the caller gives, so that one step of
//! the central differences suits all of them.
//!
//! `basin` chooses `μ` by a trust region as MINPACK's `lmder` does. On the 17 fits of `biscale-capture`'s unit tests (6 to 9 unknowns: poses from corners
//! and from edges, a scale, two colour matrices) that takes 1,072 evaluations, Nielsen's rule (1999) 1,258, and Marquardt's own factors (6 and 1/5, the loop that
//! stood here before) 1,329. All three end at the same point within 3e-7 of a unit, and none needs more than 9 steps.

use super::linear_algebra::scaled_inverse;
use super::outcome::Outcome;
use basin::{DenseMatrix, Executor, Jacobian, LevenbergMarquardt, LmDamping, PointState, Residual, TerminationCode};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;

/// When a search ends, and how derivatives are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastSquaresParams {
    /// Most trial steps, those that are refused included. Chosen: six times what the poses and colours of the tests take; a problem that
    /// needs more is ill posed, and its caller is told.
    pub steps: u64,
    /// Relative change of the sum of squares, found and predicted, that ends the search. Chosen: well below what residuals of single precision tell.
    pub enough: f64,
    /// Length of a step, in units of the unknowns, that ends the search: where the residuals become 0 their sum of squares has no digits to compare.
    /// Chosen: a millionth of `difference`.
    pub still: f64,
    /// Largest cosine between the residuals and their derivative by an unknown that ends the search: they are at right angles at the least sum of squares
    /// (MINPACK's `gtol`). Chosen: a hundred times what central differences leave.
    pub orthogonal: f64,
    /// Half the span of the central differences, in units of the unknowns. Chosen: the error of rounding is about 1e-16 over it and that of the cubic
    /// term its square, so that both are near 1e-8 or below where a unit is a typical change.
    pub difference: f64,
}

impl Default for LeastSquaresParams {
    fn default() -> Self {
        Self { steps: 60, enough: 1e-12, still: 1e-10, orthogonal: 1e-10, difference: 1e-4 }
    }
}

/// What a search ends with.
#[derive(Clone, Debug, PartialEq)]
pub struct LeastSquaresFit {
    /// Best parameters.
    pub parameters: Vec<f64>,
    /// Sum of squared residuals there.
    pub cost: f64,
    /// `(JᵀJ)⁻¹`, row after row: the covariance for residuals of unit variance. `None` if something is not determined.
    pub covariance: Option<Vec<f64>>,
    /// How it ended.
    pub outcome: Outcome,
    /// Evaluations of the residuals, those of the derivatives included.
    pub evaluations: usize,
}

impl LeastSquaresFit {
    /// Itself, unless it met numbers that are not finite.
    pub fn finite(self) -> Option<Self> {
        (self.outcome != Outcome::NotFinite).then_some(self)
    }
}

/// Where every unknown starts, as `basin` sees it. Not 0: it takes the first step's length and the smallest step's as shares of the length of the
/// unknowns, which so become lengths in units.
const ORIGIN: f64 = 1.0;

/// The residuals as `basin` sees them: of unknowns in units, from [`ORIGIN`].
struct Units<'a> {
    start: &'a [f64],
    unit: &'a [f64],
    difference: f64,
    residuals: &'a dyn Fn(&[f64]) -> Vec<f64>,
    /// Residuals at the start: stand in for those that are not finite.
    count: usize,
    evaluations: Cell<usize>,
    /// Where derivatives were last taken, and these.
    last: RefCell<Option<(Vec<f64>, DenseMatrix<f64>)>>,
}

/// A residual that is not finite, and all others with it: large enough that no step to it is taken, and its square a number.
const INFEASIBLE: f64 = 1e150;

impl Units<'_> {
    fn parameters(&self, u: &[f64]) -> Vec<f64> {
        (0..u.len()).map(|k| self.start[k] + self.unit[k] * (u[k] - ORIGIN)).collect()
    }

    /// The residuals at a point; `None` if one is not finite.
    fn at(&self, u: &[f64]) -> Option<Vec<f64>> {
        self.evaluations.set(self.evaluations.get() + 1);
        let r = (self.residuals)(&self.parameters(u));
        r.iter().all(|v| v.is_finite()).then_some(r)
    }

    /// Derivatives of the residuals by one unknown: by a central difference, or by that to the side which is finite, or 0.
    fn column(&self, u: &[f64], k: usize) -> Vec<f64> {
        let side = |d: f64| {
            let mut u = u.to_vec();
            u[k] += d;
            self.at(&u)
        };
        let h = self.difference;
        let slope = |low: &[f64], high: &[f64], span: f64| low.iter().zip(high).map(|(a, b)| (b - a) / span).collect();
        match (side(-h), side(h)) {
            (Some(low), Some(high)) => slope(&low, &high, 2.0 * h),
            (low, high) => match (self.at(u), low, high) {
                (Some(here), Some(low), None) => slope(&low, &here, h),
                (Some(here), None, Some(high)) => slope(&here, &high, h),
                _ => vec![0.0; self.count],
            },
        }
    }

    /// Derivatives of all residuals by all unknowns, those of the last call where it was for the same point.
    fn derivatives(&self, u: &[f64]) -> DenseMatrix<f64> {
        if let Some((at, derivatives)) = &*self.last.borrow()
            && at == u
        {
            return derivatives.clone();
        }
        let columns: Vec<Vec<f64>> = (0..u.len()).map(|k| self.column(u, k)).collect();
        let derivatives = DenseMatrix::from_fn(self.count, u.len(), |i, k| columns[k][i]);
        *self.last.borrow_mut() = Some((u.to_vec(), derivatives.clone()));
        derivatives
    }
}

impl Residual for &Units<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Error = Infallible;

    fn residual(&self, u: &Vec<f64>) -> Result<Vec<f64>, Infallible> {
        Ok(self.at(u).unwrap_or_else(|| vec![INFEASIBLE; self.count]))
    }
}

impl Jacobian for &Units<'_> {
    type Jacobian = DenseMatrix<f64>;

    fn jacobian(&self, u: &Vec<f64>) -> Result<DenseMatrix<f64>, Infallible> {
        Ok(self.derivatives(u))
    }
}

/// Minimises the sum of squared `residuals` from `start`; `unit` is a typical change of each parameter. Residuals that are not finite (a point behind
/// the camera) are steps that are not taken; at `start` they end the search at once, [`Outcome::NotFinite`].
///
/// # Panics
/// If `start` and `unit` differ in length, or `residuals` gives lists of different lengths.
pub fn minimise(start: &[f64], unit: &[f64], residuals: &dyn Fn(&[f64]) -> Vec<f64>, params: LeastSquaresParams) -> LeastSquaresFit {
    assert_eq!(start.len(), unit.len(), "a unit for each parameter");
    let at_start = residuals(start);
    let cost = squares(&at_start);
    let unmoved = |outcome| LeastSquaresFit { parameters: start.to_vec(), cost, covariance: None, outcome, evaluations: 1 };
    if !cost.is_finite() {
        return unmoved(Outcome::NotFinite);
    }
    if start.is_empty() {
        return unmoved(Outcome::Converged);
    }
    let (evaluations, last) = (Cell::new(1), RefCell::new(None));
    let problem = Units { start, unit, difference: params.difference, residuals, count: at_start.len(), evaluations, last };
    let solver = LevenbergMarquardt::<Vec<f64>, DenseMatrix>::new()
        .with_damping(LmDamping::TrustRegion)
        .with_absolute_gradient_tolerance(None)
        .with_gradient_orthogonality_tolerance(params.orthogonal)
        .with_relative_step_tolerance(params.still)
        .with_relative_model_reduction_tolerance(params.enough);
    let state = PointState::new(vec![ORIGIN; start.len()]);
    let found = match Executor::new(&problem, solver, state).max_iter(params.steps).run() {
        Ok(found) => found,
        Err(never) => match never {},
    };
    let outcome = match found.report.code() {
        TerminationCode::MaxIter => Outcome::Exhausted,
        TerminationCode::SolverFailed => Outcome::NotFinite,
        _ => Outcome::Converged,
    };
    let best = found.best_param();
    let covariance = scaled_inverse(&gram(&problem.derivatives(best)), start.len());
    let evaluations = problem.evaluations.get();
    LeastSquaresFit {
        parameters: problem.parameters(best),
        cost: 2.0 * found.best_cost(),
        covariance: covariance.map(|c| in_units(c, unit)),
        outcome,
        evaluations,
    }
}

/// The sum of squares.
fn squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|v| v * v).sum()
}

/// `JᵀJ`, row after row.
fn gram(jacobian: &DenseMatrix<f64>) -> Vec<f64> {
    let n = jacobian.ncols();
    (0..n * n).map(|k| (0..jacobian.nrows()).map(|i| jacobian.get(i, k / n) * jacobian.get(i, k % n)).sum()).collect()
}

/// A covariance of unknowns in units as that of the unknowns themselves.
fn in_units(mut covariance: Vec<f64>, unit: &[f64]) -> Vec<f64> {
    let n = unit.len();
    covariance.iter_mut().enumerate().for_each(|(k, c)| *c *= unit[k / n] * unit[k % n]);
    covariance
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(start: &[f64], residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> LeastSquaresFit {
        minimise(start, &vec![1.0; start.len()], residuals, LeastSquaresParams::default())
    }

    #[test]
    fn rosenbrock_s_valley_is_followed_to_its_end() {
        let found = fit(&[-1.2, 1.0], &|x| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
        assert!(found.outcome.converged() && found.parameters.iter().all(|x| (x - 1.0).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn a_line_s_covariance_is_that_of_the_textbook_in_any_units() {
        // y = a + b x at x = -1, 0, 1: var a = 1/3, var b = 1/2, no correlation.
        let residuals = |p: &[f64]| [-1.0, 0.0, 1.0].map(|x| p[0] + p[1] * x - (2.0 + 3.0 * x)).to_vec();
        for unit in [[1.0, 1.0], [1e-3, 50.0]] {
            let found = minimise(&[0.0, 0.0], &unit, &residuals, LeastSquaresParams::default());
            assert!((found.parameters[0] - 2.0).abs() < 1e-9 && (found.parameters[1] - 3.0).abs() < 1e-9, "{found:?}");
            let c = found.covariance.unwrap();
            // Rounding is 1e-16 of the residuals over a difference of 1e-7.
            assert!((c[0] - 1.0 / 3.0).abs() < 1e-8 && (c[3] - 0.5).abs() < 1e-8 && c[1].abs() < 1e-8, "{c:?}");
        }
    }

    #[test]
    fn what_is_not_determined_has_no_covariance_and_is_fitted_all_the_same() {
        let found = fit(&[0.0, 0.0], &|p| vec![p[0] + p[1] - 1.0, 2.0 * (p[0] + p[1]) - 2.0]);
        assert!(found.covariance.is_none() && found.cost < 1e-12 && found.outcome.converged(), "{found:?}");
        // The second unknown is in no residual, and stays.
        let found = fit(&[0.0, 5.0], &|p| vec![p[0] - 1.0, 2.0 * p[0] - 1.0]);
        assert!(found.covariance.is_none() && (found.parameters[0] - 0.6).abs() < 1e-9 && found.parameters[1] == 5.0, "{found:?}");
    }

    #[test]
    fn a_start_without_a_value_is_told_and_stays() {
        let found = fit(&[0.5], &|_| vec![f64::NAN]);
        assert_eq!((found.outcome, found.parameters, found.evaluations), (Outcome::NotFinite, vec![0.5], 1));
    }

    #[test]
    fn steps_and_derivatives_keep_away_from_where_there_is_no_value() {
        // Begins a quarter of a difference from where the logarithm ends; full steps would lead beyond.
        let found = fit(&[2.5e-5], &|p| vec![p[0].ln() - 3.0]);
        assert!(found.outcome.converged() && (found.parameters[0] - 3.0_f64.exp()).abs() < 1e-6, "{found:?}");
    }

    #[test]
    fn residuals_of_zero_end_the_search() {
        let found = fit(&[1.0, 2.0], &|p| vec![p[0] - 1.0, p[1] - 2.0, p[0] * p[1] - 2.0]);
        assert_eq!((found.outcome, &found.parameters[..], found.cost), (Outcome::Converged, &[1.0, 2.0][..], 0.0));
        let found = fit(&[3.0, 0.0], &|p| vec![p[0] - 1.0, p[1] - 2.0, p[0] * p[1] - 2.0]);
        assert!(found.outcome.converged() && found.cost < 1e-20, "{found:?}");
    }

    #[test]
    fn steps_that_do_not_suffice_are_told() {
        let residuals = |x: &[f64]| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]];
        let params = LeastSquaresParams { steps: 3, ..LeastSquaresParams::default() };
        let found = minimise(&[-1.2, 1.0], &[1.0, 1.0], &residuals, params);
        assert!(found.outcome == Outcome::Exhausted && found.cost < squares(&residuals(&[-1.2, 1.0])), "{found:?}");
    }
}
