//! Visibility of many facets in one direction, by projecting the triangles along it.
//!
//! Along a direction `w`, the point `(x, y, z)` projects to `(x - z w.x / w.z, y - z w.y / w.z)`: the projection keeps the lattice of
//! the tile, so the infinite surface becomes one torus, and a ray becomes a point of it. A facet is hidden when a triangle
//! covers its point from higher up. Points are sorted into the cells of a grid, and each triangle is compared with the points of
//! the cells that it covers (an *irregular z-buffer*: Aila and Laine 2004, "Alias-free shadow maps"; Johnson et al. 2005). The answer
//! is exact, as a ray's is: nothing is sampled, and no period is left out. Triangles come from the top down, and the points that
//! they have hidden are taken out now and then: most points are hidden by the first few layers.
//!
//! A ray costs about as much as 50 such comparisons, but each facet needs one ray a direction, while the triangles are set up
//! once a direction for all facets: this pays where facets are not far fewer than triangles. Near the horizon the projected
//! triangles span many periods and rays are better: see [`reach`].

use crate::facets::{Facets, NO_TRIANGLE, Surface};
use crate::simd::{self, Kernel};
use glam::{DVec2, DVec3};

/// Height, as a share of the larger period and per unit of `w.z`, by which an occluder must exceed a facet: what f32 positions can tell apart.
const BIAS: f64 = 1e-5;

/// Mean number of points in a cell of the grid. Fewer cost more rows of cells a triangle, more cost more comparisons.
const POINTS_PER_CELL: f64 = 4.0;

/// Points compared at once: most runs of points that a triangle covers within a row of cells are short.
const POINTS: usize = 8;

/// Directions whose [`reach`] is larger are better served by rays.
pub const MAX_REACH: f64 = 16.0;

/// How many periods the projection of the surface spans along a direction: what its height is worth sideways.
pub fn reach(surface: &Surface, direction: DVec3) -> f64 {
    (DVec2::new(direction.x, direction.y).abs() / direction.z * surface.height / surface.period).max_element()
}

/// Buffers that one direction after another uses.
#[derive(Debug, Default)]
pub struct Scratch {
    facing: Vec<bool>,
    /// Projected vertices: position in periods, and height.
    vertex: Vec<[f32; 3]>,
    open: Vec<Point>,
    cell_of: Vec<u32>,
    cells: Vec<u32>,
    points: Points,
}

/// The projection of a facet.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// Position in 0..1 of a period.
    uv: [f32; 2],
    /// Height above which a triangle hides it.
    z: f32,
    triangle: u32,
    facet: u32,
}

/// Points sorted by cell, structure of arrays.
#[derive(Debug, Default)]
struct Points {
    u: Vec<f32>,
    v: Vec<f32>,
    z: Vec<f32>,
    triangle: Vec<u32>,
    hidden: Vec<u32>,
    /// For each place of the sorted points its place among the open ones.
    order: Vec<u32>,
}

/// Writes the bits of `direction` (with `z > 0`) into `row`, one bit a facet.
pub fn visible(surface: &Surface, facets: &Facets, direction: DVec3, scratch: &mut Scratch, row: &mut [u64]) {
    simd::run(Visible { surface, facets, direction, scratch, row });
}

struct Visible<'a> {
    surface: &'a Surface,
    facets: &'a Facets,
    direction: DVec3,
    scratch: &'a mut Scratch,
    row: &'a mut [u64],
}

impl Kernel for Visible<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        visible_in_lanes(self.surface, self.facets, self.direction, self.scratch, self.row);
    }
}

