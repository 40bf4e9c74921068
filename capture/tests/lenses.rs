//! Photographs through several lenses, and turned ones: what a phone, or a raw converter, makes of a shoot.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what it measured")]
#![cfg(feature = "opencv")]

mod support;

use biscale::filter::Control;
use biscale::formats::capture::{Capture, Severity};
use biscale::toml_reader::Source;
use biscale_capture::lens::Pose;
use biscale_capture::run::{RunOptions, run};
use biscale_capture::shoot::{Shape, Shoot};
use glam::{DMat3, DVec2, DVec3};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use support::flat_shoot::{self, FlatShoot};
use support::*;

fn capture(folder: &Path, text: &str) -> Capture {
    let shoot = Shoot::parse(&Source { path: folder.join("shoot.toml"), text: text.to_owned() }).unwrap_or_else(|e| panic!("{e}"));
    let out = folder.join("out");
    std::fs::create_dir_all(&out).unwrap();
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    run(&shoot, &RunOptions::default(), &out, &control).unwrap()
}

fn turned(capture: &Capture) -> Vec<&str> {
    let mut names: Vec<&str> = capture.checks.iter().filter(|c| c.code == "TURNED").filter_map(|c| c.photograph.as_deref()).collect();
    names.sort_unstable();
    names
}

fn pose(capture: &Capture, role: &str) -> Pose {
    let told = || capture.checks.iter().filter(|c| c.severity > Severity::Ok).map(|c| c.message.clone()).collect::<Vec<_>>().join("\n");
    let photo = capture.photographs.iter().find(|p| p.role == role).unwrap_or_else(|| panic!("no {role}: {}", told()));
    let pose = photo.pose.as_ref().unwrap();
    Pose { rotation: DMat3::from_cols_array_2d(&pose.rotation).transpose(), translation: pose.translation_mm.into() }
}

/// Turns a 16-bit picture by quarters, clockwise.
fn turn(folder: &Path, name: &str, quarters: u32) {
    let picture = image::open(folder.join(name)).unwrap();
    let picture = match quarters {
        1 => picture.rotate90(),
        2 => picture.rotate180(),
        _ => picture.rotate270(),
    };
    picture.save(folder.join(name)).unwrap();
}

#[test]
fn turned_pixels_are_turned_back() {
    let folder = tempfile::tempdir().unwrap();
    let truth = FlatShoot::write(folder.path(), 600);
    let text = flat_shoot::text();
    assert_eq!(turned(&capture(folder.path(), &text)), [""; 0]);
    turn(folder.path(), "distant.png", 2);
    turn(folder.path(), "ball.png", 2);
    turn(folder.path(), "close-up.png", 1);
    turn(folder.path(), "validation.png", 3);
    turn(folder.path(), "board-4.png", 2);
    let found = capture(folder.path(), &text);
    // A quarter is told by the size, and one of both ways once more as a half.
    let told = turned(&found);
    for name in ["ball.png", "board-4.png", "close-up.png", "distant.png", "validation.png"] {
        assert!(told.contains(&name), "{name} is not among {told:?}");
    }
    assert!(told.iter().all(|n| !n.starts_with("board") || *n == "board-4.png"), "{told:?}");
    let camera = found.camera.as_ref().unwrap();
    let (c, lens) = (DVec2::new(camera.cx, camera.cy), truth.studio.lens);
    assert!(c.distance(lens.centre) < 2.0, "{c} for {}", lens.centre);
    // A photograph that is turned back lies as it was taken.
    for (role, truth) in &truth.poses {
        let (shift, turn) = (pose(&found, role).translation.distance(truth.translation), pose(&found, role).angle_to(truth).to_degrees());
        eprintln!("{role}: {shift:.3} mm, {turn:.3} degrees");
        assert!(shift < 1.0 && turn < 0.5, "{role}: {shift} mm, {turn} degrees");
    }
    let light = found.lights.iter().find(|l| l.name == "light").unwrap();
    let off = DVec3::from(light.direction).angle_between(truth.light).to_degrees();
    assert!(off < 1.5, "light off by {off} degrees");
}

/// The close-up through another lens: twice the focal length, and another size.
#[test]
fn each_lens_has_its_own_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let truth = FlatShoot::write(folder.path(), 600);
    let at = |name: &str| folder.path().join(name);
    let mut tele = Studio { vignetting: [0.0; 3], ..Studio::new(660, 440) };
    tele.lens.focal *= 2.0;
    let print = Print::new(&flat_shoot::board(), &flat_shoot::bits);
    let page = DVec2::new(360.0, 300.0);
    let printed = |p: DVec2| print.at(p - 0.5 * (page - flat_shoot::board().size));
    let views = around(6, 600.0, 40.0);
    for (k, view) in views.iter().enumerate() {
        save8(&tele.photograph(&Scene::new(Shape::Plane(page), truth.light, Box::new(printed)), view, 1.0), &at(&format!("tele-{k}.png")));
    }
    let near = Pose::looking_at(DVec3::new(3.0, -12.0, 280.0), DVec3::ZERO, DVec3::Y);
    save16(&tele.photograph(&Scene::new(Shape::Plane(page), truth.light, Box::new(printed)), &near, 1.0), &at("close-up.png"));
    // Without views of the board through that lens it is refused.
    let refused = capture(folder.path(), &flat_shoot::text());
    let wrong = refused.checks.iter().find(|c| c.code == "WRONG_SIZE" && c.severity == Severity::Fail).unwrap();
    assert!(wrong.message.contains("660 x 440") && wrong.message.contains("photograph the board with this lens"), "{}", wrong.message);
    let boards: Vec<String> = (0..6).map(|k| format!("\"tele-{k}.png\"")).collect();
    let text = format!("{}\n[[photo]]\nrole = \"board\"\nfiles = [{}]\n", flat_shoot::text(), boards.join(", "));
    let found = capture(folder.path(), &text);
    let shown = found.photographs.iter().find(|p| p.role == "close-up").unwrap();
    let own = shown.camera.as_ref().unwrap();
    eprintln!("fx {} +/- {:?} for {}", own.fx, own.sigma.map(|s| s[0]), tele.lens.focal.x);
    assert!((own.fx / tele.lens.focal.x - 1.0).abs() < 0.02 && (own.width, own.height) == (660, 440), "{own:?}");
    let shift = pose(&found, "close-up").translation.distance(near.translation);
    assert!(shift < 0.02 * 280.0, "{shift} mm");
    // The others keep the camera of all.
    assert!(found.photographs.iter().filter(|p| p.role != "close-up").all(|p| p.camera.is_none()));
    assert!((found.camera.as_ref().unwrap().fx / truth.studio.lens.focal.x - 1.0).abs() < 5e-3);
    assert!(
        found.checks.iter().any(|c| c.code == "SETTINGS_CHANGED" && c.severity == Severity::Warn && c.message.contains("close-up.png"))
    );
}
