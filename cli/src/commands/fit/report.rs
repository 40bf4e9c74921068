//! `report.html`: one file that holds everything, pictures too.

use super::files::{digits, flags};
use super::{pictures, trade};
use crate::commands::plot::svg::{Anchor, Stroke, Svg, base64, stroke};
use biscale::error::Result;
use biscale_fabricate::formats::svg::escape;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::photograph::image::Photograph;
use biscale_fit::run::{Options, Outcome};
use biscale_fit::search::{Entry, Stage};
use biscale_fit::uncertainty::profile::Profile;
use biscale_fit::verdict::validate::Verdict;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool, flip};
use std::fmt::Write as _;

const STYLE: &str = "body{font:15px/1.5 'DejaVu Sans',Verdana,Arial,sans-serif;max-width:62em;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;margin:.6em 0}td,th{padding:.15em .7em;border-bottom:1px solid #ddd;text-align:left}\
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}img{image-rendering:pixelated;max-width:100%}\
.pass{background:#e3f4e1}.fail{background:#fbe3df}.open{background:#f4efdc}.verdict{padding:.6em 1em;border-radius:6px;font-size:1.1em}\
.flag{color:#a03010}h2{margin-top:1.6em;border-bottom:1px solid #ccc}small{color:#666}";

/// The report.
pub fn html(spec: &Spec, options: &Options, outcome: &Outcome, compared: &[trade::Line]) -> Result<String> {
    let mut page = format!(
        "<!DOCTYPE html>\n<!-- made by biscale fit -->\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style>\n<h1>{0}</h1>\n",
        escape(&spec.name)
    );
    head(&mut page, outcome);
    page.push_str(
        "<h2>Photographs and fitted material</h2>\n<p>Left the photograph, in the middle the material as the same camera would see it, ",
    );
    let _ =
        writeln!(page, "right their difference times {} (black is none, yellow a third of white). Grey is left out.</p>", pictures::FACTOR);
    for (compared, name) in outcome.compared.iter().map(|c| (c, "fitted")).chain(outcome.validations.iter().map(|(_, c)| (c, "held out"))) {
        let png = pictures::panels(&[(&compared.photograph, &compared.picture.rgb)])?;
        let file = file_name(&compared.photograph);
        let _ = writeln!(
            page,
            "<p><b>{}</b>, {name}: relative RMS difference {:.2} % over directions, {:.2} % over pixels; &Delta;E ITP {:.2}; FLIP {:.3}<br>\
             <img alt=\"photograph, material, difference\" src=\"data:image/png;base64,{}\"></p>",
            escape(&file),
            100.0 * compared.relative_rms,
            100.0 * compared.pixel_relative_rms,
            compared.delta_e_itp,
            mean_flip(&compared.photograph, &compared.picture.rgb, &compared.used),
            base64(&png)
        );
    }
    validation(&mut page, outcome);
    unknowns(&mut page, outcome);
    close_up(&mut page, outcome);
    search(&mut page, options, outcome);
    if !compared.is_empty() {
        page.push_str("<h2>Optimisers and tolerances</h2>\n<table><tr><th>search<th class=n>evaluations<th class=n>of the winner<th class=n>objective<th class=n>training<th class=n>validation</tr>\n");
        for line in compared {
            let validation = line.validation.map_or("-".to_owned(), |v| format!("{:.2} %", 100.0 * v));
            let _ = writeln!(
                page,
                "<tr><td>{}<td class=n>{}<td class=n>{}<td class=n>{:.4}<td class=n>{:.2} %<td class=n>{validation}</tr>",
                line.what,
                line.evaluations,
                line.of_winner,
                line.objective,
                100.0 * line.training
            );
        }
        page.push_str("</table>\n");
    }
    if !outcome.notes.is_empty() {
        page.push_str("<h2>Notes</h2>\n<ul>\n");
        for note in &outcome.notes {
            let _ = writeln!(page, "<li>{}</li>", escape(note));
        }
        page.push_str("</ul>\n");
    }
    let _ = writeln!(page, "<p><small>biscale fit {}</small></p>\n</html>", env!("CARGO_PKG_VERSION"));
    Ok(page)
}

