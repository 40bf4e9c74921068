//! The model's period registered with that of the close-up: where in it the picture begins, and what each place of it then shows.

use crate::photograph::mean_period::MeanPeriod;
use crate::residuals::equations::huber_weight;
use crate::residuals::params::PARAMS;
use biscale::numerics::cast::truncate_usize;

/// For each place the first pixel and the weights from it on.
type Axis = Vec<(usize, Vec<f64>)>;

/// Shares of the pixels of a view, along x and y, in the places of a mean period.
#[derive(Clone, Debug, PartialEq)]
pub struct Windows {
    axes: [Axis; 2],
    /// What the weights change by with the shift, in periods.
    slopes: [Axis; 2],
    pixels: usize,
}

impl Windows {
    /// From a view of `pixels` x `pixels`, shifted by `shift` periods, to `size` places.
    pub fn new(pixels: usize, size: [usize; 2], shift: [f64; 2]) -> Self {
        let axis = |k: usize, is_slope: bool| -> Axis {
            let width = pixels as f64 / size[k] as f64;
            let window = |place: usize| {
                let from = (place as f64 * width + (shift[k] - shift[k].floor()) * pixels as f64).rem_euclid(pixels as f64);
                let to = from + width;
                let (first, last) = (truncate_usize(from), truncate_usize(to) + 1);
                let weight = |p: usize| {
                    if is_slope {
                        // What comes in at the end less what goes out at the beginning.
                        (f64::from(u8::from(p + 1 == last)) - f64::from(u8::from(p == first))) * pixels as f64 / width
                    } else {
                        (to.min(p as f64 + 1.0) - from.max(p as f64)).max(0.0) / width
                    }
                };
                (first, (first..last).map(weight).collect())
            };
            (0..size[k]).map(window).collect()
        };
        Self { axes: [axis(0, false), axis(1, false)], slopes: [axis(0, true), axis(1, true)], pixels }
    }

    /// A picture of the view's pixels at the places.
    pub fn of<const C: usize>(&self, picture: &[[f64; C]]) -> Vec<[f64; C]> {
        self.along(&self.axes[1], &self.across(&self.axes[0], picture))
    }

    /// The same, and what it changes by with the shift along x and along y.
    fn with_slopes(&self, picture: &[[f64; 3]]) -> [Vec<[f64; 3]>; 3] {
        let rows = self.across(&self.axes[0], picture);
        let changes = self.across(&self.slopes[0], picture);
        [self.along(&self.axes[1], &rows), self.along(&self.axes[1], &changes), self.along(&self.slopes[1], &rows)]
    }

    fn across<const C: usize>(&self, axis: &Axis, picture: &[[f64; C]]) -> Vec<[f64; C]> {
        let n = self.pixels;
        let mut rows = vec![[0.0; C]; n * axis.len()];
        for (own, line) in rows.chunks_exact_mut(axis.len()).zip(picture.chunks_exact(n)) {
            for (sum, (first, weights)) in own.iter_mut().zip(axis) {
                for (k, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                    let v = &line[(first + k) % n];
                    (0..C).for_each(|c| sum[c] += w * v[c]);
                }
            }
        }
        rows
    }

    fn along<const C: usize>(&self, axis: &Axis, rows: &[[f64; C]]) -> Vec<[f64; C]> {
        let width = rows.len() / self.pixels;
        let mut out = vec![[0.0; C]; axis.len() * width];
        for (own, (first, weights)) in out.chunks_exact_mut(width).zip(axis) {
            for (k, w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                let row = (first + k) % self.pixels;
                for (sum, v) in own.iter_mut().zip(&rows[row * width..]) {
                    (0..C).for_each(|c| sum[c] += w * v[c]);
                }
            }
        }
        out
    }
}

/// A colour of which highlights and shades have taken away less, against a brightness `bright` (the sum of channels).
pub fn flattened(v: [f64; 3], bright: f64) -> [f64; 3] {
    let sum = v.iter().sum::<f64>() + PARAMS.flattening * bright;
    if sum > 0.0 { v.map(|v| v / sum) } else { [0.0; 3] }
}

fn flat(picture: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let bright = picture.iter().map(|v| v.iter().sum::<f64>()).sum::<f64>() / picture.len().max(1) as f64;
    picture.iter().map(|v| flattened(*v, bright)).collect()
}

