//! Lines to cut: just the border of each piece with its tabs, each part once.

use super::drawn::Shape;
use super::page::{DRAWN, Kind, Page};
use super::read_pattern::ReadPattern;
use super::sides::Sides;
use crate::mesh::Mesh;
use glam::DVec2;
use rustc_hash::FxHashMap;

/// The border of a piece: sides of facets that are cut, round the tabs that stand there.
fn border(seen: &ReadPattern, design: &Mesh, sides: &Sides, piece: [u32; 2]) -> Vec<[DVec2; 2]> {
    let mut out = Vec::new();
    for facet in seen.facets.iter().filter(|f| f.piece == piece) {
        let n = facet.polygon.len();
        for (k, &edge) in design.facets[facet.facet as usize].edges.iter().enumerate() {
            if sides.joined[edge as usize] {
                continue;
            }
            let (a, b) = (facet.polygon[k], facet.polygon[(k + 1) % n]);
            match seen.tabs.iter().find(|t| t.edge == edge && t.facet == facet.facet) {
                Some(tab) if tab.polygon.len() >= 3 => {
                    let round = [&[a], &tab.polygon[2..], &[b]].concat();
                    out.extend(round.windows(2).map(|w| [w[0], w[1]]));
                }
                _ => out.push([a, b]),
            }
        }
    }
    out
}

/// Compares the cut lines of a piece.
pub(super) fn check(page: &mut Page<'_>, seen: &ReadPattern, design: &Mesh, sides: &Sides, piece: [u32; 2]) {
    let what = format!("the cut line of piece {}", piece[0]);
    let marks = page.all(&format!("cut {} {}", piece[0], piece[1]));
    let mut drawn: FxHashMap<[i64; 2], Vec<[DVec2; 2]>> = FxHashMap::default();
    let cell = |p: DVec2| (p / 0.05).round().to_array().map(|x| x as i64);
    let layer = page.layer("cut");
    let mut count = 0;
    for mark in marks {
        page.in_layer(mark, layer, &what);
        let Shape::Line { paths, look } = &mark.shape else {
            page.wrong("drawn as no line", &what);
            continue;
        };
        if !Kind::Cut.fits(look) {
            page.wrong("drawn as another kind of line", &what);
        }
        for (points, closed) in paths {
            let n = points.len();
            for k in 0..if *closed { n } else { n.saturating_sub(1) } {
                let ends = [points[k], points[(k + 1) % n]];
                drawn.entry(cell(0.5 * (ends[0] + ends[1]))).or_default().push(ends);
                count += 1;
            }
        }
    }
    let mut found = 0;
    for [a, b] in border(seen, design, sides, piece) {
        let [a, b] = [page.at(a), page.at(b)];
        let [x, y] = cell(0.5 * (a + b));
        let mut around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
        let same =
            |[c, d]: &[DVec2; 2]| (a.distance(*c) < DRAWN && b.distance(*d) < DRAWN) || (a.distance(*d) < DRAWN && b.distance(*c) < DRAWN);
        let taken = around.any(|c| {
            let list = drawn.get_mut(&c);
            list.is_some_and(|list| list.iter().position(same).map(|k| list.swap_remove(k)).is_some())
        });
        found += usize::from(taken);
        if !taken {
            page.wrong("not cut", format!("the border of piece {} from {:.2}, {:.2} to {:.2}, {:.2} mm", piece[0], a.x, a.y, b.x, b.y));
        }
    }
    if count > found {
        page.wrong("cut where nothing ends", format!("piece {}, {} lines", piece[0], count - found));
    }
}
