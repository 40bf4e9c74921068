//! What a reader of mesh files finds: triangles as they stand there, before they are a tile.

use super::super::builder::MAX_TRIANGLES;
use super::super::tile::Tile;
use super::diagonals;
use super::polygon::{self, Triangles};
use crate::error::BadInput;
use glam::{DVec2, DVec3};

/// Name of the part where a file names none.
pub(super) const NAMELESS: &str = "default";

/// What a reader found, in the file's own lengths.
#[derive(Debug, Default)]
pub(super) struct Soup {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub part_of_triangle: Vec<u16>,
    pub parts: Vec<String>,
    /// One entry a triangle, NaN where the file gives none.
    pub uv: Vec<[DVec2; 3]>,
    /// Linear colours, one for each vertex that came with one.
    pub colours: Vec<DVec3>,
    pub normals_ignored: bool,
    /// First of the two triangles of each face of four corners that became a fan.
    pub quads: Vec<usize>,
    /// Polygons that cross themselves.
    pub crossed: usize,
    /// Material libraries, as the file names them.
    pub libraries: Vec<String>,
    /// Images that the file names for its surface.
    pub textures: Vec<String>,
    pub notes: Vec<String>,
}

impl Soup {
    /// Place of a part's name, added if it is new.
    pub fn part(&mut self, name: &str) -> Result<u16, BadInput> {
        let place = self.parts.iter().position(|p| p == name).unwrap_or_else(|| {
            self.parts.push(name.to_owned());
            self.parts.len() - 1
        });
        u16::try_from(place).map_err(|_| BadInput::new("the file has more than 65,536 parts", "use fewer materials or groups"))
    }

    /// Adds a polygon of 3 or more existing vertices, cut into triangles.
    pub fn polygon(&mut self, part: u16, corners: &[u32], uv: Option<&[DVec2]>) -> Result<(), BadInput> {
        let points: Vec<DVec3> = corners.iter().map(|&c| self.vertices[c as usize]).collect();
        let Triangles { triangles, crossed } = polygon::triangulate(&points)?;
        self.crossed += usize::from(crossed);
        if corners.len() == 4 && !crossed && triangles == [[0, 1, 2], [0, 2, 3]] {
            self.quads.push(self.triangles.len());
        }
        for triangle in triangles {
            self.triangles.push(triangle.map(|k| corners[k]));
            self.part_of_triangle.push(part);
            self.uv.push(triangle.map(|k| uv.map_or(DVec2::NAN, |uv| uv[k])));
        }
        if self.triangles.len() > MAX_TRIANGLES {
            return Err(BadInput::new(format!("the mesh has more than {MAX_TRIANGLES} triangles"), "simplify it"));
        }
        Ok(())
    }

    /// Adds what is known when the whole file is read to the notes.
    pub fn finish(mut self) -> Self {
        diagonals::choose(&self.vertices, &self.quads, &mut self.triangles, &mut self.uv);
        if self.crossed > 0 {
            self.notes.push(format!("{} faces cross themselves: they are cut as fans about their first corners", self.crossed));
        }
        self
    }

    pub fn into_tile(self, period: DVec2, scale: f64) -> Result<Tile, BadInput> {
        self.into_tile_of_triangles(period, scale).map(|(tile, _)| tile)
    }

    /// The tile, and for each of its triangles the place that it has here.
    pub fn into_tile_of_triangles(mut self, period: DVec2, scale: f64) -> Result<(Tile, Vec<usize>), BadInput> {
        if self.triangles.is_empty() {
            return Err(BadInput::new("the file has no faces", "export a surface, not points or lines"));
        }
        if self.normals_ignored {
            self.notes.push("the file's own normals are not used: each triangle has its geometric normal".into());
        }
        let without = self.uv.iter().filter(|uv| uv.iter().any(|c| !c.is_finite())).count();
        if without > 0 && without < self.uv.len() {
            self.notes.push(format!("the texture coordinates are not used: {without} of {} triangles have none", self.uv.len()));
        }
        let uv = if without == 0 { Some(self.uv) } else { None };
        let vertices = self.vertices.into_iter().map(|v| v * scale).collect();
        let (triangles, part_of_triangle, parts, notes) = (self.triangles, self.part_of_triangle, self.parts, self.notes);
        Tile { vertices, triangles, part_of_triangle, parts, uv, period: period * scale, grid: None, notes }.clean_of()
    }
}

/// Three finite coordinates, or what is wrong with them.
pub(super) fn finite(position: DVec3) -> Result<DVec3, BadInput> {
    if position.is_finite() {
        Ok(position)
    } else {
        let problem = format!("the vertex ({}, {}, {}) is not finite", position.x, position.y, position.z);
        Err(BadInput::new(problem, "coordinates must be finite numbers"))
    }
}
