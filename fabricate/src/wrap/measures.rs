//! Sizes of what stands on a wrap sheet, mm.

/// Side of a marker with its frame, mm: 2 mm for each of its 7 cells. Chosen, not measured; smaller markers need sharper photographs.
pub(super) const MARKER: f64 = 14.0;

/// White around a marker, mm: one of its cells, which detectors need beside the black frame.
pub(super) const QUIET: f64 = 2.0;

/// What markers take on each side, mm.
pub(super) const BORDER: f64 = MARKER + 2.0 * QUIET;

/// Side of a colour patch, mm. Chosen, not measured: many pixels of any photograph that shows the whole sheet.
pub(super) const PATCH: f64 = 8.0;

/// Height of the strip of patches, mm: they and 4 mm of white.
pub(super) const STRIP: f64 = PATCH + 4.0;

/// How far a page of several reaches under the next one, mm. Chosen, not measured: as wide as glue sticks and tapes are.
pub const JOIN: f64 = 10.0;
