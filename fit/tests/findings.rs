//! Faults that once passed with wrong numbers and small standard deviations, one test each, on printed grooves. `faults.rs` has many more, on cloth,
//! too.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Options, Outcome, survey};
use biscale_fit::uncertainty::identify::Known;
use support::faulty::{FAULTS, Fault};
use support::question::{known, run};
use support::rows::truths;
use support::scene::{Scene, photographed, scenes, written};
use support::with_control;

fn grooves() -> Scene {
    scenes().into_iter().find(|s| s.name == "grooves").unwrap()
}

/// The fit of the grooves with a fault, and the numbers that they were made with.
fn fitted(name: &str) -> (Outcome, Vec<Option<f64>>) {
    let fault: &Fault = FAULTS.iter().find(|f| f.name == name).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let scene = fault.scene(&grooves());
    let tables = fault.tables(photographed(&scene, folder.path()));
    let outcome = run(folder.path(), &tables, &scene.start, scene.moves, &Options { starts: 2, ..Options::default() });
    let truths = truths(outcome.identified.known.iter().map(|k| &k.name[..]), &scene.truth);
    (outcome, truths)
}

/// All numbers within three standard deviations, colours against each other as well.
fn is_right(outcome: &Outcome, truths: &[Option<f64>]) {
    let known = || outcome.identified.known.iter().zip(truths).filter_map(|(known, truth)| Some((known, (*truth)?)));
    // The scale that all colours share: the median of what each says of it.
    let mut scales: Vec<f64> = known().filter(|(k, _)| k.kind == "colour").map(|(k, truth)| k.value / truth).collect();
    scales.sort_by(f64::total_cmp);
    let scale = scales[scales.len() / 2];
    for (known, truth) in known() {
        let off = (known.value - truth) / known.sigma;
        assert!(known.not_identified || off.abs() < 3.0, "{} = {} +/- {} for {truth}", known.name, known.value, known.sigma);
        if let Some(sigma) = known.sigma_of_ratio {
            let off = (known.value / scale - truth) / sigma;
            assert!(off.abs() < 3.0, "{} = {} +/- {sigma} for {truth}, in a scale of {scale}", known.name, known.value);
        }
    }
}

fn says(outcome: &Outcome, words: &str) -> bool {
    outcome.notes.iter().any(|note| note.contains(words))
}

/// It fails, with these words, and names this cause first.
fn fails(outcome: &Outcome, words: &str, cause: &str) {
    assert!(outcome.failures.iter().any(|f| f.contains(words)), "{:?}", outcome.failures);
    assert!(outcome.causes.first().is_some_and(|c| c.remedy.contains(cause)), "{:?}", outcome.causes);
}

#[test]
fn a_light_of_the_close_up_that_stands_elsewhere_is_found_and_told() {
    let (outcome, truths) = fitted("near light 10 up");
    assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
    is_right(&outcome, &truths);
    let Known { value, sigma, .. } = *known(&outcome, "light close-up elevation_deg");
    assert!((value - 10.35).abs() < 3.0 * sigma, "{value} +/- {sigma}");
    assert!(says(&outcome, "light close-up elevation_deg was found"), "{:?}", outcome.notes);
}

#[test]
fn stray_light_in_the_close_up_is_found() {
    let (outcome, truths) = fitted("near veil .02");
    assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
    is_right(&outcome, &truths);
}

#[test]
fn a_lamp_nearby_is_no_fault_where_its_place_is_known() {
    let (outcome, truths) = fitted("lamp 2 widths away, said");
    assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
    is_right(&outcome, &truths);
    assert!(!says(&outcome, "check this light"), "{:?}", outcome.notes);
}

#[test]
fn light_that_is_reflected_more_than_once_is_missed_where_the_fit_file_leaves_it_out() {
    let (outcome, _) = fitted("no bounces said");
    fails(&outcome, "is not predicted", "write `bounces = 4`");
}

#[test]
fn a_close_up_that_is_turned_or_mirrored_is_no_close_up_of_the_material() {
    fails(&fitted("near turned").0, "repeats along y", "quarter turn");
    let (outcome, _) = fitted("near mirrored");
    // Grooves that are mirrored and that are turned upside down are the same.
    assert!(outcome.causes.iter().any(|cause| cause.remedy.contains("mirrored")), "{:?}", outcome.causes);
    fails(&outcome, "does not explain", "the close-up a.exr is ");
}

#[test]
fn a_period_is_known_no_better_than_the_height_of_what_repeats() {
    let folder = tempfile::tempdir().unwrap();
    let scene = grooves();
    let tables = photographed(&scene, folder.path());
    let spec: Spec = written(&scene, folder.path(), &tables);
    let before = with_control(|control| survey(&spec, control)).unwrap().close_up.unwrap().period[0].unwrap();
    assert!((before.length - 1.0).abs() < 2.0 * before.sigma, "{before:?}");
    let outcome = run(folder.path(), &tables, &scene.start, scene.moves, &Options { starts: 1, ..Options::default() });
    let close_up = outcome.close_up.unwrap();
    let after = close_up.period[0].unwrap();
    assert!(after.sigma < before.sigma && (after.length - 1.0).abs() < 2.0 * after.sigma.max(0.001), "{after:?}");
    assert_eq!(close_up.mean_period.unwrap().length[0], Some(after.length));
}

#[test]
fn what_bounds_exclude_and_what_is_not_from_afar_fails_and_the_scale_of_colours_is_flagged() {
    let (outcome, _) = fitted("bounds too low");
    let depth = outcome.identified.known.iter().find(|k| k.name == "geometry.depth");
    assert!(outcome.failures.iter().any(|f| f.contains("geometry.depth lies on a bound")), "{:?} {depth:?}", outcome.failures);
    let (outcome, _) = fitted("threads resolved");
    assert!(outcome.failures.iter().any(|f| f.contains("is not from afar")), "{:?}", outcome.failures);
    let (outcome, _) = fitted("all gain .5");
    let colours = || outcome.identified.known.iter().filter(|k| k.kind == "colour");
    assert!(colours().all(|k| k.scale_assumed && k.sigma >= 0.049 * k.value && k.sigma_of_ratio.is_some_and(|s| s < k.sigma)));
}

#[test]
fn a_held_out_photograph_that_is_brighter_or_lit_from_elsewhere_says_so() {
    fails(&fitted("held-out gain 1.1").0, "c.exr is not predicted", "the irradiance of c.exr is 1.1");
    fails(&fitted("light 6 aside").0, "c.exr is not predicted", "the light of c.exr stands elsewhere");
}
