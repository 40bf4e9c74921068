//! The corners of a board in a photograph.

use super::image::{GreyImage8, failed, place, point, refine_corners, whole};
use super::markers::{self, DetectedMarker};
use crate::board::{Board, BoardKind};
use crate::edges::GreyImage as _;
use biscale::error::Result;
use biscale::numerics::statistics::upper_median;
use glam::DVec2;
use opencv::calib3d;
use opencv::core::{Mat, Point2f, Size, Vector};
use opencv::prelude::*;

/// How corners of boards are found. Chosen, not measured.
struct BoardParams {
    /// Longest side of the picture that a chessboard is first sought in, px.
    look_px: f64,
    /// Half width of the window of refinement over the distance of the nearest corner, and its range, px.
    chessboard_window: (f64, [i32; 2]),
    /// Distance of a marker's middle from a corner of the squares, in squares, up to which it lies beside it: the four neighbours are 0.71 away.
    beside: f64,
    /// Corners of markers, the nearest, that a corner beside one marker alone is placed by.
    helpers: usize,
    /// Half width of the window of refinement over the gap between marker and corner, and its range, px.
    charuco_window: (f64, [i32; 2]),
    /// Distance from the window to the border of the picture, px.
    margin_px: f64,
    /// Part of the gap at which the four squares around a corner are compared.
    corner_reach: f64,
    /// Steps of grey, of 255, between light and dark squares, at least.
    least_contrast: f64,
    /// Corners around a marker that its size is told by.
    ruler: usize,
    /// Fewest markers whose sizes make a median.
    fewest_scales: usize,
}

const PARAMS: BoardParams = BoardParams {
    look_px: 1600.0,
    chessboard_window: (0.4, [2, 11]),
    beside: 0.75,
    helpers: 8,
    charuco_window: (0.7, [2, 12]),
    margin_px: 2.0,
    corner_reach: 0.7,
    least_contrast: 12.0,
    ruler: 6,
    fewest_scales: 3,
};

/// What was found of a board.
#[derive(Clone, Debug, Default)]
pub struct DetectedBoard {
    /// Markers of the board's dictionary and numbers.
    pub markers: Vec<DetectedMarker>,
    /// Places on the board, mm, and in the photograph, px.
    pub corners: Vec<(DVec2, DVec2)>,
    /// Side of the markers relative to what the board says, where squares tell it.
    pub marker_scale: Option<f64>,
}

/// Looks for a board.
///
/// # Errors
/// What `OpenCV` says; a board that is not there is no error.
pub fn detect(grey: &GreyImage8, board: &Board) -> Result<DetectedBoard> {
    match board.kind {
        BoardKind::Chessboard { columns, rows } => {
            let pixels = chessboard(grey, columns, rows)?;
            Ok(DetectedBoard { corners: board.corners.iter().copied().zip(pixels).collect(), ..DetectedBoard::default() })
        }
        BoardKind::Markers => {
            let markers = of_board(grey, board)?;
            let corners = markers.iter().flat_map(|m| marker_places(board, m.0).into_iter().flatten().zip(m.1)).collect();
            Ok(DetectedBoard { markers, corners, marker_scale: None })
        }
        BoardKind::Charuco { square, marker, .. } => charuco(grey, board, square, marker),
    }
}

fn of_board(grey: &GreyImage8, board: &Board) -> Result<Vec<DetectedMarker>> {
    let Some(dictionary) = &board.dictionary else { return Ok(Vec::new()) };
    let mut markers = markers::detect(grey, dictionary)?;
    markers.retain(|m| marker_places(board, m.0).is_some());
    Ok(markers)
}

/// Corners of a marker on the board, mm.
pub fn marker_places(board: &Board, id: i32) -> Option<[DVec2; 4]> {
    board.markers.iter().find(|m| m.0 == id).map(|m| m.1)
}

