//! Integrals of a lobe of the normals times lobes of a BRDF about the half vector, with the BRDF's other factors, in f32 lanes over the latter.
//!
//! The factors of a BRDF that are no lobe (cosines, Smith's masking) are taken at the axis of the product, the normal that counts most in the integral.

use crate::filter::lobes::{Half, Masking, exp};
use crate::sg::Lobe;
use crate::simd::{LANES, Lanes};
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Directions of a pair.
#[derive(Clone, Copy, Debug)]
pub struct PairAxes {
    /// To the light.
    wi: Vec3,
    /// To the viewer.
    wo: Vec3,
    /// Their half vector.
    h: Vec3,
    /// Unit vector across it, in their plane.
    x: Vec3,
}

impl PairAxes {
    /// Of two directions, to the light and to the viewer.
    pub fn new([wi, wo]: [DVec3; 2]) -> Self {
        let h = Vec3::from(Half::new(wi, wo).h);
        // Directions that are the same have no plane, and BRDFs no harmonic there: any will do.
        let x = (wi - wo).try_normalize().map_or_else(|| h.any_orthonormal_vector(), |x| x.as_vec3());
        Self { wi: wi.as_vec3(), wo: wo.as_vec3(), h, x }
    }

    /// Squared distance of a lobe's axis from the half vector.
    #[inline(always)]
    pub fn distance_squared(&self, density: &Lobe) -> f32 {
        density.axis.distance_squared(self.h)
    }

    /// `n·wi` and `n·wo`, at least 0, at the axis `n` of the product of a lobe of normals and each of some lobes about the half vector.
    #[inline(always)]
    pub fn cosines(&self, density: &Lobe, sharpness: &Lanes) -> [Lanes; 2] {
        let [i, o, h] = self.axis_cosines(density).map(|cosine| [cosine; LANES]);
        self.cosines_of_each(&[density.sharpness; LANES], [&i, &o, &h], sharpness)
    }

    /// The same of a lobe of normals in each lane, with its sharpness and the cosines of its axis with the light, the viewer and the half vector.
    #[inline(always)]
    pub fn cosines_of_each(&self, own: &Lanes, [axis_i, axis_o, axis_h]: [&Lanes; 3], sharpness: &Lanes) -> [Lanes; 2] {
        let (mut cos_i, mut cos_o) = ([0.0; LANES], [0.0; LANES]);
        let of_half = [self.h.dot(self.wi), self.h.dot(self.wo)];
        for l in 0..LANES {
            // Shares of both axes in the sum, scaled so that sharpness of 1e8 does not overflow when squared.
            let total = own[l] + sharpness[l];
            let share = if total > 0.0 { sharpness[l] / total } else { 0.0 };
            let other = 1.0 - share;
            let length2 = share * share + other * other + 2.0 * share * other * axis_h[l];
            let inverse = 1.0 / length2.max(1e-12).sqrt();
            cos_i[l] = ((other * axis_i[l] + share * of_half[0]) * inverse).clamp(0.0, 1.0);
            cos_o[l] = ((other * axis_o[l] + share * of_half[1]) * inverse).clamp(0.0, 1.0);
        }
        [cos_i, cos_o]
    }

    /// Cosines of a lobe's axis with the light, the viewer and the half vector.
    #[inline(always)]
    pub fn axis_cosines(&self, density: &Lobe) -> [f32; 3] {
        [self.wi, self.wo, self.h].map(|w| density.axis.dot(w))
    }
}

impl PairAxes {
    /// `l` times the mean of `n_x² - n_y²` over the product of a lobe of normals and each of some lobes of sharpness `l` about the half vector, `x` in the
    /// plane of the pair: `(1 - 3 A(k) / k) (m_x² - m_y²)` of a product with axis `m` and sharpness `k`, with `A(k) = coth k - 1 / k`.
    #[inline(always)]
    pub fn harmonics(&self, density: &Lobe, sharpness: &Lanes) -> Lanes {
        let along = density.axis.dot(self.x);
        let axis_dot_half = density.axis.dot(self.h);
        let across = density.axis.dot(self.h.cross(self.x));
        let difference = (along - across) * (along + across);
        let mut out = [0.0; LANES];
        for l in 0..LANES {
            let total = (density.sharpness + sharpness[l]).max(f32::MIN_POSITIVE);
            let share = sharpness[l] / total;
            let other = 1.0 - share;
            let length2 = (share * share + other * other + 2.0 * share * other * axis_dot_half).max(1e-12);
            let k = total * length2.sqrt();
            let k2 = k * k;
            let series = k2 * (1.0 / 15.0 - k2 * (2.0 / 315.0));
            let decay = exp(-2.0 * k);
            let coth = (1.0 + decay) / (1.0 - decay).max(f32::MIN_POSITIVE);
            let plain = 1.0 - 3.0 * (coth - 1.0 / k) / k;
            let mean = if k < 0.5 { series } else { plain };
            out[l] = sharpness[l] * mean * (other * other / length2) * difference;
        }
        out
    }
}

