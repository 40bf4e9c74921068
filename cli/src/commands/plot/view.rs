//! A view of the small-scale surface: a block of several periods, cut out and seen at an angle, so that its parts and its shape
//! can be told. Where the cut goes through something solid its section shows grey; what stands by itself outside and leans in is left out.
//!
//! The camera is orthographic: lengths across the picture are true, and a scale bar holds everywhere. Each pixel's colour is that
//! of what covers the surface (its reflectance for light from above) under a light from the left, with its shadows, and a
//! weaker headlight, so that nothing is black but the back of a face.

use super::bodies::Bodies;
use crate::common::figure::{Anchor, Svg, stroke};
use biscale::brdf::Brdf;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::geometry::Tile;
use biscale::material::{Material, SmallScale, Tint};
use biscale::numerics::colour::srgb_byte;
use biscale::visibility::{Hit, Occlusion, PeriodicBvh};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use resvg::tiny_skia::Pixmap;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Pixels of the view, and height of the strip below it, in pixels of the picture.
const WIDTH: u16 = 960;
const HEIGHT: u16 = 600;
const STRIP: f64 = 96.0;
/// Pixels of the PNG for one of the picture: small text stays legible.
pub const SCALE: u16 = 2;
/// Rays across and along each pixel of the PNG.
const RAYS: u16 = 2;

/// Where the camera stands: degrees above the horizon, and from the x axis.
const ELEVATION_DEG: f64 = 38.0;
const AZIMUTH_DEG: f64 = -64.0;
/// Share of the picture that the block may fill.
const FILL: f64 = 0.94;
/// Thickness of the block below the lowest point, of its width.
const BASE: f64 = 0.035;
/// By how much of its width a ray enters the block behind its cut, which may coincide with a face.
const BEHIND_CUT: f64 = 1e-7;

/// The lights: the side light from the left of the camera, the headlight, and what comes from everywhere.
const SIDE: f64 = 0.68;
const HEAD: f64 = 0.30;
const AMBIENT: f64 = 0.08;
/// Share of the lights that glossy surfaces reflect as they do, and not as if they were matt. Chosen by eye.
const AS_IT_IS: f64 = 0.6;
/// Around the block, and seen through the surface's gaps.
const BACKGROUND: [f64; 3] = [1.0; 3];
/// The back of a face: it blocks light and shows black.
const BACK: [f64; 3] = [0.0; 3];
/// Sections through solid matter, across x and across y.
const SECTIONS: [[f64; 3]; 2] = [[0.30, 0.30, 0.31], [0.52, 0.52, 0.53]];
/// The brightest part is shown this bright, in linear light.
const BRIGHTEST: f64 = 0.9;

/// A picture of the surface: pixels of the view, and what stands below them.
pub struct View {
    pub pixels: Pixmap,
    pub strip: Svg,
    /// Height of the view in the picture.
    pub height: f64,
}

/// The block that is shown, the camera's axes, and the size of the picture.
struct Scene {
    low: DVec3,
    high: DVec3,
    right: DVec3,
    up: DVec3,
    /// From the camera into the scene.
    forward: DVec3,
    /// To the side light.
    light: DVec3,
    /// Width of the picture, in the tile's unit.
    width: f64,
    /// What the middle of the picture looks at.
    middle: DVec3,
}

/// Periods of the longer side that are shown: fewer of a tile that holds many details.
fn periods(triangles: usize) -> u32 {
    match triangles {
        0..1000 => 4,
        1000..20_000 => 3,
        20_000..100_000 => 2,
        _ => 1,
    }
}

impl Scene {
    fn new(surface: &SmallScale, periods: u32) -> Self {
        let period = surface.tile.period;
        let side = f64::from(periods) * period.max_element();
        // As square as whole periods make it.
        let size = (DVec2::splat(side) / period).round() * period;
        let (bottom, top) = surface.tile.vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v.z), h.max(v.z)));
        let (bottom, top) = if bottom <= top { (bottom, top) } else { (0.0, 0.0) };
        let low = DVec3::new(0.0, 0.0, bottom - BASE * side);
        let high = size.extend(top + BEHIND_CUT * side);
        let ((sin_e, cos_e), (sin_a, cos_a)) = (ELEVATION_DEG.to_radians().sin_cos(), AZIMUTH_DEG.to_radians().sin_cos());
        let back = DVec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        let right = DVec3::new(-sin_a, cos_a, 0.0);
        let up = back.cross(right);
        let light = (back * 0.4 - right * 0.6 + DVec3::Z * 0.7).normalize();
        let middle = 0.5 * (low + high);
        let span = |axis: DVec3| axis.abs().dot(high - low);
        let width = span(right).max(span(up) * f64::from(WIDTH) / f64::from(HEIGHT)) / FILL;
        Self { low, high, right, up, forward: -back, light, width, middle }
    }

    /// Where a ray along [`Self::forward`] enters the block, on which axis, and how far it is to the other side.
    fn enter(&self, origin: DVec3) -> Option<(DVec3, usize, f64)> {
        let (a, b) = ((self.low - origin) / self.forward, (self.high - origin) / self.forward);
        let (near, far) = (a.min(b), a.max(b));
        let (enter, leave) = (near.max_element(), far.min_element());
        let axis = if near.z == enter { 2 } else { usize::from(near.y == enter) };
        (enter < leave).then(|| (origin + enter * self.forward, axis, leave - enter))
    }
}

