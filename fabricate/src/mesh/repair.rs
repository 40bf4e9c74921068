//! What is repaired in triangles before they are facets, each with a note: faces that lie on others, faces turned against their neighbours, bodies that are inside
//! out. Paper has two sides, and fold angles count from the outer one.

use super::adjacency::place;
use super::triangles::Triangles;
use biscale::error::BadInput;
use biscale::geometry::mesh::{FaceGroups, edges};
use glam::DVec3;
use rustc_hash::FxHashSet;
use std::f64::consts::PI;

/// Repairs triangles whose corners were welded. Returns what was done.
///
/// # Errors
/// A sheet of two sides in one place; a strip with one side only, whose faces cannot all be turned alike.
pub(crate) fn repair(soup: &mut Triangles) -> Result<Vec<String>, BadInput> {
    let mut notes = Vec::new();
    let doubled = drop_doubled(soup);
    if doubled > 0 {
        notes.push(format!("left out {doubled} faces that lie on others: paper has one layer"));
    }
    let parts = FaceGroups::new(&soup.triangles);
    if let Some((_, [a, b])) = parts.one_sided.first() {
        let at = place(0.5 * (soup.vertices[*a as usize] + soup.vertices[*b as usize]));
        let problem = format!("the surface has one side only, as a Möbius strip: no faces around {at} can be turned alike");
        return Err(BadInput::new(problem, "cut it there: paper has two sides"));
    }
    let turned = parts.minority(|t| vector_area(soup, t).length());
    turned.iter().for_each(|&t| soup.triangles[t].swap(1, 2));
    if parts.groups.iter().any(|part| has_no_thickness(soup, part)) {
        let problem = "the surface has no thickness: its front and its back lie in one place";
        return Err(BadInput::new(problem, "delete the faces of one side: paper has one layer"));
    }
    if !turned.is_empty() {
        let turned = turned.len();
        notes.push(format!("turned {turned} faces over that were turned against their neighbours"));
    }
    let inside_out = turn_inside_out(soup, &parts.groups);
    if inside_out > 0 {
        let which = if parts.groups.len() == 1 { "the surface".to_owned() } else { format!("{inside_out} closed parts of the surface") };
        notes.push(format!("{which} showed the inner side outside, and was turned over"));
    }
    Ok(notes)
}

/// Leaves out triangles with the corners of an earlier one, in whatever order.
fn drop_doubled(soup: &mut Triangles) -> usize {
    let mut seen: FxHashSet<[u32; 3]> = FxHashSet::default();
    let keep: Vec<bool> = soup
        .triangles
        .iter()
        .map(|t| {
            let mut sorted = *t;
            sorted.sort_unstable();
            // What has no area is left out later, and is no face that others could lie on.
            sorted[0] == sorted[1] || sorted[1] == sorted[2] || seen.insert(sorted)
        })
        .collect();
    let before = soup.triangles.len();
    let mut k = keep.iter();
    soup.triangles.retain(|_| k.next().is_some_and(|kept| *kept));
    let mut k = keep.iter();
    soup.colours.retain(|_| k.next().is_some_and(|kept| *kept));
    before - soup.triangles.len()
}

/// Volume over area and size below which a closed surface has none: rounding of welded corners. Chosen, not measured.
const NO_THICKNESS: f64 = 1e-9;

/// Whether a part is closed and holds nothing: a sheet with a front and a back, cut into triangles in different ways.
fn has_no_thickness(soup: &Triangles, part: &[usize]) -> bool {
    let area: f64 = part.iter().map(|&t| vector_area(soup, t).length()).sum();
    area > 0.0 && is_closed(soup, part) && volume(soup, part).abs() <= NO_THICKNESS * area * soup.size()
}

