//! A small-scale BRDF as spherical Gaussians about the half vector.
//!
//! `fr (n·i)(n·o)` is `colour · masking(n·i) · masking(n·o) · shape(n·h)` (`crate::filter::lobes`): the shape becomes a sum of lobes. A measured BRDF depends on
//! the half angle, on the difference angle, which is that of the pair whatever the normal, and on how the light turns about the half vector; averaged
//! over the last it is such a sum for each difference angle.

use crate::brdf::{Brdf, Colour, Measured};
use crate::filter::lobes::{Lobe, Masking, Shape, lobes};
use crate::filter::plan::BrdfLobes;
use crate::numerics::cast::{narrow, truncate_usize};
use crate::sg::{ZonalFit, ZonalProfile};
use crate::simd::{LANES, Lanes};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Intervals of the difference angle of a measured BRDF, from 0 to a right angle: 6 degrees, linear in between. Chosen, not measured.
const DIFFERENCE_ANGLES: usize = 15;
/// Turns of the light about the half vector that a measured BRDF is averaged over.
const TURNS: usize = 16;
/// Where a ring of normals sees both directions nowhere, the BRDF is what it is here.
const LEAST_COSINE: f64 = 1e-9;

/// One lobe of a BRDF as a sum of spherical Gaussians about the half vector.
#[derive(Clone, Debug)]
pub struct BrdfLobe<'a> {
    /// Its colour and what depends on one direction.
    pub lobe: Lobe<'a>,
    /// Sharpness of each spherical Gaussian, filled up to whole lanes.
    pub sharpness: Vec<Lanes>,
    /// Their amplitudes.
    pub amplitudes: ZonalAmplitudes,
    /// Relative RMS error of the sum, as [`ZonalFit`] has it.
    pub relative_rms: f64,
}

/// Amplitudes of the lobes of a sum; what fills up has 0.
#[derive(Clone, Debug)]
pub enum ZonalAmplitudes {
    /// Of all pairs and channels.
    Same(Vec<Lanes>),
    /// For each difference angle, by channel.
    ByDifferenceAngle(Vec<[Vec<Lanes>; 3]>),
}

/// The sums of a BRDF under a tint, and its constant part: a colour to be multiplied by `(n·i)(n·o)`.
pub fn brdf_lobes(brdf: &Brdf, tint: Colour, kind: BrdfLobes) -> (Colour, Vec<BrdfLobe<'_>>) {
    let mut constant = [0.0; 3];
    let mut sums = Vec::new();
    for lobe in lobes(brdf, tint) {
        if let Some(measured) = lobe.table {
            sums.push(of_measured(lobe, measured, kind));
        } else if lobe.shape == Shape::Constant {
            constant = std::array::from_fn(|c| constant[c] + lobe.colour[c]);
        } else {
            sums.push(of_shape(lobe, kind));
        }
    }
    (constant, sums)
}

/// The value of a shape at an angle of the normal with the half vector, and its width.
fn profile(shape: Shape) -> (Box<dyn Fn(f64) -> f64>, f64) {
    match shape {
        Shape::Constant => (Box::new(|_| 1.0), FRAC_PI_2),
        Shape::Ggx(a2) => {
            let a2 = f64::from(a2);
            let value = move |angle: f64| {
                let (sin, cos) = angle.sin_cos();
                (cos * cos * a2 + sin * sin).powi(-2)
            };
            (Box::new(value), a2.sqrt())
        }
        Shape::Beckmann(inverse_a2) => {
            let inverse_a2 = f64::from(inverse_a2);
            let value = move |angle: f64| (-angle.tan().powi(2) * inverse_a2).exp() / angle.cos().powi(4);
            (Box::new(value), inverse_a2.recip().sqrt())
        }
        Shape::Ward(inverse_a2) => {
            let inverse_a2 = f64::from(inverse_a2);
            (Box::new(move |angle: f64| (-angle.tan().powi(2) * inverse_a2).exp()), inverse_a2.recip().sqrt())
        }
        Shape::Power(exponent) => {
            let exponent = f64::from(exponent);
            (Box::new(move |angle: f64| angle.cos().max(0.0).powf(exponent)), (2.0 / exponent.max(1.0)).sqrt())
        }
    }
}

