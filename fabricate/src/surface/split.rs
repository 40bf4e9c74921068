//! Facets larger than the page, cut into parts that fit.
//!
//! The parts stay neighbours at an edge of angle 0: if the unfolder cuts there, the edge gets a tab and a number on both sides like any
//! other, and its ends are the alignment marks.

use crate::mesh::{Mesh, Tolerance, Triangles};
use biscale::error::BadInput;
use glam::DVec2;

/// Cuts every facet that is larger than `sheet` across its longer side into equal parts, again until all fit.
///
/// # Errors
/// A large facet that is not convex.
pub fn split(mesh: Mesh, sheet: DVec2) -> Result<Mesh, BadInput> {
    let (long, short) = (sheet.max_element(), sheet.min_element());
    // Parts as polygons of vertices; all other facets take over the new vertices on their edges when the mesh is made again.
    let mut soup = Triangles { vertices: mesh.vertices.clone(), ..Triangles::default() };
    let mut cut_any = false;
    let mut parts_of: Vec<u32> = Vec::new();
    for (k, facet) in mesh.facets.iter().enumerate() {
        let along = longest_side(&facet.flat);
        let span = |axis: DVec2| {
            let (l, h) = facet.flat.iter().map(|p| axis.dot(*p)).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            (l, h)
        };
        let ((l, h), (l2, h2)) = (span(along), span(along.perp()));
        let (nx, ny) =
            if h - l >= h2 - l2 { (parts(h - l, long), parts(h2 - l2, short)) } else { (parts(h - l, short), parts(h2 - l2, long)) };
        if nx * ny == 1 {
            for t in &facet.fill {
                soup.triangles.push(t.map(|c| facet.corners[c as usize]));
                soup.colours.push(facet.colour);
                parts_of.push(u32::MAX);
            }
            continue;
        }
        let n = facet.flat.len();
        if (0..n).any(|j| (facet.flat[(j + 1) % n] - facet.flat[j]).perp_dot(facet.flat[(j + 2) % n] - facet.flat[(j + 1) % n]) < -1e-9) {
            let problem = format!("facet {} is larger than the page and not convex", k + 1);
            return Err(BadInput::new(problem, "cut it in a mesh program, or take a larger page").at_field("--split"));
        }
        cut_any = true;
        let origin = mesh.vertices[facet.corners[0] as usize];
        // The facet's frame in space, from two of its corners.
        let lift = frame(&mesh, k);
        for i in 0..nx {
            for j in 0..ny {
                let slab =
                    |l: f64, h: f64, n: usize, i: usize| (l + (h - l) * i as f64 / n as f64, l + (h - l) * (i + 1) as f64 / n as f64);
                let (x0, x1) = slab(l, h, nx, i);
                let (y0, y1) = slab(l2, h2, ny, j);
                let mut polygon = facet.flat.clone();
                for (axis, low, high) in [(along, x0, x1), (along.perp(), y0, y1)] {
                    polygon = clip(&polygon, axis, low);
                    polygon = clip(&polygon, -axis, -high);
                }
                if polygon.len() < 3 || crate::polygon::area(&polygon) < 1e-9 {
                    continue;
                }
                let first = u32::try_from(soup.vertices.len()).expect("few");
                soup.vertices
                    .extend(polygon.iter().map(|p| origin + lift[0] * (p.x - facet.flat[0].x) + lift[1] * (p.y - facet.flat[0].y)));
                for t in crate::polygon::triangulate(&polygon) {
                    soup.triangles.push(t.map(|c| c + first));
                    soup.colours.push(facet.colour);
                    parts_of.push(u32::try_from(k * 10_000 + i * 100 + j).expect("few"));
                }
            }
        }
    }
    if !cut_any {
        return Ok(mesh);
    }
    let size = soup.size();
    Mesh::with_groups(soup, Tolerance::of_size(size), Some(&parts_of))
}

fn parts(length: f64, room: f64) -> usize {
    ((length / room) - 1e-9).ceil().clamp(1.0, 99.0) as usize
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
        if da >= -1e-9 {
            out.push(a);
        }
        if (da > 1e-9 && db < -1e-9) || (da < -1e-9 && db > 1e-9) {
            out.push(a.lerp(b, da / (da - db)));
        }
    }
    out
}
