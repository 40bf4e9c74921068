//! Large-scale meshes: triangles with smooth normals, tangents, and a hierarchy of boxes.
//!
//! Vertex normals are means of the faces' normals, weighted by angle (Thürmer and Wüthrich 1998), of the faces that meet within
//! the crease angle. A picture at large scale wants the smooth surface that a mesh stands for; the small scale never does
//! (`geometry::mesh`). Shadow rays leave from the smooth surface, too (Hanika 2021, "Hacking the shadow terminator"): else the
//! coarse triangles beside the terminator would shadow each other.

use super::shapes::{Hit, any_across};
use crate::error::{BadInput, Error, Result};
use crate::geometry::mesh;
use crate::numerics::cast::narrow;
use crate::visibility::{MAX_DEPTH, depth};
use glam::{DAffine3, DMat3, DVec2, DVec3, UVec2, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::Ray;
use std::path::Path;
use std::time::Duration;

/// Growth of the boxes, in units of the mesh's size: more than single precision misplaces a slab, and than `STEP_BACK`.
const BOX_PADDING: f64 = 1e-5;
/// obvhs ignores boxes that end within 1e-4 of a ray's origin (`cwbvh::node::EPSILON`); rays start this much earlier.
const STEP_BACK: f64 = 2e-4;
/// How far outside of a triangle a ray may pass, relative to its edges: closes seams.
const SEAM: f64 = 1e-12;

/// Where the tile's x lies on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tangents {
    /// Along the texture coordinate u.
    Uv,
    /// Around an axis through a point, as on a sphere.
    Around {
        /// A point of the axis.
        center: DVec3,
        /// Its unit direction.
        axis: DVec3,
    },
}

/// Triangles in world coordinates.
#[derive(Clone, Debug)]
pub struct LargeMesh {
    /// Names of the parts, each once.
    pub parts: Vec<String>,
    /// For each triangle its part.
    pub part_of_triangle: Vec<u16>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// From the world to the file's lengths.
    pub(super) to_file: DAffine3,
    /// Texture coordinates of the corners of each triangle.
    pub(super) uv: Option<Vec<[DVec2; 3]>>,
    /// Linear colours of the corners of each triangle.
    pub(super) colours: Option<Vec<[DVec3; 3]>>,
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Smooth normals of the three corners.
    normals: Vec<[DVec3; 3]>,
    tangents: Tangents,
    bvh: CwBvh,
    /// Normalised = (world - low) * scale, in the unit cube.
    low: DVec3,
    scale: f64,
    closed: bool,
}

/// How a mesh stands in the world, and how smooth it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// From the file's lengths to the world.
    pub transform: DAffine3,
    /// Faces that meet at a larger angle, in radians, have an edge between them; 0 keeps all faces flat.
    pub crease: f64,
    /// Where tile x lies; without it along u where the file has texture coordinates, else around z.
    pub tangents: Option<Tangents>,
}

