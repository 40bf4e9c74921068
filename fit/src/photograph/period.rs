//! The period of a surface in a close-up photograph.
//!
//! The photograph is seen straight on first: every point of a regular grid on the surface is looked up in the picture. Then the picture is compared
//! with itself, shifted along x or y: where the two agree again, the shift is a period, or several.

use crate::photograph::image::Photograph;
use crate::photograph::params::PARAMS;
use biscale::numerics::cast::{narrow, truncate_usize};
use biscale::render::{Cylinder, Shape, any_across};
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

/// The period along one direction of the tile.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Period {
    /// Length, in the units of the photograph's camera.
    pub length: f64,
    /// Standard deviation, about: half a pixel over the longest shift that was compared.
    pub sigma: f64,
    /// Correlation of the picture with itself, shifted so.
    pub agreement: f64,
}

/// A surface seen straight on.
#[derive(Clone, Debug, PartialEq)]
pub struct Straight {
    /// Pixels across, along tile x.
    pub width: usize,
    /// Pixels along tile y.
    pub height: usize,
    /// Size of a pixel.
    pub pixel: f64,
    /// Size that a pixel of the photograph has on the surface.
    pub footprint: f64,
    /// Linear radiance, row 0 at the lowest y; NaN where the photograph does not say.
    pub rgb: Vec<[f32; 3]>,
}

/// The unit vector across the axis of a cylinder that points at the camera: coordinates begin there, far from their seam.
fn front(c: &Cylinder, photograph: &Photograph) -> DVec3 {
    let to = photograph.camera.origin - c.center;
    (to - to.dot(c.axis) * c.axis).try_normalize().unwrap_or_else(|| any_across(c.axis))
}

/// A point on a plane or cylinder from its coordinates along tile x and y.
fn point_at(photograph: &Photograph, [x, y]: [f64; 2]) -> Option<DVec3> {
    let (sin, cos) = photograph.object.turn.sin_cos();
    // The tile's axes are turned counter-clockwise against the shape's.
    let (x, y) = (cos * x - sin * y, sin * x + cos * y);
    match &photograph.object.shape {
        Shape::Plane(plane) => Some(plane.center + plane.frame * DVec3::new(x, y, 0.0)),
        Shape::Cylinder(c) => {
            let front = front(c, photograph);
            let side = c.axis.cross(front);
            let angle = x / c.radius;
            Some(c.center + c.radius * (angle.cos() * front + angle.sin() * side) + y * c.axis)
        }
        Shape::Sphere(_) | Shape::Mesh(_) => None,
    }
}

/// Coordinates along tile x and y of a point on a plane or cylinder.
pub fn coordinates(photograph: &Photograph, p: DVec3) -> Option<[f64; 2]> {
    let [x, y] = match &photograph.object.shape {
        Shape::Plane(plane) => {
            let local = plane.frame.transpose() * (p - plane.center);
            [local.x, local.y]
        }
        Shape::Cylinder(c) => {
            let front = front(c, photograph);
            let from = p - c.center;
            [c.radius * from.dot(c.axis.cross(front)).atan2(from.dot(front)), from.dot(c.axis)]
        }
        Shape::Sphere(_) | Shape::Mesh(_) => return None,
    };
    let (sin, cos) = photograph.object.turn.sin_cos();
    Some([cos * x + sin * y, cos * y - sin * x])
}

