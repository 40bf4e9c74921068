//! A decoded image.

use crate::error::BadInput;

/// Most pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 26;

/// A decoded image of one or three channels, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// One channel, or red, green and blue; each `height` rows of `width` samples.
    pub channels: Vec<Vec<f32>>,
    /// The alpha channel, where the file has one.
    pub alpha: Option<Vec<f32>>,
    /// Whether the file holds whole numbers; they are scaled so that the largest possible one is 1.
    pub integer: bool,
}

/// Refuses an image with more pixels than [`MAX_PIXELS`].
pub(super) fn check_size(width: u64, height: u64) -> Result<(), BadInput> {
    if width.checked_mul(height).is_none_or(|n| n > MAX_PIXELS) {
        return Err(BadInput::new(format!("the image is {width} x {height}, more than {MAX_PIXELS} pixels"), "reduce it"));
    }
    Ok(())
}

/// Whether a sample has no value: not a number, infinite, or the largest float of single precision, which some programs write where they have no data.
pub(super) fn is_lacking(v: f32) -> bool {
    v.is_nan() || v.abs() >= f32::MAX
}

/// Refuses an image without pixels, or with one that has no value: not a number, infinite, or what the file says to be no data.
pub(super) fn checked(raster: Raster) -> Result<Raster, BadInput> {
    if raster.width == 0 || raster.height == 0 {
        return Err(BadInput::new("the image has no pixels", "use another one"));
    }
    if let Some(place) = raster.channels.iter().chain(&raster.alpha).flatten().position(|v| is_lacking(*v)) {
        let pixel = place % (raster.width * raster.height);
        let problem = format!(
            "the pixel in column {}, row {} has no value (not a finite number, or marked as no data)",
            pixel % raster.width,
            pixel / raster.width
        );
        return Err(BadInput::new(problem, "fill such holes before use"));
    }
    Ok(raster)
}
