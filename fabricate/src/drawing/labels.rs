//! Texts that find their place: inside a polygon along a line or with a thin line to it, else on the paper around the piece.
//!
//! No text is smaller than what is read at arm's length, none lies on another one.

use super::page::text_width;
use crate::polygon::{Convex, contains};
use glam::DVec2;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Least size of type that is read at arm's length, mm: digits 1.3 mm high, as in the smallest print of a newspaper.
pub const LEAST_TYPE: f64 = 1.8;
/// Largest and least size of numbers at edges, mm. Chosen, not measured.
pub const NUMBER: [f64; 2] = [2.4, LEAST_TYPE];
/// Largest and least size of a piece's name, mm. Chosen, not measured.
pub const NAME: [f64; 2] = [6.0, LEAST_TYPE];
/// How far a line leads from an edge to its number outside of the piece, mm, at most. Chosen, not measured.
const LONGEST_LEADER: f64 = 25.0;
/// Distance of a text outside of its piece from what is cut, mm. Chosen, not measured.
const CLEAR: f64 = 0.4;

/// What a text tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The name of the piece.
    Name,
    /// The number of a glued edge on the side of a facet.
    Number { edge: u32, facet: u32 },
    /// The angle of a fold.
    Angle { edge: u32 },
    /// The period that a facet begins.
    Row { facet: u32 },
}

/// A text that found its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// Its middle.
    pub at: DVec2,
    /// Size, mm.
    pub size: f64,
    /// Direction, radians.
    pub angle: f64,
    /// The text.
    pub text: String,
    /// What it tells of.
    pub role: Role,
    /// The line that leads to what it tells of, from there.
    pub leader: Option<[DVec2; 2]>,
}

impl Label {
    /// What it covers.
    pub fn rectangle(&self) -> Convex {
        rectangle(self.at, DVec2::from_angle(self.angle), self.size, &self.text)
    }
}

/// A text that found no place inside its piece.
#[derive(Clone, Debug, PartialEq)]
pub struct Pending {
    /// The text, its largest and least size.
    pub text: String,
    pub sizes: [f64; 2],
    pub role: Role,
    /// Where a line may begin that leads to it, and the direction away from the piece there.
    pub anchors: Vec<[DVec2; 2]>,
}

/// What reads as another number when it is turned upside down, such as `6` and `68`: such texts are underlined.
pub fn turns_into_another(text: &str) -> bool {
    let turned: Option<String> = text
        .chars()
        .rev()
        .map(|c| match c {
            '0' | '1' | '8' | ':' => Some(c),
            '6' => Some('9'),
            '9' => Some('6'),
            _ => None,
        })
        .collect();
    turned.is_some_and(|turned| turned != text)
}

/// The places taken so far.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    taken: Vec<Convex>,
    /// What found a place.
    pub placed: Vec<Label>,
    /// What found none.
    pub pending: Vec<Pending>,
}

/// The rectangle of a text around its middle; a line under it included.
fn rectangle(at: DVec2, along: DVec2, size: f64, text: &str) -> Convex {
    let (w, h) = (0.5 * text_width(text, size) * along, 0.5 * size * along.perp());
    Convex::new(&[at - w - h, at + w - h, at + w + h, at - w + h])
}

/// The direction of an edge in which a text along it is read from below or from the right.
fn upright(along: DVec2) -> DVec2 {
    if along.x < -1e-9 || (along.x.abs() <= 1e-9 && along.y < 0.0) { -along } else { along }
}

/// Sizes from the largest to the least.
fn sizes([largest, least]: [f64; 2]) -> impl Iterator<Item = f64> {
    let count = 4;
    (0..=count).map(move |k| largest + (least - largest) * f64::from(k) / f64::from(count))
}

impl Labels {
    fn fits(&self, rectangle: &Convex, inside: &[DVec2]) -> bool {
        let points = rectangle.points();
        // Corners inside, and no corner of the polygon within the text: enough for texts smaller than the polygon.
        points.iter().all(|&p| contains(inside, p))
            && (0..4).all(|k| contains(inside, 0.5 * (points[k] + points[(k + 1) % 4])))
            && self.taken.iter().all(|t| !t.overlaps(rectangle))
    }

    fn put(&mut self, at: DVec2, along: DVec2, size: f64, text: &str, role: Role, leader: Option<[DVec2; 2]>) {
        self.taken.push(rectangle(at, along, size, text));
        self.placed.push(Label { at, size, angle: along.to_angle(), text: text.to_owned(), role, leader });
    }

