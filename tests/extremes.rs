//! The extremes that must be survived, each by name: the result is finite, not negative and reciprocal in `S`, and agrees with the closed
//! form or with the reference where there is one; or the input is refused with a message that names it.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::direction::{MIN_COSINE, Pair};
use biscale::filter::{Effective, Method, Quality, Value};
use biscale::formats::merl;
use biscale::material::SmallScale;
use glam::DVec3;
use std::f64::consts::PI;
use std::path::Path;
use support::*;

const RODS: &str = "kind = \"rods\"\ncount = 12\nradius = 0.05\nlean_deg = 20";
const GGX_MIRROR: &str = r#"{ model = "cook-torrance", specular = [0.9, 0.5, 0.1], alpha = 1e-3, f0 = [0.8, 0.5, 0.2] }"#;
const BECKMANN_MIRROR: &str = r#"{ model = "cook-torrance", specular = [0.9, 0.5, 0.1], alpha = 1e-3, distribution = "beckmann" }"#;
const WARD_MIRROR: &str = r#"{ model = "ward", specular = [0.9, 0.5, 0.1], alpha = 1e-3 }"#;
const PHONG_MIRROR: &str = r#"{ model = "blinn-phong", specular = [0.9, 0.5, 0.1], exponent = 1e6 }"#;
const MIRRORS: [&str; 4] = [GGX_MIRROR, BECKMANN_MIRROR, WARD_MIRROR, PHONG_MIRROR];
const ROUGH: [&str; 3] = [
    r#"{ model = "cook-torrance", diffuse = 0.1, specular = 0.9, alpha = 1.0 }"#,
    r#"{ model = "cook-torrance", diffuse = 0.1, specular = 0.9, alpha = 1.0, distribution = "beckmann" }"#,
    r#"{ model = "ward", diffuse = 0.1, specular = 0.9, alpha = 1.0 }"#,
];

/// Angles from z towards the horizon, degrees.
const GRAZING: [f64; 4] = [85.0, 89.0, 89.9, 89.99];

/// What a flat facet under the first surface's BRDF gives, as the `f64` closed form.
fn flat_closed_form(small: &SmallScale, n: DVec3, pair: &Pair) -> [f64; 3] {
    small.surfaces[0].brdf.eval(n, pair.wi, pair.wo).map(|fr| fr * n.dot(pair.wi).max(0.0))
}

/// Fails unless `fbar` is within `relative` of `expected`, or of `floor` where that is larger.
fn assert_values(values: &[Value], expected: &[[f64; 3]], relative: f64, floor: f64, what: &str) {
    assert_eq!(values.len(), expected.len());
    for (k, (v, e)) in values.iter().zip(expected).enumerate() {
        for c in 0..3 {
            let off = (v.fbar[c] - e[c]).abs();
            assert!(off <= relative * e[c] + floor, "{what}, pair {k}, channel {c}: {} for {}, off by {off:e}", v.fbar[c], e[c]);
        }
    }
}

#[test]
fn flat_surface_with_one_normal_for_every_model() {
    let plane = |brdf: &str| mesh(PLANE, [1.0, 1.0], brdf);
    for brdf in MIRRORS.iter().chain(&ROUGH).chain(&[LAMBERT]) {
        let (small, pairs) = (plane(brdf), some_pairs());
        let expected: Vec<_> = pairs.iter().map(|p| flat_closed_form(&small, DVec3::Z, p)).collect();
        let result = sound_and_reciprocal(&small, &pairs, QUICK, brdf);
        // Far from a mirror's peak exp is cut off at 2^-80, times a peak of up to 3e5.
        assert_values(&result.values, &expected, 3e-4, 1e-18, brdf);
        assert_values(&reference(&small, &pairs, 0.01).values, &expected, 1e-9, 1e-30, brdf);
        // One normal: there is nothing to be noisy.
        assert!(result.summary.relative_rms < 3e-6, "{brdf}: relative RMS {}", result.summary.relative_rms);
    }
}

#[test]
fn mirror_like_lobes_have_their_closed_form_near_the_peak() {
    /// Relative error of the direct method within five widths of the lobe: its half vectors and normals are in f32, 6e-8 of a lobe
    /// 1e-3 wide, times a steepness of 10.
    const RELATIVE: f64 = 1e-3;
    for brdf in MIRRORS {
        let plane = mesh(PLANE, [1.0, 1.0], brdf);
        let pairs: Vec<Pair> = [0.0, 30.0, 75.0]
            .iter()
            .flat_map(|&theta| {
                let widths = [0.0, 0.1, 0.5, 1.0, 2.0, 5.0];
                // The half vector moves by half of what one direction does; 1e-3 rad is a width.
                let moved = move |w: f64| pair(theta + (2.0 * w * 1e-3_f64).to_degrees(), 20.0, theta, 200.0);
                widths.into_iter().map(moved)
            })
            .collect();
        let expected: Vec<_> = pairs.iter().map(|p| flat_closed_form(&plane, DVec3::Z, p)).collect();
        assert!(expected[0][0] > 1e4, "{brdf}: the peak is {}", expected[0][0]);
        let result = sound_and_reciprocal(&plane, &pairs, QUICK, brdf);
        assert_values(&result.values, &expected, RELATIVE, 0.0, brdf);
    }
}

