//! Low-rank factors of matrices too large to hold: random projection and singular values.
//!
//! `A ≈ 1 meanᵀ + left rightᵀ`, with shapes `m x n ≈ m x 1 · 1 x n + m x rank · rank x n`; the columns of `right` are orthonormal, those of
//! `left` carry the singular values.
//!
//! Wu et al. (2011, table 2) project the rows of the centred matrix `P = A - 1 meanᵀ` on `l` Gaussian vectors, `Q = Rᵀ P / sqrt(l)`, and
//! take the right singular vectors `V` of `Q` as basis: `P ≈ (P V) Vᵀ`. That is [`Iteration::None`]: two passes over the matrix. One power
//! iteration (Halko, Martinsson and Tropp 2011, algorithm 4.4, with an orthonormalisation at each half step) makes the basis nearly that
//! of the true singular vectors, for two more passes: [`Iteration::One`]. The vectors are then turned to singular vectors of `P V Vᵀ`.
//!
//! The matrix is a function that writes rows, called again in each pass, by blocks and from several threads. Sums over blocks are
//! added in the order of the rows: the same bits at any number of threads. The random vectors come from counters.

use crate::error::{Error, Result};
use crate::numerics::low_discrepancy::gaussian;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Columns of the random projection of Wu et al. (2011, section 5).
pub const PAPER_PROJECTION: usize = 50;
/// Numbers of a block of rows: 2 MB.
const BLOCK: usize = 1 << 18;
/// Blocks in work at once.
const BLOCKS_AT_ONCE: usize = 16;
/// What is left of a matrix of equal rows after its mean is taken off is below this share of it: rounding.
const ROUNDING: f64 = 1e-13;

/// A matrix given by a function.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    /// Rows `m`.
    pub rows: usize,
    /// Columns `n`.
    pub columns: usize,
    /// Writes some rows, one after the other; the slice holds `columns` numbers for each.
    pub write: &'a (dyn Fn(Range<usize>, &mut [f64]) + Sync),
}

/// Whether the projection is refined by a power iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iteration {
    /// As in the paper.
    None,
    /// One, with orthonormalisation at each half step.
    One,
}

/// How to factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// Random vectors `l`; the rank is at most this.
    pub projection: usize,
    /// Power iteration.
    pub iteration: Iteration,
    /// Share of the power (squared Frobenius norm) of the centred matrix to keep, in 0..=1; 1 cuts nothing.
    pub energy: f64,
    /// Seed of the random vectors.
    pub seed: u64,
}

impl Default for Params {
    /// The paper's for `N`: 50 vectors, no iteration, 99.5 %.
    fn default() -> Self {
        Self { projection: PAPER_PROJECTION, iteration: Iteration::None, energy: 0.995, seed: 0 }
    }
}

/// `A ≈ 1 meanᵀ + left rightᵀ`.
#[derive(Clone, Debug)]
pub struct Factors {
    /// Mean of the rows, `n` numbers.
    pub mean: Vec<f64>,
    /// `m x rank`: `U Σ`.
    pub left: Mat<f64>,
    /// `n x rank`, orthonormal columns: `V`.
    pub right: Mat<f64>,
    /// Frobenius norm of the matrix before its mean is taken off.
    pub norm: f64,
    /// Frobenius norm of the centred matrix.
    pub centred_norm: f64,
    /// Share of the power of the centred matrix that the factors keep, in 0..=1; 1 for one without power.
    pub energy: f64,
    /// Estimated Frobenius norm of what the projection misses, before the cut.
    ///
    /// Without power iteration the leave-one-out estimate (Epperly and Tropp 2024); it does not hold with one, nor where the vectors are as
    /// many as the rows or the columns. There this is the
    /// difference of the squared norms, whose floor is 2e-8 of the centred norm.
    pub projection_error: f64,
    /// Frobenius norm of what the energy cut takes away.
    pub cut: f64,
}

