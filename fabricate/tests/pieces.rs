//! Piece counts: at or under the best of the programs that people use for papercraft.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "the benchmark uses more of it")]
#[path = "../benches/surfaces/mod.rs"]
mod surfaces;

use biscale_fabricate::mesh::{Mesh, Tolerance, Triangles};
use biscale_fabricate::unfold::{Effort, Problem, Sheet, TabShapes, TabStyle, search};
use glam::DVec2;
use surfaces::{grooves, heights, pyramids, stl};

/// Pieces for A4, tabs of 5 mm; every glued edge has one.
fn pieces(soup: Triangles, seed: u64) -> usize {
    let tolerance = Tolerance::of_size(soup.size());
    let mesh = Mesh::new(soup, tolerance).unwrap();
    let problem = Problem::new(&mesh, TabShapes::new(&mesh, TabStyle::default()), Sheet { size: DVec2::new(277.0, 190.0) });
    let net = search(&problem, Effort { seed, ..Effort::default() }, &|_| false);
    assert_eq!(net.without_tab().count(), 0);
    net.pieces
}

#[test]
fn sixteen_grooves_are_one_strip() {
    for seed in 0..3 {
        assert_eq!(pieces(grooves(16, 6, 10.0, 5.0), seed), 1, "seed {seed}");
    }
}

#[test]
fn pyramids_take_few_pieces() {
    for (n, most) in [(4, 1), (8, 1), (16, 5)] {
        for seed in 0..2 {
            let count = pieces(pyramids(n, 10.0, 5.0), seed);
            assert!(count <= most, "{n} x {n}, seed {seed}: {count} pieces");
        }
    }
}

#[test]
fn random_height_fields_take_few_pieces() {
    for (amplitude, random) in [(5.0, 1), (5.0, 2), (10.0, 3)] {
        let count = pieces(heights(16, 10.0, amplitude, random), 0);
        assert!(count <= 6, "amplitude {amplitude}: {count} pieces");
    }
}

#[test]
fn a_small_bunny_takes_few_pieces() {
    let Some(data) = std::env::var_os("BISCALE_DATA") else {
        println!("skipped: BISCALE_DATA is not set");
        return;
    };
    let path = format!("{}/meshes/bunny.stl", data.to_string_lossy());
    let soup = stl(&path, 150.0 / stl(&path, 1.0).size());
    for seed in 0..3 {
        let count = pieces(soup.clone(), seed);
        assert!(count <= 5, "seed {seed}: {count} pieces");
    }
}