impl LargeMesh {
    /// Reads an OBJ, PLY or STL file.
    ///
    /// # Errors
    /// Those of the reader; texture coordinates that are asked for and are not there.
    pub fn load(file: &Path, placement: &Placement) -> Result<Self> {
        let (tile, colours) = mesh::load_coloured(file)?;
        let notes = tile.notes.iter().filter(|n| !n.contains("own normals")).cloned().collect();
        let vertices: Vec<DVec3> = tile.vertices.iter().map(|v| placement.transform.transform_point3(*v)).collect();
        let tangents = match (placement.tangents, &tile.uv) {
            (Some(Tangents::Uv), None) => {
                let remedy = "write tangents = \"around\", or export the mesh with texture coordinates for every corner";
                return Err(BadInput::new("the mesh has no texture coordinates for its tangents", remedy).in_file(file).into());
            }
            (Some(tangents), _) => tangents,
            (None, Some(_)) => Tangents::Uv,
            (None, None) => Tangents::Around { center: placement.transform.translation, axis: DVec3::Z },
        };
        let extent = |v: &[DVec3]| v.iter().fold((v[0], v[0]), |(low, high), &p| (low.min(p), high.max(p)));
        let (low, high) = extent(&vertices);
        let size = (high - low).max_element();
        if !(size.is_finite() && size > 0.0) {
            return Err(BadInput::new("the mesh has no size", "check `scale` and the file").in_file(file).into());
        }
        let scale = size.recip();
        let boxes: Vec<Aabb> = tile
            .triangles
            .iter()
            .map(|t| {
                let corners = t.map(|v| (vertices[v as usize] - low) * scale);
                let (low, high) = extent(&corners);
                Aabb::new((low - BOX_PADDING).as_vec3a(), (high + BOX_PADDING).as_vec3a())
            })
            .collect();
        // obvhs wants to time itself; nobody reads it.
        let bvh = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        if depth(&bvh) > MAX_DEPTH {
            let problem = format!("{}: the triangles are nested more than {MAX_DEPTH} levels deep", file.display());
            return Err(Error::Numeric(problem));
        }
        let normals = smooth_normals(&vertices, &tile.triangles, placement.crease);
        let closed = is_closed(&tile.triangles);
        Ok(Self {
            parts: tile.parts,
            part_of_triangle: tile.part_of_triangle,
            notes,
            to_file: placement.transform.inverse(),
            uv: tile.uv,
            colours,
            vertices,
            triangles: tile.triangles,
            normals,
            tangents,
            bvh,
            low,
            scale,
            closed,
        })
    }

    /// The middle of its bounding box.
    pub fn middle(&self) -> DVec3 {
        let (low, high) = self.vertices.iter().fold((self.low, self.low), |(low, high), &p| (low.min(p), high.max(p)));
        low.midpoint(high)
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Whether there is no triangle; never so.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The vertices at the corners of each triangle.
    pub fn vertices_of_triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Where a hit lies in the world, by its barycentric weights.
    pub fn position(&self, hit: &Hit) -> DVec3 {
        let [a, b, c] = self.corners(hit.primitive);
        let [u, v] = hit.barycentric;
        a + u * (b - a) + v * (c - a)
    }

    /// Corners of a triangle in the world.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.vertices[v as usize])
    }

