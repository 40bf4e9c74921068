//! Which directions are grazing: rays answer for them, and the projection for all others, unless horizon angles answer for all (`choose_method`).
//!
//! At grazing angles an occluder stands many periods away. The projection of one period's triangles then spans as many periods, and each
//! triangle is compared with points all along it; a ray costs more, but only where it goes. What else is decided at grazing angles: after
//! how many periods a ray is given up ([`MAX_PERIODS`](super::MAX_PERIODS)), and from where on a direction is evaluated as if it stood
//! higher ([`MIN_COSINE`](crate::direction::MIN_COSINE)).

use crate::facets::Surface;
use glam::{DVec2, DVec3};

/// Periods that a projection may span: beyond, rays cost less. Chosen, not measured; both answer alike (`agreement_tests`).
const MAX_REACH: f64 = 16.0;

/// Whether visibility in a direction (with `z > 0`) is better told by rays than by a projection.
pub(crate) fn is_grazing(surface: &Surface, direction: DVec3) -> bool {
    reach(surface, direction) > MAX_REACH
}

/// How many periods the projection of the surface spans along a direction: what its height is worth sideways.
fn reach(surface: &Surface, direction: DVec3) -> f64 {
    (DVec2::new(direction.x, direction.y).abs() / direction.z * surface.height / surface.period).max_element()
}
