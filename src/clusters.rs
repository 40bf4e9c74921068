//! Clusters of triangles with nearly the same normal.
//!
//! A surface of few distinct normals (grooves, pyramids, folded paper) has few values of its BRDF a pair of directions: facets of one
//! cluster are counted by popcount of their visibility bits, and the BRDF is evaluated once a cluster. A cluster of several normals
//! carries what its sums need of them:
//!
//! - the mean normal and the covariance `C` of the slopes in the mean's frame, which widens a lobe of roughness `alpha` to the
//!   anisotropic roughness `alpha² I + 2 C` (Beckmann's slopes are Gaussian with variance `alpha²/2` an axis, and variances add;
//!   for GGX a good model, see `numerics.md`, section 3.2);
//! - the second moment `E[n nᵀ]`, since `(n·i)(n·o)` of a Lambertian facet is quadratic in its normal.
//!
//! What this costs in accuracy is measured on the pairs themselves: see `filter/direct/`.

use glam::DVec3;

/// A cluster wider than this share of a lobe's roughness is split (about 1 % of the value at roughness .3).
pub const SPREAD_PER_ALPHA: f64 = 0.1;
/// Slopes below this count as one normal: it is what f32 positions leave of equal ones.
const SAME: f64 = 1e-6;

/// Triangles that count as one normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// What covers them.
    pub surface: u16,
    /// Mean normal, unit, weighted by area.
    pub normal: DVec3,
    /// Tangents; with the normal they are orthonormal.
    pub tangents: [DVec3; 2],
    /// Covariance of the slopes along the tangents: xx, xy, yy.
    pub covariance: [f64; 3],
    /// `E[n nᵀ]`: xx, yy, zz, xy, xz, yz.
    pub moment: [f64; 6],
}

/// Clusters of the triangles of all surfaces, in the order of the surfaces, and for each triangle its cluster.
///
/// `spread` is the largest standard deviation of slopes of a cluster of each surface (0: equal normals only). `None` when more than
/// `most` clusters would be needed.
pub fn clusters(normals: &[DVec3], areas: &[f64], surface: &[u16], spread: &[f64], most: usize) -> Option<(Vec<Cluster>, Vec<u32>)> {
    let mut clusters = Vec::new();
    let mut of_triangle = vec![0; normals.len()];
    for (s, &limit) in (0..).zip(spread) {
        let members: Vec<u32> = (0_u32..).zip(surface).filter(|&(_, &of)| of == s).map(|(t, _)| t).collect();
        let mut open = if members.is_empty() { Vec::new() } else { vec![members] };
        while let Some(mut members) = open.pop() {
            let (cluster, widest) = describe(&members, normals, areas, s);
            let (axis, deviation) = widest?;
            if deviation > limit.max(SAME) && members.len() > 1 {
                // Where the mean along the widest axis cuts it, none of the halves is empty.
                let along = |t: u32| normals[t as usize].dot(axis);
                let mean = members.iter().map(|&t| along(t)).sum::<f64>() / members.len() as f64;
                let high: Vec<u32> = members.extract_if(.., |t| along(*t) > mean).collect();
                if !high.is_empty() && !members.is_empty() {
                    open.push(high);
                    open.push(members);
                    if clusters.len() + open.len() > most {
                        return None;
                    }
                    continue;
                }
            }
            let place = u32::try_from(clusters.len()).ok()?;
            for t in members {
                of_triangle[t as usize] = place;
            }
            clusters.push(cluster);
        }
    }
    (clusters.len() <= most).then_some((clusters, of_triangle))
}

