//! The surface to be folded: triangles in mm, checked, coplanar neighbours merged to facets, edges with their fold angles.
//!
//! A facet is a polygon that stays flat; an edge is where two facets meet, or where the surface ends. What paper cannot do is
//! refused here: three facets at one edge, facets turned against each other, one facet twice, corners that are no numbers.

mod adjacency;
mod merge;
mod soup;

pub(crate) use adjacency::Adjacency;
pub use soup::Triangles;
pub(crate) use soup::close_t_junctions;

use biscale::error::BadInput;
use glam::{DVec2, DVec3};
use merge::{drop_collinear, merge_coplanar};
use soup::{split_t_junctions, under};
use std::collections::BTreeMap;

/// A flat polygon of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    /// Vertices of the mesh, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// The corners in the facet's own plane, mm, counter-clockwise.
    pub flat: Vec<DVec2>,
    /// Triangles that fill the polygon, as places in `corners`.
    pub fill: Vec<[u32; 3]>,
    /// Edge from corner `k` to corner `k + 1`.
    pub edges: Vec<u32>,
    /// Unit normal, outwards.
    pub normal: DVec3,
    /// Linear RGB, 0 to 1.
    pub colour: [f64; 3],
}

/// Where two facets meet, or the surface ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Its ends, in the order of the first facet.
    pub ends: [u32; 2],
    /// The facets on both sides and the place of the edge in each; the second is `None` at the surface's border.
    pub sides: [Option<(u32, u32)>; 2],
    /// Fold angle in radians, -pi to pi: positive for a valley, negative for a mountain, seen from outside; 0 is flat.
    pub angle: f64,
}

/// A surface of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Positions, mm.
    pub vertices: Vec<DVec3>,
    /// The facets.
    pub facets: Vec<Facet>,
    /// The edges.
    pub edges: Vec<Edge>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// What is taken as flat and as one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Corners closer than this are one, mm. A millionth of the size of the surface suits files of 32-bit numbers.
    pub weld: f64,
    /// Neighbours whose corners all lie within this distance of one plane are one facet, mm. A tilt of a small facet by this much moves
    /// what hangs on it a hundred times as far; what is flat to the eye only stays an edge, which is not drawn.
    pub flat: f64,
}

/// Most facets that are taken: beyond it no person folds the result, and the search has no bounded time.
pub const MAX_FACETS: usize = 20_000;

/// Corners of a facet lie in its plane to this share of its width: more would tilt what hangs on a needle.
const FLAT_SHARE: f64 = 1e-7;

/// Two facets count as coplanar only below this angle, radians: a sharper fold between tiny facets is a fold all the same.
const FLAT_ANGLE: f64 = 1e-3;

impl Tolerance {
    /// For a surface of this size, mm.
    pub fn of_size(size: f64) -> Self {
        Self { weld: (1e-7 * size).max(1e-9), flat: 1e-6 }
    }
}

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
            return Err(BadInput::new(problem, "reduce it with --max-facets or --slope-tolerance"));
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
        let Edge { ends, sides: [Some((f, _)), Some((g, _))], .. } = self.edges[edge] else { return 0.0 };
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

    /// Position of a corner of a facet.
    pub fn corner(&self, facet: usize, corner: usize) -> DVec3 {
        self.vertices[self.facets[facet].corners[corner] as usize]
    }

    /// Length of an edge, mm.
    pub fn length(&self, edge: usize) -> f64 {
        let [a, b] = self.edges[edge].ends.map(|v| self.vertices[v as usize]);
        a.distance(b)
    }

    /// Loops of border edges: 0 for a closed surface.
    pub fn border_loops(&self) -> usize {
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for e in self.edges.iter().filter(|e| e.sides[1].is_none()) {
            next.entry(e.ends[0]).or_default().push(e.ends[1]);
        }
        let mut loops = 0;
        while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
            let mut at = start;
            while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
                at = to;
            }
            loops += 1;
        }
        loops
    }

    /// The connected parts, as lists of facets.
    pub fn components(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.facets.len()];
        let mut parts = Vec::new();
        for start in 0..self.facets.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            let mut part = vec![u32::try_from(start).expect("at most MAX_FACETS")];
            let mut k = 0;
            while k < part.len() {
                for (_, g) in self.neighbours(part[k]) {
                    if !std::mem::replace(&mut seen[g as usize], true) {
                        part.push(g);
                    }
                }
                k += 1;
            }
            parts.push(part);
        }
        parts
    }

    /// Edges of a facet that have another facet behind them, with that facet.
    pub fn neighbours(&self, facet: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.facets[facet as usize].edges.iter().filter_map(move |&e| self.other(e, facet).map(|(g, _)| (e, g)))
    }

    /// What lies on the other side of an edge: the facet, and the edge's place in it.
    pub fn other(&self, edge: u32, facet: u32) -> Option<(u32, u32)> {
        let [a, b] = self.edges[edge as usize].sides;
        match (a, b) {
            (Some((f, _)), other) if f == facet => other,
            (other, Some((g, _))) if g == facet => other,
            _ => None,
        }
    }

    /// Volume between the surface and a plane through its lowest point, mm³; inside it, if it is closed.
    pub fn volume(&self) -> f64 {
        let base = self.vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        let of =
            |(f, facet): (usize, &Facet)| facet.fill.iter().map(move |t| under(t.map(|c| self.corner(f, c as usize)), base)).sum::<f64>();
        self.facets.iter().enumerate().map(of).sum()
    }

    /// The smallest height of a facet over one of its edges, mm, and that facet.
    pub fn narrowest(&self) -> (f64, usize) {
        let mut least = (f64::INFINITY, 0);
        for (k, facet) in self.facets.iter().enumerate() {
            let width = width(&facet.flat);
            if width < least.0 {
                least = (width, k);
            }
        }
        least
    }
}

/// Least width of a polygon over its own edges: the distance to the farthest corner, least over the edges.
pub fn width(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    let over = |k: usize| {
        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
        let along = (b - a).normalize_or_zero();
        polygon.iter().map(|&p| along.perp_dot(p - a).abs()).fold(0.0, f64::max)
    };
    (0..n).map(over).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

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
