//! All stages of a picture in their order, band by band where its lights are too many to be held at once.

use super::environment_lighting::EnvironmentReport;
use super::gather::{View, gather, lights};
use super::picture::Picture;
use super::query_plan::{PROBES, QueryPlan, full_table};
use super::query_table::QueryTable;
use super::scene::{Light, Lighting, Scene, Shape};
use super::shade::{Frame, colours, touched};
use super::world::{MAX_SURFACES, World};
use crate::error::{Error, Result};
use crate::filter::{Control, Quality};
use crate::numerics::low_discrepancy::hash;
use crate::numerics::words::percent;
use crate::table::HemisphereGrid;
use glam::Vec3;
use std::ops::Range;

/// Most lights of points that are held at once, counted before any is found in shadow: about 60 bytes for each that is not.
const MAX_LAMPS: u64 = 48 << 20;

/// A picture and how it was made.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub picture: Picture,
    /// For each material of the scene how its values were made; `None` for one that no light reaches.
    pub materials: Vec<Option<MaterialReport>>,
    /// How the environment was sampled, if it was.
    pub light_sampling: Option<LightSampling>,
    /// How the light of an environment as a whole was made.
    pub environment: Option<EnvironmentReport>,
    /// Lights, with those that stand for the environment.
    pub lights: usize,
    /// Pairs of a point and a light that reaches it.
    pub lamps: u64,
    /// Name and milliseconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// How it was done, for who knows the methods.
    pub details: Vec<String>,
}

/// The sampling of an environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSampling {
    /// Directional lights that stand for the environment.
    pub lights: u32,
    /// Whether the tolerance chose their number, since the scene names none.
    pub chosen: bool,
    /// Relative RMS error of the pixels that show objects, by the choice of the lights.
    pub relative_rms: f64,
    /// Pixels at which it was measured.
    pub pixels: usize,
}

/// How the values of one material were made.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialReport {
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

impl MaterialReport {
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

/// Renders a scene as its lights light it, those of an environment that is sampled among them.
///
/// The same scene and quality give the same bits at any thread count.
///
/// # Errors
/// [`Error::Unsupported`] for a budget, [`Error::Interrupted`] when `control` asks to stop, those of the filter.
pub fn render_lights(scene: &Scene, quality: &Quality, control: &Control<'_>) -> Result<Rendered> {
    render_in_bands(scene, quality, control, MAX_LAMPS)
}

/// [`render_lights`] with at most this many lights of points held at once.
pub(super) fn render_in_bands(scene: &Scene, quality: &Quality, control: &Control<'_>, most_lamps: u64) -> Result<Rendered> {
    check(scene, quality)?;
    let mut stages = Stages::begin(control);
    let world = World::new(scene, control)?;
    stages.end("gaps");
    let mut bands = Bands::cut(&world, quality.seed, most_lamps, control)?;
    let (probes, lamps) = bands.probes()?;
    stages.end("large scale");
    let plans = plans(&world, probes, quality, control)?;
    stages.end("probes");
    let keys = bands.touched(&plans)?;
    stages.end("cells");
    let tables = tables(scene, &plans, keys, quality, control)?;
    stages.end("values");
    let picture = bands.shade(&tables)?;
    stages.end("shading");
    let report = |m: usize| Some(report(&world, m, plans[m].as_ref()?, tables[m].as_ref()?));
    let materials = (0..scene.materials.len()).map(report).collect();
    let notes = notes(scene, quality, &plans, &tables);
    let details = scene.materials.iter().zip(&plans).filter_map(|(m, plan)| Some((&m.material.name, &plan.as_ref()?.summary.details)));
    let details = details.flat_map(|(name, details)| details.iter().map(move |detail| format!("{name}: {detail}"))).collect();
    Ok(Rendered {
        picture,
        materials,
        light_sampling: None,
        environment: None,
        lights: bands.lights.len(),
        lamps,
        stages: stages.ended,
        notes,
        details,
    })
}

/// Refuses what a picture cannot be made by.
fn check(scene: &Scene, quality: &Quality) -> Result<()> {
    if quality.budget.is_some() {
        let (what, remedy) = ("a budget of time for a picture".to_owned(), "set the time by `tolerance`".to_owned());
        return Err(Error::Unsupported { what, remedy });
    }
    scene.materials.iter().try_for_each(|m| quality.method_for(&m.material).map(drop))
}

/// How long each stage took.
struct Stages<'a> {
    control: &'a Control<'a>,
    last: f64,
    ended: Vec<(&'static str, f64)>,
}

impl<'a> Stages<'a> {
    fn begin(control: &'a Control<'a>) -> Self {
        Self { control, last: (control.clock)(), ended: Vec::new() }
    }

