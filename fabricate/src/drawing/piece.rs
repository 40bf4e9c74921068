//! A piece on its page: colours, lines, numbers.

use super::labels::{Label, Labels, NAME, NUMBER};
use super::look::Look;
use super::page::{BLACK, GREY, Item, Layer, Mark, Page, PieceImage, Style, WHITE, srgb};
use crate::mesh::Mesh;
use crate::paper::BLEED;
use crate::polygon::{area, contains, distance_to_segment};
use crate::unfold::{Pattern, Piece};
use glam::DVec2;
use std::collections::BTreeMap;

/// Largest and least size of the number of a period, mm. Chosen, not measured.
const PERIOD: [f64; 2] = [2.6, 1.0];
/// Largest and least size of a fold angle, mm. Chosen, not measured: below the numbers, which matter more.
const ANGLE: [f64; 2] = [1.6, 0.9];
/// Facets of a piece, the largest first, on which a name is tried. Chosen, not measured.
const NAMED_FACETS: usize = 8;
/// sRGB values of a colour add up to less than this where black lines are hard to see on it. Chosen by eye, not measured.
const DARK: u32 = 300;
/// Near white, for texts on dark facets.
const PALE: [u8; 3] = [235; 3];

fn facet_fill(mesh: &Mesh, facet: u32, look: &Look) -> [u8; 3] {
    if look.colours { srgb(mesh.facets[facet as usize].colour) } else { WHITE }
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

/// What the pieces of a pattern are drawn from.
pub(super) struct PieceDrawing<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) pattern: &'a Pattern,
    pub(super) look: &'a Look,
    /// Facets that begin a period, with its number as a text.
    pub(super) rows: &'a BTreeMap<u32, String>,
}

/// Attributes of the marks of one piece.
struct PieceData(Vec<(&'static str, String)>);

impl PieceData {
    fn new(piece: &Piece) -> Self {
        let mut out = vec![("piece", piece.name.to_string())];
        if piece.copies > 1 {
            out.push(("copy", piece.copy.to_string()));
        }
        Self(out)
    }

    fn with(&self, more: &[(&'static str, String)]) -> Vec<(&'static str, String)> {
        [&self.0[..], more].concat()
    }
}

impl PieceDrawing<'_> {
    /// Draws a piece where it lies on its page, the `k`th of the pattern; returns how many numbers found no place.
    pub(super) fn draw(&self, page: &mut Page, k: usize, piece: &Piece, image: Option<PieceImage>) -> usize {
        let data = PieceData::new(piece);
        let textured = image.is_some();
        self.draw_tabs(page, piece, &data);
        self.draw_facets(page, piece, &data);
        if let Some(image) = image {
            page.items.push(Item { layer: Layer::Print, mark: Mark::Image(image), data: data.with(&[]) });
        }
        if self.look.colours && (textured || piece.facets.iter().any(|(f, _)| is_dark(facet_fill(self.mesh, *f, self.look)))) {
            draw_halos(page, piece, self.pattern.flat_angle);
        }
        draw_folds(page, piece, self.pattern.flat_angle, &data);
        self.draw_tab_folds(page, piece, &data);
        for (j, outline) in piece.outline.iter().enumerate() {
            page.items.push(Item {
                layer: Layer::Cut,
                mark: Mark::Line { points: outline.clone(), closed: true, style: Style::Cut },
                data: data.with(&[("loop", j.to_string())]),
            });
        }
        self.draw_labels(page, k, piece, &data, textured)
    }

    /// White tabs; colour reaches onto them as far as over the outline, or as far as the tab does.
    fn draw_tabs(&self, page: &mut Page, piece: &Piece, data: &PieceData) {
        for tab in &piece.tabs {
            page.items.push(Item {
                layer: Layer::Print,
                mark: Mark::Polygon { points: tab.corners.clone(), fill: WHITE },
                data: data.with(&[("tab-of", tab.edge.to_string())]),
            });
            if self.look.colours {
                let c = &tab.corners;
                let depth = distance_to_segment(c[2], c[0], c[1]);
                let t = (BLEED / depth.max(1e-9)).min(1.0);
                let strip = match c.len() {
                    4 => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[3], t)],
                    _ => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[2], t)],
                };
                page.polygon(&strip, srgb(self.mesh.facets[tab.facet as usize].colour));
            }
        }
    }

    fn draw_facets(&self, page: &mut Page, piece: &Piece, data: &PieceData) {
        for (f, polygon) in &piece.facets {
            page.items.push(Item {
                layer: Layer::Print,
                mark: Mark::Polygon { points: polygon.clone(), fill: facet_fill(self.mesh, *f, self.look) },
                data: data.with(&[("facet", f.to_string())]),
            });
        }
    }

    /// The lines at which tabs are folded: a tab goes under its neighbour, so it folds as the surface does there, and then some.
    fn draw_tab_folds(&self, page: &mut Page, piece: &Piece, data: &PieceData) {
        for tab in &piece.tabs {
            let angle = self.mesh.edges[tab.edge as usize].angle;
            page.items.push(Item {
                layer: Layer::Score,
                mark: Mark::Line {
                    points: vec![tab.corners[0], tab.corners[1]],
                    closed: false,
                    style: if angle <= 0.0 { Style::Mountain } else { Style::Valley },
                },
                data: data.with(&[("tab", tab.edge.to_string()), angle_data(angle)]),
            });
        }
    }

    /// Name and numbers; returns how many found no place.
    fn draw_labels(&self, page: &mut Page, k: usize, piece: &Piece, data: &PieceData, textured: bool) -> usize {
        let labels = self.labels(k, piece);
        for label in &labels.placed {
            if textured {
                // A white bed here too: the colours under a text may be any.
                page.polygon(label.rectangle().points(), WHITE);
            }
            let of = label.number_of.map(|(edge, facet)| data.with(&[("number-of", edge.to_string()), ("on", facet.to_string())]));
            let mark = text(label, self.mesh, piece, self.look, textured);
            page.items.push(Item { layer: Layer::Print, mark, data: of.unwrap_or_default() });
        }
        labels.missed
    }

    /// The texts of one piece: its name, the numbers of its edges, the angles of its folds.
    fn labels(&self, k: usize, piece: &Piece) -> Labels {
        let mut labels = Labels::default();
        self.name(&mut labels, k, piece);
        for (f, polygon) in &piece.facets {
            if let Some(row) = self.rows.get(f).filter(|_| piece.copies == 1) {
                // A number that finds no place is told by its neighbours.
                labels.within(polygon, row, PERIOD);
            }
        }
        let facet = |f: u32| piece.facets.iter().find(|(g, _)| *g == f).map(|(_, p)| p.as_slice()).unwrap_or_default();
        if self.look.numbers {
            for tab in &piece.tabs {
                let number = piece.glue.iter().find(|g| g.edge == tab.edge && g.facet == tab.facet).map_or(0, |g| g.number);
                labels.number([tab.corners[0], tab.corners[1]], &tab.corners, number, (tab.edge, tab.facet));
            }
            for glue in piece.glue.iter().filter(|g| !g.tab) {
                labels.number(glue.ends, facet(glue.facet), glue.number, (glue.edge, glue.facet));
            }
        }
        if self.look.angles {
            for fold in piece.folds.iter().filter(|f| f.angle.abs() >= self.pattern.flat_angle) {
                let text = format!("{:.0}°", fold.angle.abs().to_degrees());
                let f = self.mesh.edges[fold.edge as usize].sides[0].expect("a fold has two facets").facet;
                let before = labels.missed;
                labels.along(fold.ends, facet(f), &text, ANGLE);
                // An angle that finds no place is told by the model's shape; a number that finds none is missed.
                labels.missed = before;
            }
        }
        labels
    }

    /// Names the piece on one of its largest facets: in full where it fits, else by the number alone.
    fn name(&self, labels: &mut Labels, k: usize, piece: &Piece) {
        let (alike, number) = (self.pattern.alike(k), piece.name.to_string());
        // Copies may take each other's place; pieces that are only cut and folded alike have numbers of their own.
        let name = if piece.copies > 1 {
            format!("{number} (x{})", piece.copies)
        } else if alike > 1 {
            format!("{number} (like {}, x{alike})", self.pattern.pieces[piece.like].name)
        } else {
            number.clone()
        };
        let mut largest: Vec<&(u32, Vec<DVec2>)> = piece.facets.iter().collect();
        largest.sort_by(|a, b| area(&b.1).total_cmp(&area(&a.1)));
        let mut write = |text: &str| largest.iter().take(NAMED_FACETS).any(|(_, p)| labels.within(p, text, NAME));
        if !write(&name) {
            write(&number);
        }
    }
}

