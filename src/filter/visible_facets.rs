//! Facets with what they see of all directions of a query at once, for the methods that need all of it together.

use super::facet_sampler::FacetSampler;
use super::sums::visible_area;
use crate::error::{BadInput, Result};
use crate::facets::{ALIGNMENT, Facets, REPLICATES};
use crate::filter::plan::{MAX_FACETS, MIN_FACETS};
use crate::visibility::Bits;
use glam::DVec3;
use rayon::prelude::*;

/// Most bytes of visibility bits. Chosen, not measured.
const MAX_BIT_BYTES: usize = 512 << 20;

/// Facets, and what they see of some directions.
pub struct VisibleFacets {
    /// The facets.
    pub facets: Facets,
    /// One row a direction.
    pub bits: Bits,
    /// Visible area over the footprint, one a direction.
    pub areas: Vec<f64>,
}

impl VisibleFacets {
    /// The most facets, a power of two that a plan may have, for which memory is there with so many directions; for lists so long that none are,
    /// the fewest, which [`Self::new`] declines.
    pub fn most(directions: usize) -> usize {
        // Those of a surface are filled up to whole runs.
        let room = (8 * MAX_BIT_BYTES / directions.max(1)).saturating_sub(REPLICATES * ALIGNMENT);
        (room / 2 + 1).next_power_of_two().clamp(MIN_FACETS, MAX_FACETS)
    }

    /// What facets of a sampler's surface see of `directions`.
    ///
    /// # Errors
    /// More facets and directions than memory is for; an interruption.
    pub fn new(sampler: &FacetSampler<'_>, facets: Facets, directions: &[DVec3]) -> Result<Self> {
        let bytes = facets.triangle.len() / 8 * directions.len();
        if bytes > MAX_BIT_BYTES {
            let problem = format!("{} facets and {} directions need {} MB of visibility", facets.samples, directions.len(), bytes >> 20);
            return Err(BadInput::new(problem, "ask for fewer facets or pairs, or for `method direct`").into());
        }
        let bits = sampler.see(&facets, directions)?;
        let area = |(d, &w): (usize, &DVec3)| visible_area(&facets, w, bits.row(d)).iter().sum::<f64>() / facets.samples as f64;
        let areas = directions.par_iter().enumerate().map(area).collect();
        Ok(Self { facets, bits, areas })
    }
}
