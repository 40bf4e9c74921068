//! TIFF: grey, RGB or a palette; whole numbers of 1 to 64 bits, with or without a sign, and floats.

use super::common::{MAX_BYTES, deinterleave, unreadable};
use super::packed_tiff::{PackedTiff, packed};
use crate::error::BadInput;
use crate::image_file::raster::{Raster, check_size};
use crate::numerics::cast::narrow;
use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use std::borrow::Cow;
use std::io::Cursor;

type TiffDecoder<'a> = Decoder<Cursor<&'a [u8]>>;

/// Decodes a TIFF; pixels that the file marks as without data (GDAL's tag 42113) are NaN.
pub fn tiff(bytes: &[u8]) -> Result<Raster, BadInput> {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(MAX_BYTES).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    if let Some(file) = packed(bytes) {
        return packed_raster(&file, limits);
    }
    let (bytes, is_palette) = as_grey(bytes);
    let mut decoder = Decoder::new(Cursor::new(&*bytes)).map_err(|e| unreadable("TIFF", e))?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(|e| unreadable("TIFF", e))?;
    check_size(width.into(), height.into())?;
    let kind = decoder.colortype().map_err(|e| unreadable("TIFF", e))?;
    let stride = match kind {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        // 1 and 2 are alpha.
        ColorType::Multiband { num_samples: 2, .. }
            if tag_numbers(&mut decoder, Tag::ExtraSamples)?.is_some_and(|extra| matches!(extra[..], [1 | 2])) =>
        {
            2
        }
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        other => return Err(other_pixels(other)),
    };
    if stride > 1 && tag_numbers(&mut decoder, Tag::PlanarConfiguration)?.is_some_and(|planar| planar == [2]) {
        return Err(BadInput::new("the TIFF stores its channels one after the other", "write it with interleaved channels"));
    }
    let no_data = no_data(&mut decoder)?;
    let palette = tag_numbers(&mut decoder, Tag::ColorMap)?;
    let (width, height) = (width as usize, height as usize);
    let raw = decoder.read_image().map_err(|e| unreadable("TIFF", e))?;
    let (values, integer) = samples(raw, kind.bit_depth(), [width * stride, height], no_data)?;
    if is_palette && !integer {
        return Err(BadInput::new("the TIFF's palette is looked up by floats", "write it as grey or RGB"));
    }
    if values.len() != width * height * stride {
        return Err(unreadable("TIFF", format!("it has {} samples for {width} x {height} pixels", values.len())));
    }
    let (mut channels, alpha) = deinterleave(&values, stride, |v| v);
    if is_palette {
        channels = coloured(&channels[0], kind.bit_depth().into(), palette)?;
    }
    Ok(Raster { width, height, channels, alpha, integer })
}

/// The mistake of pixels that are neither grey nor RGB.
fn other_pixels(kind: ColorType) -> BadInput {
    let what = match kind {
        ColorType::Multiband { num_samples, .. } => {
            let remedy = "write that which is meant alone (`gdal_translate -b 1`), or RGB";
            return BadInput::new(format!("the TIFF has {num_samples} channels, and does not say that they are colours"), remedy);
        }
        ColorType::CMYK(_) | ColorType::CMYKA(_) => "printing colours (CMYK)",
        ColorType::YCbCr(_) => "luminance and chrominance (YCbCr)",
        ColorType::Lab(_) => "CIE L*a*b* colours",
        _ => "colours of another kind",
    };
    BadInput::new(format!("the TIFF has {what}"), "write it as grey or RGB")
}