/// The angle of a fold as an attribute, degrees.
fn angle_data(angle: f64) -> (&'static str, String) {
    ("angle", format!("{:.9}", angle.to_degrees()))
}

/// White beds under the lines: black, red and blue do not show on dark colours. Cut lines get one of dashes, which leaves little white.
fn draw_halos(page: &mut Page, piece: &Piece, flat_angle: f64) {
    for fold in piece.folds.iter().filter(|f| f.angle.abs() >= flat_angle) {
        page.line(Layer::Print, Style::Halo, &fold.ends, false);
    }
    for outline in &piece.outline {
        page.line(Layer::Print, Style::CutHalo, outline, true);
    }
}

fn draw_folds(page: &mut Page, piece: &Piece, flat_angle: f64, data: &PieceData) {
    // Flat inside a piece is no line to fold: nothing is drawn, but a reader learns the angle.
    for fold in piece.folds.iter().filter(|f| f.angle != 0.0) {
        let style = if fold.angle.abs() < flat_angle {
            Style::Hidden
        } else if fold.angle < 0.0 {
            Style::Mountain
        } else {
            Style::Valley
        };
        page.items.push(Item {
            layer: Layer::Score,
            mark: Mark::Line { points: fold.ends.to_vec(), closed: false, style },
            data: data.with(&[("edge", fold.edge.to_string()), angle_data(fold.angle)]),
        });
    }
}

/// Whether black is hard to see on a colour.
fn is_dark(colour: [u8; 3]) -> bool {
    colour.iter().map(|&v| u32::from(v)).sum::<u32>() < DARK
}

fn text(label: &Label, mesh: &Mesh, piece: &Piece, look: &Look, textured: bool) -> Mark {
    // White on dark facets.
    let under = piece.facets.iter().find(|(_, p)| contains(p, label.at)).map(|(f, _)| facet_fill(mesh, *f, look));
    let dark = !textured && under.is_some_and(is_dark);
    let colour = if dark {
        PALE
    } else if label.size > NUMBER[0] {
        BLACK
    } else {
        GREY
    };
    Mark::Text { at: label.at, size: label.size, angle: label.angle, text: label.text.clone(), colour, anchor: 0.5 }
}
