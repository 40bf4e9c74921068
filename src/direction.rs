//! Directions of the upper hemisphere and pairs of them.

use glam::DVec3;

/// Smallest cosine with z that is evaluated.
///
/// At exactly 90 degrees a periodic surface has no limit that rays could reach: a direction with `0 <= z <` this is evaluated
/// at this height in its own azimuth (`numerics.md`, section 6).
pub const MIN_COSINE: f64 = 1e-4;

/// A direction to the light and one to the viewer, unit vectors in the tile's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// To the light.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
}

/// `w` itself, lifted to [`MIN_COSINE`] in its azimuth where it grazes the surface, or `None` below the horizon.
pub fn above_horizon(w: DVec3) -> Option<DVec3> {
    if w.z < 0.0 || !w.is_finite() {
        None
    } else if w.z < MIN_COSINE {
        let flat = DVec3::new(w.x, w.y, 0.0).try_normalize()? * (1.0 - MIN_COSINE * MIN_COSINE).sqrt();
        Some(flat.with_z(MIN_COSINE))
    } else {
        Some(w)
    }
}