fn head(page: &mut String, outcome: &Outcome) {
    let (class, word) = match (outcome.failures.is_empty(), outcome.validations.is_empty()) {
        (false, _) => ("fail", "FAIL"),
        (true, true) => ("open", "Not validated"),
        (true, false) => ("pass", "PASS"),
    };
    let refused = outcome.validations.iter().all(|(v, _)| v.verdict == Verdict::Refused) && !outcome.validations.is_empty();
    let (class, word) = if refused && class == "pass" { ("open", "Not proved: the validation light is too near") } else { (class, word) };
    let _ = write!(page, "<p class=\"verdict {class}\"><b>{word}</b>. Training error {:.2} %", 100.0 * outcome.training);
    for (validation, _) in &outcome.validations {
        let _ = write!(page, ", validation error {:.2} %", 100.0 * validation.relative_rms);
    }
    page.push_str(".</p>\n");
    for failure in &outcome.failures {
        let _ = writeln!(page, "<p class=flag>{}</p>", escape(failure));
    }
}

fn validation(page: &mut String, outcome: &Outcome) {
    page.push_str("<h2>Validation</h2>\n");
    if outcome.validations.is_empty() {
        page.push_str("<p>No photograph was held out: how the material looks under another light is not tested.</p>\n");
        return;
    }
    page.push_str("<p>Everything frozen, another light. It passes with at most 5 % and at most twice the training error; a light within 10 degrees of a fitted one proves nothing.</p>\n");
    page.push_str("<table><tr><th>photograph<th>verdict<th class=n>error<th class=n>over training<th class=n>error of pixels<th class=n>&Delta;E ITP<th class=n>light away</tr>\n");
    for (v, _) in &outcome.validations {
        let _ = writeln!(
            page,
            "<tr><td>{}<td>{:?}<td class=n>{:.2} %<td class=n>{:.2}<td class=n>{:.2} %<td class=n>{:.2}<td class=n>{:.0}&deg;</tr>",
            escape(&v.photograph),
            v.verdict,
            100.0 * v.relative_rms,
            v.ratio,
            100.0 * v.pixel_relative_rms,
            v.delta_e_itp,
            v.angle_deg
        );
    }
    page.push_str("</table>\n");
}

fn unknowns(page: &mut String, outcome: &Outcome) {
    let identified = &outcome.identified;
    page.push_str("<h2>What was found, and how well it is known</h2>\n<table><tr><th>unknown<th class=n>value &plusmn; &sigma;<th class=n>%<th class=n>bounds<th>remarks</tr>\n");
    for known in &identified.known {
        let share = if known.value == 0.0 { "-".to_owned() } else { format!("{:.1}", 100.0 * (known.sigma / known.value).abs()) };
        let _ = writeln!(
            page,
            "<tr><td>{}<td class=n>{} &plusmn; {}<td class=n>{share}<td class=n>{} .. {}<td class=flag>{}</tr>",
            escape(&known.name),
            digits(known.value),
            digits(known.sigma),
            digits(known.bounds[0]),
            digits(known.bounds[1]),
            flags(known).join(", ")
        );
    }
    let _ = writeln!(
        page,
        "</table>\n<p>&chi;&sup2; per residual {:.2} over {:.0} independent residuals; condition number {:.0}. <i>Not identified</i>: &sigma; over 25 % of the range. \
         <i>Weak</i>: over 10 % of the value. <i>From the close-up</i>: the distant photographs alone do not tell it.</p>",
        identified.chi2, identified.residuals, identified.condition
    );
    if identified.correlations.is_empty() {
        page.push_str("<p>No two unknowns have a correlation over .9.</p>\n");
    } else {
        page.push_str("<table><tr><th>hardly told apart<th><th class=n>correlation</tr>\n");
        for c in &identified.correlations {
            let _ = writeln!(page, "<tr><td>{}<td>{}<td class=n>{:.3}</tr>", escape(&c.a), escape(&c.b), c.correlation);
        }
        page.push_str("</table>\n");
    }
    if !outcome.profiles.is_empty() {
        page.push_str("<p>Objective with one parameter held, for those that are known worst (all others answer):</p>\n<p>");
        for profile in &outcome.profiles {
            page.push_str(&inline(&profile_plot(profile)));
        }
        page.push_str("</p>\n");
    }
    for other in &outcome.several {
        page.push_str("<p class=flag>Fits as well:</p><table>");
        for (name, value) in other {
            let _ = writeln!(page, "<tr><td>{}<td class=n>{}</tr>", escape(name), digits(*value));
        }
        page.push_str("</table>\n");
    }
}

