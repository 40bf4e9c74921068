//! Fits of photographs that were made by something else than the fitter (`support`), of a weave and of printed grooves.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale_fit::run::{Options, Outcome};
use biscale_fit::verdict::validate::Verdict;
use support::question::{GROOVES_MOVE, WEAVE_MOVES, grooves, known, print, run, weave};
use support::{Faults, PERFECT, REAL, material, set};

/// What photographs of a weave must tell.
fn weave_is_found(faults: &Faults) {
    let folder = tempfile::tempdir().unwrap();
    let truth = weave([0.42, 0.14, 0.15], [0.34, 0.12, 0.0], 32, "[0.45, 0.06, 0.05]", "[0.05, 0.12, 0.40]", 0.25, 0.3);
    let set = set(folder.path(), &material(&truth), 290.0, faults, 64);
    let start = weave([0.38, 0.11, 0.13], [0.38, 0.11, 0.0], 16, "[0.4, 0.2, 0.2]", "[0.2, 0.2, 0.4]", 0.1, 0.2);
    let outcome = run(folder.path(), &set.tables, &start, WEAVE_MOVES, &Options::default());
    print(&outcome);
    let (validation, _) = &outcome.validations[0];
    assert!(validation.verdict == Verdict::Pass && validation.relative_rms <= 0.05, "{validation:?}");
    for (name, truth) in [("surface.warp.brdf.diffuse red", 0.45), ("surface.weft.brdf.diffuse blue", 0.40)] {
        let value = known(&outcome, name).value;
        assert!((value / truth - 1.0).abs() < 0.05, "{name}: {value} for {truth}");
    }
    // What is dark beside the other thread shows in few places: it is found, or flagged, and its standard deviation holds.
    for (name, truth) in [
        ("surface.warp.brdf.diffuse green", 0.06),
        ("surface.warp.brdf.diffuse blue", 0.05),
        ("surface.weft.brdf.diffuse red", 0.05),
        ("surface.weft.brdf.diffuse green", 0.12),
    ] {
        let found = known(&outcome, name);
        let off = (found.value - truth).abs();
        assert!(off <= 3.0 * found.sigma && (found.weak || off <= 0.1 * truth), "{found:?} for {truth}");
    }
    assert!(known(&outcome, "surface.weft.brdf.diffuse red").weak);
    // Where the light stands is told by its prior only.
    assert!(known(&outcome, "light 1 elevation_deg").sigma > 0.5);
    let winner = outcome.starts[0].evaluations;
    assert!((300..=600).contains(&winner), "{winner} evaluations of the winner");
    for period in outcome.close_up.as_ref().unwrap().period {
        assert!((period.unwrap().length - 1.0).abs() < 0.003, "{period:?}");
    }
}

#[test]
fn a_weave_is_found_in_photographs_of_a_real_camera() {
    weave_is_found(&REAL);
}

#[test]
fn photographs_of_the_models_own_weave_give_it_back() {
    let folder = tempfile::tempdir().unwrap();
    let truth = weave([0.42, 0.14, 0.15], [0.34, 0.12, 0.0], 32, "[0.45, 0.06, 0.05]", "[0.05, 0.12, 0.40]", 0.25, 0.3);
    let set = set(folder.path(), &material(&truth), 290.0, &PERFECT, 64);
    let start = weave([0.38, 0.11, 0.13], [0.38, 0.11, 0.0], 32, "[0.4, 0.2, 0.2]", "[0.2, 0.2, 0.4]", 0.1, 0.2);
    let outcome = run(folder.path(), &set.tables, &start, WEAVE_MOVES, &Options { starts: 3, ..Options::default() });
    print(&outcome);
    for (name, truth, strong) in [
        ("geometry.warp_width", 0.42, true),
        ("geometry.weft_width", 0.34, true),
        ("geometry.warp_height", 0.14, false),
        ("geometry.weft_height", 0.12, false),
        ("geometry.crimp", 0.15, false),
        ("surface.warp.brdf.alpha", 0.3, false),
        ("surface.warp.brdf.diffuse red", 0.45, true),
        ("surface.warp.brdf.diffuse green", 0.06, false),
        ("surface.warp.brdf.diffuse blue", 0.05, false),
        ("surface.weft.brdf.diffuse red", 0.05, false),
        ("surface.weft.brdf.diffuse green", 0.12, false),
        ("surface.weft.brdf.diffuse blue", 0.40, true),
        ("surface.warp.brdf.specular", 0.25, false),
        ("surface.weft.brdf.specular", 0.25, false),
    ] {
        let found = known(&outcome, name);
        let off = found.value - truth;
        assert!(off.abs() <= 3.0 * found.sigma, "{found:?} for {truth}");
        assert!(!strong || (off.abs() <= 0.02 * truth && !found.weak), "{found:?} for {truth}");
    }
}

/// What photographs of printed grooves must tell.
fn grooves_are_found(faults: &Faults, starts: usize) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let truth = grooves(0.4, 0.35, 0.25, ["[0.1, 0.6, 0.2]", "[0.65, 0.55, 0.1]", "[0.6, 0.1, 0.1]"]);
    let set = set(folder.path(), &material(&truth), 400.0, faults, 64);
    let start = grooves(0.3, 0.3, 0.3, ["[0.2, 0.5, 0.3]", "[0.5, 0.5, 0.2]", "[0.5, 0.2, 0.2]"]);
    let outcome = run(folder.path(), &set.tables, &start, GROOVES_MOVE, &Options { starts, ..Options::default() });
    println!("{faults:?}");
    print(&outcome);
    let (validation, _) = &outcome.validations[0];
    assert!(validation.verdict == Verdict::Pass && validation.relative_rms <= 0.05, "{validation:?}");
    for (name, truth) in
        [("surface.floor.brdf.albedo green", 0.6), ("surface.sides.brdf.albedo red", 0.65), ("surface.tops.brdf.albedo red", 0.6)]
    {
        let value = known(&outcome, name).value;
        assert!((value / truth - 1.0).abs() < 0.05, "{name}: {value} for {truth}");
    }
    let [across, along] = outcome.close_up.as_ref().unwrap().period;
    // What distortion is left in is in the period as well: 4/3 of it on the average over the picture.
    let limit = if faults.distortion > 0.0 { 0.01 } else { 0.003 };
    assert!((across.unwrap().length - 1.0).abs() < limit && along.is_none(), "{across:?} {along:?}");
    outcome
}

#[test]
fn printed_grooves_are_found_and_what_photographs_do_not_tell_is_flagged() {
    let outcome = grooves_are_found(&REAL, 8);
    // Where the light stands is told by its prior only.
    assert!(known(&outcome, "light 1 elevation_deg").sigma > 0.5);
}

#[test]
fn printed_grooves_are_found_whatever_the_camera_does() {
    // Columns of pixels without any blur catch more of one groove than of the next.
    let soft = Faults { blur: 0.7, ..PERFECT };
    for faults in [
        Faults { bits: Some(8), ..soft },
        Faults { bits: Some(12), ..soft },
        Faults { jpeg: true, ..soft },
        Faults { distortion: 0.004, ..soft },
        Faults { vignetting: 0.01, ..soft },
        Faults { light_off_deg: [0.5, 0.5], ..soft },
        Faults { noise: [1e-5, 4e-4], ..soft },
        Faults { blur: 1.2, ..PERFECT },
    ] {
        grooves_are_found(&faults, 2);
    }
}
