//! Parts of a surface that are one shape several times: rods on a ground, threads folded as tubes, studs that stand apart.
//!
//! Such a part is unfolded once. Its pieces are printed as often as the surface needs them, with the same numbers at their edges, so that
//! any copy may be used anywhere. Only whole connected parts count, since a piece within a part has neighbours of its own; and only turned and
//! shifted ones: a mirrored part has another net.

use super::pattern::Pattern;
use super::piece::Piece;
use crate::mesh::{Edge, Mesh, Side};
use glam::DVec2;
use rustc_hash::FxHashMap;

/// Lengths that differ by less are equal, of the surface's size: far below what the verifier's 1e-6 of an edge sees.
const SAME_LENGTH: f64 = 1e-9;
/// The same of fold angles, radians.
const SAME_ANGLE: f64 = 1e-7;

/// A facet of a copy that takes the place of one of the first part: corner `k` there is corner `k + turn` here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Twin {
    facet: u32,
    turn: u32,
}

/// Parts of one shape.
#[derive(Clone, Debug)]
struct RepeatedPart {
    /// Facets of the first part.
    facets: Vec<u32>,
    /// For each part the facets that take the places of those of the first; the first part itself is the first of them.
    copies: Vec<Vec<Twin>>,
}

/// A surface with one part of each kind, and how the others follow from it.
#[derive(Clone, Debug)]
pub struct Copies {
    /// The parts to unfold.
    pub once: Mesh,
    kinds: Vec<RepeatedPart>,
    /// For each facet of `once` its kind and its place there.
    place: Vec<(usize, usize)>,
    /// For each edge of `once` the edge of the whole surface.
    edges: Vec<u32>,
}

impl Copies {
    /// Finds the parts of `mesh` that are alike, colours included.
    pub fn find(mesh: &Mesh) -> Self {
        let tolerance = SAME_LENGTH * mesh.vertices.iter().map(|v| v.length()).fold(1.0, f64::max);
        let mut kinds: Vec<RepeatedPart> = Vec::new();
        let mut of_size: FxHashMap<usize, Vec<usize>> = FxHashMap::default();
        for part in mesh.components() {
            let same_size = of_size.entry(part.len()).or_default();
            let found = same_size.iter().find_map(|&k| Some((k, match_parts(mesh, &kinds[k].facets, &part, tolerance)?)));
            if let Some((k, twins)) = found {
                kinds[k].copies.push(twins);
            } else {
                same_size.push(kinds.len());
                let own = part.iter().map(|&facet| Twin { facet, turn: 0 }).collect();
                kinds.push(RepeatedPart { facets: part, copies: vec![own] });
            }
        }
        Self::of_kinds(mesh, kinds)
    }

    /// Every part on its own.
    pub fn none(mesh: &Mesh) -> Self {
        let own = |part: &Vec<u32>| part.iter().map(|&facet| Twin { facet, turn: 0 }).collect();
        let kinds = mesh.components().into_iter().map(|part| RepeatedPart { copies: vec![own(&part)], facets: part }).collect();
        Self::of_kinds(mesh, kinds)
    }

    fn of_kinds(mesh: &Mesh, kinds: Vec<RepeatedPart>) -> Self {
        let mut place = Vec::new();
        let mut facets: Vec<u32> = Vec::new();
        for (k, kind) in kinds.iter().enumerate() {
            facets.extend(&kind.facets);
            place.extend((0..kind.facets.len()).map(|j| (k, j)));
        }
        // In the order of the surface, so that a surface without copies is unfolded as it is.
        let mut order: Vec<usize> = (0..facets.len()).collect();
        order.sort_unstable_by_key(|&k| facets[k]);
        let place: Vec<(usize, usize)> = order.iter().map(|&k| place[k]).collect();
        let facets: Vec<u32> = order.iter().map(|&k| facets[k]).collect();
        let (once, edges) = part_of(mesh, &facets);
        Self { once, kinds, place, edges }
    }

