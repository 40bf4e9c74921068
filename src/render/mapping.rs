//! Where a place of an object lies on an image, and how large a sample is there.

use super::mesh::LargeMesh;
use super::scene::{Camera, Shape};
use super::shapes::{Cylinder, Hit, Plane, Sphere};
use glam::{DAffine3, DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Width of the filter of an image, of the distance between the samples of a pixel.
///
/// Measured by `cargo test -p biscale --lib pixels_at_the_edge -- --nocapture` with this number changed: of 1, .7, .5 and .35 the one with the smallest error at the edges of masks at 16 samples a pixel, 1.8 % RMS of the contrast (1: 2.0 %,
/// .5: 2.1 %, .35: 2.5 %).
const FILTER_WIDTH: f64 = 0.7;

/// How far a place moves when a ray moves by a sample's width across and down the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint(pub [DVec3; 2]);

impl Footprint {
    /// No width at all.
    pub const POINT: Self = Self([DVec3::ZERO; 2]);

    /// That of a camera's ray at a distance, across the ray: the samples of a pixel share its area (Igehy 1999).
    pub fn of_ray(camera: &Camera, x: f64, y: f64, distance: f64) -> Self {
        let scale = FILTER_WIDTH * distance / f64::from(camera.samples).sqrt();
        Self(camera.differentials(x, y).map(|d| scale * d))
    }

    /// What the footprint, moved along a ray of this direction, covers of a plane with this normal; infinite on a plane along the ray.
    #[must_use]
    pub fn onto(self, direction: DVec3, normal: DVec3) -> Self {
        let along = direction.dot(normal);
        Self(self.0.map(|d| d - direction * (d.dot(normal) / along)))
    }

    /// The footprint, larger or smaller.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self(self.0.map(|d| factor * d))
    }
}

/// Coordinates of an image at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chart {
    /// The coordinates; an image lies in the unit square, v upward.
    pub uv: DVec2,
    /// How u and v change with the place.
    pub gradients: [DVec3; 2],
}

impl Chart {
    /// A footprint in these coordinates.
    pub fn footprint(&self, footprint: Footprint) -> [DVec2; 2] {
        footprint.0.map(|d| DVec2::new(self.gradients[0].dot(d), self.gradients[1].dot(d)))
    }
}

/// A place of an object, as images see it.
#[derive(Clone, Copy, Debug)]
pub struct ImagePlace<'a> {
    /// The object's shape.
    pub shape: &'a Shape,
    /// Where on it.
    pub hit: &'a Hit,
    /// Where in the world.
    pub position: DVec3,
    /// The object's outward normal there.
    pub outward: DVec3,
    /// The width of a sample there.
    pub footprint: Footprint,
}

/// How an image lies on an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// By the object's texture coordinates.
    Uv,
    /// Along a direction, as a slide is projected, onto what faces it.
    Planar(Plane),
}

impl Projection {
    /// Where a place lies on the image; `None` where it does not face the projection.
    pub fn chart(&self, place: &ImagePlace<'_>) -> Option<Chart> {
        let ImagePlace { shape, hit, position, outward, .. } = *place;
        let Self::Planar(slide) = self else { return shape.chart(hit, position) };
        let to_object = shape.to_own_space();
        let facing = (to_object.matrix3 * outward).dot(slide.frame.z_axis) > 0.0;
        facing.then(|| {
            let Chart { uv, gradients } = slide.chart(to_object.transform_point3(position));
            // A gradient in the object's space is brought to the world's by the transpose of the way there.
            Chart { uv, gradients: gradients.map(|g| to_object.matrix3.transpose() * g) }
        })
    }
}

impl Shape {
    /// From the world to the object's own lengths: those of its file for a mesh, those from its centre for other shapes.
    pub fn to_own_space(&self) -> DAffine3 {
        match self {
            Self::Sphere(Sphere { center, .. }) | Self::Cylinder(Cylinder { center, .. }) | Self::Plane(Plane { center, .. }) => {
                DAffine3::from_translation(-*center)
            }
            Self::Mesh(mesh) => mesh.to_file,
        }
    }

