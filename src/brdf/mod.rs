//! Small-scale BRDFs: how one facet reflects.
//!
//! All are isotropic and one-sided: 0 when the light or the viewer is not above the facet. They come in the exact form of
//! `docs/brdf.md`. The set is closed, so it is an enum: hot loops match once, outside.
//!
//! A new model is
//! 1. a file beside `ward.rs` with its formula and its keys, and a line in [`MODELS`] (`read.rs`: reading and setting its keys),
//! 2. a variant of [`Brdf`] (`models.rs`: `eval`),
//! 3. the lobe that importance sampling draws from (`sampling.rs`),
//! 4. its `f32` kernel (`src/filter/lobes.rs`, compared with `eval` by the tests there), its width (`Brdf::roughness`) and its basis
//!    colours (`src/filter/common_random_numbers.rs`).
//!
//! The compiler names every `match` that lacks the variant; `tests.rs` has a list of models by which all of them are tested, and `docs/brdf.md` is
//! compared with [`markdown`]. `examples/custom_brdf_study.rs` compares a BRDF in a groove with closed forms.

mod blinn_phong;
mod check;
mod cook_torrance;
mod facet;
mod lambert;
mod measured;
mod microfacet;
mod models;
pub mod params;
mod read;
mod sampling;
#[cfg(test)]
mod tests;
mod ward;

pub use check::{PeakAlbedo, Reciprocity};
pub use facet::Colour;
pub use measured::{MIN_FACET_COSINE, Measured, fit_names};
pub use microfacet::Distribution;
pub use models::Brdf;
pub use params::{ALPHA, EXPONENT};
pub use read::{MODELS, markdown};

pub use crate::simd::{LANES, Lanes};
