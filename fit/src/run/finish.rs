//! After the search: what is known, pictures beside the photographs, and the held-out one.

use super::comparison::{Fitted, OtherLight, Validating, usual_stray_light};
use super::deadline::stopped_when;
use super::diagnosis::{self, Cause};
use super::found::found;
use super::held_out;
use super::nuisances;
use super::options::{COARSE, FINE, Options, POLISH_SAMPLES, SEARCH_SHARE};
use super::outcome::{Compared, Early, Outcome};
use super::prepared::{Prepared, sights_of};
use super::scale_of_colours::{self, ScaleOfColours};
use super::stages::{Searched, distance, interreflection_at, is_doubted, model_of};
use super::stopwatch::Stopwatch;
use crate::fit_file::material_text::MaterialText;
use crate::fit_file::spec::USUAL_BOUNCES;
use crate::fit_file::variant::{self, Variant};
use crate::parallel::in_parallel;
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::{DirectionBins, turned};
use crate::photograph::image::{Photograph, Role};
use crate::residuals::derivatives;
use crate::residuals::equations::Evaluated;
use crate::residuals::input::Interreflection;
use crate::residuals::model::Model;
use crate::residuals::near_interreflection::PathOptions;
use crate::residuals::unknowns::{Shot, UnknownKind, stray_light};
use crate::search::{APART, SearchShared, Start, Trace};
use crate::uncertainty::identify::{self, Identified, Known};
use crate::uncertainty::profile::{self, Profile};
use crate::verdict::gates::{self, Judged};
use crate::verdict::near::NearComparison;
use crate::verdict::validate::{Validation, Verdict};
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Profiles that are made. Chosen, not measured: each takes 14 evaluations.
const PROFILES: usize = 3;
/// Largest difference of the objective of two minima that are equally good, over the better one. Chosen, not measured.
const EQUALLY_GOOD: f64 = 0.05;
/// Difference of the factors that the periods along x and y ask for from which on it is told. Chosen, not measured.
const OTHER_FACTOR: f64 = 0.02;
/// What is added to the number of a start for samples of its own: those that tell what samples change.
const REPLICATES: [usize; 4] = [1000, 2000, 3000, 4000];

/// What ends the work after the search.
#[derive(Clone, Copy)]
pub(super) struct Ending<'a> {
    /// The caller's.
    pub(super) control: &'a Control<'a>,
    /// When the time is over, if it is limited.
    pub(super) deadline: Option<f64>,
}

impl Ending<'_> {
    fn early(&self, shared: &SearchShared<'_>) -> Option<Early> {
        if self.control.check().is_err() {
            return Some(Early::Interrupted);
        }
        (shared.is_late() || self.is_over()).then_some(Early::TimeLimit)
    }

    fn is_over(&self) -> bool {
        self.deadline.is_some_and(|d| (self.control.clock)() >= d)
    }
}

/// Looks at what was found, once the search is over.
///
/// What was asked to stop, if anything was, is the search: a result that nobody can judge is worth little. So an interrupted search gets all of its report
/// but for the profiles, and one that a time limit ended as much as fits into the limit.
pub(super) fn finish(
    prepared: &Prepared<'_>,
    options: &Options,
    shared: &SearchShared<'_>,
    searched: Searched,
    ending: Ending<'_>,
    watch: Stopwatch<'_>,
) -> Result<Outcome> {
    let early = ending.early(shared);
    let stop = AtomicBool::new(false);
    let over = || (early != Some(Early::Interrupted) && ending.control.check().is_err()) || ending.is_over();
    let parts = Parts {
        control: ending.control,
        optional: Control { cancel: &stop, progress: &|_, _| {}, clock: ending.control.clock },
        left_out: Vec::new(),
    };
    let mut outcome = stopped_when(&stop, over, || report(prepared, options, shared, searched, early, parts, watch))?;
    if outcome.ended_early.is_none() && !outcome.left_out.is_empty() {
        outcome.ended_early = ending.early(shared);
    }
    Ok(outcome)
}

/// Parts of the report, which are left out where the work must end before they are made.
struct Parts<'a> {
    control: &'a Control<'a>,
    /// Stops when the work must end.
    optional: Control<'a>,
    left_out: Vec<&'static str>,
}

