//! What a material file says of a mesh: its file, period and scale.

use super::super::params::{Param, Unit, Value, choice, number};
use super::super::tile::Tile;
use super::super::values::GeometryValues;
use super::file::load;
use super::orientation::Up;
use crate::error::Result;
use crate::toml_reader::range;
use glam::DVec2;
use std::path::PathBuf;

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    Param {
        key: "file",
        value: Value::File { example: "surface.obj", required: true },
        help: "The mesh, .obj, .ply or .stl: counter-clockwise seen from outside. PUT YOUR FILE'S NAME HERE",
    },
    Param {
        key: "period",
        value: Value::Pair { unit: Unit::Length, default: None, example: [1.0, 1.0], range: range(1e-6, 1e6) },
        help: "Size of one period in the mesh file's own lengths; required",
    },
    number("scale", Unit::One, 1.0, range(1e-9, 1e9), "Factor from the mesh file's lengths to `unit`"),
    choice("up", "z", &["z", "y", "x"], "The file's axis that points up; `period` is along the other two, in their order"),
    Param { key: "flip", value: Value::Flag { default: false }, help: "Turn all faces over: for a mesh that is inside out" },
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
    /// The file's axis that points up.
    pub up: Up,
    /// Whether its faces are turned over.
    pub flip: bool,
}

impl Mesh {
    pub(in crate::geometry) fn read(values: &GeometryValues) -> Result<Self> {
        let file = values.path("file")?.expect("file is required").to_path_buf();
        let period = values.pair("period").ok_or_else(|| values.missing("period", "[1.0, 1.0]"))?;
        let up = match values.choice("up") {
            Some("x") => Up::X,
            Some("y") => Up::Y,
            _ => Up::Z,
        };
        Ok(Self { file, period: period.into(), scale: values.number("scale"), up, flip: values.flag("flip") })
    }

    pub(in crate::geometry) fn build(&self) -> Result<Tile> {
        let Self { file, period, scale, .. } = self;
        load(file, *period, *scale, self.up, self.flip)
    }
}
