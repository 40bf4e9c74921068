//! The sheet that is wrapped around a large object and that the folded material is glued onto (Wu et al. 2011, Fig. 9).
//!
//! It shows where every period begins, by numbered lines; markers around it let a photograph of it be registered, and patches of known
//! colours let printed colours be measured. All of it also stands in the sidecar, in mm on the page.

use crate::aruco::{CELLS, is_white};
use crate::drawing::{BLACK, Item, Layer, Mark, Page, Style, srgb};
use crate::layout::Paper;
use crate::sheets::footer;
use biscale::error::BadInput;
use glam::DVec2;
use serde::Serialize;
use std::f64::consts::TAU;

/// What the material is put on; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Target {
    /// A flat rectangle.
    Plane {
        /// Across the first lines.
        width: f64,
        /// Along them.
        height: f64,
    },
    /// A cylinder, wrapped around once.
    Cylinder {
        /// Of the bare cylinder.
        radius: f64,
        /// Of the wrapped part.
        height: f64,
    },
    /// The side of a cone, from its tip.
    Cone {
        /// Of the base circle.
        radius: f64,
        /// From base to tip.
        height: f64,
    },
    /// The four upright sides of a box.
    Box {
        /// One side.
        width: f64,
        /// The other.
        depth: f64,
        /// Upright.
        height: f64,
    },
}

/// How the pattern meets the target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Periods around (or across).
    pub around: u32,
    /// Periods along the height.
    pub along: u32,
    /// Distance from line to line on the sheet that results, mm.
    pub pitch_mm: f64,
    /// What it is off from the design's, of that.
    pub residual: f64,
    /// The same along the height.
    pub residual_along: f64,
}

/// Overlap at the seam, mm.
pub const SEAM: f64 = 10.0;
/// Side of a marker with its frame, mm, and the white around it.
const MARKER: f64 = 14.0;
const QUIET: f64 = 2.0;
/// Distance of markers from middle to middle, about, mm: from every side of a cylinder several columns are seen. A large sheet has them farther apart,
/// for the dictionary has 100.
const MARKER_PITCH: f64 = 20.0;
/// Side of a colour patch, mm.
const PATCH: f64 = 8.0;
/// Steps of the grey wedge.
const GREYS: usize = 6;

impl Target {
    /// Reads `cylinder:radius=40,height=100`, `plane:width=..,height=..`, `cone:radius=..,height=..` or `box:width=..,depth=..,height=..`.
    ///
    /// # Errors
    /// An unknown shape or key, a missing or impossible length.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let remedy =
            "write it like cylinder:radius=40,height=100 (or plane:width=,height=; cone:radius=,height=; box:width=,depth=,height=)";
        let bad = |problem: String| BadInput::new(problem, remedy).at_field("--on");
        let (shape, rest) = text.split_once(':').unwrap_or((text, ""));
        let keys: &[&str] = match shape {
            "plane" => &["width", "height"],
            "cylinder" | "cone" => &["radius", "height"],
            "box" => &["width", "depth", "height"],
            _ => return Err(bad(format!("the shape \"{shape}\" is not known"))),
        };
        let mut values = vec![None; keys.len()];
        for part in rest.split(',').filter(|p| !p.is_empty()) {
            let (key, value) = part.split_once('=').ok_or_else(|| bad(format!("\"{part}\" is no key=length")))?;
            let k = keys.iter().position(|k| *k == key.trim()).ok_or_else(|| bad(format!("a {shape} has no \"{key}\"")))?;
            let value = value.trim().parse::<f64>().ok().filter(|v| (1.0..=1e4).contains(v));
            let value = value.ok_or_else(|| bad(format!("{part}: the length is not from 1 to 10000 mm")))?;
            if values[k].replace(value).is_some() {
                return Err(bad(format!("{key} stands twice")));
            }
        }
        let get = |k: usize| values[k].ok_or_else(|| bad(format!("{} of the {shape} is missing", keys[k])));
        Ok(match shape {
            "plane" => Self::Plane { width: get(0)?, height: get(1)? },
            "cylinder" => Self::Cylinder { radius: get(0)?, height: get(1)? },
            "cone" => Self::Cone { radius: get(0)?, height: get(1)? },
            _ => Self::Box { width: get(0)?, depth: get(1)?, height: get(2)? },
        })
    }

    /// Length around and along of the sheet in paper of a thickness, mm; of a cone around its base and along its side.
    pub fn extent(&self, thickness: f64) -> DVec2 {
        match *self {
            Self::Plane { width, height } => DVec2::new(width, height),
            Self::Cylinder { radius, height } => DVec2::new(TAU * (radius + thickness), height),
            Self::Cone { radius, height } => DVec2::new(TAU * (radius + thickness), radius.hypot(height)),
            Self::Box { width, depth, height } => DVec2::new(2.0 * (width + depth), height),
        }
    }

    /// How many periods of a pitch go around and along, and what pitch results: `n = round(2 pi (R + t) / pitch)`.
    pub fn fit(&self, period: DVec2, thickness: f64) -> Fit {
        let extent = self.extent(thickness);
        let count = (extent / period).round().max(DVec2::ONE).min(DVec2::splat(10_000.0));
        let pitch = extent / count;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 10,000")]
        let [around, along] = count.to_array().map(|n| n as u32);
        Fit { around, along, pitch_mm: pitch.x, residual: pitch.x / period.x - 1.0, residual_along: pitch.y / period.y - 1.0 }
    }

    fn closes(&self) -> bool {
        !matches!(self, Self::Plane { .. })
    }
}