fn close_up(page: &mut String, outcome: &Outcome) {
    let Some(found) = &outcome.close_up else { return };
    page.push_str("<h2>The close-up</h2>\n<table>");
    for (axis, period) in ["x", "y"].iter().zip(&found.period) {
        let text = period.map_or("does not repeat".to_owned(), |p| {
            format!("{} &plusmn; {} (agreement {:.2})", digits(p.length), digits(p.sigma), p.agreement)
        });
        let _ = writeln!(page, "<tr><td>period along {axis}<td>{text}</tr>");
    }
    for (k, kind) in found.kinds.iter().enumerate() {
        let colour = kind.colour.map(digits).join(", ");
        let _ = writeln!(page, "<tr><td>kind {}<td>cover {:.1} %, mean radiance [{colour}]</tr>", k + 1, 100.0 * kind.cover);
    }
    page.push_str("</table>\n");
}

fn search(page: &mut String, options: &Options, outcome: &Outcome) {
    let _ = writeln!(
        page,
        "<h2>The search</h2>\n<p>{}, colours {}, seed {}: {} evaluations in all.</p>\n<p>{}</p>",
        options.optimiser.name(),
        if options.joint { "moved with the rest" } else { "solved for at every step" },
        options.seed,
        outcome.trace.len(),
        inline(&convergence(&outcome.trace))
    );
    page.push_str("<table><tr><th class=n>start<th class=n>objective<th class=n>evaluations<th class=n>restarts<th>ended</tr>\n");
    for start in &outcome.starts {
        let _ = writeln!(
            page,
            "<tr><td class=n>{}<td class=n>{}<td class=n>{}<td class=n>{}<td>{}</tr>",
            start.number,
            digits(start.objective),
            start.evaluations,
            start.restarts,
            if start.converged { "converged" } else { "early" }
        );
    }
    page.push_str("</table>\n");
}

fn inline(svg: &Svg) -> String {
    svg.finish(None)
}

const COLOURS: [&str; 8] = ["#1b6ca8", "#c44536", "#3a7d44", "#8e5ea2", "#c98a1b", "#3aa6a0", "#7a5230", "#555555"];
const GREY: &str = "#999999";

/// The best objective of each start so far, against its evaluations, all stages one after the other.
fn convergence(trace: &[Entry]) -> Svg {
    let (width, height) = (720.0, 300.0);
    let (left, right, top, bottom) = (60.0, 15.0, 15.0, 40.0);
    let mut svg = Svg::new(width, height);
    let starts = trace.iter().map(|e| e.start + 1).max().unwrap_or(0);
    let of = |start: usize| {
        let mut best = f64::INFINITY;
        let mut stage = Stage::Explore;
        let mut line = Vec::new();
        for entry in trace.iter().filter(|e| e.start == start) {
            // A finer model has an objective of its own.
            if entry.stage != stage {
                (stage, best) = (entry.stage, f64::INFINITY);
            }
            best = best.min(entry.objective);
            line.push(best);
        }
        line
    };
    let lines: Vec<Vec<f64>> = (0..starts).map(of).collect();
    let finite = || lines.iter().flatten().copied().filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
    let longest = lines.iter().map(Vec::len).max().unwrap_or(1).max(2);
    if !(high > 0.0 && low.is_finite()) {
        return svg;
    }
    let (low, high) = (low.log10().floor(), high.log10().ceil().max(low.log10().floor() + 1.0));
    let x = |k: f64| left + (width - left - right) * k / (longest - 1) as f64;
    let y = |v: f64| top + (height - top - bottom) * (high - v.log10()) / (high - low);
    let dashed = Stroke { colour: "#dddddd", width: 1.0, dashes: "" };
    let mut decade = low;
    while decade <= high {
        let at = y(10_f64.powf(decade));
        svg.line([left, at], [width - right, at], dashed);
        svg.text([left - 6.0, at + 4.0], 11.0, Anchor::End, "#444444", &digits(10_f64.powf(decade)));
        decade += 1.0;
    }
    for k in 0..=4 {
        let at = (longest - 1) as f64 * f64::from(k) / 4.0;
        svg.text([x(at), height - bottom + 16.0], 11.0, Anchor::Middle, "#444444", &format!("{at:.0}"));
    }
    svg.text([0.5 * (left + width - right), height - 6.0], 12.0, Anchor::Middle, "#222222", "evaluations of a start");
    svg.text([left + 8.0, top + 14.0], 12.0, Anchor::Start, "#222222", "objective (mean squared residual), best so far");
    for (k, line) in lines.iter().enumerate() {
        let points: Vec<[f64; 2]> = line.iter().enumerate().filter(|(_, v)| v.is_finite()).map(|(i, v)| [x(i as f64), y(*v)]).collect();
        if points.len() > 1 {
            svg.path(&points, stroke(COLOURS[k % COLOURS.len()], 1.4));
        }
    }
    svg
}

