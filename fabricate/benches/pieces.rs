//! Pieces and milliseconds of the unfolder on surfaces that other programs were measured on.
//!
//! `BISCALE_DATA=... cargo bench -p biscale-fabricate --bench pieces`

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program that prints a table")]

mod surfaces;

use biscale_fabricate::mesh::{Mesh, Tolerance};
use biscale_fabricate::unfold::{Effort, Problem, Sheet, TabShapes, TabStyle, search};
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

fn main() {
    let mut cases = vec![
        ("16 V-grooves", grooves(16, 6, 10.0, 5.0), 1),
        ("pyramids 4 x 4", pyramids(4, 10.0, 5.0), 3),
        ("pyramids 8 x 8", pyramids(8, 10.0, 5.0), 6),
        ("pyramids 16 x 16", pyramids(16, 10.0, 5.0), 30),
        ("heights 16 x 16", heights(16, 10.0, 5.0, 1), 23),
        ("heights 16 x 16 b", heights(16, 10.0, 5.0, 2), 23),
        ("heights +-5 16 x 16", heights(16, 10.0, 10.0, 3), 23),
    ];
    if let Some(data) = std::env::var_os("BISCALE_DATA") {
        let path = format!("{}/meshes/bunny.stl", data.to_string_lossy());
        let unscaled = stl(&path, 1.0);
        cases.push(("bunny.stl", stl(&path, 150.0 / unscaled.size()), 11));
    }
    let env = |name: &str, default: u64| std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default);
    println!("{:20} {:>7} {:>7} {:>7} {:>9} {:>7}", "surface", "facets", "pieces", "target", "ms", "CPU s");
    for (name, soup, target) in cases {
        for seed in 0..env("SEEDS", 1) {
            let (start, cpu) = (Instant::now(), cpu_seconds());
            let tolerance = Tolerance::of_size(soup.size());
            let mesh = Mesh::new(soup.clone(), tolerance).unwrap();
            let problem = Problem::new(&mesh, TabShapes::new(&mesh, TabStyle::default()), Sheet { size: DVec2::new(277.0, 190.0) });
            let default = Effort::default();
            let effort = Effort { seed, runs: env("RUNS", default.runs.into()) as u32, work: env("WORK", default.work) };
            let net = search(&problem, effort, &|_| false);
            let (ms, cpu) = (start.elapsed().as_secs_f64() * 1e3, cpu_seconds() - cpu);
            println!(
                "{name:20} {:7} {:7} {target:7} {ms:9.0} {cpu:7.2}  without tab {} work {}",
                mesh.facets.len(),
                net.pieces,
                net.without_tab().count(),
                net.work
            );
        }
    }
}
