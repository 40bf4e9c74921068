//! The page that tells how to put the pieces together: the folded surface, the pieces with their numbers, the order.

use super::page::{BLACK, GREY, Layer, Mark, Page, Style, WHITE, srgb, text_width};
use crate::mesh::{Mesh, Side};
use crate::paper::Paper;
use crate::polygon::{area, bounds};
use crate::unfold::{Pattern, Piece};
use biscale::numerics::cast::truncate_u8;
use glam::{DVec2, DVec3};

/// Where the picture is seen from: degrees from x and above the horizon. Chosen by eye.
const AZIMUTH_DEG: f64 = -60.0;
const ELEVATION_DEG: f64 = 35.0;
/// Size of the numbers of pieces in the picture, mm. Chosen by eye.
const NUMBER: f64 = 3.4;
/// Most pieces that are numbered in the picture, and most that are listed: more do not fit one page.
/// Chosen, not measured.
const MOST_NUMBERS: usize = 99;
const MOST_LISTED: usize = 40;
/// Facets beyond which a picture of them is no help on one page. Chosen, not measured.
const MOST_DRAWN: usize = 6000;

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

/// A colour that tells the `k`th piece from its neighbours: hues a golden ratio of the circle apart, so that no two of few are close.
fn hue(k: usize) -> [u8; 3] {
    let h = (k as f64 * 0.618_033_988_75).fract() * 6.0;
    let ramp = |shift: f64| (((h + shift) % 6.0 - 3.0).abs() - 1.0).clamp(0.0, 1.0);
    srgb([ramp(0.0), ramp(4.0), ramp(2.0)].map(|v| 0.35 + 0.5 * v))
}

/// Parts along the picture's size, so that none of them lies both before and behind another one. Chosen by eye.
const FINENESS: f64 = 30.0;
/// Most such parts, about: what a PDF viewer shows without delay. Chosen, not measured.
const MOST_PARTS: f64 = 8000.0;

/// A part of a facet in a picture, with which of its sides are sides of the facet.
#[derive(Clone, Copy)]
struct Fragment {
    corners: [DVec3; 3],
    border: [bool; 3],
    facet: u32,
    piece: usize,
}

impl Fragment {
    /// Halves the part across its longest side until that is short enough.
    fn cut(self, longest: f64, out: &mut Vec<Self>) {
        let length = |k: usize| self.corners[k].distance_squared(self.corners[(k + 1) % 3]);
        let k = if length(0) >= length(1).max(length(2)) { 0 } else { 1 + usize::from(length(2) > length(1)) };
        if length(k) <= longest * longest {
            out.push(self);
            return;
        }
        let [a, b, c] = [k, (k + 1) % 3, (k + 2) % 3];
        let middle = 0.5 * (self.corners[a] + self.corners[b]);
        let [ab, bc, ca] = [a, b, c].map(|j| self.border[j]);
        let part = |corners, border| Self { corners, border, ..self };
        part([self.corners[a], middle, self.corners[c]], [ab, false, ca]).cut(longest, out);
        part([middle, self.corners[b], self.corners[c]], [ab, bc, false]).cut(longest, out);
    }
}

/// Draws the page.
pub fn assembly_page(mesh: &Mesh, pattern: &Pattern, paper: Paper, title: &str) -> Page {
    let height = if paper.roll { 297.0 } else { paper.size.y };
    let mut page = Page { size: DVec2::new(paper.size.x, height), items: Vec::new() };
    let m = paper.margin;
    let width = page.size.x - 2.0 * m;
    let fit = |text: &str, size: f64| size.min(width / text_width(text, 1.0).max(1.0));
    let heading = format!("{title}: how to put it together");
    page.text(DVec2::new(m, height - m - 3.0), fit(&heading, 5.0), heading);
    let mut y = height - m - 9.0;
    let lines = [
        "1. Cut along the black lines. 2. Fold: dash-dot lines (mountain) away from you, dashed lines (valley) towards you,",
        "by the angle printed beside them; 0 is flat. 3. Glue each tab under the edge with the same number,",
        "in the order of the pieces below. The printed side is the outside.",
    ];
    let size = lines.iter().map(|l| fit(l, 3.0)).fold(3.0, f64::min);
    for line in lines {
        page.text(DVec2::new(m, y), size, line);
        y -= 4.6;
    }
    let bottom = m + 0.28 * height;
    picture(&mut page, mesh, pattern, [DVec2::new(m + 0.5, bottom + 4.0), DVec2::new(m + width - 0.5, y - 2.0)]);
    list(&mut page, mesh, pattern, [DVec2::new(m + 0.5, m + 0.5), DVec2::new(m + width - 0.5, bottom)]);
    page
}

