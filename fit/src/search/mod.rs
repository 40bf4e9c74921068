//! The search: many starts on a coarse model, the best of them on a fine one, and a last look with more samples.
//!
//! Every start is a search of its own, with samples of its own that stay the same (common random numbers) until it restarts. Starts run in
//! parallel, each on one thread, so that nothing depends on how many there are. Every evaluation is kept; a search that begins with the
//! evaluations of an earlier one makes the same steps up to where that one ended.

pub mod descent;
mod one_start;
pub mod optimise;
pub mod params;
mod starts;
mod trace;

pub use one_start::{Task, search};
pub use starts::{APART, Start, latin_hypercube, starts};
pub use trace::{Entry, Memory, SearchShared, Stage, Told, Trace};
