//! The materials of a scene, each loaded and built once.

use crate::error::Result;
use crate::material::{Material, SmallScale};
use crate::toml_reader::TableReader;
use std::path::Path;

/// A material of the scene.
#[derive(Clone, Debug)]
pub struct SceneMaterial {
    /// Its file.
    pub material: Material,
    /// Its surface.
    pub small: SmallScale,
}

/// Material files so far, each loaded once.
pub(super) struct SceneMaterials<'a> {
    pub loaded: Vec<SceneMaterial>,
    /// What the next object takes in the place of its own.
    pub instead: Option<&'a Path>,
}

impl SceneMaterials<'_> {
    /// Place of the material that a table names, if it names one.
    pub fn place(&mut self, table: &TableReader<'_>) -> Result<Option<usize>> {
        let Some(path) = table.path("material")? else { return Ok(None) };
        let path = self.instead.take().map_or(path, Path::to_path_buf);
        if let Some(place) = self.loaded.iter().position(|m| m.material.file == path) {
            return Ok(Some(place));
        }
        let material = Material::load(&path)?;
        let small = material.build()?;
        self.loaded.push(SceneMaterial { material, small });
        Ok(Some(self.loaded.len() - 1))
    }
}
