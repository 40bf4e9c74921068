//! An environment map seen through lobes of any sharpness: the maps that a real-time picture looks up (Green et al. 2006).
//!
//! ```text
//! P(w, l) = ∫ L(v) exp(l (v·w - 1)) dv / ∫ exp(l (v·w - 1)) dv
//! ```
//!
//! is the mean radiance under a spherical Gaussian about `w`. It is tabulated at the sharpnesses `l = 2^k - 1`, from the mean of the whole sphere to the
//! map's own resolution, each level on an octahedral square whose texels are [`TEXEL`] standard deviations wide, and looked up
//! linearly between texels and, in `log2(1 + l)`, between levels. Each level is summed directly over the map, reduced to texels that are narrow beside the
//! lobe, with their exact solid angles; sums of a texel have a fixed order, so that any number of threads gives the same bits.
//!
//! A small bright source keeps its energy at each level. Between levels, and between texels, a lobe is the mean of others: what that costs for
//! a single bright pixel, the worst case, is stated by the test `a_sun_is_a_lobe_at_every_level`.

use super::super::environment::Environment;
use super::octahedron::{sphere_direction, sphere_place};
use crate::error::Result;
use crate::filter::{Control, exp};
use crate::numerics::cast::{narrow, truncate_usize};
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Width of a level's texel in standard deviations of its lobe.
const TEXEL: f64 = 0.36;
/// Width of a source texel, in the same unit, at most.
const SOURCE_TEXEL: f64 = 0.35;
/// `l (1 - cos)` beyond which a lobe is cut: it holds 6e-6 of the peak there.
const CUT: f64 = 12.0;
/// Fewest texels along a side of a level.
const LEAST_SIDE: f64 = 33.0;

/// The maps of an environment.
#[derive(Clone, Debug)]
pub struct PrefilteredMaps {
    /// Level `k` has the sharpness `2^k - 1`.
    levels: Vec<Level>,
}

/// One map, on an octahedral square with a border of one texel.
#[derive(Clone, Debug)]
struct Level {
    /// Texels along a side, without the border.
    side: usize,
    texels: Vec<Vec4>,
}

impl PrefilteredMaps {
    /// Filters a map.
    ///
    /// # Errors
    /// `Interrupted`.
    pub fn new(environment: &Environment, control: &Control<'_>) -> Result<Self> {
        let mut sources = vec![Source::of(environment)];
        while sources[sources.len() - 1].height % 2 == 0 && sources[sources.len() - 1].width % 2 == 0 {
            let next = sources[sources.len() - 1].halved();
            sources.push(next);
        }
        // The lobe whose standard deviation is a pixel of the map is the sharpest.
        let finest = (1.0 + sources[0].texel().powi(-2)).log2().ceil();
        let levels = (0..=truncate_usize(finest)).map(|k| {
            control.check()?;
            let sharpness = (k as f64).exp2() - 1.0;
            let width = SOURCE_TEXEL / sharpness.max(1.0).sqrt();
            let source = sources.iter().rev().find(|s| s.texel() <= width).unwrap_or(&sources[0]);
            Ok(Level::new(source, sharpness))
        });
        Ok(Self { levels: levels.collect::<Result<_>>()? })
    }

    /// Mean radiance about the unit direction `w` under a lobe of the sharpness `l`, in `0..`; sharper than the map it is the map's own. The fourth
    /// component is 1.
    #[inline]
    pub fn look_up(&self, w: Vec3, sharpness: f32) -> Vec4 {
        let place = sphere_place(w);
        let last = self.levels.len() - 1;
        let level = (1.0 + sharpness).log2().clamp(0.0, last as f32);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 0, and a floor is meant")]
        let below = (level as usize).min(last - usize::from(last > 0));
        let share = level - below as f32;
        let blunt = self.levels[below].at(place);
        if last == 0 { blunt } else { blunt + share * (self.levels[below + 1].at(place) - blunt) }
    }

    /// Bytes of all maps.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| size_of_val(l.texels.as_slice())).sum()
    }
}

