//! `report.html`: every photograph with what was found in it, every number, every check. One file that needs no other.

mod view;

pub use view::{Mark, PhotoView};

use self::view::{figure, image, thumbnail};
use crate::checks::CATALOGUE;
use crate::photo::PlanarImage;
use biscale::error::{Error, Result};
use biscale::formats::capture::{Capture, Check, Sample, Severity};
use biscale::render::picture::linear_to_srgb;
use glam::DVec2;
use std::fmt::Write as _;
use std::path::Path;

/// What the report gathers beside `capture.json`.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The photographs.
    pub views: Vec<PhotoView>,
    /// Corners that the calibration used, px.
    pub corners: Vec<DVec2>,
    /// Patches of the checker: corrected and wanted, linear.
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

/// Text for HTML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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
svg *{vector-effect:non-scaling-stroke;stroke-width:1.5}svg.plain *{vector-effect:none}\
";

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
        std::fs::write(&path, self.html(capture)).map_err(|source| Error::Io { action: "write", path, source })
    }

    fn html(&self, capture: &Capture) -> String {
        let mut out = String::new();
        let title = escape(&capture.name);
        let _ = write!(
            out,
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\"><title>{title}: \
             capture</title><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n"
        );
        verdict(&mut out, capture);
        checks(&mut out, &capture.checks);
        camera(&mut out, capture, &self.corners);
        flat_field(&mut out, capture);
        colour(&mut out, capture, &self.patches);
        lights(&mut out, capture);
        sample(&mut out, capture);
        self.close_up_section(&mut out, capture);
        out.push_str("<h2>Photographs</h2>\n<p>Magenta: saturated. Blue: markers. Red: corners, highlight, shadow. Yellow: outline of the sample.</p>\n");
        for role in ["close-up", "distant", "validation", "light", "checker", "flat", "board"] {
            let views: Vec<&PhotoView> = self.views.iter().filter(|v| v.role == role).collect();
            if views.is_empty() {
                continue;
            }
            let _ = writeln!(out, "<h3>{role}</h3>\n<div class=\"views\">");
            for view in views {
                figure(&mut out, view, &capture.checks, matches!(role, "close-up" | "distant" | "validation"));
            }
            out.push_str("</div>\n");
        }
        out.push_str("<h2>What the checks mean</h2>\n<table>\n");
        for (_, name, about) in CATALOGUE {
            let _ = writeln!(out, "<tr><td><code>{name}</code></td><td>{about}</td></tr>");
        }
        let _ = writeln!(out, "</table>\n<p>{}</p>\n</body></html>", escape(&capture.creator));
        out
    }

    fn close_up_section(&self, out: &mut String, capture: &Capture) {
        let Some(CloseUpImage { jpeg, mm_per_px, size: (w, h) }) = &self.close_up else { return };
        let size =
            mm_per_px.map_or(format!("{w} px wide, of unknown size"), |mm| format!("{:.2} mm wide, {mm:.5} mm a pixel", mm * *w as f64));
        let _ = write!(
            out,
            "<h2>Close-up, straight on</h2>\n<figure class=\"large\"><svg viewBox=\"0 0 {w} {h}\"><image href=\"{}\" width=\"{w}\" height=\"{h}\" \
             preserveAspectRatio=\"none\"/>",
            image(jpeg)
        );
        for [a, b] in &self.grid {
            let _ = write!(out, "<path class=\"grid\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>", a.x, a.y, b.x, b.y);
        }
        let lines = if self.grid.is_empty() { "" } else { "; the lines are one repeat apart" };
        let _ = writeln!(out, "</svg><figcaption>{size}{lines}</figcaption></figure>");
        if !self.weave.is_empty() {
            out.push_str("<table>\n");
            for (name, value) in &self.weave {
                let _ = writeln!(out, "<tr><td>{}</td><td>{}</td></tr>", escape(name), escape(value));
            }
            out.push_str("</table>\n");
        }
        let draft = capture.close_up.as_ref().and_then(|c| c.weave.as_ref()).and_then(|w| w["draft"].as_array());
        if let Some(rows) = draft {
            let rows: Vec<&str> = rows.iter().filter_map(|r| r.as_str()).collect();
            let (columns, count) = (rows.first().map_or(1, |r| r.len()), rows.len());
            let _ = write!(
                out,
                "<svg class=\"plain\" viewBox=\"0 0 {columns} {count}\" width=\"{}\" style=\"max-width:100%\">",
                (24 * columns).min(400)
            );
            for (j, row) in rows.iter().enumerate() {
                for (i, cell) in row.chars().enumerate() {
                    let fill = if cell == '1' { "#333" } else { "#fff" };
                    let _ = write!(
                        out,
                        "<rect x=\"{i}\" y=\"{j}\" width=\"1\" height=\"1\" fill=\"{fill}\" stroke=\"#888\" stroke-width=\".04\"/>"
                    );
                }
            }
            out.push_str("</svg>\n<p>One repeat; dark: the warp lies on top.</p>\n");
        }
    }
}

