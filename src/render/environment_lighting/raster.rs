//! What a camera sees first, one ray through the middle of each pixel: triangles by rasterisation, shapes with a closed form by their own.
//!
//! With the camera at the origin, a ray `d` meets the triangle `a b c` where the three volumes `e0 = (b×c)·d`, `e1 = (c×a)·d`, `e2 = (a×b)·d` have one sign (Olano and
//! Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates"). They are linear in the pixel, need no clipping at the camera, and divided by their sum
//! are the hit's barycentric weights. Two triangles at an edge compute its volume from the same two corners, so that no pixel falls between them.

use super::super::scene::{Camera, Shape};
use super::super::shapes::Hit;
use super::super::world::World;
use crate::numerics::cast::{index_u32, truncate_u32};
use glam::DVec3;
use rayon::prelude::*;

/// Corners whose depth is less than this share of their distance are not projected: the triangle then may be anywhere in the picture.
const LEAST_DEPTH: f64 = 1e-6;

/// What a pixel sees first: the object, and where on it.
pub type Seen = Option<(usize, Hit)>;

/// A triangle that may be seen.
struct Outline {
    object: u32,
    primitive: u32,
    /// For each volume its factors of column and row, and its value at the picture's corner.
    edges: [DVec3; 3],
    /// `a·(b×c)`.
    volume: f64,
    /// First and last column and row.
    columns: [u32; 2],
    rows: [u32; 2],
}

/// The triangles of all meshes as a camera sees them.
pub struct Outlines<'a> {
    world: &'a World<'a>,
    camera: &'a Camera,
    outlines: Vec<Outline>,
    /// Objects that are no meshes.
    shapes: Vec<usize>,
}

impl<'a> Outlines<'a> {
    /// Projects the meshes of a scene.
    pub fn new(world: &'a World<'a>, camera: &'a Camera) -> Self {
        let (mut outlines, mut shapes) = (Vec::new(), Vec::new());
        for (index, object) in world.scene.objects.iter().enumerate() {
            let Shape::Mesh(mesh) = &object.shape else {
                shapes.push(index);
                continue;
            };
            let of = |primitive: u32| outline(camera, mesh.corners(primitive), index_u32(index), primitive);
            outlines.par_extend((0..index_u32(mesh.len())).into_par_iter().filter_map(of));
        }
        Self { world, camera, outlines, shapes }
    }

    /// What the pixels of some rows see, row by row.
    pub fn rows(&self, rows: std::ops::Range<u32>) -> Vec<Seen> {
        let width = self.camera.width;
        // Depth along the camera's axis, and the outline.
        let mut nearest = vec![(f64::INFINITY, u32::MAX); (width * (rows.end - rows.start)) as usize];
        for (place, outline) in (0_u32..).zip(&self.outlines) {
            for row in outline.rows[0].max(rows.start)..(outline.rows[1] + 1).min(rows.end) {
                let at = ((row - rows.start) * width) as usize;
                outline.scan(row, place, &mut nearest[at..at + width as usize]);
            }
        }
        let pixel = |(at, &(depth, place)): (u32, &(f64, u32))| {
            let (column, row) = (at % width, rows.start + at / width);
            let direction = self.camera.direction(f64::from(column) + 0.5, f64::from(row) + 0.5);
            let forward = direction.dot(self.camera.axes.z_axis);
            let mut seen = self.outlines.get(place as usize).map(|outline| {
                let barycentric = outline.barycentric(column, row);
                (outline.object as usize, Hit { distance: depth / forward, primitive: outline.primitive, barycentric })
            });
            for &object in &self.shapes {
                let limit = seen.map_or(f64::INFINITY, |(_, hit)| hit.distance);
                if let Some(hit) = self.world.scene.objects[object].intersect(self.camera.origin, direction, [0.0, limit], None) {
                    seen = Some((object, hit));
                }
            }
            seen
        };
        (0_u32..).zip(&nearest).map(pixel).collect()
    }
}

/// The outline of a triangle, unless it lies behind the camera or beside the picture.
fn outline(camera: &Camera, corners: [DVec3; 3], object: u32, primitive: u32) -> Option<Outline> {
    let [a, b, c] = corners.map(|p| camera.axes.transpose() * (p - camera.origin));
    if a.z.max(b.z).max(c.z) <= 0.0 {
        return None;
    }
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let pixel = 2.0 * camera.half_width / width;
    let top = camera.half_width * height / width;
    // The ray through the middle of a pixel is (pixel column - half_width, top - pixel row, 1), from the middle of the first one on.
    let edge = |p: DVec3, q: DVec3| {
        let n = p.cross(q);
        DVec3::new(n.x * pixel, -n.y * pixel, n.x * (0.5 * pixel - camera.half_width) + n.y * (top - 0.5 * pixel) + n.z)
    };
    let edges = [edge(b, c), edge(c, a), edge(a, b)];
    let volume = a.dot(b.cross(c));
    let in_front = [a, b, c].iter().all(|p| p.z > LEAST_DEPTH * p.length());
    let (columns, rows) = if in_front {
        let shifted = |p: DVec3| DVec3::new((p.x / p.z + camera.half_width) / pixel - 0.5, (top - p.y / p.z) / pixel - 0.5, 0.0);
        let [a, b, c] = [a, b, c].map(shifted);
        let of = |axis: usize, size: u32| {
            let places = [a[axis], b[axis], c[axis]];
            let first = places.iter().copied().fold(f64::INFINITY, f64::min);
            let last = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let inside = last >= -1.0 && first <= f64::from(size);
            inside.then(|| [truncate_u32((first - 1.0).max(0.0)), truncate_u32((last + 1.0).clamp(0.0, f64::from(size - 1)))])
        };
        (of(0, camera.width)?, of(1, camera.height)?)
    } else {
        ([0, camera.width - 1], [0, camera.height - 1])
    };
    (volume != 0.0).then_some(Outline { object, primitive, edges, volume, columns, rows })
}

impl Outline {
    /// Takes the pixels of a row in which the triangle is nearer than what is there.
    #[inline]
    fn scan(&self, row: u32, place: u32, nearest: &mut [(f64, u32)]) {
        let sign = self.volume.signum();
        let y = f64::from(row);
        let [a, b, c] = self.edges.map(|e| sign * (e.y * y + e.z));
        let [da, db, dc] = self.edges.map(|e| sign * e.x);
        for column in self.columns[0]..=self.columns[1] {
            let x = f64::from(column);
            let volumes = [a + da * x, b + db * x, c + dc * x];
            if volumes[0] >= 0.0 && volumes[1] >= 0.0 && volumes[2] >= 0.0 {
                let depth = self.volume.abs() / (volumes[0] + volumes[1] + volumes[2]);
                let pixel = &mut nearest[column as usize];
                if depth < pixel.0 {
                    *pixel = (depth, place);
                }
            }
        }
    }

    /// Weights of the second and third corner at the middle of a pixel.
    fn barycentric(&self, column: u32, row: u32) -> [f64; 2] {
        let at = DVec3::new(f64::from(column), f64::from(row), 1.0);
        let [a, b, c] = self.edges.map(|e| e.dot(at));
        [b / (a + b + c), c / (a + b + c)]
    }
}
