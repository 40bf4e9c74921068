//! Scene files: TOML in, a [`Scene`] out, with all that it names loaded and checked.
//!
//! The format is documented in `docs/scenes.md`; every mistake names file, line, field, value and remedy.

use super::environment::Environment;
use super::mesh::{LargeMesh, Placement, Tangents};
use super::shapes::{Cylinder, Plane, Sphere};
use crate::error::{BadInput, Result};
use crate::material::{Material, SmallScale};
use crate::toml_reader::{Range, Source, TableReader, range, suggest};
use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot};
use std::path::{Path, PathBuf};

/// Most pixels across or down.
pub const MAX_SIDE: u32 = 8192;
/// Most pixels of a picture.
pub const MAX_PIXELS: u32 = 1 << 24;
/// Most samples of a pixel.
pub const MAX_SAMPLES: u32 = 1024;
/// Most directional lights that stand for an environment.
pub const MAX_LIGHTS: u32 = 4096;
/// Most objects.
const MAX_OBJECTS: usize = 256;
/// Lengths and positions of the large scale.
const PLACE: Range = range(-1e6, 1e6);
const LENGTH: Range = range(1e-6, 1e6);
/// Radiometric quantities.
const LIGHT: Range = range(0.0, 1e9);

/// A scene file, read and checked.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file it came from.
    pub file: PathBuf,
    /// The name that the file gives, or the file's own.
    pub name: String,
    /// Who looks.
    pub camera: Camera,
    /// Lights of the file, without those of the environment.
    pub lights: Vec<Light>,
    /// Light from all around.
    pub environment: Option<Surroundings>,
    /// Radiance where nothing is seen, unless the environment shows.
    pub background: [f64; 3],
    /// What is seen.
    pub objects: Vec<Object>,
    /// The materials of the objects, each once.
    pub materials: Vec<SceneMaterial>,
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub origin: DVec3,
    /// Unit vectors right, up and forward.
    pub axes: DMat3,
    /// Tangent of half the angle of view across x.
    pub half_width: f64,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples of a pixel.
    pub samples: u32,
}

/// A light of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// From so far away that its rays are parallel.
    Directional {
        /// Unit vector to the light.
        to_light: DVec3,
        /// On a plane that faces it.
        irradiance: [f64; 3],
    },
    /// From one point, equally to all sides.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity: irradiance times squared distance.
        intensity: [f64; 3],
    },
}

/// An environment map and how it is used.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// The map.
    pub map: Environment,
    /// Directional lights that stand for it.
    pub lights: u32,
    /// Whether it shows as background.
    pub visible: bool,
}

/// A material of the scene.
#[derive(Clone, Debug)]
pub struct SceneMaterial {
    /// Its file.
    pub material: Material,
    /// Its surface.
    pub small: SmallScale,
}

/// Something large.
#[derive(Clone, Debug)]
pub struct Object {
    /// For messages: `object[0] (sphere)`.
    pub label: String,
    /// Its shape.
    pub shape: Shape,
    /// For each part of the shape its place in [`Scene::materials`].
    pub materials: Vec<usize>,
    /// Turn of the tile about the normal, counter-clockwise seen from outside, radians.
    pub turn: f64,
    /// Whether the back shows the material, too; else it is black.
    pub two_sided: bool,
    /// Periods of the tile a unit of length along its x and y, where the file says so.
    pub periods_per_unit: Option<[f64; 2]>,
}

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

/// Kinds of objects.
const KINDS: [&str; 4] = ["sphere", "cylinder", "plane", "mesh"];
/// Kinds of lights.
const LIGHTS: [&str; 2] = ["directional", "point"];
/// Where the tile's x lies on a mesh.
const TANGENTS: [&str; 2] = ["uv", "around"];

