//! What `biscale check` says of a material file.

use super::would_run::{digits, would_run};
use biscale::brdf::Brdf;
use biscale::error::Result;
use biscale::filter::Quality;
use biscale::geometry::Tile;
use biscale::material::{Material, Surface, Tint};
use biscale::visibility::{PeriodicBvh, Traced};
use glam::DVec3;
use serde::Serialize;
use std::fmt;

/// What a good material file means.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    kind: &'static str,
    name: String,
    unit: &'static str,
    /// In `unit`.
    period: [f64; 2],
    /// Lowest and highest point, in `unit`.
    height: [f64; 2],
    triangles: usize,
    vertices: usize,
    /// Shares of the period that show front faces and back faces, which are black, from above; the rest are gaps.
    seen_from_above: [f64; 2],
    parts: Vec<Part>,
    surfaces: Vec<SurfaceReport>,
    /// What `eval` and `bake` would run.
    would_run: String,
    /// Bytes of the geometry and what rays need of it, about.
    memory_bytes: usize,
    notes: Vec<String>,
    warnings: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
struct Part {
    part: String,
    triangles: usize,
    /// In square `unit`s.
    area: f64,
    /// Share of the area of all parts.
    share: f64,
    /// Place in `surfaces`; `null` if the part has no triangles here.
    surface: Option<usize>,
}

#[derive(Clone, Debug, Serialize)]
struct SurfaceReport {
    part: String,
    brdf: String,
    tint: String,
    /// Share of the light that is reflected where it is largest, for models that do not keep it below 1 by themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_directional_albedo: Option<[f64; 3]>,
}

impl SurfaceReport {
    fn of(surface: &Surface) -> Self {
        let unbounded = matches!(surface.brdf, Brdf::BlinnPhong { .. } | Brdf::Ward { .. } | Brdf::Measured(_));
        Self {
            part: surface.part.clone(),
            brdf: describe_brdf(&surface.brdf),
            tint: describe_tint(&surface.tint),
            max_directional_albedo: unbounded.then(|| surface.brdf.max_directional_albedo().albedo),
        }
    }
}

/// Bytes of one triangle in the tile and in the hierarchy that rays walk through: indices, part and surface, three corners in
/// f32, and its share of the nodes (measured for obvhs' eight-wide tree: about 30 a triangle).
const BYTES_PER_TRIANGLE: usize = 12 + 2 + 2 + 36 + 30;
/// Texture coordinates of one triangle.
const BYTES_OF_UV: usize = 48;
/// Bytes of a vertex.
const BYTES_PER_VERTEX: usize = 24;