/// How the folded surface is seen on the page.
struct View {
    /// Unit vectors of space: towards the viewer, to the right and up on the page, towards the light.
    back: DVec3,
    right: DVec3,
    up: DVec3,
    light: DVec3,
    /// From the projection to the page.
    centre: DVec2,
    scale: f64,
    /// Largest extent of the projection, mm.
    extent: f64,
}

impl View {
    /// The view that fits a mesh between two corners of a page.
    fn new(mesh: &Mesh, [low, high]: [DVec2; 2]) -> Self {
        let ((sin_e, cos_e), (sin_a, cos_a)) = (ELEVATION_DEG.to_radians().sin_cos(), AZIMUTH_DEG.to_radians().sin_cos());
        let back = DVec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        let right = DVec3::new(-sin_a, cos_a, 0.0);
        let light = (0.4 * back - 0.6 * right + 0.7 * DVec3::Z).normalize();
        let mut view = Self { back, right, up: back.cross(right), light, centre: DVec2::ZERO, scale: 1.0, extent: 0.0 };
        let [l, h] = bounds(mesh.vertices.iter().map(|&v| view.project(v)));
        view.scale = ((high - low) / (h - l).max(DVec2::splat(1e-9))).min_element();
        view.centre = 0.5 * (low + high) - 0.5 * (l + h) * view.scale;
        view.extent = (h - l).max_element();
        view
    }

    fn project(&self, v: DVec3) -> DVec2 {
        DVec2::new(v.dot(self.right), v.dot(self.up))
    }

    /// A projected point on the page.
    fn on_page(&self, p: DVec2) -> DVec2 {
        self.centre + p * self.scale
    }

    /// How bright a facet is, 0 to 1; its back is dark.
    fn shade(&self, normal: DVec3) -> f64 {
        if normal.dot(self.back) < 0.0 { 0.45 } else { 0.62 + 0.38 * normal.dot(self.light).max(0.0) }
    }
}

/// The folded surface from the front, each piece in a hue of its own, with its number.
fn picture(page: &mut Page, mesh: &Mesh, pattern: &Pattern, [low, high]: [DVec2; 2]) {
    let facets: usize = pattern.pieces.iter().map(|p| p.facets.len()).sum();
    if facets > MOST_DRAWN {
        page.text(0.5 * (low + high), 4.0, format!("{facets} facets: too many to draw here"));
        return;
    }
    let view = View::new(mesh, [low, high]);
    for fragment in fragments(mesh, pattern, &view) {
        let points = fragment.corners.map(|c| view.on_page(view.project(c)));
        let shade = view.shade(mesh.facets[fragment.facet as usize].normal);
        let fill = hue(pattern.pieces[fragment.piece].name - 1).map(|c| truncate_u8(f64::from(c) * shade));
        page.polygon(&points, fill);
        for j in (0..3).filter(|&j| fragment.border[j]) {
            page.line(Layer::Print, Style::Thin, &[points[j], points[(j + 1) % 3]], false);
        }
    }
    for piece in pattern.pieces.iter().take(MOST_NUMBERS) {
        number(page, mesh, piece, &view);
    }
}

/// The facets from the back to the front, in parts so small that none lies both before and behind another one.
fn fragments(mesh: &Mesh, pattern: &Pattern, view: &View) -> Vec<Fragment> {
    let mut out: Vec<Fragment> = Vec::new();
    let whole: f64 = mesh.facets.iter().map(|f| area(&f.flat)).sum();
    let longest = (view.extent / FINENESS).max((2.0 * whole / MOST_PARTS).sqrt());
    for (k, piece) in pattern.pieces.iter().enumerate() {
        for (f, _) in &piece.facets {
            let facet = &mesh.facets[*f as usize];
            for t in &facet.fill {
                let n = facet.corners.len() as u32;
                let border = |j: usize| (t[j] + 1) % n == t[(j + 1) % 3];
                let corners = t.map(|c| mesh.vertices[facet.corners[c as usize] as usize]);
                Fragment { corners, border: [border(0), border(1), border(2)], facet: *f, piece: k }.cut(longest, &mut out);
            }
        }
    }
    let depth = |p: &Fragment| p.corners.iter().map(|c| c.dot(view.back)).sum::<f64>();
    out.sort_by(|a, b| depth(a).total_cmp(&depth(b)).then(a.facet.cmp(&b.facet)));
    out
}

