//! Polar plots of slices of an effective BRDF, as in a paper: half discs, one for each incidence and plane.
//!
//! The light stands to the left. A viewer's angle runs from -90 (left, where light returns to where it came from) to 90 degrees
//! (right, the mirror direction's side); the distance from the centre is the value.

use crate::common::figure::{Anchor, Stroke, Svg, stroke};
use biscale::direction::Pair;
use biscale::filter::Value;
use biscale::numerics::cast::truncate_u32;
use glam::DVec3;

/// Viewers' angles go to this many degrees on both sides, in steps of one; at 90 a surface has no limit that could be shown.
const LAST_ANGLE_DEG: i32 = 89;
/// The radial scale is chosen within this many degrees: a spike at grazing angles may be cut off.
const SCALE_ANGLE_DEG: i32 = 85;
/// An error bar every so many degrees.
const BAR_STEP_DEG: i32 = 10;
/// Shorter bars than this many pixels cannot be told from the line.
const SMALLEST_BAR: f64 = 2.5;
/// Channels that differ less than this share of the scale are drawn as one.
const SAME: f64 = 0.004;

/// Radius of a half disc, distance of their centres, and what stands around them, in pixels.
const RADIUS: f64 = 150.0;
const COLUMN: f64 = 372.0;
const ROW: f64 = 232.0;
const MARGIN: f64 = 24.0;
const HEAD: f64 = 72.0;
const FOOT: f64 = 56.0;

const INK: &str = "#222222";
const FAINT: &str = "#d5d5d5";
const GREY: &str = "#6a6a6a";
const LIGHT: &str = "#d08b00";
/// Channels with their colours and the widths of their curves: where two coincide, both show.
const CHANNELS: [(&str, &str, f64); 3] = [("red", "#d3222f", 2.7), ("green", "#1c9a44", 1.9), ("blue", "#1f4fc4", 1.2)];

/// Dashes of the curves of each material where there are several, and their colours where all channels are one curve.
const MATERIALS: [(&str, &str); MOST_MATERIALS] = [("", INK), ("9 5", "#b8336a"), ("2 4", "#2f7f9f"), ("11 4 2 4", "#8a6d1d")];
/// Most materials in one plot.
pub const MOST_MATERIALS: usize = 4;

/// What one material shows.
#[derive(Clone, Debug)]
pub struct Plotted {
    pub name: String,
    /// How the values were made, in one line.
    pub made: String,
    /// Values at [`Slices::pairs`].
    pub values: Vec<Value>,
}

/// What is plotted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Quantity {
    /// The effective BRDF, 1/sr
    Fhat,
    /// The same times the cosine of incidence, 1/sr
    Fbar,
}

impl Quantity {
    fn name(self) -> &'static str {
        match self {
            Self::Fhat => "effective BRDF",
            Self::Fbar => "effective BRDF times cosine of incidence",
        }
    }

    /// Values and standard errors.
    fn of(self, value: &Value, wi: DVec3) -> ([f64; 3], [f64; 3]) {
        match self {
            Self::Fbar => (value.fbar, value.se),
            Self::Fhat => (value.fhat, value.se.map(|se| se / wi.z.max(biscale::direction::MIN_COSINE))),
        }
    }
}

/// What is asked for.
#[derive(Clone, Debug)]
pub struct Slices {
    /// Angles of incidence, degrees from the normal, in 0..90.
    pub incidences_deg: Vec<f64>,
    /// Azimuth of the light, degrees from x.
    pub azimuth_deg: f64,
    pub quantity: Quantity,
}

/// The planes that viewers stand in, by their azimuth from the light's.
const PLANES: [(&str, f64); 2] = [("in the plane of incidence", 0.0), ("across the plane of incidence", 90.0)];

fn direction(theta_deg: f64, phi_deg: f64) -> DVec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
    DVec3::new(sin * cos_phi, sin * sin_phi, cos)
}

fn angles() -> impl Iterator<Item = i32> {
    -LAST_ANGLE_DEG..=LAST_ANGLE_DEG
}

