//! Importance sampling: directions drawn roughly in proportion to `fr cos`, for paths and for integrals.
//!
//! One sample is drawn from one of two parts, chosen at random: cosine-distributed over the hemisphere, or the lobe. The pdf
//! is that of the mixture, so that `fr cos / pdf` averages to the directional albedo whichever part was chosen. The lobes:
//! visible GGX normals (Heitz 2018, in the spherical-cap form of Dupuy and Benyoub 2023) for `cook-torrance` with GGX and for
//! `measured`, with a roughness that [`Measured::lobe_alpha`] estimates; Beckmann normals (Walter et al. 2007) for
//! `cook-torrance` with Beckmann and for `ward`, whose lobe has that shape; a power of the cosine for `blinn-phong`.
//!
//! [`Measured::lobe_alpha`]: super::Measured::lobe_alpha

use super::facet::{Colour, half_vector};
use super::microfacet::{Distribution, HalfAngle};
use super::models::Brdf;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// At least this share of the samples is cosine-distributed: half-vector lobes alone miss light at grazing directions.
const MIN_COSINE_SHARE: f64 = 0.1;
/// Share of the lobe for measured data, whose diffuse part is not known apart.
const MEASURED_LOBE_SHARE: f64 = 0.5;

/// Distribution of half vectors that a lobe is drawn from.
#[derive(Clone, Copy, Debug)]
enum Lobe {
    /// GGX normals as the known direction sees them.
    VisibleGgx { alpha: f64 },
    /// Beckmann normals by projected area.
    Beckmann { alpha: f64 },
    /// `(e+1)/(2 pi) (n·h)^e`.
    Power { exponent: f64 },
}

impl Brdf {
    /// A direction above the facet for the other end of a path that arrives along `w_known`, and its density.
    ///
    /// `n` and `w_known` are unit vectors; `u` are three numbers in `0..1`. The density is that of [`Brdf::pdf`], per
    /// steradian. `None` when `w_known` is not above the facet, and for the share of samples that fall below it: they count
    /// as samples of value 0. A path that starts at the viewer knows `wo` and is given `wi`.
    pub fn sample(&self, n: DVec3, w_known: DVec3, u: [f64; 3]) -> Option<(DVec3, f64)> {
        let above = n.dot(w_known) > 0.0; // false for NaN
        if !above {
            return None;
        }
        let (lobe, share) = self.lobe();
        let (x, y) = n.any_orthonormal_pair();
        let direction = match lobe {
            Some(lobe) if u[0] < share => {
                let known = DVec3::new(w_known.dot(x), w_known.dot(y), w_known.dot(n));
                let h = lobe.sample(known, u[1], u[2]);
                let w = 2.0 * known.dot(h) * h - known;
                w.x * x + w.y * y + w.z * n
            }
            _ => {
                let (radius, phi) = (u[1].sqrt(), TAU * u[2]);
                radius * phi.cos() * x + radius * phi.sin() * y + (1.0 - u[1]).max(0.0).sqrt() * n
            }
        }
        .try_normalize()?;
        let pdf = self.pdf(n, w_known, direction);
        (pdf > 0.0).then_some((direction, pdf))
    }

    /// Density per steradian with which [`Brdf::sample`] draws `w` when `w_known` is known; 0 when either is not above the
    /// facet. Its integral is the share of samples that are not `None`.
    pub fn pdf(&self, n: DVec3, w_known: DVec3, w: DVec3) -> f64 {
        let (cos_known, cos) = (n.dot(w_known), n.dot(w));
        if !(cos_known > 0.0 && cos > 0.0) {
            return 0.0;
        }
        let diffuse = cos / PI;
        match self.lobe() {
            (Some(lobe), share) => {
                let h = half_vector(n, w_known, w);
                share * lobe.pdf(HalfAngle::between(n, h), w_known.dot(h), cos_known) + (1.0 - share) * diffuse
            }
            (None, _) => diffuse,
        }
    }