/// A grid of cells over one period of the projection.
#[derive(Clone, Copy)]
struct Grid {
    columns: i32,
    rows: i32,
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "positions are compared in f32")]
fn visible_in_lanes(surface: &Surface, facets: &Facets, direction: DVec3, scratch: &mut Scratch, row: &mut [u64]) {
    row.fill(0);
    let Scratch { facing, vertex, open, cell_of, cells, points } = scratch;
    facing.clear();
    facing.extend(surface.normals.iter().map(|n| n.dot(direction) > 0.0));
    let shear = DVec2::new(direction.x, direction.y) / direction.z;
    let project = |p: DVec3| (DVec2::new(p.x, p.y) - p.z * shear) / surface.period;
    vertex.clear();
    vertex.extend(surface.vertices.iter().map(|&p| {
        let uv = project(p);
        [uv.x as f32, uv.y as f32, p.z as f32]
    }));
    let bias = BIAS * direction.z;
    open.clear();
    for (facet, (&triangle, &position)) in (0..).zip(facets.triangle.iter().zip(&facets.position)) {
        if triangle != NO_TRIANGLE && facing[triangle as usize] {
            let uv = project(position);
            let uv = uv - uv.floor();
            open.push(Point { uv: [uv.x as f32, uv.y as f32], z: (position.z + bias) as f32, triangle, facet });
        }
    }
    let stretch = (DVec2::ONE + shear.abs() * surface.height) / surface.period;
    let triangles = surface.triangles.len();
    let mut next = 0;
    while next < triangles && !open.is_empty() {
        let grid = sort(open, stretch, cell_of, cells, points);
        let lowest = open.iter().fold(f32::INFINITY, |low, p| low.min(p.z));
        // From the top down, a sixteenth, then an eighth, ... of the triangles, and the hidden points taken out.
        let end = if next == 0 { triangles.div_ceil(16) } else { (2 * next).min(triangles) };
        for &t in &surface.top_down[next..end] {
            let corners = surface.triangles[t as usize].map(|v| vertex[v as usize]);
            if corners[0][2].max(corners[1][2]).max(corners[2][2]) <= lowest {
                next = triangles;
                break;
            }
            compare(grid, cells, points, t, corners);
        }
        next = next.max(end);
        let mut place = 0;
        let hidden = &mut cell_of[..open.len()];
        for (&order, &h) in points.order.iter().zip(&points.hidden) {
            hidden[order as usize] = h;
        }
        open.retain(|_| {
            place += 1;
            hidden[place - 1] == 0
        });
    }
    for point in open {
        row[point.facet as usize / 64] |= 1 << (point.facet % 64);
    }
}

/// Sorts the points into cells; `cells[c]` becomes the end of the points of cell `c`.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cells are counted in u32 and bounded by the grid")]
fn sort(open: &[Point], stretch: DVec2, cell_of: &mut Vec<u32>, cells: &mut Vec<u32>, points: &mut Points) -> Grid {
    // Cells as long as triangles are stretched, so that a triangle covers few rows.
    let wanted = (open.len() as f64 / POINTS_PER_CELL).max(1.0);
    let aspect = (stretch.x / stretch.y).clamp(1.0 / 64.0, 64.0);
    let side = |x: f64| (x.sqrt().round() as i32).clamp(1, 2048);
    let grid = Grid { columns: side(wanted / aspect), rows: side(wanted * aspect) };
    cells.clear();
    cells.resize((grid.columns * grid.rows) as usize + 1, 0);
    cell_of.clear();
    let (columns, rows) = (grid.columns as f32, grid.rows as f32);
    for point in open {
        let column = ((point.uv[0] * columns) as i32).clamp(0, grid.columns - 1);
        let row = ((point.uv[1] * rows) as i32).clamp(0, grid.rows - 1);
        let cell = (row * grid.columns + column) as u32;
        cells[cell as usize + 1] += 1;
        cell_of.push(cell);
    }
    for c in 1..cells.len() {
        cells[c] += cells[c - 1];
    }
    let padded = open.len() + POINTS;
    for buffer in [&mut points.u, &mut points.v, &mut points.z] {
        buffer.resize(padded, 0.0);
    }
    points.triangle.resize(padded, 0);
    points.order.resize(open.len(), 0);
    points.hidden.clear();
    points.hidden.resize(padded, 0);
    // `cells[c]` moves from the start of cell c to the start of the next one.
    for (index, (&cell, point)) in (0..).zip(cell_of.iter().zip(open)) {
        let slot = cells[cell as usize] as usize;
        cells[cell as usize] += 1;
        points.u[slot] = point.uv[0];
        points.v[slot] = point.uv[1];
        points.z[slot] = point.z;
        points.triangle[slot] = point.triangle;
        points.order[slot] = index;
    }
    grid
}

/// One edge of a projected triangle.
struct Edge {
    /// The end with the smaller v.
    low: [f32; 2],
    /// The larger v.
    high: f32,
    /// Change of u with v.
    slope: f32,
}

#[inline(always)]
fn edge(p: [f32; 3], q: [f32; 3]) -> Edge {
    let (p, q) = if p[1] <= q[1] { (p, q) } else { (q, p) };
    let slope = if q[1] > p[1] { (q[0] - p[0]) / (q[1] - p[1]) } else { 0.0 };
    Edge { low: [p[0], p[1]], high: q[1], slope }
}

/// Largest coordinate, in cells, that [`cell_at`] takes.
const LARGEST_CELL: f32 = 4_194_303.0;

/// The cell that holds a coordinate in `0..=LARGEST_CELL`: `floor`, without the checks of a saturating cast.
#[inline(always)]
#[expect(clippy::cast_possible_wrap, reason = "the exponent bits cancel")]
fn cell_at(x: f32) -> i32 {
    // Added to a whole number below 2^22, leaves it in the lowest bits of the sum.
    const SHIFT: f32 = 8_388_608.0;
    ((x.floor() + SHIFT).to_bits() - SHIFT.to_bits()) as i32
}

