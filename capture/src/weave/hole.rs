//! Widths of threads by the shape of a hole that is small, or not dark: a model of the mean crossing around it.
//!
//! Beside the hole lie strips that only warps or only wefts cross, and the rest, where both do. So brightness is a sum of products of a function of x and one of
//! y, each either the hole's box or zero in the box and smooth beside it, all blurred alike:
//!
//! ```text
//! I(x, y) = sum_ab c_ab X_a(x) Y_b(y),      X = { hole, t, t e, t e², t sqrt(1 - e²) },   t = 1 - hole,   e = -1 .. 1 across the thread
//! ```
//!
//! The coefficients follow by linear least squares (with a weak pull to an even thread and a dark hole); place, widths and blur by a search. What shading and shadows
//! do far from the hole counts little: the fit has a window. A hole of another colour is fitted without the pull to the dark where that explains clearly more.

use super::fold::Fold;
use super::simplex::simplex;
use biscale::numerics::cast::truncate_usize;
use biscale::numerics::linear_algebra::Cholesky;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// A hole between the threads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hole {
    /// Widths of warp and weft as shares of their pitch.
    pub fill: [f64; 2],
}

/// Bins of a fold along each axis.
pub(super) const BINS: usize = 32;
/// Samples of a bin in which profiles are drawn before they are blurred: a side is placed to a part of 1/256 of the pitch, smoothly between.
const FINE: usize = 8;
const SAMPLES: usize = BINS * FINE;
/// Functions of one coordinate, and of both.
const TERMS: usize = 5;
const ALL: usize = TERMS * TERMS;

/// How a hole is modelled and sought. Chosen on drawn cloths of seeds 7 and 8 (`docs/weave-analysis.md`) where nothing else is said; lengths are in threads.
struct HoleParams {
    /// Weight of the pull to an even thread, of the mean square of a coefficient's function.
    even_pull: f64,
    /// Weight of the pull to a dark hole.
    dark_pull: f64,
    /// The same for a hole of any colour: only so that the equations can be solved.
    any_pull: f64,
    /// Brightness of a dark hole over the mean.
    darkness: f64,
    /// Standard deviation of the window around the hole.
    window: f64,
    /// Blur that is likely, in pixels: lens, pixel, and threads that do not lie evenly.
    blur: f64,
    /// Spread of the blur's logarithm.
    blur_spread: f64,
    /// What one spread of blur adds to the logarithm of the residual.
    blur_pull: f64,
    /// Largest change of the blur's logarithm from 0, so that the search stays finite: 0.22 to 4.5 pixels.
    blur_bound: f64,
    /// Widest hole.
    widest: f64,
    /// Narrowest hole, which keeps the search from zero.
    narrowest: f64,
    /// What a hole outside of these bounds adds to the logarithm of the residual, a thread.
    outside: f64,
    /// Share of the variation below which a residual says no more: noise.
    least_residual: f64,
    /// Difference of the residuals' logarithms by which a hole of any colour must do better than a dark one, ...
    clearer: f64,
    /// ... and its sides, in pixels, at least.
    coloured_pixels: f64,
    /// Difference between the hole and what is beside it on all sides, over the brighter of both, at least.
    contrast: f64,
    /// How far beside its sides that is looked at.
    beside: f64,
    /// Sides of a hole in pixels, at least: of one that is smaller only the area is seen.
    fewest_pixels: f64,
    /// How far inside of the edge of a round thread, which is dark there, the step lies that fits best, in standard deviations of the blur. From drawn cloths
    /// of seeds 7 and 8 (sections from elliptic to flat), where hardly any of it depends on pitch or light.
    inside: f64,
    /// Range of a width.
    fill: [f64; 2],
    /// Middles along a pitch from which the search may begin.
    places: usize,
    /// Sides from which it may begin.
    widths: [f64; 3],
    /// Starts that are followed, ...
    followed: usize,
    /// ... if their middles differ by more than this, ...
    middles_apart: f64,
    /// ... or their sides, together, by more than this.
    sides_apart: f64,
    /// First simplex: steps of middles, sides and the logarithm of the blur.
    steps: HoleShape,
    /// Shapes that one simplex looks at, about.
    evaluations: usize,
}

