//! The one kind of change of a net: a part of a piece is taken off and laid at another place, across an edge.

use super::pieces::{Net, TAB, TabChoice};
use super::pose::Pose;
use super::span::Span;
use crate::polygon::Convex;
use glam::DVec2;

/// Facets of a part up to which a list of its edges is looked through for each new one: only speed depends on it.
const SHORT_LIST: usize = 32;

/// What a move does.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// The edge across which the part is laid.
    pub across: u32,
    /// Side of the edge (0 or 1) whose facet moves.
    pub moving: usize,
    /// Tree edge at which the part is taken off its piece; none moves the whole piece.
    pub cut: Option<u32>,
    /// Most facets that may move.
    pub limit: usize,
}

/// What a move would change.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Facets that change their piece: 0 within one.
    pub moved: u32,
    /// Sizes of the piece that they leave and of that they come to, facets.
    pub sizes: [u32; 2],
    /// Change of the areas of the least boxes of both pieces together, mm².
    pub boxes: f64,
}

/// Why a move was not made, or how many facets it moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Done: facets moved.
    Done(usize),
    /// The part would be too large, or hold the facet that it is laid at.
    NoPart,
    /// The caller did not want it.
    Unwanted,
    /// Facets would overlap.
    Overlap,
    /// It would not fit on the sheet.
    Sheet,
    /// A glued edge would have no place for a tab.
    Tab,
}

impl Net<'_, '_> {
    /// The facets on the tree from `start` without crossing `cut`, at most `limit` of them, into the scratch list.
    fn gather(&mut self, start: u32, cut: Option<u32>, avoid: u32, limit: usize) -> bool {
        let problem = self.problem;
        self.stamp += 1;
        let mut part = std::mem::take(&mut self.scratch.part);
        part.clear();
        part.push(start);
        self.mark[start as usize] = self.stamp;
        let mut k = 0;
        let mut fine = start != avoid;
        while fine && k < part.len() {
            for &e in &problem.mesh.facets[part[k] as usize].edges {
                if !self.tree[e as usize] || Some(e) == cut {
                    continue;
                }
                let side = problem.side_of(e, part[k]);
                let g = problem.facet_at(e, 1 - side).expect("tree edges are inner");
                if self.mark[g as usize] != self.stamp {
                    self.mark[g as usize] = self.stamp;
                    part.push(g);
                    if g == avoid || part.len() > limit {
                        fine = false;
                        break;
                    }
                }
            }
            k += 1;
        }
        self.scratch.part = part;
        fine
    }

    /// Poses of the gathered facets when the first one is laid across an edge.
    fn lay(&mut self, across: u32, moving: usize) {
        let problem = self.problem;
        let part = std::mem::take(&mut self.scratch.part);
        let mut poses = std::mem::take(&mut self.scratch.poses);
        poses.clear();
        let target = problem.facet_at(across, 1 - moving).expect("inner edge");
        let to = problem.local_edge(across, 1 - moving).map(|p| self.pose[target as usize].apply(p));
        let first = Pose::mapping(problem.local_edge(across, moving), to);
        // The part moves as it is: one motion for all. From the old frame of the first facet to the new one.
        let old = self.pose[part[0] as usize];
        let turn = DVec2::new(old.x.dot(first.x), old.x.perp_dot(first.x));
        for &f in &part {
            let pose = self.pose[f as usize];
            let x = (pose.x.x * turn + pose.x.y * turn.perp()).normalize_or(DVec2::X);
            let r = pose.origin - old.origin;
            poses.push(Pose { x, origin: first.origin + r.x * turn + r.y * turn.perp() });
        }
        self.scratch.part = part;
        self.scratch.poses = poses;
    }

    /// Makes a move if it leaves no overlap, fits the sheet and every glued edge keeps or finds a tab.
    pub fn try_move(&mut self, m: Move) -> Outcome {
        self.try_move_if(m, |_| true)
    }

    /// As [`Net::try_move`], if `wanted` says so of what it would change.
    pub fn try_move_if(&mut self, m: Move, wanted: impl FnOnce(Change) -> bool) -> Outcome {
        let problem = self.problem;
        let start = problem.facet_at(m.across, m.moving).expect("inner edge");
        let target = problem.facet_at(m.across, 1 - m.moving).expect("inner edge");
        if !self.gather(start, m.cut, target, m.limit) {
            return Outcome::NoPart;
        }
        self.lay(m.across, m.moving);
        let part = std::mem::take(&mut self.scratch.part);
        let poses = std::mem::take(&mut self.scratch.poses);
        let mut dirty = std::mem::take(&mut self.scratch.dirty);
        let outcome = self.try_laid(m, (&part, &poses), &mut dirty, target, wanted);
        self.scratch.part = part;
        self.scratch.poses = poses;
        self.scratch.dirty = dirty;
        outcome
    }

