//! Squared distances from planes as one quadratic form (Garland and Heckbert 1997).

use glam::{DMat3, DVec3};

/// The quadratic form `p A p + 2 b p + c`: squared distances from planes, by their weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadric {
    pub(super) a: DMat3,
    pub(super) b: DVec3,
    pub(super) c: f64,
}

impl Quadric {
    pub(super) const ZERO: Self = Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0 };

    pub(super) fn plane(normal: DVec3, point: DVec3, weight: f64) -> Self {
        let d = -normal.dot(point);
        let outer = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Self { a: outer * weight, b: normal * (d * weight), c: d * d * weight }
    }

    pub(super) fn plus(self, other: Self) -> Self {
        Self { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c }
    }

    pub(super) fn at(&self, p: DVec3) -> f64 {
        (p.dot(self.a * p) + 2.0 * self.b.dot(p) + self.c).max(0.0)
    }

    /// Where it is least, if that is one point and not a line or a plane.
    pub(super) fn least(&self) -> Option<DVec3> {
        let scale = self.a.col(0).x + self.a.col(1).y + self.a.col(2).z;
        (self.a.determinant() > FLAT_FORM * scale.powi(3)).then(|| self.a.inverse() * -self.b)
    }
}

/// Determinant of a form, of the cube of its trace, below which its lowest point is not looked for: it would lie far away.
/// Chosen, not measured; points that are far away all the same are refused later.
const FLAT_FORM: f64 = 1e-5;
