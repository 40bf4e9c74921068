//! Directions of edges: the structure tensor of a cut, and the turn of threads from the picture's axes.

use super::field::Field;
use std::f64::consts::{FRAC_PI_2, PI};

/// How strongly edges run in each direction: a histogram of the gradient's direction modulo a right angle, weighted by the squared
/// gradient.
#[derive(Clone, Debug)]
pub(super) struct Edges {
    /// Squared gradients by direction of the gradient modulo a half turn, from 0.
    histogram: Vec<f64>,
}

/// How directions of edges are gathered. Chosen on drawn cloths (see [`super`]).
struct EdgeParams {
    /// Directions in half a turn: a quarter of a degree each.
    bins: usize,
    /// Half width of the triangle that the histogram is smoothed by when its peak is sought, in degrees.
    smooth_deg: f64,
    /// Half width of the window in which the direction is averaged, in degrees.
    window_deg: f64,
    /// Rounds of moving the window to its own mean; it settles in a few.
    rounds: usize,
    /// Change at which that ends, in radians.
    settled: f64,
}

const PARAMS: EdgeParams = EdgeParams { bins: 720, smooth_deg: 3.0, window_deg: 4.0, rounds: 20, settled: 1e-6 };

/// Scharr's weights of a 3 x 3 derivative, whose direction is right within a tenth of a degree: beside the middle line and on it.
const SCHARR: [f64; 2] = [47.0, 162.0];

impl Edges {
    /// Gradients of brightness, smoothed over 3 x 3 pixels.
    pub fn of(field: &Field) -> Self {
        let (w, h) = (field.width, field.height);
        let mut histogram = vec![0.0; PARAMS.bins];
        let value: Vec<f32> = field.ratio.iter().map(|r| r.iter().map(|v| (v - 1.0) / (v + 1.0)).sum()).collect();
        for y in 1..h.saturating_sub(1) {
            for x in 1..w - 1 {
                let at = |dx: usize, dy: usize| f64::from(value[(y + dy - 1) * w + x + dx - 1]);
                if !(0..3).all(|dy| (0..3).all(|dx| field.valid[(y + dy - 1) * w + x + dx - 1])) {
                    continue;
                }
                let gx = SCHARR[0] * (at(2, 0) - at(0, 0) + at(2, 2) - at(0, 2)) + SCHARR[1] * (at(2, 1) - at(0, 1));
                let gy = SCHARR[0] * (at(0, 2) - at(0, 0) + at(2, 2) - at(2, 0)) + SCHARR[1] * (at(1, 2) - at(1, 0));
                let square = gx * gx + gy * gy;
                if square > 0.0 {
                    let bin = (gy.atan2(gx).rem_euclid(PI) / PI * PARAMS.bins as f64) as usize;
                    histogram[bin % PARAMS.bins] += square;
                }
            }
        }
        Self { histogram }
    }

    fn weight(&self, angle: f64) -> f64 {
        self.histogram[(angle.rem_euclid(PI) / PI * PARAMS.bins as f64) as usize % PARAMS.bins]
    }

    /// The turn within `max_turn` (radians) of the picture's axes at which most edges run along both axes.
    pub fn turn(&self, max_turn: f64) -> f64 {
        let step = PI / PARAMS.bins as f64;
        let reach = (max_turn / step) as i64;
        let window = (PARAMS.smooth_deg.to_radians() / step) as i64;
        let smooth = |k: i64| -> f64 {
            (-window..=window)
                .map(|d| {
                    let angle = (k + d) as f64 * step + 0.5 * step;
                    let share = 1.0 - d.abs() as f64 / (window + 1) as f64;
                    // Both directions count by their roots: light from one side makes the edges of one direction strong.
                    share * (self.weight(angle).sqrt() + self.weight(angle + FRAC_PI_2).sqrt())
                })
                .sum()
        };
        let best = (-reach..=reach).max_by(|&a, &b| smooth(a).total_cmp(&smooth(b)).then(b.abs().cmp(&a.abs()))).unwrap_or(0);
        self.sharpen(best as f64 * step + 0.5 * step)
    }

    /// The mean direction of the edges near a turn of both axes, by the structure tensor of the gradients in a window around it.
    pub fn sharpen(&self, mut turn: f64) -> f64 {
        let step = PI / PARAMS.bins as f64;
        let reach = (PARAMS.window_deg.to_radians() / step) as i64;
        for _ in 0..PARAMS.rounds {
            let (mut sum, mut weights) = (0.0, 0.0);
            for axis in [turn, turn + FRAC_PI_2] {
                let middle = (axis / step).floor();
                // The eigenvector of the 2 x 2 tensor sum of g g^T over the window: half the angle of the sum of doubled angles.
                let (mut cos2, mut sin2, mut total) = (0.0, 0.0, 0.0);
                for d in -reach..=reach {
                    let angle = (middle + d as f64 + 0.5) * step;
                    let taper = 1.0 - ((angle - axis) / (reach as f64 * step)).powi(2);
                    let weight = self.weight(angle) * taper.max(0.0);
                    cos2 += weight * (2.0 * (angle - axis)).cos();
                    sin2 += weight * (2.0 * (angle - axis)).sin();
                    total += weight;
                }
                sum += 0.5 * sin2.atan2(cos2) * total;
                weights += total;
            }
            let change = if weights > 0.0 { sum / weights } else { 0.0 };
            turn += change;
            if change.abs() < PARAMS.settled {
                break;
            }
        }
        turn
    }
}
