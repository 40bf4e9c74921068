//! Where the sample is: the pose that explains best where its markers are seen.

use crate::lens::{Lens, Pose};
use biscale::numerics::least_squares::{LeastSquaresParams, minimise};
use biscale::numerics::outcome::Outcome;
use biscale::numerics::statistics::upper_median;
use glam::{DVec2, DVec3};

/// A known point and where it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// In the sample's frame, mm.
    pub point: DVec3,
    /// In the photograph as it was taken, px.
    pub pixel: DVec2,
}

/// A pose and how well it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseEstimate {
    /// The pose.
    pub pose: Pose,
    /// Standard deviation of its rotation about the camera's axes, rad.
    pub sigma_turn: DVec3,
    /// Standard deviation of its translation, mm.
    pub sigma_shift: DVec3,
    /// Reprojection error, RMS of the distances, px.
    pub rms_px: f64,
    /// Which sightings it rests on; the others lie far off.
    pub used: Vec<bool>,
    /// How the last search for it ended; not [`Outcome::Converged`], pose and standard deviations are those of the best so far.
    pub outcome: Outcome,
}

impl PoseEstimate {
    /// A pose that is known.
    pub fn given(pose: Pose) -> Self {
        let sigma = DVec3::ZERO;
        Self { pose, sigma_turn: sigma, sigma_shift: sigma, rms_px: 0.0, used: Vec::new(), outcome: Outcome::Converged }
    }
}

/// How large a pattern is relative to what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeScale {
    /// Its size over that.
    pub scale: f64,
    /// Standard deviation of `scale`.
    pub sigma: f64,
    /// How the search for it ended.
    pub outcome: Outcome,
}

/// How a pose is refined. Chosen, not measured.
struct PoseParams {
    /// Rounds of leaving out sightings that lie far off.
    rounds: usize,
    /// Sightings farther off than this many medians are left out (a marker that came loose), but never those below the second value, px.
    outliers: (f64, f64),
    /// Typical change of an unknown, rad and distances: for the derivatives.
    change: f64,
    /// Fewest sightings for the size of a pattern: seven unknowns with some to spare.
    fewest_for_scale: usize,
}

const PARAMS: PoseParams = PoseParams { rounds: 3, outliers: (5.0, 0.5), change: 0.1, fewest_for_scale: 12 };

/// Unknowns of a pose: turn about the camera's axes, and shift over the distance.
pub(crate) const UNKNOWNS: usize = 6;

/// Sightings that determine a pose.
pub const FEWEST: usize = 4;

/// A pose changed by the unknowns; `scale` is the distance.
pub(crate) fn moved(start: &Pose, scale: f64, p: &[f64]) -> Pose {
    start.moved(DVec3::new(p[0], p[1], p[2]), scale * DVec3::new(p[3], p[4], p[5]))
}

fn residuals(pose: &Pose, sightings: &[Sighting], lens: &Lens) -> Vec<f64> {
    let off = |s: &Sighting| lens.project(pose.to_camera(s.point)).map_or(DVec2::NAN, |p| p - s.pixel);
    sightings.iter().flat_map(|s| off(s).to_array()).collect()
}

/// RMS distance between where points should be seen and where they are, px; NaN if one is behind the camera.
pub fn rms(pose: &Pose, sightings: &[Sighting], lens: &Lens) -> f64 {
    (residuals(pose, sightings, lens).iter().map(|r| r * r).sum::<f64>() / sightings.len() as f64).sqrt()
}

/// Refines a pose by least squares over the reprojection errors, leaving out sightings that lie far off.
///
/// `None` if they do not determine a pose.
pub fn refine(start: &Pose, sightings: &[Sighting], lens: &Lens) -> Option<PoseEstimate> {
    refine_with(start, sightings, lens, LeastSquaresParams::default())
}

fn refine_with(start: &Pose, sightings: &[Sighting], lens: &Lens, search: LeastSquaresParams) -> Option<PoseEstimate> {
    let mut used = vec![true; sightings.len()];
    let mut pose = *start;
    for round in 0..PARAMS.rounds {
        let kept: Vec<Sighting> = sightings.iter().zip(&used).filter(|(_, u)| **u).map(|(s, _)| *s).collect();
        if kept.len() < FEWEST {
            return None;
        }
        let base = pose;
        let scale = base.translation.length().max(1.0);
        let of = |p: &[f64]| moved(&base, scale, p);
        let fit = minimise(&[0.0; UNKNOWNS], &[PARAMS.change; UNKNOWNS], &|p| residuals(&of(p), &kept, lens), search).finite()?;
        pose = of(&fit.parameters);
        let distances: Vec<f64> = residuals(&pose, sightings, lens).chunks(2).map(|r| r[0].hypot(r[1])).collect();
        let mut sorted: Vec<f64> = distances.iter().zip(&used).filter(|(_, u)| **u).map(|(d, _)| *d).collect();
        let median = upper_median(&mut sorted)?;
        let next: Vec<bool> = distances.iter().map(|d| *d <= (PARAMS.outliers.0 * median).max(PARAMS.outliers.1)).collect();
        if round + 1 == PARAMS.rounds || next == used {
            let freedom = (2 * kept.len()).saturating_sub(UNKNOWNS).max(1) as f64;
            let variance = fit.cost / freedom;
            let covariance = fit.covariance?;
            let sigma = |k: usize| (variance * covariance[k * (UNKNOWNS + 1)]).sqrt();
            return Some(PoseEstimate {
                pose,
                sigma_turn: DVec3::new(sigma(0), sigma(1), sigma(2)),
                sigma_shift: scale * DVec3::new(sigma(3), sigma(4), sigma(5)),
                rms_px: (fit.cost / kept.len() as f64).sqrt(),
                used,
                outcome: fit.outcome,
            });
        }
        used = next;
    }
    None
}

