//! The marks of one page by what they claim to be, and whether they look so.

use super::drawn::{Drawn, DrawnPage, Look, Shape};
use super::findings::Findings;
use crate::mesh::Mesh;
use crate::polygon::{bounds, contains, distance_to_segment};
use glam::DVec2;
use rustc_hash::FxHashMap;

/// How far something drawn may be from where it should be, mm: far below what printers and scissors do, far above the rounding of single precision.
pub(super) const DRAWN: f64 = 0.005;
/// Least size of type, mm.
const LEAST_TYPE: f64 = 1.8;
/// Least contrast ratio of a text and what lies below it (WCAG 2.2, level AA for large print).
const LEAST_CONTRAST: f64 = 3.0;

/// Kinds of lines, as the legend and the documentation tell them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Cut,
    Mountain,
    Valley,
    /// A thick black line: the bar, marks of a cutter.
    Bold,
    /// A thin grey line that leads to a text, or in a picture.
    Thin,
}

impl Kind {
    fn look(self) -> Look {
        let look = |colour, width, dashes: &[f64]| Look { colour, width, dashes: dashes.to_vec() };
        match self {
            Self::Cut => look([0; 3], 0.2, &[]),
            Self::Mountain => look([0xc0, 0x30, 0x30], 0.2, &[3.0, 0.9, 0.5, 0.9]),
            Self::Valley => look([0x30, 0x50, 0xc0], 0.2, &[1.6, 1.1]),
            Self::Bold => look([0; 3], 0.4, &[]),
            Self::Thin => look([0x80; 3], 0.15, &[]),
        }
    }

    /// Whether a line looks so.
    pub(super) fn fits(self, look: &Look) -> bool {
        let own = self.look();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-3;
        own.colour == look.colour
            && near(own.width, look.width)
            && own.dashes.len() == look.dashes.len()
            && own.dashes.iter().zip(&look.dashes).all(|(&a, &b)| near(a, b))
    }

    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Cut => "a line to cut",
            Self::Mountain => "a mountain",
            Self::Valley => "a valley",
            Self::Bold => "a thick line",
            Self::Thin => "a thin line",
        }
    }
}

/// What a mark claims to be; empty if it claims nothing.
fn claim(mark: &Drawn) -> String {
    let get = |name: &str| mark.get(name).unwrap_or_default();
    let has = |name: &str| mark.data.contains_key(name);
    let extra = if has("leader") {
        " leader"
    } else if has("bed") {
        " bed"
    } else {
        ""
    };
    let copy = mark.get("copy").unwrap_or("1");
    if has("view") {
        let what = ["camera", "of-facet", "border-of", "piece-at"].into_iter().find(|k| has(k)).unwrap_or_default();
        return if what == "camera" { "view".to_owned() } else { format!("{what} {} {}{extra}", get("view"), get(what)) };
    }
    for (name, of) in [("list", "part"), ("instruction", ""), ("heading", ""), ("tick", ""), ("legend", ""), ("legend-text", "")] {
        if has(name) {
            return format!("{name} {} {}", get(name), get(of)).trim().to_owned();
        }
    }
    for name in ["bar", "note", "title", "registration", "halo"] {
        if has(name) {
            return name.to_owned();
        }
    }
    for name in ["number-of", "tab-of", "tab-colour", "bleed", "tab"] {
        if has(name) {
            return format!("{name} {} {}{extra}", get(name), get("on"));
        }
    }
    if has("under") {
        return format!("under {} {}", get("of-strip"), get("under"));
    }
    if has("crossing") {
        return format!("crossing {} {}", get("of"), get("crossing"));
    }
    for name in ["facet", "edge", "angle-of", "row-of", "strip-name", "strip"] {
        if has(name) {
            return format!("{name} {}{extra}", get(name));
        }
    }
    if has("name") {
        return format!("name {} {copy}{extra}", get("piece"));
    }
    if has("loop") {
        return format!("cut {} {copy}", get("piece"));
    }
    if matches!(mark.shape, Shape::Image { .. }) && has("piece") {
        return format!("image {} {copy}", get("piece"));
    }
    String::new()
}

