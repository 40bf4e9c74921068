//! A picture of a scene, lit as the scene asks: by lights alone, or with its environment as a whole.

use super::compare::difference;
use super::environment_lighting::{EnvironmentLit, EnvironmentReport, LEAST_TOLERANCE, PictureError};
use super::light_sampling::light_sampling;
use super::renderer::{LightSampling, Rendered, render_lights};
use super::scene::{Lighting, Scene};
use crate::error::{Error, Result};
use crate::filter::{Control, Quality, keeps};
use crate::numerics::words::percent;
use std::borrow::Cow;

/// Share of the progress that the pictures make which tell the error of the lights. Chosen, not measured.
const SAMPLING_PROGRESS: f64 = 0.15;
/// Pixels across of the small picture whose error is measured.
const SMALL_WIDTH: u32 = 24;
/// Lights of each of the two pictures that it is compared with.
const SMALL_LIGHTS: u32 = 512;

/// Renders a scene.
///
/// The same scene and quality give the same bits at any thread count.
///
/// # Errors
/// [`Error::Unsupported`] for a budget, [`Error::Interrupted`] when `control` asks to stop, those of the filter.
///
/// ```
/// use biscale::render::{Scene, render};
/// use biscale::toml_reader::Source;
/// use biscale::{Control, Quality};
///
/// // `Scene::load` reads a file; paths in it are relative to its folder.
/// let text = r#"
/// format = 1
/// camera = { origin = [0, -6, 0], target = [0, 0, 0], fov_deg = 24, width = 8, height = 8, samples = 1 }
/// light = [{ type = "directional", to_light = [-1, -2, 1], irradiance_rgb = 3 }]
/// object = [{ kind = "sphere", radius = 1, material = "v-grooves.toml" }]
/// "#;
/// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/scene.toml").into();
/// let scene = Scene::parse(&Source { path, text: text.to_owned() })?;
/// let quality = Quality { tolerance: 0.1, ..Quality::default() };
/// let picture = render(&scene, &quality, &Control::quiet())?.picture;
/// assert_eq!(picture.rgb.len(), 64);
/// // The ball covers the middle and not the corner, and the light meets its grooves.
/// assert_eq!((picture.alpha[4 * 8 + 4], picture.alpha[0]), (1.0, 0.0));
/// assert!(picture.rgb[4 * 8 + 3][0] > 0.0);
/// # Ok::<(), biscale::Error>(())
/// ```
pub fn render(scene: &Scene, quality: &Quality, control: &Control<'_>) -> Result<Rendered> {
    let begun = (control.clock)();
    let sampling = control.part(0.0..SAMPLING_PROGRESS, |control| light_sampling(scene, quality, control))?;
    let sampled = (control.clock)();
    let scene = &with_lights(scene, sampling);
    let share = if sampling.is_some() { SAMPLING_PROGRESS } else { 0.0 };
    let mut rendered = control.part(share..1.0, |control| render_lights(scene, quality, control))?;
    if let Some(sampling) = sampling {
        rendered.stages.insert(0, ("light sampling", 1e3 * (sampled - begun)));
        rendered.notes.extend(sampling_note(&sampling, quality));
        rendered.light_sampling = Some(sampling);
    }
    if scene.environment.as_ref().is_some_and(|e| e.lighting == Lighting::SphericalGaussians) {
        let lit = EnvironmentLit::new(scene, quality, control)?;
        rendered.stages.extend(&lit.stages);
        let begun = (control.clock)();
        lit.add_to(&mut rendered.picture, quality.seed, control)?;
        let shaded = (control.clock)();
        rendered.stages.push(("environment", 1e3 * (shaded - begun)));
        let error = picture_error(&lit, scene, quality, control)?;
        rendered.stages.push(("comparison", 1e3 * ((control.clock)() - shaded)));
        rendered.notes.extend(notes(scene, &lit, quality));
        rendered.environment = Some(EnvironmentReport { sites: lit.sites(), bytes: lit.bytes(), responses: lit.reports(), error });
    }
    if rendered.picture.rgb.iter().flatten().any(|v| !v.is_finite()) {
        return Err(Error::Numeric("a pixel is not finite; please report this, with the scene".to_owned()));
    }
    Ok(rendered)
}

/// The scene with the number of lights that was found for its environment.
fn with_lights(scene: &Scene, sampling: Option<LightSampling>) -> Cow<'_, Scene> {
    match sampling.filter(|s| s.chosen) {
        Some(LightSampling { lights, .. }) => {
            let mut scene = scene.clone();
            scene.environment.iter_mut().for_each(|e| e.lights = Some(lights));
            Cow::Owned(scene)
        }
        None => Cow::Borrowed(scene),
    }
}

/// What the user should know of lights that miss the tolerance.
fn sampling_note(sampling: &LightSampling, quality: &Quality) -> Option<String> {
    let LightSampling { lights, relative_rms, .. } = *sampling;
    (!keeps(relative_rms, quality.tolerance)).then(|| {
        format!(
            "{lights} lights stand for the environment, which makes an error of {} that the tolerance does not cover: more `lights` in \
             [environment] make it smaller, `lighting = \"sg\"` draws none",
            percent(relative_rms)
        )
    })
}

/// How far pictures of the scene's view by `lit` are off.
fn picture_error(lit: &EnvironmentLit<'_>, scene: &Scene, quality: &Quality, control: &Control<'_>) -> Result<Option<PictureError>> {
    let mut small = scene.clone();
    small.camera.height = (SMALL_WIDTH * scene.camera.height / scene.camera.width).max(1);
    small.camera.width = SMALL_WIDTH;
    small.camera.samples = 1;
    small.lights.clear();
    if let Some(surroundings) = &mut small.environment {
        surroundings.lighting = Lighting::Sampled;
        surroundings.lights = Some(SMALL_LIGHTS);
    }
    let picture = lit.frame(&small.camera);
    let shown = |rgb: &[[f32; 3]]| -> Vec<[f32; 3]> {
        rgb.iter().zip(&picture.alpha).filter(|(_, alpha)| **alpha > 0.0).map(|(rgb, _)| *rgb).collect()
    };
    let ours = shown(&picture.rgb);
    if ours.is_empty() {
        return Ok(None);
    }
    let sampled = |seed: u64| -> Result<Vec<[f32; 3]>> {
        let tolerance = quality.tolerance.max(LEAST_TOLERANCE);
        let quality = Quality { tolerance, seed: quality.seed.wrapping_add(seed), ..quality.clone() };
        Ok(shown(&render_lights(&small, &quality, control)?.picture.rgb))
    };
    let (first, second) = (sampled(1)?, sampled(2)?);
    let mean: Vec<[f32; 3]> = first.iter().zip(&second).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
    Ok(Some(PictureError {
        lights: 2 * SMALL_LIGHTS,
        pixels: ours.len(),
        relative_rms: difference(&mean, &ours, None).relative_rms,
        noise: 0.5 * difference(&first, &second, None).relative_rms,
    }))
}

/// What the user should know.
fn notes(scene: &Scene, lit: &EnvironmentLit<'_>, quality: &Quality) -> Vec<String> {
    let tolerance = quality.tolerance.max(LEAST_TOLERANCE);
    let missed = scene.materials.iter().zip(lit.reports()).filter(|(_, r)| r.relative_rms() > tolerance).map(|(material, report)| {
        let error = report.relative_rms();
        format!(
            "{}: its response to the environment has a relative RMS error of {}, over {}, on the finest grids",
            material.material.name,
            percent(error),
            percent(tolerance)
        )
    });
    missed.collect()
}
