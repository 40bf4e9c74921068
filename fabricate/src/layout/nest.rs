//! Pieces laid into each other's gaps, page after page.
//!
//! First fit: from the largest piece to the smallest, each goes to the first page where some rotation of it has place, there as low as
//! possible, then as far left (bottom-left placement on a raster: Bennell & Oliveira 2008, "The geometry of nesting problems", section 3.1).

use super::grid::{Bits, CELL, Shape};
use super::place::{GAP, PiecePlace};
use super::turns::{Turn, best_fit, turns};
use crate::polygon::area as polygon_area;
use biscale::error::BadInput;
use biscale::numerics::convex_hull::convex_hull;
use biscale::numerics::random::Random;
use glam::DVec2;
use rayon::prelude::*;

/// A page in the making.
#[derive(Clone, Debug)]
struct Filling {
    taken: Bits,
    /// Cells that are taken.
    cells: usize,
    /// Cells of the smallest piece that had no place.
    refused: usize,
}

/// What is filled: the area of each page.
#[derive(Clone, Copy, Debug)]
struct Area {
    size: DVec2,
    roll: bool,
    /// Cells around it, so that shapes may reach over its border.
    border: usize,
}

/// A piece that is tried on a page again is smaller than the one that had no place there by this factor: the others would mostly be tried in
/// vain. Chosen, not measured.
const SMALLER: f64 = 0.9;

/// Lays pieces, given by their closed outlines, on pages of `area`. `roll` makes one page as long as needed.
///
/// # Errors
/// A piece that fits in no rotation.
pub fn nest(outlines: &[Vec<DVec2>], area: DVec2, roll: bool) -> Result<(Vec<PiecePlace>, usize), BadInput> {
    let mut pieces: Vec<Vec<(Turn, Shape)>> = Vec::new();
    for (k, outline) in outlines.iter().enumerate() {
        let hull = convex_hull(outline.clone());
        let all = turns(&hull, area, roll);
        if all.is_empty() {
            let size = best_fit(&hull, area).size;
            let problem = format!("piece {} is {:.1} x {:.1} mm and a page holds {:.1} x {:.1} mm", k + 1, size.x, size.y, area.x, area.y);
            return Err(BadInput::new(problem, "take a larger `page`, a smaller `scale`, or set `split`").at_field("page"));
        }
        pieces.push(all.into_par_iter().map(|t| (t, Shape::new(outline, t.x, t.low, t.size, GAP))).collect());
    }
    let surface: Vec<f64> = outlines.iter().map(|o| polygon_area(o)).collect();
    let box_area: Vec<f64> = pieces.iter().map(|p| p.iter().map(|(t, _)| t.size.x * t.size.y).fold(f64::INFINITY, f64::min)).collect();
    let border = pieces.first().and_then(|p| p.first()).map_or(0, |(_, shape)| shape.border);
    let area = Area { size: area, roll, border };
    // Many orders, and the best result.
    let results: Vec<_> = (0..ORDERS).into_par_iter().map(|k| fill(&pieces, &order(&surface, &box_area, k), area)).collect();
    let (places, pages, _) = results.into_iter().min_by_key(|(_, pages, last)| (*pages, *last)).expect("several orders");
    Ok((places, pages))
}

/// Orders of the pieces that are tried. Chosen, not measured: time against paper.
const ORDERS: u64 = 16;
/// By how much, at most, the areas are changed at random for all orders but the first two. Chosen, not measured.
const DISORDER: f64 = 0.4;

/// The order in which the pieces are laid: by their areas, by those of their boxes, or by these changed at random.
fn order(surface: &[f64], boxes: &[f64], number: u64) -> Vec<usize> {
    let mut random = Random::new(number);
    let disorder = if number < 2 { 0.0 } else { DISORDER };
    let areas = if number.is_multiple_of(2) { surface } else { boxes };
    let keys: Vec<f64> = areas.iter().map(|a| a * (1.0 + disorder * random.unit())).collect();
    let mut order: Vec<usize> = (0..keys.len()).collect();
    order.sort_by(|&j, &k| keys[k].total_cmp(&keys[j]).then(j.cmp(&k)));
    order
}

