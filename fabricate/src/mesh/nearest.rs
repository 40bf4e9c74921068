//! Triangles that can be found by what is near them.

use super::triangles::Triangles;
use glam::DVec3;
use rstar::{AABB, PointDistance, RTreeObject};

/// A triangle in space that can be found by what is near it.
pub struct NearTriangle {
    pub(crate) corners: [DVec3; 3],
    /// Its unit normal.
    pub normal: DVec3,
    /// A number that the maker gave it.
    pub(crate) id: usize,
}

impl NearTriangle {
    /// Triangle `k` of `soup`, with a number.
    pub fn new(soup: &Triangles, k: usize, id: usize) -> Self {
        let corners = soup.triangles[k].map(|v| soup.vertices[v as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        Self { corners, normal, id }
    }
}

impl RTreeObject for NearTriangle {
    type Envelope = AABB<[f64; 3]>;
    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.corners;
        AABB::from_corners(a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
    }
}

impl PointDistance for NearTriangle {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = DVec3::from_array(*point);
        let [a, b, c] = self.corners;
        let [u, v, w] = nearest(p, self.corners);
        (u * a + v * b + w * c).distance_squared(p)
    }
}

/// Weights of the corners at the point of a triangle that is nearest to `p` (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
pub(crate) fn nearest(p: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let inverse = 1.0 / (va + vb + vc);
    let (v, w) = (vb * inverse, vc * inverse);
    [1.0 - v - w, v, w]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle_is_a_corner_a_side_or_inside() {
        let t = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)];
        for (p, expected) in [
            ((-1.0, -1.0, 3.0), [1.0, 0.0, 0.0]),
            ((5.0, -1.0, 0.0), [0.0, 1.0, 0.0]),
            ((-1.0, 9.0, 0.0), [0.0, 0.0, 1.0]),
            ((1.0, -4.0, 1.0), [0.5, 0.5, 0.0]),
            ((-3.0, 0.5, 1.0), [0.75, 0.0, 0.25]),
            ((3.0, 3.0, 1.0), [0.0, 0.5, 0.5]),
            ((0.5, 0.5, -7.0), [0.5, 0.25, 0.25]),
        ] {
            assert_eq!(nearest(DVec3::from(p), t), expected, "{p:?}");
        }
    }
}