#[test]
fn mirror_like_lobes_of_tilted_facets_have_their_closed_form() {
    // Pyramids of slope 0.2 neither hide nor shade each other at these angles: each side has a quarter of the footprint, and
    // sqrt(1 + 0.04) of that as area. One pair is a mirror of the side that faces +x.
    let n = |x: f64, y: f64| DVec3::new(0.2 * x, 0.2 * y, 1.0).normalize();
    let normals = [n(1.0, 0.0), n(-1.0, 0.0), n(0.0, 1.0), n(0.0, -1.0)];
    let wo = direction(25.0, 40.0);
    let mirrored = |n: DVec3| 2.0 * n.dot(wo) * n - wo;
    let pairs = [
        Pair { wi: mirrored(normals[0]), wo },
        Pair { wi: (mirrored(normals[0]) + DVec3::new(0.0, 1e-3, 0.0)).normalize(), wo },
        Pair { wi: mirrored(normals[3]), wo },
        pair(10.0, 0.0, 20.0, 90.0),
    ];
    for brdf in MIRRORS {
        let pyramids = surface("kind = \"pyramids\"\nheight = 0.1", brdf);
        let expected: Vec<[f64; 3]> = pairs
            .iter()
            .map(|p| {
                let sides = normals.map(|n| flat_closed_form(&pyramids, n, p).map(|f| f * n.dot(p.wo) / n.z / 4.0));
                std::array::from_fn(|c| sides.iter().map(|s| s[c]).sum::<f64>() / p.wo.z)
            })
            .collect();
        let result = sound_and_reciprocal(&pyramids, &pairs, QUICK, brdf);
        // Each side gets exactly its share of the samples but for the strips that two sides share.
        assert_values(&result.values, &expected, 5e-3, 1e-18, brdf);
        assert!(result.values[0].fbar[0] > 1e3 && result.values[3].fbar[0] < 1e-3, "{brdf}: {:?}", result.values);
    }
}

#[test]
fn alpha_one_agrees_with_the_reference() {
    let pairs = some_pairs();
    for brdf in ROUGH {
        for geometry in ["kind = \"grooves\"\nprofile = \"v\"", RODS] {
            let small = surface(geometry, brdf);
            let result = sound_and_reciprocal(&small, &pairs, "direct:8192x1", brdf);
            assert_agree(&result, &reference(&small, &pairs, 0.02), 1e-5, &format!("{geometry}\n{brdf}"));
        }
    }
}

#[test]
fn grazing_directions_over_a_flat_plane() {
    let angles: Vec<(f64, f64)> = GRAZING.iter().map(|&theta| (theta, 7.0 * theta)).chain([(30.0, 200.0)]).collect();
    let pairs = pairs_of(&angles);
    for brdf in [LAMBERT, ROUGH[0], ROUGH[1], ROUGH[2]] {
        let plane = mesh(PLANE, [1.0, 1.0], brdf);
        let expected: Vec<_> = pairs.iter().map(|p| flat_closed_form(&plane, DVec3::Z, p)).collect();
        let result = sound_and_reciprocal(&plane, &pairs, QUICK, brdf);
        // Ward's lobe goes with the tangent of the half angle: where that is near 90 degrees, f32 has few digits of the cosine.
        assert_values(&result.values, &expected, 3e-4, 0.0, brdf);
        for (v, p) in result.values.iter().zip(&pairs) {
            assert!((v.av / p.wo.z - 1.0).abs() < 3e-6, "{p:?}: av {}", v.av);
        }
        assert_values(&reference(&plane, &pairs, 0.01).values, &expected, 1e-9, 0.0, brdf);
    }
}