/// Turns closed parts over whose volume is negative, unless they are cavities of another part; what lies in one that is turned and is no cavity of it then is
/// turned along. Returns how many were.
fn turn_inside_out(soup: &mut Triangles, parts: &[Vec<usize>]) -> usize {
    let closed: Vec<&Vec<usize>> = parts.iter().filter(|part| is_closed(soup, part)).collect();
    // The middle of a face: a corner may be one of another part, too.
    let place = |k: usize| corners(soup, closed[k][0]).into_iter().sum::<DVec3>() / 3.0;
    let around = |k: usize| -> Vec<usize> {
        (0..closed.len()).filter(|&other| other != k && winding(soup, closed[other], place(k)).abs() > 0.5).collect()
    };
    let around: Vec<Vec<usize>> = (0..closed.len()).map(around).collect();
    let negative: Vec<bool> = closed.iter().map(|part| volume(soup, part) < 0.0).collect();
    let outermost = |k: usize| negative[k] && around[k].is_empty();
    let wrong = |k: usize| outermost(k) || (!negative[k] && around[k].iter().any(|&other| outermost(other)));
    let wrong: Vec<usize> = (0..closed.len()).filter(|&k| wrong(k)).collect();
    for &k in &wrong {
        closed[k].iter().for_each(|&t| soup.triangles[t].swap(1, 2));
    }
    wrong.len()
}

fn corners(soup: &Triangles, t: usize) -> [DVec3; 3] {
    soup.triangles[t].map(|v| soup.vertices[v as usize])
}

fn vector_area(soup: &Triangles, t: usize) -> DVec3 {
    let [a, b, c] = corners(soup, t);
    0.5 * (b - a).cross(c - a)
}

/// Whether every edge of a part has another face of it behind.
fn is_closed(soup: &Triangles, part: &[usize]) -> bool {
    let all: FxHashSet<[u32; 2]> = part.iter().flat_map(|&t| edges(&soup.triangles[t])).collect();
    all.iter().all(|&[a, b]| all.contains(&[b, a]))
}

/// Signed volume of a closed part.
fn volume(soup: &Triangles, part: &[usize]) -> f64 {
    let origin = corners(soup, part[0])[0];
    part.iter()
        .map(|&t| {
            let [a, b, c] = corners(soup, t).map(|v| v - origin);
            a.dot(b.cross(c)) / 6.0
        })
        .sum()
}