    /// Whether some part stands there more than once.
    pub fn any(&self) -> bool {
        self.kinds.iter().any(|k| k.copies.len() > 1)
    }

    /// How often the part with an edge of `once` stands there.
    pub fn count(&self, edge: usize) -> usize {
        let facet = self.once.edges[edge].sides[0].expect("every edge has a facet").facet;
        self.kinds[self.place[facet as usize].0].copies.len()
    }

    /// The pattern of the whole surface from that of `once`: copies of a piece follow each other.
    pub fn expand(&self, mesh: &Mesh, pattern: Pattern) -> Pattern {
        let mut out = Pattern { flat_angle: pattern.flat_angle, ..Pattern::default() };
        let kind_of = |edge: u32| {
            let facet = self.once.edges[edge as usize].sides[0].expect("every edge has a facet").facet;
            self.place[facet as usize].0
        };
        for (edge, number) in pattern.glued {
            out.glued.extend((0..self.kinds[kind_of(edge)].copies.len()).map(|copy| (self.edge(mesh, edge, copy), number)));
        }
        for piece in pattern.pieces {
            let kind = self.place[piece.facets[0].0 as usize].0;
            let copies = self.kinds[kind].copies.len();
            out.pieces.extend((0..copies).map(|copy| Piece { copy: copy + 1, copies, ..self.copy_of(mesh, &piece, copy) }));
        }
        out.name_and_compare();
        out
    }

    fn twin(&self, facet: u32, copy: usize) -> Twin {
        let (kind, k) = self.place[facet as usize];
        self.kinds[kind].copies[copy][k]
    }

    /// The edge of the whole surface that takes the place of one of `once`.
    fn edge(&self, mesh: &Mesh, edge: u32, copy: usize) -> u32 {
        if copy == 0 {
            return self.edges[edge as usize];
        }
        let Side { facet, place } = self.once.edges[edge as usize].sides[0].expect("every edge has a facet");
        let twin = self.twin(facet, copy);
        let edges = &mesh.facets[twin.facet as usize].edges;
        edges[(place + twin.turn) as usize % edges.len()]
    }

    fn copy_of(&self, mesh: &Mesh, piece: &Piece, copy: usize) -> Piece {
        let mut out = piece.clone();
        for (facet, polygon) in &mut out.facets {
            let twin = self.twin(*facet, copy);
            *facet = twin.facet;
            polygon.rotate_right(twin.turn as usize);
        }
        for fold in &mut out.folds {
            let first = self.once.edges[fold.edge as usize].sides[0].expect("a fold has two facets").facet;
            fold.edge = self.edge(mesh, fold.edge, copy);
            // The ends stand in the order of the edge's first facet, which may be the other one here.
            if mesh.edges[fold.edge as usize].sides[0].is_none_or(|side| side.facet != self.twin(first, copy).facet) {
                fold.ends.reverse();
            }
        }
        for tab in &mut out.tabs {
            (tab.edge, tab.facet) = (self.edge(mesh, tab.edge, copy), self.twin(tab.facet, copy).facet);
        }
        for glue in &mut out.glue {
            (glue.edge, glue.facet) = (self.edge(mesh, glue.edge, copy), self.twin(glue.facet, copy).facet);
        }
        out
    }
}

