//! Triangles as they come from a design: measured, welded, checked.

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

/// Twice the area vector of a polygon in space.
pub(super) fn newell(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let points: Vec<DVec3> = points.collect();
    let origin = points[0];
    (1..points.len() - 1).map(|k| (points[k] - origin).cross(points[k + 1] - origin)).sum()
}
