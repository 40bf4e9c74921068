//! Which of two sets of choices a method that was published takes.

/// As published, or as this project does it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variant {
    /// As published.
    Paper,
    /// With what `docs/numerics.md` found to be more accurate.
    Improved,
}