const PARAMS: HoleParams = HoleParams {
    even_pull: 1e-4,
    dark_pull: 1e-3,
    any_pull: 1e-6,
    darkness: 0.06,
    window: 0.2,
    blur: 0.85,
    blur_spread: 0.35,
    blur_pull: 0.3,
    blur_bound: 1.5,
    widest: 0.5,
    narrowest: 0.002,
    outside: 10.0,
    least_residual: 1e-5,
    clearer: 0.2,
    coloured_pixels: 1.5,
    contrast: 0.3,
    beside: 0.1,
    fewest_pixels: 1.0,
    inside: 0.24,
    fill: [0.3, 1.0],
    places: 16,
    widths: [0.05, 0.2, 0.35],
    followed: 3,
    middles_apart: 0.13,
    sides_apart: 0.2,
    steps: [0.03, 0.03, 0.04, 0.04, 0.25],
    evaluations: 150,
};

/// Place of the hole's middle (threads from the fold's middle), its sides (threads), and the logarithm of the blur in pixels.
type HoleShape = [f64; 5];

/// The hole that all crossings have in the mean, whatever its colour; nothing if none is clearly seen. `pitch` in pixels.
pub(super) fn find(fold: &Fold, pitch: [f64; 2]) -> Option<Hole> {
    let model = HoleModel::new(fold.mean_cell(), pitch);
    let sides = |p: &HoleShape| [0, 1].map(|k| p[2 + k].clamp(PARAMS.narrowest, PARAMS.widest));
    let narrowest = |p: &HoleShape| sides(p).iter().zip(pitch).map(|(g, pitch)| g * pitch).fold(f64::INFINITY, f64::min);
    let (dark, any) = (model.search(PARAMS.dark_pull), model.search(PARAMS.any_pull));
    let coloured = any.1 < dark.1 - PARAMS.clearer && narrowest(&any.0) > PARAMS.coloured_pixels;
    let (place, pull) = if coloured { (any.0, PARAMS.any_pull) } else { (dark.0, PARAMS.dark_pull) };
    if narrowest(&place) <= PARAMS.fewest_pixels || model.contrast(&place, pull) <= PARAMS.contrast {
        return None;
    }
    let sigma = place[4].exp();
    let gaps = sides(&place);
    Some(Hole { fill: [0, 1].map(|k| (1.0 - gaps[k] + 2.0 * PARAMS.inside * sigma / pitch[k]).clamp(PARAMS.fill[0], PARAMS.fill[1])) })
}

/// The mean crossing, and what is needed to compare a hole with it.
struct HoleModel {
    cell: Vec<[f64; 3]>,
    mean: [f64; 3],
    variance: f64,
    pitch: [f64; 2],
    forward: Arc<dyn Fft<f64>>,
    backward: Arc<dyn Fft<f64>>,
}

/// Functions of one coordinate, in bins.
type Profiles = [[f64; BINS]; TERMS];

impl HoleModel {
    fn new(cell: Vec<[f64; 3]>, pitch: [f64; 2]) -> Self {
        let n = cell.len() as f64;
        let mean = [0, 1, 2].map(|c| cell.iter().map(|v| v[c]).sum::<f64>() / n);
        let variance = (0..3).map(|c| cell.iter().map(|v| (v[c] - mean[c]).powi(2)).sum::<f64>() / n).sum::<f64>().max(1e-12);
        let mut planner = FftPlanner::new();
        Self { cell, mean, variance, pitch, forward: planner.plan_fft_forward(SAMPLES), backward: planner.plan_fft_inverse(SAMPLES) }
    }

    /// The functions of one coordinate for a hole at `middle` of width `gap`, blurred by `sigma` (threads).
    fn profiles(&self, middle: f64, gap: f64, sigma: f64) -> Profiles {
        let mut drawn = [[0.0; SAMPLES]; TERMS];
        for k in 0..SAMPLES {
            let d = wrapped((k as f64 + 0.5) / SAMPLES as f64 - 0.5 - middle);
            let hole = ((0.5 * gap - d.abs()) * SAMPLES as f64 + 0.5).clamp(0.0, 1.0);
            let thread = 1.0 - hole;
            let off = ((d - 0.5_f64.copysign(d)) / (0.5 * (1.0 - gap))).clamp(-1.0, 1.0);
            let values = [hole, thread, thread * off, thread * off * off, thread * (1.0 - off * off).sqrt()];
            (0..TERMS).for_each(|t| drawn[t][k] = values[t]);
        }
        // The blur is even, so two real functions are blurred as one complex one.
        let mut out = [[0.0; BINS]; TERMS];
        for pair in 0..TERMS.div_ceil(2) {
            let (a, b) = (2 * pair, (2 * pair + 1).min(TERMS - 1));
            let mut both: Vec<Complex<f64>> = (0..SAMPLES).map(|k| Complex::new(drawn[a][k], drawn[b][k])).collect();
            self.forward.process(&mut both);
            for (k, value) in both.iter_mut().enumerate() {
                let cycles = std::f64::consts::PI * k.min(SAMPLES - k) as f64 * sigma;
                *value *= (-2.0 * cycles * cycles).exp() / (SAMPLES * FINE) as f64;
            }
            self.backward.process(&mut both);
            for (k, value) in both.iter().enumerate() {
                out[a][k / FINE] += value.re;
                if b != a {
                    out[b][k / FINE] += value.im;
                }
            }
        }
        out
    }

