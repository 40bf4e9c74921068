//! From file values to values that are proportional to light.

use crate::photo::{self, Photo, PlanarImage, Samples};
use crate::shoot::{CameraSpec, SATURATION};
use biscale::numerics::cast::{narrow, truncate_usize};
use biscale::numerics::colour::srgb_to_linear;
use biscale::numerics::statistics::upper_median;
use rayon::prelude::*;

/// A linear photograph: sensor values (0 to 1, black taken off) over `divisor`.
#[derive(Clone, Debug)]
pub struct LinearPhoto {
    /// Values.
    pub picture: PlanarImage,
    /// Which pixels are saturated, in any channel of all brackets.
    pub saturated: Vec<bool>,
    /// What sensor values were divided by: seconds x gain / f-number².
    pub divisor: f64,
}

/// Exposure of one file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Shutter time, s.
    pub seconds: f64,
    /// ISO over 100.
    pub gain: f64,
    /// F-number; 1 where it is not known, and then it is taken to be the same all along.
    pub f_number: f64,
}

impl Exposure {
    /// Light that a sensor value of 1 stands for, relative.
    pub fn divisor(&self) -> f64 {
        self.seconds * self.gain / (self.f_number * self.f_number)
    }
}

/// Why a photograph cannot be linear, judged by its file alone.
pub fn why_not_linear(photo: &Photo, camera: &CameraSpec, assume_srgb: bool) -> Option<String> {
    if camera.linear {
        return None;
    }
    match (photo.samples, &photo.metadata.tone_curve) {
        (Samples::Float, _) => None,
        (Samples::Integer(..=8), _) if assume_srgb => None,
        (Samples::Integer(..=8), _) => Some("it has 8 bits, which cameras only write with a tone curve".to_owned()),
        (_, Some(_)) if assume_srgb => None,
        (_, Some(curve)) => Some(curve.clone()),
        (_, None) => None,
    }
}

/// Whether its values are to be decoded by the sRGB curve, once the user allowed that.
pub fn is_srgb(photo: &Photo, camera: &CameraSpec) -> bool {
    !camera.linear && photo::is_encoded(photo.samples, &photo.metadata)
}

/// Sensor values of a photograph: the tone curve undone, black taken off, full scale 1.
///
/// Marks saturated pixels: at `camera.saturation`, before anything is taken off. Floats have no full scale: of them none is, unless that is given.
pub fn sensor(photo: Photo, camera: &CameraSpec, srgb: bool) -> (PlanarImage, Vec<bool>) {
    let Photo { mut picture, samples, .. } = photo;
    let limit = camera.saturation.unwrap_or(if samples == Samples::Float { f64::INFINITY } else { SATURATION });
    let (limit, black) = (narrow(limit), narrow(camera.black));
    let [r, g, b] = &picture.planes;
    let saturated = (0..r.len()).into_par_iter().map(|i| r[i] >= limit || g[i] >= limit || b[i] >= limit).collect();
    let scale = 1.0 / (1.0 - black);
    let curve = if srgb { Curve::of(samples) } else { Curve(Vec::new()) };
    for plane in &mut picture.planes {
        plane.par_iter_mut().for_each(|v| *v = (if srgb { curve.decode(*v) } else { *v } - black) * scale);
    }
    (picture, saturated)
}

/// The curve of sRGB at every value that whole numbers of up to 16 bits have: a power a pixel is slow.
struct Curve(Vec<f32>);

impl Curve {
    fn of(samples: Samples) -> Self {
        let Samples::Integer(bits @ 1..=16) = samples else { return Self(Vec::new()) };
        let top = (1_u32 << bits) - 1;
        Self((0..=top).map(|k| decoded(f64::from(k) / f64::from(top))).collect())
    }

    fn decode(&self, encoded: f32) -> f32 {
        if self.0.is_empty() {
            return decoded(f64::from(encoded));
        }
        let k = truncate_usize(f64::from(encoded * (self.0.len() - 1) as f32 + 0.5));
        self.0[k.min(self.0.len() - 1)]
    }
}

fn decoded(encoded: f64) -> f32 {
    narrow(srgb_to_linear(encoded))
}

/// Merges brackets of one view: the sum of unsaturated values over the sum of their exposures, which weighs photons equally (Poisson noise).
///
/// A pixel that is saturated in every bracket keeps the value of the shortest one, and is marked. Returns `None` without brackets, or if sizes differ.
pub fn merge(brackets: Vec<(PlanarImage, Vec<bool>, Exposure)>) -> Option<LinearPhoto> {
    let mut brackets = brackets;
    brackets.sort_by(|a, b| a.2.divisor().total_cmp(&b.2.divisor()));
    let mut all = brackets.into_iter();
    let (first, first_saturated, exposure) = all.next()?;
    let mut sum = first;
    let saturated = first_saturated;
    let count = saturated.len();
    let mut weight: Vec<f32> = vec![narrow(exposure.divisor()); count];
    let mut total = exposure.divisor();
    for (picture, over, exposure) in all {
        if (picture.width, picture.height) != (sum.width, sum.height) {
            return None;
        }
        let divisor = exposure.divisor();
        total += divisor;
        let add = narrow(divisor);
        for (plane, more) in sum.planes.iter_mut().zip(&picture.planes) {
            plane.par_iter_mut().zip(more).zip(&over).zip(&saturated).for_each(|(((v, m), over), before)| {
                // Brackets come from short to long: what was saturated before is so here, too, and the shortest value stays.
                if !over && !before {
                    *v += m;
                }
            });
        }
        weight.par_iter_mut().zip(&over).zip(&saturated).for_each(|((w, over), before)| {
            if !over && !before {
                *w += add;
            }
        });
    }
    for plane in &mut sum.planes {
        plane.par_iter_mut().zip(&weight).for_each(|(v, w)| *v /= w);
    }
    Some(LinearPhoto { picture: sum, saturated, divisor: total })
}