/// One page while it is compared: what is used is what should be there.
pub(super) struct Page<'a> {
    /// From 1.
    pub(super) number: usize,
    pub(super) drawn: &'a DrawnPage,
    /// Whether it is the back of another page: seen through the paper.
    pub(super) back: bool,
    by_claim: FxHashMap<String, Vec<usize>>,
    used: Vec<bool>,
    /// Facets, tabs and other fills that lie under texts and lines: those that are used.
    pub(super) findings: &'a mut Findings,
}

impl<'a> Page<'a> {
    pub(super) fn new(number: usize, drawn: &'a DrawnPage, back: bool, findings: &'a mut Findings) -> Self {
        let mut by_claim: FxHashMap<String, Vec<usize>> = FxHashMap::default();
        for (k, mark) in drawn.marks.iter().enumerate() {
            by_claim.entry(claim(mark)).or_default().push(k);
        }
        Self { number, drawn, back, by_claim, used: vec![false; drawn.marks.len()], findings }
    }

    pub(super) fn wrong(&mut self, kind: &'static str, place: impl std::fmt::Display) {
        self.findings.add(kind, format!("page {}, {place}", self.number));
    }

    /// Where a point of the front lies on this page.
    pub(super) fn at(&self, p: DVec2) -> DVec2 {
        if self.back { DVec2::new(self.drawn.size.x - p.x, p.y) } else { p }
    }

    /// The layer that something of the front is in.
    pub(super) fn layer(&self, front: &'static str) -> &'static str {
        if self.back { "print" } else { front }
    }

    /// How a fold of an angle is drawn on this side.
    pub(super) fn fold(&self, angle: f64) -> Kind {
        if (angle > 0.0) == self.back { Kind::Mountain } else { Kind::Valley }
    }

    /// The marks that claim to be something, all of them used then.
    pub(super) fn all(&mut self, claim: &str) -> Vec<&'a Drawn> {
        let places = self.by_claim.get(claim).cloned().unwrap_or_default();
        places.iter().for_each(|&k| self.used[k] = true);
        places.iter().map(|&k| &self.drawn.marks[k]).collect()
    }

