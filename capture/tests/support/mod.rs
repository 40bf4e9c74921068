//! A studio of its own: photographs whose truth is known, through a distorted, vignetted, noisy camera.
#![allow(dead_code, missing_docs, reason = "every test program uses a part of it")]
#![allow(
    clippy::unwrap_used,
    clippy::cast_possible_wrap,
    clippy::collapsible_if,
    reason = "a test's small pictures; steps that read one by one"
)]

pub mod flat_shoot;
pub mod phone;

use biscale::numerics::random::mix;
use biscale_capture::board::{Board, BoardKind};
use biscale_capture::colour::{by_rows, checker_rgb};
use biscale_capture::lens::{Lens, Pose, farthest};
use biscale_capture::photo::PlanarImage;
use biscale_capture::shoot::Shape;
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;

/// Side of the grid of rays in a pixel.
const RAYS: usize = 3;

/// The colour of a place of the sample, by its coordinates across (or around) and along from the lower left corner, mm.
pub type Paint<'a> = Box<dyn Fn(DVec2) -> [f64; 3] + Sync + 'a>;

/// What is in front of the camera, in the sample's frame.
pub struct Scene<'a> {
    pub shape: Shape,
    pub paint: Paint<'a>,
    /// Towards the light.
    pub light: DVec3,
    /// On a plane that faces the light; pi makes white facing it 1.
    pub irradiance: f64,
    pub ball: Option<(DVec3, f64)>,
    /// Foot, height and radius of an upright stick.
    pub stick: Option<(DVec2, f64, f64)>,
    /// Light falls off along this direction, a share a mm.
    pub tilt: DVec2,
}

impl<'a> Scene<'a> {
    pub fn new(shape: Shape, light: DVec3, paint: Paint<'a>) -> Self {
        Self { shape, paint, light: light.normalize(), irradiance: std::f64::consts::PI, ball: None, stick: None, tilt: DVec2::ZERO }
    }

    fn radiance(&self, eye: DVec3, direction: DVec3) -> [f64; 3] {
        let mut nearest = f64::INFINITY;
        let mut out = [0.0; 3];
        if let Some((middle, radius)) = self.ball {
            if let Some(t) = sphere(eye, direction, middle, radius) {
                nearest = t;
                let normal = (eye + t * direction - middle) / radius;
                let mirrored = direction - 2.0 * direction.dot(normal) * normal;
                // A lamp of 1.5 degrees in a dim room that is lighter above; below is the page.
                let lamp = mirrored.dot(self.light) > 1.5_f64.to_radians().cos();
                out = [if lamp { 30.0 } else { 0.05 + 0.03 * mirrored.z.max(0.0) }; 3];
                if let Some(place) = self.shape.hit(eye + t * direction, mirrored) {
                    let e = self.irradiance / std::f64::consts::PI * place.normal.dot(self.light).max(0.0);
                    let shaded = sphere(place.point + 1e-6 * place.normal, self.light, middle, radius).is_some();
                    out = (self.paint)(place.st).map(|a| 0.9 * a * e * if shaded { 0.06 } else { 1.0 });
                }
            }
        }
        if let Some((foot, height, radius)) = self.stick {
            if let Some(t) = upright(eye, direction, foot, height, radius).filter(|t| *t < nearest) {
                nearest = t;
                out = [0.1; 3];
            }
        }
        if let Some(place) = self.shape.hit(eye, direction) {
            if (place.point - eye).dot(direction) < nearest {
                let facing = place.normal.dot(self.light).max(0.0);
                let above = place.point + 1e-6 * place.normal;
                let shaded = self.stick.is_some_and(|(f, h, r)| upright(above, self.light, f, h, r).is_some())
                    || self.ball.is_some_and(|(m, r)| sphere(above, self.light, m, r).is_some());
                let e = if shaded { 0.06 } else { 1.0 } * self.irradiance / std::f64::consts::PI
                    * facing
                    * (1.0 + self.tilt.dot(place.point.truncate()));
                return (self.paint)(place.st).map(|a| a * e);
            }
        }
        out
    }
}

fn sphere(eye: DVec3, direction: DVec3, middle: DVec3, radius: f64) -> Option<f64> {
    let to = eye - middle;
    let b = to.dot(direction);
    let root = b * b - (to.length_squared() - radius * radius);
    (root > 0.0 && -b - root.sqrt() > 0.0).then(|| -b - root.sqrt())
}

