//! A small-scale BRDF as spherical Gaussians about the half vector.
//!
//! `fr (n·i)(n·o)` is `colour · masking(n·i) · masking(n·o) · shape(n·h)` (`crate::filter::lobes`): the shape becomes a sum of lobes. A measured BRDF depends on
//! the half angle, on the difference angle, which is that of the pair whatever the normal, and on the azimuth of the normal about the half vector from
//! the plane of the pair. Isotropic and reciprocal, it has even cosines of the azimuth alone: for each difference angle its mean and its second
//! harmonic are such sums, the latter of terms `l (n_x² - n_y²) G_l(n)` that a product of lobes integrates like its factors. What is left out errs by 39 dB or
//! less on exact normals (alum-bronze), 34 with the mean alone.

use crate::brdf::{Brdf, Colour, Measured};
use crate::filter::lobes::{Lobe, Masking, Shape, lobes};
use crate::filter::plan::BrdfLobes;
use crate::numerics::cast::{narrow, truncate_usize};
use crate::sg::{ZonalBasis, ZonalFit, ZonalProfile};
use crate::simd::{LANES, Lanes};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::{Arc, Mutex, PoisonError};

/// Intervals of the difference angle of a measured BRDF, from 0 to a right angle: 2 degrees, linear in between. With 6 alum-bronze loses up to 5 dB, with 1 it
/// gains nothing.
const DIFFERENCE_ANGLES: usize = 45;
/// Azimuths of the normal about the half vector, over half a turn, at which a measured BRDF is looked up.
const AZIMUTHS: usize = 16;
/// A normal whose cosines have a smaller product does not count.
const LEAST_COSINE: f64 = 1e-9;
/// Least variance of `cos 2φ` over a ring for a second harmonic, .5 for a whole one. Chosen, not measured.
const LEAST_DETERMINANT: f64 = 0.05;

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
    ByDifferenceAngle(Arc<[[Terms; 3]]>),
}

/// Amplitudes of a sum and of its second harmonic.
#[derive(Clone, Debug, Default)]
pub struct Terms {
    /// Of the lobes.
    pub zonal: Vec<Lanes>,
    /// Of the terms `l (n_x² - n_y²) G_l(n)`, `x` in the plane of the pair; empty where there are none.
    pub harmonic: Vec<Lanes>,
}

/// Sums of measured BRDFs, kept: they take some 20 CPU milliseconds each.
#[derive(Debug, Default)]
pub struct MeasuredSums(Mutex<Vec<KeptSum>>);

/// The sum of a measured BRDF for sharpnesses that grow by `ratio`.
#[derive(Clone, Debug)]
struct KeptSum {
    measured: Arc<Measured>,
    ratio: f64,
    sharpness: Vec<Lanes>,
    amplitudes: Arc<[[Terms; 3]]>,
    relative_rms: f64,
}

impl MeasuredSums {
    /// Sums that are kept at once: those of a material's surfaces, and some to go back to.
    const KEPT: usize = 8;

    fn get(&self, measured: &Arc<Measured>, ratio: f64) -> KeptSum {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(sum) = kept.iter().find(|sum| Arc::ptr_eq(&sum.measured, measured) && sum.ratio == ratio) {
            return sum.clone();
        }
        let sum = KeptSum::new(measured, ratio);
        if kept.len() == Self::KEPT {
            kept.remove(0);
        }
        kept.push(sum.clone());
        sum
    }
}

