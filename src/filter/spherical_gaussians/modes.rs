//! Few numbers a pair for what it sees of many lobes: *modes* of visibility.
//!
//! The visible areas of `L` lobes for all pairs lie near a space of few dimensions. Its basis, the modes, are the leading singular vectors of the visible shares of
//! some pairs, each lobe weighted by what it adds to a sharp BRDF. The amplitudes of a pair are not the plain projection on them, which serves all lobes alike, but
//! those that give the right sums for a row of spherical Gaussians about the pair's half vector, blunt to sharp: what BRDFs are sums of. So lobes near the half vector, which
//! decide what a sharp BRDF reflects, are exact where those far from it, which only blunt BRDFs see, need be right in sum.
//!
//! With `R_lk` the integral of lobe `l` and Gaussian `k`, `v_l` the visible areas and `B` the modes, the amplitudes `a` minimise
//!
//! ```text
//! sum_k s_k² (sum_l (sum_j a_j B_jl - v_l) R_lk)² + λ |a - P v|²
//! ```

use super::lobe_areas::LobeArea;
use super::products::{PairAxes, exact_of_each, masked};
use crate::filter::lobes::Masking;
use crate::numerics::cast::narrow;
use crate::numerics::linear_algebra::{Cholesky, largest_eigenvectors};
use crate::sg::Lobe;
use crate::simd::{self, Kernel, LANES, Lanes};
use glam::DVec3;

/// Pairs that modes are learnt from. In the design study, which is not part of the project, more than 100 did not help: within 1 dB of 800 on rods, weave and bumps with 8 modes.
pub const SAMPLE_PAIRS: usize = 128;
/// Sharpness of the Gaussians whose sums are kept, first with cosines as factors, then with Smith's masking: a BRDF's other factors lie between the two.
/// Up to 4096, that of a GGX lobe of alpha .02, a factor of 4 apart; with 2 the errors were the same within 1 dB in the design study.
const SHARPNESS: [f32; HALF] = [0.0, 1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0];
/// So many, half of the lanes.
const HALF: usize = LANES / 2;
/// Roughness squared of that masking: that of GGX lobes with alpha .14.
const SMOOTH: f32 = 0.02;
/// Weight `λ` of the plain projection beside the mean square that an amplitude has in the sums. 1e-4 to 1e-8 were alike within 2 dB in the design study.
const RIDGE: f64 = 1e-6;
/// Sharpness of the sharpest BRDF that lobes are weighted for: that of a GGX lobe of alpha .05.
const GLOSSY: f32 = 800.0;
/// A Gaussian to which no lobe answers by more than this is left out.
const LEAST_RESPONSE: f64 = 1e-10;

/// Modes of the visible areas of lobes.
pub struct VisibilityModes {
    /// Modes.
    pub count: usize,
    lobes: Vec<Lobe>,
    /// Visible area of each lobe by each mode: `count` numbers a lobe.
    basis: Vec<f32>,
    /// What each lobe's visible area adds to the projection on each mode.
    projection: Vec<f32>,
    /// Mean area of a lobe.
    mean_area: f64,
}

