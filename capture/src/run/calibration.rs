//! The camera, and what its lens does to brightness.

use super::session::{Session, name_of};
use crate::board::Board;
use crate::checks::{BLURRY, CALIBRATION_RMS, CALIBRATION_SIGMA, COVERAGE, CheckCode, Limits, PARTIAL, Reading, UNEVEN, VIEWS};
use crate::dictionary::Dictionary;
use crate::edges;
use crate::flat::Falloff;
use crate::lens::Lens;
use crate::noise;
use crate::photo::Samples;
use crate::report::{Mark, PhotoView};
use crate::shoot::{FlatMethod, Role};
use crate::vision::calibrate::{self, BoardView, Calibration, FEWEST_CORNERS};
use crate::vision::{GreyImage8, board, markers};
use biscale::error::Result;
use biscale::formats::capture::{Camera, FlatField, Severity};
use glam::DVec2;
use std::path::PathBuf;

/// A calibration fails at this many times the limit from which on it warns. Chosen.
const FAIL_TIMES: f64 = 4.0;
/// Deviation of the markers' size from that of the board, relative. Chosen: a ruler tells half a millimetre of 20 mm.
const MARKER_SCALE: Limits = Limits { warn: 0.02, fail: 0.05 };

impl Session<'_> {
    /// Calibrates from the board views, or takes the camera that is given.
    pub(super) fn camera(&mut self) -> Result<Option<Camera>> {
        let shoot = self.shoot;
        let files: Vec<_> = shoot.of_role(Role::Board).flat_map(|p| &p.files).collect();
        let Some(layout) = shoot.board.as_ref().filter(|_| !files.is_empty()) else {
            return Ok(self.given_camera());
        };
        let (names, views) = self.board_views(&files, layout)?;
        let Some((width, height)) = self.size else { return Ok(self.given_camera()) };
        let Some(calibration) = calibrate::calibrate(&views, width, height)? else {
            let good = views.iter().filter(|v| v.len() >= FEWEST_CORNERS).count();
            let message = format!("{good} views show the board well enough, too few to calibrate the camera; take more than {VIEWS}");
            let reading = Reading::of_shoot(good as f64, "views");
            self.checks.valued(CheckCode::TooFewViews, Severity::Fail, reading, f64::from(VIEWS), &message);
            return Ok(self.given_camera());
        };
        self.calibration_checks(&calibration);
        let dropped = self.dropped_views(&calibration, &names, &views);
        self.report.corners = views.iter().zip(&calibration.used).filter(|(_, u)| **u).flat_map(|(v, _)| v.iter().map(|c| c.1)).collect();
        let lens = calibration.lens;
        self.lens = Some(lens);
        let used = calibration.used.iter().filter(|u| **u).count();
        Ok(Some(Camera {
            source: "calibrated".into(),
            sigma: Some(calibration.sigma),
            rms_px: Some(calibration.rms),
            views: u32::try_from(used).unwrap_or(u32::MAX),
            dropped,
            coverage: Some(calibration.coverage),
            ..describe(&lens)
        }))
    }

    /// The corners that each readable photograph of the board shows, with its name.
    fn board_views(&mut self, files: &[&PathBuf], layout: &Board) -> Result<(Vec<String>, Vec<BoardView>)> {
        let (mut names, mut views) = (Vec::new(), Vec::new());
        for file in files {
            let name = name_of(file);
            let Some(photo) = self.photo(file)? else {
                self.step("calibrating")?;
                continue;
            };
            let encoded = photo.samples != Samples::Float;
            let grey = GreyImage8::of(&photo.picture, encoded);
            let found = board::detect(&grey, layout)?;
            let mut view = PhotoView::new(&name, Role::Board.name(), &photo.picture, None, encoded);
            view.marks.extend(found.markers.iter().map(|m| Mark::Outline(m.1.to_vec(), "marker")));
            view.marks.extend(found.corners.iter().map(|c| Mark::Cross(c.1)));
            view.row("corners", format!("{} of {}", found.corners.len(), layout.count()));
            self.report.views.push(view);
            self.board_checks(&name, &grey, &found, layout)?;
            views.push(found.corners);
            names.push(name);
            self.step("calibrating")?;
        }
        Ok((names, views))
    }

    /// Checks whether the calibration rests on enough views, all over the picture, and explains them.
    fn calibration_checks(&mut self, calibration: &Calibration) {
        let used = calibration.used.iter().filter(|u| **u).count();
        let (severity, message) = if used > VIEWS as usize {
            (Severity::Ok, "enough views of the board")
        } else {
            (Severity::Warn, "few views of the board: take more than 10, tilted by up to 45 degrees to all sides")
        };
        self.checks.valued(CheckCode::TooFewViews, severity, Reading::of_shoot(used as f64, "views"), f64::from(VIEWS), message);
        let (severity, message) = if calibration.coverage >= COVERAGE {
            (Severity::Ok, "the views reach all over the picture")
        } else {
            (
                Severity::Warn,
                "large parts of the picture, of a 10 x 10 grid, never show the board: distortion is a guess there; bring the board to the corners",
            )
        };
        let reading = Reading::of_shoot(calibration.coverage, "share of a 10 x 10 grid");
        self.checks.valued(CheckCode::BadCoverage, severity, reading, COVERAGE, message);
        let limits = |warn: f64| Limits { warn, fail: FAIL_TIMES * warn };
        let bad = "the camera does not explain the corners: is the board flat, in focus, and as described?";
        let reading = Reading::of_shoot(calibration.rms, "px (RMS)");
        self.checks.limit(CheckCode::CalibrationError, reading, limits(CALIBRATION_RMS), "the camera explains the corners", bad);
        let (lens, s) = (calibration.lens, &calibration.sigma);
        let relative = [s[0] / lens.focal.x, s[1] / lens.focal.y, s[2] / lens.centre.x, s[3] / lens.centre.y];
        let worst = 3.0 * relative.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let bad = "focal length or principal point are uncertain: tilt the board more, and bring it nearer";
        let reading = Reading::of_shoot(worst, "3 sigma over value");
        self.checks.limit(CheckCode::CalibrationError, reading, limits(CALIBRATION_SIGMA), "focal length and centre are certain", bad);
    }

    /// Tells the reprojection error of each view; returns the names of those that the calibration left out.
    fn dropped_views(&mut self, calibration: &Calibration, names: &[String], views: &[BoardView]) -> Vec<String> {
        let mut dropped = Vec::new();
        for (k, name) in names.iter().enumerate() {
            let error = calibration.view_errors[k];
            if let Some(view) = self.report.views.iter_mut().find(|v| v.title == *name && v.role == Role::Board.name()) {
                view.row("reprojection error", if error.is_nan() { "not used".into() } else { format!("{error:.3} px") });
                if !calibration.used[k] {
                    view.row("calibration", "dropped".into());
                }
            }
            if !calibration.used[k] && views[k].len() >= FEWEST_CORNERS {
                let message = format!("its error is {error:.2} px, far over the others': it was left out of the calibration");
                let reading = Reading::of(name, error, "px");
                self.checks.valued(CheckCode::CalibrationError, Severity::Ok, reading, calibration.rms, &message);
                dropped.push(name.clone());
            }
        }
        dropped
    }

    /// What a board view shows, or why it does not.
    fn board_checks(&mut self, name: &str, grey: &GreyImage8, found: &board::DetectedBoard, layout: &Board) -> Result<()> {
        if found.corners.is_empty() {
            return self.nothing_found(name, grey, layout.dictionary.as_ref(), "the board", Severity::Warn);
        }
        let share = found.corners.len() as f64 / layout.count() as f64;
        if share < PARTIAL {
            let message = "a part of the board is seen; the rest is cut off, hidden or too dark";
            self.checks.valued(CheckCode::BoardPartial, Severity::Warn, Reading::of(name, share, "share of the corners"), PARTIAL, message);
        }
        if let Some(scale) = found.marker_scale {
            let bad = "the markers are not as large relative to the squares as [board] says: measure both on the print";
            self.checks.limit(
                CheckCode::ScaleMismatch,
                Reading::of(name, (scale - 1.0).abs(), "relative"),
                MARKER_SCALE,
                "markers and squares have the sizes that [board] says",
                bad,
            );
        }
        let sides: Vec<[DVec2; 4]> = found.markers.iter().map(|m| m.1).collect();
        self.sharpness(name, grey, &sides, layout.dictionary.as_ref());
        Ok(())
    }

    /// Checks the spread of the edges of markers; photographs without markers of some size say nothing.
    pub(super) fn sharpness(&mut self, name: &str, grey: &impl edges::GreyImage, sides: &[[DVec2; 4]], dictionary: Option<&Dictionary>) {
        if let Some(spread) = dictionary.and_then(|d| edges::spread(grey, sides, d.cells() as f64)) {
            let bad = "edges are spread: focus, close the aperture a little, use a tripod";
            self.checks.limit(CheckCode::Blurry, Reading::of(name, spread, "px (10 to 90 %)"), BLURRY, "edges are sharp", bad);
        }
    }

    /// No marker, or those of someone else.
    pub(super) fn nothing_found(
        &mut self,
        name: &str,
        grey: &GreyImage8,
        dictionary: Option<&Dictionary>,
        what: &str,
        severity: Severity,
    ) -> Result<()> {
        let other = markers::other_family(grey, dictionary)?;
        if let Some((family, count)) = &other {
            let ours = dictionary.map_or_else(|| "no chessboard".to_owned(), |d| format!("none of {}", d.name()));
            let message = format!("found other marker family: {count} markers of {family}, {ours}; is this the right photograph?");
            self.checks.add(CheckCode::OtherMarkers, severity, Some(name), message);
        }
        let message = format!("{what} is not seen: it must be in the picture, in focus, and not in glare");
        self.checks.add(CheckCode::BoardNotFound, severity, Some(name), message);
        Ok(())
    }

    fn given_camera(&mut self) -> Option<Camera> {
        let given = self.shoot.camera.given?;
        // The size comes from the first photograph of a sample.
        let (width, height) = match self.size {
            Some(size) => size,
            None => {
                let file = self.shoot.photos.iter().find(|p| p.role.is_sample()).or(self.shoot.photos.first())?.files.first()?;
                crate::photo::size(file).ok()?
            }
        };
        self.size = Some((width, height));
        let lens = given.lens(width, height);
        self.lens = Some(lens);
        Some(describe(&lens))
    }

    /// Falloff and noise, from the photographs of an even surface.
    pub(super) fn flat_field(&mut self) -> Result<Option<FlatField>> {
        let shoot = self.shoot;
        let mut first: Option<crate::linear::LinearPhoto> = None;
        let mut name = String::new();
        for spec in shoot.of_role(Role::Flat) {
            for k in 0..spec.files.len() {
                let shot = self.shot_of(spec, k..k + 1)?;
                self.step("flat field")?;
                let Some(shot) = shot else { continue };
                let mut view = PhotoView::new(&shot.name, Role::Flat.name(), &shot.linear.picture, Some(&shot.linear.saturated), false);
                view.row("saturated", format!("{:.2} %", 100.0 * share(&shot.linear.saturated)));
                self.report.views.push(view);
                match &first {
                    None => {
                        name.clone_from(&shot.name);
                        first = Some(shot.linear);
                    }
                    Some(one) if self.sensor.is_none() => self.sensor = noise::measure(one, &shot.linear),
                    Some(_) => {}
                }
            }
        }
        let Some(photo) = first else { return Ok(None) };
        let middle = 0.5 * DVec2::new((photo.picture.width - 1) as f64, (photo.picture.height - 1) as f64);
        let centre = self.lens.map_or(middle, |l| l.centre);
        let Some(flat) = Falloff::fit(&photo, centre, shoot.camera.flat) else {
            let message = "the flat field is saturated, dark or uneven all over: take it again at about half of the scale";
            self.checks.add(CheckCode::UnevenLight, Severity::Fail, Some(&name), message);
            return Ok(None);
        };
        let bad = "the light of the flat field falls off from one side to the other: turn the surface by half a turn and take the mean, or light it more evenly";
        self.checks.limit(
            CheckCode::UnevenLight,
            Reading::of(&name, flat.tilt, "relative, over the picture"),
            UNEVEN,
            "the flat field is even",
            bad,
        );
        let out = FlatField {
            method: if flat.method == FlatMethod::Divide { "divide" } else { "radial" }.into(),
            radial: flat.radial,
            darkest: flat.darkest,
            residual: flat.residual,
        };
        self.flat = Some(flat);
        Ok(Some(out))
    }
}

/// Share of `true`.
pub(super) fn share(marks: &[bool]) -> f64 {
    marks.iter().filter(|m| **m).count() as f64 / marks.len().max(1) as f64
}

fn describe(lens: &Lens) -> Camera {
    Camera {
        width: u32::try_from(lens.width).unwrap_or(u32::MAX),
        height: u32::try_from(lens.height).unwrap_or(u32::MAX),
        fx: lens.focal.x,
        fy: lens.focal.y,
        cx: lens.centre.x,
        cy: lens.centre.y,
        distortion: lens.distortion,
        sigma: None,
        source: "given".into(),
        rms_px: None,
        views: 0,
        dropped: Vec::new(),
        coverage: None,
    }
}
