//! A checker of 24 patches in a photograph.

use super::board::{apply, homography};
use super::image::{failed, place, whole};
use crate::colour::{COLUMNS, Correction, checker_rgb, fit};
use crate::lens::Lens;
use crate::photo::PlanarImage;
use biscale::error::Result;
use biscale::numerics::cast::{truncate_u8, truncate_usize};
use biscale::numerics::colour::linear_to_srgb;
use biscale::numerics::statistics::rank;
use glam::DVec2;
use opencv::core::{CV_8UC3, Mat, Point2f, Vec3b, Vector};
use opencv::mcc::{MCC_CCheckerDetector, MCC_TYPECHART};
use opencv::prelude::*;

/// A checker that was found, its patches in the order of their numbers.
#[derive(Clone, Debug)]
pub struct Checker {
    /// Middles of the patches, px of the photograph as it was taken.
    pub centres: Vec<DVec2>,
    /// Corners of each patch's middle half, px, for the report.
    pub windows: Vec<[DVec2; 4]>,
    /// Mean values of the patches.
    pub measured: Vec<[f64; 3]>,
    /// Share of saturated pixels in the worst patch.
    pub saturated: f64,
    /// The matrix that they give.
    pub correction: Correction,
}

/// Where a checker is, and how much frame is around its patches, in patch distances.
struct Frame {
    corners: [DVec2; 4],
    border: f64,
}

/// Side of a patch and gap between two, as the maker's chart has them (and `OpenCV`'s model of it): 2.5 and 0.25.
const PATCH: f64 = 2.5;
const GAP: f64 = 0.25;
/// Part of a patch's side that is averaged.
const INNER: f64 = 0.5;

/// Looks for a checker in a linear photograph, or takes the outer corners of its patches as given.
///
/// Which corner is which is told by the colours: of the eight ways to orient it, the one whose patches come nearest to theirs is taken.
///
/// # Errors
/// What `OpenCV` says; `None` if there is none.
pub fn find(photo: &PlanarImage, saturated: &[bool], lens: Option<&Lens>, given: Option<[DVec2; 4]>) -> Result<Option<Checker>> {
    let frame = match given {
        Some(corners) => Frame { corners, border: 0.0 },
        None => match detect(photo)? {
            Some(corners) => Frame { corners, border: GAP },
            None => return Ok(None),
        },
    };
    let straight = |p: DVec2| lens.and_then(|l| l.undistort(l.place(p)).map(|q| l.pixel(q))).unwrap_or(p);
    let bent = |p: DVec2| lens.map_or(p, |l| l.pixel(l.distort(l.place(p))));
    let (columns, rows) = (COLUMNS as f64, 4.0);
    let (width, height) = (columns * PATCH + (columns - 1.0) * GAP, rows * PATCH + (rows - 1.0) * GAP);
    let b = frame.border;
    let outer = [DVec2::new(-b, -b), DVec2::new(width + b, -b), DVec2::new(width + b, height + b), DVec2::new(-b, height + b)];
    let mut best: Option<Checker> = None;
    for mirrored in [false, true] {
        for turn in 0..4 {
            let corner = |k: usize| {
                let k = (k + turn) % 4;
                straight(frame.corners[if mirrored { 3 - k } else { k }])
            };
            let pairs: Vec<(DVec2, DVec2)> = outer.iter().enumerate().map(|(k, o)| (*o, corner(k))).collect();
            let Some(h) = homography(&pairs)? else { continue };
            let at = |p: DVec2| bent(apply(&h, p));
            let middle = |k: usize| DVec2::new((k % COLUMNS) as f64, (k / COLUMNS) as f64) * (PATCH + GAP) + 0.5 * PATCH;
            let half = 0.5 * INNER * PATCH;
            let window = |k: usize| [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|d| at(middle(k) + half * DVec2::from(d)));
            let windows: Vec<[DVec2; 4]> = (0..24).map(window).collect();
            let means: Option<Vec<([f64; 3], f64)>> = windows.iter().map(|w| mean(photo, saturated, w)).collect();
            let Some(means) = means else { continue };
            let measured: Vec<[f64; 3]> = means.iter().map(|m| m.0).collect();
            let Some(correction) = fit(&measured, &checker_rgb()) else { continue };
            if best.as_ref().is_none_or(|b| correction.mean_delta_e() < b.correction.mean_delta_e()) {
                let saturated = means.iter().map(|m| m.1).fold(0.0, f64::max);
                best = Some(Checker { centres: (0..24).map(|k| at(middle(k))).collect(), windows, measured, saturated, correction });
            }
        }
    }
    Ok(best)
}

