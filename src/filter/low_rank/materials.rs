//! The matrix `M`: the cosine-weighted BRDF turned to each normal, and its product with `N` by the factors of both (Wu et al. 2011,
//! sections 3.5 to 3.7).
//!
//! `M[k][j] = f(n_j, wi_k, wo_k)`, `f = fr (n·wi)+ (n·wo)+` (eq. 4), in 1/sr. Its size forbids to hold it: it is written row by row. What is
//! factored is scaled so that squares count as integrals over the sphere and the two hemispheres: each element by
//! `sqrt(dw_j) sqrt(dwi_k dwo_k)` with the solid angles of the map's cells, those of `N` by `1/sqrt(dw_j)` (its elements are integrals
//! over a cell already), which cancels in the product.

use super::map::Map;
use super::normals::directions_of;
use crate::brdf::{Brdf, Colour};
use crate::error::{Error, Result};
use crate::low_rank::Factors;
use faer::Mat;
use glam::DVec3;
use std::ops::Range;

/// The colour direction of a BRDF: the first principal direction of its values at `samples` of normal, light and viewer (section 3.7),
/// a unit vector whose components sum to at least 0; grey for a black BRDF.
///
/// # Errors
/// [`Error::Numeric`] if the decomposition does not converge.
pub fn principal_colour(brdf: &Brdf, samples: impl Iterator<Item = [DVec3; 3]>) -> Result<Colour> {
    // The eigenvector of the values' second moments is the right singular vector of their table.
    let mut moments = Mat::<f64>::zeros(3, 3);
    for [n, wi, wo] in samples {
        let value = brdf.eval(n, wi, wo);
        for (a, x) in value.iter().enumerate() {
            for (b, y) in value.iter().enumerate() {
                moments[(a, b)] += x * y;
            }
        }
    }
    if (0..3).all(|c| moments[(c, c)] <= 0.0) {
        return Ok([1.0 / 3.0_f64.sqrt(); 3]);
    }
    let svd = moments.svd().map_err(|_| Error::Numeric("the colours of a BRDF have no principal direction".to_owned()))?;
    let direction: Colour = std::array::from_fn(|c| svd.U()[(c, 0)]);
    let sign = if direction.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    Ok(direction.map(|x| sign * x))
}

/// What `M` tabulates: one BRDF along one colour direction.
#[derive(Clone, Copy, Debug)]
pub struct Tabulated<'a> {
    /// The BRDF.
    pub brdf: &'a Brdf,
    /// Colour direction, unit.
    pub colour: Colour,
    /// Directions to the light and to the viewer: rows are the pairs of its cells, as [`super::normals::row_of`] counts them.
    pub directions: &'a Map,
    /// Normals: one column each.
    pub normals: &'a [DVec3],
    /// Solid angle of each normal's cell, sr.
    pub solid_angles: &'a [f64],
}

impl Tabulated<'_> {
    /// Rows of `M`.
    pub fn rows(&self) -> usize {
        let count = self.directions.directions.len();
        count * (count + 1) / 2
    }

    /// Factor that scales a row.
    pub fn row_weight(&self, row: usize) -> f64 {
        let [a, b] = directions_of(row);
        (self.directions.solid_angles[a] * self.directions.solid_angles[b]).sqrt()
    }

    /// Element of `M`, not scaled.
    pub fn element(&self, [a, b]: [usize; 2], column: usize) -> f64 {
        let (i, o, n) = (self.directions.directions[a], self.directions.directions[b], self.normals[column]);
        let (ci, co) = (n.dot(i), n.dot(o));
        if ci <= 0.0 || co <= 0.0 {
            return 0.0;
        }
        let value = self.brdf.eval(n, i, o);
        (0..3).map(|c| self.colour[c] * value[c]).sum::<f64>() * ci * co
    }

    /// Writes scaled rows: what [`crate::low_rank::factor`] takes.
    pub fn write(&self, rows: Range<usize>, out: &mut [f64]) {
        for (k, row) in rows.zip(out.chunks_exact_mut(self.normals.len().max(1))) {
            let (pair, weight) = (directions_of(k), self.row_weight(k));
            for (j, x) in row.iter_mut().enumerate() {
                *x = self.element(pair, j) * weight * self.solid_angles[j].sqrt();
            }
        }
    }
}

/// A row of a factored matrix with its scale taken off, or a mixture of rows: `scale · mean + right · coefficients`.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    scale: f64,
    coefficients: Vec<f64>,
}

