//! Cloths drawn for the tests: sections, bends, shading, shadows and disturbances of their own, by nothing of what is tested.

#![allow(dead_code, reason = "each test uses a part of it")]

use biscale::numerics::random::Random as Stream;
use rayon::prelude::*;

/// How a cloth looks.
#[derive(Clone, Debug)]
pub struct Cloth {
    /// Rows from the lowest, `true` where the warp lies over.
    pub draft: Vec<Vec<bool>>,
    /// Pixels from warp to warp and from weft to weft.
    pub pitch: [f64; 2],
    /// Widths of warp and weft, as shares of their pitch.
    pub fill: [f64; 2],
    /// Heights of the sections over their widths.
    pub flatness: f64,
    /// Exponent of the section's outline: 2 an ellipse, more is flatter on top.
    pub section: f64,
    /// Linear colours of warp, weft and what lies behind.
    pub colours: [[f64; 3]; 3],
    /// Part of the reflection that is a highlight.
    pub gloss: f64,
    /// Direction to the light, y up.
    pub to_light: [f64; 3],
    /// Light that comes from everywhere.
    pub ambient: f64,
    /// Counter-clockwise turn of the cloth.
    pub turn_deg: f64,
    /// Relative change of the light from the middle to the edge of the picture, along a direction.
    pub gradient: [f64; 2],
    /// Standard deviation of noise at a value of 1 (it grows as the root of the value).
    pub noise: f64,
    /// Standard deviation of the threads' places and widths, as a share of the pitch, and of their brightness.
    pub uneven: f64,
    /// Strength of the fibres' texture.
    pub fibres: f64,
    /// Standard deviation of the lens blur in pixels.
    pub blur: f64,
    /// Size of the picture.
    pub size: [usize; 2],
    /// Another number, another cloth.
    pub seed: u64,
}

/// A picture: rows from the top.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub rgb: Vec<[f32; 3]>,
}

/// The library's stream of numbers, as cloths need them.
pub struct Random(Stream);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Stream::from_state(seed))
    }
    pub fn next(&mut self) -> u64 {
        self.0.bits()
    }
    pub fn unit(&mut self) -> f64 {
        self.0.unit()
    }
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.unit().max(1e-300).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}

/// A value of -1 to 1 for a place.
fn hash(a: i64, b: i64, seed: u64) -> f64 {
    let mut random = Random::new(seed ^ (a as u64).wrapping_mul(0x9E37_79B1) ^ (b as u64).wrapping_mul(0x85EB_CA77_C2B2_AE63));
    random.next();
    2.0 * random.unit() - 1.0
}

/// One thread's deviations.
#[derive(Clone, Copy)]
struct Thread {
    shift: f64,
    width: f64,
    bright: f64,
}

/// Threads that differ; more repeat them.
const THREADS: i64 = 1024;

/// A cloth with the deviations of its threads drawn.
struct Drawn<'a> {
    cloth: &'a Cloth,
    threads: [Vec<Thread>; 2],
}

impl std::ops::Deref for Drawn<'_> {
    type Target = Cloth;
    fn deref(&self) -> &Cloth {
        self.cloth
    }
}

impl Cloth {
    /// The photograph.
    pub fn draw(&self) -> Picture {
        let threads = [0, 1].map(|d| (0..THREADS).map(|k| self.thread(d, k)).collect());
        Drawn { cloth: self, threads }.draw()
    }

    fn outline(&self, off: f64) -> f64 {
        if self.section == 2.0 {
            (1.0 - off * off).max(0.0).sqrt()
        } else {
            (1.0 - off.abs().powf(self.section)).max(0.0).powf(1.0 / self.section)
        }
    }

    pub fn draft_of(over: usize, under: usize, shift: usize) -> Vec<Vec<bool>> {
        let n = over + under;
        (0..n).map(|j| (0..n).map(|i| (i + (n - shift % n) * j) % n < over).collect()).collect()
    }

    fn over(&self, i: i64, j: i64) -> bool {
        let row = &self.draft[j.rem_euclid(self.draft.len() as i64) as usize];
        row[i.rem_euclid(row.len() as i64) as usize]
    }