/// Some whole parts of a surface as a surface of its own, and which edges they have. Its vertices stay those of the whole.
fn part_of(mesh: &Mesh, facets: &[u32]) -> (Mesh, Vec<u32>) {
    let mut edge_place = vec![u32::MAX; mesh.edges.len()];
    let mut facet_place = vec![u32::MAX; mesh.facets.len()];
    for (&f, k) in facets.iter().zip(0_u32..) {
        facet_place[f as usize] = k;
        mesh.facets[f as usize].edges.iter().for_each(|&e| edge_place[e as usize] = 0);
    }
    let edges: Vec<u32> = (0_u32..).zip(&edge_place).filter(|(_, p)| **p == 0).map(|(e, _)| e).collect();
    for (&e, k) in edges.iter().zip(0_u32..) {
        edge_place[e as usize] = k;
    }
    let facet = |&f: &u32| {
        let mut facet = mesh.facets[f as usize].clone();
        facet.edges.iter_mut().for_each(|e| *e = edge_place[*e as usize]);
        facet
    };
    let edge = |&e: &u32| {
        let edge = mesh.edges[e as usize];
        Edge { sides: edge.sides.map(|side| side.map(|s| Side { facet: facet_place[s.facet as usize], ..s })), ..edge }
    };
    let once = Mesh {
        vertices: mesh.vertices.clone(),
        facets: facets.iter().map(facet).collect(),
        edges: edges.iter().map(edge).collect(),
        notes: Vec::new(),
    };
    (once, edges)
}

/// How a part lies in another one: for each facet of `first` its twin in `second`; `None` if they are not alike.
fn match_parts(mesh: &Mesh, first: &[u32], second: &[u32], tolerance: f64) -> Option<Vec<Twin>> {
    let area = |part: &[u32]| part.iter().map(|&f| crate::polygon::area(&mesh.facets[f as usize].flat)).sum::<f64>();
    let (a, b) = (area(first), area(second));
    if (a - b).abs() > 1e-6 * a {
        return None;
    }
    // From the facet whose number of corners is rarest, few others have to be tried.
    let corners = |f: u32| mesh.facets[f as usize].corners.len();
    let rarity = |f: u32| first.iter().filter(|&&g| corners(g) == corners(f)).count();
    let start = if first.len() <= 64 { first.iter().copied().min_by_key(|&f| rarity(f))? } else { first[0] };
    let mut candidates: Vec<u32> = second.iter().copied().filter(|&g| corners(g) == corners(start)).collect();
    // Parts of one tile have their facets in one order: the twin is where the first is.
    if let Some(at) = first.iter().position(|&f| f == start) {
        let guess = second[at];
        candidates.sort_by_key(|&g| g != guess);
    }
    // Wrong places are mostly seen at once; two spheres of many equal facets would take long to be told apart.
    let mut steps = MOST_STEPS * first.len();
    candidates.into_iter().find_map(|g| {
        let n = u32::try_from(corners(g)).ok()?;
        (0..n).find_map(|turn| walk(mesh, first, start, Twin { facet: g, turn }, tolerance, &mut steps))
    })
}

/// Facets that are looked at, for each facet of a part, before two parts count as different: bounds the time. Chosen, not measured.
const MOST_STEPS: usize = 50;

/// Follows the neighbours of both parts from one pair of facets; `None` where they differ.
fn walk(mesh: &Mesh, first: &[u32], start: u32, twin: Twin, tolerance: f64, steps: &mut usize) -> Option<Vec<Twin>> {
    let mut twins: FxHashMap<u32, Twin> = FxHashMap::default();
    let mut taken: FxHashMap<u32, u32> = FxHashMap::default();
    twins.insert(start, twin);
    taken.insert(twin.facet, start);
    let mut queue = vec![start];
    while let Some(f) = queue.pop() {
        let here = twins[&f];
        *steps = steps.checked_sub(1)?;
        if !same_facet(mesh, f, here, tolerance) {
            return None;
        }
        let (own, other) = (&mesh.facets[f as usize].edges, &mesh.facets[here.facet as usize].edges);
        for (k, &edge) in own.iter().enumerate() {
            let edge_there = other[(k + here.turn as usize) % other.len()];
            let (a, b) = (mesh.other(edge, f), mesh.other(edge_there, here.facet));
            let (Side { facet: g, place: j }, Side { facet: h, place: l }) = match (a, b) {
                (None, None) => continue,
                (Some(a), Some(b)) => (a, b),
                _ => return None,
            };
            if (mesh.edges[edge as usize].angle - mesh.edges[edge_there as usize].angle).abs() > SAME_ANGLE {
                return None;
            }
            let n = u32::try_from(mesh.facets[g as usize].corners.len()).ok()?;
            if mesh.facets[h as usize].corners.len() != n as usize {
                return None;
            }
            let next = Twin { facet: h, turn: (l + n - j) % n };
            match twins.get(&g) {
                Some(known) if *known == next => {}
                Some(_) => return None,
                None if taken.contains_key(&h) => return None,
                None => {
                    twins.insert(g, next);
                    taken.insert(h, g);
                    queue.push(g);
                }
            }
        }
    }
    first.iter().map(|f| twins.get(f).copied()).collect()
}

