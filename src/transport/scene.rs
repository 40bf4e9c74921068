//! A surface as paths need it: rays through it, normals, what covers a point, and the direct light there.

use crate::brdf::{Brdf, Colour};
use crate::error::Result;
use crate::material::{SmallScale, Tint};
use crate::visibility::{Hit, Occlusion, PeriodicBvh, Traced};
use glam::DVec3;

/// A surface with what paths need to know of it.
pub struct TransportScene<'a> {
    small: &'a SmallScale,
    bvh: PeriodicBvh,
    /// Unit normals of the triangles.
    normals: Vec<DVec3>,
}

/// The point where a path meets the surface.
pub(super) struct SurfacePoint<'a> {
    hit: Hit,
    /// Unit normal.
    pub normal: DVec3,
    /// What covers the triangle.
    pub brdf: &'a Brdf,
    /// What the BRDF is multiplied by: a colour, or an image's at this point.
    pub tint: Colour,
}

impl<'a> TransportScene<'a> {
    /// Prepares a surface.
    ///
    /// # Errors
    /// A surface that rays cannot be traced to: see [`PeriodicBvh::new`].
    pub fn new(small: &'a SmallScale) -> Result<Self> {
        let normal = |t: usize| {
            let [a, b, c] = small.tile.corners(t);
            (b - a).cross(c - a).normalize_or_zero()
        };
        Ok(Self { small, bvh: PeriodicBvh::new(&small.tile)?, normals: (0..small.tile.triangles.len()).map(normal).collect() })
    }

    /// The surface.
    pub fn surface(&self) -> &'a SmallScale {
        self.small
    }

    /// Height of its highest point, in the tile's unit.
    pub fn highest(&self) -> f64 {
        self.bvh.highest()
    }

    /// Where a ray from above meets the surface first.
    pub(super) fn first_hit(&self, origin: DVec3, direction: DVec3) -> Traced {
        self.bvh.trace(origin, direction, None)
    }

    /// Where a ray from a point of the surface meets it next.
    pub(super) fn next_hit(&self, from: &SurfacePoint<'_>, direction: DVec3) -> Traced {
        self.bvh.trace(from.hit.position, direction, Some(from.hit.triangle))
    }

    /// What is at a hit.
    pub(super) fn point(&self, hit: Hit) -> SurfacePoint<'a> {
        let triangle = hit.triangle as usize;
        let surface = &self.small.surfaces[usize::from(self.small.surface_of_triangle[triangle])];
        let tint = match &surface.tint {
            Tint::Uniform(tint) => *tint,
            Tint::Image(image) => {
                let [a, b, c] = self.small.tile.uv.as_ref().expect("Material::build refuses an image without uv")[triangle];
                let at = a + hit.barycentric.x * (b - a) + hit.barycentric.y * (c - a);
                image.lookup(at).map(f64::from)
            }
        };
        SurfacePoint { hit, normal: self.normals[triangle], brdf: &surface.brdf, tint }
    }

    /// `fr (n·wi)+` of a point without its tint, 0 in the shadow, and whether it lies there.
    pub(super) fn direct_light(&self, point: &SurfacePoint<'_>, wi: DVec3, wo: DVec3) -> (Colour, Occlusion) {
        let SurfacePoint { hit, normal, brdf, .. } = point;
        let cos = normal.dot(wi);
        if cos <= 0.0 || normal.dot(wo) <= 0.0 {
            return ([0.0; 3], Occlusion::Blocked);
        }
        match self.bvh.occluded(hit.triangle as usize, hit.position, wi) {
            Occlusion::Blocked => ([0.0; 3], Occlusion::Blocked),
            seen => (brdf.eval(*normal, wi, wo).map(|fr| fr * cos), seen),
        }
    }
}
