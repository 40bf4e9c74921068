//! What is kept around the placed area: which sides have markers, and what is cut out.

use super::measures::{BORDER, STRIP};
use super::target::{SEAM, Target};
use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

/// Sides of the joined sheet in the order left, lower, right, upper: which have markers, and what is cut out beyond the placed area, mm.
pub(super) struct SheetFrame {
    pub(super) marked: [bool; 4],
    pub(super) margins: [f64; 4],
    /// Length of the seam at the right or, where the sheet lies turned, upper side: it is glued under the other end.
    pub(super) seam: DVec2,
}

impl SheetFrame {
    pub(super) fn new(target: Target, turned: bool) -> Self {
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
    pub(super) fn outline(&self, placed: &[DVec2], size: DVec2) -> Vec<DVec2> {
        let [left, lower, right, upper] = self.margins;
        if self.margins.iter().all(|m| *m == 0.0) {
            return placed.to_vec();
        }
        let (low, high) = (DVec2::new(-left, -lower), size + DVec2::new(right, upper));
        vec![low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)]
    }

    /// The part of what is cut out that a page holds: beyond its part at the outer sides.
    pub(super) fn part(&self, [low, high]: [DVec2; 2], outer: [bool; 4]) -> [DVec2; 2] {
        let beyond = |k: usize| if outer[k] { self.margins[k] } else { 0.0 };
        [low - DVec2::new(beyond(0), beyond(1)), high + DVec2::new(beyond(2), beyond(3))]
    }
}

/// The part of the sheet within a rectangle.
pub(super) fn cut_out(outline: &[DVec2], [low, high]: [DVec2; 2]) -> Vec<Vec<DVec2>> {
    let whole = outline.iter().all(|p| p.cmpge(low - 1e-9).all() && p.cmple(high + 1e-9).all());
    if whole {
        return vec![outline.to_vec()];
    }
    let polygon: Vec<[f64; 2]> = outline.iter().map(|p| p.to_array()).collect();
    let rectangle = vec![[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
    let shapes = polygon.overlay(&rectangle, OverlayRule::Intersect, FillRule::NonZero);
    shapes.into_iter().flatten().map(|contour| contour.into_iter().map(DVec2::from_array).collect()).collect()
}
