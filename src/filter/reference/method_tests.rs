use super::*;
use crate::brdf::{Brdf, Distribution};
use crate::direction::MIN_COSINE;
use crate::error::Error;
use crate::filter::tolerance::SAFETY;
use crate::filter::{Method, effective};
use crate::geometry::Tile;
use crate::material::{Surface, Tint, TintImage};
use crate::numerics::random::Random;
use crate::visibility::test_tiles::{direction, extruded, flat, rough, tile, upper, v_groove};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn lambert(albedo: f64) -> Brdf {
    Brdf::Lambert { albedo: [albedo, 0.5 * albedo, 0.0] }
}

fn covered(tile: Tile, brdf: Brdf) -> SmallScale {
    let surface = Surface { part: "*".into(), brdf, tint: Tint::Uniform([1.0; 3]), line: 1 };
    SmallScale { surface_of_triangle: vec![0; tile.triangles.len()], tile, surfaces: vec![surface], bounces: 0 }
}

fn run_with(small: &SmallScale, pairs: &[Pair], quality: Quality) -> Effective {
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    effective(small, pairs, &Quality { method: Method::Reference, ..quality }, &control).unwrap()
}

fn run(small: &SmallScale, pairs: &[Pair], tolerance: f64, seed: u64) -> Effective {
    run_with(small, pairs, Quality { tolerance, seed, ..Quality::default() })
}

fn random_pairs(count: usize, seed: u64) -> Vec<Pair> {
    let mut random = Random::from_state(seed);
    (0..count).map(|_| Pair { wi: upper(&mut random), wo: upper(&mut random) }).collect()
}

/// Closed form of `fbar` for direct light in a symmetric Lambertian V-groove along y of any depth: of each wall the part below
/// the shadow line and below the line of sight is lost, `(t - s)/(t + s)` of it for a slope `t` of the direction in the cross
/// section and `s` of the wall, if `t > s`.
fn v_groove_fbar(wi: DVec3, wo: DVec3, period: f64, depth: f64, albedo: f64) -> f64 {
    let half = 0.5 * period;
    let s = half / depth;
    let wall = |side: f64| {
        let cos = |w: DVec3| ((side * w.x + s * w.z) / (1.0 + s * s).sqrt()).max(0.0);
        let hidden = |w: DVec3| {
            let t = side * w.x / w.z;
            if t > s { (t - s) / (t + s) } else { 0.0 }
        };
        let lit = 1.0 - hidden(wi).max(hidden(wo));
        cos(wi) * cos(wo) * lit * half * (1.0 + 1.0 / (s * s)).sqrt()
    };
    albedo / PI * (wall(1.0) + wall(-1.0)) / (period * wo.z)
}

#[test]
fn a_flat_plane_reflects_albedo_over_pi_times_the_cosine_without_any_noise() {
    for brdf in
        [lambert(0.8), Brdf::CookTorrance { diffuse: [0.1; 3], specular: [0.7; 3], alpha: 0.2, distribution: Distribution::Ggx, f0: None }]
    {
        let small = covered(flat(DVec2::new(2.0, 0.3), 1.5), brdf.clone());
        let pairs = random_pairs(50, 1);
        let result = run(&small, &pairs, 0.005, 1);
        for (value, pair) in result.values.iter().zip(&pairs) {
            let fr = brdf.eval(DVec3::Z, pair.wi, pair.wo);
            for (c, fr) in fr.into_iter().enumerate() {
                assert!((value.fbar[c] - fr * pair.wi.z).abs() <= 1e-12 * fr, "{} at {pair:?}", value.fbar[c]);
                assert!((value.fhat[c] - fr).abs() <= 1e-12 * fr, "{} at {pair:?}", value.fhat[c]);
                assert!((value.s[c] - fr * pair.wi.z * pair.wo.z).abs() <= 1e-12 * fr, "{} at {pair:?}", value.s[c]);
            }
            assert!((value.av - pair.wo.z).abs() < 1e-12, "av {} at {pair:?}", value.av);
        }
        assert!(result.summary.relative_rms < 1e-12, "{}", result.summary.relative_rms);
    }
}