/// How large the points' pattern is relative to what it should be, for a pattern whose shape changes with its size: on a cylinder of known radius.
/// `at(k)` are the points of a pattern `k` times as large.
pub fn relative_scale(start: &Pose, pixels: &[DVec2], lens: &Lens, at: &dyn Fn(f64) -> Vec<DVec3>) -> Option<RelativeScale> {
    if pixels.len() < PARAMS.fewest_for_scale {
        return None;
    }
    let scale = start.translation.length().max(1.0);
    let cost = |p: &[f64]| {
        let pose = moved(start, scale, p);
        let sightings: Vec<Sighting> =
            at(1.0 + p[6]).into_iter().zip(pixels).map(|(point, pixel)| Sighting { point, pixel: *pixel }).collect();
        residuals(&pose, &sightings, lens)
    };
    let fit = minimise(&[0.0; UNKNOWNS + 1], &[PARAMS.change; UNKNOWNS + 1], &cost, LeastSquaresParams::default()).finite()?;
    let variance = fit.cost / (2 * pixels.len() - (UNKNOWNS + 1)) as f64;
    let sigma = (variance * fit.covariance?[(UNKNOWNS + 1).pow(2) - 1]).sqrt();
    Some(RelativeScale { scale: 1.0 + fit.parameters[6], sigma, outcome: fit.outcome })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens {
        width: 1200,
        height: 800,
        focal: DVec2::new(1500.0, 1500.0),
        centre: DVec2::new(600.0, 400.0),
        distortion: [-0.1, 0.02, 1e-3, 0.0, 0.0],
    };

    fn seen(pose: &Pose, points: &[DVec3], noise: f64) -> Vec<Sighting> {
        let mut state = 7_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Twelve uniform numbers less six are nearly normal; two are enough here.
            f64::from(state >> 8) / f64::from(1_u32 << 24) - 0.5
        };
        points
            .iter()
            .map(|p| Sighting { point: *p, pixel: LENS.project(pose.to_camera(*p)).unwrap() + noise * DVec2::new(random(), random()) })
            .collect()
    }

    fn points() -> Vec<DVec3> {
        (0..40).map(|k| DVec3::new(f64::from(k % 8) * 15.0 - 50.0, f64::from(k / 8) * 15.0 - 30.0, 0.0)).collect()
    }

    #[test]
    fn a_pose_is_found_within_what_it_says() {
        let truth = Pose::looking_at(DVec3::new(60.0, -200.0, 350.0), DVec3::ZERO, DVec3::Y);
        let start = truth.moved(DVec3::new(0.1, -0.05, 0.08), DVec3::new(5.0, -9.0, 30.0));
        let mut sightings = seen(&truth, &points(), 0.5);
        sightings[3].pixel.x += 40.0;
        let found = refine(&start, &sightings, &LENS).unwrap();
        assert!(!found.used[3] && found.used.iter().filter(|u| **u).count() == 39);
        let off = found.pose.translation - truth.translation;
        for k in 0..3 {
            assert!(off[k].abs() < 4.0 * found.sigma_shift[k], "{off} for {}", found.sigma_shift);
        }
        assert!(found.pose.angle_to(&truth) < 4.0 * found.sigma_turn.length() && found.sigma_turn.length() < 2e-3);
        // Uniform noise of width 0.5 in both coordinates: an RMS distance of 0.5 sqrt(2/12).
        assert!((found.rms_px - 0.204).abs() < 0.05, "{}", found.rms_px);
        assert!(refine(&start, &sightings[..3], &LENS).is_none());
    }

    #[test]
    fn a_pose_tells_that_its_search_used_up_its_steps() {
        let truth = Pose::looking_at(DVec3::new(60.0, -200.0, 350.0), DVec3::ZERO, DVec3::Y);
        let start = truth.moved(DVec3::new(0.1, -0.05, 0.08), DVec3::new(5.0, -9.0, 30.0));
        let sightings = seen(&truth, &points(), 0.5);
        let with = |steps| refine_with(&start, &sightings, &LENS, LeastSquaresParams { steps, ..LeastSquaresParams::default() }).unwrap();
        assert_eq!((with(1).outcome, with(60).outcome), (Outcome::Exhausted, Outcome::Converged));
    }

    #[test]
    fn the_size_of_a_pattern_on_a_cylinder_is_seen() {
        let truth = Pose::looking_at(DVec3::new(150.0, 30.0, 20.0), DVec3::ZERO, DVec3::Z);
        let at = |k: f64| -> Vec<DVec3> {
            (0..30)
                .map(|i| {
                    let (s, z) = (k * (f64::from(i % 6) * 5.0 - 12.0), k * (f64::from(i / 6) * 8.0 - 16.0));
                    DVec3::new(15.0 * (s / 15.0).cos(), 15.0 * (s / 15.0).sin(), z)
                })
                .collect()
        };
        let pixels: Vec<DVec2> = seen(&truth, &at(0.97), 0.1).iter().map(|s| s.pixel).collect();
        let start = truth.moved(DVec3::new(0.01, 0.0, 0.01), DVec3::new(1.0, 1.0, 4.0));
        let RelativeScale { scale, sigma, outcome } = relative_scale(&start, &pixels, &LENS, &at).unwrap();
        assert!(outcome.converged() && (scale - 0.97).abs() < 4.0 * sigma.max(1e-4) && sigma < 3e-3, "{scale} +/- {sigma}");
    }
}