    /// The lobe, and the share of samples that it gets.
    fn lobe(&self) -> (Option<Lobe>, f64) {
        let mean = |c: &Colour| c.iter().sum::<f64>() / 3.0;
        let weighed = |lobe, diffuse: &Colour, specular: f64| {
            if specular > 0.0 { (Some(lobe), (specular / (specular + mean(diffuse))).min(1.0 - MIN_COSINE_SHARE)) } else { (None, 0.0) }
        };
        match self {
            Self::Lambert { .. } => (None, 0.0),
            Self::BlinnPhong { diffuse, specular, exponent } => weighed(Lobe::Power { exponent: *exponent }, diffuse, mean(specular)),
            Self::CookTorrance { diffuse, specular, alpha, distribution, f0 } => {
                let lobe = match distribution {
                    Distribution::Ggx => Lobe::VisibleGgx { alpha: *alpha },
                    Distribution::Beckmann => Lobe::Beckmann { alpha: *alpha },
                };
                // Schlick's F averages to f0 + (1 - f0)/21 over the hemisphere of cosine-distributed directions.
                let fresnel = f0.map_or(1.0, |f| mean(&f) + (1.0 - mean(&f)) / 21.0);
                weighed(lobe, diffuse, mean(specular) * fresnel)
            }
            Self::Ward { diffuse, specular, alpha } => weighed(Lobe::Beckmann { alpha: *alpha }, diffuse, mean(specular)),
            Self::Measured(measured) => (Some(Lobe::VisibleGgx { alpha: measured.lobe_alpha() }), MEASURED_LOBE_SHARE),
        }
    }
}

