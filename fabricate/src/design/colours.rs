//! The printed colour of a design: what its surfaces reflect of light from above.

use biscale::material::{SmallScale, Tint};
use glam::{DVec2, DVec3};

/// What each surface reflects of light from above before its tint, as paper can show it, linear RGB.
pub(super) fn albedo(surface: &SmallScale) -> Vec<[f64; 3]> {
    let mut albedo: Vec<[f64; 3]> = surface.surfaces.iter().map(|s| s.brdf.directional_albedo(DVec3::Z)).collect();
    let brightest = albedo.iter().flatten().copied().fold(0.0, f64::max);
    // Metals and measured data may reflect more than paper can: all are darkened alike then.
    let exposure = if brightest > 1.0 { 1.0 / brightest } else { 1.0 };
    albedo.iter_mut().flatten().for_each(|a| *a *= exposure);
    albedo
}

/// The printed colour of each triangle: what the surface reflects of light from above.
pub(super) fn colours(surface: &SmallScale) -> Vec<[f64; 3]> {
    let albedo = albedo(surface);
    (0..surface.tile.triangles.len())
        .map(|t| {
            let s = usize::from(surface.surface_of_triangle[t]);
            let tint = match &surface.surfaces[s].tint {
                Tint::Uniform(tint) => *tint,
                Tint::Image(image) => {
                    let uv = surface.tile.uv.as_ref().map_or(DVec2::ZERO, |uv| uv[t].iter().sum::<DVec2>() / 3.0);
                    image.lookup(uv).map(f64::from)
                }
            };
            std::array::from_fn(|c| (albedo[s][c] * tint[c]).clamp(0.0, 1.0))
        })
        .collect()
}
