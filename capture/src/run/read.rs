//! Reading photographs into linear values, with the checks that concern files and settings.

use super::session::{LensGroup, Session, name_of};
use crate::checks::{CheckCode, NOT_LINEAR, Reading};
use crate::lens_group::{LensKey, Turn};
use crate::linear::{self, Exposure, LinearPhoto};
use crate::photo::{self, Photo, Samples};
use crate::shoot::{PhotoSpec, Role};
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
    /// Its place in [`Session::groups`].
    pub group: usize,
    /// Whether its pixels were turned back by a quarter.
    pub turn: Turn,
}

impl Shot {
    /// The same with the pixels turned by a half.
    pub(super) fn half_turned(mut self) -> Self {
        self.linear.picture = self.linear.picture.half_turned();
        self.linear.saturated.reverse();
        self
    }
}

impl Session<'_> {
    /// Reads a file of an entry, and checks that it can be read and was taken through a lens that is known; `None` after it was told why not. With it
    /// comes the place of its lens in [`Session::groups`]; pixels turned by a quarter are turned back (or by a half away from that).
    pub(super) fn photo(&mut self, spec: &PhotoSpec, file: &Path) -> Result<Option<(Photo, usize, Turn)>> {
        let name = name_of(file);
        let photo = match photo::read(file) {
            Ok(photo) => photo,
            Err(Error::BadInput(bad)) => {
                self.checks.add(CheckCode::Unreadable, Severity::Fail, Some(&name), format!("{}; {}", bad.problem, bad.remedy));
                return Ok(None);
            }
            Err(other) => return Err(other),
        };
        let key = LensKey::of(spec.lens.as_deref(), (photo.picture.width, photo.picture.height), &photo.metadata);
        let Some((group, turn)) = self.group_of(&key, &name) else { return Ok(None) };
        let others = group > 0 || self.groups.iter().any(|g| g.lens.is_some());
        if spec.role != Role::Board && self.groups[group].lens.is_none() && others {
            self.no_calibration(&key, &name);
            return Ok(None);
        }
        if turn == Turn::Quarter {
            let message = "its pixels are turned by a quarter against those of the other photographs; they were turned back (write `dcraw -t 0` to leave them as the sensor has them)";
            self.checks.add(CheckCode::Turned, Severity::Warn, Some(&name), message);
            let photo = Photo { picture: photo.picture.quarter_turned(), ..photo };
            return Ok(Some((photo, group, turn)));
        }
        Ok(Some((photo, group, turn)))
    }

    /// The group of a photograph, a new one if none holds it; `None`, and a check, if several might.
    fn group_of(&mut self, key: &LensKey, name: &str) -> Option<(usize, Turn)> {
        let held: Vec<(usize, Turn)> = self.groups.iter().enumerate().filter_map(|(k, g)| g.key.holds(key).map(|turn| (k, turn))).collect();
        match held[..] {
            [] => {
                let scaled = self.groups.iter().find_map(|g| Some((g, g.lens?, g.key.scaled(key)?)));
                let mut group = LensGroup { key: key.clone(), first: name.to_owned(), ..LensGroup::default() };
                if let Some((from, lens, factor)) = scaled {
                    let lens = lens.resized(key.size);
                    let message = format!(
                        "it is {factor:.3} times as large as {} through the same lens: it is taken as that picture reduced as a whole, and not as a cut of it; better \
                         take all photographs at one size",
                        from.first
                    );
                    group.camera = from.camera.as_ref().map(|c| super::cameras::with_lens(c, &lens));
                    group.lens = Some(lens);
                    self.checks.add(CheckCode::WrongSize, Severity::Warn, Some(name), message);
                }
                self.groups.push(group);
                Some((self.groups.len() - 1, Turn::None))
            }
            [(k, turn)] => {
                // What the first file did not tell, a later one may.
                let known = &mut self.groups[k].key;
                known.focal_mm = known.focal_mm.or(key.focal_mm);
                known.focal_35mm = known.focal_35mm.or(key.focal_35mm);
                Some((k, turn))
            }
            _ => {
                let message = format!(
                    "photographs of {} x {} pixels were taken through several lenses, and this file does not tell through which: write `lens = \"NAME\"` here and at the \
                     board views through the same lens",
                    key.size.0, key.size.1
                );
                self.checks.add(CheckCode::SettingsChanged, Severity::Fail, Some(name), message);
                None
            }
        }
    }

    /// A photograph through a lens, or of a size, that no board was photographed with.
    fn no_calibration(&mut self, key: &LensKey, name: &str) {
        let known: Vec<String> = self.groups.iter().filter(|g| g.lens.is_some()).map(|g| g.key.describe()).collect();
        let same_size = self.groups.iter().any(|g| g.lens.is_some() && g.key.size == key.size);
        let known = if known.is_empty() { format!("the first photograph is {}", self.groups[0].key.describe()) } else { known.join("; ") };
        let message = format!(
            "it is {}, and the camera is known for {known}: a crop, another lens or zoom has another focal length and centre; photograph the board with this lens at \
             this size, too (more than 10 views), or take all photographs alike",
            key.describe()
        );
        let code = if same_size { CheckCode::SettingsChanged } else { CheckCode::WrongSize };
        self.checks.add(code, Severity::Fail, Some(name), message);
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
        let (mut group, mut turn) = (0, Turn::None);
        for k in range {
            let file = &spec.files[k];
            let name = name_of(file);
            let Some((photo, place, turned)) = self.photo(spec, file)? else { return Ok(None) };
            (group, turn) = (place, turned);
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
            self.remember(&name, group, f_number, meta.model);
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
        Ok(Some(Shot { name, linear, exposure, samples, gain, brackets: count, group, turn }))
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
    fn remember(&mut self, name: &str, group: usize, f_number: Option<f64>, model: Option<String>) {
        let mut changed = Vec::new();
        if let Some(v) = f_number {
            match &self.groups[group].f_number {
                Some((before, at)) if (v / before - 1.0).abs() > SAME_SETTING => {
                    changed.push(format!("the f-number is {v} and was {before} in {at}"));
                }
                Some(_) => {}
                None => self.groups[group].f_number = Some((v, name.to_owned())),
            }
        }
        let settings = &mut self.settings;
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
