//! A photograph as a table: the radiance of all pixels that show nearly the same pair of directions, averaged.
//!
//! A homogeneous object looks alike wherever light and viewer stand alike. So pixels are sorted into bins of [`DirectionBins::step`] in the directions
//! to light and viewer, in the frame of the tile: the photograph is blurred along the surface, never across directions that differ, and the
//! effective BRDF is needed for one pair a bin. Coarse and fine tables of the same photograph make the pyramid of a search.

use crate::photograph::dark::Dark;
use crate::photograph::image::{Photograph, Pinhole};
use crate::photograph::params::PARAMS;
use crate::photograph::sight::{LEAST_COSINES, Sight};
use biscale::direction::Pair;
use biscale::error::{BadInput, Result};
use biscale::material::{Material, SmallScale};
use biscale::numerics::cast::truncate_i32;
use biscale::render::{Camera, Exposure, Footprint, Light, Scene, SceneMaterial, SurfacePoint, World};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Standard deviation of the model, as a share of the radiance: what a flat tile, one BRDF a part and direct light leave out.
pub const RELATIVE_NOISE: f64 = 0.02;
/// Directions that differ by less share what the model leaves out, radians: threads that are no ellipses, a BRDF that is not quite the
/// right one, are wrong over a lobe and not over a bin.
pub const CORRELATED: f64 = 0.26;
/// Directions over which errors are averaged, radians: about nine columns of a cylinder 84 pixels wide, as where pictures of this program are
/// compared with photographs of single threads (`docs/scenes.md`).
pub const WINDOW: f64 = 0.11;

/// Pixels of nearly the same directions.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionBin {
    /// Mean direction to the light and to the viewer, tile's frame.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
    /// Change of `wi` a degree of the light's azimuth and elevation.
    pub turn: [DVec3; 2],
    /// Mean of `1 / cos(theta_o)`.
    pub inverse_cosine: f64,
    /// Mean irradiance on a plane that faces the light.
    pub irradiance: [f64; 3],
    /// Pixels.
    pub count: usize,
    /// Mean radiance.
    pub mean: [f64; 3],
    /// Standard deviation of the mean: of the pixels' scatter, and [`RELATIVE_NOISE`] of the mean.
    pub sigma: [f64; 3],
    /// What its residuals count: one over the number of bins within [`CORRELATED`], whose model errors are nearly the same.
    pub weight: f64,
}

/// The bins of one photograph.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DirectionBins {
    /// The bins, in a fixed order.
    pub bins: Vec<DirectionBin>,
    /// Size of a bin in each of the four coordinates of a pair of directions, radians.
    pub step: f64,
    /// Mean radiance of all pixels that are used.
    pub mean: [f64; 3],
    /// What the photograph says of light that lies over all of it.
    pub dark: Dark,
    /// Pixels that are used.
    pub pixels: usize,
    /// The pixels of each bin, by their index in the picture.
    pub members: Vec<Vec<u32>>,
}

/// The light turned about its azimuth and elevation, degrees; a point light around `centre`.
pub fn turned(light: &Light, turn_deg: [f64; 2], centre: DVec3) -> Light {
    let turn = |v: DVec3| {
        let length = v.length();
        let (azimuth, elevation) = (v.y.atan2(v.x), (v.z / length).clamp(-1.0, 1.0).asin());
        let (a, e) = (azimuth + turn_deg[0].to_radians(), elevation + turn_deg[1].to_radians());
        length * DVec3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin())
    };
    match *light {
        Light::Directional { to_light, irradiance } => Light::Directional { to_light: turn(to_light), irradiance },
        Light::Point { position, intensity } => Light::Point { position: centre + turn(position - centre), intensity },
    }
}

/// Direction to the light and irradiance at a point.
fn light_at(light: &Light, position: DVec3) -> (DVec3, f64, [f64; 3]) {
    match *light {
        Light::Directional { to_light, irradiance } => (to_light, f64::INFINITY, irradiance),
        Light::Point { position: from, intensity } => {
            let away = from - position;
            let distance = away.length().max(f64::MIN_POSITIVE);
            (away / distance, distance, intensity.map(|i| i / (distance * distance)))
        }
    }
}

/// The scene that a photograph shows, with a material on its object.
pub fn scene_of(photograph: &Photograph, material: &Material, small: &SmallScale) -> Scene {
    let Pinhole { origin, axes, focal, .. } = photograph.camera;
    let half_width = 0.5 * f64::from(photograph.image.width) / focal[0];
    let camera = Camera { origin, axes, half_width, width: photograph.image.width, height: photograph.image.height, samples: 1 };
    let parts = photograph.object.materials.len();
    let mut object = photograph.object.clone();
    object.materials = vec![0; parts];
    Scene {
        file: photograph.file.clone(),
        name: "photograph".to_owned(),
        camera,
        lights: vec![photograph.light],
        exposure: Exposure::default(),
        environment: None,
        background: [0.0; 3],
        objects: vec![object],
        materials: vec![SceneMaterial { material: material.clone(), small: small.clone() }],
    }
}

