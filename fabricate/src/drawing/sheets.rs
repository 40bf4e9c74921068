//! The pages: pieces with colours, lines and numbers, and what every page says.

use super::back::mirrored;
use super::footer::{Footer, footer};
use super::labels::{Around, Labels, Role};
use super::look::Look;
use super::page::{Layer, Mark, Page, Style};
use super::piece::{PieceDrawing, bleed};
use super::piece_image::paint;
use super::registration::silhouette;
use crate::design::Texture;
use crate::layout::{PiecePlace, nest};
use crate::mesh::Mesh;
use crate::paper::{FOOTER, Paper};
use crate::polygon::{Convex, triangulate};
use crate::sheet_recipe::SheetRecipe;
use crate::unfold::{Pattern, Piece};
use biscale::error::Result;
use biscale::numerics::cast::index_u32;
use biscale::numerics::cast::{truncate_i32, truncate_u64};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The pieces of a pattern on pages.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheets {
    /// The pages.
    pub pages: Vec<Page>,
    /// Where each piece lies.
    pub places: Vec<PiecePlace>,
    /// What files say of them.
    pub recipe: SheetRecipe,
}

/// Lays out and draws a pattern; the pages of `assembly` follow. With a `texture` the facets get its colours in place of their own.
///
/// # Errors
/// A piece that fits no page; a page too small for anything; colours that cannot be written.
pub fn sheets(
    mesh: &Mesh,
    pattern: &Pattern,
    paper: Paper,
    look: &Look,
    texture: Option<&Texture<'_>>,
    assembly: Vec<Page>,
) -> Result<Sheets> {
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
    let piece_of = placed.iter().flat_map(|p| p.facets.iter().map(|(f, _)| (*f, [p.name, p.copy]))).collect();
    let drawing = PieceDrawing { mesh, pattern, look, rows: &rows, piece_of: &piece_of };
    let texture = texture.filter(|_| look.colours);
    for (piece, place) in placed.iter().zip(&places) {
        let image = texture.map(|texture| paint(mesh, piece, texture)).transpose()?;
        drawing.draw(&mut pages[place.page], piece, image);
    }
    let mut recipe = recipe_of(paper, look, texture.is_some(), pages.len(), pattern.flat_angle, &placed);
    let pieces: Vec<(usize, &Piece)> = places.iter().map(|p| p.page).zip(&placed).collect();
    label(&mut pages, &drawing, &pieces, paper, &mut recipe);
    let mut pages = with_backs(pages, look);
    let total = pages.len() + assembly.len();
    finish(&mut pages, paper, look, angles.as_deref(), total);
    recipe.assembly_pages = assembly.len();
    pages.extend(assembly);
    let places =
        places.into_iter().map(|p| PiecePlace { page: p.page * (1 + usize::from(look.back)), shift: p.shift + corner, ..p }).collect();
    Ok(Sheets { pages, places, recipe })
}

/// What files say of the sheets, as far as it is known before the texts have their places.
fn recipe_of(paper: Paper, look: &Look, textured: bool, pages: usize, flat_angle: f64, placed: &[Piece]) -> SheetRecipe {
    let tabs: std::collections::BTreeSet<u32> = placed.iter().flat_map(|p| p.tabs.iter().map(|t| t.edge)).collect();
    let glued: std::collections::BTreeSet<u32> = placed.iter().flat_map(|p| p.glue.iter().map(|g| g.edge)).collect();
    SheetRecipe {
        page_mm: [paper.size.x, if paper.roll { 0.0 } else { paper.size.y }],
        margin_mm: paper.margin,
        inset_mm: paper.inset,
        piece_pages: pages,
        back: look.back,
        clean_front: look.clean_front,
        colours: look.colours,
        textured,
        numbers: look.numbers,
        angles: look.angles,
        registration: look.silhouette,
        period_mm: look.period,
        flat_angle_deg: flat_angle.to_degrees(),
        without_tab: glued.difference(&tabs).copied().collect(),
        ..SheetRecipe::default()
    }
}

