//! Which facets see which directions: one bit a facet and direction.
//!
//! A facet sees a direction when the direction lies above the facet and the ray meets nothing on the periodic surface, up to
//! [`MAX_PERIODS`] periods away: at grazing angles an occluder of height `h` stands up to `h tan(theta)` away. A ray without an answer until then
//! counts as free, and its share is part of the error.
//!
//! | file | what it decides |
//! |---|---|
//! | `choose_method` | which of the three answers: rays at grazing angles, a projection elsewhere, horizon angles where they cost less |
//! | `grazing` | which angles are grazing |
//! | `rays` | rays from cell to cell of the lattice, and after how many periods one is given up |
//! | `repeating` | which cells a ray need not look at, as its path through them repeats |
//! | `raster` | a projection along the direction, for many facets at once |
//! | `horizon` | the horizon angle of a height field in an azimuth, which answers for all elevations |
//! | `bits` | the answers |
//!
//! The horizon itself: a direction closer to it than [`crate::direction::MIN_COSINE`] is evaluated there.

#[cfg(test)]
mod agreement_tests;
mod bits;
mod choose_method;
mod grazing;
mod horizon;
pub mod raster;
mod rays;
mod repeating;

#[cfg(test)]
pub(crate) mod test_tiles;

pub use bits::Bits;
pub(crate) use choose_method::{COSTS, Visibility};
pub(crate) use grazing::is_grazing;
pub use horizon::Horizon;
pub use rays::{Hit, MAX_PERIODS, Occlusion, PeriodicBvh, Traced};
pub(crate) use rays::{MAX_DEPTH, depth};
