//! What is known exactly of effective BRDFs: closed forms, reciprocity, energy, and results that do not depend on how they are run.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Method, Quality, effective};
use biscale::material::SmallScale;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;
use support::*;

const PYRAMIDS: &str = "kind = \"pyramids\"";
const RODS: &str = "kind = \"rods\"\ncount = 12\nradius = 0.05\nlean_deg = 20";
const WEAVE: &str = "kind = \"weave\"\nsegments = 8\nsteps = 4";
const HEIGHT_FIELD: &str =
    "kind = \"height-field\"\nfile = \"samples/hammered.png\"\nwidth = 1.0\nheight = 0.2\nresolution = 48\nedge = \"mirror\"";
const WAVY: &str =
    "kind = \"height-field\"\nfile = \"samples/hammered.png\"\nwidth = 1.0\nheight = 0.05\nresolution = 32\nedge = \"mirror\"";
const GGX: &str = r#"{ model = "cook-torrance", diffuse = [0.4, 0.2, 0.0], specular = [0.6, 0.8, 1.0], alpha = 0.3 }"#;
const BECKMANN: &str = r#"{ model = "cook-torrance", specular = 1.0, alpha = 0.5, distribution = "beckmann", f0 = [0.9, 0.5, 0.1] }"#;
const WHITE: &str = r#"{ model = "lambert", albedo = 1.0 }"#;

/// Surfaces through which no ray from above passes.
const CLOSED: [(&str, &str); 6] = [
    ("V-grooves", "kind = \"grooves\"\nprofile = \"v\""),
    ("flat-bottomed grooves", "kind = \"grooves\"\nfloor_width = 0.3\ntop_width = 0.2\ndepth = 0.4"),
    ("sawtooth", "kind = \"grooves\"\nprofile = \"sawtooth\"\nsteep_angle_deg = 70"),
    ("pyramids", PYRAMIDS),
    ("pits", "kind = \"pyramids\"\nsides = 5\nheight = -0.4\ngap = 0.1"),
    ("height field", HEIGHT_FIELD),
];

/// Directions distributed by their cosine: the integral over the hemisphere is `pi / N` times the sum of the integrand over its cosine.
fn cosine_nodes(count: u32) -> Vec<glam::DVec3> {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    (0..count)
        .map(|k| {
            let sin2 = (f64::from(k) + 0.5) / f64::from(count);
            let (sin, phi) = (sin2.sqrt(), std::f64::consts::TAU * (f64::from(k) * golden).fract());
            glam::DVec3::new(sin * phi.cos(), sin * phi.sin(), (1.0 - sin2).sqrt())
        })
        .collect()
}

#[test]
fn a_flat_plane_reflects_albedo_over_pi_times_the_cosine_at_any_azimuth() {
    let pairs: Vec<Pair> =
        (0..24).map(f64::from).map(|k| pair(3.7 * k, 53.0 * k, (31.0 * k) % 89.0, 117.0 * k)).chain(some_pairs()).collect();
    let exact: Vec<[f64; 3]> = pairs.iter().map(|p| flat_fbar(p.wi.z)).collect();
    for (name, plane) in [("mesh", mesh(PLANE, [1.0, 1.0], LAMBERT)), ("grooves of depth 0", v_groove(0.3, 0.0, LAMBERT))] {
        for (result, rounding) in [(direct(&plane, &pairs, QUICK), 3e-6), (reference(&plane, &pairs, 0.005), 1e-12)] {
            let method = result.summary.method;
            for ((v, p), exact) in result.values.iter().zip(&pairs).zip(&exact) {
                for c in 0..3 {
                    let off = (v.fbar[c] / exact[c] - 1.0).abs();
                    assert!(off <= rounding, "{name}, {method}, {p:?}: {} for {}", v.fbar[c], exact[c]);
                    assert!((v.fhat[c] * PI / ALBEDO[c] - 1.0).abs() <= rounding, "{name}, {method}, {p:?}: fhat {}", v.fhat[c]);
                    let s = exact[c] * p.wo.z;
                    assert!((v.s[c] / s - 1.0).abs() <= rounding, "{name}, {method}, {p:?}: S {} for {s}", v.s[c]);
                    assert!(v.se[c] <= rounding * exact[c], "{name}, {method}, {p:?}: standard error {}", v.se[c]);
                }
                assert!((v.av / p.wo.z - 1.0).abs() <= rounding, "{name}, {method}, {p:?}: av {}", v.av);
            }
        }
    }
}

