//! Maps of the hemisphere or the sphere onto square images, whose pixels with their centre inside the unit disc are the cells (Wu et al.
//! 2011, section 3.7).
//!
//! A direction of the upper hemisphere goes to `(x, y)` in the unit disc, one of the lower to the same place of a second image.

use crate::numerics::cast::truncate_usize;
use glam::{DVec2, DVec3};

/// How a hemisphere becomes a disc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// `(wx, wy) / (1 + wz)` (Brabec et al. 2002): the paper's. A cell's solid angle falls by 4 from the zenith to the horizon.
    Paraboloid,
    /// `(wx, wy) / sqrt(1 + wz)` (Lambert's azimuthal map): all cells have the same solid angle.
    EqualArea,
}

impl Projection {
    /// Place in the disc of a unit direction with z at least 0.
    fn project(self, w: DVec3) -> DVec2 {
        let down = 1.0 + w.z.max(0.0);
        w.truncate() / if self == Self::Paraboloid { down } else { down.sqrt() }
    }

    /// Direction of a place in the disc.
    fn direction(self, p: DVec2) -> DVec3 {
        let square = p.length_squared();
        match self {
            Self::Paraboloid => (2.0 * p).extend(1.0 - square) / (1.0 + square),
            Self::EqualArea => (p * (2.0 - square).sqrt()).extend(1.0 - square),
        }
    }

    /// Solid angle over area at a place of the disc, sr.
    fn density(self, p: DVec2) -> f64 {
        match self {
            Self::Paraboloid => 4.0 / (1.0 + p.length_squared()).powi(2),
            Self::EqualArea => 2.0,
        }
    }
}

/// Cells of a hemisphere or the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    projection: Projection,
    side: usize,
    /// Direction of the centre of each cell: those of the upper hemisphere, then those of the lower, if it has them.
    pub directions: Vec<DVec3>,
    /// Solid angle of each cell, sr.
    pub solid_angles: Vec<f64>,
    /// For each pixel its cell of the upper hemisphere.
    cell: Vec<Option<u32>>,
}

impl Map {
    /// Cells of the upper hemisphere, of images of `side` by `side` pixels: 12 gives 112 cells, among the paper's 88 to 132.
    ///
    /// # Panics
    /// If `side` is not in 1..=4096.
    pub fn hemisphere(projection: Projection, side: usize) -> Self {
        assert!((1..=4096).contains(&side), "a map of {side} pixels a side");
        let mut map = Self { projection, side, directions: Vec::new(), solid_angles: Vec::new(), cell: vec![None; side * side] };
        for k in 0..side * side {
            let pixel = DVec2::new((k % side) as f64, (k / side) as f64);
            let p = (pixel + 0.5) * (2.0 / side as f64) - 1.0;
            if p.length_squared() < 1.0 {
                map.cell[k] = u32::try_from(map.directions.len()).ok();
                map.directions.push(projection.direction(p));
                map.solid_angles.push(projection.density(p) * (2.0 / side as f64).powi(2));
            }
        }
        map
    }

    /// Cells of the sphere: twice as many.
    ///
    /// # Panics
    /// As [`Map::hemisphere`].
    pub fn sphere(projection: Projection, side: usize) -> Self {
        let mut map = Self::hemisphere(projection, side);
        let lower: Vec<DVec3> = map.directions.iter().map(|w| w.with_z(-w.z)).collect();
        map.directions.extend(lower);
        map.solid_angles.extend_from_within(..);
        map
    }