/// Puts the texts of all pieces onto the pages: first those inside the pieces, then the others around them.
fn label(pages: &mut [Page], drawing: &PieceDrawing<'_>, placed: &[(usize, &Piece)], paper: Paper, recipe: &mut SheetRecipe) {
    let inside: Vec<Labels> = placed.par_iter().enumerate().map(|(k, (_, piece))| drawing.labels(k, piece)).collect();
    let border = DVec2::splat(paper.margin + paper.inset);
    for (number, page) in pages.iter_mut().enumerate() {
        let here: Vec<(&Piece, &Labels)> =
            placed.iter().zip(&inside).filter(|((page, _), _)| *page == number).map(|((_, piece), labels)| (*piece, labels)).collect();
        let shapes = here.iter().flat_map(|(piece, _)| {
            let facets = piece.facets.iter().flat_map(|(_, p)| triangulate(p).into_iter().map(|t| Convex::new(&t.map(|c| p[c as usize]))));
            facets.chain(piece.tabs.iter().map(|t| Convex::new(&t.corners)))
        });
        let mut around = Around::new(shapes.collect(), [border + DVec2::new(0.0, FOOTER), page.size - border]);
        for (piece, labels) in here {
            let mut all = labels.placed.clone();
            for pending in &labels.pending {
                match (around.place(pending), pending.role) {
                    (Some(label), _) => all.push(label),
                    (None, Role::Number { edge, facet }) => recipe.without_number.push([edge, facet]),
                    (None, Role::Name) => recipe.without_name.push([index_u32(piece.name), index_u32(piece.copy)]),
                    (None, _) => {}
                }
            }
            let told: std::collections::BTreeSet<u32> =
                all.iter().filter_map(|l| if let Role::Angle { edge } = l.role { Some(edge) } else { None }).collect();
            if drawing.look.angles {
                let folds = piece.folds.iter().filter(|f| f.angle.abs() >= drawing.pattern.flat_angle).map(|f| f.edge);
                recipe.without_angle.extend(folds.filter(|e| !told.contains(e)));
            }
            drawing.draw_labels(page, piece, &all, recipe.textured);
        }
    }
    recipe.without_name.sort_unstable();
    recipe.without_number.sort_unstable();
    recipe.without_angle.sort_unstable();
}

/// The pages, each followed by its back if backs are wanted.
fn with_backs(pages: Vec<Page>, look: &Look) -> Vec<Page> {
    let mut out = Vec::with_capacity(2 * pages.len());
    for page in pages {
        let mirrored = look.back.then(|| mirrored(&page));
        out.push(if look.clean_front { without_folds(page) } else { page });
        out.extend(mirrored);
    }
    out
}

/// The page without its texts and fold lines: what they are stays in the attributes of lines that are not drawn.
fn without_folds(mut page: Page) -> Page {
    page.items.retain(|item| {
        let hint = item.data.iter().any(|(key, _)| matches!(*key, "leader" | "bed"));
        !hint && !matches!(item.mark, Mark::Text { .. } | Mark::Line { style: Style::Halo, .. })
    });
    for item in &mut page.items {
        if let (Layer::Score, Mark::Line { style, .. }) = (item.layer, &mut item.mark) {
            *style = Style::Hidden;
        }
    }
    page
}

/// Adds footers with the numbers of the pages, and registration marks.
fn finish(pages: &mut [Page], paper: Paper, look: &Look, angles: Option<&str>, total: usize) {
    let backs = angles.map(|angles| angles.replace("mountain", "VALLEY").replace("valley", "mountain").replace("VALLEY", "valley"));
    for (k, page) in pages.iter_mut().enumerate() {
        let back = look.back && k % 2 == 1;
        let side = match (look.back, back) {
            (false, _) => "",
            (true, false) => " (front)",
            (true, true) => " (back)",
        };
        let title = format!("{}  -  page {} of {total}{side}", look.title, k + 1);
        footer(page, paper, Footer { title: &title, angles: if back { backs.as_deref() } else { angles }, legend: true });
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
