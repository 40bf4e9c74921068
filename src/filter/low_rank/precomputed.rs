//! A compressed `M`: what Wu et al. (2011, sections 3.5 and 5) compute once a BRDF and keep.
//!
//! `M ≈ 1 meanᵀ + U Vᵀ`; `U`, by far the largest, in single precision as in the paper, so that a stored one has the same bits.

use super::map::{Map, Projection};
use super::materials::{Basis, Tabulated, principal_colour};
use super::normals::PairRows;
use super::rates::{self, Rates};
use crate::brdf::{Brdf, Colour};
use crate::error::Result;
use crate::filter::control::RisingShare;
use crate::filter::plan::MapSides;
use crate::numerics::cast::narrow;
use crate::numerics::randomized_svd::{self, Iteration, Params, Rows};
use crate::numerics::stable_bytes::StableBytes;
use faer::Mat;
use glam::DVec3;
use std::cell::Cell;

/// Random vectors for `M` at first; more where the energy asks for it.
const PROJECTION: usize = 128;
/// Most random vectors.
const MAX_PROJECTION: usize = 512;
/// Most bytes of the projected matrix.
const MAX_PROJECTED: usize = 2 << 30;
/// Side of the map whose directions tell a BRDF's colour.
const COLOUR_SIDE: usize = 6;

/// What a compressed `M` depends on beside its BRDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Map of directions and normals.
    pub projection: Projection,
    /// Side of the smallest map of directions: that of visibility. A coarser one would lose what `N` knows.
    pub least_directions: usize,
    /// Sides of the largest maps.
    pub largest: MapSides,
    /// Share of the power to keep.
    pub energy: f64,
    /// Seed of the random vectors: always the same in the paper.
    pub seed: u64,
}

impl Settings {
    /// All of them, for a hash that is kept in files.
    pub(super) fn write(&self, out: &mut StableBytes<'_>) {
        let Self { projection, least_directions, largest, energy, seed } = self;
        out.tag(match projection {
            Projection::Paraboloid => 1,
            Projection::EqualArea => 2,
        });
        [*least_directions, largest.directions, largest.normals].into_iter().for_each(|n| out.whole(n as u64));
        out.reals(&[*energy]);
        out.whole(*seed);
    }
}

/// A compressed `M` of one BRDF.
#[derive(Clone, Debug)]
pub struct Precomputed {
    /// Rows are pairs of these directions.
    pub directions: Map,
    /// Columns are these normals.
    pub normals: Map,
    /// How rows are counted.
    pub pairs: PairRows,
    /// How the maps were chosen.
    pub rates: Rates,
    /// Colour direction that values are along.
    pub colour: Colour,
    /// Share of the power that is kept.
    pub energy: f64,
    /// Mean row, scaled.
    pub(super) mean: Vec<f64>,
    /// `V`: orthonormal columns.
    pub(super) right: Mat<f64>,
    /// `U`, row by row.
    pub(super) left: Vec<f32>,
}

/// Work of the first factors, as a part of that of those which are expected to be needed. Chosen, not measured.
const VECTORS_DOUBLED: f64 = 2.0;

impl Precomputed {
    /// Computes it. `check` is told the share that is done, and stops the work with its error.
    ///
    /// # Errors
    /// What `check` returns; [`crate::Error::Numeric`] for a BRDF that is not finite.
    pub fn compute(brdf: &Brdf, settings: &Settings, check: &dyn Fn(f64) -> Result<()>) -> Result<Self> {
        check(0.0)?;
        let around = Map::hemisphere(settings.projection, COLOUR_SIDE).directions;
        let triples = around.iter().flat_map(|&n| {
            around.iter().flat_map({
                let around = &around;
                move |&i| around.iter().map(move |&o| [n, i, o])
            })
        });
        let colour = principal_colour(brdf, triples)?;
        let rates = rates::find(brdf, &colour, settings.projection, settings.least_directions, settings.largest);
        let (directions, normals, pairs) = maps(settings.projection, rates.sides, brdf.is_reciprocal());
        let table = Tabulated::new(brdf, colour, &directions, pairs, &normals);
        let matrix = Rows { rows: pairs.rows(), columns: normals.directions.len(), write: &|rows, out| table.write(rows, out) };
        let most = (MAX_PROJECTED / 8 / matrix.rows).clamp(PROJECTION, MAX_PROJECTION);
        let mut projection = PROJECTION;
        let mut done = RisingShare::default();
        let factors = loop {
            let params = Params { projection, iteration: Iteration::None, energy: settings.energy, seed: settings.seed };
            let (calls, all) = (Cell::new(0_u32), randomized_svd::checks(&matrix, &params) as f64);
            // Twice as many vectors may be wanted, and again.
            let (from, to) = done.step(1.0, VECTORS_DOUBLED, false);
            let factors = randomized_svd::factor(&matrix, &params, &|| {
                calls.set(calls.get() + 1);
                check(from + (to - from) * (f64::from(calls.get()) / all).min(1.0))
            })?;
            if factors.energy >= settings.energy || projection >= most.min(matrix.columns) {
                break factors;
            }
            projection = (2 * projection).min(most);
        };
        let left = (0..factors.left.nrows()).flat_map(|k| factors.left.row(k).iter().map(|&x| narrow(x)).collect::<Vec<f32>>()).collect();
        Ok(Self { directions, normals, pairs, rates, colour, energy: factors.energy, mean: factors.mean, right: factors.right, left })
    }

