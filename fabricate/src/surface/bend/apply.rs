//! A surface whose folds take their bend allowance.

use super::allowance::{Bend, FLAT};
use super::strip::strip_shifts;
use crate::mesh::{Mesh, Tolerance, Triangles};
use biscale::error::BadInput;
use glam::{DMat3, DVec3};

/// What is left of the bend allowance below this is not told, mm. Chosen, not measured: a tenth of the thickness of office paper.
const QUIET: f64 = 0.01;

impl Bend {
    /// The surface whose folds, drawn as sharp lines, give the design when they are bent.
    ///
    /// # Errors
    /// A surface whose facets vanish: the paper is too thick, or its folds too round.
    pub fn apply(self, mesh: Mesh) -> Result<Mesh, BadInput> {
        self.check(&mesh)?;
        let mut vertices = mesh.vertices.clone();
        let mut depth = vec![0.0; mesh.facets.len()];
        let (mut worst, mut sum, mut length) = (0.0_f64, 0.0, 0.0);
        for part in mesh.components() {
            if let Some(moved) = strip_shifts(self, &mesh, &part) {
                for (v, shift) in moved {
                    vertices[v as usize] += shift;
                }
                continue;
            }
            // Least squares of 2 d s tan(a / 2) - deduction over the folds, by length; s is 1 for a mountain, -1 for a valley.
            let folds = || {
                let edges = part.iter().flat_map(|&f| mesh.facets[f as usize].edges.iter().map(move |&e| (f, e)));
                let once = edges.filter(|(f, e)| mesh.edges[*e as usize].sides[0].is_some_and(|first| first.facet == *f));
                once.map(|(_, e)| (mesh.length(e as usize), mesh.edges[e as usize].angle)).filter(|(_, a)| a.abs() > FLAT)
            };
            let slope = |a: f64| -2.0 * (0.5 * a).tan();
            let (above, below) =
                folds().fold((0.0, 0.0), |(p, q), (l, a)| (p + l * slope(a) * self.deduction(a), q + l * slope(a) * slope(a)));
            let d = if below > 0.0 { above / below } else { 0.5 * self.thickness };
            for (l, a) in folds() {
                let left = (d * slope(a) - self.deduction(a)).abs();
                (worst, sum, length) = (worst.max(left), sum + l * left * left, length + l);
            }
            part.iter().for_each(|&f| depth[f as usize] = d);
        }
        offset(&mesh, &depth, &mut vertices);
        let mut out = self.rebuilt(&mesh, vertices)?;
        out.notes = mesh.notes;
        if worst > QUIET {
            let rms = (sum / length).sqrt();
            out.notes.push(format!(
                "folds meet in corners: their bend allowance is kept to {rms:.3} mm (RMS by length), {worst:.3} mm at the most"
            ));
        }
        Ok(out)
    }

    /// Refuses facets that are narrower than the arc of one of their folds.
    fn check(self, mesh: &Mesh) -> Result<(), BadInput> {
        for (k, facet) in mesh.facets.iter().enumerate() {
            let n = facet.flat.len();
            for (j, &e) in facet.edges.iter().enumerate().filter(|(_, e)| mesh.edges[**e as usize].sides[1].is_some()) {
                let (a, b) = (facet.flat[j], facet.flat[(j + 1) % n]);
                let along = (b - a).normalize_or_zero();
                let width = facet.flat.iter().map(|&p| along.perp_dot(p - a)).fold(0.0, f64::max);
                if width <= self.setback(mesh.edges[e as usize].angle) {
                    return Err(self.vanishes(k));
                }
            }
        }
        Ok(())
    }

    fn vanishes(self, facet: usize) -> BadInput {
        let problem = format!("facet {} vanishes in paper of {} mm with folds of radius {} mm", facet + 1, self.thickness, self.radius);
        BadInput::new(problem, "take thinner paper, a larger `scale`, or a smaller `fold_radius`").at_field("paper_thickness")
    }

    /// The mesh with its corners elsewhere.
    fn rebuilt(self, mesh: &Mesh, vertices: Vec<DVec3>) -> Result<Mesh, BadInput> {
        let mut soup = Triangles { vertices, ..Triangles::default() };
        for (k, facet) in mesh.facets.iter().enumerate() {
            let n = facet.corners.len();
            // An edge that points the other way afterwards has shrunk to nothing on the way.
            let turned = (0..n).any(|j| {
                let (a, b) = (facet.corners[j] as usize, facet.corners[(j + 1) % n] as usize);
                (soup.vertices[b] - soup.vertices[a]).dot(mesh.vertices[b] - mesh.vertices[a]) <= 0.0
            });
            if turned {
                return Err(self.vanishes(k));
            }
            for t in &facet.fill {
                soup.triangles.push(t.map(|c| facet.corners[c as usize]));
                soup.colours.push(facet.colour);
            }
        }
        let size = soup.size();
        Mesh::new(soup, Tolerance { flat: 1e-4, ..Tolerance::of_size(size) })
    }
}

