//! The surface of facets, and what can be asked of it.

use super::adjacency::{Edge, Side};
use super::facet::{Facet, width};
use super::triangles::under;
use glam::DVec3;
use std::collections::BTreeMap;

/// A surface of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Positions, mm.
    pub vertices: Vec<DVec3>,
    /// The facets.
    pub facets: Vec<Facet>,
    /// The edges.
    pub edges: Vec<Edge>,
    /// What the user should know.
    pub notes: Vec<String>,
}

impl Mesh {
    /// Position of a corner of a facet.
    pub fn corner(&self, facet: usize, corner: usize) -> DVec3 {
        self.vertices[self.facets[facet].corners[corner] as usize]
    }

    /// Length of an edge, mm.
    pub fn length(&self, edge: usize) -> f64 {
        let [a, b] = self.edges[edge].ends.map(|v| self.vertices[v as usize]);
        a.distance(b)
    }

    /// Loops of border edges: 0 for a closed surface.
    pub fn border_loops(&self) -> usize {
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for e in self.edges.iter().filter(|e| e.sides[1].is_none()) {
            next.entry(e.ends[0]).or_default().push(e.ends[1]);
        }
        let mut loops = 0;
        while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
            let mut at = start;
            while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
                at = to;
            }
            loops += 1;
        }
        loops
    }

    /// The connected parts, as lists of facets.
    pub fn components(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.facets.len()];
        let mut parts = Vec::new();
        for start in 0..self.facets.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            let mut part = vec![u32::try_from(start).expect("at most MAX_FACETS")];
            let mut k = 0;
            while k < part.len() {
                for (_, g) in self.neighbours(part[k]) {
                    if !std::mem::replace(&mut seen[g as usize], true) {
                        part.push(g);
                    }
                }
                k += 1;
            }
            parts.push(part);
        }
        parts
    }

    /// Edges of a facet that have another facet behind them, with that facet.
    pub fn neighbours(&self, facet: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.facets[facet as usize].edges.iter().filter_map(move |&e| self.other(e, facet).map(|side| (e, side.facet)))
    }

    /// What lies on the other side of an edge of a facet.
    pub fn other(&self, edge: u32, facet: u32) -> Option<Side> {
        match self.edges[edge as usize].sides {
            [Some(own), other] | [other, Some(own)] if own.facet == facet => other,
            _ => None,
        }
    }

    /// Volume between the surface and a plane through its lowest point, mm³; inside it, if it is closed.
    pub fn volume(&self) -> f64 {
        let base = self.vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        let of =
            |(f, facet): (usize, &Facet)| facet.fill.iter().map(move |t| under(t.map(|c| self.corner(f, c as usize)), base)).sum::<f64>();
        self.facets.iter().enumerate().map(of).sum()
    }

    /// The smallest height of a facet over one of its edges, mm, and that facet.
    pub fn narrowest(&self) -> (f64, usize) {
        let mut least = (f64::INFINITY, 0);
        for (k, facet) in self.facets.iter().enumerate() {
            let width = width(&facet.flat);
            if width < least.0 {
                least = (width, k);
            }
        }
        least
    }
}
