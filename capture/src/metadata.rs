//! What an image file says of its exposure and of its tone curve: Exif, PNG chunks, `OpenEXR` attributes, ICC profiles.

use exif::{In, Tag, Value};
use std::io::Cursor;

/// What was found; the shoot file may say otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Shutter time, s.
    pub seconds: Option<f64>,
    /// Sensitivity, ISO.
    pub iso: Option<f64>,
    /// Aperture as f-number.
    pub f_number: Option<f64>,
    /// Focal length, mm.
    pub focal_mm: Option<f64>,
    /// Focal length of a camera of 36 x 24 mm that sees as much, mm.
    pub focal_35mm: Option<f64>,
    /// Camera model.
    pub model: Option<String>,
    /// How the picture is to be turned for viewing: 1 as it is, 3 by a half, 6 and 8 by a quarter (Exif 2.32, 4.6.4).
    pub orientation: Option<u32>,
    /// When it was taken, as `YYYY:MM:DD HH:MM:SS` and a fraction of the second.
    pub taken: Option<String>,
    /// Why the values cannot be linear, if the file says so.
    pub tone_curve: Option<String>,
}

impl Metadata {
    /// Reads the metadata of a file with this (lower-case) ending from its bytes. What cannot be read is `None`.
    pub fn of(ending: &str, bytes: &[u8]) -> Self {
        let mut out = if ending == "exr" { Self::exr(bytes) } else { Self::exif(bytes) };
        if let Some(curve) = tone_curve(ending, bytes) {
            out.tone_curve = Some(curve);
        }
        out
    }

    fn exif(bytes: &[u8]) -> Self {
        // Damaged Exif is read as far as it goes: what messengers and editors leave of it often still tells the exposure.
        let read = exif::Reader::new().continue_on_error(true).read_from_container(&mut Cursor::new(bytes));
        let Ok(exif) = read.or_else(|e| e.distill_partial_result(|_| {})) else { return Self::default() };
        let field = |tag| exif.get_field(tag, In::PRIMARY);
        let positive = |v: f64| Some(v).filter(|v| v.is_finite() && *v > 0.0);
        let rational = |tag| match &field(tag)?.value {
            Value::Rational(v) => v.first().and_then(|r| positive(r.to_f64())),
            _ => None,
        };
        let whole = |tag| field(tag)?.value.get_uint(0);
        let text = |tag| match &field(tag)?.value {
            Value::Ascii(lines) => lines.first().map(|l| String::from_utf8_lossy(l).trim().to_owned()).filter(|t| !t.is_empty()),
            _ => None,
        };
        let taken = text(Tag::DateTimeOriginal).map(|t| format!("{t}.{}", text(Tag::SubSecTimeOriginal).unwrap_or_default()));
        Self {
            seconds: rational(Tag::ExposureTime),
            iso: whole(Tag::PhotographicSensitivity).and_then(|v| positive(v.into())),
            f_number: rational(Tag::FNumber),
            focal_mm: rational(Tag::FocalLength),
            focal_35mm: whole(Tag::FocalLengthIn35mmFilm).and_then(|v| positive(v.into())),
            model: text(Tag::Model),
            orientation: whole(Tag::Orientation).filter(|v| (1..=8).contains(v)),
            taken,
            // 1 is sRGB; 65535, "uncalibrated", says nothing.
            tone_curve: (whole(Tag::ColorSpace) == Some(1)).then(|| "its Exif colour space is sRGB".to_owned()),
        }
    }

    fn exr(bytes: &[u8]) -> Self {
        let Ok(meta) = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false) else { return Self::default() };
        let Some(header) = meta.headers.first() else { return Self::default() };
        let own = &header.own_attributes;
        let positive = |v: Option<f32>| v.map(f64::from).filter(|v| v.is_finite() && *v > 0.0);
        Self { seconds: positive(own.exposure), iso: positive(own.iso_speed), f_number: positive(own.aperture), ..Self::default() }
    }
}

/// Names of encoded colour spaces as ICC profiles spell them.
const ENCODED: [&str; 6] = ["sRGB", "Adobe RGB", "Display P3", "ProPhoto", "DCI-P3", "Rec. 709"];

