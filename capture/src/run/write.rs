//! Files of a capture folder.

use crate::photo::PlanarImage;
use biscale::error::{Error, Result};
use biscale::formats::capture::{Capture, FILE_NAME};
use exr::meta::attribute::LineOrder;
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

fn failed(path: &Path) -> impl Fn(std::io::Error) -> Error + '_ {
    move |source| Error::Io { action: "write", path: path.to_path_buf(), source }
}

/// Writes a file whole.
pub(super) fn bytes(content: &[u8], path: &Path) -> Result<()> {
    std::fs::write(path, content).map_err(failed(path))
}

/// `capture.json`.
pub(super) fn json(capture: &Capture, folder: &Path) -> Result<()> {
    let mut text = serde_json::to_vec_pretty(capture).map_err(|e| Error::Numeric(format!("cannot write {FILE_NAME}: {e}")))?;
    text.push(b'\n');
    bytes(&text, &folder.join(FILE_NAME))
}

/// A linear picture as `OpenEXR`: R, G, B in 32 bits, run-length coded, which is quick.
pub(super) fn exr(picture: PlanarImage, path: &Path, source: &str) -> Result<()> {
    let text = |s: &str| Text::new_or_none(s).unwrap_or_default();
    let ascii: String = source.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    let attributes = LayerAttributes {
        software_name: Some(text(concat!("biscale capture ", env!("CARGO_PKG_VERSION")))),
        comments: Some(text(&ascii)),
        ..LayerAttributes::default()
    };
    let size = (picture.width, picture.height);
    let channels = ["R", "G", "B"].iter().zip(picture.planes).map(|(name, plane)| AnyChannel::new(text(name), FlatSamples::F32(plane)));
    // Blocks in their order, whichever thread is done first: the same bytes at any number of threads.
    let encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::FAST_LOSSLESS };
    let image = Image::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(channels.collect())));
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path).map_err(failed(path))?);
    image.write().to_buffered(&mut out).map_err(|e| match e {
        exr::error::Error::Io(e) => failed(path)(e),
        other => failed(path)(std::io::Error::other(other)),
    })?;
    out.flush().map_err(failed(path))
}

/// A mask as grey PNG.
pub(super) fn mask(keep: &[bool], size: (usize, usize), path: &Path) -> Result<()> {
    use image::ImageEncoder as _;
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let pixels: Vec<u8> = keep.iter().map(|k| if *k { 255 } else { 0 }).collect();
    let mut out = Vec::new();
    let (width, height) = (u32::try_from(size.0).unwrap_or(u32::MAX), u32::try_from(size.1).unwrap_or(u32::MAX));
    PngEncoder::new_with_quality(&mut out, CompressionType::Fast, FilterType::NoFilter)
        .write_image(&pixels, width, height, image::ExtendedColorType::L8)
        .map_err(|e| Error::Numeric(format!("cannot write {}: {e}", path.display())))?;
    bytes(&out, path)
}
