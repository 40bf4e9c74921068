//! What a geometry answers to spherical Gaussians about the half vector of each pair, for a row of sharpnesses: an edit of a BRDF is then a scalar product a pair.
//!
//! Sums of BRDFs share their sharpnesses, the powers of 2 ([`crate::sg::ZonalBasis`]). For each of them the products with all lobes of the normals are summed once; the
//! factors of the BRDF that are no lobe are not known then. The product of two cosines, which measured BRDFs and Blinn-Phong have, is summed along. Others (Smith's masking,
//! Ward's roots) are summed over four points with the mean, the variances and the covariance that the cosines have in the sum, where `PreparedLobes` takes them for each lobe of
//! the normals by itself.

use super::amplitudes::AmplitudeLayout;
use super::brdf_lobes::{BrdfLobe, Terms};
use super::integrals::factor_at_half;
use super::prepared::{LobeValue, OneSurface, PreparedLobes};
use super::products::{PairAxes, closure, exact};
use super::surface::SurfaceBrdf;
use crate::brdf::Colour;
use crate::error::{BadInput, Result};
use crate::filter::control::Control;
use crate::filter::lobes::Masking;
use crate::filter::plan::{AmplitudeFit, ProductIntegral};
use crate::material::Surface;
use crate::sg::Lobe;
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::DVec3;
use rayon::prelude::*;

/// Lanes of sharpnesses.
const GROUPS: usize = 2;
/// 0, and the powers of 2 from 1 to 2^30: the sharpest lobe of a BRDF of alpha 1e-4.
const SHARPNESS: [Lanes; GROUPS] = {
    let mut all = [[0.0; LANES]; GROUPS];
    let mut k = 1;
    while k < GROUPS * LANES {
        all[k / LANES][k % LANES] = (1_u32 << (k - 1)) as f32;
        k += 1;
    }
    all
};

/// Lobes and amplitudes of a list of pairs, and what they answer to each sharpness.
pub struct LobeResponses {
    prepared: PreparedLobes,
    /// By surface: for each pair and channel of the query its sums, then nothing for surfaces without lobes.
    surfaces: Vec<Vec<[Response; GROUPS]>>,
}

/// Sums over the lobes of the normals of their products with Gaussians of some sharpnesses.
#[derive(Clone, Copy, Debug, Default)]
struct Response {
    /// Of the products.
    plain: Lanes,
    /// Of the products times both cosines.
    with_cosines: Lanes,
    /// The same times the second harmonic in azimuth.
    harmonic: Lanes,
    /// Mean cosines with the light and with the viewer, one standard deviation less and one more.
    cosines: [[Lanes; 2]; 2],
}

impl PreparedLobes {
    /// Sums over lobes for all sharpnesses that BRDFs are made of.
    ///
    /// # Errors
    /// An interruption.
    pub fn into_responses(self, control: &Control<'_>) -> Result<LobeResponses> {
        let tasks = self.query.pairs.len().div_ceil(PAIRS_AT_ONCE);
        let mut surfaces = Vec::with_capacity(self.surfaces.len());
        for surface in &self.surfaces {
            let mut all = Vec::new();
            for task in 0..tasks {
                control.check()?;
                let end = ((task + 1) * PAIRS_AT_ONCE).min(self.query.pairs.len());
                all.par_extend((task * PAIRS_AT_ONCE..end).into_par_iter().flat_map_iter(|pair| self.of_pair(surface, pair)));
                (control.progress)("responses", (task + 1) as f64 / tasks as f64);
            }
            surfaces.push(all);
        }
        Ok(LobeResponses { prepared: self, surfaces })
    }

    /// Responses of a pair of the query, one a channel.
    fn of_pair(&self, surface: &OneSurface, pair: usize) -> Vec<[Response; GROUPS]> {
        let directions = self.query.pairs[pair].map(|d| self.query.directions[d as usize]);
        let width = surface.layout.row() / surface.layout.channels;
        let row = &surface.rows[pair * surface.layout.row()..(pair + 1) * surface.layout.row()];
        let of_channel = |row: &[f32]| {
            let (plan, room) = (&self.plan, &mut Vec::new());
            let areas = surface.layout.lobe_areas(&row[1..], room);
            simd::run(Respond { normals: &surface.densities, areas, directions, fit: plan.amplitudes, integral: plan.integral })
        };
        row.chunks_exact(width).map(of_channel).collect()
    }
}

/// Pairs between two looks at whether to stop.
const PAIRS_AT_ONCE: usize = 1 << 12;

/// Sums of a pair and channel.
struct Respond<'a> {
    normals: &'a [Lobe],
    areas: &'a [f32],
    directions: [DVec3; 2],
    fit: AmplitudeFit,
    integral: ProductIntegral,
}