impl Straight {
    /// The surface of a photograph whose pixels show the points `seen`; `None` for spheres and meshes, which have no straight view.
    pub fn new(photograph: &Photograph, seen: &[(u32, DVec3)]) -> Option<Self> {
        let points = seen.iter().map(|(_, p)| coordinates(photograph, *p)).collect::<Option<Vec<_>>>()?;
        if points.len() < 64 {
            return None;
        }
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in &points {
            for k in 0..2 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        // As many pixels as the photograph has there, unless it has very many.
        let footprint = (area / points.len() as f64).sqrt();
        let pixel = footprint.max((high[0] - low[0]).max(high[1] - low[1]) / PARAMS.straight_pixels as f64);
        let count = |k: usize| truncate_usize(((high[k] - low[k]) / pixel).floor()).clamp(1, PARAMS.straight_pixels);
        let (width, height) = (count(0), count(1));
        let at = |index: usize| {
            let (column, row) = (index % width, index / width);
            let p = point_at(photograph, [low[0] + (column as f64 + 0.5) * pixel, low[1] + (row as f64 + 0.5) * pixel]);
            p.map_or([f32::NAN; 3], |p| lookup(photograph, p))
        };
        Some(Self { width, height, pixel, footprint, rgb: (0..width * height).into_par_iter().map(at).collect() })
    }

    /// The period along tile x (0) or y (1); `None` if the picture does not repeat along it.
    pub fn period(&self, axis: usize) -> Option<Period> {
        let length = if axis == 0 { self.width } else { self.height };
        let most = length / 2;
        let agreement: Vec<f64> = (0..=most).into_par_iter().map(|shift| self.agreement(axis, shift)).collect();
        // A return must have been away; a surface that is the same all along never is.
        let away = agreement.iter().position(|&r| r < PARAMS.away.min(0.5 * (1.0 + agreement.iter().copied().fold(1.0, f64::min))))?;
        let is_peak = |k: usize| k > away && k < most && agreement[k] >= agreement[k - 1] && agreement[k] > agreement[k + 1];
        let best = (1..most).filter(|&k| is_peak(k)).map(|k| agreement[k]).fold(0.0, f64::max);
        if best < PARAMS.least_agreement {
            return None;
        }
        let first = (1..most).find(|&k| is_peak(k) && agreement[k] >= PARAMS.first_agreement * best)?;
        let refined = |k: usize| {
            let (l, m, r) = (agreement[k - 1], agreement[k], agreement[k + 1]);
            let bend = l - 2.0 * m + r;
            k as f64 + if bend < 0.0 { (0.5 * (l - r) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        // Longer shifts tell it more exactly, each found near where the shorter ones say.
        let (mut period, mut multiple) = (refined(first), 1.0);
        for n in 2..=length {
            let near = truncate_usize((n as f64 * period).round());
            if near + 2 >= most {
                break;
            }
            let reach = (first / 4).max(1);
            let found = (near.saturating_sub(reach).max(1)..=(near + reach).min(most - 1)).filter(|&k| is_peak(k));
            let Some(k) = found.max_by(|&a, &b| agreement[a].total_cmp(&agreement[b])) else { break };
            if agreement[k] < 0.7 * best {
                break;
            }
            (period, multiple) = (refined(k) / n as f64, n as f64);
        }
        Some(Period { length: period * self.pixel, sigma: 0.5 * self.pixel / multiple, agreement: agreement[first] })
    }

    /// Correlation of the picture with itself, shifted by pixels along x (0) or y (1).
    fn agreement(&self, axis: usize, shift: usize) -> f64 {
        let (dx, dy) = if axis == 0 { (shift, 0) } else { (0, shift) };
        let mut pairs: Vec<([f32; 3], [f32; 3])> = Vec::new();
        for row in 0..self.height - dy {
            for column in 0..self.width - dx {
                let (a, b) = (self.rgb[row * self.width + column], self.rgb[(row + dy) * self.width + column + dx]);
                if !a[0].is_nan() && !b[0].is_nan() {
                    pairs.push((a, b));
                }
            }
        }
        let n = pairs.len() as f64;
        let (mut product, mut energy) = (0.0, [0.0; 2]);
        for c in 0..3 {
            let mean = |values: &mut dyn Iterator<Item = f32>| values.map(f64::from).sum::<f64>() / n.max(1.0);
            let (ma, mb) = (mean(&mut pairs.iter().map(|p| p.0[c])), mean(&mut pairs.iter().map(|p| p.1[c])));
            for (a, b) in &pairs {
                let (a, b) = (f64::from(a[c]) - ma, f64::from(b[c]) - mb);
                product += a * b;
                energy[0] += a * a;
                energy[1] += b * b;
            }
        }
        let root = (energy[0] * energy[1]).sqrt();
        if root > 0.0 { product / root } else { 1.0 }
    }
}

/// The radiance with which a photograph shows a point, between its pixels.
fn lookup(photograph: &Photograph, p: DVec3) -> [f32; 3] {
    let camera = &photograph.camera;
    let local = camera.axes.transpose() * (p - camera.origin);
    let (width, height) = (photograph.image.width as usize, photograph.image.height as usize);
    let x = camera.centre[0] + camera.focal[0] * local.x / local.z - 0.5;
    let y = camera.centre[1] - camera.focal[1] * local.y / local.z - 0.5;
    let inside = |v: f64, size: usize| v >= 0.0 && v < (size - 1) as f64;
    if local.z <= 0.0 || !inside(x, width) || !inside(y, height) {
        return [f32::NAN; 3];
    }
    let (column, row) = (truncate_usize(x), truncate_usize(y));
    let (u, v) = (narrow(x - column as f64), narrow(y - row as f64));
    let pixel = |c: usize, r: usize| photograph.image.rgb[r * width + c];
    let (a, b, c, d) = (pixel(column, row), pixel(column + 1, row), pixel(column, row + 1), pixel(column + 1, row + 1));
    std::array::from_fn(|k| (1.0 - v) * ((1.0 - u) * a[k] + u * b[k]) + v * ((1.0 - u) * c[k] + u * d[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, height: usize, f: impl Fn(f64, f64) -> f64) -> Straight {
        let rgb = (0..width * height).map(|k| [narrow(f((k % width) as f64 + 0.5, (k / width) as f64 + 0.5)); 3]).collect();
        Straight { width, height, pixel: 0.5, footprint: 0.5, rgb }
    }

    #[test]
    fn a_period_between_pixels_is_found_to_a_thousandth() {
        let wave = |x: f64, p: f64| (std::f64::consts::TAU * x / p).sin() + 0.4 * (2.0 * std::f64::consts::TAU * x / p).cos();
        let s = picture(300, 200, |x, y| 2.0 + wave(x, 23.37) + 0.5 * wave(y, 31.9));
        for (axis, p) in [(0, 23.37), (1, 31.9)] {
            let found = s.period(axis).unwrap();
            assert!((found.length / (0.5 * p) - 1.0).abs() < 2e-3, "{found:?} for {}", 0.5 * p);
        }
    }

    #[test]
    fn a_checkerboard_repeats_after_two_fields() {
        let s = picture(240, 240, |x, y| f64::from(u8::from((x / 20.0).floor() as i64 % 2 == (y / 20.0).floor() as i64 % 2)));
        for axis in 0..2 {
            let found = s.period(axis).unwrap();
            assert!((found.length / 20.0 - 1.0).abs() < 5e-3, "{found:?}");
        }
    }

    #[test]
    fn what_does_not_repeat_has_no_period() {
        assert_eq!(picture(200, 100, |x, _| (x * 0.2).sin() + 2.0).period(1), None);
        assert_eq!(picture(200, 100, |_, _| 1.0).period(0), None);
        let noise = |x: f64, y: f64| f64::from(biscale::numerics::low_discrepancy::hash((x as u32) * 1000 + y as u32)) / 4e9;
        assert_eq!(picture(200, 100, noise).period(0), None);
    }
}
