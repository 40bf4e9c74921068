//! Many cloths and grooves, photographed by the tests' own camera and fitted: how far the answers are from what the photographs were made with, and
//! whether the standard deviations say so.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale_fit::photograph::close_up::BOX;
use biscale_fit::run::Outcome;
use support::drawn::drawn as drawn_fault;
use support::question::GROOVES_MOVE;
use support::rows::{Looked, compare_with_truth, dominant, probe, truths};
use support::scene::{Scene, drawn, fit_scene, photographed, scenes, written};
use support::{material, set_under, with_control};

/// The scenes that are asked for: `SET` is `drawn:COUNT:SEED` for those drawn at random, `SCENE` names some, with semicolons between.
fn asked() -> Vec<Scene> {
    let set = std::env::var("SET").unwrap_or_default();
    let all = match set.split(':').collect::<Vec<_>>()[..] {
        ["drawn", count, seed] => drawn(count.parse().unwrap(), seed.parse().unwrap()),
        _ => scenes(),
    };
    let only = std::env::var("SCENE").ok();
    all.into_iter().filter(|s| only.as_ref().is_none_or(|o| o.split(';').any(|o| s.name == o))).collect()
}

/// How often the truth lies within 1, 2 and 3 standard deviations.
#[derive(Clone, Copy, Debug, Default)]
struct Within {
    count: f64,
    shares: [f64; 3],
}

impl Within {
    fn add(&mut self, z: f64) {
        self.count += 1.0;
        for (k, limit) in [1.0, 2.0, 3.0].into_iter().enumerate() {
            self.shares[k] += f64::from(u8::from(z.abs() <= limit));
        }
    }

    fn share(&self, k: usize) -> f64 {
        self.shares[k] / self.count.max(1.0)
    }
}

/// Of errors in order of size their mean square's root, the places at 50, 80 and 95 %, the largest, and how many are over 5 %.
fn spread(off: &[f64]) -> String {
    let at = |share: f64| 100.0 * off[((share * off.len() as f64) as usize).min(off.len() - 1)];
    let rms = 100.0 * (off.iter().map(|v| v * v).sum::<f64>() / off.len() as f64).sqrt();
    let over = off.iter().filter(|v| **v > 0.05).count();
    format!(
        "{} in all, RMS {rms:.2} %, half below {:.2} %, .8 below {:.2} %, .95 below {:.2} %, largest {:.2} %, over 5 %: {over}",
        off.len(),
        at(0.5),
        at(0.8),
        at(0.95),
        at(1.0)
    )
}

/// One unknown beside what it was.
struct Answer {
    name: String,
    /// 0 for a dominant colour, 1 for a parameter, 2 for another colour. Dominant are channels of at least .6 of the brightest one of a diffuse colour.
    group: usize,
    /// Relative difference, and the same in standard deviations.
    off: f64,
    z: f64,
}

