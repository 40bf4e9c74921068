//! Putting a tile together triangle by triangle.

use super::tile::Tile;
use crate::error::{BadInput, Result};
use glam::{DVec2, DVec3};

/// Most triangles of a tile that a kind may be asked for: about 1 GB of mesh and acceleration structure.
pub const MAX_TRIANGLES: usize = 8_000_000;

/// A tile in the making, with its kind's parts.
#[derive(Debug)]
pub(super) struct TileBuilder {
    tile: Tile,
}

impl TileBuilder {
    pub(super) fn new(period: DVec2, parts: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let parts = parts.into_iter().map(Into::into).collect();
        let (vertices, triangles, part_of_triangle, notes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { tile: Tile { vertices, triangles, part_of_triangle, parts, uv: None, period, grid: None, notes } }
    }

    /// Refuses a recipe with too many triangles; kinds ask before they build.
    pub(super) fn check_size(triangles: f64, remedy: &str) -> Result<()> {
        if triangles > MAX_TRIANGLES as f64 {
            let problem = format!("this geometry has {triangles:.0} triangles, more than the {MAX_TRIANGLES} that are allowed");
            return Err(BadInput::new(problem, remedy).at_field("geometry").into());
        }
        Ok(())
    }

    pub(super) fn vertex(&mut self, position: DVec3) -> u32 {
        let index = u32::try_from(self.tile.vertices.len()).expect("check_size keeps the number of vertices below 2^32");
        self.tile.vertices.push(position);
        index
    }

    pub(super) fn triangle(&mut self, part: u16, corners: [u32; 3]) {
        self.tile.triangles.push(corners);
        self.tile.part_of_triangle.push(part);
    }

    /// Two triangles, cut from the first to the third corner.
    pub(super) fn quad(&mut self, part: u16, [a, b, c, d]: [u32; 4]) {
        self.triangle(part, [a, b, c]);
        self.triangle(part, [a, c, d]);
    }

    /// A triangle by its corners' positions.
    pub(super) fn triangle_at(&mut self, part: u16, corners: [DVec3; 3]) {
        let corners = corners.map(|p| self.vertex(p));
        self.triangle(part, corners);
    }

    pub(super) fn note(&mut self, note: impl Into<String>) {
        self.tile.notes.push(note.into());
    }

    pub(super) fn finish(self) -> Result<Tile> {
        self.tile.clean().map_err(|bad| bad.at_field("geometry").into())
    }
}
