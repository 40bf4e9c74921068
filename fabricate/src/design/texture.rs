//! Colours that change within a facet: what the design's surface shows at a point.
//!
//! A tint image gives every point of the design a colour of its own, and a facet of a reduced surface lies over triangles of several
//! colours. So the printed colour is looked up on the design itself: under a point of a height field straight below or above it, on any
//! other surface at the nearest point that faces the same way.

use super::colours::albedo;
use super::source::Source;
use crate::mesh::{Facet, Mesh, NearTriangle, nearest};
use biscale::material::{SmallScale, Tint};
use glam::{DVec2, DVec3};
use rstar::RTree;

/// The colours of a design, repeated as it is.
pub struct Texture<'s> {
    surface: &'s SmallScale,
    /// What each surface reflects of light from above before its tint, linear RGB.
    albedo: Vec<[f64; 3]>,
    /// Millimetres of one unit of the design.
    scale: f64,
    lookup: Lookup,
}

/// How a point of the design is found.
enum Lookup {
    /// A height field of one surface: its texture coordinates are the place over the tile.
    Over { period: DVec2, surface: usize },
    /// Any other: the nearest triangle.
    Nearest(RTree<NearTriangle>),
}

/// Triangles near a point that are looked at for one that faces the same way. Chosen, not measured.
const MOST_NEAR: usize = 24;
/// Cosine between normals above which two triangles face the same way: less than 84 degrees apart.
const SAME_WAY: f64 = 0.1;

impl<'s> Texture<'s> {
    /// The colours of a source at a scale and so many periods; `None` of a plain mesh, which is white.
    pub fn new(source: &'s Source, scale: f64, periods: [u32; 2]) -> Option<Self> {
        let Source::Material(material) = source else { return None };
        let surface = &material.1;
        let one = surface.surface_of_triangle.first().copied().unwrap_or(0);
        let lookup = if surface.tile.grid.is_some() && surface.surface_of_triangle.iter().all(|&s| s == one) {
            Lookup::Over { period: surface.tile.period, surface: usize::from(one) }
        } else {
            let soup = source.triangles(scale, periods);
            let of_tile = surface.tile.triangles.len();
            let triangles = (0..soup.triangles.len()).map(|k| NearTriangle::new(&soup, k, k % of_tile));
            Lookup::Nearest(RTree::bulk_load(triangles.collect()))
        };
        Some(Self { surface, albedo: albedo(surface), scale: scale * source.unit_mm(), lookup })
    }

    /// Points that are looked up for one dot of print, along each side of it: an image may be finer than the print.
    pub fn samples(&self) -> u32 {
        if matches!(self.lookup, Lookup::Over { .. }) { 2 } else { 1 }
    }

    /// The colour at a point near the surface, mm, where it faces `normal`; linear RGB.
    pub fn at(&self, p: DVec3, normal: DVec3) -> [f64; 3] {
        match &self.lookup {
            Lookup::Over { period, surface } => self.tinted(*surface, p.truncate() / (*period * self.scale)),
            Lookup::Nearest(tree) => {
                let p3 = p.to_array();
                let mut near = tree.nearest_neighbor_iter(&p3).take(MOST_NEAR);
                let t = near.find(|t| t.normal.dot(normal) > SAME_WAY).or_else(|| tree.nearest_neighbor(&p3));
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
        /// Points along each side of a triangle: 21 in all.
        const GRID: u32 = 6;
        /// Where a point lies in its cell: at the middle of the lower of its two triangles.
        const INNER: f64 = 0.33;
        let mut sum = [0.0; 4];
        for t in &facet.fill {
            let [a, b, c] = t.map(|k| mesh.vertices[facet.corners[k as usize] as usize]);
            let area = (b - a).cross(c - a).length();
            for i in 0..GRID {
                for j in 0..GRID - i {
                    let (u, v) = ((f64::from(i) + INNER) / f64::from(GRID), (f64::from(j) + INNER) / f64::from(GRID));
                    let colour = self.at(a + u * (b - a) + v * (c - a), facet.normal);
                    (0..3).for_each(|k| sum[k] += area * colour[k]);
                    sum[3] += area;
                }
            }
        }
        [0, 1, 2].map(|k| sum[k] / sum[3].max(f64::MIN_POSITIVE))
    }
}
