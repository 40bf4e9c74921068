//! The values of a material file, typed and each in its range: numbers are set here, and the material is made of them again.
//!
//! A search asks for the key of each number once ([`MaterialValues::number_key`]) and then sets it as often as it likes; neither text nor a
//! file that the material names is read again. What a file would be refused for, a set value is refused for as well: its range when it is
//! set, and what values contradict each other when the material is made.

use super::recipe::Material;
use super::surface::{Surface, TINT, Tint};
use crate::error::{BadInput, Result};
use crate::geometry::{Geometry, GeometryValues};
use crate::toml_reader::suggest;
use std::path::PathBuf;

/// What a material file says, before the geometry's values are compared with each other.
#[derive(Clone, Debug)]
pub struct MaterialValues {
    /// The file.
    pub file: PathBuf,
    /// The name that the file gives, or the file's own.
    pub name: String,
    /// Unit of all lengths, one of [`super::recipe::UNITS`], and its size in millimetres.
    pub unit: (&'static str, f64),
    /// Reflections after the first that its look includes.
    pub bounces: u32,
    /// The `[geometry]` table.
    pub geometry: GeometryValues,
    /// What covers the parts, in the order of the file.
    pub surfaces: Vec<Surface>,
}

/// Which number of a material: `geometry.KEY`, `surface.PART.brdf.KEY` or `surface.PART.tint`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberKey {
    /// In the `[geometry]` table.
    Geometry(&'static str),
    /// In the `brdf` of a `[[surface]]`.
    Brdf {
        /// Index of the surface, in the order of the file.
        surface: usize,
        /// The key.
        key: &'static str,
    },
    /// The `tint` of a `[[surface]]`.
    Tint {
        /// Index of the surface, in the order of the file.
        surface: usize,
    },
}

impl MaterialValues {
    /// The number that `key` names; the file need not give it.
    ///
    /// # Errors
    /// A key of another form, of a part that no surface covers, or that is no number there.
    pub fn number_key(&self, key: &str) -> Result<NumberKey, BadInput> {
        let words: Vec<&str> = key.split('.').collect();
        match words[..] {
            ["geometry", key] => Ok(NumberKey::Geometry(self.geometry.number_key(key)?)),
            ["surface", part, "brdf", key] => {
                let surface = self.surface(part)?;
                Ok(NumberKey::Brdf { surface, key: self.surfaces[surface].brdf.number_key(key)? })
            }
            ["surface", part, "tint"] => Ok(NumberKey::Tint { surface: self.surface(part)? }),
            _ => {
                let form = "write `geometry.KEY`, `surface.PART.brdf.KEY` or `surface.PART.tint`";
                Err(BadInput::new(format!("\"{key}\" names no number of a material"), form))
            }
        }
    }

    fn surface(&self, part: &str) -> Result<usize, BadInput> {
        let parts: Vec<&str> = self.surfaces.iter().map(|s| &*s.part).collect();
        parts.iter().position(|p| *p == part).ok_or_else(|| {
            BadInput::new(format!("no [[surface]] of {} has the part \"{part}\"", self.file.display()), suggest(part, &parts))
        })
    }

    /// Sets a number; a colour gets it in all channels.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set(&mut self, number: NumberKey, value: f64) -> Result<(), BadInput> {
        match number {
            NumberKey::Geometry(key) => self.geometry.set_number(key, value),
            NumberKey::Brdf { .. } | NumberKey::Tint { .. } => self.set_colour(number, [value; 3]),
        }
    }

    /// Sets a colour of a surface.
    ///
    /// # Errors
    /// A channel out of range.
    ///
    /// # Panics
    /// On a number of the geometry, which has no colours.
    pub fn set_colour(&mut self, number: NumberKey, colour: [f64; 3]) -> Result<(), BadInput> {
        match number {
            NumberKey::Geometry(key) => unreachable!("`geometry.{key}` is no colour"),
            NumberKey::Brdf { surface, key } => self.surfaces[surface].brdf.set_colour(key, colour),
            NumberKey::Tint { surface } => {
                TINT.check(&colour)?;
                self.surfaces[surface].tint = Tint::Uniform(colour);
                Ok(())
            }
        }
    }

    /// The material with the values as they are.
    ///
    /// # Errors
    /// Values of the geometry that contradict each other.
    pub fn material(&self) -> Result<Material> {
        let (unit, unit_mm) = self.unit;
        let geometry = Geometry::of(&self.geometry, unit_mm)?;
        Ok(Material {
            file: self.file.clone(),
            name: self.name.clone(),
            unit,
            bounces: self.bounces,
            geometry,
            surfaces: self.surfaces.clone(),
        })
    }
}

#[cfg(test)]
#[path = "values_tests.rs"]
mod tests;