/// Fits a scene, prints what was found beside what it was, and gives that back.
fn answers(scene: &Scene, seed: u64) -> (Outcome, Vec<Answer>) {
    let folder = tempfile::tempdir().unwrap();
    let (outcome, spec) = fit_scene(scene, folder.path(), seed);
    let names: Vec<&str> = outcome.identified.known.iter().map(|k| &k.name[..]).collect();
    let truths = truths(names.iter().copied(), &scene.truth);
    let is_dominant = dominant(&names, &truths);
    let (validation, _) = &outcome.validations[0];
    let seconds: f64 = outcome.seconds.iter().map(|s| s.1).sum();
    let evaluations: usize = outcome.starts.iter().map(|s| s.evaluations).sum();
    println!(
        "{}: objective {:.3}, chi2 {:.2}, training {:.4}, validation {:.4} {:?}, {seconds:.1} s, {evaluations} evaluations",
        scene.name, outcome.objective, outcome.identified.chi2, outcome.training, validation.relative_rms, validation.verdict
    );
    let known = &outcome.identified.known;
    let period = outcome.close_up.as_ref().unwrap().period.map(|p| p.map_or(0.0, |p| 100.0 * (p.length - 1.0)));
    println!("  period {:+.2} %, {:+.2} %", period[0], period[1]);
    assert!(period.iter().all(|p| p.abs() < 1.0), "{}: {period:?}", scene.name);
    let mut found = Vec::new();
    for ((known, truth), dominant) in known.iter().zip(&truths).zip(is_dominant) {
        let Some(truth) = *truth else { continue };
        let group = if dominant {
            0
        } else if known.kind == "parameter" {
            1
        } else {
            2
        };
        let (off, z) = (known.value / truth - 1.0, (known.value - truth) / known.sigma.max(1e-12));
        let flags =
            [(known.not_identified, " not identified"), (known.weak, " weak"), (known.at_bound, " at bound"), (dominant, " dominant")];
        let flags: String = flags.into_iter().filter(|f| f.0).map(|f| f.1).collect();
        let bad = if dominant && off.abs() > 0.05 {
            "  <-- over 5 %"
        } else if z.abs() > 3.0 {
            "  <-- over 3 sigma"
        } else {
            ""
        };
        println!(
            "  {:40} {:.4} +/- {:.4} for {truth:.4}: {:+6.1} %, {z:+5.1} sigma{flags}{bad}",
            known.name,
            known.value,
            known.sigma,
            100.0 * off
        );
        found.push(Answer { name: known.name.clone(), group, off, z });
    }
    if std::env::var("ROWS").is_ok() {
        compare_with_truth(&Looked::new(&spec, &material(&scene.truth)), &outcome, &scene.truth, &scene.faults);
    }
    (outcome, found)
}

/// All scenes, with the seed `SEED`; `SET` and `SCENE` choose others, `OPTIMIZER` another search, `ROWS` shows which rows of the objective pull away from the truth.
#[test]
#[ignore = "a look at all scenes takes minutes"]
fn the_truth_of_all_scenes_lies_where_standard_deviations_say() {
    let is_whole = std::env::var("SCENE").is_err();
    let seed = std::env::var("SEED").map_or(0, |s| s.parse().unwrap());
    let mut within = [Within::default(); 3];
    let mut off = Vec::new();
    for scene in asked() {
        for answer in answers(&scene, seed).1 {
            within[answer.group].add(answer.z);
            if answer.group == 0 {
                off.push(answer.off.abs());
            }
        }
    }
    for (within, name) in within.iter().zip(["dominant colours", "parameters", "other colours"]) {
        let share = |k: usize| 100.0 * within.share(k);
        println!(
            "{name}: {} in all, {:.0} % within 1, {:.0} % within 2, {:.0} % within 3 sigma",
            within.count,
            share(0),
            share(1),
            share(2)
        );
    }
    off.sort_by(f64::total_cmp);
    let largest = *off.last().unwrap();
    println!("dominant colours: {}", spread(&off));
    assert!(largest < 0.07, "{largest}");
    for (within, name) in within.iter().zip(["dominant colours", "parameters", "other colours"]) {
        assert!(!is_whole || (within.share(1) >= 0.9 && within.share(2) >= 0.99), "{name}: {within:?}");
    }
}

/// What a search would find that misses nothing, without one: a descent from the truth.
#[test]
#[ignore = "a look at all scenes takes a minute"]
fn photographs_pull_little_away_from_the_truth() {
    let mut all = [Vec::new(), Vec::new()];
    for scene in asked() {
        let folder = tempfile::tempdir().unwrap();
        let tables = photographed(&scene, folder.path());
        let spec = written(&scene, folder.path(), &tables);
        let found = probe(&Looked::new(&spec, &material(&scene.truth)), &scene.truth, &scene.faults);
        let [a, b, c] = found.objectives;
        let off: Vec<String> = (found.off.iter())
            .map(|(name, here, there)| {
                all[0].push(here.abs());
                all[1].push(there.abs());
                let short: String = name.replace("surface.", "").replace(".brdf.diffuse", "").replace(".brdf.albedo", "");
                format!("{short} {:+.1} {:+.1}", 100.0 * here, 100.0 * there)
            })
            .collect();
        println!("{:26} {a:.2} {b:.2} {c:.2}  {}", scene.name, off.join(", "));
    }
    for (mut off, name) in all.into_iter().zip(["with true geometry", "after a descent"]) {
        off.sort_by(f64::total_cmp);
        println!("{name}: {}", spread(&off));
        assert!(off[off.len() * 4 / 5] < 0.05);
    }
}