fn upright(eye: DVec3, direction: DVec3, foot: DVec2, height: f64, radius: f64) -> Option<f64> {
    let (o, d) = (eye.truncate() - foot, direction.truncate());
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - radius * radius);
    let root = b * b - a * c;
    let t = (-b - root.max(0.0).sqrt()) / a;
    let z = eye.z + t * direction.z;
    (root > 0.0 && t > 0.0 && z > 0.0 && z < height).then_some(t)
}

/// A camera and how it records.
#[derive(Clone, Debug)]
pub struct Studio {
    pub lens: Lens,
    /// `V(r) = 1 + b r² + c r⁴ + d r⁶`.
    pub vignetting: [f64; 3],
    /// Linear Rec. 709 to the sensor's own colours.
    pub sensor: DMat3,
    /// Sensor value of a radiance of 1 in one second.
    pub gain: f64,
    /// Electrons of a full pixel and of read noise; 0: none.
    pub electrons: [f64; 2],
    /// Standard deviation of the blur, px.
    pub blur: f64,
    /// A Bayer mosaic, interpolated again.
    pub mosaic: bool,
    pub seed: u64,
}

impl Studio {
    /// A usual one of this size.
    pub fn new(width: usize, height: usize) -> Self {
        let f = 1.25 * width as f64;
        Self {
            lens: Lens {
                width,
                height,
                focal: DVec2::new(f, 1.002 * f),
                centre: DVec2::new(0.507 * width as f64, 0.489 * height as f64),
                distortion: [-0.12, 0.05, 8e-4, -6e-4, 0.0],
            },
            vignetting: [-0.32, -0.06, 0.03],
            sensor: by_rows([[0.62, 0.22, 0.05], [0.18, 0.68, 0.12], [0.03, 0.21, 0.59]]),
            gain: 0.7,
            electrons: [20_000.0, 4.0],
            blur: 0.4,
            mosaic: false,
            seed: 1,
        }
    }

    /// Sensor values (1 is full) of a second's exposure times `seconds`, before anything is lost to the file.
    pub fn photograph(&self, scene: &Scene<'_>, pose: &Pose, seconds: f64) -> PlanarImage {
        let lens = &self.lens;
        let (width, height) = (lens.width, lens.height);
        // Undistorted places of all pixel corners; inside of a pixel they are nearly bilinear.
        let corners: Vec<DVec2> = (0..(width + 1) * (height + 1))
            .into_par_iter()
            .map(|i| {
                let pixel = DVec2::new((i % (width + 1)) as f64 - 0.5, (i / (width + 1)) as f64 - 0.5);
                lens.undistort(lens.place(pixel)).expect("the lens sees its own pixels")
            })
            .collect();
        let (eye, back) = (pose.eye(), pose.rotation.transpose());
        let far = farthest(width, height, lens.centre);
        let mut out = PlanarImage::new(width, height);
        let pixels: Vec<[f32; 3]> = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let (column, row) = (i % width, i / width);
                let at = |u: f64, v: f64| {
                    let c = |dx: usize, dy: usize| corners[(row + dy) * (width + 1) + column + dx];
                    c(0, 0).lerp(c(1, 0), u).lerp(c(0, 1).lerp(c(1, 1), u), v)
                };
                let mut sum = DVec3::ZERO;
                for k in 0..RAYS * RAYS {
                    let (u, v) = (((k % RAYS) as f64 + 0.5) / RAYS as f64, ((k / RAYS) as f64 + 0.5) / RAYS as f64);
                    sum += DVec3::from(scene.radiance(eye, (back * at(u, v).extend(1.0)).normalize()));
                }
                let r2 = (DVec2::new(column as f64, row as f64) - lens.centre).length_squared() / (far * far);
                let [b, c, d] = self.vignetting;
                let falloff = 1.0 + r2 * (b + r2 * (c + r2 * d));
                (self.sensor * sum / (RAYS * RAYS) as f64 * (self.gain * seconds * falloff)).to_array().map(|v| v as f32)
            })
            .collect();
        for (c, plane) in out.planes.iter_mut().enumerate() {
            *plane = pixels.iter().map(|p| p[c]).collect();
            if self.blur > 0.0 {
                *plane = blurred(plane, width, self.blur);
            }
        }
        self.record(&mut out);
        out
    }

    /// Noise and mosaic; clips at full.
    fn record(&self, picture: &mut PlanarImage) {
        let width = picture.width;
        for (c, plane) in picture.planes.iter_mut().enumerate() {
            plane.par_iter_mut().enumerate().for_each(|(i, v)| {
                if self.electrons[0] > 0.0 {
                    let [well, read] = self.electrons;
                    let light = f64::from(*v).max(0.0);
                    let sigma = (light / well + (read / well).powi(2)).sqrt();
                    *v = (light + sigma * normal(self.seed ^ ((i as u64) << 2 | c as u64))) as f32;
                }
                *v = v.clamp(0.0, 1.0);
            });
        }
        if self.mosaic {
            let full = picture.planes.clone();
            let colour = |i: usize| [[0, 1], [1, 2]][(i / width) % 2][i % width % 2];
            let height = picture.height;
            for (c, plane) in picture.planes.iter_mut().enumerate() {
                plane.par_iter_mut().enumerate().for_each(|(i, v)| {
                    let (x, y) = (i % width, i / width);
                    let near = || {
                        (y.saturating_sub(1)..=(y + 1).min(height - 1))
                            .flat_map(move |j| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |k| j * width + k))
                    };
                    if colour(i) != c {
                        let (sum, n) = near().filter(|k| colour(*k) == c).fold((0.0, 0.0), |(s, n), k| (s + full[c][k], n + 1.0));
                        *v = sum / n;
                    }
                });
            }
        }
    }
}