impl Lobe {
    /// A half vector in the frame of the facet, z up, for the direction `known` and two numbers in `0..1`.
    fn sample(self, known: DVec3, u1: f64, u2: f64) -> DVec3 {
        let phi = TAU * u1;
        let from_sin2 = |sin2: f64| {
            let sin = sin2.max(0.0).sqrt();
            DVec3::new(sin * phi.cos(), sin * phi.sin(), (1.0 - sin2).max(0.0).sqrt())
        };
        match self {
            Self::VisibleGgx { alpha } => {
                // The known direction in the frame in which the ellipsoid is a sphere, and a cap of that sphere.
                let v = DVec3::new(alpha * known.x, alpha * known.y, known.z).normalize();
                let z = (1.0 - u2) * (1.0 + v.z) - v.z;
                let sin = (1.0 - z * z).max(0.0).sqrt();
                let h = DVec3::new(sin * phi.cos(), sin * phi.sin(), z) + v;
                DVec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).try_normalize().unwrap_or(DVec3::Z)
            }
            Self::Beckmann { alpha } => {
                let tan2 = -alpha * alpha * (-u2).ln_1p();
                from_sin2(tan2 / (1.0 + tan2))
            }
            // cos = (1 - u)^(1/(e+1)), by its sine
            Self::Power { exponent } => from_sin2(-(2.0 / (exponent + 1.0) * (-u2).ln_1p()).exp_m1()),
        }
    }

    /// Density per steradian of the reflected direction; `along` is the cosine between the known direction and `h`.
    fn pdf(self, h: HalfAngle, along: f64, cos_known: f64) -> f64 {
        // d h = d w / (4 |w·h|)
        let reflected = 0.25 / along.max(f64::MIN_POSITIVE);
        match self {
            Self::VisibleGgx { alpha } => 0.25 * Distribution::Ggx.ndf(h, alpha) * Distribution::Ggx.g1_over_cos(cos_known, alpha),
            Self::Beckmann { alpha } => Distribution::Beckmann.ndf(h, alpha) * h.cos * reflected,
            Self::Power { exponent } => (exponent + 1.0) / TAU * h.cos_power(exponent) * reflected,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{above, every_model};
    use super::*;
    use crate::numerics::low_discrepancy::{fraction, sobol_3d};

    /// `count` samples for a known direction at `theta`.
    fn samples(brdf: &Brdf, theta: f64, count: u32) -> (DVec3, Vec<Option<(DVec3, f64)>>) {
        let known = above(theta, 0.7);
        let draw = |k| brdf.sample(DVec3::Z, known, sobol_3d(k, 1).map(fraction));
        (known, (0..count).map(draw).collect())
    }

    #[test]
    fn samples_fall_where_the_density_says() {
        // Share of the samples in each of 8 x 8 cells of equal projected solid angle against the integral of the pdf over it.
        for (name, brdf) in every_model() {
            for theta in [0.2, 1.2] {
                let count = 200_000;
                let (known, drawn) = samples(&brdf, theta, count);
                let mut share = [[0.0; 8]; 8];
                for (w, pdf) in drawn.into_iter().flatten() {
                    assert!((pdf / brdf.pdf(DVec3::Z, known, w) - 1.0).abs() < 1e-9);
                    let ring = ((1.0 - w.z * w.z) * 8.0) as usize;
                    let sector = (w.y.atan2(w.x).rem_euclid(TAU) / TAU * 8.0) as usize;
                    share[ring.min(7)][sector.min(7)] += 1.0 / f64::from(count);
                }
                for (ring, row) in share.iter().enumerate() {
                    for (sector, &got) in row.iter().enumerate() {
                        let steps = 100;
                        let mut expected = 0.0;
                        for a in 0..steps {
                            for b in 0..steps {
                                let r2 = (ring as f64 + (f64::from(a) + 0.5) / f64::from(steps)) / 8.0;
                                let phi = (sector as f64 + (f64::from(b) + 0.5) / f64::from(steps)) / 8.0 * TAU;
                                let cos = (1.0 - r2).sqrt();
                                let w = DVec3::new(r2.sqrt() * phi.cos(), r2.sqrt() * phi.sin(), cos);
                                // d omega cos = pi / 64 over the cell
                                expected += brdf.pdf(DVec3::Z, known, w) / cos * PI / 64.0 / f64::from(steps * steps);
                            }
                        }
                        assert!(
                            (got - expected).abs() < 0.002 + 0.02 * expected,
                            "{name} at {theta}: cell {ring}, {sector}: {got} not {expected}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn sampled_albedo_equals_quadrature() {
        for (name, brdf) in every_model() {
            for theta in [0.0, 0.8, 1.3] {
                let (known, drawn) = samples(&brdf, theta, 60_000);
                let count = drawn.len() as f64;
                let mut sampled = [0.0; 3];
                for (w, pdf) in drawn.into_iter().flatten() {
                    for (sum, f) in sampled.iter_mut().zip(brdf.eval(DVec3::Z, w, known)) {
                        *sum += f * w.z / pdf / count;
                    }
                }
                let (rings, sectors) = (500, 500);
                let mut expected = [0.0; 3];
                for a in 0..rings {
                    for b in 0..sectors {
                        let r2 = (f64::from(a) + 0.5) / f64::from(rings);
                        let phi = (f64::from(b) + 0.5) / f64::from(sectors) * TAU;
                        let w = DVec3::new(r2.sqrt() * phi.cos(), r2.sqrt() * phi.sin(), (1.0 - r2).sqrt());
                        for (sum, f) in expected.iter_mut().zip(brdf.eval(DVec3::Z, w, known)) {
                            *sum += f * PI / f64::from(rings * sectors);
                        }
                    }
                }
                for c in 0..3 {
                    let off = (sampled[c] - expected[c]).abs();
                    assert!(off < 5e-4 + 0.01 * expected[c], "{name} at {theta}: {sampled:?} not {expected:?}");
                }
            }
        }
    }

    #[test]
    fn mirror_like_lobes_are_sampled_without_noise() {
        // The whole lobe of GGX alpha 1e-3: nine tenths of the samples hit it and each weighs what it should.
        let brdf = Brdf::CookTorrance { diffuse: [0.0; 3], specular: [1.0; 3], alpha: 1e-3, distribution: Distribution::Ggx, f0: None };
        for theta in [0.0, 1.0, 1.5] {
            let (known, drawn) = samples(&brdf, theta, 4096);
            let albedo: f64 = drawn.iter().flatten().map(|&(w, pdf)| brdf.eval(DVec3::Z, w, known)[0] * w.z / pdf / 4096.0).sum();
            assert!((albedo - 1.0).abs() < 0.01, "{albedo} at {theta}");
        }
    }

    #[test]
    fn nothing_is_sampled_from_below_or_from_numbers_that_are_none() {
        let brdf = Brdf::Lambert { albedo: [0.5; 3] };
        assert_eq!(brdf.sample(DVec3::Z, -DVec3::Z, [0.5; 3]), None);
        assert_eq!(brdf.sample(DVec3::Z, DVec3::X, [0.5; 3]), None);
        assert_eq!(brdf.sample(DVec3::Z, DVec3::NAN, [0.5; 3]), None);
        assert_eq!(brdf.pdf(DVec3::Z, DVec3::Z, -DVec3::Z), 0.0);
    }
}
