//! The whole fit: photographs in, material out, with all that says how far to trust it.

mod choice;
mod comparison;
mod deadline;
mod diagnosis;
mod finish;
mod found;
mod held_out;
mod held_out_density;
mod held_out_light;
mod nuisances;
mod options;
mod outcome;
mod prepared;
mod scale_of_colours;
mod screening;
mod stages;
mod stopwatch;
mod watcher;
mod whole;

pub use choice::{Choice, Look, Screened, candidates, choose};
pub use diagnosis::Cause;
pub use finish::DIAGNOSIS;
pub use options::{COARSE, Effort, FINE, Options, POLISH_SAMPLES, REPORT_SHARE};
pub use outcome::{Better, Compared, Early, Outcome};
pub use prepared::{Survey, survey};
pub use watcher::Watcher;
pub use whole::fit;
