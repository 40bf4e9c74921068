//! Where a tolerance becomes a number of samples.
//!
//! A tolerance is met when [`SAFETY`] times the estimated relative RMS error is within it; until then the error is brought down by more samples, of
//! which [`needed`] says how many: errors fall as `samples^-RATE`.

use crate::numerics::cast::truncate_u32;

/// Relative RMS error of `fbar` that is asked for where a caller says nothing: the default of `--tolerance` in
/// `docs/commands.md`. Chosen, not measured.
pub const DEFAULT_TOLERANCE: f64 = 0.005;
/// To keep a tolerance, stop when this times the estimate is within it. Pairs share facets, so their errors are correlated, and the estimate of one run
/// is within 1.5 of its own true error in 53 to 97 % of runs, within 2 in 90 to 100 % (`docs/numerics.md`, section 3.6).
pub(crate) const SAFETY: f64 = 1.5;
/// The same where the error is that of the values themselves, measured against sums over other facets ([`Probes::measure`](super::probes::Probes::measure)).
pub(super) const MEASURED_SAFETY: f64 = 1.2;
/// The power of the samples that errors fall with: from .63 to .8, measured by `cargo bench --bench accuracy`.
pub(super) const RATE: f64 = 0.75;
/// Margin on the samples that are asked for: one round too many costs more than a few samples too many. Chosen, not measured.
pub(super) const MARGIN: f64 = 1.2;
/// Most samples of the method `direct`: their facets, bits and sums still fit into memory. Chosen, not measured.
pub const MAX_SAMPLES: u32 = 1 << 22;

/// Whether an estimated relative RMS error keeps a tolerance.
pub(crate) fn keeps(relative_rms: f64, tolerance: f64) -> bool {
    SAFETY * relative_rms <= tolerance
}

/// Whether an error that was measured on the values themselves keeps a tolerance.
pub(super) fn measured_keeps(relative_rms: f64, tolerance: f64) -> bool {
    MEASURED_SAFETY * relative_rms <= tolerance
}

/// Samples, a power of two, that bring an error down by `factor`, if it is more than 1.
pub(super) fn needed(samples: u32, factor: f64) -> u32 {
    if factor > 1.0 { required(samples, factor, MARGIN) } else { samples }
}

/// `margin` times as many samples as make an error `factor` times smaller, or larger, rounded up to a power of two.
pub(super) fn required(samples: u32, factor: f64, margin: f64) -> u32 {
    let required = truncate_u32((margin * f64::from(samples) * factor.powf(1.0 / RATE)).clamp(1.0, f64::from(MAX_SAMPLES)));
    required.next_power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_samples_are_asked_for_where_more_error_must_go() {
        assert_eq!(needed(2048, 0.5), 2048);
        assert_eq!(needed(2048, 2.0), 8192);
        assert_eq!(needed(2048, 1.65), 8192);
        assert_eq!(needed(2048, f64::INFINITY), MAX_SAMPLES);
        assert_eq!(required(8192, 0.5, 1.0), 4096);
        assert_eq!(required(8192, 0.0, 1.0), 1);
    }
}
