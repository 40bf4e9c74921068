//! The fitted surface itself, from near and aside, as PNG: what a person checks before any number.

use crate::common::output;
use biscale::error::Result;
use biscale::material::{SmallScale, Tint};
use biscale::numerics::colour::srgb_byte;
use biscale::numerics::statistics::rank;
use biscale::visibility::{Occlusion, PeriodicBvh, Traced};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels across and down, and rays along either side of a pixel.
const SIZE: [u32; 2] = [480, 300];
const RAYS: u32 = 3;
/// Longer periods across the picture.
const PERIODS: f64 = 2.5;
/// Towards the viewer and the light: from above and in front, lit from the left.
const VIEWER: DVec3 = DVec3::new(0.25, -0.7, 0.67);
const LIGHT: DVec3 = DVec3::new(-0.55, -0.25, 0.8);
/// Light from everywhere over that of the lamp, so that shadows are not black.
const AMBIENT: f64 = 0.12;
/// Where gaps show: a table under the sample.
const UNDER: DVec3 = DVec3::new(0.02, 0.02, 0.02);
/// What is white: this share of all values lies below.
const WHITE: f64 = 0.99;

/// Some periods of a surface in parallel projection, with its own colours and BRDFs, under direct light.
///
/// # Errors
/// A surface that rays cannot be traced to.
pub fn picture(small: &SmallScale) -> Result<Vec<u8>> {
    let bvh = PeriodicBvh::new(&small.tile)?;
    let (viewer, light) = (VIEWER.normalize(), LIGHT.normalize());
    let right = DVec3::Z.cross(viewer).normalize();
    let axes = DMat3::from_cols(right, viewer.cross(right), viewer);
    let pixel = PERIODS * small.tile.period.max_element() / f64::from(SIZE[0]);
    let top = bvh.highest() + 1e-6 * small.tile.period.max_element();
    let one = |x: f64, y: f64| {
        let place = axes * DVec3::new(pixel * (x - 0.5 * f64::from(SIZE[0])), pixel * (0.5 * f64::from(SIZE[1]) - y), 0.0);
        let start = place + viewer * ((top - place.z) / viewer.z);
        let Traced::Hit(hit) = bvh.trace(start, -viewer, None) else { return UNDER };
        let triangle = hit.triangle as usize;
        let [a, b, c] = small.tile.corners(triangle);
        let normal = (b - a).cross(c - a).normalize();
        let surface = &small.surfaces[usize::from(small.surface_of_triangle[triangle])];
        // Fits take no image.
        let tint = if let Tint::Uniform(tint) = surface.tint { DVec3::from(tint) } else { DVec3::ONE };
        let of = |to_light: DVec3| PI * normal.dot(to_light).max(0.0) * tint * DVec3::from(surface.brdf.eval(normal, to_light, viewer));
        let is_lit = normal.dot(light) > 0.0 && bvh.occluded(triangle, hit.position, light) != Occlusion::Blocked;
        AMBIENT * of(normal) + if is_lit { of(light) } else { DVec3::ZERO }
    };
    let of_pixel = |k: u32| {
        let (x, y) = (f64::from(k % SIZE[0]), f64::from(k / SIZE[0]));
        let at = |s: u32| (f64::from(s) + 0.5) / f64::from(RAYS);
        (0..RAYS * RAYS).map(|s| one(x + at(s % RAYS), y + at(s / RAYS))).sum::<DVec3>() / f64::from(RAYS * RAYS)
    };
    let rgb: Vec<DVec3> = (0..SIZE[0] * SIZE[1]).into_par_iter().map(of_pixel).collect();
    let mut values: Vec<f64> = rgb.iter().map(|v| v.max_element()).collect();
    let white = rank(&mut values, WHITE).unwrap_or(1.0).max(1e-12);
    let pixels: Vec<u8> = rgb.iter().flat_map(|v| v.to_array().map(|v| srgb_byte((v / white).clamp(0.0, 1.0)))).collect();
    output::png::encode(SIZE, &pixels, false, "made by biscale fit", "the fitted surface")
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::material::Material;
    use biscale::toml_reader::Source;

    #[test]
    fn both_sides_of_grooves_are_seen_with_their_colours() {
        let text = "format = 1\n[geometry]\nkind = \"grooves\"\nprofile = \"v\"\ndepth = 0.2\n[[surface]]\npart = \"left\"\n\
                    brdf = { model = \"lambert\", albedo = [0.6, 0.0, 0.0] }\n[[surface]]\npart = \"right\"\n\
                    brdf = { model = \"lambert\", albedo = [0.0, 0.6, 0.0] }\n";
        let small = Material::parse(&Source { path: "m.toml".into(), text: text.to_owned() }).unwrap().build().unwrap();
        let picture = image::load_from_memory(&picture(&small).unwrap()).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), (SIZE[0], SIZE[1]));
        let share = |c: usize| picture.pixels().filter(|p| p[c] > 100 && p[(c + 1) % 3] < 50).count() as f64 / f64::from(SIZE[0] * SIZE[1]);
        // The left side faces +x, away from the lamp.
        let [red, green] = [0, 1].map(share);
        assert!(red + green > 0.8 && green > 0.4, "{red} {green}");
    }
}
