//! What `capture.json` says, section by section.

use super::text::{counted, css, digits, word};
use biscale::formats::capture::{Camera, Capture, Check, Light, Sample, Severity};
use glam::DVec2;
use maud::{Markup, html};

/// The checks: first what is wrong, the worst first; what passed is there for those who look for it.
pub(super) fn checks(checks: &[Check]) -> Markup {
    let mut sorted: Vec<&Check> = checks.iter().collect();
    sorted.sort_by_key(|c| std::cmp::Reverse(c.severity));
    let (good, told): (Vec<&Check>, Vec<&Check>) = sorted.into_iter().partition(|c| c.severity == Severity::Ok);
    html! {
        h2 { "Checks" }
        @if !told.is_empty() { (check_table(&told)) }
        @if !good.is_empty() {
            details {
                summary { (counted(good.len(), "check passed", "checks passed")) }
                (check_table(&good))
            }
        }
    }
}

fn check_table(rows: &[&Check]) -> Markup {
    html! {
        table {
            tr { th {} th { "code" } th { "photograph" } th {} th { "measured" } th { "limit" } th { "unit" } }
            @for c in rows {
                tr {
                    td class=(word(c.severity)) { (word(c.severity)) }
                    td { code { (c.code) } }
                    td { (c.photograph.as_deref().unwrap_or("")) }
                    td { (c.message) }
                    td class="n" { (c.measured.map_or(String::new(), digits)) }
                    td class="n" { (c.threshold.map_or(String::new(), digits)) }
                    td { (c.unit) }
                }
            }
        }
    }
}

/// The camera's numbers with their errors, and where in the picture corners were seen.
pub(super) fn camera(capture: &Capture, corners: &[DVec2]) -> Markup {
    let Some(camera) = &capture.camera else { return Markup::default() };
    let names = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
    let values = [camera.fx, camera.fy, camera.cx, camera.cy].into_iter().chain(camera.distortion);
    html! {
        h2 { "Camera" }
        p { (camera.width) " x " (camera.height) " pixels, " (camera.source) "." }
        table {
            tr { th {} th { "value" } th { "standard deviation" } th {} }
            @for (k, (name, value)) in names.iter().zip(values).enumerate() {
                tr {
                    td { (name) }
                    td class="n" { (digits(value)) }
                    td class="n" { (camera.sigma.map_or(String::new(), |s| digits(s[k]))) }
                    td { @if k < 4 { "px" } }
                }
            }
        }
        @if let Some(rms) = camera.rms_px {
            p {
                (camera.views) " views, reprojection error " (format!("{rms:.3}")) " px RMS"
                @if !camera.dropped.is_empty() { "; left out: " (camera.dropped.join(", ")) }
                "."
            }
        }
        @if !corners.is_empty() { (coverage(camera, corners)) }
        @for (photo, own) in capture.photographs.iter().filter_map(|p| Some((p, p.camera.as_ref()?))) {
            p {
                (photo.sources.join(", ")) ": through another lens or at another size, " (own.width) " x " (own.height) " pixels, "
                (own.source) (format!(", f {} x {}, centre {}, {} px", digits(own.fx), digits(own.fy), digits(own.cx), digits(own.cy)))
                @if let Some(rms) = own.rms_px { ", " (own.views) " views, " (format!("{rms:.3}")) " px RMS" }
                "."
            }
        }
    }
}

/// All corners that the calibration used, over a grid of 10 x 10.
fn coverage(camera: &Camera, corners: &[DVec2]) -> Markup {
    /// Width of the picture over that of a grid line, and over the radius of a corner.
    const LINE: f64 = 800.0;
    const CORNER: f64 = 300.0;
    let (w, h) = (camera.width, camera.height);
    let line = |k: u32| format!("M{} 0V{h}M0 {}H{w}", f64::from(w * k) / 10.0, f64::from(h * k) / 10.0);
    html! {
        figure style="max-width:420px" {
            svg class="plain" viewBox={ "0 0 " (w) " " (h) } {
                @for k in 1..10 { path d=(line(k)) stroke="#bbb" stroke-width=(f64::from(w) / LINE) fill="none" {} }
                @for c in corners {
                    circle cx=(format!("{:.1}", c.x)) cy=(format!("{:.1}", c.y)) r=(format!("{:.1}", f64::from(w) / CORNER)) fill="#0070c0"
                        stroke="none" {}
                }
            }
            figcaption {
                "All corners in the picture: "
                @if let Some(share) = camera.coverage { (format!("{:.0}", 100.0 * share)) " % of a 10 x 10 grid" }
                "."
            }
        }
    }
}

