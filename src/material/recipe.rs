//! A material: the recipe of its geometry and what covers the parts; and the surface that is built of it.

use super::small_scale::SmallScale;
use super::surface::{Surface, Tint};
use crate::error::{BadInput, Result};
use crate::geometry::{Geometry, Tile};
use crate::toml_reader::suggest;
use std::path::PathBuf;

/// Length units of a material file, with their size in millimetres.
pub const UNITS: [(&str, f64); 5] = [("nm", 1e-6), ("um", 1e-3), ("mm", 1.0), ("cm", 10.0), ("m", 1e3)];

/// Highest surface that is computed, over the longer side of its period. Chosen, not measured: twice the highest of the tests of extremes. Beyond
/// 65,536 periods rays give up, at grazing angles long before.
pub const MAX_HEIGHT: f64 = 2000.0;

/// A surface higher than this, over the same, is noted. `eval` of three pairs took 5 s for a pyramid 100 periods high, and over 20 s for one 316 high, on a
/// machine of two cores that others used.
const SLOW_HEIGHT: f64 = 100.0;

/// Most reflections after the first that a material may ask for. Chosen, not measured: as many as a fit may ask for.
pub const MAX_BOUNCES: u32 = 64;

/// A material file, read and checked, its geometry not yet built.
#[derive(Clone, Debug)]
pub struct Material {
    /// The file it came from.
    pub file: PathBuf,
    /// The name that the file gives, or the file's own.
    pub name: String,
    /// Unit of all lengths, one of [`UNITS`].
    pub unit: &'static str,
    /// Reflections after the first that its look includes, up to [`MAX_BOUNCES`]; 0 is direct light only.
    pub bounces: u32,
    /// The recipe of the small-scale geometry.
    pub geometry: Geometry,
    /// What covers the parts, in the order of the file.
    pub surfaces: Vec<Surface>,
}

impl Material {
    /// Builds the geometry and assigns a surface to each of its parts.
    ///
    /// # Errors
    /// A surface that names a part the geometry lacks, two surfaces for one part, and a part that no surface covers.
    ///
    /// ```
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
    /// let surface = biscale::Material::load(path.as_ref())?.build()?;
    /// // Four sides of one pyramid on a cell of 50 x 50 micrometres; all of them are covered by the one surface.
    /// assert_eq!((surface.tile.triangles.len(), surface.tile.footprint()), (4, 2500.0));
    /// assert_eq!(surface.surface_of_triangle, [0; 4]);
    /// # Ok::<(), biscale::Error>(())
    /// ```
    pub fn build(&self) -> Result<SmallScale> {
        let mut tile = self.geometry.build()?;
        let slow = self.check_height(&tile)?;
        tile.notes.extend(slow);
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
        let covered = SmallScale { tile, surfaces: self.surfaces.clone(), surface_of_triangle, bounces: self.bounces };
        for surface in &self.surfaces {
            if matches!(surface.tint, Tint::Image(_)) && covered.tile.uv.is_none() {
                let bad = BadInput::new("this geometry has no uv coordinates for an image", "write three numbers");
                return Err(bad.in_file(&self.file).at_line(surface.line).at_field("surface.tint").into());
            }
        }
        Ok(covered)
    }

    /// Refuses a surface that is too high for its period, and notes one that is so high that it takes long: see [`MAX_HEIGHT`].
    fn check_height(&self, tile: &Tile) -> Result<Option<String>> {
        let (low, high) = tile.vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.z), high.max(v.z)));
        let share = (high - low) / tile.period.max_element();
        if share <= SLOW_HEIGHT {
            return Ok(None);
        }
        let problem = format!("heights from {low} to {high} are {share:.3e} times the period of {} x {}", tile.period.x, tile.period.y);
        let remedy = "check the unit, and that heights and period are given in the same one";
        if share <= MAX_HEIGHT {
            return Ok(Some(format!("{problem}: rays cross that many periods, and this takes long; {remedy}")));
        }
        let remedy = format!("at most {MAX_HEIGHT} times is computed: {remedy}");
        Err(BadInput::new(problem, remedy).in_file(&self.file).at_field(self.geometry.height_key()).into())
    }
}