#[test]
fn a_v_groove_agrees_with_its_closed_form_within_its_standard_errors() {
    for (period, depth, seed) in [(1.0, 0.5, 1), (4.0, 6.0, 2), (1e-6, 1e-7, 3), (1e6, 2e6, 4)] {
        let small = covered(v_groove(DVec2::new(period, period), depth), lambert(0.9));
        let mut pairs = random_pairs(100, seed);
        // In the cross plane too, where light and viewer see the same shadow lines.
        let mut random = Random::from_state(seed);
        pairs.extend((0..100).map(|_| {
            let mut across = || direction(1.5 * (2.0 * random.unit() - 1.0), 0.0);
            Pair { wi: across(), wo: across() }
        }));
        let result = run(&small, &pairs, 0.002, seed);
        let (mut inside, mut error, mut energy) = (0, 0.0, 0.0);
        for (value, pair) in result.values.iter().zip(&pairs) {
            let expected = v_groove_fbar(pair.wi, pair.wo, period, depth, 0.9);
            inside += usize::from((value.fbar[0] - expected).abs() <= 3.0 * value.se[0].max(1e-4 * expected + 1e-8));
            error += (value.fbar[0] - expected).powi(2);
            energy += expected * expected;
            // No ray passes through a closed surface.
            assert!((value.av - pair.wo.z).abs() < 1e-9, "av {} at {pair:?}", value.av);
        }
        let relative = (error / energy).sqrt();
        assert!(relative <= 0.002, "{period} x {depth}: off by {relative}, estimated {}", result.summary.relative_rms);
        assert!(inside >= 194, "{period} x {depth}: {inside} of 200 within 3 standard errors");
    }
}

#[test]
fn the_standard_error_tells_the_true_spread() {
    let small = covered(rough(DVec2::ONE, 8, 0.4, 3), lambert(0.7));
    let pairs = random_pairs(40, 5);
    let runs: Vec<Effective> = (0..24).map(|seed| run(&small, &pairs, 1.0, seed)).collect();
    let (mut claimed, mut true_spread) = (0.0, 0.0);
    for k in 0..pairs.len() {
        let mean = runs.iter().map(|r| r.values[k].fbar[0]).sum::<f64>() / runs.len() as f64;
        true_spread += runs.iter().map(|r| (r.values[k].fbar[0] - mean).powi(2)).sum::<f64>() / (runs.len() - 1) as f64;
        claimed += runs.iter().map(|r| r.values[k].se[0].powi(2)).sum::<f64>() / runs.len() as f64;
    }
    let ratio = (claimed / true_spread).sqrt();
    // 40 pairs x 23 degrees of freedom: 2.3 % spread of each root; 10 % is 3 sigma for the two together.
    assert!((ratio - 1.0).abs() < 0.1, "claimed over true: {ratio}");
}

#[test]
fn a_tolerance_is_kept_and_asks_for_more_rays_where_it_is_tighter() {
    let small = covered(v_groove(DVec2::ONE, 0.5), lambert(0.9));
    let pairs = random_pairs(60, 6);
    let mut before = 0;
    for tolerance in [0.02, 0.002, 0.0004] {
        let result = run(&small, &pairs, tolerance, 7);
        assert!(SAFETY * result.summary.relative_rms <= tolerance, "{} for {tolerance}", result.summary.relative_rms);
        assert!(result.summary.facets >= before, "fewer rays for {tolerance}");
        assert!(result.summary.notes.is_empty(), "{:?}", result.summary.notes);
        before = result.summary.facets;
        let (mut error, mut energy) = (0.0, 0.0);
        for (value, pair) in result.values.iter().zip(&pairs) {
            let expected = v_groove_fbar(pair.wi, pair.wo, 1.0, 0.5, 0.9);
            error += (value.fbar[0] - expected).powi(2);
            energy += expected * expected;
        }
        assert!((error / energy).sqrt() <= tolerance, "truly {} for {tolerance}", (error / energy).sqrt());
    }
    assert!(before > 2048, "the tightest tolerance took the first round only");
}