/// Exponent `g` of `value = light^g` between two brackets of one view, by the median over pixels that both record well; `None` if there are
/// too few, or the exposures are too near.
pub fn bracket_exponent(short: &PlanarImage, long: &PlanarImage, saturated: &[bool], ratio: f64) -> Option<f64> {
    /// Sensor value from which on read noise does not count, fewest pixels of a median, and least ratio of exposures that tells an exponent. Chosen.
    const LEAST: f32 = 0.02;
    const FEWEST: usize = 200;
    const LEAST_RATIO: f64 = 1.3;
    if !(ratio > LEAST_RATIO) {
        return None;
    }
    let mut logs: Vec<f64> = short.planes[1]
        .iter()
        .zip(&long.planes[1])
        .zip(saturated)
        .filter(|((s, l), over)| !**over && **s > LEAST && **l > LEAST)
        .map(|((s, l), _)| f64::from(l / s).ln())
        .collect();
    if logs.len() < FEWEST {
        return None;
    }
    upper_median(&mut logs).map(|median| median / ratio.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::Metadata;

    fn camera() -> CameraSpec {
        CameraSpec { black: 0.1, ..CameraSpec::default() }
    }

    fn one(values: &[f32]) -> PlanarImage {
        PlanarImage { width: values.len(), height: 1, planes: [values.to_vec(), values.to_vec(), values.to_vec()] }
    }

    #[test]
    fn black_is_taken_off_and_saturation_seen_before() {
        let photo = Photo { picture: one(&[0.1, 0.55, 0.985]), samples: Samples::Integer(16), metadata: Metadata::default() };
        let (picture, saturated) = sensor(photo, &camera(), false);
        assert!((picture.planes[0][1] - 0.5).abs() < 1e-6 && picture.planes[0][0].abs() < 1e-6);
        assert_eq!(saturated, [false, false, true]);
    }

    #[test]
    fn the_table_of_srgb_is_its_curve() {
        for (bits, step) in [(8_u8, 1), (16, 97)] {
            let top = f64::from((1_u32 << bits) - 1);
            let values: Vec<f32> = (0..=top as u32).step_by(step).map(|k| (f64::from(k) / top) as f32).collect();
            let photo = Photo { picture: one(&values), samples: Samples::Integer(bits), metadata: Metadata::default() };
            let straight = CameraSpec { black: 0.0, ..camera() };
            let (picture, _) = sensor(photo, &straight, true);
            for (found, encoded) in picture.planes[1].iter().zip(&values) {
                assert!((f64::from(*found) - srgb_to_linear(f64::from(*encoded))).abs() < 1e-7, "{found} for {encoded}");
            }
        }
    }

    #[test]
    fn brackets_weigh_photons_and_leave_saturated_values_out() {
        let exposure = |seconds| Exposure { seconds, gain: 1.0, f_number: 1.0 };
        // Light 0.2 and 0.8; the long one clips the second pixel.
        let short = (one(&[0.21, 0.8]), vec![false, false], exposure(1.0));
        let long = (one(&[0.8, 1.0]), vec![false, true], exposure(4.0));
        let merged = merge(vec![long, short]).unwrap();
        assert!((merged.picture.planes[2][0] - 1.01 / 5.0).abs() < 1e-6, "{:?}", merged.picture.planes[2]);
        assert!((merged.picture.planes[2][1] - 0.8).abs() < 1e-6);
        assert_eq!((merged.saturated, merged.divisor), (vec![false, false], 5.0));
        let clipped = merge(vec![(one(&[1.0]), vec![true], exposure(2.0)), (one(&[1.0]), vec![true], exposure(1.0))]).unwrap();
        assert_eq!((clipped.picture.planes[0][0], &clipped.saturated[..]), (1.0, &[true][..]));
        assert!(merge(Vec::new()).is_none());
    }

    #[test]
    fn the_exponent_between_brackets_is_found() {
        let light: Vec<f32> = (0..1000).map(|i| 0.05 + i as f32 * 4e-4).collect();
        for gamma in [1.0_f32, 0.4545] {
            let (short, long) = (
                one(&light.iter().map(|v| v.powf(gamma)).collect::<Vec<_>>()),
                one(&light.iter().map(|v| (2.0 * v).powf(gamma)).collect::<Vec<_>>()),
            );
            let found = bracket_exponent(&short, &long, &[false; 1000], 2.0).unwrap();
            assert!((found - f64::from(gamma)).abs() < 1e-3, "{found}");
        }
        assert_eq!(bracket_exponent(&one(&light), &one(&light), &[false; 1000], 1.0), None);
    }

    #[test]
    fn files_with_a_tone_curve_are_told_apart() {
        let photo = |samples, curve: Option<&str>| Photo {
            picture: one(&[0.5]),
            samples,
            metadata: Metadata { tone_curve: curve.map(str::to_owned), ..Metadata::default() },
        };
        let (eight, sixteen) = (photo(Samples::Integer(8), None), photo(Samples::Integer(16), None));
        let tagged = photo(Samples::Integer(16), Some("sRGB"));
        assert!(why_not_linear(&eight, &camera(), false).is_some() && why_not_linear(&eight, &camera(), true).is_none());
        assert!(why_not_linear(&sixteen, &camera(), false).is_none() && !is_srgb(&sixteen, &camera()));
        assert!(why_not_linear(&tagged, &camera(), false).is_some() && is_srgb(&tagged, &camera()));
        let linear = CameraSpec { linear: true, ..camera() };
        assert!(why_not_linear(&tagged, &linear, false).is_none() && !is_srgb(&tagged, &linear));
    }
}
