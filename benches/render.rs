//! Pictures of the sample scenes, 384 x 384 pixels under 32 directional lights: frames a second once the effective BRDF is there,
//! what comes before, and how many pairs of directions a picture needs.
//!
//! A *frame* is [`Frame::shade`]: for each pixel's place the sum over its lights of interpolated effective BRDF times irradiance, in RGB
//! (equation 5 of Wu et al. 2011). Places, tangents and shadows, which the paper's system draws on the GPU, are *large scale*; finding the
//! cells of the direction grids is *cells*. One sample a pixel.
//!
//! usage: `cargo bench --bench render -- [--tolerance T] [SCENE.toml...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::filter::Quality;
use biscale::render::{Frame, QueryPlan, QueryTable, Scene, World, colours, gather_all, lights, render, touched};
use biscale::table::HemisphereGrid;
use std::path::PathBuf;

const SCENES: [&str; 6] = ["cup", "plate", "skirt", "pillow", "vase", "logo"];
/// Frames that are timed.
const FRAMES: usize = 50;

fn main() {
    let mut arguments = common::arguments();
    let tolerance = arguments.iter().position(|a| a == "--tolerance").map(|at| arguments.drain(at..at + 2).nth(1));
    let tolerance = tolerance.flatten().map_or(0.02, |n| n.parse().expect("a number after --tolerance"));
    if arguments.is_empty() {
        arguments = SCENES.iter().map(|s| format!("samples/scenes/{s}.toml")).collect();
    }
    println!("{} threads, tolerance {tolerance}", rayon::current_num_threads());
    println!(
        "| scene | lights at points | error | rings | pairs | full table | times fewer | large scale ms | cells ms | frame ms | frames/s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for file in arguments.iter().map(PathBuf::from) {
        let mut scene = Scene::load(&file).unwrap();
        scene.camera.samples = 1;
        let quality = Quality { tolerance, ..Quality::default() };
        common::with_control(|control| {
            let world = World::new(&scene, control).unwrap();
            let lights = lights(&scene, quality.seed);
            let (view, gathering) = common::measure(|| gather_all(&world, &lights, quality.seed, control).unwrap());
            let made = render(&scene, &quality, control).unwrap().materials;
            let probes = |m: usize| {
                let of = view.lit_points().filter(move |(p, _)| p.material as usize == m);
                let all: Vec<_> = of.flat_map(|(p, lit)| view.lit[lit].iter().map(|l| (l.wi, p.wo))).collect();
                all.iter().step_by((all.len() / biscale::render::PROBES).max(1)).copied().collect::<Vec<_>>()
            };
            let small = |m: usize| &scene.materials[m].small;
            let plans: Vec<Option<QueryPlan>> = (0..scene.materials.len())
                .map(|m| {
                    Some(probes(m))
                        .filter(|p| !p.is_empty())
                        .map(|p| QueryPlan::find(small(m), world.opacity[m].is_opaque(), &p, &quality, control).unwrap())
                })
                .collect();
            let grids: Vec<Option<HemisphereGrid>> = plans.iter().map(|p| p.as_ref().map(|p| HemisphereGrid::new(p.rings))).collect();
            let keys = touched(&view, &grids);
            let tables: Vec<Option<QueryTable>> = plans
                .iter()
                .zip(keys)
                .enumerate()
                .map(|(m, (p, k))| p.as_ref().map(|p| p.table(small(m), k, &quality, control).unwrap()))
                .collect();
            let (frame, cells) = common::measure(|| Frame::new(&view, &tables, scene.camera.width));
            let colours = colours(&lights);
            let (_, shading) = common::measure(|| (0..FRAMES).for_each(|_| drop(std::hint::black_box(frame.shade(&tables, &colours)))));
            let made: Vec<_> = made.into_iter().flatten().collect();
            let sum = |of: &dyn Fn(&biscale::render::MaterialReport) -> usize| made.iter().map(of).sum::<usize>();
            let error = made.iter().map(biscale::render::MaterialReport::relative_rms).fold(0.0, f64::max);
            let rings: Vec<String> = made.iter().map(|m| m.rings.to_string()).collect();
            let (pairs, full) = (sum(&|m| m.pairs), sum(&|m| m.full_table));
            let frame_ms = 1e3 * shading.wall / FRAMES as f64;
            println!(
                "| {} | {} | {:.2} % | {} | {pairs} | {full} | {:.1} | {:.0} | {:.0} | {frame_ms:.1} | {:.0} |",
                file.file_stem().unwrap().to_string_lossy(),
                frame.lamps(),
                100.0 * error,
                rings.join(", "),
                full as f64 / pairs as f64,
                1e3 * gathering.wall,
                1e3 * cells.wall,
                1e3 / frame_ms
            );
        });
    }
}