#[test]
fn what_is_open_deep_interreflecting_or_of_unknown_exposure_is_found_from_a_guess_that_is_far_off() {
    let names = ["open", "light between grooves", "a close-up of unknown exposure"];
    for scene in scenes().iter().filter(|s| names.contains(&&s.name[..])) {
        let (outcome, answers) = answers(scene, 0);
        assert!(outcome.failures.is_empty(), "{}: {:?}", scene.name, outcome.failures);
        for Answer { name, group, off, z } in answers {
            assert!(group > 0 || off.abs() < 0.05, "{}: {name} is {:.1} % off", scene.name, 100.0 * off);
            assert!(z.abs() <= 3.0, "{}: {name} is {z:.1} standard deviations off", scene.name);
        }
    }
}

/// Glossy threads, white ones, and such of nearly one hue are told apart, the camera's blur is found, and the period.
#[test]
fn close_ups_of_all_scenes_tell_their_surfaces_apart() {
    for scene in scenes() {
        let folder = tempfile::tempdir().unwrap();
        let set = set_under(folder.path(), &material(&scene.truth), scene.repeats, scene.lights, (&scene.faults, scene.bounces), 16);
        let spec = written(&scene, folder.path(), &set.tables);
        let found = with_control(|control| biscale_fit::run::survey(&spec, control)).unwrap().close_up.unwrap();
        assert_eq!(found.clusters.len(), spec.material.surfaces.len(), "{}: {:?}", scene.name, found.notes);
        let blur = found.blur.unwrap().pixels;
        assert!((blur - scene.faults.blur).abs() < 0.25, "{}: blur {blur} for {}", scene.name, scene.faults.blur);
        // What lies deep is farther away than the plane that the camera is said to look at: its period looks smaller.
        let deep = if scene.moves == GROOVES_MOVE { 0.8 / 22.0 } else { 0.0 };
        for period in found.period.into_iter().flatten() {
            assert!((-0.01 - deep..0.01).contains(&(period.length - 1.0)), "{}: {period:?}", scene.name);
        }
    }
}

/// What the photographs' own edges tell of their blur, over what was there, the extent of a pixel included; of `COUNT` surfaces.
#[test]
fn blur_of_close_ups_is_found_from_their_edges() {
    let count = std::env::var("COUNT").map_or(10, |count| count.parse().unwrap());
    for k in 0..count {
        let drawn = drawn_fault(k, 1, Some("none"));
        let folder = tempfile::tempdir().unwrap();
        let tables = photographed(&drawn.scene, folder.path());
        let spec = written(&drawn.scene, folder.path(), &tables);
        let survey = with_control(|control| biscale_fit::run::survey(&spec, control)).unwrap();
        let with_pixel = |blur: f64| blur.hypot(BOX);
        let ratio = with_pixel(survey.close_up.unwrap().blur.unwrap().pixels) / with_pixel(drawn.scene.faults.blur);
        println!("{} {}: {ratio:.2}", drawn.surface, drawn.scene.faults.blur);
        assert!((0.6..1.1).contains(&ratio), "{}: {ratio}", drawn.scene.name);
    }
}

/// Ten pixels a thread: edges lie near each other, look sharper than they are, and how much they are blurred tells how wide threads are.
#[test]
fn a_blur_that_edges_tell_too_small_is_found_and_widths_are_right() {
    let drawn = drawn_fault(151, 1, Some("none"));
    let scene = &drawn.scene;
    let folder = tempfile::tempdir().unwrap();
    let tables = photographed(scene, folder.path());
    let spec = written(scene, folder.path(), &tables);
    let found = probe(&Looked::new(&spec, &material(&scene.truth)), &scene.truth, &scene.faults);
    let off = |name: &str| found.moved.iter().find(|m| m.0 == name).map(|(_, truth, found)| found / truth - 1.0).unwrap();
    let [warp, weft, blur] = ["geometry.warp_width", "geometry.weft_width", "blur of the close-up"].map(off);
    println!("{warp} {weft} {blur}");
    assert!(warp.abs() < 0.01 && weft.abs() < 0.01 && blur.abs() < 0.15, "{warp} {weft} {blur}");
}
