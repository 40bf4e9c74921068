//! The sheet that is wrapped around a large object and that the folded material is glued onto (Wu et al. 2011, Fig. 9).
//!
//! It shows where every period begins, by numbered lines; markers around it let a photograph of it be registered, and patches of known
//! colours let printed colours be measured. All of them stay on the sheet when it is cut: around a plane on every side, on what goes
//! around an object above and below the material, never at the seam, where they would cover each other. Only a cone has none.
//!
//! A sheet larger than the page is printed on several, which overlap: each but the last ones reaches under its right and its upper
//! neighbour, up to whose edges lines with crosses lead. Markers stand along the whole sheet's border only. All of it also stands in
//! the sidecar, in mm on the page and on the joined sheet.

use super::aruco::DICT_5X5_100;
use super::clip::clip_segment;
use super::frame::{SheetFrame, cut_out};
use super::joins::joins;
use super::lines::{SheetLine, draw_lines, lines};
use super::markers::{Marker, draw_marker, marker_places};
use super::measures::{BORDER, MARKER, QUIET, STRIP};
use super::patches::{Patch, patches};
use super::plan::{PagePart, SheetPlan};
use super::target::{Target, WrapFit};
use crate::drawing::{Footer, Item, Layer, Mark, Page, Style, footer};
use crate::paper::Paper;
use biscale::error::BadInput;
use glam::DVec2;
use serde::Serialize;

/// Most pages of one sheet: nobody glues more. Chosen, not measured.
const MOST_PAGES: usize = 64;

/// What part of the joined sheet a page holds, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SheetPart {
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
    pub parts: Vec<SheetPart>,
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

/// Draws the wrap sheet.
///
/// # Errors
/// A sheet that takes too many pages.
pub fn wrap(target: Target, fit: WrapFit, thickness: f64, colours: &[[f64; 3]], paper: Paper, title: &str) -> Result<Wrap, BadInput> {
    let outline = target.outline(thickness);
    let plan = plan(&outline, paper)?;
    let frame = SheetFrame::new(target, plan.turned);
    let placed: Vec<DVec2> = outline.iter().map(|&p| plan.at(p)).collect();
    let cut = frame.outline(&placed, plan.size);
    let lines = lines(target, fit, target.extent(thickness));
    let sheet = WholeSheet { plan, frame, placed, cut, lines, fit, colours, paper, title };
    let mut out = Wrap {
        pages: Vec::new(),
        parts: Vec::new(),
        markers: Vec::new(),
        patches: Vec::new(),
        size: sheet.plan.size,
        turned: sheet.plan.turned,
        margins: sheet.frame.margins,
    };
    let mut places: Vec<(PagePart, DVec2)> = Vec::new();
    for part in sheet.plan.parts(origin(paper)) {
        let (page, patches) = sheet.page(&part);
        out.pages.push(page);
        out.patches.extend(patches);
        out.parts.push(SheetPart {
            page: part.number,
            origin_mm: origin(paper).to_array(),
            low_mm: part.area[0].to_array(),
            size_mm: (part.area[1] - part.area[0]).to_array(),
        });
        places.extend(marker_places(&part, &sheet.frame, sheet.plan.size).into_iter().map(|p| (part, p)));
    }
    out.place_markers(&places);
    Ok(out)
}

/// Where the parts of the sheet begin on their pages: beside the markers, above the colour patches.
fn origin(paper: Paper) -> DVec2 {
    paper.area()[0] + DVec2::new(BORDER, BORDER + STRIP)
}

/// How the sheet lies on pages of a paper.
fn plan(outline: &[DVec2], paper: Paper) -> Result<SheetPlan, BadInput> {
    let [_, area] = paper.area();
    let room = area - DVec2::new(2.0 * BORDER, 2.0 * BORDER + STRIP);
    let room = if paper.roll { DVec2::new(room.x, f64::INFINITY) } else { room };
    let too_large = |problem: String| {
        BadInput::new(problem, "take a larger page, such as `page a3` or `page roll:600`, or a smaller target").at_field("on")
    };
    let plan = SheetPlan::new(outline, room)
        .ok_or_else(|| too_large(format!("the page holds {:.0} x {:.0} mm beside the markers of the wrap sheet", room.x, room.y)))?;
    let count: usize = plan.pages().iter().product();
    if count > MOST_PAGES {
        let problem = format!("the wrap sheet of {:.0} x {:.0} mm takes {count} pages, more than {MOST_PAGES}", plan.size.x, plan.size.y);
        return Err(too_large(problem));
    }
    Ok(plan)
}

