//! What `biscale fit` writes beside its report: `fit.json`, and every evaluation as CSV, which `--resume` reads again.

use super::trade;
use crate::common::content_hash::hash_of_surface;
use biscale::error::{BadInput, Error, Result};
use biscale::numerics::hash::Fnv1a;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Choice, Options, Outcome};
use biscale_fit::search::{Entry, Memory, Stage, Trace};
use biscale_fit::uncertainty::identify::Known;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Name of the trace.
pub const EVALUATIONS: &str = "evaluations.csv";
/// Lines of a trace before its evaluations.
const HEAD_LINES: usize = 2;
/// How an output is recognised as made by this command.
pub const MADE: &str = "made by biscale fit";
/// First line of a fitted material.
pub const MATERIAL_MARK: &str = "# made by biscale fit";

/// The first line of a trace: it names the question, so that the evaluations of another one are not taken for those of this one.
pub fn mark(spec: &Spec, options: &Options) -> String {
    let mut hash = Fnv1a::default();
    let mut add = |bytes: &[u8]| hash.add(bytes);
    add(env!("CARGO_PKG_VERSION").as_bytes());
    add(spec.source.text.as_bytes());
    add(spec.text.text().as_bytes());
    // The files that the material names: images, meshes, drafts, measured BRDFs. One that cannot be built stops the fit anyhow.
    if let Ok(small) = spec.material.build() {
        add(hash_of_surface(&small).as_bytes());
    }
    for photograph in &spec.photographs {
        for value in photograph.image.rgb.iter().flatten() {
            add(&value.to_bits().to_le_bytes());
        }
    }
    add(format!("{:?}", Options { time_limit: None, ..options.clone() }).as_bytes());
    format!("# {MADE}, question {:016x}; places of the points between their bounds, 0 to 1", hash.value())
}

/// Writes the trace.
pub fn write_trace(out: &mut dyn Write, trace: &Trace, mark: &str) -> io::Result<()> {
    writeln!(out, "{mark}")?;
    let names: Vec<String> = trace.coordinates.iter().map(|n| format!("\"{}\"", n.replace('"', "\"\""))).collect();
    writeln!(out, "stage,start,evaluation,objective{}{}", if names.is_empty() { "" } else { "," }, names.join(","))?;
    for entry in &trace.entries {
        write!(out, "{},{},{},{}", entry.stage.name(), entry.start, entry.evaluation, entry.objective)?;
        for u in &entry.point {
            write!(out, ",{u}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Reads the trace of an earlier run; one that ended before it wrote any has none.
pub fn read_trace(path: &Path, mark: &str) -> Result<Memory> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Memory::default()),
        Err(e) => return Err(Error::reading(path, e)),
    };
    let mut lines = text.lines().enumerate();
    if lines.next().is_none_or(|(_, first)| first != mark) {
        let problem = "these are evaluations of another fit file, material, photographs or options";
        return Err(BadInput::new(problem, "leave --resume out, or name another folder").in_file(path).at_line(1).into());
    }
    let entry = |line: &str| -> Option<Entry> {
        let mut words = line.split(',');
        let stage = words.next()?;
        let stage = [Stage::Explore, Stage::Refine, Stage::Polish].into_iter().find(|s| s.name() == stage)?;
        let (start, evaluation) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        let objective = words.next()?.parse().ok()?;
        Some(Entry { stage, start, evaluation, objective, point: words.map(str::parse).collect::<Result<_, _>>().ok()? })
    };
    let entries: Result<Vec<Entry>> = lines
        .skip(1)
        .map(|(k, line)| {
            let bad = || BadInput::new("this line is no evaluation", "leave --resume out").in_file(path).at_line(k + 1);
            entry(line).ok_or_else(|| bad().into())
        })
        .collect();
    Ok(Memory::new(entries?))
}

/// Copies the trace of an earlier run to a name beside it that is free, `evaluations-1.csv`, before a run that does not resume it replaces it. Returns the copy's path;
/// none where there is no trace, or one without evaluations.
pub fn keep_earlier(evaluations: &Path) -> Result<Option<PathBuf>> {
    let text = match std::fs::read(evaluations) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Error::reading(evaluations, e)),
    };
    if text.split(|b| *b == b'\n').filter(|line| !line.is_empty()).count() <= HEAD_LINES {
        return Ok(None);
    }
    for number in 1_u32.. {
        let path = evaluations.with_file_name(format!("evaluations-{number}.csv"));
        let written = std::fs::File::create_new(&path).and_then(|mut file| file.write_all(&text));
        match written {
            Ok(()) => return Ok(Some(path)),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(source) => return Err(Error::Io { action: "write", path, source }),
        }
    }
    unreachable!("a folder holds fewer files")
}

/// Removes the copy of an earlier trace if all its lines stand in the new one: the run ended before it wrote any, or repeated the earlier one. Returns the copy if it
/// stays.
pub fn without_repetition(kept: PathBuf, evaluations: &Path) -> Option<PathBuf> {
    let (Ok(old), Ok(new)) = (std::fs::read_to_string(&kept), std::fs::read_to_string(evaluations)) else { return Some(kept) };
    let new: HashSet<&str> = new.lines().collect();
    // One that cannot be removed stays.
    if old.lines().all(|line| new.contains(line)) && std::fs::remove_file(&kept).is_ok() { None } else { Some(kept) }
}

