//! Folding up what was read, and comparing it with the design.

use super::best_fit::{Motion, best_fit};
use super::read_pattern::{ReadFold, ReadPattern, SAME};
use super::report::{LENGTH_DIGITS, VerifyReport};
use super::sides::Sides;
use crate::mesh::{Mesh, Side};
use glam::{DMat3, DVec2, DVec3};
use rustc_hash::FxHashMap;

pub(super) fn lengths(seen: &ReadPattern, design: &Mesh, report: &mut VerifyReport) {
    report.narrowest_facet_mm = f64::INFINITY;
    for facet in &seen.facets {
        let n = facet.polygon.len();
        for k in 0..n {
            let here = facet.polygon[k].distance(facet.polygon[(k + 1) % n]);
            let f = facet.facet as usize;
            let there = design.corner(f, k).distance(design.corner(f, (k + 1) % n));
            report.edge_length_error = report.edge_length_error.max(((here - there).abs() - LENGTH_DIGITS).max(0.0) / there);
        }
        for k in 0..n {
            let (a, b) = (facet.polygon[k], facet.polygon[(k + 1) % n]);
            let along = (b - a).normalize_or_zero();
            let width = facet.polygon.iter().map(|&p| along.perp_dot(p - a)).fold(0.0, f64::max);
            report.narrowest_facet_mm = report.narrowest_facet_mm.min(width);
        }
    }
}

/// Two facets of the file whose paper is whole between them: places in `facets`, the edges there, and the angle.
pub(super) struct Link {
    a: usize,
    edge_a: usize,
    b: usize,
    angle: f64,
}

/// The edges whose paper is whole, with the angles of the fold lines drawn there.
pub(super) fn links(seen: &ReadPattern, design: &Mesh, sides: &Sides, report: &mut VerifyReport) -> Vec<Link> {
    let mut drawn: FxHashMap<u32, Vec<&ReadFold>> = FxHashMap::default();
    for fold in &seen.folds {
        drawn.entry(fold.edge).or_default().push(fold);
    }
    let same = |[a, b]: [DVec2; 2], [c, d]: [DVec2; 2]| a.distance(c) < SAME && b.distance(d) < SAME;
    let mut out = Vec::new();
    for (e, edge) in (0_u32..).zip(&design.edges) {
        let [Some(Side { facet, place }), Some(other)] = edge.sides else { continue };
        if !sides.joined[e as usize] {
            continue;
        }
        let (i, j, k) = (sides.place[&facet], sides.place[&other.facet], place as usize);
        let polygon = &seen.facets[i].polygon;
        let [a, b] = [polygon[k], polygon[(k + 1) % polygon.len()]];
        let fold = drawn.get(&e).into_iter().flatten().find(|f| same(f.ends, [a, b]) || same(f.ends, [b, a]));
        let angle = fold.map_or(0.0, |f| f.angle);
        let error = (angle - designed_angle(design, facet, k, other.facet)).abs().to_degrees();
        report.fold_angle_error_deg = report.fold_angle_error_deg.max(error);
        out.push(Link { a: i, edge_a: k, b: j, angle });
    }
    out
}

/// The angle between two facets of the design at an edge of the first, from their corners alone; valley positive.
fn designed_angle(design: &Mesh, f: u32, k: usize, g: u32) -> f64 {
    let corners = |f: u32| (0..design.facets[f as usize].corners.len()).map(move |c| design.corner(f as usize, c)).collect::<Vec<_>>();
    let normal = |c: &[DVec3]| (1..c.len() - 1).map(|k| (c[k] - c[0]).cross(c[k + 1] - c[0])).sum::<DVec3>().normalize_or_zero();
    let (first, second) = (corners(f), corners(g));
    let along = (first[(k + 1) % first.len()] - first[k]).normalize_or_zero();
    let (n, m) = (normal(&first), normal(&second));
    -n.cross(m).dot(along).atan2(n.dot(m))
}

