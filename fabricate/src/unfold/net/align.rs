//! Tabs of one seam on one of its sides, as far as they have place there.

use super::pieces::{Net, TabChoice};
use rustc_hash::FxHashMap;

impl Net<'_, '_> {
    /// Moves tabs so that between two pieces all stand on the same piece: the one that has more of them, by the length of their edges. Those
    /// that have no place there stay. Seams within a piece stay as they are.
    pub fn align_tabs(&mut self) {
        let problem = self.problem;
        // For each pair of pieces the length with tabs on the first less that with tabs on the second.
        let mut balance: FxHashMap<[u32; 2], f64> = FxHashMap::default();
        let mut seams: Vec<(u32, [u32; 2], bool)> = Vec::new();
        for (e, tab) in (0_u32..).zip(&self.tab) {
            let (Some(tab), Some(f), Some(g)) = (tab, problem.facet_at(e, 0), problem.facet_at(e, 1)) else { continue };
            let [p, q] = [f, g].map(|f| self.piece[f as usize]);
            if p == q {
                continue;
            }
            let on = if tab.side == 0 { p } else { q };
            let pair = [p.min(q), p.max(q)];
            let length = problem.mesh.length(e as usize);
            *balance.entry(pair).or_default() += if on == pair[0] { length } else { -length };
            seams.push((e, pair, on == pair[0]));
        }
        for (edge, pair, on_first) in seams {
            if (balance[&pair] >= 0.0) != on_first {
                self.turn_tab(edge);
            }
        }
    }

    /// Moves a tab to the other side of its edge, if it has place there.
    fn turn_tab(&mut self, edge: u32) {
        let Some(old) = self.tab[edge as usize] else { return };
        let side = 1 - old.side;
        self.take_tab(edge);
        let problem = self.problem;
        let Some(facet) = problem.facet_at(edge, side.into()) else { return self.put_tab(edge, old) };
        let own = problem.items(facet);
        for (shape, local) in (0_u8..).zip(problem.tabs.of(edge, side.into())) {
            let placed = self.pose[facet as usize].convex(local);
            if !self.each_overlap(self.piece[facet as usize], &placed, |_, item| !own.contains(&item) || own.len() > 2) {
                return self.put_tab(edge, TabChoice { side, shape });
            }
        }
        self.put_tab(edge, old);
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{Mesh, Tolerance, Triangles};
    use crate::unfold::{Effort, Problem, Sheet, TabShapes, TabStyle, search};
    use glam::{DVec2, DVec3};

    #[test]
    fn tabs_between_two_pieces_stand_on_one_of_them_and_all_edges_keep_theirs() {
        // A bumpy field on small pages: several pieces with seams of many edges.
        let n = 8;
        let height = |k: usize| ((k * 7919) % 13) as f64 * 0.4;
        let mut soup = Triangles {
            vertices: (0..(n + 1) * (n + 1))
                .map(|k| DVec3::new((k % (n + 1)) as f64 * 12.0, (k / (n + 1)) as f64 * 12.0, height(k)))
                .collect(),
            ..Triangles::default()
        };
        for k in (0..n * n).map(|c| (c / n * (n + 1) + c % n) as u32) {
            let m = n as u32 + 1;
            soup.triangles.extend([[k, k + 1, k + m + 1], [k, k + m + 1, k + m]]);
        }
        soup.colours = vec![[1.0; 3]; soup.triangles.len()];
        let mesh = Mesh::new(soup.clone(), Tolerance::of_size(soup.size())).unwrap();
        let problem = Problem::new(&mesh, TabShapes::new(&mesh, TabStyle::default()), Sheet { size: DVec2::splat(60.0) });
        let mut net = search(&problem, Effort::default(), &|_| false);
        let mixed = |net: &super::Net<'_, '_>| {
            let mut sides = std::collections::BTreeMap::<[u32; 2], [usize; 2]>::new();
            for (e, tab) in (0_u32..).zip(&net.tab) {
                let (Some(tab), Some(f), Some(g)) = (tab, problem.facet_at(e, 0), problem.facet_at(e, 1)) else { continue };
                let (p, q) = (net.piece[f as usize], net.piece[g as usize]);
                if p != q {
                    let on = if tab.side == 0 { p } else { q };
                    sides.entry([p.min(q), p.max(q)]).or_default()[usize::from(on != p.min(q))] += 1;
                }
            }
            sides.values().map(|[a, b]| a.min(b)).sum::<usize>()
        };
        let (before, bare) = (mixed(&net), net.without_tab().count());
        net.align_tabs();
        let after = mixed(&net);
        assert!(before > 3 && 2 * after <= before, "{before} tabs on the side of the fewer, {after} afterwards");
        assert_eq!(net.without_tab().count(), bare);
    }
}
