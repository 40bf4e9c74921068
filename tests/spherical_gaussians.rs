//! The method `sg`: against effective BRDFs made by an independent path tracer, and what it promises beside.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::brdf::{Brdf, Measured};
use biscale::direction::Pair;
use biscale::error::Error;
use biscale::filter::{Control, Method, Plan, Quality, Variant, effective, prepare_lobes};
use biscale::material::{SmallScale, Surface, Tint};
use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use support::truth::Truth;

const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];

fn plan(plan: &str) -> Quality {
    Quality { plan: Some(plan.parse().unwrap()), ..Quality::default() }
}

fn to_tolerance(tolerance: f64) -> Quality {
    Quality { method: Method::SphericalGaussian, tolerance, ..Quality::default() }
}

#[test]
fn a_tolerance_is_kept_or_said_to_be_missed_and_the_error_told_is_the_error() {
    for tile in TILES {
        for brdf in ["diffuse", "ggx_0.30"] {
            let truth = Truth::load(tile, brdf);
            let got = truth.run(&to_tolerance(0.1));
            let (error, told) = (truth.relative_error(&got), got.summary.relative_rms);
            assert!(error < 0.1, "{tile} {brdf}: {error}, {:?}", got.summary);
            assert!(told > error / 1.5, "{tile} {brdf}: told {told}, is {error}");
        }
    }
    // The published settings are fixed.
    let truth = Truth::load("weave", "ggx_0.30");
    let got = truth.run(&Quality { variant: Some(Variant::Paper), ..to_tolerance(0.01) });
    assert!(got.summary.notes.iter().any(|n| n.contains("is not met")), "{:?}", got.summary);
}

#[test]
fn few_amplitudes_a_pair_are_enough_and_more_accurate_than_the_published_ones() {
    // 8 amplitudes a pair: dB, and how many more than by the paper's 8 lobes.
    for (tile, brdf, least, better) in [
        ("bumpy", "ggx_0.30", 36.0, 12.0),
        ("bumpy", "ggx_0.05", 36.0, 12.0),
        ("weave", "ggx_0.30", 36.0, 12.0),
        ("weave", "ggx_0.05", 36.0, 12.0),
        ("rods", "ggx_0.30", 36.0, 12.0),
        ("rods", "ggx_0.05", 36.0, 12.0),
    ] {
        let truth = Truth::load(tile, brdf);
        let improved = truth.psnr(&truth.run(&plan("sg:improved:facets=16384:lobes=512:modes=8")));
        let paper = truth.run(&plan("sg:paper"));
        assert!(improved >= least && improved >= truth.psnr(&paper) + better, "{tile} {brdf}: {improved} dB, paper {}", truth.psnr(&paper));
        let (error, told) = (truth.relative_error(&paper), paper.summary.relative_rms);
        assert!((0.67..1.5).contains(&(told / error)), "{tile} {brdf}, paper: told {told}, is {error}");
    }
}

#[test]
fn lists_without_a_pair_above_the_horizon_are_zero() {
    let weave = Truth::load("weave", "ggx_0.30");
    for list in [vec![], vec![Pair { wi: -DVec3::Z, wo: DVec3::Z }], vec![Pair { wi: -DVec3::Z, wo: -DVec3::Z }; 3]] {
        for quality in [to_tolerance(0.1), plan("sg:improved:facets=2048:lobes=32:modes=8")] {
            let got = effective(&weave.surface, &list, &quality, &Control::quiet()).unwrap();
            assert!(got.values.len() == list.len() && got.values.iter().all(|v| v.fbar == [0.0; 3] && v.s == [0.0; 3]), "{:?}", got.values);
        }
    }
}

#[test]
fn surfaces_of_few_normals_are_exact() {
    for tile in ["vgroove", "pyramid"] {
        for brdf in ["diffuse", "ggx_0.30", "ggx_0.05"] {
            let truth = Truth::load(tile, brdf);
            let got = truth.run(&plan("sg:improved:facets=8192:lobes=8:modes=8"));
            assert!(truth.psnr(&got) > 60.0, "{tile} {brdf}: {} dB", truth.psnr(&got));
        }
    }
}

#[test]
fn a_plan_repeats_the_bits_at_any_number_of_threads() {
    let truth = Truth::load("weave", "ggx_0.30");
    for quality in [to_tolerance(0.1), Quality { variant: Some(Variant::Paper), ..to_tolerance(0.1) }, plan("sg:improved:lobes=criterion")]
    {
        let first = truth.run(&quality);
        let again = plan(&first.summary.plan_text());
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        for run in [truth.run(&again), one.install(|| truth.run(&again))] {
            assert_eq!(run.values, first.values, "{}", first.summary.plan_text());
        }
        assert_ne!(truth.run(&Quality { seed: 7, ..again.clone() }).values, first.values);
    }
}