    /// Vectors that are kept.
    pub fn rank(&self) -> usize {
        self.right.ncols()
    }

    /// Bytes of the whole `M` in double precision.
    pub fn whole_bytes(&self) -> usize {
        8 * self.pairs.rows() * self.normals.directions.len()
    }

    /// Bytes of what is kept.
    pub fn bytes(&self) -> usize {
        4 * self.left.len() + 8 * (self.mean.len() + self.right.nrows() * self.right.ncols())
    }

    /// What rows are made of.
    pub(super) fn basis(&self) -> Basis<'_> {
        Basis { mean: &self.mean, right: self.right.as_ref() }
    }

    /// Coefficients of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = f64> + '_ {
        self.left[row * self.rank()..(row + 1) * self.rank()].iter().map(|&x| f64::from(x))
    }

    /// Factor that a row was scaled by.
    pub(super) fn row_weight(&self, row: usize) -> f64 {
        let [a, b] = self.pairs.directions_of(row);
        (self.directions.solid_angles[a] * self.directions.solid_angles[b]).sqrt()
    }

    /// Factor that a column was scaled by.
    pub(super) fn column_weight(&self, column: usize) -> f64 {
        self.normals.solid_angles[column].sqrt()
    }

    /// `f(n, wi, wo)` of eq. 4 as the compressed matrix has it, along the colour direction, at cells of the maps.
    pub fn element(&self, [i, o]: [usize; 2], normal: usize) -> f64 {
        let row = self.pairs.row_of(i, o);
        let scaled = self.row(row).enumerate().fold(self.mean[normal], |sum, (k, x)| sum + x * self.right[(normal, k)]);
        scaled / (self.row_weight(row) * self.column_weight(normal))
    }

    /// The direction of a normal's cell.
    pub fn normal(&self, cell: usize) -> DVec3 {
        self.normals.directions[cell]
    }
}

/// The maps of some sides, and how pairs are counted.
pub(super) fn maps(projection: Projection, sides: MapSides, reciprocal: bool) -> (Map, Map, PairRows) {
    let directions = Map::hemisphere(projection, sides.directions);
    let pairs = PairRows { count: directions.directions.len(), reciprocal };
    (directions, Map::sphere(projection, sides.normals), pairs)
}

#[cfg(test)]
mod tests {
    use super::super::materials::along_colour;
    use super::*;

    #[test]
    fn elements_of_a_compressed_matrix_are_the_brdf_within_the_cut() {
        let brdf = Brdf::Ward { diffuse: [0.2, 0.1, 0.05], specular: [0.3; 3], alpha: 0.5 };
        let largest = MapSides { directions: 12, normals: 16 };
        let settings = Settings { projection: Projection::Paraboloid, least_directions: 8, largest, energy: 0.98, seed: 1 };
        let m = Precomputed::compute(&brdf, &settings, &|_| Ok(())).unwrap();
        assert!(
            m.rank() < 60 && m.energy >= 0.98 && m.bytes() < m.whole_bytes() / 5,
            "rank {}, {} of {}",
            m.rank(),
            m.bytes(),
            m.whole_bytes()
        );
        let (mut difference, mut power) = (0.0, 0.0);
        for row in (0..m.pairs.rows()).step_by(7) {
            let [a, b] = m.pairs.directions_of(row);
            for cell in 0..m.normals.directions.len() {
                let weight = (m.row_weight(row) * m.column_weight(cell)).powi(2);
                let truth = along_colour(&brdf, &m.colour, m.normal(cell), m.directions.directions[a], m.directions.directions[b]);
                difference += weight * (m.element([a, b], cell) - truth).powi(2);
                power += weight * truth * truth;
            }
        }
        // 2 % of the power of what is left when the mean is taken off, and every seventh row only.
        assert!(difference / power < 0.025, "{}", difference / power);
    }
}
