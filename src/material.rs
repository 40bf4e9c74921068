//! Material files: TOML in, a [`Material`] out, and with its geometry built a [`SmallScale`] surface.
//!
//! Every mistake names file, line, field, value and remedy. The format is documented in `docs/formats.md`.

use crate::brdf::Brdf;
use crate::error::{BadInput, Result};
use crate::geometry::{Geometry, Tile};
use crate::image_file;
use crate::toml_reader::{Range, Source, TableReader, range, suggest};
use glam::DVec2;
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod values;

pub use values::{MaterialValues, NumberPlace};

/// Bounds of a colour weight.
const TINT: Range = range(0.0, 1.0);

/// Length units of a material file, with their size in millimetres.
pub const UNITS: [(&str, f64); 5] = [("nm", 1e-6), ("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1e3)];

/// A material file, read and checked, its geometry not yet built.
#[derive(Clone, Debug)]
pub struct Material {
    /// The file it came from.
    pub file: PathBuf,
    /// The name that the file gives, or the file's own.
    pub name: String,
    /// Unit of all lengths, one of [`UNITS`].
    pub unit: &'static str,
    /// The recipe of the small-scale geometry.
    pub geometry: Geometry,
    /// What covers the parts, in the order of the file.
    pub surfaces: Vec<Surface>,
}

/// What covers one part of the geometry.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name of the part, or `*` for all that no other surface names.
    pub part: String,
    /// How it reflects.
    pub brdf: Brdf,
    /// Colour weight of the BRDF (Wu et al. 2011, section 3.7).
    pub tint: Tint,
    /// Line in the file, for messages.
    pub line: usize,
}

/// Colour weights: linear RGB factors of a BRDF, from 0.
#[derive(Clone, Debug)]
pub enum Tint {
    /// The same everywhere.
    Uniform([f64; 3]),
    /// By position, from an image over the tile (height fields) or over the uv unit square (meshes with uv).
    Image(Arc<TintImage>),
}

/// An image of colour weights, linear RGB, row 0 at v = 0 (the image's bottom row).
#[derive(Clone, Debug)]
pub struct TintImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels up.
    pub height: usize,
    /// `height` rows of `width` linear RGB values in 0..=1.
    pub pixels: Vec<[f32; 3]>,
}

/// A small-scale surface ready to be filtered: geometry, and what covers each triangle.
#[derive(Clone, Debug)]
pub struct SmallScale {
    /// One period of the surface.
    pub tile: Tile,
    /// What covers it.
    pub surfaces: Vec<Surface>,
    /// For each triangle of the tile its place in `surfaces`.
    pub surface_of_triangle: Vec<u16>,
}

impl SmallScale {
    /// Whether light and viewer may trade places: all but RGL tables are reciprocal by construction.
    pub fn is_reciprocal(&self) -> bool {
        are_reciprocal(&self.surfaces)
    }
}

/// Whether light and viewer may trade places on all of these surfaces.
pub fn are_reciprocal(surfaces: &[Surface]) -> bool {
    surfaces.iter().all(|s| s.brdf.is_reciprocal())
}

impl TintImage {
    /// The pixel that holds `uv`, both wrapped into the unit square.
    pub fn lookup(&self, uv: DVec2) -> [f32; 3] {
        let wrapped = uv - uv.floor();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "wrapped into the image")]
        let pixel = |x: f64, size: usize| ((x * size as f64) as usize).min(size - 1);
        self.pixels[pixel(wrapped.y, self.height) * self.width + pixel(wrapped.x, self.width)]
    }
}