    /// A text along an edge, on the side of the polygon: `inside` lies to the left of `a` to `b`.
    pub fn along(&mut self, [a, b]: [DVec2; 2], inside: &[DVec2], text: &str, range: [f64; 2], role: Role) -> bool {
        let along = (b - a).normalize_or(DVec2::X);
        let read = upright(along);
        for size in sizes(range).filter(|&s| text_width(text, s) <= a.distance(b)) {
            for t in [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8] {
                let at = a.lerp(b, t) + (0.5 * size + 0.3) * along.perp();
                if self.fits(&rectangle(at, read, size, text), inside) {
                    self.put(at, read, size, text, role, None);
                    return true;
                }
            }
        }
        false
    }

    /// A text anywhere in the polygon with a line to an edge of it, `inside` to the left of `a` to `b`.
    pub fn beside(&mut self, [a, b]: [DVec2; 2], inside: &[DVec2], text: &str, range: [f64; 2], role: Role) -> bool {
        let (from, along) = (a.lerp(b, 0.5), (b - a).normalize_or(DVec2::X));
        let size = range[1];
        for depth in [1.0, 1.8, 2.6, 3.4, 4.2, 5.0, 6.5, 8.0] {
            for shift in [0.0, 1.0, -1.0, 2.0, -2.0, 3.5, -3.5] {
                let at = from + depth * size * along.perp() + shift * size * along;
                for read in [upright(along), DVec2::X, upright(along.perp())] {
                    let box_of = rectangle(at, read, size, text);
                    if self.fits(&box_of, inside) {
                        self.put(at, read, size, text, role, Some([from, border(&box_of, from)]));
                        return true;
                    }
                }
            }
        }
        false
    }

    /// A name in a polygon, where there is most place around its middle.
    pub fn within(&mut self, inside: &[DVec2], text: &str, range: [f64; 2], role: Role) -> bool {
        let n = inside.len() as f64;
        let middle = inside.iter().copied().sum::<DVec2>() / n;
        let longest = (0..inside.len())
            .map(|k| inside[(k + 1) % inside.len()] - inside[k])
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .unwrap_or(DVec2::X)
            .normalize_or(DVec2::X);
        let along = upright(longest);
        for size in sizes(range) {
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (2.0, 0.0), (-2.0, 0.0)] {
                let at = middle + 0.6 * size * (dx * along + dy * along.perp());
                if self.fits(&rectangle(at, along, size, text), inside) {
                    self.put(at, along, size, text, role, None);
                    return true;
                }
            }
        }
        false
    }
}

/// Where the line from a point to the middle of a text meets its box.
fn border(text: &Convex, from: DVec2) -> DVec2 {
    let points = text.points();
    let middle = points.iter().copied().sum::<DVec2>() / points.len() as f64;
    let toward = from - middle;
    let n = points.len();
    // The largest share of the way that stays inside.
    let share = (0..n).fold(1.0_f64, |share, k| {
        let out = -(points[(k + 1) % n] - points[k]).perp().normalize_or_zero();
        let (reach, way) = (out.dot(points[k] - middle), out.dot(toward));
        if way > reach { share.min(reach / way) } else { share }
    });
    middle + toward * share
}

/// The paper around the pieces of a page: where texts stand that found no place inside.
pub struct Around {
    tree: RTree<GeomWithData<Rectangle<[f64; 2]>, usize>>,
    shapes: Vec<Convex>,
    low: DVec2,
    high: DVec2,
}

impl Around {
    /// Around convex shapes that must stay free, between two corners of the page.
    pub fn new(shapes: Vec<Convex>, [low, high]: [DVec2; 2]) -> Self {
        let boxed = |(k, s): (usize, &Convex)| GeomWithData::new(boxed(s), k);
        Self { tree: RTree::bulk_load(shapes.iter().enumerate().map(boxed).collect()), shapes, low, high }
    }

    fn free(&self, text: &Convex) -> bool {
        let [l, h] = text.bounds();
        if l.cmplt(self.low).any() || h.cmpgt(self.high).any() {
            return false;
        }
        let near = AABB::from_corners((l - CLEAR).to_array(), (h + CLEAR).to_array());
        let middle = 0.5 * (l + h);
        // Shapes are kept apart from by making the text larger.
        let grown = text.points().iter().map(|&p| p + (p - middle).signum() * CLEAR).collect::<Vec<_>>();
        let grown = Convex::new(&grown);
        self.tree.locate_in_envelope_intersecting(&near).all(|s| !self.shapes[s.data].overlaps(&grown))
    }