fn verdict(out: &mut String, capture: &Capture) {
    let count = |s: Severity| capture.checks.iter().filter(|c| c.severity == s).count();
    let (fail, warn, ok) = (count(Severity::Fail), count(Severity::Warn), count(Severity::Ok));
    let text = if fail > 0 {
        format!("<p class=\"fail\">{}: what rests on them is missing or wrong.</p>", counted(fail, "check failed", "checks failed"))
    } else if warn > 0 {
        format!("<p class=\"warn\">Usable, with {}.</p>", counted(warn, "warning", "warnings"))
    } else {
        "<p class=\"ok\">Usable.</p>".to_owned()
    };
    let photographs = counted(capture.photographs.len(), "photograph", "photographs");
    let passed = counted(ok, "check passed", "checks passed");
    let _ = writeln!(out, "<p>{photographs} of {}; {passed}.</p>\n{text}", escape(&capture.shoot));
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Ok => "ok",
        Severity::Warn => "warn",
        Severity::Fail => "fail",
    }
}

fn checks(out: &mut String, checks: &[Check]) {
    let mut sorted: Vec<&Check> = checks.iter().collect();
    sorted.sort_by_key(|c| std::cmp::Reverse(c.severity));
    const HEAD: &str = "<tr><th></th><th>code</th><th>photograph</th><th></th><th>measured</th><th>limit</th><th>unit</th></tr>\n";
    let (good, told): (Vec<&Check>, Vec<&Check>) = sorted.into_iter().partition(|c| c.severity == Severity::Ok);
    let table = |out: &mut String, rows: &[&Check]| {
        let _ = write!(out, "<table>{HEAD}");
        for c in rows {
            let (s, number) = (word(c.severity), |v: Option<f64>| v.map_or(String::new(), digits));
            let _ = writeln!(
                out,
                "<tr><td class=\"{s}\">{s}</td><td><code>{}</code></td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>",
                c.code,
                escape(c.photograph.as_deref().unwrap_or("")),
                escape(&c.message),
                number(c.measured),
                number(c.threshold),
                escape(&c.unit)
            );
        }
        out.push_str("</table>\n");
    };
    out.push_str("<h2>Checks</h2>\n");
    if !told.is_empty() {
        table(out, &told);
    }
    if !good.is_empty() {
        // What passed is there for those who look for it.
        let _ = writeln!(out, "<details><summary>{}</summary>", counted(good.len(), "check passed", "checks passed"));
        table(out, &good);
        out.push_str("</details>\n");
    }
}

