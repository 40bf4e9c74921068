//! How far a piece reaches in several directions: whether it fits the paper.

use super::pose::Pose;
use super::problem::Sheet;
use crate::mesh::Facet;
use glam::DVec2;

/// Directions in a quarter turn in which a piece's size is measured. Chosen, not
/// measured: more directions find more pieces that fit aslant, and each costs time for every move.
const DIRECTIONS: usize = 8;

/// Least and largest coordinates along directions of a quarter turn, then along those a right angle further.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span([[f64; 2]; 2 * DIRECTIONS]);

impl Span {
    /// Of nothing.
    pub(super) const EMPTY: Self = Self([[f64::INFINITY, f64::NEG_INFINITY]; 2 * DIRECTIONS]);

    /// Takes a facet in.
    pub(super) fn add(&mut self, facet: &Facet, pose: &Pose) {
        for &p in &facet.flat {
            let p = pose.apply(p);
            for (k, axis) in AXES.iter().enumerate() {
                for (j, value) in [(k, axis.dot(p)), (k + DIRECTIONS, axis.perp_dot(p))] {
                    self.0[j][0] = self.0[j][0].min(value);
                    self.0[j][1] = self.0[j][1].max(value);
                }
            }
        }
    }

    /// Area of the smallest box among the rotations, mm²; 0 of nothing.
    pub(super) fn least_box(&self) -> f64 {
        let [w, h] = [0, DIRECTIONS].map(|j| self.0[j][1] - self.0[j][0]);
        if w < 0.0 || h < 0.0 {
            return 0.0;
        }
        let area = |k: usize| (self.0[k][1] - self.0[k][0]) * (self.0[k + DIRECTIONS][1] - self.0[k + DIRECTIONS][0]);
        (0..DIRECTIONS).map(area).fold(f64::INFINITY, f64::min)
    }

    /// Whether some of the rotations fits the sheet, upright or lying.
    pub(super) fn fits(&self, sheet: Sheet) -> bool {
        let (long, short) = (sheet.size.max_element(), sheet.size.min_element());
        (0..DIRECTIONS).any(|k| {
            let [w, h] = [k, k + DIRECTIONS].map(|j| self.0[j][1] - self.0[j][0]);
            w.max(h) <= long && w.min(h) <= short
        })
    }
}

/// Cosines and sines of `k / DIRECTIONS` of a quarter turn.
static AXES: std::sync::LazyLock<[DVec2; DIRECTIONS]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|k| DVec2::from_angle(k as f64 * std::f64::consts::FRAC_PI_2 / DIRECTIONS as f64)));
