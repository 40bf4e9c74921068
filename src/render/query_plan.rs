//! How fine the grid of a picture's table must be.
//!
//! That is measured, not guessed: [`PROBES`] of the picture's own pairs, drawn evenly from its pixels and lights, are computed at their
//! exact directions, and the grid is refined until what it interpolates there agrees. Drawn so, the relative RMS error is weighted by
//! the pixels that use a pair.

use super::query_table::{GridPlace, QueryTable, Source, Values, above, key, locate};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::{Control, Effective, Quality, Summary, Value, effective};
use crate::material::SmallScale;
use crate::numerics::cast::truncate_usize;
use crate::table::{Guide, GuideLobes, HemisphereGrid, node_count, value_count};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Pairs of the picture at which the error is measured.
pub const PROBES: usize = 256;
/// Rings of the first grid that is tried.
const FIRST_RINGS: usize = 8;
/// Most rings: 6,913 directions.
const MAX_RINGS: usize = 48;
/// Share of the squared tolerance that the facets may use.
const FACET_SHARE: f64 = 0.5;
/// A finer grid is made a little finer than the law `1 / rings²` says.
const MARGIN: f64 = 1.05;

/// How a material's values are made: found on the probes, used for the whole picture.
#[derive(Clone, Debug)]
pub struct QueryPlan {
    /// Rings of the grid.
    pub rings: usize,
    /// What is divided out before interpolation, if that helps.
    guide: Option<Guide>,
    /// How the probes were computed; its plan repeats it for the rest.
    pub summary: Summary,
    /// Relative RMS error of the values at the nodes.
    pub facets: f64,
    /// Relative RMS error of the interpolation.
    pub interpolation: f64,
    /// Whether no ray passes the surface.
    opaque: bool,
}

/// The filter as a source of values.
fn filtered<'a>(small: &'a SmallScale, control: &'a Control<'_>) -> impl FnMut(&[Pair], &Quality, Range<f64>) -> Result<Effective> + 'a {
    move |pairs, quality, share| control.part(share, |control| effective(small, pairs, quality, control))
}

/// Values of all pairs of nodes of a full table with as many rings as this one.
pub fn full_table(small: &SmallScale, rings: usize) -> usize {
    value_count(rings, small.is_reciprocal())
}

/// The guide that the lobes of a surface make for these pairs, if it has any.
fn guide_of(small: &SmallScale, exact: &[Value], pairs: &[Pair]) -> Option<Guide> {
    let directions: Vec<(DVec3, DVec3)> = pairs.iter().map(|p| (p.wi, p.wo)).collect();
    let mean = |c: usize| exact.iter().map(|v| v.s[c]).sum::<f64>() / exact.len() as f64;
    GuideLobes::of(small).map(|l| l.guide(std::array::from_fn(mean), &directions))
}

/// The probes, computed at their exact directions.
struct Probed<'a> {
    directions: &'a [(Vec3, Vec3)],
    pairs: Vec<Pair>,
    /// Radiance over irradiance.
    truth: Vec<[f64; 3]>,
    /// Sum of the squares of `truth`.
    energy: f64,
}

impl<'a> Probed<'a> {
    fn new(directions: &'a [(Vec3, Vec3)], pairs: Vec<Pair>, exact: &[Value], opaque: bool) -> Self {
        let ratio = |(v, p): (&Value, &Pair)| if opaque { v.fbar } else { v.s.map(|s| s / p.wo.z) };
        let truth: Vec<[f64; 3]> = exact.iter().zip(&pairs).map(ratio).collect();
        let energy = truth.iter().flatten().map(|v| v * v).sum();
        Self { directions, pairs, truth, energy }
    }

    /// Relative RMS of a sum of squares, or the absolute one where all values are 0.
    fn relative(&self, squares: f64) -> f64 {
        if self.energy > 0.0 { (squares / self.energy).sqrt() } else { (squares / self.truth.len() as f64).sqrt() }
    }

    /// Where the probes lie in a grid: light and viewer.
    fn locate(&self, grid: &HemisphereGrid) -> Vec<[GridPlace; 2]> {
        self.directions.iter().map(|&(wi, wo)| [locate(grid, wi), locate(grid, wo)]).collect()
    }

    /// Relative RMS error of what a table interpolates at the probes.
    fn error(&self, table: &QueryTable, located: &[[GridPlace; 2]]) -> f64 {
        let squares = located.iter().zip(&self.pairs).zip(&self.truth).map(|(([i, o], pair), truth)| {
            let cell = table.cell(key(i.triangle, o.triangle)).expect("the probes' own cells");
            let guide = table.guide_place(pair.wi.as_vec3(), pair.wo.as_vec3());
            let got = table.value(cell, i.weights, o.weights, guide.as_ref());
            (0..3).map(|c| (f64::from(got[c]) / pair.wo.z - truth[c]).powi(2)).sum::<f64>()
        });
        self.relative(squares.sum())
    }
}