fn blurred(plane: &[f32], width: usize, sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as i64;
    let weights: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp() as f32).collect();
    let total: f32 = weights.iter().sum();
    let height = plane.len() / width;
    let pass = |from: &[f32], across: bool| -> Vec<f32> {
        (0..from.len())
            .into_par_iter()
            .map(|i| {
                let (x, y) = ((i % width) as i64, (i / width) as i64);
                let at = |k: i64| {
                    let (x, y) = if across { ((x + k).clamp(0, width as i64 - 1), y) } else { (x, (y + k).clamp(0, height as i64 - 1)) };
                    from[y as usize * width + x as usize]
                };
                (-reach..=reach).zip(&weights).map(|(k, w)| w * at(k)).sum::<f32>() / total
            })
            .collect()
    };
    pass(&pass(plane, true), false)
}

/// A normal number of a key, by the library's hash and the method of Box and Muller.
pub fn normal(key: u64) -> f64 {
    let hash = |k: u64| mix(k.wrapping_add(0x9e37_79b9_7f4a_7c15)) as f64 / u64::MAX as f64;
    (-2.0 * hash(2 * key).max(1e-300).ln()).sqrt() * (std::f64::consts::TAU * hash(2 * key + 1)).cos()
}

/// Writes 16-bit linear values, as PNG or TIFF by the ending.
pub fn save16(picture: &PlanarImage, path: &Path) {
    let word = |v: f32| (f64::from(v).clamp(0.0, 1.0) * 65535.0).round() as u16;
    let pixels: Vec<u16> = (0..picture.planes[0].len()).flat_map(|i| [0, 1, 2].map(|c| word(picture.planes[c][i]))).collect();
    let image = image::ImageBuffer::<image::Rgb<u16>, _>::from_raw(picture.width as u32, picture.height as u32, pixels).unwrap();
    image.save(path).unwrap();
}

/// Writes 8 bits with the curve of sRGB, as a camera's JPEG or PNG by the ending.
pub fn save8(picture: &PlanarImage, path: &Path) {
    let byte = |v: f32| (255.0 * biscale::numerics::colour::linear_to_srgb(v.into())).round() as u8;
    let pixels: Vec<u8> = (0..picture.planes[0].len()).flat_map(|i| [0, 1, 2].map(|c| byte(picture.planes[c][i]))).collect();
    image::RgbImage::from_raw(picture.width as u32, picture.height as u32, pixels).unwrap().save(path).unwrap();
}

/// Paper.
pub const WHITE: [f64; 3] = [0.88; 3];
/// Ink.
pub const BLACK: [f64; 3] = [0.04; 3];

/// A printed board or sheet, to look up.
pub struct Print {
    board: Board,
    bits: HashMap<i32, Vec<bool>>,
    /// Markers that touch each square of 10 mm.
    near: HashMap<(i64, i64), Vec<usize>>,
}

/// Side of the squares that markers are listed in, mm.
const NEAR: f64 = 10.0;

