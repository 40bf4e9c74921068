//! One candidate before the photographs: how well it explains them, by a search that is shorter than that of a fit.

use super::comparison::{Fitted, Validating, usual_stray_light};
use super::diagnosis::Plain;
use super::found::found;
use super::held_out_density::HeldOut;
use super::options::{COARSE, FINE, Options};
use super::prepared::Prepared;
use super::stages::{Search, model_of};
use super::stopwatch::Stopwatch;
use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::image::Photograph;
use crate::residuals::equations::{Evaluated, Origin, huber};
use crate::residuals::input::material_values;
use crate::residuals::model::{Model, Registration};
use crate::residuals::unknowns::{UnknownKind, Variable};
use crate::search::descent::descend;
use crate::search::optimise::Limits;
use crate::search::{Memory, SearchShared, Start, Told, starts};
use crate::verdict::evidence::{Explained, Group, units};
use crate::verdict::near::NearComparison;
use biscale::error::Result;
use biscale::filter::Control;

/// The first look: from where the candidate starts, on the coarse model. Chosen, not measured.
const FIRST: Limits = Limits { step: 0.15, size: 0.02, cost: 0.02, evaluations: 90 };
/// The second look: on the fine model, as a diagnosis looks. Chosen, not measured.
const SECOND: Limits = Limits { step: 0.1, size: 0.01, cost: 0.01, evaluations: 160 };
/// Starts of the coarse search before the second look. Chosen, not measured: half those of a fit.
pub(super) const STARTS: usize = 4;
/// Samples of the second look.
const SAMPLES: u32 = 2 * COARSE.samples;

/// A candidate that was looked at.
#[derive(Clone, Debug)]
pub(super) struct Looked {
    pub(super) explained: Explained,
    /// Relative RMS differences: of the distant photographs, of the close-up if it is compared, and of those that were held out.
    pub(super) training: f64,
    pub(super) close_up: Option<f64>,
    pub(super) held_out: Vec<f64>,
    /// How the close-up repeats, if it does so in another way than the candidate.
    pub(super) other_periods: Option<String>,
    pub(super) evaluations: usize,
}

/// What all looks at a candidate share.
pub(super) struct Looking<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) options: &'a Options,
    pub(super) held_out: &'a [HeldOut<'a>],
    pub(super) control: &'a Control<'a>,
}

