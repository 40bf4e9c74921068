//! The calibration board: markers in the white squares of a chessboard (`ChArUco`), for the camera that photographs a sheet.

use super::markers::draw_marker;
use crate::drawing::{BLACK, Footer, Layer, Mark, Page, footer};
use crate::paper::Paper;
use biscale::error::BadInput;
use glam::DVec2;

/// A board to draw; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardDesign {
    /// Squares across.
    pub columns: usize,
    /// Squares down.
    pub rows: usize,
    /// Side of a square.
    pub square: f64,
    /// Side of a marker.
    pub marker: f64,
    /// Number of the first marker in `DICT_5X5_100`; they go on row by row from the upper left.
    pub first_id: usize,
}

/// Draws a board in the middle of a page, the upper left square black, with the bar of 100 mm below.
///
/// # Errors
/// A page that it does not fit on.
pub fn board_page(board: BoardDesign, paper: Paper, title: &str) -> Result<Page, BadInput> {
    let size = board.square * DVec2::new(board.columns as f64, board.rows as f64);
    let [low, area] = paper.area();
    if size.cmpgt(area).any() {
        let problem =
            format!("the board of {} x {} mm does not fit on the page, which holds {:.0} x {:.0} mm", size.x, size.y, area.x, area.y);
        return Err(BadInput::new(problem, "take a larger page, such as a4, letter or a3, or a smaller margin").at_field("page"));
    }
    let height = if paper.roll { (low.y + size.y + low.x).ceil() } else { paper.size.y };
    let mut page = Page { size: DVec2::new(paper.size.x, height), items: Vec::new() };
    let free = if paper.roll { DVec2::new(area.x - size.x, 0.0) } else { area - size };
    let upper_left = low + 0.5 * free + DVec2::new(0.0, size.y);
    let gap = 0.5 * (board.square - board.marker);
    let mut id = board.first_id;
    for row in 0..board.rows {
        for column in 0..board.columns {
            let corner = upper_left + board.square * DVec2::new(column as f64, -(row as f64) - 1.0);
            if (row + column) % 2 == 0 {
                let s = board.square;
                let points = [(0.0, 0.0), (s, 0.0), (s, s), (0.0, s)].map(|p| corner + DVec2::from(p)).to_vec();
                page.add(Layer::Registration, Mark::Polygon { points, fill: BLACK });
            } else {
                draw_marker(&mut page, id, corner + gap, board.marker);
                id += 1;
            }
        }
    }
    footer(&mut page, paper, Footer { title, ..Footer::default() });
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_and_markers_lie_where_the_board_says() {
        let board = BoardDesign { columns: 6, rows: 8, square: 30.0, marker: 22.0, first_id: 76 };
        for (name, size) in [("a4", DVec2::new(210.0, 297.0)), ("letter", DVec2::new(215.9, 279.4))] {
            let paper = Paper { name, size, roll: false, margin: 10.0, inset: 0.0 };
            let page = board_page(board, paper, "t").unwrap();
            let ids: Vec<&str> = page.items.iter().flat_map(|i| &i.data).filter(|d| d.0 == "marker").map(|d| &*d.1).collect();
            assert_eq!((ids.len(), ids[0], ids[23]), (24, "76", "99"), "{name}");
            let [low, high] = crate::polygon::bounds(
                page.items
                    .iter()
                    .filter(|i| i.layer == Layer::Registration)
                    .flat_map(|i| if let Mark::Polygon { points, .. } = &i.mark { points.clone() } else { Vec::new() }),
            );
            assert!((high - low).distance(DVec2::new(180.0, 240.0)) < 1e-9, "{name}");
            assert!(low.min_element() >= 10.0 && (size - high).min_element() >= 10.0, "{name}: {low} {high}");
        }
        let small = Paper { name: "a5", size: DVec2::new(148.0, 210.0), roll: false, margin: 10.0, inset: 0.0 };
        assert!(board_page(board, small, "t").unwrap_err().to_string().contains("180 x 240 mm"));
    }
}
