//! The sheet that is wrapped around a large object and that the folded material is glued onto (Wu et al. 2011, Fig. 9).
//!
//! It shows where every period begins, by numbered lines; markers around it let a photograph of it be registered, and patches of known
//! colours let printed colours be measured. All of them stay on the sheet when it is cut: around a plane on every side, on what goes around an object above
//! and below the material, never at the seam, where they would cover each other. Only a cone has none. A sheet larger than the page is printed on several, which overlap: each but the last ones reaches
//! under its right and its upper neighbour, up to whose edges lines with crosses lead. Markers stand along the whole sheet's border only. All of it also
//! stands in the sidecar, in mm on the page and on the joined sheet.

use crate::aruco::{CELLS, DICT_5X5_100, is_white};
use crate::drawing::{BLACK, Item, Layer, Mark, Page, Style, srgb};
use crate::layout::Paper;
use crate::sheets::footer;
use crate::target::{Fit, SEAM, Target};
use biscale::error::BadInput;
use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;
use serde::Serialize;

/// Side of a marker with its frame, mm, and the white around it.
const MARKER: f64 = 14.0;
const QUIET: f64 = 2.0;
/// What markers take on each side, mm.
const BORDER: f64 = MARKER + 2.0 * QUIET;
/// Distance of markers, about, mm: from every side of a cylinder several columns are seen.
const SPACING: f64 = 20.0;
/// Side of a colour patch, mm.
const PATCH: f64 = 8.0;
/// Height of the strip of patches, mm.
const STRIP: f64 = PATCH + 4.0;
/// Steps of the grey wedge.
const GREYS: usize = 6;
/// How far a page of several reaches under the next one, mm.
pub const JOIN: f64 = 10.0;
/// Least size of a page's part of the sheet, mm.
const LEAST_PART: f64 = 40.0;
/// Most pages of one sheet: nobody glues more.
const MOST_PAGES: usize = 64;

/// A marker on a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Marker {
    /// Number in the dictionary `DICT_5X5_100`.
    pub id: usize,
    /// The page, from 1.
    pub page: usize,
    /// Corners from its own upper left clockwise, mm, y up from the page's lower left corner.
    pub corners_mm: [[f64; 2]; 4],
    /// The same from the lower left corner of the joined sheet.
    pub joined_mm: [[f64; 2]; 4],
}

/// A colour patch on a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Patch {
    /// `design`, `grey` or `white`.
    pub kind: &'static str,
    /// Its place among its kind.
    pub index: usize,
    /// The page, from 1.
    pub page: usize,
    /// What was sent to the printer, linear RGB.
    pub linear_rgb: [f64; 3],
    /// Whether it is still on the sheet when that is cut out; else it is photographed by itself.
    pub kept: bool,
    /// Lower left and upper right corner, mm.
    pub rectangle_mm: [[f64; 2]; 2],
}

/// What part of the joined sheet a page holds, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Part {
    /// The page, from 1.
    pub page: usize,
    /// Where the part's lower left corner lies on the page.
    pub origin_mm: [f64; 2],
    /// Where it lies on the joined sheet.
    pub low_mm: [f64; 2],
    /// Its width and height, what reaches under its neighbours included.
    pub size_mm: [f64; 2],
}

/// The sheet, and what a camera needs to know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrap {
    /// The pages.
    pub pages: Vec<Page>,
    /// What each of them holds.
    pub parts: Vec<Part>,
    /// Markers of all pages.
    pub markers: Vec<Marker>,
    /// Colour patches of all pages.
    pub patches: Vec<Patch>,
    /// Width and height of the joined sheet, mm.
    pub size: DVec2,
    /// Whether the periods follow each other upwards on it, and not to the right.
    pub turned: bool,
    /// What is cut out: how far beyond the placed area to the left, below, to the right and above, mm.
    pub margins: [f64; 4],
}

/// How the sheet lies: turned by a right angle or not, and cut into parts.
struct Plan {
    low: DVec2,
    size: DVec2,
    turned: bool,
    /// Where parts begin, and their length, along x and y.
    cuts: [Vec<(f64, f64)>; 2],
}

