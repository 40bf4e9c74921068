//! Large-scale shapes with a closed form: where a ray meets them, and the frame in which the small-scale tile lies there.
//!
//! A frame's columns are the tile's x, y and z in the world. On a sphere and a cylinder x runs around the axis,
//! counter-clockwise seen from its tip, and y towards the tip; z points outward.

use glam::{DMat3, DVec3};

/// Where a ray meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, whose direction has unit length.
    pub distance: f64,
    /// Triangle of a mesh; 0 of other shapes.
    pub primitive: u32,
    /// Weights of the triangle's second and third corner; 0 of other shapes.
    pub barycentric: [f64; 2],
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre.
    pub center: DVec3,
    /// Its radius, over 0.
    pub radius: f64,
    /// Unit vector to the pole around which tile x runs.
    pub axis: DVec3,
}

/// The side of a cylinder, without ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// The middle of its axis.
    pub center: DVec3,
    /// Its radius, over 0.
    pub radius: f64,
    /// Its length, over 0.
    pub height: f64,
    /// Unit vector along the axis.
    pub axis: DVec3,
}

/// A flat rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Its middle.
    pub center: DVec3,
    /// Tile x, y and the outward normal.
    pub frame: DMat3,
    /// Its lengths along x and y, over 0.
    pub size: [f64; 2],
}

/// A unit vector across `axis`; the same for the same axis.
pub fn any_across(axis: DVec3) -> DVec3 {
    axis.cross(if axis.z.abs() < 0.9 { DVec3::Z } else { DVec3::X }).normalize()
}

/// The frame at a place with normal `normal`, x around `axis`; at a pole x is [`any_across`].
pub fn frame_around(axis: DVec3, normal: DVec3) -> DMat3 {
    let x = axis.cross(normal).try_normalize().unwrap_or_else(|| any_across(axis));
    DMat3::from_cols(x, normal.cross(x), normal)
}

/// The roots of `a t² + 2 b t + c`, smaller first.
fn roots(a: f64, b: f64, c: f64) -> Option<[f64; 2]> {
    let discriminant = b * b - a * c;
    if !(discriminant > 0.0 && a > 0.0) {
        return None;
    }
    // The sum without cancellation first (Press et al., section 5.6).
    let q = -(b + discriminant.sqrt().copysign(b));
    if q == 0.0 {
        return None;
    }
    let (s, t) = (q / a, c / q);
    Some([s.min(t), s.max(t)])
}

/// The first of some distances within `range`.
fn first(distances: [f64; 2], range: [f64; 2], accept: impl Fn(f64) -> bool) -> Option<Hit> {
    let inside = |t: &f64| *t > range[0] && *t < range[1] && accept(*t);
    distances.into_iter().find(inside).map(|distance| Hit { distance, primitive: 0, barycentric: [0.0; 2] })
}

impl Sphere {
    /// The first hit of a ray at a distance between the two of `range`.
    pub fn intersect(&self, origin: DVec3, direction: DVec3, range: [f64; 2]) -> Option<Hit> {
        let from = origin - self.center;
        first(roots(1.0, from.dot(direction), from.length_squared() - self.radius * self.radius)?, range, |_| true)
    }

    /// The frame at a place on the surface.
    pub fn frame(&self, place: DVec3) -> DMat3 {
        frame_around(self.axis, ((place - self.center) / self.radius).normalize())
    }

    /// Whether a point lies inside.
    pub fn contains(&self, point: DVec3) -> bool {
        point.distance(self.center) < self.radius
    }
}

impl Cylinder {
    /// The first hit of a ray at a distance between the two of `range`.
    pub fn intersect(&self, origin: DVec3, direction: DVec3, range: [f64; 2]) -> Option<Hit> {
        let from = origin - self.center;
        let (along, step) = (from.dot(self.axis), direction.dot(self.axis));
        let (across, turn) = (from - along * self.axis, direction - step * self.axis);
        let distances = roots(turn.length_squared(), across.dot(turn), across.length_squared() - self.radius * self.radius)?;
        first(distances, range, |t| 2.0 * (along + t * step).abs() <= self.height)
    }

    /// The frame at a place on the surface.
    pub fn frame(&self, place: DVec3) -> DMat3 {
        let from = place - self.center;
        frame_around(self.axis, (from - from.dot(self.axis) * self.axis).normalize())
    }