impl VisibilityModes {
    /// The `count` leading modes of `lobes` whose whole areas are `areas`, from the visible areas of some pairs: a row a pair and channel.
    pub fn new(lobes: &[Lobe], areas: &[f32], sample: &[Vec<f32>], count: usize) -> Self {
        // A lobe of area `a` whose visible share is off by `d` errs by `(a d)²` times its integral of squares, which is about its sharpness.
        let spread = |lobe: &Lobe| (lobe.sharpness * GLOSSY / (lobe.sharpness + GLOSSY)).sqrt();
        let weight: Vec<f64> =
            lobes.iter().zip(areas).map(|(lobe, area)| f64::from(if *area > 0.0 { spread(lobe) } else { 0.0 })).collect();
        let rows: Vec<Vec<f64>> = sample.iter().map(|row| row.iter().zip(&weight).map(|(v, w)| f64::from(*v) * w).collect()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let gram: Vec<f64> = rows.iter().flat_map(|a| rows.iter().map(|b| dot(a, b))).collect();
        // Eigenvectors of the pairs' Gram matrix; times the rows and normalised they are the singular vectors over the lobes.
        let vectors = largest_eigenvectors(&gram, rows.len(), count).unwrap_or_default();
        let power: f64 = (0..rows.len()).map(|k| gram[k * rows.len() + k]).sum();
        let mut modes: Vec<Vec<f64>> = Vec::new();
        for vector in &vectors {
            let mut mode = vec![0.0; lobes.len()];
            for (share, row) in vector.iter().zip(&rows) {
                mode.iter_mut().zip(row).for_each(|(m, v)| *m += share * v);
            }
            // Below it a mode is rounding.
            let norm2 = dot(&mode, &mode);
            if norm2 > 1e-12 * power {
                modes.push(mode.iter().map(|m| m / norm2.sqrt()).collect());
            }
        }
        let of_lobes = |scale: &dyn Fn(usize) -> f64| -> Vec<f32> {
            (0..lobes.len()).flat_map(|l| modes.iter().map(move |mode| (l, mode))).map(|(l, mode)| narrow(mode[l] * scale(l))).collect()
        };
        Self {
            count: modes.len(),
            lobes: lobes.to_vec(),
            basis: of_lobes(&|l| if weight[l] > 0.0 { 1.0 / weight[l] } else { 0.0 }),
            projection: of_lobes(&|l| weight[l]),
            mean_area: areas.iter().map(|a| f64::from(*a)).sum::<f64>() / lobes.len().max(1) as f64,
        }
    }

    /// Writes the amplitudes of a pair, `count` for each channel, from what it sees of the lobes.
    pub fn amplitudes(&self, directions: [DVec3; 2], areas: &[LobeArea], amplitudes: &mut [&mut [f32]]) {
        let sums = simd::run(PairSums { modes: self, axes: PairAxes::new(directions), areas, channels: amplitudes.len() });
        let least = LEAST_RESPONSE * LEAST_RESPONSE * self.lobes.len() as f64;
        let scale = sums.squares.map(|s| if f64::from(s) > least { 1.0 / (f64::from(s) / self.lobes.len() as f64).sqrt() } else { 0.0 });
        let scaled = |sum: &Lanes| -> [f64; LANES] { std::array::from_fn(|k| f64::from(sum[k]) * scale[k] / self.mean_area) };
        let dot = |a: &[f64; LANES], b: &[f64; LANES]| (0..LANES).map(|k| a[k] * b[k]).sum::<f64>();
        let of_modes: Vec<[f64; LANES]> = sums.of_modes.iter().map(scaled).collect();
        let mut normal: Vec<f64> = of_modes.iter().flat_map(|a| of_modes.iter().map(|b| dot(a, b))).collect();
        let trace: f64 = (0..self.count).map(|j| normal[j * self.count + j]).sum();
        (0..self.count).for_each(|j| normal[j * self.count + j] += RIDGE * trace / self.count as f64);
        let factor = Cholesky::new(&normal, self.count);
        for ((amplitudes, pair), projected) in amplitudes.iter_mut().zip(&sums.of_pair).zip(&sums.projected) {
            let mut missing = scaled(pair);
            for (projected, mode) in projected.iter().zip(&of_modes) {
                (0..LANES).for_each(|k| missing[k] -= f64::from(*projected) * mode[k]);
            }
            let right: Vec<f64> = of_modes.iter().map(|mode| dot(mode, &missing)).collect();
            // Where no lobe answers at all there is no factor, and nothing to correct.
            let correction = factor.as_ref().map_or_else(|| vec![0.0; self.count], |factor| factor.solve(&right));
            for ((amplitude, projected), correction) in amplitudes.iter_mut().zip(projected).zip(correction) {
                *amplitude = narrow(f64::from(*projected) + correction);
            }
        }
    }

    /// Writes the visible area of each lobe.
    #[inline(always)]
    pub fn expand(&self, amplitudes: &[f32], areas: &mut [f32]) {
        for (l, area) in areas.iter_mut().enumerate() {
            let basis = &self.basis[l * self.count..(l + 1) * self.count];
            *area = basis.iter().zip(amplitudes).map(|(b, a)| b * a).sum();
        }
    }

    /// Bytes of the modes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.basis[..])
    }
}

/// Integrals of the lobes of a pair, and of the modes, with the Gaussians of [`SHARPNESS`].
struct PairSums<'a> {
    modes: &'a VisibilityModes,
    axes: PairAxes,
    areas: &'a [LobeArea],
    channels: usize,
}