impl Looking<'_> {
    /// Goes down from where the candidate starts, on the coarse model, beside the fitted photographs alone; `None` where its numbers make no surface.
    ///
    /// # Errors
    /// `Interrupted`; failures that are no matter of the numbers.
    pub(super) fn first(&self) -> Result<Option<Looked>> {
        let Self { prepared, options, control, .. } = *self;
        let variants = prepared.variants();
        let mut best: Option<Start> = None;
        for choice in (0..variants.likely).filter(|&k| variants.all[k].sides == variants.all[0].sides) {
            let begin = Start::blank(choice);
            let model = model_of(prepared, options, &prepared.coarse, COARSE.samples, &begin, &variants.all[choice], control)?;
            let point = starts(&model, 1, options.seed).swap_remove(0);
            let objective = model.objective(&point, control)?;
            let start = Start { point, objective, ..Start::blank(choice) };
            if best.as_ref().is_none_or(|best| start.objective < best.objective) {
                best = Some(start);
            }
        }
        let Some(start) = best else { return Ok(None) };
        let model = model_of(prepared, options, &prepared.coarse, COARSE.samples, &start, &variants.all[start.choice], control)?;
        let found = descend(&model, &start.point, FIRST, &Plain { model: &model, control })?;
        let Some(evaluated) = model.evaluate(&found.point, control)? else { return Ok(None) };
        Ok(Some(Looked { evaluations: found.evaluations, ..self.looked(&model, &evaluated, &prepared.coarse, &[])? }))
    }

    /// Searches with few starts on the coarse model, goes down from the best one on the fine model, and predicts what was held out.
    ///
    /// # Errors
    /// As [`Self::first`].
    pub(super) fn second(&self) -> Result<Option<Looked>> {
        let Self { prepared, control, .. } = *self;
        let options = &Options { starts: self.options.starts.min(STARTS), joint: false, ..self.options.clone() };
        let (memory, variants) = (Memory::default(), prepared.variants());
        let shared = SearchShared::new(control, None, &memory, Told { better: &|_, _| {}, kept: &|_, _| {} });
        let search = Search { prepared, options, shared: &shared };
        let mut start = search.explored(&variants, &mut Stopwatch::new(control))?.swap_remove(0);
        control.check()?;
        if !start.objective.is_finite() {
            return Ok(None);
        }
        if prepared.spec.bounces > 0 {
            start = search.interreflecting(start, 1, &variants.all)?;
        }
        let mut model = model_of(prepared, options, &prepared.fine, SAMPLES, &start, &variants.all[start.choice], control)?;
        believe(&mut model, &start.point, control)?;
        let found = descend(&model, &start.point, SECOND, &Plain { model: &model, control })?;
        start.point.clone_from(&found.point);
        if prepared.spec.bounces > 0 {
            start = search.interreflecting(start, 1, &variants.all)?;
        }
        let looked = self.at(options, &start, SAMPLES)?;
        Ok(looked.map(|looked| Looked { evaluations: shared.evaluations() + found.evaluations, ..looked }))
    }

    /// The whole search of a fit, and what was held out.
    ///
    /// # Errors
    /// As [`Self::first`].
    pub(super) fn whole(&self) -> Result<Option<Looked>> {
        let Self { prepared, control, .. } = *self;
        let options = &Options { joint: false, ..self.options.clone() };
        let memory = Memory::default();
        let shared = SearchShared::new(control, None, &memory, Told { better: &|_, _| {}, kept: &|_, _| {} });
        let searched = Search { prepared, options, shared: &shared }.run(&mut Stopwatch::new(control))?;
        control.check()?;
        let looked = self.at(options, &searched.starts[0], super::options::POLISH_SAMPLES)?;
        Ok(looked.map(|looked| Looked { evaluations: shared.evaluations(), ..looked }))
    }

    /// The photographs where a search ended.
    fn at(&self, options: &Options, start: &Start, samples: u32) -> Result<Option<Looked>> {
        let Self { prepared, control, .. } = *self;
        let variants = prepared.variants().all;
        let mut model = model_of(prepared, options, &prepared.fine, samples, start, &variants[start.choice], control)?;
        believe(&mut model, &start.point, control)?;
        let Some(evaluated) = model.evaluate(&start.point, control)? else { return Ok(None) };
        let mut looked = self.looked(&model, &evaluated, &prepared.fine, self.held_out)?;
        let state = model.state(&start.point);
        let assigned = found(prepared.spec, model.input.variant, &state, &model.unknowns, &evaluated.linear);
        let material = material_values(prepared.spec, &assigned)?.material()?;
        let small = material.build()?;
        let fitted = Fitted { material: &material, small: &small, opaque: prepared.opaque };
        for (held_out, group) in self.held_out.iter().zip(looked.explained.groups.iter_mut().filter(|g| g.held_out)) {
            let question = Validating { fitted, compared: &[], training: looked.training, stray_light: None, seed: options.seed };
            let bins = [held_out.bins.clone()];
            let traced = question.interreflection(&group.name, &bins, prepared.spec.bounces, &mut Vec::new(), control)?;
            let usual = prepared.spec.stray_light.then(|| usual_stray_light(&prepared.fine[0], &model, &evaluated));
            let predicted = held_out.beside(&fitted, traced.as_ref().map(|t| &t.bins[0][..]), usual, control)?;
            group.units = predicted.units;
            looked.explained.priors += predicted.priors;
            looked.held_out.push(predicted.relative_rms);
        }
        Ok(Some(looked))
    }

    /// The fitted photographs, and empty groups for those that were held out.
    fn looked(&self, model: &Model<'_>, evaluated: &Evaluated, bins: &[DirectionBins], held_out: &[HeldOut<'_>]) -> Result<Looked> {
        self.control.check()?;
        let prepared = self.prepared;
        let of_distant = |(k, photograph): (usize, &&Photograph)| Group {
            name: photograph.name(),
            units: units(evaluated, |origin| matches!(origin, Origin::Bin(p, _, _) if p == k)),
            held_out: false,
        };
        let mut groups: Vec<Group> = prepared.distant.iter().enumerate().map(of_distant).collect();
        if prepared.close_up.is_some() {
            groups.push(Group { name: "close-up".into(), units: units(evaluated, |origin| origin == Origin::CloseUp), held_out: false });
        }
        groups.extend(held_out.iter().map(|h| Group { name: h.photograph.name(), units: Vec::new(), held_out: true }));
        let rows = evaluated.rows.iter().filter(|(_, origin)| *origin == Origin::Prior).map(|(row, _)| evaluated.residual(row));
        let fixed = evaluated.fixed.iter().filter(|(_, origin)| *origin == Origin::Prior).map(|(r, _)| *r);
        let close_up = prepared.close_up.as_ref();
        Ok(Looked {
            explained: Explained { groups, priors: rows.chain(fixed).map(huber).sum(), numbers: numbers(model) },
            training: evaluated.relative_rms(bins),
            close_up: close_up.and_then(|found| NearComparison::of(found, evaluated)).map(|near| near.relative_rms),
            held_out: Vec::new(),
            other_periods: other_periods(prepared),
            evaluations: 0,
        })
    }
}