impl Factors {
    /// The mean and nothing else, which misses `missed` of the norm.
    fn of_mean(mean: Vec<f64>, rows: usize, norm: f64, missed: f64) -> Self {
        let (left, right) = (Mat::zeros(rows, 0), Mat::zeros(mean.len(), 0));
        let energy = if missed > ROUNDING * norm { 0.0 } else { 1.0 };
        Self { mean, left, right, norm, centred_norm: missed, energy, projection_error: missed, cut: 0.0 }
    }

    /// Columns of the factors.
    pub fn rank(&self) -> usize {
        self.left.ncols()
    }

    /// Estimated Frobenius norm of the difference between the matrix and its factors.
    pub fn error(&self) -> f64 {
        self.projection_error.hypot(self.cut)
    }

    /// Entry of the approximation.
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        (0..self.rank()).fold(self.mean[column], |sum, k| sum + self.left[(row, k)] * self.right[(column, k)])
    }
}

/// Factors of `matrix`. `check` is called between blocks and stops the work with its error.
///
/// # Errors
/// [`Error::Numeric`] for a number that is not finite, with its place; what `check` returns.
pub fn factor(matrix: &Rows<'_>, params: &Params, check: &dyn Fn() -> Result<()>) -> Result<Factors> {
    if matrix.rows == 0 || matrix.columns == 0 {
        return Ok(Factors::of_mean(vec![0.0; matrix.columns], matrix.rows, 0.0, 0.0));
    }
    let l = params.projection.min(matrix.rows).min(matrix.columns);
    let random = |rows: Range<usize>| {
        let first = rows.start;
        Mat::from_fn(rows.len(), l, |i, j| gaussian(params.seed, ((first + i) * l + j) as u64))
    };
    // The first pass finds the mean too: it is taken off the products afterwards, P = A - 1 meanᵀ.
    let first = product_transposed(matrix, l, &random, check)?;
    let mut mean = first.sums.clone();
    for value in &mut mean {
        *value /= matrix.rows.max(1) as f64;
    }
    let mut sketch = first.product;
    take_off(&mut sketch, &mean, &first.weights);
    let (mut basis, triangle) = orthonormalise(&sketch);
    let leave_one_out = leave_one_out(&triangle);
    if params.iteration == Iteration::One {
        let (onto, _) = product(matrix, &mean, basis.as_ref(), check)?;
        let (half, _) = orthonormalise(&onto);
        let half_rows = |rows: Range<usize>| half.as_ref().subrows(rows.start, rows.len()).to_owned();
        let again = product_transposed(matrix, l, &half_rows, check)?;
        sketch = again.product;
        take_off(&mut sketch, &mean, &again.weights);
        basis = orthonormalise(&sketch).0;
    }
    let (onto, centred_power) = product(matrix, &mean, basis.as_ref(), check)?;
    let norm = first.power.sqrt();
    if centred_power.sqrt() <= ROUNDING * norm || l == 0 {
        return Ok(Factors::of_mean(mean, matrix.rows, norm, centred_power.sqrt()));
    }
    let (left, values, turn) = singular(&onto)?;
    let power: Vec<f64> = values.iter().map(|s| s * s).collect();
    let found: f64 = power.iter().sum();
    let projection_error = match params.iteration {
        // As many vectors as the matrix has rows or columns miss nothing, which one fewer would.
        Iteration::None if l < matrix.rows.min(matrix.columns) => leave_one_out,
        _ => norm_difference(centred_power, found),
    };
    let rank = rank_of(&power, params.energy * centred_power, ROUNDING * ROUNDING * first.power);
    let kept: f64 = power[..rank].iter().sum();
    let right = &basis * turn.as_ref().subcols(0, rank);
    let left = Mat::from_fn(matrix.rows, rank, |i, j| left[(i, j)] * values[j]);
    Ok(Factors {
        mean,
        left,
        right,
        norm,
        centred_norm: centred_power.sqrt(),
        energy: (kept / centred_power).min(1.0),
        projection_error,
        cut: power[rank..].iter().sum::<f64>().sqrt(),
    })
}

