//! A scene lit by its environment: prepared once, seen by a camera that moves.

use super::super::gather::place_in_pixel;
use super::super::layers::Cover;
use super::super::mapping::Footprint;
use super::super::picture::Picture;
use super::super::scene::{Camera, Scene};
use super::super::world::{MAX_SURFACES, NOTHING, SurfacePoint, World, turned_by};
use super::half_vectors::incident_lobes;
use super::light_field::LightField;
use super::material::MaterialResponse;
use super::prefilter::PrefilteredMaps;
use super::raster::Outlines;
use super::report::ResponseReport;
use super::sites::Sites;
use crate::direction::MIN_COSINE;
use crate::error::{Error, Result};
use crate::filter::{Control, Quality};
use crate::numerics::cast::{index_u32, narrow};
use crate::numerics::seed::fold;
use glam::{DMat3, DVec3, Vec4};
use rayon::prelude::*;

/// Least relative RMS error that a response is made for, whatever tolerance is asked for; a smaller one holds for lights that are sampled. Chosen, not measured: it trades the time of
/// the preparation.
pub const LEAST_TOLERANCE: f64 = 0.05;
/// Rows of the picture that are rasterised together.
const BAND: u32 = 8;
/// Share of a place's light below which a lobe is not looked up.
const NEGLIGIBLE: f32 = 1e-5;

/// A scene lit by its environment, for any camera.
///
/// ```no_run
/// use biscale::render::{EnvironmentLit, Scene};
/// use biscale::{Control, Quality};
///
/// let scene = Scene::load("samples/scenes/cup.toml".as_ref())?;
/// let lit = EnvironmentLit::new(&scene, &Quality::default(), &Control::quiet())?;
/// let mut camera = scene.camera;
/// for _ in 0..100 {
///     camera.origin.x += 0.01;
///     let picture = lit.frame(&camera);
/// }
/// # Ok::<(), biscale::Error>(())
/// ```
pub struct EnvironmentLit<'a> {
    world: World<'a>,
    maps: PrefilteredMaps,
    sites: Sites,
    responses: Vec<MaterialResponse>,
    field: LightField,
    /// Name and milliseconds of each stage of the preparation.
    pub stages: Vec<(&'static str, f64)>,
}

/// A ray of a camera through a place of its picture.
struct Ray<'c> {
    camera: &'c Camera,
    place: [f64; 2],
    origin: DVec3,
    direction: DVec3,
}

impl<'c> Ray<'c> {
    fn through(camera: &'c Camera, x: f64, y: f64) -> Self {
        Self { camera, place: [x, y], origin: camera.origin, direction: camera.direction(x, y) }
    }

    /// Its footprint at distance 1.
    fn footprint(&self) -> Footprint {
        Footprint::of_ray(self.camera, self.place[0], self.place[1], 1.0)
    }

    fn at(&self, distance: f64) -> DVec3 {
        self.origin + distance * self.direction
    }
}

impl<'a> EnvironmentLit<'a> {
    /// Prepares all that does not depend on the camera. The scene's `lighting` is not asked for, and its lamps are left out.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a scene without an environment or with a normal map, those of the filter, `Interrupted`.
    pub fn new(scene: &'a Scene, quality: &Quality, control: &Control<'_>) -> Result<Self> {
        let Some(surroundings) = &scene.environment else {
            let what = "lighting by an environment in a scene without one".to_owned();
            return Err(Error::Unsupported { what, remedy: "add an [environment] with a `file`".to_owned() });
        };
        if let Some(object) = scene.objects.iter().find(|o| o.covering.normal_map.is_some()) {
            // Its normals change between the sites at which light is kept.
            let what = format!("{}: a normal map under an environment as a whole", object.label);
            return Err(Error::Unsupported { what, remedy: "set `lighting = \"sampled\"`, or remove `normal_map`".to_owned() });
        }
        let mut stages = Vec::new();
        let mut last = (control.clock)();
        let mut end = |name| {
            let now = (control.clock)();
            stages.push((name, 1e3 * (now - last)));
            last = now;
        };
        let quality = Quality { tolerance: quality.tolerance.max(LEAST_TOLERANCE), ..quality.clone() };
        let world = World::new(scene, control)?;
        end("gaps");
        let maps = PrefilteredMaps::new(&surroundings.map, control)?;
        end("prefilter");
        let response = |(material, opacity): (&super::super::scene::SceneMaterial, &super::super::opacity::Opacity)| {
            MaterialResponse::new(&material.small, opacity.is_opaque(), &surroundings.map, &quality, control)
        };
        let responses = scene.materials.iter().zip(&world.opacity).map(response).collect::<Result<Vec<_>>>()?;
        end("responses");
        let sites = Sites::new(&world);
        let field = LightField::new(&world, &sites, &responses, &maps, control)?;
        end("light field");
        Ok(Self { world, maps, sites, responses, field, stages })
    }

    /// How each material's response was found.
    pub fn reports(&self) -> Vec<ResponseReport> {
        self.responses.iter().map(ResponseReport::of).collect()
    }

    /// Places at which arriving light is kept.
    pub fn sites(&self) -> usize {
        self.sites.all.len()
    }

    /// Bytes of the prefiltered maps, and of the light at the sites.
    pub fn bytes(&self) -> [usize; 2] {
        [self.maps.bytes(), self.field.bytes()]
    }