#[test]
fn the_same_bits_come_from_any_thread_count_and_from_the_plan_that_was_printed() {
    let small = covered(rough(DVec2::new(1.0, 2.0), 6, 0.5, 8), lambert(0.6));
    let pairs = random_pairs(12, 9);
    let quality = Quality { tolerance: 0.01, seed: 11, bounces: Some(2), ..Quality::default() };
    let runs: Vec<Effective> = [1, 2, 3]
        .into_iter()
        .map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run_with(&small, &pairs, quality.clone()))
        })
        .collect();
    assert_eq!(runs[0], runs[1]);
    assert_eq!(runs[0], runs[2]);
    assert!(runs[0].summary.plan_text().contains("doublings"), "{}: the test has no second round", runs[0].summary.plan_text());
    let plan = runs[0].summary.plan.clone();
    let repeated = run_with(&small, &pairs, Quality { plan, seed: 11, ..Quality::default() });
    assert_eq!(repeated, runs[0]);
    assert_ne!(run_with(&small, &pairs, Quality { seed: 12, ..quality }).values, runs[0].values);
}

#[test]
fn a_plan_that_is_none_is_refused_by_name() {
    for text in [
        "reference",
        "reference:bounces=x:first=8",
        "reference:bounces=0:first=0",
        "reference:bounces=0:first=4000000000",
        "reference:bounces=0:first=8:doublings=",
        "reference:bounces=0:first=8:doublings=1:",
    ] {
        let error = text.parse::<Plan>().unwrap_err();
        assert!(error.field.as_deref() == Some("plan") && error.problem.contains("`reference`"), "{error}");
    }
    let small = covered(flat(DVec2::ONE, 0.0), lambert(0.5));
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    let quality = Quality { method: Method::Reference, plan: Some("direct:2048x1".parse().unwrap()), ..Quality::default() };
    let error = effective(&small, &[], &quality, &control).unwrap_err();
    assert!(
        matches!(&error, Error::BadInput(bad) if bad.field.as_deref() == Some("plan") && bad.problem.contains("`reference`")),
        "{error}"
    );
}

#[test]
fn a_budget_ends_the_rounds_and_its_plan_repeats_the_bits() {
    let small = covered(rough(DVec2::ONE, 6, 0.5, 8), lambert(0.6));
    let pairs = random_pairs(4, 9);
    // A clock that is called about once a round, and advances by a second each time.
    let ticks = AtomicU64::new(0);
    let clock = || ticks.fetch_add(1, Ordering::Relaxed) as f64;
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &clock };
    let quality = Quality { method: Method::Reference, tolerance: 1e-9, budget: Some(18.0), ..Quality::default() };
    let result = effective(&small, &pairs, &quality, &control).unwrap();
    assert!(result.summary.notes.iter().any(|n| n.contains("time")), "{:?}", result.summary.notes);
    let plan = result.summary.plan.clone();
    let repeated = run_with(&small, &pairs, Quality { plan, ..Quality::default() });
    assert_eq!(repeated.values, result.values);
}

#[test]
fn a_cancelled_run_is_interrupted() {
    let small = covered(flat(DVec2::ONE, 0.0), lambert(0.5));
    let control = Control { cancel: &AtomicBool::new(true), progress: &|_, _| {}, clock: &|| 0.0 };
    let quality = Quality { method: Method::Reference, ..Quality::default() };
    let result = effective(&small, &random_pairs(1, 1), &quality, &control);
    assert!(matches!(result, Err(Error::Interrupted)), "{result:?}");
}

#[test]
fn progress_rises_to_one_and_never_falls() {
    let small = covered(v_groove(DVec2::ONE, 0.5), lambert(0.9));
    let seen = std::sync::Mutex::new(vec![0.0]);
    let progress = |_: &str, share: f64| seen.lock().unwrap().push(share);
    let control = Control { cancel: &AtomicBool::new(false), progress: &progress, clock: &|| 0.0 };
    let quality = Quality { method: Method::Reference, tolerance: 0.001, ..Quality::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| effective(&small, &random_pairs(20, 2), &quality, &control)).unwrap();
    let seen = seen.lock().unwrap();
    assert!(seen.windows(2).all(|w| w[0] <= w[1]), "{seen:?}");
    assert_eq!(seen.last(), Some(&1.0));
}

