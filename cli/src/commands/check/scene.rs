//! What `biscale check` says of a scene file.

use biscale::render::{Light, Scene, Shape};
use serde::Serialize;
use std::fmt;

/// What a good scene file means.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    kind: &'static str,
    name: String,
    width: u32,
    height: u32,
    samples: u32,
    /// Lights of the file.
    directional_lights: usize,
    point_lights: usize,
    /// Directional lights that stand for the environment.
    environment_lights: u32,
    objects: Vec<Object>,
    /// What `render` would run.
    would_run: String,
}

#[derive(Clone, Debug, Serialize)]
struct Object {
    object: String,
    /// Triangles of a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<usize>,
    /// Parts with their materials.
    parts: Vec<Part>,
}

#[derive(Clone, Debug, Serialize)]
struct Part {
    #[serde(skip_serializing_if = "Option::is_none")]
    part: Option<String>,
    material: String,
    file: String,
}

impl Report {
    /// Describes a scene; `would_run` is how its materials would be computed.
    pub fn of(scene: &Scene, would_run: &str) -> Self {
        let objects = scene.objects.iter().map(|object| {
            let names: Vec<Option<String>> = match &object.shape {
                Shape::Mesh(mesh) => mesh.parts.iter().cloned().map(Some).collect(),
                _ => vec![None],
            };
            let triangles = if let Shape::Mesh(mesh) = &object.shape { Some(mesh.len()) } else { None };
            let part = |(part, &material): (Option<String>, &usize)| {
                let material = &scene.materials[material].material;
                Part { part, material: material.name.clone(), file: material.file.display().to_string() }
            };
            let parts = names.into_iter().zip(&object.materials).map(part).collect();
            Object { object: object.label.clone(), triangles, parts }
        });
        let points = scene.lights.iter().filter(|l| matches!(l, Light::Point { .. })).count();
        Self {
            kind: "scene",
            name: scene.name.clone(),
            width: scene.camera.width,
            height: scene.camera.height,
            samples: scene.camera.samples,
            directional_lights: scene.lights.len() - points,
            point_lights: points,
            environment_lights: scene.environment.as_ref().map_or(0, |e| e.lights),
            objects: objects.collect(),
            would_run: would_run.to_owned(),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, samples, directional_lights, point_lights, environment_lights, .. } = self;
        writeln!(f, "  name      {}", self.name)?;
        writeln!(f, "  picture   {width} x {height} pixels of {samples} samples")?;
        writeln!(f, "  lights    {directional_lights} directional, {point_lights} point, {environment_lights} for the environment")?;
        for Object { object, triangles, parts } in &self.objects {
            let triangles = triangles.map_or(String::new(), |n| format!(", {n} triangles"));
            writeln!(f, "  object    {object}{triangles}")?;
            for Part { part, material, file } in parts {
                let part = part.as_ref().map_or(String::new(), |p| format!("{p}: "));
                writeln!(f, "            {part}{material} ({file})")?;
            }
        }
        writeln!(f, "  render    {}", self.would_run)
    }
}