/// How often a part winds around a point: solid angles over 4π (van Oosterom and Strackee 1983).
fn winding(soup: &Triangles, part: &[usize], from: DVec3) -> f64 {
    let solid_angle = |&t: &usize| {
        let [a, b, c] = corners(soup, t).map(|v| v - from);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    part.iter().map(solid_angle).sum::<f64>() / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of a side around a middle, its faces outward.
    fn cube(side: f64, middle: DVec3) -> Triangles {
        let vertices =
            (0..8).map(|k| middle + side * (DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) - 0.5)).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Triangles::white(vertices, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    fn together(a: &Triangles, b: &Triangles) -> Triangles {
        let shift = u32::try_from(a.vertices.len()).unwrap();
        let vertices = a.vertices.iter().chain(&b.vertices).copied().collect();
        Triangles::white(vertices, a.triangles.iter().copied().chain(b.triangles.iter().map(|t| t.map(|v| v + shift))).collect())
    }

    fn turned(mut soup: Triangles) -> Triangles {
        soup.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        soup
    }

    fn volume_of(soup: &Triangles) -> f64 {
        volume(soup, &(0..soup.triangles.len()).collect::<Vec<_>>())
    }

    #[test]
    fn what_is_right_stays_as_it_is() {
        for soup in [cube(2.0, DVec3::ONE), together(&cube(4.0, DVec3::ZERO), &turned(cube(1.0, DVec3::ZERO)))] {
            let mut repaired = soup.clone();
            assert!(repair(&mut repaired).unwrap().is_empty());
            assert_eq!(repaired, soup);
        }
    }

    #[test]
    fn a_body_that_is_inside_out_is_turned_and_a_cavity_is_not() {
        let mut inside_out = turned(cube(2.0, DVec3::new(5.0, -3.0, 1.0)));
        let notes = repair(&mut inside_out).unwrap();
        assert!(notes.len() == 1 && notes[0].contains("inner side outside"), "{notes:?}");
        assert!((volume_of(&inside_out) - 8.0).abs() < 1e-12);
        // One of two bodies beside each other.
        let mut two = together(&cube(2.0, DVec3::ZERO), &turned(cube(1.0, DVec3::splat(3.0))));
        assert_eq!(repair(&mut two).unwrap().len(), 1);
        assert!((volume_of(&two) - 9.0).abs() < 1e-12);
        // Of two of the same size, whose volumes cancel.
        let mut two = together(&cube(2.0, DVec3::ZERO), &turned(cube(2.0, DVec3::splat(5.0))));
        assert_eq!(repair(&mut two).unwrap().len(), 1);
        assert!((volume_of(&two) - 16.0).abs() < 1e-12);
        // A hollow body, all of it turned, or its outer side alone.
        let hollow = together(&cube(4.0, DVec3::ZERO), &turned(cube(1.0, DVec3::ZERO)));
        let outer = together(&turned(cube(4.0, DVec3::ZERO)), &turned(cube(1.0, DVec3::ZERO)));
        for mut soup in [turned(hollow), outer] {
            assert_eq!(repair(&mut soup).unwrap().len(), 1);
            assert!((volume_of(&soup) - 63.0).abs() < 1e-12, "{}", volume_of(&soup));
        }
    }

    #[test]
    fn a_sliver_that_welding_closed_parts_no_neighbours() {
        let mut soup = cube(2.0, DVec3::ZERO);
        let [a, b, _] = soup.triangles[0];
        soup.triangles.push([a, a, b]);
        soup.colours.push([0.5; 3]);
        for t in [0, 1] {
            soup.triangles[t].swap(1, 2);
        }
        let notes = repair(&mut soup).unwrap();
        assert!(notes.len() == 1 && notes[0].contains("turned 2 faces"), "{notes:?}");
    }

    #[test]
    fn faces_turned_against_most_of_their_neighbours_are_turned() {
        for count in [1, 2, 5] {
            let mut soup = cube(2.0, DVec3::ZERO);
            for t in (0..count).map(|k| 2 * k) {
                soup.triangles[t].swap(1, 2);
            }
            let notes = repair(&mut soup).unwrap();
            assert!(notes.len() == 1 && notes[0].contains(&format!("turned {count} faces")), "{notes:?}");
            assert!((volume_of(&soup) - 8.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_face_on_another_goes_whichever_way_it_is_turned() {
        let mut soup = cube(2.0, DVec3::ZERO);
        let [a, b, c] = soup.triangles[4];
        soup.triangles.extend([[b, c, a], [c, b, a]]);
        soup.colours.extend([[0.5; 3]; 2]);
        let notes = repair(&mut soup).unwrap();
        assert!(notes.len() == 1 && notes[0].contains("left out 2 faces"), "{notes:?}");
        assert_eq!(soup, cube(2.0, DVec3::ZERO));
    }

    #[test]
    fn a_sheet_with_a_front_and_a_back_is_refused_as_what_it_is() {
        // A tent of two slopes, its back cut along the other diagonals.
        let vertices = [[0., 0., 0.], [40., 0., 0.], [40., 20., 0.], [0., 20., 0.], [20., 0., 10.], [20., 20., 10.]];
        let front = [[0, 4, 5], [0, 5, 3], [4, 1, 2], [4, 2, 5]];
        let back = [[3, 5, 4], [3, 4, 0], [5, 2, 1], [5, 1, 4]];
        let mut sheet = Triangles::white(vertices.map(DVec3::from).to_vec(), front.into_iter().chain(back).collect());
        let error = repair(&mut sheet).unwrap_err().to_string();
        assert!(error.contains("no thickness") && error.contains("one side"), "{error}");
        assert!(repair(&mut Triangles::white(vertices.map(DVec3::from).to_vec(), front.to_vec())).unwrap().is_empty());
    }

    #[test]
    fn a_moebius_strip_is_refused_with_its_place() {
        let rim = |k: u32, side: f64| {
            let turn = f64::from(k) / 5.0 * 2.0 * PI;
            let r = 5.0 + side * (0.5 * turn).cos();
            DVec3::new(r * turn.cos(), r * turn.sin(), side * (0.5 * turn).sin())
        };
        let vertices = (0..5).flat_map(|k| [rim(k, -1.0), rim(k, 1.0)]).collect();
        let mut triangles: Vec<[u32; 3]> =
            (0..4).flat_map(|k| [[2 * k, 2 * k + 2, 2 * k + 1], [2 * k + 1, 2 * k + 2, 2 * k + 3]]).collect();
        // The last one joins each edge to the other side.
        triangles.extend([[8, 1, 9], [9, 1, 0]]);
        let error = repair(&mut Triangles::white(vertices, triangles)).unwrap_err().to_string();
        assert!(error.contains("one side only") && error.contains("mm"), "{error}");
    }
}