#[test]
fn a_v_groove_has_its_closed_form_in_its_cross_plane_and_for_any_directions() {
    let across: Vec<f64> = vec![-80.0, -60.0, -35.0, -10.0, 0.0, 25.0, 45.0, 70.0];
    let cross_plane = across.iter().flat_map(|&i| across.iter().map(move |&o| pair(i, 0.0, o, 0.0)));
    let pairs: Vec<Pair> = cross_plane.chain(some_pairs()).collect();
    for (period, depth) in [(1.0, 0.5), (0.7, 0.1), (2.0, 3.0)] {
        let groove = v_groove(period, depth, LAMBERT);
        let exact: Vec<[f64; 3]> = pairs.iter().map(|p| v_groove_fbar(p, period, depth)).collect();
        let expected: Vec<_> = exact.iter().map(|&e| (e, [0.0; 3])).collect();
        for method in [Method::Direct, Method::Reference] {
            let result = run(&groove, &pairs, &Quality { method, ..Quality::default() });
            let what = format!("V-groove {period} x {depth}, {}", result.summary.method);
            let rms = relative_rms(&result, &exact);
            assert!(rms <= 0.005, "{what}: relative RMS {rms}, said to be {}", result.summary.relative_rms);
            assert_near(&result, &expected, 1e-5, &what);
        }
    }
}

#[test]
fn a_surface_without_holes_shows_its_footprint_times_the_cosine() {
    /// Samples and seeds: their spread is the error of `av`.
    const SEEDS: u64 = 16;
    let angles = [(0.0, 0.0), (15.0, 80.0), (40.0, 200.0), (60.0, 10.0), (75.0, 130.0), (82.0, 300.0)];
    let pairs: Vec<Pair> = angles.iter().map(|&(theta, phi)| pair(30.0, 30.0, theta, phi)).collect();
    let (mut near, mut all) = (0, 0);
    for (name, geometry) in CLOSED {
        let small = surface(geometry, LAMBERT);
        let runs: Vec<Effective> = (0..SEEDS)
            .map(|seed| run(&small, &pairs, &Quality { seed, plan: "direct:4096x1".parse().ok(), ..Quality::default() }))
            .collect();
        for (k, pair) in pairs.iter().enumerate() {
            let av: Vec<f64> = runs.iter().map(|r| r.values[k].av).collect();
            let mean = av.iter().sum::<f64>() / SEEDS as f64;
            let variance = av.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / (SEEDS * (SEEDS - 1)) as f64;
            let (off, se) = ((mean - pair.wo.z).abs(), variance.sqrt());
            assert!(off <= 6.0 * se + 3e-6, "{name}, {:?}: av {mean}, standard error {se:e}", pair.wo);
            assert!(off <= 0.01 * pair.wo.z, "{name}, {:?}: av {mean}", pair.wo);
            near += usize::from(off <= 3.0 * se + 3e-6);
            all += 1;
        }
        for (value, pair) in reference(&small, &pairs, 0.05).values.iter().zip(&pairs) {
            assert!((value.av - pair.wo.z).abs() < 1e-12, "{name}, reference, {:?}: av {}", pair.wo, value.av);
        }
    }
    assert!(near as f64 >= 0.95 * f64::from(all), "{near} of {all} areas within 3 standard errors");
}

#[test]
fn the_kernel_is_reciprocal_to_the_last_bit_for_every_model() {
    let blinn = r#"{ model = "blinn-phong", diffuse = 0.2, specular = [0.1, 0.5, 0.3], exponent = 40 }"#;
    let ward = r#"{ model = "ward", diffuse = 0.1, specular = 0.6, alpha = 0.25 }"#;
    let narrow = r#"{ model = "cook-torrance", specular = 0.6, alpha = 0.02, f0 = 0.04 }"#;
    for brdf in [LAMBERT, blinn, GGX, BECKMANN, ward, narrow] {
        let result = sound_and_reciprocal(&surface(RODS, brdf), &some_pairs(), QUICK, brdf);
        assert!(result.values.iter().any(|v| v.s[0] > 0.0), "{brdf}: all is black");
    }
}

