//! A whole shoot whose truth is known: every number that `run` gives is compared with it.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what it measured")]
#![cfg(feature = "opencv")]

mod support;

use biscale::filter::Control;
use biscale::formats::capture::{Capture, Severity};
use biscale::toml_reader::Source;
use biscale_capture::lens::Pose;
use biscale_capture::run::{RunOptions, run};
use biscale_capture::shoot::Shoot;
use glam::{DMat3, DVec3};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use support::flat_shoot::{self, FlatShoot};

fn capture(folder: &Path, text: &str) -> Capture {
    let source = Source { path: folder.join("shoot.toml"), text: text.to_owned() };
    let shoot = Shoot::parse(&source).unwrap_or_else(|e| panic!("{e}"));
    let out = folder.join("out");
    std::fs::create_dir_all(&out).unwrap();
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    run(&shoot, &RunOptions::default(), &out, &control).unwrap()
}

fn told(capture: &Capture) -> String {
    let mut lines: Vec<String> = capture
        .checks
        .iter()
        .filter(|c| c.severity > Severity::Ok)
        .map(|c| format!("{:?} {} {:?} {:?}: {}", c.severity, c.code, c.photograph, c.measured, c.message))
        .collect();
    lines.sort();
    lines.join("\n")
}

#[test]
fn a_flat_sample_on_a_board() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let truth = FlatShoot::write(folder.path(), 900);
    let found = capture(folder.path(), &flat_shoot::text());
    eprintln!("{}", told(&found));
    // Camera.
    let camera = found.camera.as_ref().unwrap();
    eprintln!("camera {camera:?}");
    let (lens, sigma) = (truth.studio.lens, camera.sigma.unwrap());
    for (k, (value, truth)) in
        [(camera.fx, lens.focal.x), (camera.fy, lens.focal.y), (camera.cx, lens.centre.x), (camera.cy, lens.centre.y)]
            .into_iter()
            .enumerate()
    {
        assert!(
            (value - truth).abs() < 5.0 * sigma[k] && (value / truth - 1.0).abs() < 5e-3,
            "{k}: {value} for {truth}, sigma {}",
            sigma[k]
        );
    }
    // Falloff.
    let flat = found.flat_field.as_ref().unwrap();
    for r in [0.3_f64, 0.6, 0.8, 1.0] {
        let v = |p: [f64; 3]| 1.0 + p[0] * r.powi(2) + p[1] * r.powi(4) + p[2] * r.powi(6);
        assert!(
            (v(flat.radial) / v(truth.studio.vignetting) - 1.0).abs() < 0.01,
            "at {r}: {} for {}",
            v(flat.radial),
            v(truth.studio.vignetting)
        );
    }
    // Colour.
    let colour = found.colour.as_ref().unwrap();
    eprintln!("delta E {:?}", colour.delta_e);
    assert!(colour.delta_e.iter().all(|e| *e < 2.0), "{:?}", colour.delta_e);
    // Light.
    for (name, truth) in [("light", truth.light), ("other", truth.other)] {
        let l = found.lights.iter().find(|l| l.name == name).unwrap();
        for s in &l.sources {
            let off = DVec3::from(s.direction).angle_between(truth).to_degrees();
            eprintln!("{name} {} off by {off:.3}, sigma {}", s.kind, s.sigma_deg);
            assert!(off < 1.0, "{name} {}: {off} degrees", s.kind);
        }
        let off = DVec3::from(l.direction).angle_between(truth).to_degrees();
        assert!(off < 1.0, "{off}");
    }
    let first = found.lights.iter().find(|l| l.name == "light").unwrap();
    assert_eq!(first.sources.len(), 2);
    let e = first.irradiance_rgb.unwrap()[1];
    // White at the checker's place is 1.
    assert!((e * truth.light.z / std::f64::consts::PI - 1.0).abs() < 0.02, "irradiance {e}");
    // Poses.
    for (name, pose) in &truth.poses {
        let photo = found.photographs.iter().find(|p| p.role == *name).unwrap();
        let p = photo.pose.as_ref().unwrap();
        let got = Pose { rotation: DMat3::from_cols_array_2d(&p.rotation).transpose(), translation: p.translation_mm.into() };
        let (eye, turn) = (got.eye().distance(pose.eye()), got.angle_to(pose).to_degrees());
        let shift = got.translation.distance(pose.translation);
        eprintln!("{name}: origin off by {shift:.4} mm, eye by {eye:.4} mm, {turn:.4} degrees, rms {}", p.rms_px);
        assert!(shift < 0.2 && turn < 0.2, "{name}: {shift} mm, {turn} degrees");
        assert_eq!(photo.light.as_deref(), Some("light"));
    }
    // The written values of the cloth: the mean over the mask of the distant photograph is the mean reflectance: white is 1 under this light.
    let image = biscale::image_file::read(&folder.path().join("out/distant.exr")).unwrap();
    let mask = biscale::image_file::read(&folder.path().join("out/distant-mask.png")).unwrap();
    let inside: Vec<usize> = (0..image.width * image.height).filter(|&i| mask.channels[0][i] > 0.5).collect();
    assert!(inside.len() > 1000, "{}", inside.len());
    let mean = |c: usize| inside.iter().map(|&i| f64::from(image.channels[c][i])).sum::<f64>() / inside.len() as f64;
    for c in 0..3 {
        let truth = truth.mean[c];
        assert!((mean(c) / truth - 1.0).abs() < 0.03, "channel {c}: {} for {truth}", mean(c));
    }
    // The close-up: a twill of these threads, and a material file that `biscale` reads.
    let weave = found.close_up.as_ref().unwrap().weave.as_ref().unwrap();
    eprintln!("{weave}");
    for (name, pitch, width) in [("warp", truth.pitch.x, 1.3), ("weft", truth.pitch.y, 1.1)] {
        let value = |key: &str| weave[name][key]["value"].as_f64().unwrap();
        assert!((value("pitch") / pitch - 1.0).abs() < 0.01, "{name}: pitch {} for {pitch}", value("pitch"));
        // Flat threads, whose light jumps at their edges.
        assert!((value("width") / width - 1.0).abs() < 0.05, "{name}: width {} for {width}", value("width"));
    }
    assert_eq!(weave["class"]["name"], "twill");
    let material = biscale::material::Material::load(&folder.path().join("out").join(found.material.as_ref().unwrap())).unwrap();
    assert!((material.build().unwrap().tile.period.x / (3.0 * truth.pitch.x) - 1.0).abs() < 0.01);
    assert!(found.usable, "{}", told(&found));
    // The same bits again.
    let report = std::fs::read(at("out/report.html")).unwrap();
    let json = std::fs::read(at("out/capture.json")).unwrap();
    assert_eq!(capture(folder.path(), &flat_shoot::text()), found);
    assert!(std::fs::read(at("out/report.html")).unwrap() == report && std::fs::read(at("out/capture.json")).unwrap() == json);
}
