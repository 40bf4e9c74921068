//! Rays through the periodic surface.
//!
//! A ray is followed from cell to cell of the lattice until it hits, or leaves the heights between the lowest and the highest
//! point of the surface. Nothing is replicated beyond one cell: a 3x3 copy of the tile is not enough at grazing angles, where
//! an occluder of height `h` stands up to `h tan(theta)` away (`numerics.md`, section 3.3). The cell holds the part of *every*
//! translate of every triangle that reaches into it, so that overhangs are right.
//!
//! Lengths are normalised axis by axis: the cell becomes the unit square and the height of the surface 1. An affine map keeps
//! which triangle a ray meets first, and lets the single-precision boxes of the hierarchy serve periods of 1e-6 and surfaces
//! 1e-6 times as high as wide. Boxes are padded by more than their rounding, triangles are intersected in double precision.
//!
//! The hierarchy is obvhs's: PLOC (Meister and Bittner 2018), compressed to eight children a node (Ylitie et al. 2017).

use super::repeating::RepeatingPath;
use crate::error::{BadInput, Error, Result};
use crate::geometry::Tile;
use crate::numerics::cast::narrow;
use glam::{DVec2, DVec3, UVec2, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::{BRANCHING, CwBvh, builder::build_cwbvh};
use obvhs::ray::Ray;
use std::time::Duration;

/// Cells after which a ray is given up: it counts as free, and its share belongs to the error (`numerics.md`, section 3.3).
pub const MAX_PERIODS: u32 = 65_536;

/// Most triangles a cell may hold, copies of overhanging ones included; building takes about 600 bytes for each.
pub const MAX_TRIANGLES: usize = 4_000_000;

/// Growth of the boxes, in units of the cell. Single precision misplaces a slab of a unit cell by at most 5e-7.
const BOX_PADDING: f64 = 2e-6;

/// How far behind its start a ray enters the hierarchy. obvhs ignores boxes that end within 1e-4 of a ray's origin
/// (`cwbvh::node::EPSILON`), so the origin is moved back by more than that.
const STEP_BACK: f64 = 2e-4;

/// How far, relative to its longest edge, a ray may pass outside of a triangle: closes the seams that rounding (4e-16) would
/// open between neighbours.
const SEAM: f64 = 4e-15;

/// Two hits this close, in units of the cell, are one place; of two faces in one place the front one is seen.
const SAME_PLACE: f64 = 1e-10;

/// Distance to a plane, in units of the cell, within which a point of the caller's counts as lying in it, for coordinates of
/// order 1; for larger ones the rounding of the coordinates is added.
const IN_PLANE: f64 = 1e-11;

/// The same for the plane of the triangle that the caller names: there the claim is believed to single precision.
const IN_NAMED_PLANE: f64 = 1e-6;

/// Cells after which a walk asks what stands on its path, and faces that cost as much as a cell to look at. Chosen, not measured.
const LOOK_AFTER: usize = 16;
const FACES_PER_CELL: usize = 64;

/// obvhs keeps at most 31 pending groups and silently drops more; a level of the hierarchy leaves at most one.
pub(crate) const MAX_DEPTH: usize = 31;

/// What a ray from a point of the surface found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occlusion {
    /// It hit the surface.
    Blocked,
    /// It left the surface.
    Free,
    /// It passed [`MAX_PERIODS`] cells without either.
    GaveUp,
}

/// The first place where a ray meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Place in [`Tile::triangles`].
    pub triangle: u32,
    /// Where, wrapped into the cell `[0, period.x) x [0, period.y)` up to rounding, on the triangle or a translate of it.
    pub position: DVec3,
    /// Distance from the origin in units of the direction's length.
    pub distance: f64,
    /// Whether the face turns its outer side to the origin.
    pub front: bool,
    /// Weights of the triangle's second and third corner at the place; the first has the rest.
    pub barycentric: DVec2,
}

