//! What both variants work with: facets, what they see, and factors of matrices.

use super::choices::{Choices, Colours, FacetPlacement};
use super::materials::{Basis, Product};
use super::normals::Bins;
use crate::error::Result;
use crate::facets::Facets;
use crate::filter::control::Control;
use crate::filter::facet_sampler::FacetSampler;
use crate::filter::plan::{LowRankPlan, Variant};
use crate::filter::probes::RawValue;
use crate::filter::quality::Quality;
use crate::filter::value::LowRankFacts;
use crate::filter::visible_facets::VisibleFacets;
use crate::material::{SmallScale, Surface, Tint};
use crate::numerics::randomized_svd::{self, Factors, Params, Rows};
use crate::numerics::seed;
use glam::DVec3;
use std::ops::Range;

/// Random vectors are doubled until the factors keep the share of the power that is asked for; a share nearer to 1 than this cannot be told from rounding
/// of the power itself.
const ROUNDING_OF_POWER: f64 = 1e-12;

/// A stage of the method, for its seconds.
#[derive(Clone, Copy)]
pub(super) enum Stage {
    MatrixM,
    Facets,
    Visibility,
    Sums,
}

impl Stage {
    /// The names of all stages, in their order.
    pub const NAMES: [&'static str; 4] = ["matrix M", "facets", "visibility", "sums"];
}

/// A run of the method.
pub(super) struct LowRankRun<'a> {
    pub small: &'a SmallScale,
    pub quality: &'a Quality,
    pub control: &'a Control<'a>,
    pub sampler: FacetSampler<'a>,
    pub choices: Choices,
    /// Seconds of each [`Stage`].
    pub seconds: [f64; 4],
    pub notes: Vec<String>,
    pub details: Vec<String>,
    /// The share of the whole work that the step at hand is.
    pub share: Range<f64>,
}

/// Values of a list of pairs before their errors are known.
pub(super) struct RawValues {
    /// `S` of each pair, and visible area over the footprint from its viewer.
    pub pairs: Vec<RawValue>,
    pub facts: Vec<LowRankFacts>,
    pub directions: usize,
    pub bins: usize,
}

impl<'a> LowRankRun<'a> {
    /// A run of a variant.
    pub fn new(small: &'a SmallScale, variant: Variant, quality: &'a Quality, control: &'a Control<'a>) -> Self {
        let sampler = FacetSampler::new(small, None, seed::fold(quality.seed), control);
        Self {
            small,
            quality,
            control,
            sampler,
            choices: Choices::of(variant),
            seconds: [0.0; 4],
            notes: Vec::new(),
            details: Vec::new(),
            share: 0.0..1.0,
        }
    }

    /// Tells that so much of the step at hand is done.
    pub fn report(&self, stage: &str, done: f64) {
        (self.control.progress)(stage, self.share.start + done.clamp(0.0, 1.0) * (self.share.end - self.share.start));
    }

    /// This moment, in seconds.
    pub fn now(&self) -> f64 {
        (self.control.clock)()
    }

    /// Adds the time since `began` to a stage.
    pub fn took(&mut self, stage: Stage, began: f64) {
        self.seconds[stage as usize] += self.now() - began;
    }

    /// The facets of a plan.
    pub fn facets(&mut self, plan: &LowRankPlan) -> Facets {
        let began = self.now();
        let facets = match self.choices.placing {
            FacetPlacement::Random => self.sampler.random(plan.facets()),
            FacetPlacement::LowDiscrepancy => self.sampler.low_discrepancy(plan.facets()),
        };
        self.took(Stage::Facets, began);
        facets
    }

    /// What facets see of `directions`.
    pub fn see(&mut self, facets: Facets, directions: &[DVec3]) -> Result<VisibleFacets> {
        self.control.check()?;
        let began = self.now();
        let seen = VisibleFacets::new(&self.sampler, facets, directions)?;
        self.took(Stage::Visibility, began);
        Ok(seen)
    }

    /// Factors of a matrix, and with as many random vectors as its energy asks for if the variant lets them grow.
    pub fn factor(&self, matrix: &Rows<'_>, energy: f64) -> Result<Factors> {
        let Choices { iteration, projected, grows, .. } = self.choices;
        let mut projection = projected;
        loop {
            let params = Params { projection, iteration, energy, seed: self.quality.seed };
            let factors = randomized_svd::factor(matrix, &params, &|| self.control.check())?;
            let enough = factors.energy >= energy.min(1.0 - ROUNDING_OF_POWER) || projection >= matrix.rows.min(matrix.columns);
            if enough || !grows {
                return Ok(factors);
            }
            projection *= 2;
        }
    }
}

/// Products for each channel of colour weights, or the one for all: column `j` of `N` goes with column `of_bin(j)` of `M`.
pub(super) fn products(bins: &Bins, channels: usize, n: Basis<'_>, m: Basis<'_>, of_bin: impl Fn(usize) -> usize) -> Vec<Product> {
    let of_channel = |c: usize| {
        let columns: Vec<[usize; 2]> = (0..bins.normals.len()).map(|j| [channels * j + c, of_bin(j)]).collect();
        Product::new(n, m, &columns)
    };
    (0..channels.max(1)).map(of_channel).collect()
}

/// What turns a number along a colour direction, or one of each channel, into a colour of a surface.
pub(super) fn colour_of(surface: &Surface, colours: Colours, direction: &[f64; 3]) -> [f64; 3] {
    // Image tints are in N.
    let tint = if let Tint::Uniform(tint) = surface.tint { tint.map(f64::from) } else { [1.0; 3] };
    match colours {
        Colours::Principal => std::array::from_fn(|c| tint[c] * direction[c]),
        Colours::Three => tint,
    }
}