#[test]
fn grazing_directions_over_v_grooves_have_their_closed_form() {
    let groove = v_groove(1.0, 0.5, LAMBERT);
    for theta in GRAZING {
        // Across, askew and along the grooves: across them, cos(theta) of a wall is in sight.
        for azimuth in [0.0, 40.0, 90.0] {
            let pairs = [
                pair(theta, azimuth, 30.0, 10.0),
                pair(20.0, 110.0, theta, azimuth),
                pair(theta, azimuth, theta, azimuth),
                pair(theta, azimuth, theta, azimuth + 180.0),
            ];
            let exact: Vec<[f64; 3]> = pairs.iter().map(|p| v_groove_fbar(p, 1.0, 0.5)).collect();
            let expected: Vec<_> = exact.iter().map(|&e| (e, [0.0; 3])).collect();
            let what = format!("{theta} degrees, azimuth {azimuth}");
            // Some dozens of samples must fall on what is in sight. Along the grooves all is in sight, and rays are long.
            let along = azimuth == 90.0;
            let plan = if along {
                QUICK
            } else if theta > 89.5 {
                "direct:262144x1"
            } else {
                "direct:8192x1"
            };
            let result = direct(&groove, &pairs, plan);
            assert_sound(&result, &pairs, &what);
            assert_near(&result, &expected, 1e-4, &what);
            let few_rays = Quality { method: Method::Reference, plan: "reference:bounces=0:first=8".parse().ok(), ..Quality::default() };
            let result = if along { run(&groove, &pairs, &few_rays) } else { reference(&groove, &pairs, 0.02) };
            assert_sound(&result, &pairs, &what);
            assert_near(&result, &expected, 1e-6, &format!("{what}, reference"));
        }
    }
}

#[test]
fn grazing_directions_agree_with_the_reference_on_rods() {
    let rods = surface(RODS, ROUGH[0]);
    for theta in [85.0, 89.0] {
        let pairs = [pair(theta, 30.0, 20.0, 0.0), pair(20.0, 0.0, theta, 30.0), pair(theta, 30.0, theta, 200.0)];
        let result = sound_and_reciprocal(&rods, &pairs, "direct:32768x1", "rods");
        assert_agree(&result, &reference(&rods, &pairs, 0.02), 1e-4, &format!("{theta} degrees"));
    }
}

#[test]
fn what_is_seen_by_few_samples_is_not_taken_for_nothing() {
    // Of each wall 1.7e-4 is lit or in sight at 89.99 degrees: the first 2,048 samples see nothing of it.
    let groove = v_groove(1.0, 0.5, LAMBERT);
    for theta in [89.9, 89.99] {
        for p in [pair(30.0, 10.0, theta, 0.0), pair(theta, 0.0, 30.0, 10.0)] {
            let result = run(&groove, &[p], &Quality { method: Method::Direct, tolerance: 0.02, ..Quality::default() });
            let (value, exact) = (&result.values[0], v_groove_fbar(&p, 1.0, 0.5)[0]);
            let off = (value.fbar[0] - exact).abs();
            let what = format!("{p:?}: {} for {exact}, standard error {:e}, {}", value.fbar[0], value.se[0], result.summary.plan_text());
            assert!(off <= 6.0 * value.se[0] + 1e-4 * exact, "{what}");
            assert!(off <= 0.05 * exact, "{what}");
            assert!(!result.summary.notes.iter().any(|n| n.contains("may be missed")), "{what}: {:?}", result.summary.notes);
            // The start of the search says so itself.
            let start = direct(&groove, &[p], QUICK);
            assert!(start.summary.notes.iter().any(|n| n.contains("may be missed")), "{p:?}: {:?}", start.summary.notes);
        }
    }
}

/// The direct method by its own choice of samples.
fn direct_by_default(small: &SmallScale, pairs: &[Pair]) -> Effective {
    run(small, pairs, &Quality { method: Method::Direct, ..Quality::default() })
}

#[test]
fn ninety_degrees_is_evaluated_at_the_smallest_cosine_in_its_azimuth() {
    let lifted = |phi: f64| {
        let flat = direction(90.0, phi) * (1.0 - MIN_COSINE * MIN_COSINE).sqrt();
        flat.with_z(MIN_COSINE)
    };
    let low = |phi: f64| (direction(90.0, phi) * (1.0 - 2.5e-9_f64).sqrt()).with_z(5e-5);
    let up = direction(35.0, 80.0);
    let pairs: Vec<Pair> = [0.0, 65.0, 180.0]
        .iter()
        .flat_map(|&phi| {
            let horizon = direction(90.0, phi);
            [horizon, low(phi), lifted(phi)]
                .into_iter()
                .flat_map(move |w| [Pair { wi: w, wo: up }, Pair { wi: up, wo: w }, Pair { wi: w, wo: w }])
        })
        .collect();
    for (small, what) in [(mesh(PLANE, [1.0, 1.0], LAMBERT), "plane"), (v_groove(1.0, 0.2, ROUGH[0]), "V-groove")] {
        for result in [direct(&small, &pairs, "direct:16384x1"), reference(&small, &pairs, 0.05)] {
            assert_sound(&result, &pairs, what);
            let close = |a: &Value, b: &Value| {
                let near = |(x, y): (f64, f64)| (x - y).abs() <= 1e-6 * x.max(y);
                (0..3).all(|c| near((a.fbar[c], b.fbar[c])) && near((a.fhat[c], b.fhat[c])) && near((a.s[c], b.s[c]))) && near((a.av, b.av))
            };
            for six in result.values.chunks_exact(9) {
                for k in 0..3 {
                    let method = result.summary.method;
                    // A direct run of lifted directions, told apart by rounding alone; the reference draws each pair's rays anew.
                    if method == "direct" || what == "plane" {
                        assert!(close(&six[k], &six[6 + k]), "{what}, {method}, at 90 degrees: {:?}\n{:?}", six[k], six[6 + k]);
                        assert!(close(&six[3 + k], &six[6 + k]), "{what}, {method}, at z = 5e-5: {:?}\n{:?}", six[3 + k], six[6 + k]);
                    }
                }
                let fhat = six[0].fbar[0] / MIN_COSINE;
                assert!((six[0].fhat[0] / fhat - 1.0).abs() < 1e-12, "{what}: fhat {} for {fhat}", six[0].fhat[0]);
            }
        }
    }
}

