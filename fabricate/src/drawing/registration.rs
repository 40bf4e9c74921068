//! Marks that cutters look for.

use super::page::{BLACK, Item, Layer, Mark, Page, Style};
use crate::paper::Paper;
use glam::DVec2;

/// Length of the lines of registration marks, mm; the square at the upper left has sides of 5.
const SILHOUETTE_LENGTH: f64 = 20.0;

/// What registration marks take from the area on each side, mm: the square of 5 mm and white around it. Chosen, not measured.
pub const SILHOUETTE_INSET: f64 = 11.0;

/// The marks that Silhouette's cutters look for: a square of 5 mm at the upper left, two corners of 20 mm lines .5 mm thick.
pub(super) fn silhouette(page: &mut Page, paper: Paper) {
    let m = paper.margin;
    let (w, h) = (page.size.x, page.size.y);
    let square = [DVec2::new(m, h - m - 5.0), DVec2::new(m + 5.0, h - m - 5.0), DVec2::new(m + 5.0, h - m), DVec2::new(m, h - m)];
    let mut add = |mark| page.items.push(Item { layer: Layer::Registration, mark, data: vec![("registration", "silhouette".to_owned())] });
    add(Mark::Polygon { points: square.to_vec(), fill: BLACK });
    let line = |at: DVec2, x: f64, y: f64| Mark::Line {
        points: vec![at + DVec2::new(x, 0.0), at, at + DVec2::new(0.0, y)],
        closed: false,
        style: Style::Bold,
    };
    add(line(DVec2::new(w - m - 0.25, h - m - 0.25), -SILHOUETTE_LENGTH, -SILHOUETTE_LENGTH));
    add(line(DVec2::new(m + 0.25, m + 0.25), SILHOUETTE_LENGTH, SILHOUETTE_LENGTH));
}