/// What all pages of a sheet are drawn from.
struct WholeSheet<'a> {
    plan: SheetPlan,
    frame: SheetFrame,
    /// The placed area on the joined sheet.
    placed: Vec<DVec2>,
    /// What is cut out of it.
    cut: Vec<DVec2>,
    lines: Vec<SheetLine>,
    fit: WrapFit,
    colours: &'a [[f64; 3]],
    paper: Paper,
    title: &'a str,
}

impl WholeSheet<'_> {
    /// One page without its markers, and its colour patches.
    fn page(&self, part: &PagePart) -> (Page, Vec<Patch>) {
        let mut page = Page { size: self.paper.size, items: Vec::new() };
        if self.paper.roll {
            let height = part.area[1].y - part.area[0].y;
            page.size.y = (origin(self.paper).y + height + BORDER + self.paper.margin + self.paper.inset).ceil();
        }
        draw_lines(&mut page, &self.plan, &self.lines, part, self.fit.pitch_mm);
        self.draw_borders(&mut page, part);
        joins(&mut page, part, self.plan.pages()[0]);
        let (corner, kept) = self.patch_strip(part);
        let patches = patches(&mut page, self.colours, corner, kept, part.number);
        footer(&mut page, self.paper, Footer { title: &self.footer_text(part), ..Footer::default() });
        (page, patches)
    }

    /// Where the material ends, and the line to cut.
    fn draw_borders(&self, page: &mut Page, part: &PagePart) {
        if self.frame.margins != [0.0; 4] {
            // Where the material ends, inside of what is cut out.
            for k in 0..self.placed.len() {
                let ends = [self.placed[k], self.placed[(k + 1) % self.placed.len()]];
                if let Some(ends) = clip_segment(ends, part.area) {
                    page.line(Layer::Print, Style::Thin, &ends.map(|p| p + part.shift), false);
                }
            }
        }
        for polygon in cut_out(&self.cut, self.frame.part(part.area, part.outer)) {
            page.items.push(Item {
                layer: Layer::Cut,
                mark: Mark::Line { points: polygon.iter().map(|&p| p + part.shift).collect(), closed: true, style: Style::Cut },
                data: vec![("wrap", "outline".into())],
            });
        }
    }

    /// Lower left corner of the colour patches on a page, and the rectangle of what is cut out, if the patches are a part of it.
    fn patch_strip(&self, part: &PagePart) -> (DVec2, [DVec2; 2]) {
        let [corner, _] = self.paper.area();
        let kept = if self.frame.marked[1] && part.outer[1] {
            self.frame.part(part.area, part.outer).map(|p| p + part.shift)
        } else {
            [corner, self.paper.size - corner].map(|p| DVec2::new(p.x, -1.0))
        };
        (DVec2::new(kept[0].x + QUIET, corner.y), kept)
    }

    fn footer_text(&self, part: &PagePart) -> String {
        let count: usize = self.plan.pages().iter().product();
        let several = if count > 1 { format!(", sheet {} of {count}", part.number) } else { String::new() };
        let WrapFit { around, pitch_mm, residual, .. } = self.fit;
        if around == 1 {
            // For any sample: there is no period to follow.
            return format!("{}  -  sheet{several}", self.title);
        }
        format!("{}  -  wrap sheet{several}: {around} periods of {pitch_mm:.3} mm ({:+.2} %)", self.title, 100.0 * residual)
    }
}

impl Wrap {
    /// Draws markers at the places, as many as the dictionary has, evenly.
    fn place_markers(&mut self, places: &[(PagePart, DVec2)]) {
        let every = places.len().div_ceil(DICT_5X5_100.len()).max(1);
        for (id, &(part, low)) in places.iter().step_by(every).enumerate() {
            draw_marker(&mut self.pages[part.number - 1], id, low + part.shift, MARKER);
            let high = low + MARKER;
            let joined = [[low.x, high.y], [high.x, high.y], [high.x, low.y], [low.x, low.y]];
            self.markers.push(Marker {
                id,
                page: part.number,
                corners_mm: joined.map(|[x, y]| [x + part.shift.x, y + part.shift.y]),
                joined_mm: joined,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::clip::clip_segment;
    use super::super::measures::{JOIN, QUIET};
    use super::super::target::SEAM;
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
            let [l, h] = crate::polygon::bounds(all);
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