/// Why an integer file cannot be linear, if it says so.
fn tone_curve(ending: &str, bytes: &[u8]) -> Option<String> {
    match ending {
        "png" => {
            for (name, data) in png_chunks(bytes) {
                match name {
                    b"sRGB" => return Some("its PNG chunk sRGB says so".to_owned()),
                    b"gAMA" => {
                        // The exponent of encoding, times 100,000.
                        let gamma = f64::from(u32::from_be_bytes(data.get(..4)?.try_into().ok()?)) / 1e5;
                        if (gamma - 1.0).abs() > 0.02 {
                            return Some(format!("its PNG chunk gAMA says {gamma}"));
                        }
                    }
                    b"iCCP" => {
                        let name: String = data.iter().take_while(|b| **b != 0).map(|&b| char::from(b)).collect();
                        if is_encoded(&name) {
                            return Some(format!("its colour profile is \"{name}\""));
                        }
                    }
                    _ => {}
                }
            }
            None
        }
        "tif" | "tiff" => {
            let mut decoder = tiff::decoder::Decoder::new(Cursor::new(bytes)).ok()?;
            let profile = decoder.get_tag_u8_vec(tiff::tags::Tag::IccProfile).ok()?;
            // The description is text in one or two bytes a letter.
            let text: String =
                profile.iter().filter(|b| **b != 0).map(|&b| if b.is_ascii() { char::from(b) } else { '\u{fffd}' }).collect();
            let name = ENCODED.iter().find(|n| text.contains(**n))?;
            is_encoded(&text).then(|| format!("its colour profile is {name}"))
        }
        _ => None,
    }
}

fn is_encoded(profile: &str) -> bool {
    ENCODED.iter().any(|n| profile.contains(n)) && !profile.to_lowercase().contains("linear")
}

/// The chunks of a PNG file before its pixels.
fn png_chunks(bytes: &[u8]) -> impl Iterator<Item = (&[u8; 4], &[u8])> {
    let mut rest = bytes.get(8..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (name, after) = after.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        let data = after.get(..length)?;
        // Four bytes of checksum follow.
        rest = after.get(length + 4..)?;
        (name != b"IDAT").then_some((name, data))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(chunk: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
        for (name, data) in [(b"IHDR", &[0_u8; 13][..]), (chunk, data)] {
            out.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
            out.extend(name);
            out.extend(data);
            out.extend([0; 4]);
        }
        out
    }

    /// A JPEG of nothing but Exif: its first directory with these entries (tag, type, count, value).
    fn jpeg(entries: &[[u32; 4]]) -> Vec<u8> {
        let mut tiff = b"Exif\0\0II*\0\x08\0\0\0".to_vec();
        tiff.extend(u16::try_from(entries.len()).unwrap().to_le_bytes());
        for [tag, kind, count, value] in entries {
            tiff.extend([(*tag as u16).to_le_bytes(), (*kind as u16).to_le_bytes()].concat());
            tiff.extend([count.to_le_bytes(), value.to_le_bytes()].concat());
        }
        tiff.extend([0; 4]);
        let mut out = b"\xff\xd8\xff\xe1".to_vec();
        out.extend(u16::try_from(tiff.len() + 2).unwrap().to_be_bytes());
        [out, tiff, b"\xff\xd9".to_vec()].concat()
    }

    #[test]
    fn damaged_exif_is_read_as_far_as_it_goes() {
        // The orientation and a model of three letters, and before and between them texts that point outside of the file.
        let outside = |tag| [tag, 2, 400, 60_000];
        let model = [0x0110, 2, 4, u32::from_le_bytes(*b"Cam\0")];
        let found = Metadata::of("jpg", &jpeg(&[outside(0x010f), model, outside(0x0131), [0x0112, 3, 1, 6]]));
        assert_eq!((found.orientation, found.model.as_deref(), found.iso), (Some(6), Some("Cam"), None));
        assert_eq!(Metadata::of("jpg", b"\xff\xd8\xff\xe1"), Metadata::default());
    }

    #[test]
    fn a_png_says_when_it_is_encoded() {
        let curve = |chunk, data: &[u8]| Metadata::of("png", &png(chunk, data)).tone_curve;
        assert!(curve(b"sRGB", &[0]).is_some());
        assert!(curve(b"gAMA", &45_455_u32.to_be_bytes()).is_some_and(|c| c.contains("0.45")));
        assert_eq!(curve(b"gAMA", &100_000_u32.to_be_bytes()), None);
        assert!(curve(b"iCCP", b"sRGB IEC61966-2.1\0\0").is_some());
        assert_eq!(curve(b"iCCP", b"linear sRGB\0\0"), None);
        assert_eq!(curve(b"tEXt", b"sRGB"), None);
        for cut in 0..40 {
            let whole = png(b"gAMA", &[0, 0, 1, 2]);
            Metadata::of("png", &whole[..cut.min(whole.len())]);
        }
    }
}
