//! Levenberg and Marquardt's steps on the residuals themselves: what a simplex needs hundreds of evaluations for, along the floor of a narrow valley.
//!
//! The unknowns of the search move together with the linear ones in a step; then the linear ones are solved for again, where the step ended (Kaufman
//! 1975: variable projection without second derivatives). Derivatives are central differences over a share of the range that visibility bits do not spoil.
//!
//! # Beside the solvers of `basin`
//!
//! The least squares of `biscale::numerics` have no bounds and no linear unknowns. `basin`'s `BoundedLevenbergMarquardt` (Coleman and Li's scaling) and
//! `TrustRegionReflective` can do this work: residuals signed roots of Huber's loss, derivatives those of here less their part along the linear columns.
//! Measured once (no command repeats it): evaluations until the objective is within .002 of where this descent ends, and how far bounded LM is below that
//! end after as many evaluations as the descent took (negative: above it). Of four scenes of `fit/tests/scenes.rs` the starts that a fit refines, after
//! its exploration, and the last one at the finest level:
//!
//! | scene | this | bounded LM | its end below this one's |
//! |---|---|---|---|
//! | red and blue | 69, 38, 52, 18 | 35, 52, never, 18 | .033, .020, -.005, .003 |
//! | matte | 38, 86, 120, 1 | never, never, 86, 1 | -.047, -.033, .007, 0 |
//! | grooves | 12, 34, 23, 1 | 12, 56, 34, 1 | -.001, -.004, -.001, 0 |
//! | deep grooves | 56, 45, 12, 1 | 34, 45, 23, 1 | .009, -.002, .006, 0 |
//!
//! From elsewhere, the truth and points .1 and .2 of every range off it in one scene, and two points of another: this 35, 137, 154, 35, 103; bounded LM 35,
//! never, 103, 35, 52; for the first three, `TrustRegionReflective` 35, never, 86, and Nelder and Mead's simplex 130, never, never.
//!
//! Of the 21 starts bounded LM is sooner at 5, as soon at 8, later at 4, and does not arrive at 4: there it hardly moves any more. After equal evaluations
//! it is more than .002 lower at 6 of the 16 (.033 at most), and more than .002 higher at 4 (.047 at most). So neither is better on the whole, and a start
//! that is lost costs more than one that ends a little higher: this one stays. It keeps steps within the range of its differences ([`Limits::step`]), and
//! ends by the tolerances of all other searches.

use crate::residuals::derivatives::{self, Derivatives};
use crate::residuals::equations::Evaluated;
use crate::residuals::model::Model;
use crate::search::optimise::{Limits, Minimum};
use crate::search::params::PARAMS;
use biscale::error::Result;
use biscale::numerics::linear_algebra::Cholesky;

/// Evaluations that a descent asks for, all at once where they do not depend on each other.
pub trait Evaluate {
    /// Evaluates points, with the linear unknowns held if these are given; `None` where the numbers make no surface.
    ///
    /// # Errors
    /// Those of the model; `Interrupted` when the search must end.
    fn evaluate(&self, points: &[Vec<f64>], linear: Option<&[f64]>) -> Result<Vec<Option<Evaluated>>>;
}

