//! The kinds of geometry: which there are, what a material file may say about each, and the recipe that is made of it.
//!
//! A new kind is a file (or a folder) beside this one with its `PARAMS`, its `PARTS`, `read` and `build`; then a word in [`KINDS`],
//! a variant of [`Geometry`], and a line in each `match` of this file.

use super::height_field::{self, HeightField};
use super::mesh::{self, Mesh};
use super::params::Param;
use super::tile::Tile;
use super::values::GeometryValues;
use super::weave::{self, Thread, Weave};
use super::{grooves, grooves::Grooves, pyramids, pyramids::Pyramids, rods, rods::Rods};
use crate::error::Result;
use crate::toml_reader::TableReader;

/// The recipe of a small-scale geometry, one variant a kind.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Straight grooves.
    Grooves(Grooves),
    /// Pyramids on a regular polygon.
    Pyramids(Pyramids),
    /// Rods that stand or lean on flat ground.
    Rods(Rods),
    /// Cloth of warp and weft threads.
    Weave(Weave),
    /// Heights from an image or a scan.
    HeightField(HeightField),
    /// Triangles from a file.
    Mesh(Mesh),
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
            "grooves" => Self::Grooves(Grooves::read(values)?),
            "pyramids" => Self::Pyramids(Pyramids::read(values)),
            "rods" => Self::Rods(Rods::read(values)?),
            "weave" => Self::Weave(Weave::read(values, unit_mm)?),
            "height-field" => Self::HeightField(HeightField::read(values, unit_mm)?),
            "mesh" => Self::Mesh(Mesh::read(values)?),
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

    /// The key that says how high the surface is: `geometry.depth`.
    pub fn height_key(&self) -> &'static str {
        match self {
            Self::Grooves(_) => "geometry.depth",
            Self::Pyramids(_) | Self::HeightField(_) => "geometry.height",
            Self::Rods(_) => "geometry.length",
            Self::Weave(weave) => {
                let thickest = |threads: &[Thread]| threads.iter().map(|t| t.height).fold(0.0, f64::max);
                match (thickest(&weave.warp), thickest(&weave.weft)) {
                    (warp, weft) if weave.crimp >= 0.5 * (warp + weft) && weave.crimp > warp.max(weft) => "geometry.crimp",
                    (warp, weft) if warp >= weft => "geometry.warp_height",
                    _ => "geometry.weft_height",
                }
            }
            Self::Mesh(_) => "geometry.scale",
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
