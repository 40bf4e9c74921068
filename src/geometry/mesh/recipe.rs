//! What a material file says of a mesh: its file, period and scale.

use super::super::params::{Param, Unit, Value, number};
use super::super::tile::Tile;
use super::super::values::GeometryValues;
use super::file::load;
use crate::error::Result;
use crate::toml_reader::range;
use glam::DVec2;
use std::path::PathBuf;

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    Param {
        key: "file",
        value: Value::File { example: "surface.obj", required: true },
        help: "The mesh, .obj, .ply or .stl: z up, counter-clockwise seen from outside. PUT YOUR FILE'S NAME HERE",
    },
    Param {
        key: "period",
        value: Value::Pair { unit: Unit::Length, default: None, example: [1.0, 1.0], range: range(1e-6, 1e6) },
        help: "Size of one period in the mesh file's own lengths; required",
    },
    number("scale", Unit::One, 1.0, range(1e-9, 1e9), "Factor from the mesh file's lengths to `unit`"),
];

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[("*", "all parts; OBJ files name them by usemtl, else by g; others have one, \"default\"")];

/// Triangles from a file, periodic in x and y.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// OBJ, PLY or STL file.
    pub file: PathBuf,
    /// Period in the file's units.
    pub period: DVec2,
    /// Factor from the file's units to the material's.
    pub scale: f64,
}

impl Mesh {
    pub(in crate::geometry) fn read(values: &GeometryValues) -> Result<Self> {
        let file = values.path("file")?.expect("file is required").to_path_buf();
        let period = values.pair("period").ok_or_else(|| values.missing("period", "[1.0, 1.0]"))?;
        Ok(Self { file, period: period.into(), scale: values.number("scale") })
    }

    pub(in crate::geometry) fn build(&self) -> Result<Tile> {
        load(&self.file, self.period, self.scale)
    }
}
