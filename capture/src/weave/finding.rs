//! What is wrong with a photograph, as a caller can act on it.

use serde::Serialize;

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum FindingCode {
    /// Nothing in the photograph repeats.
    NoPeriod,
    /// Threads have too few pixels for what is on top to be seen.
    Undersampled,
    /// No draft explains the photograph, or several do nearly alike.
    AmbiguousWeave,
}

/// One finding: what was measured, and what would have been enough.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// What is wrong.
    pub code: FindingCode,
    /// For a person: what it means and what to do.
    pub message: String,
    /// The number that was measured.
    pub measured: f64,
    /// The number that it had to reach.
    pub threshold: f64,
}
