//! What a fit found of the photographs, and not of the material, that is far from what the fit file says: it is explained, and should be checked.

use super::prepared::Prepared;
use crate::residuals::unknowns::LIGHT_REACH;
use crate::uncertainty::identify::Known;

/// Standard deviations of a prior from which on what is found is told. Chosen, not measured: what Huber's loss takes for an outlier.
const FAR: f64 = 2.5;
/// Stray light over the mean radiance of a photograph from which on it is told. Chosen, not measured: a clean lens has less.
const MUCH_STRAY_LIGHT: f64 = 0.03;

/// Least standard deviation of an exposure that is told of: what is less is no matter for anybody.
const LEAST_EXPOSURE_SIGMA: f64 = 0.005;

/// What the user should check.
pub(super) fn notes(prepared: &Prepared<'_>, known: &[Known]) -> Vec<String> {
    let lights = known.iter().filter(|k| k.kind == "light").filter_map(|light| {
        let sigma = light.range / (2.0 * LIGHT_REACH);
        (light.value.abs() > FAR * sigma).then(|| {
            format!(
                "{} was found {:.1} degrees from what the file says, {:.1} of its standard deviations: the fit explains it; check this light",
                light.name,
                light.value,
                (light.value / sigma).abs()
            )
        })
    });
    let stated = prepared.close_up.as_ref().and_then(|found| found.exposure_sigma);
    let exposure = stated.zip(known.iter().find(|k| k.kind == "exposure")).and_then(|(sigma, exposure)| {
        let off = 1.0 / exposure.value - 1.0;
        (off.abs() > FAR * sigma.max(LEAST_EXPOSURE_SIGMA)).then(|| {
            format!(
                "the close-up is {:.0} % {} than its irradiance and that of the distant photographs say: one of the two is wrong, and all colours are \
                 uncertain by as much",
                100.0 * off.abs(),
                if off > 0.0 { "brighter" } else { "darker" }
            )
        })
    });
    let veils = known.iter().filter(|k| k.kind == "veil" && k.value > (MUCH_STRAY_LIGHT * k.range).max(FAR * k.sigma)).map(|veil| {
        format!(
            "{} is {:.1} % of the photograph's mean: keep light off the lens, and the room dark",
            veil.name,
            100.0 * veil.value / veil.range
        )
    });
    lights.chain(exposure).chain(veils).collect()
}