    fn both_profiles(&self, place: &HoleShape) -> [Profiles; 2] {
        let sigma = place[4].clamp(-PARAMS.blur_bound, PARAMS.blur_bound).exp();
        [0, 1].map(|k| self.profiles(place[k], place[2 + k].clamp(PARAMS.narrowest, PARAMS.widest), sigma / self.pitch[k]))
    }

    /// Weights around a middle, 1 in the mean; even without a window.
    fn window(middle: Option<f64>) -> [f64; BINS] {
        let Some(middle) = middle else { return [1.0; BINS] };
        let at = |k: usize| (-0.5 * (wrapped(centre(k) - middle) / PARAMS.window).powi(2)).exp();
        let sum: f64 = (0..BINS).map(at).sum();
        std::array::from_fn(|k| at(k) * BINS as f64 / sum)
    }

    /// Logarithm of the share of the cell's variation that a hole leaves unexplained, and what makes its shape unlikely.
    fn rate(&self, place: &HoleShape, pull: f64, window: [f64; 2]) -> f64 {
        let weights = window.map(|w| Self::window(Some(w)));
        let (left, _) = self.fit(&self.both_profiles(place), &weights, pull);
        let outside: f64 =
            place[2..4].iter().map(|g| PARAMS.outside * ((PARAMS.narrowest - g).max(0.0) + (g - PARAMS.widest).max(0.0))).sum();
        let blur = (place[4] - PARAMS.blur.ln()) / PARAMS.blur_spread;
        (left / self.variance + PARAMS.least_residual).ln() + outside + PARAMS.blur_pull * blur * blur
    }

    /// What the best coefficients leave of the cell, and the colour of the hole.
    fn fit(&self, [x, y]: &[Profiles; 2], [wx, wy]: &[[f64; BINS]; 2], pull: f64) -> (f64, [f64; 3]) {
        let gram = [gram(x, wx), gram(y, wy)];
        let prepared = Equations::new(&gram, pull);
        let rows = self.rows(x, wx);
        self.solve(&prepared, &rows, y, wy, self.squares(wx, wy))
    }

    /// The cell's rows projected on the functions of x.
    fn rows(&self, x: &Profiles, wx: &[f64; BINS]) -> Vec<[[f64; TERMS]; 3]> {
        let project =
            |row: usize, c: usize, t: usize| (0..BINS).map(|k| wx[k] * x[t][k] * self.cell[row * BINS + k][c]).sum::<f64>() / BINS as f64;
        (0..BINS).map(|row| [0, 1, 2].map(|c| std::array::from_fn(|t| project(row, c, t)))).collect()
    }

    fn squares(&self, wx: &[f64; BINS], wy: &[f64; BINS]) -> f64 {
        let of = |(k, v): (usize, &[f64; 3])| wx[k % BINS] * wy[k / BINS] * v.iter().map(|v| v * v).sum::<f64>();
        self.cell.iter().enumerate().map(of).sum::<f64>() / (BINS * BINS) as f64
    }

    fn solve(&self, equations: &Equations, rows: &[[[f64; TERMS]; 3]], y: &Profiles, wy: &[f64; BINS], squares: f64) -> (f64, [f64; 3]) {
        let (mut left, mut hole) = (squares, [0.0; 3]);
        for c in 0..3 {
            let mut likely = [0.0; ALL];
            likely[0] = PARAMS.darkness * self.mean[c];
            [1, TERMS, TERMS + 1].into_iter().for_each(|k| likely[k] = self.mean[c]);
            let mut rest = [0.0; ALL];
            for (k, value) in rest.iter_mut().enumerate() {
                let (b, a) = (k / TERMS, k % TERMS);
                let data = (0..BINS).map(|row| wy[row] * y[b][row] * rows[row][c][a]).sum::<f64>() / BINS as f64;
                let modelled: f64 = (0..ALL).map(|j| equations.matrix[k * ALL + j] * likely[j]).sum();
                left -= likely[k] * (2.0 * data - modelled);
                *value = data - modelled;
            }
            // Positive definite: a product of two positive semidefinite matrices, and the pulls. Without a factor nothing is explained.
            let Some(factor) = &equations.factor else { return (squares, hole) };
            let change = factor.solve(&rest);
            left -= rest.iter().zip(&change).map(|(r, d)| r * d).sum::<f64>();
            hole[c] = likely[0] + change[0];
        }
        (left.max(0.0), hole)
    }

