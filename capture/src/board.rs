//! Things with corners at known places: calibration boards and our own sheets.

use crate::dictionary::Dictionary;
use crate::sheet::Sheet;
use glam::DVec2;

/// A flat thing that a camera finds; places in mm, x to the right, y up from its lower left corner, seen from its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    /// What it is.
    pub kind: BoardKind,
    /// The markers' dictionary; none of a chessboard.
    pub dictionary: Option<Dictionary>,
    /// Markers: number, and corners from its own upper left clockwise.
    pub markers: Vec<(i32, [DVec2; 4])>,
    /// Inner corners of the chessboard, row by row from the upper left one.
    pub corners: Vec<DVec2>,
    /// Its width and height.
    pub size: DVec2,
}

/// A kind of board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoardKind {
    /// Chessboard with so many inner corners.
    Chessboard {
        /// Across.
        columns: u32,
        /// Down.
        rows: u32,
    },
    /// Markers in the white squares of a chessboard with so many squares.
    Charuco {
        /// Across.
        columns: u32,
        /// Down.
        rows: u32,
        /// Side of a square.
        square: f64,
        /// Side of a marker.
        marker: f64,
    },
    /// Markers alone.
    Markers,
}

fn square(upper_left: DVec2, side: f64) -> [DVec2; 4] {
    [(0.0, 0.0), (1.0, 0.0), (1.0, -1.0), (0.0, -1.0)].map(|c| upper_left + side * DVec2::from(c))
}

impl Board {
    /// A chessboard with so many inner corners.
    pub fn chessboard(columns: u32, rows: u32, side: f64) -> Self {
        let size = side * DVec2::new(f64::from(columns) + 1.0, f64::from(rows) + 1.0);
        let corners = inner_corners(columns, rows, side, size.y);
        Self { kind: BoardKind::Chessboard { columns, rows }, dictionary: None, markers: Vec::new(), corners, size }
    }

    /// Markers in the white squares of a chessboard of `columns` x `rows` squares, numbered row by row from the upper left. `black_first` says
    /// whether the square in the upper left corner is black, as `OpenCV` draws boards since 4.7 (and before for odd numbers of rows).
    pub fn charuco(columns: u32, rows: u32, side: f64, marker: f64, dictionary: &Dictionary, black_first: bool) -> Self {
        let size = side * DVec2::new(columns.into(), rows.into());
        let mut markers = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let black = (row + column) % 2 == u32::from(!black_first);
                if !black {
                    let gap = 0.5 * (side - marker);
                    let corner = DVec2::new(f64::from(column) * side + gap, size.y - f64::from(row) * side - gap);
                    markers.push((as_id(markers.len()), square(corner, marker)));
                }
            }
        }
        let corners = inner_corners(columns - 1, rows - 1, side, size.y);
        let kind = BoardKind::Charuco { columns, rows, square: side, marker };
        Self { kind, dictionary: Some(dictionary.clone()), markers, corners, size }
    }

    /// The same with its markers numbered from `first`.
    pub fn numbered_from(mut self, first: i32) -> Self {
        self.markers.iter_mut().for_each(|m| m.0 += first);
        self
    }

    /// A grid of markers, numbered row by row from the upper left, beginning with `first`.
    pub fn grid(columns: u32, rows: u32, marker: f64, gap: f64, dictionary: &Dictionary, first: i32) -> Self {
        let pitch = marker + gap;
        let size = DVec2::new(f64::from(columns), f64::from(rows)) * pitch - gap;
        let place = |k: u32| DVec2::new(f64::from(k % columns) * pitch, size.y - f64::from(k / columns) * pitch);
        let markers = (0..columns * rows).map(|k| (first + as_id(k as usize), square(place(k), marker))).collect();
        Self { kind: BoardKind::Markers, dictionary: Some(dictionary.clone()), markers, corners: Vec::new(), size }
    }

    /// The markers of a sheet, flat on the table; places on its page.
    pub fn of_sheet(sheet: &Sheet) -> Self {
        let markers: Vec<(i32, [DVec2; 4])> = sheet.markers.iter().map(|m| (m.id, m.corners_mm.map(DVec2::from))).collect();
        let size = markers.iter().flat_map(|m| m.1).fold(DVec2::ZERO, DVec2::max);
        Self { kind: BoardKind::Markers, dictionary: Some(sheet.dictionary.clone()), markers, corners: Vec::new(), size }
    }

    /// How many corners it offers to calibration: of the chessboard, else of the markers.
    pub fn count(&self) -> usize {
        if self.corners.is_empty() { 4 * self.markers.len() } else { self.corners.len() }
    }
}

fn inner_corners(columns: u32, rows: u32, side: f64, height: f64) -> Vec<DVec2> {
    let place = |row: u32, column: u32| DVec2::new(f64::from(column + 1) * side, height - f64::from(row + 1) * side);
    (0..rows).flat_map(|row| (0..columns).map(move |column| place(row, column))).collect()
}

fn as_id(k: usize) -> i32 {
    i32::try_from(k).unwrap_or(i32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_of_a_charuco_board_lie_in_its_white_squares() {
        let board = Board::charuco(5, 7, 30.0, 20.0, &Dictionary::Predefined("DICT_5X5_100"), true);
        assert_eq!((board.markers.len(), board.corners.len()), (17, 24));
        // The first white square of the first row is the second one.
        assert_eq!(board.markers[0].1, [(35.0, 205.0), (55.0, 205.0), (55.0, 185.0), (35.0, 185.0)].map(DVec2::from));
        assert_eq!(board.corners[0], DVec2::new(30.0, 180.0));
        let other = Board::charuco(5, 8, 30.0, 20.0, &Dictionary::Predefined("DICT_5X5_100"), false);
        assert_eq!((other.markers.len(), other.markers[0].1[0]), (20, DVec2::new(5.0, 235.0)));
    }
}
