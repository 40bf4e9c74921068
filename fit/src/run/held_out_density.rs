//! How well a candidate predicts a photograph that was held out, whatever is not known of its light.
//!
//! Its light may stand elsewhere than the file says and be brighter or darker, and stray light may lie over it, all by as much as is likely; the prediction is linearised in these:
//!
//! ```text
//! L = (1 + s) P + a dP/da + e dP/de + V,      a, e ~ N(0, sigma_light),  s ~ N(0, sigma_irradiance),  V ~ N(V0, sigma_V)
//! ```
//!
//! Without that a wrong candidate could be the better one by an error of the light that it happens to make up for.

use super::comparison::{Fitted, OtherLight};
use super::held_out_light::{Free, HeldOutLight};
use super::options::FINE;
use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::image::Photograph;
use crate::residuals::equations::{Equations, Origin, Row, solve};
use crate::verdict::evidence::{Unit, units};
use biscale::error::Result;
use biscale::filter::Control;

/// Half the step of the derivatives by the angles of a light, degrees. Chosen, not measured: that of a typical standard deviation.
const STEP_DEG: f64 = 1.0;
/// Standard deviations of a light's angles that it may turn by, and of the irradiance.
const REACH: f64 = 4.0;
/// Standard deviation of the scale of a photograph whose irradiance is not known.
const ANY_SCALE: f64 = 10.0;
/// Least standard deviation of what is not known: that of a photograph that is black all over, or of what is known.
const LEAST_SIGMA: f64 = 1e-9;
/// Samples of each prediction.
const SAMPLES: u32 = FINE.samples;

/// A photograph that was held out, as a table.
pub(super) struct HeldOut<'a> {
    pub(super) photograph: &'a Photograph,
    pub(super) bins: DirectionBins,
    /// Relative standard deviation of the irradiance of the fitted photographs.
    pub(super) fitted_sigma: f64,
    /// Whether there may be stray light.
    pub(super) stray_light: bool,
}

/// What came of it.
pub(super) struct Predicted {
    pub(super) units: Vec<Unit>,
    /// Squared residuals of what is known of the light, Huber's.
    pub(super) priors: f64,
    /// With the light as the file says, as a validation has it.
    pub(super) relative_rms: f64,
}

impl HeldOut<'_> {
    /// Beside a material that reflects `interreflection` beside direct light.
    pub(super) fn beside(
        &self,
        fitted: &Fitted<'_>,
        interreflection: Option<&[[f64; 3]]>,
        usual_stray_light: Option<[f64; 3]>,
        control: &Control<'_>,
    ) -> Result<Predicted> {
        let light = OtherLight { stray_light: [0.0; 3], interreflection };
        let at = |turn: [f64; 2]| fitted.predict(&self.bins, (turn, SAMPLES), light, control);
        let here = at([0.0; 2])?;
        let sides = [[[-STEP_DEG, 0.0], [STEP_DEG, 0.0]], [[0.0, -STEP_DEG], [0.0, STEP_DEG]]];
        let sides = sides.into_iter().map(|[low, high]| Ok([at(low)?, at(high)?])).collect::<Result<Vec<_>>>()?;
        let free = Free { factor: !self.photograph.exposure_known, stray_light: usual_stray_light };
        let found = HeldOutLight::of(&self.bins, &here, free);
        let shown: Vec<[f64; 3]> = here.iter().map(|p| std::array::from_fn(|c| found.factor * p[c] + found.stray_light[c])).collect();
        let relative_rms = self.bins.relative_rms(&shown);
        let mut equations = Equations::default();
        for (k, bin) in self.bins.bins.iter().enumerate() {
            for c in 0..3 {
                let slope = |axis: usize| (sides[axis][1][k][c] - sides[axis][0][k][c]) / (2.0 * STEP_DEG);
                let terms = vec![(0, slope(0)), (1, slope(1)), (2, here[k][c]), (3 + c, 1.0)];
                let row = Row { terms, known: here[k][c], value: bin.mean[c], sigma: bin.sigma[c], weight: bin.weight };
                equations.rows.push((row, Origin::Bin(0, k, c)));
            }
        }
        let (lower, upper) = self.add_priors(&mut equations);
        let solved = solve(equations, &lower, &upper);
        let priors = solved.rows.iter().filter(|(_, origin)| *origin == Origin::Prior);
        let priors = priors.map(|(row, _)| crate::residuals::equations::huber(solved.residual(row))).sum();
        Ok(Predicted { units: units(&solved, |origin| origin != Origin::Prior), priors, relative_rms })
    }

    /// What is known of the light, and how far it may be from that.
    fn add_priors(&self, equations: &mut Equations) -> (Vec<f64>, Vec<f64>) {
        let sigma_scale =
            if self.photograph.exposure_known { self.photograph.irradiance_sigma().hypot(self.fitted_sigma) } else { ANY_SCALE };
        let sigma_light = self.photograph.light_sigma_deg.max(LEAST_SIGMA);
        let mut known = vec![[0.0, sigma_light], [0.0, sigma_light], [0.0, sigma_scale.max(LEAST_SIGMA)]];
        known.extend((0..3).map(|c| {
            let [value, sigma] = self.bins.dark.prior(self.bins.mean, c);
            if self.stray_light { [value, sigma.max(LEAST_SIGMA)] } else { [0.0, LEAST_SIGMA] }
        }));
        for (k, &[value, sigma]) in known.iter().enumerate() {
            equations.rows.push((Row { terms: vec![(k, 1.0)], known: 0.0, value, sigma, weight: 1.0 }, Origin::Prior));
        }
        let lower = known.iter().enumerate().map(|(k, [value, sigma])| match k {
            0 | 1 => value - REACH * sigma,
            2 => (value - REACH * sigma).max(-0.9),
            _ => 0.0,
        });
        let upper = known.iter().map(|[value, sigma]| value.max(0.0) + REACH * sigma);
        (lower.collect(), upper.collect())
    }
}
