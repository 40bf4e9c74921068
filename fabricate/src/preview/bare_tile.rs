//! A tile to be filled.

use biscale::geometry::Tile;
use glam::DVec2;

/// A tile of these parts and this period, without a surface.
pub(super) fn bare_tile(parts: Vec<String>, period: DVec2) -> Tile {
    Tile {
        vertices: Vec::new(),
        triangles: Vec::new(),
        part_of_triangle: Vec::new(),
        parts,
        uv: None,
        period,
        grid: None,
        notes: Vec::new(),
    }
}
