//! What is known so far of a shoot: every stage reads what earlier ones wrote.

use crate::checks::Checks;
use crate::colour::Correction;
use crate::flat::Falloff;
use crate::lens::Lens;
use crate::lens_group::LensKey;
use crate::noise::SensorNoise;
use crate::report::Report;
use crate::shoot::Shoot;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::formats::capture::Camera;
use biscale::geometry::weave::Draft;
use glam::DVec2;
use std::collections::BTreeMap;
use std::path::Path;

/// What the caller wants.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Take 8-bit values, and values of a file that names sRGB, as sRGB.
    pub assume_srgb: bool,
    /// The draft of the close-up's weave, where it is known.
    pub draft: Option<Draft>,
    /// Threads for `OpenCV`; 0 for all.
    pub threads: u16,
}

/// Everything that is known so far.
pub(super) struct Session<'a> {
    pub shoot: &'a Shoot,
    pub options: &'a RunOptions,
    pub control: &'a Control<'a>,
    /// Where files are written.
    pub folder: &'a Path,
    pub checks: Checks,
    pub report: Report,
    /// Photographs through one lens at one size: the first is that of the first photograph that was read.
    pub groups: Vec<LensGroup>,
    pub settings: CameraSettings,
    pub colours: Option<CheckerColour>,
    /// Light that checkers were under, and how bright it is relative to the first checker's.
    pub brightness: BTreeMap<String, f64>,
    /// Photographs done, and how many there are.
    pub done: usize,
    pub all: usize,
}

/// Photographs through one lens at one size, and what was measured of it.
#[derive(Clone, Debug, Default)]
pub(super) struct LensGroup {
    pub key: LensKey,
    /// The photograph that it was first met in.
    pub first: String,
    /// Its f-number as first seen, with the photograph that said it: falloff holds for one.
    pub f_number: Option<(f64, String)>,
    pub lens: Option<Lens>,
    /// The same as it is written.
    pub camera: Option<Camera>,
    pub flat: Option<Falloff>,
    pub sensor: Option<SensorNoise>,
    /// Corners that its calibration used, px.
    pub corners: Vec<DVec2>,
}

/// What must not change during a shoot, as first seen: with the photograph that said it.
#[derive(Clone, Debug, Default)]
pub(super) struct CameraSettings {
    pub model: Option<(String, String)>,
    /// Linear photographs whose exposure is not known, and how many there are in all.
    pub unknown: Vec<String>,
    pub linear: usize,
}

/// The correction, and where it is from.
pub(super) struct CheckerColour {
    /// Camera to linear Rec. 709.
    pub correction: Correction,
    /// `checker` or `sheet`.
    pub source: &'static str,
    /// Name of the light that it was photographed under.
    pub light: String,
}

impl Session<'_> {
    /// One more photograph is done; stops if the caller wants.
    pub fn step(&mut self, stage: &str) -> Result<()> {
        self.done += 1;
        (self.control.progress)(stage, self.done as f64 / self.all.max(1) as f64);
        self.control.check()
    }

    /// The colour correction of the shoot.
    pub fn matrix(&self) -> Option<&Correction> {
        self.colours.as_ref().map(|c| &c.correction)
    }
}

/// A file's own name, for reports.
pub(super) fn name_of(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
