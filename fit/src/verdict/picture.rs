//! The fitted material as the camera of a photograph would see it, pixel by pixel.

use crate::photograph::direction_bins::{scene_of, sights};
use crate::photograph::image::Photograph;
use crate::photograph::sight::Sight;
use crate::verdict::params::PARAMS;
use biscale::error::Result;
use biscale::filter::{Control, Quality};
use biscale::material::{Material, SmallScale};
use biscale::numerics::cast::narrow;
use biscale::render::{Frame, Light, Lit, Point, QueryPlan, View, World, colours, touched};
use glam::Vec3;

/// A picture beside its photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedPhotograph {
    /// Linear radiance; NaN where the object does not fill the pixel.
    pub rgb: Vec<[f32; 3]>,
}

/// Renders the object of a photograph in direct light, with a constant `stray_light` on it, through the photograph's own camera.
///
/// # Errors
/// Those of the filter.
pub fn render(
    photograph: &Photograph,
    material: &Material,
    small: &SmallScale,
    opaque: bool,
    stray_light: [f64; 3],
    control: &Control<'_>,
) -> Result<RenderedPhotograph> {
    let scene = scene_of(photograph, material, small);
    let world = World::opaque(&scene);
    let sights = sights(&world, photograph);
    let (width, height) = (photograph.image.width, photograph.image.height);
    let mut view = View { rows: 0..height, behind: vec![[0.0; 3]; (width * height) as usize], ..View::default() };
    for sight in &sights {
        if sight.lit {
            let scale = match photograph.light {
                Light::Directional { .. } => 1.0,
                Light::Point { position, .. } => narrow(1.0 / position.distance_squared(sight.position)),
            };
            view.lit.push(Lit { wi: sight.wi.as_vec3(), scale, light: 0 });
        }
        let end = u32::try_from(view.lit.len()).expect("a photograph has fewer pixels");
        view.points.push(Point { pixel: sight.pixel, material: 0, wo: sight.wo.as_vec3(), weight: 1.0, tint: [1.0; 3], end });
    }
    let lit: Vec<&Sight> = sights.iter().filter(|s| s.lit).collect();
    let mut rgb = vec![[f32::NAN; 3]; (width * height) as usize];
    let shaded = if lit.is_empty() {
        view.behind.clone()
    } else {
        let probes: Vec<(Vec3, Vec3)> =
            lit.iter().step_by(lit.len().div_ceil(PARAMS.probes)).map(|s| (s.wi.as_vec3(), s.wo.as_vec3())).collect();
        // Whatever the material says: what it reflects more than once is traced by itself.
        let quality = Quality { tolerance: PARAMS.tolerance, bounces: Some(0), ..Quality::default() };
        let plan = QueryPlan::find(small, opaque, &probes, &quality, control)?;
        let grid = biscale::table::HemisphereGrid::new(plan.rings);
        let keys = touched(&view, &[Some(grid)]).swap_remove(0);
        let tables = [Some(plan.table(small, keys, &quality, control)?)];
        Frame::new(&view, &tables, width).shade(&tables, &colours(&[photograph.light]))
    };
    for sight in &sights {
        let at = sight.pixel as usize;
        rgb[at] = std::array::from_fn(|c| shaded[at][c] + narrow(stray_light[c]));
    }
    Ok(RenderedPhotograph { rgb })
}
