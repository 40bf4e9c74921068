//! Tables and figures of `report.html`.

use super::axes::{percent, seconds, significant};
use super::folder::Folder;
use super::pictures::StudyPicture;
use super::points::Point;
use crate::common::figure::Svg;
use biscale::error::{Error, Result};
use biscale::formats::svg::png_url;
use biscale::numerics::cast::truncate_usize;
use maud::{Markup, PreEscaped, Render, html};
use std::fmt::Display;

/// A table of `rows` under `headings`.
pub fn table<const N: usize>(headings: [&str; N], rows: impl IntoIterator<Item = [Markup; N]>) -> Markup {
    html! {
        table {
            tr { @for heading in headings { th { (heading) } } }
            @for row in rows { tr { @for cell in &row { td { (cell) } } } }
        }
    }
}

/// A cell of words or numbers.
pub fn cell(content: impl Render) -> Markup {
    html! { (content) }
}

/// A cell of what can be typed.
pub fn code(content: impl Display) -> Markup {
    html! { code { (content) } }
}

/// A cell of what need not be there.
pub fn or_dash(content: Option<String>) -> Markup {
    cell(content.unwrap_or("-".to_owned()))
}

/// A PSNR.
pub fn decibel(psnr_db: Option<f64>) -> Markup {
    or_dash(psnr_db.map(|db| format!("{db:.1} dB")))
}

/// The largest memory of a setting.
pub fn memory(point: &Point) -> Markup {
    or_dash(point.peak_mib.map(|mib| format!("{mib:.0} MiB")))
}

/// The error, or its bound.
pub fn error(point: &Point) -> String {
    if point.is_resolved() { percent(point.error) } else { format!("< {}", percent(point.at_most)) }
}

/// A plot within the page: its text is SVG already.
pub fn plot(svg: &Svg) -> Markup {
    html! { p { (PreEscaped(svg.finish(None))) } }
}

/// Sizes, ranks and energies of the low-rank method's matrices, after Table 3 and Fig. 11 of the paper.
pub fn ranks(points: &[Point], chart: Option<&Svg>) -> Markup {
    let all: Vec<&Point> = points.iter().filter(|p| !p.low_rank.is_empty()).collect();
    // The matrices of the largest question; where only facets differ they have the same sizes.
    let Some(asked) = all.iter().map(|p| p.asked).max() else { return html! {} };
    let mut with: Vec<&Point> = Vec::new();
    let sizes = |p: &Point| -> Vec<_> { p.low_rank.iter().map(|f| (f.n_rank, f.m_size, f.m_rank)).collect() };
    for p in all.into_iter().filter(|p| p.asked == asked) {
        if !with.iter().any(|shown| sizes(shown) == sizes(p)) {
            with.push(p);
        }
    }
    let headings = [
        "question",
        "setting",
        "surface",
        "N",
        "rank",
        "kept",
        "M",
        "whole M",
        "compressed",
        "rate",
        "rank",
        "kept",
        "precomputation",
        "error",
    ];
    html! {
        h2 { "Ranks and the energy kept" }
        p {
            "After Table 3 and Fig. 11 of Wu et al. (2011). " code { "N" } " is the bidirectional visible normal distribution, " code { "M" } " the turned \
             BRDFs of one surface; " i { "kept" } " is the share of the power of the centred matrix. In " code { "paper" } " the rows are pairs of map cells and "
            code { "M" } " is computed once a BRDF (" i { "precomputation" } ", CPU, not in the other costs); in " code { "improved" } " they are the wanted pairs, three rows of "
            code { "M" } " each. Of settings with the same ranks the first is shown."
        }
        @if let Some(chart) = chart { (plot(chart)) }
        (table(headings, with.into_iter().flat_map(ranks_of)))
    }
}

/// A row for each surface.
fn ranks_of(p: &Point) -> Vec<[Markup; 14]> {
    let size = |[rows, columns]: [usize; 2]| cell(format!("{rows} x {columns}"));
    let megabytes = |bytes: f64| cell(format!("{} MB", significant(bytes / 1e6)));
    let row = |(k, f): (usize, &biscale::filter::LowRankFacts)| {
        let whole = 8.0 * f.m_size[0] as f64 * f.m_size[1] as f64;
        let once = |text: Option<String>| cell(text.filter(|_| k == 0).unwrap_or_default());
        [
            cell(p.asked.name()),
            code(p.work.to_string()),
            cell(f.surface + 1),
            size(f.n_size),
            cell(f.n_rank),
            cell(share(f.n_energy)),
            size(f.m_size),
            megabytes(whole),
            megabytes(f.m_bytes as f64),
            cell(format!("{:.0} : 1", whole / (f.m_bytes as f64).max(1.0))),
            cell(f.m_rank),
            cell(share(f.m_energy)),
            once(p.precomputed_s.map(seconds)),
            once(Some(error(p))),
        ]
    };
    p.low_rank.iter().enumerate().map(row).collect()
}

/// A share near 1: as many digits as what is lacking needs.
fn share(kept: f64) -> String {
    const ALL_BUT: f64 = 1e-6;
    if 1.0 - kept < ALL_BUT {
        return "> 99.9999 %".to_owned();
    }
    let decimals = truncate_usize((-(1.0 - kept).max(ALL_BUT).log10()).clamp(1.0, 6.0));
    format!("{:.decimals$} %", 100.0 * kept)
}

/// Pictures and their differences, after Fig. 11 and 12 of the paper.
///
/// # Errors
/// I/o: a comparison in `folder` that cannot be read.
pub fn rendered(pictures: &[StudyPicture], folder: &Folder) -> Result<Markup> {
    if pictures.is_empty() {
        return Ok(html! {});
    }
    let mut panels = Vec::new();
    for (p, name) in pictures.iter().filter_map(|p| Some((p, p.panels.as_ref()?))) {
        let path = folder.path(name);
        let png = std::fs::read(&path).map_err(|source| Error::Io { action: "read", path, source })?;
        let (scene, name, against) = (p.scene, p.name, p.against);
        panels.push(html! { p { (scene) ", " (name) " against " (against) ":" br; img alt={ (against) ", " (name) ", difference" } src=(png_url(&png)); } });
    }
    let headings = ["picture", "stated", "wall", "against", "PSNR", "relative RMS", "FLIP"];
    Ok(html! {
        h2 { "Pictures" }
        p {
            "A sphere and a ring in the material, in two directional lights (" code { "pictures/*.toml" } "), after Fig. 11 and 12 of Wu et al. (2011): a \
             picture, another one, and three times their difference, colour-coded. " i { "Stated" } " is the error that " code { "render" } " states for itself. PSNR \
             and relative RMS are those of linear values, FLIP (Andersson et al. 2020) of what a screen is sent. Against " code { "interreflections" } " stands "
            code { "reference" } " without them: there the difference is between two models."
        }
        (table(headings, pictures.iter().map(picture_row)))
        @for panel in &panels { (panel) }
    })
}

fn picture_row(p: &StudyPicture) -> [Markup; 7] {
    let name = cell(format!("{} {}", p.scene, p.name));
    if let Some(problem) = &p.problem {
        let none = || cell("");
        return [name, cell(problem), none(), none(), none(), none(), none()];
    }
    // Equal pictures have no finite PSNR.
    let psnr = if p.relative_rms == Some(0.0) { cell("equal") } else { decibel(p.psnr_db) };
    let [stated, rms] = [p.stated, p.relative_rms].map(|x| or_dash(x.map(percent)));
    [name, stated, or_dash(p.seconds.map(seconds)), cell(p.against), psnr, rms, or_dash(p.flip.map(|f| format!("{f:.4}")))]
}
