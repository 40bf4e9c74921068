//! What a pattern makes of every edge of the design: whole paper, or two sides that are glued.

use super::read_pattern::{ReadPattern, SAME};
use crate::mesh::Mesh;
use glam::DVec2;
use rustc_hash::{FxHashMap, FxHashSet};

/// How the pattern treats the design's edges.
#[derive(Clone, Debug, Default)]
pub(super) struct Sides {
    /// For each facet of the design its place in what was read.
    pub(super) place: FxHashMap<u32, usize>,
    /// For each edge of the design whether its paper is whole.
    pub(super) joined: Vec<bool>,
}

impl Sides {
    /// From what was read: an edge is whole where both of its facets are in one piece, its ends lie in one place, and no line is cut there. Two
    /// other edges that come to lie on each other in the plane are cut, whatever lies beside them.
    pub(super) fn new(seen: &ReadPattern, design: &Mesh) -> Self {
        let place: FxHashMap<u32, usize> = seen.facets.iter().enumerate().map(|(k, f)| (f.facet, k)).collect();
        let cut = cut_segments(seen);
        let joined = design.edges.iter().enumerate().map(|(e, edge)| {
            let [Some(first), Some(second)] = edge.sides else { return false };
            let (Some(&i), Some(&j)) = (place.get(&first.facet), place.get(&second.facet)) else { return false };
            let (f, g) = (&seen.facets[i], &seen.facets[j]);
            let ends = |polygon: &[DVec2], k: u32| [polygon[k as usize], polygon[(k as usize + 1) % polygon.len()]];
            let ([a, b], [c, d]) = (ends(&f.polygon, first.place), ends(&g.polygon, second.place));
            if let Some(joined) = &seen.joined {
                return u32::try_from(e).is_ok_and(|e| joined.contains(&e));
            }
            let whole = f.piece == g.piece && f.page == g.page && a.distance(d) < SAME && b.distance(c) < SAME;
            let tab = seen.tabs.iter().any(|t| t.edge as usize == e);
            whole && !tab && !cut.contains(&key(f.page, a, b)) && !cut.contains(&key(g.page, c, d))
        });
        let joined = joined.collect();
        Self { place, joined }
    }
}

/// A segment of a page to a millionth of a millimetre, in its direction: corners of facets and of cut lines are written with the same digits.
fn key(page: usize, a: DVec2, b: DVec2) -> (usize, [i64; 4]) {
    (page, [a.x, a.y, b.x, b.y].map(|x| (x * 1e6).round() as i64))
}

fn cut_segments(seen: &ReadPattern) -> FxHashSet<(usize, [i64; 4])> {
    seen.outlines.iter().flat_map(|(page, o)| (0..o.len()).map(|k| key(*page, o[k], o[(k + 1) % o.len()]))).collect()
}

impl Sides {
    /// What is wrong with the names of the pieces: facets whose paper is whole between them are one piece, others are not.
    pub(super) fn pieces(&self, seen: &ReadPattern, design: &Mesh) -> Vec<String> {
        let mut part: Vec<usize> = (0..seen.facets.len()).collect();
        fn root(part: &mut [usize], mut k: usize) -> usize {
            while part[k] != k {
                part[k] = part[part[k]];
                k = part[k];
            }
            k
        }
        let mut wrong = Vec::new();
        for (e, edge) in design.edges.iter().enumerate().filter(|(e, _)| self.joined[*e]) {
            let [Some(f), Some(g)] = edge.sides else { continue };
            let (Some(&i), Some(&j)) = (self.place.get(&f.facet), self.place.get(&g.facet)) else { continue };
            if seen.facets[i].piece != seen.facets[j].piece {
                wrong.push(format!("facets {} and {} are one paper at edge {e} and have the names of two pieces", f.facet, g.facet));
            }
            let (a, b) = (root(&mut part, i), root(&mut part, j));
            part[a.max(b)] = a.min(b);
        }
        let mut first: FxHashMap<[u32; 2], usize> = FxHashMap::default();
        for (k, facet) in seen.facets.iter().enumerate() {
            let own = root(&mut part, k);
            if *first.entry(facet.piece).or_insert(own) != own {
                wrong.push(format!("facet {} has the name of piece {}, which is another paper", facet.facet, facet.piece[0]));
            }
        }
        let names: std::collections::BTreeSet<u32> = seen.facets.iter().map(|f| f.piece[0]).collect();
        if names.iter().copied().ne(1..=u32::try_from(names.len()).unwrap_or(u32::MAX)) {
            wrong.push("the names of the pieces are not 1, 2, 3 and so on".to_owned());
        }
        wrong.truncate(3);
        wrong
    }

    /// What is wrong with the edges that a file without pages names: each is the design's, and glued ones have numbers on both sides.
    pub(super) fn named(&self, seen: &ReadPattern, design: &Mesh) -> Vec<String> {
        let mut wrong = Vec::new();
        for &(edge, facet, corner) in &seen.sides {
            let known = design.facets.get(facet as usize).and_then(|f| f.edges.get(corner)).copied();
            if known != Some(edge) {
                wrong.push(format!("edges_biscale:edge: side {corner} of facet {facet} is edge {edge} and in the design {known:?}"));
            }
        }
        let mut numbered: FxHashMap<u32, usize> = FxHashMap::default();
        seen.numbers.iter().for_each(|n| *numbered.entry(n.0).or_default() += 1);
        for (e, edge) in (0_u32..).zip(&design.edges) {
            let glued = edge.sides[1].is_some() && !self.joined[e as usize];
            let sides = numbered.get(&e).copied().unwrap_or(0);
            if sides != 2 * usize::from(glued) {
                wrong.push(format!("edges_biscale:number: edge {e} is {}glued and has {sides} numbers", if glued { "" } else { "not " }));
            }
        }
        wrong.truncate(3);
        wrong
    }
}
