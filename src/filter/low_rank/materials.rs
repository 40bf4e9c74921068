//! The matrix `M`: the cosine-weighted BRDF turned to each normal, and its product with `N` by the factors of both (Wu et al. 2011,
//! sections 3.5 to 3.7).
//!
//! `M[k][j] = f(n_j, wi_k, wo_k)`, `f = fr (n·wi)+ (n·wo)+` (eq. 4), in 1/sr. Its size forbids to hold it: it is written row by row. What is
//! factored is scaled so that squares count as integrals over the sphere and the two hemispheres: each element by
//! `sqrt(dw_j) sqrt(dwi_k dwo_k)` with the solid angles of the map's cells, those of `N` by `1/sqrt(dw_j)` (its elements are integrals
//! over a cell already), which cancels in the product.

use super::map::Map;
use super::normals::PairRows;
use crate::brdf::{Brdf, Colour};
use crate::error::{Error, Result};
use crate::filter::lobes::{Half, Lobe, cosines, lobes};
use crate::numerics::cast::narrow;
use crate::numerics::randomized_svd::Factors;
use crate::simd::{self, Kernel, LANES, Lanes};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
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

/// `f(n, wi, wo)` of eq. 4 along a colour direction.
pub fn along_colour(brdf: &Brdf, colour: &Colour, n: DVec3, wi: DVec3, wo: DVec3) -> f64 {
    let (ci, co) = (n.dot(wi), n.dot(wo));
    if ci <= 0.0 || co <= 0.0 {
        return 0.0;
    }
    let value = brdf.eval(n, wi, wo);
    (0..3).map(|c| colour[c] * value[c]).sum::<f64>() * ci * co
}

/// What `M` tabulates: one BRDF along one colour direction.
#[derive(Clone, Debug)]
pub struct Tabulated<'a> {
    /// Directions to the light and to the viewer: rows are the pairs of its cells.
    directions: &'a Map,
    /// How they are counted.
    pairs: PairRows,
    lobes: Vec<Lobe<'a>>,
    colour: Colour,
    columns: Vec<Columns>,
    /// Columns in all.
    width: usize,
}

/// Normals of columns that are worked out at once, and the factors of the columns.
#[derive(Clone, Debug)]
struct Columns {
    normals: [Lanes; 3],
    weights: [f64; LANES],
}

impl<'a> Tabulated<'a> {
    /// Of `brdf` along `colour`, for pairs of `directions` and `normals`.
    pub fn new(brdf: &'a Brdf, colour: Colour, directions: &'a Map, pairs: PairRows, normals: &Map) -> Self {
        let columns = |(normals, angles): (&[DVec3], &[f64])| {
            let mut columns = Columns { normals: [[0.0; LANES]; 3], weights: [0.0; LANES] };
            for (l, (n, angle)) in normals.iter().zip(angles).enumerate() {
                for c in 0..3 {
                    columns.normals[c][l] = narrow(n[c]);
                }
                columns.weights[l] = angle.sqrt();
            }
            columns
        };
        let columns = normals.directions.chunks(LANES).zip(normals.solid_angles.chunks(LANES)).map(columns).collect();
        Self { directions, pairs, lobes: lobes(brdf, [1.0; 3]), colour, columns, width: normals.directions.len() }
    }

    /// Factor that scales a row.
    pub fn row_weight(&self, row: usize) -> f64 {
        let [a, b] = self.pairs.directions_of(row);
        (self.directions.solid_angles[a] * self.directions.solid_angles[b]).sqrt()
    }

    /// Writes scaled rows: what [`crate::numerics::randomized_svd::factor`] takes.
    pub fn write(&self, rows: Range<usize>, out: &mut [f64]) {
        simd::run(Write { table: self, rows, out });
    }
}

/// Writes rows.
struct Write<'a> {
    table: &'a Tabulated<'a>,
    rows: Range<usize>,
    out: &'a mut [f64],
}