    /// The one mark that claims to be something, if it is there.
    pub(super) fn maybe(&mut self, claim: &str, what: &str) -> Option<&'a Drawn> {
        let all = self.all(claim);
        if all.len() > 1 {
            self.wrong("drawn twice", what);
        }
        all.first().copied()
    }

    /// The one mark that claims to be something; it must be there.
    pub(super) fn one(&mut self, claim: &str, what: &str) -> Option<&'a Drawn> {
        let mark = self.maybe(claim, what);
        if mark.is_none() {
            self.wrong("not drawn", what);
        }
        mark
    }

    /// A line through points of this page, of a kind and in a layer.
    pub(super) fn line(&mut self, mark: &Drawn, points: &[DVec2], kind: Kind, layer: &str, what: &str) {
        self.in_layer(mark, layer, what);
        let Shape::Line { paths, look } = &mark.shape else {
            self.wrong("drawn as no line", what);
            return;
        };
        if !kind.fits(look) {
            self.wrong("drawn as another kind of line", format!("{what}, which is {}", kind.words()));
        }
        let [(drawn, closed)] = &paths[..] else {
            self.wrong("drawn in parts", what);
            return;
        };
        let near = |a: &[DVec2], b: &mut dyn Iterator<Item = &DVec2>| a.iter().zip(b).all(|(p, q)| p.distance(*q) < DRAWN);
        let there = drawn.len() == points.len() && (near(drawn, &mut points.iter()) || near(drawn, &mut points.iter().rev()));
        if !there || (*closed && points.len() == 2) {
            self.wrong("drawn elsewhere", what);
        }
    }

    pub(super) fn in_layer(&mut self, mark: &Drawn, layer: &str, what: &str) {
        if mark.layer != layer {
            self.wrong("drawn in another layer", format!("{what}: in \"{}\" and not in \"{layer}\"", mark.layer));
        }
    }

    /// A filled polygon of a colour.
    pub(super) fn fill(&mut self, mark: &Drawn, points: &[DVec2], colour: [u8; 3], what: &str) {
        self.in_layer(mark, "print", what);
        let Shape::Fill { polygon, colour: own, line } = &mark.shape else {
            self.wrong("drawn as no polygon", what);
            return;
        };
        if *own != colour {
            self.wrong("drawn in another colour", format!("{what}: {own:?} and not {colour:?}"));
        }
        if line.as_ref().is_some_and(|l| l.colour != *own || l.width > 0.2) {
            self.wrong("drawn with a border", what);
        }
        if polygon.len() != points.len() || polygon.iter().zip(points).any(|(p, q)| p.distance(*q) >= DRAWN) {
            self.wrong("drawn elsewhere", what);
        }
    }

    /// The words, the middle and the size of a text.
    pub(super) fn text(&mut self, mark: &'a Drawn, what: &str) -> Option<(&'a str, DVec2, f64)> {
        self.in_layer(mark, "print", what);
        let Shape::Text { words, size, corners, underlined, .. } = &mark.shape else {
            self.wrong("drawn as no text", what);
            return None;
        };
        if *underlined != reads_otherwise_upside_down(words) {
            self.wrong("underlined wrongly", format!("{what}: \"{words}\""));
        }
        Some((words, corners.iter().sum::<DVec2>() / 4.0, *size))
    }

    /// What nobody asked for, what cannot be read, what is hidden.
    pub(super) fn finish(mut self, margin: f64) {
        for k in 0..self.drawn.odd.len() {
            let odd = &self.drawn.odd[k];
            self.wrong("not plain", odd);
        }
        self.background();
        for (k, mark) in self.drawn.marks.iter().enumerate().filter(|(k, _)| !self.used[*k]).collect::<Vec<_>>() {
            let [low, high] = bounds(mark.points());
            let at = 0.5 * (low + high);
            let claims = claim(&self.drawn.marks[k]);
            let name = if claims.is_empty() { "a mark" } else { &claims };
            self.wrong("nothing of the pattern", format!("{name} at {:.1}, {:.1} mm", at.x, at.y));
        }
        self.legible();
        self.hidden();
        self.margin(margin);
    }

    /// White under everything may be there.
    fn background(&mut self) {
        let Some(first) = self.drawn.marks.first() else { return };
        let Shape::Fill { polygon, colour: [255, 255, 255], line: None } = &first.shape else { return };
        if first.layer.is_empty() && first.data.is_empty() {
            self.used[0] = true;
            let [low, high] = bounds(polygon.iter().copied());
            if low.distance(DVec2::ZERO) > DRAWN || high.distance(self.drawn.size) > DRAWN {
                self.wrong("not plain", "the white ground is not as large as the page");
            }
        }
    }

    /// Types that are too small, too faint, or on each other.
    fn legible(&mut self) {
        let marks = &self.drawn.marks;
        let fill = |(k, m): (usize, &'a Drawn)| match &m.shape {
            Shape::Fill { polygon, colour, .. } => Some((k, bounds(polygon.iter().copied()), polygon.as_slice(), *colour)),
            _ => None,
        };
        let fills: Vec<_> = marks.iter().enumerate().filter_map(fill).collect();
        let mut boxes: Vec<([DVec2; 4], &str)> = Vec::new();
        for (k, mark) in marks.iter().enumerate() {
            let Shape::Text { words, size, colour, corners, .. } = &mark.shape else { continue };
            if *size < LEAST_TYPE - 1e-3 {
                self.wrong("too small to be read", format!("\"{words}\" of {size:.2} mm"));
            }
            let at = corners.iter().sum::<DVec2>() / 4.0;
            let under = fills.iter().rev().find(|(j, [l, h], p, _)| *j < k && l.cmple(at).all() && h.cmpge(at).all() && contains(p, at));
            let ground = under.map_or([255; 3], |f| f.3);
            if contrast(*colour, ground) < LEAST_CONTRAST {
                self.wrong("too faint to be read", format!("\"{words}\" is {colour:?} on {ground:?}"));
            }
            boxes.push((*corners, words));
        }
        boxes.sort_by(|a, b| bounds(a.0)[0].x.total_cmp(&bounds(b.0)[0].x));
        for (k, (a, words)) in boxes.iter().enumerate() {
            let [l, h] = bounds(*a);
            for (b, other) in boxes[k + 1..].iter().take_while(|(b, _)| bounds(*b)[0].x < h.x) {
                let [m, n] = bounds(*b);
                // Boxes of type are higher than its digits: middles tell.
                let inner = |c: &[DVec2; 4]| c.map(|p| p.lerp(c.iter().sum::<DVec2>() / 4.0, 0.4));
                if m.y < h.y
                    && n.y > l.y
                    && crate::polygon::Convex::new(&ccw(inner(a))).overlaps(&crate::polygon::Convex::new(&ccw(inner(b))))
                {
                    self.wrong("texts on each other", format!("\"{words}\" and \"{other}\""));
                }
            }
        }
    }

    /// Lines and texts under what is filled later.
    fn hidden(&mut self) {
        let marks = &self.drawn.marks;
        let fills: Vec<(usize, [DVec2; 2], Vec<DVec2>)> = marks
            .iter()
            .enumerate()
            .filter_map(|(k, m)| match &m.shape {
                // A picture of the folded surface lies over itself.
                Shape::Fill { polygon, .. } if !m.data.contains_key("view") => Some((k, bounds(polygon.iter().copied()), polygon.clone())),
                Shape::Image { corners, .. } => Some((k, bounds(*corners), corners.to_vec())),
                _ => None,
            })
            .collect();
        for (k, mark) in marks.iter().enumerate() {
            let points: Vec<DVec2> = match &mark.shape {
                Shape::Text { corners, .. } => vec![corners.iter().sum::<DVec2>() / 4.0],
                Shape::Line { paths, .. } if !mark.data.contains_key("view") && !mark.data.contains_key("halo") => {
                    paths.iter().flat_map(|(p, _)| p.windows(2).map(|w| 0.5 * (w[0] + w[1]))).collect()
                }
                _ => continue,
            };
            let covered = |p: &DVec2| {
                fills.iter().any(|(j, [l, h], polygon)| {
                    *j > k
                        && l.x <= p.x + 0.05
                        && l.y <= p.y + 0.05
                        && h.x >= p.x - 0.05
                        && h.y >= p.y - 0.05
                        && (contains(polygon, *p)
                            || (0..polygon.len()).any(|c| distance_to_segment(*p, polygon[c], polygon[(c + 1) % polygon.len()]) < 0.05))
                })
            };
            if points.iter().any(covered) {
                let [low, _] = bounds(points.iter().copied());
                self.wrong("under what is drawn later", format!("{} at {:.1}, {:.1} mm", claim(mark), low.x, low.y));
            }
        }
    }

    fn margin(&mut self, margin: f64) {
        let size = self.drawn.size;
        for (k, mark) in
            self.drawn.marks.iter().enumerate().skip(usize::from(self.used.first() == Some(&true) && self.drawn.marks[0].layer.is_empty()))
        {
            let half = mark.half_width();
            let [low, high] = match &mark.shape {
                // A box of type is higher than its letters.
                Shape::Text { corners, .. } => bounds(corners.map(|p| p.lerp(corners.iter().sum::<DVec2>() / 4.0, 0.2))),
                _ => bounds(mark.points()),
            };
            let over = (DVec2::splat(margin) - (low - half)).max(high + half - (size - margin)).max_element();
            if over > DRAWN {
                let name = claim(&self.drawn.marks[k]);
                self.wrong("in the margin", format!("{name}, {over:.3} mm"));
            }
        }
    }
}

