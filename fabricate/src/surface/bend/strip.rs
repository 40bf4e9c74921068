//! Strips: surfaces whose folds are all parallel. Every panel is narrowed by just what its folds take.

use super::allowance::{Bend, FLAT};
use crate::mesh::Mesh;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Directions and places that differ by less are one, of the unit or in mm: far above rounding, far below what is folded.
const SAME: f64 = 1e-6;

/// A part of a surface, seen along its folds.
struct Strip<'m> {
    mesh: &'m Mesh,
    /// Direction of the folds, and the axes of the plane across them.
    along: DVec3,
    across: [DVec3; 2],
    /// Facets that lie in one plane.
    panels: Vec<Vec<u32>>,
    panel_of: BTreeMap<u32, usize>,
}

/// A fold between two panels: its place in the profile, its angle, the panel beyond.
#[derive(Clone, Copy)]
struct FoldLine {
    at: DVec2,
    angle: f64,
    beyond: usize,
}

/// How the corners of a part move if it is a strip: all folds parallel, each panel between two of them, no ring.
pub(super) fn strip_shifts(bend: Bend, mesh: &Mesh, part: &[u32]) -> Option<Vec<(u32, DVec3)>> {
    let strip = Strip::new(mesh, part)?;
    let lines = strip.fold_lines()?;
    // From one end to the other; a ring has none.
    let mut panel = lines.iter().position(|l| l.len() == 1)?;
    let mut moved: BTreeMap<u32, DVec3> = BTreeMap::new();
    let mut shift = DVec2::ZERO;
    let mut entered: Option<FoldLine> = None;
    loop {
        let leave = lines[panel].iter().find(|l| entered.is_none_or(|e| e.at.distance(l.at) > SAME)).copied();
        let half = |line: Option<FoldLine>| line.map_or(0.0, |l| 0.5 * bend.deduction(l.angle));
        let (taken_in, taken_out) = (half(entered), half(leave));
        let across = strip.across_panel(panel, entered, leave)?;
        for v in strip.corners(panel) {
            let p = strip.profile(v);
            let is_at = |line: Option<FoldLine>| line.is_some_and(|l| l.at.distance(p) <= SAME);
            let s = if is_at(entered) {
                shift
            } else if is_at(leave) {
                shift - (taken_in + taken_out) * across
            } else {
                shift - taken_in * across
            };
            moved.entry(v).or_insert(s.x * strip.across[0] + s.y * strip.across[1]);
        }
        let Some(line) = leave else { break };
        shift -= (taken_in + taken_out) * across;
        entered = Some(line);
        panel = line.beyond;
    }
    Some(moved.into_iter().collect())
}

/// Whether an edge is a fold and not flat or a border.
fn is_folded(mesh: &Mesh, edge: u32) -> bool {
    mesh.edges[edge as usize].sides[1].is_some() && mesh.edges[edge as usize].angle.abs() > FLAT
}

/// Unit direction of an edge.
fn direction(mesh: &Mesh, edge: u32) -> DVec3 {
    let [a, b] = mesh.edges[edge as usize].ends.map(|v| mesh.vertices[v as usize]);
    (b - a).normalize_or_zero()
}

impl<'m> Strip<'m> {
    /// The part along its first fold; `None` without any.
    fn new(mesh: &'m Mesh, part: &[u32]) -> Option<Self> {
        let first = part.iter().flat_map(|&f| &mesh.facets[f as usize].edges).copied().find(|&e| is_folded(mesh, e))?;
        let along = direction(mesh, first);
        let across = <[DVec3; 2]>::from(along.any_orthonormal_pair());
        let mut out = Self { mesh, along, across, panels: Vec::new(), panel_of: BTreeMap::new() };
        for &start in part {
            out.add_panel(start);
        }
        Some(out)
    }

    /// The facets in the plane of one, if it has no panel yet.
    fn add_panel(&mut self, start: u32) {
        if self.panel_of.contains_key(&start) {
            return;
        }
        let number = self.panels.len();
        self.panel_of.insert(start, number);
        let mut panel = vec![start];
        let mut k = 0;
        while k < panel.len() {
            for (e, g) in self.mesh.neighbours(panel[k]) {
                if !is_folded(self.mesh, e) && self.panel_of.insert(g, number).is_none() {
                    panel.push(g);
                }
            }
            k += 1;
        }
        self.panels.push(panel);
    }

    /// A vertex in the plane across the folds.
    fn profile(&self, v: u32) -> DVec2 {
        let at = self.mesh.vertices[v as usize];
        DVec2::new(self.across[0].dot(at), self.across[1].dot(at))
    }

    fn corners(&self, panel: usize) -> impl Iterator<Item = u32> + '_ {
        self.panels[panel].iter().flat_map(|&f| &self.mesh.facets[f as usize].corners).copied()
    }

    /// For each panel its fold lines; `None` if some fold is not parallel, or a panel has more than two lines.
    fn fold_lines(&self) -> Option<Vec<Vec<FoldLine>>> {
        let mut lines: Vec<Vec<FoldLine>> = vec![Vec::new(); self.panels.len()];
        for (panel, lines) in self.panels.iter().zip(&mut lines) {
            for (e, g) in panel.iter().flat_map(|&f| self.mesh.neighbours(f)).filter(|(e, _)| is_folded(self.mesh, *e)) {
                if direction(self.mesh, e).cross(self.along).length() > SAME {
                    return None;
                }
                let edge = &self.mesh.edges[e as usize];
                let (at, angle, beyond) = (self.profile(edge.ends[0]), edge.angle, self.panel_of[&g]);
                match lines.iter().find(|l| l.at.distance(at) <= SAME) {
                    Some(l) if (l.angle - angle).abs() > SAME || l.beyond != beyond => return None,
                    Some(_) => {}
                    None => lines.push(FoldLine { at, angle, beyond }),
                }
            }
            if lines.len() > 2 {
                return None;
            }
        }
        Some(lines)
    }

    /// Unit direction across a panel, from where it was entered to where it is left.
    fn across_panel(&self, panel: usize, entered: Option<FoldLine>, leave: Option<FoldLine>) -> Option<DVec2> {
        let far = |from: DVec2| {
            self.corners(panel).map(|v| self.profile(v)).max_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
        };
        let across = match (entered, leave) {
            (Some(e), Some(l)) => l.at - e.at,
            (Some(e), None) => far(e.at)? - e.at,
            (None, Some(l)) => l.at - far(l.at)?,
            (None, None) => return None,
        };
        Some(across.normalize_or_zero())
    }
}