/// Places, pages, and rows taken on the last page.
fn fill(pieces: &[Vec<(Turn, Shape)>], order: &[usize], area: Area) -> (Vec<PiecePlace>, usize, usize) {
    let mut places = vec![PiecePlace { page: 0, x: DVec2::X, shift: DVec2::ZERO }; pieces.len()];
    let mut pages: Vec<Filling> = Vec::new();
    for &k in order {
        let shapes = &pieces[k];
        let cells = shapes.iter().map(|(_, s)| s.cells).min().unwrap_or(0);
        let found = (0..pages.len()).find_map(|page| {
            let filling = &pages[page];
            let room = area.roll || filling.cells + cells <= area.cells();
            let place = if room && cells as f64 <= SMALLER * filling.refused as f64 { area.place(&filling.taken, shapes) } else { None };
            place.map(|place| (page, place))
        });
        let (page, (turn, at)) = found.unwrap_or_else(|| {
            for page in &mut pages {
                page.refused = page.refused.min(cells);
            }
            let words = (area.columns() + 2 * area.border).div_ceil(64);
            pages.push(Filling { taken: Bits { words, rows: Vec::new() }, cells: 0, refused: usize::MAX });
            let empty = &pages[pages.len() - 1].taken;
            (pages.len() - 1, area.place(empty, shapes).expect("each of its turns fits an empty page"))
        });
        let (turn, shape) = &shapes[turn];
        shape.take(&mut pages[page].taken, at);
        pages[page].cells += shape.cells;
        let corner = DVec2::new(at[0] as f64, at[1] as f64) * CELL;
        places[k] = area.turned_over(PiecePlace { page, x: turn.x, shift: corner - turn.low });
    }
    let last = pages.last().map_or(0, |p| p.taken.rows.len() / p.taken.words);
    (places, pages.len(), last)
}

impl Area {
    fn columns(&self) -> usize {
        (self.size.x / CELL).ceil() as usize
    }

    /// Cells of a page with what reaches over its border.
    fn cells(&self) -> usize {
        (self.columns() + 2 * self.border) * ((self.size.y / CELL).ceil() as usize + 2 * self.border)
    }

    /// Which turn of a piece lies lowest on a page, and where.
    fn place(&self, taken: &Bits, shapes: &[(Turn, Shape)]) -> Option<(usize, [usize; 2])> {
        let rows = taken.rows.len() / taken.words;
        let at = |(k, (turn, shape)): (usize, &(Turn, Shape))| {
            let free = (self.size - turn.size).max(DVec2::ZERO) / CELL + DVec2::splat(1e-9);
            let most = [free.x as usize, if self.roll { rows } else { (free.y as usize).min(rows) }];
            let [x, y] = shape.place(taken, most)?;
            // The height of its top decides, then the area of its box.
            Some(((y as f64 * CELL + turn.size.y, turn.size.x * turn.size.y), k, [x, y]))
        };
        let all: Vec<_> = shapes.iter().enumerate().filter_map(at).collect();
        let best = all.into_iter().min_by(|a, b| a.0.0.total_cmp(&b.0.0).then(a.0.1.total_cmp(&b.0.1)).then(a.1.cmp(&b.1)));
        best.map(|(_, k, place)| (k, place))
    }

    /// Pages are filled from the top: the whole page turned by half a turn.
    fn turned_over(&self, place: PiecePlace) -> PiecePlace {
        if self.roll { place } else { PiecePlace { x: -place.x, shift: self.size - place.shift, ..place } }
    }
}

#[cfg(test)]
mod tests {
    use super::super::turns::turned;
    use super::*;
    use crate::polygon::bounds;
    use i_overlay::core::fill_rule::FillRule;
    use i_overlay::core::overlay_rule::OverlayRule;
    use i_overlay::float::single::SingleFloatOverlay;

