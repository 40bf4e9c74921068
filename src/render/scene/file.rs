//! A scene file as a whole.

use super::camera::Camera;
use super::exposure::Exposure;
use super::fields::LIGHT;
use super::light::{Light, MAX_LIGHTS, Surroundings};
use super::material::{SceneMaterial, SceneMaterials};
use super::object::Object;
use crate::error::{BadInput, Result};
use crate::toml_reader::{Source, TableReader};
use std::path::{Path, PathBuf};

/// Most objects.
///
/// Chosen, not measured: every ray asks every object, so that time grows with their number; a mesh with its hierarchy counts as one.
const MAX_OBJECTS: usize = 256;

/// A scene file with every key, for `biscale new scene`.
pub const SCENE_TEMPLATE: &str = include_str!("template.toml");

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
    /// How bright images of bytes are made.
    pub exposure: Exposure,
    /// Light from all around.
    pub environment: Option<Surroundings>,
    /// Radiance where nothing is seen, unless the environment shows.
    pub background: [f64; 3],
    /// What is seen.
    pub objects: Vec<Object>,
    /// The materials of the objects, each once.
    pub materials: Vec<SceneMaterial>,
}

impl Scene {
    /// Reads and checks a scene file and all that it names.
    ///
    /// # Errors
    /// Bad input, by file, line and field; those of the materials and meshes.
    ///
    /// ```
    /// use biscale::render::{Scene, Shape};
    ///
    /// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/scenes/ball.toml");
    /// let scene = Scene::load(path.as_ref())?;
    /// assert!(matches!(scene.objects[0].shape, Shape::Sphere(_)));
    /// // Its silk, and the paper of the floor.
    /// assert_eq!(scene.materials.len(), 2);
    /// # Ok::<(), biscale::Error>(())
    /// ```
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
            return Err(top.no_table("camera", "there is no [camera] table", "add one; `biscale new scene` writes an example"));
        };
        let camera_at = (table.line(), "camera.origin");
        let camera = Camera::read(table)?;
        let lights = top.tables("light")?.into_iter().map(Light::read).collect::<Result<Vec<_>>>()?;
        let environment = top.table("environment")?.map(Surroundings::read).transpose()?;
        if lights.len() > MAX_LIGHTS as usize {
            return Err(top.error_at("light", format!("there are {} lights", lights.len()), format!("at most {MAX_LIGHTS} are possible")));
        }
        if lights.is_empty() && environment.is_none() {
            return Err(top.no_table("light", "there is no light", "add a [[light]] or an [environment]"));
        }
        let background = top.colour("background", LIGHT)?;
        if background.is_some() && environment.as_ref().is_some_and(|e| e.visible) {
            return Err(top.error_at("background", "the environment shows as background", "remove one of the two"));
        }
        let exposure = Exposure::read(&top)?;
        let tables = top.tables("object")?;
        if tables.is_empty() {
            return Err(top.no_table("object", "there is no [[object]]", "add one with a `kind` and a `material`"));
        }
        if tables.len() > MAX_OBJECTS {
            let problem = format!("there are {} objects", tables.len());
            return Err(top.error_at("object", problem, format!("at most {MAX_OBJECTS} are possible")));
        }
        let mut materials = SceneMaterials { loaded: Vec::new(), instead };
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
            exposure,
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

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
        let scene = Scene::parse(&Source { path, text: SCENE_TEMPLATE.to_owned() }).unwrap();
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
