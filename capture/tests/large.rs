//! Photographs of 24 megapixels: how long each takes, and how much memory. Figures for `docs/capture.md`:
//! `cargo test --release -p biscale-cli -p biscale-capture --features biscale-cli/capture --test large -- --ignored --nocapture`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test fails by panicking, and tells what it measured")]
#![cfg(all(feature = "opencv", target_os = "linux"))]

mod support;

use biscale::filter::Control;
use biscale::toml_reader::Source;
use biscale_capture::board::Board;
use biscale_capture::dictionary::Dictionary;
use biscale_capture::lens::Pose;
use biscale_capture::linear;
use biscale_capture::photo::{self, Photo};
use biscale_capture::run::{RunOptions, run};
use biscale_capture::shoot::{Shape, Shoot};
use biscale_capture::vision::{GreyImage8, markers};
use biscale_capture::{flat::Falloff, resample};
use glam::{DVec2, DVec3};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use support::*;

const WIDTH: usize = 6000;
const HEIGHT: usize = 4000;
/// CPU seconds that each photograph may take, which bound the time on two cores whatever else runs there, and GiB of memory.
const SECONDS: f64 = 10.0;
const GIB: f64 = 2.0;

/// CPU seconds of this process (`/proc/self/stat`, in hundredths).
fn cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = stat.rsplit(") ").next().unwrap().split(' ').collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}

/// Peak memory of this process since [`forget`], GiB.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / (1024.0 * 1024.0)
}

fn forget() {
    // What cannot be reset is reported too high, never too low.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Does one stage and tells what it took.
fn stage<T>(name: &str, work: impl FnOnce() -> T) -> T {
    forget();
    let (wall, before) = (Instant::now(), cpu());
    let out = work();
    println!("  {name}: {:.2} s, {:.2} CPU s, peak {:.2} GiB", wall.elapsed().as_secs_f64(), cpu() - before, peak());
    out
}

/// A twill on a board, from above, its markers in view.
fn photograph(folder: &Path) -> (Studio, String) {
    let board = Board::charuco(8, 6, 30.0, 22.0, &Dictionary::Predefined("DICT_5X5_100"), true);
    let print = Print::new(&board, &flat_shoot::bits);
    let page = DVec2::new(300.0, 220.0);
    let corner = 0.5 * (page - board.size);
    let draft: [&[bool]; 3] = [&[true, true, false], &[true, false, true], &[false, true, true]];
    let paint = move |p: DVec2| {
        let on = p - corner;
        let q = on - 0.5 * board.size + DVec2::new(30.0, 20.0);
        let inside = q.min(DVec2::new(60.0, 40.0) - q).min_element() >= 0.0;
        if inside { cloth(q, &draft, DVec2::new(0.8, 0.7), DVec2::new(0.7, 0.6), [0.6, 0.2, 0.2], [0.2, 0.25, 0.6]) } else { print.at(on) }
    };
    let light = DVec3::new(0.4, -0.25, 0.86);
    let scene = Scene::new(Shape::Plane(page), light, Box::new(paint));
    let studio = Studio::new(WIDTH, HEIGHT);
    let picture = studio.photograph(&scene, &Pose::looking_at(DVec3::new(20.0, -60.0, 260.0), DVec3::ZERO, DVec3::Y), 1.0);
    save16(&picture, &folder.join("deep.png"));
    save16(&picture, &folder.join("deep.tif"));
    save8(&picture, &folder.join("eight.jpg"));
    save8(&picture, &folder.join("eight.png"));
    let l = studio.lens;
    let head = format!(
        "format = 1\n[camera]\nfocal_px = [{}, {}]\ncentre_px = [{}, {}]\ndistortion = {:?}\n[[light]]\ndirection = [0.4, -0.25, 0.86]\n[board]\n\
         kind = \"charuco\"\ncolumns = 8\nrows = 6\nsquare_mm = 30\nmarker_mm = 22\n[sample]\nshape = \"plane\"\nwidth_mm = 60\nheight_mm = 40\nboard_mm = [120, 90]\n",
        l.focal.x, l.focal.y, l.centre.x, l.centre.y, l.distortion
    );
    (studio, head)
}

fn stages(path: &Path, studio: &Studio, shoot: &Shoot, srgb: bool) {
    println!("{}, stage by stage", path.file_name().unwrap().to_string_lossy());
    let photo: Photo = stage("read", || photo::read(path).unwrap());
    let (picture, saturated) = stage("linearise", || linear::sensor(photo, &shoot.camera, srgb));
    let gray = stage("grey", || GreyImage8::of(&picture, false));
    let seen = stage("find markers", || markers::detect(&gray, &Dictionary::Predefined("DICT_5X5_100")).unwrap());
    println!("    {} markers", seen.len());
    drop(gray);
    let pose = Pose::looking_at(DVec3::new(20.0, -60.0, 260.0), DVec3::ZERO, DVec3::Y);
    let shape = Shape::Plane(DVec2::new(60.0, 40.0));
    let mask = stage("mask of the sample", || resample::sample_mask(&shape, &pose, &studio.lens.pinhole(), 1));
    drop(mask);
    let straight = stage("rectify", || resample::rectify(&picture, &saturated, &studio.lens, &pose, &shape));
    println!("    {:?} pixels", straight.map(|s| (s.masked.picture.width, s.masked.picture.height)));
    let whole = linear::LinearPhoto { picture, saturated, divisor: 1.0 };
    stage("fit a falloff", || Falloff::fit(&whole, studio.lens.centre, shoot.camera.flat).is_some());
    stage("undistort", || resample::undistort(whole.picture, &whole.saturated, &studio.lens));
}

#[test]
#[ignore = "takes a minute or two"]
fn each_photograph_takes_less_than_ten_seconds_and_two_gibibytes() {
    let folder = tempfile::tempdir().unwrap();
    let (studio, head) = photograph(folder.path());
    let mut slow = Vec::new();
    for (file, role, srgb) in [
        ("deep.png", "distant", false),
        ("deep.tif", "distant", false),
        ("eight.jpg", "distant", true),
        ("eight.png", "distant", true),
        ("deep.png", "close-up", false),
        ("eight.jpg", "close-up", true),
    ] {
        let text = format!("{head}[[photo]]\nrole = \"{role}\"\nfile = \"{file}\"\nseconds = 1\n");
        let shoot = Shoot::parse(&Source { path: folder.path().join("shoot.toml"), text }).unwrap();
        if role == "distant" {
            stages(&folder.path().join(file), &studio, &shoot, srgb);
        }
        let out = folder.path().join("out");
        std::fs::create_dir_all(&out).unwrap();
        forget();
        let (wall, before) = (Instant::now(), cpu());
        let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
        let capture = run(&shoot, &RunOptions { assume_srgb: srgb, ..RunOptions::default() }, &out, &control).unwrap();
        let (seconds, memory) = (wall.elapsed().as_secs_f64(), peak());
        let used = cpu() - before;
        println!("{role} {file}, as a whole: {seconds:.1} s, {used:.1} CPU s, peak {memory:.2} GiB");
        assert!(capture.usable && capture.photographs[0].pose.is_some(), "{:?}", capture.checks);
        if used >= SECONDS || memory >= GIB {
            slow.push(format!("{role} {file}: {used:.1} CPU s, {memory:.2} GiB"));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
}