/// `masking(n·wi) masking(n·wo)` where both cosines are above 0, else 0.
#[inline(always)]
pub fn masked([cos_i, cos_o]: &[Lanes; 2], masking: Masking) -> Lanes {
    let (to_light, to_viewer) = (masking.eval(cos_i), masking.eval(cos_o));
    let mut factors = [0.0; LANES];
    for l in 0..LANES {
        factors[l] = if cos_i[l] > 0.0 && cos_o[l] > 0.0 { to_light[l] * to_viewer[l] } else { 0.0 };
    }
    factors
}

/// Twin of [`crate::sg::integral_of_product`] for many lobes of a BRDF.
#[inline(always)]
pub fn exact(l1: f32, l2: &Lanes, d2: f32) -> Lanes {
    exact_of_each(&[l1; LANES], l2, &[d2; LANES])
}

/// The same of a lobe of the normals in each lane.
#[inline(always)]
pub fn exact_of_each(l1: &Lanes, l2: &Lanes, d2: &Lanes) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        let sum = (l1[l] + l2[l]).max(f32::MIN_POSITIVE);
        let reduced = l1[l] * (l2[l] / sum);
        let length = sum * (1.0 - (reduced / sum) * d2[l]).max(0.0).sqrt();
        out[l] = 4.0 * PI * exp(-reduced * d2[l] * (sum / (length + sum))) * g(2.0 * length);
    }
    out
}

/// The closure in one lobe (eq. 14).
#[inline(always)]
pub fn closure(l1: f32, l2: &Lanes, d2: f32) -> Lanes {
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
    use crate::numerics::random::Random;
    use crate::sg::integral_of_product;
    use std::f64::consts::TAU;

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

    #[test]
    fn a_harmonic_is_its_mean_over_the_product() {
        let directions = [DVec3::new(0.6, 0.2, 0.7).normalize(), DVec3::new(-0.5, 0.3, 0.9).normalize()];
        let axes = PairAxes::new(directions);
        let y = axes.h.cross(axes.x);
        let mut random = Random::new(3);
        for (own, other) in [(0.1, 0.3), (2.0, 5.0), (30.0, 8.0), (300.0, 1000.0)] {
            let density = Lobe { axis: (axes.h + 0.2 * axes.x + 0.05 * y).normalize(), sharpness: own, amplitude: 1.0 };
            let about_half = Lobe { axis: axes.h, sharpness: other, amplitude: 1.0 };
            let product = density.product(&about_half);
            // Directions of the product's density, by its inverse distribution (Jakob 2012, "Numerically stable sampling of the von Mises-Fisher distribution").
            let (t, b) = product.axis.any_orthonormal_pair();
            let mut sum = 0.0;
            let count = 200_000;
            for k in 0..count {
                let stratum = (f64::from(k) + random.unit()) / f64::from(count);
                let cos =
                    1.0 + (stratum + (1.0 - stratum) * (-2.0 * f64::from(product.sharpness)).exp()).ln() / f64::from(product.sharpness);
                let (sin, turn) = ((1.0 - cos * cos).max(0.0).sqrt(), TAU * random.unit());
                let n = (product.axis.as_dvec3() * cos) + (t.as_dvec3() * turn.cos() + b.as_dvec3() * turn.sin()) * sin;
                sum += n.dot(axes.x.as_dvec3()).powi(2) - n.dot(y.as_dvec3()).powi(2);
            }
            let expected = f64::from(other) * sum / f64::from(count);
            let [got, ..] = axes.harmonics(&density, &[other; LANES]);
            // Three standard deviations of the random azimuths, at most .7 of a unit each.
            let allowed =
                3.0 * f64::from(other) * 0.7 / f64::from(count).sqrt() / (1.0 + f64::from(product.sharpness)).sqrt().min(3.0) + 1e-4;
            assert!((f64::from(got) - expected).abs() < allowed, "{own}, {other}: {got} for {expected} within {allowed}");
        }
    }
}
