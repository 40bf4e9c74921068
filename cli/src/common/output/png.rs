//! PNG files that say who made them.

use biscale::error::{Error, Result};

/// The bytes of a PNG file of sRGB-encoded pixels, three bytes each, or four with straight alpha.
///
/// # Errors
/// [`Error::Numeric`] if they cannot be encoded, which is a fault of this program.
pub fn encode([width, height]: [u32; 2], pixels: &[u8], alpha: bool, software: &str, comment: &str) -> Result<Vec<u8>> {
    let failed = |e: png::EncodingError| Error::Numeric(format!("cannot encode the picture: {e}; please report this"));
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(if alpha { png::ColorType::Rgba } else { png::ColorType::Rgb });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.add_text_chunk("Software".to_owned(), software.to_owned()).map_err(failed)?;
    encoder.add_itxt_chunk("Comment".to_owned(), comment.to_owned()).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).and_then(|()| writer.finish()).map_err(failed)?;
    Ok(out)
}
