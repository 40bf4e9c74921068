//! Coplanar neighbours joined to one facet.

use super::adjacency::{Adjacency, Side};
use super::t_junctions::fan_with_points;
use super::tolerance::{FLAT_ANGLE, FLAT_SHARE, Tolerance};
use super::triangles::{Triangles, newell};
use glam::DVec3;
use rustc_hash::FxHashMap;

/// A facet in the making: outline, the triangles in it, colour.
pub(super) struct Group {
    pub(super) corners: Vec<u32>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) colour: [f64; 3],
}

/// Joins coplanar neighbours of one colour, as long as the result is a polygon without holes.
pub(super) fn merge_coplanar(
    soup: &Triangles,
    polygons: &[Vec<u32>],
    adjacency: &Adjacency,
    tolerance: Tolerance,
    kinds: &[u32],
) -> Vec<Group> {
    let mut groups: Vec<Option<Group>> = polygons
        .iter()
        .zip(&soup.triangles)
        .zip(&soup.colours)
        .map(|((corners, &t), &colour)| {
            let triangles = if corners.len() == 3 { vec![t] } else { fan_with_points(soup, corners, t) };
            Some(Group { corners: corners.clone(), triangles, colour })
        })
        .collect();
    let mut owner: Vec<u32> = (0..u32::try_from(groups.len()).expect("few")).collect();
    // Again until nothing changes: an edge refused while it would close a ring may be taken later.
    loop {
        let mut changed = false;
        for e in &adjacency.edges {
            let [Some(Side { facet: f, .. }), Some(Side { facet: g, .. })] = e.sides else { continue };
            let (f, g) = (root(&mut owner, f), root(&mut owner, g));
            // A group keeps the kind of its first triangle, as all of it are of one kind.
            if f == g || kinds[f as usize] != kinds[g as usize] {
                continue;
            }
            let (Some(a), Some(b)) = (&groups[f as usize], &groups[g as usize]) else { continue };
            let Some(corners) = coplanar_outline(soup, a, b, tolerance) else { continue };
            let b = groups[g as usize].take().expect("it was there");
            let a = groups[f as usize].as_mut().expect("it was there");
            a.corners = corners;
            a.triangles.extend(b.triangles);
            owner[g as usize] = f;
            changed = true;
        }
        if !changed {
            break;
        }
    }
    groups.into_iter().flatten().collect()
}

/// The first group of the set of `k`, with the path to it halved (union-find).
fn root(owner: &mut [u32], mut k: u32) -> u32 {
    while owner[k as usize] != k {
        owner[k as usize] = owner[owner[k as usize] as usize];
        k = owner[k as usize];
    }
    k
}

/// The outline of two groups of one colour that lie in one plane; `None` if they do not, or would not be one polygon.
fn coplanar_outline(soup: &Triangles, a: &Group, b: &Group, tolerance: Tolerance) -> Option<Vec<u32>> {
    let area = |corners: &[u32]| newell(corners.iter().map(|&c| soup.vertices[c as usize]));
    let normal = |corners: &[u32]| area(corners).normalize_or_zero();
    if a.colour != b.colour || normal(&a.corners).dot(normal(&b.corners)) < FLAT_ANGLE.cos() {
        return None;
    }
    let corners = join_outlines(&a.corners, &b.corners)?;
    let n = normal(&corners);
    let centre = corners.iter().map(|&c| soup.vertices[c as usize]).sum::<DVec3>() / corners.len() as f64;
    let off = corners.iter().map(|&c| (soup.vertices[c as usize] - centre).dot(n).abs()).fold(0.0, f64::max);
    let reach = corners.iter().map(|&c| soup.vertices[c as usize].distance(centre)).fold(0.0, f64::max);
    let width = area(&corners).length() / (2.0 * reach);
    (off <= tolerance.flat.min(FLAT_SHARE * width)).then_some(corners)
}

/// Takes corners out of the outlines that lie on a straight line there for all facets that have them: what was two edges is one.
pub(super) fn drop_collinear(soup: &Triangles, groups: &mut [Group], tolerance: Tolerance) {
    let mut around: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for group in groups.iter() {
        let n = group.corners.len();
        for k in 0..n {
            let (before, at, after) = (group.corners[(k + n - 1) % n], group.corners[k], group.corners[(k + 1) % n]);
            let list = around.entry(at).or_default();
            for other in [before, after] {
                if !list.contains(&other) {
                    list.push(other);
                }
            }
        }
    }
    let straight = |v: u32| {
        let [a, b] = around[&v][..] else { return false };
        let [a, p, b] = [a, v, b].map(|v| soup.vertices[v as usize]);
        let along = (b - a).normalize_or_zero();
        ((p - a) - along * (p - a).dot(along)).length() <= tolerance.flat && (p - a).dot(b - p) > 0.0
    };
    for group in groups {
        let kept: Vec<u32> = group.corners.iter().copied().filter(|&v| !straight(v)).collect();
        if kept.len() >= 3 {
            group.corners = kept;
        }
    }
}

/// The outline of two polygons that share exactly one chain of edges; `None` if they would touch elsewhere too.
fn join_outlines(a: &[u32], b: &[u32]) -> Option<Vec<u32>> {
    let (n, m) = (a.len(), b.len());
    let place_in_b: FxHashMap<u32, usize> = b.iter().enumerate().map(|(k, &v)| (v, k)).collect();
    // shared[k]: the edge of `a` from corner k runs backwards in `b`.
    let shared: Vec<bool> = (0..n).map(|k| place_in_b.get(&a[(k + 1) % n]).is_some_and(|&j| b[(j + 1) % m] == a[k])).collect();
    let count = shared.iter().filter(|&&s| s).count();
    if count == 0 || count == n {
        return None;
    }
    // The chain starts where the previous edge is not shared; there must be one start.
    let starts: Vec<usize> = (0..n).filter(|&k| shared[k] && !shared[(k + n - 1) % n]).collect();
    let [start] = starts[..] else { return None };
    let end = (start + count) % n;
    // Corners of `a` outside the chain must not be corners of `b`.
    let outside_a: Vec<u32> = (0..n - count + 1).map(|k| a[(end + k) % n]).collect();
    if outside_a[1..outside_a.len() - 1].iter().any(|v| place_in_b.contains_key(v)) {
        return None;
    }
    let from = place_in_b[&a[start]];
    let mut joined = outside_a;
    // b runs the chain backwards, from a[end] to a[start]; what follows a[start] in b leads round to a[end].
    for k in 1..m - count {
        joined.push(b[(from + k) % m]);
    }
    Some(joined)
}
