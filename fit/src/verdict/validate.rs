//! A photograph that was held out, and how far the fitted material is from it.

use crate::photograph::image::Photograph;
use crate::verdict::picture::RenderedPhotograph;
use biscale::render::Light;
use glam::DVec3;
use serde::Serialize;

/// Least angle between the light of a validation photograph and that of every fitted one, degrees: nearer, it proves little.
pub const LEAST_ANGLE_DEG: f64 = 10.0;
/// A validation error passes up to this.
pub const MOST_ERROR: f64 = 0.05;
/// And up to this many times that of training.
pub const MOST_RATIO: f64 = 2.0;
/// A training error below this is one of the noise: nothing can be twice as good as what the model leaves out.
pub const LEAST_TRAINING: f64 = crate::photograph::direction_bins::RELATIVE_NOISE;
/// Luminance of a white diffuse surface that faces the light, cd/m², for colour differences (reference white of ITU-R BT.2408).
pub const WHITE: f64 = 203.0;

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Within the limits.
    Pass,
    /// Not within them.
    Fail,
    /// The light is too near to that of a fitted photograph to prove anything.
    Refused,
}

/// One validation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Validation {
    /// The photograph.
    pub photograph: String,
    /// What came of it.
    pub verdict: Verdict,
    /// Relative RMS difference over the bins of directions, as the fit sees them.
    pub relative_rms: f64,
    /// The same over single pixels.
    pub pixel_relative_rms: f64,
    /// The first over that of training.
    pub ratio: f64,
    /// Mean colour difference of the pixels (ITU-R BT.2124), a white surface that faces the light at [`WHITE`].
    pub delta_e_itp: f64,
    /// Least angle to the light of a fitted photograph, degrees.
    pub angle_deg: f64,
    /// Pixels compared.
    pub pixels: usize,
    /// Stray light that was found in it.
    pub stray_light: [f64; 3],
    /// What the prediction was multiplied by, where the irradiance was not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<f64>,
}

/// Largest error of a held-out photograph that passes, against that of training.
pub fn limit(training: f64) -> f64 {
    MOST_ERROR.min(MOST_RATIO * training.max(LEAST_TRAINING))
}

/// What came of an error, against that of training, with so far a light.
pub fn verdict(error: f64, training: f64, angle_deg: f64) -> Verdict {
    if angle_deg < LEAST_ANGLE_DEG {
        Verdict::Refused
    } else if error <= limit(training) {
        Verdict::Pass
    } else {
        Verdict::Fail
    }
}

/// The direction to a light from the middle of the object.
pub fn direction(photograph: &Photograph) -> DVec3 {
    match photograph.light {
        Light::Directional { to_light, .. } => to_light,
        Light::Point { position, .. } => (position - photograph.object.middle()).normalize_or(DVec3::Z),
    }
}

/// Relative RMS difference of a picture from its photograph over the pixels `used`.
pub fn pixel_relative_rms(photograph: &Photograph, picture: &RenderedPhotograph, used: &[u32]) -> f64 {
    let (mut difference, mut energy) = (0.0, 0.0);
    for &pixel in used {
        for c in 0..3 {
            let (p, m) = (f64::from(photograph.image.rgb[pixel as usize][c]), f64::from(picture.rgb[pixel as usize][c]));
            difference += (p - m).powi(2);
            energy += p * p;
        }
    }
    if energy > 0.0 { (difference / energy).sqrt() } else { f64::INFINITY }
}

/// Mean ΔE ITP of the pixels `used`.
pub fn mean_delta_e_itp(photograph: &Photograph, picture: &RenderedPhotograph, used: &[u32]) -> f64 {
    let irradiance = match photograph.light {
        Light::Directional { irradiance, .. } => irradiance,
        Light::Point { position, intensity } => {
            let d2 = position.distance_squared(photograph.object.middle());
            intensity.map(|i| i / d2)
        }
    };
    let white = irradiance.iter().sum::<f64>() / 3.0 / std::f64::consts::PI;
    let scaled = |rgb: [f32; 3]| rgb.map(|v| f64::from(v).max(0.0) / white.max(f64::MIN_POSITIVE) * WHITE);
    let sum: f64 = used.iter().map(|&p| delta_e_itp(scaled(photograph.image.rgb[p as usize]), scaled(picture.rgb[p as usize]))).sum();
    sum / used.len().max(1) as f64
}