    /// The first hit of a ray at a distance between the two of `range`, on another triangle than `skip`.
    pub fn intersect(&self, origin: DVec3, direction: DVec3, range: [f64; 2], skip: Option<u32>) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(origin, direction, range, &mut |hit: Hit| {
            if skip != Some(hit.primitive) && best.is_none_or(|b| (hit.distance, hit.primitive) < (b.distance, b.primitive)) {
                best = Some(hit);
            }
            best.map_or(range[1], |b| b.distance)
        });
        best
    }

    /// Whether anything but `skip` lies between the distances of `range`.
    pub fn blocks(&self, origin: DVec3, direction: DVec3, range: [f64; 2], skip: Option<u32>) -> bool {
        let mut found = false;
        self.visit(origin, direction, range, &mut |hit: Hit| {
            found |= skip != Some(hit.primitive);
            if found { f64::NEG_INFINITY } else { range[1] }
        });
        found
    }

    /// Shows all hits within `range` to `visit`, which returns the distance beyond which no more are wanted.
    fn visit(&self, origin: DVec3, direction: DVec3, range: [f64; 2], visit: &mut dyn FnMut(Hit) -> f64) {
        // Into the unit cube, and along the ray to where it enters a ball around it: single precision stays precise for far cameras.
        let from = (origin - self.low) * self.scale;
        let middle = DVec3::splat(0.5);
        let reach = (middle - from).dot(direction);
        let start = (reach - 2.0).max(range[0] * self.scale) - STEP_BACK;
        let end = (reach + 2.0).min(range[1] * self.scale) - start + STEP_BACK;
        if end.is_nan() || end <= 0.0 {
            return;
        }
        // The padding of the boxes covers the rounding to f32.
        let entry: Vec3A = (from + start * direction).as_vec3a();
        // obvhs takes -0 for a negative component in one place and for a positive one in another.
        let mut ray = Ray::new(entry, direction.as_vec3a() + Vec3A::ZERO, 0.0, narrow(end));
        let mut state = self.bvh.new_traversal(ray.direction);
        let mut node;
        obvhs::traverse!(self.bvh, node, state, node.intersect_ray(&ray, state.oct_inv4), {
            let triangle = self.bvh.primitive_indices[state.primitive_id as usize];
            if let Some(hit) = self.triangle_hit(triangle, origin, direction, range) {
                let limit = visit(hit);
                if limit == f64::NEG_INFINITY {
                    return;
                }
                ray.tmax = ray.tmax.min(narrow(limit * self.scale - start + STEP_BACK));
            }
        });
    }

    /// Möller and Trumbore 1997, in double precision.
    fn triangle_hit(&self, triangle: u32, origin: DVec3, direction: DVec3, range: [f64; 2]) -> Option<Hit> {
        let [a, b, c] = self.corners(triangle);
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let facing = normal.dot(direction);
        let from = origin - a;
        let distance = -normal.dot(from) / facing;
        if !(distance > range[0] && distance < range[1]) {
            return None;
        }
        let moment = from.cross(direction) / facing;
        let (u, v) = (-ac.dot(moment), ab.dot(moment));
        (u >= -SEAM && v >= -SEAM && u + v <= 1.0 + SEAM).then_some(Hit { distance, primitive: triangle, barycentric: [u, v] })
    }

    /// Outward unit normal of a triangle.
    pub fn face_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize()
    }

    /// The frame at a hit, around the smooth normal.
    pub fn frame(&self, hit: &Hit) -> DMat3 {
        let t = hit.primitive as usize;
        let [u, v] = hit.barycentric;
        let weights = [1.0 - u - v, u, v];
        let normal = (0..3).map(|k| weights[k] * self.normals[t][k]).sum::<DVec3>();
        let normal = normal.try_normalize().unwrap_or_else(|| self.face_normal(hit.primitive));
        let corners = self.corners(hit.primitive);
        let x = match (self.tangents, &self.uv) {
            (Tangents::Uv, Some(uv)) => {
                let [a, b, c] = corners;
                let [ua, ub, uc] = uv[t];
                let (d1, d2) = (ub - ua, uc - ua);
                // Mirrored texture coordinates turn u round, too.
                ((b - a) * d2.y - (c - a) * d1.y) * d1.perp_dot(d2).signum()
            }
            (Tangents::Around { center, axis }, _) => {
                // By place, not by normal: a flat plate turns around its middle, too.
                let place: DVec3 = (0..3).map(|k| weights[k] * corners[k]).sum();
                axis.cross(place - center)
            }
            (Tangents::Uv, None) => DVec3::ZERO,
        };
        // Where no direction is left (on the axis, in a triangle without texture) it is any, but the same one.
        let x = (x - x.dot(normal) * normal).try_normalize().unwrap_or_else(|| any_across(normal));
        DMat3::from_cols(x, normal.cross(x), normal)
    }

    /// The colour at a hit; `None` where the mesh has none.
    pub fn colour(&self, hit: &Hit) -> Option<DVec3> {
        let [a, b, c] = self.colours.as_ref()?[hit.primitive as usize];
        let [u, v] = hit.barycentric;
        Some((1.0 - u - v) * a + u * b + v * c)
    }

    /// Where shadow rays leave from a hit: on the smooth surface, or on the triangle where that bends inward (Hanika 2021).
    pub fn shadow_origin(&self, hit: &Hit, place: DVec3) -> DVec3 {
        let corners = self.corners(hit.primitive);
        let [u, v] = hit.barycentric;
        let weights = [1.0 - u - v, u, v];
        let normals = &self.normals[hit.primitive as usize];
        let lifted = |k: usize| place - (place - corners[k]).dot(normals[k]).min(0.0) * normals[k];
        (0..3).map(|k| weights[k] * lifted(k)).sum()
    }

    /// Whether a point lies inside of a closed mesh; open ones have no inside.
    pub fn contains(&self, point: DVec3) -> bool {
        /// A direction along no axis, so that the ray passes no edge of a regular model.
        const WAY_OUT: DVec3 = DVec3::new(0.302_113, 0.405_217, 0.862_834);
        let direction = WAY_OUT.normalize();
        let mut balance = 0;
        if self.closed {
            self.visit(point, direction, [0.0, f64::INFINITY], &mut |hit| {
                balance += if self.face_normal(hit.primitive).dot(direction) > 0.0 { 1 } else { -1 };
                f64::INFINITY
            });
        }
        balance > 0
    }
}

