//! `ArUco` markers in a photograph.

use super::{Gray, failed, place, refine_corners, whole};
use crate::shoot::dictionaries;
use biscale::error::Result;
use glam::DVec2;
use opencv::aruco::{self, CORNER_REFINE_NONE, DetectorParameters};
use opencv::core::{Mat, Point2f, Vector};
use opencv::prelude::*;

/// A marker that was found: its number, and its corners from its own upper left clockwise, px.
pub type Marker = (i32, [DVec2; 4]);

/// Names of `AprilTag` families after the dictionaries of ours, in `OpenCV`'s order.
const APRIL_TAGS: [&str; 4] = ["AprilTag 16h5", "AprilTag 25h9", "AprilTag 36h10", "AprilTag 36h11"];
/// The picture is first looked at in this width or less.
const LOOK: f64 = 2000.0;

/// `OpenCV`'s number of a dictionary.
fn number(dictionary: &str) -> Option<i32> {
    dictionaries().iter().position(|d| *d == dictionary).and_then(|k| i32::try_from(k).ok())
}

/// All markers of a dictionary, with refined corners; sorted by number, each once (the largest one, where a number is seen twice).
///
/// # Errors
/// What `OpenCV` says.
pub fn detect(gray: &Gray, dictionary: &str) -> Result<Vec<Marker>> {
    let Some(number) = number(dictionary) else { return Ok(Vec::new()) };
    let factor = (gray.width.max(gray.height) as f64 / LOOK).max(1.0);
    let mut rough = look(gray, number, factor, false)?;
    if rough.is_empty() {
        rough = look(gray, number, factor, true)?;
    }
    if rough.is_empty() && factor > 1.0 {
        rough = look(gray, number, 1.0, false)?;
    }
    // The border is one cell wide: a window of half a cell sees one corner only.
    let cells = cells(number);
    let mut out: Vec<Marker> = Vec::with_capacity(rough.len());
    for (id, corners) in rough {
        let shortest = (0..4).map(|k| corners[k].distance(corners[(k + 1) % 4])).fold(f64::INFINITY, f64::min);
        let window = whole(0.5 * shortest / cells).clamp(2, 12);
        let fine = refine_corners(gray, &corners, window)?;
        let moved = fine.iter().zip(&corners).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        // A corner that ran away is worse than one that was not refined.
        let kept = if moved <= f64::from(window) + factor { [fine[0], fine[1], fine[2], fine[3]] } else { corners };
        out.push((id, kept));
    }
    out.sort_by(|a, b| a.0.cmp(&b.0).then(area(&b.1).total_cmp(&area(&a.1))));
    out.dedup_by_key(|m| m.0);
    Ok(out)
}

/// Cells along a marker's side, its border included.
pub fn cells(number: i32) -> f64 {
    match number {
        0..=3 | 17 => 6.0,
        4..=7 => 7.0,
        12..=15 => 9.0,
        16 => 7.0,
        18 => 7.0,
        _ => 8.0,
    }
}

/// Cells along the side of a dictionary's markers.
pub fn cells_of(dictionary: &str) -> f64 {
    number(dictionary).map_or(7.0, cells)
}

fn area(c: &[DVec2; 4]) -> f64 {
    (c[2] - c[0]).perp_dot(c[3] - c[1]).abs()
}

/// Markers of a dictionary in a picture `1 / factor` as large; `large` ones need wider windows of the threshold, which melt small ones together.
fn look(gray: &Gray, number: i32, factor: f64, large: bool) -> Result<Vec<Marker>> {
    let what = "looking for markers";
    let dictionary = aruco::get_predefined_dictionary_i32(number).map_err(failed(what))?;
    let mut parameters = DetectorParameters::create().map_err(failed(what))?;
    parameters.set_corner_refinement_method(CORNER_REFINE_NONE);
    if large {
        parameters.set_adaptive_thresh_win_size_max(63);
    }
    let mut corners: Vector<Vector<Point2f>> = Vector::new();
    let (mut ids, mut rejected): (Vector<i32>, Vector<Vector<Point2f>>) = (Vector::new(), Vector::new());
    if factor > 1.0 {
        let small = gray.smaller(factor)?;
        aruco::detect_markers(&small, &dictionary, &mut corners, &mut ids, &parameters, &mut rejected).map_err(failed(what))?;
    } else {
        aruco::detect_markers(&gray.mat()?, &dictionary, &mut corners, &mut ids, &parameters, &mut rejected).map_err(failed(what))?;
    }
    let scaled = |p: Point2f| (place(p) + 0.5) * factor - 0.5;
    let quad = |c: &Vector<Point2f>| -> Option<[DVec2; 4]> { c.iter().map(scaled).collect::<Vec<_>>().try_into().ok() };
    Ok(ids.iter().zip(&corners).filter_map(|(id, c)| Some((id, quad(&c)?))).collect())
}

/// Another family that the picture shows markers of, where ours are not seen.
///
/// # Errors
/// What `OpenCV` says.
pub fn other_family(gray: &Gray, ours: &str) -> Result<Option<(String, usize)>> {
    let factor = (gray.width.max(gray.height) as f64 / LOOK).max(1.0);
    // The largest dictionary of each size holds the smaller ones. Those with few bits see markers in noise: more than one must be found.
    for (number, name) in [
        (20, APRIL_TAGS[3]),
        (19, APRIL_TAGS[2]),
        (18, APRIL_TAGS[1]),
        (11, "DICT_6X6"),
        (15, "DICT_7X7"),
        (7, "DICT_5X5"),
        (16, "DICT_ARUCO_ORIGINAL"),
        (3, "DICT_4X4"),
    ] {
        if ours.starts_with(name) {
            continue;
        }
        let found = look(gray, number, factor, false)?.len();
        if found > usize::from(number != 20) {
            return Ok(Some((name.to_owned(), found)));
        }
    }
    Ok(None)
}

/// The bits of a marker as `OpenCV` knows it, row by row, true where white, without the border.
///
/// # Errors
/// What `OpenCV` says.
pub fn bits(dictionary: &str, id: i32) -> Result<Vec<bool>> {
    let what = "a dictionary";
    let number = number(dictionary).unwrap_or_default();
    let dictionary = aruco::get_predefined_dictionary_i32(number).map_err(failed(what))?;
    let side = whole(cells(number));
    let mut image = Mat::default();
    aruco::draw_marker(&dictionary, id, side, &mut image, 1).map_err(failed(what))?;
    let mut out = Vec::new();
    for row in 1..side - 1 {
        for column in 1..side - 1 {
            out.push(*image.at_2d::<u8>(row, column).map_err(failed(what))? > 127);
        }
    }
    Ok(out)
}
