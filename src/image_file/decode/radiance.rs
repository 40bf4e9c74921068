//! Radiance `.hdr`.

use super::common::{MAX_BYTES, deinterleave, unreadable};
use crate::error::BadInput;
use crate::image_file::raster::{Raster, check_size};
use std::io::Cursor;
use std::ops::Range;

/// Decodes a Radiance picture, whichever way its rows and columns run.
pub fn hdr(bytes: &[u8]) -> Result<Raster, BadInput> {
    let Some(Turned { line, upward, leftward }) = turned(bytes)? else { return upright(bytes) };
    let mut patched = bytes.to_vec();
    for sign in line.filter(|&at| bytes[at] == b'+' || bytes[at] == b'-') {
        patched[sign] = if bytes[sign + 1] == b'Y' { b'-' } else { b'+' };
    }
    let mut raster = upright(&patched)?;
    for channel in &mut raster.channels {
        let rows: Vec<&[f32]> = channel.chunks_exact(raster.width).collect();
        let rows: Vec<&[f32]> = if upward { rows.into_iter().rev().collect() } else { rows };
        *channel =
            rows.into_iter().flat_map(|row| (0..row.len()).map(move |x| row[if leftward { row.len() - 1 - x } else { x }])).collect();
    }
    Ok(raster)
}

/// A picture whose rows run upward (`+Y`) or whose pixels run leftward (`-X`).
struct Turned {
    /// Where the resolution line is.
    line: Range<usize>,
    upward: bool,
    leftward: bool,
}

/// How a picture is turned, if it is.
fn turned(bytes: &[u8]) -> Result<Option<Turned>, BadInput> {
    let mut at = 0;
    let mut header = true;
    for line in bytes.split_inclusive(|&b| b == b'\n') {
        if !header {
            let words: Vec<&[u8]> = line.trim_ascii().split(|b| *b == b' ').filter(|word| !word.is_empty()).collect();
            return match words[..] {
                [b"+X" | b"-X", _, b"+Y" | b"-Y", _] => Err(BadInput::new(
                    "the picture stores columns and not rows",
                    "turn it upright (`pflip`, or any editor) and write it again",
                )),
                [y @ (b"+Y" | b"-Y"), _, x @ (b"+X" | b"-X"), _] if y == b"+Y" || x == b"-X" => {
                    Ok(Some(Turned { line: at..at + line.len() - 1, upward: y == b"+Y", leftward: x == b"-X" }))
                }
                _ => Ok(None),
            };
        }
        header = !line.trim_ascii().is_empty();
        at += line.len();
    }
    Ok(None)
}

fn upright(bytes: &[u8]) -> Result<Raster, BadInput> {
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
    fn rows_may_run_upward_and_pixels_leftward() {
        // Four pixels of .5, 1, 2 and 4: without run lengths, as pictures of less than eight columns are.
        let pixel = |exponent: u8| [128, 128, 128, exponent];
        let picture = |size: &str, pixels: [u8; 4]| {
            [format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes(), pixels.map(pixel).concat()].concat()
        };
        let upright = hdr(&picture("-Y 2 +X 2", [128, 129, 130, 131])).unwrap();
        assert_eq!(upright.channels[0], [0.5, 1.0, 2.0, 4.0]);
        for (size, pixels) in
            [("+Y 2 +X 2", [130, 131, 128, 129]), ("-Y 2 -X 2", [129, 128, 131, 130]), ("+Y 2 -X 2", [131, 130, 129, 128])]
        {
            assert_eq!(hdr(&picture(size, pixels)).unwrap(), upright, "{size}");
        }
        let bad = hdr(&picture("+X 2 -Y 2", [128; 4])).unwrap_err();
        assert!(bad.problem.contains("columns and not rows"), "{bad}");
        let whole = picture("+Y 2 -X 2", [128; 4]);
        for cut in 0..whole.len() {
            assert!(hdr(&whole[..cut]).is_err(), "{cut}");
        }
    }

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