impl Scene {
    /// Reads and checks a scene file and all that it names.
    ///
    /// # Errors
    /// Bad input, by file, line and field; those of the materials and meshes.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(&Source::read(path)?)
    }

    /// Whether this text is that of a scene and not of a material: it has a camera or an object.
    pub fn is_scene(source: &Source) -> bool {
        source.parse().is_ok_and(|root| {
            let table = root.get_ref();
            !table.contains_key("geometry") && ["camera", "object", "light", "environment"].iter().any(|k| table.contains_key(*k))
        })
    }

    /// Checks the text of a scene file; paths in it are relative to `source.path`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(source: &Source) -> Result<Self> {
        Self::parse_with(source, None)
    }

    /// As [`Self::parse`], with the material file `instead` in the place of the first object's own.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse_with(source: &Source, instead: Option<&Path>) -> Result<Self> {
        let root = source.parse()?;
        let top = TableReader::new(source, "", root.get_ref(), 0);
        let name = top.head()?;
        let Some(table) = top.table("camera")? else {
            return Err(top.error("there is no [camera] table", "add one; `biscale new scene` writes an example"));
        };
        let camera_at = (table.line(), "camera.origin");
        let camera = Camera::read(table)?;
        let lights = top.tables("light")?.into_iter().map(Light::read).collect::<Result<Vec<_>>>()?;
        let environment = top.table("environment")?.map(Surroundings::read).transpose()?;
        if lights.len() > MAX_LIGHTS as usize {
            return Err(top.error_at("light", format!("there are {} lights", lights.len()), format!("at most {MAX_LIGHTS} are possible")));
        }
        if lights.is_empty() && environment.is_none() {
            return Err(top.error("there is no light", "add a [[light]] or an [environment]"));
        }
        let background = top.colour("background", LIGHT)?;
        if background.is_some() && environment.as_ref().is_some_and(|e| e.visible) {
            return Err(top.error_at("background", "the environment shows as background", "remove one of the two"));
        }
        let tables = top.tables("object")?;
        if tables.is_empty() {
            return Err(top.error("there is no [[object]]", "add one with a `kind` and a `material`"));
        }
        if tables.len() > MAX_OBJECTS {
            let problem = format!("there are {} objects", tables.len());
            return Err(top.error_at("object", problem, format!("at most {MAX_OBJECTS} are possible")));
        }
        let mut materials = Materials { loaded: Vec::new(), instead };
        let mut objects = Vec::new();
        for (index, table) in tables.into_iter().enumerate() {
            objects.push(Object::read(index, table, &mut materials)?);
            materials.instead = None;
        }
        top.finish()?;
        let scene = Self {
            file: source.path.clone(),
            name,
            camera,
            lights,
            environment,
            background: background.unwrap_or_default(),
            objects,
            materials: materials.loaded,
        };
        if let Some(object) = scene.objects.iter().find(|o| o.contains(camera.origin)) {
            let o = camera.origin;
            let problem = format!("the camera at ({}, {}, {}) is inside of {}", o.x, o.y, o.z, object.label);
            let bad = BadInput::new(problem, "move it outside");
            return Err(bad.in_file(&source.path).at_line(camera_at.0).at_field(camera_at.1).into());
        }
        Ok(scene)
    }
}

/// Three numbers as a unit vector.
fn unit_vector(table: &TableReader<'_>, key: &'static str) -> Result<Option<DVec3>> {
    let Some(v) = table.array::<3>(key, PLACE)? else { return Ok(None) };
    match DVec3::from(v).try_normalize() {
        Some(unit) => Ok(Some(unit)),
        None => Err(table.error_at(key, "the vector has no length", "write a direction")),
    }
}

fn required<T>(table: &TableReader<'_>, key: &str, value: Option<T>, example: &str) -> Result<T> {
    value.ok_or_else(|| table.missing(key, example))
}

impl Camera {
    /// Reads a `[camera]` table.
    ///
    /// # Errors
    /// Bad input.
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let point = |key| table.array::<3>(key, PLACE).map(|v| v.map(DVec3::from));
        let origin = required(&table, "origin", point("origin")?, "[0.0, -5.0, 0.0]")?;
        let target = required(&table, "target", point("target")?, "[0.0, 0.0, 0.0]")?;
        let up = unit_vector(&table, "up")?.unwrap_or(DVec3::Z);
        let fov = required(&table, "fov_deg", table.f64("fov_deg", range(0.001, 170.0))?, "30.0")?;
        let width = required(&table, "width", table.integer("width", 1, MAX_SIDE)?, "384")?;
        let height = required(&table, "height", table.integer("height", 1, MAX_SIDE)?, "384")?;
        if width * height > MAX_PIXELS {
            let problem = format!("the picture has {width} x {height} pixels");
            return Err(table.error_at("width", problem, format!("at most {MAX_PIXELS} in all are possible")));
        }
        let samples = table.integer("samples", 1, MAX_SAMPLES)?.unwrap_or(4);
        let Some(forward) = (target - origin).try_normalize() else {
            return Err(table.error_at("target", "the camera looks at the place where it stands", "move target or origin"));
        };
        let Some(right) = forward.cross(up).try_normalize().filter(|_| forward.cross(up).length() > 1e-6) else {
            return Err(table.error_at("up", "the camera looks along its own up", "write another direction"));
        };
        table.finish()?;
        let axes = DMat3::from_cols(right, right.cross(forward), forward);
        Ok(Self { origin, axes, half_width: (0.5 * fov.to_radians()).tan(), width, height, samples })
    }

    /// The unit direction through the place `x`, `y` of the picture in pixels from its upper left corner.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let across = (2.0 * x / width - 1.0) * self.half_width;
        let up = (1.0 - 2.0 * y / height) * self.half_width * height / width;
        (self.axes * DVec3::new(across, up, 1.0)).normalize()
    }

    /// Width of a pixel at a distance along the camera's axis.
    pub fn pixel_width(&self, distance: f64) -> f64 {
        2.0 * self.half_width * distance / f64::from(self.width)
    }
}