impl Row {
    /// The sum of rows `(row, share, weight)`, each times its share and over the weight that it was scaled by. One row with share 1 is
    /// itself; the cells around a direction with their shares interpolate.
    pub fn mixture(factors: &Factors, rows: impl Iterator<Item = (usize, f64, f64)>) -> Self {
        let mut sum = Self { scale: 0.0, coefficients: vec![0.0; factors.rank()] };
        for (row, share, weight) in rows {
            let factor = share / weight;
            sum.scale += factor;
            for (k, c) in sum.coefficients.iter_mut().enumerate() {
                *c += factor * factors.left[(row, k)];
            }
        }
        sum
    }
}

/// Sums over normals of `N[k][j] M[k][j]` by factors (eq. 12), the means included, which the paper omits in its formulas.
#[derive(Clone, Debug)]
pub struct Product {
    means: f64,
    /// Each basis vector of `N` with the mean of `M`.
    of_n: Vec<f64>,
    /// Each basis vector of `M` with the mean of `N`.
    of_m: Vec<f64>,
    /// `V_Nᵀ V_M`.
    both: Mat<f64>,
}

impl Product {
    /// `columns[j]` is the column of `M` for column `j` of `N`.
    ///
    /// # Panics
    /// If `columns` has not one element a column of `N`, or one that is no column of `M`.
    pub fn new(n: &Factors, m: &Factors, columns: &[usize]) -> Self {
        assert_eq!(columns.len(), n.mean.len(), "one column of M for each of N");
        let sum = |f: &dyn Fn(usize, usize) -> f64| columns.iter().enumerate().map(|(j, &c)| f(j, c)).sum::<f64>();
        Self {
            means: sum(&|j, c| n.mean[j] * m.mean[c]),
            of_n: (0..n.rank()).map(|k| sum(&|j, c| n.right[(j, k)] * m.mean[c])).collect(),
            of_m: (0..m.rank()).map(|k| sum(&|j, c| n.mean[j] * m.right[(c, k)])).collect(),
            both: Mat::from_fn(n.rank(), m.rank(), |a, b| sum(&|j, c| n.right[(j, a)] * m.right[(c, b)])),
        }
    }

