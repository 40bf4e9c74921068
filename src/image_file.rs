//! Reading images: PNG, TIFF and EXR, as heights or as colour weights.
//!
//! Files are not trusted: sizes are checked before anything is allocated for them.

use crate::error::{BadInput, Error, Result};
use crate::material::TintImage;
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// Most pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 26;
/// Most bytes that decoding may take.
const MAX_BYTES: u64 = 1 << 30;

/// A decoded image of one or three channels, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// One channel, or red, green and blue; each `height` rows of `width` samples.
    pub channels: Vec<Vec<f32>>,
    /// Whether the file holds whole numbers; they are scaled so that the largest possible one is 1.
    pub integer: bool,
}

/// Linear value of an sRGB-encoded one, both in 0..1 (IEC 61966-2-1).
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// Reads an image by the ending of its name: `.png`, `.tif`, `.tiff` or `.exr`.
///
/// An alpha channel is left out. TIFF: 8, 16 bits or floats, grey or RGB. EXR: the channels R, G, B, else the only one, else Z or Y.
///
/// # Errors
/// Bad input names the file and what is wrong with it.
pub fn read(path: &Path) -> Result<Raster> {
    let bytes = std::fs::read(path).map_err(|e| Error::reading(path, e))?;
    parse(path, &bytes).map_err(|bad| bad.in_file(path).into())
}

/// Reads a photograph as [`read`] does, whose pixels may be holes: values that are no finite numbers become NaN.
///
/// # Errors
/// As [`read`], but for such values.
pub fn read_with_holes(path: &Path) -> Result<Raster> {
    let bytes = std::fs::read(path).map_err(|e| Error::reading(path, e))?;
    let mut raster = decode(path, &bytes).map_err(|bad| Error::from(bad.in_file(path)))?;
    if raster.width == 0 || raster.height == 0 {
        return Err(BadInput::new("the image has no pixels", "use another one").in_file(path).into());
    }
    for value in raster.channels.iter_mut().flatten().filter(|v| !v.is_finite()) {
        *value = f32::NAN;
    }
    while raster.channels.len() < 3 {
        raster.channels.push(raster.channels[0].clone());
    }
    Ok(raster)
}

/// Decodes the bytes of an image file.
pub(crate) fn parse(path: &Path, bytes: &[u8]) -> Result<Raster, BadInput> {
    checked(decode(path, bytes)?)
}

fn decode(path: &Path, bytes: &[u8]) -> Result<Raster, BadInput> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    Ok(match &*ending {
        "png" => png(bytes)?,
        "tif" | "tiff" => tiff(bytes)?,
        "exr" => exr(bytes)?,
        _ => return Err(BadInput::new(format!("the ending \"{ending}\" is not known for an image"), "use .png, .tif, .tiff or .exr")),
    })
}

/// Refuses an image without pixels, or with one that is not a number.
fn checked(raster: Raster) -> Result<Raster, BadInput> {
    if raster.width == 0 || raster.height == 0 {
        return Err(BadInput::new("the image has no pixels", "use another one"));
    }
    if !raster.integer
        && let Some(place) = raster.channels.iter().flatten().position(|v| !v.is_finite())
    {
        let pixel = place % (raster.width * raster.height);
        let problem = format!("the pixel in column {}, row {} is not a finite number", pixel % raster.width, pixel / raster.width);
        return Err(BadInput::new(problem, "fill such holes before use"));
    }
    Ok(raster)
}

/// Reads colour weights: whole numbers are sRGB-encoded, floats linear. All must lie in 0..1.
///
/// # Errors
/// As [`read`]; and a value outside 0..1, with its pixel.
pub fn read_tint(path: &Path) -> Result<TintImage> {
    let Raster { width, height, channels, integer } = read(path)?;
    let mut pixels = Vec::with_capacity(width * height);
    // Row 0 of a tint lies at v = 0, which is the bottom of the image.
    for row in (0..height).rev() {
        for column in 0..width {
            let pixel: [f32; 3] = std::array::from_fn(|c| channels[c.min(channels.len() - 1)][row * width + column]);
            if let Some(bad) = pixel.iter().find(|v| !(0.0..=1.0).contains(*v)) {
                let problem = format!("the colour weight {bad} in column {column}, row {row} is out of range");
                return Err(BadInput::new(problem, "scale the image to 0..1").in_file(path).into());
            }
            #[expect(clippy::cast_possible_truncation, reason = "colour weights are f32")]
            pixels.push(if integer { pixel.map(|v| srgb_to_linear(v.into()) as f32) } else { pixel });
        }
    }
    Ok(TintImage { width, height, pixels })
}

