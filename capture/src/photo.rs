//! Photographs as they come from files: pixels, and what the file says of the exposure.

use crate::metadata::Metadata;
use biscale::bounded_file::{MAX_DATA_BYTES, read_bounded};
use biscale::error::{BadInput, Result};
use biscale::image_file::{self, MAX_PIXELS};
use biscale::numerics::cast::{narrow, truncate_usize};
use std::io::Cursor;
use std::path::Path;

/// Three planes of samples, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanarImage {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Red, green and blue.
    pub planes: [Vec<f32>; 3],
}

/// How the file stores its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// Floats: taken as linear.
    Float,
    /// Whole numbers of so many bits; the pixels are over the largest one.
    Integer(u8),
}

/// A photograph as it was read.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Pixels; whole numbers are scaled to 0..1, floats are as they stand.
    pub picture: PlanarImage,
    /// How they were stored.
    pub samples: Samples,
    /// What the file says.
    pub metadata: Metadata,
}

/// Whether values have a tone curve: those of 8 bits always do, others where the file says so.
pub fn is_encoded(samples: Samples, metadata: &Metadata) -> bool {
    matches!(samples, Samples::Integer(bits) if bits <= 8 || metadata.tone_curve.is_some())
}

/// Endings of camera raw files: no decoder is built in.
const RAW: [&str; 29] = [
    "cr2", "cr3", "crw", "nef", "nrw", "arw", "sr2", "srf", "raf", "orf", "rw2", "rwl", "dng", "gpr", "pef", "srw", "x3f", "3fr", "fff",
    "iiq", "erf", "mef", "mos", "mrw", "dcr", "kdc", "k25", "raw", "cap",
];

/// Endings of encoded pictures that are not read, with the program that converts each. All have a tone curve.
const ENCODED: [(&str, &str); 7] = [
    ("heic", "heif-convert"),
    ("heif", "heif-convert"),
    ("hif", "heif-convert"),
    ("avif", "heif-convert"),
    ("webp", "dwebp"),
    ("jxl", "djxl"),
    ("jp2", "opj_decompress"),
];

/// Endings of the files that [`read`] reads.
pub const ENDINGS: [&str; 6] = ["exr", "tif", "tiff", "png", "jpg", "jpeg"];

/// The ending of a file's name, in lower case.
pub fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Whether a file with this ending is a picture that is not read, but can be converted.
pub fn is_convertible(path: &Path) -> bool {
    let ending = ending(path);
    RAW.contains(&&*ending) || ENCODED.iter().any(|e| e.0 == ending)
}

/// Why a file with this ending is not read, with the command that converts it; `None` for those of [`ENDINGS`].
///
/// `-t 0` leaves the pixels as the sensor has them: turned by a quarter or half, they do not fit the camera's calibration.
pub fn why_not_read(path: &Path) -> Option<BadInput> {
    let ending = ending(path);
    if ENDINGS.contains(&&*ending) {
        return None;
    }
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    if RAW.contains(&&*ending) {
        let problem = format!("camera raw files (.{ending}) are not read");
        let remedy = format!(
            "convert it without a tone curve and without turning it, as with `dcraw -4 -T -o 0 -t 0 {file}` or, of newer cameras and phones, `dcraw_emu -4 -T -o 0 -t 0 \
             {file}` (of LibRaw), to a linear 16-bit TIFF"
        );
        return Some(BadInput::new(problem, remedy));
    }
    if let Some((_, program)) = ENCODED.iter().find(|e| e.0 == ending) {
        let problem = format!(".{ending} pictures are not read");
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let command = match *program {
            "dwebp" => format!("dwebp {file} -o {stem}.png"),
            "opj_decompress" => format!("opj_decompress -i {file} -o {stem}.png"),
            other => format!("{other} {file} {stem}.png"),
        };
        let remedy = format!(
            "convert it, as with `{command}`, or let the camera write .jpg (an iPhone: Settings, Camera, Formats, Most Compatible), or better raw files, which have no tone curve"
        );
        return Some(BadInput::new(problem, remedy));
    }
    let problem = if ending.is_empty() {
        "its name has no ending that tells its format".to_owned()
    } else {
        format!("the ending \"{ending}\" is not known for a photograph")
    };
    Some(BadInput::new(problem, "use .exr, .tif, .tiff, .png, .jpg or .jpeg"))
}

