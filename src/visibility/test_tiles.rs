//! Small surfaces that the tests of this crate share.

use crate::geometry::{HeightGrid, Tile};
use crate::numerics::random::Random;
use glam::{DVec2, DVec3};

/// Uniform in solid angle over the upper hemisphere.
pub(crate) fn upper(random: &mut Random) -> DVec3 {
    direction(random.unit().acos(), random.unit() * std::f64::consts::TAU)
}

/// Unit vector at `theta` from z and azimuth `phi`, radians.
pub(crate) fn direction(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// A tile of one part.
pub(crate) fn tile(period: DVec2, vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Tile {
    Tile {
        vertices,
        part_of_triangle: vec![0; triangles.len()],
        triangles,
        parts: vec!["all".into()],
        uv: None,
        period,
        grid: None,
        notes: Vec::new(),
    }
}

/// One period of a surface that is straight along y: `profile` gives its points `(x, z)` from left to right.
pub(crate) fn extruded(period: DVec2, profile: &[(f64, f64)]) -> Tile {
    let vertices = profile.iter().flat_map(|&(x, z)| [DVec3::new(x, 0.0, z), DVec3::new(x, period.y, z)]).collect();
    let triangles = (0..profile.len() as u32 - 1).flat_map(|k| [[2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1]]).collect();
    tile(period, vertices, triangles)
}

/// The flat plane z = `height`.
pub(crate) fn flat(period: DVec2, height: f64) -> Tile {
    extruded(period, &[(0.0, height), (period.x, height)])
}

/// A symmetric V-groove along y: ridges at x = 0, its bottom `depth` below them in the middle.
pub(crate) fn v_groove(period: DVec2, depth: f64) -> Tile {
    extruded(period, &[(0.0, 0.0), (0.5 * period.x, -depth), (period.x, 0.0)])
}

/// A height field on `columns x rows` nodes, with its grid.
pub(crate) fn height_field(period: DVec2, columns: usize, rows: usize, height: impl Fn(usize, usize) -> f64) -> Tile {
    let heights: Vec<f64> = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| height(i, j)).collect();
    let node = |i: usize, j: usize| {
        DVec3::new(i as f64 * period.x / columns as f64, j as f64 * period.y / rows as f64, heights[(j % rows) * columns + i % columns])
    };
    let vertices = (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j))).map(|(i, j)| node(i, j)).collect();
    let place = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    let grid = HeightGrid { columns, rows, heights };
    let triangles = grid.triangles().map(|corners| corners.map(|(i, j)| place(i, j))).collect();
    Tile { grid: Some(grid), ..tile(period, vertices, triangles) }
}

/// A rough height field with heights in `0..=amplitude`.
pub(crate) fn rough(period: DVec2, nodes: usize, amplitude: f64, seed: u64) -> Tile {
    let mut random = Random::from_state(seed);
    let heights: Vec<f64> = (0..nodes * nodes).map(|_| random.unit() * amplitude).collect();
    height_field(period, nodes, nodes, |i, j| heights[j * nodes + i])
}

/// Random triangles, some of which reach over several periods.
pub(crate) fn soup(period: DVec2, height: f64, count: u32, seed: u64) -> Tile {
    let mut random = Random::from_state(seed);
    let mut vertices = Vec::new();
    for _ in 0..count {
        let centre = DVec3::new(3.0 * random.unit() - 1.0, 3.0 * random.unit() - 1.0, random.unit());
        let size = if random.unit() < 0.2 { 2.0 } else { 0.3 };
        for _ in 0..3 {
            let offset = DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) * size;
            vertices.push((centre + offset) * period.extend(height));
        }
    }
    tile(period, vertices, (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect())
}

/// A point of a triangle, by two numbers in [0, 1).
pub(crate) fn point(tile: &Tile, triangle: usize, a: f64, b: f64) -> DVec3 {
    let [p, q, r] = tile.corners(triangle);
    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
    p + a * (q - p) + b * (r - p)
}