/// The shifts, in periods, at which `picture`, of the view's pixels, is most like the mean period, the best first: a weave that is shifted by half a period looks much like itself.
pub fn coarse(picture: &[[f64; 3]], pixels: usize, mean: &MeanPeriod) -> Vec<[f64; 2]> {
    let size = mean.size.map(|n| n.div_ceil(PARAMS.coarse_places));
    let own = flat(&Windows::new(pixels, size, [0.0; 2]).of(picture));
    let seen = flat(&mean.mean);
    let mut other = vec![([0.0; 3], 0.0); size[0] * size[1]];
    for (at, v) in seen.iter().enumerate() {
        let (x, y) = (at % mean.size[0] * size[0] / mean.size[0], at / mean.size[0] * size[1] / mean.size[1]);
        let (sum, count) = &mut other[y * size[0] + x];
        (0..3).for_each(|c| sum[c] += v[c]);
        *count += 1.0;
    }
    let whole: [f64; 3] = std::array::from_fn(|c| seen.iter().map(|v| v[c]).sum::<f64>() / seen.len() as f64);
    let other: Vec<[f64; 3]> =
        other.into_iter().map(|(sum, count)| std::array::from_fn(|c| sum[c] / f64::max(count, 1.0) - whole[c])).collect();
    let mut products = vec![0.0; size[0] * size[1]];
    for (at, product) in products.iter_mut().enumerate() {
        let (dx, dy) = (at % size[0], at / size[0]);
        for y in 0..size[1] {
            let row = (y + dy) % size[1] * size[0];
            for x in 0..size[0] {
                let (a, b) = (&own[row + (x + dx) % size[0]], &other[y * size[0] + x]);
                *product += a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            }
        }
    }
    let near = |at: usize, dx: usize, dy: usize| products[(at / size[0] + dy) % size[1] * size[0] + (at + dx) % size[0]];
    let is_peak = |&at: &usize| {
        let around = [(1, 0), (size[0] - 1, 0), (0, 1), (0, size[1] - 1)];
        around.iter().all(|&(dx, dy)| products[at] >= near(at, dx, dy))
    };
    let mut peaks: Vec<usize> = (0..products.len()).filter(is_peak).collect();
    peaks.sort_by(|&a, &b| products[b].total_cmp(&products[a]).then(a.cmp(&b)));
    let best = peaks.first().map_or(0.0, |&p| products[p]);
    let is_good = |at: &usize| products[*at] > PARAMS.shift_peak * best;
    let places = peaks.into_iter().filter(is_good).take(PARAMS.shift_peaks);
    let found: Vec<[f64; 2]> = places.map(|at| [(at % size[0]) as f64 / size[0] as f64, (at / size[0]) as f64 / size[1] as f64]).collect();
    if found.is_empty() { vec![[0.0; 2]] } else { found }
}

