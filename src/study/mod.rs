//! The same question asked of every method at every setting: error against cost.
//!
//! ```text
//! question (pairs) ──┐
//! ladder (settings) ─┴─> run ─> values ─┐
//! reference ─> truth ───────────────────┴─> deviation (error) ─> frontier
//! ```
//!
//! A stage takes plain data and gives plain data; clocks, files and processes are the caller's. What a run costs is measured by the
//! caller around [`run`].

mod deviation;
mod frontier;
mod ladder;
mod point_sums;
mod question;

pub use deviation::{Deviation, Truth, deviation};
pub use frontier::{cost_at, frontier};
pub use ladder::{Family, Series, Work, ladder, truth};
pub use point_sums::{Placement, Precision};
pub use question::{Asked, Question, list, table};

use crate::direction::Pair;
use crate::error::Result;
use crate::filter::low_rank::Variant;
use crate::filter::low_rank::cache::Cache;
use crate::filter::{self, Control, Effective, Quality};
use crate::material::SmallScale;

/// Values of `pairs` by a setting; `cache` is where the low-rank method keeps what it computes once a BRDF.
///
/// # Errors
/// Those of [`filter::effective`]; `Unsupported` for a method that this build lacks.
pub fn run(small: &SmallScale, pairs: &[Pair], work: &Work, seed: u64, cache: Option<Cache>, control: &Control<'_>) -> Result<Effective> {
    match work {
        Work::Effective { method, tolerance, budget, bounces, plan } => {
            let (tolerance, budget, bounces, plan) = (*tolerance, *budget, *bounces, plan.clone());
            // To a tolerance: the published variant knows none.
            let variant = Variant::Improved;
            let quality = Quality { method: *method, tolerance, budget, seed, bounces, plan, variant, cache };
            filter::effective(small, pairs, &quality, control)
        }
        Work::Points { placement, precision, facets } => point_sums::sums(small, pairs, *placement, *precision, *facets, seed, control),
    }
}
