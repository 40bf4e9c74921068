//! Which facets meet at which edges; what cannot be a surface of paper is refused.

use biscale::error::BadInput;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// A facet at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The facet.
    pub facet: u32,
    /// The place of the edge among those of the facet; it runs from the corner at this place to the next one.
    pub place: u32,
}

/// Where two facets meet, or the surface ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Its ends, in the order of the first facet.
    pub ends: [u32; 2],
    /// The facets on both sides; the second is `None` at the surface's border.
    pub sides: [Option<Side>; 2],
    /// Fold angle in radians, -pi to pi: positive for a valley, negative for a mountain, seen from outside; 0 is flat.
    pub angle: f64,
}

/// A place in space as words.
pub(super) fn place(v: DVec3) -> String {
    format!("({:.3}, {:.3}, {:.3}) mm", v.x, v.y, v.z)
}

/// Which polygon lies behind which edge.
pub(crate) struct Adjacency {
    /// The edges.
    pub edges: Vec<Edge>,
    /// For each polygon its edges.
    pub of_polygon: Vec<Vec<u32>>,
}

impl Adjacency {
    pub(crate) fn new(vertices: &[DVec3], polygons: &[Vec<u32>]) -> Result<Self, BadInput> {
        let mut found: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        let mut edges: Vec<Edge> = Vec::new();
        let mut of_polygon = Vec::with_capacity(polygons.len());
        let mut seen: FxHashMap<Vec<u32>, usize> = FxHashMap::default();
        for (p, corners) in polygons.iter().enumerate() {
            let mut sorted = corners.clone();
            sorted.sort_unstable();
            if let Some(first) = seen.insert(sorted, p) {
                let at = place(vertices[corners[0] as usize]);
                let problem = format!("facet {} lies on facet {} (a corner is at {at})", p + 1, first + 1);
                return Err(BadInput::new(problem, "remove duplicate faces; paper has one layer"));
            }
            let n = corners.len();
            let polygon = u32::try_from(p).expect("fewer than 2^32 triangles");
            let mut own = Vec::with_capacity(n);
            for k in 0..n {
                let (a, b) = (corners[k], corners[(k + 1) % n]);
                let here = Some(Side { facet: polygon, place: u32::try_from(k).expect("few corners") });
                let middle = || place(0.5 * (vertices[a as usize] + vertices[b as usize]));
                let id = match found.get(&(a.min(b), a.max(b))) {
                    None => {
                        let id = u32::try_from(edges.len()).expect("fewer than 2^32 edges");
                        found.insert((a.min(b), a.max(b)), id);
                        edges.push(Edge { ends: [a, b], sides: [here, None], angle: 0.0 });
                        id
                    }
                    Some(&id) => {
                        let edge = &mut edges[id as usize];
                        if edge.sides[1].is_some() {
                            let problem = format!("three facets meet at the edge around {}", middle());
                            return Err(BadInput::new(problem, "an edge of a paper surface has one or two; cut the mesh there"));
                        }
                        if edge.ends == [a, b] {
                            let problem = format!("two facets with one edge around {} are turned against each other", middle());
                            return Err(BadInput::new(problem, "make the faces' normals consistent (\"recalculate normals\")"));
                        }
                        edge.sides[1] = here;
                        id
                    }
                };
                own.push(id);
            }
            of_polygon.push(own);
        }
        Ok(Self { edges, of_polygon })
    }
}
