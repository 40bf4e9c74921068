//! Reading images: PNG, TIFF, EXR and Radiance, as heights, radiance, colour weights, masks or normals.
//!
//! Files are not trusted: sizes are checked before anything is allocated for them.

mod decode;
mod mask;
mod raster;
mod read;
#[cfg(test)]
mod tests;
mod tint;

pub use mask::{MaskChannel, MaskEncoding, PlainImage, read_mask, read_normals};
pub use raster::{MAX_PIXELS, Raster};
pub use read::{read, read_heights, read_radiance, read_with_holes};
pub use tint::{TintImage, read_tint};
