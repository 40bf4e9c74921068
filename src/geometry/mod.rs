//! Small-scale geometry: a recipe in, a [`Tile`] out.
//!
//! A tile is one period of the surface as a triangle mesh, z up, repeated on the lattice `(period.x, 0)`, `(0, period.y)`.
//! It may overhang its cell: the surface is the union of all its translates.

mod builder;
mod clean;
pub mod grooves;
pub mod height_field;
pub mod mesh;
pub mod params;
pub mod pyramids;
pub mod rods;
mod template;
#[cfg(test)]
mod tests;
mod values;
pub mod weave;

pub use builder::MAX_TRIANGLES;
pub use template::template;
pub use values::GeometryValues;

use crate::error::Result;
use crate::toml_reader::TableReader;
use glam::{DVec2, DVec3};
use params::Param;

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

/// The recipe of a small-scale geometry, one variant a kind.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Straight grooves.
    Grooves(grooves::Grooves),
    /// Pyramids on a regular polygon.
    Pyramids(pyramids::Pyramids),
    /// Rods that stand or lean on flat ground.
    Rods(rods::Rods),
    /// Cloth of warp and weft threads.
    Weave(weave::Weave),
    /// Heights from an image or a scan.
    HeightField(height_field::HeightField),
    /// Triangles from a file.
    Mesh(mesh::Mesh),
}

/// The kinds, as material files name them.
pub const KINDS: [&str; 6] = ["grooves", "pyramids", "rods", "weave", "height-field", "mesh"];

/// What the user can say about one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Description {
    /// One line: what it is.
    pub help: &'static str,
    /// The keys of its `[geometry]` table beside `kind`.
    pub params: &'static [Param],
    /// Names of its parts at default values, with what they are.
    pub parts: &'static [(&'static str, &'static str)],
}

/// What the user can say about `kind`, one of [`KINDS`].
pub fn describe(kind: &str) -> Option<Description> {
    let (help, params, parts) = match kind {
        "grooves" => ("Straight grooves along y", grooves::PARAMS, grooves::PARTS),
        "pyramids" => ("Pyramids or pits on a regular polygon", pyramids::PARAMS, pyramids::PARTS),
        "rods" => ("Rods that stand or lean on flat ground, like velvet", rods::PARAMS, rods::PARTS),
        "weave" => ("Cloth of warp and weft threads", weave::PARAMS, weave::PARTS),
        "height-field" => ("Heights from an image or a scan", height_field::PARAMS, height_field::PARTS),
        "mesh" => ("Triangles from an OBJ, PLY or STL file", mesh::PARAMS, mesh::PARTS),
        _ => return None,
    };
    Some(Description { help, params, parts })
}

impl Geometry {
    /// Reads the `[geometry]` table of a file whose lengths are `unit_mm` millimetres long.
    pub fn read(table: TableReader<'_>, unit_mm: f64) -> Result<Self> {
        Self::of(&Self::values(table)?, unit_mm)
    }

    /// The values of a `[geometry]` table, each checked by itself.
    pub fn values(table: TableReader<'_>) -> Result<GeometryValues> {
        let kind = KINDS[table.choice("kind", &KINDS)?.ok_or_else(|| table.missing("kind", "\"grooves\""))?];
        GeometryValues::read(table, kind, describe(kind).expect("every kind is described").params)
    }

    /// The recipe of a kind from its values: defaults are filled in, and values are compared with each other. Lengths are `unit_mm`
    /// millimetres long.
    ///
    /// # Errors
    /// Bad input for values that contradict each other, and of files that the recipe names.
    pub fn of(values: &GeometryValues, unit_mm: f64) -> Result<Self> {
        Ok(match values.kind {
            "grooves" => Self::Grooves(grooves::Grooves::read(values)?),
            "pyramids" => Self::Pyramids(pyramids::Pyramids::read(values)),
            "rods" => Self::Rods(rods::Rods::read(values)?),
            "weave" => Self::Weave(weave::Weave::read(values, unit_mm)?),
            "height-field" => Self::HeightField(height_field::HeightField::read(values, unit_mm)?),
            "mesh" => Self::Mesh(mesh::Mesh::read(values)?),
            other => unreachable!("KINDS holds no \"{other}\""),
        })
    }

    /// The kind, one of [`KINDS`].
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Grooves(_) => "grooves",
            Self::Pyramids(_) => "pyramids",
            Self::Rods(_) => "rods",
            Self::Weave(_) => "weave",
            Self::HeightField(_) => "height-field",
            Self::Mesh(_) => "mesh",
        }
    }

    /// Builds one period.
    pub fn build(&self) -> Result<Tile> {
        match self {
            Self::Grooves(grooves) => grooves.build(),
            Self::Pyramids(pyramids) => pyramids.build(),
            Self::Rods(rods) => rods.build(),
            Self::Weave(weave) => weave.build(),
            Self::HeightField(field) => field.build(),
            Self::Mesh(mesh) => mesh.build(),
        }
    }
}
