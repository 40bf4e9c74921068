//! The arithmetic of measured BRDFs in `f64` (the reference) and in `f32` (the hot loops), from one source.
//!
//! A lookup is written once, generic over [`Real`]; what differs is precision and the three functions that the standard
//! library has no fast `f32` form of. Vectors are `[F; 3]`.

use crate::numerics::cast::{index_u32, narrow};
use glam::{DVec4, Vec4};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `f64`, or `f32` with functions good to a few units in the last place and without calls into the mathematical library.
pub(super) trait Real:
    Copy + PartialOrd + From<f32> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Four of them, which values of a table are added up in.
    type Four: Copy + Add<Output = Self::Four> + Mul<Self, Output = Self::Four>;
    /// The constant `value`, rounded.
    fn of(value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// The number of nodes, or of a node; below 2^31.
    fn count(value: u32) -> Self;
    /// Angle of the point `(x, self)`, in -π..=π; 0 at the origin.
    fn atan2(self, x: Self) -> Self;
    /// The angle, in 0..=π/2, whose versine (1 - cos) is `self`: keeps the digits of small angles.
    fn arc_versine(self) -> Self;
    /// `e^x - 1` for `0 <= x <= 80`.
    fn exp_m1(self) -> Self;
    /// The whole part of a number in `0..2^22`; of a whole number it may be the one below.
    fn whole(self) -> u32;
    /// `yes` if so, else `no`; without a branch in `f32`, since directions make branches unpredictable.
    fn select(so: bool, yes: Self, no: Self) -> Self;
    /// The smaller one.
    fn min(self, other: Self) -> Self;
    /// The larger one; `other` if `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// Four values of a table.
    fn from_four(values: [f32; 4]) -> Self::Four;
    /// The four numbers.
    fn to_four(four: Self::Four) -> [Self; 4];
}

