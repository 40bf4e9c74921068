//! PNG of 8 and 16 bits.

use super::common::{MAX_BYTES, deinterleave, unreadable};
use crate::error::BadInput;
use crate::image_file::raster::{Raster, check_size};
use std::io::Cursor;

/// Whole numbers of 8 and of 16 bits, of 1.
fn byte(v: u8) -> f32 {
    f32::from(v) / 255.0
}

fn word(v: u16) -> f32 {
    f32::from(v) / 65535.0
}

pub fn png(bytes: &[u8]) -> Result<Raster, BadInput> {
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
