//! Measured BRDFs against independent programs and against tables whose values are known.

use super::*;
use crate::Error;
use crate::brdf::tests::{above, sample_file};
use crate::brdf::{Brdf, fit_names};
use crate::formats::test_files::RglFile;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;

fn parse(file: &RglFile) -> Measured {
    let table = Adaptive::new(&rgl::parse(&file.finish()).unwrap(), Path::new("made.bsdf")).unwrap();
    Measured::new("made.bsdf".into(), String::new(), 1.0, Table::Rgl(table))
}

/// The pair whose half vector lies at `(theta_m, phi_m)` relative to the viewer at `theta_o`, and the viewer.
fn from_half(theta_o: f64, theta_m: f64, phi_m: f64) -> (DVec3, DVec3) {
    let (o, m) = (above(theta_o, 0.4), above(theta_m, 0.4 + phi_m));
    (2.0 * o.dot(m) * m - o, o)
}

/// Rows of a fixture: name, wi, wo, values.
fn rows(text: &str) -> impl Iterator<Item = (&str, DVec3, DVec3, [f64; 3])> {
    text.lines().skip(1).map(|line| {
        let (name, numbers) = line.split_once(',').unwrap();
        let v: Vec<f64> = numbers.split(',').map(|x| x.parse().unwrap()).collect();
        (name, DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]), [v[6], v[7], v[8]])
    })
}

#[test]
fn rgl_tables_agree_with_mitsuba() {
    // Made by tests/data/measured_mitsuba.py in single precision: the same lookup in double differs from it by up to 1.5e-4, where
    // ndf or the density is steep. Channels that Mitsuba leaves negative are 0 here.
    let text = include_str!("../../../tests/data/measured_mitsuba.csv");
    let mut open: Option<(String, Option<Measured>)> = None;
    let mut compared = 0;
    for (name, wi, wo, expected) in rows(text) {
        if open.as_ref().is_none_or(|(n, _)| n != name) {
            let path = if sample_file().ends_with(name) {
                Some(sample_file())
            } else {
                std::env::var_os("BISCALE_DATA").map(|d| PathBuf::from(d).join("brdf_rgl").join(name))
            };
            if path.is_none() {
                println!("skipped {name}: BISCALE_DATA is not set");
            }
            open = Some((name.to_owned(), path.map(|p| Measured::read(&p, 1.0).unwrap())));
        }
        let Some((_, Some(measured))) = &open else { continue };
        let got = measured.eval(DVec3::Z, wi, wo).map(|v| v * wi.z);
        let largest = expected.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        for (got, expected) in got.iter().zip(expected) {
            assert!((got - expected.max(0.0)).abs() < 2e-4 * largest + 1e-7, "{name} {wi} {wo}: {got} not {expected}");
        }
        compared += 1;
    }
    assert!(compared >= 50, "{compared}");
}

#[test]
fn fits_agree_with_numpy() {
    let text = include_str!("../../../tests/data/merl_fits_numpy.csv");
    for (name, wi, wo, expected) in rows(text) {
        let got = Measured::fit(name, 1.0).unwrap().eval(DVec3::Z, wi, wo);
        for (got, expected) in got.iter().zip(expected) {
            // Weights are kept in f32.
            assert!((got - expected).abs() < 1e-5 * expected + 1e-6, "{name} {wi} {wo}: {got} not {expected}");
        }
    }
}

#[test]
fn an_unwarped_table_is_bilinear_in_its_nodes() {
    // vndf constant, ndf = 4, sigma = 1: the value is the table itself at u.
    let rgb = |t: usize, c: usize, y: usize, x: usize| (1 + c) as f32 * (0.5 + t as f32 + 0.25 * x as f32 + 0.125 * y as f32);
    let measured = parse(&RglFile::isotropic(&[0.2, 0.6, 1.2], 5, |_, _, _| 3.0, rgb));
    for (theta_o, t) in [(0.2, 0.0), (0.3, 0.25), (0.6, 1.0), (0.9, 1.5), (0.1, 0.0), (1.3, 2.0)] {
        for (theta_m, phi_m) in [(0.05, 0.0), (0.2, 1.0), (0.1, -2.5), (0.15, 3.1)] {
            let (wi, wo) = from_half(theta_o, theta_m, phi_m);
            if wi.z <= 0.0 {
                continue;
            }
            let u = [(theta_m / FRAC_PI_2).sqrt(), (phi_m + PI) / (2.0 * PI)];
            let expected = 0.5 + t + 0.25 * (4.0 * u[0]) + 0.125 * (4.0 * u[1]);
            for (c, got) in measured.eval(DVec3::Z, wi, wo).iter().enumerate() {
                let expected = (1 + c) as f64 * expected / wi.z;
                assert!((got - expected).abs() < 1e-6 * expected, "{theta_o} {theta_m} {phi_m}: {got} not {expected}");
            }
        }
    }
}

