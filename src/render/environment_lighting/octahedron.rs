//! Directions as places in a square: the octahedron unfolded (Praun and Hoppe 2003; Cigolle et al. 2014, "A survey of efficient representations for
//! independent unit vectors").
//!
//! The whole sphere is the square `-1..1` with the horizon as its inner diamond. The upper hemisphere alone is that diamond, turned by 45 degrees to fill
//! a square of its own. Both maps cost a division and no trigonometry; texels have solid angles that differ by a factor of about 5 (sphere)
//! or 4 (hemisphere), which [`hemisphere_texels`] states exactly.

use glam::{DVec2, DVec3, Vec2, Vec3};

/// Where the unit vector `w` lies in the square of the sphere.
#[inline]
pub fn sphere_place(w: Vec3) -> Vec2 {
    let p = w / (w.x.abs() + w.y.abs() + w.z.abs());
    if p.z >= 0.0 { Vec2::new(p.x, p.y) } else { Vec2::new((1.0 - p.y.abs()).copysign(p.x), (1.0 - p.x.abs()).copysign(p.y)) }
}

/// The unit direction of a place in the square of the sphere; a little outside of it that of the place across the fold.
pub fn sphere_direction(place: DVec2) -> DVec3 {
    let mut p = place;
    if p.x.abs() > 1.0 {
        p = DVec2::new(2.0_f64.copysign(p.x) - p.x, -p.y);
    }
    if p.y.abs() > 1.0 {
        p = DVec2::new(-p.x, 2.0_f64.copysign(p.y) - p.y);
    }
    let z = 1.0 - p.x.abs() - p.y.abs();
    let below = (-z).max(0.0);
    DVec3::new(p.x - below.copysign(p.x), p.y - below.copysign(p.y), z).normalize()
}

/// Where a unit vector with `z >= 0` lies in the square of the upper hemisphere.
#[inline]
pub fn hemisphere_place(w: Vec3) -> Vec2 {
    let p = w.truncate() / (w.x.abs() + w.y.abs() + w.z.max(0.0));
    Vec2::new(p.x + p.y, p.x - p.y)
}

/// The unit direction, with `z >= 0`, of a place in the square of the upper hemisphere.
pub fn hemisphere_direction(place: DVec2) -> DVec3 {
    let (x, y) = (0.5 * (place.x + place.y), 0.5 * (place.x - place.y));
    DVec3::new(x, y, (1.0 - x.abs() - y.abs()).max(0.0)).normalize()
}

/// The middles and solid angles (sr) of `side²` texels of the upper hemisphere, row by row; their solid angles add up to 2 pi.
pub fn hemisphere_texels(side: usize) -> Vec<(DVec3, f64)> {
    let at = |i: f64, j: f64| hemisphere_direction(2.0 * DVec2::new(i, j) / side as f64 - 1.0);
    let texel = |index: usize| {
        let (i, j) = ((index % side) as f64, (index / side) as f64);
        let [a, b, c, d] = [at(i, j), at(i + 1.0, j), at(i + 1.0, j + 1.0), at(i, j + 1.0)];
        (at(i + 0.5, j + 0.5), solid_angle(a, b, c) + solid_angle(a, c, d))
    };
    (0..side * side).map(texel).collect()
}

/// `parts²` directions spread over a texel of the upper hemisphere, in equal parts of its square.
pub fn within_texel(side: usize, texel: usize, parts: usize) -> impl Iterator<Item = DVec3> {
    let corner = DVec2::new((texel % side) as f64, (texel / side) as f64);
    (0..parts * parts).map(move |part| {
        let inside = (DVec2::new((part % parts) as f64, (part / parts) as f64) + 0.5) / parts as f64;
        hemisphere_direction(2.0 * (corner + inside) / side as f64 - 1.0)
    })
}

/// Solid angle of a spherical triangle (Van Oosterom and Strackee 1983).
fn solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn places_and_directions_are_inverse() {
        for i in -20..=20 {
            for j in -20..=20 {
                let place = DVec2::new(f64::from(i), f64::from(j)) / 20.5;
                let w = sphere_direction(place);
                assert!(sphere_place(w.as_vec3()).as_dvec2().distance(place) < 1e-5, "{place} by {w}");
                let w = hemisphere_direction(place);
                assert!(w.z >= 0.0 && hemisphere_place(w.as_vec3()).as_dvec2().distance(place) < 1e-5, "{place} by {w}");
            }
        }
    }

    #[test]
    fn a_place_beyond_the_fold_is_next_to_the_one_inside() {
        for along in [-0.9, -0.3, 0.2, 0.7] {
            for place in [DVec2::new(1.0, along), DVec2::new(-1.0, along), DVec2::new(along, 1.0), DVec2::new(along, -1.0)] {
                let (inside, outside) = (sphere_direction(place * 0.999), sphere_direction(place * DVec2::new(1.001, 1.001)));
                assert!(inside.distance(outside) < 0.01, "{inside} and {outside} at {place}");
            }
        }
    }

    #[test]
    fn texels_of_the_hemisphere_fill_it_and_integrate_the_cosine() {
        let texels = hemisphere_texels(16);
        let sum: f64 = texels.iter().map(|t| t.1).sum();
        assert!((sum - TAU).abs() < 1e-12, "{sum}");
        for (texel, (middle, _)) in texels.iter().enumerate() {
            let mean: DVec3 = within_texel(16, texel, 3).sum();
            // A texel is .1 to .2 rad wide; those at the corners are bent.
            assert!(mean.normalize().distance(*middle) < 0.05, "{mean} and {middle}");
        }
        let cosine: f64 = texels.iter().map(|t| t.0.z * t.1).sum();
        assert!((cosine / (0.5 * TAU) - 1.0).abs() < 3e-3, "{cosine}");
    }
}
