//! A lobe of half vectors as a lobe of incident directions, for one viewer.
//!
//! With `wi = 2 (wo·h) h - wo`, a step of the half vector in the plane of incidence turns `wi` by twice its angle, one across it by `2 (wo·h)` times its angle: the
//! solid angle grows by `4 (wo·h)`. A lobe of sharpness `l` becomes one of `l / 4` in the plane and `l / (4 (wo·x)²)` across it, long in the plane at
//! grazing. One isotropic lobe in its place has the sharpness `l / (4 (wo·x))` (Wang et al. 2009; Iwasaki et al. 2012, section 5).

use glam::Vec3;

/// Stretch up to which one isotropic lobe stands for the warped one, and up to which three do; beyond there are five. Chosen: an isotropic lobe of stretch
/// 1.5 is a factor of 1.2 too narrow in the plane and too wide across it.
const STRETCH: [f32; 2] = [1.5, 2.2];
/// Width of each of three and five lobes along the plane, in that of the whole.
const PART: [f32; 2] = [0.65, 0.5];
/// Gauss-Hermite places (standard deviations) and weights for three and five lobes.
const THREE: [[f32; 2]; 3] = [[0.0, 0.666_666_7], [1.732_050_8, 0.166_666_67], [-1.732_050_8, 0.166_666_67]];
const FIVE: [[f32; 2]; 5] =
    [[0.0, 0.533_333_3], [1.355_626_2, 0.222_075_92], [-1.355_626_2, 0.222_075_92], [2.856_97, 0.011_257_411], [-2.856_97, 0.011_257_411]];

/// The mirror direction of `wo` about `h`, unit vectors.
#[inline]
pub fn mirrored(wo: Vec3, h: Vec3) -> Vec3 {
    2.0 * wo.dot(h) * h - wo
}

/// A density of half vectors about `axis` as isotropic densities of incident directions for the viewer `wo`: shows `take` the axis, sharpness and
/// share of each of one to five; the shares add up to 1. None where the axis faces away from the viewer.
#[inline]
pub fn warp(axis: Vec3, sharpness: f32, wo: Vec3, mut take: impl FnMut(Vec3, f32, f32)) {
    let cosine = wo.dot(axis);
    if cosine <= 0.0 {
        return;
    }
    if cosine * STRETCH[0] >= 1.0 {
        take(mirrored(wo, axis), sharpness / (4.0 * cosine), 1.0);
        return;
    }
    let (part, places): (f32, &[[f32; 2]]) = if cosine * STRETCH[1] >= 1.0 { (PART[0], &THREE) } else { (PART[1], &FIVE) };
    let along = (wo - cosine * axis).normalize_or_zero();
    let spread = ((1.0 - part * part) / sharpness.max(1.0)).sqrt();
    for [place, share] in places {
        let h = (axis + spread * place * along).normalize();
        take(mirrored(wo, h), sharpness / (4.0 * part * part), *share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sg::Lobe;

    /// Relative error of the mean of the incident density under a lobe of sharpness `light` about the mirror direction, against many half vectors.
    fn error(angle: f32, sharpness: f32, light: f32) -> f32 {
        const DRAWN: usize = 4096;
        let axis = Vec3::Z;
        let wo = Vec3::new(angle.sin(), 0.0, angle.cos());
        let source = Lobe { axis: mirrored(wo, axis), sharpness: light, amplitude: 1.0 };
        let drawn = |k: usize| {
            let down = -(1.0 - (k as f32 + 0.5) / DRAWN as f32).ln() / sharpness;
            let (sin, cos) = (2.399_963 * k as f32).sin_cos();
            let across = (down * (2.0 - down)).max(0.0).sqrt();
            source.eval(mirrored(wo, Vec3::new(across * cos, across * sin, 1.0 - down)))
        };
        let exact = (0..DRAWN).map(drawn).sum::<f32>() / DRAWN as f32;
        let mut warped = 0.0;
        warp(axis, sharpness, wo, |axis, sharpness, share| {
            warped += share * Lobe::density(axis, sharpness).product_integral(&source);
        });
        (warped / exact - 1.0).abs()
    }

    #[test]
    fn a_warped_lobe_sees_a_light_as_the_half_vectors_do() {
        // A light as wide as the lobe; the largest errors, at the ends of the ranges of one and of three lobes, are what `STRETCH` trades for time.
        for (degrees, allowed) in [(0.0_f32, 0.02), (30.0, 0.03), (48.0, 0.05), (60.0, 0.06), (70.0, 0.12), (78.0, 0.25)] {
            let error = error(degrees.to_radians(), 400.0, 100.0);
            assert!(error < allowed, "{degrees} degrees: off by {error}");
        }
    }

    #[test]
    fn shares_add_up_to_one_and_axes_are_unit_vectors() {
        for degrees in [0.0_f32, 40.0, 50.0, 65.0, 85.0] {
            let angle = degrees.to_radians();
            let mut sum = 0.0;
            warp(Vec3::Z, 50.0, Vec3::new(angle.sin(), 0.0, angle.cos()), |axis, sharpness, share| {
                assert!(axis.is_normalized() && sharpness > 0.0);
                sum += share;
            });
            assert!((sum - 1.0).abs() < 1e-6, "{sum} at {degrees} degrees");
        }
        warp(Vec3::Z, 50.0, Vec3::new(1.0, 0.0, 0.0), |_, _, _| panic!("no lobe faces away from the viewer"));
    }
}
