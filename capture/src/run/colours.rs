//! Colour: the matrix from a checker, or from the patches of our own sheet, and how bright each light is.

use super::read::Shot;
use super::register::{self, Falloffs, Registered};
use super::session::{CheckerColour, Session};
use crate::checks::{CHECKER, CLIPPED, CheckCode, NOT_LINEAR, Reading};
use crate::colour::{Correction, GREYS, checker_rgb, fit, grey_exponent};
use crate::report::{Mark, PhotoView};
use crate::shoot::{PhotoSpec, Registration, Role};
use crate::vision::checker::{self, Checker};
use biscale::error::Result;
use biscale::formats::capture::{Colour, Light, Severity};
use biscale::numerics::outcome::Outcome;
use glam::{DMat3, DVec3};

/// A mean Delta E 2000 over this means that what was found is no checker. Chosen.
const NO_CHECKER: f64 = 25.0;
/// Cosine between a checker's normal and the light below which its brightness tells no irradiance (87 degrees). Chosen.
const LEAST_COSINE: f64 = 0.05;

impl Session<'_> {
    /// Finds the colour matrix by the first checker that can be used; the other checkers tell how bright their lights are.
    pub(super) fn colour(&mut self) -> Result<Option<Colour>> {
        let shoot = self.shoot;
        for spec in shoot.of_role(Role::Checker) {
            if let Some(shot) = self.shot(spec)? {
                self.one_checker(spec, shot)?;
            }
            self.step("colours")?;
        }
        if self.colours.is_none() {
            self.colours_of_sheet()?;
        }
        Ok(self.colours.as_ref().map(|c| Colour {
            matrix: rows(c.correction.matrix),
            source: c.source.into(),
            delta_e: c.correction.delta_e.clone(),
            mean_delta_e: c.correction.mean_delta_e(),
            light: Some(c.light.clone()),
        }))
    }

    fn one_checker(&mut self, spec: &PhotoSpec, mut shot: Shot) -> Result<()> {
        let name = shot.name.clone();
        self.divide(&mut shot);
        let photo = &shot.linear;
        let found = checker::find(&photo.picture, &photo.saturated, self.groups[shot.group].lens.as_ref(), spec.checker_px)?;
        let mut view = PhotoView::new(&name, Role::Checker.name(), &photo.picture, Some(&photo.saturated), false);
        let seen = found.filter(|c| c.correction.mean_delta_e() < NO_CHECKER);
        let Some(found) = seen else {
            self.report.views.push(view);
            let message = if spec.checker_px.is_some() {
                "no patches of a checker lie between the corners of `checker_px`: give the outer corners of the patches dark skin, bluish green, black and white"
            } else {
                "no whole checker of 24 patches is seen: show all of it, larger and straight on, or give its corners as `checker_px`"
            };
            self.checks.add(CheckCode::CheckerNotFound, Severity::Fail, Some(&name), message);
            return Ok(());
        };
        view.marks.extend(found.windows.iter().map(|w| Mark::Outline(w.to_vec(), "patch")));
        view.row("mean Delta E 2000", format!("{:.2}", found.correction.mean_delta_e()));
        view.row("largest Delta E 2000", format!("{:.2}", found.correction.worst_delta_e()));
        self.report.views.push(view);
        self.checker_checks(&name, &found);
        // What is proportional to the camera's own values of a grey of 1: the scale of the light.
        match &self.colours {
            None => {
                self.brightness.insert(spec.light.clone(), 1.0);
                self.report.patches =
                    found.measured.iter().map(|m| (found.correction.matrix * DVec3::from(*m)).to_array()).zip(checker_rgb()).collect();
                self.colours = Some(CheckerColour { correction: found.correction, source: "checker", light: spec.light.clone() });
            }
            Some(first) => {
                let reference = checker_rgb();
                let (mut up, mut down) = (0.0, 0.0);
                for k in GREYS {
                    let seen = first.correction.matrix * DVec3::from(found.measured[k]);
                    up += seen.dot(DVec3::from(reference[k]));
                    down += DVec3::from(reference[k]).length_squared();
                }
                self.brightness.entry(spec.light.clone()).or_insert(up / down);
            }
        }
        Ok(())
    }

    fn checker_checks(&mut self, name: &str, found: &Checker) {
        if found.saturated > CLIPPED.fail {
            let message = "patches of the checker are saturated: expose less";
            self.checks.valued(
                CheckCode::Clipped,
                Severity::Fail,
                Reading::of(name, found.saturated, "share of a patch"),
                CLIPPED.fail,
                message,
            );
        }
        if let Some(exponent) = grey_exponent(&found.measured) {
            self.checks.limit(CheckCode::NotLinear, Reading::of(name, (exponent - 1.0).abs(), "exponent away from 1"), NOT_LINEAR, "the greys of the checker are proportional to light", "the greys of the checker are not proportional to light: the file has a tone curve, a wrong black level, or glare lies on the checker");
        }
        let (worst, mean) = (found.correction.worst_delta_e(), found.correction.mean_delta_e());
        // One patch may be dirty: the worst one warns, and fails only together with the mean.
        let severity = if mean > CHECKER.warn && worst > CHECKER.fail {
            Severity::Fail
        } else if worst > CHECKER.warn {
            Severity::Warn
        } else {
            Severity::Ok
        };
        let (threshold, message) = match severity {
            Severity::Fail => (
                CHECKER.fail,
                "a linear matrix does not reach the checker's colours: is it one of 24 patches, evenly lit, without glare, unsaturated?",
            ),
            Severity::Warn => (CHECKER.warn, "a patch of the checker keeps a visible difference"),
            Severity::Ok => (CHECKER.warn, "all patches are reached"),
        };
        self.checks.valued(CheckCode::CheckerBadFit, severity, Reading::of(name, worst, "Delta E 2000, worst patch"), threshold, message);
        let remedy = "light the whole checker evenly, without glare, and expose so that no patch is saturated or black";
        self.checks.search(name, "the colours of the checker", found.correction.outcome, remedy);
    }

    /// Finds the colour matrix by the patches of the sheet, whose references are what was sent to the printer: only as good as that prints.
    fn colours_of_sheet(&mut self) -> Result<()> {
        let shoot = self.shoot;
        let Registration::Sheet(sheet) = &shoot.sample.on else { return Ok(()) };
        if shoot.photos.iter().any(|p| p.role == Role::Checker) {
            return Ok(());
        }
        let Some(spec) = shoot.photos.iter().find(|p| p.role == Role::Distant) else { return Ok(()) };
        let Some(shot) = self.quietly(|s| s.shot(spec))? else { return Ok(()) };
        let (shot, registered) = self.quietly(|s| s.place(spec, shot, Falloffs::Divided, false))?;
        let Some(Registered { found, lens, .. }) = registered else { return Ok(()) };
        let pose = found.pose;
        let (mut measured, mut reference) = (Vec::new(), Vec::new());
        for patch in &sheet.patches {
            let [low, high] = patch.rectangle_mm.map(glam::DVec2::from);
            let inset = 0.25 * (high - low);
            let corners =
                [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|c| low + inset + glam::DVec2::from(c) * (high - low - 2.0 * inset));
            let seen = corners.map(|c| register::visible(shoot, sheet, c, &pose).and_then(|p| lens.project(p)));
            let [Some(a), Some(b), Some(c), Some(d)] = seen else { continue };
            if let Some((value, over)) = checker::mean(&shot.linear.picture, &shot.linear.saturated, &[a, b, c, d])
                && over == 0.0
            {
                measured.push(value);
                reference.push(patch.linear_rgb);
            }
        }
        let correction = fit(&measured, &reference).or_else(|| white_balance(&measured, &reference));
        if let Some(correction) = correction {
            let remedy = "photograph a colour checker, or light the sheet evenly and without glare";
            self.checks.search(&shot.name, "the colours of the sheet's patches", correction.outcome, remedy);
            self.brightness.insert(spec.light.clone(), 1.0);
            self.colours = Some(CheckerColour { correction, source: "sheet", light: spec.light.clone() });
        }
        Ok(())
    }

    /// Runs a step without keeping its checks and views: they are told elsewhere.
    pub(super) fn quietly<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let (checks, views, settings) = (self.checks.clone(), self.report.views.len(), self.settings.clone());
        let out = work(self);
        (self.checks, self.settings) = (checks, settings);
        self.report.views.truncate(views);
        out
    }

    /// Irradiance of the lights that a checker was under, from white being 1 there: `E = pi / (n . l)` for the first one.
    pub(super) fn irradiance(&self, lights: &mut [Light]) {
        let Some(normal) = self.shoot.checker_normal else { return };
        for light in lights {
            let cosine = normal.dot(light.direction.into());
            if let (Some(brightness), true) = (self.brightness.get(&light.name), cosine > LEAST_COSINE) {
                light.irradiance_rgb = Some([brightness * std::f64::consts::PI / cosine; 3]);
            }
        }
    }
}

/// A matrix that only scales, by the greys; `None` without any.
fn white_balance(measured: &[[f64; 3]], reference: &[[f64; 3]]) -> Option<Correction> {
    let mut scale = [0.0; 3];
    for (c, s) in scale.iter_mut().enumerate() {
        let (up, down) = measured.iter().zip(reference).fold((0.0, 0.0), |(u, d), (m, r)| (u + m[c] * r[c], d + m[c] * m[c]));
        *s = up / down;
    }
    let matrix = DMat3::from_diagonal(scale.into());
    let delta_e = measured
        .iter()
        .zip(reference)
        .map(|(m, r)| {
            crate::colour::delta_e_2000(
                biscale::numerics::colour::lab((matrix * DVec3::from(*m)).into()),
                biscale::numerics::colour::lab(*r),
            )
        })
        .collect();
    (matrix.is_finite() && !measured.is_empty()).then_some(Correction { matrix, delta_e, outcome: Outcome::Converged })
}

fn rows(m: DMat3) -> [[f64; 3]; 3] {
    m.transpose().to_cols_array_2d()
}
