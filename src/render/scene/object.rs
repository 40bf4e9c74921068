//! The objects of a scene: a shape, where it stands, and the materials that cover it.

use super::super::layers::Covering;
use super::super::mesh::LargeMesh;
use super::covering::read_covering;
use super::fields::{LENGTH, required};
use super::material::SceneMaterials;
use super::shape::{Shape, read_shape};
use crate::error::Result;
use crate::toml_reader::{TableReader, range, suggest};
use glam::DVec3;

/// Something large.
#[derive(Clone, Debug)]
pub struct Object {
    /// For messages: `object[0] (sphere)`.
    pub label: String,
    /// Its shape.
    pub shape: Shape,
    /// For each part of the shape its place in [`Scene::materials`](crate::render::Scene::materials).
    pub materials: Vec<usize>,
    /// Turn of the tile about the normal, counter-clockwise seen from outside, radians.
    pub turn: f64,
    /// Whether the back shows the material, too; else it is black.
    pub two_sided: bool,
    /// Periods of the tile a unit of length along its x and y, where the file says so.
    pub periods_per_unit: Option<[f64; 2]>,
    /// Tints, layers over the materials of the parts, and a normal map.
    pub covering: Covering,
}

impl Object {
    pub(super) fn read(index: usize, table: TableReader<'_>, all: &mut SceneMaterials<'_>) -> Result<Self> {
        let (kind, shape) = read_shape(&table)?;
        let material = all.place(&table)?;
        let needs_material = || table.missing("material", "\"my.toml\"");
        let materials = match &shape {
            Shape::Mesh(mesh) => parts(&table, mesh, material, all)?,
            _ => vec![material.ok_or_else(needs_material)?],
        };
        let turn = turn(&table)?;
        let covering = read_covering(&table, &shape, turn, all)?;
        Self::finish(format!("object[{index}] ({kind})"), shape, materials, covering, table)
    }

    /// Reads the table of an object without materials: all of it is covered by the first one of the scene.
    ///
    /// # Errors
    /// Bad input.
    pub fn read_bare(table: TableReader<'_>) -> Result<Self> {
        let (kind, shape) = read_shape(&table)?;
        let parts = if let Shape::Mesh(mesh) = &shape { mesh.parts.len() } else { 1 };
        Self::finish(kind.to_owned(), shape, vec![0; parts], Covering::default(), table)
    }

    /// Reads what all shapes have in common.
    fn finish(label: String, shape: Shape, materials: Vec<usize>, covering: Covering, table: TableReader<'_>) -> Result<Self> {
        let turn = turn(&table)?;
        let two_sided = table.bool("two_sided")?.unwrap_or(false);
        let periods_per_unit = table.array::<2>("periods_per_unit", LENGTH)?;
        table.finish()?;
        Ok(Self { label, shape, materials, turn, two_sided, periods_per_unit, covering })
    }

    /// Places of all materials that may be seen of it, some more than once.
    pub fn all_materials(&self) -> impl Iterator<Item = usize> {
        self.materials.iter().copied().chain(self.covering.materials())
    }

    /// A point in its middle.
    pub fn middle(&self) -> DVec3 {
        match &self.shape {
            Shape::Sphere(sphere) => sphere.center,
            Shape::Cylinder(cylinder) => cylinder.center,
            Shape::Plane(plane) => plane.center,
            Shape::Mesh(mesh) => mesh.middle(),
        }
    }

    /// Whether a point lies inside; planes and open meshes have no inside.
    pub fn contains(&self, point: DVec3) -> bool {
        match &self.shape {
            Shape::Sphere(sphere) => sphere.contains(point),
            Shape::Cylinder(cylinder) => cylinder.contains(point),
            Shape::Plane(_) => false,
            Shape::Mesh(mesh) => mesh.contains(point),
        }
    }
}

/// Turn of the tile about the normal, radians.
fn turn(table: &TableReader<'_>) -> Result<f64> {
    Ok(table.f64("turn_deg", range(-360.0, 360.0))?.unwrap_or(0.0).to_radians())
}

/// The material of each part of a mesh: of its own `[[object.part]]`, else the object's.
fn parts(table: &TableReader<'_>, mesh: &LargeMesh, rest: Option<usize>, materials: &mut SceneMaterials<'_>) -> Result<Vec<usize>> {
    let names: Vec<&str> = mesh.parts.iter().map(String::as_str).collect();
    let mut of_part = vec![None; names.len()];
    for part in table.tables("part")? {
        let name = required(&part, "name", part.str("name")?, "\"handle\"")?;
        let Some(place) = names.iter().position(|n| *n == name) else {
            return Err(part.error_at("name", format!("the mesh has no part \"{name}\""), suggest(name, &names)));
        };
        let Some(material) = materials.place(&part)? else { return Err(part.missing("material", "\"my.toml\"")) };
        if of_part[place].replace(material).is_some() {
            return Err(part.error_at("name", format!("part \"{name}\" is covered twice"), "keep one [[object.part]] for it"));
        }
        part.finish()?;
    }
    let mut covered = Vec::new();
    for (material, name) in of_part.into_iter().zip(&names) {
        match material.or(rest) {
            Some(material) => covered.push(material),
            None => {
                let remedy = format!("add `material` for all the rest, or an [[object.part]] with `name = \"{name}\"`");
                return Err(table.error(format!("no material covers part \"{name}\" of the mesh"), remedy));
            }
        }
    }
    Ok(covered)
}
