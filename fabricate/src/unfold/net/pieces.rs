//! A net in the making: which facet lies where, in which piece, and the tab of every edge that is glued.
//!
//! All changes are moves (see [`Move`](super::moves::Move)): a part of a piece is taken off and laid at another place. A move is done only if no
//! facet and no tab meets another one and every glued edge has a tab afterwards; otherwise everything is as before. So a net has
//! no overlap at any time.

use super::pose::Pose;
use super::problem::Problem;
use super::span::Span;
use crate::polygon::Convex;
use rustc_hash::FxHashMap;

/// The tab of a glued edge: the side that it stands on and its shape there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TabChoice {
    /// 0 or 1.
    pub side: u8,
    /// Place in [`TabShapes::of`](crate::unfold::tab_shapes::TabShapes::of).
    pub shape: u8,
}

/// Corners of two placed facets closer than this are one point of the net, mm: above the rounding of many moves, see [`Net::rebuild`],
/// and as far as borders may overlap, [`crate::polygon::TOUCH`].
const COINCIDENT: f64 = 1e-6;

/// A net: a partition of the facets into pieces, each laid out flat.
#[derive(Clone, Debug)]
pub struct Net<'p, 'a> {
    /// What it is a net of.
    pub problem: &'p Problem<'a>,
    /// For each facet its piece.
    pub piece: Vec<u32>,
    /// For each facet its place in the piece's frame.
    pub pose: Vec<Pose>,
    /// For each edge whether the pieces' trees run over it.
    pub tree: Vec<bool>,
    /// For each edge whether the paper is whole there: the facets on both sides lie edge to edge.
    pub joined: Vec<bool>,
    /// The tab of each edge that is glued.
    pub tab: Vec<Option<TabChoice>>,
    /// Facets of each piece; 0 for a number that is free.
    pub size: Vec<u32>,
    /// Pieces that have facets.
    pub pieces: usize,
    /// Collision tests made so far: the measure of effort.
    pub work: u64,
    polygons: Vec<Convex>,
    grid: FxHashMap<u64, Vec<u32>>,
    /// How far each piece reaches.
    pub(super) spans: Vec<Span>,
    pub(super) mark: Vec<u32>,
    pub(super) stamp: u32,
    pub(super) visited: Vec<u32>,
    pub(super) visits: u32,
    pub(super) scratch: Scratch,
}

/// Lists that moves use again and again.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub(super) part: Vec<u32>,
    pub(super) queue: Vec<u32>,
    pub(super) poses: Vec<Pose>,
    pub(super) old: Vec<Pose>,
    pub(super) dirty: Vec<u32>,
    pub(super) tabs_before: Vec<(u32, Option<TabChoice>, bool)>,
}

/// Marks the items of the collision grid that are tabs, by their edges.
pub(super) const TAB: u32 = 1 << 31;

impl<'p, 'a> Net<'p, 'a> {
    /// Every facet a piece of its own.
    pub fn new(problem: &'p Problem<'a>) -> Self {
        let mesh = problem.mesh;
        let (facets, edges) = (mesh.facets.len(), mesh.edges.len());
        let mut net = Self {
            problem,
            piece: (0..u32::try_from(facets).expect("at most MAX_FACETS")).collect(),
            pose: vec![Pose::IDENTITY; facets],
            tree: vec![false; edges],
            joined: vec![false; edges],
            tab: vec![None; edges],
            size: vec![1; facets],
            pieces: facets,
            work: 0,
            polygons: vec![Convex::default(); problem.facet_of_item.len() + edges],
            grid: FxHashMap::default(),
            spans: vec![Span::EMPTY; facets],
            mark: vec![0; facets],
            stamp: 0,
            visited: vec![0; facets],
            visits: 0,
            scratch: Scratch::default(),
        };
        for f in 0..net.piece.len() {
            net.spans[f].add(&mesh.facets[f], &Pose::IDENTITY);
            net.insert_facet(u32::try_from(f).expect("at most MAX_FACETS"));
        }
        for e in 0..u32::try_from(edges).expect("few") {
            // A lone facet has place for all of its tabs, but for odd shapes; those stay without until a move finds place.
            net.give_tab(e);
        }
        net
    }