/// The number of a piece, on the facet that faces the viewer most; none if all face away.
fn number(page: &mut Page, mesh: &Mesh, piece: &Piece, view: &View) {
    let shown = |f: u32| {
        let facet = &mesh.facets[f as usize];
        facet.normal.dot(view.back) * area(&facet.flat)
    };
    let Some((f, _)) = piece.facets.iter().max_by(|(a, _), (b, _)| shown(*a).total_cmp(&shown(*b))) else { return };
    let facet = &mesh.facets[*f as usize];
    if facet.normal.dot(view.back) <= 0.0 {
        return;
    }
    let middle = facet.corners.iter().map(|&c| view.project(mesh.vertices[c as usize])).sum::<DVec2>() / facet.corners.len() as f64;
    let at = view.on_page(middle);
    let text = piece.name.to_string();
    let half = DVec2::new(0.5 * text_width(&text, NUMBER) + 0.5, 2.1);
    page.polygon(&[at - half, at + half * DVec2::new(1.0, -1.0), at + half, at + half * DVec2::new(-1.0, 1.0)], WHITE);
    page.add(Layer::Print, Mark::Text { at, size: NUMBER, angle: 0.0, text, colour: BLACK, anchor: 0.5 });
}

/// The pieces in their order, small, each with its number, facets and what it is glued to.
fn list(page: &mut Page, mesh: &Mesh, pattern: &Pattern, [low, high]: [DVec2; 2]) {
    // Copies are put together like the first one.
    let order: Vec<usize> = order(mesh, pattern).into_iter().filter(|&k| pattern.pieces[k].copy == 1).collect();
    let shown = order.len().min(MOST_LISTED);
    let size = high - low;
    // The fewest rows whose cells are still about as high as wide.
    let columns = (1..=shown)
        .find(|c| {
            let rows = shown.div_ceil(*c);
            size.x / *c as f64 <= 1.25 * size.y / rows as f64
        })
        .unwrap_or(shown)
        .max(3);
    let rows = shown.div_ceil(columns);
    let cell = DVec2::new(size.x / columns as f64, size.y / rows as f64);
    for (place, &k) in order.iter().take(shown).enumerate() {
        let corner = DVec2::new(low.x + (place % columns) as f64 * cell.x, high.y - (place / columns + 1) as f64 * cell.y);
        let piece = &pattern.pieces[k];
        let [l, h] = bounds(piece.outline.iter().flatten().copied());
        let room = DVec2::new(cell.x - 2.0, cell.y - 6.0).max(DVec2::splat(1.0));
        let scale = (room / (h - l).max(DVec2::splat(1e-9))).min_element();
        let shift = corner + DVec2::new(0.5 * cell.x, 0.5 * room.y + 1.0) - 0.5 * (l + h) * scale;
        for outline in piece.outline.iter().take(1) {
            let points: Vec<DVec2> = outline.iter().map(|&p| shift + p * scale).collect();
            page.polygon(&points, hue(piece.name - 1));
            page.line(Layer::Print, Style::Thin, &points, true);
        }
        let glue = piece.glue.iter().map(|g| g.number).collect::<std::collections::BTreeSet<_>>().len();
        let times = if piece.copies > 1 { format!(" ({} times)", piece.copies) } else { String::new() };
        let text = format!("{}. piece {}{times}: {} facets, {glue} glued edges", place + 1, piece.name, piece.facets.len());
        let size = 2.6_f64.min((cell.x - 1.0) / text_width(&text, 1.0));
        let at = corner + DVec2::new(0.5, cell.y - 2.5);
        page.add(Layer::Print, Mark::Text { at, size, angle: 0.0, text, colour: BLACK, anchor: 0.0 });
    }
    if order.len() > shown {
        let text = format!("and {} more", order.len() - shown);
        page.add(Layer::Print, Mark::Text { at: DVec2::new(high.x, low.y + 1.0), size: 2.6, angle: 0.0, text, colour: GREY, anchor: 1.0 });
    }
}