    /// The best hole: from the best of many starts, each followed by two searches.
    fn search(&self, pull: f64) -> (HoleShape, f64) {
        let mut best = ([0.0, 0.0, 0.1, 0.1, PARAMS.blur.ln()], f64::INFINITY);
        for start in self.starts(pull) {
            let mut place = start;
            for sign in [1.0, -1.0] {
                let window = [place[0], place[1]];
                let rate = |p: &HoleShape| self.rate(p, pull, window);
                place = simplex(&rate, place, PARAMS.steps.map(|s| s * sign), PARAMS.evaluations);
                let value = rate(&place);
                if sign < 0.0 && value < best.1 {
                    best = (place, value);
                }
            }
        }
        best
    }

    /// Places and sizes that explain most of the whole crossing, none like another.
    fn starts(&self, pull: f64) -> Vec<HoleShape> {
        let even = [1.0; BINS];
        let axis = |k: usize| -> Vec<(f64, f64, Profiles, [[f64; TERMS]; TERMS])> {
            let middles = (0..PARAMS.places).map(|p| (p as f64 + 0.5) / PARAMS.places as f64 - 0.5);
            let all = middles.flat_map(|middle| PARAMS.widths.map(|gap| (middle, gap)));
            all.map(|(middle, gap)| {
                let profiles = self.profiles(middle, gap, PARAMS.blur / self.pitch[k]);
                (middle, gap, profiles, gram(&profiles, &even))
            })
            .collect()
        };
        let (across, upward) = (axis(0), axis(1));
        let squares = self.squares(&even, &even);
        let mut rated: Vec<(f64, HoleShape)> = Vec::new();
        for (x, width, of_x, gram_x) in &across {
            let rows = self.rows(of_x, &even);
            for (y, height, of_y, gram_y) in &upward {
                let equations = Equations::new(&[*gram_x, *gram_y], pull);
                let left = self.solve(&equations, &rows, of_y, &even, squares).0;
                rated.push((left, [*x, *y, *width, *height, PARAMS.blur.ln()]));
            }
        }
        rated.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut kept: Vec<HoleShape> = Vec::new();
        for (_, p) in rated {
            let alike = |q: &HoleShape| {
                let apart = wrapped(p[0] - q[0]).abs().max(wrapped(p[1] - q[1]).abs());
                apart <= PARAMS.middles_apart && (p[2] - q[2]).abs() + (p[3] - q[3]).abs() <= PARAMS.sides_apart
            };
            if !kept.iter().any(alike) {
                kept.push(p);
                if kept.len() == PARAMS.followed {
                    break;
                }
            }
        }
        kept
    }

    /// How much the hole's colour differs from what is beside it, on the side where it does least: a share of the brighter of both.
    fn contrast(&self, place: &HoleShape, pull: f64) -> f64 {
        let weights = [place[0], place[1]].map(|m| Self::window(Some(m)));
        let hole = self.fit(&self.both_profiles(place), &weights, pull).1;
        let size = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let beside = |dx: f64, dy: f64| {
            let v = self.cell[bin(place[1] + dy) * BINS + bin(place[0] + dx)];
            size([0, 1, 2].map(|c| v[c] - hole[c])) / size(v).max(size(hole)).max(1e-9)
        };
        let [rx, ry] = [0, 1].map(|k| 0.5 * place[2 + k].clamp(PARAMS.narrowest, PARAMS.widest) + PARAMS.beside);
        [(rx, 0.0), (-rx, 0.0), (0.0, ry), (0.0, -ry)].map(|(dx, dy)| beside(dx, dy)).into_iter().fold(f64::INFINITY, f64::min)
    }
}

/// A difference of places in threads, -0.5 to 0.5.
fn wrapped(d: f64) -> f64 {
    (d + 0.5).rem_euclid(1.0) - 0.5
}

