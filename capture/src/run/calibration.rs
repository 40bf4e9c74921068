//! Checks of the calibration and of what it rests on.

use super::session::Session;
use crate::board::Board;
use crate::checks::{BLURRY, CALIBRATION_RMS, CALIBRATION_SIGMA, COVERAGE, CheckCode, Limits, PARTIAL, Reading, VIEWS};
use crate::dictionary::Dictionary;
use crate::edges;
use crate::shoot::Role;
use crate::vision::calibrate::{BoardView, Calibration, FEWEST_CORNERS};
use crate::vision::{GreyImage8, board, markers};
use biscale::error::Result;
use biscale::formats::capture::Severity;
use glam::DVec2;

/// A calibration fails at this many times the limit from which on it warns. Chosen.
const FAIL_TIMES: f64 = 4.0;
/// Deviation of the markers' size from that of the board, relative. Chosen: a ruler tells half a millimetre of 20 mm.
const MARKER_SCALE: Limits = Limits { warn: 0.02, fail: 0.05 };

impl Session<'_> {
    /// Checks whether the calibration rests on enough views, all over the picture, and explains them.
    pub(super) fn calibration_checks(&mut self, calibration: &Calibration) {
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
    pub(super) fn dropped_views(&mut self, calibration: &Calibration, names: &[String], views: &[BoardView]) -> Vec<String> {
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
    pub(super) fn board_checks(&mut self, name: &str, grey: &GreyImage8, found: &board::DetectedBoard, layout: &Board) -> Result<()> {
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
}

/// Share of `true`.
pub(super) fn share(marks: &[bool]) -> f64 {
    marks.iter().filter(|m| **m).count() as f64 / marks.len().max(1) as f64
}