#[test]
fn the_jacobian_multiplies_by_ndf_over_four_sigma() {
    let mut file = RglFile::isotropic(&[0.0, 1.5], 2, |_, _, _| 1.0, |_, _, _, _| 1.0);
    // ndf rises along theta from 2 to 6; sigma falls along theta from 1 to .5
    file.floats("ndf", &[2, 2], &[2.0, 6.0, 2.0, 6.0]);
    file.floats("sigma", &[2, 2], &[1.0, 0.5, 1.0, 0.5]);
    let (theta_o, theta_m) = (0.7_f64, 0.3_f64);
    let (wi, wo) = from_half(theta_o, theta_m, 2.0);
    let (um, uo) = ((theta_m / FRAC_PI_2).sqrt(), (theta_o / FRAC_PI_2).sqrt());
    let expected = (2.0 + 4.0 * um) / (4.0 * (1.0 - 0.5 * uo)) / wi.z;
    let got = parse(&file).eval(DVec3::Z, wi, wo)[0];
    assert!((got - expected).abs() < 1e-7 * expected, "{got} not {expected}");
    file.bytes("jacobian", &[0]);
    let got = parse(&file).eval(DVec3::Z, wi, wo)[0];
    assert!((got - 1.0 / wi.z).abs() < 1e-7 / wi.z, "{got}");
}

#[test]
fn the_warp_is_the_cumulative_distribution_of_the_density() {
    // A bumpy density; tables that return s themselves; integrals by the midpoint rule.
    let density = |y: usize, x: usize| 0.2 + ((x * 7 + y * 5) % 6) as f32;
    let size = 6;
    let at = |ux: f64, uy: f64| {
        let (px, py) = (ux * (size - 1) as f64, uy * (size - 1) as f64);
        let (x, y) = ((px as usize).min(size - 2), (py as usize).min(size - 2));
        let (fx, fy) = (px - x as f64, py - y as f64);
        let d = |y, x| f64::from(density(y, x));
        (1.0 - fy) * ((1.0 - fx) * d(y, x) + fx * d(y, x + 1)) + fy * ((1.0 - fx) * d(y + 1, x) + fx * d(y + 1, x + 1))
    };
    let rgb = |_: usize, c: usize, y: usize, x: usize| [x as f32, y as f32, 1.0][c] / (size - 1) as f32;
    let measured = parse(&RglFile::isotropic(&[0.0], size, |_, y, x| density(y, x), rgb));
    let steps = 4000;
    let integral =
        |f: &dyn Fn(f64) -> f64, to: f64| (0..steps).map(|k| f((k as f64 + 0.5) / steps as f64 * to)).sum::<f64>() * to / steps as f64;
    for (theta_m, phi_m) in [(0.02, 0.3), (0.2, -2.0), (0.35, 2.9), (0.1, -0.7)] {
        let (wi, wo) = from_half(0.5, theta_m, phi_m);
        let (ux, uy) = ((theta_m / FRAC_PI_2).sqrt(), (phi_m + PI) / (2.0 * PI));
        let row = |y: f64| integral(&|x| at(x, y), 1.0);
        let conditional = integral(&|x| at(x, uy), ux) / row(uy);
        // Rows are piecewise linear in y, so few points integrate them: 4,000 of them cost 16 million evaluations.
        let marginal = |to: f64| (0..200).map(|k| row((f64::from(k) + 0.5) / 200.0 * to)).sum::<f64>() * to / 200.0;
        let expected = [conditional, marginal(uy) / marginal(1.0), 0.2];
        for (got, expected) in measured.eval(DVec3::Z, wi, wo).iter().zip(expected) {
            assert!((got * wi.z - expected).abs() < 2e-4, "{theta_m} {phi_m}: {} not {expected}", got * wi.z);
        }
    }
}

