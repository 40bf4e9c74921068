//! Power spectrum of a cut, its peaks, and its autocorrelation.

use super::field::{Field, transpose};
use glam::DVec2;
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{FftDirection, FftPlanner};

/// Power spectrum over all frequencies, wrapped as the transform leaves it.
#[derive(Clone, Debug)]
pub(super) struct Spectrum {
    /// Frequencies along x.
    pub width: usize,
    /// Frequencies along y.
    pub height: usize,
    /// Power, summed over brightness and two colour differences.
    pub power: Vec<f32>,
    /// Power over what its neighbourhood has without its peaks.
    pub contrast: Vec<f32>,
    /// What contrast no noise has.
    threshold: f64,
}

/// One peak in the half plane `x > 0`, or `x = 0` and `y > 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    /// Cycles per pixel.
    pub frequency: DVec2,
    /// Power over its neighbourhood's.
    pub contrast: f64,
    /// Power.
    pub power: f64,
}

/// How peaks are told from noise.
struct SpectrumParams {
    /// Half width, in frequencies, of the neighbourhood that a peak is compared with. Chosen on drawn cloths (see [`super`]): wider than the lobe of a Hann
    /// window (2), narrower than the distance of most peaks.
    neighbourhood: usize,
    /// Distance from 0, in cycles over the window, below which frequencies belong to light and folds. Chosen: the cut's own fall-off of light has one or two.
    least_cycles: f64,
    /// Contrast that no noise has in one window. Noise has exponentially distributed power: of a million values the largest is ln(1e6) = 14 times the mean.
    /// The rest is margin.
    least_contrast: f64,
    /// Exponent by which that falls with the number of independent windows. The extreme of a mean of n exponentially
    /// distributed values falls as 1/n for few and as 1/sqrt(n) for many; chosen between the two.
    windows_exponent: f64,
    /// Least value of the window's own autocorrelation that is divided out: beyond it noise is blown up.
    least_overlap: f64,
    /// Power over the largest that counts as none: what single precision cannot resolve.
    floor: f32,
}

const PARAMS: SpectrumParams =
    SpectrumParams { neighbourhood: 9, least_cycles: 3.0, least_contrast: 25.0, windows_exponent: 0.8, least_overlap: 0.05, floor: 1e-12 };

impl Spectrum {
    /// The mean spectrum of square windows of a cut with at most `side` pixels, half overlapping, each under a Hann window.
    ///
    /// Cloth is never quite straight: in a long window its peaks smear, in a short one they are wide.
    pub fn of(field: &Field, side: usize) -> Self {
        let (width, height) = (field.width.min(side), field.height.min(side));
        let starts = |whole: usize, part: usize| -> Vec<usize> {
            let steps = (2 * (whole - part)).div_ceil(part);
            (0..=steps).map(|k| (whole - part) * k / steps.max(1)).collect()
        };
        let (lefts, lows) = (starts(field.width, width), starts(field.height, height));
        let mut power = vec![0.0_f32; width * height];
        for &low in &lows {
            for &left in &lefts {
                let one = window_power(field, left, low, width, height);
                power.iter_mut().zip(&one).for_each(|(sum, p)| *sum += p);
            }
        }
        // Windows that overlap by half share a part of what they say.
        let windows = ((lefts.len() + 1) * (lows.len() + 1)) as f64 / 4.0;
        let threshold = 1.0 + (PARAMS.least_contrast - 1.0) / windows.powf(PARAMS.windows_exponent);
        let contrast = contrast(&power, width, height);
        Self { width, height, power, contrast, threshold }
    }

    /// Signed frequency of a place, in cycles per pixel.
    fn frequency(&self, x: f64, y: f64) -> DVec2 {
        let signed = |k: f64, n: usize| if k > 0.5 * n as f64 { k - n as f64 } else { k } / n as f64;
        DVec2::new(signed(x, self.width), signed(y, self.height))
    }

