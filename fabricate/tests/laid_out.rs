//! What the search accepts can be laid out: on every paper, with every width of tabs, at every scale.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "the benchmark uses more of it")]
#[path = "../benches/surfaces/mod.rs"]
mod surfaces;

use biscale_fabricate::layout::nest;
use biscale_fabricate::mesh::{Mesh, Tolerance, Triangles};
use biscale_fabricate::paper::Paper;
use biscale_fabricate::unfold::{Effort, TabStyle, room, unfold};
use glam::{DVec2, DVec3};
use surfaces::{heights, pyramids};

/// An icosahedron of corners (0, +-1, +-phi) and so on, times `scale`.
fn icosahedron(scale: f64) -> Triangles {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for a in [-1.0, 1.0] {
        for b in [-phi, phi] {
            corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)].map(|v| v * scale));
        }
    }
    let mut triangles = Vec::new();
    for i in 0..12_u32 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|v| corners[v as usize]);
                let edge = |p: DVec3, q: DVec3| (p.distance(q) - 2.0 * scale).abs() < 1e-9 * scale;
                if edge(a, b) && edge(b, c) && edge(c, a) {
                    let outwards = (b - a).cross(c - a).dot(a) > 0.0;
                    triangles.push(if outwards { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    Triangles::white(corners, triangles)
}

fn scaled(mut soup: Triangles, scale: f64) -> Mesh {
    soup.vertices.iter_mut().for_each(|v| *v *= scale);
    let tolerance = Tolerance::of_size(soup.size());
    Mesh::new(soup, tolerance).unwrap()
}

/// Unfolds and lays out. False where a facet is larger than the page, which is told before anything is searched.
fn laid_out(mesh: &Mesh, paper: Paper, tab: f64, seed: u64, work: u64) -> bool {
    let tabs = TabStyle { width: tab };
    let effort = Effort { seed, work, ..Effort::default() };
    let Ok((pattern, _)) = unfold(mesh, false, room(paper, tabs), tabs, effort, &|_| false) else { return false };
    let outlines: Vec<Vec<DVec2>> = pattern.pieces.iter().map(|p| p.outline[0].clone()).collect();
    let [_, area] = paper.area();
    let laid = nest(&outlines, area, paper.roll);
    assert!(laid.is_ok(), "{} {tab} mm, seed {seed}: {}", paper.name, laid.unwrap_err());
    true
}

const A4: Paper = Paper { name: "a4", size: DVec2::new(210.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };

#[test]
fn an_icosahedron_is_laid_out_at_every_seed() {
    // Edges of 70 mm: pieces fit the page aslant only.
    let mesh = scaled(icosahedron(35.0), 1.0);
    for seed in 0..12 {
        assert!(laid_out(&mesh, A4, 5.0, seed, 2000), "seed {seed}");
    }
}

#[test]
#[ignore = "360 runs take a minute; `cargo test -p biscale-fabricate --test laid_out -- --ignored --nocapture`"]
fn all_of_360_runs_are_laid_out() {
    let papers = [
        A4,
        Paper { name: "letter", size: DVec2::new(215.9, 279.4), ..A4 },
        Paper { name: "a5", size: DVec2::new(148.0, 210.0), ..A4 },
        Paper { name: "a3-landscape", size: DVec2::new(420.0, 297.0), ..A4 },
        Paper { name: "roll:300", size: DVec2::new(300.0, 2000.0), roll: true, ..A4 },
    ];
    let surfaces = [("icosahedron", icosahedron(1.0)), ("pyramids", pyramids(8, 0.4, 0.3)), ("heights", heights(10, 0.3, 0.3, 1))];
    let (mut runs, mut refused) = (0, 0);
    for (name, soup) in &surfaces {
        for (k, scale) in [20.0, 35.0, 47.0, 70.0].into_iter().enumerate() {
            let mesh = scaled(soup.clone(), scale);
            for paper in papers {
                for (j, tab) in [3.0, 5.0, 8.0].into_iter().enumerate() {
                    for seed in 0..2 {
                        runs += 1;
                        if !laid_out(&mesh, paper, tab, seed + (10 * k + 100 * j) as u64, 300) {
                            refused += 1;
                            println!("{name} x {scale}, {}, tabs of {tab} mm: a facet is larger than the page", paper.name);
                        }
                    }
                }
            }
        }
    }
    println!("{runs} runs, {refused} of them with facets larger than the page");
    assert!(runs >= 300 + refused);
}
