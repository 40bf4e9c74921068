//! Pictures lit by an environment as a whole: what is prepared, frames a second at 640 x 480 pixels while the camera moves, and the difference from sampled lights.
//!
//! The camera goes once around the scene. The difference is that of a picture of 320 x 240 pixels, one ray each, from the same by 1,024 lights that stand for the environment, in which the effective BRDF keeps the
//! same tolerance; *noise* is half the difference between two such pictures whose lights are drawn apart. Lamps of the scenes are left out. `ball` is the scene of that name in the studio of the others.
//!
//! usage: `cargo bench --bench environment -- [--tolerance T] [--pictures FOLDER] [--material FILE] [SCENE...]`, a scene of `samples/scenes`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::filter::Quality;
use biscale::render::{Camera, EnvironmentLit, Lighting, Picture, Scene, difference, render};
use biscale::toml_reader::Source;
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};

const SCENES: [&str; 7] = ["ball", "cup", "plate", "skirt", "pillow", "vase", "logo"];
/// Frames that are timed.
const FRAMES: u32 = 60;
/// What the lamps of `ball` are replaced by.
const STUDIO: &str = "\n[environment]\nfile = \"studio.hdr\"\nrotation_deg = 150.0\n";

fn load(name: &str, material: Option<&Path>) -> Scene {
    let mut source = Source::read(&PathBuf::from(format!("samples/scenes/{name}.toml"))).unwrap();
    if name == "ball" {
        source.text.push_str(STUDIO);
    }
    let mut scene = Scene::parse_with(&source, material).unwrap();
    scene.camera.samples = 1;
    scene.lights.clear();
    scene
}

/// A camera turned about the z axis through a point.
fn turned(camera: &Camera, middle: DVec3, angle: f64) -> Camera {
    let turn = DMat3::from_rotation_z(angle);
    Camera { origin: middle + turn * (camera.origin - middle), axes: turn * camera.axes, ..*camera }
}

/// The picture by this many sampled lights.
fn sampled(scene: &Scene, seed: u64, tolerance: f64) -> Picture {
    let mut scene = scene.clone();
    let environment = scene.environment.as_mut().unwrap();
    environment.lighting = Lighting::Sampled;
    environment.lights = Some(1024);
    let quality = Quality { tolerance, seed, ..Quality::default() };
    common::with_control(|control| render(&scene, &quality, control).unwrap().picture)
}

/// Sampled, looked up, and five times their difference, side by side in 8 bits.
fn write_panels(file: &Path, sampled: &Picture, looked_up: &Picture) {
    let width = sampled.width as usize;
    let mut panels = Picture::new(3 * sampled.width, sampled.height);
    for (at, (a, b)) in sampled.rgb.iter().zip(&looked_up.rgb).enumerate() {
        let first = at / width * 3 * width + at % width;
        panels.rgb[first] = *a;
        panels.rgb[first + width] = *b;
        panels.rgb[first + 2 * width] = std::array::from_fn(|c| 5.0 * (a[c] - b[c]).abs());
    }
    panels.write_exr(std::fs::File::create(file).unwrap(), false, "sampled, looked up, difference times five").unwrap();
}

fn main() {
    let mut arguments = common::arguments();
    let mut option = |name: &str| arguments.iter().position(|a| a == name).and_then(|at| arguments.drain(at..at + 2).nth(1));
    let tolerance = option("--tolerance").map_or(biscale::render::LEAST_TOLERANCE, |t| t.parse().expect("a number after --tolerance"));
    let pictures = option("--pictures").map(PathBuf::from);
    let material = option("--material").map(PathBuf::from);
    if arguments.is_empty() {
        arguments = SCENES.map(str::to_owned).to_vec();
    }
    println!("{} threads, tolerance {tolerance}", rayon::current_num_threads());
    println!(
        "| scene | rings | texels | lobes | response error | sites | MiB | prefilter ms | responses ms | light field ms | frame CPU ms | frame ms | frames/s | PSNR dB | relative RMS | noise |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for name in &arguments {
        let mut scene = load(name, material.as_deref());
        (scene.camera.width, scene.camera.height) = (320, 240);
        let quality = Quality { tolerance, ..Quality::default() };
        let lit = common::with_control(|control| EnvironmentLit::new(&scene, &quality, control).unwrap());
        let middle = scene.objects[0].middle();
        let large = Camera { width: 640, height: 480, ..scene.camera };
        let frame = |k: u32| {
            drop(std::hint::black_box(lit.frame(&turned(&large, middle, std::f64::consts::TAU * f64::from(k) / f64::from(FRAMES)))));
        };
        frame(0);
        let (_, cost) = common::measure(|| (0..FRAMES).for_each(frame));
        let (cpu, wall) = (1e3 * cost.cpu / f64::from(FRAMES), 1e3 * cost.wall / f64::from(FRAMES));
        let looked_up = lit.frame(&scene.camera);
        let first = sampled(&scene, 1, tolerance);
        let second = sampled(&scene, 2, tolerance);
        let off = difference(&first.rgb, &looked_up.rgb, None);
        let noise = 0.5 * difference(&first.rgb, &second.rgb, None).relative_rms;
        if let Some(folder) = &pictures {
            write_panels(&folder.join(format!("{name}.exr")), &first, &looked_up);
        }
        let reports = lit.reports();
        let list = |of: &dyn Fn(&biscale::render::ResponseReport) -> String| reports.iter().map(of).collect::<Vec<_>>().join(", ");
        let stage = |name: &str| lit.stages.iter().filter(|s| s.0 == name).map(|s| s.1).sum::<f64>();
        println!(
            "| {name} | {} | {} | {} | {} | {} | {:.0} | {:.0} | {:.0} | {:.0} | {cpu:.1} | {wall:.1} | {:.0} | {:.1} | {:.1} % | {:.1} % |",
            list(&|r| r.rings.to_string()),
            list(&|r| (r.side * r.side).to_string()),
            list(&|r| r.lobes.to_string()),
            list(&|r| format!("{:.1} %", 100.0 * r.relative_rms())),
            lit.sites(),
            lit.bytes().iter().sum::<usize>() as f64 / f64::from(1 << 20),
            stage("prefilter"),
            stage("responses"),
            stage("light field"),
            1e3 / wall,
            off.psnr,
            100.0 * off.relative_rms,
            100.0 * noise,
        );
    }
}
