//! A piece on its page: colours, lines, numbers.

use super::labels::{Label, Labels, NAME, NUMBER};
use super::look::Look;
use super::page::{BLACK, GREY, Item, Layer, Mark, Page, PieceImage, Style, srgb};
use crate::mesh::Mesh;
use crate::paper::BLEED;
use crate::polygon::{area, contains, distance_to_segment};
use crate::unfold::{Pattern, Piece};
use glam::DVec2;
use std::collections::BTreeMap;

/// Folds below this angle, radians, are not to be seen on paper.
pub const FLAT: f64 = 2e-3;

fn facet_fill(mesh: &Mesh, facet: u32, look: &Look) -> [u8; 3] {
    if look.colours { srgb(mesh.facets[facet as usize].colour) } else { [255; 3] }
}

/// Colour over the edges that are cut: scissors and printers are a little off.
pub(super) fn bleed(page: &mut Page, mesh: &Mesh, piece: &Piece) {
    for (f, polygon) in &piece.facets {
        let fill = srgb(mesh.facets[*f as usize].colour);
        let n = polygon.len();
        for k in 0..n {
            let (a, b) = (polygon[k], polygon[(k + 1) % n]);
            let edge = mesh.facets[*f as usize].edges[k];
            if piece.folds.iter().any(|fold| fold.edge == edge) {
                continue;
            }
            let along = (b - a).normalize_or_zero();
            let out = -along.perp() * BLEED;
            page.polygon(&[b + along * BLEED, a - along * BLEED, a - along * BLEED + out, b + along * BLEED + out], fill);
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "what a piece is and how it is drawn; one caller")]
pub(super) fn draw_piece(
    page: &mut Page,
    mesh: &Mesh,
    pattern: &Pattern,
    k: usize,
    piece: &Piece,
    look: &Look,
    rows: &BTreeMap<u32, String>,
    picture: Option<PieceImage>,
) -> usize {
    let mut of_piece = vec![("piece", piece.name.to_string())];
    if piece.copies > 1 {
        of_piece.push(("copy", piece.copy.to_string()));
    }
    let data = |more: &[(&'static str, String)]| [&of_piece[..], more].concat();
    for tab in &piece.tabs {
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon { points: tab.corners.clone(), fill: [255; 3] },
            data: data(&[("tab-of", tab.edge.to_string())]),
        });
        if look.colours {
            // Colour reaches onto the tab as far as over the outline, or as far as the tab does.
            let c = &tab.corners;
            let depth = distance_to_segment(c[2], c[0], c[1]);
            let t = (BLEED / depth.max(1e-9)).min(1.0);
            let strip = match c.len() {
                4 => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[3], t)],
                _ => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[2], t)],
            };
            page.polygon(&strip, srgb(mesh.facets[tab.facet as usize].colour));
        }
    }
    for (f, polygon) in &piece.facets {
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon { points: polygon.clone(), fill: facet_fill(mesh, *f, look) },
            data: data(&[("facet", f.to_string())]),
        });
    }
    // Black, red and blue do not show on dark colours: lines get a white bed there, cut lines one of dashes, which leaves little white.
    let textured = picture.is_some();
    if let Some(picture) = picture {
        page.items.push(Item { layer: Layer::Print, mark: Mark::Image(picture), data: data(&[]) });
    }
    if look.colours && (textured || piece.facets.iter().any(|(f, _)| is_dark(facet_fill(mesh, *f, look)))) {
        for fold in piece.folds.iter().filter(|f| f.angle.abs() >= FLAT) {
            page.line(Layer::Print, Style::Halo, &fold.ends, false);
        }
        for outline in &piece.outline {
            page.line(Layer::Print, Style::CutHalo, outline, true);
        }
    }
    for fold in &piece.folds {
        // Flat inside a piece is no line to fold: nothing is drawn, but a reader learns the angle.
        if fold.angle == 0.0 {
            continue;
        }
        let style = if fold.angle.abs() < FLAT {
            Style::Hidden
        } else if fold.angle < 0.0 {
            Style::Mountain
        } else {
            Style::Valley
        };
        page.items.push(Item {
            layer: Layer::Score,
            mark: Mark::Line { points: fold.ends.to_vec(), closed: false, style },
            data: data(&[("edge", fold.edge.to_string()), ("angle", format!("{:.9}", fold.angle.to_degrees()))]),
        });
    }
    for tab in &piece.tabs {
        // The tab goes under its neighbour: it folds as the surface does there, and then some.
        let angle = mesh.edges[tab.edge as usize].angle;
        page.items.push(Item {
            layer: Layer::Score,
            mark: Mark::Line {
                points: vec![tab.corners[0], tab.corners[1]],
                closed: false,
                style: if angle <= 0.0 { Style::Mountain } else { Style::Valley },
            },
            data: data(&[("tab", tab.edge.to_string()), ("angle", format!("{:.9}", angle.to_degrees()))]),
        });
    }
    for (j, outline) in piece.outline.iter().enumerate() {
        page.items.push(Item {
            layer: Layer::Cut,
            mark: Mark::Line { points: outline.clone(), closed: true, style: Style::Cut },
            data: data(&[("loop", j.to_string())]),
        });
    }
    let labels = labels(mesh, pattern, k, piece, look, rows);
    for label in &labels.placed {
        if textured {
            // A white bed here too: the colours under a text may be any.
            page.polygon(label.rectangle().points(), [255; 3]);
        }
        let of = label.number_of.map(|(edge, facet)| data(&[("number-of", edge.to_string()), ("on", facet.to_string())]));
        page.items.push(Item { layer: Layer::Print, mark: text(label, mesh, piece, look, textured), data: of.unwrap_or_default() });
    }
    labels.missed
}

