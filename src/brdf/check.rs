//! What a user should know about a small-scale BRDF before trusting it: energy, reciprocity, origin.

use super::facet::Colour;
use super::models::Brdf;
use crate::numerics::low_discrepancy::{fraction, sobol_3d};
use glam::DVec3;

/// Angles of incidence at which energy is checked, degrees from the normal.
const INCIDENCES_DEG: [f64; 22] =
    [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0, 75.0, 80.0, 85.0, 88.0, 89.0, 89.9, 89.99];
/// Up to here, in degrees, goniometers measure; beyond it tables hold what their makers put there.
const MEASURED_UP_TO_DEG: f64 = 80.0;
/// Samples of an albedo: the error stays below half a percent for every model (a test compares).
const ALBEDO_SAMPLES: u32 = 4096;
const ALBEDO_SEED: u32 = 0;
/// Albedos up to this are not reported: what the quadrature leaves open.
const ALBEDO_SLACK: f64 = 1.005;
/// Asymmetries up to this are not reported: what arithmetic leaves open.
const RECIPROCITY_SLACK: f64 = 1e-3;

/// The largest directional albedo of each channel, and where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PeakAlbedo {
    /// Reflected share of the light, by channel.
    pub albedo: Colour,
    /// Angle of incidence of that light, degrees from the normal, by channel.
    pub incidence_deg: [f64; 3],
}

impl PeakAlbedo {
    /// The largest channel: its albedo, its name, and its incidence in degrees.
    fn brightest(&self) -> (f64, &'static str, f64) {
        let c = (0..3).fold(0, |best, c| if self.albedo[c] > self.albedo[best] { c } else { best });
        (self.albedo[c], ["red", "green", "blue"][c], self.incidence_deg[c])
    }
}

/// How far `fr(wi, wo)` and `fr(wo, wi)` differ over a fixed set of pairs up to 85 degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reciprocity {
    /// Median of `|a - b| / ((a + b)/2)`, with `a` and `b` the sums over the channels; 0 for every analytic model.
    pub median: f64,
    /// Largest one.
    pub max: f64,
    /// Where the largest one is: polar angles of both directions and the azimuth between them, degrees.
    pub worst_deg: [f64; 3],
}

fn direction(theta_deg: f64, phi_deg: f64) -> DVec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
    DVec3::new(sin * cos_phi, sin * sin_phi, cos)
}

impl Brdf {
    /// Reflected share of light that arrives from `wi` on a facet with normal z, by channel.
    ///
    /// Deterministic, by quasi-random importance sampling; relative error below .5 %.
    pub fn directional_albedo(&self, wi: DVec3) -> Colour {
        let mut sum = [0.0; 3];
        for k in 0..ALBEDO_SAMPLES {
            let Some((wo, pdf)) = self.sample(DVec3::Z, wi, sobol_3d(k, ALBEDO_SEED).map(fraction)) else { continue };
            for (sum, f) in sum.iter_mut().zip(self.eval(DVec3::Z, wi, wo)) {
                *sum += f * wo.z / pdf;
            }
        }
        sum.map(|s| s / f64::from(ALBEDO_SAMPLES))
    }

    /// The largest directional albedo over incidences from 0 to 89.99 degrees.
    pub fn max_directional_albedo(&self) -> PeakAlbedo {
        self.max_albedo_up_to(90.0)
    }

    fn max_albedo_up_to(&self, limit_deg: f64) -> PeakAlbedo {
        let mut peak = PeakAlbedo::default();
        for theta in INCIDENCES_DEG.into_iter().filter(|&t| t <= limit_deg) {
            let albedo = self.directional_albedo(direction(theta, 0.0));
            for (c, albedo) in albedo.into_iter().enumerate() {
                if albedo > peak.albedo[c] {
                    (peak.albedo[c], peak.incidence_deg[c]) = (albedo, theta);
                }
            }
        }
        peak
    }

