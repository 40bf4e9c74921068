//! Small dense symmetric matrices: a thin layer over `faer`.
//!
//! A matrix of `n` rows is a slice of `n²` numbers, row after row, of which only the lower triangle is read. `faer` is built without its threads, so
//! the same matrix gives the same bits. Meant for up to a few hundred rows; for large matrices of low rank see
//! [`randomized_svd`](super::randomized_svd).

use faer::linalg::solvers::{Llt, Solve};
use faer::{MatMut, MatRef, Side};

/// Cholesky's decomposition `A = L Lᵀ` of a symmetric positive definite matrix.
#[derive(Clone, Debug)]
pub struct Cholesky {
    factor: Llt<f64>,
}

impl Cholesky {
    /// Decomposes a matrix of `n` rows; `None` if it is not positive definite, as far as `f64` tells, or not finite.
    ///
    /// # Panics
    /// If the slice has not `n²` numbers.
    pub fn new(matrix: &[f64], n: usize) -> Option<Self> {
        let factor = MatRef::from_row_major_slice(matrix, n, n).llt(Side::Lower).ok()?;
        (0..n).all(|i| factor.L()[(i, i)].is_finite()).then_some(Self { factor })
    }

    /// The least square of a diagonal element of `L`: beside the diagonal of `A`, how much of a row the rows before it do not explain.
    /// Infinite of a matrix without rows.
    pub fn least_pivot(&self) -> f64 {
        let l = self.factor.L();
        (0..l.nrows()).map(|i| l[(i, i)] * l[(i, i)]).fold(f64::INFINITY, f64::min)
    }

    /// The solution of `A x = b`.
    ///
    /// # Panics
    /// If `b` has another length than the matrix has rows.
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        let n = x.len();
        self.factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut x, n, 1));
        x
    }

    /// `A⁻¹`, row after row.
    pub fn inverse(&self) -> Vec<f64> {
        let n = self.factor.L().nrows();
        let mut out = vec![0.0; n * n];
        (0..n).for_each(|i| out[i * n + i] = 1.0);
        // Symmetric: by rows or by columns is the same.
        self.factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut out, n, n));
        out
    }
}

/// Least share of a row's scale that the rows before it must leave for an inverse to be told from rounding: about 50 machine epsilons.
pub const LEAST_PIVOT: f64 = 1e-14;

/// The inverse of a symmetric positive definite matrix whose unknowns may have any units: it is scaled to a unit diagonal first, `D⁻¹ A D⁻¹` with
/// `D = sqrt(diag A)`. `None` if a pivot of the scaled matrix is not above [`LEAST_PIVOT`]: then something is not determined.
///
/// # Panics
/// If the slice has not `n²` numbers.
pub fn scaled_inverse(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    assert_eq!(matrix.len(), n * n, "a square matrix");
    let d: Vec<f64> = (0..n).map(|i| matrix[i * n + i].sqrt()).collect();
    if d.iter().any(|v| !(v.is_finite() && *v > 0.0)) {
        return None;
    }
    let scaled: Vec<f64> = (0..n * n).map(|k| matrix[k] / (d[k / n] * d[k % n])).collect();
    let factor = Cholesky::new(&scaled, n).filter(|f| f.least_pivot() > LEAST_PIVOT)?;
    Some(factor.inverse().iter().enumerate().map(|(k, v)| v / (d[k / n] * d[k % n])).collect())
}

/// Linear least squares: the `x` with the smallest `|rows x - values|²`, by the normal equations and [`scaled_inverse`]; `None` if it is not
/// determined. Good for well-conditioned problems of few unknowns: the condition number is squared.
///
/// # Panics
/// If rows differ in length.
pub fn least_squares(rows: &[Vec<f64>], values: &[f64]) -> Option<Vec<f64>> {
    let n = rows.first()?.len();
    let (mut normal, mut right) = (vec![0.0; n * n], vec![0.0; n]);
    for (row, v) in rows.iter().zip(values) {
        for i in 0..n {
            right[i] += row[i] * v;
            for j in 0..n {
                normal[i * n + j] += row[i] * row[j];
            }
        }
    }
    let inverse = scaled_inverse(&normal, n)?;
    Some((0..n).map(|i| (0..n).map(|j| inverse[i * n + j] * right[j]).sum()).collect())
}

/// Eigenvalues of a symmetric matrix of `n` rows, ascending; NaNs if it is not finite.
///
/// # Panics
/// If the slice has not `n²` numbers.
pub fn symmetric_eigenvalues(matrix: &[f64], n: usize) -> Vec<f64> {
    let found = MatRef::from_row_major_slice(matrix, n, n).self_adjoint_eigenvalues(Side::Lower);
    found.unwrap_or_else(|_| vec![f64::NAN; n])
}

/// The eigenvector, of length 1, of the largest eigenvalue of a symmetric matrix of `n` rows; its sign is arbitrary. `None` if the matrix is not finite
/// or has no rows.
///
/// # Panics
/// If the slice has not `n²` numbers.
pub fn largest_eigenvector(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    largest_eigenvectors(matrix, n, 1)?.pop()
}

