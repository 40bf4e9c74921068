//! What a reader of a file sees of a pattern.

use super::drawn::DrawnPage;
use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;
use serde_json::Value;
use std::collections::BTreeMap;

/// What a file shows, mm, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadPattern {
    /// Facets.
    pub facets: Vec<ReadFacet>,
    /// Fold lines between facets.
    pub folds: Vec<ReadFold>,
    /// Tabs.
    pub tabs: Vec<ReadTab>,
    /// Lines to cut with their page, closed.
    pub outlines: Vec<(usize, Vec<DVec2>)>,
    /// Lines to cut with the piece that they are of.
    pub cut_of: Vec<([u32; 2], Vec<DVec2>)>,
    /// Page sizes; none where the file has no pages.
    pub pages: Vec<DVec2>,
    /// The lowest and highest point of anything drawn on each page, with half the width of its line.
    pub extents: Vec<[DVec2; 2]>,
    /// Numbers at edges that are glued: edge and facet of the design, and what stands there.
    pub numbers: Vec<(u32, u32, String)>,
    /// Edges of the design that are whole paper, if the file says them.
    pub joined: Option<FxHashSet<u32>>,
    /// Sides that the file gives to edges of the design: edge, facet, and the corner where the edge begins there.
    pub sides: Vec<(u32, u32, usize)>,
    /// What is wrong with the file in itself, in words.
    pub wrong: Vec<String>,
    /// What the pages show; none where the file has no pages.
    pub drawn: Vec<DrawnPage>,
    /// The recipe.
    pub recipe: Value,
    /// The folded form that the file shows, for each facet its corners, if it does.
    pub folded: Option<Vec<Vec<DVec3>>>,
    /// Strips of a weave by name, with their corners; the first two are along the lower side.
    pub strips: Vec<(String, Vec<DVec2>)>,
    /// The page of each strip.
    pub strip_page: BTreeMap<String, usize>,
    /// Crossings: the strip, whether it lies over, the polygon; in order along the strip.
    pub crossings: Vec<(String, bool, Vec<DVec2>)>,
    /// Facets whose polygon a clockwise or degenerate one is, by number.
    pub turned: usize,
}

impl ReadPattern {
    /// For each page how far anything on it reaches into a margin, mm; not above 0 if nothing does.
    pub(super) fn margin_violation(&self, margin: f64) -> Vec<f64> {
        let over = |(page, [low, high]): (&DVec2, &[DVec2; 2])| (DVec2::splat(margin) - *low).max(*high - (*page - margin)).max_element();
        self.pages.iter().zip(&self.extents).map(over).collect()
    }
}

/// A facet in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadFacet {
    /// The page.
    pub page: usize,
    /// The piece's number, and which of its copies it is.
    pub piece: [u32; 2],
    /// The facet of the design.
    pub facet: u32,
    /// Its corners, counter-clockwise.
    pub polygon: Vec<DVec2>,
}

/// A tab in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadTab {
    /// The page.
    pub page: usize,
    /// The edge of the design.
    pub edge: u32,
    /// The facet that it stands on.
    pub facet: u32,
    /// Its corners; the first two are the ends of the edge.
    pub polygon: Vec<DVec2>,
}

/// A fold line in a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadFold {
    /// The page.
    pub page: usize,
    /// Its ends.
    pub ends: [DVec2; 2],
    /// The edge of the design.
    pub edge: u32,
    /// Its angle, radians, valley positive.
    pub angle: f64,
}

/// Lowest and highest coordinates.
pub(super) fn bounds(points: &[DVec2]) -> [DVec2; 2] {
    let (low, high) = points.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    [low, high]
}

/// Signed area of a polygon, positive for counter-clockwise.
pub(super) fn signed_area(p: &[DVec2]) -> f64 {
    (0..p.len()).map(|k| p[k].perp_dot(p[(k + 1) % p.len()])).sum::<f64>() / 2.0
}

/// Corners of two facets of one piece closer than this are one point, mm.
pub(super) const SAME: f64 = 2e-6;