    /// Whether a point lies between the ends and inside of the side.
    pub fn contains(&self, point: DVec3) -> bool {
        let from = point - self.center;
        let along = from.dot(self.axis);
        2.0 * along.abs() < self.height && (from - along * self.axis).length() < self.radius
    }
}

impl Plane {
    /// The hit of a ray at a distance between the two of `range`.
    pub fn intersect(&self, origin: DVec3, direction: DVec3, range: [f64; 2]) -> Option<Hit> {
        let from = self.frame.transpose() * (origin - self.center);
        let step = self.frame.transpose() * direction;
        let distance = -from.z / step.z;
        let inside = (0..2).all(|c| 2.0 * (from[c] + distance * step[c]).abs() <= self.size[c]);
        // False for a ray along the plane, too, whose distance is infinite or not a number.
        (distance > range[0] && distance < range[1] && inside).then_some(Hit { distance, primitive: 0, barycentric: [0.0; 2] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f64; 2] = [0.0, f64::INFINITY];

    #[test]
    fn a_ray_meets_a_sphere_twice_and_from_inside_once() {
        let sphere = Sphere { center: DVec3::new(1.0, 2.0, 3.0), radius: 2.0, axis: DVec3::Z };
        let origin = sphere.center - 5.0 * DVec3::Y;
        let near = sphere.intersect(origin, DVec3::Y, ALL).unwrap().distance;
        let far = sphere.intersect(origin, DVec3::Y, [near + 1e-9, f64::INFINITY]).unwrap().distance;
        assert!((near - 3.0).abs() < 1e-12 && (far - 7.0).abs() < 1e-12, "{near} and {far}");
        assert_eq!(sphere.intersect(origin, -DVec3::Y, ALL), None);
        assert!((sphere.intersect(sphere.center, DVec3::Z, ALL).unwrap().distance - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_cylinder_ends_where_its_height_ends_and_is_open_there() {
        let cylinder = Cylinder { center: DVec3::ZERO, radius: 1.0, height: 2.0, axis: DVec3::Z };
        let from = |z: f64| DVec3::new(0.0, -5.0, z);
        assert!((cylinder.intersect(from(0.9), DVec3::Y, ALL).unwrap().distance - 4.0).abs() < 1e-12);
        assert_eq!(cylinder.intersect(from(1.1), DVec3::Y, ALL), None);
        assert_eq!(cylinder.intersect(DVec3::new(0.0, 0.0, 5.0), -DVec3::Z, ALL), None, "along the axis, through both ends");
        // Over the rim, onto the far side from within.
        let inward = DVec3::new(0.0, 1.0, -0.3).normalize();
        let hit = cylinder.intersect(from(2.6), inward, ALL).unwrap();
        assert!((from(2.6) + hit.distance * inward).distance(DVec3::new(0.0, 1.0, 0.8)) < 1e-12, "{hit:?}");
    }

    #[test]
    fn the_front_of_an_upright_cylinder_has_x_to_the_right_and_y_up() {
        // shared/photos: "tile x = around (increasing world +x at the front), tile y = world +z, tile z = outward", front -y.
        let cylinder = Cylinder { center: DVec3::ZERO, radius: 1.0, height: 2.0, axis: DVec3::Z };
        let sphere = Sphere { center: DVec3::ZERO, radius: 1.0, axis: DVec3::Z };
        for frame in [cylinder.frame(-DVec3::Y), sphere.frame(-DVec3::Y)] {
            assert_eq!(frame, DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y));
        }
    }

    #[test]
    fn frames_are_right_handed_and_finite_at_the_poles() {
        let sphere = Sphere { center: DVec3::ZERO, radius: 1.0, axis: DVec3::Z };
        for place in [DVec3::Z, -DVec3::Z, DVec3::X, DVec3::new(0.6, 0.0, 0.8)] {
            let frame = sphere.frame(place);
            assert!((frame.determinant() - 1.0).abs() < 1e-12 && frame.z_axis.distance(place) < 1e-12, "{frame:?} at {place}");
        }
    }

    #[test]
    fn a_plane_is_met_inside_its_size_only() {
        let plane = Plane { center: DVec3::ZERO, frame: DMat3::IDENTITY, size: [2.0, 4.0] };
        assert!(plane.intersect(DVec3::new(0.9, 1.9, 3.0), -DVec3::Z, ALL).is_some());
        assert!(plane.intersect(DVec3::new(1.1, 1.9, 3.0), -DVec3::Z, ALL).is_none());
        assert!(plane.intersect(DVec3::new(0.0, 0.0, 3.0), DVec3::X, ALL).is_none());
    }
}
