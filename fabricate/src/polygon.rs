//! Polygons in the plane: convex ones that collide or not, any one cut into triangles.

use glam::DVec2;

/// A convex polygon of three or four corners, counter-clockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Convex {
    /// The corners; the last is repeated where there are three.
    pub corners: [DVec2; 4],
    /// How many corners, 3 or 4; 0 for nothing.
    pub count: usize,
}

/// What may overlap without counting, mm: rounding of coordinates, far below what scissors see.
pub const TOUCH: f64 = 1e-6;

impl Convex {
    /// From three or four corners, counter-clockwise.
    pub fn new(points: &[DVec2]) -> Self {
        let mut corners = [points[points.len() - 1]; 4];
        corners[..points.len()].copy_from_slice(points);
        Self { corners, count: points.len() }
    }

    /// The corners.
    pub fn points(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    /// Lowest and highest coordinates.
    pub fn bounds(&self) -> [DVec2; 2] {
        bounds(self.points().iter().copied())
    }

    /// Whether the two share more than a border: by the separating axis theorem, with [`TOUCH`] allowed.
    pub fn overlaps(&self, other: &Self) -> bool {
        !self.has_separating_edge(other) && !other.has_separating_edge(self)
    }

    fn has_separating_edge(&self, other: &Self) -> bool {
        let points = self.points();
        (0..points.len()).any(|k| {
            let (a, b) = (points[k], points[(k + 1) % points.len()]);
            let along = b - a;
            // The outside of a counter-clockwise polygon lies to the right of its edges.
            let most = other.points().iter().map(|&p| along.perp_dot(p - a)).fold(f64::NEG_INFINITY, f64::max);
            most <= 0.0 || most * most <= TOUCH * TOUCH * along.length_squared()
        })
    }
}

/// Lowest and highest coordinates of points.
pub fn bounds(points: impl IntoIterator<Item = DVec2>) -> [DVec2; 2] {
    points.into_iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

/// Signed area, positive for counter-clockwise.
pub fn area(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    0.5 * (0..n).map(|k| (polygon[k] - polygon[0]).perp_dot(polygon[(k + 1) % n] - polygon[0])).sum::<f64>()
}

/// Cuts a simple polygon into counter-clockwise triangles, as places of its corners.
pub fn triangulate(polygon: &[DVec2]) -> Vec<[u32; 3]> {
    let mut out: Vec<u32> = Vec::new();
    earcut::Earcut::new().earcut(polygon.iter().map(|p| [p.x, p.y]), &[], &mut out);
    let triangles = out.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
    triangles
        .map(|[a, b, c]| {
            let [p, q, r] = [a, b, c].map(|k| polygon[k as usize]);
            if (q - p).perp_dot(r - p) < 0.0 { [a, c, b] } else { [a, b, c] }
        })
        .collect()
}

/// Whether a point lies inside a polygon or on its border.
pub fn contains(polygon: &[DVec2], p: DVec2) -> bool {
    let n = polygon.len();
    let mut inside = false;
    for k in 0..n {
        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
        if distance_to_segment(p, a, b) <= TOUCH {
            return true;
        }
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
    }
    inside
}

/// Distance of a point from a segment.
pub fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = if along == DVec2::ZERO { 0.0 } else { ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0) };
    p.distance(a + t * along)
}