#[test]
fn directions_below_the_horizon_give_zero() {
    let below = DVec3::new(0.6, 0.0, -0.8);
    let just_below = DVec3::new(1.0, 0.0, -1e-300);
    let up = direction(20.0, 0.0);
    let pairs = [Pair { wi: below, wo: up }, Pair { wi: up, wo: below }, Pair { wi: just_below, wo: up }, Pair { wi: up, wo: just_below }];
    let small = surface(RODS, LAMBERT);
    for result in [direct(&small, &pairs, QUICK), reference(&small, &pairs, 0.05)] {
        for (value, pair) in result.values.iter().zip(&pairs) {
            assert_eq!(*value, Value::default(), "{pair:?}");
        }
    }
}

#[test]
fn light_and_viewer_in_one_direction() {
    let angles = [(0.0, 0.0), (20.0, 30.0), (44.9, 180.0), (60.0, 0.0), (80.0, 15.0)];
    let pairs: Vec<Pair> = angles.iter().map(|&(theta, phi)| pair(theta, phi, theta, phi)).collect();
    let exact: Vec<_> = pairs.iter().map(|p| (v_groove_fbar(p, 1.0, 0.5), [0.0; 3])).collect();
    let groove = v_groove(1.0, 0.5, LAMBERT);
    assert_near(&sound_and_reciprocal(&groove, &pairs, "direct:16384x1", "V-groove"), &exact, 1e-5, "V-groove");
    assert_near(&reference(&groove, &pairs, 0.005), &exact, 1e-6, "V-groove, reference");
    for brdf in MIRRORS {
        let plane = mesh(PLANE, [1.0, 1.0], brdf);
        let expected: Vec<_> = pairs.iter().map(|p| flat_closed_form(&plane, DVec3::Z, p)).collect();
        assert_values(&sound_and_reciprocal(&plane, &pairs, QUICK, brdf).values, &expected, 3e-4, 1e-18, brdf);
        sound_and_reciprocal(&surface(RODS, brdf), &pairs, QUICK, brdf);
    }
}

#[test]
fn a_surface_a_millionth_as_high_as_wide_looks_flat() {
    let pairs: Vec<Pair> = some_pairs().into_iter().chain(GRAZING.map(|t| pair(t, 0.0, 30.0, 0.0))).collect();
    let groove = v_groove(1.0, 1e-6, LAMBERT);
    let exact: Vec<_> = pairs.iter().map(|p| v_groove_fbar(p, 1.0, 1e-6)).collect();
    // f32 holds a tilt of 2e-6 to 3 %; that is 5e-8 of a cosine, and 3e-4 of the smallest one here.
    assert_values(&sound_and_reciprocal(&groove, &pairs, QUICK, "V-groove").values, &exact, 1e-3, 0.0, "V-groove");
    assert_values(&reference(&groove, &pairs, 0.005).values, &exact, 1e-3, 0.0, "V-groove, reference");
    let upright = &pairs[..25];
    let field = "kind = \"height-field\"\nfile = \"samples/hammered.png\"\nwidth = 1.0\nheight = 1e-6\nresolution = 32\nedge = \"mirror\"";
    let expected: Vec<_> = upright.iter().map(|p| flat_fbar(p.wi.z)).collect();
    let result = sound_and_reciprocal(&surface(field, LAMBERT), upright, QUICK, "height field");
    assert_values(&result.values, &expected, 1e-3, 0.0, "height field");
}

