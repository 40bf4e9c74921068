//! The camera that explains views of a board.

use super::image::{failed, point};
use crate::checks::FEWEST_VIEWS;
use crate::lens::Lens;
use biscale::error::Result;
use biscale::numerics::cast::{narrow, truncate_usize};
use biscale::numerics::statistics::upper_median;
use glam::DVec2;
use opencv::calib3d;
use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, Vector};
use opencv::prelude::*;

/// One view: places on the board, mm, and in the photograph, px.
pub type BoardView = Vec<(DVec2, DVec2)>;

/// A calibrated camera.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The camera.
    pub lens: Lens,
    /// Standard deviations of `fx, fy, cx, cy, k1, k2, p1, p2, k3`.
    pub sigma: [f64; 9],
    /// Reprojection error, RMS over all points that were used, px.
    pub rms: f64,
    /// Reprojection error of each view, px, also of the dropped ones (in the round that dropped them).
    pub view_errors: Vec<f64>,
    /// Which views were used.
    pub used: Vec<bool>,
    /// Share of a 10 x 10 grid over the picture that has corners.
    pub coverage: f64,
}

/// Columns and rows of the grid that coverage is told by.
const GRID: usize = 10;
/// Calibration ends after so many rounds or below this relative change (`OpenCV`'s flag for both).
const BOTH_ENDS: i32 = 3;
const ROUNDS: i32 = 100;
const ENOUGH: f64 = 1e-9;
/// Corners that a view must show: a homography has eight unknowns, of which four corners tell as many; twice that leaves residuals to judge by.
pub const FEWEST_CORNERS: usize = 8;
/// A view is dropped if its error is this many times the median, and over [`DROP_OVER`]. Chosen.
const DROP_TIMES: f64 = 2.5;
/// Errors below this are no reason to drop a view, px.
const DROP_OVER: f64 = 0.3;

/// Calibrates, and drops the worst view as long as it is far worse than the rest.
///
/// `None` with fewer than [`FEWEST_VIEWS`] good views.
///
/// # Errors
/// What `OpenCV` says of views that it cannot use.
pub fn calibrate(views: &[BoardView], width: usize, height: usize) -> Result<Option<Calibration>> {
    let mut used: Vec<bool> = views.iter().map(|v| v.len() >= FEWEST_CORNERS).collect();
    let mut view_errors = vec![f64::NAN; views.len()];
    loop {
        let kept: Vec<usize> = (0..views.len()).filter(|&k| used[k]).collect();
        if kept.len() < FEWEST_VIEWS as usize {
            return Ok(None);
        }
        let (lens, sigma, rms, errors) = once(&kept.iter().map(|&k| &views[k]).collect::<Vec<_>>(), width, height)?;
        for (&k, e) in kept.iter().zip(&errors) {
            view_errors[k] = *e;
        }
        let mut sorted = errors.clone();
        let median = upper_median(&mut sorted).unwrap_or(f64::INFINITY);
        let worst = (0..kept.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b])).unwrap_or(0);
        if errors[worst] > (DROP_TIMES * median).max(DROP_OVER) && kept.len() > FEWEST_VIEWS as usize {
            used[kept[worst]] = false;
            continue;
        }
        let coverage = coverage(kept.iter().flat_map(|&k| views[k].iter().map(|c| c.1)), width, height);
        return Ok(Some(Calibration { lens, sigma, rms, view_errors, used, coverage }));
    }
}

/// Share of the cells of a 10 x 10 grid over the picture that hold a corner.
pub fn coverage(pixels: impl Iterator<Item = DVec2>, width: usize, height: usize) -> f64 {
    let mut cells = [false; GRID * GRID];
    for p in pixels {
        let cell = |v: f64, n: usize| truncate_usize((GRID as f64 * v / n as f64).clamp(0.0, GRID as f64 - 1.0));
        cells[GRID * cell(p.y, height) + cell(p.x, width)] = true;
    }
    cells.iter().filter(|c| **c).count() as f64 / (GRID * GRID) as f64
}

fn once(views: &[&BoardView], width: usize, height: usize) -> Result<(Lens, [f64; 9], f64, Vec<f64>)> {
    let what = "the calibration";
    let object: Vector<Vector<Point3f>> =
        views.iter().map(|v| v.iter().map(|c| Point3f::new(narrow(c.0.x), narrow(c.0.y), 0.0)).collect::<Vector<_>>()).collect();
    let image: Vector<Vector<Point2f>> = views.iter().map(|v| v.iter().map(|c| point(c.1)).collect::<Vector<_>>()).collect();
    let size = Size::new(width.try_into().unwrap_or(i32::MAX), height.try_into().unwrap_or(i32::MAX));
    let (mut matrix, mut distortion) = (Mat::default(), Mat::default());
    let (mut turns, mut shifts): (Vector<Mat>, Vector<Mat>) = (Vector::new(), Vector::new());
    let (mut deviations, mut more, mut errors) = (Mat::default(), Mat::default(), Mat::default());
    let criteria = TermCriteria::new(BOTH_ENDS, ROUNDS, ENOUGH).map_err(failed(what))?;
    let rms = calib3d::calibrate_camera_extended(
        &object,
        &image,
        size,
        &mut matrix,
        &mut distortion,
        &mut turns,
        &mut shifts,
        &mut deviations,
        &mut more,
        &mut errors,
        0,
        criteria,
    )
    .map_err(failed(what))?;
    let at = |m: &Mat, k: i32| m.at::<f64>(k).copied().map_err(failed(what));
    let camera = |i, j| matrix.at_2d::<f64>(i, j).copied().map_err(failed(what));
    let mut lens = Lens {
        width,
        height,
        focal: DVec2::new(camera(0, 0)?, camera(1, 1)?),
        centre: DVec2::new(camera(0, 2)?, camera(1, 2)?),
        distortion: [0.0; 5],
    };
    let mut sigma = [0.0; 9];
    for k in 0..5 {
        lens.distortion[k] = at(&distortion, k as i32)?;
    }
    for (k, s) in sigma.iter_mut().enumerate() {
        *s = at(&deviations, k as i32)?;
    }
    let errors = (0..views.len()).map(|k| at(&errors, k as i32)).collect::<Result<_>>()?;
    Ok((lens, sigma, rms, errors))
}
