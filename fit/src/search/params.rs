//! The numbers of this stage, and where they come from.

/// How the search looks for the least objective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchParams {
    /// Damping of Levenberg and Marquardt at the beginning, over the diagonal. Chosen, not measured.
    pub damping: f64,
    /// Factor of the damping where a step fails: Marquardt 1963.
    pub harder: f64,
    /// Factor where one succeeds. Chosen, not measured.
    pub easier: f64,
    /// Most tries of one step: up to ten thousand times the damping, where the step is none. Chosen, not measured.
    pub tries: usize,
    /// Damping of what is solved for anyway, over the diagonal, and what is added to a diagonal that is 0: keeps the matrix positive
    /// definite in `f64`.
    pub linear_ridge: f64,
    /// A step below this share of the size tolerance is none. Chosen, not measured.
    pub still: f64,
    /// Most small simplices that confirm a minimum. Chosen, not measured.
    pub confirmations: usize,
    /// Most simplices that are begun because the one before degenerated. Chosen, not measured.
    pub restarts: usize,
    /// Cost of a point that cannot be evaluated: large, and still a number that simplices can be sorted by.
    pub infeasible: f64,
}

/// The values of this version.
pub const PARAMS: SearchParams = SearchParams {
    damping: 1e-2,
    harder: 10.0,
    easier: 0.2,
    tries: 4,
    linear_ridge: 1e-9,
    still: 0.1,
    confirmations: 4,
    restarts: 8,
    infeasible: 1e300,
};
