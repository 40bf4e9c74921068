//! How well the scale is known that all colours share: exposure times colour is all that a photograph shows.

use super::prepared::Prepared;
use crate::residuals::input::Interreflection;
use crate::uncertainty::identify::Identified;

/// Relative standard deviation of a scale that nothing tells.
const UNKNOWN: f64 = 1.0;
/// Share of the light that is reflected more than once and left out, from which on it is told: half of what the model is believed to
/// ([`crate::photograph::direction_bins::RELATIVE_NOISE`]).
const TOLD: f64 = 0.01;

/// See above.
pub(super) struct ScaleOfColours {
    /// Relative standard deviation.
    pub(super) sigma: f64,
    /// Whether it rests on something that nobody gave or computed.
    pub(super) assumed: bool,
    /// What the user should know.
    pub(super) notes: Vec<String>,
}

impl ScaleOfColours {
    /// It is that of the distant photographs' irradiance. Where the close-up has another one than its file says, either may be wrong. `missing` is
    /// the relative light of reflections that the fit leaves out, `None` where there was no time for it.
    pub(super) fn of(prepared: &Prepared<'_>, identified: &Identified, missing: Option<f64>) -> Self {
        let stated = prepared.distant[0];
        let both_known = prepared.close_up.as_ref().is_some_and(|found| found.exposure_sigma.is_some());
        let exposure = identified.known.iter().find(|k| k.kind == "exposure" && both_known);
        let disagreement = exposure.map_or(0.0, |k| k.value - 1.0);
        let sigma = if stated.exposure_known { stated.irradiance_sigma().hypot(disagreement) } else { UNKNOWN };
        let left_out = missing.filter(|share| *share > TOLD);
        let notes = left_out.map(|share| {
            format!(
                "the fitted material would reflect {:.1} % of what the distant photographs show more than once, which the fit leaves out: what that changes \
                 is in the standard deviations",
                100.0 * share
            )
        });
        Self {
            sigma: sigma.hypot(missing.unwrap_or(0.0)),
            assumed: missing.is_none() || stated.stated_irradiance_sigma.is_none() || !stated.exposure_known,
            notes: notes.into_iter().collect(),
        }
    }
}

/// How much of the light of the distant photographs was `traced` as reflected more than once: relative RMS over the direction bins.
pub(super) fn share_of(prepared: &Prepared<'_>, traced: &Interreflection) -> f64 {
    let (mut missing, mut energy) = (0.0, 0.0);
    for (bin, extra) in prepared.fine.iter().flat_map(|p| &p.bins).zip(traced.bins.iter().flatten()) {
        for c in 0..3 {
            missing += bin.count as f64 * (bin.irradiance[c] * extra[c]).powi(2);
            energy += bin.count as f64 * bin.mean[c].powi(2);
        }
    }
    if energy > 0.0 { (missing / energy).sqrt() } else { 0.0 }
}
