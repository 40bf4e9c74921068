//! The light of a photograph that was held out, beside a prediction: its own stray light, and its scale.

use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::params::PARAMS;

/// What is found of the light of a held-out photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeldOutLight {
    /// What the prediction is multiplied by; 1 where the irradiance is known.
    pub(super) factor: f64,
    /// Stray light.
    pub(super) stray_light: [f64; 3],
}

/// What may be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Free {
    /// Whether the irradiance is not known.
    pub(super) factor: bool,
    /// Stray light of the fitted photographs over their mean radiance, where there may be any at all.
    pub(super) stray_light: Option<[f64; 3]>,
}

/// Rounds in which factor and stray light are found in turns: their difference falls by more than half in each.
const ROUNDS: usize = 24;

impl HeldOutLight {
    /// The light that makes a prediction nearest to a photograph. Stray light is found as far as unlit pixels or the background allow.
    pub(super) fn of(bins: &DirectionBins, predicted: &[[f64; 3]], free: Free) -> Self {
        let mut found = Self { factor: 1.0, stray_light: [0.0; 3] };
        for _ in 0..if free.factor { ROUNDS } else { 1 } {
            if free.factor {
                found.factor = scale_of(bins, predicted, found.stray_light);
            }
            if let Some(usual) = free.stray_light {
                found.stray_light = stray_light(bins, predicted, found.factor, usual);
            }
        }
        found
    }
}

/// What is between the prediction and the photograph in all bins alike. Where the photograph shows nothing dark, that of the fitted photographs,
/// `usual` over their mean, is expected.
fn stray_light(bins: &DirectionBins, predicted: &[[f64; 3]], factor: f64, usual: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        let [mut value, sigma] = bins.dark.prior(bins.mean, c);
        if bins.dark.unlit.is_none() {
            value = value.max(usual[c] * bins.mean[c]);
        }
        let precision = 1.0 / sigma.max(LEAST_SIGMA).powi(2);
        let (mut sum, mut weight) = (precision * value, precision);
        for (bin, p) in bins.bins.iter().zip(predicted) {
            let w = bin.weight / bin.sigma[c].powi(2);
            sum += w * (bin.mean[c] - factor * p[c]);
            weight += w;
        }
        // What unlit pixels and background do not allow is an error of the prediction.
        let most = value + PARAMS.stray_light_reach * sigma;
        (sum / weight).min(most).max(0.0)
    })
}

/// Least standard deviation of stray light: that of a photograph that is black all over.
const LEAST_SIGMA: f64 = 1e-12;

/// The factor of a prediction, without stray light, that is nearest to the photograph.
fn scale_of(bins: &DirectionBins, predicted: &[[f64; 3]], stray_light: [f64; 3]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (bin, p) in bins.bins.iter().zip(predicted) {
        for c in 0..3 {
            product += bin.count as f64 * p[c] * (bin.mean[c] - stray_light[c]);
            square += bin.count as f64 * p[c].powi(2);
        }
    }
    if square > 0.0 && product > 0.0 { product / square } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photograph::dark::Dark;
    use crate::residuals::distant::tests::bin;

    fn bins(mean: f64, dark: Dark) -> DirectionBins {
        DirectionBins { bins: vec![bin(mean), bin(mean + 0.2)], mean: [mean; 3], dark, ..DirectionBins::default() }
    }

    #[test]
    fn stray_light_is_what_lies_between_as_far_as_unlit_pixels_allow() {
        let predicted = [[0.5; 3], [0.7; 3]];
        let found =
            |mean: f64, dark: Dark| HeldOutLight::of(&bins(mean, dark), &predicted, Free { factor: false, stray_light: Some([0.0; 3]) });
        let free = found(0.51, Dark::default()).stray_light;
        assert!(free.iter().all(|v| (1e-4..0.01).contains(v)), "{free:?}");
        // Unlit pixels are dark, or darker than black: the difference is no stray light.
        for unlit in [0.0, -0.05] {
            let told = found(0.6, Dark { unlit: Some([unlit; 3]), background: None }).stray_light;
            assert!(told.iter().all(|v| *v < 0.005), "{told:?}");
        }
        let none = HeldOutLight::of(&bins(0.6, Dark::default()), &predicted, Free { factor: false, stray_light: None });
        assert_eq!(none, HeldOutLight { factor: 1.0, stray_light: [0.0; 3] });
    }

    #[test]
    fn a_factor_is_found_beside_stray_light_whatever_the_unit() {
        for factor in [3.0, 0.3, 1.1] {
            let seen = |v: f64| factor * v + 0.002;
            let photograph = DirectionBins { bins: vec![bin(seen(0.2)), bin(seen(1.0))], mean: [seen(0.6); 3], ..DirectionBins::default() };
            let found = HeldOutLight::of(&photograph, &[[0.2; 3], [1.0; 3]], Free { factor: true, stray_light: Some([0.0; 3]) });
            assert!((found.factor / factor - 1.0).abs() < 0.02, "{found:?} for {factor}");
        }
    }
}