fn of_shape(lobe: Lobe<'_>, kind: BrdfLobes) -> BrdfLobe<'_> {
    let (value, width) = profile(lobe.shape);
    let fit = match kind {
        // The peak and, of all but a cosine's power, the integral of a normal distribution of this roughness (Wang et al. 2009, section 4).
        BrdfLobes::Single => ZonalFit { lobes: vec![[2.0 / (width * width), value(0.0)]], relative_rms: 0.0 },
        BrdfLobes::Spaced(ratio) => ZonalFit::new(&ZonalProfile { value: &value, width }, ratio),
    };
    let (sharpness, amplitude): (Vec<f64>, Vec<f64>) = fit.lobes.iter().map(|&[l, a]| (l, a)).unzip();
    BrdfLobe { lobe, sharpness: filled(&sharpness), amplitudes: ZonalAmplitudes::Same(filled(&amplitude)), relative_rms: fit.relative_rms }
}

/// A measured BRDF. With [`BrdfLobes::Single`] it has as many lobes as with [`BrdfLobes::Spaced`] of 4: one lobe does not make a measured BRDF.
fn of_measured<'a>(lobe: Lobe<'a>, measured: &Measured, kind: BrdfLobes) -> BrdfLobe<'a> {
    let ratio = match kind {
        BrdfLobes::Single => 4.0,
        BrdfLobes::Spaced(ratio) => ratio,
    };
    let width = measured.lobe_alpha();
    let fits: Vec<[ZonalFit; 3]> = (0..=DIFFERENCE_ANGLES)
        .map(|k| {
            let difference = FRAC_PI_2 * k as f64 / DIFFERENCE_ANGLES as f64;
            // One look-up has all channels.
            let known = std::cell::RefCell::new(rustc_hash::FxHashMap::<u64, Colour>::default());
            let at = |angle: f64| *known.borrow_mut().entry(angle.to_bits()).or_insert_with(|| ring(measured, angle, difference));
            std::array::from_fn(|c| ZonalFit::new(&ZonalProfile { value: &|angle| at(angle)[c], width }, ratio))
        })
        .collect();
    let mut sharpness: Vec<f64> = fits.iter().flatten().flat_map(|fit| &fit.lobes).map(|l| l[0]).collect();
    sharpness.sort_by(f64::total_cmp);
    sharpness.dedup();
    let amplitudes = |fit: &ZonalFit| {
        let of = |l: &f64| fit.lobes.iter().find(|lobe| lobe[0] == *l).map_or(0.0, |lobe| lobe[1]);
        filled(&sharpness.iter().map(of).collect::<Vec<f64>>())
    };
    let squares: f64 = fits.iter().flatten().map(|fit| fit.relative_rms.powi(2)).sum();
    BrdfLobe {
        lobe: Lobe { masking: Masking::Cosine, table: None, ..lobe },
        sharpness: filled(&sharpness),
        amplitudes: ZonalAmplitudes::ByDifferenceAngle(fits.iter().map(|of| std::array::from_fn(|c| amplitudes(&of[c]))).collect()),
        relative_rms: (squares / (3 * fits.len()) as f64).sqrt(),
    }
}

/// A measured BRDF averaged over the normals at `angle` from the half vector of a pair `2 difference` apart, each counted by the product of its cosines.
fn ring(measured: &Measured, angle: f64, difference: f64) -> Colour {
    let (sin_d, cos_d) = difference.min(FRAC_PI_2 - 1e-3).sin_cos();
    let (wi, wo) = (DVec3::new(sin_d, 0.0, cos_d), DVec3::new(-sin_d, 0.0, cos_d));
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for k in 0..TURNS {
        // Half a turn is enough: the other half is its mirror image.
        let turn = PI * (k as f64 + 0.5) / TURNS as f64;
        let n = DVec3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos());
        let cosines = n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
        if cosines > LEAST_COSINE {
            let value = measured.eval(n, wi, wo);
            (0..3).for_each(|c| sum[c] += cosines * value[c]);
            weight += cosines;
        }
    }
    if weight > 0.0 { sum.map(|s| s / weight) } else { [0.0; 3] }
}

/// Numbers in lanes, filled up with 0.
fn filled(numbers: &[f64]) -> Vec<Lanes> {
    let of = |chunk: &[f64]| std::array::from_fn(|l| chunk.get(l).map_or(0.0, |&v| narrow(v)));
    numbers.chunks(LANES).map(of).collect()
}

impl ZonalAmplitudes {
    /// Writes the amplitudes of a pair, whose half vector has cosine `i_dot_h` with the light; how many channels are different.
    pub fn at(&self, i_dot_h: f64, channels: &mut [Vec<Lanes>; 3]) -> usize {
        match self {
            Self::Same(amplitudes) => {
                channels[0].clone_from(amplitudes);
                1
            }
            Self::ByDifferenceAngle(table) => {
                let place = i_dot_h.clamp(0.0, 1.0).acos() / FRAC_PI_2 * (table.len() - 1) as f64;
                let low = truncate_usize(place).min(table.len() - 2);
                let share = narrow(place - low as f64);
                for (c, channel) in channels.iter_mut().enumerate() {
                    let (a, b) = (&table[low][c], &table[low + 1][c]);
                    channel.clear();
                    channel.extend(a.iter().zip(b).map(|(a, b)| std::array::from_fn(|l| a[l] + share * (b[l] - a[l]))));
                }
                3
            }
        }
    }
}
