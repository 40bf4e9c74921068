//! How the sheet lies and is cut into pages.

use super::measures::JOIN;
use glam::DVec2;

/// Least size of a page's part of the sheet, mm.
const LEAST_PART: f64 = 40.0;

/// How the sheet lies: turned by a right angle or not, and cut into parts.
pub(super) struct SheetPlan {
    pub(super) low: DVec2,
    pub(super) size: DVec2,
    pub(super) turned: bool,
    /// Where parts begin, and their length, along x and y.
    pub(super) cuts: [Vec<(f64, f64)>; 2],
}

impl SheetPlan {
    pub(super) fn new(outline: &[DVec2], room: DVec2) -> Option<Self> {
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