impl Slices {
    /// The pairs of all panels: for each plane and incidence the viewers from left to right.
    pub fn pairs(&self) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for (_, plane) in PLANES {
            for &incidence in &self.incidences_deg {
                let wi = direction(incidence, self.azimuth_deg);
                // A negative angle is on the light's side.
                pairs.extend(angles().map(|a| Pair { wi, wo: direction(f64::from(-a), self.azimuth_deg + plane) }));
            }
        }
        pairs
    }

    /// The figure of one material, or of several with the same scales; at most [`MOST_MATERIALS`].
    pub fn draw(&self, materials: &[Plotted]) -> Svg {
        let columns = self.incidences_deg.len() as f64;
        let more = 17.0 * (materials.len() as f64 - 1.0);
        let mut svg = Svg::new((2.0 * MARGIN + columns * COLUMN).max(720.0), HEAD + 2.0 * ROW + FOOT + more);
        let width = svg.width;
        let names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
        svg.text([MARGIN, 34.0], 20.0, Anchor::Start, INK, &names.join(", "));
        let what = format!("{} (1/sr), light at azimuth {}°", self.quantity.name(), short(self.azimuth_deg));
        svg.text([MARGIN, 57.0], 13.0, Anchor::Start, GREY, &what);
        let count = angles().count();
        let panels: Vec<Panel> = PLANES
            .iter()
            .flat_map(|plane| self.incidences_deg.iter().map(move |&incidence| (plane.0, incidence)))
            .enumerate()
            .map(|(k, (plane, incidence))| {
                let of_panel: Vec<&[Value]> = materials.iter().map(|m| &m.values[k * count..(k + 1) * count]).collect();
                Panel::new(self, plane, incidence, &of_panel)
            })
            .collect();
        let grey = panels.iter().all(|p| p.grey);
        legend(&mut svg, grey, &names);
        let left = (width - columns * COLUMN) / 2.0;
        for (i, panel) in panels.iter().enumerate() {
            let (row, column) = (i / self.incidences_deg.len(), i % self.incidences_deg.len());
            let centre = [left + (column as f64 + 0.5) * COLUMN, HEAD + row as f64 * ROW + RADIUS + 28.0];
            panel.draw(&mut svg, centre, &format!("clip{i}"));
        }
        let bottom = svg.height;
        svg.text([MARGIN, bottom - 34.0 - more], 12.0, Anchor::Start, INK, &caption(&panels));
        for (k, material) in materials.iter().enumerate() {
            let made = if materials.len() > 1 { format!("{}: {}", material.name, material.made) } else { material.made.clone() };
            svg.text([MARGIN, bottom - 15.0 - more + 17.0 * k as f64], 12.0, Anchor::Start, GREY, &made);
        }
        svg
    }
}