impl Plan {
    fn new(outline: &[DVec2], room: DVec2) -> Option<Self> {
        let (low, high) = outline.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let size = high - low;
        let plan = |turned: bool| {
            let size = if turned { DVec2::new(size.y, size.x) } else { size };
            let cuts = [cuts(size.x, room.x)?, cuts(size.y, room.y)?];
            Some(Self { low, size, turned, cuts })
        };
        let pages = |p: &Self| p.cuts[0].len() * p.cuts[1].len();
        [plan(false), plan(true)].into_iter().flatten().min_by_key(pages)
    }

    /// A point of the target's frame on the joined sheet.
    fn at(&self, p: DVec2) -> DVec2 {
        let p = p - self.low;
        if self.turned { DVec2::new(self.size.x - p.y, p.x) } else { p }
    }
}

/// Parts of a length that fit a page and overlap by [`JOIN`]; all but the last are of one length.
fn cuts(length: f64, room: f64) -> Option<Vec<(f64, f64)>> {
    if length <= room {
        return Some(vec![(0.0, length)]);
    }
    if room < LEAST_PART {
        return None;
    }
    let count = ((length - JOIN) / (room - JOIN)).ceil();
    let own = (length - JOIN) / count;
    Some((0..count as usize).map(|k| (own * k as f64, own + JOIN)).collect())
}

/// Draws the wrap sheet.
///
/// # Errors
/// A sheet that takes too many pages.
pub fn wrap(target: Target, fit: Fit, thickness: f64, colours: &[[f64; 3]], paper: Paper, title: &str) -> Result<Wrap, BadInput> {
    let [corner, area] = paper.area();
    let room = area - DVec2::new(2.0 * BORDER, 2.0 * BORDER + STRIP);
    let room = if paper.roll { DVec2::new(room.x, f64::INFINITY) } else { room };
    let outline = target.outline(thickness);
    let too_large =
        |problem: String| BadInput::new(problem, "take a larger page, such as --page a3 or roll:600, or a smaller target").at_field("--on");
    let Some(plan) = Plan::new(&outline, room) else {
        let problem = format!("the page holds {:.0} x {:.0} mm beside the markers of the wrap sheet", room.x, room.y);
        return Err(too_large(problem));
    };
    let [columns, rows] = [plan.cuts[0].len(), plan.cuts[1].len()];
    let count = columns * rows;
    if count > MOST_PAGES {
        let problem = format!("the wrap sheet of {:.0} x {:.0} mm takes {count} pages, more than {MOST_PAGES}", plan.size.x, plan.size.y);
        return Err(too_large(problem));
    }
    let joined: Vec<DVec2> = outline.iter().map(|&p| plan.at(p)).collect();
    let lines = lines(target, fit, target.extent(thickness));
    let frame = Frame::new(target, plan.turned);
    let outline = frame.outline(&joined, plan.size);
    let mut out = Wrap {
        pages: Vec::new(),
        parts: Vec::new(),
        markers: Vec::new(),
        patches: Vec::new(),
        size: plan.size,
        turned: plan.turned,
        margins: frame.margins,
    };
    let origin = corner + DVec2::new(BORDER, BORDER + STRIP);
    let mut places: Vec<(usize, DVec2)> = Vec::new();
    for (j, &(y, height)) in plan.cuts[1].iter().enumerate() {
        for (i, &(x, width)) in plan.cuts[0].iter().enumerate() {
            let part = [DVec2::new(x, y), DVec2::new(x + width, y + height)];
            let number = out.pages.len() + 1;
            let mut page = Page { size: paper.size, items: Vec::new() };
            if paper.roll {
                page.size.y = (origin.y + height + BORDER + paper.margin + paper.inset).ceil();
            }
            let shift = origin - part[0];
            let outer = [i == 0, j == 0, i + 1 == columns, j + 1 == rows];
            draw_lines(&mut page, &plan, &lines, part, shift, fit.pitch_mm);
            if frame.margins != [0.0; 4] {
                // Where the material ends, inside of what is cut out.
                for k in 0..joined.len() {
                    let ends = [joined[k], joined[(k + 1) % joined.len()]];
                    if let Some(ends) = clip_segment(ends, part) {
                        page.line(Layer::Print, Style::Thin, &ends.map(|p| p + shift), false);
                    }
                }
            }
            let room = frame.part(part, outer);
            for polygon in cut_out(&outline, room) {
                page.items.push(Item {
                    layer: Layer::Cut,
                    mark: Mark::Line { points: polygon.iter().map(|&p| p + shift).collect(), closed: true, style: Style::Cut },
                    data: vec![("wrap", "outline".into())],
                });
            }
            joins(&mut page, part, shift, [i + 1 < columns, j + 1 < rows], [i > 0, j > 0], number, columns);
            places.extend(marker_places(part, outer, &frame, plan.size).into_iter().map(|p| (number, p)));
            // From the left edge of what is cut out, if the strip is a part of it.
            let strip = if frame.marked[1] && j == 0 {
                room.map(|p| p + shift)
            } else {
                [corner, paper.size - corner].map(|p| DVec2::new(p.x, -1.0))
            };
            out.patches.extend(patches(&mut page, colours, DVec2::new(strip[0].x + QUIET, corner.y), strip, number));
            let several = if count > 1 { format!(", sheet {number} of {count}") } else { String::new() };
            footer(
                &mut page,
                paper,
                None,
                &format!(
                    "{title}  -  wrap sheet{several}: {} periods of {:.3} mm ({:+.2} %)",
                    fit.around,
                    fit.pitch_mm,
                    100.0 * fit.residual
                ),
                false,
            );
            out.parts.push(Part {
                page: number,
                origin_mm: origin.to_array(),
                low_mm: part[0].to_array(),
                size_mm: (part[1] - part[0]).to_array(),
            });
            out.pages.push(page);
        }
    }
    // As many as the dictionary has, evenly.
    let every = places.len().div_ceil(DICT_5X5_100.len()).max(1);
    for (id, &(number, low)) in places.iter().step_by(every).enumerate() {
        let shift = origin - DVec2::from_array(out.parts[number - 1].low_mm);
        draw_marker(&mut out.pages[number - 1], id, low + shift);
        let (l, h) = (low, low + MARKER);
        let joined = [[l.x, h.y], [h.x, h.y], [h.x, l.y], [l.x, l.y]];
        out.markers.push(Marker { id, page: number, corners_mm: joined.map(|[x, y]| [x + shift.x, y + shift.y]), joined_mm: joined });
    }
    Ok(out)
}

