//! Visibility of many facets in one direction, by projecting the triangles along it.
//!
//! Along a direction `w`, the point `(x, y, z)` projects to `(x - z w.x / w.z, y - z w.y / w.z)`: the projection keeps the lattice of
//! the tile, so the infinite surface becomes one torus, and a ray becomes a point of it. A facet is hidden when a triangle
//! covers its point from higher up. Points are sorted into the cells of a grid, and each triangle is compared with the points of
//! the cells that it covers (an *irregular z-buffer*: Aila and Laine 2004, "Alias-free shadow maps"; Johnson et al. 2005). The answer
//! is exact, as a ray's is: nothing is sampled, and no period is left out.
//!
//! A ray costs about as much as 50 such comparisons, but each facet needs one ray a direction, while the triangles are set up
//! once a direction for all facets: this pays where facets are not far fewer than triangles. Near the horizon the projected
//! triangles span many periods and rays are better: see [`reach`].

use crate::facets::{Facets, LANES, NO_TRIANGLE, Surface};
use glam::{DVec2, DVec3};
use pulp::Arch;

/// Height, as a share of the larger period and per unit of `w.z`, by which an occluder must exceed a facet: what f32 positions can tell apart.
const BIAS: f64 = 1e-5;

/// Mean number of points in a cell of the grid. Fewer cost more rows of cells a triangle, more cost more comparisons.
const POINTS_PER_CELL: f64 = 6.0;

/// How many periods the projection of the surface spans along a direction: what its height is worth sideways.
pub fn reach(surface: &Surface, direction: DVec3) -> f64 {
    let height = surface.vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.z), high.max(v.z)));
    let stretch = DVec2::new(direction.x, direction.y).abs() / direction.z * (height.1 - height.0).max(0.0) / surface.period;
    stretch.max_element()
}

/// Buffers that one direction after another uses.
#[derive(Debug, Default)]
pub struct Scratch {
    facing: Vec<bool>,
    vertex: Vec<[f32; 3]>,
    cell_of: Vec<u32>,
    cells: Vec<u32>,
    unsorted: Vec<[f32; 3]>,
    points: Points,
}

/// The points of the facets that face the direction, sorted by cell.
#[derive(Debug, Default)]
struct Points {
    u: Vec<f32>,
    v: Vec<f32>,
    /// Height above which a triangle hides the point.
    z: Vec<f32>,
    triangle: Vec<u32>,
    facet: Vec<u32>,
    hidden: Vec<u32>,
}

/// Writes the bits of `direction` (with `z > 0`) into `row`, one bit a facet.
pub fn visible(surface: &Surface, facets: &Facets, direction: DVec3, scratch: &mut Scratch, row: &mut [u64]) {
    Arch::new().dispatch(
        #[inline(always)]
        || visible_in_lanes(surface, facets, direction, scratch, row),
    );
}

/// A square grid of cells over one period of the projection.
#[derive(Clone, Copy)]
struct Grid {
    columns: u32,
    rows: u32,
}

#[inline(always)]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "cells and coordinates are bounded by the grid"
)]
fn visible_in_lanes(surface: &Surface, facets: &Facets, direction: DVec3, scratch: &mut Scratch, row: &mut [u64]) {
    row.fill(0);
    let Scratch { facing, vertex, cell_of, cells, unsorted, points } = scratch;
    facing.clear();
    facing.extend(surface.normals.iter().map(|n| n.dot(direction) > 0.0));

    let faces = |t: u32| t != NO_TRIANGLE && facing[t as usize];
    let count = facets.triangle.iter().filter(|&&t| faces(t)).count();
    if count == 0 {
        return;
    }
    let aspect = surface.period.x / surface.period.y;
    let wanted = (count as f64 / POINTS_PER_CELL).max(1.0);
    let side = |x: f64| (x.sqrt().round() as u32).clamp(1, 1024);
    let grid = Grid { columns: side(wanted * aspect), rows: side(wanted / aspect) };
    let scale = DVec2::new(f64::from(grid.columns), f64::from(grid.rows)) / surface.period;
    let shear = DVec2::new(direction.x, direction.y) / direction.z;
    let project = |p: DVec3| (DVec2::new(p.x, p.y) - p.z * shear) * scale;

    vertex.clear();
    vertex.extend(surface.vertices.iter().map(|&p| {
        let uv = project(p);
        [uv.x as f32, uv.y as f32, p.z as f32]
    }));

    // Points of the facets that face the direction, wrapped into the grid and sorted by cell.
    let (columns, rows) = (f64::from(grid.columns), f64::from(grid.rows));
    let bias = BIAS * direction.z;
    cells.clear();
    cells.resize((grid.columns * grid.rows) as usize + 1, 0);
    cell_of.clear();
    unsorted.clear();
    points.facet.clear();
    points.triangle.clear();
    for (facet, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
        if !faces(triangle) {
            continue;
        }
        let uv = project(position);
        let u = (uv.x - (uv.x / columns).floor() * columns) as f32;
        let v = (uv.y - (uv.y / rows).floor() * rows) as f32;
        let cell = (v as u32).min(grid.rows - 1) * grid.columns + (u as u32).min(grid.columns - 1);
        cells[cell as usize + 1] += 1;
        cell_of.push(cell);
        unsorted.push([u, v, (position.z + bias) as f32]);
        points.facet.push(facet as u32);
    }
    for c in 1..cells.len() {
        cells[c] += cells[c - 1];
    }
    let padded = count + LANES;
    for buffer in [&mut points.u, &mut points.v, &mut points.z] {
        buffer.clear();
        buffer.resize(padded, 0.0);
    }
    for buffer in [&mut points.triangle, &mut points.hidden] {
        buffer.clear();
        buffer.resize(padded, 0);
    }
    // Counting sort; `cells[c]` moves from the start of cell c to the start of the next one.
    let mut facet_sorted = std::mem::take(&mut points.facet);
    let facet_unsorted = facet_sorted.clone();
    for ((&cell, point), &facet) in cell_of.iter().zip(unsorted.iter()).zip(&facet_unsorted) {
        let slot = cells[cell as usize] as usize;
        cells[cell as usize] += 1;
        [points.u[slot], points.v[slot], points.z[slot]] = *point;
        points.triangle[slot] = facets.triangle[facet as usize];
        facet_sorted[slot] = facet;
    }
    points.facet = facet_sorted;

    for (index, triangle) in surface.triangles.iter().enumerate() {
        compare(grid, cells, points, index as u32, triangle.map(|v| vertex[v as usize]));
    }
    for (&facet, &hidden) in points.facet.iter().zip(&points.hidden) {
        row[facet as usize / 64] |= u64::from(hidden == 0) << (facet % 64);
    }
}

