//! Measured BRDFs: MERL tables, RGL tables, and the built-in neural fits of MERL materials.
//!
//! They are used as they are: neither made reciprocal nor limited in energy ([`crate::brdf::Brdf::warnings`] says by how much
//! they fail). Each lookup is written once, generic over the precision: [`Measured::eval`] is the `f64` reference,
//! [`Measured::eval_lanes`] the same in `f32` for many normals at once, for hot loops. Neither allocates.

mod adaptive;
mod half_angle;
mod model;
mod network;
mod real;
mod table;

pub(super) use model::MODEL;
pub use network::fit_names;
pub use table::{MIN_FACET_COSINE, Measured};
