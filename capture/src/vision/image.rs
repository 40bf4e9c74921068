//! Images as `OpenCV` takes them, its points, errors and threads.

use crate::edges::GreyImage;
use crate::photo::PlanarImage;
use biscale::error::{Error, Result};
use biscale::numerics::cast::{narrow, truncate_i32, truncate_u8, truncate_usize};
use biscale::numerics::statistics::rank;
use glam::DVec2;
use opencv::core::{Mat, Point2f, Vector};
use rayon::prelude::*;

/// An error of `OpenCV`'s as one of ours.
pub(crate) fn failed(what: &'static str) -> impl Fn(opencv::Error) -> Error {
    move |e| Error::Numeric(format!("{what}: OpenCV says: {}", e.message.lines().next().unwrap_or_default()))
}

/// Threads that `OpenCV` may use; 0 for all.
///
/// # Errors
/// What `OpenCV` says.
pub fn set_threads(threads: u16) -> Result<()> {
    // For OpenCV, -1 means all, and 0 none beside the caller's.
    let threads = if threads == 0 { -1 } else { i32::from(threads) };
    opencv::core::set_num_threads(threads).map_err(failed("threads"))
}

/// Percentile of linear values that becomes white: highlights beyond it are cut off. Chosen.
const WHITE_PERCENTILE: f64 = 0.995;
/// Pixels that a percentile is taken of, about.
pub(crate) const SAMPLES: usize = 100_000;
/// Refinement of corners ends after so many rounds or below this movement, px (`OpenCV`'s flag for both). Chosen: a hundredth of what corners are off by.
const BOTH_ENDS: i32 = 3;
const ROUNDS: i32 = 60;
const ENOUGH_PX: f64 = 0.002;

/// An 8-bit grey picture.
#[derive(Clone, Debug)]
pub struct GreyImage8 {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Rows from the top.
    pub pixels: Vec<u8>,
}

impl GreyImage8 {
    /// The grey image of a photograph. Linear values are scaled so that their 99.5th percentile is white, and encoded by a square root: dark markers keep
    /// their edges.
    pub fn of(picture: &PlanarImage, encoded: bool) -> Self {
        let [r, g, b] = &picture.planes;
        let luma = |i: usize| 0.25 * r[i] + 0.5 * g[i] + 0.25 * b[i];
        let count = r.len();
        let white = if encoded {
            1.0
        } else {
            let mut sampled: Vec<f32> = (0..count).step_by((count / SAMPLES).max(1)).map(luma).collect();
            rank(&mut sampled, WHITE_PERCENTILE).unwrap_or(0.0).max(1e-9)
        };
        let pixels = (0..count)
            .into_par_iter()
            .map(|i| {
                let v = (luma(i) / white).clamp(0.0, 1.0);
                truncate_u8(f64::from(255.0 * if encoded { v } else { v.sqrt() } + 0.5))
            })
            .collect();
        Self { width: picture.width, height: picture.height, pixels }
    }

    /// The matrix that `OpenCV` takes; borrows the pixels.
    pub(crate) fn mat(&self) -> Result<opencv::boxed_ref::BoxedRef<'_, Mat>> {
        let (rows, columns) = (self.height.try_into().unwrap_or(i32::MAX), self.width.try_into().unwrap_or(i32::MAX));
        Mat::new_rows_cols_with_data(rows, columns, &self.pixels).map_err(failed("a picture"))
    }

    /// The image reduced to `1 / factor` of its size.
    pub(crate) fn smaller(&self, factor: f64) -> Result<Mat> {
        let mut out = Mat::default();
        let size = opencv::core::Size::new(whole(self.width as f64 / factor), whole(self.height as f64 / factor));
        opencv::imgproc::resize(&self.mat()?, &mut out, size, 0.0, 0.0, opencv::imgproc::INTER_AREA).map_err(failed("resizing"))?;
        Ok(out)
    }
}

impl GreyImage for GreyImage8 {
    fn value(&self, p: DVec2) -> Option<f64> {
        if !(p.x >= 0.0 && p.y >= 0.0 && p.x < (self.width - 1) as f64 && p.y < (self.height - 1) as f64) {
            return None;
        }
        let (i, j) = (truncate_usize(p.x), truncate_usize(p.y));
        let (u, v) = (p.x - i as f64, p.y - j as f64);
        let at = |i: usize, j: usize| f64::from(self.pixels[j * self.width + i]);
        Some((1.0 - v) * ((1.0 - u) * at(i, j) + u * at(i + 1, j)) + v * ((1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1)))
    }
}

/// Linear luminance of a photograph, to look up.
#[derive(Clone, Copy, Debug)]
pub struct Luminance<'a>(pub &'a PlanarImage);

impl GreyImage for Luminance<'_> {
    fn value(&self, p: DVec2) -> Option<f64> {
        let [r, g, b] = self.0.sample(p.x, p.y)?;
        Some(f64::from(0.25 * r + 0.5 * g + 0.25 * b))
    }
}

/// A length in whole pixels, at least 1.
pub(crate) fn whole(v: f64) -> i32 {
    truncate_i32(v.round()).max(1)
}

pub(crate) fn point(p: DVec2) -> Point2f {
    Point2f::new(narrow(p.x), narrow(p.y))
}

pub(crate) fn place(p: Point2f) -> DVec2 {
    DVec2::new(p.x.into(), p.y.into())
}

/// Moves corners to where the picture's gradients say, within `window` px to each side.
pub(crate) fn refine_corners(grey: &GreyImage8, corners: &[DVec2], window: i32) -> Result<Vec<DVec2>> {
    use opencv::core::{Size, TermCriteria};
    if corners.is_empty() {
        return Ok(Vec::new());
    }
    let mut points: Vector<Point2f> = corners.iter().map(|c| point(*c)).collect();
    let criteria = TermCriteria::new(BOTH_ENDS, ROUNDS, ENOUGH_PX).map_err(failed("corners"))?;
    opencv::imgproc::corner_sub_pix(&grey.mat()?, &mut points, Size::new(window, window), Size::new(-1, -1), criteria)
        .map_err(failed("corners"))?;
    Ok(points.iter().map(place).collect())
}