/// Whether black is hard to see on a colour.
fn is_dark(colour: [u8; 3]) -> bool {
    colour.iter().map(|&v| u32::from(v)).sum::<u32>() < 300
}

fn text(label: &Label, mesh: &Mesh, piece: &Piece, look: &Look, textured: bool) -> Mark {
    // White on dark facets.
    let under = piece.facets.iter().find(|(_, p)| contains(p, label.at)).map(|(f, _)| facet_fill(mesh, *f, look));
    let dark = !textured && under.is_some_and(is_dark);
    let colour = if dark {
        [235; 3]
    } else if label.size > NUMBER[0] {
        BLACK
    } else {
        GREY
    };
    Mark::Text { at: label.at, size: label.size, angle: label.angle, text: label.text.clone(), colour, anchor: 0.5 }
}

/// The texts of one piece: its name, the numbers of its edges, the angles of its folds.
fn labels(mesh: &Mesh, pattern: &Pattern, k: usize, piece: &Piece, look: &Look, rows: &BTreeMap<u32, String>) -> Labels {
    let mut labels = Labels::default();
    let (alike, number) = (pattern.alike(k), piece.name.to_string());
    // Copies may take each other's place; pieces that are only cut and folded alike have numbers of their own.
    let name = if piece.copies > 1 {
        format!("{number} (x{})", piece.copies)
    } else if alike > 1 {
        format!("{number} (like {}, x{alike})", pattern.pieces[piece.like].name)
    } else {
        number.clone()
    };
    let mut largest: Vec<&(u32, Vec<DVec2>)> = piece.facets.iter().collect();
    largest.sort_by(|a, b| area(&b.1).total_cmp(&area(&a.1)));
    // In full where it fits, else the number alone.
    let _ = largest.iter().take(8).any(|(_, p)| labels.within(p, &name, NAME))
        || largest.iter().take(8).any(|(_, p)| labels.within(p, &number, NAME));
    for (f, polygon) in &piece.facets {
        if let Some(row) = rows.get(f).filter(|_| piece.copies == 1) {
            // A number that finds no place is told by its neighbours.
            labels.within(polygon, row, [2.6, 1.0]);
        }
    }
    let facet = |f: u32| piece.facets.iter().find(|(g, _)| *g == f).map(|(_, p)| p.as_slice()).unwrap_or_default();
    if look.numbers {
        for tab in &piece.tabs {
            let number = piece.glue.iter().find(|g| g.edge == tab.edge && g.facet == tab.facet).map_or(0, |g| g.number);
            labels.number([tab.corners[0], tab.corners[1]], &tab.corners, number, (tab.edge, tab.facet));
        }
        for glue in piece.glue.iter().filter(|g| !g.tab) {
            labels.number(glue.ends, facet(glue.facet), glue.number, (glue.edge, glue.facet));
        }
    }
    if look.angles {
        for fold in piece.folds.iter().filter(|f| f.angle.abs() >= FLAT) {
            let text = format!("{:.0}°", fold.angle.abs().to_degrees());
            let (f, _) = mesh.edges[fold.edge as usize].sides[0].expect("a fold has two facets");
            let before = labels.missed;
            labels.along(fold.ends, facet(f), &text, [1.6, 0.9]);
            // An angle that finds no place is told by the model's shape; a number that finds none is missed.
            labels.missed = before;
        }
    }
    labels
}