    /// Power at the place nearest to a frequency, the largest of its 3 x 3 neighbours.
    pub fn power_near(&self, f: DVec2) -> f64 {
        let place = |f: f64, n: usize| ((f * n as f64).round() as i64).rem_euclid(n as i64) as usize;
        let (x, y) = (place(f.x, self.width), place(f.y, self.height));
        let mut best = 0.0_f32;
        for dy in [self.height - 1, 0, 1] {
            for dx in [self.width - 1, 0, 1] {
                best = best.max(self.power[(y + dy) % self.height * self.width + (x + dx) % self.width]);
            }
        }
        f64::from(best)
    }

    /// One cycle over the cut, in cycles per pixel.
    pub fn bin(&self) -> DVec2 {
        DVec2::new(1.0 / self.width as f64, 1.0 / self.height as f64)
    }

    /// The strongest peaks, at most `most`, strongest first, between the digits of the grid.
    pub fn peaks(&self, most: usize) -> Vec<Peak> {
        let (w, h) = (self.width, self.height);
        let at = |x: usize, y: usize| self.power[y % h * w + x % w];
        let mut peaks: Vec<Peak> = Vec::new();
        for y in 0..h {
            for x in 0..=w / 2 {
                let f = self.frequency(x as f64, y as f64);
                let cycles = f / self.bin();
                if f.x < 0.0 || (f.x == 0.0 && f.y <= 0.0) || cycles.length() < PARAMS.least_cycles {
                    continue;
                }
                let here = at(x, y);
                let value = f64::from(self.contrast[y * w + x]);
                if value < self.threshold {
                    continue;
                }
                let around = (0..5).flat_map(|dy| (0..5).map(move |dx| (dx, dy))).filter(|&d| d != (2, 2));
                let highest = around.map(|(dx, dy)| at(x + w + dx - 2, y + h + dy - 2)).fold(0.0_f32, f32::max);
                if highest > here {
                    continue;
                }
                // A parabola through the logarithms is nearly exact for the lobe of a Hann window.
                let offset = |before: f32, after: f32| {
                    let [a, b, c] = [before, here, after].map(|v| f64::from(v.max(f32::MIN_POSITIVE)).ln());
                    let bend = a - 2.0 * b + c;
                    if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 }
                };
                let dx = offset(at(x + w - 1, y), at(x + 1, y));
                let dy = offset(at(x, y + h - 1), at(x, y + 1));
                let frequency = f + DVec2::new(dx, dy) * self.bin();
                peaks.push(Peak { frequency, contrast: value, power: f64::from(here) });
            }
        }
        peaks.sort_by(|a, b| b.contrast.total_cmp(&a.contrast));
        peaks.truncate(most);
        peaks
    }

    /// Autocorrelation of the windowed cut, 1 at no shift, wrapped; the window's own falling off is divided out.
    pub fn autocorrelation(&self) -> Vec<f32> {
        let data: Vec<Complex<f32>> = self
            .power
            .iter()
            .enumerate()
            .map(|(k, &p)| {
                let f = self.frequency((k % self.width) as f64, (k / self.width) as f64) / self.bin();
                Complex::new(if f.length() < PARAMS.least_cycles { 0.0 } else { p }, 0.0)
            })
            .collect();
        let back = transform(data, self.width, self.height, FftDirection::Inverse);
        // Autocorrelation of a Hann window of length 1 at a shift of t: (1 - t)(2/3 + cos(2 pi t)/3) + sin(2 pi t)/(2 pi).
        let own = |k: usize, n: usize| {
            let t = k.min(n - k) as f64 / n as f64;
            let angle = std::f64::consts::TAU * t;
            (1.0 - t) * (2.0 / 3.0 + angle.cos() / 3.0) + angle.sin() / std::f64::consts::TAU
        };
        let across: Vec<f64> = (0..self.width).map(|k| own(k, self.width)).collect();
        let along: Vec<f64> = (0..self.height).map(|k| own(k, self.height)).collect();
        let none = f64::from(back[0].re).max(f64::MIN_POSITIVE);
        (0..back.len())
            .map(|k| (f64::from(back[k].re) / none / (across[k % self.width] * along[k / self.width]).max(PARAMS.least_overlap)) as f32)
            .collect()
    }
}