/// A marker on the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Marker {
    /// Number in the dictionary `DICT_5X5_100`.
    pub id: usize,
    /// Corners from its own upper left clockwise, mm, y up from the page's lower left corner.
    pub corners_mm: [[f64; 2]; 4],
}

/// A colour patch on the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Patch {
    /// `design`, `grey` or `white`.
    pub kind: &'static str,
    /// Its place among its kind.
    pub index: usize,
    /// What was sent to the printer, linear RGB.
    pub linear_rgb: [f64; 3],
    /// Lower left and upper right corner, mm.
    pub rectangle_mm: [[f64; 2]; 2],
}

/// The sheet, and what a camera needs to know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrap {
    /// The page.
    pub page: Page,
    /// Its markers.
    pub markers: Vec<Marker>,
    /// Its colour patches.
    pub patches: Vec<Patch>,
    /// Lower left corner of the wrapped area on the page, mm.
    pub origin: DVec2,
}

/// Draws the wrap sheet.
///
/// # Errors
/// A sheet that does not fit the paper.
pub fn wrap(target: Target, fit: Fit, thickness: f64, colours: &[[f64; 3]], paper: Paper, title: &str) -> Result<Wrap, BadInput> {
    let extent = target.extent(thickness);
    let seam = if target.closes() { SEAM } else { 0.0 };
    let [corner, area] = paper.area();
    let border = MARKER + 2.0 * QUIET;
    // The outline of the sheet in a frame with its lower left corner at 0.
    let outline: Vec<DVec2> = match target {
        Target::Cone { .. } => sector(extent, seam),
        _ => vec![DVec2::ZERO, DVec2::new(extent.x + seam, 0.0), DVec2::new(extent.x + seam, extent.y), DVec2::new(0.0, extent.y)],
    };
    let (low, high) = outline.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let size = high - low;
    let strip = PATCH + 4.0;
    let needed = |s: DVec2| s + DVec2::new(2.0 * border, 2.0 * border + strip);
    let fits = |s: DVec2| needed(s).x <= area.x && (paper.roll || needed(s).y <= area.y);
    let turned = !fits(size) && fits(DVec2::new(size.y, size.x));
    if !turned && !fits(size) {
        let (n, m) = (needed(size), needed(DVec2::new(size.y, size.x)));
        let problem = format!(
            "the wrap sheet with its markers takes {:.0} x {:.0} mm (or {:.0} x {:.0}) and the page holds {:.0} x {:.0}",
            n.x, n.y, m.x, m.y, area.x, area.y
        );
        return Err(BadInput::new(problem, "take a larger page, such as --page a3 or roll:600, or a smaller target").at_field("--on"));
    }
    let origin = corner + DVec2::new(border, border + strip);
    let at = |p: DVec2| {
        let p = p - low;
        origin + if turned { DVec2::new(size.y - p.y, p.x) } else { p }
    };
    let mut page = Page { size: paper.size, items: Vec::new() };
    let placed_size = if turned { DVec2::new(size.y, size.x) } else { size };
    if paper.roll {
        page.size.y = (origin.y + placed_size.y + border + paper.margin + paper.inset).ceil();
    }
    lines(&mut page, target, fit, extent, &at);
    let points: Vec<DVec2> = outline.iter().map(|&p| at(p)).collect();
    page.items.push(Item {
        layer: Layer::Cut,
        mark: Mark::Line { points, closed: true, style: Style::Cut },
        data: vec![("wrap", "outline".into())],
    });
    let markers = markers(&mut page, origin - border, origin + placed_size + border);
    let patches = patches(&mut page, colours, corner, paper.size.x - 2.0 * corner.x);
    footer(
        &mut page,
        paper,
        None,
        &format!("{title}  -  wrap sheet: {} periods of {:.3} mm ({:+.2} %)", fit.around, fit.pitch_mm, 100.0 * fit.residual),
        false,
    );
    Ok(Wrap { page, markers, patches, origin })
}

