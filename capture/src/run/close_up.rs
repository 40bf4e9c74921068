//! What the rectified close-up shows: analysed, checked, told.

use super::session::Session;
use crate::checks::{CheckCode, Reading};
use crate::photo::PlanarImage;
use crate::shoot::SurfaceKind;
use crate::weave::{self, Analysis, Axis, Measured, RectifiedPhoto, Relief, Weave};
use biscale::error::{Error, Result};
use biscale::formats::capture::Severity;
use biscale::numerics::cast::truncate_i32;
use glam::DVec2;
use serde_json::{Value, json};

/// What is known of the small scale.
#[derive(Default)]
pub(super) struct SmallScale {
    /// For `capture.json`.
    pub described: Option<Value>,
    /// A material file.
    pub material: Option<String>,
}

fn unit(in_mm: bool) -> &'static str {
    if in_mm { "mm" } else { "px" }
}

/// Rows of the report for a relief.
fn relief_rows(r: &Relief, in_mm: bool) -> Vec<(String, String)> {
    let mut out = vec![("relief".to_owned(), format!("{:?}", r.profile))];
    out.extend(r.period.iter().map(|p| ("period".to_owned(), format!("{:.4} +/- {:.4} {}", p.value, p.error, unit(in_mm)))));
    out.push(("turn".to_owned(), format!("{:.2} degrees", r.turn_deg)));
    out
}

impl Session<'_> {
    /// The weave or relief of a rectified close-up, and a guess as material file. What cannot be told is a check.
    pub(super) fn small_scale(&mut self, picture: &PlanarImage, good: &[bool], mm_per_px: Option<f64>, name: &str) -> Result<SmallScale> {
        let nothing = SmallScale::default();
        if self.shoot.sample.kind == SurfaceKind::Other {
            return Ok(nothing);
        }
        let rgb: Vec<[f32; 3]> = (0..good.len()).map(|i| picture.planes.each_ref().map(|p| p[i])).collect();
        let photo = RectifiedPhoto { width: picture.width, height: picture.height, rgb: &rgb, mask: Some(good), mm_per_pixel: mm_per_px };
        let options = weave::WeaveOptions { draft: self.options.draft.clone() };
        let analysis = match weave::analyse(&photo, &options) {
            Ok(analysis) => analysis,
            Err(Error::BadInput(bad)) => {
                self.checks.add(CheckCode::NoPeriod, Severity::Fail, Some(name), format!("{}; {}", bad.problem, bad.remedy));
                return Ok(nothing);
            }
            Err(other) => return Err(other),
        };
        for finding in &analysis.findings {
            let (code, severity) = match finding.code {
                weave::FindingCode::NoPeriod => (CheckCode::NoPeriod, Severity::Fail),
                weave::FindingCode::Undersampled => (CheckCode::Undersampled, Severity::Warn),
                weave::FindingCode::AmbiguousWeave => (CheckCode::AmbiguousWeave, Severity::Warn),
            };
            self.checks.valued(code, severity, Reading::of(name, finding.measured, ""), finding.threshold, &finding.message);
        }
        let material = analysis.material(&self.shoot.name, &weave::MaterialGuesses::default());
        let Some(found) = &analysis.weave else {
            if let Some(relief) = &analysis.relief {
                self.report.weave = relief_rows(relief, mm_per_px.is_some());
            }
            let relief = analysis.relief.as_ref().map(|r| json!({ "unit": unit(mm_per_px.is_some()), "relief": r }));
            return Ok(SmallScale { described: relief, material });
        };
        if analysis.findings.is_empty() {
            let message = format!("the close-up shows {}", found.class);
            let pixels = found.warp.pixels.min(found.weft.pixels);
            self.checks.valued(
                CheckCode::Undersampled,
                Severity::Ok,
                Reading::of(name, pixels, "px a thread"),
                weave::MIN_PIXELS_A_THREAD,
                &message,
            );
        }
        self.report.weave = rows(found, mm_per_px.is_some());
        self.report.grid = lines(found, mm_per_px.unwrap_or(1.0), picture.width, picture.height);
        Ok(SmallScale { described: Some(describe(&analysis, found)), material })
    }
}

