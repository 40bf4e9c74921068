//! How much of each texel shows the surface: rays from the viewer through the reference plane.

use super::reference_plane::ReferencePlane;
use crate::error::Result;
use crate::numerics::low_discrepancy::{fraction, hash};
use crate::visibility::{PeriodicBvh, Traced};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Rays along each side of a texel that are traced first. Chosen, not measured: what is narrower than a quarter of a texel they may miss in all of them.
const FIRST: usize = 4;
/// Rays along each side of the whole image, at least: texels that are few show much each. Chosen, not measured.
const LEAST_OF_IMAGE: usize = 256;

/// What the rays through a texel met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cover {
    /// Share that met front faces.
    pub front: f64,
    /// Share that met anything.
    pub any: f64,
    /// Standard error of `front`.
    pub error: f64,
}

/// The cover of all texels from `wo`; where the first 16 rays of a texel or of a neighbour disagree, `fine` rays along each side are traced in it, and where these
/// find no front face of which samples were `seen`.
///
/// # Errors
/// What `check` says.
pub fn cover(
    rays: &PeriodicBvh,
    plane: &ReferencePlane,
    wo: DVec3,
    (fine, seed): (usize, u32),
    seen: &(dyn Fn(usize) -> bool + Sync),
    check: &(dyn Fn() -> Result<()> + Sync),
) -> Result<Vec<Cover>> {
    let [columns, rows] = plane.texels;
    let first_side = FIRST.max(LEAST_OF_IMAGE.div_ceil(columns.max(rows)));
    let fine = fine.max(first_side);
    // From above all of the surface, or from the plane itself where that is higher.
    let rise = ((rays.highest() - plane.z).max(0.0) + plane.period.max_element()) / wo.z;
    let of = |texel: usize, side: usize, salt: u32| {
        let mut found = Counts::default();
        for k in 0..side * side {
            let number = hash(hash(seed ^ salt ^ hash(u32::try_from(texel).unwrap_or(u32::MAX))) ^ u32::try_from(k).unwrap_or(u32::MAX));
            let jitter = DVec2::new(fraction(number), fraction(hash(number)));
            let within = (DVec2::new((k % side) as f64, (k / side) as f64) + jitter) / side as f64;
            found.add(rays.trace(plane.place(texel, within) + rise * wo, -wo, None));
        }
        found.cover(side)
    };
    let first: Vec<Cover> = (0..plane.count()).into_par_iter().map(|texel| of(texel, first_side, 0x3c1)).collect();
    check()?;
    let is_whole = |c: Cover| (c.front == 0.0 || c.front == 1.0) && (c.any == 0.0 || c.any == 1.0);
    let is_clear = |texel: usize| {
        let (row, column) = (texel / columns, texel % columns);
        let near = (0..9).map(|k| (row + rows + k / 3 - 1) % rows * columns + (column + columns + k % 3 - 1) % columns);
        let mut near = near.map(|t| first[t]);
        is_whole(first[texel])
            && seen(texel) == (first[texel].front > 0.0)
            && near.all(|c| c.front == first[texel].front && c.any == first[texel].any)
    };
    let found =
        (0..plane.count()).into_par_iter().map(|texel| if is_clear(texel) { first[texel] } else { of(texel, fine, 0x7b5) }).collect();
    check()?;
    Ok(found)
}

/// Hits of the rays through a texel.
#[derive(Default)]
struct Counts {
    front: u32,
    any: u32,
}

impl Counts {
    fn add(&mut self, traced: Traced) {
        if let Traced::Hit(hit) = traced {
            self.any += 1;
            self.front += u32::from(hit.front);
        }
    }

    fn cover(&self, side: usize) -> Cover {
        let count = (side * side) as f64;
        let front = f64::from(self.front) / count;
        // As if rays were drawn at random: jittered ones err less by the root of `side` where one edge crosses the texel, and as much where many do.
        let error = (front * (1.0 - front) / count).sqrt();
        Cover { front, any: f64::from(self.any) / count, error }
    }
}
