//! What the paper's own method and the improved one do differently.

use super::map::Projection;
use crate::filter::plan::Variant;
use crate::numerics::randomized_svd::{Iteration, PAPER_PROJECTION};

/// How facets are placed, and what area each stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FacetPlacement {
    /// At random, with areas by nearest points (Wu et al. 2011, section 3.2).
    Random,
    /// By a low-discrepancy sequence, each for the same area.
    LowDiscrepancy,
}

/// What the rows of the matrices are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MatrixRows {
    /// Pairs of two maps, between whose cells values are interpolated (sections 3.6 and 3.7). `M` can be computed beforehand.
    Maps,
    /// The pairs of the query themselves.
    Query,
}

/// Which colours `M` has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colours {
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
pub(super) struct Choices {
    pub placing: FacetPlacement,
    pub projection: Projection,
    pub rows: MatrixRows,
    pub normals: Normals,
    pub colours: Colours,
    /// Of the random projections.
    pub iteration: Iteration,
    /// Random vectors for `N`; if `grows`, as many more as the energy asks for.
    pub projected: usize,
    pub grows: bool,
}

impl Choices {
    /// The choices of a variant.
    pub fn of(variant: Variant) -> Self {
        match variant {
            Variant::Paper => Self {
                placing: FacetPlacement::Random,
                projection: Projection::Paraboloid,
                rows: MatrixRows::Maps,
                normals: Normals::Nearest,
                colours: Colours::Principal,
                iteration: Iteration::None,
                projected: PAPER_PROJECTION,
                grows: false,
            },
            Variant::Improved => Self {
                placing: FacetPlacement::LowDiscrepancy,
                projection: Projection::EqualArea,
                rows: MatrixRows::Query,
                normals: Normals::Means,
                colours: Colours::Three,
                iteration: Iteration::One,
                projected: 64,
                grows: true,
            },
        }
    }
}