/// Whether two facets have one shape and colour: all corners in the frame of the first edge.
fn same_facet(mesh: &Mesh, f: u32, twin: Twin, tolerance: f64) -> bool {
    let (a, b) = (&mesh.facets[f as usize], &mesh.facets[twin.facet as usize]);
    let n = a.flat.len();
    let corner = |flat: &[DVec2], first: usize, k: usize| {
        let (o, x) = (flat[first % n], (flat[(first + 1) % n] - flat[first % n]).normalize_or_zero());
        let r = flat[(first + k) % n] - o;
        DVec2::new(x.dot(r), x.perp_dot(r))
    };
    let shift = twin.turn as usize;
    a.colour == b.colour && (1..n).all(|k| corner(&a.flat, 0, k).distance(corner(&b.flat, shift, k)) <= tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Tolerance, Triangles};
    use glam::DVec3;

    /// Open tetrahedra (three sides over a base) at places, each turned about z; mirrored where `mirror` says so.
    fn tents(places: &[(f64, f64, f64, bool)]) -> Mesh {
        let mut soup = Triangles::default();
        for &(x, y, turn, mirror) in places {
            let k = u32::try_from(soup.vertices.len()).unwrap();
            for v in [DVec3::ZERO, DVec3::new(12.0, 0.0, 0.0), DVec3::new(3.0, 9.0, 0.0), DVec3::new(5.0, 3.0, 7.0)] {
                let v = if mirror { DVec3::new(-v.x, v.y, v.z) } else { v };
                soup.vertices.push(glam::DMat3::from_rotation_z(turn) * v + DVec3::new(x, y, 0.0));
            }
            for t in [[0, 1, 3], [1, 2, 3], [2, 0, 3]] {
                soup.triangles.push(if mirror { [t[0], t[2], t[1]] } else { t }.map(|c: u32| c + k));
            }
        }
        soup.colours = vec![[1.0; 3]; soup.triangles.len()];
        let tolerance = Tolerance::of_size(soup.size());
        Mesh::new(soup, tolerance).unwrap()
    }

    #[test]
    fn turned_parts_are_copies_and_mirrored_ones_are_not() {
        let mesh = tents(&[(0.0, 0.0, 0.0, false), (40.0, 0.0, 0.7, false), (0.0, 50.0, 0.0, true), (60.0, 60.0, -2.1, false)]);
        let copies = Copies::find(&mesh);
        assert_eq!(copies.kinds.iter().map(|k| k.copies.len()).collect::<Vec<_>>(), [3, 1]);
        assert_eq!(copies.once.facets.len(), 6);
    }

    #[test]
    fn a_part_that_differs_in_colour_or_by_a_hair_is_unfolded_on_its_own() {
        let mut mesh = tents(&[(0.0, 0.0, 0.0, false), (40.0, 0.0, 0.0, false), (80.0, 0.0, 0.0, false)]);
        mesh.facets[4].colour = [0.5; 3];
        mesh.facets[7].flat[0].x += 1e-4;
        let copies = Copies::find(&mesh);
        assert_eq!(copies.kinds.len(), 3);
        assert!(!copies.any());
    }
}
