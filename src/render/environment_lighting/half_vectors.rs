//! Lobes of half vectors: where a surface is too glossy for a table of directions, light follows the viewer as it does on a facet.

use crate::material::SmallScale;
use crate::numerics::cast::narrow;
use crate::sg::{Lobe, Mixture, MixtureLobe, Order, WeightedDirection, warp};
use crate::table::{GuideLobes, nodes};
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// Lobes of a mixture.
const LOBES: usize = 12;
/// Sharpness from which on a lobe of half vectors is kept as one: a standard deviation of 5.7 degrees, so that light of 11 degrees is left to the table. Chosen with
/// grids of directions and of sites in mind, whose neighbours are about 6 degrees apart.
const SHARP: f64 = 100.0;
/// Most directions that a mixture is fitted to: the heaviest.
const MOST_DIRECTIONS: usize = 16_384;
/// Directions drawn from each lobe.
const DRAWN: usize = 16;
/// Sharpness of the draws, in that of the lobe.
const DRAWN_WIDER: f64 = 0.5;
/// Directions of the mean of a lobe over the horizon.
const MEAN_OF: usize = 64;

/// A lobe of half vectors `exp(l (h·x - 1))`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfVectorLobe {
    /// Unit axis in the tile's frame.
    pub axis: DVec3,
    /// Sharpness.
    pub sharpness: f64,
}

/// The lobes of half vectors of a surface without visibility, the sharp ones first, and how many are sharp; none where no BRDF is sharp. `pairs` say how
/// finely they must be looked at.
pub fn half_vector_lobes(small: &SmallScale, pairs: &[(DVec3, DVec3)]) -> (Vec<HalfVectorLobe>, usize) {
    /// Stands for no floor, which a guide cannot have.
    const NO_FLOOR: [f64; 3] = [1e-12; 3];
    let Some(lobes) = GuideLobes::of(small) else { return (Vec::new(), 0) };
    let guide = lobes.guide(NO_FLOOR, pairs);
    let directions = nodes(guide.rings);
    // A ring's band reaches half-way to its neighbours; its nodes share it.
    let ring = |k: usize| directions[if k == 0 { 0 } else { 1 + 3 * k * (k - 1) }].z;
    let mut weighted: Vec<WeightedDirection> = Vec::with_capacity(directions.len());
    for k in 0..=guide.rings {
        let upper = if k == 0 { 1.0 } else { 0.5 * (ring(k - 1) + ring(k)) };
        let lower = if k == guide.rings { ring(k) } else { 0.5 * (ring(k) + ring(k + 1)) };
        let count = (6 * k).max(1);
        let solid_angle = TAU * (upper - lower) / count as f64;
        for node in weighted.len()..weighted.len() + count {
            let value: f64 = guide.values.iter().map(|channel| f64::from(channel[node])).sum();
            weighted.push(WeightedDirection { direction: directions[node], weight: value * solid_angle });
        }
    }
    weighted.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    weighted.truncate(MOST_DIRECTIONS);
    let lobe = |l: &MixtureLobe| HalfVectorLobe { axis: l.axis, sharpness: l.sharpness };
    let mut lobes: Vec<HalfVectorLobe> = Mixture::fit(&weighted, Order::Fixed(LOBES)).lobes.iter().map(lobe).collect();
    lobes.sort_by(|a, b| b.sharpness.total_cmp(&a.sharpness));
    let sharp = lobes.partition_point(|l| l.sharpness >= SHARP);
    if sharp == 0 {
        lobes.clear();
    }
    (lobes, sharp)
}

impl HalfVectorLobe {
    /// The value at a unit half vector.
    pub fn eval(&self, h: DVec3) -> f64 {
        (-0.5 * self.sharpness * h.distance_squared(self.axis)).exp()
    }

    /// The integral over all half vectors.
    fn integral(&self) -> f64 {
        TAU * -(-2.0 * self.sharpness).exp_m1() / self.sharpness
    }