/// What [`PairSums`] gives.
struct Sums {
    /// Sum over the lobes of the squares of their integrals.
    squares: Lanes,
    /// Of each mode.
    of_modes: Vec<Lanes>,
    /// Of what the pair sees, by channel.
    of_pair: Vec<Lanes>,
    /// Projection of what the pair sees on the modes, by channel.
    projected: Vec<Vec<f32>>,
}

impl Kernel for PairSums<'_> {
    type Output = Sums;

    #[inline(always)]
    fn run(self) -> Sums {
        let VisibilityModes { count, lobes, basis, projection, .. } = self.modes;
        let mut squares = [0.0; LANES];
        let mut integrals = Vec::with_capacity(lobes.len() + 1);
        for lobes in lobes.chunks(2) {
            // The last lobe may be alone, and stands twice.
            integrals.extend(self.integrals([&lobes[0], &lobes[lobes.len() - 1]]));
        }
        integrals.truncate(lobes.len());
        for integrals in &integrals {
            for k in 0..LANES {
                squares[k] += integrals[k] * integrals[k];
            }
        }
        let visible = |c: usize| self.areas.iter().map(move |area| area.visible[c]);
        let of_mode = |j: usize| weighted_sum(basis[j..].iter().step_by(*count).copied(), &integrals);
        let mut projected = vec![vec![0.0; *count]; self.channels];
        for (c, projected) in projected.iter_mut().enumerate() {
            for (area, projection) in visible(c).zip(projection.chunks_exact((*count).max(1))) {
                for (sum, projection) in projected.iter_mut().zip(projection) {
                    *sum += area * projection;
                }
            }
        }
        Sums {
            squares,
            of_modes: (0..*count).map(of_mode).collect(),
            of_pair: (0..self.channels).map(|c| weighted_sum(visible(c), &integrals)).collect(),
            projected,
        }
    }
}

/// Sum of lanes with weights.
#[inline(always)]
fn weighted_sum(weights: impl Iterator<Item = f32>, lanes: &[Lanes]) -> Lanes {
    let mut sum = [0.0; LANES];
    for (weight, lanes) in weights.zip(lanes) {
        for k in 0..LANES {
            sum[k] += weight * lanes[k];
        }
    }
    sum
}