    /// Areas of the least boxes of all pieces together, mm².
    pub fn boxes(&self) -> f64 {
        self.spans.iter().map(Span::least_box).sum()
    }

    /// Glued edges without a place for a tab.
    pub fn without_tab(&self) -> impl Iterator<Item = usize> + '_ {
        let inner = |e: &usize| self.problem.mesh.edges[*e].sides[1].is_some();
        (0..self.tab.len()).filter(inner).filter(|&e| !self.joined[e] && self.tab[e].is_none())
    }

    fn item_polygon(&self, item: u32) -> &Convex {
        let k = if item & TAB == 0 { item as usize } else { self.problem.facet_of_item.len() + (item & !TAB) as usize };
        &self.polygons[k]
    }

    fn cells(&self, piece: u32, shape: &Convex) -> impl Iterator<Item = u64> + use<> {
        let [low, high] = shape.bounds();
        let inverse = 1.0 / self.problem.cell;
        let cell = |x: f64| (x * inverse).floor() as i64;
        let (x0, x1, y0, y1) = (cell(low.x), cell(high.x), cell(low.y), cell(high.y));
        let key = move |x: i64, y: i64| u64::from(piece) << 44 | ((x & 0x3f_ffff).cast_unsigned() << 22) | (y & 0x3f_ffff).cast_unsigned();
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| key(x, y)))
    }

    fn insert(&mut self, piece: u32, item: u32) {
        let shape = *self.item_polygon(item);
        for key in self.cells(piece, &shape) {
            self.grid.entry(key).or_default().push(item);
        }
    }

    fn remove(&mut self, piece: u32, item: u32) {
        let shape = *self.item_polygon(item);
        for key in self.cells(piece, &shape) {
            let list = self.grid.get_mut(&key).expect("the item is there");
            let k = list.iter().position(|&i| i == item).expect("the item is there");
            list.swap_remove(k);
        }
    }

    /// The items of a piece that a shape overlaps, until `stop` says enough.
    pub(super) fn each_overlap(&mut self, piece: u32, shape: &Convex, mut stop: impl FnMut(&Self, u32) -> bool) -> bool {
        let mut tests = 0;
        let mut found = false;
        let [low, high] = shape.bounds();
        'cells: for key in self.cells(piece, shape) {
            for &item in self.grid.get(&key).map_or(&[][..], Vec::as_slice) {
                tests += 1;
                let other = self.item_polygon(item);
                let [l, h] = other.bounds();
                let apart = l.x > high.x || l.y > high.y || h.x < low.x || h.y < low.y;
                if !apart && shape.overlaps(other) && stop(self, item) {
                    found = true;
                    break 'cells;
                }
            }
        }
        self.work += 1 + tests;
        found
    }

    pub(super) fn insert_facet(&mut self, facet: u32) {
        let problem = self.problem;
        let (pose, shape) = (self.pose[facet as usize], &problem.mesh.facets[facet as usize]);
        for (item, t) in problem.items(facet).zip(&shape.fill) {
            self.polygons[item as usize] = Convex::new(&t.map(|c| pose.apply(shape.flat[c as usize])));
            self.insert(self.piece[facet as usize], item);
        }
    }

    pub(super) fn remove_facet(&mut self, facet: u32) {
        for item in self.problem.items(facet) {
            self.remove(self.piece[facet as usize], item);
        }
    }

    pub(super) fn take_tab(&mut self, edge: u32) {
        if let Some(tab) = self.tab[edge as usize].take() {
            let facet = self.problem.facet_at(edge, tab.side.into()).expect("a tab stands on a facet");
            self.remove(self.piece[facet as usize], TAB | edge);
        }
    }

    pub(super) fn put_tab(&mut self, edge: u32, tab: TabChoice) {
        let facet = self.problem.facet_at(edge, tab.side.into()).expect("a tab stands on a facet");
        let shape = self.problem.tabs.of(edge, tab.side.into())[usize::from(tab.shape)];
        let k = self.problem.facet_of_item.len() + edge as usize;
        self.polygons[k] = self.pose[facet as usize].convex(&shape);
        self.insert(self.piece[facet as usize], TAB | edge);
        self.tab[edge as usize] = Some(tab);
    }

    /// Gives an edge the best tab that has place on either side.
    pub(super) fn give_tab(&mut self, edge: u32) -> bool {
        let problem = self.problem;
        let sides = [problem.tabs.of(edge, 0), problem.tabs.of(edge, 1)];
        let longest = sides[0].len().max(sides[1].len());
        for shape in 0..longest {
            for side in 0..2 {
                let Some(local) = sides[side].get(shape) else { continue };
                let facet = problem.facet_at(edge, side).expect("inner edge");
                let placed = self.pose[facet as usize].convex(local);
                let own = problem.items(facet);
                // The facet that a tab stands on lies on the other side of the edge, unless it is not convex.
                if !self.each_overlap(self.piece[facet as usize], &placed, |_, item| !own.contains(&item) || own.len() > 2) {
                    self.put_tab(edge, TabChoice { side: u8::from(side == 1), shape: u8::try_from(shape).expect("few shapes") });
                    return true;
                }
            }
        }
        false
    }

    /// Whether the facets of an edge lie edge to edge in one piece.
    pub(super) fn coincides(&self, edge: u32) -> bool {
        let problem = self.problem;
        let (Some(f), Some(g)) = (problem.facet_at(edge, 0), problem.facet_at(edge, 1)) else { return false };
        if self.piece[f as usize] != self.piece[g as usize] {
            return false;
        }
        let [a, b] = problem.local_edge(edge, 0).map(|p| self.pose[f as usize].apply(p));
        let [c, d] = problem.local_edge(edge, 1).map(|p| self.pose[g as usize].apply(p));
        a.distance_squared(c) < COINCIDENT * COINCIDENT && b.distance_squared(d) < COINCIDENT * COINCIDENT
    }

    /// Lays the net out anew along `tree` with these tabs; rounding of many moves is gone then.
    pub fn rebuild(&mut self, tree: &[bool], tab: &[Option<TabChoice>]) {
        let problem = self.problem;
        let mesh = problem.mesh;
        let facets = mesh.facets.len();
        self.grid.clear();
        self.spans.fill(Span::EMPTY);
        self.tree.copy_from_slice(tree);
        self.tab.fill(None);
        self.size.fill(0);
        self.pieces = 0;
        let mut seen = vec![false; facets];
        for start in 0..facets {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            let id = u32::try_from(start).expect("at most MAX_FACETS");
            self.pieces += 1;
            self.pose[start] = Pose::IDENTITY;
            let mut queue = vec![id];
            let mut k = 0;
            while k < queue.len() {
                let f = queue[k];
                self.piece[f as usize] = id;
                self.size[start] += 1;
                for &e in &mesh.facets[f as usize].edges {
                    if !self.tree[e as usize] {
                        continue;
                    }
                    let side = problem.side_of(e, f);
                    let g = problem.facet_at(e, 1 - side).expect("tree edges are inner");
                    if !std::mem::replace(&mut seen[g as usize], true) {
                        let to = problem.local_edge(e, side).map(|p| self.pose[f as usize].apply(p));
                        self.pose[g as usize] = Pose::mapping(problem.local_edge(e, 1 - side), to);
                        queue.push(g);
                    }
                }
                k += 1;
            }
        }
        for f in 0..facets {
            self.spans[self.piece[f] as usize].add(&mesh.facets[f], &self.pose[f]);
            self.insert_facet(u32::try_from(f).expect("at most MAX_FACETS"));
        }
        for (e, edge) in (0_u32..).zip(&mesh.edges) {
            self.joined[e as usize] = edge.sides[1].is_some() && (self.tree[e as usize] || self.coincides(e));
            if let (Some(tab), false) = (tab[e as usize], self.joined[e as usize]) {
                self.put_tab(e, tab);
            }
        }
    }
}
