//! `report.html`: one file that holds everything, pictures too.

use super::files::{digits, flags, with_sigma};
use super::flip::mean_flip;
use super::pictures::Pair;
use super::report_plots::{convergence, profile_plot};
use super::{pictures, report_choice, surface, trade};
use crate::common;
use crate::common::figure::Svg;
use biscale::error::Result;
use biscale::formats::svg::png_url;
use biscale::numerics::colour::srgb_byte;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::photograph::image::{IRRADIANCE_SIGMA, Photograph, Role};
use biscale_fit::run::{Choice, DIAGNOSIS, Options, Outcome};
use biscale_fit::uncertainty::identify::Known;
use biscale_fit::verdict::gates::MOST_NEAR_ERROR;
use biscale_fit::verdict::validate::{LEAST_ANGLE_DEG, LEAST_TRAINING, MOST_ERROR, MOST_RATIO, Verdict};
use maud::{Markup, PreEscaped, html};
use std::path::Path;

const STYLE: &str = "img{image-rendering:pixelated;max-width:100%}img.smooth{image-rendering:auto}\
.pass{background:#e3f4e1}.fail{background:#fbe3df}.open{background:#f4efdc}.verdict{padding:.6em 1em;border-radius:6px;font-size:1.1em}\
.flag{color:#a03010}";

/// The report.
pub fn page((spec, choice): (&Spec, Option<&Choice>), options: &Options, outcome: &Outcome, compared: &[trade::Line]) -> Result<String> {
    let photographs = photographs(outcome)?;
    let close_up = close_up(outcome)?;
    let drawn = surface::picture(&outcome.material.build()?)?;
    let body = html! {
        h1 { (spec.name) }
        (verdict(outcome))
        (causes(outcome))
        @if let Some(choice) = choice { (report_choice::section(choice)) }
        h2 { "The surface that was found" }
        img.smooth alt="the fitted surface from near" src=(png_url(&drawn));
        p { "Some periods in parallel projection, with the colours and BRDFs that were found, under direct light from the left." }
        (photographs)
        (close_up)
        (validation(outcome))
        (unknowns(outcome))
        (colours(outcome))
        (search(options, outcome))
        (optimisers(compared))
        (notes(outcome))
        (inputs(spec, options))
        p { small { "biscale fit " (env!("CARGO_PKG_VERSION")) } }
    };
    Ok(common::page::page("made by biscale fit", &spec.name, STYLE, &body))
}

/// A number in percent with two decimals.
fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn verdict(outcome: &Outcome) -> Markup {
    let (class, word) = match (outcome.failures.is_empty(), outcome.validations.is_empty()) {
        (false, _) => ("fail", "FAIL"),
        (true, true) => ("open", "Not validated"),
        (true, false) => ("pass", "PASS"),
    };
    let refused = outcome.validations.iter().all(|(v, _)| v.verdict == Verdict::Refused) && !outcome.validations.is_empty();
    let (class, word) = if refused && class == "pass" { ("open", "Not proved: the validation light is too near") } else { (class, word) };
    html! {
        p class={ "verdict " (class) } {
            b { (word) } ". Training error " (percent(outcome.training))
            @for (validation, _) in &outcome.validations { ", validation error " (percent(validation.relative_rms)) }
            "."
        }
        @for failure in &outcome.failures { p.flag { (failure) } }
    }
}

/// What makes the photographs agree, where they do not.
fn causes(outcome: &Outcome) -> Markup {
    html! {
        @if !outcome.causes.is_empty() {
            h2 { "Likely cause" }
            p { "One assumption at a time was made otherwise. These make the photographs agree, the likeliest first:" }
            ol {
                @for cause in &outcome.causes {
                    li {
                        (cause.remedy) " "
                        small {
                            "(" @if let Some(ratio) = cause.objective_ratio { "squared residuals " (format!("{:.0} %", 100.0 * ratio)) " of what they were; " }
                            "training error " (percent(cause.training)) @if let Some(near) = cause.close_up { ", close-up " (percent(near)) } ")"
                        }
                    }
                }
            }
        } @else if !outcome.failures.is_empty() && !outcome.left_out.contains(&DIAGNOSIS) {
            p {
                "No single assumption that was made otherwise (close-up turned or mirrored, photographs swapped, values encoded, lights elsewhere, \
                 reflections, field of view) makes the photographs agree: the kind of structure or the BRDFs may be others."
            }
        }
    }
}