/// Folds every piece, starting from its first facet flat on the plane, and lays it onto the design.
pub(super) fn refold(seen: &ReadPattern, design: &Mesh, links: &[Link], report: &mut VerifyReport) {
    let placed = refolded_corners(seen, design, links, report);
    for edge in &design.edges {
        let [Some(first), Some(second)] = edge.sides else { continue };
        let ends = |Side { facet, place }: Side| {
            let n = design.facets[facet as usize].corners.len();
            Some([*placed.get(&(facet, place as usize))?, *placed.get(&(facet, (place as usize + 1) % n))?])
        };
        if let (Some([a, b]), Some([d, c])) = (ends(first), ends(second)) {
            report.glue_gap_mm = report.glue_gap_mm.max(a.distance(c)).max(b.distance(d));
        }
    }
    if let Some(folded) = &seen.folded {
        let mut worst: f64 = 0.0;
        for (facet, corners) in seen.facets.iter().zip(folded) {
            for (c, p) in corners.iter().enumerate() {
                worst = worst.max(p.distance(design.corner(facet.facet as usize, c)));
            }
        }
        report.folded_form_error_mm = Some(worst);
    }
}

/// The corners of the design's facets as they lie after folding: both sides of a glued edge can be compared.
fn refolded_corners(seen: &ReadPattern, design: &Mesh, links: &[Link], report: &mut VerifyReport) -> FxHashMap<(u32, usize), DVec3> {
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); seen.facets.len()];
    for (k, link) in links.iter().enumerate() {
        around[link.a].push(k);
        around[link.b].push(k);
    }
    let mut motion: Vec<Option<Motion>> = vec![None; seen.facets.len()];
    let mut placed: FxHashMap<(u32, usize), DVec3> = FxHashMap::default();
    for start in 0..seen.facets.len() {
        if motion[start].is_some() {
            continue;
        }
        let group = fold_piece(seen, links, &around, start, &mut motion);
        let pairs: Vec<(DVec3, DVec3, (u32, usize))> = group
            .iter()
            .flat_map(|&i| {
                let facet = &seen.facets[i];
                let m = motion[i].expect("it was placed");
                (0..facet.polygon.len())
                    .map(move |c| (m.apply(facet.polygon[c].extend(0.0)), design.corner(facet.facet as usize, c), (facet.facet, c)))
            })
            .collect();
        let fit = best_fit(&pairs);
        for &(p, wanted, corner) in &pairs {
            let p = fit.apply(p);
            report.position_error_mm = report.position_error_mm.max(p.distance(wanted));
            placed.insert(corner, p);
        }
    }
    placed
}

/// Folds the piece of one facet, which stays flat on the plane; the facets of the piece.
fn fold_piece(seen: &ReadPattern, links: &[Link], around: &[Vec<usize>], start: usize, motion: &mut [Option<Motion>]) -> Vec<usize> {
    motion[start] = Some(Motion { turn: DMat3::IDENTITY, shift: DVec3::ZERO });
    let mut group = vec![start];
    let mut at = 0;
    while at < group.len() {
        let i = group[at];
        let here = motion[i].expect("it was placed");
        for &k in &around[i] {
            let link = &links[k];
            let (other, polygon) = (if link.a == i { link.b } else { link.a }, &seen.facets[link.a].polygon);
            if motion[other].is_some() {
                continue;
            }
            // A valley turns the facet beyond the fold up, about the edge of the first facet, with the inside on its left.
            let (a, b) = (polygon[link.edge_a].extend(0.0), polygon[(link.edge_a + 1) % polygon.len()].extend(0.0));
            let axis = (b - a).normalize_or_zero();
            // From the second facet to the first the way is the inverse.
            let turn = DMat3::from_axis_angle(axis, if link.a == i { -link.angle } else { link.angle });
            let local = Motion { turn, shift: a - turn * a };
            motion[other] = Some(Motion { turn: here.turn * local.turn, shift: here.apply(local.shift) });
            group.push(other);
        }
        at += 1;
    }
    group
}
