//! Noise of a photograph: variance `a + b v` of a value `v`.

use crate::linear::LinearPhoto;
use crate::photo::Samples;
use crate::shoot::CameraSpec;
use biscale::formats::capture::Noise;
use glam::{DMat3, DVec3};

/// Noise of sensor values (0 to 1), the same in all channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Variance of black.
    pub a: f64,
    /// Variance a unit of light.
    pub b: f64,
    /// Where it is from.
    pub source: NoiseSource,
}

/// Where a noise model is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseSource {
    /// Two photographs of an even surface.
    Measured,
    /// The shoot file.
    Given,
    /// A middling camera.
    Assumed,
}

/// Electrons of a full pixel that are assumed at ISO 100: a pixel of about 4 um. Chosen, not measured.
const FULL_WELL: f64 = 20_000.0;
/// One over the variance of a number that is uniform between 0 and 1, which the error of rounding is.
const UNIFORM: f64 = 12.0;
/// Read noise that is assumed, electrons. Chosen, not measured.
const READ_NOISE: f64 = 5.0;

/// The noise of a camera as the shoot file describes it, or of a middling one, at a gain (ISO over 100): `a = (read / well)^2 + step^2 / 12`, `b = 1 / well`.
pub fn of_camera(camera: &CameraSpec, gain: f64, samples: Samples) -> SensorNoise {
    let well = camera.full_well_e.unwrap_or(FULL_WELL) / gain;
    let read = camera.read_noise_e.unwrap_or(READ_NOISE) / well;
    let step = if let Samples::Integer(bits) = samples { 0.5_f64.powi(i32::from(bits)) } else { 0.0 };
    let source = if camera.full_well_e.is_some() { NoiseSource::Given } else { NoiseSource::Assumed };
    SensorNoise { a: read * read + step * step / UNIFORM, b: 1.0 / well, source }
}

/// How noise is measured from two photographs. Chosen, not measured: 16 blocks of 1024 pixels tell a variance with a standard error of 1.1 %.
struct PhotonTransferParams {
    /// Side of a block, px.
    block: usize,
    /// Fewest blocks.
    fewest_blocks: f64,
    /// Mean sensor value below which read noise hides the shot noise.
    least_mean: f64,
    /// Relative difference of the exposures up to which they count as the same.
    same_exposure: f64,
}

const PARAMS: PhotonTransferParams = PhotonTransferParams { block: 32, fewest_blocks: 16.0, least_mean: 0.02, same_exposure: 1e-6 };

/// The noise by two linear photographs of the same even surface at the same exposure (photon transfer): half of the variance of their difference against
/// their mean, block by block. Values and result in sensor units. `None` if they do not tell.
pub fn measure(one: &LinearPhoto, two: &LinearPhoto) -> Option<SensorNoise> {
    let block = PARAMS.block;
    let (width, height) = (one.picture.width, one.picture.height);
    if (two.picture.width, two.picture.height) != (width, height) || (one.divisor / two.divisor - 1.0).abs() > PARAMS.same_exposure {
        return None;
    }
    let (p, q) = (&one.picture.planes[1], &two.picture.planes[1]);
    let (mut sum_m, mut sum_v, mut count) = (0.0, 0.0, 0.0);
    for y in (0..height.saturating_sub(block)).step_by(block) {
        for x in (0..width.saturating_sub(block)).step_by(block) {
            let places = || (0..block * block).map(move |k| (y + k / block) * width + x + k % block);
            if places().any(|i| one.saturated[i] || two.saturated[i]) {
                continue;
            }
            let n = (block * block) as f64;
            let (d, m) = places().fold((0.0, 0.0), |(d, m), i| (d + f64::from(p[i] - q[i]), m + 0.5 * f64::from(p[i] + q[i])));
            let (d, m) = (d / n, m / n);
            let v = places().map(|i| (f64::from(p[i] - q[i]) - d).powi(2)).sum::<f64>() / (n - 1.0) / 2.0;
            // Values are over the divisor: back to sensor units.
            sum_m += m * one.divisor;
            sum_v += v * one.divisor * one.divisor;
            count += 1.0;
        }
    }
    // An even surface has nearly one mean: the slope through black is what it tells, and read noise is beneath it.
    let (m, v) = (sum_m / count, sum_v / count);
    (count >= PARAMS.fewest_blocks && m > PARAMS.least_mean && v > 0.0).then(|| SensorNoise {
        a: 0.0,
        b: v / m,
        source: NoiseSource::Measured,
    })
}

impl SensorNoise {
    /// The noise of values that were divided by `divisor` (of `brackets` photographs together) and multiplied by a colour matrix: exact for grey, near for others.
    pub fn written(&self, divisor: f64, brackets: usize, matrix: Option<DMat3>) -> Noise {
        let (a, b) = (self.a * brackets as f64 / (divisor * divisor), self.b / divisor);
        let source = match self.source {
            NoiseSource::Measured => "measured",
            NoiseSource::Given => "given",
            NoiseSource::Assumed => "assumed",
        };
        let m = matrix.unwrap_or(DMat3::IDENTITY);
        // Camera values of a grey of 1.
        let grey = m.inverse() * DVec3::ONE;
        let rows = m.transpose();
        let squares = |c: usize| rows.col(c) * rows.col(c);
        let of = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
        Noise { a: of(&|c| a * squares(c).element_sum()), b: of(&|c| b * squares(c).dot(grey.max(DVec3::ZERO))), source: source.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::PlanarImage;

    #[test]
    fn two_flats_tell_the_shot_noise() {
        let mut state = 3_u32;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 24)
        };
        let mut flat = || {
            let mut picture = PlanarImage::new(200, 160);
            for v in &mut picture.planes[1] {
                // Nearly normal: the sum of twelve uniform numbers has unit variance.
                let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                *v = ((0.5 + (0.5 / 10_000.0_f64).sqrt() * normal) / 0.25) as f32;
            }
            LinearPhoto { saturated: vec![false; 200 * 160], picture, divisor: 0.25 }
        };
        let (one, two) = (flat(), flat());
        let noise = measure(&one, &two).unwrap();
        assert!((noise.b * 10_000.0 - 1.0).abs() < 0.05, "{}", noise.b);
        let written = noise.written(0.25, 1, Some(2.0 * DMat3::IDENTITY));
        // Values 2 / 0.25 times as large: variance b v with b twice over 0.25.
        assert!((written.b[0] - 8.0 * noise.b).abs() < 1e-12 && written.source == "measured");
    }
}
