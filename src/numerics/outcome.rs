//! How a search ended.

/// How a search for a minimum ended. The point that comes with it is the best that was evaluated, whichever of these it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A stopping rule of the search was met.
    Converged,
    /// The steps or evaluations that were allowed are used up.
    Exhausted,
    /// The function has no finite value where the search begins, or the search met numbers that it cannot go on with.
    NotFinite,
}

impl Outcome {
    /// Whether a stopping rule was met.
    pub fn converged(self) -> bool {
        self == Self::Converged
    }
}
