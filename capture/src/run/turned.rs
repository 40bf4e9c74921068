//! Whether the pixels of a photograph are turned by a half against those that the camera was calibrated with: sizes do not tell.

use crate::lens::Lens;
use crate::lens_group::Turn;
use crate::pose::{PoseEstimate, Sighting};
use crate::vision::pnp;
use biscale::error::Result;

/// What is told of such a photograph.
pub(super) const MESSAGE: &str = "its pixels are turned by a half against those of the other photographs, whose centre of the lens lies elsewhere; they were turned back (write \
                                  `dcraw -t 0` to leave them as the sensor has them)";

/// Fewest points to judge by, logarithm of the likelihoods' ratio, and ratio of the errors from which on a turn is taken for certain. Chosen, not measured;
/// `capture/tests/lenses.rs` holds both ways.
const FEWEST: usize = 8;
const LEAST_LOG_LIKELIHOOD: f64 = 15.0;
const LEAST_RATIO: f64 = 1.2;

/// What points on the sample say of a turn by a half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evidence {
    /// Whether the pixels are to be turned.
    pub turned: bool,
    /// Whether that is certain; of pixels that were turned by a quarter one way round or the other is right, and the likelier is taken.
    pub certain: bool,
}

/// Whether points on the sample are explained better by pixels that are turned by a half.
///
/// A turn moves the lens's centre to the mirrored place. Where that lies in the middle, and the lens does not distort, nothing tells, and nothing is lost.
pub(super) fn by_a_half(sightings: &[Sighting], lens: &Lens, quarter: Turn) -> Result<Evidence> {
    let nothing = Evidence { turned: false, certain: quarter == Turn::None };
    let (Some(straight), Some(turned)) = (pnp::pose(sightings, lens)?, pnp::pose(sightings, &lens.half_turned())?) else {
        return Ok(nothing);
    };
    let used = |e: &PoseEstimate| e.used.iter().filter(|u| **u).count();
    let points = used(&straight).min(used(&turned));
    let ratio = straight.rms_px / turned.rms_px;
    // Two residuals a point, whose variance is not known: 2 n ln(ratio).
    let log_likelihood = 2.0 * points as f64 * ratio.ln();
    let certain = |ratio: f64| points >= FEWEST && ratio > LEAST_RATIO && log_likelihood.abs() > LEAST_LOG_LIKELIHOOD;
    Ok(match quarter {
        Turn::None => Evidence { turned: certain(ratio) && used(&turned) >= used(&straight), certain: true },
        Turn::Quarter => Evidence { turned: ratio > 1.0, certain: certain(ratio.max(1.0 / ratio)) },
    })
}