impl Report {
    /// Describes a material, and how it would be computed with this quality.
    ///
    /// # Errors
    /// Those of its geometry; a method that cannot compute what its file asks for.
    pub fn of(material: &Material, quality: &Quality) -> Result<Self> {
        let would_run = would_run(quality, material)?;
        let surface = material.build()?;
        let tile = &surface.tile;
        let mut parts: Vec<Part> =
            tile.parts.iter().map(|part| Part { part: part.clone(), triangles: 0, area: 0.0, share: 0.0, surface: None }).collect();
        let places = tile.part_of_triangle.iter().zip(&surface.surface_of_triangle);
        for (triangle, (&part, &covering)) in places.enumerate() {
            let part = &mut parts[usize::from(part)];
            part.triangles += 1;
            part.area += area(tile.corners(triangle));
            part.surface = Some(usize::from(covering));
        }
        // A part that the kind knows but this geometry lacks has nothing to report.
        parts.retain(|p| p.triangles > 0);
        let whole: f64 = parts.iter().map(|p| p.area).sum();
        for part in &mut parts {
            part.share = if whole > 0.0 { part.area / whole } else { 0.0 };
        }
        let (low, high) = tile.vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.z), high.max(v.z)));
        // A part without triangles is reported as such; "*" that finds nothing left is more likely a mistake.
        let idle = |i: &usize| material.surfaces[*i].part == "*" && parts.iter().all(|p| p.surface != Some(*i));
        let mut warnings: Vec<String> = (0..material.surfaces.len())
            .filter(idle)
            .map(|i| format!("the surface of part \"*\" (line {}) covers nothing", material.surfaces[i].line))
            .collect();
        for surface in &material.surfaces {
            warnings.extend(surface.brdf.warnings().into_iter().map(|w| format!("part \"{}\": {w}", surface.part)));
        }
        let surfaces = material.surfaces.iter().map(SurfaceReport::of).collect();
        Ok(Self {
            kind: "material",
            name: material.name.clone(),
            unit: material.unit,
            period: tile.period.into(),
            height: if low <= high { [low, high] } else { [0.0; 2] },
            triangles: tile.triangles.len(),
            vertices: tile.vertices.len(),
            seen_from_above: seen_from_above(tile)?,
            parts,
            surfaces,
            would_run,
            memory_bytes: memory(tile),
            notes: tile.notes.clone(),
            warnings,
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.unit;
        writeln!(f, "  name      {}", self.name)?;
        writeln!(f, "  period    {} x {} {unit}", digits(self.period[0]), digits(self.period[1]))?;
        writeln!(f, "  height    {} to {} {unit}", digits(self.height[0]), digits(self.height[1]))?;
        writeln!(f, "  geometry  {} triangles, {} vertices", self.triangles, self.vertices)?;
        let [front, back] = self.seen_from_above.map(|share| 100.0 * share);
        writeln!(f, "  from top  {front:.1} % front faces, {back:.1} % back faces, {:.1} % gaps", (100.0 - front - back).max(0.0))?;
        for part in &self.parts {
            let Some(surface) = part.surface.map(|s| &self.surfaces[s]) else {
                writeln!(f, "  part      {}: no triangles", part.part)?;
                continue;
            };
            let (triangles, area, share) = (part.triangles, digits(part.area), part.share * 100.0);
            let tint = if surface.tint == "1" { String::new() } else { format!(", tint {}", surface.tint) };
            writeln!(f, "  part      {}: {triangles} triangles, area {area} {unit}^2 ({share:.1} %), {}{tint}", part.part, surface.brdf)?;
            if let Some(albedo) = surface.max_directional_albedo {
                writeln!(f, "            largest directional albedo {}", colour(albedo.map(|a| (a * 1e3).round() / 1e3)))?;
            }
        }
        writeln!(f, "  eval      {}", self.would_run)?;
        writeln!(f, "  memory    about {} for the geometry", size(self.memory_bytes))?;
        for note in &self.notes {
            writeln!(f, "  note      {note}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "  warning   {warning}")?;
        }
        Ok(())
    }
}

/// Shares of the period that show front and back faces from above, by rays on a grid.
fn seen_from_above(tile: &Tile) -> Result<[f64; 2]> {
    /// Rays along each side of the period.
    const SIDE: u32 = 64;
    let bvh = PeriodicBvh::new(tile)?;
    let mut seen = [0.0; 2];
    for (i, j) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j))) {
        // Off the middle of the grid's cells, where edges like to lie.
        let [x, y] = [(i, 0.42), (j, 0.57)].map(|(k, offset)| (f64::from(k) + offset) / f64::from(SIDE));
        let origin = DVec3::new(x * tile.period.x, y * tile.period.y, bvh.highest());
        if let Traced::Hit(hit) = bvh.trace(origin, -DVec3::Z, None) {
            let [a, b, c] = tile.corners(hit.triangle as usize);
            let front = (b - a).cross(c - a).z > 0.0;
            seen[usize::from(!front)] += 1.0 / f64::from(SIDE * SIDE);
        }
    }
    Ok(seen)
}

fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

fn memory(tile: &Tile) -> usize {
    let uv = if tile.uv.is_some() { BYTES_OF_UV } else { 0 };
    tile.triangles.len() * (BYTES_PER_TRIANGLE + uv) + tile.vertices.len() * BYTES_PER_VERTEX
}

/// A number of bytes in words.
fn size(bytes: usize) -> String {
    let kib = bytes as f64 / 1024.0;
    if kib < 1024.0 { format!("{:.0} KiB", kib.ceil()) } else { format!("{:.1} MiB", kib / 1024.0) }
}

/// Three numbers, or one where they are equal.
fn colour(c: [f64; 3]) -> String {
    if c[0] == c[1] && c[1] == c[2] { digits(c[0]) } else { format!("[{}, {}, {}]", digits(c[0]), digits(c[1]), digits(c[2])) }
}

fn describe_tint(tint: &Tint) -> String {
    match tint {
        Tint::Uniform(c) => colour(*c),
        Tint::Image(image) => format!("an image of {} x {}", image.width, image.height),
    }
}

fn describe_brdf(brdf: &Brdf) -> String {
    let rest = |diffuse: &[f64; 3], specular: &[f64; 3]| format!("diffuse {}, specular {}", colour(*diffuse), colour(*specular));
    match brdf {
        Brdf::Lambert { albedo } => format!("lambert, albedo {}", colour(*albedo)),
        Brdf::BlinnPhong { diffuse, specular, exponent } => format!("blinn-phong, {}, exponent {exponent}", rest(diffuse, specular)),
        Brdf::CookTorrance { diffuse, specular, alpha, distribution, f0 } => {
            let f0 = f0.map_or(String::new(), |f| format!(", f0 {}", colour(f)));
            let shape = format!("{distribution:?}").to_lowercase();
            format!("cook-torrance ({shape}), {}, alpha {alpha}{f0}", rest(diffuse, specular))
        }
        Brdf::Ward { diffuse, specular, alpha } => format!("ward, {}, alpha {alpha}", rest(diffuse, specular)),
        Brdf::Measured(measured) => {
            let what = if measured.is_fit() { "built-in fit" } else { "measured" };
            let scale = if measured.scale == 1.0 { String::new() } else { format!(", scale {}", measured.scale) };
            format!("{what} {}{scale}", measured.label)
        }
    }
}