/// Where a search for the first hit ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Traced {
    /// At the surface.
    Hit(Hit),
    /// Above or below the surface.
    Left,
    /// After [`MAX_PERIODS`] cells.
    GaveUp,
}

/// One triangle, prepared for the test of Möller and Trumbore (1997).
///
/// Tests that intersect the plane first and then locate the point in the triangle (Havel and Herout 2010) cost less, but lose
/// rays at edges of faces that they graze: there the point is uncertain by the rounding over the cosine.
#[derive(Clone, Copy, Debug)]
struct Face {
    corner: DVec3,
    /// Edges from `corner` to the second and the third corner.
    edges: [DVec3; 2],
    /// Product of the edges: outward, twice the area long.
    normal: DVec3,
    /// By how much an edge may be missed, in the units of the edge tests.
    seam: f64,
}

/// A hierarchy of boxes over one cell of a periodic surface.
#[derive(Clone, Debug)]
pub struct PeriodicBvh {
    bvh: CwBvh,
    /// In the order of the hierarchy's leaves.
    faces: Vec<Face>,
    /// For each face its triangle in the tile.
    triangles: Vec<u32>,
    /// Normalised = (position - (0, 0, bottom)) · scale.
    scale: DVec3,
    bottom: f64,
    /// Height of the surface in normalised units: 1, or less for a nearly flat one.
    top: f64,
    highest: f64,
    in_plane: f64,
}

/// A ray in normalised space that walks from cell to cell.
struct Walk {
    /// Start, wrapped into the unit cell.
    start: DVec3,
    /// Unit vector.
    direction: DVec3,
    /// Distance from the caller's origin to `start`.
    skipped: f64,
    /// Distance from `start` at which it leaves the heights of the surface.
    end: f64,
}

/// The part of a walk inside one cell.
struct Segment {
    origin: DVec3,
    /// From the start of the walk to `origin`.
    entry: f64,
    length: f64,
}

impl PeriodicBvh {
    /// Builds the hierarchy; about half a second per million triangles.
    ///
    /// Triangles without area or with corners that are not finite block nothing.
    ///
    /// # Errors
    /// [`Error::BadInput`] if the cell would hold more than [`MAX_TRIANGLES`], which says that the period is far smaller than
    /// the mesh; [`Error::Numeric`] if the hierarchy becomes deeper than obvhs can traverse.
    pub fn new(tile: &Tile) -> Result<Self> {
        let used = || tile.triangles.iter().flatten().map(|&v| tile.vertices[v as usize]).filter(|p| p.is_finite());
        let (low, high) = used().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.z), high.max(p.z)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        // A height that is rounding alone must not be blown up to 1.
        let unit_height = (high - low).max(1e-9 * tile.period.max_element()).max(1e-12 * low.abs().max(high.abs()));
        let scale = DVec3::new(tile.period.x.recip(), tile.period.y.recip(), unit_height.recip());
        let largest = used().fold(low.abs().max(high.abs()) * scale.z, |m, p| m.max((p * scale).truncate().abs().max_element()));

        let normalised = |triangle: &[u32; 3]| triangle.map(|v| (tile.vertices[v as usize] - DVec3::Z * low) * scale);
        let copies: f64 = tile.triangles.iter().map(|t| Translates::of(&normalised(t)).count()).sum();
        if copies > MAX_TRIANGLES as f64 {
            let problem = format!(
                "{} triangles reach into {copies:.0} places of a period of {} x {}",
                tile.triangles.len(),
                tile.period.x,
                tile.period.y
            );
            let remedy = format!("at most {MAX_TRIANGLES} are possible: check the period, or use a coarser mesh");
            return Err(BadInput::new(problem, remedy).at_field("geometry.period").into());
        }

