//! What an analysis takes: a rectified photograph, and what is known of its weave beforehand.

use biscale::error::{BadInput, Result};
use biscale::geometry::weave::Draft;

/// A linear photograph, rectified so that the sample's plane is seen straight from above.
#[derive(Clone, Copy, Debug)]
pub struct RectifiedPhoto<'a> {
    /// Pixels along x.
    pub width: usize,
    /// Pixels along y.
    pub height: usize,
    /// Linear RGB (sRGB primaries), rows from the top; 0 to 1 where white is 1.
    pub rgb: &'a [[f32; 3]],
    /// Pixels that may be used, in the same order; all without one.
    pub mask: Option<&'a [bool]>,
    /// Size of a pixel, if it is known; without it lengths are in pixels.
    pub mm_per_pixel: Option<f64>,
}

/// What the caller knows already. A draft comes from `biscale::geometry::weave::read_wif` or `Draft::from_fn`.
#[derive(Clone, Debug, Default)]
pub struct WeaveOptions {
    /// The draft, if it is known: only its place and its threads are measured.
    pub draft: Option<Draft>,
}

/// Smallest side of a photograph in pixels: a smaller one holds too few repeats. Chosen, not measured.
pub const MIN_SIDE: usize = 48;

/// Millimetres per pixel that are believed: from an atom to a thousand kilometres.
const MM_PER_PIXEL: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Checks sizes and numbers of a photograph.
pub(super) fn check(photo: &RectifiedPhoto<'_>) -> Result<()> {
    let bad = |problem: String, remedy: &str| Err(BadInput::new(problem, remedy).at_field("photo").into());
    let pixels = photo.width.checked_mul(photo.height);
    if pixels != Some(photo.rgb.len()) {
        return bad(
            format!("{} pixels are no picture of {} x {}", photo.rgb.len(), photo.width, photo.height),
            "give width x height pixels",
        );
    }
    if photo.mask.is_some_and(|m| m.len() != photo.rgb.len()) {
        return bad("the mask has another size than the picture".into(), "give a mask of the same size");
    }
    if photo.width.min(photo.height) < MIN_SIDE {
        return bad(format!("the picture has {} x {} pixels", photo.width, photo.height), "give a close-up of at least 48 x 48 pixels");
    }
    if let Some(at) = photo.rgb.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        let problem = format!("the pixel in column {}, row {} is not a number", at % photo.width, at / photo.width);
        return bad(problem, "mask it out and give it a value");
    }
    if photo.mm_per_pixel.is_some_and(|mm| !MM_PER_PIXEL.contains(&mm)) {
        return bad("the size of a pixel is not 1e-9 to 1e9 mm".into(), "give millimetres per pixel, or none");
    }
    Ok(())
}
