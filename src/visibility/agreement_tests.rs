//! The implementations against each other.

use super::raster;
use super::rays::{Occlusion, PeriodicBvh};
use crate::facets::{Density, NO_TRIANGLE, Runs, Surface, sample};
use crate::material::Material;
use glam::DVec3;
use std::path::Path;

/// Share of bits by which implementations may differ: points that lie on the edge of a shadow within what f32 tells apart.
const SHARE: f64 = 2e-4;

#[test]
fn projection_and_rays_agree_on_every_tile_at_every_elevation() {
    for tile in ["vgroove", "pyramid", "rods", "weave", "bumpy"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/truth/{tile}.diffuse.toml"));
        let small = Material::load(&path).unwrap().build().unwrap();
        let surface = Surface::new(&small, None);
        let facets = sample(&small, &surface, &Density::uniform(&surface), Runs::of_block(0, 2048, 0, 1), 3);
        let bvh = PeriodicBvh::new(&small.tile).unwrap();
        let (mut differ, mut all) = (0, 0);
        for (k, elevation) in [90.0_f64, 80.0, 60.0, 45.0, 30.0, 15.0, 5.0, 3.0].into_iter().enumerate() {
            let (height, azimuth) = (elevation.to_radians().sin(), 1.7 * k as f64 + 0.3);
            let direction = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0) * (1.0 - height * height).sqrt() + DVec3::Z * height;
            let mut row = vec![0; facets.triangle.len() / 64];
            raster::visible(&surface, &facets, direction, &mut raster::Scratch::default(), &mut row);
            for (f, &t) in facets.triangle.iter().enumerate() {
                let faces = t != NO_TRIANGLE && surface.normals[t as usize].dot(direction) > 0.0;
                let origin = facets.position[f] * surface.unit;
                let free = faces && bvh.occluded(surface.tile_triangle[t as usize] as usize, origin, direction) == Occlusion::Free;
                differ += usize::from(free != (row[f / 64] >> (f % 64) & 1 == 1));
                all += usize::from(faces);
            }
        }
        assert!(differ as f64 <= SHARE * f64::from(all as u32), "{tile}: {differ} of {all} bits differ");
    }
}
