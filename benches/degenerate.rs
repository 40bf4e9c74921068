//! Inputs at the edge: what they cost, beside an ordinary one.
//!
//! usage: `cargo bench --bench degenerate -- [CASE...]`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::direction::Pair;
use biscale::filter::Quality;
use biscale::geometry::{HeightGrid, Tile};
use biscale::material::SmallScale;
use glam::{DVec2, DVec3};

/// Directions of an ordinary list.
const DIRECTIONS: usize = 64;
/// Angles from z of the grazing ones, degrees.
const GRAZING_DEG: [f64; 4] = [88.0, 89.0, 89.9, 90.0];
/// Nodes on a side of the large height field: 2 * 548² = 600,608 triangles.
const NODES: usize = 548;

/// Every direction with every one, and none twice.
fn ordinary() -> Vec<Pair> {
    common::all_pairs(&common::spread_directions(DIRECTIONS, 85.0))
}

/// Pairs of directions close to the horizon with each other and with ordinary ones.
fn grazing() -> Vec<Pair> {
    let mut directions = common::spread_directions(DIRECTIONS / 2, 85.0);
    for theta_deg in GRAZING_DEG {
        let (sin, cos) = theta_deg.to_radians().sin_cos();
        directions.extend((0..8).map(|k| {
            let phi = f64::from(k) * std::f64::consts::FRAC_PI_4 + 0.1;
            DVec3::new(sin * phi.cos(), sin * phi.sin(), cos.max(0.0)).normalize()
        }));
    }
    common::all_pairs(&directions)
}

/// One triangle over an open period.
fn one_facet() -> SmallScale {
    let tile = Tile {
        vertices: vec![DVec3::new(0.1, 0.1, 0.0), DVec3::new(0.8, 0.2, 0.1), DVec3::new(0.3, 0.9, 0.3)],
        triangles: vec![[0, 1, 2]],
        part_of_triangle: vec![0],
        parts: vec!["all".into()],
        uv: None,
        period: DVec2::ONE,
        grid: None,
        notes: Vec::new(),
    };
    SmallScale { tile, surfaces: vec![common::whole(common::diffuse())], surface_of_triangle: vec![0], bounces: 0 }
}

/// Waves of several sizes, as a height field.
fn large_height_field() -> SmallScale {
    let height = |i: usize, j: usize| {
        let at = |n: usize| n as f64 / NODES as f64 * std::f64::consts::TAU;
        let (x, y) = (at(i % NODES), at(j % NODES));
        0.02 * (3.0 * x + 2.0 * y).sin() + 0.01 * (11.0 * x - 7.0 * y).cos() + 0.002 * (61.0 * x + 53.0 * y).sin()
    };
    let side = NODES + 1;
    let vertices = (0..side * side)
        .map(|k| DVec3::new((k % side) as f64 / NODES as f64, (k / side) as f64 / NODES as f64, height(k % side, k / side)))
        .collect();
    let place = |i: usize, j: usize| u32::try_from(j * side + i).expect("fewer than 2^32 nodes");
    let heights = (0..NODES * NODES).map(|k| height(k % NODES, k / NODES)).collect();
    let grid = HeightGrid { columns: NODES, rows: NODES, heights };
    let triangles: Vec<[u32; 3]> = grid.triangles().map(|corners| corners.map(|(i, j)| place(i, j))).collect();
    let count = triangles.len();
    let tile = Tile {
        vertices,
        triangles,
        part_of_triangle: vec![0; count],
        parts: vec!["all".into()],
        uv: None,
        period: DVec2::ONE,
        grid: Some(grid),
        notes: Vec::new(),
    };
    SmallScale { tile, surfaces: vec![common::whole(common::diffuse())], surface_of_triangle: vec![0; count], bounces: 0 }
}

/// A name, a surface, and what is asked of it.
type Case = (&'static str, fn() -> SmallScale, fn() -> Vec<Pair>);

const CASES: [Case; 8] = [
    ("ordinary: bumpy, diffuse", || common::covered("bumpy", common::diffuse()), ordinary),
    ("alpha 1e-3 on bumpy", || common::covered("bumpy", common::ggx(1e-3)), ordinary),
    ("alpha 1e-3 on a pyramid's four normals", || common::covered("pyramid", common::ggx(1e-3)), ordinary),
    ("one facet", one_facet, ordinary),
    ("height field of 600,608 triangles", large_height_field, ordinary),
    ("grazing pairs on bumpy", || common::covered("bumpy", common::diffuse()), grazing),
    ("grazing pairs on rods", || common::covered("rods", common::diffuse()), grazing),
    ("grazing pairs on a height field of 600,608 triangles", large_height_field, grazing),
];

fn main() {
    let arguments = common::arguments();
    println!("| case | pairs | triangles | facets | estimated error | CPU s | wall s | peak MiB | stages, ms |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, surface, pairs) in CASES {
        if !arguments.is_empty() && !arguments.iter().any(|a| name.contains(a.as_str())) {
            continue;
        }
        let (small, pairs) = (surface(), pairs());
        common::reset_peak();
        let (got, cost) = common::measure(|| common::run(&small, &pairs, &Quality::default()));
        println!(
            "| {name} | {} | {} | {} | {:.2} % | {:.3} | {:.3} | {:.0} | {} |",
            pairs.len(),
            small.tile.triangles.len(),
            got.summary.facets,
            100.0 * got.summary.relative_rms,
            cost.cpu,
            cost.wall,
            common::peak_mib().unwrap_or(f64::NAN),
            common::stages(&got)
        );
    }
}