    fn rectangle(w: f64, h: f64) -> Vec<DVec2> {
        vec![DVec2::ZERO, DVec2::new(w, 0.0), DVec2::new(w, h), DVec2::new(0.0, h)]
    }

    fn moved(outline: &[DVec2], place: &PiecePlace) -> Vec<DVec2> {
        outline.iter().map(|q| turned(*q, place.x) + place.shift).collect()
    }

    /// Least distance between the outlines of two polygons that do not overlap.
    fn distance(a: &[DVec2], b: &[DVec2]) -> f64 {
        let from = |a: &[DVec2], b: &[DVec2]| {
            let pairs = a.iter().flat_map(|p| (0..b.len()).map(move |k| (*p, b[k], b[(k + 1) % b.len()])));
            pairs.map(|(p, c, d)| crate::polygon::distance_to_segment(p, c, d)).fold(f64::INFINITY, f64::min)
        };
        from(a, b).min(from(b, a))
    }

    /// A star of some points, or an L, of random sizes.
    fn shapes(count: usize) -> Vec<Vec<DVec2>> {
        let mut random = Random::new(3);
        (0..count)
            .map(|k| {
                let size = 10.0 + 50.0 * random.unit();
                if k.is_multiple_of(2) {
                    let n = 5 + k % 4;
                    let radius = |j: usize| if j.is_multiple_of(2) { size } else { 0.3 * size };
                    (0..2 * n).map(|j| radius(j) * DVec2::from_angle(std::f64::consts::PI * j as f64 / n as f64)).collect()
                } else {
                    let w = 0.2 * size;
                    [(0., 0.), (size, 0.), (size, w), (w, w), (w, size), (0., size)].map(|(x, y)| DVec2::new(x, y)).to_vec()
                }
            })
            .collect()
    }

    #[test]
    fn pieces_lie_apart_and_inside() {
        let area = DVec2::new(187.0, 258.3);
        for roll in [false, true] {
            let outlines = shapes(60);
            let (places, pages) = nest(&outlines, area, roll).unwrap();
            let laid: Vec<Vec<DVec2>> = outlines.iter().zip(&places).map(|(o, p)| moved(o, p)).collect();
            for (k, one) in laid.iter().enumerate() {
                let [low, high] = bounds(one.iter().copied());
                assert!(places[k].page < pages && low.min_element() > -1e-9 && high.x < area.x + 1e-9, "{low} {high}");
                assert!(roll || high.y < area.y + 1e-9, "{high}");
                for j in k + 1..laid.len() {
                    if places[j].page == places[k].page {
                        let points = |o: &[DVec2]| vec![o.iter().map(|p| [p.x, p.y]).collect::<Vec<[f64; 2]>>()];
                        let common = points(one).overlay(&points(&laid[j]), OverlayRule::Intersect, FillRule::NonZero);
                        assert!(common.is_empty(), "{k} and {j} overlap");
                        let gap = distance(one, &laid[j]);
                        assert!(gap >= GAP - 1e-9, "{k} and {j}: {gap} mm");
                    }
                }
            }
        }
    }

    #[test]
    fn shapes_fill_each_others_gaps() {
        // Two L of 100 x 100 and 30 wide in 140 x 140: only hooked into each other, as their boxes take 200.
        let l = [(0., 0.), (100., 0.), (100., 30.), (30., 30.), (30., 100.), (0., 100.)].map(|(x, y)| DVec2::new(x, y)).to_vec();
        let (_, pages) = nest(&[l.clone(), l], DVec2::new(140.0, 140.0), false).unwrap();
        assert_eq!(pages, 1);
    }

    #[test]
    fn what_fits_just_so_fits_and_what_does_not_is_told() {
        let area = DVec2::new(100.3, 60.7);
        assert!(nest(&[rectangle(100.3, 60.7), rectangle(60.7, 100.3)], area, false).is_ok());
        let message = nest(&[rectangle(120.0, 70.0)], area, false).unwrap_err().to_string();
        assert!(message.contains("120.0 x 70.0"), "{message}");
    }
}
