//! Convex hull of points in the plane.

use glam::DVec2;

/// The corners of the convex hull, counter-clockwise from the leftmost one; no three of them lie on a line. Fewer than three distinct
/// points come back sorted.
///
/// Andrew's monotone chain (1979, "Another efficient algorithm for convex hulls in two dimensions"), `O(n log n)`; the turns are computed in
/// `f64` without a guard, so a point nearer to a side than rounding may be kept or not.
pub fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull = chain(points.iter().copied());
    hull.extend(chain(points.iter().rev().copied()));
    hull
}

/// One side of the hull of sorted points, without its last point.
fn chain(points: impl Iterator<Item = DVec2>) -> Vec<DVec2> {
    let mut out: Vec<DVec2> = Vec::new();
    for p in points {
        while out.len() >= 2 && (out[out.len() - 1] - out[out.len() - 2]).perp_dot(p - out[out.len() - 1]) <= 0.0 {
            out.pop();
        }
        out.push(p);
    }
    out.pop();
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::Random;

    fn points(coordinates: &[(f64, f64)]) -> Vec<DVec2> {
        coordinates.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
    }

    #[test]
    fn drops_what_lies_inside_on_a_line_or_twice() {
        let square = points(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
        let more = points(&[(1.0, 1.0), (1.0, 0.0), (2.0, 1.0), (2.0, 2.0), (0.0, 0.0)]);
        assert_eq!(convex_hull([square.clone(), more].concat()), square);
    }

    #[test]
    fn few_points_and_points_on_a_line_have_a_flat_hull() {
        assert!(convex_hull(Vec::new()).is_empty());
        assert_eq!(convex_hull(points(&[(1.0, 1.0), (1.0, 1.0)])), points(&[(1.0, 1.0)]));
        assert_eq!(convex_hull(points(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)])), points(&[(0.0, 0.0), (2.0, 2.0)]));
    }

    #[test]
    fn no_point_lies_outside_and_every_corner_is_convex() {
        let mut random = Random::new(1);
        let all: Vec<DVec2> = (0..500).map(|_| DVec2::new(random.unit(), random.unit())).collect();
        let hull = convex_hull(all.clone());
        for k in 0..hull.len() {
            let (a, b) = (hull[k], hull[(k + 1) % hull.len()]);
            assert!(all.iter().all(|p| (b - a).perp_dot(*p - a) >= -1e-15));
        }
    }
}
