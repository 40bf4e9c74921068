//! Numbers at glued edges: a person glues what has one number.

use super::read_pattern::ReadPattern;
use crate::mesh::Mesh;
use std::collections::{BTreeMap, BTreeSet};

/// How many glued edges have a number, and how many of these are wrong: another number on the other side, or one that also stands at an
/// edge between other pieces. Copies of a piece, which may take each other's place, share their numbers.
pub fn check(seen: &ReadPattern, design: &Mesh) -> (usize, usize) {
    let piece_of: BTreeMap<u32, [u32; 2]> = seen.facets.iter().map(|f| (f.facet, f.piece)).collect();
    let mut sides: BTreeMap<u32, Vec<(u32, &str)>> = BTreeMap::new();
    for (edge, facet, number) in &seen.numbers {
        sides.entry(*edge).or_default().push((*facet, number));
    }
    let mut wrong = 0;
    // For each number the edges that have it: the names of the pieces on both sides, and their copies.
    let mut of_number: BTreeMap<&str, BTreeSet<[u32; 2]>> = BTreeMap::new();
    let mut copies: BTreeSet<(&str, [u32; 2])> = BTreeSet::new();
    for (edge, list) in &sides {
        let facets = design.edges.get(*edge as usize).map(|e| e.sides.map(|s| s.map(|side| side.facet)));
        let Some([Some(f), Some(g)]) = facets else {
            wrong += 1;
            continue;
        };
        let (Some(&[p, i]), Some(&[q, j])) = (piece_of.get(&f), piece_of.get(&g)) else {
            wrong += 1;
            continue;
        };
        let number = list[0].1;
        let once = list.len() <= 2 && (list.len() < 2 || list[0].0 != list[1].0);
        let beside = list.iter().all(|(facet, n)| (*facet == f || *facet == g) && *n == number);
        let names = of_number.entry(number).or_default();
        names.insert([p.min(q), p.max(q)]);
        let fresh = copies.insert((number, if p <= q { [i, j] } else { [j, i] }));
        wrong += usize::from(!(once && beside && fresh && names.len() == 1));
    }
    (sides.len(), wrong)
}
