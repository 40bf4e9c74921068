//! After the search: what is known, pictures beside the photographs, and the held-out one.

use super::found::{found, veil};
use super::options::{COARSE, FINE, Options, POLISH_SAMPLES};
use super::outcome::{Compared, Early, Outcome};
use super::prepared::{Prepared, look};
use super::stages::{Searched, distance, model_of};
use super::stopwatch::Stopwatch;
use crate::fit_file::material_text::MaterialText;
use crate::fit_file::variant::{self, Variant};
use crate::parallel::in_parallel;
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::{Cells, turned};
use crate::photograph::image::{Photograph, Role};
use crate::residuals::derivatives;
use crate::residuals::indirect::indirect;
use crate::residuals::input::Indirect;
use crate::residuals::model::Model;
use crate::residuals::unknowns::{self, UnknownKind};
use crate::search::{APART, Shared, Start};
use crate::uncertainty::identify;
use crate::uncertainty::profile;
use crate::verdict::picture;
use crate::verdict::validate::{self, Validation, verdict};
use biscale::error::Result;
use biscale::filter::CommonRandomNumbers;
use biscale::filter::Control;
use biscale::material::{Material, SmallScale};
use biscale::render::Light;

/// Profiles that are made.
const PROFILES: usize = 3;
/// Largest difference of the objective of two minima that are equally good, as a share of the better one.
const EQUALLY_GOOD: f64 = 0.05;
/// What is added to the number of a start for samples of its own: those that tell what samples change.
const REPLICAS: [usize; 4] = [1000, 2000, 3000, 4000];