fn photographs(outcome: &Outcome) -> Result<Markup> {
    let fitted = outcome.compared.iter().map(|c| (c, "fitted"));
    let held_out = outcome.validations.iter().map(|(_, c)| (c, "held out"));
    let mut shown = Vec::new();
    for (compared, role) in fitted.chain(held_out) {
        let png = pictures::panels(&[Pair::of(compared)])?;
        let flip = mean_flip(&compared.photograph, &compared.picture.rgb, &compared.used);
        shown.push(html! {
            p {
                b { (file_name(&compared.photograph)) } ", " (role) ": relative RMS difference " (percent(compared.relative_rms))
                " over directions, " (percent(compared.pixel_relative_rms)) " over pixels; ΔE ITP " (format!("{:.2}", compared.delta_e_itp))
                "; FLIP " (format!("{flip:.3}"))
                br;
                img alt="photograph, material, difference" src=(png_url(&png));
            }
        });
    }
    Ok(html! {
        h2 { "Photographs and fitted material" }
        p {
            "Left the photograph, in the middle the material as the same camera would see it, right their difference times "
            (pictures::FACTOR) " (black is none, yellow a third of white). Grey is left out."
        }
        @for photograph in &shown { (photograph) }
    })
}

fn validation(outcome: &Outcome) -> Markup {
    html! {
        h2 { "Validation" }
        @if outcome.left_out.contains(&"validation") {
            p { "The fit ended before the photograph that was held out was looked at: how the material looks under another light is not tested." }
        } @else if outcome.validations.is_empty() {
            p { "No photograph was held out: how the material looks under another light is not tested." }
        } @else {
            p {
                (format!("Everything held fixed, another light. It passes with at most {:.0} %, and at most {MOST_RATIO:.0} times the training error or \
                 {:.0} %, whichever is larger; a light within {LEAST_ANGLE_DEG:.0} degrees of a fitted one proves nothing.",
                    100.0 * MOST_ERROR, 100.0 * MOST_RATIO * LEAST_TRAINING))
            }
            table {
                tr {
                    th { "photograph" } th { "verdict" } th.n { "error" } th.n { "over training" } th.n { "error of pixels" }
                    th.n { "ΔE ITP" } th.n { "light away" }
                }
                @for (v, _) in &outcome.validations {
                    tr {
                        td { (v.photograph) } td { (format!("{:?}", v.verdict)) } td.n { (percent(v.relative_rms)) }
                        td.n { (format!("{:.2}", v.ratio)) } td.n { (percent(v.pixel_relative_rms)) }
                        td.n { (format!("{:.2}", v.delta_e_itp)) } td.n { (format!("{:.0}°", v.angle_deg)) }
                    }
                }
            }
        }
    }
}