/// Middle of a bin, in threads from the fold's middle.
fn centre(bin: usize) -> f64 {
    (bin as f64 + 0.5) / BINS as f64 - 0.5
}

/// The bin of a place.
fn bin(place: f64) -> usize {
    let bin = truncate_usize((place + 0.5).rem_euclid(1.0) * BINS as f64);
    bin.min(BINS - 1)
}

/// Means of the products of the functions.
fn gram(profiles: &Profiles, weights: &[f64; BINS]) -> [[f64; TERMS]; TERMS] {
    let mean = |a: usize, b: usize| (0..BINS).map(|k| weights[k] * profiles[a][k] * profiles[b][k]).sum::<f64>() / BINS as f64;
    std::array::from_fn(|a| std::array::from_fn(|b| mean(a, b)))
}

/// Normal equations of all coefficients, and their factor with the pulls added to the diagonal.
struct Equations {
    matrix: Vec<f64>,
    factor: Option<Cholesky>,
}

impl Equations {
    /// The equations of the products of the functions of x and of y.
    fn new([x, y]: &[[[f64; TERMS]; TERMS]; 2], pull: f64) -> Self {
        let entry = |i: usize, j: usize| y[i / TERMS][j / TERMS] * x[i % TERMS][j % TERMS];
        let matrix: Vec<f64> = (0..ALL * ALL).map(|k| entry(k / ALL, k % ALL)).collect();
        let mut pulled = matrix.clone();
        (0..ALL).for_each(|i| pulled[i * ALL + i] += if i == 0 { pull } else { PARAMS.even_pull });
        Self { matrix, factor: Cholesky::new(&pulled, ALL) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weave::grid::Repeat;

    /// A mean crossing with a hole of given sides (threads) and colour, blurred by some bins.
    fn cell(gaps: [f64; 2], hole: [f32; 3], sigma: f64) -> Fold {
        let pitch = [20.0, 20.0];
        let model = HoleModel::new(vec![[1.0; 3]; BINS * BINS], pitch);
        let [x, y] =
            [0.21, -0.33].into_iter().zip(gaps).map(|(m, g)| model.profiles(m, g, sigma / 20.0)).collect::<Vec<_>>().try_into().unwrap();
        let thread = |p: &Profiles, k: usize| 0.3 * p[1][k] + 0.7 * p[4][k] + 0.15 * p[2][k];
        let colour = (0..BINS * BINS)
            .map(|k| {
                let (i, j) = (k % BINS, k / BINS);
                let (hx, hy): (f64, f64) = (x[0][i], y[0][j]);
                let (tx, ty) = (thread(&x, i), thread(&y, j));
                let light = [0.6, 0.5, 0.4].map(|c| c * (0.9 * tx * hy + 0.7 * ty * hx + 1.1 * tx * ty));
                std::array::from_fn(|c| (light[c] + f64::from(hole[c]) * hx * hy) as f32)
            })
            .collect();
        Fold { kx: BINS, ky: BINS, repeat: Repeat { columns: 1, shift: 0, rows: 1 }, colour, count: vec![9.0; BINS * BINS] }
    }

    #[test]
    fn holes_of_any_colour_are_measured() {
        for (gaps, hole) in [([0.3, 0.12], [0.02; 3]), ([0.1, 0.12], [0.02; 3]), ([0.25, 0.2], [0.5, 0.2, 0.1])] {
            let found = find(&cell(gaps, hole, 0.8), [20.0, 20.0]).unwrap();
            for k in 0..2 {
                // Without what round threads add.
                let gap = 1.0 - found.fill[k] + 2.0 * PARAMS.inside * 0.8 / 20.0;
                assert!((gap - gaps[k]).abs() < 0.02, "{gap} for {}, {hole:?}", gaps[k]);
            }
        }
    }

    #[test]
    fn threads_that_touch_have_no_wide_hole() {
        // The dark line where two round threads touch may be taken for a gap of a pixel.
        let touching = find(&cell([0.002, 0.002], [0.02; 3], 0.8), [20.0, 20.0]);
        assert!(touching.is_none_or(|h| h.fill.iter().all(|f| *f > 0.94)), "{touching:?}");
        let flat = Fold { colour: vec![[1.0; 3]; BINS * BINS], ..cell([0.1, 0.1], [0.0; 3], 0.8) };
        assert_eq!(find(&flat, [20.0, 20.0]), None);
    }
}