    /// Makes a move of a part whose new poses are known.
    fn try_laid(
        &mut self,
        m: Move,
        (part, poses): (&[u32], &[Pose]),
        dirty: &mut Vec<u32>,
        target: u32,
        wanted: impl FnOnce(Change) -> bool,
    ) -> Outcome {
        let (from, into) = (self.piece[part[0] as usize], self.piece[target as usize]);
        dirty.clear();
        if self.part_overlaps(part, poses, into, m.across, dirty) {
            return Outcome::Overlap;
        }
        let mut grown = if from == into { self.span_of_rest(target) } else { self.spans[into as usize] };
        for (&f, pose) in part.iter().zip(poses) {
            grown.add(&self.problem.mesh.facets[f as usize], pose);
        }
        if !grown.fits(self.problem.sheet) {
            return Outcome::Sheet;
        }
        let left = if from == into { Span::EMPTY } else { self.span_left(m.cut) };
        let boxes = |span: Span| span.least_box();
        let before = boxes(self.spans[into as usize]) + if from == into { 0.0 } else { boxes(self.spans[from as usize]) };
        let moved = u32::try_from(part.len()).expect("at most MAX_FACETS");
        let change = Change {
            moved: if from == into { 0 } else { moved },
            sizes: [from, into].map(|piece| self.size[piece as usize]),
            boxes: boxes(grown) + boxes(left) - before,
        };
        if !wanted(change) {
            return Outcome::Unwanted;
        }
        if !self.apply(part, poses, into, m, dirty) {
            return Outcome::Tab;
        }
        if from != into {
            self.size[from as usize] -= moved;
            self.size[into as usize] += moved;
            self.pieces -= usize::from(self.size[from as usize] == 0);
            self.spans[from as usize] = left;
        }
        self.spans[into as usize] = grown;
        Outcome::Done(part.len())
    }

    fn part_overlaps(&mut self, part: &[u32], poses: &[Pose], into: u32, across: u32, dirty: &mut Vec<u32>) -> bool {
        let problem = self.problem;
        for (&f, pose) in part.iter().zip(poses) {
            let shape = &problem.mesh.facets[f as usize];
            for t in &shape.fill {
                let placed = Convex::new(&t.map(|c| pose.apply(shape.flat[c as usize])));
                let stamp = self.stamp;
                let hit = self.each_overlap(into, &placed, |net, item| {
                    if item & TAB != 0 {
                        let edge = item & !TAB;
                        if edge != across {
                            let side = net.tab[edge as usize].expect("the tab is there").side;
                            let owner = problem.facet_at(edge, side.into()).expect("a tab stands on a facet");
                            if net.mark[owner as usize] != stamp && !dirty.contains(&edge) {
                                dirty.push(edge);
                            }
                        }
                        false
                    } else {
                        // What moves with the part leaves its old place.
                        net.mark[problem.facet_of_item[item as usize] as usize] != stamp
                    }
                });
                if hit {
                    return true;
                }
            }
        }
        false
    }

    /// How far the rest of a piece reaches when the gathered part is taken off at `cut`.
    fn span_left(&mut self, cut: Option<u32>) -> Span {
        let Some(cut) = cut else { return Span::EMPTY };
        let sides = [0, 1].map(|side| self.problem.facet_at(cut, side).expect("tree edges are inner"));
        match sides.into_iter().find(|&f| self.mark[f as usize] != self.stamp) {
            Some(rest) => self.span_of_rest(rest),
            // The cut is no edge of the part: all of the piece moves.
            None => Span::EMPTY,
        }
    }

    /// How far the facets reach that hang together with `target` along the tree, without those that carry the mark of the gathering.
    fn span_of_rest(&mut self, target: u32) -> Span {
        let problem = self.problem;
        let mut span = Span::EMPTY;
        let moved = self.stamp;
        let mut queue = std::mem::take(&mut self.scratch.queue);
        queue.clear();
        queue.push(target);
        self.visits += 1;
        self.visited[target as usize] = self.visits;
        while let Some(f) = queue.pop() {
            span.add(&problem.mesh.facets[f as usize], &self.pose[f as usize]);
            for &e in &problem.mesh.facets[f as usize].edges {
                if self.tree[e as usize] {
                    let g = problem.facet_at(e, 1 - problem.side_of(e, f)).expect("tree edges are inner");
                    if self.mark[g as usize] != moved && self.visited[g as usize] != self.visits {
                        self.visited[g as usize] = self.visits;
                        queue.push(g);
                    }
                }
            }
        }
        self.scratch.queue = queue;
        self.work += u64::from(self.size[self.piece[target as usize] as usize]) / 4;
        span
    }

