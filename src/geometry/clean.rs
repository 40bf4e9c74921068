//! What every tile must be before anything is computed with it.

use super::tile::Tile;
use crate::error::BadInput;
use glam::DVec3;
use rustc_hash::{FxBuildHasher, FxHashMap};

/// A triangle whose height over its longest edge is below this many units in the last place of its coordinates has no area:
/// what is left is rounding. Three coordinates enter each difference, each rounded once, and a product doubles it; 8 leaves room.
/// A needle of 1e6:1 is far above it.
const DEGENERATE_ULPS: f64 = 8.0;

impl Tile {
    /// Merges vertices at the same place, drops triangles without area and exact duplicates (same corners, same side) with a
    /// note that counts them, and drops unused vertices. Every builder ends with it. Needles are kept; so is a sheet with two
    /// sides.
    ///
    /// # Errors
    /// A vertex that is not finite, a corner that does not exist, a period that is not positive, and a tile without triangles.
    /// The caller adds the file.
    pub fn clean(self) -> Result<Self, BadInput> {
        self.clean_of().map(|(tile, _)| tile)
    }

    /// [`Self::clean`], and for each triangle that is left the place that it had before.
    pub(crate) fn clean_of(mut self) -> Result<(Self, Vec<usize>), BadInput> {
        if !(self.period.is_finite() && self.period.x > 0.0 && self.period.y > 0.0) {
            return Err(BadInput::new(format!("the period is {} x {}", self.period.x, self.period.y), "both must be positive"));
        }
        if let Some(place) = self.vertices.iter().position(|v| !v.is_finite()) {
            let v = self.vertices[place];
            let problem = format!("vertex {} is ({}, {}, {})", place + 1, v.x, v.y, v.z);
            return Err(BadInput::new(problem, "coordinates must be finite numbers"));
        }
        if self.triangles.iter().flatten().any(|&v| v as usize >= self.vertices.len()) {
            return Err(BadInput::new("a triangle has a corner that does not exist", "write the mesh again"));
        }
        self.merge_vertices();
        let kept = self.drop_bad_triangles();
        if self.triangles.is_empty() {
            return Err(BadInput::new("no triangle with an area is left", "give a surface with at least one"));
        }
        self.drop_unused_vertices();
        Ok((self, kept))
    }

    /// Lets every triangle use the first of the vertices at one place.
    fn merge_vertices(&mut self) {
        let mut first: FxHashMap<[u64; 3], u32> = FxHashMap::with_capacity_and_hasher(self.vertices.len(), FxBuildHasher);
        // -0.0 + 0.0 is 0.0: the two zeros are one place.
        let place = |v: &DVec3| (*v + DVec3::ZERO).to_array().map(f64::to_bits);
        let representative: Vec<u32> = (0_u32..).zip(&self.vertices).map(|(i, v)| *first.entry(place(v)).or_insert(i)).collect();
        for corner in self.triangles.iter_mut().flatten() {
            *corner = representative[*corner as usize];
        }
    }

