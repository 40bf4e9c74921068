//! Rays among the objects of a scene: what is seen, and how much light gets through.

use super::layers::Cover;
use super::mapping::{Footprint, ImagePlace};
use super::opacity::Opacity;
use super::scene::{Object, Scene, Shape};
use super::shapes::Hit;
use crate::error::Result;
use crate::filter::Control;
use glam::{DMat3, DVec3};

/// Distance, relative to the coordinates at hand, that separates a place from itself.
const SAME_PLACE: f64 = 1e-9;
/// Least cosine between the smooth normal of a mesh and the viewer: normals that are interpolated may turn away from whoever
/// sees the triangle.
const LEAST_FACING: f64 = 0.02;
/// Most surfaces with gaps that are looked through.
pub const MAX_SURFACES: usize = 32;
/// A share of light this small counts as none.
pub const NOTHING: f64 = 1e-4;

/// A scene with what rays need beside it.
pub struct World<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// For each material how much of it rays meet.
    pub opacity: Vec<Opacity>,
    /// For each object whether no light gets through any part.
    opaque: Vec<bool>,
}

/// A place where a ray meets an object.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Which object.
    pub object: usize,
    /// Where on it.
    pub hit: Hit,
    /// Where in the world.
    pub position: DVec3,
    /// The shape's own outward normal there.
    pub outward: DVec3,
    /// Frame of the object's tile there: columns x, y, z; z points to the side that is seen. A layer with a turn of its own, and a normal map,
    /// have another one: [`World::covers`], [`World::shading_frame`].
    pub frame: DMat3,
    /// Whether the outer side is seen.
    pub front: bool,
}

impl SurfacePoint {
    /// The place as the images of its object see it; `footprint` is that of a ray there.
    fn image_place<'a>(&'a self, object: &'a Object, footprint: Footprint) -> ImagePlace<'a> {
        ImagePlace { shape: &object.shape, hit: &self.hit, position: self.position, outward: self.outward, footprint }
    }
}

impl Object {
    /// The first hit of a ray at a distance between the two of `range`, on another triangle than `skip`.
    pub fn intersect(&self, origin: DVec3, direction: DVec3, range: [f64; 2], skip: Option<u32>) -> Option<Hit> {
        match &self.shape {
            Shape::Sphere(sphere) => sphere.intersect(origin, direction, range),
            Shape::Cylinder(cylinder) => cylinder.intersect(origin, direction, range),
            Shape::Plane(plane) => plane.intersect(origin, direction, range).filter(|_| skip.is_none()),
            Shape::Mesh(mesh) => mesh.intersect(origin, direction, range, skip),
        }
    }

    fn blocks(&self, origin: DVec3, direction: DVec3, range: [f64; 2], skip: Option<u32>) -> bool {
        match &self.shape {
            Shape::Mesh(mesh) => mesh.blocks(origin, direction, range, skip),
            _ => self.intersect(origin, direction, range, skip).is_some(),
        }
    }

    /// The frame at a hit, before `turn`.
    fn frame(&self, hit: &Hit, position: DVec3) -> DMat3 {
        match &self.shape {
            Shape::Sphere(sphere) => sphere.frame(position),
            Shape::Cylinder(cylinder) => cylinder.frame(position),
            Shape::Plane(plane) => plane.frame,
            Shape::Mesh(mesh) => mesh.frame(hit),
        }
    }

    /// Outward unit normal of the shape itself at a hit; `frame` is that of [`Self::frame`].
    fn outward(&self, hit: &Hit, frame: &DMat3) -> DVec3 {
        match &self.shape {
            Shape::Mesh(mesh) => mesh.face_normal(hit.primitive),
            _ => frame.z_axis,
        }
    }

    /// Material of the part at a hit, under all layers.
    pub fn material(&self, hit: &Hit) -> usize {
        let part = match &self.shape {
            Shape::Mesh(mesh) => usize::from(mesh.part_of_triangle[hit.primitive as usize]),
            _ => 0,
        };
        self.materials[part]
    }
}