    /// The cells around a direction of the upper hemisphere and their weights, which sum to 1: linear interpolation between the pixels'
    /// centres, without those that are no cells.
    pub fn around(&self, w: DVec3) -> Vec<(usize, f64)> {
        let at = (self.projection.project(w) + 1.0) * (0.5 * self.side as f64) - 0.5;
        let low = at.floor();
        let share = at - low;
        let mut found: Vec<(usize, f64)> = Vec::with_capacity(4);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let pixel = low + DVec2::new(dx, dy);
            let weight = (1.0 - (share.x - dx).abs()) * (1.0 - (share.y - dy).abs());
            if weight > 0.0
                && let Some(cell) = self.cell_at(pixel)
            {
                found.push((cell, weight));
            }
        }
        let total: f64 = found.iter().map(|f| f.1).sum();
        // At the rim all four may be empty, or have next to no weight.
        const LEAST: f64 = 1e-9;
        if total < LEAST {
            return vec![(self.nearest(w), 1.0)];
        }
        for (_, weight) in &mut found {
            *weight /= total;
        }
        found
    }

    /// The cell of a pixel, if it is one.
    fn cell_at(&self, pixel: DVec2) -> Option<usize> {
        let last = (self.side - 1) as f64;
        let inside = |x: f64| (0.0..=last).contains(&x);
        let place = (inside(pixel.x) && inside(pixel.y)).then(|| truncate_usize(pixel.y) * self.side + truncate_usize(pixel.x))?;
        self.cell[place].map(|c| c as usize)
    }

    /// The cell whose direction is nearest to `n` (the first of several), among those a few pixels around its place.
    ///
    /// The maps stretch lengths by at most 2 against each other, so the nearest centre lies within this window, or, at the rim, where pixels
    /// may be empty, within that of the other hemisphere.
    pub fn nearest(&self, n: DVec3) -> usize {
        /// Pixels to each side.
        const WINDOW: i32 = 3;
        let upper = self.directions.len() - if self.is_sphere() { self.directions.len() / 2 } else { 0 };
        let flat = if self.is_sphere() { n.with_z(n.z.abs()) } else { n.with_z(n.z.max(0.0)) };
        let middle = ((self.projection.project(flat) + 1.0) * (0.5 * self.side as f64) - 0.5).round();
        let mut best = (0, f64::NEG_INFINITY);
        for below in [false, true].into_iter().take(if self.is_sphere() { 2 } else { 1 }) {
            for dy in -WINDOW..=WINDOW {
                for dx in -WINDOW..=WINDOW {
                    let Some(cell) = self.cell_at(middle + DVec2::new(f64::from(dx), f64::from(dy))) else { continue };
                    let cell = cell + if below { upper } else { 0 };
                    let cosine = n.dot(self.directions[cell]);
                    if cosine > best.1 {
                        best = (cell, cosine);
                    }
                }
            }
        }
        best.0
    }

    /// Whether the lower hemisphere has cells too.
    fn is_sphere(&self) -> bool {
        self.directions.last().is_some_and(|w| w.z < 0.0)
    }

    /// Pixels of a side of the image.
    pub fn side(&self) -> usize {
        self.side
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::low_discrepancy::{fraction, sobol_2d};
    use std::f64::consts::{PI, TAU};

    const BOTH: [Projection; 2] = [Projection::Paraboloid, Projection::EqualArea];

    #[test]
    fn a_side_of_12_gives_the_112_directions_of_the_paper_and_the_sphere_twice_as_many() {
        for projection in BOTH {
            assert_eq!(Map::hemisphere(projection, 12).directions.len(), 112);
            assert_eq!(Map::sphere(projection, 12).directions.len(), 224);
        }
    }

    #[test]
    fn solid_angles_sum_to_the_hemisphere_and_directions_are_unit_and_above_the_horizon() {
        for projection in BOTH {
            let map = Map::hemisphere(projection, 100);
            let sum: f64 = map.solid_angles.iter().sum();
            assert!((sum / (2.0 * PI) - 1.0).abs() < 2e-3, "{projection:?}: {sum}");
            assert!(map.directions.iter().all(|w| w.z > 0.0 && (w.length() - 1.0).abs() < 1e-12));
            // First moment: ∫ wz dw = pi.
            let moment: f64 = map.directions.iter().zip(&map.solid_angles).map(|(w, s)| w.z * s).sum();
            assert!((moment / PI - 1.0).abs() < 1e-3, "{projection:?}: {moment}");
        }
    }

    #[test]
    fn interpolation_is_exact_at_centres_linear_between_them_and_defined_to_the_horizon() {
        for projection in BOTH {
            let map = Map::hemisphere(projection, 12);
            for (cell, w) in map.directions.iter().enumerate() {
                let around = map.around(*w);
                let own: f64 = around.iter().filter(|a| a.0 == cell).map(|a| a.1).sum();
                assert!((own - 1.0).abs() < 1e-9, "{projection:?}, cell {cell}: {around:?}");
            }
            for k in 0..720 {
                let azimuth = f64::from(k) * 0.0123;
                for height in [0.0, 1e-4, 0.01, 0.1, 0.5, 0.999, 1.0] {
                    let across = f64::sqrt(1.0 - height * height);
                    let w = DVec3::new(across * azimuth.cos(), across * azimuth.sin(), height);
                    let around = map.around(w);
                    let total: f64 = around.iter().map(|a| a.1).sum();
                    assert!((total - 1.0).abs() < 1e-12 && around.iter().all(|a| a.1 > 0.0), "{w}: {around:?}");
                    if height > 0.3 {
                        let p: DVec2 = around.iter().map(|&(c, share)| projection.project(map.directions[c]) * share).sum();
                        assert!((p - projection.project(w)).length() < 1e-9, "{w}: not linear");
                    }
                }
            }
        }
    }

    #[test]
    fn the_nearest_cell_of_a_downward_normal_is_below() {
        let map = Map::sphere(Projection::Paraboloid, 8);
        let n = DVec3::new(0.3, -0.2, -0.8).normalize();
        let found = map.directions[map.nearest(n)];
        assert!(found.z < 0.0 && found.dot(n) > 0.95, "{found}");
        assert_eq!(map.nearest(map.directions[17]), 17);
    }

    #[test]
    fn the_nearest_cell_is_the_one_that_looking_at_all_finds() {
        for projection in BOTH {
            for side in [1, 2, 3, 5, 12, 13, 31, 64] {
                for map in [Map::hemisphere(projection, side), Map::sphere(projection, side)] {
                    for k in 0..2000_u32 {
                        let [x, y] = sobol_2d(k, 7).map(fraction);
                        // Every tenth at the horizon, where pixels are empty.
                        let z = if k % 10 == 0 { 0.02 * (2.0 * x - 1.0) } else { 2.0 * x - 1.0 };
                        let n = DVec3::new((TAU * y).cos(), (TAU * y).sin(), 0.0) * f64::sqrt(1.0 - z * z) + DVec3::Z * z;
                        let n = if map.is_sphere() { n } else { n.with_z(z.abs()) };
                        let best = map.directions.iter().map(|w| w.dot(n)).fold(f64::NEG_INFINITY, f64::max);
                        let found = map.directions[map.nearest(n)].dot(n);
                        assert!(found >= best - 1e-12, "{projection:?}, side {side}, {n}: {found} for {best}");
                    }
                }
            }
        }
    }
}