fn ccw(corners: [DVec2; 4]) -> [DVec2; 4] {
    let [a, b, c, d] = corners;
    if (b - a).perp_dot(c - a) < 0.0 { [a, d, c, b] } else { corners }
}

/// Whether digits turned upside down are other digits: 6 and 9, 68 and 89.
pub(super) fn reads_otherwise_upside_down(words: &str) -> bool {
    let upside_down = |c: char| "01896:".find(c).and_then(|k| "01869:".chars().nth(k));
    let turned: Option<String> = words.chars().rev().map(upside_down).collect();
    !words.is_empty() && turned.is_some_and(|turned| turned != words)
}

/// Contrast ratio (WCAG 2.2).
fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
    let channel = |v: u8| {
        let v = f64::from(v) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    let luminance = |c: [u8; 3]| 0.2126 * channel(c[0]) + 0.7152 * channel(c[1]) + 0.0722 * channel(c[2]) + 0.05;
    let (a, b) = (luminance(a), luminance(b));
    a.max(b) / a.min(b)
}

/// The colour of a facet as it is printed.
pub(super) fn facet_colour(design: &Mesh, facet: u32, colours: bool) -> [u8; 3] {
    if colours { design.facets[facet as usize].colour.map(biscale::numerics::colour::srgb_byte) } else { [255; 3] }
}
