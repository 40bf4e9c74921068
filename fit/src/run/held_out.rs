//! What would make a photograph agree that was held out and is not predicted.

use super::comparison::{OtherLight, Validating};
use super::diagnosis::Cause;
use super::held_out_light::{Free, HeldOutLight};
use super::options::{COARSE, FINE};
use super::outcome::Compared;
use super::prepared::{Prepared, sights_of};
use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::image::Role;
use crate::verdict::validate::{Validation, Verdict, limit};
use biscale::error::Result;
use biscale::filter::Control;

/// Steps of the turns of a light that are tried, degrees, each about the best one of the step before, and turns to either side.
const TURNS_DEG: [f64; 3] = [4.0, 1.5, 0.5];
/// See [`TURNS_DEG`]: 18 degrees in all.
const TO_A_SIDE: i32 = 3;

/// Adds what would make held-out photographs agree that are not predicted: their light elsewhere, or brighter or darker.
///
/// # Errors
/// Those of the filter.
pub(super) fn causes(
    prepared: &Prepared<'_>,
    question: &Validating<'_>,
    validations: &[(Validation, Compared)],
    causes: &mut Vec<Cause>,
    control: &Control<'_>,
) -> Result<()> {
    let Validating { fitted, training, stray_light, .. } = *question;
    for (validation, compared) in validations.iter().filter(|(v, _)| v.verdict == Verdict::Fail) {
        let Some(photograph) = prepared.spec.of_role(Role::Validation).find(|p| p.file == compared.photograph.file) else { continue };
        let bins = [DirectionBins::new(photograph, &sights_of(photograph, prepared.spec, &prepared.start), FINE.bins)?];
        // Notes on it were told with the verdict.
        let traced = question.interreflection(&validation.photograph, &bins, prepared.spec.bounces, &mut Vec::new(), control)?;
        let interreflection = traced.as_ref().map(|found| &found.bins[0][..]);
        let [bins] = &bins;
        let error = |turn_deg: [f64; 2], factor: bool| -> Result<(f64, f64)> {
            let light = OtherLight { stray_light: [0.0; 3], interreflection };
            let mut predicted = fitted.predict(bins, (turn_deg, COARSE.samples), light, control)?;
            let found = HeldOutLight::of(bins, &predicted, Free { factor, stray_light });
            predicted.iter_mut().for_each(|p| (0..3).for_each(|c| p[c] = found.factor * p[c] + found.stray_light[c]));
            Ok((bins.relative_rms(&predicted), found.factor))
        };
        let mut add = |remedy: String, error: f64| {
            let ratio = (error / validation.relative_rms).powi(2);
            causes.push(Cause { remedy, objective_ratio: Some(ratio), training, close_up: None });
        };
        let is_scaled = validation.exposure.is_some();
        let (scaled, factor) = error([0.0; 2], true)?;
        if scaled <= limit(training) && !is_scaled {
            let remedy = format!(
                "the irradiance of {} is {factor:.2} times what the file says, or the fit's is: its light is predicted but for that factor",
                validation.photograph
            );
            add(remedy, scaled);
        }
        let (turn, turned) = best_turn(&|turn| error(turn, is_scaled).map(|found| found.0))?;
        if turned <= limit(training) && turn != [0.0; 2] {
            let remedy = format!(
                "the light of {} stands elsewhere than the file says, by {:.1} degrees of azimuth and {:.1} of elevation",
                validation.photograph, turn[0], turn[1]
            );
            add(remedy, turned);
        }
    }
    Ok(())
}

/// The turn of a light by which an error is least, and that error.
fn best_turn(error: &dyn Fn([f64; 2]) -> Result<f64>) -> Result<([f64; 2], f64)> {
    let mut best = ([0.0; 2], error([0.0; 2])?);
    for step in TURNS_DEG {
        let middle = best.0;
        for azimuth in -TO_A_SIDE..=TO_A_SIDE {
            for elevation in -TO_A_SIDE..=TO_A_SIDE {
                let turn = [middle[0] + step * f64::from(azimuth), middle[1] + step * f64::from(elevation)];
                let found = error(turn)?;
                if found < best.1 {
                    best = (turn, found);
                }
            }
        }
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_found_by_ever_smaller_steps() {
        let (turn, error) = best_turn(&|turn| Ok((turn[0] - 9.0).abs() + (turn[1] + 5.5).abs())).unwrap();
        assert!((turn[0] - 9.0).abs() < 0.51 && (turn[1] + 5.5).abs() < 0.51 && error < 1.0, "{turn:?}");
    }
}
