//! The catalogue of checks: codes, thresholds, and what to do when one fails.

use biscale::formats::capture::{Check, Severity};
use biscale::numerics::outcome::Outcome;

/// A code of the catalogue, with what it is about. `docs/capture.md` lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names are the codes; `CheckCode::about` says what each is")]
pub enum CheckCode {
    Unreadable,
    WrongSize,
    Turned,
    NotLinear,
    AssumedSrgb,
    Clipped,
    Underexposed,
    Blurry,
    SettingsChanged,
    NoExposure,
    BoardNotFound,
    BoardPartial,
    OtherMarkers,
    TooFewViews,
    BadCoverage,
    CalibrationError,
    ScaleMismatch,
    PoseError,
    NotConverged,
    NoScale,
    UnevenLight,
    CheckerNotFound,
    CheckerBadFit,
    LightNotFound,
    LightInconsistent,
    SameLight,
    Undersampled,
    NoPeriod,
    AmbiguousWeave,
}

/// All codes with their names and meanings, in the order of the work.
pub const CATALOGUE: [(CheckCode, &str, &str); 29] = [
    (CheckCode::Unreadable, "UNREADABLE", "a file is no image, or damaged"),
    (CheckCode::WrongSize, "WRONG_SIZE", "a photograph has another size than those that the camera is known for"),
    (CheckCode::Turned, "TURNED", "the pixels of a photograph are turned against those of the others"),
    (CheckCode::NotLinear, "NOT_LINEAR", "values are not proportional to light"),
    (CheckCode::AssumedSrgb, "ASSUMED_SRGB", "8-bit values were taken as sRGB, as asked"),
    (CheckCode::Clipped, "CLIPPED", "pixels of the sample are saturated"),
    (CheckCode::Underexposed, "UNDEREXPOSED", "the sample uses a small part of the scale"),
    (CheckCode::Blurry, "BLURRY", "edges of the markers are spread"),
    (CheckCode::SettingsChanged, "SETTINGS_CHANGED", "aperture, focal length or camera changed between photographs"),
    (CheckCode::NoExposure, "NO_EXPOSURE", "neither the file nor the shoot file says the exposure"),
    (CheckCode::BoardNotFound, "BOARD_NOT_FOUND", "no board or marker of the sheet is seen"),
    (CheckCode::BoardPartial, "BOARD_PARTIAL", "few of the board's corners are seen"),
    (CheckCode::OtherMarkers, "OTHER_MARKERS", "markers of another family are seen"),
    (CheckCode::TooFewViews, "TOO_FEW_VIEWS", "too few views of the board"),
    (CheckCode::BadCoverage, "BAD_COVERAGE", "the views leave parts of the picture without corners"),
    (CheckCode::CalibrationError, "CALIBRATION_ERROR", "the calibrated camera does not explain its views, or is uncertain"),
    (CheckCode::ScaleMismatch, "SCALE_MISMATCH", "lengths disagree: the print is not at 100 %, or a length is wrong"),
    (CheckCode::PoseError, "POSE_ERROR", "the markers do not lie where the shape says"),
    (CheckCode::NotConverged, "NOT_CONVERGED", "a least-squares search used up its steps: its result may be off"),
    (CheckCode::NoScale, "NO_SCALE", "nothing tells how large the close-up is"),
    (CheckCode::UnevenLight, "UNEVEN_LIGHT", "the light is not even"),
    (CheckCode::CheckerNotFound, "CHECKER_NOT_FOUND", "no colour checker is seen"),
    (CheckCode::CheckerBadFit, "CHECKER_BAD_FIT", "the colours of the checker are not reached"),
    (CheckCode::LightNotFound, "LIGHT_NOT_FOUND", "a light's direction cannot be told"),
    (CheckCode::LightInconsistent, "LIGHT_INCONSISTENT", "two sources disagree on a light's direction"),
    (CheckCode::SameLight, "SAME_LIGHT", "the validation photograph is under the light of the others"),
    (CheckCode::Undersampled, "UNDERSAMPLED", "threads are too few pixels wide"),
    (CheckCode::NoPeriod, "NO_PERIOD", "the close-up does not repeat"),
    (CheckCode::AmbiguousWeave, "AMBIGUOUS_WEAVE", "more than one weave explains the close-up"),
];

impl CheckCode {
    fn entry(self) -> (&'static str, &'static str) {
        CATALOGUE.iter().find(|c| c.0 == self).map_or(("", ""), |c| (c.1, c.2))
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// What it is about.
    pub fn about(self) -> &'static str {
        self.entry().1
    }
}

/// Limits of a check: over `warn` it warns, over `fail` it fails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Above it, a warning.
    pub warn: f64,
    /// Above it, a failure.
    pub fail: f64,
}