    /// For each triangle whether an earlier one has the same corners in the same order round.
    fn repeated(&self) -> Vec<bool> {
        let rotated: Vec<[u32; 3]> = self
            .triangles
            .iter()
            .map(|&[a, b, c]| {
                if a <= b && a <= c {
                    [a, b, c]
                } else if b <= c {
                    [b, c, a]
                } else {
                    [c, a, b]
                }
            })
            .collect();
        // Triangles sorted by their smallest corner by counting: equal ones lie within a few of each other.
        let mut starts = vec![0_usize; self.vertices.len() + 1];
        for &[a, ..] in &rotated {
            starts[a as usize + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0_u32; rotated.len()];
        for (t, &[a, ..]) in (0_u32..).zip(&rotated) {
            order[next[a as usize]] = t;
            next[a as usize] += 1;
        }
        let mut repeated = vec![false; rotated.len()];
        for bucket in starts.windows(2) {
            let bucket = &mut order[bucket[0]..bucket[1]];
            bucket.sort_unstable_by_key(|&t| (rotated[t as usize], t));
            for pair in bucket.windows(2) {
                repeated[pair[1] as usize] = rotated[pair[0] as usize] == rotated[pair[1] as usize];
            }
        }
        repeated
    }

    /// Returns the places of those that are kept.
    fn drop_bad_triangles(&mut self) -> Vec<usize> {
        let repeated = self.repeated();
        let (mut flat, mut double) = (0_usize, 0_usize);
        let keep: Vec<bool> = (0..self.triangles.len())
            .map(|t| {
                let bad = has_no_area(self.corners(t));
                flat += usize::from(bad);
                double += usize::from(!bad && repeated[t]);
                !bad && !repeated[t]
            })
            .collect();
        if flat == 0 && double == 0 {
            return (0..keep.len()).collect();
        }
        retain(&mut self.triangles, &keep);
        retain(&mut self.part_of_triangle, &keep);
        if let Some(uv) = &mut self.uv {
            retain(uv, &keep);
        }
        let counts = [(flat, "without area"), (double, "that repeat another one")];
        let said: Vec<String> = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
        self.notes.push(format!("dropped triangles: {}", said.join(", ")));
        (0..keep.len()).filter(|&t| keep[t]).collect()
    }

    fn drop_unused_vertices(&mut self) {
        let mut used = vec![false; self.vertices.len()];
        for &corner in self.triangles.iter().flatten() {
            used[corner as usize] = true;
        }
        if used.iter().all(|&u| u) {
            return;
        }
        let mut next = 0;
        let renumbered: Vec<u32> = used
            .iter()
            .map(|&u| {
                next += u32::from(u);
                next.wrapping_sub(1)
            })
            .collect();
        retain(&mut self.vertices, &used);
        for corner in self.triangles.iter_mut().flatten() {
            *corner = renumbered[*corner as usize];
        }
    }
}

/// Whether what looks like an area is rounding; see [`DEGENERATE_ULPS`].
fn has_no_area([a, b, c]: [DVec3; 3]) -> bool {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let longest = ab.length_squared().max(bc.length_squared()).max(ca.length_squared());
    let magnitude = a.abs().max(b.abs()).max(c.abs()).max_element();
    let rounding = DEGENERATE_ULPS * f64::EPSILON * magnitude;
    // In squares: periods of 1e-6 with heights of 1e-12 leave 1e-36, far from the smallest number.
    ab.cross(ca).length_squared() <= longest * rounding * rounding
}

fn retain<T>(items: &mut Vec<T>, keep: &[bool]) {
    let mut place = 0;
    items.retain(|_| {
        place += 1;
        keep[place - 1]
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn tile(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Tile {
        Tile {
            vertices: vertices.iter().map(|&v| v.into()).collect(),
            triangles: triangles.to_vec(),
            part_of_triangle: vec![0; triangles.len()],
            parts: vec!["default".into()],
            uv: None,
            period: DVec2::ONE,
            grid: None,
            notes: Vec::new(),
        }
    }

    #[test]
    fn drops_flat_and_double_triangles_and_counts_them_in_a_note() {
        let third = 1.0 / 3.0;
        let vertices =
            [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [third, third, third], [2. * third, 2. * third, 2. * third], [1., 1., 1.]];
        // Collinear along the diagonal (not exactly, in binary), a repeated corner, and the first triangle again from another corner.
        let cleaned = tile(&vertices, &[[0, 1, 2], [3, 4, 5], [0, 1, 1], [1, 2, 0], [0, 2, 1]]).clean().unwrap();
        assert_eq!(cleaned.triangles, [[0, 1, 2], [0, 2, 1]]);
        assert_eq!(cleaned.vertices.len(), 3);
        assert_eq!(cleaned.notes, ["dropped triangles: 2 without area, 1 that repeat another one"]);
    }

    #[test]
    fn keeps_needles_of_a_million_to_one_at_every_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let needle = [[0., 0., 0.], [scale, 0., 0.], [scale, 1e-6 * scale, 0.]];
            assert!(tile(&needle, &[[0, 1, 2]]).clean().is_ok(), "needle of length {scale}");
        }
    }

    #[test]
    fn merges_vertices_at_one_place_and_knows_one_zero() {
        let vertices = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [-0., 0., -0.], [1., 0., 0.], [1., -1., 0.]];
        let cleaned = tile(&vertices, &[[0, 1, 2], [3, 5, 4]]).clean().unwrap();
        assert_eq!((cleaned.vertices.len(), cleaned.triangles), (4, vec![[0, 1, 2], [0, 3, 1]]));
    }

    #[test]
    fn refuses_vertices_that_are_not_finite_and_tiles_without_triangles() {
        for bad in [f64::NAN, f64::INFINITY] {
            let error = tile(&[[0., 0., 0.], [1., bad, 0.], [0., 1., 0.]], &[[0, 1, 2]]).clean().unwrap_err();
            assert!(error.problem.contains("vertex 2"), "{error}");
        }
        assert!(tile(&[[0., 0., 0.]], &[]).clean().is_err());
        assert!(tile(&[[0., 0., 0.], [1., 0., 0.]], &[[0, 1, 7]]).clean().is_err());
    }
}