/// What is seen of a surface.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// For light from above, exposed.
    colour: [f64; 3],
    /// The factor of that.
    exposure: f64,
}

/// What is seen of each surface: its colour for light from above, so that all together are well exposed.
fn colours(surface: &SmallScale) -> Vec<Seen> {
    let tinted = |s: &biscale::material::Surface| {
        let albedo = s.brdf.directional_albedo(DVec3::Z);
        let tint = if let Tint::Uniform(tint) = s.tint { tint } else { [1.0; 3] };
        std::array::from_fn(|c| albedo[c] * tint[c])
    };
    let colours: Vec<[f64; 3]> = surface.surfaces.iter().map(tinted).collect();
    let brightest = colours.iter().flatten().copied().fold(0.0, f64::max);
    let exposure = if brightest > 0.0 { BRIGHTEST / brightest } else { 1.0 };
    colours.into_iter().map(|c| Seen { colour: c.map(|v| v * exposure), exposure }).collect()
}

/// The view of `surface`, the tile of `material`; of `count` of its longer periods, or of as many as suit it.
///
/// # Errors
/// Those of [`PeriodicBvh::new`], and interruption.
pub fn view(material: &Material, surface: &SmallScale, count: Option<u32>, control: &Control<'_>) -> Result<View> {
    let bvh = PeriodicBvh::new(&surface.tile)?;
    let bodies = Bodies::new(&surface.tile);
    let scene = Scene::new(surface, count.unwrap_or_else(|| periods(surface.tile.triangles.len())));
    let colours = colours(surface);
    let (width, height) = (usize::from(WIDTH * SCALE), usize::from(HEIGHT * SCALE));
    let pixel = scene.width / width as f64;
    let eye = scene.middle - scene.forward * 2.0 * (scene.width + scene.high.z - scene.low.z);
    let seen = |x: f64, y: f64| {
        let origin = eye + scene.right * (x - 0.5 * width as f64) * pixel + scene.up * (0.5 * height as f64 - y) * pixel;
        shade(
            surface,
            &Shown { bvh: &bvh, bodies: &bodies, tile: &surface.tile, block: [scene.low, scene.high].map(DVec3::truncate) },
            &scene,
            &colours,
            origin,
        )
    };
    let done = AtomicUsize::new(0);
    let rows: Vec<Vec<u8>> = (0..height)
        .into_par_iter()
        .map(|row| {
            control.check()?;
            let mut bytes = Vec::with_capacity(4 * width);
            for column in 0..width {
                let mut sum = [0.0; 3];
                for i in 0..usize::from(RAYS * RAYS) {
                    let n = usize::from(RAYS);
                    let at = |k: usize| (k as f64 + 0.5) / n as f64;
                    let colour = seen(column as f64 + at(i % n), row as f64 + at(i / n));
                    for (sum, colour) in sum.iter_mut().zip(colour) {
                        *sum += colour / (n * n) as f64;
                    }
                }
                bytes.extend(sum.map(srgb_byte));
                bytes.push(u8::MAX);
            }
            (control.progress)("view", done.fetch_add(1, Ordering::Relaxed) as f64 / height as f64);
            Ok(bytes)
        })
        .collect::<Result<_>>()?;
    let size = resvg::tiny_skia::IntSize::from_wh(u32::from(WIDTH * SCALE), u32::from(HEIGHT * SCALE)).expect("constants over 0");
    let pixels = Pixmap::from_vec(rows.concat(), size).expect("four bytes a pixel");
    Ok(View { pixels, strip: strip(material, surface, &scene, &colours), height: f64::from(HEIGHT) })
}

