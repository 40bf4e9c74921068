//! How much is searched, and when to stop.

/// How much to search, and from which random numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Seed of everything random.
    pub seed: u64,
    /// Runs from different beginnings, for surfaces of few facets; large ones get one run of the same work together.
    pub runs: u32,
    /// Collision tests for each facet, of all runs together, about: the measure of effort that does not depend on the machine. Small
    /// surfaces get as much as larger ones.
    pub work: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seed: 0, runs: 4, work: 14_000 }
    }
}

/// Asked now and then whether to stop: returns true to stop with what there is.
pub type Stop<'s> = dyn Fn(f64) -> bool + Sync + 's;
