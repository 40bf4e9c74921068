//! What the caller wants, and how fine the models of the search are.

use crate::residuals::input::Level;
use crate::search::optimise::Optimiser;

/// The model while all starts explore.
pub const COARSE: Level = Level { samples: 1024, bins: 48 };
/// The model that the best of them refine.
pub const FINE: Level = Level { samples: 4096, bins: 144 };
/// Samples of the last look.
pub const POLISH_SAMPLES: u32 = 8192;

/// Share of the progress that is told of a fit when the search ends. Chosen, not measured.
pub(super) const SEARCH_SHARE: f64 = 0.8;

/// Share of a time limit that is kept for what follows the search. Chosen, not measured: less leaves parts of the report out more often.
pub const REPORT_SHARE: f64 = 0.2;

/// What the caller wants.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Which optimiser.
    pub optimiser: Optimiser,
    /// Number of starts.
    pub starts: usize,
    /// Whether colours move with everything else, and are not solved for.
    pub joint: bool,
    /// Seed of everything random.
    pub seed: u64,
    /// Seconds that all of the fit may take; it ends with the best so far.
    pub time_limit: Option<f64>,
    /// How closely the search looks.
    pub effort: Effort,
}

/// How closely a search looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Tolerances of the coarse and of the fine search, in coordinates of the unit box.
    pub size: [f64; 2],
    /// The same of the objective.
    pub cost: [f64; 2],
    /// Whether starts explore a coarse model first.
    pub coarse_first: bool,
    /// Whether a search of Nelder and Mead ends by steps of Levenberg and Marquardt, on the fine model.
    pub descent: bool,
}

impl Default for Effort {
    fn default() -> Self {
        Self { size: [0.02, 0.004], cost: [0.02, 0.002], coarse_first: true, descent: true }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { optimiser: Optimiser::default(), starts: 8, joint: false, seed: 0, time_limit: None, effort: Effort::default() }
    }
}
