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
use crate::filter::sums::{of_task, split_by_task};
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::{index_u32, narrow};
use crate::numerics::linear_algebra::Cholesky;
use crate::numerics::non_negative::non_negative_least_squares;
use crate::sg::{Lobe, MAX_SHARPNESS};
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// A facet does not count for a group that has less of it; the others share it. Chosen, not measured: errors are measured with it.
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
    /// Facets, those of one lobe after those of another, filled up to whole lanes with facets of weight 0.
    members: Vec<u32>,
    /// Weight of each member over the footprint, for each channel.
    weights: Vec<Vec<Lanes>>,
    /// Chunks of lanes of each group.
    chunks: Vec<Range<usize>>,
    /// Area over the footprint of each group, by channel.
    areas: Vec<[f32; 3]>,
    /// What least squares need.
    least_squares: Option<LeastSquares>,
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
            members: Vec::new(),
            weights: vec![Vec::new(); channels],
            chunks: Vec::new(),
            areas: Vec::new(),
            least_squares: (fit != AmplitudeFit::Responsibilities && count > 0).then(|| LeastSquares::new(lobes, fit)),
        };
        for lobe in &members {
            of.push(facets, lobe);
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
        split_by_task(&mut amplitudes, tasks, lobes).into_par_iter().zip(tasks).for_each_init(Vec::new, |views, (rows, task)| {
            let (directions, pairs) = of_task(&self.seen.bits, query, task.clone());
            views.clear();
            for (direction, bits) in directions {
                self.view(direction, bits, views);
            }
            let chunks = self.members.len() / LANES;
            for (row, pair) in rows.chunks_exact_mut(lobes).zip(pairs) {
                let of = |d: usize| &views[d * chunks..(d + 1) * chunks];
                simd::run(PairSums { facets: self, views: [of(pair.i), of(pair.o)], row });
                if let Some(least_squares) = &self.least_squares {
                    least_squares.solve(row, self.weights.len());
                }
            }
        });
        amplitudes
    }

    /// Appends how a direction sees the members: the cosine where a facet is seen, minus it where it is faced and hidden, 0 where it is turned away.
    fn view(&self, direction: DVec3, bits: &[u64], views: &mut Vec<Lanes>) {
        let facets = &self.seen.facets;
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

/// Least squares for the amplitudes of lobes.
struct LeastSquares {
    /// Gram matrix of the lobes with amplitude 1.
    gram: Vec<f64>,
    /// Its factor, where amplitudes may be negative.
    factor: Option<Cholesky>,
    /// Integrals of the lobes.
    integrals: Vec<f64>,
}

impl LeastSquares {
    fn new(lobes: &NormalLobes, fit: AmplitudeFit) -> Self {
        let peaks: Vec<Lobe> = lobes.lobes.iter().map(|l| Lobe { amplitude: 1.0, ..l.density }).collect();
        let mut gram: Vec<f64> = peaks.iter().flat_map(|a| peaks.iter().map(|b| f64::from(a.product_integral(b)))).collect();
        let integrals = lobes.lobes.iter().map(|l| 1.0 / f64::from(l.density.amplitude)).collect();
        let mut ridge = RIDGE;
        (0..peaks.len()).for_each(|k| gram[k * peaks.len() + k] *= 1.0 + ridge);
        if fit == AmplitudeFit::NonNegative {
            return Self { gram, factor: None, integrals };
        }
        // Lobes that coincide as far as f32 tells need more of it; a matrix whose diagonal is large enough has a factor.
        let factor = loop {
            if let Some(factor) = Cholesky::new(&gram, peaks.len()) {
                break factor;
            }
            ridge *= 10.0;
            (0..peaks.len()).for_each(|k| gram[k * peaks.len() + k] *= 1.0 + ridge);
        };
        Self { gram, factor: Some(factor), integrals }
    }

    /// Puts the visible area of each lobe in the place of the sums `b_j`.
    fn solve(&self, row: &mut [Amplitude], channels: usize) {
        for c in 0..channels {
            let b: Vec<f64> = row.iter().map(|a| f64::from(a.projected[c])).collect();
            let solution = match &self.factor {
                Some(factor) => factor.solve(&b),
                None => non_negative_least_squares(&self.gram, &b),
            };
            for ((a, x), integral) in row.iter_mut().zip(solution).zip(&self.integrals) {
                a.projected[c] = narrow(x * integral);
                a.visible[c] = 0.0;
            }
        }
    }
}
