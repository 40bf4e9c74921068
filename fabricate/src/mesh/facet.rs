//! One flat polygon of the surface, in space and in its own plane.

use super::adjacency::place;
use super::merge::Group;
use super::triangles::{Triangles, newell};
use biscale::error::BadInput;
use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;

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

impl Facet {
    pub(super) fn new(soup: &Triangles, group: Group) -> Result<Self, BadInput> {
        let at = |v: u32| soup.vertices[v as usize];
        let Group { corners, triangles, colour } = group;
        let area = newell(corners.iter().map(|&c| at(c)));
        let normal = area.normalize_or_zero();
        let origin = at(corners[0]);
        // The x axis along the longest edge: lengths along it are kept to the last bit.
        let n = corners.len();
        let longest = (0..n)
            .max_by(|&j, &k| {
                let length = |k: usize| at(corners[k]).distance_squared(at(corners[(k + 1) % n]));
                length(j).total_cmp(&length(k)).then(k.cmp(&j))
            })
            .expect("a facet has corners");
        let along = at(corners[(longest + 1) % n]) - at(corners[longest]);
        let x = (along - normal * along.dot(normal)).normalize_or_zero();
        let y = normal.cross(x);
        if normal == DVec3::ZERO || x == DVec3::ZERO {
            return Err(BadInput::new(format!("a facet at {} has no area", place(origin)), "remove it from the mesh"));
        }
        let flat = corners.iter().map(|&c| DVec2::new((at(c) - origin).dot(x), (at(c) - origin).dot(y))).collect();
        let place_of: FxHashMap<u32, u32> = corners.iter().zip(0..).map(|(&v, k)| (v, k)).collect();
        // Corners that were inside the facet are gone from its outline; then it is filled anew.
        let fill: Option<Vec<[u32; 3]>> =
            triangles.iter().map(|t| Some([*place_of.get(&t[0])?, *place_of.get(&t[1])?, *place_of.get(&t[2])?])).collect();
        let mut facet = Self { corners, flat, fill: Vec::new(), edges: Vec::new(), normal, colour };
        facet.fill = match fill {
            Some(fill) => fill,
            None => crate::polygon::triangulate(&facet.flat),
        };
        Ok(facet)
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