#[test]
fn office_paper_reflects_what_white_paper_does() {
    let paper = Brdf::Measured(Measured::read(&sample_file(), 1.0).unwrap().into());
    // Its brighteners turn ultraviolet into blue.
    for theta in [0.0, 0.8, 1.2, 1.4] {
        let albedo = paper.directional_albedo(above(theta, 0.0));
        assert!(albedo.iter().all(|a| (0.8..1.0).contains(a)) && albedo[2] > albedo[0], "{albedo:?} at {theta}");
    }
    // Far from a lobe it is near albedo/pi.
    let value = paper.eval(DVec3::Z, above(0.5, 0.0), above(0.3, 2.0))[1];
    assert!((0.2..0.35).contains(&value), "{value}");
}

#[test]
fn what_facets_cannot_use_is_refused_as_unsupported() {
    let unsupported = |file: &RglFile| match Adaptive::new(&rgl::parse(&file.finish()).unwrap(), Path::new("x.bsdf")) {
        Err(Error::Unsupported { what, remedy }) => format!("{what}; {remedy}"),
        other => panic!("{other:?}"),
    };
    let isotropic = RglFile::isotropic(&[0.0, 1.0], 2, |_, _, _| 1.0, |_, _, _, _| 1.0);
    let mut anisotropic = isotropic.clone();
    anisotropic.floats("phi_i", &[3], &[-3.0, 0.0, 3.0]);
    anisotropic.floats("vndf", &[3, 2, 2, 2], &[1.0; 24]);
    anisotropic.floats("luminance", &[3, 2, 2, 2], &[1.0; 24]);
    anisotropic.floats("rgb", &[3, 2, 3, 2, 2], &[1.0; 72]);
    let message = unsupported(&anisotropic);
    assert!(message.contains("anisotropic measurement (3 azimuths)") && message.contains("x.bsdf"), "{message}");
    let mut spectral = isotropic.clone();
    spectral.drop("rgb");
    spectral.floats("wavelengths", &[2], &[400.0, 700.0]);
    spectral.floats("spectra", &[1, 2, 2, 2, 2], &[1.0; 16]);
    assert!(unsupported(&spectral).contains("spectral measurement (2 wavelengths)"));
}

#[test]
fn an_isotropic_file_that_changes_with_azimuth_is_refused() {
    let bad = |file: &RglFile| match Adaptive::new(&rgl::parse(&file.finish()).unwrap(), Path::new("x.bsdf")) {
        Err(Error::BadInput(bad)) => bad.to_string(),
        other => panic!("{other:?}"),
    };
    let mut file = RglFile::isotropic(&[0.0], 2, |_, _, _| 1.0, |_, _, _, _| 1.0);
    file.floats("sigma", &[2, 2], &[1.0, 1.0, 1.0, 2.0]);
    assert!(bad(&file).contains("sigma: its rows differ"));
    file.floats("sigma", &[2, 2], &[1.0; 4]);
    file.floats("phi_i", &[2], &[0.0, 1.0]);
    file.floats("vndf", &[2, 1, 2, 2], &[1.0; 8]);
    file.floats("luminance", &[2, 1, 2, 2], &[1.0; 8]);
    let mut rgb = [1.0; 24];
    file.floats("rgb", &[2, 1, 3, 2, 2], &rgb);
    assert_eq!(parse(&file).eval(DVec3::Z, DVec3::Z, DVec3::Z), [1.0; 3]);
    rgb[23] = 2.0;
    file.floats("rgb", &[2, 1, 3, 2, 2], &rgb);
    assert!(bad(&file).contains("rgb: its two azimuths differ"));
}

/// A MERL table with `f` of the node's half and difference angles.
fn merl_table(f: impl Fn(f64, f64, f64) -> f64) -> Measured {
    let mut rgb = Vec::with_capacity(merl::THETA_H * merl::THETA_D * merl::PHI_D);
    for h in 0..merl::THETA_H {
        for d in 0..merl::THETA_D {
            for p in 0..merl::PHI_D {
                let angles = ((h as f64 / 90.0).powi(2) * FRAC_PI_2, d as f64 / 90.0 * FRAC_PI_2, p as f64 / 180.0 * PI);
                rgb.push([f(angles.0, angles.1, angles.2) as f32; 3]);
            }
        }
    }
    Measured::new("made.binary".into(), String::new(), 1.0, Table::Merl(merl::Merl { rgb, negative: 0.0 }))
}

/// The pair with these half and difference angles.
fn from_angles(theta_h: f64, theta_d: f64, phi_d: f64) -> (DVec3, DVec3) {
    let turn = glam::DQuat::from_rotation_z(0.9) * glam::DQuat::from_rotation_y(theta_h);
    let (d, h) = (turn * above(theta_d, phi_d), turn * DVec3::Z);
    (d, 2.0 * d.dot(h) * h - d)
}