#[test]
fn white_noise_of_heights_has_no_preferred_direction() {
    let folder = tempfile::tempdir().unwrap();
    // A pixel is .01 wide; neighbours differ by .6 of that, in the root mean square.
    let mut state = 1_u32;
    let mut heights = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        image::Luma([u16::try_from(state >> 16).unwrap()])
    };
    image::ImageBuffer::from_fn(192, 192, |_, _| heights()).save(folder.path().join("noise.png")).unwrap();
    let height = 0.6 * 0.01 * 6.0_f64.sqrt();
    let file = folder.path().join("noise.png");
    let field =
        format!("kind = \"height-field\"\nfile = {:?}\nwidth = 1.92\nheight = {height}\nresolution = 192", file.display().to_string());
    // To the left and to the right of the light.
    let sides = |light: f64| [90.0, -90.0].map(|turn| pair(60.0, light, 60.0, light + turn));
    let pairs: Vec<Pair> = [0.0, 45.0, 90.0].into_iter().flat_map(sides).collect();
    let values = reference(&surface(&field, LAMBERT), &pairs, 0.003).values;
    for (two, light) in values.chunks(2).zip([0, 45, 90]) {
        let ratio = two[0].fbar[0] / two[1].fbar[0];
        assert!((ratio - 1.0).abs() < 0.03, "light from {light} degrees: {ratio}");
    }
}

#[test]
fn a_surface_a_thousand_times_as_high_as_wide_has_its_closed_form() {
    let depth = 1e3;
    let groove = v_groove(1.0, depth, LAMBERT);
    // Steep enough to look to the bottom (the walls are 0.029 degrees from the upright), and ever less.
    let across = [0.0, 0.02, 0.1, 1.0, 10.0];
    let pairs: Vec<Pair> =
        across.iter().flat_map(|&i| across.iter().map(move |&o| pair(i, 0.0, o, if o > i { 180.0 } else { 0.0 }))).collect();
    let exact: Vec<_> = pairs.iter().map(|p| v_groove_fbar(p, 1.0, depth)).collect();
    let expected: Vec<_> = exact.iter().map(|&e| (e, [0.0; 3])).collect();
    let result = direct(&groove, &pairs, "direct:262144x1");
    assert_sound(&result, &pairs, "V-groove");
    assert_near(&result, &expected, 1e-4, "V-groove");
    for (v, p) in result.values.iter().zip(&pairs) {
        assert!((v.av / p.wo.z - 1.0).abs() < 0.05, "{p:?}: av {} of {}", v.av, p.wo.z);
    }
    assert_near(&reference(&groove, &pairs, 0.01), &expected, 1e-4, "V-groove, reference");
}

#[test]
fn zero_area_and_duplicated_triangles_change_nothing() {
    let with = format!("{PLANE}v 0.5 0.5 0\nf 1 3 5\nf 1 1 2\nf 1 2 3\nf 2 3 1\nv 0.25 0 0\nf 1 6 2\n");
    let (small, plain) = (mesh(&with, [1.0, 1.0], LAMBERT), mesh(PLANE, [1.0, 1.0], LAMBERT));
    let said = &small.tile.notes;
    assert!(said.iter().any(|n| n.contains("3 without area") && n.contains("2 that repeat")), "{said:?}");
    let pairs = some_pairs();
    let result = sound_and_reciprocal(&small, &pairs, QUICK, "plane");
    assert_eq!(result.values, direct(&plain, &pairs, QUICK).values);
    assert_eq!(reference(&small, &pairs, 0.01).values, reference(&plain, &pairs, 0.01).values);
}

#[test]
fn a_needle_of_a_million_to_one_changes_nothing_on_a_plane() {
    // The plane, cut by a sliver 1e-6 wide along its lower edge; and the same with the sliver folded up by 45 degrees.
    let cut = |z: f64| format!("v 0 0 0\nv 1 0 0\nv 1 1e-6 {z}\nv 0 1e-6 {z}\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\nf 4 3 5\nf 4 5 6\n");
    let pairs = some_pairs();
    let exact: Vec<_> = pairs.iter().map(|p| flat_fbar(p.wi.z)).collect();
    for (z, within) in [(0.0, 3e-6), (1e-6, 1e-3)] {
        let small = mesh(&cut(z), [1.0, 1.0], LAMBERT);
        assert_eq!(small.tile.triangles.len(), 4);
        let what = format!("sliver at {z:e}");
        assert_values(&sound_and_reciprocal(&small, &pairs, QUICK, &what).values, &exact, within, 0.0, &what);
        assert_values(&reference(&small, &pairs, 0.01).values, &exact, within, 0.0, &what);
    }
    // Alone: one needle in a tile.
    let needle = mesh("v 0 0 0\nv 1 0 0\nv 1 1e-6 0\nf 1 2 3\n", [1.0, 1.0], LAMBERT);
    let result = sound_and_reciprocal(&needle, &pairs, QUICK, "needle");
    assert_values(&result.values, &exact, 3e-6, 0.0, "needle");
    for (v, p) in result.values.iter().zip(&pairs) {
        assert!((v.av / (0.5e-6 * p.wo.z) - 1.0).abs() < 1e-5, "{p:?}: av {}", v.av);
    }
}

