//! The low-rank method of Wu et al. (2011), as published and with this project's changes.
//!
//! [`map`]: maps of directions and normals. [`normals`]: the matrix `N` of the bidirectional visible normal distribution. [`materials`]: the
//! matrix `M` of turned BRDFs, and the product of both. [`rates`]: how fine the maps of `M` must be. [`precomputed`]: a compressed `M`;
//! [`cache`]: such kept on disk. [`plan`]: settings of a run. `method` puts them together; the linear algebra is [`crate::numerics::randomized_svd`].
//!
//! What the paper's own method and the improved one do differently is chosen by [`Variant`], in this file and nowhere else.

pub mod cache;
mod errors;
pub mod map;
pub mod materials;
mod method;
pub mod normals;
pub mod plan;
pub mod precomputed;
pub mod rates;

pub(super) use method::low_rank;

use crate::numerics::randomized_svd::Iteration;
use map::Projection;

/// Which of two sets of choices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Variant {
    /// As published.
    #[default]
    Paper,
    /// With what `numerics.md`, section 2, found to be more accurate.
    Improved,
}

/// How facets are placed, and what area each stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Placing {
    /// At random, with areas by nearest points (Wu et al. 2011, section 3.2).
    Random,
    /// By a low-discrepancy sequence, each for the same area.
    LowDiscrepancy,
}

/// What the rows of the matrices are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Grid {
    /// Pairs of two maps, between whose cells values are interpolated (sections 3.6 and 3.7). `M` can be computed beforehand.
    Maps,
    /// The wanted pairs themselves.
    Wanted,
}

/// Which colours `M` has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Colours {
    /// One direction in the space of colours, the principal one (section 3.7).
    Principal,
    /// All three channels.
    Three,
}

/// What a facet's normal counts as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// The nearest normal of the map (Wu et al. 2011, eq. 11).
    Nearest,
    /// The mean of the normals that share a nearest one.
    Means,
}

/// All choices that tell the variants apart.
#[derive(Clone, Copy, Debug)]
struct Choices {
    placing: Placing,
    projection: Projection,
    grid: Grid,
    normals: Normals,
    colours: Colours,
    /// Of the random projections.
    iteration: Iteration,
    /// Random vectors for `N`; if `grows`, as many more as the energy asks for.
    projected: usize,
    grows: bool,
}

impl Variant {
    fn choices(self) -> Choices {
        match self {
            Self::Paper => Choices {
                placing: Placing::Random,
                projection: Projection::Paraboloid,
                grid: Grid::Maps,
                normals: Normals::Nearest,
                colours: Colours::Principal,
                iteration: Iteration::None,
                projected: crate::numerics::randomized_svd::PAPER_PROJECTION,
                grows: false,
            },
            Self::Improved => Choices {
                placing: Placing::LowDiscrepancy,
                projection: Projection::EqualArea,
                grid: Grid::Wanted,
                normals: Normals::Means,
                colours: Colours::Three,
                iteration: Iteration::One,
                projected: 64,
                grows: true,
            },
        }
    }
}