/// The shift near `shift` at which `picture` is nearest to the mean period, `sigma` the standard deviation of each place: steps of Gauss and Newton.
pub fn refined(picture: &[[f64; 3]], pixels: usize, mean: &MeanPeriod, sigma: &[[f64; 3]], mut shift: [f64; 2]) -> [f64; 2] {
    let moves = [0, 1].map(|k| mean.size[k] > 1);
    for _ in 0..PARAMS.shift_steps {
        let [here, x, y] = Windows::new(pixels, mean.size, shift).with_slopes(picture);
        let slopes = [&x, &y];
        let (mut gram, mut rhs) = ([[1e-30, 0.0], [0.0, 1e-30]], [0.0; 2]);
        for p in 0..here.len() {
            for c in 0..3 {
                let r = (here[p][c] - mean.mean[p][c]) / sigma[p][c];
                let w = huber_weight(r);
                let d = [0, 1].map(|k| if moves[k] { slopes[k][p][c] / sigma[p][c] } else { 0.0 });
                for i in 0..2 {
                    rhs[i] -= w * d[i] * r;
                    (0..2).for_each(|j| gram[i][j] += w * d[i] * d[j]);
                }
            }
        }
        let det = gram[0][0] * gram[1][1] - gram[0][1] * gram[1][0];
        let step = if moves == [true; 2] && det > 1e-9 * gram[0][0] * gram[1][1] {
            [(gram[1][1] * rhs[0] - gram[0][1] * rhs[1]) / det, (gram[0][0] * rhs[1] - gram[1][0] * rhs[0]) / det]
        } else {
            [rhs[0] / gram[0][0], rhs[1] / gram[1][1]]
        };
        let mut longest: f64 = 0.0;
        for k in (0..2).filter(|&k| moves[k]) {
            let limit = PARAMS.longest_shift / mean.size[k] as f64;
            let step = step[k].clamp(-limit, limit);
            shift[k] += step;
            longest = longest.max((step * mean.size[k] as f64).abs());
        }
        if longest < PARAMS.settled_shift {
            break;
        }
    }
    shift
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const PIXELS: usize = 64;

    /// Two stripes across each other, of their own colours.
    fn picture() -> Vec<[f64; 3]> {
        let value = |k: usize| {
            let (x, y) = ((k % PIXELS) as f64 / PIXELS as f64, (k / PIXELS) as f64 / PIXELS as f64);
            let (a, b) = ((TAU * x).sin(), (TAU * y).cos());
            [1.0 + 0.4 * a + 0.3 * (2.0 * TAU * x).cos(), 1.0 + 0.5 * a * b, 1.0 + 0.6 * b]
        };
        (0..PIXELS * PIXELS).map(value).collect()
    }

    fn seen(size: [usize; 2], shift: [f64; 2]) -> MeanPeriod {
        let mean = Windows::new(PIXELS, size, shift).of(&picture());
        let sigma = vec![[0.01; 3]; mean.len()];
        MeanPeriod { size, mean, sigma, ..MeanPeriod::default() }
    }

    #[test]
    fn windows_keep_the_mean_and_move_by_whole_pixels_exactly() {
        let picture = picture();
        let mean = |of: &[[f64; 3]], c: usize| of.iter().map(|v| v[c]).sum::<f64>() / of.len() as f64;
        for shift in [[0.0, 0.0], [0.123, -0.4], [-3.7, 0.999]] {
            let seen = Windows::new(PIXELS, [24, 10], shift).of(&picture);
            assert!((0..3).all(|c| (mean(&seen, c) - mean(&picture, c)).abs() < 1e-12), "{shift:?}");
        }
        let moved = Windows::new(PIXELS, [PIXELS; 2], [5.0 / PIXELS as f64, 63.0 / PIXELS as f64]).of(&picture);
        for y in 0..PIXELS {
            for x in 0..PIXELS {
                let (a, b) = (moved[y * PIXELS + x], picture[(y + 63) % PIXELS * PIXELS + (x + 5) % PIXELS]);
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-9), "{x} {y}");
            }
        }
    }

    #[test]
    fn a_shift_is_found_to_a_thousandth_of_a_period_along_both_directions_and_along_one() {
        for (size, shift) in [([24, 24], [0.371, 0.82]), ([20, 24], [0.02, 0.49]), ([24, 1], [0.613, 0.0])] {
            let mean = seen(size, shift);
            let first = coarse(&picture(), PIXELS, &mean)[0];
            let away = |found: [f64; 2], k: usize| {
                let d: f64 = found[k] - shift[k];
                if size[k] == 1 { 0.0 } else { (d - d.round()).abs() }
            };
            assert!((0..2).all(|k| away(first, k) < 0.1), "{first:?} for {shift:?}");
            let found = refined(&picture(), PIXELS, &mean, &mean.sigma, first);
            assert!((0..2).all(|k| away(found, k) < 1e-3), "{found:?} for {shift:?}");
        }
    }

    #[test]
    fn what_is_the_same_all_over_lies_anywhere() {
        let mean = MeanPeriod { size: [8, 8], mean: vec![[0.5; 3]; 64], sigma: vec![[0.01; 3]; 64], ..MeanPeriod::default() };
        let found = coarse(&picture(), PIXELS, &mean);
        assert!(!found.is_empty());
        let found = refined(&vec![[0.5; 3]; PIXELS * PIXELS], PIXELS, &mean, &mean.sigma, found[0]);
        assert!(found.iter().all(|v| v.is_finite()), "{found:?}");
    }
}
