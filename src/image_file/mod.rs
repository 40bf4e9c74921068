//! Reading images: PNG, TIFF, EXR and Radiance, as heights, radiance or colour weights.
//!
//! Files are not trusted: sizes are checked before anything is allocated for them.

mod decode;
mod raster;
mod read;
#[cfg(test)]
mod tests;
mod tint;

pub use raster::{MAX_PIXELS, Raster};
pub use read::{read, read_radiance, read_with_holes};
pub use tint::{TintImage, read_tint};
