//! Sums over a batch of facets: over clusters where the facets have some, else facet by facet.

use super::area::visible_area;
use super::clusters::{ClusterViews, Clustered, ClusteredLobe};
use super::facets::FacetSums;
use super::task::{PairSums, of_task, split_by_task};
use super::views::Views;
use crate::clusters::Cluster;
use crate::facets::{Group, REPLICATES, Surface};
use crate::filter::facet_sampler::Batch;
use crate::filter::lobes::{self, Lobe};
use crate::filter::query::Query;
use crate::material::{self, Tint};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Lobes of each surface, tinted.
pub fn surface_lobes(surfaces: &[material::Surface]) -> Vec<Vec<Lobe<'_>>> {
    let of = |s: &'_ material::Surface| if let Tint::Uniform(tint) = s.tint { tint } else { [1.0; 3] };
    surfaces.iter().map(|s| lobes::lobes(&s.brdf, of(s))).collect()
}

/// Those of `directions`, with sums of visible `areas`, that are under-sampled: a triangle faces them, and yet a whole replicate shows nothing of them,
/// so that the spread of the replicates does not tell their error.
pub fn undersampled(surface: &Surface, directions: &[DVec3], areas: &[[f64; REPLICATES]]) -> Vec<DVec3> {
    let faced = |w: DVec3| surface.normals.iter().any(|n| n.dot(w) > 0.0);
    directions.iter().zip(areas).filter(|(w, sets)| sets.contains(&0.0) && faced(**w)).map(|(w, _)| *w).collect()
}

/// Adds the sums over a batch of visible area, one element a direction.
pub fn add_areas(batch: &Batch, directions: &[DVec3], areas: &mut [[f64; REPLICATES]]) {
    areas.par_iter_mut().zip(directions).enumerate().for_each(|(d, (area, &direction))| {
        for (sum, new) in area.iter_mut().zip(visible_area(&batch.facets, direction, batch.bits.row(d))) {
            *sum += new;
        }
    });
}

/// How a batch is summed.
pub struct Materials<'a> {
    /// Groups of the facets.
    pub groups: &'a [Group],
    /// Lobes of each surface.
    pub lobes: &'a [Vec<Lobe<'a>>],
    /// For each surface its lobes under its clusters, if there are clusters.
    clustered: Option<Vec<Vec<ClusteredLobe<'a>>>>,
}

impl<'a> Materials<'a> {
    /// For groups under the lobes of each surface; by clusters if the groups are some and `by_clusters` says so.
    pub fn new(groups: &'a [Group], lobes: &'a [Vec<Lobe<'a>>], by_clusters: bool) -> Self {
        let of = |s: usize| -> Vec<&Cluster> {
            groups.iter().filter(|g| usize::from(g.surface) == s).filter_map(|g| g.cluster.as_ref()).collect()
        };
        let clustered = (by_clusters && groups.iter().any(|g| g.cluster.is_some())).then(|| {
            let surface = |(s, lobes): (usize, &'a Vec<Lobe<'a>>)| {
                let clusters = of(s);
                lobes.iter().map(|lobe| ClusteredLobe::new(lobe, &clusters)).collect()
            };
            lobes.iter().enumerate().map(surface).collect()
        });
        Self { groups, lobes, clustered }
    }
}

/// Adds the sums over a batch of the pairs of `tasks`, a run of [`Query::tasks`], one element a pair.
pub fn add_pairs(batch: &Batch, query: &Query, tasks: &[Range<usize>], materials: &Materials<'_>, sums: &mut [PairSums]) {
    let slices = split_by_task(sums, tasks, 1);
    let Batch { facets, bits, .. } = batch;
    let work = slices.into_par_iter().zip(tasks);
    let Some(clustered) = &materials.clustered else {
        let of_facets = FacetSums { facets, bits, query, groups: materials.groups, lobes: materials.lobes };
        work.for_each_init(Views::default, |views, (slice, task)| of_facets.add(task.clone(), views, slice));
        return;
    };
    // Clusters come with samples spread by area: every facet stands for the same.
    let weight = facets.weight.iter().copied().fold(0.0, f32::max).into();
    let words = |g: usize| facets.ranges[g].start / 64..facets.ranges[g].end / 64;
    let of = |s: usize| (0..materials.groups.len()).filter(|&g| usize::from(materials.groups[g].surface) == s).map(words).collect();
    let ranges: Vec<Vec<Range<usize>>> = (0..clustered.len()).map(of).collect();
    work.for_each_init(ClusterViews::default, |views, (slice, task)| {
        let (directions, pairs) = of_task(bits, query, task.clone());
        for (lobes, ranges) in clustered.iter().zip(&ranges) {
            Clustered { ranges, lobes, weight }.add(&directions, &pairs, views, slice);
        }
    });
}