/// Reads linear radiance: `.hdr` (Radiance) or `.exr`, three channels.
///
/// # Errors
/// As [`read`]; and a value below 0, with its pixel.
pub fn read_radiance(path: &Path) -> Result<Raster> {
    let bytes = std::fs::read(path).map_err(|e| Error::reading(path, e))?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let raster = match &*ending {
        "hdr" => hdr(&bytes).and_then(checked),
        "exr" => parse(path, &bytes),
        _ => Err(BadInput::new(format!("the ending \"{ending}\" is not known for light"), "use .hdr or .exr")),
    };
    let mut raster = raster.map_err(|bad| bad.in_file(path))?;
    if let Some(place) = raster.channels.iter().flatten().position(|v| *v < 0.0) {
        let pixel = place % (raster.width * raster.height);
        let problem = format!("the radiance in column {}, row {} is negative", pixel % raster.width, pixel / raster.width);
        return Err(BadInput::new(problem, "light is 0 or more").in_file(path).into());
    }
    while raster.channels.len() < 3 {
        raster.channels.push(raster.channels[0].clone());
    }
    Ok(raster)
}

fn hdr(bytes: &[u8]) -> Result<Raster, BadInput> {
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
    Ok(Raster { width: width as usize, height: height as usize, channels: deinterleave(decoded.as_raw(), 3, |v| v), integer: false })
}

fn check_size(width: u64, height: u64) -> Result<(), BadInput> {
    if width.checked_mul(height).is_none_or(|n| n > MAX_PIXELS) {
        return Err(BadInput::new(format!("the image is {width} x {height}, more than {MAX_PIXELS} pixels"), "reduce it"));
    }
    Ok(())
}

fn unreadable(kind: &str, why: impl std::fmt::Display) -> BadInput {
    BadInput::new(format!("not a readable {kind} image: {why}"), "write the image again")
}

/// Splits interleaved samples of a kind into channels of floats; of two or four the last is alpha.
fn deinterleave<T: Copy + Sync>(samples: &[T], stride: usize, value: impl Fn(T) -> f32 + Sync) -> Vec<Vec<f32>> {
    let kept = if stride >= 3 { 3 } else { 1 };
    (0..kept).map(|c| samples.par_chunks_exact(stride).map(|pixel| value(pixel[c])).collect()).collect()
}

/// Whole numbers of 8 and of 16 bits, of 1.
fn byte(v: u8) -> f32 {
    f32::from(v) / 255.0
}

fn word(v: u16) -> f32 {
    f32::from(v) / 65535.0
}

