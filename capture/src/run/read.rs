//! Reading photographs into linear values, with the checks that concern files and settings.

use super::session::{Session, name_of};
use crate::checks::{CheckCode, NOT_LINEAR, Reading};
use crate::linear::{self, Exposure, LinearPhoto};
use crate::photo::{self, Photo, Samples};
use crate::shoot::PhotoSpec;
use biscale::error::{Error, Result};
use biscale::formats::capture::{self, Severity};
use std::path::Path;

/// Relative difference up to which two settings are the same: files round them.
const SAME_SETTING: f64 = 0.01;

/// A linear photograph with what was known of its making.
pub(super) struct Shot {
    pub name: String,
    pub linear: LinearPhoto,
    pub exposure: Option<capture::Exposure>,
    pub samples: Samples,
    pub gain: f64,
    pub brackets: usize,
}

impl Session<'_> {
    /// Reads a file, and checks that it can be read and has the size of the others. What cannot is told, and `None`.
    pub(super) fn photo(&mut self, file: &Path) -> Result<Option<Photo>> {
        let name = name_of(file);
        let photo = match photo::read(file) {
            Ok(photo) => photo,
            Err(Error::BadInput(bad)) => {
                self.checks.add(CheckCode::Unreadable, Severity::Fail, Some(&name), format!("{}; {}", bad.problem, bad.remedy));
                return Ok(None);
            }
            Err(other) => return Err(other),
        };
        let size = (photo.picture.width, photo.picture.height);
        let (width, height) = *self.size.get_or_insert(size);
        if size != (width, height) {
            let problem = format!(
                "it is {} x {} pixels and the first photograph {width} x {height}: a crop or another camera has another centre; take all alike",
                size.0, size.1
            );
            self.checks.add(CheckCode::WrongSize, Severity::Fail, Some(&name), problem);
            return Ok(None);
        }
        Ok(Some(photo))
    }

    /// Reads all files of an entry as brackets of one view, in sensor values over exposure. What makes it unusable is told, and `None`.
    pub(super) fn shot(&mut self, spec: &PhotoSpec) -> Result<Option<Shot>> {
        self.shot_of(spec, 0..spec.files.len())
    }

    /// As [`Session::shot`], of some of the files.
    pub(super) fn shot_of(&mut self, spec: &PhotoSpec, range: std::ops::Range<usize>) -> Result<Option<Shot>> {
        let name = name_of(&spec.files[range.start]);
        let mut brackets = Vec::new();
        let mut seconds = Vec::new();
        let (mut known, mut f_known, mut gain, mut samples) = (true, None, 1.0, Samples::Float);
        for k in range {
            let file = &spec.files[k];
            let name = name_of(file);
            let Some(photo) = self.photo(file)? else { return Ok(None) };
            if let Some(why) = linear::why_not_linear(&photo, &self.shoot.camera, self.options.assume_srgb) {
                let message = format!(
                    "{why}; convert the camera's raw file to linear 16-bit TIFF or EXR, or take it as sRGB (`assume_srgb`), which loses accuracy (if \
                     it is linear all the same, write `linear = true` under [camera])"
                );
                self.checks.add(CheckCode::NotLinear, Severity::Fail, Some(&name), message);
                return Ok(None);
            }
            let srgb = linear::is_srgb(&photo, &self.shoot.camera);
            if srgb {
                let message = "its values were taken as sRGB, as asked; cameras change them by more than that curve";
                self.checks.add(CheckCode::AssumedSrgb, Severity::Warn, Some(&name), message);
            }
            samples = photo.samples;
            let meta = photo.metadata.clone();
            let time = spec.seconds.get(k).copied().or(meta.seconds);
            let f_number = spec.f_number.or(meta.f_number);
            gain = spec.iso.or(meta.iso).map_or(1.0, |iso| iso / 100.0);
            self.remember(&name, f_number, meta.focal_mm, meta.model);
            known &= time.is_some();
            f_known = f_number;
            seconds.push(time.unwrap_or(1.0));
            let exposure = Exposure { seconds: time.unwrap_or(1.0), gain, f_number: f_number.unwrap_or(1.0) };
            let (picture, saturated) = linear::sensor(photo, &self.shoot.camera, srgb);
            brackets.push((picture, saturated, exposure));
        }
        if brackets.len() > 1 && !known {
            let message = "the exposure times of the brackets are not known; write `seconds = [...]`, one a file";
            self.checks.add(CheckCode::NoExposure, Severity::Fail, Some(&name), message);
            return Ok(None);
        }
        self.settings.linear += 1;
        if !known {
            self.settings.unknown.push(name.clone());
        }
        if !self.brackets_are_linear(&name, &brackets) {
            return Ok(None);
        }
        let count = brackets.len();
        let Some(linear) = linear::merge(brackets) else { return Ok(None) };
        let exposure = known.then_some(capture::Exposure { seconds, gain, f_number: f_known, divisor: linear.divisor });
        Ok(Some(Shot { name, linear, exposure, samples, gain, brackets: count }))
    }

    /// Brackets of one view must differ by their exposure and nothing else.
    fn brackets_are_linear(&mut self, name: &str, brackets: &[(photo::PlanarImage, Vec<bool>, Exposure)]) -> bool {
        let mut good = true;
        for pair in brackets.windows(2) {
            let (short, long) = if pair[0].2.divisor() <= pair[1].2.divisor() { (&pair[0], &pair[1]) } else { (&pair[1], &pair[0]) };
            let over: Vec<bool> = short.1.iter().zip(&long.1).map(|(a, b)| *a || *b).collect();
            let ratio = long.2.divisor() / short.2.divisor();
            if let Some(exponent) = linear::bracket_exponent(&short.0, &long.0, &over, ratio) {
                let severity = self.checks.limit(
                    CheckCode::NotLinear,
                    Reading::of(name, (exponent - 1.0).abs(), "exponent away from 1"),
                    NOT_LINEAR,
                    "brackets differ as their exposures do",
                    "brackets do not differ as their exposures do: the values have a tone curve, or the times are wrong",
                );
                good &= severity < Severity::Fail;
            }
        }
        good
    }

    /// Compares settings with those of the photographs before.
    fn remember(&mut self, name: &str, f_number: Option<f64>, focal_mm: Option<f64>, model: Option<String>) {
        let mut changed = Vec::new();
        let settings = &mut self.settings;
        let mut number = |what: &str, slot: &mut Option<(f64, String)>, value: Option<f64>| {
            if let Some(v) = value {
                match slot {
                    Some((before, at)) if (v / *before - 1.0).abs() > SAME_SETTING => {
                        changed.push(format!("{what} is {v} and was {before} in {at}"));
                    }
                    Some(_) => {}
                    None => *slot = Some((v, name.to_owned())),
                }
            }
        };
        number("the f-number", &mut settings.f_number, f_number);
        number("the focal length in mm", &mut settings.focal_mm, focal_mm);
        if let Some(m) = model {
            match &settings.model {
                Some((before, at)) if *before != m => changed.push(format!("the camera is \"{m}\" and was \"{before}\" in {at}")),
                Some(_) => {}
                None => settings.model = Some((m, name.to_owned())),
            }
        }
        for change in changed {
            let message = format!("{change}: falloff and calibration hold for one setting only; take all photographs with the same");
            self.checks.add(CheckCode::SettingsChanged, Severity::Fail, Some(name), message);
        }
    }

    /// What can only be said when all is read.
    pub(super) fn settings_checks(&mut self) {
        let unknown = std::mem::take(&mut self.settings.unknown);
        if !unknown.is_empty() && self.settings.linear > 1 {
            let message = format!(
                "neither file nor shoot file tells the exposure time of {}; it is taken to be 1 s, so brightness between photographs is not known: write \
                 `seconds = ...`",
                unknown.join(", ")
            );
            self.checks.add(CheckCode::NoExposure, Severity::Warn, None, message);
        }
    }
}
