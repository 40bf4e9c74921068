//! The part of a photograph that is analysed: cut out, reduced by a whole factor, freed of uneven light.
//!
//! Rows are turned so that row 0 is the lowest: here and in all that follows y points up, as in a material file.

use super::input::RectifiedPhoto;
use rayon::prelude::*;

/// A square-cut piece of a photograph at one scale.
#[derive(Clone, Debug)]
pub(super) struct Field {
    /// Pixels along x.
    pub width: usize,
    /// Pixels along y, row 0 the lowest.
    pub height: usize,
    /// Pixels of the photograph to a pixel here.
    pub factor: usize,
    /// Linear colours over their local mean, 1 where nothing is known: free of uneven light.
    pub ratio: Vec<[f32; 3]>,
    /// Linear colours as they were photographed.
    pub rgb: Vec<[f32; 3]>,
    /// Whether a pixel may be used.
    pub valid: Vec<bool>,
}

/// How uneven light is taken out. Chosen on drawn cloths (see [`super`]).
struct FieldParams {
    /// Half width of the local mean over the cut's shorter side: longer than a repeat, shorter than a light falls off.
    mean_share: f64,
    /// The same in pixels, at least.
    least_radius: usize,
    /// Ratio to the local mean above which a pixel is a highlight or a defect.
    most_ratio: f32,
    /// Local mean of a channel over that of the brightest, at least: a channel that is nearly black everywhere around holds noise.
    least_channel: f32,
}

const PARAMS: FieldParams = FieldParams { mean_share: 0.06, least_radius: 2, most_ratio: 4.0, least_channel: 0.02 };

impl Field {
    /// Cuts at most `side` x `side` reduced pixels out of the middle of what the mask leaves, `factor` x `factor` averaged to one;
    /// nothing if fewer than `least` are left along an axis.
    pub fn cut(photo: &RectifiedPhoto<'_>, factor: usize, side: usize, least: usize) -> Option<Self> {
        let [x0, x1, y0, y1] = used_box(photo);
        let place = |low: usize, high: usize| {
            let size = ((high - low) / factor).min(side);
            (low + (high - low - size * factor) / 2, size)
        };
        let ((left, width), (top, height)) = (place(x0, x1), place(y0, y1));
        if width.min(height) < least {
            return None;
        }
        let share = 1.0 / (factor * factor) as f32;
        let rows: Vec<(Vec<[f32; 3]>, Vec<bool>)> = (0..height)
            .into_par_iter()
            .map(|row| {
                // Row 0 here is the lowest row of the photograph.
                let first = top + (height - 1 - row) * factor;
                let mut colours = vec![[0.0; 3]; width];
                let mut valid = vec![true; width];
                for y in first..first + factor {
                    for (k, (colour, ok)) in colours.iter_mut().zip(&mut valid).enumerate() {
                        let from = y * photo.width + left + k * factor;
                        for pixel in &photo.rgb[from..from + factor] {
                            for c in 0..3 {
                                colour[c] += pixel[c].max(0.0) * share;
                            }
                        }
                        *ok &= photo.mask.is_none_or(|mask| mask[from..from + factor].iter().all(|&m| m));
                    }
                }
                (colours, valid)
            })
            .collect();
        let (rgb, valid): (Vec<Vec<[f32; 3]>>, Vec<Vec<bool>>) = rows.into_iter().unzip();
        let (rgb, valid) = (rgb.concat(), valid.concat());
        let radius = ((width.min(height) as f64 * PARAMS.mean_share) as usize).max(PARAMS.least_radius);
        let ratio = local_ratio(&rgb, &valid, width, height, radius);
        Some(Self { width, height, factor, ratio, rgb, valid })
    }

    /// Position of a pixel from the middle of the cut, in pixels of this scale.
    pub fn position(&self, column: usize, row: usize) -> glam::DVec2 {
        glam::DVec2::new(column as f64 + 0.5 - 0.5 * self.width as f64, row as f64 + 0.5 - 0.5 * self.height as f64)
    }
}

