//! How many directional lights stand for an environment that is sampled, and how far off a picture is by them.
//!
//! Small pictures of the view, whose lights are drawn apart, spread about their mean by the error of one. All pixels share the lights of a picture and err
//! together, so it is the number of pictures that tells how well the spread is known, and a tolerance is kept with the margin of all estimated errors ([`keeps`]).
//! Errors of few lights fall at least as fast as one over the root of their number.

use super::environment_lighting::LEAST_TOLERANCE;
use super::renderer::{LightSampling, render_lights};
use super::scene::{LEAST_LIGHTS, Lighting, Scene};
use crate::error::Result;
use crate::filter::{Control, Quality, SAFETY, keeps};
use crate::numerics::cast::truncate_u32;
use std::ops::Range;

/// Pixels across of the small pictures. Chosen, not measured.
const SMALL_WIDTH: u32 = 48;
/// Small pictures: a standard deviation of four degrees of freedom is within a half of the true one in 85 % of cases, were all pixels one.
const PICTURES: u16 = 5;
/// Lights where a scene names no number, at most. Chosen, not measured: a picture takes longer with each.
pub const MOST_LIGHTS: u32 = 128;

/// The number of lights that stand for a scene's environment, and their error; none where no environment is sampled, or where the camera sees no object.
///
/// # Errors
/// Those of [`render_lights`].
pub fn light_sampling(scene: &Scene, quality: &Quality, control: &Control<'_>) -> Result<Option<LightSampling>> {
    let Some(surroundings) = scene.environment.as_ref().filter(|e| e.lighting == Lighting::Sampled) else { return Ok(None) };
    let chosen = surroundings.lights.is_none();
    let look = |share: Range<f64>, lights: u32| -> Result<Option<LightSampling>> {
        let found = control.part(share, |control| error_of(scene, lights, quality, control))?;
        Ok(found.map(|(relative_rms, pixels)| LightSampling { lights, chosen, relative_rms, pixels }))
    };
    let is_enough = |found: &LightSampling| !chosen || found.lights >= MOST_LIGHTS || keeps(found.relative_rms, quality.tolerance);
    let Some(first) = look(0.0..0.2, surroundings.lights.unwrap_or(LEAST_LIGHTS))? else { return Ok(None) };
    if is_enough(&first) {
        return Ok(Some(first));
    }
    let needed = f64::from(first.lights) * (SAFETY * first.relative_rms / quality.tolerance).powi(2);
    // Few pictures tell the error roughly, so it is measured again; where it does not do, as many lights are taken as there may be.
    match look(0.2..0.5, truncate_u32(needed.ceil().min(MOST_LIGHTS.into())))? {
        Some(second) if !is_enough(&second) => look(0.5..1.0, MOST_LIGHTS),
        second => Ok(second),
    }
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
    let shown = |seed: u64, control: &Control<'_>| -> Result<(Vec<[f32; 3]>, Vec<f32>)> {
        let tolerance = quality.tolerance.max(LEAST_TOLERANCE);
        // In direct light: what is reflected more than once, which takes long, depends less on where a light stands.
        let quality = Quality { tolerance, seed: quality.seed.wrapping_add(seed), bounces: Some(0), ..quality.clone() };
        let picture = render_lights(&small, &quality, control)?.picture;
        Ok((picture.rgb, picture.alpha))
    };
    let part = |k: u16| f64::from(k) / f64::from(PICTURES);
    let pictures: Vec<_> =
        (0..PICTURES).map(|k| control.part(part(k)..part(k + 1), |control| shown(1 + u64::from(k), control))).collect::<Result<_>>()?;
    // Where rays pass a surface, which pixels show it may depend on the seed: what none shows is left out.
    let seen: Vec<usize> = (0..pictures[0].1.len()).filter(|&k| pictures.iter().any(|(_, alpha)| alpha[k] > 0.0)).collect();
    let (mut squares, mut energy) = (0.0, 0.0);
    for &k in &seen {
        for c in 0..3 {
            let values = || pictures.iter().map(|(rgb, _)| f64::from(rgb[k][c]));
            let mean = values().sum::<f64>() / f64::from(PICTURES);
            squares += values().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(PICTURES - 1);
            energy += mean * mean;
        }
    }
    let error = if energy > 0.0 { (squares / energy).sqrt() } else { squares.sqrt() };
    Ok((!seen.is_empty()).then_some((error, seen.len())))
}