        let (mut boxes, mut faces, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
        for (id, triangle) in (0_u32..).zip(&tile.triangles) {
            let corners = normalised(triangle);
            for shift in Translates::of(&corners).iter() {
                let corners = corners.map(|p| p + shift);
                if let (Some(bounds), Some(face)) = (bounds_in_cell(&corners), Face::new(&corners)) {
                    boxes.push(bounds);
                    faces.push(face);
                    triangles.push(id);
                }
            }
        }
        // obvhs wants to time itself; nobody reads it.
        let mut bvh = build_cwbvh(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        if depth(&bvh) > MAX_DEPTH {
            return Err(Error::Numeric(format!(
                "the triangles are nested so deeply that their hierarchy has more than {MAX_DEPTH} levels: remove the smallest ones"
            )));
        }
        let order = std::mem::take(&mut bvh.primitive_indices);
        Ok(Self {
            faces: order.iter().map(|&i| faces[i as usize]).collect(),
            triangles: order.iter().map(|&i| triangles[i as usize]).collect(),
            bvh,
            scale,
            bottom: low,
            top: (high - low) * scale.z,
            highest: high,
            in_plane: IN_PLANE + 16.0 * f64::EPSILON * largest,
        })
    }

    /// Height of the highest point, in the tile's unit.
    pub fn highest(&self) -> f64 {
        self.highest
    }

    /// Whether the surface blocks a ray that leaves it at `origin` on `triangle` (or on a translate of it).
    ///
    /// `origin` must be known to double precision: faces in whose plane it lies (its own, duplicates, coplanar neighbours)
    /// cannot block the ray, and are found by their distance. `direction` need not be a unit vector. Both sides of a face block.
    pub fn occluded(&self, triangle: usize, origin: DVec3, direction: DVec3) -> Occlusion {
        let Some(walk) = self.walk(origin, direction) else { return Occlusion::Free };
        let (blocked, finished) = walk.cells(&self.faces, |segment| self.blocks(segment, walk.direction, triangle));
        match (blocked, finished) {
            (Some(()), _) => Occlusion::Blocked,
            (None, true) => Occlusion::Free,
            (None, false) => Occlusion::GaveUp,
        }
    }

    /// The first hit of a ray, if there is one. A ray that passes [`MAX_PERIODS`] cells hits nothing; [`Self::trace`] tells.
    pub fn closest(&self, origin: DVec3, direction: DVec3, skip_triangle: Option<u32>) -> Option<Hit> {
        match self.trace(origin, direction, skip_triangle) {
            Traced::Hit(hit) => Some(hit),
            Traced::Left | Traced::GaveUp => None,
        }
    }

    /// Follows a ray to its first hit.
    ///
    /// With `skip_triangle` the ray leaves the surface there, and the rules of [`Self::occluded`] hold; without, a face that
    /// passes through `origin` is hit at distance 0. Where a front and a back face coincide, the front one is hit.
    pub fn trace(&self, origin: DVec3, direction: DVec3, skip_triangle: Option<u32>) -> Traced {
        let Some(walk) = self.walk(origin, direction) else { return Traced::Left };
        let (hit, finished) = walk.cells(&self.faces, |segment| self.first(segment, walk.direction, skip_triangle));
        match (hit, finished) {
            (Some((face, place, distance)), _) => {
                let length = (direction * self.scale).length();
                Traced::Hit(Hit {
                    triangle: self.triangles[face],
                    position: place / self.scale + DVec3::Z * self.bottom,
                    distance: (walk.skipped + distance) / length,
                    front: self.faces[face].normal.dot(walk.direction) < 0.0,
                    barycentric: self.faces[face].barycentric(place),
                })
            }
            (None, true) => Traced::Left,
            (None, false) => Traced::GaveUp,
        }
    }

    /// Normalises a ray and cuts off what lies above and below the surface; `None` if nothing is left.
    fn walk(&self, origin: DVec3, direction: DVec3) -> Option<Walk> {
        let direction = (direction * self.scale).normalize();
        let origin = (origin - DVec3::Z * self.bottom) * self.scale;
        let (low, high) = (-SAME_PLACE, self.top + SAME_PLACE);
        let (near, far) = if direction.z == 0.0 {
            if origin.z < low || origin.z > high {
                return None;
            }
            (0.0, f64::INFINITY)
        } else {
            let (a, b) = ((low - origin.z) / direction.z, (high - origin.z) / direction.z);
            (a.min(b).max(0.0), a.max(b))
        };
        let start = origin + near * direction;
        // Not `far < near`: a direction that is not a number ends here, too.
        (near <= far).then(|| Walk { start: DVec3::new(wrap(start.x), wrap(start.y), start.z), direction, skipped: near, end: far - near })
    }

    /// Whether any face blocks the segment of a ray that left the surface on `triangle`.
    fn blocks(&self, segment: &Segment, direction: DVec3, triangle: usize) -> Option<()> {
        let ray = hierarchy_ray(segment, direction);
        let mut state = self.bvh.new_traversal(ray.direction);
        let mut node;
        obvhs::traverse!(self.bvh, node, state, node.intersect_ray(&ray, state.oct_inv4), {
            let index = state.primitive_id as usize;
            let face = &self.faces[index];
            if face.intersect(segment.origin, direction, segment.length).is_some()
                && !self.leaves_from(segment, face, || self.triangles[index] as usize == triangle)
            {
                return Some(());
            }
        });
        None
    }

    /// First face on a segment: its index, the place, and the distance from the start of the walk.
    fn first(&self, segment: &Segment, direction: DVec3, skip_triangle: Option<u32>) -> Option<(usize, DVec3, f64)> {
        let mut ray = hierarchy_ray(segment, direction);
        let mut state = self.bvh.new_traversal(ray.direction);
        let mut node;
        let mut best: Option<(usize, f64, bool)> = None;
        obvhs::traverse!(self.bvh, node, state, node.intersect_ray(&ray, state.oct_inv4), {
            let index = state.primitive_id as usize;
            let face = &self.faces[index];
            let limit = best.map_or(segment.length, |(_, t, _)| t + SAME_PLACE);
            if let Some(t) = face.intersect(segment.origin, direction, limit)
                && !skip_triangle.is_some_and(|skip| self.leaves_from(segment, face, || self.triangles[index] == skip))
            {
                let front = face.normal.dot(direction) < 0.0;
                let better = best.is_none_or(|(_, best_t, best_front)| t < best_t - SAME_PLACE || (front, -t) > (best_front, -best_t));
                if better {
                    best = Some((index, t, front));
                    ray.tmax = narrow(t + STEP_BACK + BOX_PADDING);
                }
            }
        });
        best.map(|(index, t, _)| {
            let place = segment.origin + t * direction;
            let face = &self.faces[index];
            // Back into the plane: a long walk has rounded more than the next ray's test for its own plane allows.
            let place = place - face.normal.normalize() * face.height(place);
            (index, place, segment.entry + t)
        })
    }

    /// Whether the ray starts in the plane of a face: such a face, its own or a coplanar one, is no obstacle.
    fn leaves_from(&self, segment: &Segment, face: &Face, named: impl FnOnce() -> bool) -> bool {
        // A ray that has come from afar may pass through a plane at the border of two cells, and be blocked there.
        if segment.entry > IN_NAMED_PLANE {
            return false;
        }
        let height = face.height(segment.origin).abs();
        height <= self.in_plane || (height <= IN_NAMED_PLANE && named())
    }
}

impl Walk {
    /// Shows `visit` the segments in order, but for those over which none of `faces` can stand, until it finds something. Also tells whether the walk came to
    /// its end or to a find, and not to [`MAX_PERIODS`].
    fn cells<T>(&self, faces: &[Face], mut visit: impl FnMut(&Segment) -> Option<T>) -> (Option<T>, bool) {
        let (mut column, mut row) = (0.0, 0.0);
        let mut look = LOOK_AFTER.max(faces.len() / FACES_PER_CELL);
        // Distance from `start` to the next border of the lattice, computed anew from the cell's number: it does not drift.
        let border = |cell: f64, start: f64, direction: f64| {
            if direction > 0.0 {
                (cell + 1.0 - start) / direction
            } else if direction < 0.0 {
                (cell - start) / direction
            } else {
                f64::INFINITY
            }
        };
        let mut entry = 0.0_f64;
        for cell in 0..MAX_PERIODS as usize {
            if cell == look {
                look += look;
                let at = self.start + entry * self.direction - DVec3::new(column, row, 0.0);
                if let Some(path) = RepeatingPath::new(at, self.direction) {
                    let free = path.next_height(faces.iter().map(Face::corners), at.z);
                    let to_end = (self.end - entry) / path.length;
                    if free == f64::INFINITY && to_end <= path.straight {
                        return (None, true);
                    }
                    // One repeat less, so that the walk comes to what stands there from below.
                    let repeats = ((free - at.z) / path.rise - 1.0).min(to_end).min(path.straight).floor().max(0.0);
                    column += repeats * path.cells[0];
                    row += repeats * path.cells[1];
                    entry += repeats * path.length;
                }
            }
            let x = border(column, self.start.x, self.direction.x);
            let y = border(row, self.start.y, self.direction.y);
            let exit = x.min(y).min(self.end).max(entry);
            let place = self.start + entry * self.direction;
            let origin = DVec3::new((place.x - column).clamp(0.0, 1.0), (place.y - row).clamp(0.0, 1.0), place.z);
            // A wall on the border belongs to both cells; the longer segment makes sure that one of them sees it.
            let found = visit(&Segment { origin, entry, length: exit - entry + SAME_PLACE });
            if found.is_some() || exit >= self.end {
                return (found, true);
            }
            if x <= exit {
                column += self.direction.x.signum();
            }
            if y <= exit {
                row += self.direction.y.signum();
            }
            entry = exit;
        }
        (None, false)
    }
}

impl Face {
    fn corners(&self) -> [DVec3; 3] {
        [self.corner, self.corner + self.edges[0], self.corner + self.edges[1]]
    }

