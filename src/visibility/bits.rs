//! Visibility bits.

/// Visibility bits: one row a direction, one bit a facet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bits {
    /// Words of a row.
    pub words: usize,
    /// The rows; bit `f % 64` of word `f / 64` of a row belongs to facet `f`.
    pub rows: Vec<u64>,
}

impl Bits {
    /// The row of a direction.
    pub fn row(&self, direction: usize) -> &[u64] {
        &self.rows[direction * self.words..(direction + 1) * self.words]
    }
}