/// One unknown in a line: `geometry.depth = 0.51 +/- 0.02 (4 %)`.
pub fn line(known: &Known) -> String {
    // A share of a number that is zero where nothing is wrong says nothing.
    let about_zero = known.value == 0.0 || ["light", "veil"].contains(&known.kind);
    let share = if about_zero { String::new() } else { format!(" ({:.1} %)", 100.0 * (known.sigma / known.value).abs()) };
    let mut text = if known.sigma.is_nan() {
        format!("{} = {} (standard deviation not computed)", known.name, digits(known.value))
    } else {
        format!("{} = {}{share}", known.name, with_sigma(known, " +/- "))
    };
    for flag in flags(known) {
        text.push_str(", ");
        text.push_str(flag);
    }
    text
}

/// What is to be said of an unknown.
pub fn flags(known: &Known) -> Vec<&'static str> {
    let all = [
        (known.not_identified, "not identified"),
        (known.weak && !known.not_identified, "weak"),
        (known.at_bound && known.kind != "veil", "at a bound"),
        (known.from_close_up, "from the close-up"),
        (known.scale_assumed, "scale assumed"),
    ];
    all.into_iter().filter(|(set, _)| *set).map(|(_, word)| word).collect()
}

/// A value and its standard deviation, this with two significant digits and the value with as many decimals; without one where it was not
/// computed.
pub fn with_sigma(known: &Known, between: &str) -> String {
    if !known.sigma.is_finite() || known.sigma <= 0.0 {
        return digits(known.value);
    }
    // The exponent of the rounded number: .00996 is .010.
    let exponent: i32 = format!("{:.1e}", known.sigma).split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0);
    let decimals = usize::try_from(1 - exponent).unwrap_or(0);
    format!("{:.decimals$}{between}{:.decimals$}", known.value, known.sigma)
}

/// A number with four significant digits.
pub fn digits(x: f64) -> String {
    format!("{x:.3e}").parse::<f64>().map_or_else(|_| x.to_string(), |v| v.to_string())
}

/// Everything that was found, as JSON. Nothing in it depends on the clock.
pub fn summary((spec, choice): (&Spec, Option<&Choice>), options: &Options, outcome: &Outcome, compared: &[trade::Line]) -> Value {
    let verdict = match (outcome.failures.is_empty(), outcome.validations.is_empty()) {
        (false, _) => "fail",
        (true, true) => "not validated",
        (true, false) => "pass",
    };
    let mut summary = json!({
        "creator": format!("{MADE} {}", env!("CARGO_PKG_VERSION")),
        "format": 1,
        "name": spec.name,
        "verdict": verdict,
        "failures": outcome.failures,
        "causes": outcome.causes,
        "training": {
            "relative_rms": outcome.training,
            "objective": finite(outcome.objective),
            "chi2": finite(outcome.identified.chi2),
            "residuals": finite(outcome.identified.residuals),
            "close_up": outcome.near.as_ref().map(|near| json!({ "relative_rms": finite(near.relative_rms) })),
            "photographs": outcome.compared.iter().zip(&outcome.bins).map(|(c, bins)| json!({
                "photograph": c.photograph.file.file_name().unwrap_or_default().to_string_lossy(),
                "relative_rms": c.relative_rms,
                "pixel_relative_rms": c.pixel_relative_rms,
                "delta_e_itp": c.delta_e_itp,
                "pixels": bins.pixels,
                "cells": bins.bins.len(),
                "cell_deg": bins.step.to_degrees(),
            })).collect::<Vec<_>>(),
        },
        "unknowns": outcome.identified.known,
        "correlations": outcome.identified.correlations,
        "condition": finite(outcome.identified.condition),
        "profiles": outcome.profiles,
        "close_up": outcome.close_up,
        "validation": outcome.validations.iter().map(|(v, _)| v).collect::<Vec<_>>(),
        "several_solutions": outcome.several.iter().map(|s| s.iter().map(|(n, v)| (n.clone(), json!(v))).collect::<serde_json::Map<_, _>>()).collect::<Vec<_>>(),
        "search": {
            "optimizer": options.optimiser.name(),
            "colours": if options.joint { "joint" } else { "projected" },
            "seed": options.seed,
            "evaluations": outcome.evaluations,
            "ended_early": outcome.ended_early,
            "starts": outcome.starts.iter().map(|s| json!({
                "number": s.number, "objective": finite(s.objective), "evaluations": s.evaluations, "converged": s.converged, "restarts": s.restarts,
            })).collect::<Vec<_>>(),
        },
        "left_out": outcome.left_out,
        "compared_optimizers": compared,
        "notes": outcome.notes,
    });
    // Of a fit without candidates nothing is said.
    if let (Some(choice), Some(object)) = (choice, summary.as_object_mut()) {
        object.insert("choice".to_owned(), json!({ "sentence": choice.sentence(), "of": choice }));
    }
    summary
}

/// JSON has no infinity.
fn finite(x: f64) -> Option<f64> {
    x.is_finite().then_some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_as_many_decimals_as_its_standard_deviation_tells() {
        let known = |value: f64, sigma: f64| with_sigma(&Known { value, sigma, ..Known::default() }, " +/- ");
        assert_eq!(known(0.44581, 0.02495), "0.446 +/- 0.025");
        assert_eq!(known(0.0000017, 0.00062), "0.00000 +/- 0.00062");
        assert_eq!(known(1234.5, 99.6), "1234 +/- 100");
        assert_eq!(known(-3.2, 0.00996), "-3.200 +/- 0.010");
        assert_eq!(known(0.25, 0.0), "0.25");
        assert_eq!(known(0.25, f64::NAN), "0.25");
    }
}
