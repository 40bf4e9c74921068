//! Why a fit fails: from the best point on it goes down again with one assumption at a time made otherwise, and says which one makes the photographs
//! agree.

use super::options::{COARSE, Options};
use super::prepared::Prepared;
use super::stages::{Search, model_of};
use crate::fit_file::variant::Variant;
use crate::parallel::in_parallel;
use crate::residuals::equations::Evaluated;
use crate::residuals::model::{Model, Registration};
use crate::residuals::unknowns::Variable;
use crate::search::descent::{Evaluate, descend};
use crate::search::optimise::Limits;
use crate::search::{Memory, SearchShared, Start, Told};
use crate::verdict::assumption::Assumption;
use crate::verdict::gates::MOST_NEAR_ERROR;
use crate::verdict::near::NearComparison;
use crate::verdict::validate::MOST_ERROR;
use biscale::error::{Error, Result};
use biscale::filter::Control;
use serde::Serialize;

/// Largest objective of photographs that agree, over that of those that do not. Chosen, not measured: what samples and one more free number change is
/// some per cent; what wrong assumptions cost is several times as much (`cargo test --test faults`).
const REPAIRED: f64 = 0.6;
/// The same where the photographs pass so and did not before. Chosen, not measured.
const CLEARLY_BETTER: f64 = 0.8;
/// Error of a close-up over that of before from which on it is explained clearly worse. Chosen, not measured.
const CLEARLY_WORSE: f64 = 1.1;
/// How each descent ends: as that of the last stage, sooner.
const LIMITS: Limits = Limits { step: 0.1, size: 0.01, cost: 0.01, evaluations: 160 };

/// An assumption that makes the photographs agree when it is made otherwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    /// What it is, and what to do about it.
    pub remedy: String,
    /// Squared residuals over what they were, both after a descent; `None` where these are of another comparison of the close-up.
    pub objective_ratio: Option<f64>,
    /// Relative RMS difference of the distant photographs without it.
    pub training: f64,
    /// The same of the close-up.
    pub close_up: Option<f64>,
}

/// What the photographs are explained like under an assumption.
struct Explained {
    objective: f64,
    /// Whether the close-up is compared bin by bin of its mean period: objectives of another comparison are others.
    by_bin: bool,
    /// Whether distant photographs and close-up are explained as a fit that passes must.
    passes: bool,
    training: f64,
    close_up: Option<f64>,
}

/// Adds the likely causes of a failure to `causes`; those that were found before an interrupt stay there.
///
/// # Errors
/// `Interrupted`; failures that are no matter of the assumptions.
pub(super) fn causes(
    prepared: &Prepared<'_>,
    options: &Options,
    best: &Start,
    causes: &mut Vec<Cause>,
    control: &Control<'_>,
) -> Result<()> {
    let Some(now) = explained(prepared, prepared, options, best, control)? else { return Ok(()) };
    for assumption in Assumption::all(prepared.spec) {
        let spec = assumption.applied(prepared.spec);
        let looked = Prepared::new(&spec, control).and_then(|other| explained(&other, prepared, options, best, control));
        let then = match looked {
            Ok(Some(then)) => then,
            // What cannot be looked at otherwise is no cause.
            Ok(None) | Err(Error::BadInput(_)) => continue,
            Err(error) => return Err(error),
        };
        if then.repairs(&now, assumption.changes_values()) {
            causes.push(Cause {
                remedy: assumption.remedy(prepared.spec),
                objective_ratio: (then.by_bin == now.by_bin).then_some(then.objective / now.objective),
                training: then.training,
                close_up: then.close_up,
            });
        }
    }
    Ok(())
}

impl Explained {
    /// Whether the photographs agree so, and did not before.
    fn repairs(&self, before: &Self, other_values: bool) -> bool {
        let ratio = self.objective / before.objective;
        if self.by_bin != before.by_bin {
            // Only a close-up that repeats as the material does can be compared bin by bin.
            return self.passes && self.by_bin && !before.passes;
        }
        // Of other values residuals are smaller or larger by themselves: the rules of a fit that passes are not.
        let residuals_say = ratio <= REPAIRED && !other_values;
        let passes_now = self.passes && !before.passes;
        // What is left of a photograph's misfit is a share of its own light.
        let distant_agree = self.training <= MOST_ERROR && before.training > MOST_ERROR && !self.is_worse_near(before);
        residuals_say || ((passes_now || distant_agree) && ratio <= CLEARLY_BETTER)
    }

    /// Whether the close-up is explained clearly worse.
    fn is_worse_near(&self, before: &Self) -> bool {
        self.close_up.zip(before.close_up).is_some_and(|(now, before)| now > MOST_NEAR_ERROR.max(CLEARLY_WORSE * before))
    }
}