fn measured(m: Measured) -> Value {
    json!({ "value": m.value, "error": m.error })
}

fn axis(a: &Axis) -> Value {
    json!({
        "pitch": measured(a.pitch),
        "pitch_by_autocorrelation": a.pitch_by_autocorrelation.map(measured),
        "width": measured(a.width),
        "gap": a.gap,
        "pixels": a.pixels,
        "turn_deg": measured(a.turn_deg),
        "colour": a.colour,
    })
}

/// The JSON that `docs/capture-format.md` describes.
fn describe(analysis: &Analysis, w: &Weave) -> Value {
    let row = |j: usize| -> String { (0..w.draft.columns).map(|i| if w.draft.over(i, j) { '1' } else { '0' }).collect() };
    json!({
        "unit": unit(analysis.mm_per_pixel.is_some()),
        "turn_deg": analysis.turn_deg,
        "warp": axis(&w.warp),
        "weft": axis(&w.weft),
        // The highest row first, as drafts are written.
        "draft": (0..w.draft.rows).rev().map(row).collect::<Vec<_>>(),
        "class": w.class,
        "class_name": w.class.to_string(),
        "confidence": w.confidence,
        "unexplained": w.unexplained,
        "repeat": w.repeat,
        "cover": w.cover,
        "colour_difference": w.colour_difference,
        "flatness": w.flatness,
    })
}

/// Rows of the report.
fn rows(w: &Weave, in_mm: bool) -> Vec<(String, String)> {
    let unit = unit(in_mm);
    let mut out = vec![("class".to_owned(), format!("{} (confidence {:.2})", w.class, w.confidence))];
    for (name, a) in [("warp", &w.warp), ("weft", &w.weft)] {
        let value = |m: Measured| format!("{:.4} +/- {:.4} {unit}", m.value, m.error);
        out.push((format!("{name}, thread to thread"), format!("{}, {:.1} pixels", value(a.pitch), a.pixels)));
        if let Some(by) = a.pitch_by_autocorrelation {
            out.push((format!("{name}, by autocorrelation"), value(by)));
        }
        out.push((format!("{name}, width"), format!("{}, gap {:.4} {unit}", value(a.width), a.gap)));
        out.push((format!("{name}, turn"), format!("{:.3} +/- {:.3} degrees", a.turn_deg.value, a.turn_deg.error)));
        out.push((format!("{name}, colour"), format!("{:.3}, {:.3}, {:.3}", a.colour[0], a.colour[1], a.colour[2])));
    }
    let percent = w.cover.map(|c| 100.0 * c);
    out.push(("on top".to_owned(), format!("warp {:.1} %, weft {:.1} %, neither {:.1} %", percent[0], percent[1], percent[2])));
    out.push(("not explained".to_owned(), format!("{:.1} % of the picture's variation", 100.0 * w.unexplained)));
    out
}

/// Lines of the repeat's grid to each side of the middle, at most.
const MOST_LINES: f64 = 50.0;

/// Lines of the repeat's grid over the rectified picture, px: through its middle and as many to each side as fit, not more than a hundred.
fn lines(w: &Weave, mm_per_px: f64, width: usize, height: usize) -> Vec<[DVec2; 2]> {
    let middle = 0.5 * DVec2::new(width as f64, height as f64);
    let reach = middle.length();
    let mut out = Vec::new();
    for (repeat, turn, upright) in [(w.repeat[0], w.warp.turn_deg.value, true), (w.repeat[1], w.weft.turn_deg.value, false)] {
        let step = repeat / mm_per_px;
        if !(step > 2.0) {
            continue;
        }
        // Counter-clockwise with y up; rows run down.
        let (sin, cos) = turn.to_radians().sin_cos();
        let along = if upright { DVec2::new(-sin, -cos) } else { DVec2::new(cos, -sin) };
        let across = along.perp();
        let count = truncate_i32((reach / step).min(MOST_LINES));
        for k in -count..=count {
            let at = middle + f64::from(k) * step * across;
            out.push([at - reach * along, at + reach * along]);
        }
    }
    out
}