    /// Moves the part; without a tab for some edge everything is put back.
    fn apply(&mut self, part: &[u32], poses: &[Pose], into: u32, m: Move, dirty: &[u32]) -> bool {
        let from = self.piece[part[0] as usize];
        let mut before = std::mem::take(&mut self.scratch.tabs_before);
        let mut old = std::mem::take(&mut self.scratch.old);
        self.take_tabs_around(part, dirty, &mut before);
        old.clear();
        old.extend(part.iter().map(|&f| self.pose[f as usize]));
        self.place(part, poses, into);
        self.set_tree(m, true);
        for &(e, ..) in &before {
            self.joined[e as usize] = self.tree[e as usize] || self.coincides(e);
        }
        let fine = self.give_tabs(&before);
        if !fine {
            self.put_back(part, &old, from, m, &before);
        }
        self.scratch.tabs_before = before;
        self.scratch.old = old;
        fine
    }

    /// Takes off all tabs that a move of the part may change: those that it runs into, and all around and in it. They are kept in
    /// `before`, with whether their edges are joined.
    fn take_tabs_around(&mut self, part: &[u32], dirty: &[u32], before: &mut Vec<(u32, Option<TabChoice>, bool)>) {
        let problem = self.problem;
        before.clear();
        let note = |net: &mut Self, before: &mut Vec<(u32, Option<TabChoice>, bool)>, e: u32| {
            if problem.mesh.edges[e as usize].sides[1].is_some() && before.iter().all(|&(b, ..)| b != e) {
                before.push((e, net.tab[e as usize], net.joined[e as usize]));
                net.take_tab(e);
            }
        };
        for &e in dirty {
            note(self, before, e);
        }
        if part.len() <= SHORT_LIST {
            for &f in part {
                for &e in &problem.mesh.facets[f as usize].edges {
                    note(self, before, e);
                }
            }
        } else {
            // As above, without looking through a long list: an edge inside the part is met from its first side only.
            for &f in part {
                for &e in &problem.mesh.facets[f as usize].edges {
                    let Some(other) = problem.mesh.other(e, f) else { continue };
                    let inside = self.mark[other.facet as usize] == self.stamp;
                    if (!inside || problem.side_of(e, f) == 0) && !dirty.contains(&e) {
                        before.push((e, self.tab[e as usize], self.joined[e as usize]));
                        self.take_tab(e);
                    }
                }
            }
        }
    }

    /// Lays facets with these poses in a piece.
    fn place(&mut self, part: &[u32], poses: &[Pose], piece: u32) {
        for (&f, &pose) in part.iter().zip(poses) {
            self.remove_facet(f);
            self.piece[f as usize] = piece;
            self.pose[f as usize] = pose;
        }
        for &f in part {
            self.insert_facet(f);
        }
    }

    /// Lets the tree run over the edge of a move, and not over the one where the part was cut off, or the other way round.
    fn set_tree(&mut self, m: Move, moved: bool) {
        self.tree[m.across as usize] = moved;
        if let Some(cut) = m.cut {
            self.tree[cut as usize] = !moved;
        }
    }

    /// Gives tabs to edges that are glued now; false as soon as one finds none. An edge that had no tab before may go on without.
    fn give_tabs(&mut self, before: &[(u32, Option<TabChoice>, bool)]) -> bool {
        before.iter().all(|&(e, tab, was_joined)| self.joined[e as usize] || self.give_tab(e) || (tab.is_none() && !was_joined))
    }

    /// Undoes a move.
    fn put_back(&mut self, part: &[u32], old: &[Pose], from: u32, m: Move, before: &[(u32, Option<TabChoice>, bool)]) {
        for &(e, ..) in before {
            self.take_tab(e);
        }
        self.place(part, old, from);
        self.set_tree(m, false);
        for &(e, tab, joined) in before {
            self.joined[e as usize] = joined;
            if let Some(tab) = tab {
                self.put_tab(e, tab);
            }
        }
    }
}
