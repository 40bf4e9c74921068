//! Strips of a weave: are they those of the draft, as long as the threads, apart from each other?

use super::read_pattern::{ReadPattern, bounds};
use super::report::MARGIN;
use super::strips_drawn;
use biscale::error::BadInput;
use biscale::geometry::weave::{Thread, Weave};
use glam::DVec2;
use std::collections::BTreeMap;

/// A strip in a file: its corners, and its crossings in their order.
struct KnownStrip<'s> {
    corners: &'s [DVec2],
    /// For each crossing where it is along the strip, mm, and whether the strip lies over.
    crossings: Vec<(f64, bool)>,
}

/// The threads of one direction, as the strips of a pattern repeat them.
struct Direction<'w> {
    warp: bool,
    own: &'w [Thread],
    crossed: &'w [Thread],
    /// Periods across and along the threads.
    repeats: usize,
    along: usize,
    /// Length of a period along the threads, in the weave's unit.
    period: f64,
}

/// Widths of strips must agree to this share, and crossings to this many mm: far above the 8 decimals of the files, far below what is cut.
const WIDTH: f64 = 1e-6;
const PLACE: f64 = 1e-5;

/// What is wrong with the strips in a file, in words; nothing if all is well. `scale` is printed mm for one unit of the weave.
///
/// Orders of over and under are compared with the draft; the distance of neighbouring crossings with an upper and a lower bound that
/// any path between them keeps: straight, and straight up or down at a corner.
///
/// # Errors
/// A file without strips.
pub fn verify_strips(seen: &ReadPattern, weave: &Weave, scale: f64, periods: [u32; 2], margin: f64) -> Result<Vec<String>, BadInput> {
    if seen.strips.is_empty() {
        return Err(BadInput::new("there is no strip in the file", "name an SVG that `biscale fold` wrote of a weave"));
    }
    let mut wrong = Vec::new();
    let known = known_strips(seen, &mut wrong);
    let [nx, ny] = periods.map(|n| n as usize);
    let directions = [
        Direction { warp: true, own: &weave.warp, crossed: &weave.weft, repeats: nx, along: ny, period: weave.period.y },
        Direction { warp: false, own: &weave.weft, crossed: &weave.warp, repeats: ny, along: nx, period: weave.period.x },
    ];
    for direction in &directions {
        for index in 0..direction.own.len() * direction.repeats {
            let name = format!("{}-{}", if direction.warp { "warp" } else { "weft" }, index + 1);
            match known.get(name.as_str()) {
                Some(strip) => wrong.extend(direction.compare(&name, index, strip, weave, scale)),
                None => wrong.push(format!("{name} is missing")),
            }
        }
    }
    let expected: usize = directions.iter().map(|d| d.own.len() * d.repeats).sum();
    if expected != known.len() {
        wrong.push(format!("{} strips in place of {expected}", known.len()));
    }
    wrong.extend(misplaced(seen, margin));
    wrong.extend(strips_drawn::check(seen));
    Ok(wrong)
}

/// The strips of a file by name, with their crossings.
fn known_strips<'s>(seen: &'s ReadPattern, wrong: &mut Vec<String>) -> BTreeMap<&'s str, KnownStrip<'s>> {
    let mut known: BTreeMap<&str, KnownStrip<'_>> = BTreeMap::new();
    for (name, corners) in &seen.strips {
        if known.insert(name, KnownStrip { corners, crossings: Vec::new() }).is_some() {
            wrong.push(format!("{name} stands twice"));
        }
    }
    for (of, over, polygon) in &seen.crossings {
        let Some(strip) = known.get_mut(of.as_str()) else {
            wrong.push(format!("a crossing is of {of}, which is no strip"));
            continue;
        };
        let (origin, along) = (strip.corners[0], (strip.corners[1] - strip.corners[0]).normalize_or_zero());
        let middle = polygon.iter().map(|&p| along.dot(p - origin)).sum::<f64>() / polygon.len() as f64;
        strip.crossings.push((middle, *over));
    }
    known
}

impl Direction<'_> {
    /// What differs between a strip and its thread.
    fn compare(&self, name: &str, index: usize, strip: &KnownStrip<'_>, weave: &Weave, scale: f64) -> Vec<String> {
        let mut wrong = Vec::new();
        let crossed = self.crossed;
        let i = index % self.own.len();
        let n = crossed.len() * self.along;
        let order: Vec<bool> = (0..n)
            .map(|k| {
                let k = k % crossed.len();
                if self.warp { weave.draft.over(i, k) } else { !weave.draft.over(k, i) }
            })
            .collect();
        if strip.crossings.iter().map(|c| c.1).collect::<Vec<_>>() != order {
            return vec![format!("{name} does not go over and under as the draft says")];
        }
        let width = strip.corners[1].distance(strip.corners[2]);
        if (width - self.own[i].width * scale).abs() > WIDTH * width {
            wrong.push(format!("{name} is {width} mm wide and its thread {}", self.own[i].width * scale));
        }
        let place = |k: usize| (crossed[k % crossed.len()].centre + self.period * (k / crossed.len()) as f64) * scale;
        for k in 1..n {
            let (here, straight) = (strip.crossings[k].0 - strip.crossings[k - 1].0, place(k) - place(k - 1));
            let most = if order[k] == order[k - 1] { straight } else { straight + 2.0 * weave.crimp * scale };
            if here < straight - PLACE || here > most + PLACE {
                wrong.push(format!("{name}: crossings {k} and {} are {here} mm apart and the threads {straight}", k + 1));
            }
        }
        wrong
    }
}

/// What reaches into the margin, and strips that overlap.
fn misplaced(seen: &ReadPattern, margin: f64) -> Vec<String> {
    let mut wrong = Vec::new();
    let over = seen.margin_violation(margin);
    wrong.extend(over.into_iter().filter(|over| *over > MARGIN).map(|over| format!("something reaches {over:.3} mm into the margin")));
    for (k, (page, a)) in seen.outlines.iter().enumerate() {
        let [l, h] = bounds(a);
        let meets = |b: &[DVec2]| {
            let [m, n] = bounds(b);
            l.x < n.x && m.x < h.x && l.y < n.y && m.y < h.y
        };
        // Strips lie along the axes of the page: their boxes are their outlines.
        if seen.outlines[k + 1..].iter().any(|(p, b)| p == page && meets(b)) {
            wrong.push(format!("strip {} overlaps another one", k + 1));
        }
    }
    wrong
}