#[test]
fn the_reference_is_reciprocal_within_its_error() {
    let there = some_pairs();
    let back: Vec<Pair> = there.iter().map(|p| Pair { wi: p.wo, wo: p.wi }).collect();
    let rods = surface(RODS, GGX);
    let (there, back) = (reference(&rods, &there, 0.02), reference(&rods, &back, 0.02));
    for (k, (a, b)) in there.values.iter().zip(&back.values).enumerate() {
        for c in 0..3 {
            let (off, se) = ((a.s[c] - b.s[c]).abs(), a.s_se[c].hypot(b.s_se[c]));
            assert!(off <= 4.5 * se + 1e-12, "pair {k}: {} and {}, combined standard error {se:e}", a.s[c], b.s[c]);
        }
    }
}

#[test]
fn a_white_plane_in_a_white_furnace_is_white() {
    let plane = mesh(PLANE, [1.0, 1.0], WHITE);
    let nodes = cosine_nodes(64);
    for theta in [0.0, 50.0, 89.0] {
        let pairs: Vec<Pair> = nodes.iter().map(|&wi| Pair { wi, wo: direction(theta, 70.0) }).collect();
        for result in [direct(&plane, &pairs, QUICK), reference(&plane, &pairs, 0.01)] {
            let albedo = PI / nodes.len() as f64 * result.values.iter().map(|v| v.fhat[0]).sum::<f64>();
            assert!((albedo - 1.0).abs() < 3e-6, "{} at {theta} degrees: {albedo}", result.summary.method);
        }
    }
}

#[test]
fn no_surface_reflects_more_than_it_receives() {
    let nodes = cosine_nodes(256);
    let share = PI / nodes.len() as f64;
    for geometry in [CLOSED[0].1, CLOSED[1].1, PYRAMIDS, RODS] {
        for brdf in [WHITE, GGX, BECKMANN] {
            let small = surface(geometry, brdf);
            for (theta, phi) in [(0.0, 0.0), (50.0, 20.0), (80.0, 250.0)] {
                let fixed = direction(theta, phi);
                let from: Vec<Pair> = nodes.iter().map(|&wi| Pair { wi, wo: fixed }).collect();
                let values = direct(&small, &from, QUICK).values;
                for c in 0..3 {
                    // The errors of values that share facets may add up.
                    let sum = |f: &dyn Fn(usize) -> f64| share * (0..nodes.len()).map(f).sum::<f64>();
                    let (albedo, se) = (sum(&|k| values[k].fhat[c]), sum(&|k| values[k].se[c] / nodes[k].z));
                    let what = format!("{geometry}\n{brdf}, {theta} degrees, channel {c}");
                    assert!(albedo <= 1.0 + 3.0 * se + 1e-5, "{what}: reflects {albedo}, standard error {se:e}");
                    assert!(albedo > 0.2 || brdf != WHITE, "{what}: reflects only {albedo}");
                    // By symmetry S(fixed, node) = S(node, fixed): the light comes from `fixed`.
                    let (sent, se) = (sum(&|k| values[k].s[c] / nodes[k].z), sum(&|k| values[k].s_se[c] / nodes[k].z));
                    let received = values[0].av;
                    assert!(sent <= received + 3.0 * se + 1e-5, "{what}: sends {sent} of {received}, standard error {se:e}");
                }
            }
        }
    }
}

#[test]
fn direct_agrees_with_the_reference_on_rods_a_weave_and_a_height_field() {
    // Errors of pairs and channels of one run go together: 95 % within 3 combined standard errors holds pooled over seeds.
    let pairs = some_pairs();
    for (geometry, brdf) in [(RODS, LAMBERT), (WEAVE, GGX), (HEIGHT_FIELD, GGX), (HEIGHT_FIELD, LAMBERT)] {
        let small = surface(geometry, brdf);
        let (mut near, mut all) = (0, 0);
        for seed in 0..4 {
            let with = |method, plan| run(&small, &pairs, &Quality { method, seed, tolerance: 0.03, plan, ..Quality::default() });
            let (direct, reference) = (with(Method::Direct, "direct:4096x1".parse().ok()), with(Method::Reference, None));
            let expected: Vec<_> = reference.values.iter().map(|v| (v.fbar, v.se)).collect();
            let within = count_near(&direct, &expected, 1e-5, geometry);
            assert!(
                within.0 as f64 >= 0.8 * within.1 as f64,
                "{geometry}, seed {seed}: {} of {} within 3 standard errors",
                within.0,
                within.1
            );
            near += within.0;
            all += within.1;
        }
        assert!(near as f64 >= 0.95 * all as f64, "{geometry}: {near} of {all} values within 3 standard errors");
    }
}

