//! Effective BRDFs of bi-scale materials.
//!
//! A surface's look from afar is the average of its small-scale structure: grooves, pyramids, rods, threads, bumps, each with
//! its own BRDF. This crate computes that average, with its error, and renders pictures with it.
//!
//! ```
//! use biscale::{Control, Material, Pair, Quality, effective};
//! use glam::DVec3;
//!
//! # let text = include_str!("../samples/pyramids.toml").to_owned();
//! // `Material::load("pyramids.toml")` reads a file.
//! let material = Material::parse(&biscale::toml_reader::Source { path: "pyramids.toml".into(), text })?;
//! let surface = material.build()?;
//! let pair = Pair { wi: DVec3::new(0.6, 0.0, 0.8), wo: DVec3::Z };
//! let quality = Quality { tolerance: 0.1, ..Quality::default() };
//! let result = effective(&surface, &[pair], &quality, &Control::quiet())?;
//! let value = &result.values[0];
//! // 1/sr, by channel, within the tolerance; the metal is a little yellow.
//! assert!(value.fbar[0] > value.fbar[2] && value.fbar[2] > 0.0);
//! assert!(result.summary.relative_rms <= 0.1);
//! # Ok::<(), biscale::Error>(())
//! ```
//!
//! # Conventions
//!
//! **Frame.** A *tile* is one period of the small-scale surface, z up, repeated in x and y, with footprint `A`. `wi` points to the light
//! and `wo` to the viewer; both are unit vectors in the tile's frame. `n` is a facet's unit normal, on its outer side. Angles of
//! incidence and reflection are measured from z; an azimuth of 0 is +x, of 90 degrees +y. At the large scale z is up, too, and
//! cameras and lights are given in that world ([`render`]).
//!
//! **Units.** Angles are radians inside, degrees in files (keys that end in `_deg`). Lengths of a material are in its file's `unit`;
//! only their ratios matter to the effective BRDF. BRDFs are in 1/sr, colours are linear RGB with Rec. 709 primaries.
//!
//! **Numbers.** `f64` for geometry and sums, `f32` in hot loops where a test shows what it costs. Every value comes with its standard
//! error. The same input and seed give the same bits at any number of threads.
//!
//! # Notation
//!
//! One for all papers, as `docs/formats.md` has it; `V` is 1 where a direction is visible from a point of the surface, else 0:
//!
//! ```text
//! S(wi,wo)    = 1/A ∫ fr(n,wi,wo) (n·wi)+ (n·wo)+ V(wi) V(wo) dA
//! av(wo)      = 1/A ∫ (n·wo)+ V(wo) dA
//! fbar(wi,wo) = S / av(wo)                cosine-weighted effective BRDF (Wu et al. 2011, eq. 7)
//! fhat(wi,wo) = fbar / cos(theta_i)       its BRDF, 1/sr
//! ```
//!
//! # Rooms
//!
//! In the order of the flow; earlier ones never import later ones:
//!
//! ```text
//! error, bounded_file, text_file, file_signature, toml_reader, numerics, direction, image_file, brdf, geometry, material, formats,
//! facets, visibility, transport, bvndf, sg, filter, table, render, study
//!
//! material file -> geometry -> facets -> visibility -> filter -> table | render | study
//!                                             brdf ----^
//! ```
//!
//! `examples/` has a program for each of the usual tasks: `evaluate`, `bake`, `render`, `custom_brdf_study` (where a new BRDF goes), and
//! `fabricate/examples/fold`.

mod bvndf;
mod clusters;
mod facets;
mod simd;

pub mod bounded_file;
pub mod brdf;
pub mod btf;
pub mod direction;
pub mod error;
pub mod file_signature;
pub mod filter;
pub mod formats;
pub mod geometry;
pub mod image_file;
pub mod material;
pub mod numerics;
pub mod render;
pub mod sg;
pub mod study;
pub mod table;
pub mod text_file;
pub mod toml_reader;
pub mod transport;
pub mod visibility;

pub use brdf::Brdf;
pub use direction::Pair;
pub use error::{BadInput, Error, Result};
pub use filter::{Control, Effective, Method, Plan, Quality, Summary, Value, effective};
pub use geometry::Tile;
pub use material::{Material, SmallScale, Surface, Tint};
pub use render::Scene;
pub use table::{EffectiveTable, bake};
