//! Pieces and milliseconds of the unfolder on surfaces that other programs were measured on.
//!
//! `cargo bench -p biscale-fabricate --bench pieces`

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program that prints a table")]

use biscale_fabricate::mesh::{Mesh, Tolerance, Triangles};
use biscale_fabricate::random::Random;
use biscale_fabricate::unfold::net::{Problem, Sheet};
use biscale_fabricate::unfold::search::{Effort, search};
use biscale_fabricate::unfold::tabs::{TabShapes, TabStyle};
use glam::{DVec2, DVec3};
use std::time::Instant;

fn pyramids(n: u32, cell: f64, height: f64) -> Triangles {
    let mut soup = Triangles::default();
    for j in 0..n {
        for i in 0..n {
            let at = |x: f64, y: f64, z: f64| DVec3::new((f64::from(i) + x) * cell, (f64::from(j) + y) * cell, z);
            let corners = [at(0., 0., 0.), at(1., 0., 0.), at(1., 1., 0.), at(0., 1., 0.), at(0.5, 0.5, height)];
            let k = soup.vertices.len() as u32;
            soup.vertices.extend(corners);
            soup.triangles.extend([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]].map(|t: [u32; 3]| t.map(|c| c + k)));
        }
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}

fn heights(n: usize, cell: f64, amplitude: f64, seed: u64) -> Triangles {
    let mut random = Random::new(seed);
    let mut soup = Triangles::default();
    for j in 0..=n {
        for i in 0..=n {
            soup.vertices.push(DVec3::new(i as f64 * cell, j as f64 * cell, amplitude * random.unit()));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let k = (j * (n + 1) + i) as u32;
            let m = (n + 1) as u32;
            soup.triangles.extend([[k, k + 1, k + m + 1], [k, k + m + 1, k + m]]);
        }
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}

fn stl(path: &str, scale: f64) -> Triangles {
    let bytes = std::fs::read(path).unwrap();
    let mut soup = Triangles::default();
    for record in bytes[84..].chunks_exact(50) {
        let k = soup.vertices.len() as u32;
        for c in 0..3 {
            let at = |j: usize| f64::from(f32::from_le_bytes(record[12 + c * 12 + j * 4..][..4].try_into().unwrap()));
            soup.vertices.push(DVec3::new(at(0), at(1), at(2)) * scale);
        }
        soup.triangles.push([k, k + 1, k + 2]);
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}

fn main() {
    let mut cases = vec![
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
    println!("{:20} {:>7} {:>7} {:>7} {:>9}", "surface", "facets", "pieces", "target", "ms");
    for (name, soup, target) in cases {
        for seed in 0..env("SEEDS", 1) {
            let start = Instant::now();
            let tolerance = Tolerance::of_size(soup.size());
            let mesh = Mesh::new(soup.clone(), tolerance).unwrap();
            let problem = Problem::new(&mesh, TabShapes::new(&mesh, TabStyle::default()), Sheet { size: DVec2::new(277.0, 190.0) });
            let default = Effort::default();
            let effort = Effort { seed, runs: env("RUNS", default.runs.into()) as u32, work: env("WORK", default.work) };
            let net = search(&problem, effort, &|_| false);
            let ms = start.elapsed().as_secs_f64() * 1e3;
            println!(
                "{name:20} {:7} {:7} {target:7} {ms:9.0}  without tab {} work {}",
                mesh.facets.len(),
                net.pieces,
                net.without_tab(),
                net.work
            );
        }
    }
}
