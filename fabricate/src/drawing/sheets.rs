//! The pages: pieces with colours, lines and numbers, and what every page says.

use super::back::mirrored;
use super::footer::footer;
use super::look::Look;
use super::page::Page;
use super::piece::{PieceDrawing, bleed};
use super::piece_image::paint;
use super::registration::silhouette;
use crate::design::Texture;
use crate::layout::{PiecePlace, nest};
use crate::mesh::Mesh;
use crate::paper::Paper;
use crate::unfold::{Pattern, Piece};
use biscale::error::Result;
use biscale::numerics::cast::{truncate_i32, truncate_u64};
use glam::DVec2;
use std::collections::BTreeMap;

/// The pieces of a pattern on pages.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheets {
    /// The pages.
    pub pages: Vec<Page>,
    /// Where each piece lies.
    pub places: Vec<PiecePlace>,
    /// Numbers that found no place beside their edge.
    pub missed: usize,
}

/// Lays out and draws a pattern. With a `texture` the facets get its colours in place of their own.
///
/// # Errors
/// A piece that fits no page; a page too small for anything; colours that cannot be written.
pub fn sheets(mesh: &Mesh, pattern: &Pattern, paper: Paper, look: &Look, texture: Option<&Texture<'_>>) -> Result<Sheets> {
    paper.check()?;
    let outlines: Vec<Vec<DVec2>> = pattern.pieces.iter().map(|p| p.outline[0].clone()).collect();
    let [corner, area] = paper.area();
    let (places, count) = nest(&outlines, area, paper.roll)?;
    let mut pages = vec![Page { size: paper.size, items: Vec::new() }; count];
    let mut placed: Vec<Piece> = Vec::new();
    for (piece, place) in pattern.pieces.iter().zip(&places) {
        placed.push(piece.moved(place.x, place.shift + corner));
    }
    if paper.roll {
        let top = placed.iter().flat_map(|p| p.outline.iter().flatten()).map(|p| p.y).fold(0.0, f64::max);
        pages[0].size.y = (top + paper.margin + paper.inset).ceil();
    }
    // Colours of all pieces lie below all lines.
    if look.colours {
        for (piece, place) in placed.iter().zip(&places) {
            bleed(&mut pages[place.page], mesh, piece);
        }
    }
    let kinds = fold_kinds(&placed, pattern.flat_angle);
    let look = &Look {
        angles: look.angles && (kinds.len() > FEW_KINDS || placed.iter().map(|p| p.folds.len()).sum::<usize>() <= FEW_FOLDS),
        ..look.clone()
    };
    let angles = (!look.angles && kinds.len() <= FEW_KINDS && !kinds.is_empty()).then(|| angles_text(&kinds));
    let rows = if look.numbers { rows(mesh, look.period) } else { BTreeMap::new() };
    let drawing = PieceDrawing { mesh, pattern, look, rows: &rows };
    let mut missed = 0;
    for (k, (piece, place)) in placed.iter().zip(&places).enumerate() {
        let image = match texture.filter(|_| look.colours) {
            Some(texture) => Some(paint(mesh, piece, texture)?),
            None => None,
        };
        missed += drawing.draw(&mut pages[place.page], k, piece, image);
    }
    let mut pages = with_backs(pages, look.back);
    finish(&mut pages, paper, look, angles.as_deref());
    let places =
        places.into_iter().map(|p| PiecePlace { page: p.page * (1 + usize::from(look.back)), shift: p.shift + corner, ..p }).collect();
    Ok(Sheets { pages, places, missed })
}

/// The pages, each followed by its back if backs are wanted.
fn with_backs(pages: Vec<Page>, back: bool) -> Vec<Page> {
    let mut out = Vec::with_capacity(2 * pages.len());
    for page in pages {
        let mirrored = back.then(|| mirrored(&page));
        out.push(page);
        out.extend(mirrored);
    }
    out
}

/// Adds footers with the numbers of the pages, and registration marks.
fn finish(pages: &mut [Page], paper: Paper, look: &Look, angles: Option<&str>) {
    // The page that tells how to put the pieces together follows.
    let total = pages.len() + 1;
    for (k, page) in pages.iter_mut().enumerate() {
        let back = look.back && k % 2 == 1;
        let side = match (look.back, back) {
            (false, _) => "",
            (true, false) => " (front)",
            (true, true) => " (back)",
        };
        footer(page, paper, angles, &format!("{}  -  page {} of {total}{side}", look.title, k + 1), !back);
        if look.silhouette && !back {
            silhouette(page, paper);
        }
    }
}

/// For each period along x the facet that begins it, at the lowest y, with the text `#1` and so on.
fn rows(mesh: &Mesh, period: f64) -> BTreeMap<u32, String> {
    let low = mesh.vertices.iter().map(|v| v.x).fold(f64::INFINITY, f64::min);
    let size = mesh.vertices.iter().map(|v| v.x - low).fold(0.0, f64::max);
    if !(period > 0.0 && size > 1.5 * period) {
        return BTreeMap::new();
    }
    let mut first: BTreeMap<u64, (f64, f64, u32)> = BTreeMap::new();
    for (k, facet) in (0_u32..).zip(&mesh.facets) {
        let middle = facet.corners.iter().map(|&c| mesh.vertices[c as usize]).sum::<glam::DVec3>() / facet.corners.len() as f64;
        let row = truncate_u64(((middle.x - low) / period).floor());
        let place = (middle.y, middle.x, k);
        let best = first.entry(row).or_insert(place);
        if (place.0, place.1) < (best.0, best.1) {
            *best = place;
        }
    }
    first.into_iter().map(|(row, (_, _, k))| (k, format!("#{}", row + 1))).collect()
}

/// So many different angles are told once, in the footer, where there are more than so many folds. Chosen, not measured.
const FEW_KINDS: usize = 4;

const FEW_FOLDS: usize = 40;

/// The fold angles in whole degrees, mountains negative, each once.
fn fold_kinds(pieces: &[Piece], flat_angle: f64) -> std::collections::BTreeSet<i32> {
    let whole = |angle: f64| truncate_i32(angle.to_degrees().round());
    pieces.iter().flat_map(|p| &p.folds).filter(|f| f.angle.abs() >= flat_angle).map(|f| whole(f.angle)).collect()
}

/// `mountain 45°, valley 63°`.
fn angles_text(kinds: &std::collections::BTreeSet<i32>) -> String {
    let list: Vec<String> = kinds.iter().map(|&a| format!("{} {}°", if a < 0 { "mountain" } else { "valley" }, a.abs())).collect();
    format!("fold angles: {}", list.join(", "))
}
