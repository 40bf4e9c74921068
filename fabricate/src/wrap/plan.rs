//! How the sheet lies and is cut into pages.

use super::measures::JOIN;
use crate::polygon::bounds;
use glam::DVec2;

/// Least size of a page's part of the sheet, mm. Chosen, not measured: of a smaller one a quarter is glued under the next ([`JOIN`]).
const LEAST_PART: f64 = 40.0;

/// The part of the joined sheet that one page holds.
#[derive(Clone, Copy)]
pub(super) struct PagePart {
    /// The page, from 1.
    pub(super) number: usize,
    /// Lower left and upper right corner on the joined sheet, what reaches under the neighbours included, mm.
    pub(super) area: [DVec2; 2],
    /// From a point of the joined sheet to the page, mm.
    pub(super) shift: DVec2,
    /// Whether its left, lower, right and upper side are sides of the whole sheet.
    pub(super) outer: [bool; 4],
}

/// How the sheet lies: turned by a right angle or not, and cut into parts.
pub(super) struct SheetPlan {
    /// Lowest coordinates of the outline in the target's frame, mm.
    pub(super) low: DVec2,
    /// Width and height of the joined sheet, mm.
    pub(super) size: DVec2,
    /// Whether the periods follow each other upwards.
    pub(super) turned: bool,
    /// Where parts begin, and their length, along x and y.
    pub(super) cuts: [Vec<(f64, f64)>; 2],
}

impl SheetPlan {
    /// The way to lie that takes the fewest pages with `room` each; `None` if there is none.
    pub(super) fn new(outline: &[DVec2], room: DVec2) -> Option<Self> {
        let [low, high] = bounds(outline.iter().copied());
        let size = high - low;
        let plan = |turned: bool| {
            let size = if turned { DVec2::new(size.y, size.x) } else { size };
            let cuts = [cuts(size.x, room.x)?, cuts(size.y, room.y)?];
            Some(Self { low, size, turned, cuts })
        };
        [plan(false), plan(true)].into_iter().flatten().min_by_key(|p| p.pages().iter().product::<usize>())
    }

    /// Columns and rows of pages.
    pub(super) fn pages(&self) -> [usize; 2] {
        [self.cuts[0].len(), self.cuts[1].len()]
    }

    /// The parts of all pages, row by row from below, where each part begins at `origin` on its page.
    pub(super) fn parts(&self, origin: DVec2) -> Vec<PagePart> {
        let [columns, rows] = self.pages();
        let part = |i: usize, j: usize| {
            let ((x, width), (y, height)) = (self.cuts[0][i], self.cuts[1][j]);
            let low = DVec2::new(x, y);
            PagePart {
                number: j * columns + i + 1,
                area: [low, DVec2::new(x + width, y + height)],
                shift: origin - low,
                outer: [i == 0, j == 0, i + 1 == columns, j + 1 == rows],
            }
        };
        (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| part(i, j)).collect()
    }

    /// A point of the target's frame on the joined sheet.
    pub(super) fn at(&self, p: DVec2) -> DVec2 {
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
