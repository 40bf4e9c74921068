//! Residuals of what is known beforehand: priors of parameters, of the lights' directions and of the close-up's blur and exposure, and what unlit pixels
//! and the background say of the stray light.

use crate::fit_file::spec::Parameter;
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::block::ResidualBlock;
use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::equations::{Equations, Origin, Row};
use crate::residuals::state::State;
use crate::residuals::unknowns::{BLUR_PRIOR, Shot, UnknownKind, Variable};

/// Least standard deviation of a stray-light offset or an exposure: that of a photograph that is black all over, or whose exposure is exact.
const LEAST_SIGMA: f64 = 1e-12;

/// What is known of a state beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Priors<'a> {
    /// Parameters of the fit file.
    pub parameters: &'a [Parameter],
    /// What the search moves: lights have standard deviations of their own.
    pub variables: &'a [Variable],
    /// Where the search stands.
    pub state: &'a State,
    /// The distant photographs, which show their stray light.
    pub photographs: &'a [DirectionBins],
    /// The close-up, which shows its own.
    pub close_up: Option<&'a CloseUp>,
    /// Its exposure, about.
    pub exposure: f64,
}

impl ResidualBlock for Priors<'_> {
    fn add_to(&self, basis: &ColourBasis<'_>, equations: &mut Equations) {
        for (parameter, value) in self.parameters.iter().zip(&self.state.values) {
            if let Some([mean, sigma]) = parameter.prior {
                equations.fixed.push(((value - mean) / sigma, Origin::Prior));
            }
        }
        for variable in self.variables {
            let off = match variable {
                Variable::Light { shot: Shot::Distant(k), axis, sigma } => self.state.lights[*k][*axis] / sigma,
                Variable::Light { shot: Shot::CloseUp, axis, sigma } => self.state.near_light[*axis] / sigma,
                Variable::Blur => (self.state.blur.ln() - BLUR_PRIOR[0]) / BLUR_PRIOR[1],
                Variable::Parameter(_) | Variable::Linear(_) => continue,
            };
            equations.fixed.push((off, Origin::Prior));
        }
        for (k, unknown) in basis.unknowns.iter().enumerate() {
            let known = match unknown.kind {
                UnknownKind::StrayLight(Shot::Distant(p), c) => Some(self.photographs[p].dark.prior(self.photographs[p].mean, c)),
                // As its exposure makes it: [`UnknownKind::Exposure`] times what is seen.
                UnknownKind::StrayLight(Shot::CloseUp, c) => {
                    self.close_up.map(|found| found.dark.prior(found.mean, c).map(|v| self.exposure * v))
                }
                UnknownKind::Exposure => self.close_up.and_then(|found| found.exposure_sigma).map(|sigma| [1.0, sigma]),
                UnknownKind::Colour(..) => None,
            };
            if let Some([value, sigma]) = known {
                let row = Row { terms: vec![(k, 1.0)], known: 0.0, value, sigma: sigma.max(LEAST_SIGMA), weight: 1.0 };
                equations.rows.push((row, Origin::Prior));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photograph::dark::Dark;
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
        let unknown = |kind| Unknown { name: String::new(), kind, bounds: [0.0, 1.0] };
        let of_close_up = [UnknownKind::StrayLight(Shot::CloseUp, 2), UnknownKind::Exposure];
        let offsets = [0, 1].map(|p| UnknownKind::StrayLight(Shot::Distant(p), 1));
        grooves.unknowns.extend(offsets.into_iter().chain(of_close_up).map(unknown));
        let photographs = [None, Some([0.1; 3])].map(|unlit| DirectionBins {
            mean: [2.0; 3],
            dark: Dark { unlit, background: None },
            ..DirectionBins::default()
        });
        let state = State {
            values: vec![0.9, 0.6],
            lights: vec![[0.0; 2], [0.0, -3.0]],
            near_light: [4.5, 0.0],
            blur: (BLUR_PRIOR[0] - 0.5).exp(),
            linear: Vec::new(),
        };
        let close_up = CloseUp { exposure_sigma: Some(0.07), mean: [3.0; 3], ..CloseUp::default() };
        let light = |shot, axis| Variable::Light { shot, axis, sigma: 1.5 };
        let priors = Priors {
            parameters: &[parameter(None), parameter(Some([0.4, 0.1]))],
            variables: &[Variable::Parameter(0), light(Shot::Distant(1), 1), light(Shot::CloseUp, 0), Variable::Blur],
            state: &state,
            photographs: &photographs,
            close_up: Some(&close_up),
            exposure: 0.5,
        };
        let mut equations = Equations::default();
        priors.add_to(&grooves.basis(), &mut equations);
        let [(parameter, Origin::Prior), (light, Origin::Prior), (near, Origin::Prior), (blur, Origin::Prior)] = equations.fixed[..] else {
            panic!("{:?}", equations.fixed)
        };
        assert!((parameter - 2.0).abs() < 1e-12 && light == -2.0 && near == 3.0 && (blur + 2.0).abs() < 1e-12, "{:?}", equations.fixed);
        let [(dark, _), (seen, origin), (near, _), (exposure, _)] = &equations.rows[..] else { panic!("{:?}", equations.rows) };
        assert!(dark.terms == [(3, 1.0)] && dark.value == 0.0 && (dark.sigma - 0.08).abs() < 1e-12, "{dark:?}");
        assert!(seen.terms == [(4, 1.0)] && seen.value == 0.1 && (seen.sigma - 0.004_f64.hypot(0.04)).abs() < 1e-12, "{seen:?}");
        assert!(near.terms == [(5, 1.0)] && near.value == 0.0 && (near.sigma - 0.06).abs() < 1e-12, "{near:?}");
        assert!(exposure.terms == [(6, 1.0)] && exposure.value == 1.0 && exposure.sigma == 0.07, "{exposure:?}");
        assert_eq!(*origin, Origin::Prior);
    }
}
