//! Integrals of lobes of normals times lobes of a BRDF, for one pair, in f32 lanes over the lobes of the BRDF.
//!
//! Where a facet belongs to lobes by responsibilities, the factors of the BRDF that are no lobe (cosines, Smith's masking) are taken at the axis of the
//! product, the normal that counts most in the integral. By least squares the amplitudes have the cosines, and what remains of the factors
//! is taken at the half vector (Wang et al. 2009, section 4; Iwasaki et al. 2012, section 4.1).

use super::amplitudes::Amplitude;
use super::brdf_lobes::BrdfLobe;
use super::normals::GroupedLobe;
use crate::brdf::Colour;
use crate::filter::lobes::{Half, Masking, exp};
use crate::filter::plan::{AmplitudeFit, ProductIntegral};
use crate::sg::Lobe;
use crate::simd::{Kernel, LANES, Lanes};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// `S` of one pair from one surface.
pub struct PairIntegral<'a> {
    /// Lobes of the surface's normals.
    pub normals: &'a [GroupedLobe],
    /// What the pair sees of each group of them.
    pub amplitudes: &'a [Amplitude],
    /// Whether the amplitudes have a number a channel.
    pub tinted: bool,
    /// How they were found.
    pub fit: AmplitudeFit,
    /// The integral of two lobes.
    pub integral: ProductIntegral,
    /// Constant part of the BRDF.
    pub constant: Colour,
    /// Its sums of lobes.
    pub brdf: &'a [BrdfLobe<'a>],
    /// To the light and to the viewer.
    pub directions: [DVec3; 2],
    /// Room for the amplitudes of a sum.
    pub scratch: &'a mut [Vec<Lanes>; 3],
}

impl Kernel for PairIntegral<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run(self) -> [f64; 3] {
        let [wi, wo] = self.directions;
        let half = Half::new(wi, wo);
        let (h, i_dot_h) = (Vec3::from(half.h), 0.5 * (wi + wo).length());
        let axes = Axes { wi: wi.as_vec3(), wo: wo.as_vec3(), h };
        let channel = |c: usize| if self.tinted { c } else { 0 };
        let mut sum = [0.0; 3];
        for amplitude in self.amplitudes {
            for c in 0..3 {
                sum[c] += self.constant[c] * f64::from(amplitude.projected[channel(c)]);
            }
        }
        for brdf in self.brdf {
            let colour = brdf.lobe.colour_at(i_dot_h);
            let channels = brdf.amplitudes.at(i_dot_h, self.scratch);
            // What is left of the factors when the amplitudes have both cosines.
            let at_half = match self.fit {
                AmplitudeFit::Responsibilities => None,
                AmplitudeFit::LeastSquares | AmplitudeFit::NonNegative => {
                    #[expect(clippy::cast_possible_truncation, reason = "the sums are in f32")]
                    let cosine = (i_dot_h as f32).max(f32::MIN_POSITIVE);
                    let [factor, ..] = brdf.lobe.masking.eval(&[cosine; LANES]);
                    Some((factor / cosine) * (factor / cosine))
                }
            };
            for GroupedLobe { density, group, share } in self.normals {
                let amplitude = &self.amplitudes[*group];
                let visible = if at_half.is_some() { amplitude.projected } else { amplitude.visible };
                if visible == [0.0; 3] {
                    continue;
                }
                let d2 = density.axis.distance_squared(h);
                let mut of_channel = [0.0; 3];
                for (k, sharpness) in brdf.sharpness.iter().enumerate() {
                    let mut integral = match self.integral {
                        ProductIntegral::Exact => exact(density.sharpness, sharpness, d2),
                        ProductIntegral::Closure => closure(density.sharpness, sharpness, d2),
                    };
                    if at_half.is_none() {
                        let factors = axes.factors(density, sharpness, brdf.lobe.masking);
                        for l in 0..LANES {
                            integral[l] *= factors[l];
                        }
                    }
                    for c in 0..channels {
                        let amplitudes = &self.scratch[c][k];
                        for l in 0..LANES {
                            of_channel[c] += amplitudes[l] * integral[l];
                        }
                    }
                }
                let factor = share * density.amplitude * at_half.unwrap_or(1.0);
                for c in 0..3 {
                    let lobes = of_channel[if channels == 3 { c } else { 0 }];
                    sum[c] += colour[c] * f64::from(visible[channel(c)]) * f64::from(factor * lobes);
                }
            }
        }
        sum
    }
}