impl Kernel for Write<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { table, rows, out } = self;
        for (k, row) in rows.zip(out.chunks_exact_mut(table.width.max(1))) {
            let [wi, wo] = table.pairs.directions_of(k).map(|d| table.directions.directions[d]);
            let (half, i_dot_h, weight) = (Half::new(wi, wo), 0.5 * (wi + wo).length(), table.row_weight(k));
            for (columns, out) in table.columns.iter().zip(row.chunks_mut(LANES)) {
                let (mut cos_i, mut cos_o) = (cosines(&columns.normals, wi.as_vec3()), cosines(&columns.normals, wo.as_vec3()));
                let mut any = false;
                for l in 0..LANES {
                    (cos_i[l], cos_o[l]) = (cos_i[l].clamp(0.0, 1.0), cos_o[l].clamp(0.0, 1.0));
                    any |= cos_i[l] > 0.0 && cos_o[l] > 0.0;
                }
                let mut sum = [0.0; LANES];
                if any {
                    for lobe in &table.lobes {
                        if lobe.table.is_some() {
                            let values = lobe.table_values(&columns.normals, wi, wo);
                            for c in 0..3 {
                                let along = narrow(table.colour[c]);
                                for l in 0..LANES {
                                    sum[l] += along * values[c][l];
                                }
                            }
                        } else {
                            let colour = lobe.colour_at(i_dot_h);
                            let along = narrow((0..3).map(|c| table.colour[c] * colour[c]).sum());
                            let values = lobe.at_normals(&columns.normals, [&cos_i, &cos_o], [wi, wo], &half);
                            for l in 0..LANES {
                                sum[l] += along * values[l];
                            }
                        }
                    }
                }
                for (l, x) in out.iter_mut().enumerate() {
                    *x = f64::from(sum[l]) * weight * columns.weights[l];
                }
            }
        }
    }
}

/// The coefficients of a row of a factored matrix with its scale taken off, or of a mixture of rows: the row is
/// `scale · mean + right · coefficients`.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    scale: f64,
    coefficients: Vec<f64>,
}

impl Row {
    /// The sum of rows `(coefficients, share, weight)`, each times its share and over the weight that it was scaled by. One row with share 1
    /// is itself; the cells around a direction with their shares interpolate.
    pub fn mixture<I: Iterator<Item = f64>>(rank: usize, rows: impl Iterator<Item = (I, f64, f64)>) -> Self {
        let mut sum = Self { scale: 0.0, coefficients: vec![0.0; rank] };
        for (row, share, weight) in rows {
            let factor = share / weight;
            sum.scale += factor;
            for (c, x) in sum.coefficients.iter_mut().zip(row) {
                *c += factor * x;
            }
        }
        sum
    }
}

/// What the rows of a factored matrix are made of.
#[derive(Clone, Copy, Debug)]
pub struct Basis<'a> {
    /// Mean of the rows.
    pub mean: &'a [f64],
    /// Orthonormal columns.
    pub right: MatRef<'a, f64>,
}

