//! Visibility of many facets in one direction, by projecting the triangles along it.
//!
//! Along a direction `w`, the point `(x, y, z)` projects to `(x - z w.x / w.z, y - z w.y / w.z)`: the projection keeps the lattice of
//! the tile, so the infinite surface becomes one torus, and a ray becomes a point of it. A facet is hidden when a triangle
//! covers its point from higher up. Points are sorted into the cells of a grid, and each triangle is compared with the points of
//! the cells that it covers (an *irregular z-buffer*: Aila and Laine 2004, "Alias-free shadow maps"; Johnson et al. 2005). The answer
//! is exact, as a ray's is: nothing is sampled, and no period is left out. Triangles come from the top down, and the points that
//! they have hidden are taken out now and then: most points are hidden by the first few layers. A ray that enters a closed surface
//! leaves it again: of closed surfaces only the triangles that face the direction are compared.
//!
//! A ray costs about as much as 50 such comparisons, but each facet needs one ray a direction, while the triangles are set up
//! once a direction for all facets: this pays where facets are not far fewer than triangles. Near the horizon the projected
//! triangles span many periods and rays are better: see [`super::is_grazing`].

use crate::facets::{Facets, NO_TRIANGLE, Surface};
use crate::numerics::cast::{index_u32, narrow};
use crate::simd::{self, Kernel};
use glam::{DVec2, DVec3};

/// Height, as a share of the larger period and per unit of `w.z`, by which an occluder must exceed a facet: what f32 positions can tell apart.
const BIAS: f64 = 1e-5;

/// The same for the facet's own triangle, which its translates one period on may hide: nearly edge-on, f32 tells less apart.
const OWN_BIAS: f64 = 1e-3;

/// Mean number of points in a cell of the grid. Fewer cost more rows of cells a triangle, more cost more comparisons.
const POINTS_PER_CELL: f64 = 4.0;

/// Points compared at once: most runs of points that a triangle covers within a row of cells are short.
const POINTS: usize = 8;

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
    count: usize,
    u: Vec<f32>,
    v: Vec<f32>,
    z: Vec<f32>,
    triangle: Vec<u32>,
    hidden: Vec<u32>,
    facet: Vec<u32>,
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
fn visible_in_lanes(surface: &Surface, facets: &Facets, direction: DVec3, scratch: &mut Scratch, row: &mut [u64]) {
    row.fill(0);
    let Scratch { facing, vertex, open, cell_of, cells, points } = scratch;
    facing.clear();
    for n in &surface.normals {
        facing.push(n.x * direction.x + n.y * direction.y + n.z * direction.z > 0.0);
    }
    let shear = DVec2::new(direction.x, direction.y) / direction.z;
    let frequency = 1.0 / surface.period;
    vertex.clear();
    for &p in &surface.vertices {
        let p = p - surface.base;
        let uv = (DVec2::new(p.x, p.y) - p.z * shear) * frequency;
        vertex.push([narrow(uv.x), narrow(uv.y), narrow(p.z)]);
    }
    let bias = BIAS * direction.z;
    let own_bias = narrow(OWN_BIAS * direction.z);
    open.clear();
    // A loop, and no iterator with a closure, which would be compiled for the oldest processor.
    for (facet, (&triangle, &position)) in (0..).zip(facets.triangle.iter().zip(&facets.position)) {
        if triangle != NO_TRIANGLE && facing[triangle as usize] {
            let position = position - surface.base;
            let uv = (DVec2::new(position.x, position.y) - position.z * shear) * frequency;
            let uv = [uv.x - uv.x.floor(), uv.y - uv.y.floor()];
            open.push(Point { uv: uv.map(narrow), z: narrow(position.z + bias), triangle, facet });
        }
    }
    let stretch = (DVec2::ONE + shear.abs() * surface.height) / surface.period;
    let grid = points.sort(open, stretch, cell_of, cells);
    let triangles = surface.triangles.len();
    let mut next = 0;
    while next < triangles && points.count > 0 {
        let lowest = points.z[..points.count].iter().fold(f32::INFINITY, |low, &z| low.min(z));
        // From the top down, a sixteenth, a quarter, all of the triangles, and the hidden points taken out.
        let end = if next == 0 { triangles.div_ceil(16) } else { (4 * next).min(triangles) };
        for &t in &surface.top_down[next..end] {
            if surface.closed && !facing[t as usize] {
                continue;
            }
            let corners = surface.triangles[t as usize].map(|v| vertex[v as usize]);
            if most(corners[0][2], corners[1][2], corners[2][2]) <= lowest {
                next = triangles;
                break;
            }
            compare(grid, cells, points, t, corners, own_bias);
        }
        next = next.max(end);
        if next < triangles {
            points.take_out_hidden(cells);
        }
    }
    for (&facet, &hidden) in points.facet.iter().zip(&points.hidden[..points.count]) {
        row[facet as usize / 64] |= u64::from(hidden == 0) << (facet % 64);
    }
}

