//! The rays of a batch: where each starts, and the sums of what they bring back.

use crate::brdf::Colour;
use crate::direction::Pair;
use crate::transport::{PathSequence, TransportScene, ViewRay};
use glam::DVec2;

/// Sums over rays from the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sums {
    /// Light that came back: see [`PathLight`](crate::transport::PathLight).
    pub colour: Colour,
    /// The part of `colour` that came along rays that were given up and count as free.
    pub doubtful: Colour,
    /// Least and most light of a ray that met a front face.
    pub range: [Colour; 2],
    /// The brightest direct light that any ray saw, those between two events included.
    pub brightest: Colour,
    /// Rays that met a front face.
    pub front: u32,
    /// Rays from the viewer that were given up and count as missing.
    pub lost: u32,
    /// What the radiance would have been multiplied by that the rays between two events saw which were given up and count as free.
    pub lost_bounces: Colour,
}

impl Default for Sums {
    fn default() -> Self {
        let dark = [0.0; 3];
        Self { colour: dark, doubtful: dark, range: [[f64::INFINITY; 3], dark], brightest: dark, front: 0, lost: 0, lost_bounces: dark }
    }
}

impl Sums {
    /// Adds path `index` of a sequence. It starts somewhere on the plane over one period, and has at most `bounces + 1` surface events.
    pub(super) fn add_path(&mut self, scene: &TransportScene<'_>, pair: Pair, bounces: u32, sequence: PathSequence, index: u32) {
        let origin = (scene.surface().tile.period * DVec2::from(sequence.start(index))).extend(scene.highest());
        match scene.path(origin, pair, 1..=bounces.saturating_add(1), sequence, index) {
            ViewRay::Front(path) => {
                self.front += 1;
                for c in 0..3 {
                    self.colour[c] += path.colour[c];
                    self.doubtful[c] += path.doubtful[c];
                    self.lost_bounces[c] += path.lost[c];
                    self.brightest[c] = self.brightest[c].max(path.brightest[c]);
                    self.range[0][c] = self.range[0][c].min(path.colour[c]);
                    self.range[1][c] = self.range[1][c].max(path.colour[c]);
                }
            }
            ViewRay::Dark => {}
            ViewRay::GaveUp => self.lost += 1,
        }
    }
}
