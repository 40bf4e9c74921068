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

use super::half_angle::{HalfDifference, Halfway};
use super::real::Real;
use crate::error::BadInput;
use crate::numerics::stable_bytes::StableBytes;
use crate::simd::{Kernel, LANES, Lanes};

/// Units of the two hidden layers.
const UNITS: usize = 21;
/// `UNITS` rounded up to whole vectors; the rest stays 0.
const PADDED: usize = 32;
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
    w1: [[f32; PADDED]; 5],
    b1: [f32; PADDED],
    w2: [[f32; PADDED]; UNITS],
    b2: [f32; PADDED],
    /// By output, then by unit.
    w3: [[f32; PADDED]; 3],
    b3: [f32; 3],
}

impl Network {
    /// See [`Brdf::write`](super::super::Brdf::write).
    pub fn write(&self, out: &mut StableBytes<'_>) {
        let rows = self.w1.iter().chain([&self.b1]).chain(&self.w2).chain([&self.b2]).chain(&self.w3);
        rows.for_each(|row| out.singles(row));
        out.singles(&self.b3);
    }

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
    #[inline(always)]
    fn eval<F: Real>(&self, angles: &HalfDifference<F>) -> [F; 3] {
        let (mut first, mut second) = ([F::of(0.0); PADDED], [F::of(0.0); PADDED]);
        for unit in 0..PADDED {
            (first[unit], second[unit]) = (F::from(self.b1[unit]), F::from(self.b2[unit]));
        }
        for (row, input) in self.w1.iter().zip(inputs(angles)) {
            forward(&mut first, row, input);
        }
        for (row, unit) in self.w2.iter().zip(first) {
            forward(&mut second, row, unit.max(F::of(0.0)));
        }
        let mut values = [F::of(0.0); 3];
        for (c, value) in values.iter_mut().enumerate() {
            let mut sum = F::from(self.b3[c]);
            for unit in 0..UNITS {
                sum = sum + F::from(self.w3[c][unit]) * second[unit].max(F::of(0.0));
            }
            *value = output(sum);
        }
        values
    }

    /// [`Network::eval`] in `f32` for [`LANES`] normals at once, by channel.
    #[inline(always)]
    pub fn eval_lanes<S: pulp::Simd>(&self, simd: S, normals: &[Lanes; 3], i: [f32; 3], o: [f32; 3]) -> [Lanes; 3] {
        let pair = Halfway::new(i, o);
        let mut seen = [[0.0; LANES]; 5];
        for l in 0..LANES {
            let [a, b, c, d, e] = inputs(&pair.about([normals[0][l], normals[1][l], normals[2][l]]));
            (seen[0][l], seen[1][l], seen[2][l], seen[3][l], seen[4][l]) = (a, b, c, d, e);
        }
        let mut sums = [[0.0; LANES]; 3];
        for v in 0..LANES / S::F32_LANES {
            let vector = |lanes: &Lanes| S::as_simd_f32s(lanes).0[v];
            let zero = simd.splat_f32s(0.0);
            let add = |sum: S::f32s, weight: f32, input: S::f32s| simd.mul_add_e_f32s(simd.splat_f32s(weight), input, sum);
            let seen = [vector(&seen[0]), vector(&seen[1]), vector(&seen[2]), vector(&seen[3]), vector(&seen[4])];
            let mut first = [zero; UNITS];
            for unit in 0..UNITS {
                let mut sum = simd.splat_f32s(self.b1[unit]);
                for input in 0..5 {
                    sum = add(sum, self.w1[input][unit], seen[input]);
                }
                first[unit] = simd.max_f32s(sum, zero);
            }
            let mut last = [simd.splat_f32s(self.b3[0]), simd.splat_f32s(self.b3[1]), simd.splat_f32s(self.b3[2])];
            for unit in 0..UNITS {
                // Two sums, even and odd units: one alone waits for its additions.
                let (mut even, mut odd) = (simd.splat_f32s(self.b2[unit]), zero);
                for pair in 0..UNITS / 2 {
                    even = add(even, self.w2[2 * pair][unit], first[2 * pair]);
                    odd = add(odd, self.w2[2 * pair + 1][unit], first[2 * pair + 1]);
                }
                even = add(even, self.w2[UNITS - 1][unit], first[UNITS - 1]);
                let second = simd.max_f32s(simd.add_f32s(even, odd), zero);
                for c in 0..3 {
                    last[c] = add(last[c], self.w3[c][unit], second);
                }
            }
            for c in 0..3 {
                S::as_mut_simd_f32s(&mut sums[c]).0[v] = last[c];
            }
        }
        for sums in &mut sums {
            for sum in sums {
                *sum = output(*sum);
            }
        }
        sums
    }
}

/// Adds one input to the sums of a layer.
#[inline(always)]
fn forward<F: Real>(sums: &mut [F; PADDED], weights: &[f32; PADDED], input: F) {
    for (sum, &w) in sums.iter_mut().zip(weights) {
        *sum = *sum + F::from(w) * input;
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

/// [`Network::eval`] in `f64`, for the machine's vectors.
pub(super) struct Plain<'a> {
    pub network: &'a Network,
    pub angles: HalfDifference<f64>,
}

impl Kernel for Plain<'_> {
    type Output = [f64; 3];

    #[inline(always)]
    fn run(self) -> [f64; 3] {
        self.network.eval(&self.angles)
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