/// The raster of a file whose samples are taken apart here.
fn packed_raster(file: &PackedTiff, limits: Limits) -> Result<Raster, BadInput> {
    let mut decoder = Decoder::new(Cursor::new(&*file.bytes)).map_err(|e| unreadable("TIFF", e))?.with_limits(limits);
    let (_, rows) = decoder.dimensions().map_err(|e| unreadable("TIFF", e))?;
    let rows = rows as usize;
    check_size(file.width as u64, file.rows(rows) as u64)?;
    let no_data = no_data(&mut decoder)?;
    let palette = if file.is_palette { tag_numbers(&mut decoder, Tag::ColorMap)? } else { None };
    let raw = decoder.read_image().map_err(|e| unreadable("TIFF", e))?;
    let DecodingResult::U8(raw) = raw else { return Err(unreadable("TIFF", "its bytes are none")) };
    if raw.len() != file.row_bytes() * rows {
        return Err(unreadable("TIFF", format!("it has {} bytes for {rows} rows of {}", raw.len(), file.row_bytes())));
    }
    let (mut channels, alpha) = deinterleave(&file.unpacked(&raw, no_data), file.samples, |v| v);
    if file.is_palette {
        channels = coloured(&channels[0], file.bits, palette)?;
    }
    Ok(Raster { width: file.width, height: file.rows(rows), channels, alpha, integer: true })
}

/// The file with places of a palette taken as greys, which is what the decoder knows; and whether they are such places.
fn as_grey(bytes: &[u8]) -> (Cow<'_, [u8]>, bool) {
    /// Photometric interpretation, of which 3 is a palette and 1 grey.
    const INTERPRETATION: u16 = 262;
    let little = bytes.starts_with(b"II*\0");
    if !little && !bytes.starts_with(b"MM\0*") {
        return (Cow::Borrowed(bytes), false);
    }
    let short = |at: usize| {
        let two = bytes.get(at..at.checked_add(2)?)?.try_into().ok()?;
        Some(if little { u16::from_le_bytes(two) } else { u16::from_be_bytes(two) })
    };
    let directory = || {
        let four = bytes.get(4..8)?.try_into().ok()?;
        usize::try_from(if little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) }).ok()
    };
    let value = || {
        let first = directory()?.checked_add(2)?;
        let entries = (0..usize::from(short(directory()?)?)).map(|k| first + 12 * k);
        let entry = entries.into_iter().find(|&at| short(at) == Some(INTERPRETATION))?;
        (short(entry + 8) == Some(3)).then_some(entry + 8)
    };
    let Some(value) = value() else { return (Cow::Borrowed(bytes), false) };
    let mut grey = bytes.to_vec();
    grey[value..value + 2].copy_from_slice(&if little { 1_u16.to_le_bytes() } else { 1_u16.to_be_bytes() });
    (Cow::Owned(grey), true)
}

/// The whole numbers of a tag, if the file has it.
fn tag_numbers(decoder: &mut TiffDecoder<'_>, tag: Tag) -> Result<Option<Vec<u16>>, BadInput> {
    let value = decoder.find_tag(tag).map_err(|e| unreadable("TIFF", e))?;
    value.map(|v| v.into_u16_vec().map_err(|e| unreadable("TIFF", e))).transpose()
}

/// The number that stands for no data, if the file names one.
fn no_data(decoder: &mut TiffDecoder<'_>) -> Result<Option<f64>, BadInput> {
    let Some(value) = decoder.find_tag(Tag::GdalNodata).map_err(|e| unreadable("TIFF", e))? else { return Ok(None) };
    let text = value.into_string().map_err(|e| unreadable("TIFF", e))?;
    let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    if text.is_empty() {
        return Ok(None);
    }
    let bad = |_| {
        BadInput::new(format!("the TIFF's mark for no data (tag 42113) is \"{}\"", text.escape_debug()), "write a number, or remove it")
    };
    text.parse().map(Some).map_err(bad)
}

