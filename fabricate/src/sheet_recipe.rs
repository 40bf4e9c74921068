//! What the sheets are to show, as every file keeps it: how a reader knows what should be printed.

use serde::{Deserialize, Serialize};

/// What the sheets of a pattern show; lengths in mm. Files keep it in the recipe under `sheet`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SheetRecipe {
    /// Width and height of a page; the height of a roll is 0, as long as needed.
    pub page_mm: [f64; 2],
    /// Nothing is drawn this near to the border.
    pub margin_mm: f64,
    /// Taken on each side beyond the margin by registration marks.
    pub inset_mm: f64,
    /// Pages before those with pieces: a wrap sheet.
    pub wrap_pages: usize,
    /// Pages with pieces, backs not counted.
    pub piece_pages: usize,
    /// Pages that tell how to put the pieces together.
    pub assembly_pages: usize,
    /// Whether a back follows each page with pieces.
    pub back: bool,
    /// Whether fold lines and texts are on the backs only.
    pub clean_front: bool,
    /// Whether facets have their colours, and whether these change within facets.
    pub colours: bool,
    /// Whether the colours are images.
    pub textured: bool,
    /// Whether glued edges carry numbers.
    pub numbers: bool,
    /// Whether folds carry their angles.
    pub angles: bool,
    /// Whether there are a cutter's registration marks.
    pub registration: bool,
    /// Length of a period along x; 0 for none.
    pub period_mm: f64,
    /// Pixels to the inch, if the size of an SVG is in pixels.
    pub svg_dpi: Option<f64>,
    /// Folds below this angle are not drawn, degrees.
    pub flat_angle_deg: f64,
    /// Glued edges without a tab.
    pub without_tab: Vec<u32>,
    /// Name and copy of pieces whose name found no place.
    pub without_name: Vec<[u32; 2]>,
    /// Edge and facet of numbers that found no place.
    pub without_number: Vec<[u32; 2]>,
    /// Folds whose angle found no place.
    pub without_angle: Vec<u32>,
}

impl SheetRecipe {
    /// How many pages there are.
    pub fn pages(&self) -> usize {
        self.wrap_pages + self.piece_pages * (1 + usize::from(self.back)) + self.assembly_pages
    }
}