/// A frame turned about its z by an angle, counter-clockwise seen from its tip.
pub(super) fn turned_by(frame: DMat3, turn: f64) -> DMat3 {
    let (sin, cos) = turn.sin_cos();
    DMat3::from_cols(cos * frame.x_axis + sin * frame.y_axis, cos * frame.y_axis - sin * frame.x_axis, frame.z_axis)
}

/// The frame whose z is turned towards the unit vector `viewer` until their cosine is at least [`LEAST_FACING`].
fn facing(frame: DMat3, viewer: DVec3) -> DMat3 {
    let cosine = frame.z_axis.dot(viewer);
    if cosine >= LEAST_FACING {
        return frame;
    }
    let across = (frame.z_axis - cosine * viewer).normalize_or(super::shapes::any_across(viewer));
    let z = LEAST_FACING * viewer + (1.0 - LEAST_FACING * LEAST_FACING).sqrt() * across;
    let x = (frame.x_axis - frame.x_axis.dot(z) * z).normalize_or(super::shapes::any_across(z));
    DMat3::from_cols(x, z.cross(x), z)
}

impl<'a> World<'a> {
    /// Finds out which materials have gaps.
    ///
    /// # Errors
    /// Those of [`Opacity::of`].
    pub fn new(scene: &'a Scene, control: &Control<'_>) -> Result<Self> {
        let opacity = scene.materials.iter().map(|m| Opacity::of(&m.small.tile, control)).collect::<Result<Vec<_>>>()?;
        let opaque = scene.objects.iter().map(|o| o.all_materials().all(|m| opacity[m].is_opaque())).collect();
        Ok(Self { scene, opacity, opaque })
    }

    /// As if no material had gaps.
    pub fn opaque(scene: &'a Scene) -> Self {
        Self { scene, opacity: vec![Opacity::Opaque; scene.materials.len()], opaque: vec![true; scene.objects.len()] }
    }

    /// The first place on a ray beyond the distance `after`.
    pub fn first(&self, origin: DVec3, direction: DVec3, after: f64) -> Option<SurfacePoint> {
        let mut best: Option<(usize, Hit)> = None;
        let after = after + SAME_PLACE * (1.0 + after);
        for (index, object) in self.scene.objects.iter().enumerate() {
            let limit = best.map_or(f64::INFINITY, |(_, hit)| hit.distance);
            if let Some(hit) = object.intersect(origin, direction, [after, limit], None) {
                best = Some((index, hit));
            }
        }
        let (index, hit) = best?;
        Some(self.seen(index, hit, origin + hit.distance * direction, direction))
    }

    /// A hit on an object as a ray along `direction` sees it.
    pub fn seen(&self, index: usize, hit: Hit, position: DVec3, direction: DVec3) -> SurfacePoint {
        let object = &self.scene.objects[index];
        let frame = object.frame(&hit, position);
        let outward = object.outward(&hit, &frame);
        let front = outward.dot(direction) < 0.0;
        // Seen from behind, the tile is turned round about its y.
        let seen = if front { frame } else { DMat3::from_cols(-frame.x_axis, frame.y_axis, -frame.z_axis) };
        let turned = turned_by(seen, object.turn);
        SurfacePoint { object: index, hit, position, outward, frame: facing(turned, -direction), front }
    }

    /// A place on a triangle of a mesh as it is seen from straight above its outer side, or its inner one.
    pub fn seen_upright(&self, index: usize, hit: Hit, front: bool) -> SurfacePoint {
        let Shape::Mesh(mesh) = &self.scene.objects[index].shape else { return self.upright_at(index, DVec3::ZERO, front) };
        let outward = mesh.frame(&hit).z_axis;
        self.seen(index, hit, mesh.position(&hit), if front { -outward } else { outward })
    }

    /// The same of a place on a shape that is no mesh.
    pub fn upright_at(&self, index: usize, position: DVec3, front: bool) -> SurfacePoint {
        let hit = Hit { distance: 0.0, primitive: 0, barycentric: [0.0; 2] };
        let outward = self.scene.objects[index].frame(&hit, position).z_axis;
        self.seen(index, hit, position, if front { -outward } else { outward })
    }

