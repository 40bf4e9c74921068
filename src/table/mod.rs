//! The whole effective BRDF as a table: evaluate, interpolate, store.
//!
//! `S(wi,wo)` and `av(wo)` stand on the nodes of a hemisphere grid ([`HemisphereGrid`]); between them the weights of the two directions
//! multiply, and a [`Guide`] keeps lobes sharp that are narrower than the grid:
//!
//! ```text
//! S(wi,wo) = G(h) sum_jk b_j(wi) b_k(wo) S_jk / G(h_jk),      av(wo) = sum_k b_k(wo) av_k
//! ```
//!
//! All weights and `G` are not negative, so neither is `S`; it is exactly symmetric where the table is. `bake` makes
//! tables, `file` stores them, `forecast` says what one will cost, and `kept_blocks` keeps what an interrupted bake has made.

mod bake;
mod effective_table;
mod file;
mod forecast;
mod grid;
mod guide;
mod kept_blocks;

pub use bake::{BakeAids, BakeRecipe, FIRST_RINGS, MIN_RINGS, ValuesOfPairs, bake, bake_with, build};
pub use effective_table::{EffectiveTable, MAX_VALUES, TableError, TableOrigin, max_rings, value_count};
pub use file::{FORMAT, VERSION, is_effective_brdf, is_openexr};
pub use forecast::BakeForecast;
pub use grid::{GridWeights, HemisphereGrid, lattice_weights, node_count, nodes};
pub use guide::{Guide, GuideLobes, MAX_GUIDE_RINGS};
pub use kept_blocks::KeptBlocks;
