//! How far threads must bend to pass each other, and how deep they meet where they do not.

use super::cloth::{Thread, Weave};
use std::f64::consts::PI;

/// The crimp by default is at most this factor of what keeps straight threads apart: where threads touch side by side they meet at the
/// corners of every crossing however strong they are bent.
const MAX_DEFAULT_CRIMP: f64 = 1.5;

/// Keeps the polygons of the sections apart, not only their ellipses: chords along a bend cut its inside.
const CLEARANCE: f64 = 1.02;

/// Intervals at which half a section is looked at.
///
/// Chosen, not measured: the height of a section is concave and the bend smooth, so that between 65 points the largest depth is missed by
/// less than [`CLEARANCE`] adds.
const INTERVALS: u32 = 64;

/// How deep warp and weft meet.
pub(super) struct Overlap {
    /// Largest depth at a crossing; 0 where threads pass each other.
    pub deepest: f64,
    /// Height of the thinner threads.
    pub thinner: f64,
}

impl Weave {
    /// Height of half a section over its middle, at a share of the half width.
    fn rise(share: f64) -> f64 {
        (1.0 - share * share).max(0.0).sqrt()
    }

    /// For each thread of one direction its width over the distance to its nearest neighbour, where threads across it bend.
    fn crowding(threads: &[Thread], period: f64) -> f64 {
        let n = threads.len();
        let to_next =
            |k: usize| if k + 1 < n { threads[k + 1].centre - threads[k].centre } else { threads[0].centre + period - threads[k].centre };
        (0..n).map(|k| threads[k].width / to_next(k).min(to_next((k + n - 1) % n))).fold(0.0, f64::max)
    }

    fn heights(&self) -> (f64, f64) {
        let highest = |threads: &[Thread]| threads.iter().map(|t| t.height).fold(0.0, f64::max);
        (highest(&self.warp), highest(&self.weft))
    }

    /// The smallest crimp with which threads do not meet along their middle lines, at the most crowded crossing.
    ///
    /// At a distance `t` half widths from a crossing's middle along the warp, the warp's centre line has fallen to `a cos(pi/2 crowding t)`
    /// while the weft under it still rises `rise(t)` half heights; and the same along the weft.
    pub(super) fn least_crimp(&self) -> f64 {
        let (warp_height, weft_height) = self.heights();
        let straight = 0.5 * (warp_height + weft_height);
        let along = |share: f64, across: f64, crowding: f64| {
            let own = 0.5 * (warp_height + weft_height - across);
            let needed = |k: u32| {
                let t = f64::from(k) / f64::from(INTERVALS);
                let bend = libm::cos(0.5 * PI * (crowding * t).min(1.0)).max(0.0);
                (own + 0.5 * across * Self::rise(t)) / (share * bend + (1.0 - share)).max(f64::MIN_POSITIVE)
            };
            (0..=INTERVALS).map(needed).fold(0.0, f64::max)
        };
        let warp = along(self.crimp_share, weft_height, Self::crowding(&self.weft, self.period.y));
        let weft = along(1.0 - self.crimp_share, warp_height, Self::crowding(&self.warp, self.period.x));
        (CLEARANCE * warp.max(weft)).min(MAX_DEFAULT_CRIMP * straight)
    }

    /// How deep threads meet at most at a crossing.
    pub(super) fn overlap(&self) -> Overlap {
        let (warp_height, weft_height) = self.heights();
        let (warp_crowding, weft_crowding) = (Self::crowding(&self.warp, self.period.x), Self::crowding(&self.weft, self.period.y));
        let bend = |crowding: f64, t: f64| libm::cos(0.5 * PI * (crowding * t).min(1.0));
        let grid = || (0..=INTERVALS).map(|k| f64::from(k) / f64::from(INTERVALS));
        // At (x, y) half widths from the middle of a crossing the depth is a term of x and one of y: each has its largest value by itself.
        let along_x = |x: f64| 0.5 * warp_height * Self::rise(x) - self.crimp * (1.0 - self.crimp_share) * bend(warp_crowding, x);
        let along_y = |y: f64| 0.5 * weft_height * Self::rise(y) - self.crimp * self.crimp_share * bend(weft_crowding, y);
        let deepest = grid().map(along_x).fold(f64::NEG_INFINITY, f64::max) + grid().map(along_y).fold(f64::NEG_INFINITY, f64::max);
        Overlap { deepest: deepest.max(0.0), thinner: warp_height.min(weft_height) }
    }
}