    /// Appends the materials at a place with their weights; `footprint` is that of the ray that met it, across the ray, and `direction`
    /// the ray's.
    pub fn covers(&self, place: &SurfacePoint, footprint: Footprint, direction: DVec3, covers: &mut Vec<Cover>) {
        let object = &self.scene.objects[place.object];
        let place = place.image_place(object, footprint.onto(direction, place.outward));
        object.covering.covers(&place, (object.material(place.hit), object.turn), covers);
    }

    /// The frame in which the materials of a place are evaluated: that of its normal map, turned towards the viewer as any smooth normal
    /// is where it turns away from whoever sees the place.
    pub fn shading_frame(&self, place: &SurfacePoint, footprint: Footprint, direction: DVec3) -> DMat3 {
        let object = &self.scene.objects[place.object];
        let Some(map) = &object.covering.normal_map else { return place.frame };
        let images = place.image_place(object, footprint.onto(direction, place.outward));
        facing(map.turned(&images, place.frame, place.front), -direction)
    }

    /// The share of rays along `direction` that the object's surface stops at a hit.
    fn opacity_at(&self, object: &Object, hit: Hit, ray: (DVec3, DVec3), footprint: Footprint) -> f64 {
        let (origin, direction) = ray;
        let position = origin + hit.distance * direction;
        let frame = object.frame(&hit, position);
        let along = |material: usize, turn: f64| {
            let (sin, cos) = turn.sin_cos();
            let (x, y) = (direction.dot(frame.x_axis), direction.dot(frame.y_axis));
            let local = DVec3::new(cos * x + sin * y, cos * y - sin * x, direction.dot(frame.z_axis));
            self.opacity[material].along(local.normalize())
        };
        if object.covering.layers.is_empty() {
            return along(object.material(&hit), object.turn);
        }
        let outward = object.outward(&hit, &frame);
        let place = ImagePlace { shape: &object.shape, hit: &hit, position, outward, footprint: footprint.onto(direction, outward) };
        let mut covers = Vec::new();
        object.covering.covers(&place, (object.material(&hit), object.turn), &mut covers);
        covers.iter().map(|cover| cover.weight * along(cover.material, cover.turn)).sum()
    }

    /// The share of light that reaches a place from the unit direction `to_light`, over `distance`; `footprint` is that of the place.
    pub fn transmittance(&self, place: &SurfacePoint, footprint: Footprint, to_light: DVec3, distance: f64) -> f64 {
        let start = match &self.scene.objects[place.object].shape {
            // The lifted origin lies over the outer side only.
            Shape::Mesh(mesh) if place.front => mesh.shadow_origin(&place.hit, place.position),
            _ => place.position,
        };
        let range = [SAME_PLACE * (1.0 + start.abs().max_element()), distance];
        let skip = |object: usize| (object == place.object).then_some(place.hit.primitive);
        let objects = || self.scene.objects.iter().enumerate();
        if objects().any(|(i, o)| self.opaque[i] && o.blocks(start, to_light, range, skip(i))) {
            return 0.0;
        }
        let mut share = 1.0;
        for (index, object) in objects().filter(|(i, _)| !self.opaque[*i]) {
            let (mut range, mut skip) = (range, skip(index));
            for _ in 0..MAX_SURFACES {
                let Some(hit) = object.intersect(start, to_light, range, skip) else { break };
                // The rays from a point light to the sides of the footprint converge; those from a distant one do not.
                let there = footprint.scaled(if distance.is_finite() { (1.0 - hit.distance / distance).max(0.0) } else { 1.0 });
                share *= 1.0 - self.opacity_at(object, hit, (start, to_light), there);
                range[0] = hit.distance + SAME_PLACE * (1.0 + hit.distance);
                skip = None;
                if share < NOTHING {
                    return 0.0;
                }
            }
        }
        share
    }
}