impl Level {
    fn new(source: &Source, sharpness: f64) -> Self {
        // An odd number puts the folds of the upper and the lower half, where the map has kinks, on the middles of texels.
        let side = 2.0 * (0.5 * (4.0 * PI * (1.0 + sharpness)).sqrt() / TEXEL).ceil() + 1.0;
        let side = side.max(LEAST_SIDE);
        let stride = truncate_usize(side) + 2;
        let texel = |index: usize| {
            let place = DVec2::new((index % stride) as f64, (index / stride) as f64);
            source.mean(sphere_direction((2.0 * place - 1.0) / side - 1.0), sharpness)
        };
        Self { side: stride - 2, texels: (0..stride * stride).into_par_iter().map(texel).collect() }
    }

    /// The value at a place of the square, linear between texels.
    #[inline]
    fn at(&self, place: glam::Vec2) -> Vec4 {
        let at = (place + 1.0) * (0.5 * self.side as f32) + 0.5;
        let corner = at.floor().clamp(glam::Vec2::ZERO, glam::Vec2::splat(self.side as f32));
        let share = at - corner;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers from 0 to the side")]
        let first = corner.y as usize * (self.side + 2) + corner.x as usize;
        let row = |at: usize| self.texels[at] + share.x * (self.texels[at + 1] - self.texels[at]);
        let (upper, lower) = (row(first), row(first + self.side + 2));
        upper + share.y * (lower - upper)
    }
}

/// A map of equal angles, in the world's directions and radiances.
struct Source {
    width: usize,
    height: usize,
    rotation: f64,
    /// For each row the mean z of its directions, their distance from the z axis, and a pixel's solid angle.
    rows: Vec<[f32; 3]>,
    /// Sines and cosines of the azimuths of the columns, from y towards x.
    sin: Vec<f32>,
    cos: Vec<f32>,
    channels: [Vec<f32>; 3],
}

impl Source {
    fn of(environment: &Environment) -> Self {
        let [width, height] = environment.size();
        let pixels = || (0..width * height).map(|at| environment.pixel(at % width, at / width));
        Self::new([width, height], environment.rotation(), std::array::from_fn(|c| pixels().map(|p| narrow(p[c])).collect()))
    }

    fn new([width, height]: [usize; 2], rotation: f64, channels: [Vec<f32>; 3]) -> Self {
        let edge = |row: usize| (PI * row as f64 / height as f64).cos();
        let row = |row: usize| {
            let z = 0.5 * (edge(row) + edge(row + 1));
            [z, (1.0 - z * z).max(0.0).sqrt(), TAU / width as f64 * (edge(row) - edge(row + 1))].map(narrow)
        };
        let azimuth = |column: usize| TAU * ((column as f64 + 0.5) / width as f64 - 0.5) - rotation;
        let [sin, cos] = [f64::sin, f64::cos].map(|f| (0..width).map(|c| narrow(f(azimuth(c)))).collect());
        Self { width, height, rotation, rows: (0..height).map(row).collect(), sin, cos, channels }
    }

    /// Width of its widest pixel, radians.
    fn texel(&self) -> f64 {
        (TAU / self.width as f64).max(PI / self.height as f64)
    }