/// Looks at what was found, once the search is over.
pub(super) fn finish(
    prepared: &Prepared<'_>,
    options: &Options,
    shared: &Shared<'_>,
    searched: Searched,
    mut watch: Stopwatch<'_>,
) -> Result<Outcome> {
    // What was asked to stop was the search: what follows is short, and a result without it could not be judged.
    let never = std::sync::atomic::AtomicBool::new(false);
    let early = if shared.control.check().is_err() {
        Some(Early::Interrupted)
    } else {
        shared.deadline.filter(|&d| (shared.control.clock)() >= d).map(|_| Early::TimeLimit)
    };
    let report = |stage: &str, share: f64| (shared.control.progress)(stage, 0.8 + 0.2 * share);
    let control = &Control {
        cancel: if early == Some(Early::Interrupted) { &never } else { shared.control.cancel },
        progress: &|_, _| {},
        clock: shared.control.clock,
    };
    let spec = prepared.spec;
    let Searched { starts, refined } = searched;
    let variants = prepared.variants().all;
    let best = &starts[0];
    report("identify", 0.0);
    // Whatever the search moved, the colours are solved for here.
    let solved = Options { joint: false, ..options.clone() };
    let projected = |start: &Start| Start { point: start.point[..unknowns::variables(spec).len()].to_vec(), ..start.clone() };
    let best = &projected(best);
    let model = model_of(prepared, &solved, &prepared.fine, POLISH_SAMPLES, best, &variants[best.choice], control)?;
    let Some(evaluated) = model.evaluate(&best.point, control)? else {
        let why = "no point of the bounds makes a surface";
        return Err(biscale::BadInput::new(why, "widen the bounds, or change the start material")
            .in_file(&spec.source.path)
            .at_field("parameter")
            .into());
    };
    let derivatives = derivatives::derivatives(&model, &best.point, &evaluated, control)?;
    let replicas = in_parallel(&REPLICAS, |_, &seed| {
        let other = Start { number: best.number + seed, ..best.clone() };
        let model = model_of(prepared, &solved, &prepared.fine, POLISH_SAMPLES, &other, &variants[best.choice], control)?;
        Ok(model.evaluate_with(&best.point, Some(&evaluated.linear), control)?.map(|e| derivatives::residuals(&e)))
    })?;
    let replicas: Vec<Vec<f64>> = replicas.into_iter().flatten().filter(|r| r.len() == derivatives.rows.len()).collect();
    let mut identified = identify::identify(&model, &best.point, &evaluated, &derivatives, &replicas);
    watch.lap("identify");
    report("profiles", 0.3);
    let mut profiles = Vec::new();
    if early.is_none() {
        for (unknown, profile) in profile::profiles(&model, &best.point, &evaluated, (&identified, &derivatives), PROFILES, control)? {
            identified.widen(unknown, profile.wider);
            profiles.push(profile);
        }
        watch.lap("profiles");
    }
    let state = model.state(&best.point);
    let mut text = spec.text.clone();
    text.write(&found(spec, model.input.variant, &state, &model.unknowns, &evaluated.linear));
    let mut notes = prepared.notes.clone();
    if let (Some(sides), Some(own)) = (model.input.variant.sides, variant::own_sides(&spec.material.geometry)) {
        notes.push(format!("threads of {sides} sides explain the photographs better than the {own} of the start material"));
    }
    let tile = text.material()?.build()?.tile.period.to_array();
    let close_up = prepared.close_up.as_ref().map(|c| c.on_its_plane(model.registration().map_or(0.0, |r| r.height), tile));
    if spec.scale_to_close_up {
        scale(&mut text, close_up.as_ref(), prepared, &mut notes)?;
    }
    let material = text.material()?;
    let small = material.build()?;
    report("pictures", 0.5);
    let training = evaluated.relative_rms(&prepared.fine);
    let mut compared = Vec::new();
    for (k, photograph) in prepared.distant.iter().enumerate() {
        let mut seen = (*photograph).clone();
        seen.light = turned(&photograph.light, state.lights[k], photograph.object.middle());
        let veil = veil(&model.unknowns, &evaluated.linear, k);
        let error = prepared.fine[k].relative_rms(&evaluated.predicted(k, &prepared.fine[k]));
        let extra = best.indirect.as_ref().map(|i| &i.cells[k][..]);
        compared.push(compare(seen, (&material, &small), prepared.opaque, veil, &prepared.fine[k], extra, error, control)?);
    }
    let mut validations = Vec::new();
    for photograph in spec.of_role(Role::Validation) {
        let sights = look(photograph, spec, &prepared.start);
        let cells = match Cells::new(photograph, &sights, FINE.cells) {
            Ok(cells) => [cells],
            Err(error) => {
                notes.push(format!("a validation photograph cannot be used: {error}"));
                continue;
            }
        };
        validations.push(validate_one(
            prepared,
            (&material, &small),
            photograph,
            cells,
            &compared,
            training,
            veil(&model.unknowns, &evaluated.linear, 0),
            options.seed,
            control,
        )?);
    }
    for (validation, _) in validations.iter().filter(|(v, _)| v.exposure.is_some()) {
        notes.push(format!(
            "{}: its irradiance is not known: it was scaled to fit, and proves colours only up to a factor",
            validation.photograph
        ));
    }
    watch.lap("pictures");
    let several = several(prepared, options, &starts[..refined], &variants, control)?;
    if !several.is_empty() {
        notes.push(format!("several solutions: {} other places fit as well as the best one", several.len()));
    }
    for known in &identified.known {
        if known.not_identified {
            notes.push(format!(
                "{} is not identified: its standard deviation is {:.0} % of its range",
                known.name,
                100.0 * known.sigma / known.range.max(f64::MIN_POSITIVE)
            ));
        } else if known.at_bound && known.kind == "parameter" {
            notes.push(format!("{} lies on a bound", known.name));
        }
    }
    let failures = failures(training, &validations, &starts[0]);
    report("report", 1.0);
    let variables = unknowns::variables(spec);
    Ok(Outcome {
        coordinates: if options.joint {
            coordinates(&model, true)
        } else {
            variables.iter().map(|v| v.name(spec, &model.unknowns)).collect()
        },
        best: best.point.clone(),
        text,
        identified,
        profiles,
        objective: evaluated.objective,
        training,
        several,
        trace: shared.sorted_trace(),
        close_up,
        cells: prepared.fine.clone(),
        compared,
        validations,
        ended_early: early,
        seconds: watch.parts,
        notes,
        failures,
        starts,
        material,
    })
}