fn unknowns(outcome: &Outcome) -> Markup {
    let identified = &outcome.identified;
    let computed = !identified.chi2.is_nan();
    // A share of a number that is zero where nothing is wrong says nothing.
    let relative = |known: &Known| {
        let about_zero = ["light", "veil"].contains(&known.kind) || known.value == 0.0;
        if about_zero || known.sigma.is_nan() { "-".to_owned() } else { format!("{:.1}", 100.0 * (known.sigma / known.value).abs()) }
    };
    html! {
        h2 { "What was found, and how well it is known" }
        table {
            tr { th { "unknown" } th.n { "value ± σ" } th.n { "%" } th.n { "bounds" } th { "remarks" } }
            @for known in &identified.known {
                tr {
                    td title=(known.name) { (plain_name(&known.name)) }
                    td.n { (with_sigma(known, " ± ")) } td.n { (relative(known)) }
                    td.n { (digits(known.bounds[0])) " .. " (digits(known.bounds[1])) } td.flag { (flags(known).join(", ")) }
                }
            }
        }
        @if computed {
            p {
                (format!("χ² per residual {:.2} over {:.0} independent residuals; condition number {:.0}. ",
                    identified.chi2, identified.residuals, identified.condition))
                i { "Not identified" } ": σ over 25 % of the range. " i { "Weak" } ": over 10 % of the value. "
                i { "From the close-up" } ": the distant photographs alone do not tell it."
            }
        }
        @if computed { (correlations(outcome)) } @else { p { "The fit ended before it was told how well they are known." } }
        @if !outcome.profiles.is_empty() {
            p { "Objective with one parameter held, for those that are known worst (all others answer):" }
            p { @for profile in &outcome.profiles { (inline(&profile_plot(profile))) } }
        }
        @for other in &outcome.several {
            p.flag { "Fits as well:" }
            table { @for (name, value) in other { tr { td { (name) } td.n { (digits(*value)) } } } }
        }
    }
}

fn correlations(outcome: &Outcome) -> Markup {
    let correlations = &outcome.identified.correlations;
    html! {
        @if correlations.is_empty() {
            p { "No two unknowns have a correlation over .9." }
        } @else {
            table {
                tr { th { "hardly told apart" } th {} th.n { "correlation" } }
                @for c in correlations { tr { td { (c.a) } td { (c.b) } td.n { (format!("{:.3}", c.correlation)) } } }
            }
        }
    }
}

/// The close-up beside the material, and what it says by itself.
fn close_up(outcome: &Outcome) -> Result<Markup> {
    let Some(found) = &outcome.close_up else { return Ok(html! {}) };
    let picture = outcome.near.as_ref().and_then(Pair::of_close_up).map(|pair| pictures::panels(&[pair])).transpose()?;
    Ok(html! {
        h2 { "The close-up" }
        @if let Some(near) = &outcome.near {
            p {
                "Relative RMS difference " (percent(near.relative_rms)) ", at most " (format!("{:.0} %", 100.0 * MOST_NEAR_ERROR)) " passes."
                @if picture.is_some() { " Its mean period, that of the material, and their difference:" }
            }
        }
        @if let Some(png) = &picture { img alt="mean period, material, difference" src=(png_url(png)); }
        table {
            @for (axis, period) in ["x", "y"].iter().zip(&found.period) {
                tr {
                    td { "period along " (axis) }
                    td {
                        @match period {
                            Some(p) => { (digits(p.length)) " ± " (digits(p.sigma)) (format!(" (agreement {:.2})", p.agreement)) },
                            None => "does not repeat",
                        }
                    }
                }
            }
            @for (k, cluster) in found.clusters.iter().enumerate() {
                tr {
                    td { "colour cluster " (k + 1) }
                    td { (format!("coverage {:.1} %, mean radiance [{}]", 100.0 * cluster.cover, cluster.colour.map(digits).join(", "))) }
                }
            }
        }
    })
}

/// The colours that were found, as a screen shows them.
fn colours(outcome: &Outcome) -> Markup {
    let channels = ["red", "green", "blue"].map(|c| format!(" {c}"));
    let colour = |k: &Known| {
        let key = k.name.strip_suffix(&channels[0])?;
        let value = |c: usize| outcome.identified.known.iter().find(|k| k.name == format!("{key}{}", channels[c])).map(|k| k.value);
        Some((plain_name(key), [value(0)?, value(1)?, value(2)?]))
    };
    let found: Vec<(String, [f64; 3])> = outcome.identified.known.iter().filter(|k| k.kind == "colour").filter_map(colour).collect();
    let assumed = outcome.identified.known.iter().any(|k| k.scale_assumed);
    html! {
        @if !found.is_empty() {
            table {
                @for (name, value) in &found {
                    @let [r, g, b] = value.map(srgb_byte);
                    tr {
                        td { (name) }
                        td { span style=(format!("display:inline-block;width:5em;height:1.2em;background:rgb({r},{g},{b})")) {} }
                        td { "[" (value.map(digits).join(", ")) "]" }
                    }
                }
            }
        }
        @if assumed {
            p {
                "All colours share the scale of the irradiance in the file, which nothing in the photographs tells; its standard deviation was not \
                 given and was taken as " (format!("{:.0} %", 100.0 * IRRADIANCE_SIGMA))
                ". Write " code { "irradiance_sigma" } " into the fit file where it is known better or worse."
            }
        }
    }
}