#[test]
fn merl_tables_are_trilinear_between_their_nodes() {
    // Linear in each of sqrt(theta_h), theta_d and phi_d: exact between nodes; off the seam of phi_d.
    let f = |h: f64, d: f64, p: f64| 0.1 + h.sqrt() + 2.0 * d + 0.3 * p * d;
    let measured = merl_table(f);
    for (h, d, p) in [(0.0101, 0.2, 0.5), (0.3, 0.7, 1.9), (0.001, 0.01, 3.1), (0.6, 0.333, 1.0)] {
        let (wi, wo) = from_angles(h, d, p);
        for (wi, wo) in [(wi, wo), (wo, wi)] {
            let got = measured.eval(DVec3::Z, wi, wo)[0];
            assert!((got - f(h, d, p)).abs() < 1e-6, "{h} {d} {p}: {got} not {}", f(h, d, p));
        }
    }
}

#[test]
fn merl_tables_are_periodic_in_the_difference_azimuth() {
    let measured = merl_table(|_, _, p| (2.0 * p).cos() + 2.0);
    for p in [PI - 0.001, PI - 0.015, 0.001] {
        let (wi, wo) = from_angles(0.3, 0.5, p);
        let got = measured.eval(DVec3::Z, wi, wo)[0];
        assert!((got - ((2.0 * p).cos() + 2.0)).abs() < 1e-3, "{got} at {p}");
    }
}

#[test]
fn merl_tables_are_held_beyond_their_last_nodes() {
    let measured = merl_table(|h, d, _| h + 10.0 * d);
    let last = 89.0 / 90.0 * FRAC_PI_2;
    // Difference angle of 89.7 degrees at the normal.
    let (wi, wo) = from_angles(0.0, 89.7_f64.to_radians(), 0.0);
    let got = measured.eval(DVec3::Z, wi, wo)[0];
    assert!((got - 10.0 * last).abs() < 1e-4, "{got}");
}

#[test]
fn half_and_difference_angles_are_found_from_mirror_like_to_grazing() {
    for (h, d, p) in [(1e-5, 0.5, 1.0), (0.4, 1e-4, 2.0), (1.2, 0.2, 0.3), (0.7, 0.7, 3.0)] {
        let (wi, wo) = from_angles(h, d, p);
        for (i, o) in [(wi, wo), (wo, wi)] {
            let got = Halfway::new(i.to_array(), o.to_array()).about([0.0, 0.0, 1.0]);
            let angles = [got.sin_h.atan2(got.cos_h), got.sin_d.atan2(got.cos_d), got.d[1].atan2(got.d[0])];
            for (got, expected) in angles.iter().zip([h, d, p]) {
                assert!((got - expected).abs() < 1e-10 / h.min(d), "{angles:?} not {:?}", [h, d, p]);
            }
        }
    }
}

#[test]
fn fits_do_not_flicker_in_the_plane_of_incidence() {
    // Rounding puts the difference vector on either side of the plane; the value must not follow.
    let fit = Measured::fit("pink-felt", 1.0).unwrap();
    for k in 1..80 {
        let theta = f64::from(k) * 0.019;
        let reference = fit.eval(DVec3::Z, above(theta, 0.0), above(0.4, PI));
        for phi in [0.3, 1.1, 2.7] {
            let got = fit.eval(DVec3::Z, above(theta, phi), above(0.4, phi + PI));
            for c in 0..3 {
                assert!((got[c] - reference[c]).abs() <= 1e-6 * reference[c].max(1e-3), "{theta} {phi}: {got:?} not {reference:?}");
            }
        }
    }
}

