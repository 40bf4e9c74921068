//! Strips of a weave: are they those of the draft, as long as the threads, apart from each other?

use super::read_pattern::ReadPattern;
use biscale::error::BadInput;
use biscale::geometry::weave::Weave;
use glam::DVec2;
use std::collections::BTreeMap;

/// Corners of a strip, and its crossings: where they are along it, and whether it lies over.
type KnownStrip<'s> = (&'s [DVec2], Vec<(f64, bool)>);

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
    let mut known: BTreeMap<&str, KnownStrip<'_>> = BTreeMap::new();
    for (name, polygon) in &seen.strips {
        if known.insert(name, (polygon, Vec::new())).is_some() {
            wrong.push(format!("{name} stands twice"));
        }
    }
    for (of, over, polygon) in &seen.crossings {
        let Some((strip, list)) = known.get_mut(of.as_str()) else {
            wrong.push(format!("a crossing is of {of}, which is no strip"));
            continue;
        };
        let (origin, along) = (strip[0], (strip[1] - strip[0]).normalize_or_zero());
        let middle = polygon.iter().map(|&p| along.dot(p - origin)).sum::<f64>() / polygon.len() as f64;
        list.push((middle, *over));
    }
    let mut expected = 0;
    for (warp, own, crossed, repeats, along, period) in [
        (true, &weave.warp, &weave.weft, periods[0], periods[1], weave.period.y),
        (false, &weave.weft, &weave.warp, periods[1], periods[0], weave.period.x),
    ] {
        for index in 0..own.len() * repeats as usize {
            expected += 1;
            let name = format!("{}-{}", if warp { "warp" } else { "weft" }, index + 1);
            let Some((strip, list)) = known.get(name.as_str()) else {
                wrong.push(format!("{name} is missing"));
                continue;
            };
            let i = index % own.len();
            let n = crossed.len() * along as usize;
            let order: Vec<bool> = (0..n)
                .map(|k| {
                    let k = k % crossed.len();
                    if warp { weave.draft.over(i, k) } else { !weave.draft.over(k, i) }
                })
                .collect();
            if list.iter().map(|c| c.1).collect::<Vec<_>>() != order {
                wrong.push(format!("{name} does not go over and under as the draft says"));
                continue;
            }
            let width = strip[1].distance(strip[2]);
            if (width - own[i].width * scale).abs() > 1e-6 * width {
                wrong.push(format!("{name} is {width} mm wide and its thread {}", own[i].width * scale));
            }
            let place = |k: usize| (crossed[k % crossed.len()].centre + period * (k / crossed.len()) as f64) * scale;
            for k in 1..n {
                let (here, straight) = (list[k].0 - list[k - 1].0, place(k) - place(k - 1));
                let most = if order[k] == order[k - 1] { straight } else { straight + 2.0 * weave.crimp * scale };
                if here < straight - 1e-5 || here > most + 1e-5 {
                    wrong.push(format!("{name}: crossings {k} and {} are {here} mm apart and the threads {straight}", k + 1));
                }
            }
        }
    }
    if expected != known.len() {
        wrong.push(format!("{} strips in place of {expected}", known.len()));
    }
    for (page, [low, high]) in seen.pages.iter().zip(&seen.extents) {
        let over = (DVec2::splat(margin) - *low).max(*high - (*page - margin)).max_element();
        if over > 1e-6 {
            wrong.push(format!("something reaches {over:.3} mm into the margin"));
        }
    }
    for (k, (page, a)) in seen.outlines.iter().enumerate() {
        let bounds = |p: &[DVec2]| p.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let (l, h) = bounds(a);
        let meets = |b: &[DVec2]| {
            let (m, n) = bounds(b);
            l.x < n.x && m.x < h.x && l.y < n.y && m.y < h.y
        };
        // Strips lie along the axes of the page: their boxes are their outlines.
        if seen.outlines[k + 1..].iter().any(|(p, b)| p == page && meets(b)) {
            wrong.push(format!("strip {} overlaps another one", k + 1));
        }
    }
    Ok(wrong)
}