impl PlanarImage {
    /// A black one.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, planes: std::array::from_fn(|_| vec![0.0; width * height]) }
    }

    /// The same with its pixels turned by a quarter, clockwise.
    pub fn quarter_turned(&self) -> Self {
        let (w, h) = (self.width, self.height);
        let turned = |plane: &Vec<f32>| (0..w * h).map(|i| plane[(h - 1 - i % h) * w + i / h]).collect();
        Self { width: h, height: w, planes: self.planes.each_ref().map(turned) }
    }

    /// The same with its pixels turned by a half.
    pub fn half_turned(mut self) -> Self {
        for plane in &mut self.planes {
            plane.reverse();
        }
        self
    }

    /// A pixel.
    pub fn at(&self, column: usize, row: usize) -> [f32; 3] {
        let i = row * self.width + column;
        [self.planes[0][i], self.planes[1][i], self.planes[2][i]]
    }

    /// Catmull-Rom interpolation at a place whose pixel centres are whole; `None` outside of the centres' rectangle. Never below 0.
    ///
    /// Near the border the outermost pixels are repeated.
    pub fn sample(&self, x: f64, y: f64) -> Option<[f32; 3]> {
        let inside = |v: f64, n: usize| v >= 0.0 && v <= (n - 1) as f64;
        if !inside(x, self.width) || !inside(y, self.height) {
            return None;
        }
        let (i, j) = (truncate_usize(x), truncate_usize(y));
        let (wx, wy) = (catmull_rom(narrow(x - i as f64)), catmull_rom(narrow(y - j as f64)));
        let mut out = [0.0_f32; 3];
        if i >= 1 && i + 2 < self.width && j >= 1 && j + 2 < self.height {
            // The usual case, with one check of bounds a line.
            for (o, plane) in out.iter_mut().zip(&self.planes) {
                for (k, weight) in wy.iter().enumerate() {
                    let start = (j + k - 1) * self.width + i - 1;
                    let line = &plane[start..start + 4];
                    *o += weight * (wx[0] * line[0] + wx[1] * line[1] + wx[2] * line[2] + wx[3] * line[3]);
                }
                *o = o.max(0.0);
            }
            return Some(out);
        }
        let columns: [usize; 4] = std::array::from_fn(|k| (i + k).saturating_sub(1).min(self.width - 1));
        for k in 0..4 {
            let row = (j + k).saturating_sub(1).min(self.height - 1) * self.width;
            for (o, plane) in out.iter_mut().zip(&self.planes) {
                let line: f32 = (0..4).map(|m| wx[m] * plane[row + columns[m]]).sum();
                *o += wy[k] * line;
            }
        }
        Some(out.map(|v| v.max(0.0)))
    }
}

/// Weights of four neighbours at `t` in 0..1 between the middle two.
pub(crate) fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2]
}

/// Reads a photograph by the ending of its name: `.exr`, `.tif`, `.tiff`, `.png`, `.jpg` or `.jpeg`.
///
/// # Errors
/// Bad input names the file and what is wrong with it; of a raw file also how to convert it.
pub fn read(path: &Path) -> Result<Photo> {
    let ending = ending(path);
    if let Some(bad) = why_not_read(path) {
        return Err(bad.in_file(path).into());
    }
    let bytes = read_bounded(path, MAX_DATA_BYTES, "no photograph is so large: this is something else")?;
    let metadata = Metadata::of(&ending, &bytes);
    if matches!(&*ending, "jpg" | "jpeg") {
        let picture = jpeg(&bytes).map_err(|bad| bad.in_file(path))?;
        return Ok(Photo { picture, samples: Samples::Integer(8), metadata });
    }
    let bits = bits(&ending, &bytes);
    drop(bytes);
    let raster = image_file::read(path)?;
    let samples = if raster.integer { Samples::Integer(bits) } else { Samples::Float };
    let (width, height) = (raster.width, raster.height);
    let mut planes = raster.channels.into_iter();
    let first = planes.next().unwrap_or_default();
    let planes = match (planes.next(), planes.next()) {
        (Some(green), Some(blue)) => [first, green, blue],
        _ => [first.clone(), first.clone(), first],
    };
    Ok(Photo { picture: PlanarImage { width, height, planes }, samples, metadata })
}

/// Width and height of a photograph, without its pixels where its format tells them first.
///
/// # Errors
/// As [`read`].
pub fn size(path: &Path) -> Result<(usize, usize)> {
    let ending = ending(path);
    let told = match &*ending {
        "exr" => exr::meta::MetaData::read_from_file(path, false)
            .ok()
            .and_then(|meta| meta.headers.first().map(|h| (h.layer_size.width(), h.layer_size.height()))),
        _ => image::ImageReader::open(path)
            .ok()
            .and_then(|reader| reader.into_dimensions().ok())
            .map(|(width, height)| (width as usize, height as usize)),
    };
    match told {
        Some(size) => Ok(size),
        None => read(path).map(|photo| (photo.picture.width, photo.picture.height)),
    }
}

/// How a file with this ending stores its samples, by its head: floats in an `OpenEXR` or a TIFF of floats.
pub fn samples(ending: &str, bytes: &[u8]) -> Samples {
    let float_tiff = || {
        let tag = tiff::decoder::Decoder::new(Cursor::new(bytes)).ok()?.get_tag_u16_vec(tiff::tags::Tag::SampleFormat).ok()?;
        Some(tag.first() == Some(&3))
    };
    match ending {
        "exr" => Samples::Float,
        "tif" | "tiff" if float_tiff() == Some(true) => Samples::Float,
        _ => Samples::Integer(bits(ending, bytes)),
    }
}

