//! The large-scale appearance: scene, camera, lights, environment map -> picture.
//!
//! ```text
//! scene file -> scene -> world -> gather -> demand -> shade -> picture
//!            (mesh, shapes, environment, coverage)
//! ```
//!
//! `L = fbar E av/cos_o + (1 - c) background`: `E` is the irradiance on a plane that faces the light, `c` the share of rays from
//! the viewer that hit anything (`docs/formats.md`). For a surface without gaps that is `fbar E`. Light is direct light at the large
//! scale; objects shadow each other.
//!
//! The effective BRDF is computed only for the cells of directions that the picture's pixels and lights touch ([`demand`]).

pub mod compare;
pub mod coverage;
pub mod demand;
pub mod environment;
pub mod gather;
pub mod mesh;
pub mod picture;
pub mod scene;
pub mod shade;
pub mod shapes;
#[cfg(test)]
mod tests;
pub mod world;

use crate::error::{Error, Result};
use crate::filter::{Control, Quality};
use crate::numerics::low_discrepancy::hash;
use demand::{PROBES, Plan, Table, full_table};
use gather::{View, gather};
use glam::Vec3;
use picture::Picture;
use scene::{Light, Scene};
use shade::{Frame, colours, touched};
use std::ops::Range;
use world::World;

/// Most lights of points that are held at once, counted before any is found in shadow: about 60 bytes for each that is not.
const MAX_LAMPS: u64 = 48 << 20;

/// A picture and how it was made.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub picture: Picture,
    /// For each material of the scene how its values were made; `None` for one that no light reaches.
    pub materials: Vec<Option<Made>>,
    /// Lights, with those that stand for the environment.
    pub lights: usize,
    /// Pairs of a point and a light that reaches it.
    pub lamps: u64,
    /// Name and milliseconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// How the values of one material were made.
#[derive(Clone, Debug, PartialEq)]
pub struct Made {
    /// The method that ran.
    pub method: &'static str,
    /// Everything that fixes the values' bits beside the seed.
    pub plan: String,
    /// Facets (`direct`), or rays from the viewer per pair (`reference`).
    pub facets: usize,
    /// Rings of the direction grid.
    pub rings: usize,
    /// Cells of the grid that the picture touches.
    pub cells: usize,
    /// Pairs of directions that were computed.
    pub pairs: usize,
    /// Pairs of a full table of the same grid, which has the same error.
    pub full_table: usize,
    /// Whether a guide is divided out before interpolation.
    pub guided: bool,
    /// Whether rays pass the surface.
    pub gaps: bool,
    /// Relative RMS error over the picture's pairs: facets, and interpolation.
    pub error: [f64; 2],
}

impl Made {
    /// The whole relative RMS error.
    pub fn relative_rms(&self) -> f64 {
        self.error[0].hypot(self.error[1])
    }
}

/// Probes of a material so far: those of the smallest hashes, which any order of rows gives alike.
#[derive(Clone, Default)]
struct Probes(Vec<(u32, u32, u32, Vec3, Vec3)>);

impl Probes {
    fn add(&mut self, pixel: u32, nth: u32, wi: Vec3, wo: Vec3) {
        self.0.push((hash(hash(pixel) ^ nth.wrapping_mul(0x9e37_79b9)), pixel, nth, wi, wo));
        if self.0.len() >= 64 * PROBES {
            self.keep();
        }
    }

    fn keep(&mut self) {
        self.0.sort_unstable_by_key(|p| (p.0, p.1, p.2));
        self.0.truncate(PROBES);
    }
}

/// Renders a scene.
///
/// The same scene and quality give the same bits at any thread count.
///
/// # Errors
/// [`Error::Unsupported`] for a budget or a plan, [`Error::Interrupted`] when `control` asks to stop, those of the filter.
pub fn render(scene: &Scene, quality: &Quality, control: &Control<'_>) -> Result<Rendered> {
    render_in_bands(scene, quality, control, MAX_LAMPS)
}