impl Points {
    /// Sorts the points into cells; `cells[c]` becomes the end of the points of cell `c`.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "cells are counted in u32 and bounded by the grid")]
    fn sort(&mut self, open: &[Point], stretch: DVec2, cell_of: &mut Vec<u32>, cells: &mut Vec<u32>) -> Grid {
        // Cells as long as triangles are stretched, so that a triangle covers few rows.
        let wanted = (open.len() as f64 / POINTS_PER_CELL).max(1.0);
        let aspect = (stretch.x / stretch.y).clamp(1.0 / 64.0, 64.0);
        let side = |x: f64| (x.sqrt().round() as i32).clamp(1, 2048);
        let grid = Grid { columns: side(wanted / aspect), rows: side(wanted * aspect) };
        cells.clear();
        cells.resize((grid.columns * grid.rows) as usize + 1, 0);
        let (columns, rows) = (grid.columns as f32, grid.rows as f32);
        cell_of.clear();
        cell_of.extend(open.iter().map(|point| {
            // Rounding may put a point on the far edge, which is the near edge of the next period: it stays in the last cell.
            let column = cell_at((point.uv[0] * columns).min(columns - 1.0));
            let row = cell_at((point.uv[1] * rows).min(rows - 1.0));
            (row * grid.columns + column) as u32
        }));
        for &cell in cell_of.iter() {
            cells[cell as usize + 1] += 1;
        }
        let mut sum = 0;
        for cell in cells.iter_mut() {
            sum += *cell;
            *cell = sum;
        }
        self.count = open.len();
        let padded = open.len() + POINTS;
        for buffer in [&mut self.u, &mut self.v, &mut self.z] {
            buffer.resize(padded, 0.0);
        }
        self.triangle.resize(padded, 0);
        self.facet.resize(padded, 0);
        self.hidden.clear();
        self.hidden.resize(padded, 0);
        // `cells[c]` moves from the start of cell c to the start of the next one.
        for (&cell, point) in cell_of.iter().zip(open) {
            let slot = cells[cell as usize] as usize;
            cells[cell as usize] += 1;
            self.u[slot] = point.uv[0];
            self.v[slot] = point.uv[1];
            self.z[slot] = point.z;
            self.triangle[slot] = point.triangle;
            self.facet[slot] = point.facet;
        }
        grid
    }

    /// Takes the hidden points out, where that is worth it; the others stay in their cells.
    #[inline(always)]
    fn take_out_hidden(&mut self, cells: &mut [u32]) {
        let hidden: u32 = self.hidden[..self.count].iter().sum();
        if (hidden as usize) < self.count / 4 {
            return;
        }
        let (mut from, mut to) = (0, 0);
        for end in cells.iter_mut() {
            while from < *end as usize {
                if self.hidden[from] == 0 {
                    self.u[to] = self.u[from];
                    self.v[to] = self.v[from];
                    self.z[to] = self.z[from];
                    self.triangle[to] = self.triangle[from];
                    self.facet[to] = self.facet[from];
                    to += 1;
                }
                from += 1;
            }
            *end = index_u32(to);
        }
        self.count = to;
        self.hidden[..to + POINTS].fill(0);
    }
}

/// One edge of a projected triangle.
#[derive(Clone, Copy)]
struct Edge {
    /// The end with the smaller v.
    low: [f32; 2],
    /// The larger v.
    high: f32,
    /// Change of u with v.
    slope: f32,
}

/// Fills the place of an edge that is not needed.
const NO_EDGE: Edge = Edge { low: [0.0; 2], high: 0.0, slope: 0.0 };

/// Columns up to which all columns of a triangle count as covered in each of its rows.
const NARROW: i32 = 6;

#[inline(always)]
fn least(a: f32, b: f32, c: f32) -> f32 {
    let ab = if a < b { a } else { b };
    if ab < c { ab } else { c }
}