/// Colours of the curves, at the top right, and the dashes of each material where there are several.
fn legend(svg: &mut Svg, grey: bool, names: &[&str]) {
    let channel = |(name, colour, width): (&'static str, &'static str, f64)| (name, stroke(colour, width));
    let channels = if grey { vec![("red = green = blue", stroke(INK, 1.8))] } else { CHANNELS.map(channel).to_vec() };
    let dashed = |(name, (dashes, colour)): (&&str, (&'static str, &'static str))| {
        (shortened(name), Stroke { dashes, ..stroke(if grey { colour } else { INK }, 1.8) })
    };
    let materials: Vec<(String, Stroke<'_>)> = names.iter().zip(MATERIALS).map(dashed).collect();
    let mut line = |entries: Vec<(&str, Stroke<'_>)>, y: f64| {
        let mut x = svg.width - 2.0 * MARGIN;
        for (name, stroke) in entries.into_iter().rev() {
            svg.text([x, y], 13.0, Anchor::End, INK, name);
            // The embedded font's letters are .6 of their size wide on average.
            x -= 13.0 * 0.6 * name.chars().count() as f64 + 8.0;
            svg.line([x - 34.0, y - 4.5], [x, y - 4.5], stroke);
            x -= 56.0;
        }
    };
    if names.len() == 1 || !grey {
        line(channels, 34.0);
    }
    if names.len() > 1 {
        line(materials.iter().map(|(name, stroke)| (name.as_str(), *stroke)).collect(), 57.0);
    }
}

/// A name that fits into the legend.
fn shortened(name: &str) -> String {
    if name.chars().count() <= 24 { name.to_owned() } else { name.chars().take(23).chain(['…']).collect() }
}

/// One half disc.
struct Panel {
    plane: &'static str,
    incidence_deg: f64,
    /// For each material value and standard error of each channel at each angle.
    values: Vec<Vec<([f64; 3], [f64; 3])>>,
    /// Value at the rim, and distance of the rings.
    rim: f64,
    step: f64,
    /// Whether all channels are one curve.
    grey: bool,
    /// Whether something lies outside the rim.
    cut: bool,
}

impl Panel {
    fn new(slices: &Slices, plane: &'static str, incidence_deg: f64, materials: &[&[Value]]) -> Self {
        let wi = direction(incidence_deg, slices.azimuth_deg);
        let values: Vec<Vec<_>> = materials.iter().map(|values| values.iter().map(|v| slices.quantity.of(v, wi)).collect()).collect();
        let top = |limit: i32| {
            let inside = values.iter().flat_map(|values| angles().zip(values)).filter(|(a, _)| a.abs() <= limit);
            inside.flat_map(|(_, (v, se))| v.iter().zip(se).map(|(v, se)| v + se)).fold(0.0, f64::max)
        };
        let (rim, step) = nice_scale(top(SCALE_ANGLE_DEG));
        let grey = values.iter().flatten().all(|(v, _)| v.iter().all(|x| (x - v[0]).abs() <= SAME * rim));
        Self { plane, incidence_deg, cut: top(LAST_ANGLE_DEG) > 1.02 * rim, grey, rim, step, values }
    }

    fn draw(&self, svg: &mut Svg, centre: [f64; 2], clip: &str) {
        let at = |angle_deg: f64, radius: f64| {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            [centre[0] + radius * sin, centre[1] - radius * cos]
        };
        // Rings with their values below the base line, spokes with their angles around.
        let rings = (self.rim / self.step).round();
        for ring in 1..=truncate_u32(rings) {
            let radius = RADIUS * f64::from(ring) / rings;
            let outer = f64::from(ring) == rings;
            svg.half_circle(centre, radius, stroke(if outer { GREY } else { FAINT }, if outer { 1.0 } else { 0.8 }));
            let label = short(self.step * f64::from(ring));
            svg.text([centre[0] + radius, centre[1] + 14.0], 10.5, Anchor::Middle, GREY, &label);
        }
        svg.text([centre[0], centre[1] + 14.0], 10.5, Anchor::Middle, GREY, "0");
        for spoke in (-90..=90).step_by(30).map(f64::from) {
            svg.line(centre, at(spoke, RADIUS), stroke(FAINT, 0.8));
            let [x, y] = at(spoke, RADIUS + 9.0);
            let anchor = if spoke < -15.0 {
                Anchor::End
            } else if spoke > 15.0 {
                Anchor::Start
            } else {
                Anchor::Middle
            };
            svg.text([x, y + 3.5], 10.5, anchor, GREY, &format!("{}°", short(spoke)));
        }
        svg.line(at(-90.0, RADIUS), at(90.0, RADIUS), stroke(GREY, 1.0));
        self.draw_light(svg, centre, &at);
        svg.clip_half_disc(clip, centre, RADIUS);
        for (values, style) in self.values.iter().zip(MATERIALS) {
            self.draw_curves(svg, values, style, clip, &at);
        }
        let title = format!("light at {}°, viewer {}", short(self.incidence_deg), self.plane);
        svg.text([centre[0], centre[1] + 34.0], 12.5, Anchor::Middle, INK, &title);
    }

    /// The curves of one material and their error bars.
    fn draw_curves(
        &self,
        svg: &mut Svg,
        values: &[([f64; 3], [f64; 3])],
        (dashes, grey): (&'static str, &'static str),
        clip: &str,
        at: &dyn Fn(f64, f64) -> [f64; 2],
    ) {
        let point = |angle: i32, value: f64| at(f64::from(angle), RADIUS * value / self.rim);
        let curves: &[(&str, &str, f64)] = if self.grey { &[("all", grey, 1.8)] } else { &CHANNELS };
        for (c, (_, colour, width)) in curves.iter().enumerate() {
            let curve: Vec<[f64; 2]> = angles().zip(values).map(|(a, (v, _))| point(a, v[c])).collect();
            svg.clipped_path(&curve, Stroke { dashes, ..stroke(colour, *width) }, Some(clip));
            for (a, (v, se)) in angles().zip(values).filter(|(a, _)| a % BAR_STEP_DEG == 0) {
                if 2.0 * se[c] / self.rim * RADIUS >= SMALLEST_BAR {
                    let (low, high) = (point(a, (v[c] - se[c]).max(0.0)), point(a, v[c] + se[c]));
                    svg.clipped_path(&[low, high], stroke(colour, 1.0), Some(clip));
                    // Caps across the bar: it lies along a spoke.
                    let (sin, cos) = f64::from(a).to_radians().sin_cos();
                    for [x, y] in [low, high] {
                        svg.clipped_path(
                            &[[x - 3.0 * cos, y - 3.0 * sin], [x + 3.0 * cos, y + 3.0 * sin]],
                            stroke(colour, 1.0),
                            Some(clip),
                        );
                    }
                }
            }
        }
    }

    /// An arrow along the light; across its plane the light is seen end on, and only its elevation would mislead.
    fn draw_light(&self, svg: &mut Svg, centre: [f64; 2], at: &dyn Fn(f64, f64) -> [f64; 2]) {
        if self.plane != PLANES[0].0 {
            return;
        }
        let angle = -self.incidence_deg;
        svg.line(at(angle, RADIUS), centre, Stroke { dashes: "5 4", ..stroke(LIGHT, 1.2) });
        let tip = at(angle, RADIUS * 0.9);
        let (sin, cos) = angle.to_radians().sin_cos();
        let back = |side: f64| {
            let base = at(angle, RADIUS * 0.97);
            [base[0] + side * 4.5 * cos, base[1] + side * 4.5 * sin]
        };
        svg.polygon(&[tip, back(1.0), back(-1.0)], LIGHT);
    }
}

/// What the error bars mean, and whether there are any to see.
fn caption(panels: &[Panel]) -> String {
    let (mut largest, mut drawn) = (0.0_f64, false);
    for panel in panels {
        for (_, (_, se)) in panel.values.iter().flat_map(|values| angles().zip(values)).filter(|(a, _)| a % BAR_STEP_DEG == 0) {
            for se in se {
                largest = largest.max(se / panel.rim);
                drawn |= 2.0 * se / panel.rim * RADIUS >= SMALLEST_BAR;
            }
        }
    }
    let percent = format!("{:.2} %", 100.0 * largest);
    let bars = if panels.iter().all(|p| p.values.iter().flatten().all(|(v, _)| *v == [0.0; 3])) {
        "All values are 0.".to_owned()
    } else if drawn {
        format!("Bars: ± one standard error, where longer than the line is wide; the largest is {percent} of its rim.")
    } else {
        format!("Standard errors are too small to see: the largest is {percent} of its rim.")
    };
    let cut = if panels.iter().any(|p| p.cut) { " Values beyond the rim, near grazing, are cut off." } else { "" };
    format!("{bars}{cut} Negative angles: the light's side.")
}

/// A rim at or above `top` that is a whole number of nice steps, two to five of them.
fn nice_scale(top: f64) -> (f64, f64) {
    if top <= 0.0 || !top.is_finite() {
        return (1.0, 0.5);
    }
    let rough = top / 4.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough * 0.999).unwrap_or(10.0 * power);
    // A curve that ends just above a ring needs no whole ring more.
    ((top / step - 0.02).ceil().max(1.0) * step, step)
}