    /// How far the BRDF is from reciprocal.
    pub fn reciprocity_error(&self) -> Reciprocity {
        if !matches!(self, Self::Measured(_)) {
            return Reciprocity::default(); // all analytic forms are symmetric as written
        }
        let polar = || (5..=85).step_by(10).map(f64::from);
        let mut found = Vec::new();
        for a in polar() {
            for b in polar().filter(|&b| b >= a) {
                for phi in (0..=180).step_by(15).map(f64::from) {
                    let (wi, wo) = (direction(a, 0.0), direction(b, phi));
                    let forth: f64 = self.eval(DVec3::Z, wi, wo).iter().sum();
                    let back: f64 = self.eval(DVec3::Z, wo, wi).iter().sum();
                    if forth + back > 0.0 {
                        found.push((2.0 * (forth - back).abs() / (forth + back), [a, b, phi]));
                    }
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(max, worst_deg)) = found.last() else { return Reciprocity::default() };
        Reciprocity { median: found[found.len() / 2].0, max, worst_deg }
    }

    /// What a user should know, one sentence each: more light out than in, not reciprocal, not a measurement.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Self::BlinnPhong { diffuse, specular, .. }
        | Self::CookTorrance { diffuse, specular, f0: None, .. }
        | Self::Ward { diffuse, specular, .. } = self
        {
            let sum = (0..3).map(|c| diffuse[c] + specular[c]).fold(0.0, f64::max);
            if sum > 1.0 {
                warnings.push(format!("diffuse + specular reach {sum:.3}, over 1: the facets may reflect more light than falls on them"));
            }
        }
        // Lambert never, and Cook-Torrance only as just said; with `f0` its lobe is far weaker than `specular` but for grazing light.
        let sum = match self {
            Self::CookTorrance { diffuse, specular, f0: Some(_), .. } => (0..3).map(|c| diffuse[c] + specular[c]).fold(0.0, f64::max),
            Self::Lambert { .. } | Self::CookTorrance { .. } => 0.0,
            Self::BlinnPhong { .. } | Self::Ward { .. } | Self::Measured(_) => f64::INFINITY,
        };
        if sum > 1.0 {
            let (albedo, channel, incidence) = self.max_directional_albedo().brightest();
            if albedo > ALBEDO_SLACK {
                let mut text =
                    format!("reflects up to {albedo:.2} times the light that falls on it ({channel}, incidence {incidence} degrees)");
                if matches!(self, Self::Measured(_)) {
                    let (within, ..) = self.max_albedo_up_to(MEASURED_UP_TO_DEG).brightest();
                    text += &format!("; up to {MEASURED_UP_TO_DEG} degrees at most {within:.2}: such data are not made for grazing light");
                }
                warnings.push(text);
            }
        }
        if let Self::Measured(measured) = self {
            let error = self.reciprocity_error();
            if error.max > RECIPROCITY_SLACK {
                let [a, b, phi] = error.worst_deg;
                warnings.push(format!(
                    "the data of {} are not reciprocal and are used as they are: exchanging light and viewer changes them by {:.1} % \
                     (median), at most {:.0} % (polar angles {a} and {b}, azimuth {phi} degrees)",
                    measured.label,
                    100.0 * error.median,
                    100.0 * error.max
                ));
            }
            if measured.is_fit() {
                warnings.push(format!("\"{}\" is a neural fit of a MERL material, not the measurement", measured.label));
            }
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{every_model, office_paper};
    use super::super::{Distribution, Measured};
    use super::*;

    #[test]
    fn lambert_reflects_its_albedo_from_every_direction() {
        let peak = Brdf::Lambert { albedo: [0.1, 0.7, 1.0] }.max_directional_albedo();
        for (got, expected) in peak.albedo.iter().zip([0.1, 0.7, 1.0]) {
            assert!((got - expected).abs() < 1e-12, "{got} not {expected}");
        }
    }

    #[test]
    fn energy_is_kept_by_microfacets_and_not_by_ward() {
        for distribution in [Distribution::Ggx, Distribution::Beckmann] {
            for alpha in [1e-3, 0.05, 0.3, 1.0] {
                let brdf = Brdf::CookTorrance { diffuse: [0.0; 3], specular: [1.0; 3], alpha, distribution, f0: None };
                let peak = brdf.max_directional_albedo();
                assert!(peak.albedo[0] < ALBEDO_SLACK && peak.albedo[0] > 0.4, "{distribution:?} {alpha}: {peak:?}");
            }
        }
        let ward = Brdf::Ward { diffuse: [0.0; 3], specular: [1.0; 3], alpha: 0.3 };
        let peak = ward.max_directional_albedo();
        assert!((peak.albedo[0] - 3.2).abs() < 0.1 && peak.incidence_deg[0] == 89.99, "{peak:?}");
        // Along the normal, exponent 0: (e+2)/(2 pi) cos integrates to 1; and it is largest there.
        let blinn = Brdf::BlinnPhong { diffuse: [0.0; 3], specular: [1.0; 3], exponent: 0.0 };
        assert!((blinn.directional_albedo(DVec3::Z)[0] - 1.0).abs() < 5e-3);
        // A mirror: 4 (o.h) times the specular factor.
        let blinn = Brdf::BlinnPhong { diffuse: [0.0; 3], specular: [1.0; 3], exponent: 1e6 };
        assert!((blinn.directional_albedo(DVec3::Z)[0] - 4.0).abs() < 0.02);
    }

    #[test]
    fn analytic_models_are_reciprocal_and_office_paper_is_not() {
        for (name, brdf) in every_model().into_iter().filter(|(_, b)| !matches!(b, Brdf::Measured(_))) {
            assert_eq!(brdf.reciprocity_error(), Reciprocity::default(), "{name}");
        }
        let error = office_paper().reciprocity_error();
        assert!(error.median > 0.01 && error.median < 0.04 && error.max > 0.2, "{error:?}");
    }

    #[test]
    fn fits_are_reciprocal() {
        let gold = Brdf::Measured(Measured::fit("gold-metallic-paint", 1.0).unwrap().into());
        let error = gold.reciprocity_error();
        assert!(error.max < 1e-9, "{error:?}");
    }

    #[test]
    fn warnings_say_what_is_wrong_with_figures() {
        let say = |brdf: &Brdf| brdf.warnings().join("\n");
        assert_eq!(say(&Brdf::Lambert { albedo: [1.0; 3] }), "");
        let ggx = |diffuse| Brdf::CookTorrance { diffuse, specular: [0.5; 3], alpha: 0.2, distribution: Distribution::Ggx, f0: None };
        assert_eq!(say(&ggx([0.5; 3])), "");
        assert!(say(&ggx([0.0, 0.7, 0.0])).contains("diffuse + specular reach 1.200"));
        // A dielectric: specular 1 of F, which is .04 towards the normal.
        let varnish = |diffuse, f0| {
            let (specular, distribution) = ([1.0; 3], Distribution::Ggx);
            say(&Brdf::CookTorrance { diffuse: [diffuse; 3], specular, alpha: 0.2, distribution, f0: Some([f0; 3]) })
        };
        assert_eq!(varnish(0.3, 0.04), "");
        assert!(varnish(0.9, 0.04).contains("times the light that falls on it"), "{}", varnish(0.9, 0.04));
        assert!(varnish(0.5, 0.9).contains("times the light that falls on it"));
        assert!(say(&Brdf::Ward { diffuse: [0.0; 3], specular: [0.9; 3], alpha: 0.3 }).contains("incidence 89.99 degrees"));
        assert!(say(&Brdf::BlinnPhong { diffuse: [0.0; 3], specular: [0.5; 3], exponent: 100.0 }).contains("reflects up to"));
        let paper = say(&office_paper());
        assert!(paper.contains("not reciprocal") && paper.contains("up to 80 degrees at most 0.98"), "{paper}");
        let gold = Brdf::Measured(Measured::fit("gold-metallic-paint", 1.0).unwrap().into());
        assert!(say(&gold).contains("a neural fit"), "{}", say(&gold));
    }
}
