//! Which facets see which directions: one bit a facet and direction.
//!
//! A facet sees a direction when the direction lies above the facet and the ray meets nothing on the periodic surface, however
//! many periods away.

#[cfg(test)]
mod agreement_tests;
mod bits;
mod horizon;
pub mod raster;
mod rays;

#[cfg(test)]
pub(crate) mod test_tiles;

pub use bits::Bits;
pub use horizon::Horizon;
pub use rays::{Hit, MAX_PERIODS, Occlusion, PeriodicBvh, Traced};
pub(crate) use rays::{MAX_DEPTH, depth};
