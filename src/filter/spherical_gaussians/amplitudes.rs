//! What a pair sees of each lobe of the normals (Iwasaki et al. 2012, eq. 7 and 8).
//!
//! By *responsibilities*: each facet belongs to the lobes by the shares that the mixture has of its normal. The visible projected area
//! `(n·wi)+ (n·wo)+ V(wi) V(wo) dA` of a lobe is a sum over its facets, so no area is lost or negative; and the share of the area facing both
//! directions that is visible is what the lobe's density is multiplied by where the cosines are known better, near the half vector.
//!
//! By *least squares*: amplitudes that come nearest to `gamma (n·wi)+ (n·wo)+` over the sphere, `A mu = b` with the lobes' Gram matrix `A` and
//! `b_j = sum of gamma (n·wi)+ (n·wo)+ G_j(n) dA`.

use super::normals::NormalLobes;
use crate::facets::{Facets, NO_TRIANGLE};
use crate::filter::plan::AmplitudeFit;
use crate::filter::query::Query;
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::{index_u32, narrow};
use crate::numerics::linear_algebra::Cholesky;
use crate::numerics::non_negative::non_negative_least_squares;
use crate::sg::{Lobe, MAX_SHARPNESS};
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// A facet does not count for a group that has less of it: what all left out have is below a thousandth.
const LEAST_SHARE: f64 = 1e-3;
/// Share of its diagonal that is added to a Gram matrix: its elements are in f32, and lobes may nearly coincide.
const RIDGE: f64 = 1e-6;

/// What a pair sees of one group of lobes, over the footprint; a number a channel where facets have colours, else one in the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Amplitude {
    /// `∫ (n·wi)+ (n·wo)+ V(wi) V(wo) dA` of the group's facets.
    pub projected: [f32; 3],
    /// The group's area times the share of its facets facing both directions that both see; 0 by least squares, which has the cosines in its
    /// amplitudes.
    pub visible: [f32; 3],
}

/// The facets that count for each group of lobes of a surface.
///
/// By least squares each lobe is a group.
pub struct LobeFacets<'a> {
    seen: &'a VisibleFacets,
    fit: AmplitudeFit,
    /// Facets, those of one lobe after those of another, filled up to whole lanes with facets of weight 0.
    members: Vec<u32>,
    /// Weight of each member over the footprint, for each channel.
    weights: Vec<Vec<Lanes>>,
    /// Chunks of lanes of each group.
    chunks: Vec<Range<usize>>,
    /// Area over the footprint of each group, by channel.
    areas: Vec<[f32; 3]>,
    /// Gram matrix of the lobes with amplitude 1, and their integrals, for least squares.
    gram: Vec<f64>,
    integrals: Vec<f64>,
}

