//! Facets larger than the page, cut into parts that fit.
//!
//! The parts stay neighbours at an edge of angle 0: if the unfolder cuts there, the edge gets a tab and a number on both sides like any
//! other, and its ends are the alignment marks.

use crate::mesh::{Mesh, Tolerance, Triangles};
use crate::polygon::{area, triangulate};
use biscale::error::BadInput;
use glam::DVec2;

/// Numbers of the parts of a facet: so many for each facet, of these so many for each column. More than [`MOST_PARTS`] of each.
const NUMBERS_OF_FACET: usize = 10_000;
const NUMBERS_OF_COLUMN: usize = 100;
/// Most parts of a facet along each side.
const MOST_PARTS: f64 = 99.0;
/// Lengths that differ by less are one, of the room or in mm: rounding.
const SAME: f64 = 1e-9;

/// Parts as polygons of vertices; all other facets take over the new vertices on their edges when the mesh is made again.
struct Cutting {
    soup: Triangles,
    /// For each triangle the number of its part: those of different parts stay different facets.
    part: Vec<u32>,
}

/// Cuts every facet that is larger than `sheet` across its longer side into equal parts, again until all fit.
///
/// # Errors
/// A large facet that is not convex.
pub fn split(mesh: Mesh, sheet: DVec2) -> Result<Mesh, BadInput> {
    let mut cutting = Cutting { soup: Triangles { vertices: mesh.vertices.clone(), ..Triangles::default() }, part: Vec::new() };
    let mut cut_any = false;
    for k in 0..mesh.facets.len() {
        let grid = Grid::new(&mesh.facets[k].flat, sheet);
        if grid.count == [1, 1] {
            cutting.keep(&mesh, k);
        } else {
            cut_any = true;
            cutting.cut(&mesh, k, &grid)?;
        }
    }
    if !cut_any {
        return Ok(mesh);
    }
    let size = cutting.soup.size();
    Mesh::with_groups(cutting.soup, Tolerance::of_size(size), Some(&cutting.part))
}

/// The parts of a facet: columns along its longest side, rows across.
struct Grid {
    axes: [DVec2; 2],
    /// Least and largest coordinate along each axis.
    spans: [[f64; 2]; 2],
    count: [usize; 2],
}

impl Grid {
    fn new(flat: &[DVec2], sheet: DVec2) -> Self {
        let along = longest_side(flat);
        let axes = [along, along.perp()];
        let spans = axes.map(|axis| {
            let values = flat.iter().map(|p| axis.dot(*p));
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        });
        let [w, h] = spans.map(|[low, high]| high - low);
        let (long, short) = (sheet.max_element(), sheet.min_element());
        let count = if w >= h { [parts(w, long), parts(h, short)] } else { [parts(w, short), parts(h, long)] };
        Self { axes, spans, count }
    }

    /// The part of a convex polygon in a cell.
    fn clip(&self, polygon: &[DVec2], cell: [usize; 2]) -> Vec<DVec2> {
        let mut polygon = polygon.to_vec();
        for k in 0..2 {
            let ([low, high], n, i) = (self.spans[k], self.count[k], cell[k]);
            let at = |i: usize| low + (high - low) * i as f64 / n as f64;
            polygon = clip(&polygon, self.axes[k], at(i));
            polygon = clip(&polygon, -self.axes[k], -at(i + 1));
        }
        polygon
    }
}

impl Cutting {
    /// Takes a facet over as it is.
    fn keep(&mut self, mesh: &Mesh, k: usize) {
        let facet = &mesh.facets[k];
        for t in &facet.fill {
            self.soup.triangles.push(t.map(|c| facet.corners[c as usize]));
            self.soup.colours.push(facet.colour);
            self.part.push(u32::MAX);
        }
    }

    /// Cuts a facet along a grid.
    fn cut(&mut self, mesh: &Mesh, k: usize, grid: &Grid) -> Result<(), BadInput> {
        let facet = &mesh.facets[k];
        if !is_convex(&facet.flat) {
            let problem = format!("facet {} is larger than the page and not convex", k + 1);
            return Err(BadInput::new(problem, "cut it in a mesh program, or take a larger `page`").at_field("split"));
        }
        let origin = mesh.vertices[facet.corners[0] as usize];
        // The facet's frame in space, from two of its corners.
        let lift = frame(mesh, k);
        for (i, j) in (0..grid.count[0]).flat_map(|i| (0..grid.count[1]).map(move |j| (i, j))) {
            let polygon = grid.clip(&facet.flat, [i, j]);
            if polygon.len() < 3 || area(&polygon) < SAME {
                continue;
            }
            let first = u32::try_from(self.soup.vertices.len()).expect("few");
            let in_space = |p: &DVec2| origin + lift[0] * (p.x - facet.flat[0].x) + lift[1] * (p.y - facet.flat[0].y);
            self.soup.vertices.extend(polygon.iter().map(in_space));
            for t in triangulate(&polygon) {
                self.soup.triangles.push(t.map(|c| c + first));
                self.soup.colours.push(facet.colour);
                self.part.push(u32::try_from(k * NUMBERS_OF_FACET + i * NUMBERS_OF_COLUMN + j).expect("few"));
            }
        }
        Ok(())
    }
}

/// Whether a counter-clockwise polygon turns nowhere to the right.
fn is_convex(polygon: &[DVec2]) -> bool {
    let n = polygon.len();
    (0..n).all(|j| (polygon[(j + 1) % n] - polygon[j]).perp_dot(polygon[(j + 2) % n] - polygon[(j + 1) % n]) >= -SAME)
}

fn parts(length: f64, room: f64) -> usize {
    ((length / room) - SAME).ceil().clamp(1.0, MOST_PARTS) as usize
}

fn longest_side(polygon: &[DVec2]) -> DVec2 {
    let n = polygon.len();
    (0..n)
        .map(|k| polygon[(k + 1) % n] - polygon[k])
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or(DVec2::X)
        .normalize_or(DVec2::X)
}

/// The x and y axes of a facet's own plane, in space.
fn frame(mesh: &Mesh, facet: usize) -> [glam::DVec3; 2] {
    let f = &mesh.facets[facet];
    let n = f.flat.len();
    let k =
        (0..n).max_by(|&a, &b| f.flat[a].distance_squared(f.flat[(a + 1) % n]).total_cmp(&f.flat[b].distance_squared(f.flat[(b + 1) % n])));
    let k = k.unwrap_or(0);
    let d2 = (f.flat[(k + 1) % n] - f.flat[k]).normalize_or(DVec2::X);
    let d3 = (mesh.corner(facet, (k + 1) % n) - mesh.corner(facet, k)).normalize_or_zero();
    let up = f.normal.cross(d3);
    [d3 * d2.x - up * d2.y, d3 * d2.y + up * d2.x]
}

/// The part of a convex polygon with `axis . p >= low` (Sutherland and Hodgman 1974).
fn clip(polygon: &[DVec2], axis: DVec2, low: f64) -> Vec<DVec2> {
    let n = polygon.len();
    let mut out = Vec::with_capacity(n + 1);
    for k in 0..n {
        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
        let (da, db) = (axis.dot(a) - low, axis.dot(b) - low);
        if da >= -SAME {
            out.push(a);
        }
        if (da > SAME && db < -SAME) || (da < -SAME && db > SAME) {
            out.push(a.lerp(b, da / (da - db)));
        }
    }
    out
}