/// Colour along the ray from `origin`, linear.
fn shade(surface: &SmallScale, shown: &Shown<'_>, scene: &Scene, colours: &[Seen], origin: DVec3) -> [f64; 3] {
    let Some((entry, axis, length)) = scene.enter(origin) else { return BACKGROUND };
    let behind = BEHIND_CUT * scene.width;
    let start = entry + scene.forward * behind;
    if axis < 2 && shown.is_inside(start) {
        return SECTIONS[axis];
    }
    let Some((hit, position)) = shown.closest(start, scene.forward, None) else { return BACKGROUND };
    if position.distance(start) + behind > length {
        return BACKGROUND;
    }
    if !hit.front {
        return BACK;
    }
    let triangle = hit.triangle as usize;
    let [a, b, c] = surface.tile.corners(triangle);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let cosine = normal.dot(scene.light).max(0.0);
    let lit = cosine > 0.0 && shown.bvh.occluded(triangle, hit.position, scene.light) != Occlusion::Blocked;
    let covered = usize::from(surface.surface_of_triangle[triangle]);
    let lights = [(-scene.forward, HEAD * normal.dot(-scene.forward).max(0.0)), (scene.light, if lit { SIDE * cosine } else { 0.0 })];
    let matt = AMBIENT + lights[0].1 + lights[1].1;
    let tint = match &surface.surfaces[covered].tint {
        Tint::Image(image) => uv(surface, &hit).map_or([1.0; 3], |uv| image.lookup(uv).map(f64::from)),
        Tint::Uniform(_) => [1.0; 3],
    };
    let Seen { colour, exposure } = colours[covered];
    let brdf = &surface.surfaces[covered].brdf;
    // Of a matt surface both parts are the same; looking up measured ones would take longer than all of the view.
    if matches!(brdf, Brdf::Lambert { .. } | Brdf::Measured(_)) {
        return std::array::from_fn(|c| colour[c] * tint[c] * matt);
    }
    let reflected = lights.map(|(wi, light)| brdf.eval(normal, wi, -scene.forward).map(|fr| PI * fr * light));
    let constant = if let Tint::Uniform(tint) = surface.surfaces[covered].tint { tint } else { [1.0; 3] };
    std::array::from_fn(|c| {
        let as_it_is = exposure * constant[c] * (reflected[0][c] + reflected[1][c]) + colour[c] * AMBIENT;
        tint[c] * (AS_IT_IS * as_it_is + (1.0 - AS_IT_IS) * colour[c] * matt)
    })
}

/// The surface as the block shows it.
struct Shown<'a> {
    bvh: &'a PeriodicBvh,
    bodies: &'a Bodies,
    tile: &'a Tile,
    block: [DVec2; 2],
}

impl Shown<'_> {
    /// Faces behind or above each other that are looked at.
    const MOST: usize = 64;

    /// The first hit of a ray with what stands in the block, if there is one, and where that is; the hit has its position in one period.
    fn closest(&self, origin: DVec3, direction: DVec3, skip_triangle: Option<u32>) -> Option<(Hit, DVec3)> {
        let (mut from, mut skip) = (origin, skip_triangle);
        for _ in 0..Self::MOST {
            let hit = self.bvh.closest(from, direction, skip)?;
            let position = from + hit.distance * direction;
            let triangle = hit.triangle as usize;
            let [a, b, c] = self.tile.corners(triangle);
            if self.bodies.stands_in(triangle, (a + b + c) / 3.0, position, self.block) {
                return Some((hit, position));
            }
            (from, skip) = (position, Some(hit.triangle));
        }
        None
    }

    /// Whether a point lies inside of something solid: the way up leaves more often, through backs of faces, than it enters.
    fn is_inside(&self, point: DVec3) -> bool {
        let mut balance = 0;
        let mut hit = self.closest(point, DVec3::Z, None);
        for _ in 0..Self::MOST {
            let Some((face, position)) = hit else { break };
            balance += if face.front { -1 } else { 1 };
            hit = self.closest(position, DVec3::Z, Some(face.triangle));
        }
        balance > 0
    }
}

/// Texture coordinates of a hit.
fn uv(surface: &SmallScale, hit: &Hit) -> Option<DVec2> {
    let triangle = hit.triangle as usize;
    let uv = surface.tile.uv.as_ref()?[triangle];
    let corners = surface.tile.corners(triangle);
    // The hit lies on a translate of the triangle: the one nearest to it.
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let offset = (hit.position - centre).truncate();
    let shift = (offset / surface.tile.period).round() * surface.tile.period;
    let p = hit.position - shift.extend(0.0);
    let [a, b, c] = corners;
    let area = (b - a).cross(c - a);
    let weight = |u: DVec3, v: DVec3| (u - p).cross(v - p).dot(area) / area.length_squared();
    Some(uv[0] * weight(b, c) + uv[1] * weight(c, a) + uv[2] * weight(a, b))
}