impl Parts<'_> {
    fn make<T>(&mut self, name: &'static str, share: f64, make: impl FnOnce(&Control<'_>) -> Result<T>) -> Result<Option<T>> {
        (self.control.progress)(name, SEARCH_SHARE + (1.0 - SEARCH_SHARE) * share);
        match self.optional.check().and_then(|()| make(&self.optional)) {
            Ok(made) => Ok(Some(made)),
            Err(Error::Interrupted) => {
                self.left_out.push(name);
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

fn report(
    prepared: &Prepared<'_>,
    options: &Options,
    shared: &SearchShared<'_>,
    Searched { starts, refined }: Searched,
    early: Option<Early>,
    mut parts: Parts<'_>,
    mut watch: Stopwatch<'_>,
) -> Result<Outcome> {
    let spec = prepared.spec;
    let variants = prepared.variants().all;
    // What must be there in any case is not stopped.
    let never = AtomicBool::new(false);
    let control = &Control { cancel: &never, ..parts.optional };
    // Whatever the search moved, the colours are solved for here.
    let solved = Options { joint: false, ..options.clone() };
    let best = &Start { point: starts[0].point[..prepared.variables().len()].to_vec(), ..starts[0].clone() };
    let model = model_of(prepared, &solved, &prepared.fine, POLISH_SAMPLES, best, &variants[best.choice], control)?;
    let Some(evaluated) = model.evaluate(&best.point, control)? else { return Err(no_surface(prepared)) };
    let missing =
        parts.make("interreflection", 0.0, |control| missing_interreflection(prepared, &model, &evaluated, best, options.seed, control))?;
    let (mut identified, profiles) =
        uncertainty(prepared, &solved, &model, (&evaluated, missing.as_ref().and_then(Option::as_ref)), best, early, &mut parts)?;
    watch.lap("uncertainty");
    let mut notes = prepared.notes.clone();
    notes.extend(best.interreflection.iter().flat_map(|found| found.notes.iter().cloned()));
    if spec.bounces > 0 && best.interreflection.is_none() {
        notes.push(
            "the search ended before interreflections were traced: the material explains the photographs by direct light alone".to_owned(),
        );
    }
    let (text, close_up) = fitted_text(prepared, &model, &evaluated, &best.point, &mut notes)?;
    let material = text.material()?;
    let small = material.build()?;
    let training = evaluated.relative_rms(&prepared.fine);
    let missing = missing.map(|traced| traced.map_or(0.0, |traced| scale_of_colours::share_of(prepared, &traced)));
    if !identified.covariance.is_empty() {
        let scale = ScaleOfColours::of(prepared, &identified, missing);
        identified.add_scale(scale.sigma, scale.assumed);
        notes.extend(scale.notes);
    }
    let fitted = Fitted { material: &material, small: &small, opaque: prepared.opaque };
    let compared = parts.make("pictures", 0.5, |control| compare_distant(prepared, &fitted, &model, &evaluated, best, control))?;
    let compared = compared.unwrap_or_default();
    let stray_light = spec.stray_light.then(|| usual_stray_light(&prepared.fine[0], &model, &evaluated));
    let question = Validating { fitted, compared: &compared, training, stray_light, seed: options.seed };
    let mut validations = Vec::new();
    if spec.of_role(Role::Validation).next().is_some() {
        let validated = parts.make("validation", 0.7, |control| validate_all(prepared, &question, control))?;
        let (found, told) = validated.unwrap_or_default();
        validations = found;
        notes.extend(told);
    }
    watch.lap("pictures");
    let several = parts.make("other minima", 0.9, |control| several(prepared, options, &starts[..refined], &variants, control))?;
    let several = several.unwrap_or_default();
    if !several.is_empty() {
        notes.push(format!("several solutions: {} other minima fit as well as the best one", several.len()));
    }
    notes.splice(0..0, nuisances::notes(prepared, &identified.known));
    notes.extend(identified.known.iter().filter_map(note_of));
    let pixels: Vec<(String, f64)> = compared.iter().map(|c| (c.photograph.name(), c.pixel_relative_rms)).collect();
    let near = prepared.close_up.as_ref().and_then(|found| NearComparison::of(found, &evaluated));
    let failures = gates::failures(&Judged {
        objective: starts[0].objective,
        training,
        pixels: &pixels,
        validations: &validations.iter().map(|(v, _)| v).collect::<Vec<_>>(),
        close_up: close_up.as_ref(),
        near: near.as_ref(),
        known: &identified.known,
    });
    let causes = if failures.is_empty() {
        Vec::new()
    } else if early.is_some() {
        parts.left_out.push(DIAGNOSIS);
        Vec::new()
    } else {
        let only_held_out = failures.len() == validations.iter().filter(|(v, _)| v.verdict == Verdict::Fail).count();
        likely_causes(prepared, (&solved, best), (&question, &validations), only_held_out, &mut parts)?
    };
    notes.extend(left_out_note(&parts.left_out));
    (parts.control.progress)("report", 1.0);
    let entries = if early.is_some() { shared.trace_with_memory() } else { shared.sorted_trace() };
    Ok(Outcome {
        trace: Trace { coordinates: coordinates(&model, options.joint), entries },
        evaluations: shared.evaluations(),
        best: best.point.clone(),
        text,
        identified,
        profiles,
        objective: evaluated.objective,
        training,
        several,
        close_up,
        near,
        bins: prepared.fine.clone(),
        compared,
        validations,
        ended_early: early,
        left_out: parts.left_out,
        seconds: watch.parts,
        notes,
        failures,
        causes,
        starts,
        material,
    })
}

/// What else than the fit file says makes the photographs agree, the likeliest first.
fn likely_causes(
    prepared: &Prepared<'_>,
    (options, best): (&Options, &Start),
    (question, validations): (&Validating<'_>, &[(Validation, Compared)]),
    only_held_out: bool,
    parts: &mut Parts<'_>,
) -> Result<Vec<Cause>> {
    let (mut causes, mut of_held_out) = (Vec::new(), Vec::new());
    parts.make(DIAGNOSIS, 0.95, |control| {
        held_out::causes(prepared, question, validations, &mut of_held_out, control)?;
        diagnosis::causes(prepared, options, best, &mut causes, control)
    })?;
    // What makes the fitted photographs agree, where they do not, comes before all that is said of a held-out one.
    if only_held_out {
        causes.append(&mut of_held_out);
    }
    causes.sort_by(|a, b| a.objective_ratio.unwrap_or(0.0).total_cmp(&b.objective_ratio.unwrap_or(0.0)));
    causes.append(&mut of_held_out);
    Ok(causes)
}

/// How well the unknowns are known, and profiles of those that are known worst. Where the search ended early there are no profiles.
fn uncertainty(
    prepared: &Prepared<'_>,
    options: &Options,
    model: &Model<'_>,
    (evaluated, missing): (&Evaluated, Option<&Arc<Interreflection>>),
    best: &Start,
    early: Option<Early>,
    parts: &mut Parts<'_>,
) -> Result<(Identified, Vec<Profile>)> {
    let variants = prepared.variants().all;
    let found = parts.make(STANDARD_DEVIATIONS, 0.0, |control| {
        let derivatives = derivatives::derivatives(model, &best.point, evaluated, control)?;
        let replicates = in_parallel(&REPLICATES, |_, &seed| {
            let other = Start { number: best.number + seed, ..best.clone() };
            let model = model_of(prepared, options, &prepared.fine, POLISH_SAMPLES, &other, &variants[best.choice], control)?;
            Ok(model.evaluate_with(&best.point, Some(&evaluated.linear), control)?.map(|e| derivatives::residuals(&e)))
        })?;
        let replicates: Vec<Vec<f64>> = replicates.into_iter().flatten().filter(|r| r.len() == derivatives.rows.len()).collect();
        let changed = match missing.filter(|_| model.mean_period().is_some() || prepared.close_up.is_none()) {
            // Of a close-up that is compared by colour clusters rows are others with interreflections.
            None => None,
            Some(traced) => {
                let with = Start { interreflection: Some(traced.clone()), ..best.clone() };
                let model = model_of(prepared, options, &prepared.fine, POLISH_SAMPLES, &with, &variants[best.choice], control)?;
                model.evaluate_with(&best.point, Some(&evaluated.linear), control)?.map(|e| derivatives::residuals(&e))
            }
        };
        let here = derivatives::residuals(evaluated);
        let changed =
            changed.filter(|with| with.len() == here.len()).map(|with| with.iter().zip(&here).map(|(a, b)| a - b).collect::<Vec<f64>>());
        Ok((identify::identify(model, &best.point, evaluated, &derivatives, (&replicates, changed.as_deref())), derivatives))
    })?;
    let Some((mut identified, derivatives)) = found else {
        parts.left_out.push(PROFILES_PART);
        return Ok((identify::values_only(model, &best.point, evaluated), Vec::new()));
    };
    if early.is_some() {
        parts.left_out.push(PROFILES_PART);
        return Ok((identified, Vec::new()));
    }
    let profiled = parts.make(PROFILES_PART, 0.3, |control| {
        profile::profiles(model, &best.point, evaluated, &identified, &derivatives, PROFILES, control)
    })?;
    let mut profiles = Vec::new();
    for (unknown, profile) in profiled.unwrap_or_default() {
        identified.widen(unknown, profile.wider);
        profiles.push(profile);
    }
    Ok((identified, profiles))
}

/// What the fitted material reflects more than once, where the fit has none of it.
fn missing_interreflection(
    prepared: &Prepared<'_>,
    model: &Model<'_>,
    evaluated: &Evaluated,
    best: &Start,
    seed: u64,
    control: &Control<'_>,
) -> Result<Option<Arc<Interreflection>>> {
    if best.interreflection.is_some() {
        return Ok(None);
    }
    let options = PathOptions { bounces: USUAL_BOUNCES, seed };
    interreflection_at(prepared, model, (&best.point, evaluated), options, control).map(|traced| Some(Arc::new(traced)))
}

/// Names of parts of the report.
pub const DIAGNOSIS: &str = "diagnosis";
/// The same.
const STANDARD_DEVIATIONS: &str = "standard deviations";
/// The same.
const PROFILES_PART: &str = "profiles";

/// What is missing since the work ended early, and what that means for what is there.
fn left_out_note(left_out: &[&str]) -> Option<String> {
    if left_out.is_empty() {
        return None;
    }
    // Without profiles nothing tells a valley that bends.
    let narrow = left_out.contains(&PROFILES_PART) && !left_out.contains(&STANDARD_DEVIATIONS);
    let narrow = if narrow {
        format!("; standard deviations may be too small, by up to {} times, where a valley bends", profile::WIDEST)
    } else {
        String::new()
    };
    Some(format!("left out, since the fit ended early: {}{narrow}", left_out.join(", ")))
}

fn no_surface(prepared: &Prepared<'_>) -> Error {
    let bad = BadInput::new("no point of the bounds makes a surface", "widen the bounds, or change the start material");
    bad.in_file(&prepared.spec.source.path).at_field("parameter").into()
}

/// The text of the fitted material, and the close-up with its periods where they lie.
fn fitted_text(
    prepared: &Prepared<'_>,
    model: &Model<'_>,
    evaluated: &Evaluated,
    point: &[f64],
    notes: &mut Vec<String>,
) -> Result<(MaterialText, Option<CloseUp>)> {
    let spec = prepared.spec;
    let mut text = spec.text.clone();
    text.write(&found(spec, model.input.variant, &model.state(point), &model.unknowns, &evaluated.linear));
    // A search that ended before they were traced explains the photographs by direct light.
    text.set_bounces(if model.input.interreflection.is_some() { spec.bounces } else { 0 });
    if let (Some(sides), Some(own)) = (model.input.variant.sides, variant::own_sides(&spec.material.geometry)) {
        notes.push(format!("threads of {sides} sides explain the photographs better than the {own} of the start material"));
    }
    let tile = text.material()?.build()?.tile.period.to_array();
    let close_up = prepared.close_up.as_ref().map(|c| c.on_its_plane(model.registration().map_or(0.0, |r| r.height), tile));
    if spec.scale_to_close_up {
        scale(&mut text, close_up.as_ref(), prepared, notes)?;
    }
    Ok((text, close_up))
}

/// The distant photographs beside the fitted material, their lights where they were found.
fn compare_distant(
    prepared: &Prepared<'_>,
    fitted: &Fitted<'_>,
    model: &Model<'_>,
    evaluated: &Evaluated,
    best: &Start,
    control: &Control<'_>,
) -> Result<Vec<Compared>> {
    let lights = model.state(&best.point).lights;
    let one = |(k, photograph): (usize, &&Photograph)| {
        let mut seen = (*photograph).clone();
        seen.light = turned(&photograph.light, lights[k], photograph.object.middle());
        let bins = &prepared.fine[k];
        let light = OtherLight {
            stray_light: stray_light(&model.unknowns, &evaluated.linear, Shot::Distant(k)),
            interreflection: best.interreflection.as_ref().map(|i| &i.bins[k][..]),
        };
        fitted.compare(seen, bins, light, bins.relative_rms(&evaluated.predicted(k, bins)), control)
    };
    prepared.distant.iter().enumerate().map(one).collect()
}

/// Photographs that were held out beside the material, and what the user should know of them.
type Validated = (Vec<(Validation, Compared)>, Vec<String>);

/// The photographs that were held out beside the fitted material.
fn validate_all(prepared: &Prepared<'_>, question: &Validating<'_>, control: &Control<'_>) -> Result<Validated> {
    let (mut validations, mut notes) = (Vec::new(), Vec::new());
    for photograph in prepared.spec.of_role(Role::Validation) {
        let sights = sights_of(photograph, prepared.spec, &prepared.start);
        match DirectionBins::new(photograph, &sights, FINE.bins) {
            Ok(bins) => validations.push(question.validate(photograph, bins, prepared.spec.bounces, &mut notes, control)?),
            Err(error) => notes.push(format!("a validation photograph cannot be used: {error}")),
        }
    }
    let scaled = validations.iter().filter(|(v, _)| v.exposure.is_some());
    notes.extend(scaled.map(|(v, _)| {
        format!("{}: its irradiance is not known: it was scaled to fit, and proves colours only up to a factor", v.photograph)
    }));
    Ok((validations, notes))
}

/// What the user should know of an unknown.
fn note_of(known: &Known) -> Option<String> {
    if known.not_identified {
        Some(format!(
            "{} is not identified: its standard deviation is over {:.0} % of the way between its bounds",
            known.name,
            100.0 * identify::NOT_IDENTIFIED
        ))
    } else {
        None
    }
}

/// Names of the coordinates of a point of the search.
fn coordinates(model: &Model<'_>, joint: bool) -> Vec<String> {
    let mut names: Vec<String> = model.variables.iter().map(|v| v.name(model.input.spec, &model.unknowns)).collect();
    if joint {
        names.extend(model.unknowns.iter().filter(|u| matches!(u.kind, UnknownKind::Colour(..))).map(|u| u.name.clone()));
    }
    names
}

/// Other minima as good as the best one, and not near it.
fn several(
    prepared: &Prepared<'_>,
    options: &Options,
    refined: &[Start],
    variants: &[Variant],
    control: &Control<'_>,
) -> Result<Vec<Vec<(String, f64)>>> {
    let best = &refined[0];
    let mut found: Vec<&Start> = Vec::new();
    for start in &refined[1..] {
        // Where the close-up was believed less, the objective is smaller by itself.
        let alike = !is_doubted(start) || is_doubted(best);
        let good = alike && start.objective <= best.objective * (1.0 + EQUALLY_GOOD);
        let far = |other: &Start| {
            variants[other.choice].clusters != variants[start.choice].clusters || distance(&other.point, &start.point) > APART
        };
        if good && far(best) && found.iter().all(|o| far(o)) {
            found.push(start);
        }
    }
    found
        .into_iter()
        .map(|start| {
            let model = model_of(prepared, options, &prepared.fine, COARSE.samples, start, &variants[start.choice], control)?;
            let named = model
                .variables
                .iter()
                .zip(&start.point)
                .map(|(v, &u)| (v.name(model.input.spec, &model.unknowns), v.at(model.input.spec, &model.unknowns, u)));
            Ok(named.collect())
        })
        .collect()
}

/// Scales all lengths of the material so that its period is the close-up's.
fn scale(text: &mut MaterialText, close_up: Option<&CloseUp>, prepared: &Prepared<'_>, notes: &mut Vec<String>) -> Result<()> {
    let tile = text.material()?.build()?.tile;
    let Some(measured) = close_up.map(|c| c.period) else {
        notes.push("the period is not that of a close-up: there is none".to_owned());
        return Ok(());
    };
    let own = [tile.period.x, tile.period.y];
    let factors: Vec<f64> = (0..2).filter_map(|k| Some(measured[k]?.length / own[k])).collect();
    let Some(&factor) = factors.first() else {
        notes.push("no period was found in the close-up: lengths are those of the start material".to_owned());
        return Ok(());
    };
    if let [x, y] = factors[..]
        && (x / y - 1.0).abs() > OTHER_FACTOR
    {
        notes.push(format!("the close-up's periods ask for factors {x:.4} along x and {y:.4} along y; lengths are scaled by the first"));
    }
    text.scale_lengths(prepared.spec.material.geometry.kind(), factor);
    notes.push(format!("all lengths were multiplied by {factor:.5}, so that the period is that of the close-up"));
    Ok(())
}
