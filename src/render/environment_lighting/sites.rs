//! Where the light that arrives is kept: at the corners of meshes, and on grids over shapes that have a closed form.
//!
//! Between sites what they hold is interpolated, in the frames of their own tiles: linearly over triangles, bilinearly over grids. Corners that share a vertex
//! share a site where their frames nearly agree and their material is the same. Each layer of an object has sites of its own, with its material and the turn of its tile.

use super::super::layers::Cover;
use super::super::scene::Shape;
use super::super::shapes::{Cylinder, Hit, Plane, Sphere, any_across};
use super::super::world::{SurfacePoint, World, turned_by};
use crate::numerics::cast::{index_u32, narrow, truncate_usize};
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

/// Columns of sites around a sphere or a cylinder, and along the longer side of a plane. Chosen: 5.6 degrees; shadows are as soft as sites are apart.
const COLUMNS: usize = 64;
const PLANE_COLUMNS: usize = 96;
/// Fewest rows of a grid.
const LEAST_ROWS: usize = 8;
/// Share of a triangle's other corners at the site of a corner: rays that leave from the corner itself would leave from a dozen triangles at once.
const PULLED_IN: f64 = 0.05;
/// Least cosine between the normals of corners that share a site (8 degrees), and between their tangents (20 degrees). Chosen.
const SHARED: [f64; 2] = [0.99, 0.94];

/// Sites around a place, and their weights, which add up to 1.
#[derive(Clone, Copy, Debug)]
pub struct SiteWeights {
    /// Places of the sites; a mesh has three.
    pub sites: [u32; 4],
    /// Their weights.
    pub weights: [f32; 4],
}

/// A place at which light is kept.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Where it is, with the frame of its material's tile.
    pub place: SurfacePoint,
    /// Its material.
    pub material: usize,
}

/// The sites of a scene.
pub struct Sites {
    /// Those of the outer sides and, of objects with two sides, of the inner ones.
    pub all: Vec<Site>,
    /// For each object those of the materials of its parts, then those of each layer.
    objects: Vec<Vec<CoatSites>>,
}

/// What a coat is made of: the materials of the parts, or that of a layer.
#[derive(Clone, Copy)]
struct Coat {
    object: usize,
    /// Material of a layer.
    material: Option<usize>,
    /// Turn of the tile beyond that of the object.
    turn: f64,
}

/// The sites of a coat of an object, outer side first.
enum CoatSites {
    /// For each triangle those of its corners.
    Mesh([Vec<[u32; 3]>; 2]),
    /// The first of each side.
    Grid(Grid, [u32; 2]),
}

/// A grid over the parameters `u` and `v` of a shape, both in 0..1.
#[derive(Clone, Copy)]
struct Grid {
    columns: usize,
    rows: usize,
    /// Whether `u` runs around.
    around: bool,
}

impl Sites {
    /// The sites of all objects.
    pub fn new(world: &World<'_>) -> Self {
        let mut sites = Self { all: Vec::new(), objects: Vec::new() };
        for (index, object) in world.scene.objects.iter().enumerate() {
            let parts = Coat { object: index, material: None, turn: 0.0 };
            let layers = object.covering.layers.iter();
            let layers = layers.map(|layer| Coat { object: index, material: Some(layer.material), turn: layer.turn - object.turn });
            let coats: Vec<Coat> = std::iter::once(parts).chain(layers).collect();
            let of_object = coats.into_iter().map(|coat| sites.add(world, coat)).collect();
            sites.objects.push(of_object);
        }
        sites
    }

    fn add(&mut self, world: &World<'_>, coat: Coat) -> CoatSites {
        let object = &world.scene.objects[coat.object];
        let sides = if object.two_sided { 2 } else { 1 };
        match &object.shape {
            Shape::Mesh(mesh) => {
                let mut corners = [Vec::new(), Vec::new()];
                for (side, corners) in corners.iter_mut().enumerate().take(sides) {
                    *corners = self.add_mesh(world, coat, mesh.vertices_of_triangles(), side == 0);
                }
                CoatSites::Mesh(corners)
            }
            shape => {
                let grid = Grid::over(shape);
                let mut first = [0; 2];
                for (side, first) in first.iter_mut().enumerate().take(sides) {
                    *first = index_u32(self.all.len());
                    self.add_grid(world, coat, grid, side == 0);
                }
                CoatSites::Grid(grid, first)
            }
        }
    }

