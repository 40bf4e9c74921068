//! A material file whose numbers move: keys in, the file with other numbers out.

use crate::template::kind;
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::params::{Fallback, Unit, Value};
use biscale::geometry::{self, Geometry};
use biscale::material::Material;
use biscale::toml_reader::{Source, suggest};
use std::path::PathBuf;
use toml_edit::{Array, DocumentMut, Item, TableLike, value};

/// A material file, as text that is changed key by key. Comments stay.
#[derive(Clone, Debug)]
pub struct Recipe {
    path: PathBuf,
    document: DocumentMut,
}

/// Where a key stands: `geometry.KEY`, or `surface.PART.brdf.KEY`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the `[geometry]` table.
    Geometry(String),
    /// In the `brdf` of a `[[surface]]`.
    Brdf {
        /// Place of the surface in the file.
        surface: usize,
        /// The key.
        key: String,
    },
    /// The `tint` of a `[[surface]]`.
    Tint {
        /// Place of the surface in the file.
        surface: usize,
    },
}

impl Recipe {
    /// Of the text of a material file.
    ///
    /// # Errors
    /// Bad input if it is no TOML.
    pub fn new(source: &Source) -> Result<Self> {
        let document = source.text.parse::<DocumentMut>().map_err(|e| {
            let line = e.span().map_or(1, |s| source.line(s.start));
            Error::from(BadInput::new("not valid TOML", "see https://toml.io for the syntax").in_file(&source.path).at_line(line))
        })?;
        Ok(Self { path: source.path.clone(), document })
    }

    /// The place that `key` means in this file; it need not be there yet.
    ///
    /// # Errors
    /// A mistake that is not yet placed: a key of another form, or of a part that no surface covers.
    pub fn place(&self, key: &str) -> Result<Place, BadInput> {
        let words: Vec<&str> = key.split('.').collect();
        let form = "write `geometry.KEY`, `surface.PART.brdf.KEY` or `surface.PART.tint`";
        match words[..] {
            ["geometry", key] => Ok(Place::Geometry(key.to_owned())),
            ["surface", part, "brdf", key] => Ok(Place::Brdf { surface: self.surface(part)?, key: key.to_owned() }),
            ["surface", part, "tint"] => Ok(Place::Tint { surface: self.surface(part)? }),
            _ => Err(BadInput::new(format!("\"{key}\" names no number of a material"), form)),
        }
    }

    fn surface(&self, part: &str) -> Result<usize, BadInput> {
        let parts: Vec<&str> = self.tables().iter().filter_map(|t| t.get("part").and_then(Item::as_str)).collect();
        parts.iter().position(|p| *p == part).ok_or_else(|| {
            BadInput::new(format!("no [[surface]] of {} has the part \"{part}\"", self.path.display()), suggest(part, &parts))
        })
    }

    fn tables(&self) -> Vec<&dyn TableLike> {
        match self.document.get("surface") {
            Some(Item::ArrayOfTables(tables)) => tables.iter().map(|t| t as &dyn TableLike).collect(),
            Some(Item::Value(v)) => {
                v.as_array().into_iter().flatten().filter_map(|v| v.as_inline_table()).map(|t| t as &dyn TableLike).collect()
            }
            _ => Vec::new(),
        }
    }

    fn table(&mut self, place: &Place) -> Option<&mut dyn TableLike> {
        let surface = match place {
            Place::Geometry(_) => return self.document.get_mut("geometry")?.as_table_like_mut(),
            Place::Brdf { surface, .. } | Place::Tint { surface } => *surface,
        };
        let table: &mut dyn TableLike = match self.document.get_mut("surface")? {
            Item::ArrayOfTables(tables) => tables.get_mut(surface)?,
            Item::Value(v) => v.as_array_mut()?.get_mut(surface)?.as_inline_table_mut()?,
            _ => return None,
        };
        if matches!(place, Place::Brdf { .. }) { table.get_mut("brdf")?.as_table_like_mut() } else { Some(table) }
    }

    fn key(place: &Place) -> &str {
        match place {
            Place::Geometry(key) | Place::Brdf { key, .. } => key,
            Place::Tint { .. } => "tint",
        }
    }

    /// The number that stands there, if one does.
    pub fn number(&mut self, place: &Place) -> Option<f64> {
        let item = self.table(place)?.get(Self::key(place))?;
        #[expect(clippy::cast_precision_loss, reason = "numbers of a material are small")]
        item.as_float().or_else(|| item.as_integer().map(|i| i as f64))
    }

    /// Writes a number there.
    pub fn set(&mut self, place: &Place, number: f64) {
        self.put(place, value(number));
    }

    /// Writes a whole number there.
    pub fn set_count(&mut self, place: &Place, count: u32) {
        self.put(place, value(i64::from(count)));
    }

    /// Writes a colour there.
    pub fn set_colour(&mut self, place: &Place, colour: [f64; 3]) {
        let mut array = Array::new();
        array.extend(colour);
        self.put(place, value(array));
    }

