//! The pages that tell how to put the pieces together: the folded surface from two sides, the pieces with their numbers, the order.

use super::assembly_view::{VIEWS, hue, picture};
use super::footer::text;
use super::page::{BLACK, Item, Layer, Mark, Page, Style, text_width};
use crate::mesh::{Mesh, Side};
use crate::paper::Paper;
use crate::polygon::bounds;
use crate::unfold::{Pattern, Piece};
use glam::DVec2;

/// Height of a page of a roll, mm: that of A4.
const ROLL_PAGE: f64 = 297.0;
/// Least width and height of the cell of a piece in the list, mm. Chosen, not measured: its text fits at a size that is read.
const CELL: DVec2 = DVec2::new(44.0, 32.0);
/// Share of the first page's height that the list has there. Chosen by eye.
const LIST_SHARE: f64 = 0.3;

/// Pieces in an order in which each can be glued to those before it, where there is a common edge.
pub fn order(mesh: &Mesh, pattern: &Pattern) -> Vec<usize> {
    let mut piece_of = vec![0; mesh.facets.len()];
    for (k, piece) in pattern.pieces.iter().enumerate() {
        for (f, _) in &piece.facets {
            piece_of[*f as usize] = k;
        }
    }
    let mut common = vec![std::collections::BTreeMap::<usize, f64>::new(); pattern.pieces.len()];
    for &(edge, _) in &pattern.glued {
        if let [Some(Side { facet: f, .. }), Some(Side { facet: g, .. })] = mesh.edges[edge as usize].sides {
            let (a, b) = (piece_of[f as usize], piece_of[g as usize]);
            if a != b {
                *common[a].entry(b).or_default() += mesh.length(edge as usize);
                *common[b].entry(a).or_default() += mesh.length(edge as usize);
            }
        }
    }
    let n = pattern.pieces.len();
    let mut done = vec![false; n];
    let mut out = Vec::with_capacity(n);
    let mut held = vec![0.0; n];
    for _ in 0..n {
        // The piece with most edge at what is there already; the largest one where nothing holds.
        let next = (0..n).filter(|&k| !done[k]).max_by(|&a, &b| f64::total_cmp(&held[a], &held[b]).then(b.cmp(&a))).expect("one is left");
        done[next] = true;
        out.push(next);
        for (&other, &length) in &common[next] {
            held[other] += length;
        }
    }
    out
}

/// What the first page says.
pub(super) const INSTRUCTIONS: [&str; 5] = [
    "1. Cut along the black lines. 2. Fold: dash-dot lines (mountain) away from you, dashed lines",
    "(valley) towards you, by the angle printed beside them; 0 is flat. 3. Glue each tab under the",
    "edge with the same number, in the order of the pieces below: \"3:17\" is edge 17, glued to piece 3;",
    "a number alone is glued within its piece. An underlined number stands upright over its line.",
    "The printed side is the outside.",
];

