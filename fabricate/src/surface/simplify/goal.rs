//! What a reduction is to reach.

/// What is wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Most facets.
    pub(super) facets: usize,
    /// Largest slope error, radians, if one is given: then no more facets than it needs.
    pub(super) slope: Option<f64>,
}