/// The side of a cone rolled out: a sector whose arc is `extent.x` long at the distance `extent.y`, with a seam.
fn sector(extent: DVec2, seam: f64) -> Vec<DVec2> {
    let (side, angle) = (extent.y, extent.x / extent.y);
    let with_seam = angle + seam / side;
    let steps = 120;
    let mut out = vec![DVec2::ZERO];
    out.extend((0..=steps).map(|k| side * DVec2::from_angle(with_seam * f64::from(k) / f64::from(steps))));
    out
}

/// The numbered lines where the periods begin.
fn lines(page: &mut Page, target: Target, fit: Fit, extent: DVec2, at: &impl Fn(DVec2) -> DVec2) {
    let mut numbered = |from: DVec2, to: DVec2, k: u32| {
        let (a, b) = (at(from), at(to));
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Line { points: vec![a, b], closed: false, style: Style::Thin },
            data: vec![("period", k.to_string())],
        });
        let size = (0.45 * fit.pitch_mm).clamp(0.8, 2.5);
        for t in [0.04, 0.96] {
            let text = Mark::Text {
                at: a.lerp(b, t) + DVec2::new(0.6 * size, 0.0),
                size,
                angle: 0.0,
                text: k.to_string(),
                colour: BLACK,
                anchor: 0.5,
            };
            page.add(Layer::Print, text);
        }
    };
    let closed = u32::from(target.closes());
    match target {
        Target::Cone { .. } => {
            for k in 0..=fit.around {
                let direction = DVec2::from_angle(extent.x / extent.y * f64::from(k) / f64::from(fit.around));
                numbered(0.15 * extent.y * direction, extent.y * direction, k % fit.around.max(1) + 1);
            }
        }
        _ => {
            for k in 0..=fit.around {
                let x = extent.x * f64::from(k) / f64::from(fit.around);
                // The line at the seam is the first one again.
                let number = if closed == 1 { k % fit.around + 1 } else { k + 1 };
                numbered(DVec2::new(x, 0.0), DVec2::new(x, extent.y), number);
            }
        }
    }
    if let Target::Box { width, depth, .. } = target {
        for x in [width, width + depth, 2.0 * width + depth] {
            page.line(Layer::Score, Style::Mountain, &[at(DVec2::new(x, 0.0)), at(DVec2::new(x, extent.y))], false);
        }
    }
}