/// The inner corners of a chessboard in a photograph, row by row; none if it is not seen as a whole.
fn chessboard(grey: &GreyImage8, columns: u32, rows: u32) -> Result<Vec<DVec2>> {
    let what = "looking for a chessboard";
    let factor = (grey.width.max(grey.height) as f64 / PARAMS.look_px).max(1.0);
    let size = Size::new(columns.try_into().unwrap_or(i32::MAX), rows.try_into().unwrap_or(i32::MAX));
    let small = if factor > 1.0 { grey.smaller(factor)? } else { grey.mat()?.try_clone().map_err(failed(what))? };
    let mut points: Vector<Point2f> = Vector::new();
    let classic = calib3d::CALIB_CB_ADAPTIVE_THRESH | calib3d::CALIB_CB_NORMALIZE_IMAGE | calib3d::CALIB_CB_FAST_CHECK;
    let mut found = calib3d::find_chessboard_corners(&small, size, &mut points, classic).map_err(failed(what))?;
    if !found {
        let thorough = calib3d::CALIB_CB_NORMALIZE_IMAGE | calib3d::CALIB_CB_EXHAUSTIVE;
        found = calib3d::find_chessboard_corners_sb(&small, size, &mut points, thorough).map_err(failed(what))?;
    }
    let columns = columns as usize;
    if !found || points.len() != columns * rows as usize {
        return Ok(Vec::new());
    }
    let rough: Vec<DVec2> = points.iter().map(|p| (place(p) + 0.5) * factor - 0.5).collect();
    // The nearest neighbour decides how far a window may reach.
    let along = rough.windows(2).enumerate().filter(|(k, _)| (k + 1) % columns != 0).map(|(_, w)| w[0].distance(w[1]));
    let across = rough.iter().zip(&rough[columns.min(rough.len())..]).map(|(a, b)| a.distance(*b));
    let nearest = along.chain(across).fold(f64::INFINITY, f64::min);
    refine_corners(grey, &rough, window(nearest, PARAMS.chessboard_window))
}

/// Half width of a window of refinement, px: a part of a distance, within a range.
fn window(distance: f64, (part, [least, most]): (f64, [i32; 2])) -> i32 {
    whole(part * distance).clamp(least, most)
}

/// Corners between the squares, from the markers around them (as `interpolateCornersCharuco` does), then refined.
fn charuco(grey: &GreyImage8, board: &Board, square: f64, marker: f64) -> Result<DetectedBoard> {
    let markers = of_board(grey, board)?;
    let mut corners = Vec::new();
    if markers.is_empty() {
        return Ok(DetectedBoard::default());
    }
    let all: Vec<(DVec2, DVec2)> = markers.iter().flat_map(|m| marker_places(board, m.0).into_iter().flatten().zip(m.1)).collect();
    for &corner in &board.corners {
        // Only where a marker of its own is seen: elsewhere it would be a guess.
        let mut near: Vec<&DetectedMarker> = markers
            .iter()
            .filter(|m| {
                marker_places(board, m.0).is_some_and(|c| (c.iter().sum::<DVec2>() / 4.0).distance(corner) < PARAMS.beside * square)
            })
            .collect();
        if near.is_empty() {
            continue;
        }
        near.sort_by_key(|m| m.0);
        let mut pairs: Vec<(DVec2, DVec2)> = near.iter().flat_map(|m| marker_places(board, m.0).into_iter().flatten().zip(m.1)).collect();
        if near.len() == 1 {
            // One marker alone has too short a lever: the next ones help.
            let mut others: Vec<&(DVec2, DVec2)> = all.iter().collect();
            others.sort_by(|a, b| a.0.distance(corner).total_cmp(&b.0.distance(corner)));
            pairs = others.into_iter().take(PARAMS.helpers).copied().collect();
        }
        let Some(h) = homography(&pairs)? else { continue };
        let rough = apply(&h, corner);
        // Half of the gap between corner and marker, in pixels there.
        let gap = 0.5 * (square - marker);
        let reach = [DVec2::X, DVec2::Y].iter().map(|d| apply(&h, corner + gap * *d).distance(rough)).fold(f64::INFINITY, f64::min);
        let window = window(reach, PARAMS.charuco_window);
        let margin = f64::from(window) + PARAMS.margin_px;
        let inside = rough.x > margin && rough.y > margin && rough.x < grey.width as f64 - margin && rough.y < grey.height as f64 - margin;
        if !inside {
            continue;
        }
        let fine = refine_corners(grey, &[rough], window)?[0];
        if fine.distance(rough) <= f64::from(window) && is_corner(grey, &h, corner, PARAMS.corner_reach * gap) {
            corners.push((corner, fine));
        }
    }
    let marker_scale = marker_scale(board, &markers, &corners, marker)?;
    Ok(DetectedBoard { markers, corners, marker_scale })
}