impl Real for f64 {
    type Four = DVec4;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn count(value: u32) -> Self {
        Self::from(value)
    }
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        self.atan2(x)
    }
    #[inline(always)]
    fn arc_versine(self) -> Self {
        2.0 * (0.5 * self).clamp(0.0, 0.5).sqrt().asin()
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        self.exp_m1()
    }
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the contract says 0..2^22")]
    fn whole(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn select(so: bool, yes: Self, no: Self) -> Self {
        if so { yes } else { no }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn from_four(values: [f32; 4]) -> Self::Four {
        DVec4::from_array(values.map(Self::from))
    }
    #[inline(always)]
    fn to_four(four: Self::Four) -> [Self; 4] {
        four.to_array()
    }
}

impl Real for f32 {
    type Four = Vec4;

    #[inline(always)]
    fn of(value: f64) -> Self {
        narrow(value)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    #[expect(clippy::cast_possible_wrap, reason = "the contract says below 2^31")]
    fn count(value: u32) -> Self {
        value as i32 as Self // one instruction, where an unsigned number takes several
    }

    /// Relative error below 3e-7.
    #[inline(always)]
    fn arc_versine(self) -> Self {
        let v = self.clamp(0.0, 1.0);
        v.sqrt() * arc_versine_over_root(v)
    }

    /// Absolute error below 4e-7.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        use std::f32::consts::{FRAC_PI_2, PI};
        let (ax, ay) = (x.abs(), self.abs());
        // MIN_POSITIVE: the angle of the origin is 0 and not 0/0.
        let t = Real::min(ax, ay) / Real::max(Real::max(ax, ay), Self::MIN_POSITIVE);
        let octant = t * atan_over_x(t * t);
        let quadrant = Self::select(ax < ay, FRAC_PI_2 - octant, octant);
        Self::select(x < 0.0, PI - quadrant, quadrant).copysign(self)
    }

    /// Relative error below 3e-7.
    #[inline(always)]
    fn exp_m1(self) -> Self {
        use std::f32::consts::LOG2_E;
        // ln 2 in two parts, the first with 9 bits, so that k ln 2 is exact.
        const LN2_HIGH: f32 = 355.0 / 512.0;
        const LN2_LOW: f32 = -2.121_944_4e-4;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the contract says 0..=80")]
        let k = (self * LOG2_E + 0.5) as u32;
        let r = (self - k as Self * LN2_HIGH) - k as Self * LN2_LOW;
        let power = Self::from_bits((k + 127) << 23);
        power * (r * expm1_over_x(r)) + (power - 1.0)
    }

    #[inline(always)]
    fn whole(self) -> u32 {
        // In 2^23..2^24 the last bit counts ones, so that the addition rounds: `as u32` would look for NaN and numbers out of its range.
        const ROUND: f32 = 12_582_912.0;
        (self - 0.5 + ROUND).to_bits().wrapping_sub(ROUND.to_bits())
    }
    #[inline(always)]
    fn select(so: bool, yes: Self, no: Self) -> Self {
        let mask = u32::from(so).wrapping_neg();
        Self::from_bits((yes.to_bits() & mask) | (no.to_bits() & !mask))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn from_four(values: [f32; 4]) -> Self::Four {
        Vec4::from_array(values)
    }
    #[inline(always)]
    fn to_four(four: Self::Four) -> [Self; 4] {
        four.to_array()
    }
}

/// `acos(1 - v)/sqrt(v)` for `v` in `0..=1`: minimax, relative error 1.5e-8 before rounding.
#[inline(always)]
fn arc_versine_over_root(v: f32) -> f32 {
    let v2 = v * v;
    let low = (std::f32::consts::SQRT_2 + 0.117_853_63 * v) + (0.026_466_913 + 0.008_262_832 * v) * v2;
    let high = (0.001_345_521_6 + 0.003_535_988_4 * v) + (-0.002_135_580_6 + 0.001_253_457_1 * v) * v2;
    low + high * (v2 * v2)
}

/// `atan(x)/x` as a polynomial of `u = x²` in `0..=1`: minimax, relative error 1e-7.
#[inline(always)]
fn atan_over_x(u: f32) -> f32 {
    let u2 = u * u;
    let low = (0.999_999_9 - 0.333_319_9 * u) + (0.199_697_24 - 0.140_194_82 * u) * u2;
    let high = (0.099_142_94 - 0.059_486_403 * u) + (0.024_252_407 - 0.004_693_276_4 * u) * u2;
    low + high * (u2 * u2)
}

/// `(e^x - 1)/x` for `|x| <= ln 2 / 2`: minimax, relative error 1.1e-8 before rounding.
#[inline(always)]
fn expm1_over_x(x: f32) -> f32 {
    let x2 = x * x;
    (1.0 + 0.499_999_98 * x) + (0.166_665_06 + 0.041_667_137 * x) * x2 + (0.008_369_069 + 0.001_388_887_3 * x) * (x2 * x2)
}

/// Scalar product.
#[inline(always)]
pub(super) fn dot<F: Real>(a: [F; 3], b: [F; 3]) -> F {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
#[inline(always)]
pub(super) fn cross<F: Real>(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a s + b t`.
#[inline(always)]
pub(super) fn combine<F: Real>(a: [F; 3], s: F, b: [F; 3], t: F) -> [F; 3] {
    [a[0] * s + b[0] * t, a[1] * s + b[1] * t, a[2] * s + b[2] * t]
}

/// The unit half vector of two unit directions, `None` for exactly opposite ones, and the cosine of its angle with them.
#[inline(always)]
pub(super) fn half_vector<F: Real>(i: [F; 3], o: [F; 3]) -> (Option<[F; 3]>, F) {
    let sum = combine(i, F::of(0.5), o, F::of(0.5));
    let cosine = dot(sum, sum).sqrt();
    ((cosine > F::of(0.0)).then(|| sum.map(|x| x / cosine)), cosine)
}

/// Cell of a grid with `nodes >= 2` nodes that holds the position `at`, in node spacings, and how far into it; clamped to the grid.
#[inline(always)]
pub(super) fn cell<F: Real>(at: F, nodes: usize) -> (u32, F) {
    let nodes = index_u32(nodes);
    let at = at.max(F::of(0.0));
    let index = at.min(F::count(nodes)).whole().min(nodes - 2);
    (index, (at - F::count(index)).min(F::of(1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_arctangent_is_right_in_all_quadrants() {
        for k in 0..100_000_u32 {
            let angle = (f64::from(k) / 50_000.0 - 1.0) * std::f64::consts::PI;
            let (y, x) = (angle.sin() as f32, angle.cos() as f32);
            let off = (f64::from(Real::atan2(y, x)) - f64::from(y).atan2(f64::from(x))).abs();
            assert!(off < 4e-7, "{off:e} at {angle} rad");
        }
        assert_eq!(Real::atan2(0.0_f32, 0.0), 0.0);
    }

    #[test]
    fn fast_arc_versine_keeps_its_digits_from_the_normal_to_the_horizon() {
        for k in 0..100_000_u32 {
            let v = (f64::from(k) / 100_000.0).powi(8) as f32;
            let (fast, slow) = (f64::from(v.arc_versine()), f64::from(v).arc_versine());
            assert!((fast - slow).abs() <= 3e-7 * slow, "{fast} not {slow} at {v}");
        }
        assert_eq!(2.0_f32.arc_versine(), 1.0_f32.arc_versine());
        assert_eq!((-1e-9_f64).arc_versine(), 0.0);
        // cos 60 degrees = 1/2
        assert!((0.5_f64.arc_versine() - std::f64::consts::FRAC_PI_3).abs() < 1e-15);
    }

    #[test]
    fn fast_exponential_keeps_its_digits_from_1e_minus_20_to_80() {
        for k in 0..100_000_u32 {
            let x = (1e-20_f64.ln() + f64::from(k) / 1e5 * (80_f64.ln() - 1e-20_f64.ln())).exp() as f32;
            let relative = (f64::from(Real::exp_m1(x)) / f64::from(x).exp_m1() - 1.0).abs();
            assert!(relative < 3e-7, "{relative:e} at {x}");
        }
        assert_eq!(Real::exp_m1(0.0_f32), 0.0);
    }

    #[test]
    fn a_cell_and_the_way_into_it_are_the_position() {
        for nodes in [2_usize, 3, 90, 181, 4_096] {
            for k in 0..20_000_u32 {
                let at = f64::from(k) / 20_000.0 * (nodes - 1) as f64;
                for at in [narrow(at), narrow(at).round(), narrow(at).round().next_down(), narrow(at).round().next_up()] {
                    let (index, part) = cell(at, nodes);
                    assert!((index as usize) < nodes - 1 && (0.0..=1.0).contains(&part), "{at} of {nodes}: {index} and {part}");
                    assert!((index as f32 + part - at.clamp(0.0, (nodes - 1) as f32)).abs() <= at * f32::EPSILON, "{at} of {nodes}");
                }
            }
        }
    }

    #[test]
    fn a_cell_is_clamped_at_both_ends() {
        assert_eq!(cell(-0.5_f64, 4), (0, 0.0));
        assert_eq!(cell(2.25_f64, 4), (2, 0.25));
        assert_eq!(cell(3.0_f64, 4), (2, 1.0));
        assert_eq!(cell(1e30_f32, 4), (2, 1.0));
        assert_eq!(cell(f64::NAN, 4), (0, 0.0));
    }
}
