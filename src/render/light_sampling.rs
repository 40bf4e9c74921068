//! How many directional lights stand for an environment that is sampled, and how far off a picture is by them.
//!
//! Two small pictures of the view, whose lights are drawn apart, differ by the error of both: over the root of two it is that of one.
//! Errors of few lights fall at least as fast as one over the root of their number.

use super::compare::difference;
use super::environment_lighting::LEAST_TOLERANCE;
use super::renderer::{LightSampling, render_lights};
use super::scene::{LEAST_LIGHTS, Lighting, Scene};
use crate::error::Result;
use crate::filter::{Control, Quality};
use crate::numerics::cast::truncate_u32;

/// Pixels across of the small pictures. Chosen, not measured: about 1,000 pixels of objects tell an RMS to a few per cent.
const SMALL_WIDTH: u32 = 48;
/// Lights where a scene names no number, at most: 460 lights take 13 times as long as 32 (`samples/scenes/cup.toml` without `lights`, tolerance .03). Chosen, not measured.
pub const MOST_LIGHTS: u32 = 128;

/// The number of lights that stand for a scene's environment, and their error; none where no environment is sampled, or where the camera sees no object.
///
/// # Errors
/// Those of [`render_lights`].
pub fn light_sampling(scene: &Scene, quality: &Quality, control: &Control<'_>) -> Result<Option<LightSampling>> {
    let Some(surroundings) = scene.environment.as_ref().filter(|e| e.lighting == Lighting::Sampled) else { return Ok(None) };
    let least = surroundings.lights.unwrap_or(LEAST_LIGHTS);
    let first = control.part(0.0..0.3, |control| error_of(scene, least, quality, control))?;
    let Some((error, pixels)) = first else { return Ok(None) };
    let chosen = surroundings.lights.is_none();
    let enough = f64::from(least) * (error / quality.tolerance).powi(2);
    if !chosen || enough <= f64::from(least) {
        return Ok(Some(LightSampling { lights: least, chosen, relative_rms: error, pixels }));
    }
    let lights = truncate_u32(enough.ceil().min(MOST_LIGHTS.into()));
    let found = control.part(0.3..1.0, |control| error_of(scene, lights, quality, control))?;
    Ok(found.map(|(relative_rms, pixels)| LightSampling { lights, chosen, relative_rms, pixels }))
}

/// Relative RMS error by so many lights, and the pixels that tell it.
fn error_of(scene: &Scene, lights: u32, quality: &Quality, control: &Control<'_>) -> Result<Option<(f64, usize)>> {
    let mut small = scene.clone();
    small.camera.height = (SMALL_WIDTH * scene.camera.height / scene.camera.width).max(1);
    small.camera.width = SMALL_WIDTH;
    small.camera.samples = 1;
    if let Some(surroundings) = &mut small.environment {
        surroundings.lights = Some(lights);
    }
    let shown = |seed: u64, control: &Control<'_>| -> Result<Vec<[f32; 3]>> {
        let tolerance = quality.tolerance.max(LEAST_TOLERANCE);
        let quality = Quality { tolerance, seed: quality.seed.wrapping_add(seed), ..quality.clone() };
        let picture = render_lights(&small, &quality, control)?.picture;
        Ok(picture.rgb.iter().zip(&picture.alpha).filter(|(_, alpha)| **alpha > 0.0).map(|(rgb, _)| *rgb).collect())
    };
    let first = control.part(0.0..0.5, |control| shown(1, control))?;
    let second = control.part(0.5..1.0, |control| shown(2, control))?;
    // Where rays pass a surface, which pixels show it depends on the seed.
    if first.is_empty() || first.len() != second.len() {
        return Ok(None);
    }
    Ok(Some((difference(&first, &second, None).relative_rms / 2.0_f64.sqrt(), first.len())))
}
