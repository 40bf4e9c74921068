//! What a picture needs to know of the large scale: for each sample of each pixel the places that are seen, with the directions
//! to the viewer and to each light that reaches them, in the tile's frame. Nothing here depends on how the materials reflect.

use super::layers::Cover;
use super::mapping::Footprint;
use super::scene::{Camera, LEAST_LIGHTS, Light, Lighting, Scene};
use super::world::{MAX_SURFACES, NOTHING, SurfacePoint, World, turned_by};
use crate::direction::MIN_COSINE;
use crate::error::Result;
use crate::filter::Control;
use crate::numerics::cast::narrow;
use crate::numerics::low_discrepancy::{fraction, hash, sobol_2d};
use crate::numerics::seed::fold;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// A material at a place that is seen.
///
/// A place that several layers share is as many points, one after the other, the uppermost layer first: each has its material, its share in
/// the weight, its tint, the directions in its own tile's frame, and its lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Place of its pixel in the picture, row by row from the top.
    pub pixel: u32,
    /// Its material.
    pub material: u32,
    /// Direction to the viewer in the tile's frame.
    pub wo: Vec3,
    /// Share of the pixel's radiance that is this place's, and of its layers this one's.
    pub weight: f32,
    /// What its radiance is multiplied by.
    pub tint: [f32; 3],
    /// End of its lights in [`View::lit`]; they begin where the point before ends.
    pub end: u32,
}

/// A light that reaches a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lit {
    /// Direction to the light in the tile's frame.
    pub wi: Vec3,
    /// Factor of the light's colour: what gets through, over the squared distance for a point light.
    pub scale: f32,
    /// Place of the light.
    pub light: u16,
}

/// Some rows of a picture.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// The rows.
    pub rows: Range<u32>,
    /// What is seen, pixel by pixel.
    pub points: Vec<Point>,
    /// Their lights, point by point.
    pub lit: Vec<Lit>,
    /// For each pixel the radiance of what lies behind all objects.
    pub behind: Vec<[f32; 3]>,
    /// For each pixel the share that objects cover.
    pub alpha: Vec<f32>,
}

/// The lights of a scene, with those of an environment that is sampled, [`LEAST_LIGHTS`] where it names no number; `seed` is that of the sampling.
pub fn lights(scene: &Scene, seed: u64) -> Vec<Light> {
    let sampled = scene.environment.iter().filter(|e| e.lighting == Lighting::Sampled);
    let surroundings = sampled.flat_map(|e| e.map.lights(e.lights.unwrap_or(LEAST_LIGHTS), seed));
    let distant = surroundings.map(|(to_light, irradiance)| Light::Directional { to_light, irradiance });
    scene.lights.iter().copied().chain(distant).collect()
}

/// Gathers some rows. Each row is the work of one thread; the result does not depend on which.
///
/// # Errors
/// `Interrupted`.
pub fn gather(world: &World<'_>, lights: &[Light], rows: Range<u32>, seed: u64, control: &Control<'_>) -> Result<View> {
    let done = std::sync::atomic::AtomicU32::new(0);
    let total = rows.len().max(1) as f64;
    let parts: Vec<View> = rows
        .clone()
        .into_par_iter()
        .map(|row| {
            if control.check().is_err() {
                return View::default();
            }
            let view = gather_row(world, lights, row, seed);
            let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            (control.progress)("large scale", f64::from(done) / total);
            view
        })
        .collect();
    control.check()?;
    let mut view = View { rows, ..View::default() };
    view.points.reserve_exact(parts.iter().map(|p| p.points.len()).sum());
    view.lit.reserve_exact(parts.iter().map(|p| p.lit.len()).sum());
    for part in parts {
        let before = count(view.lit.len());
        view.points.extend(part.points.into_iter().map(|p| Point { end: p.end + before, ..p }));
        view.lit.extend(part.lit);
        view.behind.extend(part.behind);
        view.alpha.extend(part.alpha);
    }
    Ok(view)
}

/// Lights of a scene as [`render`](crate::render::render) uses them, gathered for all of its rows: for callers that shade a view again and again.
///
/// # Errors
/// `Interrupted`.
pub fn gather_all(world: &World<'_>, lights: &[Light], seed: u64, control: &Control<'_>) -> Result<View> {
    gather(world, lights, 0..world.scene.camera.height, seed, control)
}

fn count(length: usize) -> u32 {
    u32::try_from(length).expect("a band is cut so that its lights can be counted")
}

/// Where sample `index` of a pixel lies in it, 0..1 across and down; a single one in the middle. `seed` is folded.
pub(super) fn place_in_pixel(camera: &Camera, seed: u32, pixel: u32, index: u32) -> [f64; 2] {
    if camera.samples == 1 { [0.5; 2] } else { sobol_2d(index, hash(seed ^ hash(pixel))).map(fraction) }
}

