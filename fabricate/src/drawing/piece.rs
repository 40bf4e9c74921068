//! A piece on its page: colours, lines, numbers.

use super::labels::{LEAST_TYPE, Label, Labels, NAME, NUMBER, Pending, Role, turns_into_another};
use super::look::Look;
use super::page::{BLACK, Item, Layer, Mark, Page, PieceImage, Style, WHITE, srgb};
use crate::mesh::Mesh;
use crate::paper::BLEED;
use crate::polygon::{area, contains, distance_to_segment};
use crate::unfold::{Glue, Pattern, Piece};
use glam::DVec2;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Largest and least size of the number of a period, mm. Chosen, not measured.
const PERIOD: [f64; 2] = [2.6, LEAST_TYPE];
/// Largest and least size of a fold angle, mm. Chosen, not measured: below the numbers, which matter more.
const ANGLE: [f64; 2] = [2.0, LEAST_TYPE];
/// Least size of a name in full, mm: a shorter one in larger type is found sooner. Chosen, not measured.
const NAME_IN_FULL: f64 = 2.6;
/// Facets of a piece, the largest first, on which a name is tried. Chosen, not measured.
const NAMED_FACETS: usize = 8;
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
            let points = vec![b + along * BLEED, a - along * BLEED, a - along * BLEED + out, b + along * BLEED + out];
            let data = vec![("bleed", edge.to_string()), ("on", f.to_string())];
            page.items.push(Item { layer: Layer::Print, mark: Mark::Polygon { points, fill }, data });
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
    /// Name and copy of the piece of each facet.
    pub(super) piece_of: &'a FxHashMap<u32, [usize; 2]>,
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
    /// Draws a piece where it lies on its page, without its texts.
    pub(super) fn draw(&self, page: &mut Page, piece: &Piece, image: Option<PieceImage>) {
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
    }

    /// White tabs; colour reaches onto them as far as over the outline, or as far as the tab does.
    fn draw_tabs(&self, page: &mut Page, piece: &Piece, data: &PieceData) {
        for tab in &piece.tabs {
            page.items.push(Item {
                layer: Layer::Print,
                mark: Mark::Polygon { points: tab.corners.clone(), fill: WHITE },
                data: data.with(&[("tab-of", tab.edge.to_string()), ("on", tab.facet.to_string())]),
            });
            if self.look.colours {
                let c = &tab.corners;
                let depth = distance_to_segment(c[2], c[0], c[1]);
                let t = (BLEED / depth.max(1e-9)).min(1.0);
                let strip = match c.len() {
                    4 => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[3], t)],
                    _ => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[2], t)],
                };
                let fill = srgb(self.mesh.facets[tab.facet as usize].colour);
                let data = vec![("tab-colour", tab.edge.to_string()), ("on", tab.facet.to_string())];
                page.items.push(Item { layer: Layer::Print, mark: Mark::Polygon { points: strip, fill }, data });
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
                data: data.with(&[("tab", tab.edge.to_string()), ("on", tab.facet.to_string()), angle_data(angle)]),
            });
        }
    }

    /// The texts of one piece: its name, the numbers of its edges, the angles of its folds. Numbers and names that find no place inside are
    /// pending; angles that find none are not printed: the model's shape tells them.
    pub(super) fn labels(&self, k: usize, piece: &Piece) -> Labels {
        let mut labels = Labels::default();
        self.name(&mut labels, k, piece);
        for (f, polygon) in &piece.facets {
            if let Some(row) = self.rows.get(f).filter(|_| piece.copies == 1) {
                // A number that finds no place is told by its neighbours.
                labels.within(polygon, row, PERIOD, Role::Row { facet: *f });
            }
        }
        let facet = |f: u32| piece.facets.iter().find(|(g, _)| *g == f).map(|(_, p)| p.as_slice()).unwrap_or_default();
        if self.look.numbers {
            for tab in &piece.tabs {
                if let Some(glue) = piece.glue.iter().find(|g| g.edge == tab.edge && g.facet == tab.facet) {
                    let tip = 0.5 * (tab.corners[2] + tab.corners[tab.corners.len() - 1]);
                    self.number(&mut labels, piece, glue, &tab.corners, tip);
                }
            }
            for glue in piece.glue.iter().filter(|g| !g.tab) {
                self.number(&mut labels, piece, glue, facet(glue.facet), 0.5 * (glue.ends[0] + glue.ends[1]));
            }
        }
        if self.look.angles {
            for fold in piece.folds.iter().filter(|f| f.angle.abs() >= self.pattern.flat_angle) {
                let text = format!("{:.0}°", fold.angle.abs().to_degrees());
                let f = self.mesh.edges[fold.edge as usize].sides[0].expect("a fold has two facets").facet;
                labels.along(fold.ends, facet(f), &text, ANGLE, Role::Angle { edge: fold.edge });
            }
        }
        labels
    }

    /// The number of an edge, with the piece that it is glued to: `3:417`; without it where that is the same piece.
    fn number(&self, labels: &mut Labels, piece: &Piece, glue: &Glue, inside: &[DVec2], from: DVec2) {
        let mate = self.mesh.other(glue.edge, glue.facet).and_then(|side| self.piece_of.get(&side.facet)).copied();
        let text = match mate {
            Some(mate) if mate != [piece.name, piece.copy] => format!("{}:{}", mate[0], glue.number),
            _ => glue.number.to_string(),
        };
        let role = Role::Number { edge: glue.edge, facet: glue.facet };
        // The polygon lies to the left of the edge: a tab's base runs against its facet's edge.
        let ends = if glue.tab { [inside[0], inside[1]] } else { glue.ends };
        let placed = labels.along(ends, inside, &text, NUMBER, role) || (!glue.tab && labels.beside(ends, inside, &text, NUMBER, role));
        if !placed {
            let outward = -(glue.ends[1] - glue.ends[0]).perp();
            labels.pending.push(Pending { text, sizes: NUMBER, role, anchors: vec![[from, outward]] });
        }
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
        let mut write = |text: &str, sizes| largest.iter().take(NAMED_FACETS).any(|(_, p)| labels.within(p, text, sizes, Role::Name));
        if write(&name, [NAME[0], NAME_IN_FULL]) || write(&number, NAME) {
            return;
        }
        // From any side of the outline, the longest first.
        let mut sides: Vec<[DVec2; 2]> = piece.outline.iter().flat_map(|o| (0..o.len()).map(|k| [o[k], o[(k + 1) % o.len()]])).collect();
        sides.sort_by(|[a, b], [c, d]| c.distance_squared(*d).total_cmp(&a.distance_squared(*b)));
        let anchors = sides.iter().map(|&[a, b]| [0.5 * (a + b), -(b - a).perp()]).collect();
        labels.pending.push(Pending { text: format!("piece {number}"), sizes: NAME, role: Role::Name, anchors });
    }

    /// Draws texts, with the lines that lead to them.
    pub(super) fn draw_labels(&self, page: &mut Page, piece: &Piece, labels: &[Label], textured: bool) {
        let data = PieceData::new(piece);
        for label in labels {
            let role = match label.role {
                Role::Name => vec![("name", piece.name.to_string())],
                Role::Number { edge, facet } => vec![("number-of", edge.to_string()), ("on", facet.to_string())],
                Role::Angle { edge } => vec![("angle-of", edge.to_string())],
                Role::Row { facet } => vec![("row-of", facet.to_string())],
            };
            if let Some(ends) = label.leader {
                let mark = Mark::Line { points: ends.to_vec(), closed: false, style: Style::Thin };
                page.items.push(Item { layer: Layer::Print, mark, data: [data.with(&role), vec![("leader", String::new())]].concat() });
            }
            if textured {
                // A white bed here too: the colours under a text may be any.
                let mark = Mark::Polygon { points: label.rectangle().points().to_vec(), fill: WHITE };
                page.items.push(Item { layer: Layer::Print, mark, data: [data.with(&role), vec![("bed", String::new())]].concat() });
            }
            let mark = text(label, self.mesh, piece, self.look, textured);
            page.items.push(Item { layer: Layer::Print, mark, data: data.with(&role) });
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
        halo(page, Style::Halo, &fold.ends, false);
    }
    for outline in &piece.outline {
        halo(page, Style::CutHalo, outline, true);
    }
}