    /// Half as many pixels each way: means by solid angle.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let mean = |channel: &Vec<f32>, at: usize| {
            let (row, column) = (2 * (at / width), 2 * (at % width));
            let pair = |row: usize| 0.5 * (channel[row * self.width + column] + channel[row * self.width + column + 1]);
            let [upper, lower] = [self.rows[row][2], self.rows[row + 1][2]];
            (upper * pair(row) + lower * pair(row + 1)) / (upper + lower)
        };
        let channels = self.channels.each_ref().map(|channel| (0..width * height).map(|at| mean(channel, at)).collect());
        Self::new([width, height], self.rotation, channels)
    }

    /// The mean under a lobe about the unit direction `w`.
    fn mean(&self, w: DVec3, sharpness: f64) -> Vec4 {
        let radius = if sharpness > 0.5 * CUT { (1.0 - CUT / sharpness).acos() } else { PI };
        // A lobe that is narrower than a pixel takes at least those around it.
        let radius = radius.max(1.5 * self.texel());
        let polar = w.z.clamp(-1.0, 1.0).acos();
        let row = |angle: f64| angle / PI * self.height as f64;
        let first = truncate_usize(row(polar - radius).max(0.0));
        let last = truncate_usize(row(polar + radius)).min(self.height - 1);
        let azimuth = w.x.atan2(w.y) + self.rotation;
        let middle = (azimuth / TAU + 0.5).rem_euclid(1.0) * self.width as f64;
        let mut sums = [[0.0; LANES]; 4];
        for row in first..=last {
            let [z, across, _] = self.rows[row].map(f64::from);
            let cosine = (radius.min(PI).cos() - z * w.z) / (across * w.truncate().length()).max(1e-9);
            let reach = if cosine <= -1.0 { PI } else { cosine.min(1.0).acos() };
            // Up to a whole turn, and at least the column in which the direction lies.
            let half = reach / TAU * self.width as f64;
            let start = truncate_usize((middle - half + self.width as f64).max(0.0));
            let count = (truncate_usize(2.0 * half) + 2).min(self.width);
            let begin = start % self.width;
            let end = (begin + count).min(self.width);
            for columns in [begin..end, 0..(begin + count) - end] {
                simd::run(Taps { source: self, row, columns, w: w.as_vec3(), sharpness: narrow(sharpness), sums: &mut sums });
            }
        }
        let [r, g, b, weight] = sums.map(|lanes| lanes.iter().sum::<f32>());
        (Vec4::new(r, g, b, weight)) / weight
    }
}

/// Adds the pixels of some columns of a row, weighted by lobe and solid angle, to sums of red, green, blue and weights.
struct Taps<'a> {
    source: &'a Source,
    row: usize,
    columns: std::ops::Range<usize>,
    w: Vec3,
    sharpness: f32,
    sums: &'a mut [Lanes; 4],
}

