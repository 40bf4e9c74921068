//! The numbers of this stage, and where they come from.

/// How pictures beside the photographs are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerdictParams {
    /// Tolerance of the pictures: well below the 2 % that photographs and model differ by
    /// ([`crate::photograph::direction_bins::RELATIVE_NOISE`]).
    pub tolerance: f64,
    /// Pairs on which the grid of directions is chosen. Chosen, not measured.
    pub probes: usize,
}

/// The values of this version.
pub const PARAMS: VerdictParams = VerdictParams { tolerance: 0.01, probes: 256 };