fn halo(page: &mut Page, style: Style, points: &[DVec2], closed: bool) {
    let mark = Mark::Line { points: points.to_vec(), closed, style };
    page.items.push(Item { layer: Layer::Print, mark, data: vec![("halo", String::new())] });
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

/// Whether black is hard to see on a colour: pale ink has more contrast there than black, after WCAG 2's contrast ratio.
fn is_dark(colour: [u8; 3]) -> bool {
    contrast(colour, PALE) > contrast(colour, BLACK)
}

/// Contrast ratio of two sRGB colours, 1 to 21 (Web Content Accessibility Guidelines 2.2, "contrast ratio").
fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
    let luminance = |c: [u8; 3]| {
        let [r, g, b] = c.map(|v| {
            let v = f64::from(v) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        });
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

fn text(label: &Label, mesh: &Mesh, piece: &Piece, look: &Look, textured: bool) -> Mark {
    // White on dark facets.
    let under = piece.facets.iter().find(|(_, p)| contains(p, label.at)).map(|(f, _)| facet_fill(mesh, *f, look));
    let dark = !textured && under.is_some_and(is_dark);
    let colour = if dark { PALE } else { BLACK };
    Mark::Text {
        at: label.at,
        size: label.size,
        angle: label.angle,
        text: label.text.clone(),
        colour,
        anchor: 0.5,
        underlined: turns_into_another(&label.text),
    }
}
