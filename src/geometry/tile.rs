//! One period of a small-scale surface: what every later stage works on.

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
    /// Names of the parts, each once; a part that the kind knows may have no triangle here.
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
