//! The pieces of a net, ready to be drawn: outlines, tabs, folds, and which edge is glued to which.

use crate::mesh::Mesh;
use crate::unfold::net::{Net, Pose};
use glam::DVec2;
use rustc_hash::FxHashMap;

/// Pieces of paper that together make the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pattern {
    /// The pieces, largest first, copies one after another.
    pub pieces: Vec<Piece>,
    /// Edges of the surface that are glued, with their numbers, from 1. Copies of a piece have the same numbers.
    pub glued: Vec<(u32, usize)>,
}

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

impl Pattern {
    /// Gathers the pieces of a net.
    pub fn new(net: &Net<'_, '_>) -> Self {
        let mesh = net.problem.mesh;
        let mut place: FxHashMap<u32, usize> = FxHashMap::default();
        let mut lists: Vec<Vec<u32>> = Vec::new();
        for (f, &piece) in (0_u32..).zip(&net.piece) {
            let k = *place.entry(piece).or_insert_with(|| {
                lists.push(Vec::new());
                lists.len() - 1
            });
            lists[k].push(f);
        }
        lists.sort_by(|a, b| b.len().cmp(&a.len()).then(a[0].cmp(&b[0])));
        let mut number: FxHashMap<u32, usize> = FxHashMap::default();
        let mut glued = Vec::new();
        // Numbers rise along the pieces, so that a person finds them.
        for &f in lists.iter().flatten() {
            for (edge, _) in mesh.neighbours(f) {
                if !net.joined[edge as usize] {
                    number.entry(edge).or_insert_with(|| {
                        glued.push((edge, glued.len() + 1));
                        glued.len()
                    });
                }
            }
        }
        let mut out = Self { pieces: lists.iter().map(|facets| Piece::new(net, facets, &number)).collect(), glued };
        for (k, piece) in out.pieces.iter_mut().enumerate() {
            (piece.name, piece.copy, piece.copies) = (k + 1, 1, 1);
        }
        out.name_and_compare();
        out
    }

    /// Names the pieces by their places, but for copies, and finds those of one shape.
    pub(crate) fn name_and_compare(&mut self) {
        let mut name = 0;
        for piece in &mut self.pieces {
            name += usize::from(piece.copy == 1);
            piece.name = name;
        }
        // The first pieces of each shape, by what is cheap to compare.
        let mut first: FxHashMap<[usize; 3], Vec<usize>> = FxHashMap::default();
        for k in 0..self.pieces.len() {
            let piece = &self.pieces[k];
            let list = first.entry([piece.facets.len(), piece.folds.len(), piece.tabs.len()]).or_default();
            let like = if piece.copy > 1 { Some(self.pieces[k - 1].like) } else { None };
            let like = like.or_else(|| list.iter().copied().find(|&j| alike(&self.pieces[j], piece)));
            self.pieces[k].like = like.unwrap_or_else(|| {
                list.push(k);
                k
            });
        }
    }

    /// How many pieces are like this one, itself included.
    pub fn alike(&self, piece: usize) -> usize {
        self.pieces.iter().filter(|p| p.like == self.pieces[piece].like).count()
    }
}

/// Lengths that differ by less are one shape to scissors, mm.
const SAME_SHAPE: f64 = 1e-4;

/// Whether two pieces are one shape with the same folds and tabs: some motion brings every facet, fold and tab of one onto one of the other.
fn alike(a: &Piece, b: &Piece) -> bool {
    let length = |p: &Piece| p.outline.iter().map(|o| (0..o.len()).map(|k| o[k].distance(o[(k + 1) % o.len()])).sum::<f64>()).sum::<f64>();
    if (length(a) - length(b)).abs() > SAME_SHAPE * 10.0 {
        return false;
    }
    let (_, first) = &a.facets[0];
    let marks_of_b = Marks::new(b);
    let own = Marks::list(a);
    b.facets.iter().filter(|(_, q)| q.len() == first.len()).any(|(_, q)| {
        (0..q.len()).any(|turn| {
            let ends = [q[turn], q[(turn + 1) % q.len()]];
            if (ends[0].distance(ends[1]) - first[0].distance(first[1])).abs() > SAME_SHAPE {
                return false;
            }
            let pose = Pose::mapping([first[0], first[1]], ends);
            own.iter().all(|&(at, what)| marks_of_b.has(pose.apply(at), what))
        })
    })
}

/// Points of a piece with what they are: corners of facets and tabs, middles of folds with their angles.
struct Marks(FxHashMap<[i64; 2], Vec<(DVec2, f64)>>);

impl Marks {
    /// Marks of corners: beyond all angles.
    const CORNER: f64 = 10.0;
    const TAB: f64 = 20.0;

    fn list(piece: &Piece) -> Vec<(DVec2, f64)> {
        let corners = piece.facets.iter().flat_map(|(_, p)| p).map(|&p| (p, Self::CORNER));
        let tabs = piece.tabs.iter().flat_map(|t| &t.corners).map(|&p| (p, Self::TAB));
        let folds = piece.folds.iter().map(|f| (0.5 * (f.ends[0] + f.ends[1]), f.angle));
        corners.chain(tabs).chain(folds).collect()
    }

    fn cell(p: DVec2) -> [i64; 2] {
        (p / 1e-2).floor().to_array().map(|x| x as i64)
    }

    fn new(piece: &Piece) -> Self {
        let mut out: FxHashMap<[i64; 2], Vec<(DVec2, f64)>> = FxHashMap::default();
        for (at, what) in Self::list(piece) {
            out.entry(Self::cell(at)).or_default().push((at, what));
        }
        Self(out)
    }

    fn has(&self, p: DVec2, what: f64) -> bool {
        let [x, y] = Self::cell(p);
        let mut near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy])).flat_map(|c| self.0.get(&c).into_iter().flatten());
        near.any(|&(q, w)| p.distance(q) <= SAME_SHAPE && (w - what).abs() <= 1e-6)
    }
}

impl Piece {
    fn new(net: &Net<'_, '_>, facets: &[u32], number: &FxHashMap<u32, usize>) -> Self {
        let mesh = net.problem.mesh;
        let place = |f: u32, k: usize| net.pose[f as usize].apply(mesh.facets[f as usize].flat[k]);
        let mut piece = Self::default();
        for &f in facets {
            let facet = &mesh.facets[f as usize];
            let polygon: Vec<DVec2> = (0..facet.flat.len()).map(|k| place(f, k)).collect();
            for (k, &edge) in facet.edges.iter().enumerate() {
                let ends = [polygon[k], polygon[(k + 1) % polygon.len()]];
                let data = &mesh.edges[edge as usize];
                let Some((_, _)) = data.sides[1] else { continue };
                let side = usize::from(data.sides[0].is_none_or(|(g, _)| g != f));
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
                let (g, j) = mesh.other(mesh.facets[f as usize].edges[k], f).expect("joined edges have two facets");
                f = g;
                k = (j as usize + 1) % polygons[&g].len();
            }
        }
        loops.push(points);
    }
    loops.sort_by(|a, b| crate::polygon::area(b).abs().total_cmp(&crate::polygon::area(a).abs()));
    loops
}
