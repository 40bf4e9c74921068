//! A panel of a plot with logarithmic axes: grid, ticks, marks, and what lies outside of none.

use crate::common::figure::{Anchor, Stroke, Svg, stroke};
use biscale::numerics::cast::{truncate_i32, truncate_usize};

pub const INK: &str = "#222222";
pub const GREY: &str = "#6a6a6a";
const GRID: &str = "#e4e4e4";
const FINE_GRID: &str = "#f3f3f3";
/// Size of ordinary text, pixels.
pub const TEXT: f64 = 12.0;
/// Radius of a mark, pixels.
const RADIUS: f64 = 4.6;
/// Share of a decade left free beyond the outermost values.
const MARGIN: f64 = 0.12;
/// Fewest decades of an axis.
const LEAST: f64 = 1.0;

/// Shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Circle,
    Square,
    Diamond,
    Up,
    Down,
    Cross,
    Star,
}

/// How the marks of a curve look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    pub colour: &'static str,
    pub shape: Shape,
}

/// Draws a mark; a hollow one is a bound.
pub fn mark(svg: &mut Svg, [x, y]: [f64; 2], look: Look, hollow: bool) {
    let around = |corners: usize, radius: f64, turn: f64| -> Vec<[f64; 2]> {
        let angle = |k: usize| std::f64::consts::TAU * (k as f64 / corners as f64 + turn);
        (0..corners).map(|k| [x + radius * angle(k).sin(), y - radius * angle(k).cos()]).collect()
    };
    let points = match look.shape {
        Shape::Circle => around(20, RADIUS, 0.0),
        Shape::Square => around(4, 1.25 * RADIUS, 0.125),
        Shape::Diamond => around(4, 1.35 * RADIUS, 0.0),
        Shape::Up => around(3, 1.35 * RADIUS, 0.0),
        Shape::Down => around(3, 1.35 * RADIUS, 0.5),
        Shape::Cross | Shape::Star => {
            let (points, inner) = if look.shape == Shape::Cross { (4, 0.45) } else { (5, 0.55) };
            let (long, short) = (around(points, 1.5 * RADIUS, 0.5 / points as f64), around(points, inner * RADIUS, 0.0));
            (0..points).flat_map(|k| [short[k], long[k]]).collect()
        }
    };
    let fill = if hollow { "white" } else { look.colour };
    svg.outlined_polygon(&points, fill, stroke(look.colour, 1.4));
}

/// A panel with logarithmic axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Upper left corner and size of the field, pixels.
    origin: [f64; 2],
    size: [f64; 2],
    /// Decimal logarithms of the ends of the axes: x, then y.
    range: [[f64; 2]; 2],
}

impl Panel {
    /// A panel that holds all `points`; those that have no logarithm are left out.
    pub fn new(origin: [f64; 2], size: [f64; 2], points: &[[f64; 2]]) -> Self {
        let range = [0, 1].map(|axis| {
            let logs = points.iter().map(|p| p[axis]).filter(|v| v.is_finite() && *v > 0.0).map(f64::log10);
            let [low, high] = logs.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
            let [low, high] = if low > high { [0.0, 0.0] } else { [low, high] };
            let lacking = (LEAST - (high - low + 2.0 * MARGIN)).max(0.0) / 2.0;
            [low - MARGIN - lacking, high + MARGIN + lacking]
        });
        Self { origin, size, range }
    }

