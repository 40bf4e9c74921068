//! Cutting a polygon in space into triangles.

use crate::error::BadInput;
use earcut::Earcut;
use glam::{DVec2, DVec3};

/// A polygon cut into triangles.
pub(super) struct Triangles {
    /// As places among its corners, turning the way the polygon does.
    pub triangles: Vec<[usize; 3]>,
    /// Whether the polygon crosses itself, so that no triangles cover it: it is cut as a fan, some of which turns the other way.
    pub crossed: bool,
}

/// Cuts a polygon into triangles.
///
/// A convex polygon becomes a fan about its first corner (exact for planar ones and the usual choice for others); one that is
/// not convex has its ears clipped in the plane across its mean normal.
///
/// # Errors
/// Fewer than 3 corners.
pub(super) fn triangulate(points: &[DVec3]) -> Result<Triangles, BadInput> {
    let n = points.len();
    if n < 3 {
        return Err(BadInput::new(format!("a face has {n} corners"), "faces need 3 or more"));
    }
    let fan = |crossed| Triangles { triangles: (1..n - 1).map(|k| [0, k, k + 1]).collect(), crossed };
    if n == 3 {
        return Ok(fan(false));
    }
    // Twice the vector area, about the first corner: large coordinates far from the origin cost no digits.
    let parts = || (1..n - 1).map(|k| (points[k] - points[0]).cross(points[k + 1] - points[0]));
    let normal: DVec3 = parts().sum();
    // Areas that cancel: a bow of two equal halves.
    let Some(unit) = normal.try_normalize() else { return Ok(fan(parts().any(|area| area != DVec3::ZERO))) };
    let (u, v) = unit.any_orthonormal_pair();
    let flat: Vec<DVec2> = points.iter().map(|&p| DVec2::new((p - points[0]).dot(u), (p - points[0]).dot(v))).collect();
    let doubled = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
    let area = normal.length();
    // Every triangle of the fan must turn the polygon's way: true for convex polygons and some others, and then the fan covers
    // the polygon once. A collinear corner may miss by rounding.
    if (1..n - 1).all(|k| doubled(0, k, k + 1) >= -1e-12 * area) {
        return Ok(fan(false));
    }
    let mut indices: Vec<usize> = Vec::new();
    Earcut::new().earcut(flat.iter().map(|p| [p.x, p.y]), &[], &mut indices);
    let triangles: Vec<[usize; 3]> =
        indices.chunks_exact(3).map(|t| if doubled(t[0], t[1], t[2]) < 0.0 { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] }).collect();
    let covered: f64 = triangles.iter().map(|t| doubled(t[0], t[1], t[2])).sum();
    if (covered - area).abs() > 1e-6 * area {
        return Ok(fan(true));
    }
    Ok(Triangles { triangles, crossed: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        triangles.iter().map(|t| 0.5 * (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).z).sum()
    }

    #[test]
    fn convex_polygons_become_fans_and_concave_ones_keep_their_area() {
        let square: Vec<DVec3> = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        assert_eq!(triangulate(&square).unwrap().triangles, [[0, 1, 2], [0, 2, 3]]);
        // An arrow head whose first corner sees outside, and an L that begins at its inner corner.
        for (shape, expected) in
            [(vec![(0., 0.), (2., 1.), (0., 2.), (1., 1.)], 1.0), (vec![(2., 0.), (2., 1.), (1., 1.), (1., 2.), (0., 2.), (0., 0.)], 3.0)]
        {
            let points: Vec<DVec3> = shape.iter().map(|&(x, y)| DVec3::new(x + 1e3, y - 1e3, 7.0)).collect();
            let Triangles { triangles, crossed } = triangulate(&points).unwrap();
            assert_eq!((triangles.len(), crossed), (points.len() - 2, false));
            assert!(triangles.iter().all(|t| area(&points, &[*t]) > 0.0), "{triangles:?}");
            assert!((area(&points, &triangles) - expected).abs() < 1e-9, "{triangles:?}");
        }
    }

    #[test]
    fn a_face_that_crosses_itself_is_a_fan() {
        let bow: Vec<DVec3> = [(0., 0.), (3., 2.), (3., 0.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        let Triangles { triangles, crossed } = triangulate(&bow).unwrap();
        assert_eq!((&triangles[..], crossed), (&[[0, 1, 2], [0, 2, 3]][..], true));
        let even: Vec<DVec3> = [(0., 0.), (1., 1.), (1., 0.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        assert!(triangulate(&even).unwrap().crossed);
        assert!(!triangulate(&[DVec3::ZERO, DVec3::X, DVec3::X * 2.0, DVec3::X * 3.0]).unwrap().crossed);
    }
}
