//! Normal maps: images that turn the normals of an object, in its tangent space.
//!
//! Red, green and blue are x along u, y along v and z outward, each `2 value - 1` ("OpenGL"; where green is down, it must be inverted).
//! Only the frame turns in which the materials are evaluated: outlines and shadows stay those of the shape.
//!
//! A map is filtered as any image, and the mean normal is made a unit vector: that normals which a sample cannot tell apart make a
//! material rougher (Toksvig 2005) is not modelled; the samples of a pixel see them one by one.

use super::mapping::ImagePlace;
use super::texture::Texture;
use glam::DMat3;

/// Normals over the texture coordinates of an object.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// Vectors with z over 0, x along u, y along v.
    pub image: Texture<3>,
    /// Factor of x and y: 0 leaves all as it is, 1 takes the map as it stands.
    pub strength: f64,
}

impl NormalMap {
    /// The frame whose normal is turned as the map says at a place. `frame` is that of the tile there, seen from the outside if `front`;
    /// tile x stays as near to where it was as a frame allows. A triangle whose texture coordinates have no area keeps its normal.
    pub fn turned(&self, place: &ImagePlace<'_>, frame: DMat3, front: bool) -> DMat3 {
        let Some(chart) = place.shape.chart(place.hit, place.position) else { return frame };
        let [x, y, z] = self.image.mean(chart.uv, chart.footprint(place.footprint));
        // What stands out seen from outside is a hollow from within.
        let side = if front { self.strength } else { -self.strength };
        let [to_u, to_v] = chart.gradients;
        let normal = frame.z_axis;
        // Where u grows and v does not, and the direction across on the side where v grows.
        let along = to_v.cross(normal);
        let along = along * to_u.dot(along).signum();
        let Some(along) = along.try_normalize() else { return frame };
        let across = normal.cross(along);
        let across = across * to_v.dot(across).signum();
        let Some(z) = (side * (x * along + y * across) + z * normal).try_normalize() else { return frame };
        let x = (frame.x_axis - frame.x_axis.dot(z) * z).try_normalize().unwrap_or_else(|| super::shapes::any_across(z));
        DMat3::from_cols(x, z.cross(x), z)
    }
}

#[cfg(test)]
mod tests {
    use super::super::mapping::Footprint;
    use super::super::scene::Shape;
    use super::super::shapes::{Hit, Plane, Sphere};
    use super::super::texture::Wrap;
    use super::*;
    use glam::DVec3;

    /// A map of one normal.
    fn map(normal: [f32; 3]) -> NormalMap {
        NormalMap { image: Texture::new(1, 1, vec![normal], Wrap::Repeat), strength: 1.0 }
    }

    fn place(shape: &Shape, position: DVec3, outward: DVec3) -> ImagePlace<'_> {
        const HIT: Hit = Hit { distance: 1.0, primitive: 0, barycentric: [0.0; 2] };
        ImagePlace { shape, hit: &HIT, position, outward, footprint: Footprint::POINT }
    }

    #[test]
    fn red_is_along_u_and_green_along_v_on_a_plane_and_in_front_of_a_ball() {
        let plane = Shape::Plane(Plane { center: DVec3::ZERO, frame: DMat3::IDENTITY, size: [2.0, 2.0] });
        let ball = Shape::Sphere(Sphere { center: DVec3::ZERO, radius: 1.0, axis: DVec3::Z });
        let front = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
        for (shape, position, frame) in [(&plane, DVec3::new(0.1, 0.2, 0.0), DMat3::IDENTITY), (&ball, -DVec3::Y, front)] {
            let at = place(shape, position, frame.z_axis);
            for (normal, expected) in [
                ([0.0, 0.0, 1.0], frame.z_axis),
                ([0.6, 0.0, 0.8], 0.6 * frame.x_axis + 0.8 * frame.z_axis),
                ([0.0, 0.6, 0.8], 0.6 * frame.y_axis + 0.8 * frame.z_axis),
            ] {
                let turned = map(normal).turned(&at, frame, true);
                assert!(turned.z_axis.distance(expected) < 1e-7, "{} and not {expected}", turned.z_axis);
                assert!((turned.determinant() - 1.0).abs() < 1e-12 && turned.x_axis.dot(turned.z_axis).abs() < 1e-12, "{turned}");
            }
        }
    }

    #[test]
    fn seen_from_behind_a_slope_is_the_same_slope() {
        let plane = Shape::Plane(Plane { center: DVec3::ZERO, frame: DMat3::IDENTITY, size: [2.0, 2.0] });
        let at = place(&plane, DVec3::ZERO, DVec3::Z);
        let back = DMat3::from_cols(-DVec3::X, DVec3::Y, -DVec3::Z);
        let map = map([0.6, 0.3, 0.8]);
        let (outer, inner) = (map.turned(&at, DMat3::IDENTITY, true).z_axis, map.turned(&at, back, false).z_axis);
        assert!(outer.distance(-inner) < 1e-12, "{outer} and {inner}");
    }

    #[test]
    fn strength_scales_the_slope() {
        let plane = Shape::Plane(Plane { center: DVec3::ZERO, frame: DMat3::IDENTITY, size: [2.0, 2.0] });
        let at = place(&plane, DVec3::ZERO, DVec3::Z);
        let slope = |strength: f64| {
            let z = NormalMap { strength, ..map([0.6, 0.0, 0.8]) }.turned(&at, DMat3::IDENTITY, true).z_axis;
            z.x / z.z
        };
        assert!(slope(0.0) == 0.0 && (slope(1.0) - 0.75).abs() < 1e-7 && (slope(2.0) - 1.5).abs() < 1e-7);
    }
}
