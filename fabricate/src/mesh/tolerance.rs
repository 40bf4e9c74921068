//! What counts as flat and as one place.

/// What is taken as flat and as one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Corners closer than this are one, mm.
    pub weld: f64,
    /// Neighbours whose corners all lie within this distance of one plane are one facet, mm. A tilt of a small facet by this much moves
    /// what hangs on it a hundred times as far; what is flat to the eye only stays an edge, which is not drawn.
    pub flat: f64,
}

/// Corners of a facet lie in its plane to this share of its width: more would tilt what hangs on a needle. A tenth of the share to which
/// the verifier compares lengths.
pub(super) const FLAT_SHARE: f64 = 1e-7;

/// Two facets count as coplanar only below this angle, radians: a sharper fold between tiny facets is a fold all the same.
/// Chosen, not measured: .06 degrees are not seen on paper.
pub(super) const FLAT_ANGLE: f64 = 1e-3;

/// Corners closer than this share of the surface's size are one: what files of 32-bit numbers (2^-24 = 6e-8) can tell apart.
pub(crate) const WELD_SHARE: f64 = 1e-7;
/// The same for tiny surfaces, mm.
const LEAST_WELD: f64 = 1e-9;
/// Distance from a common plane below which neighbours are one facet, mm; see [`Tolerance::flat`].
const FLAT: f64 = 1e-6;

impl Tolerance {
    /// For a surface of this size, mm.
    pub fn of_size(size: f64) -> Self {
        Self { weld: (WELD_SHARE * size).max(LEAST_WELD), flat: FLAT }
    }
}