/// Whether each edge is met by as many edges in the reverse direction.
fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut edges: Vec<(u32, u32, i32)> = triangles
        .iter()
        .flat_map(|t| (0..3).map(|k| (t[k], t[(k + 1) % 3])))
        .map(|(a, b)| if a < b { (a, b, 1) } else { (b, a, -1) })
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).all(|edge| edge.iter().map(|e| e.2).sum::<i32>() == 0)
}

/// For each corner of each triangle the mean of the normals around it, by angle, of faces within the crease angle of its own.
fn smooth_normals(vertices: &[DVec3], triangles: &[[u32; 3]], crease: f64) -> Vec<[DVec3; 3]> {
    let face = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| vertices[v as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let faces: Vec<DVec3> = triangles.iter().map(face).collect();
    // Triangles around each vertex, as runs of one list.
    let mut around: Vec<(u32, u32, u32)> =
        (0_u32..).zip(triangles).flat_map(|(i, t)| (0_u32..3).map(move |k| (t[k as usize], i, k))).collect();
    around.sort_unstable();
    let starts: Vec<usize> = (0..=vertices.len()).map(|v| around.partition_point(|a| (a.0 as usize) < v)).collect();
    let angle = |i: u32, k: u32| {
        let t = &triangles[i as usize];
        let corner = |k: u32| vertices[t[(k % 3) as usize] as usize];
        (corner(k + 1) - corner(k)).angle_between(corner(k + 2) - corner(k))
    };
    let least = crease.cos();
    (0_u32..)
        .zip(triangles)
        .map(|(i, t)| {
            let own = faces[i as usize];
            t.map(|v| {
                let near = &around[starts[v as usize]..starts[v as usize + 1]];
                let smooth = |n: DVec3| crease > 0.0 && n.dot(own) >= least;
                let sum: DVec3 =
                    near.iter().filter(|a| smooth(faces[a.1 as usize])).map(|&(_, j, k)| angle(j, k) * faces[j as usize]).sum();
                sum.try_normalize().unwrap_or(own)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    const ALL: [f64; 2] = [0.0, f64::INFINITY];

    /// A ball of `n` rings and `2 n` segments around `center`, as OBJ text with uv.
    fn ball(n: usize, center: DVec3) -> String {
        let mut text = String::new();
        for i in 0..=n {
            for j in 0..=2 * n {
                // The seam and the poles are exact, so that the ball is closed.
                let (theta, phi) = (std::f64::consts::PI * i as f64 / n as f64, std::f64::consts::PI * (j % (2 * n)) as f64 / n as f64);
                let across = if i == 0 || i == n { 0.0 } else { theta.sin() };
                let p = center + DVec3::new(across * phi.cos(), across * phi.sin(), theta.cos());
                let _ = writeln!(text, "v {} {} {}\nvt {} {}", p.x, p.y, p.z, j as f64 / (2 * n) as f64, 1.0 - i as f64 / n as f64);
            }
        }
        let at = |i: usize, j: usize| 1 + i * (2 * n + 1) + j;
        for i in 0..n {
            for j in 0..2 * n {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let faces: &[[usize; 3]] = if i == 0 {
                    &[[0, 1, 2]]
                } else if i + 1 == n {
                    &[[0, 1, 3]]
                } else {
                    &[[0, 1, 2], [0, 2, 3]]
                };
                for face in faces {
                    let c = face.map(|k| corners[k]);
                    let _ = writeln!(text, "f {0}/{0} {1}/{1} {2}/{2}", c[0], c[1], c[2]);
                }
            }
        }
        text
    }

    fn load(text: &str, placement: &Placement) -> LargeMesh {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("m.obj");
        std::fs::write(&file, text).unwrap();
        LargeMesh::load(&file, placement).unwrap()
    }

    const SMOOTH: Placement = Placement { transform: DAffine3::IDENTITY, crease: 1.0, tangents: None };

    #[test]
    fn a_fine_ball_has_the_hits_and_frames_of_a_sphere_also_from_far_away() {
        let center = DVec3::new(3.0, -2.0, 1.0);
        let mesh = load(&ball(40, center), &SMOOTH);
        let sphere = super::super::shapes::Sphere { center, radius: 1.0, axis: DVec3::Z };
        for k in 0..500 {
            let turn = f64::from(k) * 2.399_963;
            let height = f64::from(k) / 250.0 - 0.998;
            let outward = DVec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - height * height).sqrt() + DVec3::Z * height;
            for away in [1.5, 1e5] {
                let origin = center + away * outward;
                let direction = (center + 0.5 * DVec3::new(height, 0.3, -0.2) - origin).normalize();
                let exact = sphere.intersect(origin, direction, ALL).unwrap().distance;
                let hit = mesh.intersect(origin, direction, ALL, None).unwrap();
                assert!((hit.distance - exact).abs() < 0.01, "{} and not {exact}", hit.distance);
                let place = origin + hit.distance * direction;
                let (frame, expected) = (mesh.frame(&hit), sphere.frame(place));
                // Near the poles the directions of u differ within a triangle.
                if (place - center).z.abs() < 0.9 {
                    let off = (frame.x_axis.distance(expected.x_axis)).max(frame.z_axis.distance(expected.z_axis));
                    assert!(off < 0.1, "{frame:?} and not {expected:?}");
                }
            }
        }
        assert!(mesh.contains(center + 0.9 * DVec3::X) && !mesh.contains(center + 1.1 * DVec3::X));
    }

    #[test]
    fn light_from_outside_reaches_every_point_of_a_coarse_ball_that_faces_it() {
        let mesh = load(&ball(6, DVec3::ZERO), &SMOOTH);
        let light = DVec3::new(0.3, 0.5, 0.4).normalize();
        let mut seen = 0;
        for k in 0..2000 {
            let turn = f64::from(k) * 2.399_963;
            let height = f64::from(k) / 1000.0 - 0.9995;
            let outward = DVec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - height * height).sqrt() + DVec3::Z * height;
            let hit = mesh.intersect(3.0 * outward, -outward, ALL, None).unwrap();
            let normal = mesh.frame(&hit).z_axis;
            if normal.dot(light) > 0.02 {
                seen += 1;
                let origin = mesh.shadow_origin(&hit, 3.0 * outward - hit.distance * outward);
                assert!(!mesh.blocks(origin, light, [1e-9, f64::INFINITY], Some(hit.primitive)), "{outward}");
            }
        }
        assert!(seen > 800, "{seen}");
    }

    #[test]
    fn edges_sharper_than_the_crease_stay_edges() {
        // A roof: two squares that meet at a right angle.
        let roof = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 1 2 0\nv 0 2 0\nf 1 2 3 4\nf 4 3 5 6\n";
        let top = |crease: f64| {
            let mesh = load(roof, &Placement { crease, ..SMOOTH });
            let origin = DVec3::new(0.5, 0.999, 5.0);
            let hit = mesh.intersect(origin, -DVec3::Z, ALL, None).unwrap();
            mesh.frame(&hit).z_axis
        };
        assert!(top(1.6).distance(DVec3::Z) < 0.01, "{}", top(1.6));
        for crease in [0.0, 1.5] {
            assert!(top(crease).distance(DVec3::new(0.0, -0.5_f64.sqrt(), 0.5_f64.sqrt())) < 1e-9, "{}", top(crease));
        }
    }

    #[test]
    fn texture_coordinates_that_are_asked_for_must_be_there() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("m.obj");
        std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let error = LargeMesh::load(&file, &Placement { tangents: Some(Tangents::Uv), ..SMOOTH }).unwrap_err().to_string();
        assert!(error.contains("m.obj") && error.contains("around"), "{error}");
    }
}
