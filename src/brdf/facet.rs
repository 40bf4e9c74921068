//! What all models share: colours, and the half vector of a pair of directions.

use glam::DVec3;

/// Linear RGB.
pub type Colour = [f64; 3];

/// Unit half vector; `n` for directions that are exactly opposite, which lie in the plane of the facet.
pub(super) fn half_vector(n: DVec3, wi: DVec3, wo: DVec3) -> DVec3 {
    (wi + wo).try_normalize().unwrap_or(n)
}
