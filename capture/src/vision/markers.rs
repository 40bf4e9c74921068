//! `ArUco` markers in a photograph.

use super::image::{GreyImage8, failed, place, refine_corners, whole};
use crate::dictionary::{self, CustomDictionary, Dictionary};
use biscale::error::{Error, Result};
use glam::DVec2;
use opencv::aruco::{self, CORNER_REFINE_NONE, DetectorParameters};
use opencv::core::{Mat, Point2f, Ptr, Vector};
use opencv::prelude::*;

/// A marker that was found: its number, and its corners from its own upper left clockwise, px.
pub type DetectedMarker = (i32, [DVec2; 4]);

/// Names of `AprilTag` families after the dictionaries of ours, in `OpenCV`'s order.
const APRIL_TAGS: [&str; 4] = ["AprilTag 16h5", "AprilTag 25h9", "AprilTag 36h10", "AprilTag 36h11"];
/// The picture is first looked at in this width or less, px. Chosen: large markers are found faster and as well.
const LOOK: f64 = 2000.0;
/// Widest window of `OpenCV`'s adaptive threshold, px, for large markers; its default is 23.
const LARGE_WINDOW: i32 = 63;
/// Half width of the window of refinement over a cell of the marker, and its range, px: the border is one cell wide, so half a cell sees one corner only.
const WINDOW: (f64, [i32; 2]) = (0.5, [2, 12]);
/// `OpenCV`'s numbers of dictionaries that hold the smaller ones of their size.
const FAMILIES: [(i32, &str); 8] = [
    (20, APRIL_TAGS[3]),
    (19, APRIL_TAGS[2]),
    (18, APRIL_TAGS[1]),
    (11, "DICT_6X6"),
    (15, "DICT_7X7"),
    (7, "DICT_5X5"),
    (16, "DICT_ARUCO_ORIGINAL"),
    (3, "DICT_4X4"),
];
/// The one whose markers noise does not look like: one of them is enough.
const SURE_FAMILY: i32 = 20;
/// Grey above which a cell is white.
const WHITE: u8 = 127;

/// A dictionary as `OpenCV` takes it.
type Markers = Ptr<aruco::Dictionary>;

fn predefined(number: i32) -> Result<Markers> {
    aruco::get_predefined_dictionary_i32(number).map_err(failed("a dictionary"))
}

fn markers_of(dictionary: &Dictionary) -> Result<Markers> {
    match dictionary {
        Dictionary::Predefined(name) => {
            let number = dictionary::names().iter().position(|n| n == name).and_then(|k| i32::try_from(k).ok());
            predefined(number.ok_or_else(|| Error::Numeric(format!("OpenCV has no dictionary {name}")))?)
        }
        Dictionary::Custom(own) => made(own),
    }
}

/// `OpenCV` keeps the bits of all four turns of each marker as bytes, a row a marker.
fn made(own: &CustomDictionary) -> Result<Markers> {
    let what = "a dictionary of one's own";
    let side = i32::try_from(own.side).unwrap_or(i32::MAX);
    let mut rows: Vector<Mat> = Vector::new();
    for bits in &own.markers {
        let values: Vec<u8> = bits.iter().map(|b| u8::from(*b)).collect();
        let bits = Mat::new_rows_cols_with_data(side, side, &values).map_err(failed(what))?;
        rows.push(aruco::Dictionary::get_byte_list_from_bits(&bits).map_err(failed(what))?);
    }
    let mut list = Mat::default();
    opencv::core::vconcat(&rows, &mut list).map_err(failed(what))?;
    let correction = i32::try_from(own.correction).unwrap_or(i32::MAX);
    Ok(Ptr::new(aruco::Dictionary::new(&list, side, correction).map_err(failed(what))?))
}