#[test]
fn triangles_with_corners_that_are_not_numbers_are_refused_by_name() {
    for word in ["nan", "inf", "-inf"] {
        let error = try_mesh(&PLANE.replace("v 1 1 0", &format!("v 1 {word} 0")), [1.0, 1.0], LAMBERT).unwrap_err();
        let said = error.to_string();
        assert!(matches!(error, biscale::Error::BadInput(_)) && said.contains("test.obj:3:") && said.contains("finite"), "{said}");
    }
}

#[test]
fn facets_that_face_away_from_everything_are_zero_and_the_summary_says_so() {
    let pairs = some_pairs();
    let reversed = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 3 2 1\nf 4 3 1\n";
    for brdf in [LAMBERT, GGX_MIRROR] {
        let small = mesh(reversed, [1.0, 1.0], brdf);
        for result in
            [sound_and_reciprocal(&small, &pairs, QUICK, brdf), direct_by_default(&small, &pairs), reference(&small, &pairs, 0.01)]
        {
            assert!(result.values.iter().all(|v| *v == Value::default()), "{:?}", result.values);
            assert_eq!(result.summary.relative_rms, 0.0);
            let said = &result.summary.notes;
            assert!(said.iter().any(|n| n.contains("no front face")), "{}: {said:?}", result.summary.method);
        }
    }
}

#[test]
fn a_tile_with_holes_and_no_floor_shows_its_share_and_black_where_nothing_is() {
    // A quarter of the tile is covered.
    let patch = mesh("v 0.2 0.2 0\nv 0.7 0.2 0\nv 0.7 0.7 0\nv 0.2 0.7 0\nf 1 2 3\nf 1 3 4\n", [1.0, 1.0], LAMBERT);
    let pairs = some_pairs();
    let exact: Vec<_> = pairs.iter().map(|p| flat_fbar(p.wi.z)).collect();
    let result = sound_and_reciprocal(&patch, &pairs, QUICK, "patch");
    assert_values(&result.values, &exact, 3e-6, 0.0, "patch");
    for (v, p) in result.values.iter().zip(&pairs) {
        assert!((v.av - 0.25 * p.wo.z).abs() < 1e-6, "{p:?}: av {}", v.av);
    }
    assert_values(&reference(&patch, &pairs, 0.01).values, &exact, 1e-9, 0.0, "patch, reference");
    // A fence: nothing of it is seen from straight above.
    let fence = mesh("v 0 0.5 0\nv 1 0.5 0\nv 1 0.5 0.3\nv 0 0.5 0.3\nf 1 2 3\nf 1 3 4\n", [1.0, 1.0], LAMBERT);
    let pairs = [pair(45.0, 270.0, 0.0, 0.0), pair(0.0, 0.0, 45.0, 270.0), pair(45.0, 270.0, 30.0, 270.0)];
    for result in [sound_and_reciprocal(&fence, &pairs, QUICK, "fence"), reference(&fence, &pairs, 0.01)] {
        assert_eq!((result.values[0].fbar, result.values[0].av), ([0.0; 3], 0.0), "{}", result.summary.method);
        assert_eq!(result.values[1].fbar, [0.0; 3], "{}: light along the fence", result.summary.method);
        let said = &result.summary.notes;
        assert!(said.iter().any(|n| n.starts_with("1 pair") && n.contains("no front face")), "{}: {said:?}", result.summary.method);
        // Nothing is in its own way at these angles: albedo/pi n·wi.
        let exact = ALBEDO[0] / PI * 45.0_f64.to_radians().sin();
        assert!((result.values[2].fbar[0] / exact - 1.0).abs() < 1e-5, "{:?}", result.values[2]);
    }
}