/// The same tile under another BRDF and tint.
fn covered(small: &SmallScale, brdf: &Brdf, tint: Tint) -> SmallScale {
    let mut small = small.clone();
    small.surfaces = vec![Surface { brdf: brdf.clone(), tint, ..small.surfaces[0].clone() }];
    small.surface_of_triangle.fill(0);
    small
}

#[test]
fn every_model_comes_near_to_direct_sums() {
    let truth = Truth::load("bumpy", "diffuse");
    let specular = [0.8, 0.5, 0.2];
    let diffuse = [0.1, 0.2, 0.3];
    let models = [
        Brdf::BlinnPhong { diffuse, specular, exponent: 100.0 },
        Brdf::Ward { diffuse, specular, alpha: 0.2 },
        Brdf::CookTorrance { diffuse, specular, alpha: 0.3, distribution: biscale::brdf::Distribution::Beckmann, f0: Some([0.04; 3]) },
        Brdf::Measured(Arc::new(Measured::fit("alum-bronze", 1.0).unwrap())),
        Brdf::Measured(Arc::new(Measured::fit("blue-fabric", 1.0).unwrap())),
    ];
    for brdf in &models {
        let small = covered(&truth.surface, brdf, Tint::Uniform([0.9, 1.0, 0.5]));
        let control = Control::quiet();
        let direct = effective(&small, &truth.pairs, &Quality { tolerance: 0.005, ..Quality::default() }, &control).unwrap();
        let sg = effective(&small, &truth.pairs, &plan("sg:improved:facets=32768:lobes=1024:modes=8"), &control).unwrap();
        let (mut difference, mut energy) = (0.0, 0.0);
        for (a, b) in sg.values.iter().zip(&direct.values) {
            (0..3).for_each(|c| difference += (a.fbar[c] - b.fbar[c]).powi(2));
            (0..3).for_each(|c| energy += b.fbar[c].powi(2));
        }
        let (error, told) = (f64::sqrt(difference / energy), sg.summary.relative_rms);
        assert!(error < 0.05 && (0.67..1.5).contains(&(told / error)), "{brdf:?}: {error}, told {told}, {:?}", sg.summary.notes);
    }
}

#[test]
fn a_prepared_geometry_has_the_values_of_the_plan_under_any_brdf_and_says_where_it_does_not_hold() {
    let truth = Truth::load("weave", "diffuse");
    let quality = plan("sg:improved:facets=2048:lobes=64:modes=6");
    let Some(Plan::SphericalGaussian(of_lobes)) = &quality.plan else { panic!("a plan of sg") };
    let control = Control::quiet();
    let prepared = prepare_lobes(&truth.surface, &truth.pairs, of_lobes, 0, &control).unwrap();
    let lobe = |alpha| Brdf::CookTorrance {
        diffuse: [0.1; 3],
        specular: [0.8, 0.5, 0.2],
        alpha,
        distribution: biscale::brdf::Distribution::Ggx,
        f0: None,
    };
    for alpha in [0.1, 0.5] {
        let mut edited = truth.surface.clone();
        edited.surfaces.iter_mut().for_each(|surface| surface.brdf = lobe(alpha));
        let expected = effective(&edited, &truth.pairs, &quality, &control).unwrap().values;
        let got = prepared.evaluate(&edited.surfaces, &control).unwrap();
        assert!(got.iter().zip(&expected).all(|(g, e)| g.fbar() == e.fbar && g.s == e.s), "alpha {alpha}");
    }
    let pairs = truth.pairs.len() * 7 * 4 * truth.surface.surfaces.len();
    assert!(prepared.bytes() >= pairs && prepared.bytes() < pairs + 128 * 64 * truth.surface.surfaces.len(), "{}", prepared.bytes());
    let fewer = prepared.evaluate(&[], &control).unwrap_err().to_string();
    assert!(fewer.contains("0 surfaces") && fewer.contains("prepare"), "{fewer}");
}

