//! Linear least squares with unknowns of at least 0 (Lawson and Hanson 1974, "Solving Least Squares Problems", chapter 23).

use super::linear_algebra::Cholesky;

/// Share of a diagonal element that is added to it: columns that are nearly equal then share what one of them would get, and the matrix stays
/// positive definite. Far above rounding, far below what moves a fit.
const RIDGE: f64 = 1e-10;
/// A gradient counts as positive above this share of the largest right-hand side.
const SETTLED: f64 = 1e-12;

/// The `x >= 0` with the smallest `xᵀ A x - 2 bᵀ x`, for a symmetric matrix `A` of positive diagonal, by its rows: with `A = MᵀM` and `b = Mᵀy` the one with
/// the smallest `|M x - y|²`. Unknowns whose diagonal element is not positive stay 0.
///
/// # Panics
/// If `matrix` has not `b.len()²` numbers.
pub fn non_negative_least_squares(matrix: &[f64], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    assert_eq!(matrix.len(), n * n, "a row for each unknown");
    let mut x = vec![0.0; n];
    let mut free: Vec<usize> = Vec::new();
    let settled = SETTLED * b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    // Each round frees an unknown; one that is taken back in the same round would be freed for ever.
    for _ in 0..3 * n {
        let gradient = |k: usize| b[k] - (0..n).map(|j| matrix[k * n + j] * x[j]).sum::<f64>();
        let candidates = (0..n).filter(|k| !free.contains(k) && matrix[k * n + k] > 0.0);
        // By the gain of each alone, so that the scale of a column does not count.
        let gain = |k: usize| gradient(k) / matrix[k * n + k].sqrt();
        let Some(next) = candidates.filter(|&k| gradient(k) > settled).max_by(|&a, &b| gain(a).total_cmp(&gain(b))) else { break };
        free.push(next);
        loop {
            let Some(solution) = solve(matrix, b, n, &free) else {
                free.pop();
                return x;
            };
            if solution.iter().all(|v| *v > 0.0) {
                x.fill(0.0);
                free.iter().zip(solution).for_each(|(&k, v)| x[k] = v);
                break;
            }
            // As far towards the solution as all stay at least 0; those that are 0 there are held.
            let step = free
                .iter()
                .zip(&solution)
                .filter(|(_, v)| **v <= 0.0)
                .map(|(&k, &v)| x[k] / (x[k] - v))
                .fold(1.0, f64::min)
                .clamp(0.0, 1.0);
            free.iter().zip(&solution).for_each(|(&k, &v)| x[k] += step * (v - x[k]));
            let least = free.iter().zip(&solution).filter(|(_, v)| **v <= 0.0).map(|(&k, _)| x[k]).fold(f64::INFINITY, f64::min);
            let held: Vec<usize> = free.iter().zip(&solution).filter(|&(&k, &v)| v <= 0.0 && x[k] <= least).map(|(&k, _)| k).collect();
            held.iter().for_each(|&k| x[k] = 0.0);
            free.retain(|k| !held.contains(k));
            if free.is_empty() {
                break;
            }
        }
    }
    x
}

/// The solution of the free unknowns alone.
fn solve(matrix: &[f64], b: &[f64], n: usize, free: &[usize]) -> Option<Vec<f64>> {
    let m = free.len();
    let element = |i: usize, j: usize| matrix[free[i] * n + free[j]] * if i == j { 1.0 + RIDGE } else { 1.0 };
    let block: Vec<f64> = (0..m * m).map(|k| element(k / m, k % m)).collect();
    let right: Vec<f64> = free.iter().map(|&k| b[k]).collect();
    Some(Cholesky::new(&block, m)?.solve(&right))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn normal_equations(columns: &[Vec<f64>], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let matrix = columns.iter().flat_map(|a| columns.iter().map(|b| dot(a, b))).collect();
        (matrix, columns.iter().map(|a| dot(a, y)).collect())
    }

    #[test]
    fn what_would_be_negative_is_zero_and_the_rest_is_solved_without_it() {
        // Without bounds 3 and -1; with them the first column alone, 4·2 / 4.
        let (matrix, b) = normal_equations(&[vec![2.0, 0.0], vec![2.0, 1.0]], &[4.0, -1.0]);
        let x = non_negative_least_squares(&matrix, &b);
        assert!((x[0] - 2.0).abs() < 1e-9 && x[1] == 0.0, "{x:?}");
        // Equal columns and an empty one.
        let (matrix, b) = normal_equations(&[vec![1.0, 1.0], vec![1.0, 1.0], vec![0.0, 0.0]], &[1.0, 1.0]);
        let x = non_negative_least_squares(&matrix, &b);
        assert!((x[0] + x[1] - 1.0).abs() < 1e-6 && x[2] == 0.0, "{x:?}");
        assert_eq!(non_negative_least_squares(&[], &[]), Vec::<f64>::new());
    }

    proptest! {
        #[test]
        fn the_optimality_conditions_hold(entries in prop::collection::vec(-1.0_f64..1.0, 30), y in prop::collection::vec(-1.0_f64..1.0, 6)) {
            let columns: Vec<Vec<f64>> = entries.chunks(6).map(<[f64]>::to_vec).collect();
            let (matrix, b) = normal_equations(&columns, &y);
            let x = non_negative_least_squares(&matrix, &b);
            for k in 0..5 {
                let gradient = b[k] - (0..5).map(|j| matrix[5 * k + j] * x[j]).sum::<f64>();
                prop_assert!(x[k] >= 0.0 && gradient <= 1e-6, "{k}: {x:?}, gradient {gradient}");
                prop_assert!(x[k] == 0.0 || gradient.abs() <= 1e-6, "{k}: {x:?}, gradient {gradient}");
            }
        }
    }
}