impl QueryPlan {
    /// Finds how fine the grid must be for `probes`, pairs of the picture in the tile's frame, at least one.
    ///
    /// # Errors
    /// Those of [`effective`].
    pub fn find(small: &SmallScale, opaque: bool, probes: &[(Vec3, Vec3)], quality: &Quality, control: &Control<'_>) -> Result<Self> {
        Self::find_with(small, opaque, probes, quality, &mut filtered(small, control))
    }

    fn find_with(small: &SmallScale, opaque: bool, probes: &[(Vec3, Vec3)], quality: &Quality, values: &mut Values<'_>) -> Result<Self> {
        let pairs: Vec<Pair> = probes.iter().map(|&(wi, wo)| Pair { wi: above(wi), wo: above(wo) }).collect();
        let facet_quality = Quality { tolerance: quality.tolerance * FACET_SHARE.sqrt(), ..quality.clone() };
        let exact = values(&pairs, &facet_quality, 0.0..0.2)?;
        let guide = guide_of(small, &exact.values, &pairs);
        let probed = Probed::new(probes, pairs, &exact.values, opaque);
        let facets = if opaque {
            exact.summary.relative_rms
        } else {
            probed.relative(exact.values.iter().zip(&probed.pairs).flat_map(|(v, p)| v.s_se.map(|e| (e / p.wo.z).powi(2))).sum())
        };
        // Where the facets alone miss the tolerance, a bias of half their error adds no more than an eighth to it.
        let allowed = (quality.tolerance * quality.tolerance - facets * facets).max(facets * facets / 4.0).sqrt();
        let mut plan = Self { rings: FIRST_RINGS, guide: None, summary: exact.summary, facets, interpolation: 0.0, opaque };
        let mut done = 0.2;
        loop {
            let share = done..0.5 * (1.0 + done);
            done = share.end;
            plan.try_rings(small, &probed, guide.as_ref(), quality, &mut |pairs, quality, _| values(pairs, quality, share.clone()))?;
            if plan.interpolation <= allowed || plan.rings >= MAX_RINGS {
                return Ok(plan);
            }
            let finer = truncate_usize((MARGIN * plan.rings as f64 * (plan.interpolation / allowed).sqrt()).ceil().min(MAX_RINGS as f64));
            plan.rings = finer.clamp(plan.rings + 1, MAX_RINGS);
        }
    }

    /// Measures the interpolation with as many rings as the plan has, without and with a guide, and keeps the better of the two.
    fn try_rings(
        &mut self,
        small: &SmallScale,
        probed: &Probed<'_>,
        guide: Option<&Guide>,
        quality: &Quality,
        values: &mut Values<'_>,
    ) -> Result<()> {
        let located = probed.locate(&HemisphereGrid::new(self.rings));
        let mut keys: Vec<u64> = located.iter().map(|[i, o]| key(i.triangle, o.triangle)).collect();
        keys.sort_unstable();
        keys.dedup();
        let table = QueryTable::fill(&self.source(small), self.rings, keys, quality, values)?;
        self.interpolation = probed.error(&table, &located);
        self.guide = None;
        if let Some(guide) = guide {
            let guided = probed.error(&table.guided(guide), &located);
            if guided < self.interpolation {
                self.interpolation = guided;
                self.guide = Some(guide.clone());
            }
        }
        Ok(())
    }

    fn source<'a>(&'a self, small: &'a SmallScale) -> Source<'a> {
        Source { small, opaque: self.opaque, summary: &self.summary }
    }

    /// The whole relative RMS error.
    pub fn relative_rms(&self) -> f64 {
        self.facets.hypot(self.interpolation)
    }

    /// Directions of its grid.
    pub fn nodes(&self) -> usize {
        node_count(self.rings)
    }

    /// Whether a guide is used.
    pub fn is_guided(&self) -> bool {
        self.guide.is_some()
    }

    /// The values that the cells of these sorted, distinct keys need.
    ///
    /// # Errors
    /// Those of [`effective`].
    pub fn table(&self, small: &SmallScale, keys: Vec<u64>, quality: &Quality, control: &Control<'_>) -> Result<QueryTable> {
        let table = QueryTable::fill(&self.source(small), self.rings, keys, quality, &mut filtered(small, control))?;
        Ok(match &self.guide {
            Some(guide) => table.guided(guide),
            None => table,
        })
    }
}
