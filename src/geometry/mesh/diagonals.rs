//! Diagonals of faces of four corners.
//!
//! Where a face is not flat its two diagonals give two surfaces. Taken is the flatter one; but no edge that the mesh has already, since two
//! faces that share two edges would have one triangle twice, or three triangles would meet at the diagonal.

use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;

/// The other diagonal is taken only if it folds less by this, radians: rounding does not decide. Chosen, not measured.
const FLATTER: f64 = 1e-6;

/// Chooses the diagonals of `quads`, each the first of the two triangles of a face of four corners that became a fan; `uv` has one entry a triangle.
pub(super) fn choose(vertices: &[DVec3], quads: &[usize], triangles: &mut [[u32; 3]], uv: &mut [[DVec2; 3]]) {
    let edge = |a: u32, b: u32| (a.min(b), a.max(b));
    let mut uses: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for t in &*triangles {
        for k in 0..3 {
            *uses.entry(edge(t[k], t[(k + 1) % 3])).or_default() += 1;
        }
    }
    // A diagonal is an edge of its own two triangles.
    for &first in quads {
        let [a, _, c] = triangles[first];
        *uses.entry(edge(a, c)).or_default() -= 2;
    }
    for &first in quads {
        let ([a, b, c], [_, _, d]) = (triangles[first], triangles[first + 1]);
        let at = [a, b, c, d].map(|v| vertices[v as usize]);
        let taken = |p: u32, q: u32| uses.get(&edge(p, q)).is_some_and(|&n| n > 0);
        let own = fold([at[0], at[1], at[2]], [at[0], at[2], at[3]]);
        let other = fold([at[1], at[2], at[3]], [at[1], at[3], at[0]]);
        let turned = match (taken(a, c), taken(b, d), own, other) {
            // A face that is not convex has one diagonal.
            (_, _, _, None) => false,
            (true, false, ..) | (_, _, None, _) => true,
            (false, true, ..) => false,
            (_, _, Some(own), Some(other)) => other + FLATTER < own,
        };
        if turned {
            let ([ua, ub, uc], [_, _, ud]) = (uv[first], uv[first + 1]);
            (triangles[first], triangles[first + 1]) = ([b, c, d], [b, d, a]);
            (uv[first], uv[first + 1]) = ([ub, uc, ud], [ub, ud, ua]);
        }
        let diagonal = if turned { edge(b, d) } else { edge(a, c) };
        *uses.entry(diagonal).or_default() += 2;
    }
}

/// Angle between two triangles, radians; none if one has no area or they turn against each other by a right angle or more.
fn fold(first: [DVec3; 3], second: [DVec3; 3]) -> Option<f64> {
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).try_normalize();
    let (n, m) = (normal(first)?, normal(second)?);
    let cosine = n.dot(m);
    (cosine > 0.0).then(|| n.cross(m).length().atan2(cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangles of faces of four corners.
    fn cut(vertices: &[[f64; 3]], faces: &[[u32; 4]]) -> Vec<[u32; 3]> {
        let vertices: Vec<DVec3> = vertices.iter().map(|&v| v.into()).collect();
        let mut triangles: Vec<[u32; 3]> = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let quads: Vec<usize> = (0..faces.len()).map(|f| 2 * f).collect();
        let mut uv = vec![[DVec2::NAN; 3]; triangles.len()];
        choose(&vertices, &quads, &mut triangles, &mut uv);
        triangles
    }

    #[test]
    fn two_faces_that_share_two_edges_have_no_triangle_twice() {
        let vertices = [[0., 0., 0.], [30., 45., -10.], [0., 35., -40.], [0., -5., -35.], [-30., 45., -10.]];
        let triangles = cut(&vertices, &[[0, 1, 2, 3], [0, 3, 2, 4]]);
        let mut seen = triangles.clone();
        seen.iter_mut().for_each(|t| t.sort_unstable());
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 4, "{triangles:?}");
    }

    #[test]
    fn the_flatter_diagonal_is_taken_and_flat_faces_stay() {
        // A valley of two long triangles along the diagonal from corner 1 to corner 3.
        let bent = [[0., 0., 1.], [2., 0., 0.], [2.2, 2., 1.], [0., 2., 0.]];
        let folds = |t: &[[u32; 3]]| fold(t[0].map(|c| bent[c as usize].into()), t[1].map(|c| bent[c as usize].into())).unwrap();
        let chosen = cut(&bent, &[[0, 1, 2, 3]]);
        assert!(folds(&chosen) <= folds(&[[0, 1, 2], [0, 2, 3]]) && folds(&chosen) <= folds(&[[1, 2, 3], [1, 3, 0]]));
        let flat = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        assert_eq!(cut(&flat, &[[0, 1, 2, 3]]), [[0, 1, 2], [0, 2, 3]]);
    }
}