/// How often [`factor`] will call `check`.
pub fn checks(matrix: &Rows<'_>, params: &Params) -> usize {
    let passes = match params.iteration {
        Iteration::None => 2,
        Iteration::One => 4,
    };
    passes * blocks(matrix).len().div_ceil(BLOCKS_AT_ONCE)
}

/// Fewest of the powers, largest first, whose sum reaches `wanted`; none of those up to `least`, which are rounding.
fn rank_of(power: &[f64], wanted: f64, least: f64) -> usize {
    let mut sum = 0.0;
    for (rank, &p) in power.iter().enumerate() {
        if sum >= wanted || p <= least {
            return rank;
        }
        sum += p;
    }
    power.len()
}

/// Frobenius norm of what lacks between a matrix and its projection, from the squares of their norms.
fn norm_difference(all: f64, found: f64) -> f64 {
    (all - found).max(0.0).sqrt()
}

/// Leave-one-out estimate of `|A - Q Qᵀ A|` in the Frobenius norm, from the triangle of `A Omega = Q R` for `l` Gaussian vectors:
/// `err² = 1/l sum over j of 1 / |row j of R⁻¹|²` (Epperly and Tropp 2024, "Efficient error and variance estimation for randomized matrix
/// computations"). 0 where the triangle is singular: the vectors then span all of the matrix.
fn leave_one_out(triangle: &Mat<f64>) -> f64 {
    let l = triangle.ncols();
    let largest = (0..l).map(|k| triangle[(k, k)].abs()).fold(0.0, f64::max);
    if l == 0 || triangle.nrows() < l || (0..l).any(|k| triangle[(k, k)].abs() <= ROUNDING * largest) {
        return 0.0;
    }
    // Row j of the inverse, x R = e_j, by forward substitution along the row.
    let mut sum = 0.0;
    let mut x = vec![0.0; l];
    for j in 0..l {
        let mut square = 0.0;
        for k in j..l {
            let before: f64 = (j..k).map(|i| x[i] * triangle[(i, k)]).sum();
            x[k] = (f64::from(u8::from(k == j)) - before) / triangle[(k, k)];
            square += x[k] * x[k];
        }
        sum += 1.0 / square;
    }
    (sum / l as f64).sqrt()
}

/// Orthonormal basis of the columns, and the triangle: `Y = Q R`.
fn orthonormalise(y: &Mat<f64>) -> (Mat<f64>, Mat<f64>) {
    let qr = y.qr();
    (qr.compute_thin_Q(), qr.thin_R().to_owned())
}

/// Thin singular value decomposition of a tall matrix: left vectors, values, right vectors.
fn singular(tall: &Mat<f64>) -> Result<(Mat<f64>, Vec<f64>, Mat<f64>)> {
    let svd = tall.thin_svd().map_err(|_| Error::Numeric("a singular value decomposition did not converge".to_owned()))?;
    let values = svd.S().column_vector().iter().copied().collect();
    Ok((svd.U().to_owned(), values, svd.V().to_owned()))
}

/// `product -= mean weightsᵀ`.
fn take_off(product: &mut Mat<f64>, mean: &[f64], weights: &[f64]) {
    for (j, w) in weights.iter().enumerate() {
        for (i, m) in mean.iter().enumerate() {
            product[(i, j)] -= m * w;
        }
    }
}

/// What a pass over a matrix `A` with weights `G` finds.
struct Transposed {
    /// `Aᵀ G`.
    product: Mat<f64>,
    /// `Aᵀ 1`.
    sums: Vec<f64>,
    /// `Gᵀ 1`.
    weights: Vec<f64>,
    /// Squared Frobenius norm of `A`.
    power: f64,
}

/// Blocks of rows of a matrix, by its shape alone.
fn blocks(matrix: &Rows<'_>) -> Vec<Range<usize>> {
    let height = (BLOCK / matrix.columns.max(1)).clamp(1, 4096);
    (0..matrix.rows).step_by(height).map(|start| start..(start + height).min(matrix.rows)).collect()
}

