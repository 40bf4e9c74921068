//! Reading a material file.

use super::recipe::{MAX_BOUNCES, Material, UNITS};
use super::surface::Surface;
use super::values::MaterialValues;
use crate::error::Result;
use crate::geometry::Geometry;
use crate::toml_reader::{Source, TableReader};
use std::path::Path;

impl Material {
    /// Reads and checks a material file.
    ///
    /// ```
    /// use biscale::Material;
    ///
    /// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
    /// let material = Material::load(path.as_ref())?;
    /// assert_eq!((material.name.as_str(), material.unit, material.surfaces.len()), ("pyramids", "um", 1));
    ///
    /// // A mistake says where it stands and what would be right.
    /// let error = Material::load("no-such-file.toml".as_ref()).unwrap_err();
    /// assert!(error.to_string().starts_with("no-such-file.toml: there is no such file"));
    /// # Ok::<(), biscale::Error>(())
    /// ```
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(&Source::read(path)?)
    }

    /// Checks the text of a material file; paths in it are relative to `source.path`.
    pub fn parse(source: &Source) -> Result<Self> {
        MaterialValues::parse(source)?.material()
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
        // The micro sign and the Greek letter.
        let micrometre = matches!(top.str("unit")?, Some("\u{b5}m" | "\u{3bc}m"));
        let unit = if micrometre { UNITS[1] } else { UNITS[top.choice("unit", &UNITS.map(|(unit, _)| unit))?.unwrap_or(2)] };
        let bounces = top.integer("bounces", 0, MAX_BOUNCES)?.unwrap_or(0);
        let Some(table) = top.table("geometry")? else {
            return Err(top.no_table(
                "geometry",
                "there is no [geometry] table",
                "add one with `kind = ...`; `biscale new` writes an example",
            ));
        };
        let geometry = Geometry::values(table)?;
        let tables = top.tables("surface")?;
        if tables.is_empty() {
            return Err(top.no_table("surface", "there is no [[surface]] table", "add one with `part = \"*\"` and a `brdf`"));
        }
        let surfaces = tables.into_iter().map(Surface::read).collect::<Result<Vec<_>>>()?;
        top.finish()?;
        Ok(Self { file: source.path.clone(), name, unit, bounces, geometry, surfaces })
    }
}
