//! Running one setting.

use super::point_sums;
use super::work::Work;
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::{self, Control, Effective, MatrixCache, Quality, Variant};
use crate::material::SmallScale;

/// Values of `pairs` by a setting; `cache` is where the low-rank method keeps what it computes once a BRDF.
///
/// # Errors
/// Those of [`filter::effective`]; `Unsupported` for a method that this build lacks.
///
/// ```
/// use biscale::study::{Truth, Work, deviation, list, run};
/// use biscale::{Control, Material};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
/// let surface = Material::load(path.as_ref())?.build()?;
/// let question = list(4, 1);
/// let run = |work: &str, seed| run(&surface, &question.pairs, &Work::parse(work)?, seed, None, &Control::quiet());
/// let truth = run("direct:4096x1", 1)?;
/// let truth = Truth { value: truth.values.iter().map(|v| v.fbar).collect(), se: truth.values.iter().map(|v| v.se).collect() };
/// let found: Vec<[f64; 3]> = run("direct:1024x1", 2)?.values.iter().map(|v| v.fbar).collect();
/// // Fewer facets in other places: a few per cent off.
/// assert!(deviation(&found, &truth).error < 0.1);
/// # Ok::<(), biscale::Error>(())
/// ```
pub fn run(
    small: &SmallScale,
    pairs: &[Pair],
    work: &Work,
    seed: u64,
    cache: Option<MatrixCache>,
    control: &Control<'_>,
) -> Result<Effective> {
    match work {
        Work::Effective { method, tolerance, budget, bounces, plan } => {
            let (tolerance, budget, bounces, plan) = (*tolerance, *budget, Some(*bounces), plan.clone());
            // To a tolerance: the published variant knows none.
            let variant = Some(Variant::Improved);
            let quality = Quality { method: *method, tolerance, budget, seed, bounces, plan, variant, cache };
            filter::effective(small, pairs, &quality, control)
        }
        Work::Points { placement, precision, facets } => point_sums::sums(small, pairs, *placement, *precision, *facets, seed, control),
    }
}
