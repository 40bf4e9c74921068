//! The pages that tell how to put the pieces together: the pictures show the design in the colours of the list, each piece is listed once, with its
//! shape, and held by those before it.

use super::drawn::{DrawnPage, Shape};
use super::findings::Findings;
use super::page::{DRAWN, Kind, Page};
use super::read_pattern::{ReadPattern, bounds, signed_area};
use super::sides::Sides;
use crate::mesh::Mesh;
use crate::polygon::{contains, distance_to_segment};
use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// How much of the area of a facet in a picture may be missing or too much, of it and of its extent: rounding to single precision is less.
const AREA: f64 = 2e-4;
/// How bright facets are in a picture, of the colour of their piece in the list.
const SHADE: [f64; 2] = [0.42, 1.0];

/// The sides that a surface is shown from.
const VIEWS: [&str; 2] = ["from the front and above", "from behind and below"];

/// What the first page says, in words.
const INSTRUCTIONS: [&str; 5] = [
    "1. Cut along the black lines. 2. Fold: dash-dot lines (mountain) away from you, dashed lines",
    "(valley) towards you, by the angle printed beside them; 0 is flat. 3. Glue each tab under the",
    "edge with the same number, in the order of the pieces below: \"3:17\" is edge 17, glued to piece 3;",
    "a number alone is glued within its piece. An underlined number stands upright over its line.",
    "The printed side is the outside.",
];

/// A listed piece: its place in the order, what it says of it, its colour and shape, its page.
#[derive(Clone, Debug, Default)]
pub(super) struct Listed {
    words: String,
    colour: [u8; 3],
    shape: Vec<DVec2>,
}

/// The pieces that the list shows.
pub(super) fn listed(pages: &[DrawnPage]) -> BTreeMap<u32, Listed> {
    let mut out: BTreeMap<u32, Listed> = BTreeMap::new();
    for mark in pages.iter().flat_map(|p| &p.marks) {
        let Some(Ok(name)) = mark.get("list").map(str::parse) else { continue };
        let entry = out.entry(name).or_default();
        match &mark.shape {
            Shape::Text { words, .. } => entry.words.clone_from(words),
            Shape::Fill { polygon, colour, .. } => (entry.colour, entry.shape) = (*colour, polygon.clone()),
            _ => {}
        }
    }
    out
}