fn gather_row(world: &World<'_>, lights: &[Light], row: u32, seed: u64) -> View {
    let camera = &world.scene.camera;
    let seed = fold(seed);
    let mut view = View { rows: row..row + 1, ..View::default() };
    let mut scratch = Scratch::default();
    for column in 0..camera.width {
        let pixel = row * camera.width + column;
        let (mut behind, mut alpha) = ([0.0; 3], 0.0);
        for index in 0..camera.samples {
            let [x, y] = place_in_pixel(camera, seed, pixel, index);
            let (x, y) = (f64::from(column) + x, f64::from(row) + y);
            let direction = camera.direction(x, y);
            let weight = 1.0 / f64::from(camera.samples);
            let footprint = Footprint::of_ray(camera, x, y, 1.0);
            let ray = Ray { pixel, origin: camera.origin, direction, footprint, weight };
            let through = view.look(world, lights, &ray, &mut scratch);
            alpha += weight - through;
            let beyond = match &world.scene.environment {
                Some(e) if e.visible => e.map.radiance(direction),
                _ => world.scene.background,
            };
            for c in 0..3 {
                behind[c] += through * beyond[c];
            }
        }
        view.behind.push(behind.map(narrow));
        view.alpha.push(narrow(alpha));
    }
    view
}

/// A ray of the camera.
#[derive(Clone, Copy)]
struct Ray {
    pixel: u32,
    origin: DVec3,
    direction: DVec3,
    /// Its footprint at distance 1.
    footprint: Footprint,
    /// Its share of the pixel.
    weight: f64,
}

/// A light as it reaches a place.
#[derive(Clone, Copy)]
struct Reaching {
    to_light: DVec3,
    scale: f32,
    light: u16,
}

/// The lights that reach a place on the side of `normal`; those that do not lie over the horizon of `shading`, too, are not followed.
fn reaching(world: &World<'_>, lights: &[Light], place: &SurfacePoint, footprint: Footprint, shading: DVec3, found: &mut Vec<Reaching>) {
    found.clear();
    for (index, light) in lights.iter().enumerate() {
        let (to_light, distance, falloff) = match light {
            Light::Directional { to_light, .. } => (*to_light, f64::INFINITY, 1.0),
            Light::Point { position, .. } => {
                let away = *position - place.position;
                let distance = away.length();
                (away / distance.max(f64::MIN_POSITIVE), distance, (distance * distance).max(f64::MIN_POSITIVE).recip())
            }
        };
        if place.frame.z_axis.dot(to_light) <= 0.0 || shading.dot(to_light) <= 0.0 {
            continue;
        }
        let share = world.transmittance(place, footprint, to_light, distance);
        if share > 0.0 {
            let scale = narrow((share * falloff).min(f64::from(f32::MAX)));
            let light = u16::try_from(index).expect("lights are limited");
            found.push(Reaching { to_light, scale, light });
        }
    }
}

/// What is used again for each place.
#[derive(Default)]
struct Scratch {
    covers: Vec<Cover>,
    reaching: Vec<Reaching>,
}

impl View {
    /// Adds what a camera ray sees; returns the share of its weight that passes all objects.
    fn look(&mut self, world: &World<'_>, lights: &[Light], ray: &Ray, scratch: &mut Scratch) -> f64 {
        let Scratch { covers, reaching: found } = scratch;
        let (mut after, mut left) = (0.0, ray.weight);
        for _ in 0..MAX_SURFACES {
            let Some(place) = world.first(ray.origin, ray.direction, after) else { return left };
            after = place.hit.distance;
            let object = &world.scene.objects[place.object];
            let footprint = ray.footprint.scaled(after);
            let frame = world.shading_frame(&place, footprint, ray.direction);
            covers.clear();
            world.covers(&place, footprint, ray.direction, covers);
            let lit = place.front || object.two_sided;
            if lit {
                let there = footprint.onto(ray.direction, place.outward);
                reaching(world, lights, &place, there, frame.z_axis, found);
            }
            let mut opacity = 0.0;
            for cover in &*covers {
                let to_tile = turned_by(frame, cover.turn - object.turn).transpose();
                let wo = (to_tile * -ray.direction).normalize();
                let wo = DVec3::new(wo.x, wo.y, wo.z.max(MIN_COSINE)).normalize();
                opacity += cover.weight * world.opacity[cover.material].along(wo);
                if lit {
                    self.add(ray.pixel, left, cover, wo, found.iter().map(|l| (to_tile * l.to_light, l)));
                }
            }
            left *= 1.0 - opacity;
            if left < NOTHING * ray.weight {
                return 0.0;
            }
        }
        // What lies behind so many layers is dark.
        0.0
    }

    /// Adds a material's share of a place that has `left` of its pixel.
    fn add<'l>(&mut self, pixel: u32, left: f64, cover: &Cover, wo: DVec3, lights: impl Iterator<Item = (DVec3, &'l Reaching)>) {
        // The turn of the tile may round a light on the horizon to below it.
        self.lit.extend(lights.filter(|(wi, _)| wi.z > 0.0).map(|(wi, l)| Lit { wi: wi.as_vec3(), scale: l.scale, light: l.light }));
        let material = u32::try_from(cover.material).expect("as many materials as objects, parts and layers");
        let (weight, tint) = (narrow(cover.weight * left), cover.tint.map(narrow));
        self.points.push(Point { pixel, material, wo: wo.as_vec3(), weight, tint, end: count(self.lit.len()) });
    }

    /// Points with their lights.
    pub fn lit_points(&self) -> impl Iterator<Item = (&Point, Range<usize>)> {
        let mut start = 0;
        self.points.iter().map(move |point| {
            let range = start..point.end as usize;
            start = range.end;
            (point, range)
        })
    }
}
