//! The files of one pattern, by the ending that the user chose.

use super::{dxf, fold_file, origami_simulator, pdf, png, svg};
use crate::drawing::{Page, Sheets};
use crate::mesh::Mesh;
use crate::unfold::{Pattern, Piece};
use biscale::error::{Error, Result};
use glam::DVec2;
use serde_json::Value;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    /// One SVG a page, in mm, or in pixels at so many to the inch.
    Svg {
        /// Pixels to the inch, if the size is given in pixels.
        dpi: Option<f64>,
    },
    /// One PDF of all pages.
    Pdf,
    /// One PNG a page.
    Png,
    /// One FOLD file.
    Fold,
    /// One SVG a piece for Origami Simulator; copies are written once.
    OrigamiSimulator,
    /// One DXF a page.
    Dxf,
}

/// Pixels of a PNG to the millimetre: 200 dots an inch. Chosen, not measured: a4 has 3.9 million.
const PNG_SCALE: f64 = 200.0 / 25.4;

/// What the files are made of.
#[derive(Clone, Copy, Debug)]
pub struct Content<'a> {
    /// Title.
    pub title: &'a str,
    /// Pages.
    pub pages: &'a [Page],
    /// The surface; strips have none.
    pub mesh: &'a Mesh,
    /// The pattern.
    pub pattern: &'a Pattern,
    /// Its pieces where they lie on the pages, pages side by side.
    pub placed: &'a [Piece],
    /// What a verifier needs to build the design again.
    pub recipe: &'a Value,
}

impl Format {
    /// How many files there will be.
    pub fn count(self, content: &Content<'_>) -> usize {
        match self {
            Self::Svg { .. } | Self::Png | Self::Dxf => content.pages.len(),
            Self::OrigamiSimulator => content.pattern.pieces.iter().filter(|p| p.copy == 1).count(),
            Self::Pdf | Self::Fold => 1,
        }
    }

    /// The contents of the files.
    ///
    /// # Errors
    /// [`Error::Numeric`] if something cannot be drawn.
    pub fn files(self, content: &Content<'_>) -> Result<Vec<Vec<u8>>> {
        let recipe = content.recipe.to_string();
        match self {
            Self::Svg { dpi } => Ok(content.pages.iter().map(|p| svg::document(p, dpi, &recipe).into_bytes()).collect()),
            Self::Pdf => Ok(vec![pdf::pdf(content.pages, content.title)?]),
            Self::Png => content.pages.iter().map(|p| png::png(p, PNG_SCALE)).collect(),
            Self::Dxf => Ok(content.pages.iter().map(|p| dxf::dxf(p).into_bytes()).collect()),
            Self::OrigamiSimulator => {
                let once = content.pattern.pieces.iter().filter(|p| p.copy == 1);
                Ok(once.map(|p| origami_simulator::origami_simulator(content.mesh, p).into_bytes()).collect())
            }
            Self::Fold => {
                let fold = fold_file::fold(content.mesh, content.pattern, content.placed, content.title, content.recipe);
                let mut text = serde_json::to_vec(&fold).map_err(|e| Error::Numeric(format!("cannot write the pattern: {e}")))?;
                text.push(b'\n');
                Ok(vec![text])
            }
        }
    }
}

/// Distance between pages that lie side by side in one FOLD file, mm: to be seen apart.
const BETWEEN_PAGES: f64 = 20.0;

/// The pieces where they lie, the pages side by side.
pub fn side_by_side(pattern: &Pattern, sheets: &Sheets) -> Vec<Piece> {
    let width = sheets.pages.first().map_or(0.0, |p| p.size.x) + BETWEEN_PAGES;
    let shift = |page: usize| DVec2::new(page as f64 * width, 0.0);
    pattern.pieces.iter().zip(&sheets.places).map(|(piece, place)| piece.moved(place.x, place.shift + shift(place.page))).collect()
}
