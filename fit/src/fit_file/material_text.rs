//! The text of a material file: numbers are written into it, comments stay. For the file that a fit writes; its inner loop sets the numbers
//! of [`biscale::material::MaterialValues`].

use crate::fit_file::assignment::Assignment;
use biscale::error::{BadInput, Error, Result};
use biscale::geometry;
use biscale::geometry::params::{Fallback, Unit, Value};
use biscale::material::{Material, NumberKey};
use biscale::toml_reader::Source;
use std::path::PathBuf;
use toml_edit::{Array, DocumentMut, Item, TableLike, value};

/// A material file, as text that is changed key by key. Comments stay.
#[derive(Clone, Debug)]
pub struct MaterialText {
    path: PathBuf,
    document: DocumentMut,
}

impl MaterialText {
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

    fn tables(&self) -> Vec<&dyn TableLike> {
        match self.document.get("surface") {
            Some(Item::ArrayOfTables(tables)) => tables.iter().map(|t| t as &dyn TableLike).collect(),
            Some(Item::Value(v)) => {
                v.as_array().into_iter().flatten().filter_map(|v| v.as_inline_table()).map(|t| t as &dyn TableLike).collect()
            }
            _ => Vec::new(),
        }
    }

    fn table(&mut self, number: NumberKey) -> Option<&mut dyn TableLike> {
        let surface = match number {
            NumberKey::Geometry(_) => return self.document.get_mut("geometry")?.as_table_like_mut(),
            NumberKey::Brdf { surface, .. } | NumberKey::Tint { surface } => surface,
        };
        let table: &mut dyn TableLike = match self.document.get_mut("surface")? {
            Item::ArrayOfTables(tables) => tables.get_mut(surface)?,
            Item::Value(v) => v.as_array_mut()?.get_mut(surface)?.as_inline_table_mut()?,
            _ => return None,
        };
        if matches!(number, NumberKey::Brdf { .. }) { table.get_mut("brdf")?.as_table_like_mut() } else { Some(table) }
    }