/// All samples, whole numbers over the largest that they can be (so that 1 is white), and whether they are whole numbers.
fn samples(raw: DecodingResult, bits: u8, rows: [usize; 2], no_data: Option<f64>) -> Result<(Vec<f32>, bool), BadInput> {
    let whole = |values: &mut dyn Iterator<Item = f64>, largest: f64| -> (Vec<f32>, bool) {
        (values.map(|v| if Some(v) == no_data { f32::NAN } else { narrow(v / largest) }).collect(), true)
    };
    // The mark is written in decimals of a float.
    let float = |values: &mut dyn Iterator<Item = f32>| -> (Vec<f32>, bool) {
        let mark = no_data.map(narrow);
        (values.map(|v| if Some(v) == mark { f32::NAN } else { v }).collect(), false)
    };
    Ok(match raw {
        DecodingResult::U8(raw) if bits < 8 => {
            whole(&mut unpacked(&raw, bits, rows)?.into_iter().map(f64::from), f64::from((1_u16 << bits) - 1))
        }
        DecodingResult::U8(raw) => whole(&mut raw.into_iter().map(f64::from), u8::MAX.into()),
        DecodingResult::U16(raw) if bits == 16 => whole(&mut raw.into_iter().map(f64::from), u16::MAX.into()),
        DecodingResult::U32(raw) if bits == 32 => whole(&mut raw.into_iter().map(f64::from), u32::MAX.into()),
        DecodingResult::U64(raw) if bits == 64 => whole(&mut raw.into_iter().map(|v| v as f64), u64::MAX as f64),
        DecodingResult::I64(raw) if bits == 64 => whole(&mut raw.into_iter().map(|v| v as f64), i64::MAX as f64),
        DecodingResult::I8(raw) => whole(&mut raw.into_iter().map(f64::from), i8::MAX.into()),
        DecodingResult::I16(raw) if bits == 16 => whole(&mut raw.into_iter().map(f64::from), i16::MAX.into()),
        DecodingResult::I32(raw) if bits == 32 => whole(&mut raw.into_iter().map(f64::from), i32::MAX.into()),
        DecodingResult::F16(raw) => float(&mut raw.into_iter().map(|v| v.to_f32())),
        DecodingResult::F32(raw) => float(&mut raw.into_iter()),
        // f32 keeps 1e-7 of a height or colour.
        DecodingResult::F64(raw) => float(&mut raw.into_iter().map(narrow)),
        _ => {
            let problem = format!("the TIFF has samples of {bits} bits");
            return Err(BadInput::new(problem, "write whole numbers of 8, 16 or 32 bits, or floats"));
        }
    })
}

/// Samples of 1, 2 or 4 bits, the first in the highest bits; each row begins with a byte.
fn unpacked(raw: &[u8], bits: u8, [in_row, rows]: [usize; 2]) -> Result<Vec<u8>, BadInput> {
    if !matches!(bits, 1 | 2 | 4) {
        return Err(BadInput::new(format!("the TIFF has samples of {bits} bits"), "write 8, 16 or 32"));
    }
    let in_byte = usize::from(8 / bits);
    let bytes = in_row.div_ceil(in_byte);
    if raw.len() != bytes * rows {
        return Err(unreadable("TIFF", format!("its rows have {} bytes in all and not {}", raw.len(), bytes * rows)));
    }
    let sample =
        |row: &[u8], k: usize| row[k / in_byte] >> (8 - bits - u8::try_from(k % in_byte).expect("below 8") * bits) & ((1 << bits) - 1);
    Ok(raw.chunks_exact(bytes.max(1)).flat_map(|row| (0..in_row).map(move |k| sample(row, k))).collect())
}

/// Red, green and blue of entries of a palette, which were scaled to 0..=1.
fn coloured(entries: &[f32], bits: u32, palette: Option<Vec<u16>>) -> Result<Vec<Vec<f32>>, BadInput> {
    let size = 1_usize << bits.min(16);
    let palette =
        palette.filter(|p| p.len() == 3 * size).ok_or_else(|| unreadable("TIFF", format!("its palette has not {size} colours")))?;
    let last = (size - 1) as f32;
    let channel = |c: usize| {
        let colour = |&entry: &f32| {
            if entry.is_nan() {
                return f32::NAN;
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0..=65535")]
            let place = (entry * last).round() as usize;
            f32::from(palette[c * size + place]) / f32::from(u16::MAX)
        };
        entries.iter().map(colour).collect()
    };
    Ok((0..3).map(channel).collect())
}
