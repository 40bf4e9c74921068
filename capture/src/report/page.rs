//! The page: its sections in the order of the work.

use super::sections;
use super::text::{counted, jpeg_address};
use super::view::{PhotoView, figure, thumbnail};
use crate::checks::CATALOGUE;
use crate::photo::PlanarImage;
use biscale::error::{Error, Result};
use biscale::formats::capture::{Capture, Severity};
use glam::DVec2;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::path::Path;

/// What the report gathers beside `capture.json`.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The photographs.
    pub views: Vec<PhotoView>,
    /// Corners that the calibration used, px.
    pub corners: Vec<DVec2>,
    /// Patches of the checker: corrected and of the maker, linear.
    pub patches: Vec<([f64; 3], [f64; 3])>,
    /// What the close-up's weave is, line by line.
    pub weave: Vec<(String, String)>,
    /// Lines of the weave's repeat over the rectified close-up, px.
    pub grid: Vec<[DVec2; 2]>,
    close_up: Option<CloseUpImage>,
}

/// The rectified close-up.
#[derive(Clone, Debug)]
struct CloseUpImage {
    jpeg: Vec<u8>,
    mm_per_px: Option<f64>,
    size: (usize, usize),
}

const STYLE: &str = "\
body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222;background:#fff}\
h1{font-size:1.6em}h2{margin-top:2em;border-bottom:1px solid #ccc}\
table{border-collapse:collapse;margin:.7em 0}td,th{padding:.2em .8em .2em 0;text-align:left;vertical-align:top}th{font-weight:600}\
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}\
.ok{color:#1a7f37}.warn{color:#9a6700;font-weight:600}.fail{color:#c00;font-weight:700}\
.views{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));gap:1.2em}\
figure{margin:0}figure svg{width:100%;height:auto;display:block;background:#eee}figcaption{font-size:.85em;margin-top:.3em}\
figcaption b{font-size:1.1em}.large{grid-column:1/-1}\
.marker{fill:none;stroke:#00d0ff}.sample{fill:none;stroke:#ffb000}.patch{fill:none;stroke:#fff}.ball{fill:none;stroke:#00ff60}\
.grid{stroke:#ffe000;fill:none;opacity:.6}.cross{stroke:#ff3030;fill:none}\
svg:not(.plain) *{vector-effect:non-scaling-stroke;stroke-width:1.5}\
";

/// Roles of photographs in the order of the page: what a fit reads first.
const ROLES: [&str; 7] = ["close-up", "distant", "validation", "light", "checker", "flat", "board"];
/// Those that are shown over the whole width.
const LARGE_ROLES: [&str; 3] = ["close-up", "distant", "validation"];

impl Report {
    /// Keeps the rectified close-up.
    pub fn close_up(&mut self, picture: &PlanarImage, mm_per_px: Option<f64>) {
        self.close_up = Some(CloseUpImage { jpeg: thumbnail(picture, None, false), mm_per_px, size: (picture.width, picture.height) });
    }

    /// Writes `report.html` into a folder.
    ///
    /// # Errors
    /// I/o.
    pub fn write(&self, capture: &Capture, folder: &Path) -> Result<()> {
        let path = folder.join("report.html");
        std::fs::write(&path, self.html(capture).into_string()).map_err(|source| Error::Io { action: "write", path, source })
    }

    fn html(&self, capture: &Capture) -> Markup {
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width";
                    title { (capture.name) ": capture" }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (capture.name) }
                    (verdict(capture))
                    (sections::checks(&capture.checks))
                    (sections::camera(capture, &self.corners))
                    (sections::flat_field(capture))
                    (sections::colour(capture, &self.patches))
                    (sections::lights(capture))
                    (sections::sample(capture))
                    (self.close_up_section(capture))
                    (self.photographs(capture))
                    h2 { "What the checks mean" }
                    table { @for (_, name, about) in CATALOGUE { tr { td { code { (name) } } td { (about) } } } }
                    p { (capture.creator) }
                }
            }
        }
    }

    fn photographs(&self, capture: &Capture) -> Markup {
        let of_role = |role: &str| self.views.iter().filter(|v| v.role == role).collect::<Vec<_>>();
        html! {
            h2 { "Photographs" }
            p { "Magenta: saturated. Blue: markers. Red: corners, highlight, shadow. Yellow: outline of the sample." }
            @for (role, views) in ROLES.map(|role| (role, of_role(role))) {
                @if !views.is_empty() {
                    h3 { (role) }
                    div class="views" { @for view in views { (figure(view, &capture.checks, LARGE_ROLES.contains(&role))) } }
                }
            }
        }
    }

    fn close_up_section(&self, capture: &Capture) -> Markup {
        let Some(CloseUpImage { jpeg, mm_per_px, size: (w, h) }) = &self.close_up else { return Markup::default() };
        let size =
            mm_per_px.map_or(format!("{w} px wide, of unknown size"), |mm| format!("{:.2} mm wide, {mm:.5} mm a pixel", mm * *w as f64));
        let weave = capture.close_up.as_ref().and_then(|c| c.weave.as_ref());
        let draft = weave.and_then(|w| w["draft"].as_array()).map(|rows| rows.iter().filter_map(|r| r.as_str()).collect::<Vec<_>>());
        html! {
            h2 { "Close-up, straight on" }
            figure class="large" {
                svg viewBox={ "0 0 " (w) " " (h) } {
                    image href=(jpeg_address(jpeg)) width=(w) height=(h) preserveAspectRatio="none" {}
                    @for [a, b] in &self.grid { path class="grid" d=(format!("M{:.1} {:.1}L{:.1} {:.1}", a.x, a.y, b.x, b.y)) {} }
                }
                figcaption { (size) @if !self.grid.is_empty() { "; the lines are one repeat apart" } }
            }
            @if !self.weave.is_empty() { table { @for (name, value) in &self.weave { tr { td { (name) } td { (value) } } } } }
            @if let Some(rows) = draft { (draft_picture(&rows)) }
        }
    }
}

/// One repeat of a draft, its highest row first.
fn draft_picture(rows: &[&str]) -> Markup {
    /// Side of a crossing, and width of the whole at most, px.
    const CELL: usize = 24;
    const WIDEST: usize = 400;
    let columns = rows.first().map_or(1, |r| r.len());
    html! {
        svg class="plain" viewBox={ "0 0 " (columns) " " (rows.len()) } width=((CELL * columns).min(WIDEST)) style="max-width:100%" {
            @for (j, row) in rows.iter().enumerate() {
                @for (i, cell) in row.chars().enumerate() {
                    rect x=(i) y=(j) width="1" height="1" fill=(if cell == '1' { "#333" } else { "#fff" }) stroke="#888" stroke-width=".04" {}
                }
            }
        }
        p { "One repeat; dark: the warp lies on top." }
    }
}

fn verdict(capture: &Capture) -> Markup {
    let count = |s: Severity| capture.checks.iter().filter(|c| c.severity == s).count();
    let (fail, warn, ok) = (count(Severity::Fail), count(Severity::Warn), count(Severity::Ok));
    html! {
        p {
            (counted(capture.photographs.len(), "photograph", "photographs")) " of " (capture.shoot) "; "
            (counted(ok, "check passed", "checks passed")) "."
        }
        @if fail > 0 {
            p class="fail" { (counted(fail, "check failed", "checks failed")) ": what rests on them is missing or wrong." }
        } @else if warn > 0 {
            p class="warn" { "Usable, with " (counted(warn, "warning", "warnings")) "." }
        } @else {
            p class="ok" { "Usable." }
        }
    }
}
