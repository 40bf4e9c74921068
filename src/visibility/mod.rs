//! Which facets see which directions: one bit a facet and direction.
//!
//! A facet sees a direction when the direction lies above the facet and the ray meets nothing on the periodic surface, however
//! many periods away.

pub mod horizon;
pub mod raster;
pub mod rays;

#[cfg(test)]
pub(crate) mod test_tiles;

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