/// The sums of a BRDF under a tint, and its constant part: a colour to be multiplied by `(n·i)(n·o)`.
pub fn brdf_lobes<'a>(brdf: &'a Brdf, tint: Colour, kind: BrdfLobes, measured_sums: &MeasuredSums) -> (Colour, Vec<BrdfLobe<'a>>) {
    let mut constant = [0.0; 3];
    let mut sums = Vec::new();
    for lobe in lobes(brdf, tint) {
        if let Brdf::Measured(measured) = brdf {
            sums.push(of_measured(lobe, measured, kind, measured_sums));
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
fn of_measured<'a>(lobe: Lobe<'a>, measured: &Arc<Measured>, kind: BrdfLobes, kept: &MeasuredSums) -> BrdfLobe<'a> {
    let ratio = match kind {
        BrdfLobes::Single => 4.0,
        BrdfLobes::Spaced(ratio) => ratio,
    };
    let KeptSum { sharpness, amplitudes, relative_rms, .. } = kept.get(measured, ratio);
    let lobe = Lobe { masking: Masking::Cosine, table: None, ..lobe };
    BrdfLobe { lobe, sharpness, amplitudes: ZonalAmplitudes::ByDifferenceAngle(amplitudes), relative_rms }
}

impl KeptSum {
    fn new(measured: &Arc<Measured>, ratio: f64) -> Self {
        let basis = ZonalBasis::new(measured.lobe_alpha(), ratio);
        let fits: Vec<[(ZonalFit, Vec<[f64; 2]>); 3]> = (0..=DIFFERENCE_ANGLES)
            .into_par_iter()
            .map(|k| {
                let difference = FRAC_PI_2 * k as f64 / DIFFERENCE_ANGLES as f64;
                let rings: Vec<Ring> = basis.angles.iter().map(|&angle| Ring::new(measured, angle, difference)).collect();
                let weights: Vec<f64> = rings.iter().map(|ring| ring.weight).collect();
                std::array::from_fn(|c| {
                    let mean: Vec<f64> = rings.iter().map(|ring| ring.mean[c]).collect();
                    let harmonic: Vec<f64> = rings.iter().map(|ring| ring.harmonic[c]).collect();
                    (basis.fit(&mean, &weights), basis.fit_second_harmonic(&harmonic, &mean, &weights))
                })
            })
            .collect();
        let terms = || fits.iter().flatten().flat_map(|(zonal, harmonic)| zonal.lobes.iter().chain(harmonic));
        let mut sharpness: Vec<f64> = terms().map(|l| l[0]).collect();
        sharpness.sort_by(f64::total_cmp);
        sharpness.dedup();
        let amplitudes = |terms: &[[f64; 2]]| {
            let of = |l: &f64| terms.iter().find(|term| term[0] == *l).map_or(0.0, |term| term[1]);
            filled(&sharpness.iter().map(of).collect::<Vec<f64>>())
        };
        let of_channel =
            |(zonal, harmonic): &(ZonalFit, Vec<[f64; 2]>)| Terms { zonal: amplitudes(&zonal.lobes), harmonic: amplitudes(harmonic) };
        let squares: f64 = fits.iter().flatten().map(|(zonal, _)| zonal.relative_rms.powi(2)).sum();
        Self {
            measured: Arc::clone(measured),
            ratio,
            sharpness: filled(&sharpness),
            amplitudes: fits.iter().map(|of| std::array::from_fn(|c| of_channel(&of[c]))).collect(),
            relative_rms: (squares / (3 * fits.len()) as f64).sqrt(),
        }
    }
}

/// A measured BRDF over the normals at one angle from the half vector of a pair, each counted by the product of its cosines.
struct Ring {
    /// Its mean.
    mean: Colour,
    /// Its second harmonic: what stands before `cos 2φ`, with the azimuth `φ` from the plane of the pair.
    harmonic: Colour,
    /// Mean product of the cosines, 1 at the half vector.
    weight: f64,
}

impl Ring {
    /// At `angle`, for directions that are `2 difference` apart.
    fn new(measured: &Measured, angle: f64, difference: f64) -> Self {
        let (sin_d, cos_d) = difference.min(FRAC_PI_2 - 1e-3).sin_cos();
        let (wi, wo) = (DVec3::new(sin_d, 0.0, cos_d), DVec3::new(-sin_d, 0.0, cos_d));
        let mut weight = 0.0;
        // Weighted moments of `cos 2φ`, and of the values with 1 and `cos 2φ`.
        let (mut first, mut second, mut sum, mut with_cosine) = (0.0, 0.0, [0.0; 3], [0.0; 3]);
        for k in 0..AZIMUTHS {
            // Half a turn is enough: the other half is its mirror image.
            let azimuth = PI * (k as f64 + 0.5) / AZIMUTHS as f64;
            let n = DVec3::new(angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin(), angle.cos());
            let cosines = n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
            if cosines > LEAST_COSINE {
                let (value, cosine) = (measured.eval(n, wi, wo), (2.0 * azimuth).cos());
                weight += cosines;
                first += cosines * cosine;
                second += cosines * cosine * cosine;
                for c in 0..3 {
                    sum[c] += cosines * value[c];
                    with_cosine[c] += cosines * cosine * value[c];
                }
            }
        }
        let of_whole = weight / (AZIMUTHS as f64 * cos_d * cos_d);
        let determinant = weight * second - first * first;
        // Where few azimuths see both directions, mean and harmonic are not told apart: then the mean is all.
        if determinant <= LEAST_DETERMINANT * weight * weight {
            let mean = if weight > 0.0 { sum.map(|s| s / weight) } else { [0.0; 3] };
            return Self { mean, harmonic: [0.0; 3], weight: of_whole };
        }
        let mean = std::array::from_fn(|c| (second * sum[c] - first * with_cosine[c]) / determinant);
        let harmonic = std::array::from_fn(|c| (weight * with_cosine[c] - first * sum[c]) / determinant);
        Self { mean, harmonic, weight: of_whole }
    }
}

/// Numbers in lanes, filled up with 0.
fn filled(numbers: &[f64]) -> Vec<Lanes> {
    let of = |chunk: &[f64]| std::array::from_fn(|l| chunk.get(l).map_or(0.0, |&v| narrow(v)));
    numbers.chunks(LANES).map(of).collect()
}

impl ZonalAmplitudes {
    /// The same with the amplitudes of each sum at other places.
    pub fn map(&self, moved: impl Fn(&Vec<Lanes>) -> Vec<Lanes>) -> Self {
        let terms = |t: &Terms| Terms { zonal: moved(&t.zonal), harmonic: moved(&t.harmonic) };
        match self {
            Self::Same(amplitudes) => Self::Same(moved(amplitudes)),
            Self::ByDifferenceAngle(table) => {
                Self::ByDifferenceAngle(table.iter().map(|of| std::array::from_fn(|c| terms(&of[c]))).collect())
            }
        }
    }

    /// Writes the amplitudes of a pair, whose half vector has cosine `i_dot_h` with the light; how many channels are different.
    pub fn at(&self, i_dot_h: f64, channels: &mut [Terms; 3]) -> usize {
        match self {
            Self::Same(amplitudes) => {
                channels[0].zonal.clone_from(amplitudes);
                channels[0].harmonic.clear();
                1
            }
            Self::ByDifferenceAngle(table) => {
                let place = i_dot_h.clamp(0.0, 1.0).acos() / FRAC_PI_2 * (table.len() - 1) as f64;
                let low = truncate_usize(place).min(table.len() - 2);
                let share = narrow(place - low as f64);
                let between = |out: &mut Vec<Lanes>, a: &[Lanes], b: &[Lanes]| {
                    out.clear();
                    out.extend(a.iter().zip(b).map(|(a, b)| std::array::from_fn(|l| a[l] + share * (b[l] - a[l]))));
                };
                for (c, channel) in channels.iter_mut().enumerate() {
                    let (a, b) = (&table[low][c], &table[low + 1][c]);
                    between(&mut channel.zonal, &a.zonal, &b.zonal);
                    between(&mut channel.harmonic, &a.harmonic, &b.harmonic);
                }
                3
            }
        }
    }
}