/// Whether four squares meet at a place: light and dark ones across. Where the sample, or a hand, covers the board they do not.
fn is_corner(grey: &GreyImage8, h: &glam::DMat3, corner: DVec2, reach: f64) -> bool {
    let value = |x: f64, y: f64| grey.value(apply(h, corner + reach * DVec2::new(x, y)));
    let (Some(a), Some(b), Some(c), Some(d)) = (value(1.0, 1.0), value(-1.0, -1.0), value(1.0, -1.0), value(-1.0, 1.0)) else {
        return false;
    };
    a.min(b) > c.max(d) + PARAMS.least_contrast || c.min(d) > a.max(b) + PARAMS.least_contrast
}

/// The sides of the markers in units of what the board says, where the squares are the ruler.
fn marker_scale(board: &Board, markers: &[DetectedMarker], corners: &[(DVec2, DVec2)], marker: f64) -> Result<Option<f64>> {
    let mut scales = Vec::new();
    for m in markers {
        let Some(places) = marker_places(board, m.0) else { continue };
        let middle = places.iter().sum::<DVec2>() / 4.0;
        let mut near: Vec<(DVec2, DVec2)> = corners.to_vec();
        near.sort_by(|a, b| a.0.distance(middle).total_cmp(&b.0.distance(middle)));
        near.truncate(PARAMS.ruler);
        // Only inside of the corners: a homography is no good beyond its points.
        if near.len() < PARAMS.ruler {
            continue;
        }
        let Some(h) = homography(&near.iter().map(|(a, b)| (*b, *a)).collect::<Vec<_>>())? else { continue };
        let sides: f64 = (0..4).map(|k| apply(&h, m.1[k]).distance(apply(&h, m.1[(k + 1) % 4]))).sum();
        scales.push(sides / (4.0 * marker));
    }
    if scales.len() < PARAMS.fewest_scales {
        return Ok(None);
    }
    Ok(upper_median(&mut scales))
}

/// The homography that takes the first places to the second ones; `None` if there is none.
pub(crate) fn homography(pairs: &[(DVec2, DVec2)]) -> Result<Option<glam::DMat3>> {
    if pairs.len() < 4 {
        return Ok(None);
    }
    let from: Vector<Point2f> = pairs.iter().map(|p| point(p.0)).collect();
    let to: Vector<Point2f> = pairs.iter().map(|p| point(p.1)).collect();
    let h: Mat = calib3d::find_homography(&from, &to, &mut opencv::core::no_array(), 0, 3.0).map_err(failed("a homography"))?;
    if h.empty() {
        return Ok(None);
    }
    let mut rows = [[0.0; 3]; 3];
    for (i, row) in rows.iter_mut().enumerate() {
        for (j, v) in row.iter_mut().enumerate() {
            *v = *h.at_2d::<f64>(i as i32, j as i32).map_err(failed("a homography"))?;
        }
    }
    let h = crate::colour::by_rows(rows);
    Ok(h.is_finite().then_some(h))
}

/// Where a homography takes a place.
pub(crate) fn apply(h: &glam::DMat3, p: DVec2) -> DVec2 {
    let q = *h * p.extend(1.0);
    q.truncate() / q.z
}