    /// The key in its own table.
    fn last_key(number: NumberKey) -> &'static str {
        match number {
            NumberKey::Geometry(key) | NumberKey::Brdf { key, .. } => key,
            NumberKey::Tint { .. } => "tint",
        }
    }

    /// The number that stands there, if one does.
    pub fn number(&mut self, key: NumberKey) -> Option<f64> {
        let item = self.table(key)?.get(Self::last_key(key))?;
        #[expect(clippy::cast_precision_loss, reason = "numbers of a material are small")]
        item.as_float().or_else(|| item.as_integer().map(|i| i as f64))
    }

    /// Writes values, each where it stands; a key that is not there yet is added.
    pub fn write(&mut self, assignments: &[Assignment]) {
        for assignment in assignments {
            match *assignment {
                Assignment::Number(key, number) => self.put(key, value(number)),
                Assignment::Whole(key, count) => self.put(NumberKey::Geometry(key), value(i64::from(count))),
                Assignment::Colour(key, colour) => {
                    let mut array = Array::new();
                    array.extend(colour);
                    self.put(key, value(array));
                }
            }
        }
    }

    fn put(&mut self, number: NumberKey, item: Item) {
        let key = Self::last_key(number);
        let Some(table) = self.table(number) else { return };
        match (table.get_mut(key), item) {
            // What surrounds the value, a comment at its end, stays.
            (Some(Item::Value(old)), Item::Value(mut new)) => {
                *new.decor_mut() = old.decor().clone();
                *old = new;
            }
            (_, item) => {
                table.insert(key, item);
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

    /// Multiplies all lengths of the geometry, which is of this `kind`.
    pub fn scale_lengths(&mut self, kind: &str, factor: f64) {
        let params = geometry::describe(kind).map_or(&[][..], |d| d.params);
        for param in params {
            let key = NumberKey::Geometry(param.key);
            match param.value {
                // A length that is not written and has a fixed default must be written to be scaled.
                Value::Number { unit: Unit::Length, default, .. } => {
                    let fixed = if let Fallback::Fixed(v) = default { Some(v) } else { None };
                    if let Some(length) = self.number(key).or(fixed) {
                        self.put(key, value(length * factor));
                    }
                }
                // A mesh's own period is in the lengths of its file, which `scale` scales.
                Value::Pair { unit: Unit::Length, .. } if kind != "mesh" => {
                    let Some(table) = self.table(key) else { continue };
                    let pair: Option<Vec<f64>> = table
                        .get(param.key)
                        .and_then(Item::as_array)
                        .map(|a| a.iter().filter_map(|v| v.as_float().or_else(|| v.as_integer().map(|i| i as f64))).collect());
                    if let Some([x, y]) = pair.as_deref() {
                        let mut array = Array::new();
                        array.extend([x * factor, y * factor]);
                        self.put(key, value(array));
                    }
                }
                _ => {}
            }
        }
        if kind == "mesh" {
            // The triangles of a file are scaled by a factor of their own.
            let key = NumberKey::Geometry("scale");
            let own = self.number(key).unwrap_or(1.0);
            self.put(key, value(own * factor));
        }
    }

    /// Names the material.
    pub fn set_name(&mut self, name: &str) {
        self.document["name"] = value(name);
    }

    /// Says how many reflections after the first its look includes; 0, which is what a file without the key means, takes the key out.
    pub fn set_bounces(&mut self, bounces: u32) {
        match (bounces, self.document.get_mut("bounces")) {
            (0, _) => {
                self.document.remove("bounces");
            }
            (_, Some(Item::Value(old))) => {
                let decor = old.decor().clone();
                *old = i64::from(bounces).into();
                *old.decor_mut() = decor;
            }
            (_, _) => self.document["bounces"] = value(i64::from(bounces)),
        }
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
            for (number, key) in [(NumberKey::Tint { surface }, "tint"), (NumberKey::Brdf { surface, key: "file" }, "file")] {
                self.table(number).and_then(|t| t.get_mut(key)).into_iter().for_each(absolute);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit_file::assignment::assign;
    use biscale::material::MaterialValues;

    const TEXT: &str = "format = 1\n[geometry]\nkind = \"grooves\" # V\ndepth = 0.5 # deep\n[[surface]]\npart = \"floor\"\n\
                        brdf = { model = \"lambert\", albedo = 0.5 }\n[[surface]]\npart = \"*\"\ntint = [1, 1, 1]\n\
                        brdf = { model = \"ward\", specular = 0.1, alpha = 0.2 }\n";

    #[test]
    fn bounces_are_set_changed_and_taken_out() {
        let text = |head: &str| MaterialText::new(&Source { path: "m.toml".into(), text: format!("{head}{TEXT}") }).unwrap();
        for (head, bounces, written) in [
            ("", 4, "format = 1\nbounces = 4\n[geometry]"),
            ("bounces = 2 # white\n", 4, "bounces = 4 # white\nformat = 1\n[geometry]"),
            ("bounces = 2 # white\n", 0, "format = 1\n[geometry]"),
            ("", 0, "format = 1\n[geometry]"),
        ] {
            let mut text = text(head);
            text.set_bounces(bounces);
            assert!(text.text().starts_with(written), "{}", text.text());
            assert_eq!(text.material().unwrap().bounces, bounces);
        }
    }

    #[test]
    fn numbers_change_and_comments_stay() {
        let source = Source { path: "m.toml".into(), text: TEXT.to_owned() };
        let mut text = MaterialText::new(&source).unwrap();
        let values = MaterialValues::parse(&source).unwrap();
        let number = |key: &str| values.number_key(key).unwrap();
        assert_eq!(text.number(number("geometry.depth")), Some(0.5));
        let assignments = [
            Assignment::Number(number("geometry.depth"), 0.75),
            Assignment::Number(number("surface.*.brdf.alpha"), 0.125),
            Assignment::Colour(number("surface.floor.brdf.albedo"), [0.25, 0.5, 1.0]),
        ];
        text.write(&assignments);
        let written = text.text();
        assert!(written.contains("depth = 0.75 # deep") && written.contains("alpha = 0.125"), "{written}");
        assert!(written.contains("albedo = [0.25, 0.5, 1.0]"), "{written}");
        // What the inner loop sees and what is written are the same material.
        let mut typed = values;
        assign(&mut typed, &assignments).unwrap();
        let shown = |m: &Material| format!("{:?} {:?}", m.geometry, m.surfaces.iter().map(|s| (&s.brdf, &s.tint)).collect::<Vec<_>>());
        assert_eq!(shown(&typed.material().unwrap()), shown(&text.material().unwrap()));
    }
}
