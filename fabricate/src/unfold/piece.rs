//! One piece of paper: its facets, tabs and folds, and the line to cut.

use super::net::Net;
use crate::mesh::Mesh;
use glam::DVec2;
use rustc_hash::FxHashMap;

/// One piece of paper, in a frame of its own, mm, seen from the printed side.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piece {
    /// Facets with their polygons, counter-clockwise.
    pub facets: Vec<(u32, Vec<DVec2>)>,
    /// Tabs.
    pub tabs: Vec<Tab>,
    /// Edges to fold; those of angle 0 stay flat.
    pub folds: Vec<Fold>,
    /// Edges of facets that are glued to other edges.
    pub glue: Vec<Glue>,
    /// The line to cut: the outer loop counter-clockwise, holes clockwise. Tabs are inside.
    pub outline: Vec<Vec<DVec2>>,
    /// Its name on the sheets, from 1; copies that may take each other's place have one name.
    pub name: usize,
    /// Which of these copies it is, from 1.
    pub copy: usize,
    /// How many such copies there are.
    pub copies: usize,
    /// Place of the first piece with the same shape and folds, itself if there is none before. Its numbers may differ.
    pub like: usize,
}

/// A tab to be glued under a neighbour.
#[derive(Clone, Debug, PartialEq)]
pub struct Tab {
    /// The edge of the surface.
    pub edge: u32,
    /// The facet that it stands on.
    pub facet: u32,
    /// Its corners, counter-clockwise; the first two are the ends of the edge.
    pub corners: Vec<DVec2>,
}

impl Tab {
    /// How far it reaches from its edge, mm.
    pub fn width(&self) -> f64 {
        let along = (self.corners[1] - self.corners[0]).normalize_or_zero();
        self.corners[2..].iter().map(|p| along.perp_dot(*p - self.corners[0])).fold(0.0, f64::max)
    }
}

/// A fold within a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// The edge of the surface.
    pub edge: u32,
    /// Its ends.
    pub ends: [DVec2; 2],
    /// Fold angle, radians: valley positive.
    pub angle: f64,
}

/// An edge of a facet that is glued to its twin elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glue {
    /// The edge of the surface.
    pub edge: u32,
    /// Its number on the sheet, from 1.
    pub number: usize,
    /// The facet.
    pub facet: u32,
    /// Its ends, in the order of the facet.
    pub ends: [DVec2; 2],
    /// Whether the tab stands here.
    pub tab: bool,
}

impl Piece {
    pub(super) fn new(net: &Net<'_, '_>, facets: &[u32], number: &FxHashMap<u32, usize>) -> Self {
        let mesh = net.problem.mesh;
        let place = |f: u32, k: usize| net.pose[f as usize].apply(mesh.facets[f as usize].flat[k]);
        let mut piece = Self::default();
        for &f in facets {
            let facet = &mesh.facets[f as usize];
            let polygon: Vec<DVec2> = (0..facet.flat.len()).map(|k| place(f, k)).collect();
            for (k, &edge) in facet.edges.iter().enumerate() {
                let ends = [polygon[k], polygon[(k + 1) % polygon.len()]];
                let data = &mesh.edges[edge as usize];
                if data.sides[1].is_none() {
                    continue;
                }
                let side = usize::from(data.sides[0].is_none_or(|first| first.facet != f));
                if net.joined[edge as usize] {
                    if side == 0 {
                        piece.folds.push(Fold { edge, ends, angle: data.angle });
                    }
                    continue;
                }
                let tab = net.tab[edge as usize].filter(|t| usize::from(t.side) == side);
                piece.glue.push(Glue { edge, number: number[&edge], facet: f, ends, tab: tab.is_some() });
                if let Some(tab) = tab {
                    let shape = &net.problem.tabs.of(edge, side)[usize::from(tab.shape)];
                    let mut corners: Vec<DVec2> = shape.points().iter().map(|&p| net.pose[f as usize].apply(p)).collect();
                    // The base as the facet has it, to the last bit.
                    corners[0] = ends[1];
                    corners[1] = ends[0];
                    piece.tabs.push(Tab { edge, facet: f, corners });
                }
            }
            piece.facets.push((f, polygon));
        }
        piece.outline = outline(net, mesh, &piece);
        piece
    }

    /// Moves the piece: first turns by the unit vector `x`, then shifts.
    #[must_use]
    pub fn moved(&self, x: DVec2, shift: DVec2) -> Self {
        let m = |p: DVec2| p.x * x + p.y * x.perp() + shift;
        let mut out = self.clone();
        out.facets.iter_mut().flat_map(|(_, p)| p).for_each(|p| *p = m(*p));
        out.tabs.iter_mut().flat_map(|t| &mut t.corners).for_each(|p| *p = m(*p));
        out.folds.iter_mut().flat_map(|f| &mut f.ends).for_each(|p| *p = m(*p));
        out.glue.iter_mut().flat_map(|g| &mut g.ends).for_each(|p| *p = m(*p));
        out.outline.iter_mut().flatten().for_each(|p| *p = m(*p));
        out
    }
}

/// Follows the border of a piece: from each edge that is not joined to the next one round the corner, with tabs on the way.
///
/// Not by a union of the polygons: where two borders of a piece touch without being joined, a union would close the cut.
fn outline(net: &Net<'_, '_>, mesh: &Mesh, piece: &Piece) -> Vec<Vec<DVec2>> {
    let polygons: FxHashMap<u32, &[DVec2]> = piece.facets.iter().map(|(f, p)| (*f, p.as_slice())).collect();
    let tabs: FxHashMap<(u32, u32), &Tab> = piece.tabs.iter().map(|t| ((t.facet, t.edge), t)).collect();
    let open = |f: u32, k: usize| !net.joined[mesh.facets[f as usize].edges[k] as usize];
    let mut starts: Vec<(u32, usize)> = Vec::new();
    for (f, polygon) in &piece.facets {
        starts.extend((0..polygon.len()).filter(|&k| open(*f, k)).map(|k| (*f, k)));
    }
    let mut seen: std::collections::BTreeSet<(u32, usize)> = std::collections::BTreeSet::new();
    let mut loops = Vec::new();
    for start in starts {
        if seen.contains(&start) {
            continue;
        }
        let mut points = Vec::new();
        let (mut f, mut k) = start;
        while seen.insert((f, k)) {
            let polygon = polygons[&f];
            let n = polygon.len();
            points.push(polygon[k]);
            if let Some(tab) = tabs.get(&(f, mesh.facets[f as usize].edges[k])) {
                points.extend(&tab.corners[2..]);
            }
            // Round the end of this edge, over the joined edges there, to the next open one.
            k = (k + 1) % n;
            while !open(f, k) {
                let there = mesh.other(mesh.facets[f as usize].edges[k], f).expect("joined edges have two facets");
                f = there.facet;
                k = (there.place as usize + 1) % polygons[&f].len();
            }
        }
        loops.push(points);
    }
    loops.sort_by(|a, b| crate::polygon::area(b).abs().total_cmp(&crate::polygon::area(a).abs()));
    loops
}