impl<'a> From<&'a Factors> for Basis<'a> {
    fn from(factors: &'a Factors) -> Self {
        Self { mean: &factors.mean, right: factors.right.as_ref() }
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
    /// The sum goes over `columns`: each a column of `N` with its column of `M`.
    ///
    /// # Panics
    /// If one is no column of its matrix.
    pub fn new(n: Basis<'_>, m: Basis<'_>, columns: &[[usize; 2]]) -> Self {
        let (rank_n, rank_m) = (n.right.ncols(), m.right.ncols());
        let sum = |f: &dyn Fn(usize, usize) -> f64| columns.iter().map(|&[j, c]| f(j, c)).sum::<f64>();
        let some =
            |basis: Basis<'_>, which: usize| Mat::from_fn(columns.len(), basis.right.ncols(), |x, k| basis.right[(columns[x][which], k)]);
        let mut both = Mat::zeros(rank_n, rank_m);
        matmul(both.as_mut(), Accum::Replace, some(n, 0).transpose(), some(m, 1).as_ref(), 1.0, Par::Seq);
        Self {
            means: sum(&|j, c| n.mean[j] * m.mean[c]),
            of_n: (0..rank_n).map(|k| sum(&|j, c| n.right[(j, k)] * m.mean[c])).collect(),
            of_m: (0..rank_m).map(|k| sum(&|j, c| n.mean[j] * m.right[(c, k)])).collect(),
            both,
        }
    }

    /// The sum for a row of `N` and one of `M`.
    pub fn at(&self, n: &Row, m: &Row) -> f64 {
        let mut sum = self.means * n.scale * m.scale;
        for (b, y) in m.coefficients.iter().enumerate() {
            let mixed: f64 = n.coefficients.iter().zip(self.both.col(b).iter()).map(|(x, with)| x * with).sum();
            sum += (mixed + n.scale * self.of_m[b]) * y;
        }
        sum + m.scale * n.coefficients.iter().zip(&self.of_n).map(|(x, with)| x * with).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::super::map::Projection;
    use super::*;
    use crate::brdf::Distribution;
    use crate::numerics::low_discrepancy::gaussian;
    use crate::numerics::randomized_svd::{Iteration, Params, Rows, factor};

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
        let pairs = PairRows { count: grid.directions.len(), reciprocal: true };
        let m = Tabulated::new(&brdf, colour, &grid, pairs, &sphere);
        // Some of the normals, seen by made-up amounts that vary smoothly with the pair, and a little at random.
        let columns: Vec<usize> = (0..sphere.directions.len()).step_by(3).collect();
        let seen = |k: usize, j: usize| {
            let [a, b] = pairs.directions_of(k).map(|d| grid.directions[d]);
            let n = sphere.directions[columns[j]];
            (1.0 + n.dot(a)) * (1.0 + n.dot(b)) + 1e-3 * gaussian(1, (k * 100 + j) as u64)
        };
        // M as it is written, its scale taken off: single precision of the BRDF itself.
        let all = sphere.directions.len();
        let mut written = vec![0.0; pairs.rows() * all];
        m.write(0..pairs.rows(), &mut written);
        let element = |k: usize, column: usize| written[k * all + column] / (m.row_weight(k) * sphere.solid_angles[column].sqrt());
        for k in 0..pairs.rows() {
            let [i, o] = pairs.directions_of(k).map(|d| grid.directions[d]);
            for (column, &n) in sphere.directions.iter().enumerate() {
                let truth = along_colour(&brdf, &colour, n, i, o);
                assert!((element(k, column) - truth).abs() <= 2e-6 * (truth.abs() + 0.01), "{} for {truth}", element(k, column));
            }
        }
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
                factor(&Rows { rows: pairs.rows(), columns, write }, &params, &|| Ok(())).unwrap()
            });
            let both: Vec<[usize; 2]> = columns.iter().copied().enumerate().map(|(j, c)| [j, c]).collect();
            let product = Product::new((&n).into(), (&m_factors).into(), &both);
            let row = |f: &Factors, k| Row::mixture(f.rank(), std::iter::once((f.left.row(k).iter().copied(), 1.0, m.row_weight(k))));
            let (mut difference, mut energy) = (0.0, 0.0);
            for k in 0..pairs.rows() {
                let truth: f64 = (0..width).map(|j| seen(k, j) * element(k, columns[j])).sum();
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
        let product = Product::new((&f).into(), (&f).into(), &[[0, 4], [1, 3], [2, 2], [3, 1], [4, 0]]);
        let row = |k: usize| f.left.row(k).iter().copied();
        let single = |k| Row::mixture(f.rank(), std::iter::once((row(k), 1.0, 2.0)));
        let mixed = Row::mixture(f.rank(), [(row(3), 0.25, 2.0), (row(12), 0.75, 2.0)].into_iter());
        let expected = 0.25 * product.at(&single(3), &single(9)) + 0.75 * product.at(&single(12), &single(9));
        assert!((product.at(&mixed, &single(9)) - expected).abs() < 1e-9 * expected.abs().max(1.0));
        // And a row with itself reversed is what its elements say, each halved by the weight.
        let own: f64 = (0..5).map(|j| f.entry(3, j) * f.entry(3, 4 - j)).sum::<f64>() / 4.0;
        assert!((product.at(&single(3), &single(3)) - own).abs() < 1e-9 * own.abs());
    }
}
