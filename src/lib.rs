//! Effective BRDFs of bi-scale materials.
//!
//! A surface's look from afar is the average of its small-scale structure: grooves, pyramids, rods, threads, bumps, each with
//! its own BRDF. This crate computes that average. The modules stand in the order in which data flows through them:
//!
//! ```text
//! material file -> geometry -> facets -> visibility -> filter -> effective BRDF -> render
//!                                             brdf ----^
//! ```
//!
//! Notation (one for all papers): a *tile* is one period of the small-scale surface, z up, repeated in x and y, with
//! footprint `A`; `wi` points to the light and `wo` to the viewer; both are unit vectors in the tile's frame.
//!
//! ```text
//! S(wi,wo)    = 1/A ∫ fr(n,wi,wo) (n·wi)+ (n·wo)+ V(wi) V(wo) dA
//! av(wo)      = 1/A ∫ (n·wo)+ V(wo) dA      visible projected area over the footprint
//! fbar(wi,wo) = S / av(wo)                  cosine-weighted effective BRDF (Wu et al. 2011, eq. 7)
//! fhat(wi,wo) = fbar / cos(theta_i)         its BRDF, 1/sr
//! ```

pub mod brdf;
pub mod bvndf;
pub mod clusters;
pub mod direction;
pub mod error;
pub mod facets;
pub mod filter;
pub mod formats;
pub mod geometry;
pub mod image_file;
pub mod material;
pub mod numerics;
pub mod render;
mod simd;
pub mod study;
pub mod table;
pub mod toml_reader;
pub mod visibility;

pub use error::{BadInput, Error, Result};
