//! The same question asked of every method at every setting: error against cost.
//!
//! ```text
//! question (pairs) ──┐
//! ladder (settings) ─┴─> run ─> values ─┐
//! reference ─> truth ───────────────────┴─> deviation (error) ─> frontier
//! ```
//!
//! A stage takes plain data and gives plain data; clocks, files and processes are the caller's. What a run costs is measured by the
//! caller around [`run()`].

mod deviation;
mod frontier;
mod ladder;
mod point_sums;
mod question;
mod run;
mod work;

pub use deviation::{Deviation, Truth, deviation};
pub use frontier::{cost_at, frontier};
pub use ladder::{Series, ladder, truth};
pub use point_sums::{Placement, Precision};
pub use question::{Asked, Question, list, table};
pub use run::run;
pub use work::{Family, Work};