impl Print {
    /// `bits(id)` are the cells of a marker, row by row, without the border.
    pub fn new(board: &Board, bits: &dyn Fn(i32) -> Vec<bool>) -> Self {
        let mut near: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
        for (k, (_, c)) in board.markers.iter().enumerate() {
            let (low, high) = c.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
            let (low, high) = ((low / NEAR).floor().as_i64vec2(), (high / NEAR).floor().as_i64vec2());
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    near.entry((x, y)).or_default().push(k);
                }
            }
        }
        Self { bits: board.markers.iter().map(|m| (m.0, bits(m.0))).collect(), board: board.clone(), near }
    }

    /// The colour at a place from the lower left corner, mm.
    pub fn at(&self, place: DVec2) -> [f64; 3] {
        let key = (place / NEAR).floor().as_i64vec2();
        for k in self.near.get(&(key.x, key.y)).into_iter().flatten() {
            let (id, c) = &self.board.markers[*k];
            let (x, y) = (c[1] - c[0], c[3] - c[0]);
            let p = place - c[0];
            let (u, v) = (p.dot(x) / x.length_squared(), p.dot(y) / y.length_squared());
            if (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v) {
                let cells = &self.bits[id];
                let inner = (cells.len() as f64).sqrt() as usize;
                let n = inner + 2;
                let (i, j) = ((u * n as f64) as usize, (v * n as f64) as usize);
                let inside = (1..=inner).contains(&i) && (1..=inner).contains(&j);
                return if inside && cells[(j - 1) * inner + i - 1] { WHITE } else { BLACK };
            }
        }
        let square = match self.board.kind {
            BoardKind::Charuco { square, .. } => square,
            BoardKind::Chessboard { columns, .. } => self.board.size.x / (f64::from(columns) + 1.0),
            BoardKind::Markers => return WHITE,
        };
        if place.min(self.board.size - place).min_element() < 0.0 {
            return WHITE;
        }
        let (i, j) = ((place.x / square) as usize, ((self.board.size.y - place.y) / square) as usize);
        if (i + j) % 2 == 0 { BLACK } else { WHITE }
    }
}

/// A checker with patches of `side` mm at a place from its lower left corner; `None` beside it.
pub fn checker(place: DVec2, side: f64) -> Option<[f64; 3]> {
    let pitch = 1.1 * side;
    let p = place - 0.1 * side;
    let (i, j) = ((p.x / pitch).floor(), 3.0 - (p.y / pitch).floor());
    let size = DVec2::new(6.0 * pitch + 0.1 * side, 4.0 * pitch + 0.1 * side);
    // The frame around it is as wide as half a patch.
    if place.min(size - place).min_element() < -0.5 * side {
        return None;
    }
    let inside = (0.0..6.0).contains(&i) && (0.0..4.0).contains(&j);
    let (u, v) = (p.x - i * pitch, p.y - (3.0 - j) * pitch);
    if inside && u < side && v < side { Some(checker_rgb()[(j * 6.0 + i) as usize]) } else { Some([0.03; 3]) }
}

/// A cloth: `draft[row][column]` true where the warp is on top, row 0 at the bottom; threads of pitch `pitch` and width `width`, mm.
pub fn cloth(place: DVec2, draft: &[&[bool]], pitch: DVec2, width: DVec2, warp: [f64; 3], weft: [f64; 3]) -> [f64; 3] {
    let cell = (place / pitch).floor();
    let off = place - (cell + 0.5) * pitch;
    let row = draft[cell.y.rem_euclid(draft.len() as f64) as usize];
    let over = row[cell.x.rem_euclid(row.len() as f64) as usize];
    let (on_warp, on_weft) = (2.0 * off.x.abs() < width.x, 2.0 * off.y.abs() < width.y);
    // A thread is round, and lower at its ends.
    let round = |across: f64, along: f64, c: [f64; 3]| {
        c.map(|v| v * (0.55 + 0.45 * (1.0 - across * across).sqrt()) * (0.8 + 0.2 * (0.5 * std::f64::consts::PI * along).cos()))
    };
    let warp_here = || round(2.0 * off.x / width.x, 2.0 * off.y / pitch.y, warp);
    let weft_here = || round(2.0 * off.y / width.y, 2.0 * off.x / pitch.x, weft);
    match (on_warp, on_weft) {
        (true, true) if over => warp_here(),
        (true, true) => weft_here(),
        (true, false) => warp_here(),
        (false, true) => weft_here(),
        (false, false) => [0.01; 3],
    }
}

/// Poses all around a plane, looking at it from this distance.
pub fn around(count: usize, distance: f64, spread: f64) -> Vec<Pose> {
    (0..count)
        .map(|k| {
            let turn = 2.399_963 * k as f64;
            let tilt = (0.1 + 0.55 * ((k as f64 + 0.5) / count as f64).sqrt()).sin();
            let eye =
                DVec3::new(tilt * turn.cos(), tilt * turn.sin(), (1.0 - tilt * tilt).sqrt()) * distance * (1.0 + 0.1 * (3.0 * turn).sin());
            let target = spread * DVec3::new((1.7 * k as f64).cos(), (2.3 * k as f64).sin(), 0.0);
            let up = DVec3::new((0.4 * k as f64).sin(), (0.4 * k as f64).cos(), 0.0);
            Pose::looking_at(eye, target, up)
        })
        .collect()
}