    /// `None` for a triangle without area.
    fn new(corners: &[DVec3; 3]) -> Option<Self> {
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        let normal = edges[0].cross(edges[1]);
        let seam = SEAM * edges[0].length().max(edges[1].length());
        let area = normal.length();
        (area.is_finite() && area > 0.0).then_some(Self { corner: corners[0], edges, normal, seam })
    }

    /// Distance along the ray within `-SAME_PLACE..=limit`.
    #[inline]
    fn intersect(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<f64> {
        let from_corner = origin - self.corner;
        let facing = -self.normal.dot(direction);
        let t = self.normal.dot(from_corner) / facing;
        // False for a parallel ray, too, whose t is infinite or not a number.
        if !(t >= -SAME_PLACE && t <= limit) {
            return None;
        }
        let moment = from_corner.cross(direction) * facing.signum();
        let u = self.edges[1].dot(moment);
        let v = -self.edges[0].dot(moment);
        (u >= -self.seam && v >= -self.seam && u + v <= facing.abs() + self.seam).then_some(t)
    }

    /// Weights of the second and the third corner at a point of the plane.
    fn barycentric(&self, place: DVec3) -> DVec2 {
        let from_corner = place - self.corner;
        let [a, b] = self.edges;
        DVec2::new(b.cross(self.normal).dot(from_corner), self.normal.cross(a).dot(from_corner)) / self.normal.length_squared()
    }

    /// Height of a point over the plane.
    fn height(&self, place: DVec3) -> f64 {
        self.normal.dot(place - self.corner) / self.normal.length()
    }
}

/// The translates of a triangle whose bounding rectangle touches the unit cell.
struct Translates {
    columns: (f64, f64),
    rows: (f64, f64),
}

impl Translates {
    fn of(corners: &[DVec3; 3]) -> Self {
        let low = corners[0].min(corners[1]).min(corners[2]);
        let high = corners[0].max(corners[1]).max(corners[2]);
        if !(low.is_finite() && high.is_finite()) {
            return Self { columns: (0.0, -1.0), rows: (0.0, -1.0) };
        }
        // low + k <= 1 and high + k >= 0, with the padding of the boxes so that a wall on the border is in both cells.
        let span = |low: f64, high: f64| ((-high - BOX_PADDING).ceil(), (1.0 - low + BOX_PADDING).floor());
        Self { columns: span(low.x, high.x), rows: span(low.y, high.y) }
    }