    fn put(&mut self, place: &Place, item: Item) {
        let key = Self::key(place).to_owned();
        let Some(table) = self.table(place) else { return };
        match (table.get_mut(&key), item) {
            // What surrounds the value, a comment at its end, stays.
            (Some(Item::Value(old)), Item::Value(mut new)) => {
                *new.decor_mut() = old.decor().clone();
                *old = new;
            }
            (_, item) => {
                table.insert(&key, item);
            }
        }
    }

    /// The file's text.
    pub fn text(&self) -> String {
        self.document.to_string()
    }

    /// The material that the file describes now.
    ///
    /// # Errors
    /// Those of [`Material::parse`].
    pub fn material(&self) -> Result<Material> {
        Material::parse(&Source { path: self.path.clone(), text: self.text() })
    }

    /// Multiplies all lengths of the geometry.
    pub fn scale_lengths(&mut self, geometry: &Geometry, factor: f64) {
        let kind = kind(geometry);
        let params = geometry::describe(kind).map_or(&[][..], |d| d.params);
        for param in params {
            let place = Place::Geometry(param.key.to_owned());
            match param.value {
                // A length that is not written and has a fixed default must be written to be scaled.
                Value::Number { unit: Unit::Length, default, .. } => {
                    let fixed = if let Fallback::Fixed(v) = default { Some(v) } else { None };
                    if let Some(length) = self.number(&place).or(fixed) {
                        self.set(&place, length * factor);
                    }
                }
                // A mesh's own period is in the lengths of its file, which `scale` scales.
                Value::Pair { unit: Unit::Length, .. } if kind != "mesh" => {
                    let Some(table) = self.table(&place) else { continue };
                    let pair: Option<Vec<f64>> = table
                        .get(param.key)
                        .and_then(Item::as_array)
                        .map(|a| a.iter().filter_map(|v| v.as_float().or_else(|| v.as_integer().map(|i| i as f64))).collect());
                    if let Some([x, y]) = pair.as_deref() {
                        let mut array = Array::new();
                        array.extend([x * factor, y * factor]);
                        self.put(&place, value(array));
                    }
                }
                _ => {}
            }
        }
        if kind == "mesh" {
            // The triangles of a file are scaled by a factor of their own.
            let place = Place::Geometry("scale".to_owned());
            let own = self.number(&place).unwrap_or(1.0);
            self.set(&place, own * factor);
        }
    }

    /// Names the material.
    pub fn set_name(&mut self, name: &str) {
        self.document["name"] = value(name);
    }

    /// Makes the paths that the file holds relative to another folder.
    pub fn rebase(&mut self, from: &std::path::Path) {
        let absolute = |item: &mut Item| {
            if let Some(old) = item.as_str().map(str::to_owned) {
                let path = from.join(&old);
                let path = std::path::absolute(&path).unwrap_or(path);
                *item = value(path.display().to_string());
            }
        };
        if let Some(table) = self.document.get_mut("geometry").and_then(Item::as_table_like_mut) {
            for key in ["file", "wif"] {
                table.get_mut(key).into_iter().for_each(absolute);
            }
        }
        for surface in 0..self.tables().len() {
            for (place, key) in [(Place::Tint { surface }, "tint"), (Place::Brdf { surface, key: "file".to_owned() }, "file")] {
                self.table(&place).and_then(|t| t.get_mut(key)).into_iter().for_each(absolute);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "format = 1\n[geometry]\nkind = \"grooves\" # V\ndepth = 0.5 # deep\n[[surface]]\npart = \"floor\"\n\
                        brdf = { model = \"lambert\", albedo = 0.5 }\n[[surface]]\npart = \"*\"\ntint = [1, 1, 1]\n\
                        brdf = { model = \"ward\", specular = 0.1, alpha = 0.2 }\n";

    fn recipe() -> Recipe {
        Recipe::new(&Source { path: "m.toml".into(), text: TEXT.to_owned() }).unwrap()
    }

    #[test]
    fn numbers_change_and_comments_stay() {
        let mut recipe = recipe();
        let depth = recipe.place("geometry.depth").unwrap();
        let alpha = recipe.place("surface.*.brdf.alpha").unwrap();
        let albedo = recipe.place("surface.floor.brdf.albedo").unwrap();
        assert_eq!(recipe.number(&depth), Some(0.5));
        recipe.set(&depth, 0.75);
        recipe.set(&alpha, 0.125);
        recipe.set_colour(&albedo, [0.25, 0.5, 1.0]);
        let text = recipe.text();
        assert!(text.contains("depth = 0.75 # deep") && text.contains("alpha = 0.125"), "{text}");
        assert!(text.contains("albedo = [0.25, 0.5, 1.0]"), "{text}");
        recipe.material().unwrap();
    }

    #[test]
    fn a_key_that_names_nothing_is_told() {
        for (key, word) in [("depth", "geometry.KEY"), ("surface.flour.brdf.albedo", "`floor`"), ("surface.floor.model", "names no number")]
        {
            let bad = recipe().place(key).unwrap_err();
            assert!(format!("{} {}", bad.problem, bad.remedy).contains(word), "{key}: {bad:?}");
        }
    }
}
