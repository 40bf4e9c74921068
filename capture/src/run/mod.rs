//! A whole shoot: every photograph read, measured, checked and written.

mod calibration;
mod close_up;
mod colours;
mod lights;
mod read;
mod samples;
mod write;

use crate::checks::{Checks, Code};
use crate::colour::Correction;
use crate::flat::Flat;
use crate::lens::Lens;
use crate::noise::Sensor;
use crate::report::Report;
use crate::shoot::{Role, Shape, Shoot};
use biscale::error::Result;
use biscale::filter::Control;
use biscale::formats::capture::{CREATOR, Capture, FORMAT, Light, Sample, Severity};
use biscale::geometry::weave::draft::Draft;
use std::collections::BTreeMap;
use std::path::Path;

/// What the caller wants.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Take 8-bit values, and values of a file that names sRGB, as sRGB.
    pub assume_srgb: bool,
    /// The draft of the close-up's weave, where it is known.
    pub draft: Option<Draft>,
    /// Threads for `OpenCV`; 0 for all.
    pub threads: u16,
}

/// Everything that is known so far.
struct Session<'a> {
    shoot: &'a Shoot,
    options: &'a Options,
    control: &'a Control<'a>,
    /// Where files are written.
    folder: &'a Path,
    checks: Checks,
    report: Report,
    /// Size of all photographs: that of the first one.
    size: Option<(usize, usize)>,
    settings: read::Settings,
    lens: Option<Lens>,
    flat: Option<Flat>,
    sensor: Option<Sensor>,
    colours: Option<colours::Colours>,
    /// Light that checkers were under, and how bright it is relative to the first checker's.
    brightness: BTreeMap<String, f64>,
    /// Photographs done, and how many there are.
    done: usize,
    all: usize,
}

/// Does all of a shoot. Files appear in `folder`, which must be there: `capture.json`, `report.html`, and those that `docs/capture-format.md` lists.
///
/// Bad photographs are no error: they are told in `checks`, and what rests on them is missing.
///
/// # Errors
/// I/o, an interruption, and what `OpenCV` says of something unforeseen.
pub fn run(shoot: &Shoot, options: &Options, folder: &Path, control: &Control<'_>) -> Result<Capture> {
    crate::vision::set_threads(options.threads)?;
    let all = shoot.photos.iter().map(|p| p.files.len()).sum();
    let mut session = Session {
        shoot,
        options,
        control,
        folder,
        checks: Checks::default(),
        report: Report::default(),
        size: None,
        settings: read::Settings::default(),
        lens: None,
        flat: None,
        sensor: None,
        colours: None,
        brightness: BTreeMap::new(),
        done: 0,
        all,
    };
    let camera = session.camera()?;
    let flat_field = session.flat_field()?;
    let colour = session.colour()?;
    let mut lights = session.lights()?;
    session.irradiance(&mut lights);
    let made = session.samples(&lights)?;
    session.compare_lights(&made.photographs, &lights);
    session.settings_checks();
    let capture = Capture {
        creator: format!("{CREATOR} {}", env!("CARGO_PKG_VERSION")),
        format: FORMAT,
        name: shoot.name.clone(),
        shoot: name_of(&shoot.file),
        usable: session.checks.worst() < Severity::Fail,
        camera,
        sample: sample(&shoot.sample.shape),
        lights,
        photographs: made.photographs,
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

/// A file's own name, for reports.
fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

impl Session<'_> {
    /// One more photograph is done; stops if the caller wants.
    fn step(&mut self, stage: &str) -> Result<()> {
        self.done += 1;
        (self.control.progress)(stage, self.done as f64 / self.all.max(1) as f64);
        self.control.check()
    }

    /// The validation photograph must be under another light.
    fn compare_lights(&mut self, photographs: &[biscale::formats::capture::Photograph], lights: &[Light]) {
        let direction = |name: &Option<String>| {
            let light = lights.iter().find(|l| Some(&l.name) == name.as_ref())?;
            Some(glam::DVec3::from(light.direction))
        };
        let validation = Role::Validation.name();
        for photo in photographs.iter().filter(|p| p.role == validation) {
            let Some(own) = direction(&photo.light) else { continue };
            let others = photographs.iter().filter(|p| p.role == Role::Distant.name()).filter_map(|p| direction(&p.light));
            let Some(nearest) = others.map(|o| o.angle_between(own).to_degrees()).min_by(f64::total_cmp) else { continue };
            let least = crate::checks::SAME_LIGHT_DEG;
            let (severity, message) = if nearest < least {
                (
                    Severity::Warn,
                    "its light is that of the distant photograph: it proves nothing about other lights; move the lamp and repeat it",
                )
            } else {
                (Severity::Ok, "its light differs from that of the distant photograph")
            };
            self.checks.valued(Code::SameLight, severity, Some(&photo.sources[0]), nearest, least, "degrees", message);
        }
    }
}

/// The correction of a shoot.
impl Session<'_> {
    fn matrix(&self) -> Option<&Correction> {
        self.colours.as_ref().map(|c| &c.correction)
    }
}
