//! `S` of one pair from the lobes of the normals and those of a BRDF, in f32 lanes over the lobes of the BRDF.
//!
//! Where a facet belongs to lobes by responsibilities, the factors of the BRDF that are no lobe (cosines, Smith's masking) are taken at the axis of the
//! product, the normal that counts most in the integral. By least squares the amplitudes have the cosines, and what remains of the factors
//! is taken at the half vector (Wang et al. 2009, section 4; Iwasaki et al. 2012, section 4.1).

use super::amplitudes::AmplitudeLayout;
use super::brdf_lobes::{BrdfLobe, Terms};
use super::products::{PairAxes, closure, exact, masked};
use crate::brdf::Colour;
use crate::filter::plan::{AmplitudeFit, ProductIntegral};
use crate::sg::Lobe;
use crate::simd::{Kernel, LANES};
use glam::DVec3;

/// `S` of one pair from one surface.
pub struct PairIntegral<'a> {
    /// Lobes of the surface's normals, with an integral of 1.
    pub normals: &'a [Lobe],
    /// What the numbers of a row mean.
    pub layout: &'a AmplitudeLayout,
    /// The row of the pair.
    pub row: &'a [f32],
    /// How the amplitudes were found.
    pub fit: AmplitudeFit,
    /// The integral of two lobes.
    pub integral: ProductIntegral,
    /// Constant part of the BRDF.
    pub constant: Colour,
    /// Its sums of lobes.
    pub brdf: &'a [BrdfLobe<'a>],
    /// To the light and to the viewer.
    pub directions: [DVec3; 2],
    /// Room to work in.
    pub room: &'a mut Room,
}

/// Room for the work of a thread.
#[derive(Default)]
pub struct Room {
    /// Amplitudes of a BRDF's sum.
    brdf: [Terms; 3],
    /// Visible areas of the lobes, by channel.
    areas: [Vec<f32>; 3],
}

impl Kernel for PairIntegral<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run(self) -> [f64; 3] {
        let [wi, wo] = self.directions;
        let i_dot_h = 0.5 * (wi + wo).length();
        let axes = PairAxes::new(self.directions);
        let channels = self.layout.channels;
        let Room { brdf: of_brdf, areas: rooms } = self.room;
        let rows: [&[f32]; 3] = std::array::from_fn(|c| {
            let width = 1 + self.layout.count();
            let c = c.min(channels - 1);
            &self.row[c * width..(c + 1) * width]
        });
        let mut sum: [f64; 3] = std::array::from_fn(|c| self.constant[c] * f64::from(rows[c][0]));
        if self.brdf.is_empty() {
            return sum;
        }
        let [red, green, blue] = rooms;
        let of_red = self.layout.lobe_areas(&rows[0][1..], red);
        let areas: [&[f32]; 3] = if channels == 1 {
            [of_red; 3]
        } else {
            [of_red, self.layout.lobe_areas(&rows[1][1..], green), self.layout.lobe_areas(&rows[2][1..], blue)]
        };
        for brdf in self.brdf {
            let colour = brdf.lobe.colour_at(i_dot_h);
            let brdf_channels = brdf.amplitudes.at(i_dot_h, of_brdf);
            let at_half = factor_at_half(self.fit, brdf, i_dot_h);
            let terms = &of_brdf[..brdf_channels];
            for (l, density) in self.normals.iter().enumerate() {
                let area = areas.map(|areas| areas[l]);
                if area == [0.0; 3] {
                    continue;
                }
                let of_channel = product(self.integral, &axes, density, brdf, terms, at_half.is_none());
                let factor = density.amplitude * at_half.unwrap_or(1.0);
                for c in 0..3 {
                    let lobes = of_channel[if brdf_channels == 3 { c } else { 0 }];
                    sum[c] += colour[c] * f64::from(area[c] * factor * lobes);
                }
            }
        }
        sum
    }
}

/// What is left of the factors of a BRDF where the amplitudes have both cosines.
#[inline(always)]
pub fn factor_at_half(fit: AmplitudeFit, brdf: &BrdfLobe<'_>, i_dot_h: f64) -> Option<f32> {
    match fit {
        AmplitudeFit::Responsibilities => None,
        AmplitudeFit::LeastSquares | AmplitudeFit::NonNegative => {
            #[expect(clippy::cast_possible_truncation, reason = "the sums are in f32")]
            let cosine = (i_dot_h as f32).max(f32::MIN_POSITIVE);
            let [factor, ..] = brdf.lobe.masking.eval(&[cosine; LANES]);
            Some((factor / cosine) * (factor / cosine))
        }
    }
}

/// The integral of a lobe of the normals, its amplitude left out, and the sum of a BRDF, for each channel of `terms`; `with_factors` with the BRDF's other factors
/// at the axis of the product.
#[inline(always)]
fn product(
    integral: ProductIntegral,
    axes: &PairAxes,
    density: &Lobe,
    brdf: &BrdfLobe<'_>,
    terms: &[Terms],
    with_factors: bool,
) -> [f32; 3] {
    let d2 = axes.distance_squared(density);
    let mut of_channel = [0.0; 3];
    for (k, sharpness) in brdf.sharpness.iter().enumerate() {
        let mut integral = match integral {
            ProductIntegral::Exact => exact(density.sharpness, sharpness, d2),
            ProductIntegral::Closure => closure(density.sharpness, sharpness, d2),
        };
        if with_factors {
            let factors = masked(&axes.cosines(density, sharpness), brdf.lobe.masking);
            for l in 0..LANES {
                integral[l] *= factors[l];
            }
        }
        for (sum, terms) in of_channel.iter_mut().zip(terms) {
            for l in 0..LANES {
                *sum += terms.zonal[k][l] * integral[l];
            }
        }
        if terms[0].harmonic.is_empty() {
            continue;
        }
        let harmonics = axes.harmonics(density, sharpness);
        for (sum, terms) in of_channel.iter_mut().zip(terms) {
            for l in 0..LANES {
                *sum += terms.harmonic[k][l] * harmonics[l] * integral[l];
            }
        }
    }
    of_channel
}