    /// Whether a line meets none of the shapes, but where it begins.
    fn clear(&self, from: DVec2, to: DVec2) -> bool {
        let along = (to - from).normalize_or_zero();
        let a = from + 0.1 * along;
        let side = 0.02 * along.perp();
        let line = Convex::new(&[a - side, to - side, to + side, a + side]);
        let [l, h] = line.bounds();
        self.tree
            .locate_in_envelope_intersecting(&AABB::from_corners(l.to_array(), h.to_array()))
            .all(|s| !self.shapes[s.data].overlaps(&line))
    }

    fn take(&mut self, shape: Convex) {
        self.tree.insert(GeomWithData::new(boxed(&shape), self.shapes.len()));
        self.shapes.push(shape);
    }

    /// A place for a text, the nearest that is free.
    pub fn place(&mut self, pending: &Pending) -> Option<Label> {
        let Pending { text, sizes: [_, size], role, anchors } = pending;
        let mut reach = 0.9 * size;
        while reach <= LONGEST_LEADER {
            for &[from, outward] in anchors {
                if let Some((box_of, read, to)) = self.near(from, outward.normalize_or(DVec2::Y), reach, text, *size) {
                    let side = (to - from).normalize_or_zero().perp() * 0.1;
                    let at = 0.5 * (box_of.points()[0] + box_of.points()[2]);
                    self.take(box_of);
                    self.take(Convex::new(&[from - side, to - side, to + side, from + side]));
                    return Some(Label {
                        at,
                        size: *size,
                        angle: read.to_angle(),
                        text: text.clone(),
                        role: *role,
                        leader: Some([from, to]),
                    });
                }
            }
            reach += 0.7 * size;
        }
        None
    }

    /// A free box for a text whose nearer side is `reach` away, its direction, and where the line to it ends.
    fn near(&self, from: DVec2, outward: DVec2, reach: f64, text: &str, size: f64) -> Option<(Convex, DVec2, DVec2)> {
        for turn in [0.0, 0.35, -0.35, 0.7, -0.7, 1.05, -1.05, 1.35, -1.35] {
            let way = DVec2::from_angle(turn).rotate(outward);
            for read in [DVec2::X, upright(outward.perp())] {
                let half = 0.5 * text_width(text, size) * read.dot(way).abs();
                let box_of = rectangle(from + (reach + half) * way, read, size, text);
                let to = border(&box_of, from);
                if self.free(&box_of) && self.clear(from, to) {
                    return Some((box_of, read, to));
                }
            }
        }
        None
    }
}

fn boxed(shape: &Convex) -> Rectangle<[f64; 2]> {
    let [l, h] = shape.bounds();
    Rectangle::from_corners(l.to_array(), h.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_read_as_others_upside_down_are_told() {
        for text in ["6", "9", "66", "99", "68", "89", "18", "1:6", "61"] {
            assert!(turns_into_another(text), "{text}");
        }
        for text in ["8", "69", "96", "2", "26", "6:9", "4:66", "6 (x2)", "60°"] {
            assert!(!turns_into_another(text), "{text}");
        }
    }

    #[test]
    fn a_text_outside_stands_clear_of_every_shape_and_of_other_texts() {
        let square =
            |x: f64, y: f64| Convex::new(&[DVec2::new(x, y), DVec2::new(x + 4.0, y), DVec2::new(x + 4.0, y + 4.0), DVec2::new(x, y + 4.0)]);
        let shapes: Vec<Convex> = (0..5).map(|k| square(20.0 + 10.0 * f64::from(k), 20.0)).collect();
        let mut around = Around::new(shapes.clone(), [DVec2::splat(5.0), DVec2::splat(95.0)]);
        let mut placed = Vec::new();
        for k in 0..5_u32 {
            for (from, outward) in
                [(DVec2::new(22.0, 24.0), DVec2::Y), (DVec2::new(22.0, 20.0), DVec2::NEG_Y), (DVec2::new(24.0, 22.0), DVec2::X)]
            {
                let role = Role::Angle { edge: k };
                let pending = Pending {
                    text: format!("3:{k}17"),
                    sizes: NUMBER,
                    role,
                    anchors: vec![[from + 10.0 * f64::from(k) * DVec2::X, outward]],
                };
                placed.push(around.place(&pending).expect("there is room"));
            }
        }
        for (k, label) in placed.iter().enumerate() {
            assert!(label.size >= LEAST_TYPE);
            assert!(shapes.iter().all(|s| !s.overlaps(&label.rectangle())), "{label:?}");
            assert!(placed[..k].iter().all(|other| !other.rectangle().overlaps(&label.rectangle())), "{label:?}");
        }
    }
}