impl Light {
    /// Reads a `[[light]]` table.
    ///
    /// # Errors
    /// Bad input.
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let kind = required(&table, "type", table.choice("type", &LIGHTS)?, "\"directional\"")?;
        let light = if LIGHTS[kind] == "directional" {
            let to_light = required(&table, "to_light", unit_vector(&table, "to_light")?, "[0.0, -1.0, 1.0]")?;
            let irradiance = required(&table, "irradiance_rgb", table.colour("irradiance_rgb", LIGHT)?, "[3.14, 3.14, 3.14]")?;
            Self::Directional { to_light, irradiance }
        } else {
            let position = required(&table, "position", table.array::<3>("position", PLACE)?, "[0.0, -3.0, 3.0]")?.into();
            let intensity = required(&table, "intensity_rgb", table.colour("intensity_rgb", LIGHT)?, "[10.0, 10.0, 10.0]")?;
            Self::Point { position, intensity }
        };
        table.finish()?;
        Ok(light)
    }
}

impl Surroundings {
    fn read(table: TableReader<'_>) -> Result<Self> {
        let file = required(&table, "file", table.path("file")?, "\"studio.hdr\"")?;
        let rotation = table.f64("rotation_deg", range(-360.0, 360.0))?.unwrap_or(0.0).to_radians();
        let scale = table.f64("scale", range(1e-9, 1e9))?.unwrap_or(1.0);
        let lights = table.integer("lights", 1, MAX_LIGHTS)?.unwrap_or(32);
        let visible = table.bool("visible")?.unwrap_or(false);
        table.finish()?;
        Ok(Self { map: Environment::load(&file, rotation, scale)?, lights, visible })
    }
}

/// Material files so far, each loaded once.
struct Materials<'a> {
    loaded: Vec<SceneMaterial>,
    /// What the next object takes in the place of its own.
    instead: Option<&'a Path>,
}