/// Runs on a given number of threads.
fn on_threads(threads: usize, small: &SmallScale, pairs: &[Pair], quality: &Quality) -> Effective {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| run(small, pairs, quality))
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let pairs = some_pairs();
    for geometry in [RODS, WEAVE] {
        let small = surface(geometry, GGX);
        for method in [Method::Direct, Method::Reference] {
            let quality = Quality { method, tolerance: 0.03, ..Quality::default() };
            let [one, two] = [1, 2].map(|threads| on_threads(threads, &small, &pairs, &quality));
            assert_eq!(one.values, two.values, "{}, {geometry}", one.summary.method);
            assert_eq!(one.summary.plan, two.summary.plan);
        }
    }
}

#[test]
fn another_seed_gives_other_values_that_agree() {
    let (small, pairs) = (surface(RODS, GGX), some_pairs());
    for method in [Method::Direct, Method::Reference] {
        let [a, b] = [3, 1 << 40].map(|seed| run(&small, &pairs, &Quality { method, seed, tolerance: 0.03, ..Quality::default() }));
        assert_ne!(a.values, b.values, "{}", a.summary.method);
        assert_agree(&a, &b, 0.0, a.summary.method);
    }
}

/// Runs to a tolerance, and then by the plan of that run and the default tolerance.
fn assert_plan_repeats(geometry: &str, pairs: &[Pair], method: Method, tolerance: f64) {
    let small = surface(geometry, LAMBERT);
    let first = run(&small, pairs, &Quality { method, tolerance, seed: 5, ..Quality::default() });
    let plan = first.summary.plan.clone();
    let again = run(&small, pairs, &Quality { method, seed: 5, plan: plan.clone(), ..Quality::default() });
    assert!(first.values == again.values, "{geometry}: {} gave other values", first.summary.plan_text());
    assert_eq!(plan, again.summary.plan, "{geometry}");
    assert_eq!(first.summary.relative_rms, again.summary.relative_rms, "{geometry}, {plan:?}");
    assert_eq!(first.summary.clusters, again.summary.clusters, "{geometry}, {plan:?}");
}

#[test]
fn the_plan_of_a_summary_repeats_its_bits() {
    assert_plan_repeats(RODS, &some_pairs(), Method::Direct, 0.02);
    assert_plan_repeats(RODS, &some_pairs(), Method::Reference, 0.03);
}

#[test]
fn the_plan_repeats_its_bits_whatever_the_tolerance_made_of_the_clusters() {
    // Clusters of unequal normals would take too much of the first tolerance, which is not repeated.
    for tolerance in [0.002, 0.05] {
        assert_plan_repeats(WAVY, &some_pairs(), Method::Direct, tolerance);
    }
}

#[test]
fn the_plan_of_a_long_list_repeats_its_bits() {
    // 260 directions have more distinct pairs than the direct method tries samples on at once.
    let nodes = cosine_nodes(260);
    let many: Vec<Pair> = nodes.iter().flat_map(|&wi| nodes.iter().map(move |&wo| Pair { wi, wo })).collect();
    assert_plan_repeats(CLOSED[0].1, &many, Method::Direct, 0.05);
}

#[test]
fn the_plan_of_a_run_with_a_budget_repeats_its_bits() {
    let (small, pairs) = (surface(RODS, GGX), some_pairs());
    for method in [Method::Direct, Method::Reference] {
        // What a real clock allows differs from run to run; what the plan then repeats may not.
        let start = std::time::Instant::now();
        let clock = || start.elapsed().as_secs_f64();
        let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &clock };
        let quality = Quality { method, tolerance: 1e-6, budget: Some(0.05), seed: 9, ..Quality::default() };
        let first = effective(&small, &pairs, &quality, &control).unwrap();
        assert!(first.summary.notes.iter().any(|n| n.contains("tolerance")), "no note that the tolerance is missed");
        let again = run(&small, &pairs, &Quality { method, plan: first.summary.plan.clone(), seed: 9, ..Quality::default() });
        assert_eq!(first.values, again.values, "{}", first.summary.plan_text());
    }
}
