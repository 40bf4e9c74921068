//! Sizes of what stands on a wrap sheet, mm.

/// Side of a marker with its frame, mm, and the white around it.
pub(super) const MARKER: f64 = 14.0;

pub(super) const QUIET: f64 = 2.0;

/// What markers take on each side, mm.
pub(super) const BORDER: f64 = MARKER + 2.0 * QUIET;

/// Side of a colour patch, mm.
pub(super) const PATCH: f64 = 8.0;

/// Height of the strip of patches, mm.
pub(super) const STRIP: f64 = PATCH + 4.0;

/// How far a page of several reaches under the next one, mm.
pub const JOIN: f64 = 10.0;