    fn add_mesh(&mut self, world: &World<'_>, coat: Coat, triangles: &[[u32; 3]], front: bool) -> Vec<[u32; 3]> {
        let vertices = triangles.iter().flatten().max().map_or(0, |&v| v as usize + 1);
        let mut of_vertex: Vec<Vec<u32>> = vec![Vec::new(); vertices];
        let mut corners = Vec::with_capacity(triangles.len());
        for (primitive, triangle) in (0_u32..).zip(triangles) {
            corners.push(std::array::from_fn(|corner| {
                let mut weights = [PULLED_IN; 3];
                weights[corner] = 1.0 - 2.0 * PULLED_IN;
                let hit = Hit { distance: 0.0, primitive, barycentric: [weights[1], weights[2]] };
                let site = coat.site(world, world.seen_upright(coat.object, hit, front));
                let of_vertex = &mut of_vertex[triangle[corner] as usize];
                if let Some(&alike) = of_vertex.iter().find(|&&other| self.all[other as usize].is_like(&site)) {
                    return alike;
                }
                let at = index_u32(self.all.len());
                of_vertex.push(at);
                self.all.push(site);
                at
            }));
        }
        corners
    }

    fn add_grid(&mut self, world: &World<'_>, coat: Coat, grid: Grid, front: bool) {
        let shape = &world.scene.objects[coat.object].shape;
        for index in 0..grid.columns * grid.rows {
            let u = (index % grid.columns) as f64 + if grid.around { 0.0 } else { 0.5 };
            let v = (index / grid.columns) as f64 + 0.5;
            let position = position(shape, u / grid.columns as f64, v / grid.rows as f64);
            self.all.push(coat.site(world, world.upright_at(coat.object, position, front)));
        }
    }

    /// The sites around a place that hold the light of the material that covers it.
    #[inline]
    pub fn around(&self, world: &World<'_>, place: &SurfacePoint, cover: &Cover) -> SiteWeights {
        let object = &world.scene.objects[place.object];
        let layer = object.covering.layers.iter().position(|l| (l.material, l.turn) == (cover.material, cover.turn));
        let side = usize::from(!place.front);
        // A layer like the material of the part has the same light.
        match &self.objects[place.object][layer.map_or(0, |layer| layer + 1)] {
            CoatSites::Mesh(corners) => {
                let [a, b, c] = corners[side][place.hit.primitive as usize];
                let [u, v] = place.hit.barycentric;
                SiteWeights { sites: [a, b, c, a], weights: [1.0 - u - v, u, v, 0.0].map(narrow) }
            }
            CoatSites::Grid(grid, first) => {
                let [u, v] = parameters(&object.shape, place.position);
                grid.around(first[side], u, v)
            }
        }
    }
}

impl Coat {
    fn site(self, world: &World<'_>, place: SurfacePoint) -> Site {
        let frame = if self.turn == 0.0 { place.frame } else { turned_by(place.frame, self.turn) };
        let material = self.material.unwrap_or_else(|| world.scene.objects[self.object].material(&place.hit));
        Site { place: SurfacePoint { frame, ..place }, material }
    }
}

impl Site {
    /// Whether another corner of the same vertex may share the site.
    fn is_like(&self, other: &Self) -> bool {
        let along = |axis: fn(&DMat3) -> DVec3| axis(&self.place.frame).dot(axis(&other.place.frame));
        along(|f| f.z_axis) > SHARED[0] && along(|f| f.x_axis) > SHARED[1] && self.material == other.material
    }
}

impl Grid {
    fn over(shape: &Shape) -> Self {
        let of = |most: usize, ratio: f64| truncate_usize((most as f64 * ratio).ceil()).clamp(LEAST_ROWS, most);
        let rows = |ratio: f64| of(COLUMNS, ratio);
        match shape {
            Shape::Plane(plane) => {
                let longer = plane.size[0].max(plane.size[1]);
                Self { columns: of(PLANE_COLUMNS, plane.size[0] / longer), rows: of(PLANE_COLUMNS, plane.size[1] / longer), around: false }
            }
            Shape::Cylinder(c) => Self { columns: COLUMNS, rows: rows(c.height / (TAU * c.radius)), around: true },
            Shape::Sphere(_) | Shape::Mesh(_) => Self { columns: COLUMNS, rows: rows(0.5), around: true },
        }
    }

