//! Radiance `.hdr`.

use super::common::{MAX_BYTES, deinterleave, unreadable};
use crate::error::BadInput;
use crate::image_file::raster::{Raster, check_size};
use std::io::Cursor;

pub fn hdr(bytes: &[u8]) -> Result<Raster, BadInput> {
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