#[test]
fn directions_below_the_horizon_give_0_and_at_it_the_value_just_above() {
    let small = covered(v_groove(DVec2::ONE, 0.5), lambert(0.9));
    let (up, level, below) = (direction(0.3, 1.0), DVec3::Y, DVec3::new(0.0, 0.8, -0.6));
    let lifted = DVec3::new(0.0, (1.0 - MIN_COSINE * MIN_COSINE).sqrt(), MIN_COSINE);
    let pair = |wi, wo| Pair { wi, wo };
    let list = [pair(below, up), pair(up, below), pair(level, up), pair(up, level), pair(lifted, up), pair(up, lifted), pair(level, level)];
    let values = run(&small, &list, 0.01, 1).values;
    assert_eq!(values[..2], [Value::default(); 2]);
    assert_eq!(values[2].fbar, values[4].fbar);
    assert_eq!(values[3].fbar, values[5].fbar);
    for (value, pair) in values.iter().zip(&list).skip(2) {
        assert!(value.fbar.iter().chain(&value.s).chain(&value.fhat).all(|x| x.is_finite() && *x >= 0.0), "{value:?} at {pair:?}");
        assert!((value.av - pair.wo.z.max(MIN_COSINE)).abs() < 1e-9, "{value:?} at {pair:?}");
    }
    assert!(values[3].fbar[0] > 0.0, "grazing along the groove the walls are seen");
}

#[test]
fn a_viewer_who_sees_only_gaps_or_back_faces_gets_0_and_a_note() {
    let sheet = vec![DVec3::ZERO, DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.5, 0.5, 0.0), DVec3::new(0.0, 0.5, 0.0)];
    let upside_down = covered(tile(DVec2::ONE, sheet.clone(), vec![[0, 2, 1], [0, 3, 2]]), lambert(0.9));
    let wall = vec![DVec3::ZERO, DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1.0), DVec3::Z];
    let edge_on = covered(tile(DVec2::ONE, wall, vec![[0, 1, 2], [0, 2, 3]]), lambert(0.9));
    for small in [upside_down, edge_on] {
        let result = run(&small, &[Pair { wi: direction(0.5, 0.3), wo: DVec3::Z }], 0.01, 1);
        assert_eq!(result.values, [Value::default()]);
        assert!(result.summary.notes.iter().any(|n| n.contains("front face")), "{:?}", result.summary.notes);
    }
    // A quarter is covered: av is a quarter, and fbar that of the covered part.
    let quarter = covered(tile(DVec2::ONE, sheet, vec![[0, 1, 2], [0, 2, 3]]), lambert(0.9));
    let value = run(&quarter, &[Pair { wi: direction(0.5, 0.3), wo: DVec3::Z }], 1e-4, 1).values[0];
    assert!((value.av - 0.25).abs() < 1e-3, "{value:?}");
    assert!((value.fbar[0] - 0.9 / PI * 0.5_f64.cos()).abs() < 1e-12, "{value:?}");
}

#[test]
fn tints_are_taken_where_the_ray_hits() {
    // Red where u < 1/2, green elsewhere; the tile's second triangle carries uv of its own.
    let mut tile = flat(DVec2::ONE, 0.0);
    let uv = |p: DVec3| DVec2::new(p.x, p.y) * 0.999 + 0.0005;
    tile.uv = Some((0..2).map(|t| tile.corners(t).map(uv)).collect());
    let mut small = covered(tile, Brdf::Lambert { albedo: [1.0; 3] });
    let image = TintImage { width: 4, height: 1, pixels: vec![[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]] };
    small.surfaces[0].tint = Tint::Image(Arc::new(image));
    let value = run(&small, &[Pair { wi: DVec3::Z, wo: direction(0.7, 2.0) }], 1e-3, 1).values[0];
    for (c, expected) in [0.5 / PI, 0.5 / PI, 0.0].into_iter().enumerate() {
        assert!((value.fbar[c] - expected).abs() < 2e-3, "channel {c}: {value:?}");
    }
}

