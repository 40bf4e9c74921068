//! Whether a picture was enlarged: then it has more pixels than it shows, and threads of two pixels look like threads of six.
//!
//! Interpolated pixels lie on lines or smooth curves between the old ones, so that the size of the second difference along a row, averaged over all rows, is periodic
//! with the enlargement (Gallagher, "Detection of linear and cubic interpolation in JPEG compressed images", CRV 2005). A cloth is periodic, too; an enlargement is so
//! in both directions alike, and leaves hardly anything in the picture itself that is finer than the old pixels.

use super::input::RectifiedPhoto;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// How an enlargement is told. Chosen on drawn cloths, enlarged and not.
struct EnlargedParams {
    /// Longest side of the piece that is looked at, px.
    side: usize,
    /// Least frequency at which periods are sought, cycles per pixel: longer ones are of light.
    least: f64,
    /// Frequencies of enlargements: from 2.2 to 6.6 times. Twice cannot be told: the new pixels lie a quarter to both sides of the old ones, all alike.
    range: [f64; 2],
    /// Height of a peak over the median.
    peak: f64,
    /// Height over the highest peak from which on a lower multiple is the period.
    multiple: f64,
    /// Relative difference of both directions.
    alike: f64,
    /// Frequency over that of the old pixels from which on details are finer than those, and the share of the variation that may be.
    finer: f64,
    most_finer: f64,
}

const PARAMS: EnlargedParams =
    EnlargedParams { side: 1024, least: 0.02, range: [0.15, 0.46], peak: 8.0, multiple: 0.6, alike: 0.03, finer: 0.6, most_finer: 0.25 };

/// How many times a picture was enlarged, 2.2 to 6.6; `None` if it was not, or by another factor.
pub(super) fn factor(photo: &RectifiedPhoto<'_>) -> Option<f64> {
    // Even sides have a frequency of one half.
    let side = |n: usize| n.min(PARAMS.side) & !1;
    let (w, h) = (side(photo.width), side(photo.height));
    let (left, top) = ((photo.width - w) / 2, (photo.height - h) / 2);
    let at = |x: usize, y: usize| f64::from(photo.rgb[(top + y) * photo.width + left + x].iter().sum::<f32>());
    let along = |n: usize, lines: usize, value: &dyn Fn(usize, usize) -> f64| {
        let frequency = period(n, lines, value)?;
        (finer_share(n, lines, value, frequency) < PARAMS.most_finer).then_some(frequency)
    };
    let x = along(w, h, &at)?;
    let y = along(h, w, &|k, line| at(line, k))?;
    ((x / y - 1.0).abs() < PARAMS.alike).then(|| 2.0 / (x + y))
}

/// Magnitudes at the frequencies `0, 1/n ... 1/2` of values under a Hann window.
fn magnitudes(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let window = |i: usize| 0.5 - 0.5 * (std::f64::consts::TAU * (i as f64 + 0.5) / n as f64).cos();
    let mut data: Vec<Complex<f64>> = values.iter().enumerate().map(|(i, v)| Complex::new((v - mean) * window(i), 0.0)).collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut data);
    data[..=n / 2].iter().map(|c| c.norm()).collect()
}