/// A number and its noun.
fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// A number with four significant digits.
fn digits(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let size = v.abs().log10().floor();
    if !(-4.0..6.0).contains(&size) {
        return format!("{v:.3e}");
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 7")]
    let decimals = (3.0 - size).clamp(0.0, 7.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn camera(out: &mut String, capture: &Capture, corners: &[DVec2]) {
    let Some(camera) = &capture.camera else { return };
    let _ = writeln!(
        out,
        "<h2>Camera</h2>\n<p>{} x {} pixels, {}.</p>\n<table><tr><th></th><th>value</th><th>standard deviation</th><th></th></tr>",
        camera.width, camera.height, camera.source
    );
    let names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
    let values = [camera.fx, camera.fy, camera.cx, camera.cy].into_iter().chain(camera.distortion);
    for (k, (name, value)) in names.iter().zip(values).enumerate() {
        let sigma = camera.sigma.map_or(String::new(), |s| digits(s[k]));
        let unit = if k < 4 { "px" } else { "" };
        let _ = writeln!(out, "<tr><td>{name}</td><td class=\"n\">{}</td><td class=\"n\">{sigma}</td><td>{unit}</td></tr>", digits(value));
    }
    out.push_str("</table>\n");
    if let Some(rms) = camera.rms_px {
        let dropped = if camera.dropped.is_empty() { String::new() } else { format!("; left out: {}", escape(&camera.dropped.join(", "))) };
        let _ = writeln!(out, "<p>{} views, reprojection error {rms:.3} px RMS{dropped}.</p>", camera.views);
    }
    if !corners.is_empty() {
        let (w, h) = (camera.width, camera.height);
        let _ = write!(out, "<figure style=\"max-width:420px\"><svg class=\"plain\" viewBox=\"0 0 {w} {h}\">");
        for k in 1..10 {
            let (x, y) = (f64::from(w * k) / 10.0, f64::from(h * k) / 10.0);
            let _ =
                write!(out, "<path d=\"M{x} 0V{h}M0 {y}H{w}\" stroke=\"#bbb\" stroke-width=\"{}\" fill=\"none\"/>", f64::from(w) / 800.0);
        }
        for c in corners {
            let _ = write!(
                out,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.1}\" fill=\"#0070c0\" stroke=\"none\"/>",
                c.x,
                c.y,
                f64::from(w) / 300.0
            );
        }
        let coverage = camera.coverage.map_or(String::new(), |c| format!("{:.0} % of a 10 x 10 grid", 100.0 * c));
        let _ = writeln!(out, "</svg><figcaption>All corners in the picture: {coverage}.</figcaption></figure>");
    }
}

fn flat_field(out: &mut String, capture: &Capture) {
    let Some(flat) = &capture.flat_field else { return };
    let [b, c, d] = flat.radial;
    let v = |r: f64| 1.0 + b * r.powi(2) + c * r.powi(4) + d * r.powi(6);
    let path: String =
        (0..=60).map(|k| f64::from(k) / 60.0).map(|r| format!("{:.1},{:.1} ", 40.0 + 300.0 * r, 170.0 - 150.0 * v(r))).collect();
    let _ = writeln!(
        out,
        "<h2>Falloff to the corners</h2>\n<p>V(r) = 1 {b:+.4} r² {c:+.4} r⁴ {d:+.4} r⁶, r = 1 in the farthest corner; darkest {:.3}; what is left: {:.2} % RMS. \
         Taken out by {}.</p>\n<svg class=\"plain\" viewBox=\"0 0 360 200\" width=\"420\"><path d=\"M40 20V170H340\" fill=\"none\" stroke=\"#888\"/>\
         <polyline points=\"{path}\" fill=\"none\" stroke=\"#0070c0\" stroke-width=\"2\"/><text x=\"5\" y=\"25\" font-size=\"13\">1</text>\
         <text x=\"5\" y=\"175\" font-size=\"13\">0</text><text x=\"330\" y=\"190\" font-size=\"13\">r = 1</text></svg>",
        flat.darkest,
        100.0 * flat.residual,
        if flat.method == "divide" { "the photograph itself, smoothed" } else { "this curve" }
    );
}

fn css(rgb: [f64; 3]) -> String {
    let c = rgb.map(|v| (255.0 * linear_to_srgb(v)).round());
    format!("rgb({},{},{})", c[0], c[1], c[2])
}

fn colour(out: &mut String, capture: &Capture, patches: &[([f64; 3], [f64; 3])]) {
    let Some(colour) = &capture.colour else { return };
    let _ = writeln!(
        out,
        "<h2>Colour</h2>\n<p>Matrix from the {}, camera to linear Rec. 709; mean Delta E 2000 {:.2}.</p>\n<table>",
        colour.source, colour.mean_delta_e
    );
    for row in colour.matrix {
        let _ = writeln!(out, "<tr>{}</tr>", row.map(|v| format!("<td class=\"n\">{}</td>", digits(v))).concat());
    }
    out.push_str("</table>\n");
    if !patches.is_empty() {
        out.push_str("<svg class=\"plain\" viewBox=\"0 0 600 400\" width=\"600\">");
        for (k, (seen, wanted)) in patches.iter().enumerate() {
            let (x, y) = ((k % 6) * 100, (k / 6) * 100);
            let delta = colour.delta_e.get(k).copied().unwrap_or(f64::NAN);
            let ink = if wanted[1] > 0.2 { "#000" } else { "#fff" };
            let _ = write!(
                out,
                "<rect x=\"{x}\" y=\"{y}\" width=\"96\" height=\"96\" fill=\"{}\"/><rect x=\"{}\" y=\"{}\" width=\"48\" height=\"48\" fill=\"{}\"/>\
                 <text x=\"{}\" y=\"{}\" font-size=\"14\" fill=\"{ink}\">{delta:.1}</text>",
                css(*wanted),
                x + 24,
                y + 24,
                css(*seen),
                x + 6,
                y + 90
            );
        }
        out.push_str("</svg><p>Outside: the maker's value; inside: this photograph, corrected; the number is their Delta E 2000.</p>\n");
    }
}

fn lights(out: &mut String, capture: &Capture) {
    if capture.lights.is_empty() {
        return;
    }
    out.push_str("<h2>Lights</h2>\n<table><tr><th>light</th><th>from</th><th>photograph</th><th>towards it, in the sample's frame</th><th>standard deviation</th></tr>\n");
    let direction = |d: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", d[0], d[1], d[2]);
    for light in &capture.lights {
        for s in &light.sources {
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{:.2} degrees</td></tr>",
                escape(&light.name),
                s.kind,
                escape(s.photograph.as_deref().unwrap_or("")),
                direction(s.direction),
                s.sigma_deg
            );
        }
        let apart = light.disagreement_deg.map_or(String::new(), |d| format!("; sources are {d:.2} degrees apart"));
        let bright = light.irradiance_rgb.map_or(String::new(), |e| format!("; irradiance {}", digits(e[1])));
        let _ = writeln!(
            out,
            "<tr><td><b>{}</b></td><td><b>together</b></td><td></td><td><b>{}</b>{apart}{bright}</td><td class=\"n\"><b>{:.2} degrees</b></td></tr>",
            escape(&light.name),
            direction(light.direction),
            light.sigma_deg
        );
    }
    out.push_str("</table>\n");
}

fn sample(out: &mut String, capture: &Capture) {
    let text = match capture.sample {
        Sample::Plane { width_mm, height_mm } => format!("A plane of {} x {} mm.", digits(width_mm), digits(height_mm)),
        Sample::Cylinder { radius_mm, height_mm, .. } => {
            format!("A cylinder of radius {} mm, {} mm high.", digits(radius_mm), digits(height_mm))
        }
    };
    let _ = writeln!(out, "<h2>Sample</h2>\n<p>{text}</p>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (v, text) in [(0.0, "0"), (535.915_7, "535.9"), (-0.266_37, "-0.2664"), (1e-9, "1.000e-9"), (12_345.6, "12346"), (2.0, "2")] {
            assert_eq!(digits(v), text);
        }
    }
}