impl PairSums<'_> {
    /// Integrals of two lobes with the Gaussians, first with cosines, then with Smith's masking.
    #[inline(always)]
    fn integrals(&self, lobes: [&Lobe; 2]) -> [Lanes; 2] {
        // One lobe in either half of the lanes.
        let each = |numbers: [f32; 2]| -> Lanes { std::array::from_fn(|k| numbers[k / HALF]) };
        let sharpness: Lanes = std::array::from_fn(|k| SHARPNESS[k % HALF]);
        let own = each([lobes[0].sharpness, lobes[1].sharpness]);
        let distance = each([self.axes.distance_squared(lobes[0]), self.axes.distance_squared(lobes[1])]);
        let products = exact_of_each(&own, &sharpness, &distance);
        let [a, b] = [self.axes.axis_cosines(lobes[0]), self.axes.axis_cosines(lobes[1])];
        let [axis_i, axis_o, axis_h] = [each([a[0], b[0]]), each([a[1], b[1]]), each([a[2], b[2]])];
        let cosines = self.axes.cosines_of_each(&own, [&axis_i, &axis_o, &axis_h], &sharpness);
        let (by_cosine, by_smith) = (masked(&cosines, Masking::Cosine), masked(&cosines, Masking::Ggx(SMOOTH)));
        let mut out = [[0.0; LANES]; 2];
        for k in 0..HALF {
            for (j, out) in out.iter_mut().enumerate() {
                let lane = j * HALF + k;
                let product = products[lane] * lobes[j].amplitude;
                out[k] = product * by_cosine[lane];
                out[HALF + k] = product * by_smith[lane];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::spherical_gaussians::products::exact;
    use crate::numerics::random::Random;
    use glam::Vec3;

    /// Lobes along an arc, each a unit of area.
    fn arc(count: u8) -> Vec<Lobe> {
        let lobe = |k: u8| {
            let (sin, cos) = (2.4 * (f32::from(k) / f32::from(count - 1) - 0.5)).sin_cos();
            Lobe::density(Vec3::new(sin, 0.0, cos), 200.0)
        };
        (0..count).map(lobe).collect()
    }

    fn area(visible: f32) -> LobeArea {
        LobeArea { projected: [0.0; 3], visible: [visible; 3] }
    }

    /// A step: what is left of `edge` is hidden.
    fn step(lobes: &[Lobe], edge: f32) -> Vec<f32> {
        lobes.iter().map(|lobe| 1.0 / (1.0 + (-12.0 * (lobe.axis.x - edge)).exp())).collect()
    }

    fn pair(x: f64) -> [DVec3; 2] {
        [DVec3::new(x, 0.3, 1.0).normalize(), DVec3::new(0.4 - x, -0.2, 1.0).normalize()]
    }

    #[test]
    fn visibility_in_the_space_of_the_modes_comes_back() {
        let lobes = arc(40);
        let patterns: Vec<Vec<f32>> = [-0.6, -0.1, 0.3].map(|edge| step(&lobes, edge)).to_vec();
        let mut random = Random::new(7);
        let mut mixed = || -> Vec<f32> {
            let shares = [(); 3].map(|()| narrow(random.unit()));
            (0..lobes.len()).map(|l| (0..3).map(|j| shares[j] * patterns[j][l]).sum()).collect()
        };
        let sample: Vec<Vec<f32>> = (0..30).map(|_| mixed()).collect();
        let modes = VisibilityModes::new(&lobes, &[1.0; 40], &sample, 8);
        assert_eq!(modes.count, 3, "three patterns are mixed");
        for _ in 0..10 {
            let visible = mixed();
            let mut amplitudes = [0.0; 3];
            modes.amplitudes(pair(0.3), &visible.iter().map(|v| area(*v)).collect::<Vec<_>>(), &mut [&mut amplitudes]);
            let mut expanded = [0.0; 40];
            modes.expand(&amplitudes, &mut expanded);
            for (got, expected) in expanded.iter().zip(&visible) {
                assert!((got - expected).abs() < 2e-4, "{got} for {expected}");
            }
        }
    }

    #[test]
    fn sums_for_gaussians_about_the_half_vector_are_nearer_than_by_projection() {
        let lobes = arc(60);
        let sample: Vec<Vec<f32>> = (0..50_u8).map(|k| step(&lobes, 0.03 * f32::from(k) - 0.8)).collect();
        let modes = VisibilityModes::new(&lobes, &[1.0; 60], &sample, 4);
        let [mut kept, mut plain] = [0.0; 2];
        for (x, edge) in [(0.0, 0.1), (0.5, 0.2), (-0.6, -0.3)] {
            let visible = step(&lobes, edge);
            let mut amplitudes = [0.0; 4];
            modes.amplitudes(pair(x), &visible.iter().map(|v| area(*v)).collect::<Vec<_>>(), &mut [&mut amplitudes]);
            let projected: Vec<f32> = (0..4).map(|j| (0..60).map(|l| visible[l] * modes.projection[4 * l + j]).sum()).collect();
            let axes = PairAxes::new(pair(x));
            // Sharpnesses between those that are kept.
            for sharpness in [2.0, 40.0, 500.0] {
                let integral = |lobe: &Lobe| exact(lobe.sharpness, &[sharpness; LANES], axes.distance_squared(lobe))[0];
                let sum =
                    |areas: &[f32]| -> f32 { lobes.iter().zip(areas).map(|(lobe, area)| area * lobe.amplitude * integral(lobe)).sum() };
                let error = |amplitudes: &[f32]| {
                    let mut expanded = [0.0; 60];
                    modes.expand(amplitudes, &mut expanded);
                    (sum(&expanded) / sum(&visible) - 1.0).abs()
                };
                kept += error(&amplitudes) / 9.0;
                plain += error(&projected) / 9.0;
            }
        }
        assert!(kept < 0.01 && kept < 0.5 * plain, "mean error {kept}, by projection {plain}");
    }

    #[test]
    fn what_nothing_sees_has_no_modes() {
        let lobes = arc(20);
        let modes = VisibilityModes::new(&lobes, &[1.0; 20], &vec![vec![0.0; 20]; 5], 4);
        assert_eq!(modes.count, 0);
        let mut amplitudes = [];
        modes.amplitudes(pair(0.1), &[area(0.0); 20], &mut [&mut amplitudes]);
        let mut expanded = [1.0; 20];
        modes.expand(&amplitudes, &mut expanded);
        assert_eq!(expanded, [0.0; 20]);
    }
}