/// Sides of the joined sheet in the order left, lower, right, upper: which have markers, and what is cut out beyond the placed area, mm.
struct Frame {
    marked: [bool; 4],
    margins: [f64; 4],
    /// Length of the seam at the right or, where the sheet lies turned, upper side: it is glued under the other end.
    seam: DVec2,
}

impl Frame {
    fn new(target: Target, turned: bool) -> Self {
        let marked = match target {
            Target::Plane { .. } => [true; 4],
            // What leads around the object meets itself: nothing may stand there.
            Target::Cylinder { .. } | Target::Box { .. } => [turned, !turned, turned, !turned],
            Target::Cone { .. } => [false; 4],
        };
        let mut margins = marked.map(|m| if m { BORDER } else { 0.0 });
        if marked[1] {
            // The strip of patches lies below.
            margins[1] += STRIP;
        }
        let seam = if target.closes() { SEAM } else { 0.0 };
        Self { marked, margins, seam: if turned { DVec2::new(0.0, seam) } else { DVec2::new(seam, 0.0) } }
    }

    /// What is cut out of the joined sheet: the placed area and what is kept around it.
    fn outline(&self, placed: &[DVec2], size: DVec2) -> Vec<DVec2> {
        let [left, lower, right, upper] = self.margins;
        if self.margins.iter().all(|m| *m == 0.0) {
            return placed.to_vec();
        }
        let (low, high) = (DVec2::new(-left, -lower), size + DVec2::new(right, upper));
        vec![low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)]
    }

    /// The part of what is cut out that a page holds: beyond its part at the outer sides.
    fn part(&self, [low, high]: [DVec2; 2], outer: [bool; 4]) -> [DVec2; 2] {
        let beyond = |k: usize| if outer[k] { self.margins[k] } else { 0.0 };
        [low - DVec2::new(beyond(0), beyond(1)), high + DVec2::new(beyond(2), beyond(3))]
    }
}