/// The strip below the view: name, size, parts, and a scale bar.
fn strip(material: &Material, surface: &SmallScale, scene: &Scene, colours: &[Seen]) -> Svg {
    let (width, top) = (f64::from(WIDTH), f64::from(HEIGHT));
    let mut svg = Svg::new(width, top + STRIP);
    svg.text([20.0, top + 36.0], 26.0, Anchor::Start, "#222222", &material.name);
    let tile = &surface.tile;
    let unit = if material.unit == "um" { "µm" } else { material.unit };
    let count = (scene.high - scene.low).truncate() / tile.period;
    let what = format!("{:.0} × {:.0} periods of {} × {} {unit}", count.x, count.y, digits(tile.period.x), digits(tile.period.y));
    svg.text([20.0, top + 72.0], 19.0, Anchor::Start, "#6a6a6a", &what);
    // The scale bar: a round length of about a sixth of the picture.
    let length = round_below(scene.width / 6.0);
    let pixels = length / scene.width * width;
    let (x, y) = (width - 20.0 - pixels, top + 40.0);
    svg.line([x, y], [x + pixels, y], stroke("#222222", 3.0));
    for end in [x, x + pixels] {
        svg.line([end, y - 7.0], [end, y + 7.0], stroke("#222222", 1.4));
    }
    svg.text([x + pixels / 2.0, y + 29.0], 19.0, Anchor::Middle, "#222222", &format!("{} {unit}", digits(length)));
    parts(&mut svg, surface, colours, x - 30.0, top + 27.0);
    svg
}

/// The surfaces with their colours, ending at `right`: if there are several that can be told apart, and as many as fit.
fn parts(svg: &mut Svg, surface: &SmallScale, colours: &[Seen], right: f64, y: f64) {
    /// Entries a column, width of a column, and entries at most.
    const ROWS: usize = 3;
    const COLUMN: f64 = 165.0;
    const MOST: usize = 6;
    /// Letters that fit beside a swatch.
    const LETTERS: usize = 13;
    let mut entries: Vec<([u8; 3], &str)> = Vec::new();
    for (index, (covering, colour)) in surface.surfaces.iter().zip(colours).enumerate() {
        let used = surface.surface_of_triangle.iter().any(|&s| usize::from(s) == index);
        let name = if covering.part == "*" { "the rest" } else { &covering.part };
        let colour = colour.colour.map(srgb_byte);
        if used && !entries.iter().any(|e| e.0 == colour) {
            entries.push((colour, name));
        }
    }
    if !(2..=MOST).contains(&entries.len()) {
        return;
    }
    let columns = entries.len().div_ceil(ROWS);
    for (i, ([r, g, b], name)) in entries.into_iter().enumerate() {
        let x = right - COLUMN * (columns - i / ROWS) as f64;
        let y = y + 27.0 * (i % ROWS) as f64;
        svg.rectangle([x, y - 14.0], [22.0, 15.0], &format!("#{r:02x}{g:02x}{b:02x}"), "#6a6a6a");
        let name: String = name.chars().take(LETTERS).collect();
        svg.text([x + 30.0, y], 19.0, Anchor::Start, "#222222", &name);
    }
}

/// The largest of 1, 2, 5 times a power of ten that is at most `x`, which is over 0.
fn round_below(x: f64) -> f64 {
    let power = 10.0_f64.powf(x.log10().floor());
    [5.0, 2.0, 1.0].map(|m| m * power).into_iter().find(|v| *v <= x * 1.000_001).unwrap_or(power)
}

/// A length with at most four significant digits.
fn digits(x: f64) -> String {
    format!("{x:.3e}").parse::<f64>().unwrap_or(x).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_have_round_lengths() {
        for (x, expected) in [(0.9, 0.5), (1.0, 1.0), (4.99, 2.0), (5.0, 5.0), (73.0, 50.0), (3e-5, 2e-5)] {
            assert!((round_below(x) / expected - 1.0).abs() < 1e-9, "{x}: {}", round_below(x));
        }
    }

    #[test]
    fn white_black_and_middle_grey_are_encoded_as_the_standard_says() {
        assert_eq!([0.0, 1.0, 0.215_861, 2.0, -1.0].map(srgb_byte), [0, 255, 128, 255, 0]);
    }
}
