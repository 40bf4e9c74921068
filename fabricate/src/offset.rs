//! The middle of a thick sheet: every facet moved along its normal, and the edges where they meet then.
//!
//! Paper keeps its length in its middle. The printed side is the design's surface, so the middle lies half a thickness below it: a
//! mountain fold takes `t tan(angle / 2)` from the two facets together, a valley adds as much. What is left of the bend allowance,
//! the arc being shorter than the corner, is `t (tan(angle / 2) - angle / 2)`: 0.02 mm for a right angle in paper of 0.1 mm.

use crate::mesh::{Mesh, Tolerance, Triangles};
use biscale::error::BadInput;
use glam::{DMat3, DVec3};

/// The mesh with every facet moved by `distance` along its normal; corners go where their facets' planes meet, or, where more than
/// three meet, nearest to all of them by least squares.
///
/// # Errors
/// A surface whose facets vanish: the paper is thicker than they are.
pub fn offset(mesh: Mesh, distance: f64) -> Result<Mesh, BadInput> {
    let mut sums = vec![(DMat3::ZERO, DVec3::ZERO, Vec::<DVec3>::new()); mesh.vertices.len()];
    for facet in &mesh.facets {
        for &c in &facet.corners {
            let (matrix, right, seen) = &mut sums[c as usize];
            // A plane counts once at a corner, however many facets lie in it.
            if seen.iter().any(|n| n.dot(facet.normal) > 1.0 - 1e-9) {
                continue;
            }
            seen.push(facet.normal);
            let n = facet.normal;
            *matrix += DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            *right += n * distance;
        }
    }
    let vertices: Vec<DVec3> = mesh
        .vertices
        .iter()
        .zip(&sums)
        .map(|(&v, (matrix, right, _))| {
            // Where fewer than three planes meet, the shortest way: a small multiple of the unit matrix picks it.
            let regular = *matrix + DMat3::IDENTITY * 1e-9;
            v + regular.inverse() * *right
        })
        .collect();
    let mut soup = Triangles { vertices, ..Triangles::default() };
    for (k, facet) in mesh.facets.iter().enumerate() {
        let n = facet.corners.len();
        // An edge that points the other way afterwards has shrunk to nothing on the way.
        let turned = (0..n).any(|j| {
            let (a, b) = (facet.corners[j] as usize, facet.corners[(j + 1) % n] as usize);
            (soup.vertices[b] - soup.vertices[a]).dot(mesh.vertices[b] - mesh.vertices[a]) <= 0.0
        });
        if turned {
            let problem = format!("facet {} vanishes in paper of {} mm", k + 1, 2.0 * distance.abs());
            return Err(BadInput::new(problem, "take thinner paper or a larger scale").at_field("--paper-thickness"));
        }
        for t in &facet.fill {
            let triangle = t.map(|c| facet.corners[c as usize]);
            soup.triangles.push(triangle);
            soup.colours.push(facet.colour);
        }
    }
    let size = soup.size();
    Mesh::new(soup, Tolerance { flat: 1e-4, ..Tolerance::of_size(size) })
}
