//! A first pose from points, to be refined.

use super::image::failed;
use crate::lens::{Lens, Pose};
use crate::pose::{self, PoseEstimate, Sighting};
use biscale::error::Result;
use glam::{DMat3, DQuat, DVec3};
use opencv::calib3d::{self, SolvePnPMethod};
use opencv::core::{Mat, Point2d, Point3d, Vector, no_array};
use opencv::prelude::*;

/// The pose that explains sightings best; `None` if there are too few or nothing fits.
///
/// `SQPnP` gives every start, also for points in a plane (which may have two); each is refined by our own least squares.
///
/// # Errors
/// What `OpenCV` says of points that it cannot use.
pub fn pose(sightings: &[Sighting], lens: &Lens) -> Result<Option<PoseEstimate>> {
    let what = "a pose";
    // Points that the lens cannot see are left out.
    let seen: Vec<(Sighting, glam::DVec2)> = sightings.iter().filter_map(|s| Some((*s, lens.undistort(lens.place(s.pixel))?))).collect();
    if seen.len() < pose::FEWEST {
        return Ok(None);
    }
    let sightings: Vec<Sighting> = seen.iter().map(|s| s.0).collect();
    let object: Vector<Point3d> = seen.iter().map(|(s, _)| Point3d::new(s.point.x, s.point.y, s.point.z)).collect();
    let image: Vector<Point2d> = seen.iter().map(|(_, p)| Point2d::new(p.x, p.y)).collect();
    let identity = Mat::eye(3, 3, opencv::core::CV_64F).map_err(failed(what))?.to_mat().map_err(failed(what))?;
    let (mut turns, mut shifts): (Vector<Mat>, Vector<Mat>) = (Vector::new(), Vector::new());
    let mut best: Option<PoseEstimate> = None;
    for method in [SolvePnPMethod::SOLVEPNP_SQPNP, SolvePnPMethod::SOLVEPNP_EPNP] {
        let solved = calib3d::solve_pnp_generic(
            &object,
            &image,
            &identity,
            &no_array(),
            &mut turns,
            &mut shifts,
            false,
            method,
            &no_array(),
            &no_array(),
            &mut no_array(),
        );
        if solved.is_err() {
            continue;
        }
        for (turn, shift) in turns.iter().zip(&shifts) {
            let vector = |m: &Mat| -> Result<DVec3> {
                let v = |k| m.at::<f64>(k).copied().map_err(failed(what));
                Ok(DVec3::new(v(0)?, v(1)?, v(2)?))
            };
            let start = Pose { rotation: DMat3::from_quat(DQuat::from_scaled_axis(vector(&turn)?)), translation: vector(&shift)? };
            let Some(found) = pose::refine(&start, &sightings, lens) else { continue };
            let better = best.as_ref().is_none_or(|b| found.rms_px * used(b) < b.rms_px * used(&found));
            if better && found.pose.translation.z > 0.0 {
                best = Some(found);
            }
        }
        if best.as_ref().is_some_and(|b| b.rms_px < 2.0) {
            break;
        }
    }
    Ok(best)
}

fn used(found: &PoseEstimate) -> f64 {
    found.used.iter().filter(|u| **u).count() as f64
}
