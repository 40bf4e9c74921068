//! The numbers of this stage, and where they come from.

/// How the search looks for the least objective.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchParams {
    /// Damping of Levenberg and Marquardt at the beginning, over the diagonal. Chosen, not measured: more shortens first steps that were good,
    /// less wastes an evaluation on each that is not.
    pub damping: f64,
    /// Factor of the damping where a step fails: Marquardt 1963.
    pub harder: f64,
    /// Factor where one succeeds. Chosen, not measured: near 1 it stays slow after a bad step, near 0 the next bad step costs several tries.
    pub easier: f64,
    /// Most tries of one step: up to ten thousand times the damping, where the step is none. Chosen, not measured: each costs an
    /// evaluation, and fewer end the descent where a shorter step would have led on.
    pub tries: usize,
    /// Damping of what is solved for anyway, over the diagonal, and what is added to a diagonal that is 0: keeps the matrix positive
    /// definite in `f64`.
    pub linear_ridge: f64,
    /// A step below this share of the size tolerance is none. Chosen, not measured: more ends descents before their tolerance, less spends evaluations on
    /// steps that nobody asks for.
    pub still: f64,
    /// Most small simplices that confirm a minimum. Chosen, not measured: each costs about the evaluations of a search near its end; a valley that bends
    /// may go on after fewer.
    pub confirmations: usize,
    /// Most simplices that are begun because the one before grew flat. Chosen, not measured: the last is 2⁻⁸ times as large as the first, below any
    /// tolerance that is asked for; fewer leave searches where a bound flattened them.
    pub restarts: usize,
    /// Volume of a simplex, over that of one with all edges as long as its longest, below which it is begun anew. Chosen, not measured: far below that
    /// of a simplex that still moves along a valley, far above rounding.
    pub flat: f64,
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
    flat: 1e-8,
    infeasible: 1e300,
};
