//! Photographs with faults of a size that people make, fitted: a fit must be right within its standard deviations, or say that it is not to be
//! believed.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale_fit::run::{Options, Outcome};
use support::faulty::{FAULTS, Fault};
use support::question::run;
use support::rows::truths;
use support::scene::{Scene, drawn, photographed, scenes};

/// Starts of each search: its own and one of each number of sides. Photographs with faults have the minima of those without, which eight starts
/// find as well.
const STARTS: usize = 3;

/// What came of one fit.
struct Found {
    /// By number of the material its name and how many standard deviations it is off.
    off: Vec<(String, f64)>,
    outcome: Outcome,
}

impl Found {
    fn of(scene: &Scene, fault: &Fault) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = fault.scene(scene);
        let tables = fault.tables(photographed(&scene, folder.path()));
        let options = Options { starts: STARTS, ..Options::default() };
        let outcome = run(folder.path(), &tables, &scene.start, scene.moves, &options);
        let known = &outcome.identified.known;
        let truths = truths(known.iter().map(|k| &k.name[..]), &scene.truth);
        let one = |(known, truth): (&biscale_fit::uncertainty::identify::Known, &Option<f64>)| {
            let flagged = known.not_identified || (known.scale_assumed && fault.scales_all);
            truth.filter(|_| !flagged).map(|truth| (known.name.clone(), (known.value - truth) / known.sigma))
        };
        Self { off: known.iter().zip(&truths).filter_map(one).collect(), outcome }
    }

    fn worst(&self) -> (&str, f64) {
        self.off.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(("", 0.0), |(name, z)| (&name[..], *z))
    }
}

/// The scenes that are asked for: `SCENES` names some, with semicolons between, or is `drawn:COUNT:SEED`.
fn asked() -> Vec<Scene> {
    let asked = std::env::var("SCENES").unwrap_or_else(|_| "red and blue;grooves".to_owned());
    match asked.split(':').collect::<Vec<_>>()[..] {
        ["drawn", count, seed] => drawn(count.parse().unwrap(), seed.parse().unwrap()),
        _ => scenes().into_iter().filter(|s| asked.split(';').any(|o| s.name == o)).collect(),
    }
}

/// `FAULTS` names some faults, with semicolons between; `SHOW` prints all numbers.
#[test]
#[ignore = "takes an hour"]
fn a_fit_of_faulty_photographs_is_right_or_says_that_it_is_not() {
    let only = std::env::var("FAULTS").ok();
    let (mut counted, mut within, mut confident) = (0.0, [0.0; 3], Vec::new());
    for scene in asked() {
        for fault in FAULTS.iter().filter(|f| only.as_ref().is_none_or(|o| o.split(';').any(|o| f.name == o))) {
            let found = Found::of(&scene, fault);
            let Found { off, outcome } = &found;
            let passed = outcome.failures.is_empty();
            let (name, worst) = found.worst();
            let near = outcome.near.as_ref().map_or(f64::NAN, |n| 100.0 * n.relative_rms);
            let nuisances: Vec<String> = (outcome.identified.known.iter())
                .filter(|k| k.kind == "light" || k.kind == "exposure")
                .map(|k| format!("{:.2}", k.value))
                .collect();
            let pixels: Vec<String> = outcome.compared.iter().map(|c| format!("{:.1}", 100.0 * c.pixel_relative_rms)).collect();
            let seconds: f64 = outcome.seconds.iter().map(|s| s.1).sum();
            println!(
                "{:12} {:26} {} worst {worst:+5.1} {name}; training {:.1} validation {:.1} close-up {near:.1} pixels {} %, objective {:.2}, [{}], {seconds:.0} s",
                scene.name,
                fault.name,
                if passed { "PASS" } else { "fail" },
                100.0 * outcome.training,
                100.0 * outcome.validations.first().map_or(f64::NAN, |v| v.0.relative_rms),
                pixels.join(" "),
                outcome.objective,
                nuisances.join(" ")
            );
            for failure in &outcome.failures {
                println!("      {failure}");
            }
            for cause in &outcome.causes {
                println!("      cause: {} ({:.2?})", cause.remedy, cause.objective_ratio);
            }
            if std::env::var("SHOW").is_ok() {
                for k in &outcome.identified.known {
                    let z = off.iter().find(|(name, _)| *name == k.name).map_or(String::new(), |(_, z)| format!("{z:+.1}"));
                    println!("      {:40} {:.4} +/- {:.4} {z}", k.name, k.value, k.sigma);
                }
                outcome.notes.iter().for_each(|note| println!("      note: {note}"));
            }
            if passed {
                for (_, z) in off {
                    counted += 1.0;
                    (0..3).for_each(|k| within[k] += f64::from(u8::from(z.abs() <= (k + 1) as f64)));
                }
                if worst.is_nan() || worst.abs() > 4.0 {
                    confident.push(format!("{} {}: {name} {worst:+.1}", scene.name, fault.name));
                }
            }
        }
    }
    let share = |k: usize| 100.0 * within[k] / f64::max(counted, 1.0);
    println!(
        "{counted} numbers of fits that pass: {:.0} % within 1, {:.0} % within 2, {:.0} % within 3 standard deviations",
        share(0),
        share(1),
        share(2)
    );
    assert!(confident.is_empty(), "passed, and over 4 standard deviations off: {confident:#?}");
}
