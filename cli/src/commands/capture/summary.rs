//! What is said of a capture when it is done.

use biscale::formats::capture::{Capture, Check, Severity};
use std::path::Path;

/// How it ended, in one line.
pub(super) fn verdict(capture: &Capture, folder: &Path) -> String {
    let count = |s| capture.checks.iter().filter(|c| c.severity == s).count();
    let word = if capture.usable { "usable" } else { "not usable" };
    format!(
        "{word}: {} failed checks, {} warnings; see {}\n",
        count(Severity::Fail),
        count(Severity::Warn),
        folder.join("report.html").display()
    )
}

/// What a check measured, for people.
pub(super) fn measured(check: &Check) -> String {
    match (check.measured, check.threshold) {
        (Some(m), Some(t)) => format!(" ({m:.4} for {t} {})", check.unit),
        _ => String::new(),
    }
}

/// What was measured, in a few lines.
pub(super) fn summary(capture: &Capture, folder: &Path) -> String {
    let mut out = capture.name.clone();
    if let Some(c) = &capture.camera {
        let sigma = |k: usize| c.sigma.map_or(String::new(), |s| format!(" +/- {:.2}", s[k]));
        let rms = c.rms_px.map_or(String::new(), |r| format!(", {} views, {r:.3} px RMS", c.views));
        out.push_str(&format!(
            "\ncamera ({}): f {:.1}{} x {:.1}{}, centre {:.1}{}, {:.1}{} px{rms}",
            c.source,
            c.fx,
            sigma(0),
            c.fy,
            sigma(1),
            c.cx,
            sigma(2),
            c.cy,
            sigma(3)
        ));
        if !c.dropped.is_empty() {
            out.push_str(&format!("\nviews left out: {}", c.dropped.join(", ")));
        }
    }
    if let Some(c) = &capture.colour {
        out.push_str(&format!("\ncolour ({}): mean Delta E 2000 {:.2}", c.source, c.mean_delta_e));
    }
    for l in &capture.lights {
        let [x, y, z] = l.direction;
        out.push_str(&format!("\nlight \"{}\": ({x:.4}, {y:.4}, {z:.4}) +/- {:.2} degrees", l.name, l.sigma_deg));
    }
    if let Some(weave) = capture.close_up.as_ref().and_then(|c| c.weave.as_ref()) {
        out.push_str(&small_scale(weave));
    }
    for p in &capture.photographs {
        let pose = p.pose.as_ref().map_or("not placed".to_owned(), |pose| {
            let t = glam::DVec3::from(pose.translation_mm).length();
            if pose.points > 0 {
                format!("{t:.1} mm away, {} corners, {:.3} px RMS", pose.points, pose.rms_px)
            } else {
                format!("{t:.1} mm away, as given")
            }
        });
        out.push_str(&format!("\n{} ({}): {pose}", p.file, p.role));
    }
    for check in capture.checks.iter().filter(|c| c.severity == Severity::Warn) {
        let photograph = check.photograph.as_ref().map_or(String::new(), |p| format!("{p}: "));
        out.push_str(&format!("\nwarning: {}: {photograph}{}{}", check.code, check.message, measured(check)));
    }
    out.push_str(&format!("\nwrote {}", folder.join("report.html").display()));
    out
}

/// The line of what the close-up shows: threads, or a relief. What was not measured is left out.
fn small_scale(found: &serde_json::Value) -> String {
    let unit = found["unit"].as_str().unwrap_or_default();
    let length = |v: &serde_json::Value| v.as_f64().map(|v| format!("{v:.4} {unit}"));
    if let Some(class) = found["class_name"].as_str() {
        let mut out = format!("\nweave: {class}");
        if let Some(confidence) = found["confidence"].as_f64() {
            out.push_str(&format!(" (confidence {confidence:.2})"));
        }
        for name in ["warp", "weft"] {
            if let Some(pitch) = length(&found[name]["pitch"]["value"]) {
                out.push_str(&format!(", {name} {pitch}"));
            }
        }
        return out + " from thread to thread";
    }
    let relief = &found["relief"];
    let periods: Vec<String> = relief["period"].as_array().into_iter().flatten().filter_map(|p| length(&p["value"])).collect();
    match relief["profile"].as_str() {
        Some(profile) if !periods.is_empty() => format!("\nrelief: {profile}, period {}", periods.join(" x ")),
        Some(profile) => format!("\nrelief: {profile}"),
        None => String::new(),
    }
}
