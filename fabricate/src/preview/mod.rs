//! The surface as paper can take it, and how far its effective BRDF is from the design's.

mod bare_tile;
mod compare;
mod ribbons;
mod rounding;

pub use compare::{Crafted, Preview, preview, preview_strips};
