//! Pieces and milliseconds of the unfolder on surfaces that other programs were measured on.
//!
//! `BISCALE_DATA=... cargo bench -p biscale-fabricate --bench pieces`; of other meshes, each scaled so that its largest extent is so many mm:
//! `MESHES="cow.obj:300 spot.obj:300" cargo bench -p biscale-fabricate --bench pieces`

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program that prints a table")]

mod surfaces;

use biscale_fabricate::design::{FoldRecipe, Source};
use biscale_fabricate::layout::nest;
use biscale_fabricate::mesh::{Mesh, Tolerance, Triangles};
use biscale_fabricate::paper::Paper;
use biscale_fabricate::polygon;
use biscale_fabricate::surface::prepare;
use biscale_fabricate::unfold::{Effort, Pattern, Problem, TabShapes, TabStyle, room, search};
use glam::DVec2;
use std::time::Instant;
use surfaces::{grooves, heights, pyramids, stl};

/// CPU seconds of this process so far, of all its threads: on a busy machine they tell more than the clock. 0 where the system does not tell.
fn cpu_seconds() -> f64 {
    // Fields 14 and 15 of the line, after the name in brackets, in hundredths of a second (proc(5)).
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return 0.0 };
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    [11, 12].iter().filter_map(|&k| fields.get(k)?.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// A mesh file as `biscale fold` takes it, its largest extent scaled to so many mm.
fn file(argument: &str) -> Mesh {
    let (path, size) = argument.rsplit_once(':').unwrap();
    let source = Source::load(path.as_ref()).unwrap();
    let scale = size.parse::<f64>().unwrap() / source.triangles(1.0, [1, 1]).size();
    let recipe = FoldRecipe {
        scale,
        periods: [1, 1],
        thickness: 0.0,
        fold_radius: 0.0,
        k_factor: 0.0,
        max_facets: None,
        slope_tolerance_deg: None,
        split: None,
    };
    prepare(&source, &recipe).unwrap().0
}

fn made(soup: &Triangles) -> Mesh {
    Mesh::new(soup.clone(), Tolerance::of_size(soup.size())).unwrap()
}

fn main() {
    let mut cases: Vec<(String, Mesh)> = Vec::new();
    if let Ok(meshes) = std::env::var("MESHES") {
        for argument in meshes.split_whitespace() {
            cases.push((argument.rsplit('/').next().unwrap().to_owned(), file(argument)));
        }
    } else {
        for (name, soup) in [
            ("16 V-grooves", grooves(16, 6, 10.0, 5.0)),
            ("pyramids 4 x 4", pyramids(4, 10.0, 5.0)),
            ("pyramids 8 x 8", pyramids(8, 10.0, 5.0)),
            ("pyramids 16 x 16", pyramids(16, 10.0, 5.0)),
            ("heights 16 x 16", heights(16, 10.0, 5.0, 1)),
            ("heights 16 x 16 b", heights(16, 10.0, 5.0, 2)),
            ("heights +-5 16 x 16", heights(16, 10.0, 10.0, 3)),
        ] {
            cases.push((name.to_owned(), made(&soup)));
        }
        if let Some(data) = std::env::var_os("BISCALE_DATA") {
            let path = format!("{}/meshes/bunny.stl", data.to_string_lossy());
            cases.push(("bunny.stl".to_owned(), made(&stl(&path, 150.0 / stl(&path, 1.0).size()))));
        }
    }
    let env = |name: &str, default: u64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    println!(
        "{:20} {:>7} {:>4} {:>7} {:>7} {:>7} {:>5} {:>5} {:>9} {:>7} {:>7}",
        "surface", "facets", "seed", "pieces", "largest", "median", "pages", "used", "ms", "CPU s", "nesting"
    );
    let paper = Paper { name: "a4", size: DVec2::new(210.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };
    let style = TabStyle::default();
    for (name, mesh) in cases {
        for seed in 0..env("SEEDS", 1) {
            let (start, cpu) = (Instant::now(), cpu_seconds());
            let problem = Problem::new(&mesh, TabShapes::new(&mesh, style), room(paper, style));
            let default = Effort::default();
            let effort = Effort { seed, runs: env("RUNS", default.runs.into()) as u32, work: env("WORK", default.work) };
            let net = search(&problem, effort, &|_| false);
            let (ms, cpu) = (start.elapsed().as_secs_f64() * 1e3, cpu_seconds() - cpu);
            let [_, area] = paper.area();
            let pattern = Pattern::new(&net);
            let outlines: Vec<Vec<DVec2>> = pattern.pieces.iter().map(|p| p.outline[0].clone()).collect();
            let start = cpu_seconds();
            let (_, pages) = nest(&outlines, area, false).unwrap();
            let nesting = cpu_seconds() - start;
            let used = outlines.iter().map(|o| polygon::area(o)).sum::<f64>() / (pages as f64 * area.x * area.y);
            let mut sizes: Vec<u32> = net.size.iter().copied().filter(|&s| s > 0).collect();
            sizes.sort_unstable();
            println!(
                "{name:20} {:7} {seed:4} {:7} {:7} {:7} {pages:5} {used:5.2} {ms:9.0} {cpu:7.2} {nesting:7.2}  without tab {} work {}",
                mesh.facets.len(),
                net.pieces,
                sizes[sizes.len() - 1],
                sizes[sizes.len() / 2],
                net.without_tab().count(),
                net.work
            );
        }
    }
}