/// Power of one window of a cut.
fn window_power(field: &Field, left: usize, low: usize, width: usize, height: usize) -> Vec<f32> {
    let hann = |k: usize, n: usize| (0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / n as f64).cos()) as f32;
    let across: Vec<f32> = (0..width).map(|k| hann(k, width)).collect();
    let along: Vec<f32> = (0..height).map(|k| hann(k, height)).collect();
    let mut first = Vec::with_capacity(width * height);
    let mut second = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let pixel = (low + y) * field.width + left + x;
            let window = if field.valid[pixel] { across[x] * along[y] } else { 0.0 };
            // Bounded and symmetric in the logarithm: highlights and holes weigh alike.
            let t = field.ratio[pixel].map(|r| (r - 1.0) / (r + 1.0));
            let [bright, red, blue] = [(t[0] + t[1] + t[2]) / 3.0, 0.5 * (t[0] - t[1]), 0.5 * (t[2] - 0.5 * (t[0] + t[1]))];
            first.push(Complex::new(bright * window, red * window));
            second.push(Complex::new(blue * window, 0.0));
        }
    }
    let first = transform(first, width, height, FftDirection::Forward);
    let second = transform(second, width, height, FftDirection::Forward);
    (0..width * height)
        .map(|k| {
            // Two real signals in one complex transform: half the power at a frequency and its opposite is the sum of both.
            let opposite = (height - k / width) % height * width + (width - k % width) % width;
            0.5 * (first[k].norm_sqr() + first[opposite].norm_sqr()) + second[k].norm_sqr()
        })
        .collect()
}

/// Power over the geometric mean of its neighbourhood, which single peaks hardly lift; 1 is the mean of noise.
fn contrast(power: &[f32], width: usize, height: usize) -> Vec<f32> {
    let floor = power.iter().fold(0.0_f32, |a, &b| a.max(b)) * PARAMS.floor + f32::MIN_POSITIVE;
    let logs: Vec<f32> = power.iter().map(|&p| (p + floor).ln()).collect();
    let rows = wrapped_means(&logs, width);
    let means = transpose(&wrapped_means(&transpose(&rows, width, height), height), height, width);
    // The mean logarithm of exponentially distributed values lies Euler's constant below the logarithm of their mean.
    const EULER: f32 = 0.577_215_7;
    logs.iter().zip(&means).map(|(&l, &m)| (l - m - EULER).exp()).collect()
}

/// Running means along wrapped rows.
fn wrapped_means(values: &[f32], width: usize) -> Vec<f32> {
    let radius = PARAMS.neighbourhood.min((width - 1) / 2);
    let mut out = values.to_vec();
    out.par_chunks_exact_mut(width).zip(values.par_chunks_exact(width)).for_each(|(to, from)| {
        let mut sum: f64 = (0..=2 * radius).map(|k| f64::from(from[(k + width - radius) % width])).sum();
        for k in 0..width {
            to[k] = (sum / (2 * radius + 1) as f64) as f32;
            sum += f64::from(from[(k + radius + 1) % width]) - f64::from(from[(k + width - radius) % width]);
        }
    });
    out
}

/// Transform along rows and columns, without a factor.
fn transform(mut data: Vec<Complex<f32>>, width: usize, height: usize, direction: FftDirection) -> Vec<Complex<f32>> {
    let mut planner = FftPlanner::new();
    let along_rows = planner.plan_fft(width, direction);
    data.par_chunks_exact_mut(width).for_each(|row| along_rows.process(row));
    let mut turned = transpose(&data, width, height);
    let along_columns = planner.plan_fft(height, direction);
    turned.par_chunks_exact_mut(height).for_each(|column| along_columns.process(column));
    transpose(&turned, height, width)
}