impl Kernel for Respond<'_> {
    type Output = [Response; GROUPS];

    #[inline(always)]
    fn run(self) -> [Response; GROUPS] {
        let axes = PairAxes::new(self.directions);
        let mut out = [Response::default(); GROUPS];
        // First and second moments of the cosines.
        let mut moments = [[[[0.0; LANES]; 2]; 2]; GROUPS];
        for (density, area) in self.normals.iter().zip(self.areas) {
            if *area == 0.0 {
                continue;
            }
            let d2 = axes.distance_squared(density);
            for ((response, moments), sharpness) in out.iter_mut().zip(&mut moments).zip(&SHARPNESS) {
                let products = match self.integral {
                    ProductIntegral::Exact => exact(density.sharpness, sharpness, d2),
                    ProductIntegral::Closure => closure(density.sharpness, sharpness, d2),
                };
                let cosines = axes.cosines(density, sharpness);
                let harmonics = axes.harmonics(density, sharpness);
                let by_least_squares = self.fit != AmplitudeFit::Responsibilities;
                for l in 0..LANES {
                    let [to_light, to_viewer] = [cosines[0][l], cosines[1][l]];
                    let counts = by_least_squares || (to_light > 0.0 && to_viewer > 0.0);
                    let product = if counts { area * density.amplitude * products[l] } else { 0.0 };
                    let with_cosines = product * to_light * to_viewer;
                    response.plain[l] += product;
                    response.with_cosines[l] += with_cosines;
                    response.harmonic[l] += if by_least_squares { product } else { with_cosines } * harmonics[l];
                    for ([first, second], cosine) in moments.iter_mut().zip([to_light, to_viewer]) {
                        first[l] += product * cosine;
                        second[l] += product * cosine * cosine;
                    }
                }
            }
        }
        for (response, moments) in out.iter_mut().zip(&moments) {
            for ([low, high], [first, second]) in response.cosines.iter_mut().zip(moments) {
                for l in 0..LANES {
                    // Modes may make an area slightly negative: the moments of little are those of no distribution.
                    let inverse = if response.plain[l] > 0.0 { 1.0 / response.plain[l] } else { 0.0 };
                    let mean = (first[l] * inverse).clamp(0.0, 1.0);
                    let deviation = (second[l] * inverse - mean * mean).max(0.0).sqrt().min(mean).min(1.0 - mean);
                    (low[l], high[l]) = (mean - deviation, mean + deviation);
                }
            }
        }
        out
    }
}

impl LobeResponses {
    /// Values of the pairs, in their order, under `surfaces`, as [`PreparedLobes::evaluate`] has them; the same to rounding for Blinn-Phong and measured BRDFs, nearly for
    /// others (`docs/iwasaki-2012.md`, speed).
    ///
    /// # Errors
    /// Those of [`PreparedLobes::evaluate`]; a BRDF that is a sum of other sharpnesses.
    pub fn evaluate(&self, surfaces: &[Surface], control: &Control<'_>) -> Result<Vec<LobeValue>> {
        self.prepared.check(surfaces)?;
        let mut sums = vec![[0.0; 3]; self.prepared.query.pairs.len()];
        for (k, (prepared, surface)) in self.prepared.surfaces.iter().zip(surfaces).enumerate() {
            control.check()?;
            if prepared.densities.is_empty() {
                continue;
            }
            let brdf = SurfaceBrdf::new(surface, self.prepared.plan.brdf, &self.prepared.measured);
            let lobes = brdf.sums.iter().map(on_the_row).collect::<Option<Vec<_>>>().ok_or_else(|| {
                let problem = format!("the BRDF of surface {} is not a sum of Gaussians whose sharpnesses are powers of 2 to 2^30", k + 1);
                BadInput::new(problem, "evaluate it from the prepared lobes, or prepare them by a plan with `brdf=2`").at_field("surface")
            })?;
            let of_pairs = sums.par_iter_mut().zip(prepared.rows.par_chunks_exact(prepared.layout.row()));
            let of_pairs = of_pairs.zip(self.surfaces[k].par_chunks_exact(prepared.layout.channels)).zip(&self.prepared.query.pairs);
            of_pairs.for_each_init(<[Terms; 3]>::default, |terms, (((sum, row), responses), pair)| {
                let directions = pair.map(|d| self.prepared.query.directions[d as usize]);
                let fit = self.prepared.plan.amplitudes;
                let product = PairProduct {
                    layout: &prepared.layout,
                    row,
                    responses,
                    constant: brdf.constant,
                    lobes: &lobes,
                    directions,
                    fit,
                    terms,
                };
                let s = simd::run(product);
                (0..3).for_each(|c| sum[c] += s[c]);
            });
        }
        Ok(self.prepared.values(&sums))
    }

    /// Bytes of lobes, modes, amplitudes and sums.
    pub fn bytes(&self) -> usize {
        self.prepared.bytes() + self.surfaces.iter().map(|s| size_of_val(&s[..])).sum::<usize>()
    }
}