/// All markers of a dictionary, with refined corners; sorted by number, each once (the largest one, where a number is seen twice).
///
/// # Errors
/// What `OpenCV` says.
pub fn detect(grey: &GreyImage8, dictionary: &Dictionary) -> Result<Vec<DetectedMarker>> {
    let ours = markers_of(dictionary)?;
    let factor = (grey.width.max(grey.height) as f64 / LOOK).max(1.0);
    let mut rough = look(grey, &ours, factor, false)?;
    if rough.is_empty() {
        rough = look(grey, &ours, factor, true)?;
    }
    if rough.is_empty() && factor > 1.0 {
        rough = look(grey, &ours, 1.0, false)?;
    }
    let cells = dictionary.cells() as f64;
    let mut out: Vec<DetectedMarker> = Vec::with_capacity(rough.len());
    for (id, corners) in rough {
        let shortest = (0..4).map(|k| corners[k].distance(corners[(k + 1) % 4])).fold(f64::INFINITY, f64::min);
        let window = whole(WINDOW.0 * shortest / cells).clamp(WINDOW.1[0], WINDOW.1[1]);
        let fine = refine_corners(grey, &corners, window)?;
        let moved = fine.iter().zip(&corners).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        // A corner that ran away is worse than one that was not refined.
        let kept = if moved <= f64::from(window) + factor { [fine[0], fine[1], fine[2], fine[3]] } else { corners };
        out.push((id, kept));
    }
    out.sort_by(|a, b| a.0.cmp(&b.0).then(area(&b.1).total_cmp(&area(&a.1))));
    out.dedup_by_key(|m| m.0);
    Ok(out)
}

fn area(c: &[DVec2; 4]) -> f64 {
    (c[2] - c[0]).perp_dot(c[3] - c[1]).abs()
}

/// Markers of a dictionary in a picture `1 / factor` as large; `large` ones need wider windows of the threshold, which melt small ones together.
fn look(grey: &GreyImage8, dictionary: &Markers, factor: f64, large: bool) -> Result<Vec<DetectedMarker>> {
    let what = "looking for markers";
    let mut parameters = DetectorParameters::create().map_err(failed(what))?;
    parameters.set_corner_refinement_method(CORNER_REFINE_NONE);
    if large {
        parameters.set_adaptive_thresh_win_size_max(LARGE_WINDOW);
    }
    let mut corners: Vector<Vector<Point2f>> = Vector::new();
    let (mut ids, mut rejected): (Vector<i32>, Vector<Vector<Point2f>>) = (Vector::new(), Vector::new());
    if factor > 1.0 {
        let small = grey.smaller(factor)?;
        aruco::detect_markers(&small, dictionary, &mut corners, &mut ids, &parameters, &mut rejected).map_err(failed(what))?;
    } else {
        aruco::detect_markers(&grey.mat()?, dictionary, &mut corners, &mut ids, &parameters, &mut rejected).map_err(failed(what))?;
    }
    let scaled = |p: Point2f| (place(p) + 0.5) * factor - 0.5;
    let quad = |c: &Vector<Point2f>| -> Option<[DVec2; 4]> { c.iter().map(scaled).collect::<Vec<_>>().try_into().ok() };
    Ok(ids.iter().zip(&corners).filter_map(|(id, c)| Some((id, quad(&c)?))).collect())
}

/// Another family that the picture shows markers of, where ours are not seen.
///
/// # Errors
/// What `OpenCV` says.
pub fn other_family(grey: &GreyImage8, ours: Option<&Dictionary>) -> Result<Option<(String, usize)>> {
    let factor = (grey.width.max(grey.height) as f64 / LOOK).max(1.0);
    // The largest dictionary of each size holds the smaller ones. Those with few bits see markers in noise: more than one must be found.
    for (number, name) in FAMILIES {
        if matches!(ours, Some(Dictionary::Predefined(own)) if own.starts_with(name)) {
            continue;
        }
        let found = look(grey, &predefined(number)?, factor, false)?.len();
        if found > usize::from(number != SURE_FAMILY) {
            return Ok(Some((name.to_owned(), found)));
        }
    }
    Ok(None)
}

/// The bits of a marker as `OpenCV` knows it, row by row, true where white, without the border.
///
/// # Errors
/// What `OpenCV` says.
pub fn bits(dictionary: &Dictionary, id: i32) -> Result<Vec<bool>> {
    let what = "a dictionary";
    let side = i32::try_from(dictionary.cells()).unwrap_or(i32::MAX);
    let mut image = Mat::default();
    aruco::draw_marker(&markers_of(dictionary)?, id, side, &mut image, 1).map_err(failed(what))?;
    let mut out = Vec::new();
    for row in 1..side - 1 {
        for column in 1..side - 1 {
            out.push(*image.at_2d::<u8>(row, column).map_err(failed(what))? > WHITE);
        }
    }
    Ok(out)
}
