//! Photographs from the folder that `biscale capture` wrote (`docs/capture-format.md`).

use crate::photograph::image::{Image, LIGHT_SIGMA_DEG, Photograph, Pinhole, Role};
use biscale::error::{BadInput, Error, Result};
use biscale::formats::capture::{
    self, Camera as CaptureCamera, Capture, Light as CaptureLight, Photograph as Shot, Pose, Sample, Severity,
};
use biscale::render::{Covering, Cylinder, Light, Object, Plane, Shape};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;
use std::path::Path;

/// Least standard deviation of a light's direction, degrees: no capture knows a light better than its lamp is wide. Chosen, not measured.
const LEAST_SIGMA_DEG: f64 = 0.2;

/// Reads the photographs of a folder. Those without a pose or a light are left out, with a note; `sigma` replaces the standard deviations of
/// the lights, degrees.
///
/// # Errors
/// Bad input; a capture that is not usable.
pub fn photographs(folder: &Path, sigma: Option<f64>, notes: &mut Vec<String>) -> Result<Vec<Photograph>> {
    let capture = Capture::read(folder)?;
    let folder = if folder.is_dir() { folder } else { folder.parent().unwrap_or(Path::new("")) };
    let reader = CaptureReader { folder, camera: usable_camera(&capture, folder)?, object: object(&capture.sample), sigma };
    let mut found = Vec::new();
    for shot in &capture.photographs {
        let role = reader.role(shot)?;
        let Some(pose) = &shot.pose else {
            notes.push(format!("{}: its pose is not known: it is left out", shot.file));
            continue;
        };
        let Some(light) = shot.light.as_ref().and_then(|name| capture.lights.iter().find(|l| l.name == *name)) else {
            notes.push(format!("{}: its light is not known: it is left out", shot.file));
            continue;
        };
        found.push(reader.photograph(shot, role, pose, light)?);
    }
    Ok(found)
}

/// Bad input in the capture file of a folder.
fn bad_capture(folder: &Path, problem: String, remedy: &str) -> BadInput {
    BadInput::new(problem, remedy).in_file(&folder.join(capture::FILE_NAME))
}

/// The camera of a capture that is usable.
fn usable_camera<'a>(capture: &'a Capture, folder: &Path) -> Result<&'a CaptureCamera> {
    if !capture.usable {
        let failed: Vec<&str> = capture.checks.iter().filter(|c| c.severity == Severity::Fail).map(|c| &*c.message).collect();
        let problem = format!("the capture is not usable: {}", failed.join("; "));
        return Err(bad_capture(folder, problem, "photograph again what failed").into());
    }
    let no_camera = || bad_capture(folder, "the capture has no camera".into(), "calibrate it, or give it in the shoot file").into();
    capture.camera.as_ref().ok_or_else(no_camera)
}

/// What the photographs of a folder have in common.
struct CaptureReader<'a> {
    folder: &'a Path,
    camera: &'a CaptureCamera,
    object: Object,
    /// Standard deviation of all lights, degrees, if the fit file gives one.
    sigma: Option<f64>,
}

impl CaptureReader<'_> {
    fn bad(&self, problem: String, remedy: &str) -> Error {
        bad_capture(self.folder, problem, remedy).into()
    }

    /// The camera of a photograph: its own, where it was taken through another lens than the rest.
    fn camera<'b>(&'b self, shot: &'b Shot) -> &'b CaptureCamera {
        shot.camera.as_ref().unwrap_or(self.camera)
    }

    fn role(&self, shot: &Shot) -> Result<Role> {
        match &*shot.role {
            "close-up" => Ok(Role::CloseUp),
            "distant" => Ok(Role::Distant),
            "validation" => Ok(Role::Validation),
            other => Err(self.bad(format!("the role \"{other}\" of {} is not known", shot.file), "capture again with this version")),
        }
    }

    fn photograph(&self, shot: &Shot, role: Role, pose: &Pose, light: &CaptureLight) -> Result<Photograph> {
        let file = self.folder.join(&shot.file);
        let image = self.image(shot, &file)?;
        let Some(to_light) = DVec3::from(light.direction).try_normalize() else {
            return Err(self.bad(format!("the light \"{}\" has no direction", light.name), "capture again"));
        };
        let irradiance = light.irradiance_rgb.unwrap_or([PI; 3]);
        let own_sigma = if light.sigma_deg > 0.0 { light.sigma_deg.max(LEAST_SIGMA_DEG) } else { LIGHT_SIGMA_DEG };
        Ok(Photograph {
            file,
            role,
            image,
            camera: pinhole(self.camera(shot), pose),
            light: light_of(to_light, irradiance, light.position_mm.map(DVec3::from)),
            light_sigma_deg: self.sigma.unwrap_or(own_sigma),
            exposure_known: light.irradiance_rgb.is_some(),
            stated_irradiance_sigma: None,
            object: self.object.clone(),
            noise: Some([shot.noise.a, shot.noise.b]),
        })
    }

    /// The pixels of a photograph, which must be as many as the camera's.
    fn image(&self, shot: &Shot, file: &Path) -> Result<Image> {
        let image = Image::load(file, Some(&self.folder.join(&shot.mask)))?;
        let camera = self.camera(shot);
        if (image.width, image.height) != (camera.width, camera.height) {
            let problem =
                format!("{} has {} x {} pixels, the camera {} x {}", shot.file, image.width, image.height, camera.width, camera.height);
            return Err(self.bad(problem, "capture again"));
        }
        Ok(image)
    }
}

/// A lamp far away, or one that stands at `position` and gives its irradiance at the origin.
fn light_of(to_light: DVec3, irradiance: [f64; 3], position: Option<DVec3>) -> Light {
    match position {
        Some(position) => Light::Point { position, intensity: irradiance.map(|e| e * position.length_squared()) },
        None => Light::Directional { to_light, irradiance },
    }
}

/// The camera in the sample's frame.
fn pinhole(camera: &CaptureCamera, pose: &Pose) -> Pinhole {
    // Rows of the rotation are the camera's axes right, down and forward in the sample's frame.
    let [right, down, forward] = pose.rotation.map(DVec3::from);
    let axes = DMat3::from_cols(right, -down, forward);
    let origin = -(DMat3::from_cols(right, down, forward) * DVec3::from(pose.translation_mm));
    // A pixel's centre has whole coordinates there, and half ones here.
    Pinhole { origin, axes, focal: [camera.fx, camera.fy], centre: [camera.cx + 0.5, camera.cy + 0.5] }
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
    Object {
        label: label.to_owned(),
        shape,
        materials: vec![0],
        turn: 0.0,
        two_sided: false,
        periods_per_unit: None,
        covering: Covering::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_whose_place_is_known_shines_from_there_with_its_irradiance_at_the_origin() {
        let to_light = DVec3::new(0.0, 0.6, 0.8);
        assert_eq!(light_of(to_light, [2.0; 3], None), Light::Directional { to_light, irradiance: [2.0; 3] });
        let lamp = light_of(to_light, [2.0, 3.0, 4.0], Some(500.0 * to_light));
        let Light::Point { position, intensity } = lamp else { panic!("{lamp:?}") };
        assert_eq!(position, DVec3::new(0.0, 300.0, 400.0));
        assert_eq!(intensity.map(|i| i / 250_000.0), [2.0, 3.0, 4.0]);
    }
}