/// Mean of a convex quadrilateral in a photograph, and its share of saturated pixels; `None` if it leaves the picture or holds no pixel.
pub(crate) fn mean(photo: &PlanarImage, saturated: &[bool], corners: &[DVec2; 4]) -> Option<([f64; 3], f64)> {
    let (low, high) = corners.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), c| (l.min(*c), h.max(*c)));
    if !(low.x >= 0.0 && low.y >= 0.0 && high.x <= (photo.width - 1) as f64 && high.y <= (photo.height - 1) as f64) {
        return None;
    }
    let side = |p: DVec2, k: usize| (corners[(k + 1) % 4] - corners[k]).perp_dot(p - corners[k]);
    let (mut sum, mut count, mut over) = ([0.0; 3], 0_u32, 0_u32);
    let range = |a: f64, b: f64| truncate_usize(a.ceil())..=truncate_usize(b);
    for row in range(low.y, high.y) {
        for column in range(low.x, high.x) {
            let p = DVec2::new(column as f64, row as f64);
            let signs: Vec<bool> = (0..4).map(|k| side(p, k) >= 0.0).collect();
            if signs.iter().all(|s| *s) || signs.iter().all(|s| !s) {
                for (s, v) in sum.iter_mut().zip(photo.at(column, row)) {
                    *s += f64::from(v);
                }
                count += 1;
                over += u32::from(saturated[row * photo.width + column]);
            }
        }
    }
    (count > 0).then(|| (sum.map(|s| s / f64::from(count)), f64::from(over) / f64::from(count)))
}

/// The corners of a checker that `OpenCV` sees, px; around the patches with a gap.
fn detect(photo: &PlanarImage) -> Result<Option<[DVec2; 4]>> {
    /// Longest side of the picture that is looked at, px; the percentile of green that is shown bright, and how bright, of 1. Chosen.
    const LOOK: f64 = 1200.0;
    const BRIGHT_PERCENTILE: f64 = 0.99;
    const BRIGHT: f64 = 0.9;
    let what = "looking for a checker";
    let factor = (photo.width.max(photo.height) as f64 / LOOK).max(1.0);
    // By the mean of each small pixel's part: a fine pattern must not alias.
    let (width, height) = (whole(photo.width as f64 / factor), whole(photo.height as f64 / factor));
    let every = (photo.planes[1].len() / super::image::SAMPLES).max(1);
    let mut sampled: Vec<f32> = photo.planes[1].iter().step_by(every).copied().collect();
    let bright = rank(&mut sampled, BRIGHT_PERCENTILE).unwrap_or(0.0).max(1e-9);
    let byte = |v: f32| truncate_u8(255.0 * linear_to_srgb(f64::from(v / bright) * BRIGHT) + 0.5);
    let full: Vec<Vec3b> = (0..photo.planes[0].len())
        .map(|i| Vec3b::from([byte(photo.planes[2][i]), byte(photo.planes[1][i]), byte(photo.planes[0][i])]))
        .collect();
    let (rows, columns) = (photo.height.try_into().unwrap_or(i32::MAX), photo.width.try_into().unwrap_or(i32::MAX));
    let image = Mat::new_rows_cols_with_data(rows, columns, &full).map_err(failed(what))?;
    let mut small = Mat::default();
    let size = opencv::core::Size::new(width, height);
    opencv::imgproc::resize(&image, &mut small, size, 0.0, 0.0, opencv::imgproc::INTER_AREA).map_err(failed(what))?;
    debug_assert_eq!(small.typ(), CV_8UC3);
    let mut detector = MCC_CCheckerDetector::create().map_err(failed(what))?;
    let found = detector.process_def(&small, MCC_TYPECHART::MCC24).map_err(failed(what))?;
    if !found {
        return Ok(None);
    }
    let mut checker = detector.get_best_color_checker().map_err(failed(what))?;
    let corners: Vector<Point2f> = checker.get_box().map_err(failed(what))?;
    let corners: Vec<DVec2> = corners.iter().map(|p| (place(p) + 0.5) * factor - 0.5).collect();
    Ok(corners.try_into().ok())
}
