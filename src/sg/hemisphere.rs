//! Integrals of one lobe over a hemisphere, in f32.

use super::lobe::g;
use std::f32::consts::PI;

/// `∫ exp(l (w·x - 1)) dw` over the hemisphere about a normal whose cosine with the axis `x` is `cosine` (Tokuyoshi 2022, "Accurate diffuse lighting
/// from spherical Gaussian lights"), for sharpnesses of 0 to 1e8: within .5 % of the integral over the sphere.
pub fn hemispherical_integral(sharpness: f32, cosine: f32) -> f32 {
    /// Fitted by Tokuyoshi.
    const A: f32 = 0.651_732_9;
    const B: f32 = 1.341_828;
    const C: f32 = 7.221_667;
    /// `erf(t c) / erf(t)` is `c` from here down.
    const SMALL: f32 = 1e-3;
    let l = sharpness;
    let steepness = l * ((0.5 * l + A) / ((l + B) * l + C)).sqrt();
    let ratio = if steepness < SMALL { cosine } else { libm::erff(steepness * cosine) / libm::erff(steepness) };
    let share = (0.5 + 0.5 * ratio).clamp(0.0, 1.0);
    let behind = (-l).exp();
    2.0 * PI * (behind + share * (1.0 - behind)) * g(-l)
}

/// `∫ exp(l (w·x - 1)) (w·n)+ dw` for a unit normal `n` whose cosine with the axis `x` is `cosine` (the fit of Hill and Pettineo 2016, "SG series, part 3"), for sharpnesses of
/// 0 to 1e8: within 2.2 % of the integral over the sphere. Below 1, where the fit ends, its mean is blended with that of a constant.
pub fn clamped_cosine_integral(sharpness: f32, cosine: f32) -> f32 {
    /// Least sharpness of the fit.
    const LEAST: f32 = 1.0;
    let whole = |sharpness: f32| 4.0 * PI * g(-2.0 * sharpness);
    if sharpness < LEAST {
        let mean = clamped_cosine_integral(LEAST, cosine) / whole(LEAST);
        return (0.25 + sharpness / LEAST * (mean - 0.25)) * whole(sharpness);
    }
    const C0: f32 = 0.36;
    const C1: f32 = 1.0 / (4.0 * C0);
    let (e1, e2) = ((-sharpness).exp(), (-2.0 * sharpness).exp());
    let scale = 1.0 + 2.0 * e2 - 1.0 / sharpness;
    let bias = (e1 - e2) / sharpness - e2;
    // 1 - scale, without the difference.
    let width = (1.0 / sharpness - 2.0 * e2).max(0.0).sqrt();
    let (tilt, soft) = (C0 * cosine, C1 * width);
    let clamped = if tilt.abs() <= soft { (tilt + soft) * (tilt + soft) / width } else { cosine.clamp(0.0, 1.0) };
    (scale * clamped + bias) * 2.0 * PI / sharpness
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Mean of a function of the cosine with the normal over the lobe's density, by its quantiles and equal angles around the axis.
    fn mean(sharpness: f64, cosine: f64, f: impl Fn(f64) -> f64) -> f64 {
        const RINGS: usize = 400;
        const AROUND: usize = 96;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let ring = |i: usize| {
            let u = (i as f64 + 0.5) / RINGS as f64;
            let down = -(u * (-2.0 * sharpness).exp_m1()).ln_1p() / sharpness;
            let (along, across) = (1.0 - down, (down * (2.0 - down)).max(0.0).sqrt());
            (0..AROUND).map(|j| f(cosine * along + sine * across * (TAU * (j as f64 + 0.5) / AROUND as f64).cos())).sum::<f64>()
        };
        (0..RINGS).map(ring).sum::<f64>() / (RINGS * AROUND) as f64
    }

    /// The largest difference from the quadrature, in the integral over the sphere.
    fn worst(integral: impl Fn(f32, f32) -> f32, f: impl Fn(f64) -> f64 + Copy, sharpness: f32) -> f64 {
        let whole = f64::from(4.0 * PI * g(-2.0 * sharpness));
        let off = |k: i16| {
            let cosine = f32::from(k) / 10.0;
            (f64::from(integral(sharpness, cosine)) / whole - mean(sharpness.into(), cosine.into(), f)).abs()
        };
        (-10..=10).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn the_hemispherical_integral_errs_as_it_says() {
        let above = |z: f64| if z > 0.0 { 1.0 } else { 0.0 };
        for sharpness in [0.01, 0.1, 1.0, 5.0, 10.0, 30.0, 100.0, 1e4] {
            let worst = worst(hemispherical_integral, above, sharpness);
            assert!(worst < 5e-3, "sharpness {sharpness}: off by {worst}");
        }
        assert!((hemispherical_integral(0.0, 0.3) - 2.0 * PI).abs() < 1e-5);
        assert!(hemispherical_integral(1e8, 1.0) > 0.0 && hemispherical_integral(1e8, -1.0) >= 0.0);
    }

    #[test]
    fn the_clamped_cosine_integral_errs_as_it_says() {
        for (sharpness, allowed) in
            [(0.01, 0.005), (0.1, 0.005), (0.5, 0.022), (0.9, 0.022), (1.0, 0.022), (2.0, 0.022), (5.0, 0.02), (30.0, 0.02), (1e3, 0.005)]
        {
            let worst = worst(clamped_cosine_integral, |z| z.max(0.0), sharpness);
            assert!(worst < allowed, "sharpness {sharpness}: off by {worst}");
        }
        assert!((clamped_cosine_integral(1e8, 0.5) * 1e8 / (2.0 * PI) - 0.5).abs() < 1e-3);
    }
}
