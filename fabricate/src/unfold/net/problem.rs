//! What does not change while a net is searched.

use super::super::tab_shapes::TabShapes;
use crate::mesh::{Mesh, Side};
use crate::polygon::Convex;
use glam::DVec2;

/// What the paper's size allows: a piece fits if some rotation of it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Longer and shorter side that a piece may fill, mm.
    pub size: DVec2,
}

/// What does not change during the search.
#[derive(Debug)]
pub struct Problem<'a> {
    /// The surface.
    pub mesh: &'a Mesh,
    /// Its possible tabs.
    pub tabs: TabShapes,
    /// The paper.
    pub sheet: Sheet,
    /// First item of each facet; a facet has one for each of its triangles.
    pub(super) first_item: Vec<u32>,
    pub(super) facet_of_item: Vec<u32>,
    /// Size of a cell of the collision grid, mm.
    pub(super) cell: f64,
}

impl<'a> Problem<'a> {
    /// Prepares the search over `mesh`.
    pub fn new(mesh: &'a Mesh, tabs: TabShapes, sheet: Sheet) -> Self {
        let mut first_item = Vec::with_capacity(mesh.facets.len() + 1);
        let mut facet_of_item = Vec::new();
        let mut extents = Vec::new();
        for (facet, k) in mesh.facets.iter().zip(0_u32..) {
            first_item.push(u32::try_from(facet_of_item.len()).expect("few triangles"));
            for t in &facet.fill {
                facet_of_item.push(k);
                let [low, high] = Convex::new(&t.map(|c| facet.flat[c as usize])).bounds();
                extents.push((high - low).max_element());
            }
        }
        first_item.push(u32::try_from(facet_of_item.len()).expect("few triangles"));
        extents.sort_unstable_by(f64::total_cmp);
        let cell = extents.get(extents.len() / 2).copied().unwrap_or(1.0).max(1e-6);
        Self { mesh, tabs, sheet, first_item, facet_of_item, cell }
    }

    pub(super) fn items(&self, facet: u32) -> std::ops::Range<u32> {
        self.first_item[facet as usize]..self.first_item[facet as usize + 1]
    }

    /// The two ends of an edge in the frame of the facet on its side, in the order of the edge.
    pub(super) fn local_edge(&self, edge: u32, side: usize) -> [DVec2; 2] {
        let Side { facet, place } = self.mesh.edges[edge as usize].sides[side].expect("inner edge");
        let flat = &self.mesh.facets[facet as usize].flat;
        let (a, b) = (flat[place as usize], flat[(place as usize + 1) % flat.len()]);
        if side == 0 { [a, b] } else { [b, a] }
    }

    pub(super) fn side_of(&self, edge: u32, facet: u32) -> usize {
        usize::from(self.mesh.edges[edge as usize].sides[0].is_none_or(|first| first.facet != facet))
    }

    pub(super) fn facet_at(&self, edge: u32, side: usize) -> Option<u32> {
        self.mesh.edges[edge as usize].sides[side].map(|side| side.facet)
    }
}
