//! Residuals of what is known beforehand: priors of parameters and of the lights' directions, and what unlit pixels say of the stray light.

use crate::fit_file::spec::Parameter;
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::block::ResidualBlock;
use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::equations::{Equations, Origin, Row};
use crate::residuals::params::PARAMS;
use crate::residuals::unknowns::{UnknownKind, Variable};

/// Least standard deviation of a stray-light offset: that of a photograph that is black all over.
const LEAST_SIGMA: f64 = 1e-12;

/// What is known of a state beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Priors<'a> {
    /// Parameters of the fit file, and their values.
    pub parameters: (&'a [Parameter], &'a [f64]),
    /// What the search moves: lights have standard deviations of their own.
    pub variables: &'a [Variable],
    /// Azimuth and elevation of the light of each distant photograph against what was given, degrees.
    pub lights: &'a [[f64; 2]],
    /// The distant photographs, which show their stray light.
    pub photographs: &'a [DirectionBins],
}

impl ResidualBlock for Priors<'_> {
    fn add_to(&self, basis: &ColourBasis<'_>, equations: &mut Equations) {
        let (parameters, values) = self.parameters;
        for (parameter, value) in parameters.iter().zip(values) {
            if let Some([mean, sigma]) = parameter.prior {
                equations.fixed.push(((value - mean) / sigma, Origin::Prior));
            }
        }
        for variable in self.variables {
            if let Variable::Light { photograph, axis, sigma } = variable {
                equations.fixed.push((self.lights[*photograph][*axis] / sigma, Origin::Prior));
            }
        }
        for (k, unknown) in basis.unknowns.iter().enumerate() {
            if let UnknownKind::StrayLight(p, c) = unknown.kind {
                let DirectionBins { mean, unlit, .. } = &self.photographs[p];
                let [of_mean, of_seen] = PARAMS.stray_light_seen;
                let (value, sigma) = match unlit {
                    Some(unlit) => (unlit[c], (of_mean * mean[c]).hypot(of_seen * unlit[c])),
                    None => (0.0, PARAMS.stray_light * mean[c]),
                };
                let sigma = sigma.max(LEAST_SIGMA);
                equations.rows.push((Row { terms: vec![(k, 1.0)], known: 0.0, value, sigma, weight: 1.0 }, Origin::Prior));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residuals::colour_basis::tests::Grooves;
    use crate::residuals::unknowns::Unknown;
    use biscale::material::NumberKey;

    #[test]
    fn priors_are_residuals_in_standard_deviations_and_stray_light_is_a_row() {
        let parameter = |prior| Parameter {
            key: "geometry.depth".into(),
            number: NumberKey::Geometry("depth"),
            start: 0.5,
            bounds: [0.0, 1.0],
            log: false,
            prior,
            same: Vec::new(),
            rest: None,
        };
        let mut grooves = Grooves::new();
        let offset = |p, c| Unknown { name: String::new(), kind: UnknownKind::StrayLight(p, c), bounds: [0.0, 1.0] };
        grooves.unknowns.extend([offset(0, 1), offset(1, 1)]);
        let photographs = [None, Some([0.1; 3])].map(|unlit| DirectionBins { mean: [2.0; 3], unlit, ..DirectionBins::default() });
        let priors = Priors {
            parameters: (&[parameter(None), parameter(Some([0.4, 0.1]))], &[0.9, 0.6]),
            variables: &[Variable::Parameter(0), Variable::Light { photograph: 1, axis: 1, sigma: 1.5 }],
            lights: &[[0.0; 2], [0.0, -3.0]],
            photographs: &photographs,
        };
        let mut equations = Equations::default();
        priors.add_to(&grooves.basis(), &mut equations);
        let [(parameter, Origin::Prior), (light, Origin::Prior)] = equations.fixed[..] else { panic!("{:?}", equations.fixed) };
        assert!((parameter - 2.0).abs() < 1e-12 && light == -2.0, "{:?}", equations.fixed);
        let [(dark, _), (seen, origin)] = &equations.rows[..] else { panic!("{:?}", equations.rows) };
        assert!(dark.terms == [(3, 1.0)] && dark.value == 0.0 && (dark.sigma - 0.04).abs() < 1e-12, "{dark:?}");
        assert!(seen.terms == [(4, 1.0)] && seen.value == 0.1 && (seen.sigma - 0.004_f64.hypot(0.04)).abs() < 1e-12, "{seen:?}");
        assert_eq!(*origin, Origin::Prior);
    }
}
