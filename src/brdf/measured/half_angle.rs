//! Half and difference angles (Rusinkiewicz 1998), and MERL tables over them.
//!
//! `h` is the half vector and `theta_h` its angle with the normal; the difference vector `d` is `wi` in the frame of `h` whose
//! x axis points away from the normal: `d = (sin θd cos φd, sin θd sin φd, cos θd)`. Swapping `wi` and `wo` turns φd by π;
//! data over φd in `0..π` are therefore reciprocal by construction.

use super::real::{Real, cell, combine, cross, dot, half_vector};
use crate::formats::merl::{Merl, PHI_D, THETA_D, THETA_H};
use crate::numerics::cast::index_u32;
use std::f64::consts::{FRAC_PI_2, PI};

/// Below this sine of θh the azimuth of `d` is noise, and taken as 0.
const MIN_SIN: f64 = 1e-6;

/// Half and difference vectors of a pair of directions.
pub(super) struct HalfDifference<F> {
    /// Cosine, sine and versine (1 - cos) of θh.
    pub cos_h: F,
    pub sin_h: F,
    pub versine_h: F,
    /// Cosine and sine of θd.
    pub cos_d: F,
    pub sin_d: F,
    /// `sin θd cos φd` and `sin θd sin φd`, with φd folded into `0..=π`.
    pub d: [F; 2],
}

/// What a pair of directions is, whatever the normal.
#[derive(Clone, Copy)]
pub(super) struct Halfway<F> {
    /// The unit half vector; `None` for exactly opposite directions, which lie in the plane of the facet: it is the normal there.
    h: Option<[F; 3]>,
    /// Half the difference of the directions.
    difference: [F; 3],
    cos_d: F,
    sin_d: F,
}

impl<F: Real> Halfway<F> {
    /// Of unit `i` and `o`.
    #[inline(always)]
    pub fn new(i: [F; 3], o: [F; 3]) -> Self {
        let (h, cos_d) = half_vector(i, o);
        let difference = combine(i, F::of(0.5), o, F::of(-0.5));
        Self { h, difference, cos_d, sin_d: dot(difference, difference).sqrt() }
    }

    /// Half and difference vectors about the unit normal `n`. No branch depends on `n`: many normals make vector code.
    #[inline(always)]
    pub fn about(&self, n: [F; 3]) -> HalfDifference<F> {
        let (h, difference) = (self.h.unwrap_or(n), self.difference);
        // From h - n and not from h, which keeps the digits of small angles: 1 - n.h = |h - n|²/2, and the tangent of the circle
        // from n to h is h cos - n = (h - n) - h (1 - cos).
        let step = combine(h, F::of(1.0), n, F::of(-1.0));
        let versine = F::of(0.5) * dot(step, step);
        let tangent = combine(step, F::of(1.0), h, -versine);
        let sin_h = dot(tangent, tangent).sqrt();
        let tilted = sin_h > F::of(MIN_SIN);
        let (x, y) = (dot(tangent, difference), dot(cross(n, step), difference));
        let scale = F::select(y < F::of(0.0), F::of(-1.0), F::of(1.0)) / F::select(tilted, sin_h, F::of(1.0));
        let d = [F::select(tilted, x * scale, self.sin_d), F::select(tilted, y * scale, F::of(0.0))];
        HalfDifference { cos_h: F::of(1.0) - versine, sin_h, versine_h: versine, cos_d: self.cos_d, sin_d: self.sin_d, d }
    }
}

/// `fr` in 1/sr of a MERL table for `N` unit normals, by channel: trilinear, φd periodic, clamped at the last nodes of θh and θd.
///
/// Angles first and values after them: arithmetic of many normals becomes vector code, reading a table does not.
#[inline(always)]
pub(super) fn lookup<F: Real, const N: usize>(table: &Merl, pair: &Halfway<F>, normals: &[[F; N]; 3]) -> [[F; N]; 3] {
    let one = F::of(1.0);
    // 1 - cos = sin² / (1 + cos)
    let theta_d = (pair.sin_d * pair.sin_d / (one + pair.cos_d)).arc_versine();
    let (d, fd) = cell(theta_d * F::of(THETA_D as f64 / FRAC_PI_2), THETA_D);
    let mut at = [([0; N], [one; N]); 2];
    for l in 0..N {
        let angles = pair.about([normals[0][l], normals[1][l], normals[2][l]]);
        let theta_h = angles.versine_h.arc_versine();
        let phi_d = angles.d[1].atan2(angles.d[0]);
        (at[0].0[l], at[0].1[l]) = cell((theta_h * F::of(1.0 / FRAC_PI_2)).sqrt() * F::of(THETA_H as f64), THETA_H);
        // One node more than the table has: node 180 is node 0.
        (at[1].0[l], at[1].1[l]) = cell(phi_d * F::of(PHI_D as f64 / PI), PHI_D + 1);
    }
    let mut out = [[F::of(0.0); N]; 3];
    for l in 0..N {
        let [(h, fh), (p, fp)] = [(at[0].0[l], at[0].1[l]), (at[1].0[l], at[1].1[l])];
        let next = if p + 1 == index_u32(PHI_D) { 0 } else { p + 1 };
        let mut sum = F::from_four([0.0; 4]);
        for (dh, wh) in [(0, one - fh), (1, fh)] {
            for (dd, wd) in [(0, one - fd), (1, fd)] {
                let row = &table.rgb[((h + dh) as usize * THETA_D + (d + dd) as usize) * PHI_D..][..PHI_D];
                let ([ar, ag, ab], [br, bg, bb]) = (row[p as usize], row[next as usize]);
                let (wa, wb) = (wh * wd * (one - fp), wh * wd * fp);
                sum = sum + F::from_four([ar, ag, ab, 0.0]) * wa + F::from_four([br, bg, bb, 0.0]) * wb;
            }
        }
        let [r, g, b, _] = F::to_four(sum);
        (out[0][l], out[1][l], out[2][l]) = (r, g, b);
    }
    out
}
