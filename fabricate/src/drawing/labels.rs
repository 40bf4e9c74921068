//! Texts that find their place inside a polygon: upright along a line, smaller if need be, never over each other.

use super::page::text_width;
use crate::polygon::{Convex, contains};
use glam::DVec2;

/// Largest and least size of numbers at edges, mm. Chosen, not measured: .9 mm are digits .65 mm high, the least that is read.
pub const NUMBER: [f64; 2] = [2.2, 0.9];
/// Largest and least size of a piece's name, mm. Chosen, not measured.
pub const NAME: [f64; 2] = [6.0, 1.2];

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
    /// The edge and the facet that it is the number of.
    pub number_of: Option<(u32, u32)>,
}

impl Label {
    /// What it covers.
    pub fn rectangle(&self) -> Convex {
        rectangle(self.at, DVec2::from_angle(self.angle), self.size, &self.text)
    }
}

/// The places taken so far.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    taken: Vec<Convex>,
    /// What found a place.
    pub placed: Vec<Label>,
    /// Texts that found none.
    pub missed: usize,
}

/// The rectangle of a text around its middle.
fn rectangle(at: DVec2, along: DVec2, size: f64, text: &str) -> Convex {
    let (w, h) = (0.5 * text_width(text, size) * along, 0.45 * size * along.perp());
    Convex::new(&[at - w - h, at + w - h, at + w + h, at - w + h])
}

impl Labels {
    fn fits(&self, rectangle: &Convex, inside: &[DVec2]) -> bool {
        let points = rectangle.points();
        // Corners inside, and no corner of the polygon within the text: enough for texts smaller than the polygon.
        points.iter().all(|&p| contains(inside, p))
            && (0..4).all(|k| contains(inside, 0.5 * (points[k] + points[(k + 1) % 4])))
            && self.taken.iter().all(|t| !t.overlaps(rectangle))
    }

    fn put(&mut self, at: DVec2, along: DVec2, size: f64, text: &str) {
        self.taken.push(rectangle(at, along, size, text));
        self.placed.push(Label { at, size, angle: along.to_angle(), text: text.to_owned(), number_of: None });
    }

    /// A number along an edge, on the side of the polygon: `inside` lies to the left of `a` to `b`.
    pub fn along(&mut self, [a, b]: [DVec2; 2], inside: &[DVec2], text: &str, [largest, least]: [f64; 2]) -> bool {
        let along = (b - a).normalize_or(DVec2::X);
        // Readable from below or from the right.
        let upright = if along.x < -1e-9 || (along.x.abs() <= 1e-9 && along.y < 0.0) { -along } else { along };
        let mut size = largest.min(0.5 * a.distance(b) / (0.65 * text.chars().count().max(1) as f64));
        while size >= least {
            for t in [0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8] {
                let at = a.lerp(b, t) + (0.45 * size + 0.35) * along.perp();
                if self.fits(&rectangle(at, upright, size, text), inside) {
                    self.put(at, upright, size, text);
                    return true;
                }
            }
            size *= 0.8;
        }
        self.missed += 1;
        false
    }

    /// As [`Labels::along`], for the number of an edge on the side of a facet.
    pub fn number(&mut self, ends: [DVec2; 2], inside: &[DVec2], number: usize, (edge, facet): (u32, u32)) {
        if self.along(ends, inside, &number.to_string(), NUMBER) {
            self.placed.last_mut().expect("it was placed").number_of = Some((edge, facet));
        }
    }

    /// A name in a polygon, where there is most place around its middle.
    pub fn within(&mut self, inside: &[DVec2], text: &str, [largest, least]: [f64; 2]) -> bool {
        let n = inside.len() as f64;
        let middle = inside.iter().copied().sum::<DVec2>() / n;
        let longest = (0..inside.len())
            .map(|k| inside[(k + 1) % inside.len()] - inside[k])
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .unwrap_or(DVec2::X)
            .normalize_or(DVec2::X);
        let along = if longest.x < 0.0 { -longest } else { longest };
        let mut size = largest;
        while size >= least {
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (2.0, 0.0), (-2.0, 0.0)] {
                let at = middle + 0.6 * size * (dx * along + dy * along.perp());
                if self.fits(&rectangle(at, along, size, text), inside) {
                    self.put(at, along, size, text);
                    return true;
                }
            }
            size *= 0.8;
        }
        false
    }
}