impl<'a> LobeFacets<'a> {
    /// For the facets `range` of a surface and its lobes.
    ///
    /// # Panics
    /// If by least squares groups have several lobes.
    pub fn new(seen: &'a VisibleFacets, range: Range<usize>, lobes: &NormalLobes, fit: AmplitudeFit, tinted: bool) -> Self {
        let facets = &seen.facets;
        let count = lobes.groups;
        assert!(fit == AmplitudeFit::Responsibilities || count == lobes.lobes.len(), "each lobe has an amplitude by least squares");
        let own: Vec<usize> = range.filter(|&f| facets.triangle[f] != NO_TRIANGLE).collect();
        let mut members: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
        let mut of_lobes = vec![0.0; lobes.lobes.len()];
        let mut shares = vec![0.0; count];
        for &f in &own {
            let normal = facets.normal_of(f);
            match fit {
                AmplitudeFit::Responsibilities => {
                    lobes.mixture.responsibilities(normal.as_dvec3(), &mut of_lobes);
                    shares.fill(0.0);
                    lobes.lobes.iter().zip(&of_lobes).for_each(|(lobe, share)| shares[lobe.group] += share);
                    shares.iter_mut().filter(|s| **s < LEAST_SHARE).for_each(|s| *s = 0.0);
                    let sum: f64 = shares.iter().sum();
                    shares.iter_mut().for_each(|s| *s /= sum);
                }
                AmplitudeFit::LeastSquares | AmplitudeFit::NonNegative => {
                    // A facet's normal is a lobe of the largest sharpness: a peak of no width has twice its area in the Gaussian of any width that comes
                    // nearest to it.
                    let facet = Lobe::density(normal, narrow(MAX_SHARPNESS));
                    for lobe in &lobes.lobes {
                        let peak = Lobe { amplitude: 1.0, ..lobe.density };
                        shares[lobe.group] = f64::from(peak.product_integral(&facet));
                    }
                }
            }
            members.iter_mut().zip(&shares).filter(|(_, s)| **s > 0.0).for_each(|(m, &s)| m.push((index_u32(f), s)));
        }
        let channels = if tinted { 3 } else { 1 };
        let mut of = Self {
            seen,
            fit,
            members: Vec::new(),
            weights: vec![Vec::new(); channels],
            chunks: Vec::new(),
            areas: Vec::new(),
            gram: Vec::new(),
            integrals: Vec::new(),
        };
        for lobe in &members {
            of.push(facets, lobe);
        }
        if fit != AmplitudeFit::Responsibilities {
            let pair = |k: usize| {
                let [a, b] = [k / count, k % count].map(|j| Lobe { amplitude: 1.0, ..lobes.lobes[j].density });
                let integral = f64::from(a.product_integral(&b));
                if k / count == k % count { integral * (1.0 + RIDGE) } else { integral }
            };
            of.gram = (0..count * count).map(pair).collect();
            of.integrals = lobes.lobes.iter().map(|l| 1.0 / f64::from(l.density.amplitude)).collect();
        }
        of
    }

    /// Adds the members of a lobe.
    fn push(&mut self, facets: &Facets, lobe: &[(u32, f64)]) {
        let first = self.members.len() / LANES;
        let mut area = [0.0; 3];
        for chunk in lobe.chunks(LANES) {
            for (c, weights) in self.weights.iter_mut().enumerate() {
                let mut lanes = [0.0; LANES];
                for (lane, &(f, share)) in lanes.iter_mut().zip(chunk) {
                    let tint = facets.tint.as_ref().map_or(1.0, |tint| f64::from(tint[c][f as usize]));
                    let weight = share * tint * f64::from(facets.weight[f as usize]) / facets.samples as f64;
                    area[c] += weight;
                    *lane = narrow(weight);
                }
                weights.push(lanes);
            }
            let filled = chunk.iter().map(|m| m.0).chain(std::iter::repeat(chunk[0].0)).take(LANES);
            self.members.extend(filled);
        }
        self.chunks.push(first..self.members.len() / LANES);
        self.areas.push(area.map(narrow));
    }

    /// The amplitudes of all groups for the pairs of `tasks`, a run of [`Query::tasks`]: a row a pair.
    pub fn amplitudes(&self, query: &Query, tasks: &[Range<usize>]) -> Vec<Amplitude> {
        let lobes = self.chunks.len();
        let pairs = tasks.iter().map(ExactSizeIterator::len).sum::<usize>();
        let mut amplitudes = vec![Amplitude::default(); lobes * pairs];
        if lobes == 0 {
            return amplitudes;
        }
        let solver = Solver::new(self.fit, &self.gram, lobes);
        let mut slices = Vec::with_capacity(tasks.len());
        let mut rest = &mut amplitudes[..];
        for task in tasks {
            let (slice, others) = rest.split_at_mut(lobes * task.len());
            slices.push(slice);
            rest = others;
        }
        slices.into_par_iter().zip(tasks).for_each_init(Vec::new, |views, (rows, task)| {
            let pairs = &query.pairs[task.clone()];
            let mut used: Vec<u32> = pairs.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            views.clear();
            for &d in &used {
                self.view(query.directions[d as usize], d as usize, views);
            }
            let place = |d: u32| used.binary_search(&d).expect("collected above");
            let chunks = self.members.len() / LANES;
            for (row, &[i, o]) in rows.chunks_exact_mut(lobes).zip(pairs) {
                let of = |d: usize| &views[d * chunks..(d + 1) * chunks];
                simd::run(PairSums { facets: self, views: [of(place(i)), of(place(o))], row });
                if self.fit != AmplitudeFit::Responsibilities {
                    for c in 0..self.weights.len() {
                        let b: Vec<f64> = row.iter().map(|a| f64::from(a.projected[c])).collect();
                        let solution = solver.solve(&b);
                        for ((a, x), integral) in row.iter_mut().zip(solution).zip(&self.integrals) {
                            a.projected[c] = narrow(x * integral);
                            a.visible[c] = 0.0;
                        }
                    }
                }
            }
        });
        amplitudes
    }