    /// The sum for a row of `N` and one of `M`.
    pub fn at(&self, n: &Row, m: &Row) -> f64 {
        let mut sum = self.means * n.scale * m.scale;
        for (b, y) in m.coefficients.iter().enumerate() {
            let mixed: f64 = n.coefficients.iter().enumerate().map(|(a, x)| x * self.both[(a, b)]).sum();
            sum += (mixed + n.scale * self.of_m[b]) * y;
        }
        sum + m.scale * n.coefficients.iter().zip(&self.of_n).map(|(x, with)| x * with).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::super::map::Projection;
    use super::super::normals::row_of;
    use super::*;
    use crate::brdf::Distribution;
    use crate::low_discrepancy::gaussian;
    use crate::low_rank::{Iteration, Params, Rows, factor};

    fn rough() -> Brdf {
        let (diffuse, specular) = ([0.2, 0.1, 0.0], [0.5, 0.6, 0.7]);
        Brdf::CookTorrance { diffuse, specular, alpha: 0.5, distribution: Distribution::Ggx, f0: None }
    }

    /// All normals of a map with all pairs of directions.
    fn samples(map: &Map) -> impl Iterator<Item = [DVec3; 3]> {
        let w = &map.directions;
        w.iter().flat_map(move |&n| w.iter().flat_map(move |&i| w.iter().map(move |&o| [n, i, o])))
    }

    #[test]
    fn one_colour_is_its_own_direction_and_black_is_grey() {
        let map = Map::hemisphere(Projection::Paraboloid, 4);
        let direction = principal_colour(&Brdf::Lambert { albedo: [0.6, 0.0, 0.3] }, samples(&map)).unwrap();
        let length = f64::hypot(0.6, 0.3);
        for (found, expected) in direction.iter().zip([0.6, 0.0, 0.3]) {
            assert!((found - expected / length).abs() < 1e-12, "{direction:?}");
        }
        let black = principal_colour(&Brdf::Lambert { albedo: [0.0; 3] }, samples(&map)).unwrap();
        assert!(black.iter().all(|x| (x * x - 1.0 / 3.0).abs() < 1e-12), "{black:?}");
    }

    #[test]
    fn the_product_of_factors_is_the_sum_over_normals() {
        let (grid, sphere) = (Map::hemisphere(Projection::Paraboloid, 6), Map::sphere(Projection::Paraboloid, 8));
        let brdf = rough();
        let colour = principal_colour(&brdf, samples(&Map::hemisphere(Projection::Paraboloid, 4))).unwrap();
        let m = Tabulated { brdf: &brdf, colour, directions: &grid, normals: &sphere.directions, solid_angles: &sphere.solid_angles };
        // Some of the normals, seen by made-up amounts that vary smoothly with the pair, and a little at random.
        let columns: Vec<usize> = (0..sphere.directions.len()).step_by(3).collect();
        let seen = |k: usize, j: usize| {
            let [a, b] = directions_of(k).map(|d| grid.directions[d]);
            let n = sphere.directions[columns[j]];
            (1.0 + n.dot(a)) * (1.0 + n.dot(b)) + 1e-3 * gaussian(1, (k * 100 + j) as u64)
        };
        let width = columns.len();
        let write_n = |rows: Range<usize>, out: &mut [f64]| {
            for (k, row) in rows.zip(out.chunks_exact_mut(width)) {
                for (j, x) in row.iter_mut().enumerate() {
                    *x = seen(k, j) * m.row_weight(k) / sphere.solid_angles[columns[j]].sqrt();
                }
            }
        };
        let write_m = |rows: Range<usize>, out: &mut [f64]| m.write(rows, out);
        let matrices = [(width, &write_n as &(dyn Fn(Range<usize>, &mut [f64]) + Sync)), (sphere.directions.len(), &write_m)];
        let error = |energies: [f64; 2]| {
            let [n, m_factors] = [0, 1].map(|which| {
                let (columns, write) = matrices[which];
                let params = Params { projection: 200, iteration: Iteration::None, energy: energies[which], seed: 2 };
                factor(&Rows { rows: m.rows(), columns, write }, &params, &|| Ok(())).unwrap()
            });
            let product = Product::new(&n, &m_factors, &columns);
            let row = |factors, k| Row::mixture(factors, std::iter::once((k, 1.0, m.row_weight(k))));
            let (mut difference, mut energy) = (0.0, 0.0);
            for k in 0..m.rows() {
                let truth: f64 = (0..width).map(|j| seen(k, j) * m.element(directions_of(k), columns[j])).sum();
                difference += (product.at(&row(&n, k), &row(&m_factors, k)) - truth).powi(2);
                energy += truth * truth;
            }
            (f64::sqrt(difference / energy), n.rank(), m_factors.rank())
        };
        let (whole, _, _) = error([1.0, 1.0]);
        assert!(whole < 1e-9, "without a cut: {whole}");
        // The cuts of the paper (section 5).
        let (cut, n_rank, m_rank) = error([0.995, 0.98]);
        assert!(cut < 0.06 && n_rank < 12 && m_rank < 60, "with the paper's cuts: {cut}, ranks {n_rank} and {m_rank}");
    }

    #[test]
    fn a_mixture_of_rows_is_the_mixture_of_their_sums() {
        let write = |rows: Range<usize>, out: &mut [f64]| {
            for (x, k) in out.iter_mut().zip(rows.start * 5..) {
                *x = ((k * k) % 23) as f64;
            }
        };
        let params = Params { energy: 1.0, ..Params::default() };
        let f = factor(&Rows { rows: 30, columns: 5, write: &write }, &params, &|| Ok(())).unwrap();
        let product = Product::new(&f, &f, &[4, 3, 2, 1, 0]);
        let single = |k| Row::mixture(&f, std::iter::once((k, 1.0, 2.0)));
        let mixed = Row::mixture(&f, [(3, 0.25, 2.0), (row_of(2, 4), 0.75, 2.0)].into_iter());
        let expected = 0.25 * product.at(&single(3), &single(9)) + 0.75 * product.at(&single(row_of(2, 4)), &single(9));
        assert!((product.at(&mixed, &single(9)) - expected).abs() < 1e-9 * expected.abs().max(1.0));
        // And a row with itself reversed is what its elements say, each halved by the weight.
        let own: f64 = (0..5).map(|j| f.entry(3, j) * f.entry(3, 4 - j)).sum::<f64>() / 4.0;
        assert!((product.at(&single(3), &single(3)) - own).abs() < 1e-9 * own.abs());
    }
}