/// Marks the points that a projected triangle hides. `cells[c]` is the end of the points of cell `c`.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cells are bounded by the grid")]
fn compare(grid: Grid, cells: &[u32], points: &mut Points, index: u32, [a, b, c]: [[f32; 3]; 3]) {
    let (ab, ac) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    let inverse = 1.0 / (ab[0] * ac[1] - ab[1] * ac[0]);
    if !inverse.is_finite() {
        return; // edge-on: covers nothing
    }
    // Barycentric coordinates of a + d are (m0 · d, m1 · d).
    let m0 = [ac[1] * inverse, -ac[0] * inverse];
    let m1 = [-ab[1] * inverse, ab[0] * inverse];
    let (columns, rows) = (grid.columns as f32, grid.rows as f32);
    let low = [a[0].min(b[0]).min(c[0]), a[1].min(b[1]).min(c[1])];
    let high = [a[0].max(b[0]).max(c[0]), a[1].max(b[1]).max(c[1])];
    // Moved by whole periods so that its lowest corner lies in the grid: from here on cells are counted from 0.
    let lattice = [low[0].floor(), low[1].floor()];
    let [a, b, c] = [a, b, c].map(|p| [p[0] - lattice[0], p[1] - lattice[1], p[2]]);
    let first_column = cell_at((low[0] - lattice[0]) * columns);
    let last_column = cell_at((high[0] - lattice[0]) * columns);
    let first_row = cell_at((low[1] - lattice[1]) * rows);
    let last_row = cell_at((high[1] - lattice[1]) * rows);
    let edges = [edge(a, b), edge(b, c), edge(c, a)];
    let narrow = last_column - first_column < 2;
    let (row_height, mut lattice_row, mut wrapped_row) = (1.0 / rows, 0.0, first_row);
    for row in first_row..=last_row {
        if wrapped_row >= grid.rows {
            wrapped_row -= grid.rows;
            lattice_row += 1.0;
        }
        let row_start = (wrapped_row * grid.columns) as usize;
        wrapped_row += 1;
        // The columns that the triangle covers within this row: conservative, from the edges clipped to the row.
        let (mut from, mut to) = (first_column, last_column);
        if !narrow {
            let (bottom, top) = (row as f32 * row_height, (row + 1) as f32 * row_height);
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for e in &edges {
                let (start, end) = (bottom.max(e.low[1]), top.min(e.high));
                let (x, y) = (e.low[0] + (start - e.low[1]) * e.slope, e.low[0] + (end - e.low[1]) * e.slope);
                let meets = start <= end;
                left = if meets { left.min(x.min(y)) } else { left };
                right = if meets { right.max(x.max(y)) } else { right };
            }
            if left > right {
                continue;
            }
            // A hundredth of a cell covers the rounding of the clipped ends.
            from = from.max(cell_at((left * columns - 1e-2).max(0.0)));
            to = to.min(cell_at((right * columns + 1e-2).clamp(0.0, LARGEST_CELL)));
        }
        let (mut lattice_column, mut shift) = (0.0, 0);
        while from - shift >= grid.columns {
            shift += grid.columns;
            lattice_column += 1.0;
        }
        while from <= to {
            let first = row_start + (from - shift) as usize;
            let last = row_start + (to - shift).min(grid.columns - 1) as usize;
            let start = if first == 0 { 0 } else { cells[first - 1] } as usize;
            let end = cells[last] as usize;
            let origin = [a[0] - lattice_column, a[1] - lattice_row];
            shift += grid.columns;
            lattice_column += 1.0;
            from = shift;
            let mut at = start;
            while at < end {
                let lanes = |values: &[f32]| -> [f32; POINTS] { values[at..at + POINTS].try_into().expect("the points are padded") };
                let (u, v, z) = (lanes(&points.u), lanes(&points.v), lanes(&points.z));
                let own: [u32; POINTS] = points.triangle[at..at + POINTS].try_into().expect("the points are padded");
                let hidden: &mut [u32; POINTS] = (&mut points.hidden[at..at + POINTS]).try_into().expect("the points are padded");
                for l in 0..POINTS {
                    let d = [u[l] - origin[0], v[l] - origin[1]];
                    let s = m0[0] * d[0] + m0[1] * d[1];
                    let t = m1[0] * d[0] + m1[1] * d[1];
                    let height = a[2] + s * ab[2] + t * ac[2];
                    let hides = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (height > z[l]) & (own[l] != index);
                    hidden[l] |= u32::from(hides);
                }
                at += POINTS;
            }
        }
    }
}