/// Draws the pages.
pub fn assembly_pages(mesh: &Mesh, pattern: &Pattern, paper: Paper, title: &str) -> Vec<Page> {
    let size = DVec2::new(paper.size.x, if paper.roll { ROLL_PAGE } else { paper.size.y });
    let m = paper.margin + 0.5;
    let width = size.x - 2.0 * m;
    let mut page = Page { size, items: Vec::new() };
    let heading = format!("{title}: how to put it together");
    text(&mut page, DVec2::new(m, size.y - m - 3.0), 5.0, width, heading, ("heading", String::new()));
    let mut y = size.y - m - 9.0;
    let type_size = INSTRUCTIONS.iter().map(|l| width / text_width(l, 1.0)).fold(3.0, f64::min);
    for (k, line) in INSTRUCTIONS.iter().enumerate() {
        text(&mut page, DVec2::new(m, y), type_size, width, (*line).to_owned(), ("instruction", k.to_string()));
        y -= 1.5 * type_size;
    }
    let bottom = m + LIST_SHARE * size.y;
    // Two pictures side by side, or one above the other, whichever leaves more room.
    let (low, high) = (DVec2::new(m, bottom + 2.0), DVec2::new(m + width, y));
    let room = high - low;
    let beside = room.x > room.y;
    for (k, view) in VIEWS.iter().enumerate() {
        let k = k as f64;
        let part = if beside { DVec2::new(0.5 * room.x, room.y) } else { DVec2::new(room.x, 0.5 * room.y) };
        let corner = if beside { low + DVec2::new(k * part.x, 0.0) } else { low + DVec2::new(0.0, (1.0 - k) * part.y) };
        picture(&mut page, mesh, pattern, view, [corner + 1.0, corner + part - 1.0]);
    }
    // Copies are put together like the first one.
    let order: Vec<usize> = order(mesh, pattern).into_iter().filter(|&k| pattern.pieces[k].copy == 1).collect();
    let mut done = list(&mut page, pattern, &order, 0, [DVec2::splat(m), DVec2::new(m + width, bottom)]);
    let mut pages = vec![page];
    while done < order.len() {
        let mut page = Page { size, items: Vec::new() };
        let heading = format!("{title}: the pieces, continued");
        text(&mut page, DVec2::new(m, size.y - m - 3.0), 4.0, width, heading, ("heading", String::new()));
        done = list(&mut page, pattern, &order, done, [DVec2::splat(m), DVec2::new(m + width, size.y - m - 7.0)]);
        pages.push(page);
    }
    pages
}

/// The pieces from the `first` of their order on, as many as there is room for, small, each with its place in the order and its name; the place
/// of the next one.
fn list(page: &mut Page, pattern: &Pattern, order: &[usize], first: usize, [low, high]: [DVec2; 2]) -> usize {
    let size = high - low;
    let most = (size / CELL).floor().max(DVec2::ONE);
    let (columns, rows) = (most.x as usize, most.y as usize);
    let shown = (order.len() - first).min(columns * rows);
    // Few pieces get larger cells.
    let rows = rows.min(shown.div_ceil(columns).max(1));
    let columns = columns.min(shown.div_ceil(rows).max(2));
    let cell = DVec2::new(size.x / columns as f64, size.y / rows as f64);
    for place in 0..shown {
        let corner = DVec2::new(low.x + (place % columns) as f64 * cell.x, high.y - (place / columns + 1) as f64 * cell.y);
        entry(page, &pattern.pieces[order[first + place]], first + place + 1, corner, cell);
    }
    first + shown
}

/// One piece of the list in its cell.
fn entry(page: &mut Page, piece: &Piece, place: usize, corner: DVec2, cell: DVec2) {
    let [l, h] = bounds(piece.outline.iter().flatten().copied());
    let room = DVec2::new(cell.x - 2.0, cell.y - 6.5).max(DVec2::splat(1.0));
    let scale = (room / (h - l).max(DVec2::splat(1e-9))).min_element();
    let shift = corner + DVec2::new(0.5 * cell.x, 0.5 * room.y + 1.0) - 0.5 * (l + h) * scale;
    let data = |what: &str| vec![("list", piece.name.to_string()), ("part", what.to_owned())];
    if let Some(outline) = piece.outline.first() {
        let points: Vec<DVec2> = outline.iter().map(|&p| shift + p * scale).collect();
        let mark = Mark::Polygon { points: points.clone(), fill: hue(piece.name - 1) };
        page.items.push(Item { layer: Layer::Print, mark, data: data("shape") });
        let mark = Mark::Line { points, closed: true, style: Style::Thin };
        page.items.push(Item { layer: Layer::Print, mark, data: data("outline") });
    }
    let times = if piece.copies > 1 { format!(" ({} times)", piece.copies) } else { String::new() };
    let words = format!("{place}. piece {}{times}: {} facets", piece.name, piece.facets.len());
    let size = 2.6_f64.min((cell.x - 1.5) / text_width(&words, 1.0));
    let at = corner + DVec2::new(0.5, cell.y - 2.5);
    let mark = Mark::Text { at, size, angle: 0.0, text: words, colour: BLACK, anchor: 0.0, underlined: false };
    page.items.push(Item { layer: Layer::Print, mark, data: data("words") });
}
