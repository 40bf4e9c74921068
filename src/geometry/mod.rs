//! Small-scale geometry: a recipe in, a [`Tile`] out.
//!
//! A tile is one period of the surface as a triangle mesh, z up, repeated on the lattice `(period.x, 0)`, `(0, period.y)`.
//! It may overhang its cell: the surface is the union of all its translates.

pub mod mesh;

use crate::error::Result;
use crate::toml_reader::TableReader;
use glam::{DVec2, DVec3};

/// One period of a small-scale surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Positions, in the material file's unit.
    pub vertices: Vec<DVec3>,
    /// Counter-clockwise seen from outside; each has a positive area and finite corners (see [`Tile::clean`]).
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle its place in `parts`.
    pub part_of_triangle: Vec<u16>,
    /// Names of the parts.
    pub parts: Vec<String>,
    /// Texture coordinates of the corners of each triangle, if the geometry has them.
    pub uv: Option<Vec<[DVec2; 3]>>,
    /// Size of the period in x and y, positive.
    pub period: DVec2,
    /// The heights that the triangles interpolate, where the surface is a height field and nothing else.
    pub grid: Option<HeightGrid>,
    /// What the user should know about how the tile was made (dropped triangles, ignored normals, a seam's height).
    pub notes: Vec<String>,
}

/// A periodic height field: node `(i, j)` lies at `(i, j) * period / (columns, rows)`; node `(columns, j)` is node `(0, j)`.
/// Each cell is cut along the diagonal from node `(i, j)` to `(i + 1, j + 1)`.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightGrid {
    /// Nodes along x in one period.
    pub columns: usize,
    /// Nodes along y in one period.
    pub rows: usize,
    /// `rows` rows of `columns` heights, row `j = 0` at y = 0.
    pub heights: Vec<f64>,
}

impl Tile {
    /// Footprint `A` of one period.
    pub fn footprint(&self) -> f64 {
        self.period.x * self.period.y
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }
}

/// The recipe of a small-scale geometry, one variant a kind.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles from a file.
    Mesh(mesh::Mesh),
}

/// The kinds, as material files name them.
pub const KINDS: [&str; 1] = ["mesh"];

impl Geometry {
    /// Reads the `[geometry]` table.
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let kind = table.choice("kind", &KINDS)?.ok_or_else(|| table.missing("kind", "\"grooves\""))?;
        let geometry = match KINDS[kind] {
            "mesh" => Self::Mesh(mesh::Mesh::read(&table)?),
            _ => unreachable!("choice returns a place in KINDS"),
        };
        table.finish()?;
        Ok(geometry)
    }

    /// Builds one period.
    pub fn build(&self) -> Result<Tile> {
        match self {
            Self::Mesh(mesh) => mesh.build(),
        }
    }
}
