//! Image files, by the endings of their names.

use super::decode::{self, Wanted};
use super::raster::{Raster, checked, is_lacking};
use crate::bounded_file::{MAX_DATA_BYTES, read_bounded};
use crate::error::{BadInput, Error, Result};
use std::path::Path;

/// Reads an image by the ending of its name: `.png`, `.tif`, `.tiff` or `.exr`.
///
/// TIFF: whole numbers of 1 to 32 bits or floats, grey, RGB or a palette. EXR: the channels R, G, B, else the only one, else Z or Y.
///
/// # Errors
/// Bad input names the file and what is wrong with it.
pub fn read(path: &Path) -> Result<Raster> {
    let bytes = read_bounded(path, MAX_DATA_BYTES, "write a smaller image")?;
    parse(path, &bytes).map_err(|bad| bad.in_file(path).into())
}

/// Reads heights as [`read`] does; of an EXR the channel Z, in whichever layer it is, before all others.
///
/// # Errors
/// As [`read`].
pub fn read_heights(path: &Path) -> Result<Raster> {
    let bytes = read_bounded(path, MAX_DATA_BYTES, "write a smaller image")?;
    by_ending(path, &bytes, Wanted::Heights).and_then(checked).map_err(|bad| bad.in_file(path).into())
}

/// Reads a photograph as [`read`] does, whose pixels may be holes: what has no value becomes NaN.
///
/// # Errors
/// As [`read`], but for such values.
pub fn read_with_holes(path: &Path) -> Result<Raster> {
    let bytes = read_bounded(path, MAX_DATA_BYTES, "write a smaller image")?;
    let mut raster = by_ending(path, &bytes, Wanted::Colour).map_err(|bad| Error::from(bad.in_file(path)))?;
    if raster.width == 0 || raster.height == 0 {
        return Err(BadInput::new("the image has no pixels", "use another one").in_file(path).into());
    }
    for value in raster.channels.iter_mut().flatten().filter(|v| is_lacking(**v)) {
        *value = f32::NAN;
    }
    while raster.channels.len() < 3 {
        raster.channels.push(raster.channels[0].clone());
    }
    Ok(raster)
}

/// Reads linear radiance: `.hdr` (Radiance) or `.exr`, three channels.
///
/// # Errors
/// As [`read`]; and a value below 0, with its pixel.
pub fn read_radiance(path: &Path) -> Result<Raster> {
    let bytes = read_bounded(path, MAX_DATA_BYTES, "write a smaller image")?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let raster = match &*ending {
        "hdr" => decode::hdr(&bytes).and_then(checked),
        "exr" => by_ending(path, &bytes, Wanted::Radiance).and_then(checked),
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

/// Decodes the bytes of an image file.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Raster, BadInput> {
    checked(by_ending(path, bytes, Wanted::Colour)?)
}

fn by_ending(path: &Path, bytes: &[u8], wanted: Wanted) -> Result<Raster, BadInput> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    Ok(match &*ending {
        "png" => decode::png(bytes)?,
        "tif" | "tiff" => decode::tiff(bytes)?,
        "exr" => decode::exr(bytes, wanted)?,
        _ => return Err(BadInput::new(format!("the ending \"{ending}\" is not known for an image"), "use .png, .tif, .tiff or .exr")),
    })
}
