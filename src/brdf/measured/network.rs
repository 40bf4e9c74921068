//! The 100 materials of the MERL database as small neural networks (Sztrajman et al. 2021, *Neural BRDF Representation and
//! Importance Sampling*). They are fits, not measurements.
//!
//! `x = (sin θh, 0, cos θh, sin θd cos φd, sin θd sin φd, cos θd)` goes through two layers of 21 rectified units and one of 3;
//! `fr = max(e^y - 1, 0)`. φd is folded into `0..π`, where MERL has data: the networks were fitted there, and so they are
//! reciprocal. In the plane of incidence, where φd jumps from π to 0, the value is the one at 0.
//!
//! The network itself is evaluated, also in hot loops. A table cannot keep 1e-3: the units' kinks make the interpolation
//! error first order in the spacing. With 181 x 181 x 91 nodes (36 MB) and interpolated `y`, one direction in a hundred is still
//! off by .09 to 1 % (`merl_fits/table_error.py`), and such a table does not fit the cache.

use super::half_angle::HalfDifference;
use super::real::Real;
use crate::error::BadInput;

/// Units of the two hidden layers.
const UNITS: usize = 21;
/// `UNITS` rounded up to whole vectors of up to 16 lanes; the rest stays 0.
const LANES: usize = 32;
/// Numbers of a network as it is shipped: 6 x 21 + 21, 21 x 21 + 21, 21 x 3 + 3.
const NUMBERS: usize = 6 * UNITS + UNITS + UNITS * UNITS + UNITS + UNITS * 3 + 3;
/// Within this share of sin θd of the plane of incidence, φd counts as in the plane: there it changes sides by rounding.
const IN_PLANE: f64 = 1e-4;
/// Largest output before the exponential; the fits stay below 10.
const MAX_LOG: f64 = 18.0;

const NAMES: &str = include_str!("../merl_fits/names.txt");
const WEIGHTS: &[u8] = include_bytes!("../merl_fits/weights.f32");

/// Names of the built-in fits, in alphabetical order.
pub fn fit_names() -> impl Iterator<Item = &'static str> {
    NAMES.lines()
}

/// The weights of one material, by input and then by unit, padded with zeros.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    /// The second input is always 0 and has no row.
    w1: [[f32; LANES]; 5],
    b1: [f32; LANES],
    w2: [[f32; LANES]; UNITS],
    b2: [f32; LANES],
    /// By output, then by unit.
    w3: [[f32; LANES]; 3],
    b3: [f32; 3],
}

impl Network {
    /// The built-in fit of this name.
    pub fn named(name: &str) -> Result<Self, BadInput> {
        let place = fit_names().position(|n| n == name).ok_or_else(|| unknown(name))?;
        let numbers: Vec<f32> =
            WEIGHTS[place * NUMBERS * 4..][..NUMBERS * 4].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let (w1, rest) = numbers.split_at(6 * UNITS);
        let (b1, rest) = rest.split_at(UNITS);
        let (w2, rest) = rest.split_at(UNITS * UNITS);
        let (b2, rest) = rest.split_at(UNITS);
        let (w3, b3) = rest.split_at(UNITS * 3);
        let padded = |row: &[f32]| std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0));
        Ok(Self {
            w1: [0, 2, 3, 4, 5].map(|input| padded(&w1[input * UNITS..][..UNITS])),
            b1: padded(b1),
            w2: std::array::from_fn(|unit| padded(&w2[unit * UNITS..][..UNITS])),
            b2: padded(b2),
            w3: std::array::from_fn(|c| std::array::from_fn(|unit| if unit < UNITS { w3[unit * 3 + c] } else { 0.0 })),
            b3: [b3[0], b3[1], b3[2]],
        })
    }

    /// `fr` in 1/sr, plainly.
    pub fn eval<F: Real>(&self, angles: &HalfDifference<F>) -> [F; 3] {
        let forward = |sum: &mut [F; LANES], weights: &[f32; LANES], input: F| {
            for (sum, &w) in sum.iter_mut().zip(weights) {
                *sum = *sum + F::from(w) * input;
            }
        };
        let mut first = self.b1.map(F::from);
        for (row, input) in self.w1.iter().zip(inputs(angles)) {
            forward(&mut first, row, input);
        }
        let mut second = self.b2.map(F::from);
        for (row, unit) in self.w2.iter().zip(first) {
            forward(&mut second, row, unit.max(F::of(0.0)));
        }
        std::array::from_fn(|c| {
            let sum = second.iter().zip(&self.w3[c]).fold(F::from(self.b3[c]), |sum, (&unit, &w)| sum + F::from(w) * unit.max(F::of(0.0)));
            output(sum)
        })
    }

    /// [`Network::eval`] in `f32` on the widest vectors of the machine.
    #[inline]
    pub fn eval_f32(&self, angles: &HalfDifference<f32>) -> [f32; 3] {
        let [r, g, b] = pulp::Arch::new().dispatch(Forward { network: self, inputs: inputs(angles) });
        [output(r), output(g), output(b)]
    }
}