fn coordinates(model: &Model<'_>, joint: bool) -> Vec<String> {
    let mut names: Vec<String> = model.variables.iter().map(|v| v.name(model.input.spec, &model.unknowns)).collect();
    if joint {
        names.extend(model.unknowns.iter().filter(|u| matches!(u.kind, UnknownKind::Colour(..))).map(|u| u.name.clone()));
    }
    names
}

/// Why the fit is not to be believed.
fn failures(training: f64, validations: &[(Validation, Compared)], best: &Start) -> Vec<String> {
    let mut failures = Vec::new();
    if !best.objective.is_finite() || !training.is_finite() {
        failures.push("nothing was fitted".to_owned());
    } else if training > validate::MOST_ERROR {
        failures.push(format!(
            "the material does not explain the photographs: the relative RMS difference is {:.1} %, over {:.0} %",
            100.0 * training,
            100.0 * validate::MOST_ERROR
        ));
    }
    for (validation, _) in validations {
        if validation.verdict == validate::Verdict::Fail {
            failures.push(format!(
                "{} is not predicted: the relative RMS difference is {:.1} %, {:.1} times that of training",
                validation.photograph,
                100.0 * validation.relative_rms,
                validation.ratio
            ));
        }
    }
    failures
}

#[expect(clippy::too_many_arguments, reason = "what a comparison is made of")]
fn compare(
    photograph: Photograph,
    material: (&Material, &SmallScale),
    opaque: bool,
    veil: [f64; 3],
    cells: &Cells,
    indirect: Option<&[[f64; 3]]>,
    relative_rms: f64,
    control: &Control<'_>,
) -> Result<Compared> {
    let mut picture = picture::render(&photograph, material, opaque, veil, control)?;
    if let Some(extra) = indirect {
        for ((members, cell), extra) in cells.members.iter().zip(&cells.cells).zip(extra) {
            for &pixel in members {
                #[expect(clippy::cast_possible_truncation, reason = "pictures are in f32")]
                for c in 0..3 {
                    picture.rgb[pixel as usize][c] += (cell.irradiance[c] * extra[c]) as f32;
                }
            }
        }
    }
    let used: Vec<u32> = cells.members.iter().flatten().copied().filter(|&p| !picture.rgb[p as usize][0].is_nan()).collect();
    let pixel_relative_rms = validate::pixel_relative_rms(&photograph, &picture, &used);
    let delta_e_itp = validate::mean_delta_e_itp(&photograph, &picture, &used);
    Ok(Compared { photograph, picture, used, relative_rms, pixel_relative_rms, delta_e_itp })
}

