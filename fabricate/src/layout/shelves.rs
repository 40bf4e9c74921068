//! Strips onto pages: each along a side of the page, on shelves from the largest to the smallest.

use super::place::{GAP, PiecePlace};
use crate::polygon::bounds;
use biscale::error::BadInput;
use biscale::numerics::convex_hull::convex_hull;
use glam::DVec2;

/// A rotation of a piece and its size then.
#[derive(Clone, Copy, Debug)]
struct Turn {
    x: DVec2,
    low: DVec2,
    size: DVec2,
}

/// The rotations worth trying: those with a side of the hull along an axis, lying and standing.
fn turns(hull: &[DVec2]) -> Vec<Turn> {
    let n = hull.len();
    let mut out = Vec::new();
    for k in 0..n {
        let along = (hull[(k + 1) % n] - hull[k]).normalize_or(DVec2::X);
        // The side becomes horizontal, or vertical.
        for x in [DVec2::new(along.x, -along.y), DVec2::new(along.y, along.x)] {
            let turned = hull.iter().map(|p| p.x * x + p.y * x.perp());
            let [low, high] = bounds(turned);
            out.push(Turn { x, low, size: high - low });
        }
    }
    out
}

/// Lays pieces, given by the points of their outlines, on pages of `area`. `roll` makes one page as long as needed.
///
/// # Errors
/// A piece that fits in no rotation.
pub fn shelves(outlines: &[Vec<DVec2>], area: DVec2, roll: bool) -> Result<(Vec<PiecePlace>, usize), BadInput> {
    let mut chosen: Vec<(usize, Turn)> = Vec::new();
    for (k, outline) in outlines.iter().enumerate() {
        let all = turns(&convex_hull(outline.clone()));
        let fits = |t: &&Turn| t.size.x <= area.x + 1e-9 && (roll || t.size.y <= area.y + 1e-9);
        // Least area first; among equals the lower one, which fills shelves better.
        let best = all.iter().filter(fits).min_by(|a, b| {
            let cost = |t: &Turn| (t.size.x + GAP) * (t.size.y + GAP) * (1.0 + 0.05 * f64::from(u8::from(t.size.y > t.size.x)));
            cost(a).total_cmp(&cost(b))
        });
        let Some(&best) = best else {
            let least = all.iter().min_by(|a, b| a.size.max_element().total_cmp(&b.size.max_element()));
            let size = least.map_or(DVec2::ZERO, |t| t.size);
            let problem = format!("piece {} is {:.1} x {:.1} mm and a page holds {:.1} x {:.1} mm", k + 1, size.x, size.y, area.x, area.y);
            return Err(BadInput::new(problem, "take a larger `page`, a smaller `scale`, or set `split`").at_field("page"));
        };
        chosen.push((k, best));
    }
    chosen.sort_by(|(j, a), (k, b)| b.size.y.total_cmp(&a.size.y).then(j.cmp(k)));
    let mut places = vec![PiecePlace { page: 0, x: DVec2::X, shift: DVec2::ZERO }; outlines.len()];
    // Shelves of all pages: page, bottom, height, used length.
    let mut shelves: Vec<(usize, f64, f64, f64)> = Vec::new();
    let mut tops: Vec<f64> = Vec::new();
    for (k, turn) in chosen {
        let found = shelves.iter().position(|&(_, _, height, used)| turn.size.y <= height + 1e-9 && used + turn.size.x <= area.x + 1e-9);
        let shelf = found.unwrap_or_else(|| {
            let page = (0..tops.len()).find(|&p| roll || tops[p] + turn.size.y <= area.y + 1e-9).unwrap_or_else(|| {
                tops.push(0.0);
                tops.len() - 1
            });
            shelves.push((page, tops[page], turn.size.y, 0.0));
            tops[page] += turn.size.y + GAP;
            shelves.len() - 1
        });
        let (page, bottom, height, used) = shelves[shelf];
        // Shelves fill the page from its top.
        let corner = DVec2::new(used, if roll { bottom } else { area.y - bottom - height + (height - turn.size.y) });
        places[k] = PiecePlace { page, x: turn.x, shift: corner - turn.low };
        shelves[shelf].3 = used + turn.size.x + GAP;
    }
    Ok((places, tops.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(w: f64, h: f64) -> Vec<DVec2> {
        vec![DVec2::ZERO, DVec2::new(w, 0.0), DVec2::new(w, h), DVec2::new(0.0, h)]
    }

    #[test]
    fn pieces_lie_apart_and_inside_turned_if_need_be() {
        let area = DVec2::new(100.0, 60.0);
        let outlines: Vec<Vec<DVec2>> = (1..30).map(|k| rectangle(5.0 + f64::from(k), 95.0 - 3.0 * f64::from(k))).collect();
        let (places, pages) = shelves(&outlines, area, false).unwrap();
        let boxes: Vec<(usize, DVec2, DVec2)> = outlines
            .iter()
            .zip(&places)
            .map(|(o, p)| {
                let moved = o.iter().map(|q| q.x * p.x + q.y * p.x.perp() + p.shift);
                let [l, h] = bounds(moved);
                (p.page, l, h)
            })
            .collect();
        for (k, (page, l, h)) in boxes.iter().enumerate() {
            assert!(*page < pages && l.min_element() > -1e-9 && h.x < 100.0 + 1e-9 && h.y < 60.0 + 1e-9, "piece {k}: {l} to {h}");
            for (other, m, n) in &boxes[k + 1..] {
                let gap = (*m - *h).max(*l - *n).max_element();
                assert!(other != page || gap >= GAP - 1e-9, "piece {k}: {gap}");
            }
        }
        let message = shelves(&[rectangle(120.0, 70.0)], area, false).unwrap_err().to_string();
        assert!(message.contains("120.0 x 70.0") || message.contains("70.0 x 120.0"), "{message}");
    }
}