    fn thread(&self, direction: i64, k: i64) -> Thread {
        let n = |salt: i64| (hash(k, direction * 16 + salt, self.seed) + hash(k, direction * 16 + salt + 5, self.seed)) * 1.22;
        Thread { shift: self.uneven * n(1), width: 1.0 + self.uneven * n(2), bright: 1.0 + 1.5 * self.uneven * n(3) }
    }
}

impl Drawn<'_> {
    /// Height of the top of a thread's surface over the middle plane, in pixels, or nothing beside the thread.
    /// `across` and `along` are in threads; `direction` 0 is warp.
    fn top(&self, direction: usize, across: f64, along: f64) -> Option<(f64, i64, f64)> {
        let k = across.floor() as i64;
        let thread = self.threads[direction][k.rem_euclid(THREADS) as usize];
        let width = self.fill[direction] * thread.width;
        let off = (across - (k as f64 + 0.5 + thread.shift)) / (0.5 * width);
        if off.abs() >= 1.0 {
            return None;
        }
        let width_px = self.fill[direction] * self.pitch[direction];
        let half = 0.5 * self.flatness * width_px;
        let crimp = 0.55 * self.flatness * (self.fill[0] * self.pitch[0] + self.fill[1] * self.pitch[1]) * 0.5;
        let place = along - 0.5;
        let j = place.floor() as i64;
        let side = |j: i64| {
            let warp_over = if direction == 0 { self.over(k, j) } else { self.over(j, k) };
            if warp_over == (direction == 0) { 1.0 } else { -1.0 }
        };
        // A smoothstep from crossing to crossing.
        let t = place - j as f64;
        let s = t * t * (3.0 - 2.0 * t);
        let centre = crimp * (side(j) * (1.0 - s) + side(j + 1) * s);
        Some((centre + half * self.outline(off), k, off))
    }

    /// Linear colour at a point of the cloth, in threads.
    fn colour(&self, x: f64, y: f64) -> [f64; 3] {
        let height = |x: f64, y: f64| {
            let warp = self.top(0, x, y);
            let weft = self.top(1, y, x);
            match (warp, weft) {
                (Some(a), Some(b)) if a.0 >= b.0 => Some((a, 0)),
                (Some(a), None) => Some((a, 0)),
                (_, Some(b)) => Some((b, 1)),
                (None, None) => None,
            }
        };
        let Some(((z, k, off), direction)) = height(x, y) else {
            return self.colours[2].map(|c| c * 0.5);
        };
        let along = if direction == 0 { y } else { x };
        let top = |x: f64, y: f64| {
            let surface = if direction == 0 { self.top(0, x, y) } else { self.top(1, y, x) };
            surface.filter(|s| s.1 == k).map(|s| s.0)
        };
        let step = 0.02;
        let slope = |a: Option<f64>, b: Option<f64>, pitch: f64| match (a, b) {
            (Some(a), Some(b)) => (b - a) / (2.0 * step * pitch),
            (Some(a), None) => (z - a) / (step * pitch),
            (None, Some(b)) => (b - z) / (step * pitch),
            (None, None) => 0.0,
        };
        let zx = slope(top(x - step, y), top(x + step, y), self.pitch[0]);
        let zy = slope(top(x, y - step), top(x, y + step), self.pitch[1]);
        let unit = |v: [f64; 3]| {
            let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            v.map(|c| c / length)
        };
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let normal = unit([-zx, -zy, 1.0]);
        let light = unit(self.to_light);
        // A soft shadow: how far the cloth rises over the ray to the light within two threads.
        let mut lit = 1.0_f64;
        for n in 1..=6 {
            let distance = 0.16 * f64::from(n) * self.pitch[0].min(self.pitch[1]);
            let (px, py) = (x + distance * light[0] / self.pitch[0], y + distance * light[1] / self.pitch[1]);
            let ray = z + distance * light[2] / (light[0] * light[0] + light[1] * light[1]).sqrt().max(1e-3);
            if let Some(((top, ..), _)) = height(px, py) {
                lit = lit.min(1.0 - ((top - ray) / (0.06 * self.pitch[0])).clamp(0.0, 1.0));
            }
        }
        let cosine = dot(normal, light).max(0.0);
        let half = unit([light[0], light[1], light[2] + 1.0]);
        let highlight = dot(normal, half).max(0.0).powf(30.0) * 3.0;
        // Fibres run along the thread, a little twisted.
        let twist = off * 7.0 + along * 1.3;
        let fibre = hash((twist * 2.0).floor() as i64, (along * 3.0).floor() as i64 + 1000 * k, self.seed ^ direction as u64);
        let thread = self.threads[direction][k.rem_euclid(THREADS) as usize];
        let depth = (0.75 + 0.25 * (z / (0.5 * self.flatness * self.fill[0] * self.pitch[0])).clamp(-1.0, 1.0)).max(0.2);
        let diffuse = (lit * cosine + self.ambient * depth) * thread.bright * (1.0 + self.fibres * fibre);
        self.colours[direction].map(|c| (c * diffuse + self.gloss * lit * highlight * (1.0 + self.fibres * fibre)).max(0.0))
    }

    /// The photograph.
    fn draw(&self) -> Picture {
        let [width, height] = self.size;
        let (sin, cos) = self.turn_deg.to_radians().sin_cos();
        const SAMPLES: usize = 2;
        let mut random = Random::new(self.seed ^ 0xC10_7000);
        let mut linear = vec![[0.0_f64; 3]; width * height];
        let origin = [random.unit() * 20.0, random.unit() * 20.0];
        linear.par_chunks_exact_mut(width).enumerate().for_each(|(row, line)| {
            for column in 0..width {
                let mut sum = [0.0; 3];
                for sample in 0..SAMPLES * SAMPLES {
                    let (sx, sy) = ((sample % SAMPLES) as f64 + 0.5, (sample / SAMPLES) as f64 + 0.5);
                    let x = column as f64 + sx / SAMPLES as f64 - 0.5 * width as f64;
                    let y = 0.5 * height as f64 - (row as f64 + sy / SAMPLES as f64);
                    let (s, t) = ((cos * x + sin * y) / self.pitch[0], (cos * y - sin * x) / self.pitch[1]);
                    let colour = self.colour(s + origin[0] + 400.0, t + origin[1] + 400.0);
                    (0..3).for_each(|c| sum[c] += colour[c]);
                }
                let (x, y) = (2.0 * column as f64 / width as f64 - 1.0, 1.0 - 2.0 * row as f64 / height as f64);
                let light = (1.0 + self.gradient[0] * x + self.gradient[1] * y).max(0.1) * (1.0 - 0.1 * (x * x + y * y));
                line[column] = sum.map(|v| v / (SAMPLES * SAMPLES) as f64 * light);
            }
        });
        blur(&mut linear, width, height, self.blur);
        let rgb =
            linear.iter().map(|p| p.map(|v| (v + self.noise * (v.max(0.0) + 0.01).sqrt() * random.normal()).max(0.0) as f32)).collect();
        Picture { width, height, rgb }
    }
}

/// A Gaussian blur, edges repeated.
fn blur(image: &mut [[f64; 3]], width: usize, height: usize, sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    let radius = (3.0 * sigma).ceil() as i64;
    let kernel: Vec<f64> = (-radius..=radius).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let total: f64 = kernel.iter().sum();
    for axis in 0..2 {
        let old = image.to_vec();
        for y in 0..height as i64 {
            for x in 0..width as i64 {
                let mut sum = [0.0; 3];
                for (k, weight) in kernel.iter().enumerate() {
                    let d = k as i64 - radius;
                    let (px, py) = if axis == 0 { (x + d, y) } else { (x, y + d) };
                    let from = old[(py.clamp(0, height as i64 - 1) * width as i64 + px.clamp(0, width as i64 - 1)) as usize];
                    (0..3).for_each(|c| sum[c] += from[c] * weight / total);
                }
                image[(y * width as i64 + x) as usize] = sum;
            }
        }
    }
}
