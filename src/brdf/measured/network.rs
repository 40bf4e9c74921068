//! The 100 materials of the MERL database as small neural networks (Sztrajman et al. 2021, *Neural BRDF Representation and
//! Importance Sampling*). They are fits, not measurements.
//!
//! `x = (sin θh, 0, cos θh, sin θd cos φd, sin θd sin φd, cos θd)` goes through two layers of 21 rectified units and one of 3;
//! `fr = max(e^y - 1, 0)`. φd is folded into `0..π`, where MERL has data: the networks were fitted there, and so they are
//! reciprocal. In the plane of incidence, where φd jumps from π to 0, the value is the one at 0.
//!
//! The network itself is evaluated, also in hot loops. A table cannot keep 1e-3: the units' kinks make the interpolation
//! error first order in the spacing. With 181 x 181 x 91 nodes (36 MB) and interpolated `y`, one direction in a hundred is still
//! off by .4 to 1 % (seven materials from paint to chrome), and the lookup misses the cache.

use super::half_angle::HalfDifference;
use super::real::Real;
use crate::error::BadInput;

/// Units of the two hidden layers.
const UNITS: usize = 21;
/// `UNITS` rounded up to whole vectors; the rest stays 0.
const LANES: usize = 24;
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

    /// `fr` in 1/sr.
    #[inline(always)]
    pub fn eval<F: Real>(&self, angles: &HalfDifference<F>) -> [F; 3] {
        let zero = F::of(0.0);
        let [x, y] = angles.d;
        let x = if x < zero && y <= F::of(IN_PLANE) * angles.sin_d { -x } else { x };
        let inputs = [angles.sin_h, angles.cos_h, x, y, angles.cos_d];
        let mut first = self.b1.map(F::from);
        for (row, input) in self.w1.iter().zip(inputs) {
            for (unit, &w) in first.iter_mut().zip(row) {
                *unit = *unit + F::from(w) * input;
            }
        }
        let mut second = self.b2.map(F::from);
        for (row, unit) in self.w2.iter().zip(first) {
            let input = unit.max(zero);
            for (unit, &w) in second.iter_mut().zip(row) {
                *unit = *unit + F::from(w) * input;
            }
        }
        std::array::from_fn(|c| {
            // Eight sums side by side, because one after the other cannot be vectorised.
            let mut lanes = [zero; 8];
            for (w, unit) in self.w3[c].chunks_exact(8).zip(second.chunks_exact(8)) {
                for k in 0..8 {
                    lanes[k] = lanes[k] + F::from(w[k]) * unit[k].max(zero);
                }
            }
            let [a, b, c4, d, e, f, g, h] = lanes;
            let sum = ((a + e) + (c4 + g)) + ((b + f) + (d + h));
            (sum + F::from(self.b3[c])).max(zero).min(F::of(MAX_LOG)).exp_m1()
        })
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