    /// The texture coordinates at a place; `None` on a mesh that has none.
    pub fn chart(&self, hit: &Hit, position: DVec3) -> Option<Chart> {
        match self {
            Self::Sphere(sphere) => Some(sphere.chart(position)),
            Self::Cylinder(cylinder) => Some(cylinder.chart(position)),
            Self::Plane(plane) => Some(plane.chart(position)),
            Self::Mesh(mesh) => mesh.chart(hit),
        }
    }
}

/// Unit vector across `axis` to the side where u is 1/2: -y of the world as far as possible; -z where the axis runs along y.
fn front(axis: DVec3) -> DVec3 {
    let to = if axis.y.abs() < 0.9 { -DVec3::Y } else { -DVec3::Z };
    (to - to.dot(axis) * axis).normalize()
}

/// u around an axis: 1/2 in front, growing counter-clockwise seen from its tip; with its gradient. `across` is the vector from the axis.
fn around(axis: DVec3, across: DVec3) -> (f64, DVec3) {
    let front = front(axis);
    let u = 0.5 + across.dot(axis.cross(front)).atan2(across.dot(front)) / TAU;
    (u, axis.cross(across) / (TAU * across.length_squared()))
}

impl Sphere {
    /// Longitude and latitude as u and v: v is 1 at the tip of the axis.
    fn chart(&self, position: DVec3) -> Chart {
        let from = position - self.center;
        let along = from.dot(self.axis);
        let across = from - along * self.axis;
        let (u, gradient) = around(self.axis, across);
        let v = 0.5 + along.atan2(across.length()) / PI;
        // Upward along the meridian; its length is that of v over half the circumference.
        let upward = (self.axis * from.length_squared() - from * along).normalize_or_zero();
        Chart { uv: DVec2::new(u, v), gradients: [gradient, upward / (PI * self.radius)] }
    }
}

impl Cylinder {
    /// The angle as u; v is 0 at the lower end of the axis and 1 at its upper end.
    fn chart(&self, position: DVec3) -> Chart {
        let from = position - self.center;
        let along = from.dot(self.axis);
        let (u, gradient) = around(self.axis, from - along * self.axis);
        Chart { uv: DVec2::new(u, 0.5 + along / self.height), gradients: [gradient, self.axis / self.height] }
    }
}

impl Plane {
    /// u along x and v along y, 0 to 1 over the size.
    fn chart(&self, position: DVec3) -> Chart {
        let gradients = [self.frame.x_axis / self.size[0], self.frame.y_axis / self.size[1]];
        let from = position - self.center;
        Chart { uv: DVec2::new(0.5 + gradients[0].dot(from), 0.5 + gradients[1].dot(from)), gradients }
    }
}

