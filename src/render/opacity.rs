//! Opacity of a tile: the share of parallel rays that hit anything, back faces included.
//!
//! A surface with gaps is not opaque (`docs/formats.md`): what lies behind it shows through by the share of rays that hit nothing.
//! A line that hits does so from both ends, so the share of a direction and of its opposite are equal.

use crate::direction::above_horizon;
use crate::error::Result;
use crate::filter::Control;
use crate::geometry::Tile;
use crate::numerics::cast::narrow;
use crate::numerics::low_discrepancy::{fraction, sobol_2d};
use crate::table::{lattice_weights, nodes};
use crate::visibility::{PeriodicBvh, Traced};
use glam::DVec3;
use rayon::prelude::*;

/// Rings of directions at which the share is found.
const RINGS: usize = 12;
/// Rays a direction.
const RAYS: u32 = 2048;
/// Rings and rays of the first look, which decides whether there are gaps at all.
const FIRST: (usize, u32) = (4, 1024);

/// Least cosine at which rays are followed: below it a ray passes hundreds of periods, and its share is that found here.
const LEAST_COSINE: f64 = 0.03;

/// The share of rays that hit, by direction.
#[derive(Clone, Debug)]
pub enum Opacity {
    /// All rays hit.
    Opaque,
    /// By the nodes of a hemisphere grid of this many rings.
    Gaps(usize, Vec<f32>),
}

impl Opacity {
    /// Traces the rays. Gaps that fewer than one of 1,024 rays finds, from 61 directions, count as none.
    ///
    /// # Errors
    /// Those of the hierarchy, and `Interrupted`.
    pub fn of(tile: &Tile, control: &Control<'_>) -> Result<Self> {
        // A height field covers its plane.
        if tile.grid.is_some() {
            return Ok(Self::Opaque);
        }
        let rays = PeriodicBvh::new(tile)?;
        if shares(&rays, tile, FIRST, control)?.iter().all(|&s| s >= 1.0) {
            return Ok(Self::Opaque);
        }
        Ok(Self::Gaps(RINGS, shares(&rays, tile, (RINGS, RAYS), control)?))
    }

    /// The share for a line along the unit vector `w` in the tile's frame.
    pub fn along(&self, w: DVec3) -> f64 {
        let Self::Gaps(rings, shares) = self else { return 1.0 };
        let up = if w.z < 0.0 { -w } else { w };
        let Some(up) = above_horizon(up) else { return 1.0 };
        let (nodes, weights) = lattice_weights(*rings, up);
        (0..3).map(|c| weights[c] * f64::from(shares[nodes[c]])).sum::<f64>().clamp(0.0, 1.0)
    }

    /// Whether all rays hit.
    pub fn is_opaque(&self) -> bool {
        matches!(self, Self::Opaque)
    }
}

fn shares(bvh: &PeriodicBvh, tile: &Tile, (rings, rays): (usize, u32), control: &Control<'_>) -> Result<Vec<f32>> {
    let one = |&w: &DVec3| {
        if control.check().is_err() {
            return 0.0;
        }
        let flat = DVec3::new(w.x, w.y, 0.0).normalize_or_zero() * (1.0 - LEAST_COSINE * LEAST_COSINE).sqrt();
        let w = if w.z < LEAST_COSINE { flat.with_z(LEAST_COSINE) } else { w };
        let hits = (0..rays).filter(|&index| {
            let [x, y] = sobol_2d(index, 0).map(fraction);
            let origin = DVec3::new(x * tile.period.x, y * tile.period.y, bvh.highest());
            // A ray that found nothing in as many periods as rays are followed passes between what there is.
            matches!(bvh.trace(origin, -w, None), Traced::Hit(_))
        });
        narrow(hits.count() as f64 / f64::from(rays))
    };
    let shares: Vec<f32> = nodes(rings).par_iter().map(one).collect();
    control.check()?;
    Ok(shares)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use std::sync::atomic::AtomicBool;

    /// A square of half the period's side, flat at height 0: a quarter is covered, from all directions.
    fn quarter() -> Tile {
        Tile {
            vertices: vec![DVec3::ZERO, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.0, 0.5, 0.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            part_of_triangle: vec![0, 0],
            parts: vec!["all".to_owned()],
            uv: None,
            period: DVec2::ONE,
            grid: None,
            notes: Vec::new(),
        }
    }

    fn coverage(tile: &Tile) -> Opacity {
        let cancel = AtomicBool::new(false);
        Opacity::of(tile, &Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 }).unwrap()
    }

    #[test]
    fn a_flat_square_covers_its_share_from_above_and_from_below() {
        let coverage = coverage(&quarter());
        for w in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, -0.6, -0.8), DVec3::new(0.99, 0.0, 0.141_067)] {
            let share = coverage.along(w);
            assert!((share - 0.25).abs() < 0.005, "{share} at {w}");
        }
    }

    #[test]
    fn a_whole_square_is_opaque() {
        let mut tile = quarter();
        for v in &mut tile.vertices {
            *v *= 2.0;
        }
        assert!(coverage(&tile).is_opaque());
    }
}