#[inline(always)]
fn most(a: f32, b: f32, c: f32) -> f32 {
    let ab = if a > b { a } else { b };
    if ab > c { ab } else { c }
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

/// The columns that the triangle of these edges covers between two heights, from the edges clipped to them: conservative, and empty where it covers none.
#[inline(always)]
fn covered_columns(edges: &[Edge; 3], bottom: f32, top: f32, columns: f32) -> [i32; 2] {
    let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
    for e in edges {
        let start = if bottom > e.low[1] { bottom } else { e.low[1] };
        let end = if top < e.high { top } else { e.high };
        let (x, y) = (e.low[0] + (start - e.low[1]) * e.slope, e.low[0] + (end - e.low[1]) * e.slope);
        let (near, far) = if x < y { (x, y) } else { (y, x) };
        left = if (start <= end) & (near < left) { near } else { left };
        right = if (start <= end) & (far > right) { far } else { right };
    }
    if left > right {
        return NO_COLUMNS;
    }
    // A hundredth of a cell covers the rounding of the clipped ends.
    [cell_at((left * columns - 1e-2).max(0.0)), cell_at((right * columns + 1e-2).clamp(0.0, LARGEST_CELL))]
}

/// A range of columns that ends before it begins.
const NO_COLUMNS: [i32; 2] = [1, 0];

/// A projected triangle, as points are compared with it: with its corner at `a`, a point `a + d` has the barycentric coordinates
/// `(s, t) = (m[0] · d, m[1] · d)`, and there the triangle has the height `height + s * rise[0] + t * rise[1]`.
#[derive(Clone, Copy)]
struct Occluder {
    triangle: u32,
    m: [[f32; 2]; 2],
    height: f32,
    rise: [f32; 2],
    /// What it must exceed its own facets by.
    own_bias: f32,
}

impl Occluder {
    /// Marks which of the points `start..end` it hides, with its first corner at `origin`.
    #[inline(always)]
    fn hide(&self, points: &mut Points, start: usize, end: usize, origin: [f32; 2]) {
        let [m0, m1] = self.m;
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
                let height = self.height + s * self.rise[0] + t * self.rise[1];
                let least_height = if own[l] == self.triangle { z[l] + self.own_bias } else { z[l] };
                let hides = (s >= 0.0) & (t >= 0.0) & (s + t <= 1.0) & (height > least_height);
                hidden[l] |= u32::from(hides);
            }
            at += POINTS;
        }
    }
}

/// Marks the points that a projected triangle hides. `cells[c]` is the end of the points of cell `c`.
#[inline(always)]
#[expect(clippy::cast_sign_loss, reason = "cells are bounded by the grid; a check in the inner loop would cost time")]
fn compare(grid: Grid, cells: &[u32], points: &mut Points, triangle: u32, [a, b, c]: [[f32; 3]; 3], own_bias: f32) {
    let (ab, ac) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    let inverse = 1.0 / (ab[0] * ac[1] - ab[1] * ac[0]);
    if !inverse.is_finite() {
        return; // edge-on: covers nothing
    }
    let m = [[ac[1] * inverse, -ac[0] * inverse], [-ab[1] * inverse, ab[0] * inverse]];
    let (columns, rows) = (grid.columns as f32, grid.rows as f32);
    let low = [least(a[0], b[0], c[0]), least(a[1], b[1], c[1])];
    let high = [most(a[0], b[0], c[0]), most(a[1], b[1], c[1])];
    // Moved by whole periods so that its lowest corner lies in the grid: from here on cells are counted from 0.
    let lattice = [low[0].floor(), low[1].floor()];
    let [a, b, c] = [a, b, c].map(|p| [p[0] - lattice[0], p[1] - lattice[1], p[2]]);
    let occluder = Occluder { triangle, m, height: a[2], rise: [ab[2], ac[2]], own_bias };
    let first_column = cell_at((low[0] - lattice[0]) * columns);
    let last_column = cell_at((high[0] - lattice[0]) * columns);
    let first_row = cell_at((low[1] - lattice[1]) * rows);
    let last_row = cell_at((high[1] - lattice[1]) * rows);
    // Comparing a few points in vain costs less than clipping the edges.
    let narrow = last_column - first_column < NARROW || last_row == first_row;
    let edges = if narrow { [NO_EDGE; 3] } else { [edge(a, b), edge(b, c), edge(c, a)] };
    let (row_height, mut lattice_row, mut wrapped_row) = (1.0 / rows, 0.0, first_row);
    for row in first_row..=last_row {
        if wrapped_row >= grid.rows {
            wrapped_row -= grid.rows;
            lattice_row += 1.0;
        }
        let row_start = (wrapped_row * grid.columns) as usize;
        wrapped_row += 1;
        let (mut from, mut to) = (first_column, last_column);
        if !narrow {
            let [left, right] = covered_columns(&edges, row as f32 * row_height, (row + 1) as f32 * row_height, columns);
            if left > right {
                continue;
            }
            (from, to) = (from.max(left), to.min(right));
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
            occluder.hide(points, start, cells[last] as usize, [a[0] - lattice_column, a[1] - lattice_row]);
            shift += grid.columns;
            lattice_column += 1.0;
            from = shift;
        }
    }
}