    /// What a camera sees, by one ray through the middle of each pixel.
    pub fn frame(&self, camera: &Camera) -> Picture {
        let mut picture = Picture::new(camera.width, camera.height);
        let outlines = Outlines::new(&self.world, camera);
        let band = (BAND * camera.width) as usize;
        picture.rgb.par_chunks_mut(band).zip(picture.alpha.par_chunks_mut(band)).enumerate().for_each(|(at, (rgb, alpha))| {
            let first = index_u32(at) * BAND;
            let seen = outlines.rows(first..(first + BAND).min(camera.height));
            let mut covers = Vec::new();
            for (at, ((seen, rgb), alpha)) in (0_u32..).zip(seen.iter().zip(rgb).zip(alpha)) {
                let ray = Ray::through(camera, f64::from(at % camera.width) + 0.5, f64::from(first + at / camera.width) + 0.5);
                let place = seen.map(|(object, hit)| self.world.seen(object, hit, ray.at(hit.distance), ray.direction));
                let (sum, left) = self.look(&ray, place, &mut covers);
                let behind = if left > 0.0 { self.behind(ray.direction) } else { [0.0; 3] };
                *rgb = std::array::from_fn(|c| sum[c] + left * behind[c]);
                *alpha = 1.0 - left;
            }
        });
        picture
    }

    /// Adds to a picture of the scene's camera what the environment lights, at the places in the pixels at which [`render`](super::super::render) samples them.
    ///
    /// # Errors
    /// `Interrupted`.
    pub(in super::super) fn add_to(&self, picture: &mut Picture, seed: u64, control: &Control<'_>) -> Result<()> {
        let (camera, seed) = (&self.world.scene.camera, fold(seed));
        let width = camera.width;
        picture.rgb.par_chunks_mut(width as usize).enumerate().for_each(|(row, pixels)| {
            let row = index_u32(row);
            let mut covers = Vec::new();
            for (column, pixel) in (0_u32..).zip(pixels) {
                if control.check().is_err() {
                    return;
                }
                let mut sample = |index: u32| {
                    let [x, y] = place_in_pixel(camera, seed, row * width + column, index);
                    let ray = Ray::through(camera, f64::from(column) + x, f64::from(row) + y);
                    self.look(&ray, self.world.first(ray.origin, ray.direction, 0.0), &mut covers).0
                };
                let sum: Vec4 = (0..camera.samples).map(&mut sample).sum();
                *pixel = std::array::from_fn(|c| pixel[c] + sum[c] / camera.samples as f32);
            }
        });
        control.check()
    }

    /// Radiance along a ray whose first place is known, and the share of it that passes all objects.
    fn look(&self, ray: &Ray<'_>, first: Option<SurfacePoint>, covers: &mut Vec<Cover>) -> (Vec4, f32) {
        let (mut sum, mut left, mut next) = (Vec4::ZERO, 1.0, first);
        for _ in 0..MAX_SURFACES {
            let Some(place) = next else { return (sum, narrow(left)) };
            let object = &self.world.scene.objects[place.object];
            covers.clear();
            if object.covering.is_plain() {
                covers.push(Cover { material: object.material(&place.hit), weight: 1.0, tint: [1.0; 3], turn: object.turn });
            } else {
                self.world.covers(&place, ray.footprint().scaled(place.hit.distance), ray.direction, covers);
            }
            let mut opacity = 0.0;
            for cover in &*covers {
                let frame = if cover.turn == object.turn { place.frame } else { turned_by(place.frame, cover.turn - object.turn) };
                let wo = frame.transpose() * -ray.direction;
                let wo = DVec3::new(wo.x, wo.y, wo.z.max(MIN_COSINE)).normalize();
                opacity += cover.weight * self.world.opacity[cover.material].along(wo);
                if place.front || object.two_sided {
                    let tint = DVec3::from(cover.tint).as_vec3().extend(0.0);
                    sum += narrow(left * cover.weight) * tint * self.radiance(&place, cover, frame, wo);
                }
            }
            left *= 1.0 - opacity;
            if left < NOTHING {
                return (sum, 0.0);
            }
            next = self.world.first(ray.origin, ray.direction, place.hit.distance);
        }
        // What lies behind so many surfaces is dark.
        (sum, 0.0)
    }

    /// Radiance of a place's material, whose tile has this frame, towards the viewer `wo` in it.
    fn radiance(&self, place: &SurfacePoint, cover: &Cover, frame: DMat3, wo: DVec3) -> Vec4 {
        let response = &self.responses[cover.material];
        let (nodes, weights) = response.grid.weights(wo);
        let weights = weights.map(narrow);
        let around = self.sites.around(&self.world, place, cover);
        let mut sum = self.field.outgoing(&around, nodes, weights);
        let lobes = response.lobes.len();
        if lobes > 0 {
            let frame = frame.as_mat3();
            let open = self.field.is_open(&around);
            for (j, lobe) in response.lobes.iter().enumerate() {
                let energy: Vec4 = (0..3).map(|c| weights[c] * response.energies[nodes[c] * lobes + j]).sum();
                if energy.max_element() < NEGLIGIBLE {
                    continue;
                }
                let mut mean = Vec4::ZERO;
                incident_lobes(lobe.axis.as_vec3(), narrow(lobe.sharpness), wo.as_vec3(), |axis, sharpness, share| {
                    let through = if open { 1.0 } else { self.field.share(&around, axis, response.fineness.side) };
                    mean += share * through * self.maps.look_up(frame * axis, sharpness);
                });
                sum += energy * mean;
            }
        }
        sum / narrow(wo.z)
    }

    /// Radiance behind all objects.
    fn behind(&self, direction: DVec3) -> [f32; 3] {
        match &self.world.scene.environment {
            Some(e) if e.visible => e.map.radiance(direction),
            _ => self.world.scene.background,
        }
        .map(narrow)
    }
}