#[test]
fn one_facet_alone_has_its_closed_form() {
    let pairs = some_pairs();
    let flat = mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", [1.0, 1.0], LAMBERT);
    let exact: Vec<_> = pairs.iter().map(|p| flat_fbar(p.wi.z)).collect();
    let result = sound_and_reciprocal(&flat, &pairs, QUICK, "flat");
    assert_values(&result.values, &exact, 3e-6, 0.0, "flat");
    assert!(result.values.iter().zip(&pairs).all(|(v, p)| (v.av - 0.5 * p.wo.z).abs() < 1e-6));
    // Tilted, far from its copies: they do not meet below 84 degrees.
    let tilted = mesh("v 0 0 0\nv 0.1 0 0.1\nv 0 0.1 0\nf 1 2 3\n", [1.0, 1.0], ROUGH[0]);
    let n = DVec3::new(-1.0, 0.0, 1.0).normalize();
    let exact: Vec<_> = pairs.iter().map(|p| if n.dot(p.wo) > 0.0 { flat_closed_form(&tilted, n, p) } else { [0.0; 3] }).collect();
    let result = sound_and_reciprocal(&tilted, &pairs, QUICK, "tilted");
    assert_values(&result.values, &exact, 1e-5, 0.0, "tilted");
    assert_values(&reference(&tilted, &pairs, 0.05).values, &exact, 1e-9, 0.0, "tilted, reference");
}

#[test]
fn albedo_zero_is_black_and_albedo_one_is_linear() {
    let pairs = some_pairs();
    let rods = |albedo: f64| surface(RODS, &format!("{{ model = \"lambert\", albedo = {albedo:?} }}"));
    for result in [
        sound_and_reciprocal(&rods(0.0), &pairs, QUICK, "black"),
        direct_by_default(&rods(0.0), &pairs),
        reference(&rods(0.0), &pairs, 0.05),
    ] {
        assert!(result.values.iter().all(|v| v.fbar == [0.0; 3] && v.se == [0.0; 3] && v.av > 0.0), "{:?}", result.values);
        assert_eq!(result.summary.relative_rms, 0.0);
    }
    let (white, grey) = (sound_and_reciprocal(&rods(1.0), &pairs, QUICK, "white"), direct(&rods(0.5), &pairs, QUICK));
    for (white, grey) in white.values.iter().zip(&grey.values) {
        assert_eq!(white.fbar, grey.fbar.map(|f| 2.0 * f));
    }
}

#[test]
fn tints_of_zero_are_black_in_their_channels() {
    let pairs = some_pairs();
    let tinted = |tint: &str| build_in(Path::new(""), text(RODS, LAMBERT) + "tint = " + tint).unwrap();
    for result in [sound_and_reciprocal(&tinted("0.0"), &pairs, QUICK, "tint 0"), reference(&tinted("0.0"), &pairs, 0.05)] {
        assert!(result.values.iter().all(|v| v.fbar == [0.0; 3] && v.av > 0.0), "{:?}", result.values);
    }
    let plain = direct(&tinted("1.0"), &pairs, QUICK);
    let red = sound_and_reciprocal(&tinted("[1.0, 0.0, 0.0]"), &pairs, QUICK, "red");
    for (red, plain) in red.values.iter().zip(&plain.values) {
        assert_eq!(red.fbar, [plain.fbar[0], 0.0, 0.0]);
    }
    // An image: the left half black, the right half white.
    let folder = tempfile::tempdir().unwrap();
    let halves = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb([255 * u8::try_from(x).unwrap(); 3]));
    halves.save(folder.path().join("halves.png")).unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    std::fs::write(folder.path().join("test.obj"), obj).unwrap();
    let lines = text("kind = \"mesh\"\nfile = \"test.obj\"\nperiod = [1.0, 1.0]", LAMBERT) + "tint = \"halves.png\"";
    let plane = build_in(folder.path(), lines).unwrap();
    let exact: Vec<_> = pairs.iter().map(|p| (flat_fbar(p.wi.z).map(|f| 0.5 * f), [0.0; 3])).collect();
    assert_near(&sound_and_reciprocal(&plane, &pairs, "direct:8192x1", "image"), &exact, 1e-4, "image");
    assert_near(&reference(&plane, &pairs, 0.01), &exact, 1e-4, "image, reference");
}