fn render_in_bands(scene: &Scene, quality: &Quality, control: &Control<'_>, most_lamps: u64) -> Result<Rendered> {
    let unsupported = |what: &str, remedy: &str| Error::Unsupported { what: what.to_owned(), remedy: remedy.to_owned() };
    if quality.budget.is_some() {
        return Err(unsupported("a budget of time for a picture", "set the time by `tolerance`"));
    }
    if quality.plan.is_some() {
        return Err(unsupported("a plan for a picture", "the same scene, seed and options repeat its bits without one"));
    }
    let clock = control.clock;
    let mut stages: Vec<(&'static str, f64)> = Vec::new();
    let mut last = clock();
    let mut stage = |name| {
        let now = clock();
        stages.push((name, 1e3 * (now - last)));
        last = now;
    };
    let part = |range: Range<f64>| move |stage: &str, done: f64| (control.progress)(stage, range.start + done * (range.end - range.start));

    let world = World::new(scene, control)?;
    stage("gaps");
    let lights = gather::lights(scene, quality.seed);
    let camera = &scene.camera;
    let a_row = u64::from(camera.width) * u64::from(camera.samples) * lights.len().max(1) as u64;
    #[expect(clippy::cast_possible_truncation, reason = "at most the picture's height")]
    let band = (most_lamps / a_row).clamp(1, u64::from(camera.height)) as u32;
    let bands: Vec<Range<u32>> = (0..camera.height).step_by(band as usize).map(|r| r..(r + band).min(camera.height)).collect();
    let view = |range: &Range<u32>, share: Range<f64>| {
        let progress = part(share);
        gather(&world, &lights, range.clone(), quality.seed, &Control { progress: &progress, ..*control })
    };

    let count = scene.materials.len();
    let mut probes = vec![Probes::default(); count];
    let mut lamps = 0;
    // A picture that fits one band is gathered once.
    let mut only = None;
    for range in &bands {
        let gathered = view(range, 0.0..0.1)?;
        let (mut pixel, mut nth) = (u32::MAX, 0);
        for (point, lit) in gathered.lit_points() {
            if pixel != point.pixel {
                (pixel, nth) = (point.pixel, 0);
            }
            for lit in &gathered.lit[lit] {
                probes[point.material as usize].add(pixel, nth, lit.wi, point.wo);
                nth += 1;
            }
        }
        lamps += gathered.lit.len() as u64;
        only = Some(gathered);
    }
    stage("large scale");

    let mut plans: Vec<Option<Plan>> = Vec::new();
    for ((material, probes), coverage) in scene.materials.iter().zip(&mut probes).zip(&world.coverage) {
        probes.keep();
        let pairs: Vec<(Vec3, Vec3)> = probes.0.iter().map(|p| (p.3, p.4)).collect();
        let begun = 0.1 + 0.3 * plans.len() as f64 / count as f64;
        let progress = part(begun..begun + 0.3 / count as f64);
        let control = Control { progress: &progress, ..*control };
        let plan = || Plan::find(&material.small, coverage.is_opaque(), &pairs, quality, &control);
        plans.push(if pairs.is_empty() { None } else { Some(plan()?) });
    }
    stage("probes");

    let grids: Vec<_> = plans.iter().map(|p| p.as_ref().map(|p| crate::table::HemisphereGrid::new(p.rings))).collect();
    let one_band = bands.len() == 1;
    let mut keys = vec![Vec::new(); count];
    for range in &bands {
        let gathered = if one_band { only.take().expect("gathered above") } else { view(range, 0.4..0.45)? };
        for (all, new) in keys.iter_mut().zip(touched(&gathered, &grids)) {
            all.extend(new);
            all.sort_unstable();
            all.dedup();
        }
        only = one_band.then_some(gathered);
    }
    stage("cells");
    let mut tables: Vec<Option<Table>> = Vec::new();
    for ((plan, keys), material) in plans.iter().zip(keys).zip(&scene.materials) {
        let begun = 0.45 + 0.45 * tables.len() as f64 / count as f64;
        let progress = part(begun..begun + 0.45 / count as f64);
        let control = Control { progress: &progress, ..*control };
        tables.push(plan.as_ref().map(|p| p.table(&material.small, keys, quality, &control)).transpose()?);
    }
    stage("values");

    let colours = colours(&lights);
    let mut picture = Picture::new(camera.width, camera.height);
    for range in &bands {
        control.check()?;
        let gathered = if one_band { only.take().expect("kept above") } else { view(range, 0.9..1.0)? };
        let frame = Frame::new(&gathered, &tables, camera.width);
        let at = (range.start * camera.width) as usize;
        let rows = frame.shade(&tables, &colours);
        picture.rgb[at..at + rows.len()].copy_from_slice(&rows);
        picture.alpha[at..at + rows.len()].copy_from_slice(&gathered.alpha);
    }
    stage("shading");
    if picture.rgb.iter().flatten().any(|v| !v.is_finite()) {
        return Err(Error::Numeric("a pixel is not finite; please report this, with the scene".to_owned()));
    }
    let made: Vec<Option<Made>> = (0..count).map(|m| Some(made(scene, &world, m, plans[m].as_ref()?, tables[m].as_ref()?))).collect();
    let notes = notes(scene, quality, &plans);
    Ok(Rendered { picture, materials: made, lights: lights.len(), lamps, stages, notes })
}

fn made(scene: &Scene, world: &World<'_>, material: usize, plan: &Plan, table: &Table) -> Made {
    Made {
        method: plan.summary.method,
        plan: plan.summary.plan.clone(),
        facets: plan.summary.facets,
        rings: plan.rings,
        cells: table.cells(),
        pairs: table.pairs,
        full_table: full_table(&scene.materials[material].small, plan.rings),
        guided: plan.is_guided(),
        gaps: !world.coverage[material].is_opaque(),
        error: [plan.facets, plan.interpolation],
    }
}

/// What the user should know.
fn notes(scene: &Scene, quality: &Quality, plans: &[Option<Plan>]) -> Vec<String> {
    let mut notes: Vec<String> = Vec::new();
    let mut note = |text: String| {
        if !notes.contains(&text) {
            notes.push(text);
        }
    };
    for object in &scene.objects {
        if let scene::Shape::Mesh(mesh) = &object.shape {
            mesh.notes.iter().for_each(|n| note(format!("{}: {n}", object.label)));
        }
        let distance = (object.middle() - scene.camera.origin).length();
        if let Some(periods) = object.periods_per_unit {
            let pixels = periods.map(|p| 1.0 / (p * scene.camera.pixel_width(distance)));
            if pixels[0].max(pixels[1]) > 1.0 {
                let (x, y) = (pixels[0], pixels[1]);
                note(format!("{}: a period covers about {x:.1} x {y:.1} pixels; the picture shows its average", object.label));
            }
        }
    }
    for (material, plan) in scene.materials.iter().zip(plans) {
        let name = &material.material.name;
        material.small.tile.notes.iter().for_each(|n| note(format!("{name}: {n}")));
        let Some(plan) = plan else {
            note(format!("{name}: no light reaches it where the camera sees it"));
            continue;
        };
        plan.summary.notes.iter().for_each(|n| note(format!("{name}: {n}")));
        let error = plan.relative_rms();
        if error > quality.tolerance {
            let why = if plan.interpolation > plan.facets {
                format!("its lobes are too narrow for {} rings of directions", plan.rings)
            } else {
                "the values themselves are that far off".to_owned()
            };
            note(format!("{name}: the relative RMS error is {error:.2e}, over the tolerance {:.2e}: {why}", quality.tolerance));
        }
    }
    notes
}

/// Lights of a scene as [`render`] uses them, gathered for all of its rows: for callers that shade a view again and again.
///
/// # Errors
/// `Interrupted`.
pub fn gather_all(world: &World<'_>, lights: &[Light], seed: u64, control: &Control<'_>) -> Result<View> {
    gather(world, lights, 0..world.scene.camera.height, seed, control)
}
