//! The sample's shape: where a ray meets it, and its own two coordinates.

use crate::lens::Pose;
use crate::shoot::Shape;
use glam::{DVec2, DVec3};

/// A place on the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// In the sample's frame, mm.
    pub point: DVec3,
    /// Outward normal.
    pub normal: DVec3,
    /// From the lower left corner: across or around, and along, mm.
    pub st: DVec2,
}

impl Shape {
    /// Lengths across (or around) and along, mm.
    pub fn extent(&self) -> DVec2 {
        match *self {
            Self::Plane(size) => size,
            Self::Cylinder { radius, height, arc_deg: [a, b] } => DVec2::new(radius * (b - a).to_radians(), height),
        }
    }

    /// The place with these coordinates, `height` over the surface.
    pub fn at(&self, st: DVec2, over: f64) -> SurfacePoint {
        match *self {
            Self::Plane(size) => SurfacePoint { point: (st - 0.5 * size).extend(over), normal: DVec3::Z, st },
            Self::Cylinder { radius, height, arc_deg } => {
                let (sin, cos) = (arc_deg[0].to_radians() + st.x / radius).sin_cos();
                let normal = DVec3::new(cos, sin, 0.0);
                SurfacePoint { point: (radius + over) * normal + DVec3::Z * (st.y - 0.5 * height), normal, st }
            }
        }
    }

    /// Where a ray from `eye` along `direction` meets the sample's front, if it does inside of its borders.
    pub fn hit(&self, eye: DVec3, direction: DVec3) -> Option<SurfacePoint> {
        let place = match *self {
            Self::Plane(size) => {
                let t = -eye.z / direction.z;
                if !(eye.z > 0.0 && t > 0.0 && t.is_finite()) {
                    return None;
                }
                let point = eye + t * direction;
                SurfacePoint { point, normal: DVec3::Z, st: point.truncate() + 0.5 * size }
            }
            Self::Cylinder { radius, height, arc_deg } => {
                let (o, d) = (eye.truncate(), direction.truncate());
                let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - radius * radius);
                let root = b * b - a * c;
                if !(root > 0.0 && c > 0.0) {
                    return None;
                }
                // The nearer one, written so that nothing cancels for a far eye.
                let t = c / (root.sqrt() - b);
                if !(t > 0.0) {
                    return None;
                }
                let point = eye + t * direction;
                let normal = (point.truncate() / radius).extend(0.0);
                let turn = (point.y.atan2(point.x) - arc_deg[0].to_radians()).rem_euclid(std::f64::consts::TAU);
                SurfacePoint { point, normal, st: DVec2::new(radius * turn, point.z + 0.5 * height) }
            }
        };
        let extent = self.extent();
        (place.st.cmpge(DVec2::ZERO).all() && place.st.cmple(extent).all()).then_some(place)
    }

    /// The coordinates of the place that the camera looks at most directly among those it sees, and the size of a pixel of unit focal length there: the
    /// distance, mm.
    pub fn nearest(&self, pose: &Pose) -> Option<SurfacePoint> {
        let eye = pose.eye();
        let along = pose.rotation.transpose() * DVec3::Z;
        self.hit(eye, along)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_find_the_places_that_they_were_sent_to() {
        let plane = Shape::Plane(DVec2::new(80.0, 60.0));
        let cylinder = Shape::Cylinder { radius: 15.0, height: 100.0, arc_deg: [-30.0, 200.0] };
        for (shape, eye, st) in [
            (plane, DVec3::new(100.0, -200.0, 300.0), DVec2::new(10.0, 55.0)),
            (cylinder, DVec3::new(200.0, 50.0, 20.0), DVec2::new(5.0, 20.0)),
            (cylinder, DVec3::new(10.0, 300.0, -20.0), DVec2::new(25.0, 99.0)),
        ] {
            let place = shape.at(st, 0.0);
            let hit = shape.hit(eye, (place.point - eye).normalize()).unwrap();
            assert!(
                hit.st.distance(st) < 1e-9 && hit.point.distance(place.point) < 1e-9 && hit.normal.distance(place.normal) < 1e-9,
                "{hit:?}"
            );
        }
        // Beside, behind and from inside.
        assert!(plane.hit(DVec3::new(0.0, 0.0, 9.0), DVec3::new(9.0, 0.0, -1.0).normalize()).is_none());
        assert!(plane.hit(DVec3::new(0.0, 0.0, -9.0), DVec3::Z).is_none() && plane.hit(DVec3::Z, DVec3::X).is_none());
        assert!(cylinder.hit(DVec3::ZERO, DVec3::X).is_none() && cylinder.hit(DVec3::new(0.0, -99.0, 0.0), DVec3::Y).is_none());
        // The bare sheet is at +x where period 0 begins, and goes round counter-clockwise.
        assert!(cylinder.at(DVec2::new(15.0 * 30.0_f64.to_radians(), 50.0), 0.5).point.distance(DVec3::new(15.5, 0.0, 0.0)) < 1e-12);
    }
}
