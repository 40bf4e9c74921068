//! The low-rank method of Wu et al. (2011), as published and with this project's changes.
//!
//! [`map`]: maps of directions and normals. `choices`: what the variants do differently, in this file and nowhere else. [`normals`]: the matrix `N` of the
//! bidirectional visible normal distribution. [`materials`]: the matrix `M` of turned BRDFs, and the product of both. [`rates`]: how fine the maps of `M`
//! must be. [`precomputed`]: a compressed `M`; `cache`: such kept on disk. `run`: facets, visibility, factors. `by_maps`: as published. `by_pairs`: improved.
//! `errors`: how far the values are off. `method` puts them together; the linear algebra is [`crate::numerics::randomized_svd`].

mod by_maps;
mod by_pairs;
mod cache;
mod choices;
mod errors;
pub mod map;
pub mod materials;
mod method;
pub mod normals;
pub mod precomputed;
pub mod rates;
mod run;

pub use cache::CacheEntry;
pub use choices::Normals;
pub(super) use method::low_rank;
