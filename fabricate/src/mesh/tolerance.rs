//! What counts as flat and as one place.

/// What is taken as flat and as one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Corners closer than this are one, mm. A millionth of the size of the surface suits files of 32-bit numbers.
    pub weld: f64,
    /// Neighbours whose corners all lie within this distance of one plane are one facet, mm. A tilt of a small facet by this much moves
    /// what hangs on it a hundred times as far; what is flat to the eye only stays an edge, which is not drawn.
    pub flat: f64,
}

/// Corners of a facet lie in its plane to this share of its width: more would tilt what hangs on a needle.
pub(super) const FLAT_SHARE: f64 = 1e-7;

/// Two facets count as coplanar only below this angle, radians: a sharper fold between tiny facets is a fold all the same.
pub(super) const FLAT_ANGLE: f64 = 1e-3;

impl Tolerance {
    /// For a surface of this size, mm.
    pub fn of_size(size: f64) -> Self {
        Self { weld: (1e-7 * size).max(1e-9), flat: 1e-6 }
    }
}
