//! Triangles as they come from a design: welded, measured, and cut where corners of others lie on their edges.

use super::merge::newell;
use biscale::error::BadInput;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Triangles in mm, as a material or a mesh file gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Positions, mm.
    pub vertices: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Linear RGB of each triangle, 0 to 1.
    pub colours: Vec<[f64; 3]>,
}

impl Triangles {
    /// Triangles of one colour, white.
    pub fn white(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let colours = vec![[1.0; 3]; triangles.len()];
        Self { vertices, triangles, colours }
    }
}

impl Triangles {
    /// Largest extent of the bounding box, mm.
    pub fn size(&self) -> f64 {
        let low = self.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = self.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        if self.vertices.is_empty() { 0.0 } else { (high - low).max_element() }
    }

    /// Volume between the surface and a plane through its lowest point, mm³; inside it, if it is closed.
    pub fn volume(&self) -> f64 {
        let base = self.triangles.iter().flatten().map(|&v| self.vertices[v as usize].z).fold(f64::INFINITY, f64::min);
        self.triangles.iter().map(|t| under(t.map(|v| self.vertices[v as usize]), base)).sum()
    }

    /// Joins corners that lie within `distance` of each other: the first one wins.
    pub fn weld(&mut self, distance: f64) {
        let cell = |v: DVec3| (v / (2.0 * distance)).floor().to_array().map(|x| x as i64);
        let mut grid: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        let mut kept: Vec<DVec3> = Vec::new();
        let mut place = Vec::with_capacity(self.vertices.len());
        for &v in &self.vertices {
            let [low, high] = [cell(v - distance), cell(v + distance)];
            let mut found = None;
            'search: for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let near = grid.get(&[x, y, z]).into_iter().flatten();
                        found = near.copied().find(|&k| kept[k as usize].distance(v) <= distance);
                        if found.is_some() {
                            break 'search;
                        }
                    }
                }
            }
            place.push(found.unwrap_or_else(|| {
                let k = u32::try_from(kept.len()).expect("fewer corners than before");
                kept.push(v);
                grid.entry(cell(v)).or_default().push(k);
                k
            }));
        }
        for corner in self.triangles.iter_mut().flatten() {
            *corner = place[*corner as usize];
        }
        self.vertices = kept;
    }

    /// Refuses what is no surface at all: corners that are no numbers or do not exist, no triangle.
    pub(super) fn check(&self) -> Result<(), BadInput> {
        if self.triangles.is_empty() {
            return Err(BadInput::new("there is no triangle to fold", "give a surface with at least one"));
        }
        if let Some((k, v)) = self.vertices.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(BadInput::new(format!("vertex {} is ({}, {}, {})", k + 1, v.x, v.y, v.z), "coordinates must be finite numbers"));
        }
        if self.triangles.iter().flatten().any(|&c| c as usize >= self.vertices.len()) {
            return Err(BadInput::new("a triangle has a corner that does not exist", "write the mesh again"));
        }
        if self.colours.len() != self.triangles.len() {
            return Err(BadInput::new("not every triangle has a colour", "give one colour a triangle"));
        }
        Ok(())
    }
}

/// Signed volume of the prism between a triangle and the plane at height `base`.
pub(super) fn under([a, b, c]: [DVec3; 3], base: f64) -> f64 {
    0.5 * (b - a).truncate().perp_dot((c - a).truncate()) * ((a.z + b.z + c.z) / 3.0 - base)
}

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
