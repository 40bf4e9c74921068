//! A height field as paper rounds it: opened and closed with a ball, on a grid.

use super::bare_tile::bare_tile;
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::{HeightGrid, Tile};
use biscale::material::SmallScale;
use glam::DVec2;

/// Nodes along each side of the sampled period. Chosen, not measured: what this sampling changes is told beside the result.
const NODES: usize = 96;

/// The same, for places that wrap around.
const WRAP: i64 = 96;

/// Triangles of a tile up to which each point looks through all of them. Chosen, not measured.
const MAX_DENSE: usize = 20_000;

/// Heights of the highest surface over each node, one period.
pub(super) fn sample(tile: &Tile) -> Result<Vec<f64>> {
    let cell = tile.period / NODES as f64;
    let mut heights = vec![f64::NEG_INFINITY; NODES * NODES];
    for t in 0..tile.triangles.len() {
        let [a, b, c] = tile.corners(t);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area < -1e-9 * tile.footprint() {
            return Err(overhang());
        }
        if area <= 0.0 {
            continue;
        }
        let low = (a.min(b).min(c).truncate() / cell).floor();
        let high = (a.max(b).max(c).truncate() / cell).ceil();
        let (x0, x1, y0, y1) = (low.x as i64, high.x as i64, low.y as i64, high.y as i64);
        for j in y0..=y1 {
            for i in x0..=x1 {
                let p = DVec2::new(i as f64, j as f64) * cell;
                let (u, v) = ((b.truncate() - p).perp_dot(c.truncate() - p) / area, (c.truncate() - p).perp_dot(a.truncate() - p) / area);
                let w = 1.0 - u - v;
                if u >= -1e-9 && v >= -1e-9 && w >= -1e-9 {
                    let wrapped = |k: i64| k.rem_euclid(WRAP) as usize;
                    let slot = &mut heights[wrapped(j) * NODES + wrapped(i)];
                    *slot = slot.max(u * a.z + v * b.z + w * c.z);
                }
            }
        }
    }
    if heights.iter().any(|h| !h.is_finite()) {
        return Err(overhang());
    }
    Ok(heights)
}

fn overhang() -> Error {
    let remedy =
        "leave `preview` out: folds are rounded by a ball that rolls over and under the surface, which needs one height at every place";
    BadInput::new("the surface overhangs or has gaps, so that it is no height over the plane", remedy).at_field("preview").into()
}

/// Opening (`closing` false) or closing with a ball, on the periodic grid.
pub(super) fn morph(heights: &[f64], period: DVec2, radius: f64, closing: bool) -> Vec<f64> {
    let cell = period / NODES as f64;
    if radius < cell.min_element() {
        return heights.to_vec();
    }
    // No farther than half a period: a larger ball sees the same surface again.
    let reach = ((DVec2::splat(radius) / cell).floor()).min(DVec2::splat(NODES as f64 / 2.0));
    let mut ball: Vec<(i64, i64, f64)> = Vec::new();
    for j in -(reach.y as i64)..=reach.y as i64 {
        for i in -(reach.x as i64)..=reach.x as i64 {
            let r2 = (DVec2::new(i as f64, j as f64) * cell).length_squared();
            if r2 <= radius * radius {
                ball.push((i, j, (radius * radius - r2).sqrt()));
            }
        }
    }
    let at = |i: i64, j: i64| (j.rem_euclid(WRAP) as usize) * NODES + i.rem_euclid(WRAP) as usize;
    let dilate = |h: &[f64], sign: f64| -> Vec<f64> {
        (0..WRAP * WRAP)
            .map(|k| {
                let (x, y) = (k % WRAP, k / WRAP);
                sign * ball.iter().map(|&(i, j, b)| sign * h[at(x + i, y + j)] + b).fold(f64::NEG_INFINITY, f64::max)
            })
            .collect()
    };
    let (first, second) = if closing { (1.0, -1.0) } else { (-1.0, 1.0) };
    dilate(&dilate(heights, first), second)
}

/// The surface with these heights, covered as the original is below.
pub(super) fn on_grid(surface: &SmallScale, heights: &[f64]) -> Result<SmallScale> {
    let tile = &surface.tile;
    let cell = tile.period / NODES as f64;
    let mut out = bare_tile(tile.parts.clone(), tile.period);
    let grid = HeightGrid { columns: NODES, rows: NODES, heights: heights.to_vec() };
    for j in 0..=NODES {
        for i in 0..=NODES {
            out.vertices.push((DVec2::new(i as f64, j as f64) * cell).extend(heights[j % NODES * NODES + i % NODES]));
        }
    }
    if tile.triangles.len() > MAX_DENSE {
        let problem = format!("the tile has {} triangles", tile.triangles.len());
        return Err(BadInput::new(problem, "preview one of at most 20,000: lower its resolution").at_field("preview").into());
    }
    let mut surface_of_triangle = Vec::new();
    let mut uv = Vec::new();
    for corners in grid.triangles() {
        let corners = corners.map(|(i, j)| u32::try_from(j * (NODES + 1) + i).expect("few"));
        let middle = corners.iter().map(|&c| out.vertices[c as usize].truncate()).sum::<DVec2>() / 3.0;
        let below = below(tile, middle);
        out.triangles.push(corners);
        out.part_of_triangle.push(tile.part_of_triangle[below]);
        surface_of_triangle.push(surface.surface_of_triangle[below]);
        uv.push(corners.map(|c| out.vertices[c as usize].truncate() / tile.period));
    }
    out.grid = Some(grid);
    out.uv = tile.uv.as_ref().map(|_| uv);
    Ok(SmallScale { tile: out, surfaces: surface.surfaces.clone(), surface_of_triangle, bounces: surface.bounces })
}

/// The highest triangle over a point of the period.
fn below(tile: &Tile, p: DVec2) -> usize {
    let mut best = (f64::NEG_INFINITY, 0);
    for t in 0..tile.triangles.len() {
        let [a, b, c] = tile.corners(t);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area <= 0.0 {
            continue;
        }
        for shift in
            [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE, -DVec2::X, -DVec2::Y, -DVec2::ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)]
        {
            let q = p + shift * tile.period;
            let (u, v) = ((b.truncate() - q).perp_dot(c.truncate() - q) / area, (c.truncate() - q).perp_dot(a.truncate() - q) / area);
            let z = u * a.z + v * b.z + (1.0 - u - v) * c.z;
            if u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && z > best.0 {
                best = (z, t);
            }
        }
    }
    best.1
}
