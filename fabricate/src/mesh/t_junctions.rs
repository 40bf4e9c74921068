//! Corners that lie on the edge of a neighbour: the neighbour is cut there.

use super::triangles::{Triangles, newell};
use rustc_hash::FxHashMap;

/// Triangles as polygons, with corners of others that lie on their edges put in between: the ends of two cells may differ.
pub(super) fn split_t_junctions(soup: &Triangles, distance: f64) -> Vec<Vec<u32>> {
    let mut count: FxHashMap<(u32, u32), i32> = FxHashMap::default();
    for t in &soup.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *count.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let mut open: Vec<(u32, u32)> = count.iter().filter(|(_, n)| **n == 1).map(|(e, _)| *e).collect();
    open.sort_unstable();
    let mut ends: Vec<u32> = open.iter().flat_map(|&(a, b)| [a, b]).collect();
    ends.sort_unstable_by(|&a, &b| soup.vertices[a as usize].x.total_cmp(&soup.vertices[b as usize].x).then(a.cmp(&b)));
    ends.dedup();
    let mut between: FxHashMap<(u32, u32), Vec<u32>> = FxHashMap::default();
    for &(a, b) in &open {
        let (p, q) = (soup.vertices[a as usize], soup.vertices[b as usize]);
        let (low, high) = (p.x.min(q.x) - distance, p.x.max(q.x) + distance);
        let first = ends.partition_point(|&v| soup.vertices[v as usize].x < low);
        let along = q - p;
        let mut on: Vec<(f64, u32)> = Vec::new();
        for &v in ends[first..].iter().take_while(|&&v| soup.vertices[v as usize].x <= high) {
            let r = soup.vertices[v as usize] - p;
            let t = r.dot(along) / along.length_squared();
            if v != a && v != b && t > 0.0 && t < 1.0 && (r - t * along).length() <= distance {
                on.push((t, v));
            }
        }
        on.sort_by(|x, y| x.0.total_cmp(&y.0));
        if !on.is_empty() {
            between.insert((a, b), on.into_iter().map(|(_, v)| v).collect());
        }
    }
    let polygon = |t: &[u32; 3]| {
        let mut corners = Vec::with_capacity(3);
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            corners.push(a);
            if let Some(on) = between.get(&(a.min(b), a.max(b))) {
                if a < b { corners.extend(on) } else { corners.extend(on.iter().rev()) }
            }
        }
        corners
    };
    soup.triangles.iter().map(polygon).collect()
}

/// Triangles whose corners nowhere lie on the edge of a neighbour: such neighbours are cut there. The soup's corners are welded.
pub(crate) fn close_t_junctions(soup: Triangles, distance: f64) -> Triangles {
    let polygons = split_t_junctions(&soup, distance);
    let mut out = Triangles { vertices: soup.vertices.clone(), ..Triangles::default() };
    for ((corners, &t), &colour) in polygons.iter().zip(&soup.triangles).zip(&soup.colours) {
        let cut = if corners.len() == 3 { vec![t] } else { fan_with_points(&soup, corners, t) };
        let distinct = cut.into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        out.triangles.extend(distinct);
        out.colours.resize(out.triangles.len(), colour);
    }
    out
}

/// Cuts a triangle whose edges carry further corners into triangles: a fan from one of its corners that sees all of them, or, where
/// several edges have some, from a corner between. All points lie on the border of a triangle, so ears without area are skipped.
pub(super) fn fan_with_points(soup: &Triangles, corners: &[u32], triangle: [u32; 3]) -> Vec<[u32; 3]> {
    let at = |v: u32| soup.vertices[v as usize];
    let [a, b, c] = triangle.map(at);
    let normal = (b - a).cross(c - a);
    let scale = normal.length();
    let mut rest = corners.to_vec();
    let mut out = Vec::new();
    while rest.len() > 3 {
        let n = rest.len();
        // The largest ear: never one of three points on a line while another exists.
        let area = |k: usize| {
            let [p, q, r] = [rest[(k + n - 1) % n], rest[k], rest[(k + 1) % n]].map(at);
            (q - p).cross(r - p).dot(normal) / scale
        };
        // An ear may be cut only if what stays still has an area: its tip must not be the last corner off a line.
        let best = (0..n).max_by(|&x, &y| area(x).total_cmp(&area(y))).expect("more than three");
        let ear = (0..n)
            .filter(|&k| area(k) > 1e-9 * scale)
            .find(|&k| {
                let left: Vec<u32> = (0..n).filter(|&j| j != k).map(|j| rest[j]).collect();
                newell(left.iter().map(|&v| at(v))).dot(normal) / scale > 1e-9 * scale
            })
            .unwrap_or(best);
        out.push([rest[(ear + n - 1) % n], rest[ear], rest[(ear + 1) % n]]);
        rest.remove(ear);
    }
    out.push([rest[0], rest[1], rest[2]]);
    out
}