/// Moves every facet inwards by its depth; corners go where their facets' planes meet, or, where more than three meet, nearest to all of
/// them by least squares.
fn offset(mesh: &Mesh, depth: &[f64], vertices: &mut [DVec3]) {
    let mut sums = vec![(DMat3::ZERO, DVec3::ZERO, Vec::<DVec3>::new()); mesh.vertices.len()];
    for (facet, &depth) in mesh.facets.iter().zip(depth) {
        for &c in &facet.corners {
            let (matrix, right, seen) = &mut sums[c as usize];
            // A plane counts once at a corner, however many facets lie in it.
            if seen.iter().any(|n| n.dot(facet.normal) > 1.0 - 1e-9) {
                continue;
            }
            seen.push(facet.normal);
            let n = facet.normal;
            *matrix += DMat3::from_cols(n * n.x, n * n.y, n * n.z);
            *right -= n * depth;
        }
    }
    for (v, (matrix, right, _)) in vertices.iter_mut().zip(&sums) {
        // Where fewer than three planes meet, the shortest way: a small multiple of the unit matrix picks it.
        let regular = *matrix + DMat3::IDENTITY * 1e-9;
        *v += regular.inverse() * *right;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use std::f64::consts::PI;

    /// A strip along y with this profile, 20 mm wide, cut into two cells along y.
    fn strip(profile: &[(f64, f64)]) -> Mesh {
        let mut soup = Triangles::default();
        for &(x, z) in profile {
            soup.vertices.extend([0.0, 10.0, 20.0].map(|y| DVec3::new(x, y, z)));
        }
        for k in 0..u32::try_from(profile.len()).unwrap() - 1 {
            for j in 0..2 {
                let (a, b) = (3 * k + j, 3 * k + 3 + j);
                soup.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
            }
        }
        soup.colours = vec![[1.0; 3]; soup.triangles.len()];
        let tolerance = Tolerance::of_size(soup.size());
        Mesh::new(soup, tolerance).unwrap()
    }

    /// Length of the strip when it lies flat.
    fn flat_length(mesh: &Mesh) -> f64 {
        mesh.facets.iter().map(|f| crate::polygon::area(&f.flat)).sum::<f64>() / 20.0
    }

    #[test]
    fn a_right_angle_is_as_long_as_its_legs_and_its_arc() {
        let bend = Bend { thickness: 0.5, radius: 1.0, k: 0.42 };
        // A mountain of two legs of 50 mm, measured outside: 48.5 each to where the arc begins, and an arc of 1.21 pi / 2.
        let mountain = bend.apply(strip(&[(-50.0, 0.0), (0.0, 0.0), (0.0, -50.0)])).unwrap();
        assert!((flat_length(&mountain) - (97.0 + 1.21 * PI / 2.0)).abs() < 1e-9, "{}", flat_length(&mountain));
        // A valley, measured inside: 49 each and the same arc.
        let valley = bend.apply(strip(&[(-50.0, 0.0), (0.0, 0.0), (0.0, 50.0)])).unwrap();
        assert!((flat_length(&valley) - (98.0 + 1.21 * PI / 2.0)).abs() < 1e-9, "{}", flat_length(&valley));
        for mesh in [mountain, valley] {
            let fold = mesh.edges.iter().map(|e| e.angle.abs()).fold(0.0, f64::max);
            assert!((fold - PI / 2.0).abs() < 1e-9 && mesh.notes.is_empty(), "the angle stays: {fold}");
        }
    }

    #[test]
    fn a_zigzag_of_any_angles_takes_what_each_of_its_folds_takes() {
        let bend = Bend { thickness: 0.2, radius: 0.3, k: 0.5 };
        let profile = [(0.0, 0.0), (9.0, 4.0), (12.0, -5.0), (20.0, 0.0), (26.0, 0.0), (30.0, 9.0)];
        let mesh = strip(&profile);
        let before = flat_length(&mesh);
        let taken: f64 = (1..5)
            .map(|k| {
                let [a, b, c] = [k - 1, k, k + 1].map(|j: usize| DVec2::new(profile[j].0, profile[j].1));
                let turn = (b - a).angle_to(c - b);
                let (radius, arc) = (if turn < 0.0 { 0.5 } else { 0.3 }, turn.abs() * 0.4);
                2.0 * radius * (0.5 * turn.abs()).tan() - arc
            })
            .sum();
        let bent = bend.apply(mesh).unwrap();
        assert!((before - flat_length(&bent) - taken).abs() < 1e-9, "{} for {taken}", before - flat_length(&bent));
    }

    #[test]
    fn equal_folds_around_corners_get_just_their_allowance() {
        let r = 20.0;
        let v = [(r, 0., 0.), (0., r, 0.), (-r, 0., 0.), (0., -r, 0.), (0., 0., r), (0., 0., -r)].map(DVec3::from).to_vec();
        let t = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]];
        let soup = Triangles::white(v, t);
        let tolerance = Tolerance::of_size(soup.size());
        let bend = Bend { thickness: 0.4, radius: 0.2, k: 0.5 };
        let mesh = bend.apply(Mesh::new(soup, tolerance).unwrap()).unwrap();
        // Folds of an octahedron: cos a = 1/3; the inradius of its facets loses half of what a fold takes.
        let a = (1.0_f64 / 3.0).acos();
        let taken = 2.0 * 0.6 * (0.5 * a).tan() - a * 0.4;
        let inradius = 20.0 * 2.0_f64.sqrt() / (2.0 * 3.0_f64.sqrt()) - 0.5 * taken;
        for facet in &mesh.facets {
            let side = facet.flat[0].distance(facet.flat[1]);
            assert!((side / (2.0 * 3.0_f64.sqrt()) - inradius).abs() < 1e-9, "{side}");
        }
        assert!(mesh.notes.is_empty(), "{:?}", mesh.notes);
    }

    #[test]
    fn facets_narrower_than_their_folds_are_refused() {
        let bend = Bend { thickness: 2.0, radius: 4.0, k: 0.5 };
        let problem = bend.apply(strip(&[(0.0, 0.0), (9.0, 0.0), (9.0, -3.0), (18.0, -3.0)])).unwrap_err().to_string();
        assert!(problem.contains("vanishes"), "{problem}");
    }
}