/// The frequency of the second difference along `lines` lines of `n` pixels, if it is one of an enlargement.
fn period(n: usize, lines: usize, value: &dyn Fn(usize, usize) -> f64) -> Option<f64> {
    let second = |k: usize| (0..lines).map(|l| (2.0 * value(k, l) - value(k - 1, l) - value(k + 1, l)).abs()).sum::<f64>() / lines as f64;
    // The two ends have none: an even number is left.
    let heights = magnitudes(&(1..n - 1).map(second).collect::<Vec<f64>>());
    let bins = (n - 2) as f64;
    let first = (PARAMS.least * bins).ceil() as usize;
    let best = (first..heights.len()).max_by(|&a, &b| heights[a].total_cmp(&heights[b]))?;
    let mut sorted = heights[first..].to_vec();
    let median = biscale::numerics::statistics::upper_median(&mut sorted)?;
    if !(heights[best] > PARAMS.peak * median) {
        return None;
    }
    // Of lines between the old pixels all multiples are as high: the lowest is the period.
    let lowest = (1..=3).rev().map(|m| (m, best as f64 / f64::from(m))).find(|(m, place)| {
        let near = (place.round() as usize).saturating_sub(1)..=(place.round() as usize + 1).min(heights.len() - 1);
        *m == 1 || near.clone().map(|k| heights[k]).fold(0.0, f64::max) > PARAMS.multiple * heights[best] && *place / bins > PARAMS.range[0]
    });
    let (m, _) = lowest?;
    // Between bins: the middle of the peak.
    let around = best.saturating_sub(1)..=(best + 1).min(heights.len() - 1);
    let (sum, weight) = around.fold((0.0, 0.0), |(s, w), k| (s + k as f64 * heights[k], w + heights[k]));
    let middle = if best + 1 >= heights.len() { best as f64 } else { sum / weight };
    let frequency = middle / f64::from(m) / bins;
    (PARAMS.range[0]..=PARAMS.range[1]).contains(&frequency).then_some(frequency)
}

/// Share of the variation along lines that is finer than pixels of the frequency `old`.
fn finer_share(n: usize, lines: usize, value: &dyn Fn(usize, usize) -> f64, old: f64) -> f64 {
    let (mut finer, mut all) = (0.0, 0.0);
    for line in (0..lines).step_by((lines / 64).max(1)) {
        for (k, m) in magnitudes(&(0..n).map(|i| value(i, line)).collect::<Vec<f64>>()).iter().enumerate() {
            let frequency = k as f64 / n as f64;
            if frequency >= PARAMS.least {
                all += m * m;
                finer += if frequency > PARAMS.finer * old { m * m } else { 0.0 };
            }
        }
    }
    finer / f64::max(all, f64::MIN_POSITIVE)
}

/// A picture with the pixels that it had before.
pub(super) struct Reduced {
    width: usize,
    height: usize,
    rgb: Vec<[f32; 3]>,
    mask: Option<Vec<bool>>,
    mm_per_pixel: f64,
}

impl Reduced {
    /// Means over `factor` x `factor` pixels. Without a size of the pixels lengths stay in pixels of the enlarged picture.
    pub fn of(photo: &RectifiedPhoto<'_>, factor: f64) -> Self {
        let (width, height) = ((photo.width as f64 / factor) as usize, (photo.height as f64 / factor) as usize);
        let span = |k: usize, n: usize| {
            let from = ((k as f64 * factor).round() as usize).min(n - 1);
            from..(((k + 1) as f64 * factor).round() as usize).clamp(from + 1, n)
        };
        let (mut rgb, mut mask) = (Vec::with_capacity(width * height), photo.mask.map(|_| Vec::with_capacity(width * height)));
        for j in 0..height {
            for i in 0..width {
                let (mut sum, mut count, mut good) = ([0.0_f32; 3], 0.0_f32, true);
                for y in span(j, photo.height) {
                    for x in span(i, photo.width) {
                        let place = y * photo.width + x;
                        (0..3).for_each(|c| sum[c] += photo.rgb[place][c]);
                        count += 1.0;
                        good &= photo.mask.is_none_or(|m| m[place]);
                    }
                }
                rgb.push(sum.map(|s| s / count));
                mask.iter_mut().for_each(|m| m.push(good));
            }
        }
        Self { width, height, rgb, mask, mm_per_pixel: photo.mm_per_pixel.unwrap_or(1.0) * factor }
    }

    /// As a photograph.
    pub fn photo(&self) -> RectifiedPhoto<'_> {
        RectifiedPhoto {
            width: self.width,
            height: self.height,
            rgb: &self.rgb,
            mask: self.mask.as_deref(),
            mm_per_pixel: Some(self.mm_per_pixel),
        }
    }
}