/// Writes a block of rows and refuses what is not finite.
fn write_block(matrix: &Rows<'_>, rows: &Range<usize>) -> Result<Vec<f64>> {
    let mut block = vec![0.0; rows.len() * matrix.columns];
    (matrix.write)(rows.clone(), &mut block);
    match block.iter().position(|x| !x.is_finite()) {
        None => Ok(block),
        Some(k) => {
            let (row, column) = (rows.start + k / matrix.columns, k % matrix.columns);
            Err(Error::Numeric(format!("row {row}, column {column} of a matrix to factor is {}", block[k])))
        }
    }
}

/// `Aᵀ G` for the `width` columns of `G`, whose rows `weights` gives.
fn product_transposed(
    matrix: &Rows<'_>,
    width: usize,
    weights: &(dyn Fn(Range<usize>) -> Mat<f64> + Sync),
    check: &dyn Fn() -> Result<()>,
) -> Result<Transposed> {
    let n = matrix.columns;
    let mut all = Transposed { product: Mat::zeros(n, width), sums: vec![0.0; n], weights: vec![0.0; width], power: 0.0 };
    for group in blocks(matrix).chunks(BLOCKS_AT_ONCE) {
        check()?;
        let parts = group
            .par_iter()
            .map(|rows| {
                let block = write_block(matrix, rows)?;
                let g = weights(rows.clone());
                let mut part = Transposed { product: Mat::zeros(n, width), sums: vec![0.0; n], weights: vec![0.0; width], power: 0.0 };
                let a = MatRef::from_row_major_slice(&block, rows.len(), n);
                matmul(part.product.as_mut(), Accum::Replace, a.transpose(), g.as_ref(), 1.0, Par::Seq);
                for row in block.chunks_exact(n) {
                    for (sum, x) in part.sums.iter_mut().zip(row) {
                        *sum += x;
                        part.power += x * x;
                    }
                }
                for (j, sum) in part.weights.iter_mut().enumerate() {
                    *sum = g.col(j).iter().sum();
                }
                Ok(part)
            })
            .collect::<Result<Vec<Transposed>>>()?;
        for part in parts {
            all.product += &part.product;
            for (sum, x) in all.sums.iter_mut().zip(&part.sums).chain(all.weights.iter_mut().zip(&part.weights)) {
                *sum += x;
            }
            all.power += part.power;
        }
    }
    Ok(all)
}

/// `P V` of the centred matrix, and the squared Frobenius norm of `P`.
fn product(matrix: &Rows<'_>, mean: &[f64], v: MatRef<'_, f64>, check: &dyn Fn() -> Result<()>) -> Result<(Mat<f64>, f64)> {
    let n = matrix.columns;
    let mut all = Mat::zeros(matrix.rows, v.ncols());
    let mut power = 0.0;
    for group in blocks(matrix).chunks(BLOCKS_AT_ONCE) {
        check()?;
        let parts = group
            .par_iter()
            .map(|rows| {
                let mut block = write_block(matrix, rows)?;
                let mut power = 0.0;
                for row in block.chunks_exact_mut(n) {
                    for (x, m) in row.iter_mut().zip(mean) {
                        *x -= m;
                        power += *x * *x;
                    }
                }
                let mut part = Mat::zeros(rows.len(), v.ncols());
                matmul(part.as_mut(), Accum::Replace, MatRef::from_row_major_slice(&block, rows.len(), n), v, 1.0, Par::Seq);
                Ok((rows.start, part, power))
            })
            .collect::<Result<Vec<(usize, Mat<f64>, f64)>>>()?;
        for (start, part, square) in parts {
            all.as_mut().subrows_mut(start, part.nrows()).copy_from(&part);
            power += square;
        }
    }
    Ok((all, power))
}

#[cfg(test)]
#[path = "randomized_svd_tests.rs"]
mod tests;