/// One profile.
fn profile_plot(profile: &Profile) -> Svg {
    let (width, height) = (235.0, 170.0);
    let (left, right, top, bottom) = (48.0, 10.0, 24.0, 26.0);
    let mut svg = Svg::new(width, height);
    svg.text([0.5 * width, 15.0], 11.0, Anchor::Middle, "#222222", &profile.name);
    let span = |k: usize| {
        let values = profile.points.iter().map(|p| p[k]);
        (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max))
    };
    let ((x0, x1), (y0, y1)) = (span(0), span(1));
    if profile.points.len() < 2 || x1 <= x0 {
        return svg;
    }
    let y1 = y1.max(y0 * 1.02);
    let place =
        |p: &[f64; 2]| [left + (width - left - right) * (p[0] - x0) / (x1 - x0), top + (height - top - bottom) * (y1 - p[1]) / (y1 - y0)];
    svg.rectangle([left, top], [width - left - right, height - top - bottom], "none", GREY);
    for (value, anchor, at) in [(x0, Anchor::Start, left), (x1, Anchor::End, width - right)] {
        svg.text([at, height - bottom + 14.0], 10.0, anchor, "#444444", &digits(value));
    }
    for (value, at) in [(y1, top + 8.0), (y0, height - bottom)] {
        svg.text([left - 4.0, at], 10.0, Anchor::End, "#444444", &digits(value));
    }
    let points: Vec<[f64; 2]> = profile.points.iter().map(place).collect();
    svg.path(&points, stroke(COLOURS[0], 1.6));
    for [x, y] in points {
        svg.rectangle([x - 2.0, y - 2.0], [4.0, 4.0], COLOURS[0], COLOURS[0]);
    }
    svg
}

fn file_name(photograph: &Photograph) -> String {
    photograph.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Mean FLIP of the pixels that are compared, both as a screen would show them; the others are black in both.
fn mean_flip(photograph: &Photograph, picture: &[[f32; 3]], used: &[u32]) -> f64 {
    let (width, height) = (photograph.image.width, photograph.image.height);
    let largest = used.iter().flat_map(|&p| photograph.image.rgb[p as usize]).fold(0.0, f32::max);
    let image = |rgb: &[[f32; 3]]| {
        let mut bytes = vec![0_u8; 3 * rgb.len()];
        for &pixel in used {
            for c in 0..3 {
                let share = biscale::render::picture::linear_to_srgb(f64::from(rgb[pixel as usize][c] / largest.max(f32::MIN_POSITIVE)));
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "linear_to_srgb gives 0..=1")]
                {
                    bytes[3 * pixel as usize + c] = (255.0 * share).round() as u8;
                }
            }
        }
        FlipImageRgb8::with_data(width, height, &bytes)
    };
    let errors = flip(image(&photograph.image.rgb), image(picture), DEFAULT_PIXELS_PER_DEGREE);
    let share = used.len() as f64 / f64::from(width * height);
    f64::from(FlipPool::from_image(&errors).mean()) / share.max(1e-9)
}
