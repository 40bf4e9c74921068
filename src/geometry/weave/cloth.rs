//! Cloth: its draft, its threads and how far they bend.

use super::draft::Draft;
use glam::DVec2;

/// Cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct Weave {
    /// Where the warp lies over.
    pub draft: Draft,
    /// One thread a column of the draft.
    pub warp: Vec<Thread>,
    /// One thread a row of the draft.
    pub weft: Vec<Thread>,
    /// Size of the repeat.
    pub period: DVec2,
    /// Distance between the centre lines of warp and weft where they cross.
    pub crimp: f64,
    /// Share of the crimp by which the warp bends, 0 to 1.
    pub crimp_share: f64,
    /// Sides of a section.
    pub segments: u32,
    /// Pieces along each bend.
    pub steps: u32,
    /// Names of the parts.
    pub parts: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// One thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Place of its centre line across its direction.
    pub centre: f64,
    /// Width of its section.
    pub width: f64,
    /// Height of its section.
    pub height: f64,
    /// Place in [`Weave::parts`].
    pub part: u16,
}