/// ΔE ITP (ITU-R BT.2124) of two colours, linear with Rec. 709 primaries, in cd/m²; about 1 is just visible.
pub fn delta_e_itp(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (itp(a), itp(b));
    DELTA_E_SCALE * (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// Factor of ΔE ITP (ITU-R BT.2124, section 3): about 1 is just visible.
const DELTA_E_SCALE: f64 = 720.0;
/// Linear Rec. 709 to Rec. 2020 (ITU-R BT.2087, four digits).
const REC_709_TO_2020: [[f64; 3]; 3] = [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]];
/// Linear Rec. 2020 to LMS, times 4096 (ITU-R BT.2100, table 7).
const REC_2020_TO_LMS: [[f64; 3]; 3] = [[1688.0, 2146.0, 262.0], [683.0, 2951.0, 462.0], [99.0, 309.0, 3688.0]];
/// Quantised LMS to I, `C_T`, `C_P`, times 4096 (ITU-R BT.2100, table 7).
const LMS_TO_ICTCP: [[f64; 3]; 3] = [[2048.0, 2048.0, 0.0], [6610.0, -13_613.0, 7003.0], [17_933.0, -17_390.0, -543.0]];
/// Brightest luminance of the perceptual quantiser, cd/m² (SMPTE ST 2084).
const PQ_PEAK: f64 = 10_000.0;
/// `m1` of its inverse (SMPTE ST 2084), as are the following.
const PQ_M1: f64 = 2610.0 / 16_384.0;
/// `m2`.
const PQ_M2: f64 = 2523.0 / 32.0;
/// `c1`.
const PQ_C1: f64 = 3424.0 / 4096.0;
/// `c2`.
const PQ_C2: f64 = 2413.0 / 128.0;
/// `c3`.
const PQ_C3: f64 = 2392.0 / 128.0;

/// I, T, P of a linear Rec. 709 colour in cd/m² (ITU-R BT.2100 and BT.2124).
fn itp(rgb: [f64; 3]) -> [f64; 3] {
    let apply = |m: [[f64; 3]; 3], v: [f64; 3]| m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    let over_4096 = |m: [[f64; 3]; 3]| m.map(|row| row.map(|v| v / 4096.0)); // the recommendation's denominator
    let lms = apply(over_4096(REC_2020_TO_LMS), apply(REC_709_TO_2020, rgb));
    let quantised = lms.map(|v| {
        let y = (v / PQ_PEAK).clamp(0.0, 1.0).powf(PQ_M1);
        ((PQ_C1 + PQ_C2 * y) / (1.0 + PQ_C3 * y)).powf(PQ_M2)
    });
    let ictcp = apply(over_4096(LMS_TO_ICTCP), quantised);
    [ictcp[0], 0.5 * ictcp[1], ictcp[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_has_no_hue_and_the_quantiser_is_that_of_the_standard() {
        // 100 cd/m² is .508 of the scale of ST 2084; the reference white of BT.2408, 203 cd/m², .581.
        for (luminance, code) in [(100.0, 0.508), (203.0, 0.581), (10_000.0, 1.0)] {
            let [i, t, p] = itp([luminance; 3]);
            assert!((i - code).abs() < 1e-3 && t.abs() < 1e-3 && p.abs() < 1e-3, "{luminance}: {i} {t} {p}");
        }
    }

    #[test]
    fn equal_colours_do_not_differ_and_two_percent_of_grey_are_just_visible() {
        assert_eq!(delta_e_itp([50.0, 20.0, 10.0], [50.0, 20.0, 10.0]), 0.0);
        let just = delta_e_itp([100.0; 3], [102.0; 3]);
        assert!((0.5..2.5).contains(&just), "{just}");
    }

    #[test]
    fn the_verdict_needs_a_light_from_elsewhere() {
        assert_eq!(verdict(0.03, 0.02, 60.0), Verdict::Pass);
        assert_eq!(verdict(0.045, 0.01, 60.0), Verdict::Fail);
        assert_eq!(verdict(0.03, 0.005, 60.0), Verdict::Pass);
        assert_eq!(verdict(0.06, 0.05, 60.0), Verdict::Fail);
        assert_eq!(verdict(0.01, 0.01, 9.0), Verdict::Refused);
        assert_eq!(verdict(f64::NAN, 0.01, 60.0), Verdict::Fail);
    }
}
