//! The decoders, one a format: bytes in, a [`Raster`] out.

use super::raster::{Raster, check_size};
use crate::error::BadInput;
use crate::numerics::cast::narrow;
use rayon::prelude::*;
use std::io::Cursor;

/// Most bytes that decoding may take.
const MAX_BYTES: u64 = 1 << 30;

pub(super) fn hdr(bytes: &[u8]) -> Result<Raster, BadInput> {
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

pub(super) fn tiff(bytes: &[u8]) -> Result<Raster, BadInput> {
    use tiff::ColorType;
    use tiff::decoder::{Decoder, DecodingResult, Limits};
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(MAX_BYTES).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|e| unreadable("TIFF", e))?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(|e| unreadable("TIFF", e))?;
    check_size(width.into(), height.into())?;
    let stride = match decoder.colortype().map_err(|e| unreadable("TIFF", e))? {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        other => return Err(BadInput::new(format!("the TIFF has pixels of type {other:?}"), "write it as grey or RGB")),
    };
    let samples = width as usize * height as usize * stride;
    let ((channels, alpha), integer) = match decoder.read_image().map_err(|e| unreadable("TIFF", e))? {
        // One-bit and four-bit images come packed.
        DecodingResult::U8(raw) if raw.len() == samples => (deinterleave(&raw, stride, byte), true),
        DecodingResult::U16(raw) => (deinterleave(&raw, stride, word), true),
        DecodingResult::F16(raw) => (deinterleave(&raw, stride, |v| v.to_f32()), false),
        DecodingResult::F32(raw) => (deinterleave(&raw, stride, |v| v), false),
        // f32 keeps 1e-7 of a height or colour.
        DecodingResult::F64(raw) => (deinterleave(&raw, stride, narrow), false),
        _ => return Err(BadInput::new("the TIFF's samples are not 8 or 16 bit unsigned, nor floats", "write it in one of these")),
    };
    if channels.iter().any(|c| c.len() * stride != samples) {
        return Err(BadInput::new("the TIFF stores its channels one after the other", "write it with interleaved channels"));
    }
    Ok(Raster { width: width as usize, height: height as usize, channels, alpha, integer })
}

pub(super) fn exr(bytes: &[u8]) -> Result<Raster, BadInput> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| unreadable("EXR", e))?;
    for header in &meta.headers {
        let size = header.layer_size;
        check_size(size.width() as u64, size.height() as u64)?;
        let samples = (size.width() as u64 * size.height() as u64).saturating_mul(header.channels.list.len() as u64);
        if samples.saturating_mul(4) > MAX_BYTES {
            return Err(BadInput::new(format!("the EXR has {} channels", header.channels.list.len()), "keep those that are needed"));
        }
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| unreadable("EXR", e))?;
    let layer = &image.layer_data;
    let channels = &layer.channel_data.list;
    let named = |name: &str| channels.iter().find(|c| c.name.eq(name));
    let chosen = match (named("R"), named("G"), named("B"), &channels[..]) {
        (Some(r), Some(g), Some(b), _) => vec![r, g, b],
        (.., [only]) => vec![only],
        _ => match named("Z").or(named("Y")) {
            Some(channel) => vec![channel],
            None => {
                let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
                let problem = format!("the EXR has the channels {}", names.join(", "));
                return Err(BadInput::new(problem, "name one Z or Y, or three R, G and B"));
            }
        },
    };
    let values = |c: &exr::prelude::AnyChannel<exr::prelude::FlatSamples>| c.sample_data.values_as_f32().collect();
    let channels: Vec<Vec<f32>> = chosen.into_iter().map(values).collect();
    let alpha: Option<Vec<f32>> = named("A").map(values);
    let (width, height) = (layer.size.width(), layer.size.height());
    if channels.iter().chain(&alpha).any(|c| c.len() != width * height) {
        return Err(unreadable("EXR", "a channel is subsampled"));
    }
    Ok(Raster { width, height, channels, alpha, integer: false })
}