impl Kernel for Taps<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { source, row, columns, w, sharpness, sums } = self;
        let [z, across, solid_angle] = source.rows[row];
        let offset = row * source.width;
        let (sin, cos) = (&source.sin[columns.clone()], &source.cos[columns.clone()]);
        let pixels = offset + columns.start..offset + columns.end;
        let [r, g, b] = source.channels.each_ref().map(|c| &c[pixels.clone()]);
        let down = (z - w.z) * (z - w.z);
        let weight = |sin: f32, cos: f32| {
            let (x, y) = (across * sin - w.x, across * cos - w.y);
            // exp(l (v·w - 1)) by the squared distance, which does not cancel.
            solid_angle * exp(-0.5 * sharpness * (x * x + y * y + down))
        };
        let whole = sin.len() / LANES * LANES;
        for at in (0..whole).step_by(LANES) {
            for l in 0..LANES {
                let k = at + l;
                let weight = weight(sin[k], cos[k]);
                sums[0][l] += weight * r[k];
                sums[1][l] += weight * g[k];
                sums[2][l] += weight * b[k];
                sums[3][l] += weight;
            }
        }
        for k in whole..sin.len() {
            let weight = weight(sin[k], cos[k]);
            sums[0][k - whole] += weight * r[k];
            sums[1][k - whole] += weight * g[k];
            sums[2][k - whole] += weight * b[k];
            sums[3][k - whole] += weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sg::Lobe;

    /// A map of 128 x 64 pixels.
    fn maps(value: impl Fn(DVec3) -> [f32; 3]) -> PrefilteredMaps {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("map.exr");
        let mut picture = crate::render::Picture::new(128, 64);
        for (at, pixel) in picture.rgb.iter_mut().enumerate() {
            let azimuth = TAU * ((at % 128) as f64 + 0.5) / 128.0 - PI;
            let z = (PI * ((at / 128) as f64 + 0.5) / 64.0).cos();
            let across = (1.0 - z * z).sqrt();
            *pixel = value(DVec3::new(across * azimuth.sin(), across * azimuth.cos(), z));
        }
        let out = std::fs::File::create(&file).unwrap();
        picture.write_exr(out, false, "a test").unwrap();
        PrefilteredMaps::new(&Environment::load(&file, 0.0, 1.0).unwrap(), &Control::quiet()).unwrap()
    }

    fn spread() -> impl Iterator<Item = DVec3> {
        (0..500).map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 500.0;
            let (sin, cos) = (2.399_963 * f64::from(k)).sin_cos();
            DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
        })
    }

    #[test]
    fn a_constant_stays_one_under_any_lobe() {
        let maps = maps(|_| [0.25, 1.0, 4.0]);
        for w in spread() {
            for sharpness in [0.0, 0.5, 7.0, 100.0, 1e5] {
                let mean = maps.look_up(w.as_vec3(), sharpness);
                assert!((mean - Vec4::new(0.25, 1.0, 4.0, 1.0)).abs().max_element() < 1e-4, "{mean} at {w} for {sharpness}");
            }
        }
    }

    #[test]
    fn a_linear_function_keeps_its_direction_and_shrinks_as_the_mean_cosine_does() {
        // The mean of v·a under a lobe about w is (coth l - 1/l) w·a.
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        let maps = maps(|v| [narrow(2.0 + v.dot(axis)), 0.0, 1.0]);
        for w in spread() {
            for sharpness in [1.0_f64, 3.0, 20.0, 127.0] {
                let expected = 2.0 + (sharpness.tanh().recip() - sharpness.recip()) * w.dot(axis);
                let mean = f64::from(maps.look_up(w.as_vec3(), narrow(sharpness)).x);
                // The folds of the octahedron's equator run across texels.
                assert!((mean - expected).abs() < 0.02, "{mean} for {expected} at {w}, sharpness {sharpness}");
            }
        }
    }

    #[test]
    fn a_sun_is_a_lobe_at_every_level() {
        // One bright pixel: the map of it is the density of the lobe about it, in the pixel's energy. Between levels, and between texels, it is a mean of neighbours: the largest
        // difference, in the peak.
        let sun = DVec3::new(0.4, 0.7, 0.45).normalize();
        let maps = maps(|v| if v.dot(sun) > 0.9995 { [1000.0, 0.0, 0.0] } else { [0.0; 3] });
        let source = f64::from(maps.look_up(sun.as_vec3(), 0.0).x) * 2.0 * TAU;
        let mut report = Vec::new();
        for (sharpness, allowed) in [(0.5_f32, 0.12), (3.0, 0.05), (10.0, 0.06), (31.0, 0.06), (90.0, 0.08)] {
            let peak = f64::from(Lobe::density(Vec3::Z, sharpness).amplitude) * source;
            let off = |w: DVec3| {
                let expected = f64::from(Lobe::density(sun.as_vec3(), sharpness).eval(w.as_vec3())) * source;
                (f64::from(maps.look_up(w.as_vec3(), sharpness).x) - expected).abs() / peak
            };
            let around = (0..64).map(|k| (sun + 0.3 * f64::from(k) / 64.0 * sun.any_orthonormal_vector()).normalize());
            let worst = spread().chain(around).map(off).fold(0.0, f64::max);
            report.push((sharpness, worst, worst < allowed));
        }
        assert!(report.iter().all(|r| r.2), "sharpness, largest error in the peak, whether it was expected: {report:?}");
        // Its energy is the same at each level.
        for sharpness in [1.0, 7.0, 63.0] {
            let points = 40_000;
            let sum: f64 = (0..points)
                .map(|k| {
                    let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(points);
                    let (sin, cos) = (2.399_963_229_7 * f64::from(k)).sin_cos();
                    let w = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                    f64::from(maps.look_up(w.as_vec3(), sharpness).x)
                })
                .sum();
            let energy = sum / f64::from(points) * 2.0 * TAU;
            assert!((energy / source - 1.0).abs() < 0.01, "sharpness {sharpness}: {energy} for {source}");
        }
    }
}
