//! What `biscale check` says of a scene file.

use super::would_run::would_run;
use biscale::error::Result;
use biscale::filter::Quality;
use biscale::render::{Blend, LEAST_LIGHTS, Light, MOST_LIGHTS, Object as SceneObject, Projection, Scene, Shape, Tint};
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
    /// Directional lights that stand for the environment, none without one; null where `render` chooses.
    environment_lights: Option<u32>,
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
    /// What the materials of the parts are multiplied by.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tints: Vec<&'static str>,
    /// Layers over the parts, the lowest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    layers: Vec<Layer>,
    /// How the layers lie over each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    blend: Option<&'static str>,
    /// Pixels of the normal map.
    #[serde(skip_serializing_if = "Option::is_none")]
    normal_map: Option<[usize; 2]>,
}

#[derive(Clone, Debug, Serialize)]
struct Layer {
    material: String,
    file: String,
    /// Pixels of its mask.
    mask: [usize; 2],
    projection: &'static str,
    inverted: bool,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tints: Vec<&'static str>,
}

#[derive(Clone, Debug, Serialize)]
struct Part {
    #[serde(skip_serializing_if = "Option::is_none")]
    part: Option<String>,
    material: String,
    file: String,
}

/// How the materials of a scene would be computed: in one line, or in one for each where they ask for different reflections.
fn of_materials(scene: &Scene, quality: &Quality) -> Result<String> {
    let each = scene.materials.iter().map(|m| Ok((&m.material.name, would_run(quality, &m.material)?)));
    let each = each.collect::<Result<Vec<_>>>()?;
    if each.iter().all(|(_, how)| *how == each[0].1) {
        return Ok(each.into_iter().next().map(|(_, how)| how).unwrap_or_else(|| "nothing: there is no object".to_owned()));
    }
    Ok(each.iter().map(|(name, how)| format!("{name}: {how}")).collect::<Vec<_>>().join("\n"))
}

/// The keys of the tints that there are.
fn tints(tint: &Tint) -> Vec<&'static str> {
    let there = [("tint", tint.colour != [1.0; 3]), ("tint_texture", tint.image.is_some()), ("tint_vertex_colors", tint.vertex_colours)];
    there.into_iter().filter(|t| t.1).map(|t| t.0).collect()
}

/// The layers of an object.
fn layers(object: &SceneObject, scene: &Scene) -> Vec<Layer> {
    let one = |layer: &biscale::render::Layer| {
        let material = &scene.materials[layer.material].material;
        Layer {
            material: material.name.clone(),
            file: material.file.display().to_string(),
            mask: layer.mask.image.size(),
            projection: if layer.mask.projection == Projection::Uv { "uv" } else { "planar" },
            inverted: layer.mask.invert,
            tints: tints(&layer.tint),
        }
    };
    object.covering.layers.iter().map(one).collect()
}

impl Report {
    /// Describes a scene, and how its materials would be computed with this quality.
    ///
    /// # Errors
    /// A method that cannot compute what the file of a material asks for.
    pub fn of(scene: &Scene, quality: &Quality) -> Result<Self> {
        let would_run = of_materials(scene, quality)?;
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
            let covering = &object.covering;
            let blend = match covering.blend {
                _ if covering.layers.is_empty() => None,
                Blend::Over => Some("over"),
                Blend::Sum => Some("sum"),
            };
            Object {
                object: object.label.clone(),
                triangles,
                parts,
                tints: tints(&covering.tint),
                layers: layers(object, scene),
                blend,
                normal_map: covering.normal_map.as_ref().map(|map| map.image.size()),
            }
        });
        let points = scene.lights.iter().filter(|l| matches!(l, Light::Point { .. })).count();
        Ok(Self {
            kind: "scene",
            name: scene.name.clone(),
            width: scene.camera.width,
            height: scene.camera.height,
            samples: scene.camera.samples,
            directional_lights: scene.lights.len() - points,
            point_lights: points,
            environment_lights: scene.environment.as_ref().map_or(Some(0), |e| e.lights),
            objects: objects.collect(),
            would_run,
        })
    }
}

/// The tints of a line, if there are any.
fn tinted(tints: &[&str]) -> String {
    if tints.is_empty() { String::new() } else { format!(", times {}", tints.join(", ")) }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, samples, directional_lights, point_lights, environment_lights, .. } = self;
        writeln!(f, "  name      {}", self.name)?;
        writeln!(f, "  picture   {width} x {height} pixels of {samples} samples")?;
        let sampled = environment_lights.map_or_else(|| format!("{LEAST_LIGHTS} to {MOST_LIGHTS}, by the tolerance,"), |n| n.to_string());
        writeln!(f, "  lights    {directional_lights} directional, {point_lights} point, {sampled} for the environment")?;
        for Object { object, triangles, parts, tints, layers, blend, normal_map } in &self.objects {
            let triangles = triangles.map_or(String::new(), |n| format!(", {n} triangles"));
            let map = normal_map.map_or(String::new(), |[w, h]| format!(", normal map of {w} x {h} pixels"));
            writeln!(f, "  object    {object}{triangles}{map}")?;
            for Part { part, material, file } in parts {
                let part = part.as_ref().map_or(String::new(), |p| format!("{p}: "));
                writeln!(f, "            {part}{material} ({file}){}", tinted(tints))?;
            }
            for Layer { material, file, mask: [w, h], projection, inverted, tints } in layers {
                let blend = blend.unwrap_or_default();
                let inverted = if *inverted { ", inverted" } else { "" };
                writeln!(f, "            {blend}: {material} ({file}){}, mask of {w} x {h} pixels, {projection}{inverted}", tinted(tints))?;
            }
        }
        writeln!(f, "  render    {}", self.would_run.replace('\n', "\n            "))
    }
}