    fn count(&self) -> f64 {
        (self.columns.1 - self.columns.0 + 1.0).max(0.0) * (self.rows.1 - self.rows.0 + 1.0).max(0.0)
    }

    fn iter(&self) -> impl Iterator<Item = DVec3> {
        let steps = |(first, last): (f64, f64)| std::iter::successors(Some(first), |k| Some(k + 1.0)).take_while(move |&k| k <= last);
        let rows = self.rows;
        steps(self.columns).flat_map(move |x| steps(rows).map(move |y| DVec3::new(x, y, 0.0)))
    }
}

/// Padded box around the part of a triangle that lies in the unit cell; `None` if nothing does.
fn bounds_in_cell(corners: &[DVec3; 3]) -> Option<Aabb> {
    // Sutherland and Hodgman 1974: each of four half planes adds at most one corner.
    let mut polygon = corners.to_vec();
    for axis in 0..2 {
        for (border, side) in [(-BOX_PADDING, 1.0), (1.0 + BOX_PADDING, -1.0)] {
            let inside = |p: DVec3| (p[axis] - border) * side;
            let mut clipped = Vec::with_capacity(polygon.len() + 1);
            for (k, &p) in polygon.iter().enumerate() {
                let q = polygon[(k + 1) % polygon.len()];
                let (a, b) = (inside(p), inside(q));
                if a >= 0.0 {
                    clipped.push(p);
                }
                if (a < 0.0) != (b < 0.0) {
                    let mut cut = p + (q - p) * (a / (a - b));
                    cut[axis] = border;
                    clipped.push(cut);
                }
            }
            polygon = clipped;
        }
    }
    let first = *polygon.first()?;
    let (low, high) = polygon.iter().fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
    Some(Aabb::new((low - BOX_PADDING).as_vec3a(), (high + BOX_PADDING).as_vec3a()))
}

/// The ray that the hierarchy's boxes are tested with: it starts [`STEP_BACK`] early and ends a padding late.
fn hierarchy_ray(segment: &Segment, direction: DVec3) -> Ray {
    let origin: Vec3A = (segment.origin - STEP_BACK * direction).as_vec3a();
    // obvhs takes -0 for a negative component in one place and for a positive one in another; -1e-50 becomes -0 here.
    let direction = direction.as_vec3a() + Vec3A::ZERO;
    Ray::new(origin, direction, 0.0, narrow(segment.length + STEP_BACK + BOX_PADDING))
}

/// Into `[0, 1)`.
fn wrap(x: f64) -> f64 {
    let fraction = x - x.floor();
    // -1e-17 has the fraction 1.
    if fraction < 1.0 { fraction } else { 0.0 }
}

/// Levels of the hierarchy.
pub(crate) fn depth(bvh: &CwBvh) -> usize {
    let mut level: Vec<usize> = if bvh.nodes.is_empty() { Vec::new() } else { vec![0] };
    let mut levels = 0;
    while !level.is_empty() {
        levels += 1;
        level = level
            .iter()
            .flat_map(|&index| {
                let node = &bvh.nodes[index];
                (0..BRANCHING).filter(|&c| !node.is_child_empty(c) && !node.is_leaf(c)).map(|c| node.child_node_index(c) as usize)
            })
            .collect();
    }
    levels
}

#[cfg(test)]
#[path = "rays_tests.rs"]
mod tests;
