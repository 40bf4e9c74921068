//! The decoders, one a format: bytes in, a [`Raster`] out.

mod exr;
mod tiff;

pub(super) use exr::{Wanted, exr};
pub(super) use tiff::tiff;

use super::raster::{Raster, check_size};
use crate::error::BadInput;
use rayon::prelude::*;
use std::io::Cursor;

/// Most bytes that decoding may take.
const MAX_BYTES: u64 = 1 << 30;

pub(super) fn hdr(bytes: &[u8]) -> Result<Raster, BadInput> {
    // Some programs sign with "#?RGBE"; what follows is the same.
    let signed: Vec<u8>;
    let bytes = match bytes.strip_prefix(b"#?RGBE") {
        Some(rest) => {
            signed = [b"#?RADIANCE", rest].concat();
            &signed
        }
        None => bytes,
    };
    let with = || {
        let mut reader = image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Hdr);
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(MAX_BYTES);
        reader.limits(limits);
        reader
    };
    let (width, height) = with().into_dimensions().map_err(|e| unreadable("Radiance", e))?;
    check_size(width.into(), height.into())?;
    let decoded = with().decode().map_err(|e| unreadable("Radiance", e))?.into_rgb32f();
    let (channels, alpha) = deinterleave(decoded.as_raw(), 3, |v| v);
    Ok(Raster { width: width as usize, height: height as usize, channels, alpha, integer: false })
}

fn unreadable(kind: &str, why: impl std::fmt::Display) -> BadInput {
    BadInput::new(format!("not a readable {kind} image: {why}"), "write the image again")
}

/// Splits interleaved samples of a kind into channels of floats and alpha, the last of two or four.
fn deinterleave<T: Copy + Sync>(samples: &[T], stride: usize, value: impl Fn(T) -> f32 + Sync) -> Channels {
    let channel = |c: usize| samples.par_chunks_exact(stride).map(|pixel| value(pixel[c])).collect();
    let alpha = matches!(stride, 2 | 4).then(|| channel(stride - 1));
    ((0..if stride >= 3 { 3 } else { 1 }).map(channel).collect(), alpha)
}

/// One or three channels, and alpha.
type Channels = (Vec<Vec<f32>>, Option<Vec<f32>>);

/// Whole numbers of 8 and of 16 bits, of 1.
fn byte(v: u8) -> f32 {
    f32::from(v) / 255.0
}

fn word(v: u16) -> f32 {
    f32::from(v) / 65535.0
}

pub(super) fn png(bytes: &[u8]) -> Result<Raster, BadInput> {
    use image::DynamicImage as Image;
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let size = image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png).into_dimensions();
    let (width, height) = size.map_err(|e| unreadable("PNG", e))?;
    check_size(width.into(), height.into())?;
    let decoded = reader.decode().map_err(|e| unreadable("PNG", e))?;
    let stride = usize::from(decoded.color().channel_count());
    let bytes8 = |raw: &[u8]| deinterleave(raw, stride, byte);
    let words = |raw: &[u16]| deinterleave(raw, stride, word);
    let (channels, alpha) = match &decoded {
        Image::ImageLuma8(i) => bytes8(i),
        Image::ImageLumaA8(i) => bytes8(i),
        Image::ImageRgb8(i) => bytes8(i),
        Image::ImageRgba8(i) => bytes8(i),
        Image::ImageLuma16(i) => words(i),
        Image::ImageLumaA16(i) => words(i),
        Image::ImageRgb16(i) => words(i),
        Image::ImageRgba16(i) => words(i),
        _ => return Err(unreadable("PNG", "its pixels are of a kind that PNG has not")),
    };
    Ok(Raster { width: width as usize, height: height as usize, channels, alpha, integer: true })
}