    /// `count` half vectors that follow the lobe (a spiral with its quantiles).
    fn spread(&self, count: usize) -> impl Iterator<Item = DVec3> + use<> {
        const GOLDEN: f64 = 2.399_963_229_728_653;
        let (l, axis) = (self.sharpness, self.axis);
        let (x, y) = axis.any_orthonormal_pair();
        (0..count).map(move |k| {
            let u = (k as f64 + 0.5) / count as f64;
            let down = -(u * (-2.0 * l).exp_m1()).ln_1p() / l;
            let across = (down * (2.0 - down)).max(0.0).sqrt();
            let (sin, cos) = (GOLDEN * k as f64).sin_cos();
            (1.0 - down) * axis + across * (cos * x + sin * y)
        })
    }

    fn wider(&self) -> Self {
        Self { sharpness: DRAWN_WIDER * self.sharpness, ..*self }
    }

    /// Incident directions over the horizon, drawn a little wider than the lobe.
    pub fn draws(&self, wo: DVec3) -> impl Iterator<Item = DVec3> + use<> {
        self.wider().spread(DRAWN).filter(move |h| h.dot(wo) > 0.0).map(move |h| 2.0 * wo.dot(h) * h - wo).filter(|wi| wi.z > 0.0)
    }

    /// Their density, 1/sr of incident directions, of all draws together.
    pub fn draws_density(&self, wo: DVec3, h: DVec3) -> f64 {
        let wider = self.wider();
        let cosine = wo.dot(h);
        if cosine > 0.0 { DRAWN as f64 * wider.eval(h) / (wider.integral() * 4.0 * cosine) } else { 0.0 }
    }

    /// Its integral over the incident directions above the horizon, for a viewer.
    pub fn incident_integral(&self, wo: DVec3) -> f64 {
        let jacobian = |h: DVec3| {
            let cosine = wo.dot(h);
            let above = cosine > 0.0 && 2.0 * cosine * h.z - wo.z > 0.0;
            if above { 4.0 * cosine } else { 0.0 }
        };
        self.integral() * self.spread(MEAN_OF).map(jacobian).sum::<f64>() / MEAN_OF as f64
    }
}

/// The isotropic densities of incident directions that stand for a lobe of half vectors, those above the horizon: shows `take` the axis, sharpness and share of
/// each; the shares add up to 1.
#[inline]
pub fn incident_lobes(axis: Vec3, sharpness: f32, wo: Vec3, mut take: impl FnMut(Vec3, f32, f32)) {
    let mut above = 0.0;
    warp(axis, sharpness, wo, |wi, _, share| above += if wi.z > 0.0 { share } else { 0.0 });
    if above > 0.0 {
        warp(axis, sharpness, wo, |wi, l, share| {
            if wi.z > 0.0 {
                take(wi, l, share / above);
            }
        });
    }
}

/// Value of a lobe's density, 1/sr, at a unit direction.
pub fn density(axis: Vec3, sharpness: f64, w: Vec3) -> f32 {
    Lobe::density(axis, narrow(sharpness)).eval(w)
}

/// Sharpness of the lobe through which a texel of this solid angle sees an environment: standard deviation of half its width. Weights of a row of such texels then add up to 1
/// within .7 % wherever a small light stands between them.
pub fn texel_sharpness(solid_angle: f64) -> f64 {
    4.0 / solid_angle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_have_the_density_that_they_say() {
        // The mean of 1 / density over the draws is the solid angle that they reach, here all of a lobe that is far from the horizon: the integral of the lobe.
        let lobe = HalfVectorLobe { axis: DVec3::new(0.2, 0.1, 1.0).normalize(), sharpness: 400.0 };
        let wo = DVec3::new(-0.3, 0.2, 0.9).normalize();
        let sum: f64 = lobe
            .draws(wo)
            .map(|wi| {
                let h = (wi + wo).normalize();
                lobe.eval(h) / lobe.draws_density(wo, h)
            })
            .sum();
        let expected = lobe.incident_integral(wo);
        assert!((sum / expected - 1.0).abs() < 0.02, "{sum} for {expected}");
        let isotropic = lobe.integral() * 4.0 * wo.dot(lobe.axis);
        assert!((expected / isotropic - 1.0).abs() < 0.01, "{expected} for {isotropic}");
    }
}