/// First and last + 1 column and row that the mask leaves.
fn used_box(photo: &RectifiedPhoto<'_>) -> [usize; 4] {
    let Some(mask) = photo.mask else { return [0, photo.width, 0, photo.height] };
    let (mut x0, mut x1, mut y0, mut y1) = (photo.width, 0, photo.height, 0);
    for (y, row) in mask.chunks_exact(photo.width).enumerate() {
        if let (Some(first), Some(last)) = (row.iter().position(|&m| m), row.iter().rposition(|&m| m)) {
            (x0, x1, y0, y1) = (x0.min(first), x1.max(last + 1), y0.min(y), y1.max(y + 1));
        }
    }
    if x1 == 0 { [0, 0, 0, 0] } else { [x0, x1, y0, y1] }
}

/// Each channel over its mean in the neighbourhood (three box means, nearly a Gaussian), where pixels are valid.
fn local_ratio(rgb: &[[f32; 3]], valid: &[bool], width: usize, height: usize, radius: usize) -> Vec<[f32; 3]> {
    let weight: Vec<f32> = valid.iter().map(|&v| f32::from(u8::from(v))).collect();
    let smooth_weight = box_mean_thrice(weight.clone(), width, height, radius);
    let means: Vec<Vec<f32>> = (0..3)
        .into_par_iter()
        .map(|c| {
            let values = rgb.iter().zip(&weight).map(|(p, w)| p[c] * w).collect();
            box_mean_thrice(values, width, height, radius)
        })
        .collect();
    (0..rgb.len())
        .map(|k| {
            if !valid[k] || smooth_weight[k] <= 0.0 {
                return [1.0; 3];
            }
            // A channel that is nearly black everywhere around holds noise: it is measured against a share of the brightest.
            let local = [0, 1, 2].map(|c| means[c][k] / smooth_weight[k]);
            let floor = PARAMS.least_channel * local[0].max(local[1]).max(local[2]);
            [0, 1, 2].map(|c| if local[c].max(floor) > 0.0 { (rgb[k][c] / local[c].max(floor)).min(PARAMS.most_ratio) } else { 1.0 })
        })
        .collect()
}

/// Three running means over `2 radius + 1` pixels along both axes, with the edge value repeated outwards.
fn box_mean_thrice(mut values: Vec<f32>, width: usize, height: usize, radius: usize) -> Vec<f32> {
    for _ in 0..3 {
        for row in values.chunks_exact_mut(width) {
            running_mean(row, radius);
        }
        let mut turned = transpose(&values, width, height);
        for column in turned.chunks_exact_mut(height) {
            running_mean(column, radius);
        }
        values = transpose(&turned, height, width);
    }
    values
}

fn running_mean(line: &mut [f32], radius: usize) {
    let n = line.len();
    let old = line.to_vec();
    let at = |k: isize| f64::from(old[k.clamp(0, n as isize - 1) as usize]);
    let r = radius as isize;
    let mut sum: f64 = (-r..=r).map(at).sum();
    let scale = 1.0 / (2 * radius + 1) as f64;
    for (k, value) in line.iter_mut().enumerate() {
        *value = (sum * scale) as f32;
        let k = k as isize;
        sum += at(k + r + 1) - at(k - r);
    }
}

/// Rows to columns.
pub(super) fn transpose<T: Copy + Send + Sync>(values: &[T], width: usize, height: usize) -> Vec<T> {
    const BLOCK: usize = 32;
    let mut out = values.to_vec();
    for y0 in (0..height).step_by(BLOCK) {
        for x0 in (0..width).step_by(BLOCK) {
            for y in y0..(y0 + BLOCK).min(height) {
                for x in x0..(x0 + BLOCK).min(width) {
                    out[x * height + y] = values[y * width + x];
                }
            }
        }
    }
    out
}