#[test]
fn single_precision_agrees_with_double() {
    let merl = merl_table(|h, d, p| 0.2 + 50.0 * (-h * h / 0.01).exp() + d * (1.0 + 0.2 * (2.0 * p).cos()));
    // With the fits this compares the network's kernel with its plain twin, too.
    let mut all = vec![merl, Measured::read(&sample_file(), 0.7).unwrap()];
    all.extend(["chrome", "gold-metallic-paint", "red-fabric", "white-paint"].map(|n| Measured::fit(n, 1.0).unwrap()));
    for measured in &all {
        let (mut worst, mut squares, mut total) = (0.0_f64, 0.0, 0.0);
        for k in 0..1_500_u32 {
            let r = |step: f64| (f64::from(k) * step).fract();
            let middle = above(2.0 * r(0.379), 6.2 * r(0.618));
            let turn = glam::DQuat::from_rotation_arc(DVec3::Z, middle);
            let o = (turn * above(1.5 * r(0.7548), 6.2 * r(0.5698))).as_vec3().normalize();
            let i = (turn * above(1.5 * r(0.8191), 6.2 * r(0.671))).as_vec3().normalize();
            // Other normals around the middle one, some of them with a direction below.
            let normals: [Vec3; LANES] = std::array::from_fn(|l| (turn * above(0.1 * l as f64, 2.4 * l as f64)).as_vec3().normalize());
            let fast = measured.eval_lanes(&[0, 1, 2].map(|x| normals.map(|n| n[x])), i, o);
            for (l, n) in normals.iter().enumerate() {
                let slow = measured.eval(n.as_dvec3(), i.as_dvec3(), o.as_dvec3());
                if n.dot(i).min(n.dot(o)) < 0.07 {
                    // Below 4 degrees fr over a rounded cosine keeps few digits; under the facet all is 0.
                    let under = n.dot(i).min(n.dot(o)) < -1e-6;
                    assert!(!under || (0..3).all(|c| fast[c][l] == 0.0 && slow[c] == 0.0), "{fast:?}, {slow:?}");
                    continue;
                }
                for c in 0..3 {
                    let off = (f64::from(fast[c][l]) - slow[c]).abs();
                    squares += off * off;
                    total += slow[c] * slow[c];
                    worst = worst.max(off / (slow[c] + 0.01));
                }
            }
        }
        let rms = (squares / total).sqrt();
        println!("{}: worst relative {worst:.1e}, RMS {rms:.1e}", measured.label);
        assert!(worst < 1e-4 && rms < 5e-6, "{}: worst relative {worst:e}, RMS {rms:e}", measured.label);
    }
}

#[test]
fn the_lobe_is_estimated_from_mirror_to_diffuse() {
    let alpha = |name: &str| Measured::fit(name, 1.0).unwrap().lobe_alpha();
    let (chrome, paint, felt) = (alpha("chrome"), alpha("gold-metallic-paint"), alpha("pink-felt"));
    assert!(chrome < 0.03 && paint > 0.1 && paint < 0.9 && felt > 0.5, "{chrome} {paint} {felt}");
}

#[test]
fn every_fit_is_there_and_plausible() {
    let names: Vec<&str> = fit_names().collect();
    assert_eq!(names.len(), 100);
    for name in names {
        let albedo = Brdf::Measured(Measured::fit(name, 1.0).unwrap().into()).directional_albedo(above(0.5, 0.0));
        assert!(albedo.iter().all(|a| (0.0..1.1).contains(a)) && albedo.iter().sum::<f64>() > 0.003, "{name}: {albedo:?}");
    }
}

#[test]
fn scale_multiplies() {
    let (one, three) = (Measured::fit("brass", 1.0).unwrap(), Measured::fit("brass", 3.0).unwrap());
    let (i, o) = (above(0.3, 0.0), above(0.5, 2.0));
    assert_eq!(one.eval(DVec3::Z, i, o).map(|v| 3.0 * v), three.eval(DVec3::Z, i, o));
}

proptest! {
    /// Whatever the reader lets pass is looked up without a panic, and finite.
    #[test]
    fn damaged_files_are_refused_or_give_finite_values(damage in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = RglFile::isotropic(&[0.0, 0.8], 3, |_, y, x| (x + y) as f32, |_, _, y, x| (x * y) as f32).finish();
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Ok(file) = rgl::parse(&bytes) && let Ok(table) = Adaptive::new(&file, Path::new("x.bsdf")) {
            let measured = Measured::new(String::new(), String::new(), 1.0, Table::Rgl(table));
            for (i, o) in [(0.0, 0.0), (0.3, 1.2), (1.5, 1.5)] {
                let (i, o) = (above(i, 1.0), above(o, 4.0));
                let slow = measured.eval(DVec3::Z, i, o);
                let fast = measured.eval_lanes(&[[0.0; LANES], [0.0; LANES], [1.0; LANES]], i.as_vec3(), o.as_vec3());
                prop_assert!(slow.iter().all(|v| v.is_finite() && *v >= 0.0), "{slow:?}");
                prop_assert!(fast.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{fast:?}");
            }
        }
    }
}