/// A MERL file in which `value` gives the stored numbers by channel and node.
fn merl_table(path: &Path, value: impl Fn(usize, usize) -> f64) {
    let nodes = merl::THETA_H * merl::THETA_D * merl::PHI_D;
    let mut bytes: Vec<u8> = [90_i32, 90, 180].iter().flat_map(|d| d.to_le_bytes()).collect();
    bytes.reserve(24 * nodes);
    for place in 0..3 * nodes {
        bytes.extend(value(place / nodes, place % nodes).to_le_bytes());
    }
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn a_brdf_table_of_zeros_is_black_and_one_with_gaps_is_finite() {
    let folder = tempfile::tempdir().unwrap();
    let measured = |geometry: &str| build_in(folder.path(), text(geometry, r#"{ model = "measured", file = "t.binary" }"#));
    let pairs = some_pairs();
    merl_table(&folder.path().join("t.binary"), |_, _| 0.0);
    let black = measured(RODS).unwrap();
    for result in [direct(&black, &pairs, QUICK), reference(&black, &pairs, 0.05)] {
        assert_sound(&result, &pairs, "zeros");
        assert!(result.values.iter().all(|v| v.fbar == [0.0; 3] && v.av > 0.0), "{:?}", result.values);
    }
    // Red is 1/sr; green has zeros and negative entries, which mark gaps; blue has values near the largest.
    merl_table(&folder.path().join("t.binary"), |channel, node| match channel {
        0 => 1500.0,
        1 => [1500.0, 0.0, -1.0][node / merl::PHI_D % 3],
        _ => 1e11,
    });
    let plane = measured("kind = \"grooves\"\nprofile = \"v\"\ndepth = 0.0").unwrap();
    let expected: Vec<_> = pairs.iter().map(|p| flat_closed_form(&plane, DVec3::Z, p)).collect();
    for (e, p) in expected.iter().zip(&pairs) {
        assert!((e[0] / p.wi.z - 1.0).abs() < 1e-6, "red is {} at {p:?}", e[0]);
    }
    let result = direct(&plane, &pairs, QUICK);
    assert_sound(&result, &pairs, "gaps");
    assert_values(&result.values, &expected, 1e-4, 1e-5, "gaps");
    let rods = measured(RODS).unwrap();
    assert_agree(&direct(&rods, &pairs, "direct:8192x1"), &reference(&rods, &pairs, 0.05), 1e-5, "gaps on rods");
}

#[test]
fn a_brdf_table_with_a_value_that_is_no_number_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    merl_table(&folder.path().join("t.binary"), |channel, node| if (channel, node) == (1, 181) { f64::NAN } else { 1.0 });
    let error = build_in(folder.path(), text(RODS, r#"{ model = "measured", file = "t.binary" }"#)).unwrap_err();
    let said = error.to_string();
    assert!(matches!(error, biscale::Error::BadInput(_)), "{said}");
    assert!(said.contains("t.binary") && said.contains("green at theta_h 0, theta_d 1, phi_d 1") && said.contains("NaN"), "{said}");
}

#[test]
fn periods_from_a_millionth_to_a_million_look_like_a_period_of_one() {
    let pairs: Vec<Pair> = some_pairs().into_iter().chain([pair(85.0, 10.0, 40.0, 0.0)]).collect();
    let rods = |p: f64| surface(&format!("kind = \"rods\"\nperiod = {p:e}\ncount = 12\nradius = {:e}\nlean_deg = 20", 0.05 * p), ROUGH[0]);
    let groove = |p: f64| v_groove(p, 0.5 * p, LAMBERT);
    for build in [&rods as &dyn Fn(f64) -> SmallScale, &groove] {
        let one = sound_and_reciprocal(&build(1.0), &pairs, QUICK, "period 1");
        let expected: Vec<_> = one.values.iter().map(|v| v.fbar).collect();
        let exact = reference(&build(1.0), &pairs, 0.05);
        for period in [1e-6, 1e-3, 1e3, 1e6] {
            let what = format!("period {period:e}");
            let result = sound_and_reciprocal(&build(period), &pairs, QUICK, &what);
            // Rounding may move a sample across the edge of a shadow: one of 2,048.
            assert_values(&result.values, &expected, 2e-3, 1e-6, &what);
            assert_agree(&reference(&build(period), &pairs, 0.05), &exact, 1e-6, &format!("{what}, reference"));
        }
    }
}

#[test]
fn a_surface_far_from_the_origin_looks_the_same() {
    let ridge = |x: f64, y: f64, z: f64| {
        let v = |dx: f64, dy: f64, dz: f64| format!("v {} {} {}\n", x + dx, y + dy, z + dz);
        let rows = [v(0.0, 0.0, 0.0), v(0.5, 0.0, -0.25), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(0.5, 1.0, -0.25), v(1.0, 1.0, 0.0)];
        rows.concat() + "f 1 2 5\nf 1 5 4\nf 2 3 6\nf 2 6 5\n"
    };
    let pairs: Vec<Pair> = some_pairs().into_iter().chain([pair(85.0, 10.0, 40.0, 0.0)]).collect();
    let home = direct(&mesh(&ridge(0.0, 0.0, 0.0), [1.0, 1.0], LAMBERT), &pairs, QUICK);
    let expected: Vec<_> = home.values.iter().map(|v| v.fbar).collect();
    for (x, y, z) in [(1e4, -2e4, 0.0), (0.0, 0.0, 1e3), (-1e5, 0.0, -1e5)] {
        let what = format!("at {x}, {y}, {z}");
        let away = mesh(&ridge(x, y, z), [1.0, 1.0], LAMBERT);
        assert_values(&sound_and_reciprocal(&away, &pairs, QUICK, &what).values, &expected, 2e-3, 1e-6, &what);
    }
}