/// A BRDF's sum with its amplitudes at the places of [`SHARPNESS`], if it has these sharpnesses alone.
fn on_the_row<'a>(brdf: &BrdfLobe<'a>) -> Option<BrdfLobe<'a>> {
    let place = |sharpness: f32| SHARPNESS.iter().flatten().position(|s| *s == sharpness);
    let places: Vec<usize> = brdf.sharpness.iter().flatten().map(|s| place(*s)).collect::<Option<_>>()?;
    let moved = |amplitudes: &Vec<Lanes>| {
        let mut row = vec![[0.0; LANES]; GROUPS];
        // What fills up lanes has an amplitude of 0, and the place of the constant.
        amplitudes.iter().flatten().zip(&places).for_each(|(a, place)| row[place / LANES][place % LANES] += a);
        row
    };
    Some(BrdfLobe { sharpness: SHARPNESS.to_vec(), amplitudes: brdf.amplitudes.map(moved), ..brdf.clone() })
}

/// `S` of a pair from its responses.
struct PairProduct<'a> {
    layout: &'a AmplitudeLayout,
    row: &'a [f32],
    responses: &'a [[Response; GROUPS]],
    constant: Colour,
    lobes: &'a [BrdfLobe<'a>],
    directions: [DVec3; 2],
    fit: AmplitudeFit,
    terms: &'a mut [Terms; 3],
}

impl Kernel for PairProduct<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run(self) -> [f64; 3] {
        let i_dot_h = 0.5 * (self.directions[0] + self.directions[1]).length();
        let width = self.layout.row() / self.layout.channels;
        let channel = |c: usize| c.min(self.layout.channels - 1);
        let mut sum: [f64; 3] = std::array::from_fn(|c| self.constant[c] * f64::from(self.row[channel(c) * width]));
        for brdf in self.lobes {
            let colour = brdf.lobe.colour_at(i_dot_h);
            let brdf_channels = brdf.amplitudes.at(i_dot_h, self.terms);
            let at_half = factor_at_half(self.fit, brdf, i_dot_h);
            // One number where channels differ neither in what is seen nor in the BRDF's shape.
            let numbers = brdf_channels.max(self.layout.channels);
            let mut products = [0.0; 3];
            for (c, product) in products.iter_mut().take(numbers).enumerate() {
                let terms = &self.terms[c.min(brdf_channels - 1)];
                *product = f64::from(scalar(&self.responses[channel(c)], terms, brdf.lobe.masking, at_half));
            }
            (0..3).for_each(|c| sum[c] += colour[c] * products[c.min(numbers - 1)]);
        }
        sum
    }
}

impl Response {
    /// Sums of the products with the factor `masking` of both directions.
    #[inline(always)]
    fn masked(&self, masking: Masking) -> Lanes {
        let [to_light, to_viewer] = &self.cosines;
        let factors = [to_light, to_viewer].map(|[low, high]| [masking.eval(low), masking.eval(high)]);
        let mut out = [0.0; LANES];
        for l in 0..LANES {
            let [mean_i, mean_o] = [to_light, to_viewer].map(|[low, high]| 0.5 * (low[l] + high[l]));
            let [deviation_i, deviation_o] = [to_light, to_viewer].map(|[low, high]| 0.5 * (high[l] - low[l]));
            let [factor_i, factor_o] = factors.each_ref().map(|[low, high]| 0.5 * (low[l] + high[l]));
            let [slope_i, slope_o] = factors.each_ref().map(|[low, high]| 0.5 * (high[l] - low[l]));
            // Points (mean ± deviation, mean ± deviation), those of equal signs with weight (1 + r) / 4, the others with (1 - r) / 4.
            let both = deviation_i * deviation_o;
            let covariance = self.with_cosines[l] / self.plain[l] - mean_i * mean_o;
            let correlation = if both > f32::MIN_POSITIVE && self.plain[l] > 0.0 { (covariance / both).clamp(-1.0, 1.0) } else { 0.0 };
            out[l] = self.plain[l] * (factor_i * factor_o + correlation * slope_i * slope_o);
        }
        out
    }
}

/// Scalar product of responses and the amplitudes of a BRDF.
#[inline(always)]
fn scalar(responses: &[Response; GROUPS], terms: &Terms, masking: Masking, at_half: Option<f32>) -> f32 {
    let mut sum = 0.0;
    for (k, response) in responses.iter().enumerate() {
        let amplitudes = &terms.zonal[k];
        if *amplitudes == [0.0; LANES] {
            continue;
        }
        let factored = match (at_half, masking) {
            (Some(factor), _) => response.plain.map(|p| p * factor),
            (None, Masking::Cosine) => response.with_cosines,
            (None, masking) => response.masked(masking),
        };
        for l in 0..LANES {
            sum += amplitudes[l] * factored[l];
        }
        if let Some(harmonics) = terms.harmonic.get(k) {
            let factor = at_half.unwrap_or(1.0);
            for l in 0..LANES {
                sum += harmonics[l] * response.harmonic[l] * factor;
            }
        }
    }
    sum
}
