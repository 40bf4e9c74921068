//! `kind = "weave"`: cloth of warp and weft threads after any binary draft.
//!
//! Warp threads run along y, weft threads along x. Sections are ellipses, measured upright (width along the cloth, height along z).
//! Centre lines lie at `+a` where a thread is over and `-a` where it is under, flat while it floats, with a cosine between. The
//! amplitudes of warp and weft add up to the `crimp`, the distance of their centre lines where they cross; by default just so much that
//! the threads do not meet along their middle lines. There is no backing: gaps are see-through.

mod cloth;
mod crimp;
mod draft;
mod recipe;
mod sweep;
mod wif;

pub use cloth::{Thread, Weave};
pub use draft::Draft;
pub use recipe::{PARAMS, PARTS};
pub use wif::{Threads as WifThreads, Wif, read as read_wif};