/// How the close-up repeats, if that rules the candidate out: in another ratio, or along an axis along which the candidate does not change at all.
fn other_periods(prepared: &Prepared<'_>) -> Option<String> {
    let found = prepared.close_up.as_ref()?;
    let uniform = crate::photograph::mean_period::uniform(&prepared.spec.material.geometry);
    let repeats = (0..2).find(|&k| uniform[k] && found.period[k].is_some());
    let along = |k: usize| format!("the close-up repeats along {}, where this structure does not change", ["x", "y"][k]);
    found.other_periods.clone().or_else(|| repeats.map(along))
}

/// Free numbers: parameters, and colours by channel. Lights, stray light and exposures are those of the photographs, and the same for all candidates.
fn numbers(model: &Model<'_>) -> usize {
    let parameters = model.variables.iter().filter(|v| matches!(v, Variable::Parameter(_))).count();
    parameters + model.unknowns.iter().filter(|u| matches!(u.kind, UnknownKind::Colour(..)) && u.bounds[1] > u.bounds[0]).count()
}

/// Finds at what height the periods of the close-up are registered, and believes it as far as its noise says: less for being explained badly, a close-up would
/// be explained well by anything.
fn believe(model: &mut Model<'_>, point: &[f64], control: &Control<'_>) -> Result<()> {
    if model.registration().is_none_or(|r| r.doubt <= 1.0) {
        model.settle_height(point, control)?;
    }
    if let Some(registration) = model.registration() {
        model.register(Registration { doubt: 1.0, ..registration });
    }
    Ok(())
}

/// What was held out, as tables that all candidates share.
pub(super) fn held_out<'a>(prepared: &Prepared<'a>, notes: &mut Vec<String>) -> Vec<HeldOut<'a>> {
    let fitted_sigma = prepared.distant[0].irradiance_sigma();
    let one = |photograph: &'a Photograph| {
        let sights = super::prepared::sights_of(photograph, prepared.spec, &prepared.start);
        match DirectionBins::new(photograph, &sights, FINE.bins) {
            Ok(bins) => Some(HeldOut { photograph, bins, fitted_sigma, stray_light: prepared.spec.stray_light }),
            Err(error) => {
                notes.push(format!("a validation photograph cannot be used: {error}"));
                None
            }
        }
    };
    prepared.spec.of_role(crate::photograph::image::Role::Validation).filter_map(one).collect()
}