impl Materials<'_> {
    fn place(&mut self, table: &TableReader<'_>) -> Result<Option<usize>> {
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

impl Object {
    fn read(index: usize, table: TableReader<'_>, materials: &mut Materials<'_>) -> Result<Self> {
        let (kind, shape) = read_shape(&table)?;
        let material = materials.place(&table)?;
        let needs_material = || table.missing("material", "\"my.toml\"");
        let materials = match &shape {
            Shape::Mesh(mesh) => parts(&table, mesh, material, materials)?,
            _ => vec![material.ok_or_else(needs_material)?],
        };
        Self::finish(format!("object[{index}] ({kind})"), shape, materials, table)
    }

    /// Reads the table of an object without materials: all of it is covered by the first one of the scene.
    ///
    /// # Errors
    /// Bad input.
    pub fn read_bare(table: TableReader<'_>) -> Result<Self> {
        let (kind, shape) = read_shape(&table)?;
        let parts = if let Shape::Mesh(mesh) = &shape { mesh.parts.len() } else { 1 };
        Self::finish(kind.to_owned(), shape, vec![0; parts], table)
    }

    /// Reads what all shapes have in common.
    fn finish(label: String, shape: Shape, materials: Vec<usize>, table: TableReader<'_>) -> Result<Self> {
        let turn = table.f64("turn_deg", range(-360.0, 360.0))?.unwrap_or(0.0).to_radians();
        let two_sided = table.bool("two_sided")?.unwrap_or(false);
        let periods_per_unit = table.array::<2>("periods_per_unit", LENGTH)?;
        table.finish()?;
        Ok(Self { label, shape, materials, turn, two_sided, periods_per_unit })
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

/// The shape that a table describes, and its kind.
fn read_shape(table: &TableReader<'_>) -> Result<(&'static str, Shape)> {
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
    Ok(table.array::<3>("center", PLACE)?.map_or(DVec3::ZERO, DVec3::from))
}

fn radius(table: &TableReader<'_>) -> Result<f64> {
    required(table, "radius", table.f64("radius", LENGTH)?, "1.0")
}

fn axis(table: &TableReader<'_>) -> Result<DVec3> {
    Ok(unit_vector(table, "axis")?.unwrap_or(DVec3::Z))
}

fn read_plane(table: &TableReader<'_>) -> Result<Plane> {
    let normal = unit_vector(table, "normal")?.unwrap_or(DVec3::Z);
    let x = unit_vector(table, "x_axis")?.unwrap_or(if normal.x.abs() < 0.9 { DVec3::X } else { DVec3::Y });
    let Some(x) = (x - x.dot(normal) * normal).try_normalize().filter(|_| x.cross(normal).length() > 1e-6) else {
        return Err(table.error_at("x_axis", "x_axis and normal are parallel", "write a direction in the plane"));
    };
    let size = required(table, "size", table.array::<2>("size", LENGTH)?, "[2.0, 2.0]")?;
    Ok(Plane { center: center(table)?, frame: DMat3::from_cols(x, normal.cross(x), normal), size })
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

/// The material of each part of a mesh: of its own `[[object.part]]`, else the object's.
fn parts(table: &TableReader<'_>, mesh: &LargeMesh, rest: Option<usize>, materials: &mut Materials<'_>) -> Result<Vec<usize>> {
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

/// A scene file with every key, for `biscale new scene`.
pub const TEMPLATE: &str = include_str!("scene_template.toml");

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Scene> {
        let folder = tempfile::tempdir().unwrap();
        let material =
            "format = 1\n[geometry]\nkind = \"grooves\"\n[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n";
        std::fs::write(folder.path().join("material.toml"), material).unwrap();
        std::fs::write(folder.path().join("two.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\ng a\nf 1 2 3\ng b\nf 1 3 2\n").unwrap();
        Scene::parse(&Source { path: folder.path().join("scene.toml"), text: text.to_owned() })
    }

    const GOOD: &str = "format = 1\n[camera]\norigin = [0, -5, 0]\ntarget = [0, 0, 0]\nfov_deg = 30\nwidth = 8\nheight = 4\n\
                        [[light]]\ntype = \"directional\"\nto_light = [0, -1, 1]\nirradiance_rgb = 1\n\
                        [[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"material.toml\"\n";

    #[test]
    fn the_camera_has_y_up_and_its_angle_across_x() {
        let camera = parse(GOOD).unwrap().camera;
        assert!(camera.direction(4.0, 2.0).distance(DVec3::Y) < 1e-12);
        let edge = camera.direction(8.0, 2.0);
        assert!((edge.x / edge.y - 15.0_f64.to_radians().tan()).abs() < 1e-12 && edge.z.abs() < 1e-12, "{edge}");
        let corner = camera.direction(0.0, 0.0);
        assert!(corner.x < 0.0 && (corner.z / corner.y - 0.5 * 15.0_f64.to_radians().tan()).abs() < 1e-12, "{corner}");
    }

    #[test]
    fn parts_of_a_mesh_take_their_own_material_or_the_objects() {
        let mesh = GOOD.replace("kind = \"sphere\"\nradius = 1\n", "kind = \"mesh\"\nfile = \"two.obj\"\n");
        let with = |text: &str| parse(&(mesh.clone() + text));
        assert_eq!(with("").unwrap().objects[0].materials, [0, 0]);
        let part = "[[object.part]]\nname = \"b\"\nmaterial = \"material.toml\"\n";
        assert_eq!(with(part).unwrap().objects[0].materials, [0, 0]);
        for (text, word) in [
            (part.replace("\"b\"", "\"c\""), "no part \"c\""),
            (format!("{part}{part}"), "covered twice"),
            (part.replace("name = \"b\"\n", ""), "lacks the required key `name`"),
        ] {
            let message = with(&text).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        let bare = mesh.replace("material = \"material.toml\"\n", "") + part;
        let message = parse(&bare).unwrap_err().to_string();
        assert!(message.contains("no material covers part \"a\""), "{message}");
    }

    #[test]
    fn the_template_is_a_good_scene() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(folder.path().join("material.toml"), crate::geometry::template("grooves").unwrap()).unwrap();
        let scene = Scene::parse(&Source { path, text: TEMPLATE.to_owned() }).unwrap();
        assert_eq!((scene.objects.len(), scene.lights.len()), (2, 1));
    }

    #[test]
    fn a_camera_inside_of_an_object_is_refused() {
        for (object, inside) in [
            ("kind = \"sphere\"\nradius = 5.1\n", true),
            ("kind = \"sphere\"\nradius = 4.9\n", false),
            ("kind = \"cylinder\"\nradius = 5.1\nheight = 1\n", true),
            ("kind = \"cylinder\"\nradius = 5.1\nheight = 1\ncenter = [0, 0, 1]\n", false),
        ] {
            let result = parse(&GOOD.replace("kind = \"sphere\"\nradius = 1\n", object));
            match result {
                Ok(_) => assert!(!inside, "{object} accepted"),
                Err(error) => assert!(inside && error.to_string().contains("camera.origin: the camera"), "{object}: {error}"),
            }
        }
    }
}