/// A line of the sheet in the target's frame: where a period begins, or a fold.
enum Line {
    Period { ends: [DVec2; 2], number: u32 },
    Fold([DVec2; 2]),
}

/// The numbered lines where the periods begin, and a box's folds.
fn lines(target: Target, fit: Fit, extent: DVec2) -> Vec<Line> {
    // The line at the seam is the first one again.
    let number = |k: u32| if target.closes() { k % fit.around.max(1) + 1 } else { k + 1 };
    let share = |k: u32| f64::from(k) / f64::from(fit.around);
    let ends = |k: u32| match target {
        Target::Cone { .. } => {
            let direction = DVec2::from_angle(extent.x / extent.y * share(k));
            [0.15 * extent.y * direction, extent.y * direction]
        }
        _ => [0.0, extent.y].map(|y| DVec2::new(extent.x * share(k), y)),
    };
    let mut out: Vec<Line> = (0..=fit.around).map(|k| Line::Period { ends: ends(k), number: number(k) }).collect();
    if let Target::Box { width, depth, .. } = target {
        let folds = [width, width + depth, 2.0 * width + depth, 2.0 * (width + depth)];
        out.extend(folds.map(|x| Line::Fold([0.0, extent.y].map(|y| DVec2::new(x, y)))));
    }
    out
}

fn draw_lines(page: &mut Page, plan: &Plan, lines: &[Line], part: [DVec2; 2], shift: DVec2, pitch: f64) {
    for line in lines {
        let (Line::Period { ends, .. } | Line::Fold(ends)) = line;
        let Some([a, b]) = clip_segment(ends.map(|p| plan.at(p)), part).map(|ends| ends.map(|p| p + shift)) else { continue };
        let Line::Period { number, .. } = line else {
            page.line(Layer::Score, Style::Mountain, &[a, b], false);
            continue;
        };
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Line { points: vec![a, b], closed: false, style: Style::Thin },
            data: vec![("period", number.to_string())],
        });
        let size = (0.45 * pitch).clamp(0.8, 2.5);
        // Beside the line, at both of its ends.
        let aside = (b - a).normalize_or(DVec2::Y).perp();
        let aside = if aside.x + 1e-9 * aside.y < 0.0 { -aside } else { aside };
        for t in [0.04, 0.96] {
            let at = a.lerp(b, t) + 0.6 * size * aside;
            page.add(Layer::Print, Mark::Text { at, size, angle: 0.0, text: number.to_string(), colour: BLACK, anchor: 0.5 });
        }
    }
}

