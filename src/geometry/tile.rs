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
/// Each cell is cut along one of its diagonals: [`HeightGrid::rises`].
#[derive(Clone, Debug, PartialEq)]
pub struct HeightGrid {
    /// Nodes along x in one period.
    pub columns: usize,
    /// Nodes along y in one period.
    pub rows: usize,
    /// `rows` rows of `columns` heights, row `j = 0` at y = 0.
    pub heights: Vec<f64>,
}

impl HeightGrid {
    /// The heights at the corners of the cell above and to the right of node `(i, j)`, counter-clockwise from that node.
    pub fn corners(&self, i: usize, j: usize) -> [f64; 4] {
        let next = |k: usize, size: usize| if k + 1 == size { 0 } else { k + 1 };
        let (right, up) = (next(i, self.columns), next(j, self.rows) * self.columns);
        [self.heights[j * self.columns + i], self.heights[j * self.columns + right], self.heights[up + right], self.heights[up + i]]
    }

    /// Whether a cell with these [corners](Self::corners) is cut from node `(i, j)` to `(i + 1, j + 1)`, and not along the other diagonal.
    ///
    /// It is cut along the shorter one, whose ends differ less in height, so that no direction is preferred: cut all the same way, the normals of white noise
    /// have slopes along x and y that go together. Where both are equal (a saddle) neighbours are cut differently.
    #[inline(always)]
    pub fn rises([low, right, far, up]: [f64; 4], i: usize, j: usize) -> bool {
        let (rising, falling) = ((far - low).abs(), (up - right).abs());
        rising < falling || rising == falling && (i + j).is_multiple_of(2)
    }

    /// The two triangles of each cell, row by row, counter-clockwise, by their nodes `(i, j)`; node `(columns, j)` stands a period after node `(0, j)`.
    pub fn triangles(&self) -> impl Iterator<Item = [(usize, usize); 3]> + '_ {
        let cells = (0..self.rows).flat_map(|j| (0..self.columns).map(move |i| (i, j)));
        cells.flat_map(|(i, j)| {
            let (low, right, far, up) = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1));
            if Self::rises(self.corners(i, j), i, j) { [[low, right, far], [low, far, up]] } else { [[low, right, up], [right, far, up]] }
        })
    }
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