/// Goes down from where a search of the fit file of `before` ended, with the lights as given, and from where the fit file starts: what was found
/// under a wrong assumption may be far off. The better of the two.
fn explained(
    prepared: &Prepared<'_>,
    before: &Prepared<'_>,
    options: &Options,
    best: &Start,
    control: &Control<'_>,
) -> Result<Option<Explained>> {
    let variants = prepared.variants().all;
    let memory = Memory::default();
    let shared = SearchShared::new(control, None, &memory, Told { better: &|_, _| {}, kept: &|_, _| {} });
    let search = Search { prepared, options, shared: &shared };
    let here = translated(before, prepared, &best.point);
    // What was traced is known by its bins.
    let members = |of: &Prepared<'_>| of.fine.iter().map(|bins| bins.members.clone()).collect::<Vec<_>>();
    let is_traced = prepared.spec.bounces == before.spec.bounces && members(prepared) == members(before);
    let variables = prepared.variables();
    let as_given = variables.iter().zip(&here).map(|(v, &u)| if matches!(v, Variable::Light { .. }) { 0.5 } else { u });
    let parameters = &prepared.spec.parameters;
    let own: Vec<f64> =
        variables.iter().map(|v| if let Variable::Parameter(k) = v { parameters[*k].to_unit(parameters[*k].start) } else { 0.5 }).collect();
    let mut found: Option<Explained> = None;
    for point in [as_given.collect::<Vec<f64>>(), own] {
        // Which colour cluster is which surface may be another matter now.
        let sides = variants[best.choice.min(variants.len() - 1)].sides;
        let alike = (0..variants.len()).filter(|&k| variants[k].sides == sides);
        let mut start: Option<Start> = None;
        for choice in alike {
            let mut other = Start { point: point.clone(), choice, registration: None, ..best.clone() };
            if !is_traced {
                other.interreflection = None;
            }
            let model = model_of(prepared, options, &prepared.fine, COARSE.samples, &other, &variants[choice], control)?;
            other.objective = model.objective(&other.point, control)?;
            if start.as_ref().is_none_or(|start| other.objective < start.objective) {
                start = Some(other);
            }
        }
        let Some(mut start) = start else { continue };
        if prepared.spec.bounces > 0 && start.interreflection.is_none() {
            start = search.interreflecting(start, 1, &variants)?;
        }
        let explained = from(prepared, options, &start, &variants[start.choice], control)?;
        found = match (found, explained) {
            (Some(a), Some(b)) => Some(if b.objective < a.objective { b } else { a }),
            (a, b) => a.or(b),
        };
    }
    Ok(found)
}

/// Goes down from one point.
fn from(prepared: &Prepared<'_>, options: &Options, start: &Start, variant: &Variant, control: &Control<'_>) -> Result<Option<Explained>> {
    let samples = 2 * COARSE.samples;
    let mut model = model_of(prepared, options, &prepared.fine, samples, start, variant, control)?;
    model.settle_height(&start.point, control)?;
    if let Some(registration) = model.registration() {
        // Believed less for being explained badly, a close-up would be explained well by anything.
        model.register(Registration { doubt: 1.0, ..registration });
    }
    let found = descend(&model, &start.point, LIMITS, &Plain { model: &model, control })?;
    let Some(evaluated) = model.evaluate(&found.point, control)? else { return Ok(None) };
    let close_up = prepared.close_up.as_ref();
    let near = close_up.and_then(|close_up| NearComparison::of(close_up, &evaluated)).map(|near| near.relative_rms);
    let training = evaluated.relative_rms(&prepared.fine);
    let repeats = close_up.is_none_or(|close_up| close_up.other_periods.is_none());
    Ok(Some(Explained {
        objective: evaluated.objective,
        by_bin: model.mean_period().is_some(),
        passes: repeats && training <= MOST_ERROR && near.is_none_or(|near| near <= MOST_NEAR_ERROR),
        training,
        close_up: near,
    }))
}

/// A point of the search of one fit file as a point of another's, whose lights have other bounds, or are held in one of the two.
fn translated(from: &Prepared<'_>, to: &Prepared<'_>, point: &[f64]) -> Vec<f64> {
    let olds: Vec<(Variable, f64)> = from.variables().into_iter().zip(point.iter().copied()).collect();
    let one = |new: Variable| {
        let same = |(old, unit): &(Variable, f64)| match (old, &new) {
            (Variable::Parameter(a), Variable::Parameter(b)) => (a == b).then_some(*unit),
            (Variable::Light { shot: a, axis: i, sigma: old }, Variable::Light { shot: b, axis: j, sigma: new }) => {
                (a == b && i == j).then_some((0.5 + (unit - 0.5) * old / new).clamp(0.0, 1.0))
            }
            (Variable::Blur, Variable::Blur) => Some(*unit),
            _ => None,
        };
        olds.iter().find_map(same).unwrap_or(0.5)
    };
    to.variables().into_iter().map(one).collect()
}

/// Evaluations that nobody notes.
pub(super) struct Plain<'a> {
    pub(super) model: &'a Model<'a>,
    pub(super) control: &'a Control<'a>,
}

impl Evaluate for Plain<'_> {
    fn evaluate(&self, points: &[Vec<f64>], linear: Option<&[f64]>) -> Result<Vec<Option<Evaluated>>> {
        in_parallel(points, |_, point| self.model.evaluate_with(point, linear, self.control))
    }
}