/// Everything frozen, under the light of a photograph that was held out.
#[expect(clippy::too_many_arguments, reason = "what a validation is made of")]
fn validate_one(
    prepared: &Prepared<'_>,
    (material, small): (&Material, &SmallScale),
    photograph: &Photograph,
    mut cells: [Cells; 1],
    fitted: &[Compared],
    training: f64,
    veil: [f64; 3],
    seed: u64,
    control: &Control<'_>,
) -> Result<(Validation, Compared)> {
    let spec = prepared.spec;
    let extra = if spec.bounces > 0 { Some(indirect(small, &cells, &[[0.0; 2]], None, (spec.bounces, seed), control)?) } else { None };
    let mut predicted = predict(small, &cells[0], prepared.opaque, extra.as_ref(), veil, control)?;
    let mut photograph = photograph.clone();
    let mut exposure = None;
    if !photograph.exposure_known {
        // How bright its light was says the photograph alone.
        let factor = scale_of(&cells[0], &predicted, veil);
        exposure = Some(factor);
        predicted.iter_mut().for_each(|p| (0..3).for_each(|c| p[c] = factor * (p[c] - veil[c]) + veil[c]));
        cells[0].cells.iter_mut().for_each(|cell| cell.irradiance = cell.irradiance.map(|i| factor * i));
        match &mut photograph.light {
            Light::Directional { irradiance: light, .. } | Light::Point { intensity: light, .. } => *light = light.map(|i| factor * i),
        }
    }
    let photograph = &photograph;
    let relative_rms = cells[0].relative_rms(&predicted);
    let own = validate::direction(photograph);
    let angle = |other: &Compared| own.angle_between(validate::direction(&other.photograph)).to_degrees();
    let angle_deg = fitted.iter().map(angle).fold(f64::INFINITY, f64::min);
    let extra = extra.as_ref().map(|i| &i.cells[0][..]);
    let compared = compare(photograph.clone(), (material, small), prepared.opaque, veil, &cells[0], extra, relative_rms, control)?;
    let validation = Validation {
        photograph: photograph.file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        verdict: verdict(relative_rms, training, angle_deg),
        relative_rms,
        pixel_relative_rms: compared.pixel_relative_rms,
        ratio: relative_rms / training.max(f64::MIN_POSITIVE),
        delta_e_itp: compared.delta_e_itp,
        angle_deg,
        pixels: compared.used.len(),
        exposure,
    };
    Ok((validation, compared))
}

/// The factor of a prediction that is nearest to the photograph.
fn scale_of(cells: &Cells, predicted: &[[f64; 3]], veil: [f64; 3]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (cell, p) in cells.cells.iter().zip(predicted) {
        for c in 0..3 {
            product += cell.count as f64 * (p[c] - veil[c]) * (cell.mean[c] - veil[c]);
            square += cell.count as f64 * (p[c] - veil[c]).powi(2);
        }
    }
    if square > 0.0 && product > 0.0 { product / square } else { 1.0 }
}

/// Radiance that a material shows in some cells.
fn predict(
    small: &SmallScale,
    cells: &Cells,
    opaque: bool,
    indirect: Option<&Indirect>,
    veil: [f64; 3],
    control: &Control<'_>,
) -> Result<Vec<[f64; 3]>> {
    let slots = unknowns::slots(&small.surfaces);
    let pairs = cells.pairs([0.0; 2]);
    let samples = CommonRandomNumbers::new(small, 4 * POLISH_SAMPLES, 0, &pairs, control)?;
    let shares = samples.on(small, control)?.basis_reflectance(&pairs, &slots)?;
    let value = |k: usize| {
        let cell = &cells.cells[k];
        let factor = cell.inverse_cosine * if opaque && shares.av[k] > 0.0 { cell.wo.z / shares.av[k] } else { 1.0 };
        std::array::from_fn(|c| {
            let direct: f64 = slots.iter().zip(&shares.s).map(|(slot, s)| s[k][c] * unknowns::colour_of(small, *slot)[c]).sum();
            let extra = indirect.map_or(0.0, |i| i.cells[0][k][c]);
            cell.irradiance[c] * (factor * direct + extra) + veil[c]
        })
    };
    Ok((0..cells.cells.len()).map(value).collect())
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
        let good = start.objective <= best.objective * (1.0 + EQUALLY_GOOD);
        let far =
            |other: &Start| variants[other.choice].kinds != variants[start.choice].kinds || distance(&other.point, &start.point) > APART;
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
        && (x / y - 1.0).abs() > 0.02
    {
        notes.push(format!("the close-up's periods ask for factors {x:.4} along x and {y:.4} along y; lengths are scaled by the first"));
    }
    text.scale_lengths(prepared.spec.material.geometry.kind(), factor);
    notes.push(format!("all lengths were multiplied by {factor:.5}, so that the period is that of the close-up"));
    Ok(())
}