/// Goes down from `start`.
///
/// # Errors
/// Those of the evaluations; what was best before is known to these.
pub fn descend(model: &Model<'_>, start: &[f64], limits: Limits, evaluate: &dyn Evaluate) -> Result<Minimum> {
    let mut found = Minimum { point: start.to_vec(), objective: f64::INFINITY, evaluations: 1, converged: false, restarts: 0 };
    let Some(mut here) = evaluate.evaluate(std::slice::from_ref(&found.point), None)?.remove(0) else { return Ok(found) };
    found.objective = here.objective;
    let mut damping = PARAMS.damping;
    loop {
        let sides = derivatives::difference_points(&found.point);
        if found.evaluations + sides.len() + 1 > limits.evaluations {
            return Ok(found);
        }
        let moved = evaluate.evaluate(&sides, Some(&here.linear))?;
        found.evaluations += sides.len();
        let slopes = derivatives::derivatives_of(model, &found.point, &here, &moved);
        let before = found.objective;
        let mut length = 0.0;
        for _ in 0..PARAMS.tries {
            let Some(step) = step(&slopes, &found.point, damping) else { return Ok(found) };
            // No farther than derivatives are worth.
            let longest = step.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
            let share = (limits.step / longest.max(f64::MIN_POSITIVE)).min(1.0);
            let next: Vec<f64> = found.point.iter().zip(&step).map(|(u, s)| (u + share * s).clamp(0.0, 1.0)).collect();
            length = found.point.iter().zip(&next).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            if length <= PARAMS.still * limits.size || found.evaluations == limits.evaluations {
                break;
            }
            found.evaluations += 1;
            match evaluate.evaluate(std::slice::from_ref(&next), None)?.remove(0) {
                Some(there) if there.objective < found.objective => {
                    (found.point, found.objective, here) = (next, there.objective, there);
                    damping *= PARAMS.easier;
                    break;
                }
                _ => damping *= PARAMS.harder,
            }
        }
        // Where no step leads down the floor is reached, as far as differences can tell.
        if before - found.objective <= limits.cost * before.max(1.0) || length <= limits.size {
            found.converged = true;
            return Ok(found);
        }
    }
}

/// The step of the unknowns of the search; those that lie on a bound and want to leave the box stay.
fn step(derivatives: &Derivatives, point: &[f64], damping: f64) -> Option<Vec<f64>> {
    let total = derivatives.rows.first().map_or(0, Vec::len);
    let n = derivatives.variables;
    let (mut gram, mut gradient) = (vec![0.0; total * total], vec![0.0; total]);
    for (row, r) in derivatives.rows.iter().zip(&derivatives.residuals) {
        for i in (0..total).filter(|&i| row[i] != 0.0) {
            gradient[i] += row[i] * r;
            for j in 0..total {
                gram[i * total + j] += row[i] * row[j];
            }
        }
    }
    let mut held = vec![false; total];
    loop {
        let mut matrix = gram.clone();
        let mut rhs: Vec<f64> = gradient.iter().map(|g| -g).collect();
        for i in 0..total {
            // What nothing tells stays; linear unknowns are not damped: they are solved for again.
            matrix[i * total + i] += gram[i * total + i] * if i < n { damping } else { PARAMS.linear_ridge } + PARAMS.linear_ridge;
            if held[i] {
                (0..total).for_each(|j| (matrix[i * total + j], matrix[j * total + i]) = (0.0, 0.0));
                (matrix[i * total + i], rhs[i]) = (1.0, 0.0);
            }
        }
        let step = Cholesky::new(&matrix, total)?.solve(&rhs);
        let leaves = |i: &usize| !held[*i] && (point[*i] <= 0.0 && step[*i] < 0.0 || point[*i] >= 1.0 && step[*i] > 0.0);
        match (0..n).find(leaves) {
            Some(i) => held[i] = true,
            None => return Some(step[..n].to_vec()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_solves_a_linear_problem_and_stays_in_the_box() {
        // r = (x - .7, 2 (y + 3)), a linear unknown that nothing tells.
        let point = [0.2, 0.0];
        let rows = vec![vec![1.0, 0.0, 0.0], vec![0.0, 2.0, 0.0]];
        let residuals = vec![point[0] - 0.7, 2.0 * (point[1] + 3.0)];
        let d = Derivatives { rows, close_up: vec![false; 2], groups: vec![0; 2], residuals, variables: 2 };
        let step = step(&d, &point, 0.0).unwrap();
        assert!((step[0] - 0.5).abs() < 1e-6 && step[1] == 0.0, "{step:?}");
    }
}
