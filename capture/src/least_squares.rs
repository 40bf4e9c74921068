//! Small nonlinear least squares: Levenberg-Marquardt with numeric derivatives.
//!
//! For problems of up to about twenty unknowns and smooth residuals: poses, colour matrices. It is no general solver: no bounds, no sparse
//! problems.

use biscale::numerics::linear_algebra::scaled_inverse;

/// What a fit ends with.
#[derive(Clone, Debug)]
pub struct LeastSquaresFit {
    /// Best parameters.
    pub parameters: Vec<f64>,
    /// Sum of squared residuals there.
    pub cost: f64,
    /// `(J^T J)^-1`, row by row: the covariance for residuals of unit variance. `None` if something is not determined.
    pub covariance: Option<Vec<f64>>,
}

/// How steps are taken. Chosen, not measured.
struct LevenbergMarquardtParams {
    /// Most steps.
    steps: usize,
    /// Relative change of the cost that ends the search: well below what residuals of single precision tell.
    enough: f64,
    /// Step of the central differences over the typical change of a parameter.
    difference: f64,
    /// First damping, as a share of the diagonal of the normal matrix.
    damping: f64,
    /// Factor on the damping after a step that was good, ...
    eased: f64,
    /// ... after one that was not, ...
    raised: f64,
    /// ... and where the damped matrix cannot be inverted.
    singular: f64,
    /// Range of the damping; beyond it no step helps.
    range: [f64; 2],
}

const PARAMS: LevenbergMarquardtParams = LevenbergMarquardtParams {
    steps: 60,
    enough: 1e-12,
    difference: 1e-4,
    damping: 1e-3,
    eased: 0.2,
    raised: 6.0,
    singular: 10.0,
    range: [1e-12, 1e12],
};

/// Minimises the sum of squared `residuals` from `start`; `scale` is a typical change of each parameter (for the derivatives: 1e-4 of it).
///
/// Returns `None` if the residuals at `start` are not finite.
pub fn minimise(start: &[f64], scale: &[f64], residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> Option<LeastSquaresFit> {
    let n = start.len();
    let cost_of = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>();
    let mut x = start.to_vec();
    let mut r = residuals(&x);
    let mut cost = cost_of(&r);
    if !cost.is_finite() {
        return None;
    }
    let mut damping = PARAMS.damping;
    let (mut normal, mut gradient) = normal_equations(&x, scale, &r, residuals);
    for _ in 0..PARAMS.steps {
        let mut damped = normal.clone();
        for k in 0..n {
            damped[k * n + k] += damping * normal[k * n + k].max(f64::MIN_POSITIVE);
        }
        let Some(inverse) = scaled_inverse(&damped, n) else {
            damping *= PARAMS.singular;
            if damping > PARAMS.range[1] {
                break;
            }
            continue;
        };
        let trial: Vec<f64> = (0..n).map(|i| x[i] - (0..n).map(|k| inverse[i * n + k] * gradient[k]).sum::<f64>()).collect();
        let trial_r = residuals(&trial);
        let trial_cost = cost_of(&trial_r);
        if trial_cost.is_finite() && trial_cost <= cost {
            let gain = cost - trial_cost;
            (x, r, cost) = (trial, trial_r, trial_cost);
            damping = (damping * PARAMS.eased).max(PARAMS.range[0]);
            (normal, gradient) = normal_equations(&x, scale, &r, residuals);
            if gain <= PARAMS.enough * cost {
                break;
            }
        } else {
            damping *= PARAMS.raised;
            if damping > PARAMS.range[1] {
                break;
            }
        }
    }
    Some(LeastSquaresFit { covariance: scaled_inverse(&normal, n), parameters: x, cost })
}

/// `J^T J` and `J^T r`, by central differences.
fn normal_equations(x: &[f64], scale: &[f64], r: &[f64], residuals: &dyn Fn(&[f64]) -> Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let n = x.len();
    let columns: Vec<Vec<f64>> = (0..n)
        .map(|k| {
            let h = PARAMS.difference * scale[k];
            let at = |d: f64| {
                let mut x = x.to_vec();
                x[k] += d;
                residuals(&x)
            };
            let (up, down) = (at(h), at(-h));
            up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * h)).collect()
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal = (0..n * n).map(|i| dot(&columns[i / n], &columns[i % n])).collect();
    (normal, columns.iter().map(|c| dot(c, r)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rosenbrock_s_valley_is_followed_to_its_end() {
        let fit = minimise(&[-1.2, 1.0], &[1.0, 1.0], &|x| vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]).unwrap();
        assert!((fit.parameters[0] - 1.0).abs() < 1e-6 && (fit.parameters[1] - 1.0).abs() < 1e-6, "{fit:?}");
    }

    #[test]
    fn a_line_s_covariance_is_that_of_the_textbook() {
        // y = a + b x at x = -1, 0, 1: var a = 1/3, var b = 1/2, no correlation.
        let fit = minimise(&[0.0, 0.0], &[1.0, 1.0], &|p| [-1.0, 0.0, 1.0].map(|x| p[0] + p[1] * x - (2.0 + 3.0 * x)).to_vec()).unwrap();
        let c = fit.covariance.unwrap();
        assert!((fit.parameters[0] - 2.0).abs() < 1e-9 && (fit.parameters[1] - 3.0).abs() < 1e-9);
        assert!((c[0] - 1.0 / 3.0).abs() < 1e-9 && (c[3] - 0.5).abs() < 1e-9 && c[1].abs() < 1e-9, "{c:?}");
    }

    #[test]
    fn what_is_not_determined_has_no_covariance() {
        let fit = minimise(&[0.0, 0.0], &[1.0, 1.0], &|p| vec![p[0] + p[1] - 1.0, 2.0 * (p[0] + p[1]) - 2.0]).unwrap();
        assert!(fit.covariance.is_none() && fit.cost < 1e-12, "{fit:?}");
        assert!(minimise(&[0.0], &[1.0], &|_| vec![f64::NAN]).is_none());
    }
}