fn png(bytes: &[u8]) -> Result<Raster, BadInput> {
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
    let channels = match &decoded {
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
    Ok(Raster { width: width as usize, height: height as usize, channels, integer: true })
}

fn tiff(bytes: &[u8]) -> Result<Raster, BadInput> {
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
    let (channels, integer) = match decoder.read_image().map_err(|e| unreadable("TIFF", e))? {
        // One-bit and four-bit images come packed.
        DecodingResult::U8(raw) if raw.len() == samples => (deinterleave(&raw, stride, byte), true),
        DecodingResult::U16(raw) => (deinterleave(&raw, stride, word), true),
        DecodingResult::F16(raw) => (deinterleave(&raw, stride, |v| v.to_f32()), false),
        DecodingResult::F32(raw) => (deinterleave(&raw, stride, |v| v), false),
        #[expect(clippy::cast_possible_truncation, reason = "f32 keeps 1e-7 of a height or colour")]
        DecodingResult::F64(raw) => (deinterleave(&raw, stride, |v| v as f32), false),
        _ => return Err(BadInput::new("the TIFF's samples are not 8 or 16 bit unsigned, nor floats", "write it in one of these")),
    };
    if channels.iter().any(|c| c.len() * stride != samples) {
        return Err(BadInput::new("the TIFF stores its channels one after the other", "write it with interleaved channels"));
    }
    Ok(Raster { width: width as usize, height: height as usize, channels, integer })
}

fn exr(bytes: &[u8]) -> Result<Raster, BadInput> {
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
    let channels: Vec<Vec<f32>> = chosen.iter().map(|c| c.sample_data.values_as_f32().collect()).collect();
    let (width, height) = (layer.size.width(), layer.size.height());
    if channels.iter().any(|c| c.len() != width * height) {
        return Err(unreadable("EXR", "a channel is subsampled"));
    }
    Ok(Raster { width, height, channels, integer: false })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A 3 x 2 grey PNG of 16 bits: 0, 1, 2 thousandths on top, then 65535.
    fn grey_png() -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, vec![0_u16, 1000, 2000, 65535, 65535, 65535]).unwrap();
        image.write_to(&mut out, image::ImageFormat::Png).unwrap();
        out.into_inner()
    }

    fn float_tiff() -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let mut encoder = tiff::encoder::TiffEncoder::new(&mut out).unwrap();
        encoder.write_image::<tiff::encoder::colortype::Gray32Float>(3, 2, &[0.5, -1.25, 3.0, 0.0, 1e-3, 7.0]).unwrap();
        out.into_inner()
    }

    fn colour_exr() -> Vec<u8> {
        use exr::prelude::*;
        let mut out = Cursor::new(Vec::new());
        let channels = SpecificChannels::rgb(|p: Vec2<usize>| (p.x() as f32 / 4.0, p.y() as f32 / 2.0, 0.25_f32));
        Image::from_channels((3, 2), channels).write().to_buffered(&mut out).unwrap();
        out.into_inner()
    }

    #[test]
    fn every_format_is_read_with_row_0_on_top() {
        let png = parse(Path::new("a.png"), &grey_png()).unwrap();
        assert_eq!((png.width, png.height, png.integer), (3, 2, true));
        assert_eq!(png.channels, [vec![0.0, 1000.0 / 65535.0, 2000.0 / 65535.0, 1.0, 1.0, 1.0]]);
        let tiff = parse(Path::new("a.TIFF"), &float_tiff()).unwrap();
        assert_eq!((tiff.integer, tiff.channels), (false, vec![vec![0.5, -1.25, 3.0, 0.0, 1e-3, 7.0]]));
        let exr = parse(Path::new("a.exr"), &colour_exr()).unwrap();
        assert_eq!(exr.channels, [vec![0.0, 0.25, 0.5, 0.0, 0.25, 0.5], vec![0.0, 0.0, 0.0, 0.5, 0.5, 0.5], vec![0.25; 6]]);
    }

    #[test]
    fn tints_are_linear_with_row_0_at_the_bottom() {
        let folder = tempfile::tempdir().unwrap();
        let (png, exr) = (folder.path().join("t.png"), folder.path().join("t.exr"));
        image::RgbImage::from_raw(1, 2, vec![255, 188, 0, 10, 20, 30]).unwrap().save(&png).unwrap();
        std::fs::write(&exr, colour_exr()).unwrap();
        let tint = read_tint(&png).unwrap();
        // sRGB 188 is linear 0.5029.
        let top = tint.pixels[1];
        assert!(top[0] == 1.0 && (top[1] - 0.5029).abs() < 1e-4 && top[2] == 0.0, "{top:?}");
        assert_eq!(read_tint(&exr).unwrap().pixels[0], [0.0, 0.5, 0.25]);
    }

    #[test]
    fn a_tint_outside_0_to_1_is_refused_with_its_pixel() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.tif");
        std::fs::write(&path, float_tiff()).unwrap();
        let message = read_tint(&path).unwrap_err().to_string();
        assert!(
            message.contains("t.tif") && message.contains("0 to 1") | message.contains("0..1") && message.contains("row 1"),
            "{message}"
        );
    }

    #[test]
    fn wrong_files_are_refused() {
        for (name, bytes) in [("a.png", grey_png()), ("a.tif", float_tiff()), ("a.exr", colour_exr())] {
            assert!(parse(Path::new(name), &bytes[..bytes.len() / 2]).is_err(), "half of {name}");
            assert!(parse(Path::new(name), b"").is_err() && parse(Path::new(name), b"hello").is_err(), "{name}");
        }
        assert!(parse(Path::new("a.webp"), b"").unwrap_err().problem.contains("webp"));
        // A PNG header that announces 4e9 x 4e9 pixels.
        let mut png = grey_png();
        png[16..24].fill(0x7f);
        assert!(parse(Path::new("a.png"), &png).is_err());
    }

    #[test]
    fn srgb_is_the_standard_curve() {
        for (encoded, linear) in [(0.0, 0.0), (0.04, 0.04 / 12.92), (0.5, 0.214_041_140_5), (1.0, 1.0)] {
            assert!((srgb_to_linear(encoded) - linear).abs() < 1e-10, "{encoded}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 1_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn damaged_images_never_panic(
            which in 0_usize..3,
            damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
            cut in any::<prop::sample::Index>(),
            whole in any::<bool>(),
        ) {
            let (name, mut bytes) = [("a.png", grey_png()), ("a.tif", float_tiff()), ("a.exr", colour_exr())][which].clone();
            for (place, byte) in damage {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            if !whole {
                bytes.truncate(cut.index(bytes.len()));
            }
            let _ = parse(Path::new(name), &bytes);
        }
    }
}