/// The eigenvectors of the `count` largest eigenvalues, or all if they are no more, that of the largest first; otherwise as [`largest_eigenvector`].
///
/// # Panics
/// If the slice has not `n²` numbers.
pub fn largest_eigenvectors(matrix: &[f64], n: usize, count: usize) -> Option<Vec<Vec<f64>>> {
    if n == 0 {
        return Some(Vec::new());
    }
    let found = MatRef::from_row_major_slice(matrix, n, n).self_adjoint_eigen(Side::Lower).ok()?;
    // Ascending.
    let vectors: Vec<Vec<f64>> = (0..n).rev().take(count).map(|j| (0..n).map(|i| found.U()[(i, j)]).collect()).collect();
    vectors.iter().flatten().all(|v| v.is_finite()).then_some(vectors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::low_discrepancy::gaussian;

    /// `B Bᵀ + share · 1` of random numbers.
    fn positive(n: usize, seed: u64, share: f64) -> Vec<f64> {
        let b: Vec<f64> = (0..(n * n) as u64).map(|k| gaussian(seed, k)).collect();
        let dot = |i: usize, j: usize| (0..n).map(|k| b[i * n + k] * b[j * n + k]).sum::<f64>();
        (0..n * n).map(|k| dot(k / n, k % n) + if k / n == k % n { share } else { 0.0 }).collect()
    }

    fn times(matrix: &[f64], x: &[f64]) -> Vec<f64> {
        matrix.chunks(x.len()).map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
    }

    #[test]
    fn a_solution_solves_and_an_inverse_inverts() {
        for n in [1, 2, 5, 40] {
            let matrix = positive(n, n as u64, 0.5);
            let factor = Cholesky::new(&matrix, n).unwrap();
            let x: Vec<f64> = (0..n).map(|k| gaussian(9, k as u64)).collect();
            let found = factor.solve(&times(&matrix, &x));
            assert!(found.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10), "{n} rows: {found:?} for {x:?}");
            for inverse in [factor.inverse(), scaled_inverse(&matrix, n).unwrap()] {
                let again = times(&inverse, &times(&matrix, &x));
                assert!(again.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10), "{n} rows: {again:?} for {x:?}");
            }
        }
    }

    #[test]
    fn only_the_lower_triangle_is_read() {
        let factor = Cholesky::new(&[4.0, f64::NAN, 2.0, 5.0], 2).unwrap();
        // L = (2 0; 1 2)
        assert_eq!(factor.least_pivot(), 4.0);
        assert_eq!(factor.solve(&[4.0, 2.0]), [1.0, 0.0]);
    }

    #[test]
    fn what_is_not_positive_or_not_finite_is_refused() {
        for matrix in [[1.0, 2.0, 2.0, 1.0], [0.0; 4], [f64::NAN; 4], [f64::INFINITY, 0.0, 0.0, 1.0]] {
            assert!(Cholesky::new(&matrix, 2).is_none() && scaled_inverse(&matrix, 2).is_none(), "{matrix:?}");
        }
        // Two unknowns that only appear as their sum, but for rounding.
        assert!(scaled_inverse(&[1.0, 1.0, 1.0, 1.0 + 1e-15], 2).is_none());
        assert!(Cholesky::new(&[], 0).is_some());
    }

    #[test]
    fn units_do_not_matter_to_the_scaled_inverse() {
        let units: [f64; 3] = [1e-9, 1.0, 1e9];
        let matrix = positive(3, 4, 0.5);
        let other: Vec<f64> = (0..9).map(|k| matrix[k] * units[k / 3] * units[k % 3]).collect();
        let (a, b) = (scaled_inverse(&matrix, 3).unwrap(), scaled_inverse(&other, 3).unwrap());
        for k in 0..9 {
            assert!((b[k] * units[k / 3] * units[k % 3] - a[k]).abs() < 1e-12, "{a:?}, {b:?}");
        }
    }

    #[test]
    fn a_line_is_fitted() {
        let rows: Vec<Vec<f64>> = (0..9).map(|k| vec![1.0, f64::from(k)]).collect();
        let values: Vec<f64> = (0..9).map(|k| 2.0 - 0.5 * f64::from(k)).collect();
        let found = least_squares(&rows, &values).unwrap();
        assert!((found[0] - 2.0).abs() < 1e-12 && (found[1] + 0.5).abs() < 1e-12, "{found:?}");
        assert_eq!(least_squares(&[vec![1.0, 1.0]], &[1.0]), None);
        assert_eq!(least_squares(&[], &[]), None);
    }

    #[test]
    fn eigenvalues_of_closed_form_and_their_largest_vector() {
        // Second differences: 2 - 2 cos(k π / (n + 1)).
        let n = 12_usize;
        let matrix: Vec<f64> = (0..n * n).map(|k| [2.0, -1.0, 0.0][(k / n).abs_diff(k % n).min(2)]).collect();
        let found = symmetric_eigenvalues(&matrix, n);
        let of = |k: usize| 2.0 - 2.0 * (std::f64::consts::PI * k as f64 / (n + 1) as f64).cos();
        assert!((0..n).all(|k| (found[k] - of(k + 1)).abs() < 1e-13), "{found:?}");
        let vector = largest_eigenvector(&matrix, n).unwrap();
        let image = times(&matrix, &vector);
        assert!((0..n).all(|k| (image[k] - of(n) * vector[k]).abs() < 1e-13), "{vector:?}");
        assert_eq!(largest_eigenvector(&[f64::NAN; 4], 2), None);
    }
}