/// What the first layer sees, without the input that is always 0.
#[inline(always)]
fn inputs<F: Real>(angles: &HalfDifference<F>) -> [F; 5] {
    let [x, y] = angles.d;
    let x = F::select((x < F::of(0.0)) & (y <= F::of(IN_PLANE) * angles.sin_d), -x, x);
    [angles.sin_h, angles.cos_h, x, y, angles.cos_d]
}

/// `fr` of the last layer's sum.
#[inline(always)]
fn output<F: Real>(sum: F) -> F {
    sum.max(F::of(0.0)).min(F::of(MAX_LOG)).exp_m1()
}

/// The sums of the last layer, by vectors of units.
struct Forward<'a> {
    network: &'a Network,
    inputs: [f32; 5],
}

impl pulp::WithSimd for Forward<'_> {
    type Output = [f32; 3];

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> [f32; 3] {
        const { assert!(LANES.is_multiple_of(S::F32_LANES), "a row of weights is whole vectors") };
        let Network { w1, b1, w2, b2, w3, b3 } = self.network;
        let vectors = |row: &[f32; LANES], v: usize| S::as_simd_f32s(row).0[v];
        let zero = simd.splat_f32s(0.0);
        let mut first = [0.0; LANES];
        for (v, unit) in S::as_mut_simd_f32s(&mut first).0.iter_mut().enumerate() {
            let mut sum = vectors(b1, v);
            for (row, &input) in w1.iter().zip(&self.inputs) {
                sum = simd.mul_add_e_f32s(simd.splat_f32s(input), vectors(row, v), sum);
            }
            *unit = simd.max_f32s(sum, zero);
        }
        let mut last = [zero; 3];
        for v in 0..LANES / S::F32_LANES {
            // Two sums, even and odd units: one alone waits for its additions.
            let (mut even, mut odd) = (vectors(b2, v), zero);
            for (rows, units) in w2.chunks_exact(2).zip(first.chunks_exact(2)) {
                even = simd.mul_add_e_f32s(simd.splat_f32s(units[0]), vectors(&rows[0], v), even);
                odd = simd.mul_add_e_f32s(simd.splat_f32s(units[1]), vectors(&rows[1], v), odd);
            }
            even = simd.mul_add_e_f32s(simd.splat_f32s(first[UNITS - 1]), vectors(&w2[UNITS - 1], v), even);
            let second = simd.max_f32s(simd.add_f32s(even, odd), zero);
            for (last, row) in last.iter_mut().zip(w3) {
                *last = simd.mul_add_e_f32s(second, vectors(row, v), *last);
            }
        }
        let [r, g, b] = last;
        [simd.reduce_sum_f32s(r) + b3[0], simd.reduce_sum_f32s(g) + b3[1], simd.reduce_sum_f32s(b) + b3[2]]
    }
}

/// The mistake of naming a fit that is not there, with the nearest names.
fn unknown(name: &str) -> BadInput {
    let wanted = name.to_lowercase().replace(['_', ' '], "-");
    let rank = |n: &'static str| (!(n.contains(&wanted) || wanted.contains(n)), strsim::damerau_levenshtein(n, &wanted), n);
    let mut near: Vec<(bool, usize, &str)> = fit_names().map(rank).collect();
    near.sort_unstable();
    let nearest: Vec<String> = near.iter().take(4).map(|(_, _, n)| format!("`{n}`")).collect();
    BadInput::new(
        format!("there is no built-in fit \"{name}\""),
        format!("the nearest are {}; docs/brdf.md lists all {}", nearest.join(", "), near.len()),
    )
}
