//! What one fold takes of the paper.

/// Paper, and how it is folded; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Thickness of the paper.
    pub thickness: f64,
    /// Radius of the inner side of a fold.
    pub radius: f64,
    /// Where the paper keeps its length, from the inner side, as a share of its thickness.
    pub k: f64,
}

/// Folds below this angle, radians, take nothing.
pub(super) const FLAT: f64 = 1e-9;

impl Bend {
    /// What a fold takes from its two facets together, mm; `angle` in radians, valley positive.
    pub fn deduction(self, angle: f64) -> f64 {
        let a = angle.abs();
        let outside = if angle < 0.0 { self.radius + self.thickness } else { self.radius };
        2.0 * outside * (0.5 * a).tan() - a * (self.radius + self.k * self.thickness)
    }

    /// Distance from the edge of a fold to where its arc begins, mm.
    pub(super) fn setback(self, angle: f64) -> f64 {
        (if angle < 0.0 { self.radius + self.thickness } else { self.radius }) * (0.5 * angle.abs()).tan()
    }
}
