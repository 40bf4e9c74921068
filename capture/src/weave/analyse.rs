//! The analysis, step by step: what repeats, whether threads explain it, and what else could.

use super::analysis::{Analysis, Weave};
use super::enlarged::{self, Reduced};
use super::finding::{Finding, FindingCode};
use super::input::{RectifiedPhoto, WeaveOptions, check};
use super::orientation::Edges;
use super::scale::{self, Scale};
use super::{cloth, relief, threads};
use biscale::error::{Error, Result};

/// Fewest pixels from thread to thread for which a draft is trusted: the pitch of the finest of the drawn cloths that the figures of
/// `docs/weave-analysis.md` are of (8 to 40 pixels).
pub const MIN_PIXELS_A_THREAD: f64 = 8.0;
/// Fewest pixels of a repeat in two directions that is taken for pyramids where no threads are seen: two threads of [`MIN_PIXELS_A_THREAD`].
pub const MIN_PIXELS_A_REPEAT: f64 = 2.0 * MIN_PIXELS_A_THREAD;
/// Most of the variation of a photograph that a cloth may leave unexplained. Chosen: the satin of the real fabrics, which is not recognised, leaves two
/// thirds.
pub const MAX_UNEXPLAINED: f64 = 0.5;
/// The next best draft must leave at least this much more unexplained: confidence is 1 - best / next best. Chosen.
pub const MIN_CONFIDENCE: f64 = 0.05;

/// Analyses a photograph.
///
/// A photograph that cannot be understood is no error: the findings say what is missing, with what was measured and what is needed, and
/// the parts of the result that depend on it are `None`.
///
/// # Errors
/// Bad input if sizes do not fit together, if there are fewer than [`MIN_SIDE`](super::input::MIN_SIDE) pixels a side, or if a value is not a number.
pub fn analyse(photo: &RectifiedPhoto<'_>, options: &WeaveOptions) -> Result<Analysis> {
    check(photo)?;
    let Some(factor) = enlarged::factor(photo) else { return as_taken(photo, options) };
    let message = format!(
        "the picture was enlarged {factor:.2} times: it shows no more than one of {:.0} x {:.0} pixels, which is what is analysed; photograph from nearer",
        photo.width as f64 / factor,
        photo.height as f64 / factor
    );
    let finding = Finding { code: FindingCode::Undersampled, message, measured: factor, threshold: 1.0 };
    let small = Reduced::of(photo, factor);
    let mut result = match as_taken(&small.photo(), options) {
        Ok(result) => result,
        // Too small for an analysis.
        Err(Error::BadInput(_)) => Analysis::nothing(None),
        Err(other) => return Err(other),
    };
    result.mm_per_pixel = photo.mm_per_pixel;
    result.findings.insert(0, finding);
    Ok(result)
}

/// Analyses a photograph whose pixels are those of the camera.
fn as_taken(photo: &RectifiedPhoto<'_>, options: &WeaveOptions) -> Result<Analysis> {
    check(photo)?;
    let mut result = Analysis::nothing(photo.mm_per_pixel);
    let scale = match scale::find(photo) {
        Ok(scale) => scale,
        Err((measured, threshold)) => {
            let message = "nothing in the photograph repeats: take a sharper one, nearer, with more of the surface in it".to_owned();
            result.findings.push(Finding { code: FindingCode::NoPeriod, message, measured, threshold });
            return Ok(result);
        }
    };
    let edges = Edges::of(&scale.field);
    let Some(cloth) = cloth::find(&scale, &edges, options.draft.as_ref()).filter(|c| !c.fits.is_empty()) else {
        without_threads(photo, &scale, options, &mut result);
        return Ok(result);
    };
    let turns = cloth.grid.turns();
    result.turn_deg = Some(0.5 * (turns[0] + turns[1]).to_degrees());
    result.edge_turn_deg = Some(edges.sharpen(0.5 * (turns[0] + turns[1])).to_degrees());
    let weave = threads::describe(photo, &scale, &cloth, options.draft.as_ref());
    result.findings = doubts(&weave);
    result.weave = Some(weave);
    Ok(result)
}

/// What repeats along one direction, or so that no threads can lie in it: a relief, or nothing that can be told.
fn without_threads(photo: &RectifiedPhoto<'_>, scale: &Scale, options: &WeaveOptions, result: &mut Analysis) {
    if options.draft.is_some() {
        let message = "the photograph repeats, but not as a cloth of the given draft does".to_owned();
        result.findings.push(Finding { code: FindingCode::AmbiguousWeave, message, measured: 1.0, threshold: MAX_UNEXPLAINED });
        return;
    }
    if scale.lattice.basis.len() == 1 {
        let measured = relief::repeating(scale);
        if measured < relief::MIN_REPEATING {
            let message = format!(
                "brightness changes across one direction, but only {:.0} % of that repeats, as at an edge or a shadow: show more of the surface",
                100.0 * measured
            );
            result.findings.push(Finding { code: FindingCode::NoPeriod, message, measured, threshold: relief::MIN_REPEATING });
            return;
        }
    }
    if let [a, b] = scale.lattice.basis[..] {
        let pixels = scale.field.factor as f64 / a.length().max(b.length());
        if pixels < MIN_PIXELS_A_REPEAT {
            let message = format!(
                "something repeats after {pixels:.1} pixels in two directions; threads or pyramids, {MIN_PIXELS_A_REPEAT} pixels a repeat tell: photograph from nearer"
            );
            result.findings.push(Finding { code: FindingCode::Undersampled, message, measured: pixels, threshold: MIN_PIXELS_A_REPEAT });
            return;
        }
    }
    let relief = relief::describe(photo, scale);
    result.turn_deg = Some(relief.turn_deg);
    result.relief = Some(relief);
}

/// What makes a weave doubtful: threads of few pixels, a draft that explains little, or hardly more than another.
fn doubts(weave: &Weave) -> Vec<Finding> {
    let mut findings = Vec::new();
    let fewest = weave.warp.pixels.min(weave.weft.pixels);
    if fewest < MIN_PIXELS_A_THREAD {
        let message = format!(
            "threads are {fewest:.1} pixels apart: what is on top is a guess; photograph from nearer, {MIN_PIXELS_A_THREAD} pixels a thread or more"
        );
        findings.push(Finding { code: FindingCode::Undersampled, message, measured: fewest, threshold: MIN_PIXELS_A_THREAD });
    }
    if weave.unexplained > MAX_UNEXPLAINED {
        let message = format!("no draft explains more than {:.0} % of what the photograph shows", 100.0 * (1.0 - weave.unexplained));
        let (measured, threshold) = (weave.unexplained, MAX_UNEXPLAINED);
        findings.push(Finding { code: FindingCode::AmbiguousWeave, message, measured, threshold });
    } else if weave.confidence < MIN_CONFIDENCE {
        let message =
            format!("another draft explains the photograph nearly as well as {}: give the draft, or a photograph from nearer", weave.class);
        let (measured, threshold) = (weave.confidence, MIN_CONFIDENCE);
        findings.push(Finding { code: FindingCode::AmbiguousWeave, message, measured, threshold });
    }
    findings
}
