//! A picture of the folded surface, each piece in a hue of its own, with its number.

use super::page::{BLACK, Item, Layer, Mark, Page, Style, WHITE, number, srgb, text_width};
use crate::mesh::Mesh;
use crate::polygon::{Convex, area, bounds, contains};
use crate::unfold::{Pattern, Piece};
use biscale::numerics::cast::truncate_u8;
use glam::{DVec2, DVec3};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Where a picture is seen from: its words, degrees from x and above the horizon. Chosen by eye; opposite to each other.
pub(super) const VIEWS: [(&str, f64, f64); 2] = [("from the front and above", -60.0, 35.0), ("from behind and below", 120.0, -35.0)];
/// Largest and least size of the numbers of pieces in the picture, mm, and how many are as large as can be. Chosen by eye.
const NUMBER: [f64; 2] = [3.4, 2.0];
const FEW_NUMBERS: usize = 40;
/// Facets of a piece that its number is tried on, those that face the viewer most first. Chosen, not measured.
const TRIED: usize = 12;
/// Room for the words below a picture, mm.
const CAPTION: f64 = 4.5;

/// A colour that tells the `k`th piece from its neighbours: hues a golden ratio of the circle apart, so that no two of few are close.
pub(super) fn hue(k: usize) -> [u8; 3] {
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
    fn depth(&self, view: &View) -> f64 {
        self.corners.iter().map(|c| c.dot(view.back)).sum::<f64>() / 3.0
    }

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

/// A fragment on the page.
struct Seen {
    points: [DVec2; 3],
    /// How far it is towards the viewer, mm.
    depth: f64,
}

/// Draws a picture between two corners of the page, with words below it.
pub(super) fn picture(
    page: &mut Page,
    mesh: &Mesh,
    pattern: &Pattern,
    &(words, azimuth, elevation): &(&str, f64, f64),
    [low, high]: [DVec2; 2],
) {
    let view = View::new(mesh, [azimuth, elevation], [low + DVec2::new(0.0, CAPTION), high]);
    let data = |more: (&'static str, String)| vec![("view", words.to_owned()), more];
    let camera = [azimuth, elevation, view.scale, view.centre.x, view.centre.y].map(number).join(" ");
    let at = DVec2::new(0.5 * (low.x + high.x), low.y + 1.5);
    let mark = Mark::Text { at, size: 2.4, angle: 0.0, text: words.to_owned(), colour: BLACK, anchor: 0.5, underlined: false };
    page.items.push(Item { layer: Layer::Print, mark, data: data(("camera", camera)) });
    let mut seen = Vec::new();
    for fragment in fragments(mesh, pattern, &view) {
        let points = fragment.corners.map(|c| view.on_page(view.project(c)));
        let shade = view.shade(mesh.facets[fragment.facet as usize].normal);
        let fill = hue(pattern.pieces[fragment.piece].name - 1).map(|c| truncate_u8(f64::from(c) * shade));
        let of = data(("of-facet", fragment.facet.to_string()));
        page.items.push(Item { layer: Layer::Print, mark: Mark::Polygon { points: points.to_vec(), fill }, data: of });
        for j in (0..3).filter(|&j| fragment.border[j]) {
            let mark = Mark::Line { points: vec![points[j], points[(j + 1) % 3]], closed: false, style: Style::Thin };
            page.items.push(Item { layer: Layer::Print, mark, data: data(("border-of", fragment.facet.to_string())) });
        }
        seen.push(Seen { points, depth: fragment.depth(&view) });
    }
    let size = if pattern.pieces.len() <= FEW_NUMBERS { NUMBER[0] } else { NUMBER[1] };
    let mut numbers = Numbers {
        view: &view,
        mesh,
        tree: tree(&seen),
        seen: &seen,
        taken: Vec::new(),
        frame: [low + DVec2::new(0.0, CAPTION), high],
        size,
    };
    for piece in &pattern.pieces {
        let Some(at) = numbers.place(piece) else { continue };
        let text = piece.name.to_string();
        let half = numbers.half(&text);
        let points = vec![at - half, at + half * DVec2::new(1.0, -1.0), at + half, at + half * DVec2::new(-1.0, 1.0)];
        let bed = [data(("piece-at", text.clone())), vec![("bed", String::new())]].concat();
        page.items.push(Item { layer: Layer::Print, mark: Mark::Polygon { points, fill: WHITE }, data: bed });
        let underlined = super::labels::turns_into_another(&text);
        let of = data(("piece-at", text.clone()));
        let mark = Mark::Text { at, size, angle: 0.0, text, colour: BLACK, anchor: 0.5, underlined };
        page.items.push(Item { layer: Layer::Print, mark, data: of });
    }
}

fn tree(seen: &[Seen]) -> RTree<GeomWithData<Rectangle<[f64; 2]>, usize>> {
    let boxed = |(k, s): (usize, &Seen)| {
        let [l, h] = bounds(s.points);
        GeomWithData::new(Rectangle::from_corners(l.to_array(), h.to_array()), k)
    };
    RTree::bulk_load(seen.iter().enumerate().map(boxed).collect())
}

/// The numbers of pieces in a picture, apart from each other, each on a place of its piece that is seen.
struct Numbers<'v> {
    view: &'v View,
    mesh: &'v Mesh,
    tree: RTree<GeomWithData<Rectangle<[f64; 2]>, usize>>,
    seen: &'v [Seen],
    taken: Vec<Convex>,
    frame: [DVec2; 2],
    size: f64,
}

impl Numbers<'_> {
    fn half(&self, text: &str) -> DVec2 {
        DVec2::new(0.5 * text_width(text, self.size) + 0.3, 0.62 * self.size)
    }

    /// The place for the number of a piece; none if no place of it is seen, or all of them are taken.
    fn place(&mut self, piece: &Piece) -> Option<DVec2> {
        let shown = |f: u32| {
            let facet = &self.mesh.facets[f as usize];
            facet.normal.dot(self.view.back).abs() * area(&facet.flat)
        };
        let mut facets: Vec<u32> = piece.facets.iter().map(|(f, _)| *f).collect();
        facets.sort_by(|&a, &b| shown(b).total_cmp(&shown(a)).then(a.cmp(&b)));
        let half = self.half(&piece.name.to_string());
        for f in facets.into_iter().take(TRIED) {
            let facet = &self.mesh.facets[f as usize];
            // The middle of the largest triangle: that of all corners may lie outside.
            let corner = |c: u32| self.mesh.vertices[facet.corners[c as usize] as usize];
            let size = |t: &[u32; 3]| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length_squared();
            let Some(t) = facet.fill.iter().max_by(|a, b| size(a).total_cmp(&size(b))) else { continue };
            let middle = t.iter().map(|&c| corner(c)).sum::<DVec3>() / 3.0;
            let at = self.view.on_page(self.view.project(middle));
            let depth = middle.dot(self.view.back);
            let near = 1e-6 * self.view.extent;
            let hidden = self.tree.locate_in_envelope_intersecting(&AABB::from_point(at.to_array())).any(|s| {
                let s = &self.seen[s.data];
                s.depth > depth + near && contains(&s.points, at) && !self.of_facet(s, f)
            });
            let text = Convex::new(&[at - half, at + half * DVec2::new(1.0, -1.0), at + half, at + half * DVec2::new(-1.0, 1.0)]);
            let framed = (at - half).cmpge(self.frame[0]).all() && (at + half).cmple(self.frame[1]).all();
            if framed && !hidden && self.taken.iter().all(|t| !t.overlaps(&text)) {
                self.taken.push(text);
                return Some(at);
            }
        }
        None
    }

    /// Whether a fragment lies in the plane of a facet: parts of one facet do not hide its middle.
    fn of_facet(&self, seen: &Seen, f: u32) -> bool {
        let facet = &self.mesh.facets[f as usize];
        let outline: Vec<DVec2> =
            facet.corners.iter().map(|&c| self.view.on_page(self.view.project(self.mesh.vertices[c as usize]))).collect();
        seen.points.iter().all(|&p| contains(&outline, p))
    }
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
    fn new(mesh: &Mesh, direction_deg: [f64; 2], [low, high]: [DVec2; 2]) -> Self {
        let [(sin_a, cos_a), (sin_e, cos_e)] = direction_deg.map(|d| d.to_radians().sin_cos());
        let back = DVec3::new(cos_e * cos_a, cos_e * sin_a, sin_e);
        let right = DVec3::new(-sin_a, cos_a, 0.0);
        let up = back.cross(right);
        let light = (0.4 * back - 0.6 * right + 0.7 * up).normalize();
        let mut view = Self { back, right, up, light, centre: DVec2::ZERO, scale: 1.0, extent: 0.0 };
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
    out.sort_by(|a, b| a.depth(view).total_cmp(&b.depth(view)).then(a.facet.cmp(&b.facet)));
    out
}
