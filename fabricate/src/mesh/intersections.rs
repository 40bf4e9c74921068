//! Facets that pass through each other: a pattern of them can be drawn, but not be folded.

use super::faceted::Mesh;
use glam::DVec3;

/// Share of an edge, and of a facet's plane, within which facets touch and do not cross: rounding of welded corners, many times over. Chosen, not measured.
const TOUCH: f64 = 1e-5;

/// Two facets that cross.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Their places in [`Mesh::facets`], the smaller one first.
    pub facets: [u32; 2],
    /// A place where an edge of one passes through the other, mm.
    pub at: DVec3,
}

/// A triangle of a facet with its bounds.
struct Part {
    facet: u32,
    corners: [DVec3; 3],
    low: DVec3,
    high: DVec3,
}

impl Mesh {
    /// Pairs of facets of which one passes through the other, in the order of the facets. Facets that only touch, and such that overlap in one plane, are none.
    pub fn crossings(&self) -> Vec<Crossing> {
        let mut parts: Vec<Part> = Vec::new();
        for (f, facet) in (0_u32..).zip(&self.facets) {
            for triangle in &facet.fill {
                let corners = triangle.map(|c| self.corner(f as usize, c as usize));
                let [low, high] = [DVec3::min, DVec3::max].map(|pick| corners.into_iter().reduce(pick).expect("three corners"));
                parts.push(Part { facet: f, corners, low, high });
            }
        }
        // Swept along x: only those whose spans overlap are compared.
        parts.sort_by(|a, b| a.low.x.total_cmp(&b.low.x).then(a.facet.cmp(&b.facet)));
        let mut found: Vec<Crossing> = Vec::new();
        for (k, a) in parts.iter().enumerate() {
            for b in parts[k + 1..].iter().take_while(|b| b.low.x <= a.high.x) {
                let apart = a.low.y > b.high.y || b.low.y > a.high.y || a.low.z > b.high.z || b.low.z > a.high.z;
                if a.facet == b.facet || apart {
                    continue;
                }
                if let Some(at) = crossing(&a.corners, &b.corners).or_else(|| crossing(&b.corners, &a.corners)) {
                    found.push(Crossing { facets: [a.facet.min(b.facet), a.facet.max(b.facet)], at });
                }
            }
        }
        found.sort_by_key(|c| c.facets);
        found.dedup_by_key(|c| c.facets);
        found
    }

    /// What the user should know of facets that cross.
    pub fn crossings_note(&self) -> Option<String> {
        let all = self.crossings();
        let first = all.first()?;
        let ([a, b], at) = (first.facets.map(|f| f + 1), super::adjacency::place(first.at));
        let count = match all.len() {
            1 => "facets pass".to_owned(),
            n => format!("{n} pairs of facets pass"),
        };
        Some(format!(
            "{count} through each other, {a} and {b} around {at}: paper cannot; cut the surface there, or fold its parts by themselves"
        ))
    }
}

/// Where an edge of `a` passes through the inside of `b`, well away from its rim.
fn crossing(a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<DVec3> {
    let normal = (b[1] - b[0]).cross(b[2] - b[0]);
    let size = normal.length();
    if size == 0.0 {
        return None;
    }
    let normal = normal / size;
    let longest = (0..3).map(|k| b[k].distance(b[(k + 1) % 3])).fold(0.0, f64::max);
    (0..3).find_map(|k| {
        let (p, q) = (a[k], a[(k + 1) % 3]);
        let (from, to) = (normal.dot(p - b[0]), normal.dot(q - b[0]));
        let margin = TOUCH * p.distance(q).max(longest);
        if from.abs() <= margin || to.abs() <= margin || (from > 0.0) == (to > 0.0) {
            return None;
        }
        let at = p + (q - p) * (from / (from - to));
        // Twice the areas that it leaves at each edge, over that of the whole.
        let inside = (0..3).all(|k| normal.dot((b[(k + 1) % 3] - b[k]).cross(at - b[k])) > TOUCH * size);
        inside.then_some(at)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Tolerance, Triangles};

    fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let soup = Triangles::white(vertices.iter().map(|&v| v.into()).collect(), triangles.to_vec());
        let tolerance = Tolerance::of_size(soup.size());
        Mesh::new(soup, tolerance).unwrap()
    }

    #[test]
    fn facets_that_cross_are_found_with_their_place() {
        // A flag through a floor.
        let m = mesh(&[[0., 0., 0.], [10., 0., 0.], [0., 10., 0.], [2., 2., -3.], [2., 2., 3.], [20., 2., 0.]], &[[0, 1, 2], [3, 4, 5]]);
        let found = m.crossings();
        assert!(found.len() == 1 && found[0].facets == [0, 1], "{found:?}");
        // The floor's long edge passes through the flag.
        assert!(found[0].at.distance(DVec3::new(8.0, 2.0, 0.0)) < 1e-9, "{found:?}");
        assert!(m.crossings_note().unwrap().contains("1 and 2 around (8.000, 2.000, 0.000) mm"));
    }

    #[test]
    fn facets_that_touch_do_not_cross() {
        for third in [
            // Edge on edge, corner on face, edge in the plane, side by side in one plane, apart.
            [[0., 0., 0.], [0., 0., 10.], [10., 0., 0.]],
            [[2., 2., 0.], [2., 2., 9.], [9., 2., 9.]],
            [[1., 1., 0.], [3., 3., 0.], [2., 2., 9.]],
            [[10., 0., 0.], [10., 10., 0.], [0., 10., 0.]],
            [[1., 1., 1.], [3., 3., 1.], [2., 2., 9.]],
        ] {
            let mut vertices = vec![[0., 0., 0.], [10., 0., 0.], [0., 10., 0.]];
            vertices.extend(third);
            let m = mesh(&vertices, &[[0, 1, 2], [3, 4, 5]]);
            assert_eq!(m.crossings(), [], "{third:?}");
        }
    }
}