/// Marks the points that a projected triangle hides. `cells[c]` is the end of the points of cell `c`.
#[inline(always)]
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap,
    reason = "cells and coordinates are bounded by the grid"
)]
fn compare(grid: Grid, cells: &[u32], points: &mut Points, index: u32, [a, b, c]: [[f32; 3]; 3]) {
    let (ab, ac) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    let area = ab[0] * ac[1] - ab[1] * ac[0];
    let inverse = 1.0 / area;
    if !inverse.is_finite() {
        return; // edge-on: covers nothing
    }
    // Barycentric coordinates of a + d are (m0 · d, m1 · d).
    let m0 = [ac[1] * inverse, -ac[0] * inverse];
    let m1 = [-ab[1] * inverse, ab[0] * inverse];
    let low = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
    let high = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
    let (columns, rows) = (grid.columns as i32, grid.rows as i32);
    let (first_row, last_row) = (low[1].floor() as i32, high[1].floor() as i32);
    let (first_column, last_column) = (low[0].floor() as i32, high[0].floor() as i32);
    let narrow = last_column - first_column < 2;
    for row in first_row..=last_row {
        // The columns that the triangle covers within this row: conservative, from the edges clipped to the row.
        let (mut from, mut to) = (first_column, last_column);
        if !narrow {
            let (bottom, top) = (row as f32, (row + 1) as f32);
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
                if q[1] < bottom || p[1] > top {
                    continue;
                }
                let slope = if q[1] > p[1] { (q[0] - p[0]) / (q[1] - p[1]) } else { 0.0 };
                let at_bottom = if p[1] < bottom { p[0] + (bottom - p[1]) * slope } else { p[0] };
                let at_top = if q[1] > top { p[0] + (top - p[1]) * slope } else { q[0] };
                left = left.min(at_bottom).min(at_top);
                right = right.max(at_bottom).max(at_top);
            }
            // A thousandth of a cell covers the rounding of the clipped ends.
            from = from.max((left - 1e-3).floor() as i32);
            to = to.min((right + 1e-3).floor() as i32);
        }
        let (lattice_row, wrapped_row) = (row.div_euclid(rows), row.rem_euclid(rows));
        let mut column = from;
        while column <= to {
            let (lattice_column, wrapped_column) = (column.div_euclid(columns), column.rem_euclid(columns));
            let run = (to - column).min(columns - 1 - wrapped_column);
            let cell = (wrapped_row * columns + wrapped_column) as usize;
            let start = if cell == 0 { 0 } else { cells[cell - 1] } as usize;
            let end = cells[cell + run as usize] as usize;
            column += run + 1;
            if start == end {
                continue;
            }
            let origin = [a[0] - (lattice_column * columns) as f32, a[1] - (lattice_row * rows) as f32];
            let mut at = start;
            while at < end {
                let lanes =
                    |values: &[f32]| -> [f32; LANES] { values[at..at + LANES].try_into().expect("the points are padded by a chunk") };
                let (u, v, z) = (lanes(&points.u), lanes(&points.v), lanes(&points.z));
                let own: [u32; LANES] = points.triangle[at..at + LANES].try_into().expect("the points are padded by a chunk");
                let hidden: &mut [u32; LANES] = (&mut points.hidden[at..at + LANES]).try_into().expect("the points are padded by a chunk");
                for l in 0..LANES {
                    let d = [u[l] - origin[0], v[l] - origin[1]];
                    let s = m0[0] * d[0] + m0[1] * d[1];
                    let t = m1[0] * d[0] + m1[1] * d[1];
                    let height = a[2] + s * ab[2] + t * ac[2];
                    let hides = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (height > z[l]) & (own[l] != index);
                    hidden[l] |= u32::from(hides);
                }
                at += LANES;
            }
        }
    }
}