/// What a ray through a point of the picture meets first.
pub fn first_point(world: &World<'_>, photograph: &Photograph, x: f64, y: f64) -> Option<SurfacePoint> {
    world.first(photograph.camera.origin, photograph.camera.direction(x, y), 0.0).filter(|p| p.front)
}

/// The pixels that show the object all over, whether they may be used or not.
pub fn sights(world: &World<'_>, photograph: &Photograph) -> Vec<Sight> {
    let (width, height) = (photograph.image.width, photograph.image.height);
    let centre = photograph.object.middle();
    let nudged = [[PARAMS.nudge_deg, 0.0], [0.0, PARAMS.nudge_deg]].map(|turn| turned(&photograph.light, turn, centre));
    let row = |y: u32| {
        let mut found = Vec::new();
        for x in 0..width {
            let (fx, fy) = (f64::from(x), f64::from(y));
            // Pixels at the outline show something else as well.
            if [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
                .iter()
                .any(|(dx, dy)| first_point(world, photograph, fx + dx, fy + dy).is_none())
            {
                continue;
            }
            let Some(point) = first_point(world, photograph, fx + 0.5, fy + 0.5) else { continue };
            let to_tile = point.frame.transpose();
            let (to_light, distance, irradiance) = light_at(&photograph.light, point.position);
            let wi = to_tile * to_light;
            let wo = to_tile * -photograph.camera.direction(fx + 0.5, fy + 0.5);
            let turn = nudged.map(|light| (to_tile * light_at(&light, point.position).0 - wi) / PARAMS.nudge_deg);
            let lit = wi.z > 0.0 && world.transmittance(&point, Footprint::POINT, to_light, distance) > 0.0;
            found.push(Sight { pixel: y * width + x, position: point.position, wi, wo, turn, irradiance, lit });
        }
        found
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

/// A direction as a point of a plane, by equal areas of the hemisphere.
fn flat(w: DVec3) -> DVec2 {
    w.truncate() * (2.0 / (1.0 + w.z.max(0.0))).sqrt()
}

impl DirectionBins {
    /// The bins of a photograph: the smallest ones that are at most `most`.
    ///
    /// # Errors
    /// Bad input if no pixel can be used.
    pub fn new(photograph: &Photograph, sights: &[Sight], most: usize) -> Result<Self> {
        let image = &photograph.image;
        let used: Vec<&Sight> = sights
            .iter()
            .filter(|s| s.lit && s.wi.z >= LEAST_COSINES[0] && s.wo.z >= LEAST_COSINES[1] && !image.rgb[s.pixel as usize][0].is_nan())
            .collect();
        if used.is_empty() {
            let lit = sights.iter().any(|s| s.lit && s.wi.z >= LEAST_COSINES[0]);
            let why = match (sights.is_empty(), lit) {
                (true, _) => "the camera does not see the object",
                (false, false) => "the light does not reach what the camera sees, or grazes it",
                (false, true) => "the mask, holes or clipped pixels leave nothing over",
            };
            let remedy = "check camera, light and shape of this photograph";
            return Err(BadInput::new(format!("no pixel can be used: {why}"), remedy).in_file(&photograph.file).into());
        }
        let mut step = PARAMS.finest_step;
        loop {
            let groups = group(&used, step);
            if groups.len() <= most {
                return Ok(Self { dark: Dark::of(photograph, sights), ..Self::of(photograph, &used, &groups, step) });
            }
            step *= PARAMS.wider_step;
        }
    }

    fn of(photograph: &Photograph, used: &[&Sight], groups: &BTreeMap<[i32; 4], Vec<u32>>, step: f64) -> Self {
        let value = |s: &Sight| photograph.image.rgb[s.pixel as usize].map(f64::from);
        let mean_of =
            |members: &[u32], f: &dyn Fn(&Sight) -> f64| members.iter().map(|&m| f(used[m as usize])).sum::<f64>() / members.len() as f64;
        let mean_vector = |members: &[u32], f: &dyn Fn(&Sight) -> DVec3| {
            members.iter().map(|&m| f(used[m as usize])).sum::<DVec3>() / members.len() as f64
        };
        let means: Vec<[f64; 3]> = groups.values().map(|members| std::array::from_fn(|c| mean_of(members, &|s| value(s)[c]))).collect();
        // What pixels scatter by around the mean of their bin, as variance a + b I.
        let noise: Option<[[f64; 2]; 3]> = photograph.noise.map(|[a, b]| std::array::from_fn(|c| [a[c], b[c]]));
        let scatter: [[f64; 2]; 3] = std::array::from_fn(|c| {
            let points: Vec<(f64, f64, f64)> = groups
                .values()
                .zip(&means)
                .filter(|(members, _)| members.len() > 2)
                .map(|(members, mean)| {
                    let n = members.len() as f64;
                    let variance = members.iter().map(|&m| (value(used[m as usize])[c] - mean[c]).powi(2)).sum::<f64>() / (n - 1.0);
                    (mean[c].max(0.0), variance, n)
                })
                .collect();
            let found = line(&points);
            // The pixels' own noise is the least that they scatter by.
            let given = noise.unwrap_or_default();
            [found[0].max(given[c][0]), found[1].max(given[c][1])]
        });
        let bin = |(members, &mean): (&Vec<u32>, &[f64; 3])| {
            let sigma = std::array::from_fn(|c| {
                let variance = (scatter[c][0] + scatter[c][1] * mean[c].max(0.0)) / members.len() as f64;
                (variance + (RELATIVE_NOISE * mean[c]).powi(2)).sqrt().max(1e-9)
            });
            DirectionBin {
                wi: mean_vector(members, &|s| s.wi).normalize(),
                wo: mean_vector(members, &|s| s.wo).normalize(),
                turn: std::array::from_fn(|k| mean_vector(members, &|s| s.turn[k])),
                inverse_cosine: mean_of(members, &|s| 1.0 / s.wo.z),
                irradiance: std::array::from_fn(|c| mean_of(members, &|s| s.irradiance[c])),
                count: members.len(),
                mean,
                sigma,
                weight: 1.0,
            }
        };
        let mut bins: Vec<DirectionBin> = groups.values().zip(&means).map(bin).collect();
        let near = |a: &DirectionBin, b: &DirectionBin| a.wi.distance(b.wi) < CORRELATED && a.wo.distance(b.wo) < CORRELATED;
        let weights: Vec<f64> = bins.iter().map(|a| 1.0 / bins.iter().filter(|b| near(a, b)).count() as f64).collect();
        bins.iter_mut().zip(weights).for_each(|(bin, weight)| bin.weight = weight);
        let mean = std::array::from_fn(|c| used.iter().map(|s| value(s)[c]).sum::<f64>() / used.len() as f64);
        let members = groups.values().map(|m| m.iter().map(|&k| used[k as usize].pixel).collect()).collect();
        Self { bins, step, mean, dark: Dark::default(), pixels: used.len(), members }
    }

    /// How far a picture is from the photograph: `sqrt(sum n d² / sum n v²)`, where `d` is the difference and `v` the photograph's value,
    /// both averaged over the bins within [`WINDOW`]: what single threads do to single pixels is no error of their average.
    pub fn relative_rms(&self, predicted: &[[f64; 3]]) -> f64 {
        let (difference, energy) = self.squares(predicted);
        if energy > 0.0 { (difference / energy).sqrt() } else { f64::INFINITY }
    }

    /// The two sums of [`Self::relative_rms`].
    pub fn squares(&self, predicted: &[[f64; 3]]) -> (f64, f64) {
        let near = |a: &DirectionBin, b: &DirectionBin| a.wi.distance(b.wi) < WINDOW && a.wo.distance(b.wo) < WINDOW;
        let (mut difference, mut energy) = (0.0, 0.0);
        for a in &self.bins {
            let (mut d, mut v, mut n) = ([0.0; 3], [0.0; 3], 0.0);
            for (b, value) in self.bins.iter().zip(predicted).filter(|(b, _)| near(a, b)) {
                let count = b.count as f64;
                n += count;
                for c in 0..3 {
                    d[c] += count * (value[c] - b.mean[c]);
                    v[c] += count * b.mean[c];
                }
            }
            for c in 0..3 {
                difference += a.count as f64 * (d[c] / n).powi(2);
                energy += a.count as f64 * (v[c] / n).powi(2);
            }
        }
        (difference, energy)
    }

    /// The pairs of the bins under a light that is turned by these degrees of azimuth and elevation.
    pub fn pairs(&self, turn_deg: [f64; 2]) -> Vec<Pair> {
        let pair =
            |bin: &DirectionBin| Pair { wi: (bin.wi + turn_deg[0] * bin.turn[0] + turn_deg[1] * bin.turn[1]).normalize(), wo: bin.wo };
        self.bins.iter().map(pair).collect()
    }
}

fn group(used: &[&Sight], step: f64) -> BTreeMap<[i32; 4], Vec<u32>> {
    let mut groups: BTreeMap<[i32; 4], Vec<u32>> = BTreeMap::new();
    for (k, sight) in (0_u32..).zip(used) {
        let (i, o) = (flat(sight.wi) / step, flat(sight.wo) / step);
        let key = [i.x, i.y, o.x, o.y].map(|v| truncate_i32(v.round()));
        groups.entry(key).or_default().push(k);
    }
    groups
}

/// `a` and `b`, not negative, of the line `a + b x` through points `(x, y, weight)`.
fn line(points: &[(f64, f64, f64)]) -> [f64; 2] {
    let mut normal = crate::bounded_least_squares::Normal::new(2);
    let top = points.iter().map(|p| p.1).fold(0.0, f64::max);
    if top <= 0.0 {
        return [0.0; 2];
    }
    for &(x, y, weight) in points {
        normal.add(&[(0, 1.0), (1, x)], y / top, weight);
    }
    let found = normal.solve(&[0.0; 2], &[f64::MAX.sqrt(); 2]);
    [found[0] * top, found[1] * top]
}