/// Bits of a whole number in a PNG or TIFF; 8 where it cannot be told.
fn bits(ending: &str, bytes: &[u8]) -> u8 {
    match ending {
        // IHDR: signature, length and name take 16 bytes, width and height 8.
        "png" => bytes.get(24).copied().unwrap_or(8),
        "tif" | "tiff" => {
            tiff::decoder::Decoder::new(Cursor::new(bytes)).ok().and_then(|mut d| d.colortype().ok()).map_or(8, |c| c.bit_depth())
        }
        _ => 8,
    }
}

fn jpeg(bytes: &[u8]) -> Result<PlanarImage, BadInput> {
    let unreadable = |e: image::ImageError| {
        let why = e.to_string();
        BadInput::new(format!("not a readable JPEG image: {}", why.trim()), "write the image again")
    };
    let reader = || image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Jpeg);
    let (width, height) = reader().into_dimensions().map_err(unreadable)?;
    if u64::from(width) * u64::from(height) > MAX_PIXELS || width == 0 || height == 0 {
        return Err(BadInput::new(format!("the image is {width} x {height}; from 1 to {MAX_PIXELS} pixels are read"), "reduce it"));
    }
    let rgb = reader().decode().map_err(unreadable)?.into_rgb8();
    let plane = |c: usize| rgb.as_raw().iter().skip(c).step_by(3).map(|&v| f32::from(v) / 255.0).collect();
    Ok(PlanarImage { width: width as usize, height: height as usize, planes: [plane(0), plane(1), plane(2)] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::error::Error;

    #[test]
    fn interpolation_gives_pixels_back_and_lines_between_them() {
        let mut picture = PlanarImage::new(5, 4);
        for (i, v) in picture.planes[1].iter_mut().enumerate() {
            *v = (i % 5) as f32 + 10.0 * (i / 5) as f32;
        }
        assert_eq!(picture.sample(3.0, 2.0), Some([0.0, 23.0, 0.0]));
        // A ramp is kept where all four neighbours lie inside.
        assert!((picture.sample(2.25, 1.5).unwrap()[1] - 17.25).abs() < 1e-5);
        assert!(picture.sample(-0.01, 1.0).is_none() && picture.sample(4.01, 1.0).is_none() && picture.sample(f64::NAN, 1.0).is_none());
    }

    #[test]
    fn turning_moves_the_upper_left_pixel_to_the_right_and_down() {
        let mut picture = PlanarImage::new(3, 2);
        picture.planes[0] = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let turned = picture.quarter_turned();
        assert_eq!((turned.width, turned.height, &turned.planes[0][..]), (2, 3, &[4.0, 1.0, 5.0, 2.0, 6.0, 3.0][..]));
        assert_eq!(turned.quarter_turned(), picture.half_turned());
    }

    #[test]
    fn raw_and_broken_files_say_what_to_do() {
        for (name, words) in [
            ("IMG_1.CR2", &["dcraw -4 -T -o 0 -t 0 IMG_1.CR2", "IMG_1.CR2"][..]),
            ("L1.RWL", &["dcraw_emu -4 -T -o 0 -t 0 L1.RWL"]),
            ("G.GPR", &["-t 0"]),
            ("IMG_2.HEIC", &["heif-convert IMG_2.HEIC IMG_2.png", ".jpg"]),
            ("a.webp", &["dwebp a.webp -o a.png", ".jpg"]),
            ("a.avif", &["heif-convert", ".jpg"]),
            ("a.gif", &[".jpg"]),
            ("a", &["no ending", ".jpg"]),
        ] {
            let message = read(Path::new(name)).unwrap_err().to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{message}");
        }
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.jpg", "a.png", "a.tif", "a.exr"] {
            let path = folder.path().join(name);
            std::fs::write(&path, b"\xff\xd8\xff broken").unwrap();
            assert!(matches!(read(&path), Err(Error::BadInput(_))), "{name}");
        }
    }

    #[test]
    fn the_depth_of_whole_numbers_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_fn(3, 2, |x, _| image::Rgb([1000 * x as u16, 0, 65535]));
        let flat = image::RgbImage::from_pixel(3, 2, image::Rgb([51, 0, 255]));
        for (name, bits) in [("a.png", 16), ("a.tif", 16), ("b.png", 8), ("b.jpg", 8)] {
            let path = folder.path().join(name);
            if bits == 16 {
                deep.save(&path).unwrap();
            } else {
                flat.save(&path).unwrap();
            }
            let photo = read(&path).unwrap();
            assert_eq!(photo.samples, Samples::Integer(bits), "{name}");
            assert_eq!((photo.picture.width, photo.picture.height), (3, 2));
            assert_eq!(size(&folder.path().join(name)).unwrap(), (3, 2), "{name}");
        }
        let photo = read(&folder.path().join("a.png")).unwrap();
        assert_eq!(photo.picture.at(2, 1), [2000.0 / 65535.0, 0.0, 1.0]);
    }
}