/// A number for a label: at most three significant digits.
fn short(x: f64) -> String {
    let rounded = format!("{x:.2e}").parse::<f64>().unwrap_or(x);
    if rounded == 0.0 || (1e-3..1e5).contains(&rounded.abs()) { format!("{rounded}").replace('-', "−") } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slices() -> Slices {
        Slices { incidences_deg: vec![0.0, 30.0, 60.0], azimuth_deg: 20.0, quantity: Quantity::Fhat }
    }

    /// Values of a flat Lambertian, each channel times its factor, with an error.
    fn lambertian(factors: [f64; 3], error: f64) -> Vec<Value> {
        let value = |p: &Pair| {
            let fhat = factors.map(|f| f / std::f64::consts::PI);
            let fbar = fhat.map(|f| f * p.wi.z);
            Value { fhat, fbar, se: fbar.map(|f| f * error), av: p.wo.z, ..Value::default() }
        };
        slices().pairs().iter().map(value).collect()
    }

    fn plotted(name: &str, made: &str, factors: [f64; 3], error: f64) -> Plotted {
        Plotted { name: name.to_owned(), made: made.to_owned(), values: lambertian(factors, error) }
    }

    #[test]
    fn several_materials_share_a_scale_and_are_told_apart() {
        let two = [plotted("wool", "direct", [0.8, 0.4, 0.1], 0.0), plotted("silk", "sg", [0.2, 0.3, 0.4], 0.0)];
        let text = slices().draw(&two).finish(None);
        assert!(text.contains("wool, silk") && text.contains("wool: direct") && text.contains("silk: sg"), "{text}");
        assert!(text.contains("stroke-dasharray=\"9 5\""), "the second is dashed");
        // Rims of each alone would differ: .3 and .15.
        let panel = |of: &[&Plotted]| Panel::new(&slices(), "p", 0.0, &of.iter().map(|m| &m.values[..179]).collect::<Vec<_>>()).rim;
        assert_eq!(panel(&[&two[0], &two[1]]), panel(&[&two[0]]));
        assert!(panel(&[&two[1]]) < panel(&[&two[0]]));
    }

    #[test]
    fn the_mirror_direction_is_to_the_right_and_the_light_to_the_left() {
        let pairs = slices().pairs();
        let n = angles().count();
        assert_eq!(pairs.len(), 6 * n);
        // Second panel: incidence 30 in its plane; 30 degrees to the right mirrors, to the left returns.
        let panel = &pairs[n..2 * n];
        let at = |angle: i32| &panel[usize::try_from(angle + LAST_ANGLE_DEG).unwrap()];
        let mirrored = DVec3::new(-at(30).wo.x, -at(30).wo.y, at(30).wo.z);
        assert!(mirrored.distance(at(30).wi) < 1e-12 && at(-30).wo.distance(at(-30).wi) < 1e-12);
        // Fifth panel: across.
        assert!(pairs[4 * n].wo.cross(pairs[4 * n].wi).dot(DVec3::Z).abs() > 0.1);
    }

    #[test]
    fn a_figure_holds_finite_numbers_its_title_and_its_errors() {
        for (factors, error, says) in [
            ([0.8, 0.4, 0.1], 0.05, "Bars: ± one standard error"),
            ([0.5; 3], 1e-4, "too small to see"),
            ([0.0; 3], 0.0, "All values are 0"),
        ] {
            let text = slices().draw(&[plotted("copper & <wool>", "direct, 8192 facets", factors, error)]).finish(None);
            assert!(text.contains("copper &amp; &lt;wool&gt;") && text.contains("8192 facets") && text.contains(says), "{text}");
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
            assert!(text.contains("light at 30°") && text.contains("(1/sr)") && text.contains("60°"));
        }
    }

    #[test]
    fn equal_channels_are_one_curve() {
        let text = slices().draw(&[plotted("grey", "", [0.5; 3], 0.0)]).finish(None);
        assert!(text.contains("red = green = blue") && !text.contains(CHANNELS[0].1));
    }

    #[test]
    fn the_same_values_make_the_same_bytes() {
        let draw = || slices().draw(&[plotted("a", "b", [0.8, 0.4, 0.1], 0.05)]);
        assert_eq!(draw().finish(None), draw().finish(None));
        assert_eq!(draw().rasterise(1.0, None).unwrap().data(), draw().rasterise(1.0, None).unwrap().data());
    }

    #[test]
    fn scales_end_at_round_numbers_above_the_values() {
        for top in [1e-9, 0.031, 0.1, 0.2546, 1.0, 3.7, 99.0, 1e6] {
            let (rim, step) = nice_scale(top);
            let rings = rim / step;
            assert!(rim >= 0.98 * top && rings.round() <= 5.0 && (rings - rings.round()).abs() < 1e-9, "{top}: {rim} by {step}");
        }
    }
}
