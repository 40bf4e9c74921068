//! The whole fit: photographs in, material out, with all that says how far to trust it.

mod comparison;
mod finish;
mod found;
mod options;
mod outcome;
mod prepared;
mod stages;
mod stopwatch;
mod whole;

pub use options::{COARSE, Effort, FINE, Options, POLISH_SAMPLES};
pub use outcome::{Better, Compared, Early, Outcome};
pub use prepared::{Survey, survey};
pub use whole::fit;
