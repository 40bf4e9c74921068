//! Markers beside the sheet.

use super::aruco::{CELLS, is_white};
use super::frame::SheetFrame;
use super::measures::{BORDER, JOIN, MARKER, QUIET};
use super::plan::PagePart;
use crate::drawing::{BLACK, Item, Layer, Mark, Page, WHITE};
use glam::DVec2;
use serde::Serialize;

/// Distance of markers, about, mm: from every side of a cylinder several columns are seen. Chosen, not measured: closer ones would leave
/// no white between them, see [`MARKER`] and [`QUIET`].
const SPACING: f64 = 20.0;

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

/// Lower left corners of markers beside the outer sides of a part (left, lower, right, upper), on the joined sheet.
pub(super) fn marker_places(part: &PagePart, frame: &SheetFrame, size: DVec2) -> Vec<DVec2> {
    let PagePart { area: [low, high], outer, .. } = *part;
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

/// Draws a marker whose lower left corner and side are these, mm.
pub(super) fn draw_marker(page: &mut Page, id: usize, corner: DVec2, side: f64) {
    let cell = side / CELLS as f64;
    let square = |x: f64, y: f64, s: f64| vec![DVec2::new(x, y), DVec2::new(x + s, y), DVec2::new(x + s, y + s), DVec2::new(x, y + s)];
    page.items.push(Item {
        layer: Layer::Registration,
        mark: Mark::Polygon { points: square(corner.x, corner.y, side), fill: BLACK },
        data: vec![("marker", id.to_string())],
    });
    for row in 0..CELLS {
        for column in (0..CELLS).filter(|&c| is_white(id, row, c)) {
            let (x, y) = (corner.x + column as f64 * cell, corner.y + (CELLS - 1 - row) as f64 * cell);
            page.add(Layer::Registration, Mark::Polygon { points: square(x, y, cell), fill: WHITE });
        }
    }
}