    fn around(self, first: u32, u: f64, v: f64) -> SiteWeights {
        let last = |size: usize| (size - 1) as f64;
        let x = if self.around { u * self.columns as f64 } else { (u * self.columns as f64 - 0.5).clamp(0.0, last(self.columns)) };
        let y = (v * self.rows as f64 - 0.5).clamp(0.0, last(self.rows));
        let (column, row) = (truncate_usize(x).min(self.columns - 1), truncate_usize(y).min(self.rows - 1));
        let (right, below) = (x - column as f64, y - row as f64);
        let next = if self.around { (column + 1) % self.columns } else { (column + 1).min(self.columns - 1) };
        let lower = (row + 1).min(self.rows - 1);
        let site = |row: usize, column: usize| first + index_u32(row * self.columns + column);
        SiteWeights {
            sites: [site(row, column), site(row, next), site(lower, column), site(lower, next)],
            weights: [(1.0 - right) * (1.0 - below), right * (1.0 - below), (1.0 - right) * below, right * below].map(narrow),
        }
    }
}

/// The place with these parameters; no mesh has any.
fn position(shape: &Shape, u: f64, v: f64) -> DVec3 {
    let turned = |axis: DVec3| {
        let x = any_across(axis);
        let (sin, cos) = (TAU * u).sin_cos();
        cos * x + sin * axis.cross(x)
    };
    match shape {
        Shape::Sphere(Sphere { center, radius, axis }) => {
            let (sin, cos) = (PI * v).sin_cos();
            *center + *radius * (sin * turned(*axis) + cos * *axis)
        }
        Shape::Cylinder(Cylinder { center, radius, height, axis }) => *center + *radius * turned(*axis) + (v - 0.5) * *height * *axis,
        Shape::Plane(Plane { center, frame, size }) => *center + (u - 0.5) * size[0] * frame.x_axis + (v - 0.5) * size[1] * frame.y_axis,
        Shape::Mesh(mesh) => mesh.middle(),
    }
}

/// The parameters of a place on a shape.
fn parameters(shape: &Shape, place: DVec3) -> [f64; 2] {
    let turn = |axis: DVec3, from: DVec3| {
        let x = any_across(axis);
        (from.dot(axis.cross(x)).atan2(from.dot(x)) / TAU).rem_euclid(1.0)
    };
    match shape {
        Shape::Sphere(Sphere { center, radius, axis }) => {
            let from = place - *center;
            [turn(*axis, from), (from.dot(*axis) / *radius).clamp(-1.0, 1.0).acos() / PI]
        }
        Shape::Cylinder(Cylinder { center, height, axis, .. }) => {
            let from = place - *center;
            [turn(*axis, from), from.dot(*axis) / *height + 0.5]
        }
        Shape::Plane(Plane { center, frame, size }) => {
            let from = place - *center;
            [from.dot(frame.x_axis) / size[0] + 0.5, from.dot(frame.y_axis) / size[1] + 0.5]
        }
        Shape::Mesh(_) => [0.5; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_and_positions_are_inverse_and_weights_reproduce_the_place() {
        let axis = DVec3::new(0.2, -0.4, 0.9).normalize();
        let shapes = [
            Shape::Sphere(Sphere { center: DVec3::new(1.0, 2.0, 3.0), radius: 0.7, axis }),
            Shape::Cylinder(Cylinder { center: DVec3::X, radius: 0.5, height: 3.0, axis }),
            Shape::Plane(Plane { center: DVec3::Y, frame: DMat3::IDENTITY, size: [2.0, 5.0] }),
        ];
        for shape in &shapes {
            let grid = Grid::over(shape);
            for (u, v) in [(0.01, 0.5), (0.3, 0.21), (0.77, 0.9), (0.999, 0.4)] {
                let place = position(shape, u, v);
                let [u2, v2] = parameters(shape, place);
                assert!((u - u2).abs() < 1e-9 && (v - v2).abs() < 1e-9, "{u}, {v}: {u2}, {v2}");
                let SiteWeights { sites, weights } = grid.around(0, u, v);
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{weights:?}");
                let site = |site: u32| {
                    let (column, row) = (site as usize % grid.columns, site as usize / grid.columns);
                    let shift = if grid.around { 0.0 } else { 0.5 };
                    position(shape, (column as f64 + shift) / grid.columns as f64, (row as f64 + 0.5) / grid.rows as f64)
                };
                let mean: DVec3 = (0..4).map(|k| f64::from(weights[k]) * site(sites[k])).sum();
                // Between a border and the first sites what they hold is continued.
                assert!(mean.distance(place) < 0.05, "{place} by {mean}");
            }
        }
    }
}
