//! Image files, by the endings of their names.

use super::decode::{self, Wanted};
use super::raster::{Raster, checked, is_lacking};
use crate::bounded_file::{MAX_DATA_BYTES, read_bounded};
use crate::error::{BadInput, Error, Result};
use std::path::Path;

/// Share of the light of a map that values below 0 may be: resampling with sharp filters makes them beside bright sources. Chosen, not measured.
const NEGATIVE_SHARE: f64 = 0.01;

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

/// Reads linear radiance: `.hdr` (Radiance) or `.exr`, three channels, and a note where values below 0 were taken as 0.
///
/// # Errors
/// As [`read`]; and values below 0 that are more than 1 % of the light, with the pixel of the first.
pub fn read_radiance(path: &Path) -> Result<(Raster, Option<String>)> {
    let bytes = read_bounded(path, MAX_DATA_BYTES, "write a smaller image")?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let raster = match &*ending {
        "hdr" => decode::hdr(&bytes).and_then(checked),
        "exr" => by_ending(path, &bytes, Wanted::Radiance).and_then(checked),
        _ => Err(BadInput::new(format!("the ending \"{ending}\" is not known for light"), "use .hdr or .exr")),
    };
    let mut raster = raster.map_err(|bad| bad.in_file(path))?;
    let mut note = without_negatives(&mut raster).map_err(|bad| bad.in_file(path))?;
    if let Some(exposure) = decode::hdr_exposure(&bytes).filter(|_| ending == "hdr") {
        let told = format!(
            "the file says that its values are {exposure} times radiance (EXPOSURE): they are taken as they are; write `scale = {}` for radiance",
            1.0 / exposure
        );
        note = Some(note.map_or(told.clone(), |other| format!("{other}; {told}")));
    }
    while raster.channels.len() < 3 {
        raster.channels.push(raster.channels[0].clone());
    }
    Ok((raster, note))
}

/// Takes radiance below 0 as 0, and says so.
fn without_negatives(raster: &mut Raster) -> Result<Option<String>, BadInput> {
    let values = || raster.channels.iter().flatten().map(|&v| f64::from(v));
    let (negative, light) = (-values().map(|v| v.min(0.0)).sum::<f64>(), values().map(|v| v.max(0.0)).sum::<f64>());
    let Some(first) = raster.channels.iter().flatten().position(|v| *v < 0.0) else { return Ok(None) };
    let pixel = first % (raster.width * raster.height);
    let place = format!("column {}, row {}", pixel % raster.width, pixel / raster.width);
    if negative > NEGATIVE_SHARE * light {
        let problem = format!("the radiance in {place} is negative, and such values are {:.1} % of the light", 100.0 * negative / light);
        return Err(BadInput::new(problem, "light is 0 or more"));
    }
    let mut count = 0;
    for value in raster.channels.iter_mut().flatten().filter(|v| **v < 0.0) {
        *value = 0.0;
        count += 1;
    }
    Ok(Some(format!("{count} values below 0, the first in {place}, {:.1e} of the light in all, are taken as 0", negative / light)))
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