/// The part of a segment within a rectangle (Liang and Barsky 1984), if it is longer than a dot.
fn clip_segment([a, b]: [DVec2; 2], [low, high]: [DVec2; 2]) -> Option<[DVec2; 2]> {
    let along = b - a;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (p, d, l, h) in [(a.x, along.x, low.x, high.x), (a.y, along.y, low.y, high.y)] {
        if d.abs() < 1e-12 {
            if p < l - 1e-9 || p > h + 1e-9 {
                return None;
            }
            continue;
        }
        let (s, t) = ((l - p) / d, (h - p) / d);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    ((to - from) * along.length() > 0.1).then(|| [a + from * along, a + to * along])
}

/// The part of the sheet within a rectangle.
fn cut_out(outline: &[DVec2], [low, high]: [DVec2; 2]) -> Vec<Vec<DVec2>> {
    let whole = outline.iter().all(|p| p.cmpge(low - 1e-9).all() && p.cmple(high + 1e-9).all());
    if whole {
        return vec![outline.to_vec()];
    }
    let polygon: Vec<[f64; 2]> = outline.iter().map(|p| p.to_array()).collect();
    let rectangle = vec![[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
    let shapes = polygon.overlay(&rectangle, OverlayRule::Intersect, FillRule::NonZero);
    shapes.into_iter().flatten().map(|contour| contour.into_iter().map(DVec2::from_array).collect()).collect()
}

/// Where the neighbours' edges come to lie, with crosses that both sheets have.
fn joins(page: &mut Page, [low, high]: [DVec2; 2], shift: DVec2, after: [bool; 2], before: [bool; 2], number: usize, columns: usize) {
    for axis in 0..2 {
        let along = if axis == 0 { DVec2::Y } else { DVec2::X };
        let across = DVec2::new(along.y, along.x);
        let (from, to) = (low.dot(along), high.dot(along));
        let mut edge = |at: f64, line: bool| {
            let point = |s: f64| at * across + s * along + shift;
            if line {
                page.line(Layer::Registration, Style::Thin, &[point(from), point(to)], false);
                let (next, turn) = if axis == 0 { (number + 1, std::f64::consts::FRAC_PI_2) } else { (number + columns, 0.0) };
                let text = format!("the edge of sheet {next} comes here");
                let at = point(0.5 * (from + to)) + 0.5 * JOIN * across;
                page.add(Layer::Print, Mark::Text { at, size: 3.0, angle: turn, text, colour: BLACK, anchor: 0.5 });
            }
            for k in 0..4 {
                // At places of the joined sheet, so that the halves on both sheets meet.
                let s = from + (to - from) * (0.5 + f64::from(k)) / 4.0;
                for arm in [along, across] {
                    let arm = [point(s) - CROSS * arm, point(s) + CROSS * arm];
                    let inside = clip_segment(arm.map(|p| p - shift), [low, high]);
                    if let Some(ends) = inside {
                        page.line(Layer::Registration, Style::Bold, &ends.map(|p| p + shift), false);
                    }
                }
            }
        };
        if after[axis] {
            edge(high.dot(across) - JOIN, true);
        }
        if before[axis] {
            edge(low.dot(across), false);
        }
    }
}

/// Length of an arm of a cross, mm.
const CROSS: f64 = 4.0;

/// Lower left corners of markers beside the outer sides of a part (left, lower, right, upper), on the joined sheet.
fn marker_places([low, high]: [DVec2; 2], outer: [bool; 4], frame: &Frame, size: DVec2) -> Vec<DVec2> {
    let [left, lower, right, upper]: [bool; 4] = std::array::from_fn(|k| outer[k] && frame.marked[k]);
    // From the corner beyond an outer side, or from the side itself where the neighbour goes on, or the sheet meets itself; the seam is covered.
    let start = |there: bool, low: f64| if there { low - BORDER } else { low };
    let end = |there: bool, outer: bool, high: f64, whole: f64| match (there, outer) {
        (true, _) => high + BORDER,
        (false, true) => whole,
        (false, false) => high - JOIN,
    };
    let whole = size - frame.seam;
    let first = DVec2::new(start(left, low.x), start(lower, low.y)) + QUIET;
    let last = DVec2::new(end(right, outer[2], high.x, whole.x), end(upper, outer[3], high.y, whole.y)) - QUIET - MARKER;
    if last.x < first.x || last.y < first.y {
        return Vec::new();
    }
    // Two need a length of their own and the white between them.
    let count = |length: f64| ((length / SPACING).floor() as usize).max(usize::from(length >= MARKER + QUIET));
    let (nx, ny) = (count(last.x - first.x), count(last.y - first.y));
    let mut places = Vec::new();
    for k in 0..=nx {
        let x = first.x + (last.x - first.x) * k as f64 / nx.max(1) as f64;
        for (y, there) in [(low.y - BORDER + QUIET, lower), (high.y + QUIET, upper)] {
            if there {
                places.push(DVec2::new(x, y));
            }
        }
    }
    for k in 0..=ny {
        let y = first.y + (last.y - first.y) * k as f64 / ny.max(1) as f64;
        // The corners stand there already.
        if (k == 0 && lower) || (k == ny && upper) {
            continue;
        }
        for (x, there) in [(low.x - BORDER + QUIET, left), (high.x + QUIET, right)] {
            if there {
                places.push(DVec2::new(x, y));
            }
        }
    }
    places
}

fn draw_marker(page: &mut Page, id: usize, corner: DVec2) {
    let cell = MARKER / CELLS as f64;
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
}

/// The colours of the design, a grey wedge, and the paper itself; `kept` is what is cut out.
fn patches(page: &mut Page, colours: &[[f64; 3]], corner: DVec2, kept: [DVec2; 2], number: usize) -> Vec<Patch> {
    let greys = (0..GREYS).map(|k| ("grey", k, [k as f64 / (GREYS - 1) as f64 * 0.9; 3]));
    let white = std::iter::once(("white", 0, [1.0; 3]));
    let room = (((kept[1].x - corner.x) / (PATCH + 1.0)).floor() as usize).saturating_sub(GREYS + 1);
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
        let kept = low.cmpge(kept[0] - 1e-9).all() && high.cmple(kept[1] + 1e-9).all();
        out.push(Patch { kind, index, page: number, linear_rgb, kept, rectangle_mm: [low.to_array(), high.to_array()] });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const A4: Paper = Paper { name: "a4", size: DVec2::new(210.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };

    fn sheet(text: &str, paper: Paper) -> Wrap {
        let target = Target::parse(text).unwrap();
        let fit = target.fit(DVec2::splat(4.0), 0.1);
        wrap(target, fit, 0.1, &[[0.5; 3]], paper, "t").unwrap()
    }

    #[test]
    fn parts_cover_the_sheet_and_overlap_by_what_is_glued() {
        let wrap = sheet("cylinder:radius=60,height=300", A4);
        assert!((wrap.size.max_element() - (std::f64::consts::TAU * 60.1 + 10.0)).abs() < 1e-9);
        assert!(wrap.pages.len() > 3, "{}", wrap.pages.len());
        for axis in 0..2 {
            let mut spans: Vec<[f64; 2]> = wrap.parts.iter().map(|p| [p.low_mm[axis], p.low_mm[axis] + p.size_mm[axis]]).collect();
            spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
            spans.dedup();
            assert!(spans[0][0] == 0.0 && (spans[spans.len() - 1][1] - wrap.size[axis]).abs() < 1e-9, "{spans:?}");
            assert!(spans.windows(2).all(|w| (w[0][1] - w[1][0] - JOIN).abs() < 1e-9), "{spans:?}");
        }
        // One place in two frames: pages lie where their parts do.
        for marker in &wrap.markers {
            let part = &wrap.parts[marker.page - 1];
            for (on_page, joined) in marker.corners_mm.iter().zip(&marker.joined_mm) {
                for axis in 0..2 {
                    let moved = on_page[axis] - part.origin_mm[axis] + part.low_mm[axis];
                    assert!((moved - joined[axis]).abs() < 1e-9);
                }
            }
            // Beside the joined sheet, never on it.
            let [[l, _], _, _, [_, b]] = marker.joined_mm;
            let apart = l >= wrap.size.x || b >= wrap.size.y || l + MARKER <= 0.0 || b + MARKER <= 0.0;
            assert!(apart, "{marker:?}");
        }
        assert!(wrap.markers.iter().enumerate().all(|(k, m)| m.id == k));
    }

    #[test]
    fn who_cuts_along_the_line_keeps_all_markers_and_no_two_cover_each_other() {
        let pages = [A4, Paper { name: "a3", size: DVec2::new(297.0, 420.0), ..A4 }];
        let objects =
            ["plane:width=100,height=80", "cylinder:radius=30,height=70", "cylinder:radius=5,height=60", "box:width=30,depth=20,height=60"];
        for (object, paper) in objects.iter().flat_map(|o| pages.iter().map(move |p| (*o, *p))) {
            let wrap = sheet(object, paper);
            let [left, lower, right, upper] = wrap.margins;
            let (low, high) = (DVec2::new(-left, -lower), wrap.size + DVec2::new(right, upper));
            assert!(wrap.markers.len() >= 2, "{object}: {}", wrap.markers.len());
            let seam = if object.starts_with("plane") { 0.0 } else { SEAM };
            let covered = wrap.size - if wrap.turned { DVec2::new(0.0, seam) } else { DVec2::new(seam, 0.0) };
            let rectangles: Vec<[DVec2; 2]> =
                wrap.markers.iter().map(|m| [DVec2::from_array(m.joined_mm[3]), DVec2::from_array(m.joined_mm[1])]).collect();
            for (k, [l, h]) in rectangles.iter().enumerate() {
                let inside = l.cmpge(low + QUIET - 1e-9).all() && h.cmple(high - QUIET + 1e-9).all();
                assert!(inside, "{object} on {}: marker {k} at {l} is cut off", paper.name);
                // Around an object the other end of the sheet lies on the seam.
                let along = if wrap.turned { (h.y, covered.y) } else { (h.x, covered.x) };
                assert!(seam == 0.0 || along.0 <= along.1 + 1e-9, "{object}: marker {k} lies on the seam");
                for [l2, h2] in &rectangles[..k] {
                    let apart = (*l2 - *h).max(*l - *h2).max_element();
                    assert!(apart >= QUIET - 1e-9, "{object} on {}: two markers are {apart} mm apart", paper.name);
                }
            }
            // The line that is cut is on the pages, and reaches as far.
            let cut = |page: &Page| -> Vec<DVec2> {
                let of_cut = page.items.iter().filter(|i| i.layer == Layer::Cut);
                of_cut.flat_map(|i| if let Mark::Line { points, .. } = &i.mark { points.clone() } else { Vec::new() }).collect()
            };
            let all = wrap.pages.iter().zip(&wrap.parts).flat_map(|(page, part)| {
                let shift = DVec2::from_array(part.low_mm) - DVec2::from_array(part.origin_mm);
                cut(page).into_iter().map(move |p| p + shift)
            });
            let (l, h) = all.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
            assert!(l.distance(low) < 1e-3 && h.distance(high) < 1e-3, "{object}: {l} to {h}, not {low} to {high}");
        }
        let cone = sheet("cone:radius=30,height=50", A4);
        assert!(cone.markers.is_empty() && cone.margins == [0.0; 4] && cone.patches.iter().all(|p| !p.kept));
        let plane = sheet("plane:width=100,height=80", A4);
        assert!(plane.patches.iter().all(|p| p.kept), "{:?}", plane.patches);
    }

    #[test]
    fn every_period_line_is_whole_over_the_parts() {
        let wrap = sheet("cylinder:radius=60,height=120", A4);
        let mut length = std::collections::BTreeMap::<String, f64>::new();
        for (page, part) in wrap.pages.iter().zip(&wrap.parts) {
            // What reaches under the next sheet is there again.
            let end = [0, 1].map(|k| part.low_mm[k] + part.size_mm[k]);
            let last = [0, 1].map(|k| (end[k] - wrap.size[k]).abs() < 1e-9);
            let own = DVec2::new(part.size_mm[0] - if last[0] { 0.0 } else { JOIN }, part.size_mm[1] - if last[1] { 0.0 } else { JOIN });
            let low = DVec2::from_array(part.origin_mm);
            for item in page.items.iter().filter(|i| i.data.iter().any(|(k, _)| *k == "period")) {
                let Mark::Line { points, .. } = &item.mark else { continue };
                if let Some([a, b]) = clip_segment([points[0], points[1]], [low, low + own - 1e-7]) {
                    *length.entry(item.data[0].1.clone()).or_default() += a.distance(b);
                }
            }
        }
        let periods = (std::f64::consts::TAU * 60.1 / 4.0).round() as usize;
        assert_eq!(length.len(), periods);
        // The first line stands at both ends of the seam.
        assert!(length.iter().all(|(k, l)| (l - if k == "1" { 240.0 } else { 120.0 }).abs() < 1e-3), "{length:?}");
    }

    #[test]
    fn a_cone_larger_than_the_page_is_cut_too_and_sheets_beyond_all_measure_are_refused() {
        let wrap = sheet("cone:radius=80,height=150", A4);
        assert!(wrap.pages.len() > 1);
        let target = Target::parse("cylinder:radius=2000,height=9000").unwrap();
        let fit = target.fit(DVec2::splat(40.0), 0.1);
        let message = super::wrap(target, fit, 0.1, &[], A4, "t").unwrap_err().to_string();
        assert!(message.contains("pages") && message.contains("roll"), "{message}");
    }
}