/// Share of the sample's pixels that may be saturated.
pub const CLIPPED: Limits = Limits { warn: 1e-3, fail: 0.05 };
/// The sample's brightest values (95th percentile) over the full scale: below.
pub const UNDEREXPOSED_WARN: f64 = 0.1;
/// As [`UNDEREXPOSED_WARN`], failing.
pub const UNDEREXPOSED_FAIL: f64 = 0.01;
/// Edge spread (10 to 90 %), px.
pub const BLURRY: Limits = Limits { warn: 2.0, fail: 5.0 };
/// Exponent of the tone curve, away from 1.
pub const NOT_LINEAR: Limits = Limits { warn: 0.08, fail: 0.15 };
/// Delta E 2000 of a patch.
pub const CHECKER: Limits = Limits { warn: 3.0, fail: 6.0 };
/// Lengths that should agree, relative.
pub const SCALE: Limits = Limits { warn: 5e-3, fail: 0.02 };
/// Two sources of a light, degrees.
pub const LIGHT: Limits = Limits { warn: 2.0, fail: 5.0 };
/// Light over the sheet, or of the flat field beside its radial part: largest over smallest, less 1.
pub const UNEVEN: Limits = Limits { warn: 0.1, fail: 0.5 };
/// Reprojection error of a pose, px.
pub const POSE: Limits = Limits { warn: 1.0, fail: 3.0 };
/// Reprojection error of the calibration, px. The gates of `OpenCV`'s interactive calibration.
pub const CALIBRATION_RMS: f64 = 0.5;
/// Three standard deviations of focal length and principal point, relative to themselves.
pub const CALIBRATION_SIGMA: f64 = 0.05;
/// Views: more than this.
pub const VIEWS: u32 = 10;
/// Fewest views that a calibration is tried with.
pub const FEWEST_VIEWS: u32 = 3;
/// Share of the 10 x 10 grid that has corners.
pub const COVERAGE: f64 = 0.5;
/// Angle between the light of the validation photograph and that of the others, degrees: at least.
pub const SAME_LIGHT_DEG: f64 = 10.0;
/// Share of a board's corners: below it is partial.
pub const PARTIAL: f64 = 0.5;

/// A value that a check judges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<'a> {
    /// The photograph that it was measured in; none of the whole shoot.
    pub photograph: Option<&'a str>,
    /// The value.
    pub value: f64,
    /// Its unit, or what it is a share of.
    pub unit: &'a str,
}

impl<'a> Reading<'a> {
    /// A value measured in one photograph.
    pub fn of(photograph: &'a str, value: f64, unit: &'a str) -> Self {
        Self { photograph: Some(photograph), value, unit }
    }

    /// A value of the whole shoot.
    pub fn of_shoot(value: f64, unit: &'a str) -> Self {
        Self { photograph: None, value, unit }
    }
}

/// All checks of a run.
#[derive(Clone, Debug, Default)]
pub struct Checks(pub Vec<Check>);

impl Checks {
    /// Adds one.
    pub fn add(&mut self, code: CheckCode, severity: Severity, photograph: Option<&str>, message: impl Into<String>) -> &mut Check {
        self.0.push(Check {
            code: code.name().to_owned(),
            severity,
            message: message.into(),
            measured: None,
            threshold: None,
            unit: String::new(),
            photograph: photograph.map(str::to_owned),
        });
        self.0.last_mut().expect("one was just added")
    }

    /// Adds a check of a value by its limits, with what is said if it holds and if it does not; returns how severe it is.
    pub fn limit(&mut self, code: CheckCode, reading: Reading<'_>, limits: Limits, good: &str, bad: &str) -> Severity {
        let severity = if !(reading.value <= limits.fail) {
            Severity::Fail
        } else if reading.value > limits.warn {
            Severity::Warn
        } else {
            Severity::Ok
        };
        let threshold = if severity == Severity::Fail { limits.fail } else { limits.warn };
        self.valued(code, severity, reading, threshold, if severity == Severity::Ok { good } else { bad });
        severity
    }

    /// Adds a check with its measured value.
    pub fn valued(&mut self, code: CheckCode, severity: Severity, reading: Reading<'_>, threshold: f64, message: &str) {
        let check = self.add(code, severity, reading.photograph, message);
        check.measured = reading.value.is_finite().then_some(reading.value);
        check.threshold = Some(threshold);
        reading.unit.clone_into(&mut check.unit);
    }

    /// Adds a warning if the search for `what` in a photograph used up its steps: the result is the best so far, and its standard deviations hold for
    /// the least sum of squares only. `remedy` says what would help.
    pub fn search(&mut self, photograph: &str, what: &str, outcome: Outcome, remedy: &str) {
        if !outcome.converged() {
            let message = format!("the search for {what} used up its steps; the best so far is taken, which may be off: {remedy}");
            self.add(CheckCode::NotConverged, Severity::Warn, Some(photograph), message);
        }
    }

    /// The worst of them.
    pub fn worst(&self) -> Severity {
        self.0.iter().map(|c| c.severity).max().unwrap_or(Severity::Ok)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_decide_and_what_is_no_number_fails() {
        let mut checks = Checks::default();
        for (measured, severity) in [(1.0, Severity::Ok), (2.5, Severity::Warn), (5.5, Severity::Fail), (f64::NAN, Severity::Fail)] {
            assert_eq!(checks.limit(CheckCode::Blurry, Reading::of_shoot(measured, "px"), BLURRY, "good", "bad"), severity, "{measured}");
        }
        assert_eq!(checks.worst(), Severity::Fail);
        assert_eq!((checks.0[1].measured, checks.0[1].threshold, &*checks.0[1].code), (Some(2.5), Some(2.0), "BLURRY"));
        assert_eq!(checks.0[3].measured, None);
    }

    #[test]
    fn a_search_that_used_up_its_steps_warns_and_says_what_to_do() {
        let mut checks = Checks::default();
        checks.search("a.png", "the pose", Outcome::Converged, "show more markers");
        assert!(checks.0.is_empty());
        checks.search("a.png", "the pose", Outcome::Exhausted, "show more markers");
        let [check] = &checks.0[..] else { panic!("{checks:?}") };
        assert_eq!((&*check.code, check.severity, check.photograph.as_deref()), ("NOT_CONVERGED", Severity::Warn, Some("a.png")));
        assert!(check.message.contains("the pose") && check.message.ends_with("show more markers"), "{}", check.message);
    }
}