#[test]
fn interreflections_conserve_energy_in_a_white_groove() {
    // A white V-groove under light from everywhere looks white from everywhere: the integral of fbar over wi is 1.
    let small = covered(v_groove(DVec2::ONE, 0.5), Brdf::Lambert { albedo: [1.0, 0.5, 0.0] });
    let mut random = Random::from_state(12);
    // wi by 16 x 16 strata, uniform in the projected solid angle: the integral of fbar is the mean of pi fbar / cos.
    let wo = direction(0.8, 0.4);
    let pairs: Vec<Pair> = (0..256)
        .map(|k| {
            let (u, v) = ((f64::from(k % 16) + random.unit()) / 16.0, (f64::from(k / 16) + random.unit()) / 16.0);
            Pair { wi: direction(u.sqrt().asin(), 2.0 * PI * v), wo }
        })
        .collect();
    let integral = |bounces: u32| {
        let result = run_with(&small, &pairs, Quality { tolerance: 0.02, bounces: Some(bounces), ..Quality::default() });
        let mean = |c: usize| result.values.iter().zip(&pairs).map(|(v, p)| PI * v.fbar[c] / p.wi.z).sum::<f64>() / 256.0;
        [mean(0), mean(1), mean(2)]
    };
    let direct = integral(0);
    let full = integral(200);
    assert!(direct[0] < 0.85, "direct light alone: {direct:?}");
    assert!((full[0] - 1.0).abs() < 0.02, "with interreflections: {full:?}");
    assert!(full[1] < 0.55 && full[1] > direct[1], "albedo 1/2: {full:?}, direct {direct:?}");
    assert_eq!(full[2], 0.0);
}

#[test]
fn light_and_viewer_can_change_places_with_bounces_and_glossy_walls_too() {
    let glossy = Brdf::CookTorrance { diffuse: [0.3; 3], specular: [0.6; 3], alpha: 0.2, distribution: Distribution::Ggx, f0: None };
    let small = covered(v_groove(DVec2::ONE, 0.7), glossy);
    let pairs = random_pairs(16, 13);
    let swapped: Vec<Pair> = pairs.iter().map(|p| Pair { wi: p.wo, wo: p.wi }).collect();
    for bounces in [0, 3] {
        let plan = Some(format!("reference:bounces={bounces}:first=512").parse().unwrap());
        let run =
            |pairs: &[Pair]| run_with(&small, pairs, Quality { plan: plan.clone(), bounces: Some(bounces), ..Quality::default() }).values;
        for ((value, back), pair) in run(&pairs).iter().zip(&run(&swapped)).zip(&pairs) {
            let (off, se) = ((value.s[0] - back.s[0]).abs(), value.s_se[0].hypot(back.s_se[0]));
            // Two errors of 15 degrees of freedom each: beyond 5 of them lie 2 of 100,000 values.
            assert!(off <= 5.0 * se, "{bounces} bounces: S {} and back {}, standard error {se}, at {pair:?}", value.s[0], back.s[0]);
        }
    }
}

#[test]
fn every_further_bounce_adds_light_by_a_falling_factor() {
    let small = covered(v_groove(DVec2::ONE, 1.0), lambert(0.8));
    let pair = [Pair { wi: direction(0.2, 1.0), wo: direction(0.4, 2.0) }];
    let light: Vec<f64> = [0, 1, 2, 23]
        .into_iter()
        .map(|bounces| {
            run_with(&small, &pair, Quality { tolerance: 0.002, bounces: Some(bounces), ..Quality::default() }).values[0].fbar[0]
        })
        .collect();
    let (first, second, rest) = (light[1] - light[0], light[2] - light[1], light[3] - light[2]);
    assert!(first > 0.0 && second > 0.0 && second < 0.8 * first, "{light:?}");
    assert!(rest < second * 4.0 && rest > 0.3 * second, "{light:?}");
}

