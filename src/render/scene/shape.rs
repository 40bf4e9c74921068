//! The shapes of objects, as a scene file describes them.

use super::super::mesh::{LargeMesh, Placement, Tangents};
use super::super::shapes::{Cylinder, Plane, Sphere};
use super::fields::{LENGTH, POSITION, required, unit_vector};
use crate::error::Result;
use crate::toml_reader::{TableReader, range};
use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot};

/// Kinds of objects.
const KINDS: [&str; 4] = ["sphere", "cylinder", "plane", "mesh"];
/// Where the tile's x lies on a mesh.
const TANGENTS: [&str; 2] = ["uv", "around"];

/// The shape of an object.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A ball.
    Sphere(Sphere),
    /// The side of a cylinder.
    Cylinder(Cylinder),
    /// A rectangle.
    Plane(Plane),
    /// Triangles.
    Mesh(Box<LargeMesh>),
}

/// The shape that a table describes, and its kind.
pub(super) fn read_shape(table: &TableReader<'_>) -> Result<(&'static str, Shape)> {
    let kind = KINDS[required(table, "kind", table.choice("kind", &KINDS)?, "\"sphere\"")?];
    let shape = match kind {
        "sphere" => Shape::Sphere(Sphere { center: center(table)?, radius: radius(table)?, axis: axis(table)? }),
        "cylinder" => {
            let height = required(table, "height", table.f64("height", LENGTH)?, "2.0")?;
            Shape::Cylinder(Cylinder { center: center(table)?, radius: radius(table)?, height, axis: axis(table)? })
        }
        "plane" => Shape::Plane(read_plane(table)?),
        _ => Shape::Mesh(Box::new(read_mesh(table)?)),
    };
    Ok((kind, shape))
}

fn center(table: &TableReader<'_>) -> Result<DVec3> {
    Ok(table.array::<3>("center", POSITION)?.map_or(DVec3::ZERO, DVec3::from))
}

fn radius(table: &TableReader<'_>) -> Result<f64> {
    required(table, "radius", table.f64("radius", LENGTH)?, "1.0")
}

fn axis(table: &TableReader<'_>) -> Result<DVec3> {
    Ok(unit_vector(table, "axis")?.unwrap_or(DVec3::Z))
}

/// The frame of a plane by its normal, default z, and a direction of its x, default the world's.
pub(super) fn plane_frame(table: &TableReader<'_>, normal_key: &'static str, x_key: &'static str) -> Result<DMat3> {
    let normal = unit_vector(table, normal_key)?.unwrap_or(DVec3::Z);
    let x = unit_vector(table, x_key)?.unwrap_or(if normal.x.abs() < 0.9 { DVec3::X } else { DVec3::Y });
    let Some(x) = (x - x.dot(normal) * normal).try_normalize().filter(|_| x.cross(normal).length() > 1e-6) else {
        return Err(table.error_at(x_key, format!("{x_key} and {normal_key} are parallel"), "write a direction in the plane"));
    };
    Ok(DMat3::from_cols(x, normal.cross(x), normal))
}

fn read_plane(table: &TableReader<'_>) -> Result<Plane> {
    let frame = plane_frame(table, "normal", "x_axis")?;
    let size = required(table, "size", table.array::<2>("size", LENGTH)?, "[2.0, 2.0]")?;
    Ok(Plane { center: center(table)?, frame, size })
}

fn read_mesh(table: &TableReader<'_>) -> Result<LargeMesh> {
    let file = required(table, "file", table.path("file")?, "\"model.obj\"")?;
    let scale = table.f64("scale", range(1e-9, 1e9))?.unwrap_or(1.0);
    let [x, y, z] = table.array::<3>("rotate_deg", range(-360.0, 360.0))?.unwrap_or_default().map(f64::to_radians);
    // Turned about x first, then y, then z, all of them the world's.
    let rotation = DQuat::from_euler(EulerRot::XYZEx, x, y, z);
    let center = center(table)?;
    let transform = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), rotation, center);
    let crease = table.f64("crease_deg", range(0.0, 180.0))?.unwrap_or(45.0).to_radians();
    let around = Tangents::Around { center, axis: axis(table)? };
    let tangents = table.choice("tangents", &TANGENTS)?.map(|k| if TANGENTS[k] == "uv" { Tangents::Uv } else { around });
    let tangents = tangents.or(table.has("axis").then_some(around));
    LargeMesh::load(&file, &Placement { transform, crease, tangents })
}
