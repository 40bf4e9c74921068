//! Facets of some samples, and what they see: the visibility of exactly the directions of a query.

use super::control::Control;
use crate::error::Result;
use crate::facets::{self, Clustering, Density, Facets, Runs, Surface};
use crate::material::SmallScale;
use crate::numerics::cast::{index_u32, truncate_u32};
use crate::visibility::{Bits, COSTS, Visibility};
use glam::DVec3;

/// Samples of a batch: their bits and positions are what is held at once. Chosen, not measured: a bit a direction, 8 KiB each.
pub(super) const BATCH: u32 = 1 << 16;

/// What turns samples into facets that know what they see.
pub(crate) struct FacetSampler<'a> {
    small: &'a SmallScale,
    /// The surface in the form that sampling and visibility use.
    pub surface: Surface,
    visibility: Visibility<'a>,
    /// Where samples go.
    pub density: Density,
    /// Seed of the samples.
    pub seed: u32,
    control: Control<'a>,
}

/// Facets, and the bits of some directions.
pub(crate) struct Batch {
    /// The facets.
    pub facets: Facets,
    /// One row a direction.
    pub bits: Bits,
    /// Seconds that sampling and visibility took.
    pub seconds: [f64; 2],
}

impl<'a> FacetSampler<'a> {
    /// For a surface, with samples spread by area, its triangles clustered if `clustering` says how.
    pub fn new(small: &'a SmallScale, clustering: Option<&Clustering>, seed: u32, control: &Control<'a>) -> Self {
        let surface = Surface::new(small, clustering);
        let density = Density::uniform(&surface);
        Self { small, surface, visibility: Visibility::new(small), density, seed, control: *control }
    }

    /// For a surface in the form that sampling uses, and not clustered.
    pub fn of(small: &'a SmallScale, surface: Surface, control: &Control<'a>) -> Self {
        let density = Density::uniform(&surface);
        Self { small, surface, visibility: Visibility::new(small), density, seed: 0, control: *control }
    }

    /// Whether the triangles are clustered by normal.
    pub fn is_clustered(&self) -> bool {
        self.surface.groups.iter().any(|g| g.cluster.is_some())
    }

    /// Samples whose facets cost as much in a projection as all triangles do.
    pub fn samples_worth_a_projection(&self) -> u32 {
        let triangles = u32::try_from(self.surface.triangles.len()).unwrap_or(u32::MAX);
        truncate_u32(f64::from(triangles) * COSTS.projected_triangle / COSTS.projected_facet)
    }

    /// Whether to project all triangles `rounds` times costs more than to look up so many samples.
    pub fn costs_more_than_samples(&self, rounds: f64, samples: u32) -> bool {
        rounds * self.surface.triangles.len() as f64 * COSTS.projected_triangle > f64::from(samples) * COSTS.projected_facet
    }

    /// Rays so far that were given up among the periods and counted as free.
    pub fn given_up(&self) -> usize {
        self.visibility.given_up()
    }

    /// The first `count` samples, a power of two.
    pub fn low_discrepancy(&self, count: usize) -> Facets {
        facets::sample(self.small, &self.surface, &self.density, Runs::of_block(0, index_u32(count), 0, 1), self.seed)
    }

    /// `count` facets placed at random, as Wu et al. (2011, section 3.2) do.
    pub fn random(&self, count: usize) -> Facets {
        facets::random(self.small, &self.surface, count, self.seed)
    }

    /// What facets of this surface see of `directions`.
    pub fn see(&self, facets: &Facets, directions: &[DVec3]) -> Result<Bits> {
        self.visibility.see(&self.surface, facets, directions, &|| self.control.check())
    }

    /// Facets of some samples, and what they see of `directions`.
    pub fn batch(&self, runs: Runs, directions: &[DVec3]) -> Result<Batch> {
        self.control.check()?;
        let clock = self.control.clock;
        let start = clock();
        let facets = facets::sample(self.small, &self.surface, &self.density, runs, self.seed);
        let sampled = clock();
        let bits = self.see(&facets, directions)?;
        Ok(Batch { facets, bits, seconds: [sampled - start, clock() - sampled] })
    }
}
