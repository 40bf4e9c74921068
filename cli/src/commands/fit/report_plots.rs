//! The plots of `report.html`: convergence of the search, and profiles of the objective.

use super::files::digits;
use crate::common::figure::{Anchor, Stroke, Svg, stroke};
use biscale_fit::search::{Entry, Stage};
use biscale_fit::uncertainty::profile::Profile;

const COLOURS: [&str; 8] = ["#1b6ca8", "#c44536", "#3a7d44", "#8e5ea2", "#c98a1b", "#3aa6a0", "#7a5230", "#555555"];
const GREY: &str = "#999999";

/// The best objective of each start so far, against its evaluations, all stages one after the other.
pub fn convergence(trace: &[Entry]) -> Svg {
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
pub fn profile_plot(profile: &Profile) -> Svg {
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
