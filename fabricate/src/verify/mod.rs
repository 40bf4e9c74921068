//! Is a written pattern right? Reads the file again, folds it up in space and compares it with the design.
//!
//! Nothing here uses the unfolder, its tabs, its layout or its drawing: what a reader of the file can see is all there is. The design is
//! built again from the material, with the recipe that the file keeps.

mod numbers;
mod read_fold;
mod read_svg;
mod refold;
mod strips;

pub use read_fold::{Frame, read_fold};
pub use read_svg::read_svg;
pub use refold::{Report, verify};
pub use strips::verify_strips;

use glam::{DVec2, DVec3};
use serde_json::Value;

/// What a file shows, mm, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Facets.
    pub facets: Vec<SeenFacet>,
    /// Fold lines between facets.
    pub folds: Vec<SeenFold>,
    /// Polygons of tabs with their page.
    pub tabs: Vec<(usize, Vec<DVec2>)>,
    /// Lines to cut with their page, closed.
    pub outlines: Vec<(usize, Vec<DVec2>)>,
    /// Page sizes; none where the file has no pages.
    pub pages: Vec<DVec2>,
    /// The lowest and highest point of anything drawn on each page, with half the width of its line.
    pub extents: Vec<[DVec2; 2]>,
    /// Numbers at edges that are glued: edge and facet of the design, and what stands there.
    pub numbers: Vec<(u32, u32, String)>,
    /// The recipe.
    pub recipe: Value,
    /// The folded form that the file shows, for each facet its corners, if it does.
    pub folded: Option<Vec<Vec<DVec3>>>,
    /// Strips of a weave by name, with their corners; the first two are along the lower side.
    pub strips: Vec<(String, Vec<DVec2>)>,
    /// Crossings: the strip, whether it lies over, the polygon; in order along the strip.
    pub crossings: Vec<(String, bool, Vec<DVec2>)>,
    /// Facets whose polygon a clockwise or degenerate one is, by number.
    pub turned: usize,
}

/// A facet in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenFacet {
    /// The page.
    pub page: usize,
    /// The piece's number, and which of its copies it is.
    pub piece: [u32; 2],
    /// The facet of the design.
    pub facet: u32,
    /// Its corners, counter-clockwise.
    pub polygon: Vec<DVec2>,
}

/// A fold line in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenFold {
    /// The page.
    pub page: usize,
    /// Its ends.
    pub ends: [DVec2; 2],
    /// Its angle, radians, valley positive.
    pub angle: f64,
}
