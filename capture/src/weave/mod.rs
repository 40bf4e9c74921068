//! What a rectified close-up says about a woven or embossed surface: where it repeats, how its threads lie, how wide they are, which is on top.
//!
//! ```text
//! photograph -> field (cut, even light) -> spectrum -> lattice of its peaks -> grid of threads -> fold (one repeat, noise averaged)
//!                                              \-> autocorrelation                        \-> model: draft and shape -> class, widths
//! ```
//!
//! Angles are counter-clockwise with y up, though the rows of a photograph run down. Warp threads are those nearer to the vertical.
//! How each step works, and how well, stands in `docs/weave-analysis.md`.

#![allow(clippy::cast_possible_wrap, reason = "pixels, bins and threads are counted with signs, and far below 2^63")]

mod autocorrelation;
mod class;
mod cloth;
mod colour;
mod field;
mod finding;
mod fold;
mod gaps;
mod grid;
mod hole;
mod labels;
mod lattice;
mod material;
mod model;
mod orientation;
mod relief;
mod report;
mod scale;
mod spectrum;

pub use class::{Class, Direction};
pub use finding::{Code, Finding};
pub use material::Guesses;
pub use relief::{Profile, Relief};
pub use report::{Analysis, Axis, MIN_PIXELS_A_THREAD, Measured, Weave};

use biscale::error::{BadInput, Result};
use biscale::geometry::weave::draft::Draft;

/// A linear photograph, rectified so that the sample's plane is seen straight from above.
#[derive(Clone, Copy, Debug)]
pub struct Photo<'a> {
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

/// What the caller knows already. A draft comes from `biscale::geometry::weave::wif::read` or `Draft::from_fn`.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The draft, if it is known (`--weave`, `--wif`): only its place and its threads are measured.
    pub draft: Option<Draft>,
}

/// Smallest side of a photograph in pixels.
pub const MIN_SIDE: usize = 48;

/// Analyses a photograph.
///
/// A photograph that cannot be understood is no error: the findings say what is missing, with what was measured and what is needed, and
/// the parts of the result that depend on it are `None`.
///
/// # Errors
/// Bad input if sizes do not fit together, if there are fewer than [`MIN_SIDE`] pixels a side, or if a value is not a number.
pub fn analyse(photo: &Photo<'_>, options: &Options) -> Result<Analysis> {
    check(photo)?;
    report::analyse(photo, options)
}

fn check(photo: &Photo<'_>) -> Result<()> {
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
    if photo.mm_per_pixel.is_some_and(|mm| !(1e-9..=1e9).contains(&mm)) {
        return bad("the size of a pixel is not 1e-9 to 1e9 mm".into(), "give millimetres per pixel, or none");
    }
    Ok(())
}
