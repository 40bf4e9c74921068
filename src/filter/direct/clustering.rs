//! How the triangles are clustered, and what clusters of unequal normals cost.

use super::params::PARAMS;
use crate::brdf::Brdf;
use crate::clusters::SPREAD_PER_ALPHA;
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{Clustering, REPLICATES, Runs};
use crate::filter::control::Control;
use crate::filter::facet_sampler::FacetSampler;
use crate::filter::plan::{CLUSTER_WIDTHS, DirectPlan};
use crate::filter::query::Query;
use crate::filter::subset::subset;
use crate::filter::sums::{self, Materials, PairSums};
use crate::material::{SmallScale, Surface, Tint};

/// A sampler of triangles whose clusters cost no more than their share of the tolerance.
pub(super) struct ClusteredTracer<'a> {
    pub sampler: FacetSampler<'a>,
    /// Place of the clusters' width in [`CLUSTER_WIDTHS`].
    pub narrowed: usize,
    /// What clusters of unequal normals cost, relative RMS.
    pub bias: f64,
}

/// Narrows the clusters until their bias keeps its share of `tolerance`: they are a model, whose error must leave room for that of the samples. A plan
/// repeats what was chosen for the tolerance of its day.
pub(super) fn clustered<'a>(
    small: &'a SmallScale,
    pairs: &[Pair],
    query: &Query,
    plan: Option<DirectPlan>,
    tolerance: f64,
    seed: u32,
    control: &Control<'a>,
) -> Result<ClusteredTracer<'a>> {
    let long = query.pairs.len() > PARAMS.long_list;
    let probes = if long { subset(pairs, query, PARAMS.bias_pairs) } else { Vec::new() };
    let widest = if long && query.pairs.len() <= PARAMS.wide_clusters { CLUSTER_WIDTHS.len() - 1 } else { 0 };
    let mut narrowed = plan.map_or(widest, |plan| plan.narrowed);
    // Clusters count facets, which must all stand for the same: where a plan spreads them unevenly, whatever surface it was made for, each
    // is summed by itself.
    let even = !plan.is_some_and(|plan| plan.weighted);
    loop {
        let clustering = even.then(|| clustering(small, long, CLUSTER_WIDTHS[narrowed])).flatten();
        let sampler = FacetSampler::new(small, clustering.as_ref(), seed, control);
        let bias = bias(small, &sampler, &probes)?;
        let too_wide = bias > PARAMS.bias_share * tolerance;
        if !too_wide || plan.is_some() {
            return Ok(ClusteredTracer { sampler, narrowed, bias });
        }
        narrowed += 1;
    }
}

/// How the triangles may be clustered: equal normals, and for long lists also those that the narrowest lobe of each surface tells little
/// apart, `width` of the widest that clusters come in; for short lists, whose cost is the visibility, measuring their bias would cost
/// more than they save. `None` where an image tints each facet by itself.
fn clustering(small: &SmallScale, long: bool, width: f64) -> Option<Clustering> {
    let uniform = small.surfaces.iter().all(|s| matches!(s.tint, Tint::Uniform(_)));
    let spread = |s: &Surface| match &s.brdf {
        // The lobes of these are not widened by a cluster's spread.
        Brdf::BlinnPhong { .. } | Brdf::Measured(_) => 0.0,
        brdf if long => width * SPREAD_PER_ALPHA * brdf.roughness(),
        _ => 0.0,
    };
    let most = if long { PARAMS.most_clusters_long } else { PARAMS.most_clusters };
    uniform.then(|| Clustering { spread: small.surfaces.iter().map(spread).collect(), most })
}

/// What clusters of unequal normals cost: the relative RMS difference of `fbar` from sums facet by facet, over the pairs `probes`. Not of `S`: a
/// grazing viewer sees little, and counts as much as any.
fn bias(small: &SmallScale, sampler: &FacetSampler<'_>, probes: &[Pair]) -> Result<f64> {
    let groups = &sampler.surface.groups;
    if !groups.iter().any(|g| g.cluster.is_some_and(|c| c.covariance != [0.0; 3])) {
        return Ok(0.0);
    }
    let query = Query::new(probes, false);
    let batch = sampler.batch(Runs::of_block(0, PARAMS.pilot_samples, 0, 1), &query.directions)?;
    let lobes = sums::surface_lobes(&small.surfaces);
    let sums_of = |by_clusters| {
        let mut sums = vec![[[0.0; 3]; REPLICATES]; query.pairs.len()];
        sums::add_pairs(&batch, &query, &query.tasks(), &Materials::new(groups, &lobes, by_clusters), &mut sums);
        sums
    };
    let (by_clusters, by_facets) = (sums_of(true), sums_of(false));
    let mut areas = vec![[0.0; REPLICATES]; query.directions.len()];
    sums::add_areas(&batch, &query.directions, &mut areas);
    let total = |s: &PairSums, c: usize| s.iter().map(|set| set[c]).sum::<f64>();
    let (mut difference, mut energy) = (0.0, 0.0);
    for ((a, b), [_, viewer]) in by_clusters.iter().zip(&by_facets).zip(&query.pairs) {
        let area: f64 = areas[*viewer as usize].iter().sum();
        for c in 0..3 {
            if area > 0.0 {
                difference += ((total(a, c) - total(b, c)) / area).powi(2);
                energy += (total(b, c) / area).powi(2);
            }
        }
    }
    Ok(if energy > 0.0 { (difference / energy).sqrt() } else { 0.0 })
}