    fn end(&mut self, name: &'static str) {
        let now = (self.control.clock)();
        self.ended.push((name, 1e3 * (now - self.last)));
        self.last = now;
    }
}

/// Most points of a place: one a layer, and one of what is below them.
fn most_layers(world: &World<'_>) -> u64 {
    1 + world.scene.objects.iter().map(|o| o.covering.layers.len()).max().unwrap_or(0) as u64
}

/// The rows of a picture, cut so that few enough lights are held at once. Each pass over the picture gathers them again, unless they are one.
struct Bands<'a> {
    world: &'a World<'a>,
    lights: Vec<Light>,
    seed: u64,
    control: &'a Control<'a>,
    rows: Vec<Range<u32>>,
    /// The view of a picture that is one band.
    only: Option<View>,
}

impl<'a> Bands<'a> {
    fn cut(world: &'a World<'a>, seed: u64, most_lamps: u64, control: &'a Control<'a>) -> Result<Self> {
        let lights = lights(world.scene, seed);
        let camera = &world.scene.camera;
        let a_row = u64::from(camera.width) * u64::from(camera.samples) * lights.len().max(1) as u64;
        // Points are counted in 32 bits.
        let most = u64::from(u32::MAX) / (MAX_SURFACES as u64 * most_layers(world));
        if a_row > most {
            let what = format!("a row of {} pixels with {} samples under {} lights", camera.width, camera.samples, lights.len());
            let remedy = format!("take fewer of one of them, so that their product is at most {most}");
            return Err(Error::Unsupported { what, remedy });
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most the picture's height")]
        let band = ((most_lamps / most_layers(world)).min(most) / a_row).clamp(1, u64::from(camera.height)) as u32;
        let rows = (0..camera.height).step_by(band as usize).map(|r| r..(r + band).min(camera.height)).collect();
        Ok(Self { world, lights, seed, control, rows, only: None })
    }

    /// Shows every band to `visit`; `share` is the progress that gathering them makes.
    fn each(&mut self, share: Range<f64>, mut visit: impl FnMut(&View)) -> Result<()> {
        for rows in &self.rows {
            self.control.check()?;
            let view = match self.only.take() {
                Some(view) => view,
                None => {
                    let of_band =
                        |row: u32| share.start + (share.end - share.start) * f64::from(row) / f64::from(self.world.scene.camera.height);
                    self.control.part(of_band(rows.start)..of_band(rows.end), |control| {
                        gather(self.world, &self.lights, rows.clone(), self.seed, control)
                    })?
                }
            };
            visit(&view);
            self.only = (self.rows.len() == 1).then_some(view);
        }
        Ok(())
    }

    /// Probes of each material, and how many lights reach points in all.
    fn probes(&mut self) -> Result<(Vec<Probes>, u64)> {
        let mut probes = vec![Probes::default(); self.world.scene.materials.len()];
        let mut lamps = 0;
        self.each(0.0..0.1, |view| {
            let (mut pixel, mut nth) = (u32::MAX, 0);
            for (point, lit) in view.lit_points() {
                if pixel != point.pixel {
                    (pixel, nth) = (point.pixel, 0);
                }
                for lit in &view.lit[lit] {
                    probes[point.material as usize].add(pixel, nth, lit.wi, point.wo);
                    nth += 1;
                }
            }
            lamps += view.lit.len() as u64;
        })?;
        Ok((probes, lamps))
    }

    /// For each material the keys of the cells that the picture touches, sorted and distinct.
    fn touched(&mut self, plans: &[Option<QueryPlan>]) -> Result<Vec<Vec<u64>>> {
        let grids: Vec<_> = plans.iter().map(|p| p.as_ref().map(|p| HemisphereGrid::new(p.rings))).collect();
        let mut keys = vec![Vec::new(); plans.len()];
        self.each(0.4..0.45, |view| {
            for (all, new) in keys.iter_mut().zip(touched(view, &grids)) {
                all.extend(new);
                all.sort_unstable();
                all.dedup();
            }
        })?;
        Ok(keys)
    }

    fn shade(&mut self, tables: &[Option<QueryTable>]) -> Result<Picture> {
        let colours = colours(&self.lights);
        let camera = self.world.scene.camera;
        let mut picture = Picture::new(camera.width, camera.height);
        self.each(0.9..1.0, |view| {
            let frame = Frame::new(view, tables, camera.width);
            let at = (view.rows.start * camera.width) as usize;
            let rows = frame.shade(tables, &colours);
            picture.rgb[at..at + rows.len()].copy_from_slice(&rows);
            picture.alpha[at..at + rows.len()].copy_from_slice(&view.alpha);
        })?;
        Ok(picture)
    }
}

/// How the values of each material are made; `None` for one that no light reaches.
fn plans(world: &World<'_>, probes: Vec<Probes>, quality: &Quality, control: &Control<'_>) -> Result<Vec<Option<QueryPlan>>> {
    let materials = &world.scene.materials;
    let mut plans = Vec::new();
    for ((material, mut probes), opacity) in materials.iter().zip(probes).zip(&world.opacity) {
        probes.keep();
        let pairs: Vec<(Vec3, Vec3)> = probes.0.iter().map(|p| (p.3, p.4)).collect();
        let begun = 0.1 + 0.3 * plans.len() as f64 / materials.len() as f64;
        let plan = |control: &Control<'_>| QueryPlan::find(&material.small, opacity.is_opaque(), &pairs, quality, control);
        let share = begun..begun + 0.3 / materials.len() as f64;
        plans.push(if pairs.is_empty() { None } else { Some(control.part(share, plan)?) });
    }
    Ok(plans)
}

/// The values of each material that the picture needs.
fn tables(
    scene: &Scene,
    plans: &[Option<QueryPlan>],
    keys: Vec<Vec<u64>>,
    quality: &Quality,
    control: &Control<'_>,
) -> Result<Vec<Option<QueryTable>>> {
    // Values cost about as much each: a material has the share of the progress that its cells have of all.
    let all = keys.iter().map(Vec::len).sum::<usize>().max(1) as f64;
    let mut begun = 0;
    let mut tables: Vec<Option<QueryTable>> = Vec::new();
    for ((plan, keys), material) in plans.iter().zip(keys).zip(&scene.materials) {
        let share = [begun, begun + keys.len()].map(|cells| 0.45 + 0.45 * cells as f64 / all);
        begun += keys.len();
        let table = |p: &QueryPlan| control.part(share[0]..share[1], |control| p.table(&material.small, keys, quality, control));
        tables.push(plan.as_ref().map(table).transpose()?);
    }
    Ok(tables)
}

fn report(world: &World<'_>, material: usize, plan: &QueryPlan, table: &QueryTable) -> MaterialReport {
    MaterialReport {
        method: plan.summary.method,
        plan: plan.summary.plan_text(),
        facets: plan.summary.facets,
        rings: plan.rings,
        cells: table.cells(),
        pairs: table.pairs,
        full_table: full_table(&world.scene.materials[material].small, plan.rings),
        guided: plan.is_guided(),
        gaps: !world.opacity[material].is_opaque(),
        error: errors(plan, table),
    }
}

/// Relative RMS errors of the values and of their interpolation.
fn errors(plan: &QueryPlan, table: &QueryTable) -> [f64; 2] {
    [plan.facets.max(table.relative_rms), plan.interpolation]
}

/// What the user should know.
fn notes(scene: &Scene, quality: &Quality, plans: &[Option<QueryPlan>], tables: &[Option<QueryTable>]) -> Vec<String> {
    let mut notes: Vec<String> = Vec::new();
    let mut note = |text: String| {
        if !notes.contains(&text) {
            notes.push(text);
        }
    };
    scene.environment.iter().filter_map(|e| e.map.note.as_ref()).for_each(|n| note(format!("environment: {n}")));
    for object in &scene.objects {
        if let Shape::Mesh(mesh) = &object.shape {
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
    for ((material, plan), table) in scene.materials.iter().zip(plans).zip(tables) {
        let name = &material.material.name;
        material.small.tile.notes.iter().for_each(|n| note(format!("{name}: {n}")));
        let whole = scene.environment.as_ref().is_some_and(|e| e.lighting != Lighting::Sampled);
        let Some(plan) = plan else {
            if whole {
                continue;
            }
            note(format!("{name}: no light reaches it where the camera sees it"));
            continue;
        };
        plan.summary.notes.iter().for_each(|n| note(format!("{name}: {n}")));
        // Of the cells that the picture shows, which may err more than the probes that the plan is made by.
        let [of_values, interpolation] = table.as_ref().map_or([plan.facets, plan.interpolation], |table| errors(plan, table));
        let error = of_values.hypot(interpolation);
        if error > quality.tolerance {
            let why = if interpolation > of_values {
                format!("its lobes are too narrow for {} rings of directions", plan.rings)
            } else {
                "the values themselves are that far off".to_owned()
            };
            let (error, tolerance) = (percent(error), percent(quality.tolerance));
            note(format!("{name}: the relative RMS error is {error}, over the tolerance of {tolerance}: {why}"));
        }
    }
    notes
}
