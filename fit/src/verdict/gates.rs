//! What a fit must hold to be believed: each rule with the sentence that it fails with. `docs/fit.md`, step 11, states them for users.

use crate::photograph::close_up::CloseUp;
use crate::residuals::unknowns::LIGHT_REACH;
use crate::uncertainty::identify::Known;
use crate::verdict::near::NearComparison;
use crate::verdict::validate::{LEAST_TRAINING, MOST_ERROR, MOST_RATIO, Validation, Verdict, limit};

/// Largest relative RMS difference of the close-up. Of photographs without faults it is .5 % (grooves) and 2.4 % (cloth), of cloth that is turned by a
/// quarter turn 34 % (`cargo test --test faults`).
pub const MOST_NEAR_ERROR: f64 = 0.05;
/// Largest relative RMS difference of a distant photograph pixel by pixel: beyond it pixels show single threads, and their mean is not what a
/// material looks like from afar.
pub const MOST_PIXEL_ERROR: f64 = 0.25;

/// What a fit is judged by.
#[derive(Clone, Copy, Debug)]
pub struct Judged<'a> {
    /// The objective of the best start.
    pub objective: f64,
    /// Relative RMS difference over the bins of the distant photographs.
    pub training: f64,
    /// By distant photograph its name and the relative RMS difference over single pixels.
    pub pixels: &'a [(String, f64)],
    /// The photographs that were held out.
    pub validations: &'a [&'a Validation],
    /// The close-up.
    pub close_up: Option<&'a CloseUp>,
    /// The close-up beside the material.
    pub near: Option<&'a NearComparison>,
    /// All unknowns.
    pub known: &'a [Known],
}

/// Why a fit is not to be believed; empty if it may be.
pub fn failures(judged: &Judged<'_>) -> Vec<String> {
    if !judged.objective.is_finite() || !judged.training.is_finite() {
        return vec!["nothing was fitted".to_owned()];
    }
    let mut failures: Vec<String> = Vec::new();
    if over(judged.training, MOST_ERROR) {
        failures.push(format!(
            "the material does not explain the distant photographs: the relative RMS difference is {}, over {}",
            percent(judged.training),
            percent(MOST_ERROR)
        ));
    }
    failures.extend(judged.pixels.iter().filter(|(_, error)| over(*error, MOST_PIXEL_ERROR)).map(|(name, error)| {
        format!(
            "{name} is not from afar: its pixels differ by {} from the mean of their directions, over {}; photograph from farther away, so that \
             a pixel shows a period and more",
            percent(*error),
            percent(MOST_PIXEL_ERROR)
        )
    }));
    failures.extend(judged.close_up.and_then(|found| found.other_periods.clone()));
    if let Some(near) = judged.near.filter(|near| over(near.relative_rms, MOST_NEAR_ERROR)) {
        failures.push(format!(
            "the material does not explain the close-up: the relative RMS difference is {}, over {}",
            percent(near.relative_rms),
            percent(MOST_NEAR_ERROR)
        ));
    }
    let is_explained = failures.is_empty();
    failures.extend(judged.known.iter().filter_map(|known| of_bound(known, is_explained)));
    failures.extend(judged.validations.iter().filter(|v| v.verdict == Verdict::Fail).map(|v| of_validation(v, judged.training)));
    failures
}

/// Whether an error is over its limit: one that is no number is.
fn over(error: f64, limit: f64) -> bool {
    error.is_nan() || error > limit
}

/// An unknown that would go on if it could. Where photographs are explained, a parameter that nothing tells may lie anywhere; where they are not, its bound may be why.
fn of_bound(known: &Known, is_explained: bool) -> Option<String> {
    if !known.at_bound {
        return None;
    }
    let Known { name, value, bounds, .. } = known;
    match known.kind {
        "parameter" if known.not_identified && is_explained => None,
        "parameter" => Some(format!(
            "{name} lies on a bound, at {value:.4}: the truth may lie beyond; widen `bounds` = [{}, {}]",
            bounds[0], bounds[1]
        )),
        "light" => Some(format!(
            "{name} would have to stand {:.1} degrees and more from where the file says, {LIGHT_REACH:.0} of its standard deviations: check this light",
            value.abs()
        )),
        "colour" if *value >= 0.5 * (bounds[0] + bounds[1]) => Some(format!(
            "{name} lies on its upper bound, {value:.3}: the photographs are brighter than such a surface can be; check the irradiance in the file"
        )),
        "colour" if bounds[0] > 0.0 => Some(format!("{name} lies on its lower bound, {value:.3}: the truth may lie below; widen `bounds`")),
        "blur" => Some(format!(
            "the close-up would have to be {value:.2} times as blurred as its edges tell, the bound of what is looked for: photograph it from nearer, in focus"
        )),
        "exposure" => Some(format!("the close-up is {value:.3} times as bright as its irradiance says: check the irradiance in the file")),
        _ => None,
    }
}

fn of_validation(validation: &Validation, training: f64) -> String {
    format!(
        "{} is not predicted: the relative RMS difference is {}, over {} (at most {}, and at most {MOST_RATIO:.0} times the larger of training's {} and {})",
        validation.photograph,
        percent(validation.relative_rms),
        percent(limit(training)),
        percent(MOST_ERROR),
        percent(training),
        percent(LEAST_TRAINING)
    )
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uncertainty::identify::tests::known_as;

    fn judged() -> Judged<'static> {
        Judged { objective: 0.4, training: 0.01, pixels: &[], validations: &[], close_up: None, near: None, known: &[] }
    }

    #[test]
    fn each_rule_fails_with_its_own_sentence() {
        assert!(failures(&judged()).is_empty());
        let one = |judged: Judged<'_>, words: &str| {
            let found = failures(&judged);
            assert!(found.len() == 1 && found[0].contains(words), "{found:?} for {words}");
        };
        one(Judged { objective: f64::INFINITY, ..judged() }, "nothing was fitted");
        one(Judged { training: 0.06, ..judged() }, "6.0 %, over 5.0 %");
        one(Judged { pixels: &[("b.exr".to_owned(), f64::NAN)], ..judged() }, "b.exr is not from afar");
        one(Judged { pixels: &[("b.exr".to_owned(), 0.57)], ..judged() }, "b.exr is not from afar");
        let near = NearComparison { relative_rms: 0.2, ..NearComparison::default() };
        one(Judged { near: Some(&near), ..judged() }, "close-up: the relative RMS difference is 20.0 %");
        let close_up = CloseUp { other_periods: Some("it repeats along y".to_owned()), ..CloseUp::default() };
        one(Judged { close_up: Some(&close_up), ..judged() }, "repeats along y");
    }

    #[test]
    fn bounds_count_where_something_is_known() {
        let at = |kind, value, not_identified| Known { at_bound: true, not_identified, value, ..known_as("x", kind) };
        let told = |known: Known| failures(&Judged { known: &[known], ..judged() }).len();
        assert_eq!([told(at("parameter", 1.0, false)), told(at("parameter", 1.0, true))], [1, 0]);
        assert_eq!([told(at("light", 10.5, false)), told(at("veil", 0.0, false))], [1, 0]);
        assert_eq!([told(at("colour", 1.0, false)), told(at("colour", 0.0, false))], [1, 0]);
        assert_eq!(told(Known { bounds: [0.3, 0.9], ..at("colour", 0.3, false) }), 1);
        assert_eq!([told(at("light", -12.0, true)), told(at("exposure", 100.0, false)), told(at("blur", 2.5, false))], [1, 1, 1]);
    }
}
