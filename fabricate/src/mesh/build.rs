//! Triangles to facets: checked, welded, coplanar neighbours merged, edges with their fold angles.

use super::adjacency::{Adjacency, Edge, Side};
use super::facet::Facet;
use super::faceted::Mesh;
use super::merge::{drop_collinear, merge_coplanar};
use super::t_junctions::split_t_junctions;
use super::tolerance::Tolerance;
use super::triangles::Triangles;
use biscale::error::BadInput;

/// Most facets that are taken: beyond it no person folds the result, and the search has no bounded time. Chosen, not measured.
pub const MAX_FACETS: usize = 20_000;

impl Mesh {
    /// Makes facets of triangles.
    ///
    /// # Errors
    /// Corners that are no numbers, triangles without area that cannot be left out, a triangle twice, edges of three facets,
    /// neighbours turned against each other, more than [`MAX_FACETS`].
    pub fn new(soup: Triangles, tolerance: Tolerance) -> Result<Self, BadInput> {
        Self::with_groups(soup, tolerance, None)
    }

    /// As [`Mesh::new`]; triangles of different numbers in `groups` stay different facets.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn with_groups(mut soup: Triangles, tolerance: Tolerance, groups: Option<&[u32]>) -> Result<Self, BadInput> {
        soup.check()?;
        let mut groups = groups.map_or_else(|| vec![0; soup.triangles.len()], <[u32]>::to_vec);
        let mut notes = Vec::new();
        soup.weld(tolerance.weld);
        let before = soup.triangles.len();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            ((b - a).cross(c - a).length(), longest)
        };
        let keep: Vec<bool> = soup
            .triangles
            .iter()
            .map(|t| {
                let (area, longest) = area(t);
                t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && area > longest * tolerance.weld
            })
            .collect();
        let mut k = keep.iter();
        soup.triangles.retain(|_| *k.next().expect("one a triangle"));
        let mut k = keep.iter();
        soup.colours.retain(|_| *k.next().expect("one a triangle"));
        let mut k = keep.iter();
        groups.retain(|_| *k.next().expect("one a triangle"));
        let flat = before - soup.triangles.len();
        if soup.triangles.is_empty() {
            return Err(BadInput::new("no triangle has an area", "give a surface with at least one; is its scale right?"));
        }
        if flat > 0 {
            notes.push(format!("left out {flat} triangles without area"));
        }
        let polygons: Vec<Vec<u32>> = split_t_junctions(&soup, tolerance.weld);
        let neighbours = Adjacency::new(&soup.vertices, &polygons)?;
        let mut groups = merge_coplanar(&soup, &polygons, &neighbours, tolerance, &groups);
        drop_collinear(&soup, &mut groups, tolerance);
        if groups.len() > MAX_FACETS {
            let problem = format!("the surface has {} facets, more than the {MAX_FACETS} that can be unfolded", groups.len());
            return Err(BadInput::new(problem, "reduce it with `max_facets` or `slope_tolerance`"));
        }
        let facets: Vec<Facet> = groups.into_iter().map(|g| Facet::new(&soup, g)).collect::<Result<_, _>>()?;
        let outlines: Vec<Vec<u32>> = facets.iter().map(|f| f.corners.clone()).collect();
        let Adjacency { edges, of_polygon } = Adjacency::new(&soup.vertices, &outlines)?;
        let mut mesh = Self { vertices: soup.vertices, facets, edges, notes };
        for (facet, edges) in mesh.facets.iter_mut().zip(of_polygon) {
            facet.edges = edges;
        }
        for k in 0..mesh.edges.len() {
            mesh.edges[k].angle = mesh.fold_angle(k);
        }
        mesh.drop_unused();
        Ok(mesh)
    }

    /// Fold angle at an edge, from the normals on both sides.
    fn fold_angle(&self, edge: usize) -> f64 {
        let Edge { ends, sides: [Some(Side { facet: f, .. }), Some(Side { facet: g, .. })], .. } = self.edges[edge] else { return 0.0 };
        let [a, b] = ends.map(|v| self.vertices[v as usize]);
        let (n, m) = (self.facets[f as usize].normal, self.facets[g as usize].normal);
        let along = (b - a).normalize_or_zero();
        // n x m points along the edge of the first facet where the surface bends away from the viewer: a mountain.
        -n.cross(m).dot(along).atan2(n.dot(m))
    }

    fn drop_unused(&mut self) {
        let mut next = vec![u32::MAX; self.vertices.len()];
        let mut kept = Vec::new();
        let mut renumber = |v: &mut u32| {
            if next[*v as usize] == u32::MAX {
                next[*v as usize] = u32::try_from(kept.len()).expect("fewer than before");
                kept.push(self.vertices[*v as usize]);
            }
            *v = next[*v as usize];
        };
        self.facets.iter_mut().flat_map(|f| f.corners.iter_mut()).for_each(&mut renumber);
        self.edges.iter_mut().flat_map(|e| e.ends.iter_mut()).for_each(&mut renumber);
        self.vertices = kept;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Mesh, BadInput> {
        let soup = Triangles::white(vertices.iter().map(|&v| v.into()).collect(), triangles.to_vec());
        let tolerance = Tolerance::of_size(soup.size());
        Mesh::new(soup, tolerance)
    }

    #[test]
    fn coplanar_neighbours_are_one_facet_and_corners_on_straight_lines_go() {
        // Two squares side by side, cut into triangles, and a flap folded up by 90 degrees behind them.
        let vertices = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0., 1., 0.], [1., 1., 0.], [2., 1., 0.], [0., 1., 1.], [2., 1., 1.]];
        let m = mesh(&vertices, &[[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [3, 4, 6], [4, 5, 7], [4, 7, 6]]).unwrap();
        assert_eq!(m.facets.len(), 2);
        assert!(m.facets.iter().all(|f| f.corners.len() == 4), "{:?}", m.facets);
        let folds: Vec<&Edge> = m.edges.iter().filter(|e| e.sides[1].is_some()).collect();
        assert_eq!(folds.len(), 1, "one edge of 2, not two of 1");
        assert!((folds[0].angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "a valley: {}", folds[0].angle);
        assert_eq!((m.border_loops(), m.components().len()), (1, 1));
    }

    #[test]
    fn a_corner_on_the_edge_of_a_neighbour_joins_them() {
        let vertices = [[0., 0., 0.], [2., 0., 0.], [1., 1., 1.], [1., 0., 0.], [0., -1., 1.], [2., -1., 1.]];
        let m = mesh(&vertices, &[[0, 1, 2], [0, 4, 3], [3, 5, 1]]).unwrap();
        assert_eq!(m.components().len(), 1);
        assert_eq!(m.edges.iter().filter(|e| e.sides[1].is_some()).count(), 2);
    }

    #[test]
    fn a_ring_of_coplanar_triangles_does_not_become_a_facet_with_a_hole() {
        let mut vertices = Vec::new();
        for r in [1.0, 2.0] {
            vertices.extend((0..4).map(|k| {
                let (s, c) = (f64::from(k) * std::f64::consts::FRAC_PI_2).sin_cos();
                [r * c, r * s, 0.0]
            }));
        }
        let ring: Vec<[u32; 3]> = (0..4_u32)
            .flat_map(|k| {
                let n = (k + 1) % 4;
                [[k, k + 4, n + 4], [k, n + 4, n]]
            })
            .collect();
        let m = mesh(&vertices, &ring).unwrap();
        assert!(m.facets.len() >= 2, "{} facets", m.facets.len());
        let area: f64 = m.facets.iter().map(|f| crate::polygon::area(&f.flat)).sum();
        assert!((area - (8.0 - 2.0)).abs() < 1e-9, "{area}");
        assert_eq!(m.border_loops(), 2);
    }

    #[test]
    fn volumes_are_those_of_prisms_and_solids() {
        let lifted = Triangles::white(vec![DVec3::ZERO, DVec3::new(2., 0., 0.), DVec3::new(0., 2., 3.)], vec![[0, 1, 2]]);
        assert!((lifted.volume() - 2.0).abs() < 1e-12, "{}", lifted.volume());
    }
}
