//! `report.html`: one file that holds everything, pictures too.

use super::files::{digits, flags};
use super::flip::mean_flip;
use super::report_plots::{convergence, profile_plot};
use super::{pictures, trade};
use crate::common;
use crate::common::figure::Svg;
use biscale::error::Result;
use biscale::formats::svg::png_url;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::photograph::image::Photograph;
use biscale_fit::run::{Options, Outcome};
use biscale_fit::verdict::validate::Verdict;
use maud::{Markup, PreEscaped, html};

const STYLE: &str = "img{image-rendering:pixelated;max-width:100%}\
.pass{background:#e3f4e1}.fail{background:#fbe3df}.open{background:#f4efdc}.verdict{padding:.6em 1em;border-radius:6px;font-size:1.1em}\
.flag{color:#a03010}";

/// The report.
pub fn page(spec: &Spec, options: &Options, outcome: &Outcome, compared: &[trade::Line]) -> Result<String> {
    let photographs = photographs(outcome)?;
    let body = html! {
        h1 { (spec.name) }
        (verdict(outcome))
        (photographs)
        (validation(outcome))
        (unknowns(outcome))
        (close_up(outcome))
        (search(options, outcome))
        (optimisers(compared))
        (notes(outcome))
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

fn photographs(outcome: &Outcome) -> Result<Markup> {
    let fitted = outcome.compared.iter().map(|c| (c, "fitted"));
    let held_out = outcome.validations.iter().map(|(_, c)| (c, "held out"));
    let mut shown = Vec::new();
    for (compared, role) in fitted.chain(held_out) {
        let png = pictures::panels(&[(&compared.photograph, &compared.picture.rgb)])?;
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
                "Everything held fixed, another light. It passes with at most 5 % and at most twice the training error; a light within 10 degrees \
                 of a fitted one proves nothing."
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
    let relative = |value: f64, sigma: f64| {
        if value == 0.0 || sigma.is_nan() { "-".to_owned() } else { format!("{:.1}", 100.0 * (sigma / value).abs()) }
    };
    html! {
        h2 { "What was found, and how well it is known" }
        table {
            tr { th { "unknown" } th.n { "value ± σ" } th.n { "%" } th.n { "bounds" } th { "remarks" } }
            @for known in &identified.known {
                tr {
                    td { (known.name) } td.n { (digits(known.value)) @if known.sigma.is_finite() { " ± " (digits(known.sigma)) } } td.n { (relative(known.value, known.sigma)) }
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

fn close_up(outcome: &Outcome) -> Markup {
    let Some(found) = &outcome.close_up else { return html! {} };
    html! {
        h2 { "The close-up" }
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