    /// Appends how a direction sees the members: the cosine where a facet is seen, minus it where it is faced and hidden, 0 where it is turned away.
    fn view(&self, direction: DVec3, d: usize, views: &mut Vec<Lanes>) {
        let (facets, bits) = (&self.seen.facets, self.seen.bits.row(d));
        let w = direction.as_vec3();
        for members in self.members.chunks_exact(LANES) {
            views.push(std::array::from_fn(|l| {
                let f = members[l] as usize;
                let cosine = facets.normal_of(f).dot(w).clamp(0.0, 1.0);
                if bits[f / 64] >> (f % 64) & 1 == 1 { cosine } else { -cosine }
            }));
        }
    }
}

/// Sums over the facets of each lobe for one pair.
struct PairSums<'a, 'b> {
    facets: &'a LobeFacets<'a>,
    /// How each of the two directions sees the members.
    views: [&'a [Lanes]; 2],
    row: &'b mut [Amplitude],
}

impl Kernel for PairSums<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let LobeFacets { weights, chunks, areas, .. } = self.facets;
        let [to_light, to_viewer] = self.views;
        for ((amplitude, chunks), area) in self.row.iter_mut().zip(chunks).zip(areas) {
            for (c, weights) in weights.iter().enumerate() {
                let (mut projected, mut visible, mut facing) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
                for k in chunks.clone() {
                    let (a, b, w) = (&to_light[k], &to_viewer[k], &weights[k]);
                    for l in 0..LANES {
                        let seen = if a[l] > 0.0 && b[l] > 0.0 { w[l] } else { 0.0 };
                        let faced = if a[l] != 0.0 && b[l] != 0.0 { w[l] } else { 0.0 };
                        projected[l] += seen * (a[l] * b[l]);
                        visible[l] += seen;
                        facing[l] += faced;
                    }
                }
                let [projected, visible, facing] = [projected, visible, facing].map(|lanes| lanes.iter().sum::<f32>());
                amplitude.projected[c] = projected;
                amplitude.visible[c] = if facing > 0.0 { area[c] * (visible / facing) } else { 0.0 };
            }
        }
    }
}

/// What solves for amplitudes by least squares.
enum Solver<'a> {
    Free(Option<Cholesky>),
    NonNegative(&'a [f64]),
}

impl<'a> Solver<'a> {
    fn new(fit: AmplitudeFit, gram: &'a [f64], lobes: usize) -> Self {
        match fit {
            AmplitudeFit::LeastSquares => Self::Free(Cholesky::new(gram, lobes)),
            AmplitudeFit::NonNegative | AmplitudeFit::Responsibilities => Self::NonNegative(gram),
        }
    }

    fn solve(&self, b: &[f64]) -> Vec<f64> {
        match self {
            Self::Free(Some(cholesky)) => cholesky.solve(b),
            // Lobes that coincide as far as f32 tells: nothing was solved for.
            Self::Free(None) => vec![0.0; b.len()],
            Self::NonNegative(gram) => non_negative_least_squares(gram, b),
        }
    }
}