impl Material {
    /// Reads and checks a material file.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(&Source::read(path)?)
    }

    /// Checks the text of a material file; paths in it are relative to `source.path`.
    pub fn parse(source: &Source) -> Result<Self> {
        MaterialValues::parse(source)?.material()
    }

    /// Builds the geometry and assigns a surface to each of its parts.
    ///
    /// # Errors
    /// A surface that names a part the geometry lacks, two surfaces for one part, and a part that no surface covers.
    pub fn build(&self) -> Result<SmallScale> {
        let tile = self.geometry.build()?;
        let names: Vec<&str> = tile.parts.iter().map(String::as_str).collect();
        let at = |surface: &Surface, bad: BadInput| bad.in_file(&self.file).at_line(surface.line).at_field("surface.part");
        let mut surface_of_part: Vec<Option<u16>> = vec![None; names.len()];
        let mut rest: Option<u16> = None;
        for (index, surface) in (0_u16..).zip(&self.surfaces) {
            let slot = if surface.part == "*" {
                &mut rest
            } else if let Some(part) = names.iter().position(|&n| n == surface.part) {
                &mut surface_of_part[part]
            } else {
                let bad = BadInput::new(format!("the geometry has no part \"{}\"", surface.part), suggest(&surface.part, &names));
                return Err(at(surface, bad).into());
            };
            if slot.replace(index).is_some() {
                let bad = BadInput::new(format!("part \"{}\" is covered twice", surface.part), "keep one [[surface]] for each part");
                return Err(at(surface, bad).into());
            }
        }
        let mut has_triangles = vec![false; names.len()];
        for &part in &tile.part_of_triangle {
            has_triangles[usize::from(part)] = true;
        }
        for ((slot, name), used) in surface_of_part.iter_mut().zip(&names).zip(has_triangles) {
            *slot = slot.or(rest);
            // A part without triangles (the tops of grooves whose ridges are sharp) may be covered, but need not be.
            if slot.is_none() && used {
                let bad = BadInput::new(
                    format!("no surface covers part \"{name}\""),
                    format!("add a [[surface]] with `part = \"{name}\"` or `part = \"*\"`"),
                );
                return Err(bad.in_file(&self.file).at_field("surface").into());
            }
        }
        let surface_of_triangle =
            tile.part_of_triangle.iter().map(|&p| surface_of_part[usize::from(p)].expect("every part with triangles is covered")).collect();
        let covered = SmallScale { tile, surfaces: self.surfaces.clone(), surface_of_triangle };
        for surface in &self.surfaces {
            if matches!(surface.tint, Tint::Image(_)) && covered.tile.uv.is_none() {
                let bad = BadInput::new("this geometry has no uv coordinates for an image", "write three numbers");
                return Err(bad.in_file(&self.file).at_line(surface.line).at_field("surface.tint").into());
            }
        }
        Ok(covered)
    }
}

impl MaterialValues {
    /// Checks the text of a material file, each value by itself; paths in it are relative to `source.path`.
    ///
    /// # Errors
    /// Bad input, by line and field; those of the files that surfaces name.
    pub fn parse(source: &Source) -> Result<Self> {
        let root = source.parse()?;
        let top = TableReader::new(source, "", root.get_ref(), 0);
        let name = top.head()?;
        let unit = UNITS[top.choice("unit", &UNITS.map(|(unit, _)| unit))?.unwrap_or(2)];
        let Some(table) = top.table("geometry")? else {
            return Err(top.error("there is no [geometry] table", "add one with `kind = ...`; `biscale new` writes an example"));
        };
        let geometry = Geometry::values(table)?;
        let tables = top.tables("surface")?;
        if tables.is_empty() {
            return Err(top.error("there is no [[surface]] table", "add one with `part = \"*\"` and a `brdf`"));
        }
        let surfaces = tables.into_iter().map(Surface::read).collect::<Result<Vec<_>>>()?;
        top.finish()?;
        Ok(Self { file: source.path.clone(), name, unit, geometry, surfaces })
    }
}

impl Surface {
    fn read(table: TableReader<'_>) -> Result<Self> {
        let part = table.str("part")?.ok_or_else(|| table.missing("part", "\"*\""))?.to_owned();
        let brdf = table.table("brdf")?.ok_or_else(|| table.missing("brdf", "{ model = \"lambert\", albedo = 0.5 }"))?;
        let brdf = Brdf::read(brdf)?;
        let tint = match table.text("tint").and_then(|_| table.path("tint").transpose()) {
            Some(path) => Tint::Image(Arc::new(image_file::read_tint(&path?)?)),
            None => Tint::Uniform(table.colour("tint", TINT)?.unwrap_or([1.0; 3])),
        };
        let line = table.line();
        table.finish()?;
        Ok(Self { part, brdf, tint, line })
    }
}