/// A number of a material or a photograph in words.
fn plain_name(name: &str) -> String {
    let words = |text: &str| text.replace("_deg", " (degrees)").replace('_', " ");
    let photograph = |shot: &str| if shot == "close-up" { "the close-up".to_owned() } else { format!("distant photograph {shot}") };
    let mut parts = name.splitn(3, ' ');
    match (parts.next(), parts.next(), parts.next()) {
        (Some("light"), Some(shot), Some(axis)) => format!("light of {}, {}", photograph(shot), words(axis)),
        (Some("veil"), Some(shot), Some(channel)) => format!("stray light of {}, {channel}", photograph(shot)),
        _ => match name.split('.').collect::<Vec<_>>()[..] {
            ["geometry", key] => words(key),
            ["surface", part, "brdf", key] => format!("{part} {}", words(key)),
            ["surface", part, key] => format!("{part} {}", words(key)),
            _ => name.to_owned(),
        },
    }
}

/// What was fitted, and by which command.
fn inputs(spec: &Spec, options: &Options) -> Markup {
    let file = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    html! {
        h2 { "Made from" }
        ul {
            li { "fit file " code { (file(&spec.source.path)) } ", start material " code { (file(&spec.material_file)) } }
            @for photograph in &spec.photographs {
                li {
                    (match photograph.role { Role::Distant => "distant", Role::CloseUp => "close-up", Role::Validation => "held out" }) " "
                    code { (photograph.name()) } (format!(", {} x {} pixels", photograph.image.width, photograph.image.height))
                }
            }
        }
        p { code { (format!("biscale fit {} -o FOLDER --optimizer {} --seed {}", file(&spec.source.path), options.optimiser.name(), options.seed)) } }
    }
}

fn search(options: &Options, outcome: &Outcome) -> Markup {
    let colours = if options.joint { "moved with the rest" } else { "solved for at every step" };
    html! {
        h2 { "The search" }
        p { (options.optimiser.name()) ", colours " (colours) ", seed " (options.seed) ": " (outcome.evaluations) " evaluations in all." }
        p { (inline(&convergence(&outcome.trace.entries))) }
        table {
            tr { th.n { "start" } th.n { "objective" } th.n { "evaluations" } th.n { "restarts" } th { "ended" } }
            @for start in &outcome.starts {
                tr {
                    td.n { (start.number) } td.n { (digits(start.objective)) } td.n { (start.evaluations) } td.n { (start.restarts) }
                    td { @if start.converged { "converged" } @else { "early" } }
                }
            }
        }
    }
}

fn optimisers(compared: &[trade::Line]) -> Markup {
    if compared.is_empty() {
        return html! {};
    }
    html! {
        h2 { "Optimisers and tolerances" }
        table {
            tr {
                th { "search" } th.n { "evaluations" } th.n { "of the winner" } th.n { "objective" } th.n { "training" } th.n { "validation" }
            }
            @for line in compared {
                tr {
                    td { (line.what) } td.n { (line.evaluations) } td.n { (line.of_winner) } td.n { (format!("{:.4}", line.objective)) }
                    td.n { (percent(line.training)) } td.n { (line.validation.map_or("-".to_owned(), percent)) }
                }
            }
        }
    }
}

fn notes(outcome: &Outcome) -> Markup {
    html! {
        @if !outcome.notes.is_empty() {
            h2 { "Notes" }
            ul { @for note in &outcome.notes { li { (note) } } }
        }
    }
}

/// A plot within the page: its text is SVG already.
fn inline(svg: &Svg) -> Markup {
    PreEscaped(svg.finish(None))
}

fn file_name(photograph: &Photograph) -> String {
    photograph.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
