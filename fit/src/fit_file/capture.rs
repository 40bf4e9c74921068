//! Photographs from the folder that `biscale capture` wrote (`docs/capture-format.md`).

use crate::photograph::image::{Image, LIGHT_SIGMA_DEG, Photograph, Pinhole, Role};
use biscale::error::{BadInput, Result};
use biscale::formats::capture::{self, Capture, Sample, Severity};
use biscale::render::{Cylinder, Light, Object, Plane, Shape};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::path::Path;

/// Reads the photographs of a folder. Those without a pose or a light are left out, with a note; `sigma` replaces the standard deviations of
/// the lights.
///
/// # Errors
/// Bad input; a capture that is not usable.
pub fn photographs(folder: &Path, sigma: Option<f64>, notes: &mut Vec<String>) -> Result<Vec<Photograph>> {
    let capture = Capture::read(folder)?;
    let folder = if folder.is_dir() { folder } else { folder.parent().unwrap_or(Path::new("")) };
    let bad = |problem: String, remedy: &str| BadInput::new(problem, remedy).in_file(&folder.join(capture::FILE_NAME));
    if !capture.usable {
        let failed: Vec<&str> = capture.checks.iter().filter(|c| c.severity == Severity::Fail).map(|c| &*c.message).collect();
        return Err(bad(format!("the capture is not usable: {}", failed.join("; ")), "photograph again what failed").into());
    }
    let Some(camera) = &capture.camera else {
        return Err(bad("the capture has no camera".into(), "calibrate it, or give it in the shoot file").into());
    };
    let object = object(&capture.sample);
    let mut found = Vec::new();
    for photograph in &capture.photographs {
        let role = match &*photograph.role {
            "close-up" => Role::CloseUp,
            "distant" => Role::Distant,
            "validation" => Role::Validation,
            other => {
                return Err(
                    bad(format!("the role \"{other}\" of {} is not known", photograph.file), "capture again with this version").into()
                );
            }
        };
        let Some(pose) = &photograph.pose else {
            notes.push(format!("{}: its pose is not known: it is left out", photograph.file));
            continue;
        };
        let light = photograph.light.as_ref().and_then(|name| capture.lights.iter().find(|l| l.name == *name));
        let Some(light) = light else {
            notes.push(format!("{}: its light is not known: it is left out", photograph.file));
            continue;
        };
        // Rows of the rotation are the camera's axes right, down and forward in the sample's frame.
        let [right, down, forward] = pose.rotation.map(DVec3::from);
        let axes = DMat3::from_cols(right, -down, forward);
        let origin = -(DMat3::from_cols(right, down, forward) * DVec3::from(pose.translation_mm));
        let file = folder.join(&photograph.file);
        let image = Image::load(&file, Some(&folder.join(&photograph.mask)))?;
        if (image.width, image.height) != (camera.width, camera.height) {
            let problem = format!(
                "{} has {} x {} pixels, the camera {} x {}",
                photograph.file, image.width, image.height, camera.width, camera.height
            );
            return Err(bad(problem, "capture again").into());
        }
        // A pixel's centre has whole coordinates there, and half ones here.
        let camera = Pinhole { origin, axes, focal: [camera.fx, camera.fy], centre: [camera.cx + 0.5, camera.cy + 0.5] };
        let to_light = DVec3::from(light.direction);
        let Some(to_light) = to_light.try_normalize() else {
            return Err(bad(format!("the light \"{}\" has no direction", light.name), "capture again").into());
        };
        found.push(Photograph {
            file,
            role,
            image,
            camera,
            light: Light::Directional { to_light, irradiance: light.irradiance_rgb.unwrap_or([PI; 3]) },
            light_sigma_deg: sigma.unwrap_or_else(|| if light.sigma_deg > 0.0 { light.sigma_deg.max(0.2) } else { LIGHT_SIGMA_DEG }),
            exposure_known: light.irradiance_rgb.is_some(),
            object: object.clone(),
            noise: Some([photograph.noise.a, photograph.noise.b]),
        });
    }
    Ok(found)
}

fn object(sample: &Sample) -> Object {
    let (label, shape) = match *sample {
        Sample::Plane { width_mm, height_mm } => {
            ("plane", Shape::Plane(Plane { center: DVec3::ZERO, frame: DMat3::IDENTITY, size: [width_mm, height_mm] }))
        }
        Sample::Cylinder { radius_mm, height_mm, .. } => {
            ("cylinder", Shape::Cylinder(Cylinder { center: DVec3::ZERO, radius: radius_mm, height: height_mm, axis: DVec3::Z }))
        }
    };
    Object { label: label.to_owned(), shape, materials: vec![0], turn: 0.0, two_sided: false, periods_per_unit: None }
}