    /// Where values are on the picture; `None` for values that have no logarithm.
    pub fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let share = |axis: usize, v: f64| {
            let [low, high] = self.range[axis];
            (v > 0.0 && v.is_finite()).then(|| (v.log10() - low) / (high - low))
        };
        let (x, y) = (share(0, x)?, share(1, y)?);
        Some([self.origin[0] + x * self.size[0], self.origin[1] + (1.0 - y) * self.size[1]])
    }

    /// Grid, frame, ticks; `labels` write a value of x and of y.
    pub fn frame(&self, svg: &mut Svg, title: &str, [x_label, y_label]: [&str; 2], labels: [fn(f64) -> String; 2]) {
        let ([left, top], [width, height]) = (self.origin, self.size);
        let (right, bottom) = (left + width, top + height);
        for (axis, label) in labels.into_iter().enumerate() {
            let [low, high] = self.range[axis];
            let at = |v: f64| {
                let share = (v.log10() - low) / (high - low);
                if axis == 0 { left + share * width } else { bottom - share * height }
            };
            // Where few decades show, 2 and 5 are labelled too.
            let crowded = high - low > 2.2;
            for (value, digit) in ticks(low, high) {
                let p = at(value);
                let (from, to) = if axis == 0 { ([p, top], [p, bottom]) } else { ([left, p], [right, p]) };
                svg.line(from, to, stroke(if digit == 1 { GRID } else { FINE_GRID }, 1.0));
                if digit == 1 || (!crowded && matches!(digit, 2 | 5)) {
                    let (place, anchor) =
                        if axis == 0 { ([p, bottom + 17.0], Anchor::Middle) } else { ([left - 7.0, p + 4.0], Anchor::End) };
                    svg.text(place, TEXT, anchor, INK, &label(value));
                }
            }
        }
        for (from, to) in [([left, bottom], [right, bottom]), ([left, top], [left, bottom])] {
            svg.line(from, to, stroke(GREY, 1.2));
        }
        svg.text([left, top - 12.0], TEXT + 2.0, Anchor::Start, INK, title);
        svg.text([right, bottom + 36.0], TEXT, Anchor::End, GREY, x_label);
        svg.text([right, top - 12.0], TEXT, Anchor::End, GREY, y_label);
    }

    /// A line through values.
    pub fn curve(&self, svg: &mut Svg, points: &[[f64; 2]], look: Stroke<'_>) {
        let places: Vec<[f64; 2]> = points.iter().filter_map(|&p| self.place(p)).collect();
        if places.len() > 1 {
            svg.path(&places, look);
        }
    }

    /// A horizontal line with a label at its left end, if it is within the panel.
    pub fn level(&self, svg: &mut Svg, y: f64, label: &str) {
        let [low, high] = self.range[1];
        if y > 0.0 && (low..high).contains(&y.log10()) {
            let right = self.origin[0] + self.size[0];
            let height = self.origin[1] + (1.0 - (y.log10() - low) / (high - low)) * self.size[1];
            svg.line([self.origin[0], height], [right, height], Stroke { colour: GREY, width: 1.0, dashes: "2 4" });
            svg.text([self.origin[0] + 8.0, height - 5.0], TEXT - 1.0, Anchor::Start, GREY, label);
        }
    }
}

/// Values with one digit within a range of logarithms, and the digit.
fn ticks(low: f64, high: f64) -> Vec<(f64, u32)> {
    let decades = truncate_i32(low.floor())..=truncate_i32(high.floor());
    let all = decades.flat_map(|decade| (1..10_u32).map(move |digit| (f64::from(digit) * 10.0_f64.powi(decade), digit)));
    all.filter(|(v, _)| (low..=high).contains(&v.log10())).collect()
}

/// A share as per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share))
}

/// Seconds with a unit that keeps the number short.
pub fn seconds(s: f64) -> String {
    if s >= 1.0 { format!("{} s", significant(s)) } else { format!("{} ms", significant(1e3 * s)) }
}

/// A whole number.
pub fn count(n: f64) -> String {
    format!("{n:.0}")
}

/// Two significant digits, without trailing zeros, never as a power of ten.
pub fn significant(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let decimals = truncate_usize((1.0 - x.abs().log10().floor()).clamp(0.0, 12.0));
    let text = format!("{x:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (x, text) in [(0.0123, "0.012"), (0.5, "0.5"), (12.3, "12"), (1234.0, "1234"), (0.1 + 0.2, "0.3"), (0.0, "0"), (9.99, "10")] {
            assert_eq!(significant(x), text);
        }
        assert_eq!((percent(0.001), seconds(0.0021), seconds(12.0)), ("0.1 %".into(), "2.1 ms".into(), "12 s".into()));
    }

    #[test]
    fn places_run_from_the_lower_left_by_logarithms() {
        let panel = Panel::new([10.0, 20.0], [100.0, 50.0], &[[1.0, 1.0], [100.0, 0.01], [f64::NAN, -1.0]]);
        let [middle, low] = [[10.0, 0.1], [1.0, 0.01]].map(|p| panel.place(p).unwrap());
        assert!((middle[0] - 60.0).abs() < 1e-9 && (middle[1] - 45.0).abs() < 1e-9, "{middle:?}");
        assert!(low[0] > 10.0 && low[0] < 20.0 && low[1] < 70.0 && low[1] > 60.0, "{low:?}");
        assert_eq!(panel.place([0.0, 1.0]), None);
    }

    #[test]
    fn every_decade_has_its_ticks() {
        let all = ticks(-1.1, 1.0);
        assert_eq!(all.iter().filter(|t| t.1 == 1).count(), 3);
        assert!(ticks(0.02, 0.1).is_empty());
    }
}
