//! Where a facet lies in its piece.

use crate::polygon::Convex;
use glam::DVec2;

/// Where a facet's own frame lies in its piece: a rotation and then a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The x axis of the facet's frame, of unit length.
    pub x: DVec2,
    /// Its origin.
    pub origin: DVec2,
}

impl Pose {
    pub(super) const IDENTITY: Self = Self { x: DVec2::X, origin: DVec2::ZERO };

    /// A point of the facet's frame in the piece's.
    pub fn apply(&self, p: DVec2) -> DVec2 {
        self.origin + p.x * self.x + p.y * self.x.perp()
    }

    /// The pose that maps the segment `from` onto the segment `to` of the same length.
    pub fn mapping(from: [DVec2; 2], to: [DVec2; 2]) -> Self {
        let (a, b) = (from[1] - from[0], to[1] - to[0]);
        // The direction of `b` in the frame where `a` is the x axis: b times the conjugate of a.
        let x = DVec2::new(a.dot(b), a.perp_dot(b)).normalize_or(DVec2::X);
        let middle = 0.5 * (from[0] + from[1]);
        let turned = middle.x * x + middle.y * x.perp();
        Self { x, origin: 0.5 * (to[0] + to[1]) - turned }
    }

    pub(super) fn convex(&self, shape: &Convex) -> Convex {
        Convex { corners: shape.corners.map(|p| self.apply(p)), count: shape.count }
    }
}