/// The falloff of the lens as formula and curve.
pub(super) fn flat_field(capture: &Capture) -> Markup {
    /// Left and upper end of the plot's axes, its width and height, px.
    const PLOT: [f64; 4] = [40.0, 20.0, 300.0, 150.0];
    const STEPS: u32 = 60;
    let Some(flat) = &capture.flat_field else { return Markup::default() };
    let [b, c, d] = flat.radial;
    let v = |r: f64| 1.0 + b * r.powi(2) + c * r.powi(4) + d * r.powi(6);
    let [left, top, width, height] = PLOT;
    let bottom = top + height;
    let curve: String = (0..=STEPS)
        .map(|k| f64::from(k) / f64::from(STEPS))
        .map(|r| format!("{:.1},{:.1} ", left + width * r, bottom - height * v(r)))
        .collect();
    html! {
        h2 { "Falloff to the corners" }
        p {
            (format!("V(r) = 1 {b:+.4} r² {c:+.4} r⁴ {d:+.4} r⁶, r = 1 in the farthest corner; darkest {:.3}; ", flat.darkest))
            (format!("what is left: {:.2} % RMS. Taken out by ", 100.0 * flat.residual))
            @if flat.method == "divide" { "the photograph itself, smoothed." } @else { "this curve." }
        }
        svg class="plain" viewBox="0 0 360 200" width="420" {
            path d={ "M" (left) " " (top) "V" (bottom) "H" (left + width) } fill="none" stroke="#888" {}
            polyline points=(curve) fill="none" stroke="#0070c0" stroke-width="2" {}
            text x="5" y="25" font-size="13" { "1" }
            text x="5" y="175" font-size="13" { "0" }
            text x="330" y="190" font-size="13" { "r = 1" }
        }
    }
}

/// The colour matrix, and the checker's patches beside their maker's values.
pub(super) fn colour(capture: &Capture, patches: &[([f64; 3], [f64; 3])]) -> Markup {
    let Some(colour) = &capture.colour else { return Markup::default() };
    html! {
        h2 { "Colour" }
        p {
            "Matrix from the " (colour.source) ", camera to linear Rec. 709; mean Delta E 2000 " (format!("{:.2}", colour.mean_delta_e)) "."
        }
        table { @for row in colour.matrix { tr { @for v in row { td class="n" { (digits(v)) } } } } }
        @if !patches.is_empty() {
            svg class="plain" viewBox="0 0 600 400" width="600" {
                @for (k, (seen, reference)) in patches.iter().enumerate() {
                    (patch(k, *seen, *reference, colour.delta_e.get(k).copied().unwrap_or(f64::NAN)))
                }
            }
            p { "Outside: the maker's value; inside: this photograph, corrected; the number is their Delta E 2000." }
        }
    }
}

/// A patch of the checker in squares of 100 px: the reference with the measured colour inside of it, and their difference.
fn patch(k: usize, seen: [f64; 3], reference: [f64; 3], delta_e: f64) -> Markup {
    let (x, y) = ((k % 6) * 100, (k / 6) * 100);
    // White ink on what is darker than a fifth.
    let ink = if reference[1] > 0.2 { "#000" } else { "#fff" };
    html! {
        rect x=(x) y=(y) width="96" height="96" fill=(css(reference)) {}
        rect x=(x + 24) y=(y + 24) width="48" height="48" fill=(css(seen)) {}
        text x=(x + 6) y=(y + 90) font-size="14" fill=(ink) { (format!("{delta_e:.1}")) }
    }
}

/// The lights, source by source and together.
pub(super) fn lights(capture: &Capture) -> Markup {
    html! {
        @if !capture.lights.is_empty() {
            h2 { "Lights" }
            table {
                tr { th { "light" } th { "from" } th { "photograph" } th { "towards it, in the sample's frame" } th { "standard deviation" } }
                @for light in &capture.lights { (light_rows(light)) }
            }
        }
    }
}

fn light_rows(light: &Light) -> Markup {
    let direction = |d: [f64; 3]| format!("({:.4}, {:.4}, {:.4})", d[0], d[1], d[2]);
    let degrees = |sigma: f64| format!("{sigma:.2} degrees");
    html! {
        @for s in &light.sources {
            tr {
                td { (light.name) }
                td { (s.kind) }
                td { (s.photograph.as_deref().unwrap_or("")) }
                td { (direction(s.direction)) }
                td class="n" { (degrees(s.sigma_deg)) }
            }
        }
        tr {
            td { b { (light.name) } }
            td { b { "together" } }
            td {}
            td {
                b { (direction(light.direction)) }
                @if let Some(apart) = light.disagreement_deg { "; sources are " (format!("{apart:.2}")) " degrees apart" }
                @if let Some(irradiance) = light.irradiance_rgb { "; irradiance " (digits(irradiance[1])) }
            }
            td class="n" { b { (degrees(light.sigma_deg)) } }
        }
    }
}

/// The shape of the sample.
pub(super) fn sample(capture: &Capture) -> Markup {
    let text = match capture.sample {
        Sample::Plane { width_mm, height_mm } => format!("A plane of {} x {} mm.", digits(width_mm), digits(height_mm)),
        Sample::Cylinder { radius_mm, height_mm, .. } => {
            format!("A cylinder of radius {} mm, {} mm high.", digits(radius_mm), digits(height_mm))
        }
    };
    html! {
        h2 { "Sample" }
        p { (text) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_from_files_is_escaped() {
        let check = Check {
            code: "CLIPPED".into(),
            severity: Severity::Warn,
            message: "<b> & \"quoted\"".into(),
            measured: Some(0.25),
            threshold: None,
            unit: String::new(),
            photograph: Some("a<b>.png".into()),
        };
        let html = checks(&[check]).into_string();
        assert!(html.contains("a&lt;b&gt;.png") && html.contains("&lt;b&gt; &amp; ") && html.contains(">0.25<"), "{html}");
    }
}
