//! The decoders, one a format: bytes in, a [`Raster`](super::Raster) out.

mod common;
mod exr;
mod packed_tiff;
mod png;
mod radiance;
mod tiff;

pub(super) use exr::{Wanted, exr};
pub(super) use png::png;
pub(super) use radiance::{hdr, hdr_exposure};
pub(super) use tiff::tiff;
