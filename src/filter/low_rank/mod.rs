//! Parts of the method of Wu et al. (2011): maps of directions and normals ([`map`]), the matrix `N` of the bidirectional visible normal
//! distribution ([`normals`]), the matrix `M` of turned BRDFs and the product of both ([`materials`]). The linear algebra is
//! [`crate::low_rank`]. No method of [`super::effective`] uses them yet.
//!
//! What the paper's own method and the improved one do differently is chosen by [`Variant`], in this file and nowhere else.

pub mod map;
pub mod materials;
pub mod normals;
pub mod rates;

use crate::low_rank::{Iteration, Params};
use map::Projection;

/// Which of two sets of choices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// As published.
    Paper,
    /// With what `numerics.md`, section 2, found to be more accurate.
    Improved,
}

/// What a facet's normal counts as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// The nearest normal of the map (Wu et al. 2011, eq. 11).
    Nearest,
    /// The mean of the normals that share a nearest one.
    Means,
}

impl Variant {
    /// Map of directions and normals.
    pub fn projection(self) -> Projection {
        match self {
            Self::Paper => Projection::Paraboloid,
            Self::Improved => Projection::EqualArea,
        }
    }

    /// What normals count as.
    pub fn normals(self) -> Normals {
        match self {
            Self::Paper => Normals::Nearest,
            Self::Improved => Normals::Means,
        }
    }

    /// How `N` is factored: 50 random vectors, 99.5 % of its power (Wu et al. 2011, section 5).
    pub fn params(self, seed: u64) -> Params {
        let iteration = match self {
            Self::Paper => Iteration::None,
            Self::Improved => Iteration::One,
        };
        Params { iteration, seed, ..Params::default() }
    }
}