#[test]
fn sums_for_each_sharpness_have_the_values_of_the_lobes() {
    let truth = Truth::load("weave", "diffuse");
    let control = Control::quiet();
    let prepare = |plan: &str| {
        let quality = self::plan(plan);
        let Some(Plan::SphericalGaussian(plan)) = &quality.plan else { panic!("a plan of sg") };
        prepare_lobes(&truth.surface, &truth.pairs, plan, 0, &control).unwrap()
    };
    let ggx = |alpha| Brdf::CookTorrance {
        diffuse: [0.1; 3],
        specular: [0.8, 0.5, 0.2],
        alpha,
        distribution: biscale::brdf::Distribution::Ggx,
        f0: Some([0.1; 3]),
    };
    let covered = |brdf: &Brdf| {
        let mut surfaces = truth.surface.surfaces.clone();
        surfaces.iter_mut().for_each(|surface| surface.brdf = brdf.clone());
        surfaces
    };
    let models = [
        (Brdf::Lambert { albedo: [0.5, 0.2, 0.1] }, 1e-6),
        (Brdf::BlinnPhong { diffuse: [0.1; 3], specular: [0.8; 3], exponent: 512.0 }, 1e-5),
        (Brdf::Measured(Arc::new(Measured::fit("blue-fabric", 1.0).unwrap())), 1e-5),
        (ggx(0.05), 1e-3),
        (ggx(0.3), 0.02),
        (Brdf::Ward { diffuse: [0.1; 3], specular: [0.5; 3], alpha: 0.2 }, 0.02),
    ];
    for plan in ["sg:improved:facets=2048:lobes=64:modes=6", "sg:paper:lobes=6:brdf=4:integral=closure"] {
        let prepared = prepare(plan);
        let expected: Vec<_> = models.iter().map(|(brdf, _)| prepared.evaluate(&covered(brdf), &control).unwrap()).collect();
        let responses = prepared.into_responses(&control).unwrap();
        for ((brdf, allowed), expected) in models.iter().zip(expected) {
            let got = responses.evaluate(&covered(brdf), &control).unwrap();
            let (mut difference, mut energy) = (0.0, 0.0);
            for (g, e) in got.iter().zip(&expected) {
                assert_eq!(g.av, e.av);
                (0..3).for_each(|c| difference += (g.s[c] - e.s[c]).powi(2));
                (0..3).for_each(|c| energy += e.s[c].powi(2));
            }
            let error = f64::sqrt(difference / energy);
            assert!(energy > 0.0 && error < *allowed, "{plan}, {brdf:?}: {error}");
        }
    }
    // One lobe of any sharpness is on no row.
    let single = prepare("sg:improved:facets=2048:lobes=8:brdf=single").into_responses(&control).unwrap();
    let refused = single.evaluate(&covered(&ggx(0.3)), &control).unwrap_err().to_string();
    assert!(refused.contains("surface 1") && refused.contains("`brdf=2`"), "{refused}");
}

#[test]
fn what_it_cannot_do_it_declines_and_it_stops_when_asked() {
    let truth = Truth::load("vgroove", "diffuse");
    let run = |quality: &Quality, cancel: &AtomicBool| {
        let control = Control { cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        effective(&truth.surface, &truth.pairs, quality, &control)
    };
    let go = AtomicBool::new(false);
    let budget = run(&Quality { budget: Some(1.0), ..to_tolerance(0.1) }, &go).unwrap_err();
    assert!(matches!(budget, Error::Unsupported { .. }) && budget.to_string().contains("`method direct`"), "{budget}");
    let bounces = run(&Quality { bounces: Some(2), ..to_tolerance(0.1) }, &go).unwrap_err();
    assert!(matches!(bounces, Error::BadInput(_)) && bounces.to_string().contains("`method sg`"), "{bounces}");
    for quality in [plan("sg:paper"), to_tolerance(0.02)] {
        let stopped = run(&quality, &AtomicBool::new(true)).unwrap_err();
        assert!(matches!(stopped, Error::Interrupted), "{stopped}");
        // An empty list is no mistake.
        assert!(effective(&truth.surface, &[], &quality, &Control::quiet()).unwrap().values.is_empty());
    }
}

#[test]
fn progress_rises_to_1_while_settings_are_looked_for() {
    let truth = Truth::load("weave", "diffuse");
    let told = std::sync::Mutex::new(Vec::new());
    let progress = |_: &str, share: f64| told.lock().unwrap().push(share);
    let control = Control { progress: &progress, ..Control::quiet() };
    effective(&truth.surface, &truth.pairs, &to_tolerance(0.05), &control).unwrap();
    let told = told.into_inner().unwrap();
    assert!(told.len() > 3 && told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
}
