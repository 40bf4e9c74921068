//! Where a piece lies on which page.

use glam::DVec2;

/// Distance between pieces, mm: scissors need some, and so do the colours that reach over the outline by
/// [`crate::paper::BLEED`] on both sides. Chosen, not measured.
pub const GAP: f64 = 4.0;

/// Where a piece lies: turned by the unit vector `x`, then shifted, on a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiecePlace {
    /// Page, from 0.
    pub page: usize,
    /// The piece's x axis on the page.
    pub x: DVec2,
    /// Its origin on the page, mm, y upwards.
    pub shift: DVec2,
}