#[test]
fn rays_that_are_given_up_count_as_free_and_enter_the_error() {
    // A trench 1e4 deep for its width: light at the horizon nearly along it needs 1e8 periods to leave.
    let trench = extruded(DVec2::ONE, &[(0.0, 1e4), (0.5, 1e4), (0.5, 0.0), (1.0, 0.0), (1.0, 1e4)]);
    let small = covered(trench, lambert(0.9));
    // 128 rays are enough to see it, and each passes 65,536 periods.
    let quality = Quality { plan: Some("reference:bounces=0:first=8".parse().unwrap()), ..Quality::default() };
    let result = run_with(&small, &[Pair { wi: DVec3::new(1e-9, 1.0, 0.0).normalize(), wo: DVec3::Z }], quality);
    let value = result.values[0];
    assert!(value.se[0] >= 0.3 * value.fbar[0], "half of what is seen is in doubt: {value:?}");
    assert!(result.summary.notes.iter().any(|n| n.contains("periods")), "{:?}", result.summary.notes);
}

/// A floor, and over it walls half a period high that face +y. Their distance from the floor changes nothing of what floor and walls show of each other:
/// each ray of a slope meets the same share of the walls, and each point of the floor is shadowed as long.
fn floor_under_walls(distance: f64) -> SmallScale {
    let floor = flat(DVec2::ONE, 0.0);
    let first = floor.vertices.len() as u32;
    let wall = [(1.0, 0.0), (0.0, 0.0), (0.0, 0.5), (1.0, 0.5)].map(|(x, z)| DVec3::new(x, 0.5, distance + z));
    let triangles = [floor.triangles, vec![[first, first + 1, first + 2], [first, first + 2, first + 3]]].concat();
    covered(tile(DVec2::ONE, [floor.vertices, wall.to_vec()].concat(), triangles), lambert(0.9))
}

#[test]
fn bounces_that_are_given_up_enter_the_error_and_leave_the_value() {
    // Rays from the floor rise 1e5 to the walls: those that climb less than 1.5 a period are given up.
    let (near, far) = (floor_under_walls(0.1), floor_under_walls(1e5));
    let pair = [Pair { wi: DVec3::new(0.0, 0.3, 1.0).normalize(), wo: DVec3::Z }];
    let run = |small, bounces| {
        let plan = Some(format!("reference:bounces={bounces}:first=32").parse().unwrap());
        run_with(small, &pair, Quality { plan, ..Quality::default() })
    };
    let results = [run(&near, 1), run(&far, 1), run(&far, 0)];
    let notes = results.each_ref().map(|result| result.summary.notes.join("; "));
    assert!(notes[1].contains("periods") && notes[0].is_empty() && notes[2].is_empty(), "{notes:?}");
    let [truth, value, direct] = results.map(|result| result.values[0]);
    for c in 0..2 {
        let missed = truth.fbar[c] - value.fbar[c];
        let noise = truth.se[c].hypot(direct.se[c]);
        assert!(missed > 4.0 * noise, "channel {c}: {missed} for a noise of {noise}");
        assert!(missed <= value.se[c] && value.se[c] <= value.fbar[c], "channel {c}: {value:?} misses {missed}");
        assert!((value.s_se[c] / value.se[c] - 1.0).abs() < 1e-9, "all of the floor is seen, from straight above: {value:?}");
        assert!(value.fbar[c] >= direct.fbar[c] - 3.0 * noise, "{value:?} and {direct:?}");
    }
    // The blue channel is black: nothing is lost there.
    assert_eq!((value.fbar[2], value.se[2]), (0.0, 0.0));
}

#[test]
fn a_viewer_whose_rays_are_all_given_up_sees_0_with_an_error() {
    // Along thin walls 1e4 high over nothing.
    let wall = vec![DVec3::ZERO, DVec3::new(0.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 1e4), DVec3::new(0.0, 0.0, 1e4)];
    let small = covered(tile(DVec2::ONE, wall, vec![[0, 1, 2], [0, 2, 3]]), lambert(0.9));
    let quality = Quality { plan: Some("reference:bounces=0:first=1".parse().unwrap()), ..Quality::default() };
    let result = run_with(&small, &[Pair { wi: DVec3::Z, wo: DVec3::Y }], quality);
    let value = result.values[0];
    assert_eq!((value.fbar, value.av, value.se), ([0.0; 3], 0.0, [1.0 / PI; 3]));
    assert!((value.s_se[0] - MIN_COSINE / PI).abs() < 1e-12, "{value:?}");
    assert!(matches!(&result.summary.notes[..], [note] if note.contains("periods")), "{:?}", result.summary.notes);
}