impl LargeMesh {
    /// The texture coordinates at a hit; `None` where the mesh has none.
    fn chart(&self, hit: &Hit) -> Option<Chart> {
        let [a, b, c] = self.uv.as_ref()?[hit.primitive as usize];
        let [p, q, r] = self.corners(hit.primitive);
        let [s, t] = hit.barycentric;
        let (first, second) = (b - a, c - a);
        let (pq, pr) = (q - p, r - p);
        let normal = pq.cross(pr);
        // The basis reciprocal to the two edges.
        let (along, across) = (pr.cross(normal) / normal.length_squared(), normal.cross(pq) / normal.length_squared());
        let gradients = [along * first.x + across * second.x, along * first.y + across * second.y];
        Some(Chart { uv: a + s * first + t * second, gradients })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// Largest difference of the gradients from differences of uv along the surface.
    fn off(chart: &dyn Fn(DVec3) -> Chart, place: DVec3, normal: DVec3) -> f64 {
        let h = 1e-6;
        let (x, y) = normal.any_orthonormal_pair();
        let here = chart(place);
        [x, y]
            .iter()
            .flat_map(|&d| {
                let slope = (chart(place + h * d).uv - chart(place - h * d).uv) / (2.0 * h);
                (0..2).map(move |c| (slope[c] - here.gradients[c].dot(d)).abs())
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn gradients_are_the_slopes_of_uv_on_every_shape() {
        let center = DVec3::new(1.0, -2.0, 0.5);
        for axis in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::Y, -DVec3::X] {
            let sphere = Sphere { center, radius: 2.0, axis };
            let cylinder = Cylinder { center, radius: 2.0, height: 3.0, axis };
            for k in 0..40 {
                let turn = f64::from(k) * 2.399_963;
                let height = f64::from(k) / 20.5 - 0.96;
                let (x, y) = axis.any_orthonormal_pair();
                let flat = turn.cos() * x + turn.sin() * y;
                let normal = (1.0 - height * height).sqrt() * flat + height * axis;
                let on_sphere = off(&|p| sphere.chart(p), center + 2.0 * normal, normal);
                let on_cylinder = off(&|p| cylinder.chart(p), center + 2.0 * flat + height * axis, flat);
                // The seam of u, where differences jump, lies behind.
                if (sphere.chart(center + 2.0 * normal).uv.x - 0.5).abs() < 0.49 {
                    assert!(on_sphere < 1e-6 && on_cylinder < 1e-6, "{on_sphere} and {on_cylinder} at {normal} around {axis}");
                }
            }
        }
    }

    #[test]
    fn the_front_of_an_upright_ball_has_u_one_half_growing_to_the_right_and_v_upward() {
        let sphere = Sphere { center: DVec3::ZERO, radius: 1.0, axis: DVec3::Z };
        let Chart { uv, gradients } = sphere.chart(-DVec3::Y);
        assert!(uv.distance(DVec2::splat(0.5)) < 1e-12, "{uv}");
        assert!(gradients[0].distance(DVec3::X / TAU) < 1e-12 && gradients[1].distance(DVec3::Z / PI) < 1e-12, "{gradients:?}");
        assert!((sphere.chart(DVec3::Z).uv.y - 1.0).abs() < 1e-12);
        assert!((sphere.chart(DVec3::X).uv.x - 0.75).abs() < 1e-12);
    }

    #[test]
    fn a_footprint_is_that_of_two_neighbouring_rays() {
        use crate::toml_reader::{Source, TableReader};
        let text = "origin = [1, -5, 2]\ntarget = [0, 0, 0]\nfov_deg = 40\nwidth = 100\nheight = 60\nsamples = 1\n";
        let source = Source { path: "c.toml".into(), text: text.to_owned() };
        let root = source.parse().unwrap();
        let camera = Camera::read(TableReader::new(&source, "", root.get_ref(), 0)).unwrap();
        let plane = Plane { center: DVec3::ZERO, frame: DMat3::IDENTITY, size: [9.0, 9.0] };
        let meet = |x: f64, y: f64| {
            let d = camera.direction(x, y);
            (d, plane.intersect(camera.origin, d, [0.0, f64::INFINITY]).unwrap().distance)
        };
        let at = |x: f64, y: f64| camera.origin + meet(x, y).1 * meet(x, y).0;
        for (x, y) in [(50.0, 30.0), (20.5, 41.25)] {
            let (direction, distance) = meet(x, y);
            let Footprint([across, down]) = Footprint::of_ray(&camera, x, y, distance).scaled(1.0 / FILTER_WIDTH).onto(direction, DVec3::Z);
            let h = 1e-4;
            let expected = [(at(x + h, y) - at(x - h, y)) / (2.0 * h), (at(x, y + h) - at(x, y - h)) / (2.0 * h)];
            assert!(across.distance(expected[0]) < 1e-6 && down.distance(expected[1]) < 1e-6, "{across}, {down}, {expected:?}");
        }
    }
}