/// A cluster of triangles, and the axis along which its normals spread most with their deviation along it.
///
/// The axis is `None` for normals that are none.
fn describe(members: &[u32], normals: &[DVec3], areas: &[f64], surface: u16) -> (Cluster, Option<(DVec3, f64)>) {
    let of = |t: &u32| (normals[*t as usize], areas[*t as usize]);
    let total: f64 = members.iter().map(|t| of(t).1).sum();
    let sum: DVec3 = members.iter().map(|t| of(t).0 * of(t).1).sum();
    let first = normals[members[0] as usize];
    let normal = sum.try_normalize().unwrap_or(first);
    if !normal.is_normalized() || total <= 0.0 {
        let none = Cluster { surface, normal: DVec3::Z, tangents: [DVec3::X, DVec3::Y], covariance: [0.0; 3], moment: [0.0; 6] };
        return (none, None);
    }
    let (t1, t2) = normal.any_orthonormal_pair();
    let mut moment = [0.0; 6];
    // Slopes; a normal that leans away from the mean by more than this has none to speak of, and counts as far.
    const LEAST_COSINE: f64 = 0.1;
    let (mut mean, mut squares) = ([0.0; 2], [0.0; 3]);
    for t in members {
        let (n, area) = of(t);
        let w = area / total;
        for (m, value) in moment.iter_mut().zip([n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z]) {
            *m += w * value;
        }
        let up = n.dot(normal).max(LEAST_COSINE);
        let s = [n.dot(t1) / up, n.dot(t2) / up];
        mean = [mean[0] + w * s[0], mean[1] + w * s[1]];
        squares = [squares[0] + w * s[0] * s[0], squares[1] + w * s[0] * s[1], squares[2] + w * s[1] * s[1]];
        // Opposite normals have no slopes: their distance keeps them apart.
        if n.dot(normal) < LEAST_COSINE {
            squares[0] += w;
        }
    }
    let c = [squares[0] - mean[0] * mean[0], squares[1] - mean[0] * mean[1], squares[2] - mean[1] * mean[1]];
    let (half_trace, half_difference) = (0.5 * (c[0] + c[2]), 0.5 * (c[0] - c[2]));
    let root = half_difference.hypot(c[1]);
    let deviation = (half_trace + root).max(0.0).sqrt();
    // The eigenvector of the larger eigenvalue; if the mean vanished, the normals spread along the first of them.
    let angle = 0.5 * c[1].atan2(half_difference);
    let axis = if sum.length() < LEAST_COSINE * total { first } else { t1 * angle.cos() + t2 * angle.sin() };
    (
        Cluster { surface, normal, tangents: [t1, t2], covariance: c.map(|x| if deviation <= SAME { 0.0 } else { x }), moment },
        Some((axis, deviation)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_normals_are_one_cluster_and_others_are_not() {
        let tilted = DVec3::new(0.6, 0.0, 0.8);
        let normals = [DVec3::Z, tilted, DVec3::Z, -DVec3::Z, tilted];
        let (clusters, of) = clusters(&normals, &[1.0, 2.0, 3.0, 1.0, 1.0], &[0, 0, 0, 0, 1], &[0.0, 0.0], 8).unwrap();
        assert_eq!(clusters.len(), 4);
        assert_eq!(of[0], of[2]);
        assert!(of[0] != of[1] && of[1] != of[4] && of[0] != of[3]);
        for (n, &c) in normals.iter().zip(&of) {
            let cluster = clusters[c as usize];
            assert!((cluster.normal - *n).length() < 1e-9 && cluster.covariance == [0.0; 3], "{cluster:?}");
        }
    }

    #[test]
    fn a_cap_of_normals_splits_until_each_cluster_is_narrow() {
        let normals: Vec<DVec3> =
            (0..400).map(|k| DVec3::new(0.05 * f64::from(k % 20 - 10), 0.05 * f64::from(k / 20 - 10), 1.0).normalize()).collect();
        let (few, of) = clusters(&normals, &[1.0; 400], &[0; 400], &[0.1], 400).unwrap();
        assert!(few.len() > 4 && few.len() < 100, "{} clusters", few.len());
        for (n, &c) in normals.iter().zip(&of) {
            let cluster = &few[c as usize];
            assert!(n.dot(cluster.normal) > 0.9, "{n} in {cluster:?}");
            assert!(cluster.covariance[0] <= 0.0101 && cluster.covariance[2] <= 0.0101, "{cluster:?}");
        }
        assert!(clusters(&normals, &[1.0; 400], &[0; 400], &[0.0], 399).is_none(), "400 normals in 399 clusters");
    }

    #[test]
    fn the_moment_of_a_cluster_is_that_of_its_normals() {
        let normals = [DVec3::new(0.1, 0.0, 0.995).normalize(), DVec3::new(-0.1, 0.0, 0.995).normalize()];
        let (clusters, _) = clusters(&normals, &[1.0, 3.0], &[0, 0], &[0.5], 2).unwrap();
        assert_eq!(clusters.len(), 1);
        let xx = normals[0].x.powi(2);
        assert!(
            (clusters[0].moment[0] - xx).abs() < 1e-12
                && (clusters[0].moment[4] - (0.25 - 0.75) * normals[0].x * normals[0].z).abs() < 1e-12
        );
    }
}