/// Directions of a pair.
struct Axes {
    wi: Vec3,
    wo: Vec3,
    h: Vec3,
}

impl Axes {
    /// `masking(n·wi) masking(n·wo)` at the axis `n` of the product of a lobe of normals and lobes about the half vector.
    #[inline(always)]
    fn factors(&self, density: &Lobe, sharpness: &Lanes, masking: Masking) -> Lanes {
        let (mut cos_i, mut cos_o) = ([0.0; LANES], [0.0; LANES]);
        let of_axis = [density.axis.dot(self.wi), density.axis.dot(self.wo)];
        let of_half = [self.h.dot(self.wi), self.h.dot(self.wo)];
        let axis_dot_half = density.axis.dot(self.h);
        for l in 0..LANES {
            // Shares of both axes in the sum, scaled so that sharpness of 1e8 does not overflow when squared.
            let total = density.sharpness + sharpness[l];
            let share = if total > 0.0 { sharpness[l] / total } else { 0.0 };
            let other = 1.0 - share;
            let length2 = share * share + other * other + 2.0 * share * other * axis_dot_half;
            let inverse = 1.0 / length2.max(1e-12).sqrt();
            cos_i[l] = ((other * of_axis[0] + share * of_half[0]) * inverse).clamp(0.0, 1.0);
            cos_o[l] = ((other * of_axis[1] + share * of_half[1]) * inverse).clamp(0.0, 1.0);
        }
        let (to_light, to_viewer) = (masking.eval(&cos_i), masking.eval(&cos_o));
        let mut factors = [0.0; LANES];
        for l in 0..LANES {
            factors[l] = if cos_i[l] > 0.0 && cos_o[l] > 0.0 { to_light[l] * to_viewer[l] } else { 0.0 };
        }
        factors
    }
}

/// Twin of [`crate::sg::integral_of_product`] for many lobes of a BRDF.
#[inline(always)]
fn exact(l1: f32, l2: &Lanes, d2: f32) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        let sum = (l1 + l2[l]).max(f32::MIN_POSITIVE);
        let reduced = l1 * (l2[l] / sum);
        let length = sum * (1.0 - (reduced / sum) * d2).max(0.0).sqrt();
        out[l] = 4.0 * PI * exp(-reduced * d2 * (sum / (length + sum))) * g(2.0 * length);
    }
    out
}

/// The closure in one lobe (eq. 14).
#[inline(always)]
fn closure(l1: f32, l2: &Lanes, d2: f32) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        let sum = (l1 + l2[l]).max(f32::MIN_POSITIVE);
        out[l] = 4.0 * PI * exp(-0.5 * l1 * (l2[l] / sum) * d2) * g(2.0 * sum);
    }
    out
}

/// `(1 - e^-x) / x` for `x >= 0`.
#[inline(always)]
fn g(x: f32) -> f32 {
    // Where 1 - e^-x cancels, its series; below 1e-6 relative on both sides of the change.
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0))));
    let plain = (1.0 - exp(-x)) / x.max(f32::MIN_POSITIVE);
    if x < 0.2 { series } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sg::integral_of_product;

    #[test]
    fn lanes_integrate_as_the_plain_function_does() {
        let sharpness: Lanes = std::array::from_fn(|l| if l == 0 { 0.0 } else { 10_f32.powf(l as f32 - 6.0) });
        for l1 in [0.0, 1e-4, 0.3, 7.0, 1e3, 1e8] {
            for d2 in [0.0, 1e-6, 1e-2, 0.7, 3.0, 4.0] {
                for (l2, got) in sharpness.iter().zip(exact(l1, &sharpness, d2)) {
                    let expected = integral_of_product(l1, *l2, d2);
                    // The lanes' exponential ends at 2^-80.
                    assert!((got - expected).abs() <= 2e-5 * expected + 1e-22, "{l1}, {l2}, {d2}: {got:e} for {expected:e}");
                }
                for (l2, got) in sharpness.iter().zip(closure(l1, &sharpness, d2)) {
                    let (a, b) =
                        (Lobe { axis: Vec3::Z, sharpness: l1, amplitude: 1.0 }, Lobe { axis: Vec3::Z, sharpness: *l2, amplitude: 1.0 });
                    let closed = a.product_closure(&b);
                    let expected = closed.amplitude * (-0.5 * closed.sharpness * d2).exp();
                    assert!((got - expected).abs() <= 2e-5 * expected + 1e-22, "{l1}, {l2}, {d2}: {got:e} for {expected:e}");
                }
            }
        }
    }
}