/// Markers along the border of a rectangle: at its corners and in between, so that a few are always seen.
fn markers(page: &mut Page, low: DVec2, high: DVec2) -> Vec<Marker> {
    let size = high - low;
    let pitch = MARKER_PITCH.max(2.0 * (size.x + size.y) / crate::aruco::DICT_5X5_100.len() as f64);
    let count = |length: f64| ((length / pitch).floor() as usize).max(1);
    let (nx, ny) = (count(size.x - MARKER), count(size.y - MARKER));
    let mut places: Vec<DVec2> = Vec::new();
    let first = low + QUIET;
    let last = high - QUIET - MARKER;
    for k in 0..=nx {
        let x = first.x + (last.x - first.x) * k as f64 / nx as f64;
        places.push(DVec2::new(x, first.y));
        places.push(DVec2::new(x, last.y));
    }
    for k in 1..ny {
        let y = first.y + (last.y - first.y) * k as f64 / ny as f64;
        places.push(DVec2::new(first.x, y));
        places.push(DVec2::new(last.x, y));
    }
    places.truncate(crate::aruco::DICT_5X5_100.len());
    let cell = MARKER / CELLS as f64;
    let mut out = Vec::new();
    for (id, corner) in places.into_iter().enumerate() {
        let square = |x: f64, y: f64, s: f64| vec![DVec2::new(x, y), DVec2::new(x + s, y), DVec2::new(x + s, y + s), DVec2::new(x, y + s)];
        page.items.push(Item {
            layer: Layer::Registration,
            mark: Mark::Polygon { points: square(corner.x, corner.y, MARKER), fill: BLACK },
            data: vec![("marker", id.to_string())],
        });
        for row in 0..CELLS {
            for column in (0..CELLS).filter(|&c| is_white(id, row, c)) {
                let (x, y) = (corner.x + column as f64 * cell, corner.y + (CELLS - 1 - row) as f64 * cell);
                page.add(Layer::Registration, Mark::Polygon { points: square(x, y, cell), fill: [255; 3] });
            }
        }
        let (l, h) = (corner, corner + MARKER);
        out.push(Marker { id, corners_mm: [[l.x, h.y], [h.x, h.y], [h.x, l.y], [l.x, l.y]] });
    }
    out
}

/// The colours of the design, a grey wedge, and the paper itself.
fn patches(page: &mut Page, colours: &[[f64; 3]], corner: DVec2, width: f64) -> Vec<Patch> {
    let greys = (0..GREYS).map(|k| ("grey", k, [k as f64 / (GREYS - 1) as f64 * 0.9; 3]));
    let white = std::iter::once(("white", 0, [1.0; 3]));
    let room = ((width / (PATCH + 1.0)).floor() as usize).saturating_sub(GREYS + 1);
    let design = colours.iter().take(room).enumerate().map(|(k, c)| ("design", k, *c));
    let mut out = Vec::new();
    for (k, (kind, index, linear_rgb)) in design.chain(greys).chain(white).enumerate() {
        let low = corner + DVec2::new(k as f64 * (PATCH + 1.0), 0.5);
        let high = low + PATCH;
        let points = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon { points: points.to_vec(), fill: srgb(linear_rgb) },
            data: vec![("patch", format!("{kind}-{index}"))],
        });
        // The paper's own white needs a frame to be found.
        if kind == "white" {
            page.line(Layer::Print, Style::Thin, &points, true);
        }
        out.push(Patch { kind, index, linear_rgb, rectangle_mm: [low.to_array(), high.to_array()] });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_around_a_cylinder_are_whole_and_their_residual_is_told() {
        let target = Target::parse("cylinder:radius=40,height=100").unwrap();
        let fit = target.fit(DVec2::new(4.0, 4.0), 0.1);
        // 2 pi 40.1 / 4 = 62.99 periods: 63 of 3.99937 mm.
        assert_eq!((fit.around, fit.along), (63, 25));
        assert!((fit.pitch_mm - TAU * 40.1 / 63.0).abs() < 1e-12);
        assert!((fit.residual - (TAU * 40.1 / 252.0 - 1.0)).abs() < 1e-12, "{}", fit.residual);
    }

    #[test]
    fn shapes_that_cannot_be_are_refused_with_an_example() {
        for text in [
            "",
            "ball:radius=3",
            "cylinder",
            "cylinder:radius=40",
            "cylinder:radius=0,height=9",
            "cylinder:radius=nan,height=9",
            "cylinder:radius=40,height=100,depth=3",
            "cylinder:radius=40,radius=3,height=1",
            "box:width=3,depth=4",
            "plane:width=3;height=4",
        ] {
            let message = Target::parse(text).unwrap_err().to_string();
            assert!(message.contains("cylinder:radius=40,height=100"), "{text:?}: {message}");
        }
    }
}
