//! The slope error of a reduced surface: how far its normals are off.

use crate::mesh::{NearTriangle, Triangles};
use glam::DVec3;
use rayon::prelude::*;
use rstar::RTree;

/// The original's triangles: middles, areas, normals.
pub(super) struct Slopes(Vec<(DVec3, f64, DVec3)>);

/// Triangles near a middle that are looked at for one that faces the same way. Chosen, not measured: the two sides of a thin wall are
/// among them.
const NEAR: usize = 8;

impl Slopes {
    pub(super) fn new(soup: &Triangles) -> Self {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
            let n = (b - a).cross(c - a);
            ((a + b + c) / 3.0, 0.5 * n.length(), n.normalize_or_zero())
        };
        Self(soup.triangles.iter().map(of).collect())
    }

    /// Root mean square of the angle between the normals and those of the nearest triangles that face the same side, by area, radians.
    pub(super) fn error(&self, reduced: &Triangles) -> f64 {
        let tree = RTree::bulk_load((0..reduced.triangles.len()).map(|k| NearTriangle::new(reduced, k, k)).collect());
        let angle = |(p, _, normal): &(DVec3, f64, DVec3)| {
            let p = p.to_array();
            let facing = tree.nearest_neighbor_iter(&p).take(NEAR).find(|t: &&NearTriangle| t.normal.dot(*normal) > 0.0);
            let found = facing.or_else(|| tree.nearest_neighbor(&p)).expect("a surface has triangles");
            found.normal.dot(*normal).clamp(-1.0, 1.0).acos()
        };
        // Summed in one order at any number of threads.
        let angles: Vec<f64> = self.0.par_iter().map(angle).collect();
        let (sum, area) = angles.iter().zip(&self.0).fold((0.0, 0.0), |(s, a), (x, (_, w, _))| (s + w * x * x, a + w));
        if area > 0.0 { (sum / area).sqrt() } else { 0.0 }
    }
}
