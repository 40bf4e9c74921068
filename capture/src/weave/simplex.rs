//! The simplex search of weaves: shapes of a few numbers, whose least residual nothing bounds.

use biscale::numerics::nelder_mead::{Coefficients, SimplexParams, axis_simplex, minimise};
use std::convert::Infallible;

/// Difference of the residuals of a simplex's corners, over the least of them, that ends a search. Chosen: far below what tells two shapes apart, and
/// more evaluations for less buy no width.
const LEVEL: f64 = 1e-5;

/// The lowest point that a simplex of given steps from `start` finds within `most` evaluations.
pub(super) fn simplex<const N: usize>(f: &impl Fn(&[f64; N]) -> f64, start: [f64; N], steps: [f64; N], most: usize) -> [f64; N] {
    let params = SimplexParams {
        coefficients: Coefficients::Classic,
        bounds: [f64::NEG_INFINITY, f64::INFINITY],
        size: f64::INFINITY,
        cost: LEVEL,
        cost_floor: 0.0,
        flat: 0.0,
        evaluations: most,
    };
    let array = |x: &[f64]| -> [f64; N] { std::array::from_fn(|k| x[k]) };
    let objective = |x: &[f64]| -> Result<f64, Infallible> { Ok(f(&array(x))) };
    match minimise(&objective, axis_simplex(&start, &steps, params.bounds), &params) {
        Ok(found) => array(&found.point),
        Err(never) => match never {},
    }
}
