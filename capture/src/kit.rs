//! What `biscale new board` prints: a board for calibration, and a sheet for the sample; its sidecar tells both.

use crate::board::Board;
use crate::dictionary::Dictionary;
use crate::sheet::Sheet;
use biscale::bounded_file::read_bounded;
use biscale::error::Result;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A `ChArUco` board, as sidecar and shoot file describe it; lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrintedBoard {
    /// Squares across.
    pub columns: u32,
    /// Squares down.
    pub rows: u32,
    /// Side of a square.
    pub square_mm: f64,
    /// Side of a marker.
    pub marker_mm: f64,
    /// Name of the markers' dictionary.
    pub dictionary: String,
    /// Number of the first marker.
    pub first_id: u32,
}

impl PrintedBoard {
    /// What `biscale new board` prints: it fits on A4 and on US letter. Its numbers are the last ones of the dictionary, so that no marker of it is one of a
    /// sheet, whose numbers begin with 0.
    pub fn standard() -> Self {
        Self { columns: 6, rows: 8, square_mm: 30.0, marker_mm: 22.0, dictionary: "DICT_5X5_100".into(), first_id: 76 }
    }

    /// Its corners and markers; `None` of a dictionary that `OpenCV` has not.
    pub fn layout(&self) -> Option<Board> {
        let dictionary = Dictionary::named(&self.dictionary)?;
        let first = i32::try_from(self.first_id).ok()?;
        (self.columns >= 2 && self.rows >= 2 && self.marker_mm < self.square_mm)
            .then(|| Board::charuco(self.columns, self.rows, self.square_mm, self.marker_mm, &dictionary, true).numbered_from(first))
    }
}

/// What a folder's sidecars tell.
#[derive(Clone, Debug)]
pub struct Kit {
    /// The board.
    pub board: PrintedBoard,
    /// Whether a sidecar told it; else it is the standard one.
    pub board_told: bool,
    /// The sheet of the sample with its sidecar.
    pub sheet: Option<(PathBuf, Sheet)>,
    /// Sidecars that tell another sheet: which one was used is not known.
    pub others: Vec<PathBuf>,
}

/// Most bytes of a sidecar.
const MAX_BYTES: u64 = 1 << 26;

impl Kit {
    /// Reads the sidecars among these files; those that are none are passed over.
    ///
    /// # Errors
    /// I/o.
    pub fn read(files: &[PathBuf]) -> Result<Self> {
        let mut out = Self { board: PrintedBoard::standard(), board_told: false, sheet: None, others: Vec::new() };
        for file in files {
            if let Some(board) = board_of(file)? {
                (out.board, out.board_told) = (board, true);
            }
            match (Sheet::read(file), &out.sheet) {
                (Ok(sheet), None) => out.sheet = Some((file.clone(), sheet)),
                (Ok(_), Some(_)) => out.others.push(file.clone()),
                (Err(_), _) => {}
            }
        }
        Ok(out)
    }
}

fn board_of(file: &Path) -> Result<Option<PrintedBoard>> {
    #[derive(Deserialize)]
    struct Sidecar {
        board: Option<PrintedBoard>,
    }
    let bytes = read_bounded(file, MAX_BYTES, "name the .json that `biscale new board` wrote")?;
    Ok(serde_json::from_slice::<Sidecar>(&bytes).ok().and_then(|s| s.board).filter(|b| b.layout().is_some()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_board_has_the_last_numbers_of_its_dictionary() {
        let board = PrintedBoard::standard().layout().unwrap();
        let ids: Vec<i32> = board.markers.iter().map(|m| m.0).collect();
        assert_eq!((ids.len(), ids[0], ids[23]), (24, 76, 99));
        assert_eq!(board.corners.len(), 35);
    }

    #[test]
    fn sidecars_are_told_from_other_json() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let other = at("a.json", "{\"albums\": []}");
        let broken = at("b.json", "{");
        let kit = Kit::read(&[other.clone(), broken.clone()]).unwrap();
        assert!(!kit.board_told && kit.sheet.is_none() && kit.board == PrintedBoard::standard());
        let board = PrintedBoard { columns: 5, ..PrintedBoard::standard() };
        let told = at("c.json", &serde_json::json!({ "board": board }).to_string());
        assert_eq!(Kit::read(&[other, told, broken]).unwrap().board, board);
    }
}
