//! The low-rank method: against effective BRDFs made by an independent path tracer, and what it promises beside.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::error::Error;
use biscale::filter::{Control, MatrixCache, Method, Quality, Variant, effective};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use support::truth::Truth;

const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];
/// Smaller maps for `M` than the paper's largest, which would take minutes for the narrower lobe.
const PAPER: &str = "lowrank:paper:rates=16x32";

fn plan(plan: &str) -> Quality {
    Quality { plan: Some(plan.parse().unwrap()), ..Quality::default() }
}

fn improved(tolerance: f64) -> Quality {
    Quality { method: Method::LowRank, variant: Some(Variant::Improved), tolerance, ..Quality::default() }
}

#[test]
fn as_published_it_is_at_least_as_accurate_as_the_paper_says_and_tells_its_error() {
    for tile in TILES {
        for brdf in ["diffuse", "ggx_0.30"] {
            let truth = Truth::load(tile, brdf);
            let got = truth.run(&plan(PAPER));
            // Table 4 of the paper: 17.36 to 22.66 dB.
            let (psnr, error) = (truth.psnr(&got), truth.relative_error(&got));
            assert!(psnr >= 20.0, "{tile} {brdf}: {psnr:.1} dB");
            let told = got.summary.relative_rms;
            assert!((0.67..1.5).contains(&(told / error)), "{tile} {brdf}: told {told}, is {error}");
        }
    }
}

#[test]
fn improved_it_keeps_the_tolerance_that_it_says_it_does() {
    for tile in TILES {
        for (brdf, least) in [("diffuse", 37.0), ("ggx_0.30", 37.0), ("ggx_0.05", 32.0)] {
            let truth = Truth::load(tile, brdf);
            let got = truth.run(&improved(0.02));
            let (psnr, error) = (truth.psnr(&got), truth.relative_error(&got));
            assert!(psnr >= least, "{tile} {brdf}: {psnr:.1} dB");
            assert!(error <= 0.02, "{tile} {brdf}: {error}, {:?}", got.summary);
        }
    }
}

#[test]
fn the_ranks_are_those_of_the_surface() {
    // Two sides of a groove: one normal a surface, so N and M have rank 1.
    let got = Truth::load("vgroove", "ggx_0.30").run(&improved(0.02));
    assert!(got.summary.low_rank.iter().all(|f| f.n_rank <= 1 && f.m_rank <= 1), "{:?}", got.summary.low_rank);
    let got = Truth::load("bumpy", "diffuse").run(&plan(PAPER));
    let facts = got.summary.low_rank[0];
    assert!((5..=50).contains(&facts.n_rank) && facts.m_rank < 20 && facts.m_energy >= 0.98, "{facts:?}");
    // Fewer vectors, larger errors (Fig. 11).
    let truth = Truth::load("bumpy", "diffuse");
    let few = truth.run(&plan("lowrank:paper:rates=16x32:energy=0.3,0.98"));
    assert!(few.summary.low_rank[0].n_rank < facts.n_rank && truth.relative_error(&few) > truth.relative_error(&got), "{:?}", few.summary);
}

#[test]
fn a_plan_repeats_the_bits_at_any_number_of_threads_and_from_the_cache() {
    let folder = tempfile::tempdir().unwrap();
    let cache = MatrixCache { folder: folder.path().to_path_buf(), max_bytes: 1 << 30 };
    for (tile, quality) in [("weave", plan("lowrank:paper:facets=1000:rates=14x20")), ("weave", improved(0.05))] {
        let truth = Truth::load(tile, "ggx_0.30");
        let first = truth.run(&quality);
        let again = plan(&first.summary.plan_text());
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        for run in [
            truth.run(&again),
            one.install(|| truth.run(&again)),
            truth.run(&Quality { cache: Some(cache.clone()), ..again.clone() }),
            truth.run(&Quality { cache: Some(cache.clone()), ..again.clone() }),
        ] {
            assert_eq!(run.values, first.values, "{}", first.summary.plan_text());
        }
        assert_ne!(truth.run(&Quality { seed: 7, ..again.clone() }).values, first.values);
    }
    assert!(!cache.list().unwrap().is_empty());
    // A file that is no matrix is told, and replaced.
    for entry in cache.list().unwrap() {
        std::fs::write(entry.path, "no matrix").unwrap();
    }
    let truth = Truth::load("weave", "ggx_0.30");
    let quality = Quality { cache: Some(cache.clone()), ..plan("lowrank:paper:facets=1000:rates=14x20") };
    let run = truth.run(&quality);
    assert!(run.summary.notes.iter().any(|n| n.contains("computed again")), "{:?}", run.summary.notes);
    assert!(truth.run(&quality).summary.notes.iter().all(|n| !n.contains("computed again")));
    assert!(cache.list().unwrap().iter().all(|e| e.label.is_some()));
}

#[test]
fn what_it_cannot_do_it_declines_and_it_stops_when_asked() {
    let truth = Truth::load("vgroove", "diffuse");
    let run = |quality: &Quality, cancel: &AtomicBool| {
        let control = Control { cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        effective(&truth.surface, &truth.pairs, quality, &control)
    };
    let go = AtomicBool::new(false);
    let budget = run(&Quality { method: Method::LowRank, budget: Some(1.0), ..Quality::default() }, &go).unwrap_err();
    assert!(matches!(budget, Error::Unsupported { .. }) && budget.to_string().contains("`method direct`"), "{budget}");
    let bounces = run(&Quality { method: Method::LowRank, bounces: Some(2), ..Quality::default() }, &go).unwrap_err();
    assert!(matches!(bounces, Error::BadInput(_)), "{bounces}");
    for quality in [plan(PAPER), improved(0.02)] {
        let stopped = run(&quality, &AtomicBool::new(true)).unwrap_err();
        assert!(matches!(stopped, Error::Interrupted), "{stopped}");
    }
    // An empty list is no mistake.
    let control = Control { cancel: &go, progress: &|_, _| {}, clock: &|| 0.0 };
    for quality in [plan(PAPER), improved(0.02)] {
        assert!(effective(&truth.surface, &[], &quality, &control).unwrap().values.is_empty());
    }
}

#[test]
fn progress_rises_to_1_over_all_stages() {
    let truth = Truth::load("weave", "ggx_0.30");
    let cancel = AtomicBool::new(false);
    let told: Mutex<Vec<(String, f64)>> = Mutex::default();
    let progress = |stage: &str, share: f64| told.lock().unwrap().push((stage.to_owned(), share));
    let control = Control { cancel: &cancel, progress: &progress, clock: &|| 0.0 };
    effective(&truth.surface, &truth.pairs, &plan("lowrank:paper:facets=500:rates=14x20"), &control).unwrap();
    let told = told.into_inner().unwrap();
    let shares: Vec<f64> = told.iter().map(|(_, share)| *share).collect();
    assert!(shares.is_sorted() && shares.first() == Some(&0.0) && shares.last() == Some(&1.0), "{told:?}");
    for stage in ["matrix M of surface 1 of 2", "matrix M of surface 2 of 2", "sums"] {
        assert!(told.iter().filter(|(s, _)| s == stage).count() > 1, "{stage}: {told:?}");
    }
}
