//! Colours that change within a facet: what the design's surface shows at a point.
//!
//! A tint image gives every point of the design a colour of its own, and a facet of a reduced surface lies over triangles of several
//! colours. So the printed colour is looked up on the design itself: under a point of a height field straight below or above it, on any
//! other surface at the nearest point that faces the same way.

use crate::design::Source;
use crate::mesh::{Facet, Mesh, Triangles};
use biscale::material::{SmallScale, Tint};
use glam::{DVec2, DVec3};
use rstar::{AABB, PointDistance, RTree, RTreeObject};

/// The colours of a design, repeated as it is.
pub struct Texture<'s> {
    surface: &'s SmallScale,
    /// What each surface reflects of light from above before its tint, linear RGB.
    albedo: Vec<[f64; 3]>,
    /// Millimetres of one unit of the design.
    scale: f64,
    place: Place,
}

/// How a point of the design is found.
enum Place {
    /// A height field of one surface: its texture coordinates are the place over the tile.
    Over { period: DVec2, surface: usize },
    /// Any other: the nearest triangle.
    Nearest(RTree<Triangle>),
}

/// A triangle in space that can be found by what is near it.
pub struct Triangle {
    corners: [DVec3; 3],
    /// Its unit normal.
    pub normal: DVec3,
    /// A number that the maker gave it.
    id: usize,
}

impl Triangle {
    /// Triangle `k` of `soup`, with a number.
    pub fn new(soup: &Triangles, k: usize, id: usize) -> Self {
        let corners = soup.triangles[k].map(|v| soup.vertices[v as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
        Self { corners, normal, id }
    }
}

impl RTreeObject for Triangle {
    type Envelope = AABB<[f64; 3]>;
    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.corners;
        AABB::from_corners(a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
    }
}

impl PointDistance for Triangle {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = DVec3::from_array(*point);
        let [a, b, c] = self.corners;
        let [u, v, w] = nearest(p, self.corners);
        (u * a + v * b + w * c).distance_squared(p)
    }
}

/// Weights of the corners at the point of a triangle that is nearest to `p` (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
fn nearest(p: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
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

/// Triangles near a point that are looked at for one that faces the same way.
const MOST_NEAR: usize = 24;

impl<'s> Texture<'s> {
    /// The colours of a source at a scale and so many periods; `None` of a plain mesh, which is white.
    pub fn new(source: &'s Source, scale: f64, periods: [u32; 2]) -> Option<Self> {
        let Source::Material(material) = source else { return None };
        let surface = &material.1;
        let one = surface.surface_of_triangle.first().copied().unwrap_or(0);
        let place = if surface.tile.grid.is_some() && surface.surface_of_triangle.iter().all(|&s| s == one) {
            Place::Over { period: surface.tile.period, surface: usize::from(one) }
        } else {
            let soup = source.triangles(scale, periods);
            let of_tile = surface.tile.triangles.len();
            let triangles = (0..soup.triangles.len()).map(|k| Triangle::new(&soup, k, k % of_tile));
            Place::Nearest(RTree::bulk_load(triangles.collect()))
        };
        Some(Self { surface, albedo: crate::design::albedo(surface), scale: scale * source.unit_mm(), place })
    }

    /// Points that are looked up for one dot of print, along each side of it: an image may be finer than the print.
    pub fn samples(&self) -> u32 {
        if matches!(self.place, Place::Over { .. }) { 2 } else { 1 }
    }

    /// The colour at a point near the surface, mm, where it faces `normal`; linear RGB.
    pub fn at(&self, p: DVec3, normal: DVec3) -> [f64; 3] {
        match &self.place {
            Place::Over { period, surface } => self.tinted(*surface, p.truncate() / (*period * self.scale)),
            Place::Nearest(tree) => {
                let p3 = p.to_array();
                let mut near = tree.nearest_neighbor_iter(&p3).take(MOST_NEAR);
                let t = near.find(|t| t.normal.dot(normal) > 0.1).or_else(|| tree.nearest_neighbor(&p3));
                let t = t.expect("a design has triangles");
                let k = t.id;
                let weights = nearest(p, t.corners);
                let uv = self.surface.tile.uv.as_ref().map_or(DVec2::ZERO, |uv| (0..3).map(|c| weights[c] * uv[k][c]).sum());
                self.tinted(usize::from(self.surface.surface_of_triangle[k]), uv)
            }
        }
    }

    fn tinted(&self, surface: usize, uv: DVec2) -> [f64; 3] {
        let tint = match &self.surface.surfaces[surface].tint {
            Tint::Uniform(tint) => *tint,
            Tint::Image(image) => image.lookup(uv).map(f64::from),
        };
        std::array::from_fn(|c| (self.albedo[surface][c] * tint[c]).clamp(0.0, 1.0))
    }

    /// Gives every facet the mean of its colours: what is drawn where no image can be, and what tells dark facets from light ones.
    pub fn tint(&self, mesh: &mut Mesh) {
        for f in 0..mesh.facets.len() {
            let colour = self.mean(mesh, &mesh.facets[f]);
            mesh.facets[f].colour = colour;
        }
    }

    fn mean(&self, mesh: &Mesh, facet: &Facet) -> [f64; 3] {
        /// Points along each side of a triangle.
        const GRID: u32 = 6;
        let mut sum = [0.0; 4];
        for t in &facet.fill {
            let [a, b, c] = t.map(|k| mesh.vertices[facet.corners[k as usize] as usize]);
            let area = (b - a).cross(c - a).length();
            for i in 0..GRID {
                for j in 0..GRID - i {
                    let (u, v) = ((f64::from(i) + 0.33) / f64::from(GRID), (f64::from(j) + 0.33) / f64::from(GRID));
                    let colour = self.at(a + u * (b - a) + v * (c - a), facet.normal);
                    (0..3).for_each(|k| sum[k] += area * colour[k]);
                    sum[3] += area;
                }
            }
        }
        [0, 1, 2].map(|k| sum[k] / sum[3].max(f64::MIN_POSITIVE))
    }
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
