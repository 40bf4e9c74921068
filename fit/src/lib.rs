//! From photographs to a bi-scale material (Wu, Dorsey and Rushmeier 2011, section 5 and Fig. 10, by a program).
//!
//! ```text
//! fit file ─> spec ─> photograph ─> bins ──────────────────┐
//!                  └> parameters ─> material ─> model ──────┴─> objective <─> search ─> identify, profile
//!                                   close_up ───────────────────┘                  └─> validate
//! ```
//!
//! A photograph of a homogeneous object is a table of the effective BRDF at the pairs of directions that its pixels show. Pixels with
//! nearly the same directions are one [`DirectionBin`](photograph::direction_bins::DirectionBin). For a guess of the parameters the model computes the effective BRDF at the bins only,
//! in shares of the unknown colours; these enter linearly and are solved for, so that the search moves geometry, roughness and light alone.

#![cfg_attr(test, allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic"))]

pub mod bounded_least_squares;
pub mod fit_file;
pub mod parallel;
pub mod photograph;
pub mod residuals;
pub mod run;
pub mod search;
pub mod uncertainty;
pub mod verdict;
