//! A whole shoot: every photograph read, measured, checked and written.

mod calibration;
mod cameras;
mod close_up;
mod colours;
mod flat_fields;
mod lights;
mod read;
mod register;
mod samples;
mod session;
mod turned;
mod write;

pub use session::RunOptions;

use self::session::{CameraSettings, Session, name_of};
use crate::checks::{CheckCode, Checks, Reading, SAME_LIGHT_DEG};
use crate::report::Report;
use crate::shoot::{Role, Shape, Shoot};
use biscale::error::Result;
use biscale::filter::Control;
use biscale::formats::capture::{CREATOR, Capture, FORMAT, Light, Photograph, Sample, Severity};
use std::collections::BTreeMap;
use std::path::Path;

/// Does all of a shoot. Files appear in `folder`, which must be there: `capture.json`, `report.html`, and those that `docs/capture-format.md` lists.
///
/// Bad photographs are no error: they are told in `checks`, and what rests on them is missing.
///
/// # Errors
/// I/o, an interruption, and what `OpenCV` says of something unforeseen.
pub fn run(shoot: &Shoot, options: &RunOptions, folder: &Path, control: &Control<'_>) -> Result<Capture> {
    crate::vision::set_threads(options.threads)?;
    let all = shoot.photos.iter().map(|p| p.files.len()).sum();
    let mut session = Session {
        shoot,
        options,
        control,
        folder,
        checks: Checks::default(),
        report: Report::default(),
        groups: Vec::new(),
        settings: CameraSettings::default(),
        colours: None,
        brightness: BTreeMap::new(),
        done: 0,
        all,
    };
    session.cameras()?;
    session.flat_fields()?;
    let colour = session.colour()?;
    let mut lights = session.lights()?;
    session.irradiance(&mut lights);
    let made = session.samples(&lights)?;
    session.compare_lights(&made.photographs, &lights);
    session.settings_checks();
    let (camera, main, photographs) = session.written_cameras(made.photographs);
    let flat_field = session.written_flat(main);
    let capture = Capture {
        creator: format!("{CREATOR} {}", env!("CARGO_PKG_VERSION")),
        format: FORMAT,
        name: shoot.name.clone(),
        shoot: name_of(&shoot.file),
        usable: session.checks.worst() < Severity::Fail,
        camera,
        sample: sample(&shoot.sample.shape),
        lights,
        photographs,
        colour,
        flat_field,
        close_up: made.close_up,
        material: made.material,
        checks: std::mem::take(&mut session.checks.0),
    };
    session.report.write(&capture, folder)?;
    write::json(&capture, folder)?;
    Ok(capture)
}

fn sample(shape: &Shape) -> Sample {
    match *shape {
        Shape::Plane(size) => Sample::Plane { width_mm: size.x, height_mm: size.y },
        Shape::Cylinder { radius, height, arc_deg } => Sample::Cylinder { radius_mm: radius, height_mm: height, arc_deg },
    }
}

impl Session<'_> {
    /// The validation photograph must be under another light.
    fn compare_lights(&mut self, photographs: &[Photograph], lights: &[Light]) {
        let direction = |name: &Option<String>| {
            let light = lights.iter().find(|l| Some(&l.name) == name.as_ref())?;
            Some(glam::DVec3::from(light.direction))
        };
        let validation = Role::Validation.name();
        for photo in photographs.iter().filter(|p| p.role == validation) {
            let Some(own) = direction(&photo.light) else { continue };
            let others = photographs.iter().filter(|p| p.role == Role::Distant.name()).filter_map(|p| direction(&p.light));
            let Some(nearest) = others.map(|o| o.angle_between(own).to_degrees()).min_by(f64::total_cmp) else { continue };
            let least = SAME_LIGHT_DEG;
            let (severity, message) = if nearest < least {
                (
                    Severity::Warn,
                    "its light is that of the distant photograph: it proves nothing about other lights; move the lamp and repeat it",
                )
            } else {
                (Severity::Ok, "its light differs from that of the distant photograph")
            };
            self.checks.valued(CheckCode::SameLight, severity, Reading::of(&photo.sources[0], nearest, "degrees"), least, message);
        }
    }
}
