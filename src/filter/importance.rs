//! Where facets are worth most: a density of samples from a pilot run.
//!
//! The variance of `q = S/a` at a pair, by the ratio estimator, is that of the residuals `(fr (n·i)+ V(i) - q) (n·o)+ V(o) / a` of the
//! facets. The sum of the variances over all pairs is least when samples go where the root of the sum of the squared residuals is
//! large (Neyman allocation): to facets that many pairs see and that reflect unlike the average, not to the feet of rods that
//! nothing sees.

use super::facet_sampler::Batch;
use super::lobes::{Half, Lobe};
use super::query::Query;
use super::sums::{BLOCK_FACETS, normals, seen_cosine};
use crate::facets::{Facets, Group};
use crate::numerics::cast::{narrow, truncate_usize};
use crate::simd::{self, Kernel, LANES};
use glam::DVec3;
use rayon::prelude::*;

/// Pairs that the residuals are taken over; more would cost more than they tell. Chosen, not measured.
const PAIRS: usize = 256;
/// Share of the samples that go by area all the same (defensive sampling: Hesterberg 1995), so that no weight exceeds 1 / share and what the pilot run
/// missed is not lost. Chosen, not measured.
const DEFENSIVE: f64 = 0.25;

/// What the pilot run found: `q = fbar`, as the mean of the channels, and `a = av`, for a pair of the list.
#[derive(Clone, Copy, Debug)]
pub struct PilotValue {
    /// Cosine-weighted effective BRDF.
    pub q: f64,
    /// Visible projected area over the footprint.
    pub a: f64,
}

/// Importance of `stretches` stretches of the surface of equal area, by a pilot run of samples spread by area.
///
/// `known(k)` is what the run found for pair `k` of the list.
pub fn importance(
    pilot: &Batch,
    query: &Query,
    groups: &[Group],
    lobes: &[Vec<Lobe<'_>>],
    known: impl Fn(usize) -> PilotValue + Sync,
    stretches: usize,
) -> Vec<f64> {
    let Batch { facets, bits, .. } = pilot;
    let step = query.entries.len().div_ceil(PAIRS).max(1);
    let chosen: Vec<usize> = (0..query.entries.len()).step_by(step).filter(|&k| query.entries[k].is_some()).collect();
    let blocks: Vec<usize> = (0..facets.triangle.len()).step_by(BLOCK_FACETS).collect();
    let squares: Vec<Vec<f32>> = blocks
        .par_iter()
        .map(|&start| {
            let mut squares = vec![0.0; BLOCK_FACETS.min(facets.triangle.len() - start)];
            for &k in &chosen {
                let entry = query.entries[k].expect("filtered above");
                let known = known(k);
                if known.a > 0.0 {
                    let [first, second] = query.pairs[entry.pair as usize];
                    let light = if entry.viewer == second { first } else { second };
                    let seen_from = |d: u32| (query.directions[d as usize], bits.row(d as usize));
                    simd::run(Residuals {
                        facets,
                        start,
                        groups,
                        lobes,
                        light: seen_from(light),
                        viewer: seen_from(entry.viewer),
                        known,
                        squares: &mut squares,
                    });
                }
            }
            squares
        })
        .collect();
    // Mean of the facets of each stretch; those that only fill up have no weight and do not count.
    let mut sum = vec![0.0; stretches];
    let mut count = vec![0.0_f64; stretches];
    for (f, square) in squares.into_iter().flatten().enumerate() {
        if facets.weight[f] > 0.0 {
            let stretch = truncate_usize(f64::from(facets.along[f]) * stretches as f64).min(stretches - 1);
            sum[stretch] += f64::from(square);
            count[stretch] += 1.0;
        }
    }
    let roots: Vec<f64> = sum.iter().zip(&count).map(|(s, n)| (s / n.max(1.0)).sqrt()).collect();
    let mean = roots.iter().sum::<f64>() / stretches as f64;
    if mean > 0.0 { roots.iter().map(|r| DEFENSIVE + (1.0 - DEFENSIVE) * r / mean).collect() } else { vec![1.0; stretches] }
}

/// How many times smaller independent samples' variance becomes if they follow `importance`: `Σ r² / Σ (r²/d)`, `d` the density and `r` what it
/// was made from. More than it is, a little: the pilot's noise looks like importance.
pub fn gain(importance: &[f64]) -> f64 {
    let squares = importance.iter().map(|d| (((d - DEFENSIVE) / (1.0 - DEFENSIVE)).powi(2), *d));
    let (even, weighted) = squares.fold((0.0, 0.0), |(even, weighted), (square, d)| (even + square, weighted + square / d));
    if weighted > 0.0 { even / weighted } else { 1.0 }
}

/// Adds the squared residuals of one pair to those of a block of facets.
struct Residuals<'a> {
    facets: &'a Facets,
    start: usize,
    groups: &'a [Group],
    lobes: &'a [Vec<Lobe<'a>>],
    light: (DVec3, &'a [u64]),
    viewer: (DVec3, &'a [u64]),
    known: PilotValue,
    squares: &'a mut [f32],
}

impl Kernel for Residuals<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { facets, start, groups, lobes, light, viewer, known, squares } = self;
        let half = Half::new(light.0, viewer.0);
        let i_dot_h = 0.5 * (light.0 + viewer.0).length();
        let (q, inverse_a) = (narrow(known.q), narrow(1.0 / known.a));
        for (range, group) in facets.ranges.iter().zip(groups) {
            let lobes = &lobes[usize::from(group.surface)];
            let (from, to) = (range.start.max(start), range.end.min(start + squares.len()));
            for chunk in (from..to.max(from)).step_by(LANES) {
                let cosine_o = seen_cosine(facets, chunk, viewer.0, viewer.1);
                if cosine_o == [0.0; LANES] {
                    continue;
                }
                let cosine_i = seen_cosine(facets, chunk, light.0, light.1);
                let normals = normals(facets, chunk);
                let mut reflected = [0.0; LANES];
                for lobe in lobes {
                    let grey = narrow(lobe.colour_at(i_dot_h).iter().sum::<f64>() / 3.0);
                    let value = lobe.at_normals(&normals, [&cosine_i, &cosine_o], [light.0, viewer.0], &half);
                    for l in 0..LANES {
                        reflected[l] += grey * value[l];
                    }
                }
                for l in 0..LANES {
                    let residual = (reflected[l] - q * cosine_o[l]) * inverse_a;
                    squares[chunk - start + l] += residual * residual;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_gain_where_importance_is_uneven() {
        assert!((gain(&[1.0; 8]) - 1.0).abs() < 1e-12);
        // Half of the surface says nothing, as r = 0 and 2: variance 2 evenly, and 4 / 1.75 / 2 by the density .25 and 1.75.
        assert!((gain(&[0.25, 1.75]) - 1.75).abs() < 1e-12);
    }
}
