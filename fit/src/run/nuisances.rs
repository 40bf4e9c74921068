//! What a fit found of the photographs, and not of the material, that is far from what the fit file says: it is explained, and should be checked.

use crate::residuals::unknowns::LIGHT_REACH;
use crate::uncertainty::identify::Known;

/// Standard deviations of a prior from which on what is found is told. Chosen, not measured: what Huber's loss takes for an outlier.
const FAR: f64 = 2.5;
/// Stray light over the mean radiance of a photograph from which on it is told. Chosen, not measured: a clean lens has less.
const MUCH_STRAY_LIGHT: f64 = 0.03;

/// What the user should check.
pub(super) fn notes(known: &[Known]) -> Vec<String> {
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
    let veils = known.iter().filter(|k| k.kind == "veil" && k.value > (MUCH_STRAY_LIGHT * k.range).max(FAR * k.sigma)).map(|veil| {
        format!(
            "{} is {:.1} % of the photograph's mean: keep light off the lens, and the room dark",
            veil.name,
            100.0 * veil.value / veil.range
        )
    });
    lights.chain(veils).collect()
}
