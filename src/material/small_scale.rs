//! A small-scale surface ready to be filtered.

use super::surface::Surface;
use crate::geometry::Tile;

/// A small-scale surface ready to be filtered: geometry, and what covers each triangle.
#[derive(Clone, Debug)]
pub struct SmallScale {
    /// One period of the surface.
    pub tile: Tile,
    /// What covers it.
    pub surfaces: Vec<Surface>,
    /// For each triangle of the tile its place in `surfaces`.
    pub surface_of_triangle: Vec<u16>,
    /// Reflections after the first that its look includes, where [`Quality::bounces`](crate::Quality::bounces) does not say; 0 is direct light only.
    pub bounces: u32,
}

impl SmallScale {
    /// Whether light and viewer may trade places: all but RGL tables are reciprocal by construction.
    pub fn is_reciprocal(&self) -> bool {
        are_reciprocal(&self.surfaces)
    }
}

/// Whether light and viewer may trade places on all of these surfaces.
pub fn are_reciprocal(surfaces: &[Surface]) -> bool {
    surfaces.iter().all(|s| s.brdf.is_reciprocal())
}
