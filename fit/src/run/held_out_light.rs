//! The light of a photograph that was held out, beside a prediction: its own stray light, and its scale.

use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::params::PARAMS;

/// The stray light of a held-out photograph: what is between the prediction and the photograph in all bins alike, as far as its unlit pixels or
/// background allow. Where it shows neither, that of the fitted photographs, `usual` over their mean, is expected.
pub(super) fn stray_light(bins: &DirectionBins, predicted: &[[f64; 3]], usual: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| {
        let [mut value, sigma] = bins.dark.prior(bins.mean, c);
        if bins.dark.unlit.is_none() {
            value = value.max(usual[c] * bins.mean[c]);
        }
        let precision = 1.0 / sigma.max(f64::MIN_POSITIVE.sqrt()).powi(2);
        let (mut sum, mut weight) = (precision * value, precision);
        for (bin, p) in bins.bins.iter().zip(predicted) {
            let w = bin.weight / bin.sigma[c].powi(2);
            sum += w * (bin.mean[c] - p[c]);
            weight += w;
        }
        // What unlit pixels and background do not allow is an error of the prediction.
        let most = value + PARAMS.stray_light_reach * sigma;
        (sum / weight).clamp(0.0, most)
    })
}

/// The factor of a prediction, without stray light, that is nearest to the photograph.
pub(super) fn scale_of(bins: &DirectionBins, predicted: &[[f64; 3]], stray_light: [f64; 3]) -> f64 {
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
        let free = stray_light(&bins(0.51, Dark::default()), &predicted, [0.0; 3]);
        assert!(free.iter().all(|v| (0.0..0.01).contains(v) && *v > 1e-4), "{free:?}");
        // Unlit pixels are dark: the difference is no stray light.
        let dark = Dark { unlit: Some([0.0; 3]), background: None };
        let told = stray_light(&bins(0.6, dark), &predicted, [0.0; 3]);
        assert!(told.iter().all(|v| *v < 0.005), "{told:?}");
    }

    #[test]
    fn a_scale_is_found_beside_stray_light() {
        let photograph = DirectionBins { bins: vec![bin(1.3), bin(2.5)], ..DirectionBins::default() };
        assert!((scale_of(&photograph, &[[1.0; 3], [2.0; 3]], [0.1; 3]) - 1.2).abs() < 1e-12);
    }
}
