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

/// What the values of a file were multiplied by, if its header says so and it is not 1: the product of all its `EXPOSURE` lines.
pub fn hdr_exposure(bytes: &[u8]) -> Option<f64> {
    let mut product = 1.0;
    for line in bytes.split(|&b| b == b'\n').take_while(|line| !line.trim_ascii().is_empty()) {
        if let Some(value) = line.strip_prefix(b"EXPOSURE=") {
            product *= std::str::from_utf8(value).ok()?.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0)?;
        }
    }
    (product != 1.0).then_some(product)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_are_multiplied_and_end_with_the_header() {
        for (header, exposure) in [
            ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\nEXPOSURE=3\n", None),
            ("#?RADIANCE\nEXPOSURE=2.0\nEXPOSURE= 0.25 \n\n-Y 1 +X 1\n", Some(0.5)),
            ("#?RADIANCE\nEXPOSURE=1\n\n", None),
            ("#?RADIANCE\nEXPOSURE=0\n\n", None),
            ("#?RADIANCE\nEXPOSURE=bright\n\n", None),
        ] {
            assert_eq!(hdr_exposure(header.as_bytes()), exposure, "{header}");
        }
    }
}