/// Compares one of the pages.
pub(super) fn check(page: &mut Page<'_>, seen: &ReadPattern, design: &Mesh, sides: &Sides, first: bool) {
    if let Some(mark) = page.one("heading", "the heading") {
        page.text(mark, "the heading");
    }
    if first {
        for (k, line) in INSTRUCTIONS.iter().enumerate() {
            let what = format!("line {} of the instructions", k + 1);
            let Some(mark) = page.one(&format!("instruction {k}"), &what) else { continue };
            if page.text(mark, &what).is_some_and(|(words, ..)| words != *line) {
                page.wrong("says something else", what);
            }
        }
        let list = listed(&seen.drawn);
        let cameras = page.all("view");
        for view in VIEWS {
            let camera = cameras.iter().find(|c| c.get("view") == Some(view));
            let numbers: Vec<f64> =
                camera.and_then(|c| c.get("camera")).unwrap_or_default().split(' ').filter_map(|v| v.parse().ok()).collect();
            let (Some(camera), [azimuth, elevation, scale, x, y]) = (camera, &numbers[..]) else {
                page.wrong("not drawn", format!("the surface seen {view}"));
                continue;
            };
            if page.text(camera, view).is_some_and(|(words, ..)| words != view) {
                page.wrong("says something else", view);
            }
            let ((sin_a, cos_a), (sin_e, cos_e)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
            let right = DVec3::new(-sin_a, cos_a, 0.0);
            let up = DVec3::new(cos_e * cos_a, cos_e * sin_a, sin_e).cross(right);
            let project = |v: DVec3| DVec2::new(*x, *y) + *scale * DVec2::new(v.dot(right), v.dot(up));
            picture(page, view, seen, design, &list, &project);
            numbers_at(page, view, seen, design, sides, &project);
        }
    }
    let names: BTreeSet<u32> = seen.facets.iter().map(|f| f.piece[0]).collect();
    for name in names {
        for part in ["words", "shape", "outline"] {
            for mark in page.all(&format!("list {name} {part}")) {
                page.in_layer(mark, "print", "the list");
                match (part, &mark.shape) {
                    ("words", _) => {
                        page.text(mark, "the list");
                    }
                    ("shape", Shape::Fill { .. }) => {}
                    ("outline", Shape::Line { look, .. }) if Kind::Thin.fits(look) => {}
                    _ => page.wrong("drawn as something else", format!("piece {name} in the list")),
                }
            }
        }
    }
}

/// Every facet is drawn where the camera sees it, whole, in the colour that its piece has in the list.
fn picture(
    page: &mut Page<'_>,
    view: &str,
    seen: &ReadPattern,
    design: &Mesh,
    list: &BTreeMap<u32, Listed>,
    project: &dyn Fn(DVec3) -> DVec2,
) {
    for facet in &seen.facets {
        let f = facet.facet as usize;
        let what = format!("facet {f} {view}");
        let outline: Vec<DVec2> = (0..design.facets[f].corners.len()).map(|c| project(design.corner(f, c))).collect();
        let n = outline.len();
        let whole = signed_area(&outline).abs();
        let near =
            |p: &DVec2| contains(&outline, *p) || (0..n).any(|k| distance_to_segment(*p, outline[k], outline[(k + 1) % n]) < 2.0 * DRAWN);
        let mut area = 0.0;
        for mark in page.all(&format!("of-facet {view} {f}")) {
            let Shape::Fill { polygon, colour, line } = &mark.shape else {
                page.wrong("drawn as no polygon", &what);
                continue;
            };
            area += signed_area(polygon).abs();
            let own = list.get(&facet.piece[0]).map_or([0; 3], |l| l.colour);
            if !shaded(*colour, own) || line.as_ref().is_some_and(|l| l.colour != *colour) {
                page.wrong("drawn in another colour", format!("{what}, of piece {}: {colour:?} is no shade of {own:?}", facet.piece[0]));
            }
            if !polygon.iter().all(near) {
                page.wrong("drawn elsewhere", &what);
            }
        }
        // Facets that are seen edge on have hardly an area.
        let [low, high] = bounds(&outline);
        if (area - whole).abs() > AREA * (whole + (high - low).element_sum()) {
            page.wrong("not drawn whole", format!("{what}: {area:.3} of {whole:.3} mm2"));
        }
        for mark in page.all(&format!("border-of {view} {f}")) {
            let thin = matches!(&mark.shape, Shape::Line { look, .. } if Kind::Thin.fits(look));
            if !thin || !mark.points().iter().all(near) {
                page.wrong("drawn elsewhere", format!("the border of {what}"));
            }
        }
    }
}

/// Whether a colour is a shade of another one: the same share of each channel.
fn shaded(colour: [u8; 3], of: [u8; 3]) -> bool {
    let share = |s: f64| colour.iter().zip(of).all(|(&c, o)| (f64::from(c) - s * f64::from(o)).abs() <= 1.6);
    let k = (0..3).max_by_key(|&k| of[k]).unwrap_or(0);
    let guess = (f64::from(colour[k]) + 0.5) / f64::from(of[k]).max(1.0);
    (SHADE[0]..=SHADE[1] + 0.02).contains(&guess) && (share(guess) || share(guess.min(1.0)))
}

/// The numbers in a picture stand on their pieces.
fn numbers_at(page: &mut Page<'_>, view: &str, seen: &ReadPattern, design: &Mesh, sides: &Sides, project: &dyn Fn(DVec3) -> DVec2) {
    let mut of_piece: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    seen.facets.iter().for_each(|f| of_piece.entry(f.piece[0]).or_default().push(f.facet));
    let mut told = 0;
    for (name, facets) in of_piece {
        let what = format!("the number of piece {name} {view}");
        page.all(&format!("piece-at {view} {name} bed"));
        let marks = page.all(&format!("piece-at {view} {name}"));
        told += marks.len();
        let copies = facets.iter().filter_map(|f| sides.place.get(f)).map(|&k| seen.facets[k].piece[1]).collect::<BTreeSet<_>>().len();
        if marks.len() > copies {
            page.wrong("drawn twice", &what);
        }
        for mark in marks {
            let Some((words, at, _)) = page.text(mark, &what) else { continue };
            let on = facets.iter().any(|&f| {
                let outline: Vec<DVec2> =
                    (0..design.facets[f as usize].corners.len()).map(|c| project(design.corner(f as usize, c))).collect();
                let n = outline.len();
                contains(&outline, at) || (0..n).any(|k| distance_to_segment(at, outline[k], outline[(k + 1) % n]) < 0.5)
            });
            if words != name.to_string() || !on {
                page.wrong("says something else", format!("{what}: \"{words}\""));
            }
        }
    }
    if told == 0 {
        page.wrong("not drawn", format!("the numbers of the pieces {view}"));
    }
}

/// Every piece is listed once, in its shape, and holds on to one before it where any does.
pub(super) fn order(findings: &mut Findings, seen: &ReadPattern, design: &Mesh, sides: &Sides, list: &BTreeMap<u32, Listed>) {
    let mut facets: BTreeMap<u32, usize> = BTreeMap::new();
    let mut copies: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for f in &seen.facets {
        *facets.entry(f.piece[0]).or_default() += usize::from(f.piece[1] == 1);
        copies.entry(f.piece[0]).or_default().insert(f.piece[1]);
    }
    let mut places: BTreeMap<usize, u32> = BTreeMap::new();
    for (&name, &count) in &facets {
        let Some(entry) = list.get(&name).filter(|e| !e.words.is_empty() && !e.shape.is_empty()) else {
            findings.add("assembly", format!("piece {name} is not listed"));
            continue;
        };
        let times = copies[&name].len();
        let times = if times > 1 { format!(" ({times} times)") } else { String::new() };
        let place = entry.words.split_once(". ").filter(|(_, rest)| *rest == format!("piece {name}{times}: {count} facets"));
        match place.and_then(|(place, _)| place.parse::<usize>().ok()) {
            Some(place) if places.insert(place, name).is_none() => {}
            _ => findings.add("assembly", format!("piece {name} is listed as \"{}\"", entry.words)),
        }
        let own: Vec<&Vec<DVec2>> = seen.cut_of.iter().filter(|c| c.0 == [name, 1]).map(|c| &c.1).collect();
        let largest = own.into_iter().max_by(|a, b| signed_area(a).abs().total_cmp(&signed_area(b).abs()));
        if largest.is_some_and(|outline| !similar(outline, &entry.shape)) {
            findings.add("assembly", format!("the shape of piece {name} in the list is another one"));
        }
    }
    if places.keys().copied().ne(1..=facets.len()) {
        findings.add("assembly", "the order does not count 1, 2, 3 and so on");
    }
    let mut neighbours: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for (_, edge) in design.edges.iter().enumerate().filter(|(e, _)| !sides.joined[*e]) {
        let [Some(f), Some(g)] = edge.sides else { continue };
        let (Some(&i), Some(&j)) = (sides.place.get(&f.facet), sides.place.get(&g.facet)) else { continue };
        let (p, q) = (seen.facets[i].piece[0], seen.facets[j].piece[0]);
        neighbours.entry(p).or_default().insert(q);
        neighbours.entry(q).or_default().insert(p);
    }
    let mut there: BTreeSet<u32> = BTreeSet::new();
    for name in places.values() {
        let held = |p: &u32| neighbours.get(p).is_some_and(|n| n.iter().any(|q| there.contains(q)));
        let waiting = facets.keys().any(|p| !there.contains(p) && held(p));
        if waiting && !held(name) {
            findings.add("assembly", format!("piece {name} comes before any piece that it is glued to"));
        }
        there.insert(*name);
    }
}

/// Whether two polygons are one shape, turned, shifted and scaled.
fn similar(a: &[DVec2], b: &[DVec2]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    // The complex number that takes one to the other in the sense of least squares.
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<DVec2>() / n, b.iter().sum::<DVec2>() / n);
    let sum: DVec2 = a.iter().zip(b).map(|(p, q)| (*q - mb).rotate(DVec2::new((*p - ma).x, -(*p - ma).y))).sum();
    let scale = sum / a.iter().map(|p| p.distance_squared(ma)).sum::<f64>().max(1e-12);
    let [low, high] = bounds(b);
    let most = 1e-3 * (high - low).max_element() + 2.0 * DRAWN;
    a.iter().zip(b).all(|(p, q)| (mb + (*p - ma).rotate(scale)).distance(*q) < most)
}
