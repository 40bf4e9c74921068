//! Folding up what was read, and everything that can be wrong with it.

use super::{Seen, SeenFacet};
use crate::mesh::Mesh;
use biscale::error::BadInput;
use glam::{DMat3, DVec2, DVec3};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;
use rustc_hash::FxHashMap;
use serde::Serialize;

/// What was found; lengths in mm.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Facets of the design.
    pub facets: usize,
    /// Pieces in the file.
    pub pieces: usize,
    /// Facets of the design that are not in the file exactly once, and polygons turned the wrong way.
    pub missing_or_double: usize,
    /// Largest difference of an edge's length from the design's, of that length.
    pub edge_length_error: f64,
    /// Largest difference of a fold's angle from the design's, degrees.
    pub fold_angle_error_deg: f64,
    /// Largest distance of a refolded corner from the design's, each piece moved as a whole to where it fits best.
    pub position_error_mm: f64,
    /// Largest gap between the two sides of a glued edge.
    pub glue_gap_mm: f64,
    /// Largest distance of a corner in the file's own folded form from the design's; none if the file has no such form.
    pub folded_form_error_mm: Option<f64>,
    /// Pairs of facets or tabs that overlap by more than `OVERLAP`.
    pub overlaps: usize,
    /// Area of the largest such overlap, mm².
    pub largest_overlap_mm2: f64,
    /// Crossings of cut lines with themselves and each other.
    pub crossings: usize,
    /// Relative difference between the area inside the cut lines and that of facets and tabs; none if the file has no cut lines.
    pub outline_area_error: Option<f64>,
    /// How far anything reaches into the margin.
    pub margin_violation_mm: f64,
    /// Glued edges with a number, and those whose number is not the same on both sides or stands at edges that do not belong together.
    pub numbered: usize,
    /// Of these, how many are wrong.
    pub wrong_numbers: usize,
    /// Least width of a facet.
    pub narrowest_facet_mm: f64,
    /// What is wrong, in words; nothing if all is well.
    pub failures: Vec<String>,
}

/// Overlap of two polygons that counts, mm²: that of a hair of 0.01 mm over 10 mm is 0.1.
pub const OVERLAP: f64 = 1e-4;
/// Edge lengths must agree to this share.
pub const EDGE_LENGTH: f64 = 1e-6;
/// Refolded corners must lie where the design has them, mm.
pub const POSITION: f64 = 1e-4;
/// Fold angles must agree, degrees.
pub const ANGLE_DEG: f64 = 1e-4;
/// Corners of two facets of one piece closer than this are one point, mm.
const SAME: f64 = 2e-6;

/// Signed area of a polygon, positive for counter-clockwise.
pub(super) fn signed_area(p: &[DVec2]) -> f64 {
    (0..p.len()).map(|k| p[k].perp_dot(p[(k + 1) % p.len()])).sum::<f64>() / 2.0
}

/// Compares what was read with the design.
///
/// # Errors
/// A file whose facets are not those of the design at all.
pub fn verify(seen: &Seen, design: &Mesh, margin: f64) -> Result<Report, BadInput> {
    let mut report = Report { facets: design.facets.len(), ..Report::default() };
    let mut count = vec![0_usize; design.facets.len()];
    for facet in &seen.facets {
        let known = design.facets.get(facet.facet as usize).filter(|f| f.corners.len() == facet.polygon.len());
        if known.is_none() {
            let problem = format!("facet {} with {} corners is none of the design's", facet.facet, facet.polygon.len());
            return Err(BadInput::new(problem, "is it the material that the file was made from?").at_field("--against"));
        }
        count[facet.facet as usize] += 1;
    }
    report.missing_or_double = count.iter().filter(|&&n| n != 1).count() + seen.turned;
    report.pieces = seen.facets.iter().map(|f| f.piece).collect::<std::collections::BTreeSet<_>>().len();
    lengths(seen, design, &mut report);
    let links = links(seen, design, &mut report);
    refold(seen, design, &links, &mut report);
    (report.numbered, report.wrong_numbers) = super::numbers::check(seen, design);
    overlaps(seen, &mut report);
    outlines(seen, &mut report);
    for (page, [low, high]) in seen.pages.iter().zip(&seen.extents) {
        let over = (DVec2::splat(margin) - *low).max(*high - (*page - margin)).max_element();
        report.margin_violation_mm = report.margin_violation_mm.max(over);
    }
    report.judge();
    Ok(report)
}

fn lengths(seen: &Seen, design: &Mesh, report: &mut Report) {
    report.narrowest_facet_mm = f64::INFINITY;
    for facet in &seen.facets {
        let n = facet.polygon.len();
        for k in 0..n {
            let here = facet.polygon[k].distance(facet.polygon[(k + 1) % n]);
            let f = facet.facet as usize;
            let there = design.corner(f, k).distance(design.corner(f, (k + 1) % n));
            report.edge_length_error = report.edge_length_error.max((here - there).abs() / there);
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
struct Link {
    a: usize,
    edge_a: usize,
    b: usize,
    angle: f64,
}

/// Finds the edges that two facets of a piece share in the file, and the fold line drawn there.
fn links(seen: &Seen, design: &Mesh, report: &mut Report) -> Vec<Link> {
    let key = |page: usize, p: DVec2| (page, (p.x / 1e-3).round() as i64, (p.y / 1e-3).round() as i64);
    // Middles of edges, in cells of a micrometre; a neighbour's middle may fall into the next cell.
    let mut middles: FxHashMap<(usize, i64, i64), Vec<(usize, usize)>> = FxHashMap::default();
    for (i, facet) in seen.facets.iter().enumerate() {
        let n = facet.polygon.len();
        for k in 0..n {
            middles.entry(key(facet.page, 0.5 * (facet.polygon[k] + facet.polygon[(k + 1) % n]))).or_default().push((i, k));
        }
    }
    let mut drawn: FxHashMap<(usize, i64, i64), Vec<usize>> = FxHashMap::default();
    for (i, fold) in seen.folds.iter().enumerate() {
        drawn.entry(key(fold.page, 0.5 * (fold.ends[0] + fold.ends[1]))).or_default().push(i);
    }
    let around = |(page, x, y): (usize, i64, i64)| (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| (page, x + dx, y + dy)));
    let edge = |i: usize, k: usize| {
        let p: &SeenFacet = &seen.facets[i];
        [p.polygon[k], p.polygon[(k + 1) % p.polygon.len()]]
    };
    let same = |[a, b]: [DVec2; 2], [c, d]: [DVec2; 2]| a.distance(c) < SAME && b.distance(d) < SAME;
    let mut out = Vec::new();
    for (i, facet) in seen.facets.iter().enumerate() {
        for k in 0..facet.polygon.len() {
            let [a, b] = edge(i, k);
            let here = key(facet.page, 0.5 * (a + b));
            let twins = around(here).flat_map(|c| middles.get(&c).into_iter().flatten());
            for &(j, l) in twins {
                if j <= i
                    || seen.facets[j].piece != facet.piece
                    || !same([a, b], {
                        let [c, d] = edge(j, l);
                        [d, c]
                    })
                {
                    continue;
                }
                let fold = around(here)
                    .flat_map(|c| drawn.get(&c).into_iter().flatten())
                    .map(|&f| &seen.folds[f])
                    .find(|f| same(f.ends, [a, b]) || same(f.ends, [b, a]));
                let angle = fold.map_or(0.0, |f| f.angle);
                report.fold_angle_error_deg = report
                    .fold_angle_error_deg
                    .max((angle - designed_angle(design, facet.facet, k, seen.facets[j].facet)).abs().to_degrees());
                out.push(Link { a: i, edge_a: k, b: j, angle });
            }
        }
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

/// A rigid motion of space.
#[derive(Clone, Copy, Debug)]
struct Motion {
    turn: DMat3,
    shift: DVec3,
}

impl Motion {
    fn apply(&self, p: DVec3) -> DVec3 {
        self.turn * p + self.shift
    }
}

/// Folds every piece, starting from its first facet flat on the plane, and lays it onto the design.
fn refold(seen: &Seen, design: &Mesh, links: &[Link], report: &mut Report) {
    let n = seen.facets.len();
    let mut around: Vec<Vec<usize>> = vec![Vec::new(); n];
    for (k, link) in links.iter().enumerate() {
        around[link.a].push(k);
        around[link.b].push(k);
    }
    let mut motion: Vec<Option<Motion>> = vec![None; n];
    // Corners of the design's facets, refolded: both sides of a glued edge can be compared.
    let mut placed: FxHashMap<(u32, usize), DVec3> = FxHashMap::default();
    for start in 0..n {
        if motion[start].is_some() {
            continue;
        }
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
    for edge in &design.edges {
        let [Some((f, k)), Some((g, l))] = edge.sides else { continue };
        let ends = |f: u32, k: u32| {
            let n = design.facets[f as usize].corners.len();
            Some([*placed.get(&(f, k as usize))?, *placed.get(&(f, (k as usize + 1) % n))?])
        };
        if let (Some([a, b]), Some([d, c])) = (ends(f, k), ends(g, l)) {
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

/// The motion that brings the first points of the pairs nearest to the second ones in the sense of least squares (Horn 1987,
/// "Closed-form solution of absolute orientation using unit quaternions"), by power iteration on Horn's matrix, shifted to be positive.
fn best_fit(pairs: &[(DVec3, DVec3, (u32, usize))]) -> Motion {
    let n = pairs.len() as f64;
    let (p0, q0) = (pairs.iter().map(|x| x.0).sum::<DVec3>() / n, pairs.iter().map(|x| x.1).sum::<DVec3>() / n);
    let mut s = [[0.0_f64; 3]; 3];
    for (p, q, _) in pairs {
        let (p, q) = ((*p - p0).to_array(), (*q - q0).to_array());
        for (row, a) in s.iter_mut().zip(p) {
            for (cell, b) in row.iter_mut().zip(q) {
                *cell += a * b;
            }
        }
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
    let matrix = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let q = largest_eigenvector(matrix);
    let turn = DMat3::from_quat(glam::DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize());
    Motion { turn, shift: q0 - turn * p0 }
}

/// Eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi rotations.
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut v = [[0.0; 4]; 4];
    for (k, row) in v.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for _ in 0..50 {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let (c, s) = (1.0 / t.hypot(1.0), t / t.hypot(1.0));
                for k in 0..4 {
                    let (x, y) = (a[k][p], a[k][q]);
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for k in 0..4 {
                    let (x, y) = (a[p][k], a[q][k]);
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for row in &mut v {
                    let (x, y) = (row[p], row[q]);
                    row[p] = c * x - s * y;
                    row[q] = s * x + c * y;
                }
            }
        }
    }
    let best = (0..4).max_by(|&i, &j| a[i][i].total_cmp(&a[j][j])).expect("four of them");
    v.map(|row| row[best])
}

/// Areas of pairs of polygons on one page whose boxes meet.
fn overlaps(seen: &Seen, report: &mut Report) {
    let shapes: Vec<(usize, &[DVec2])> =
        seen.facets.iter().map(|f| (f.page, f.polygon.as_slice())).chain(seen.tabs.iter().map(|(p, t)| (*p, t.as_slice()))).collect();
    let boxes: Vec<[DVec2; 2]> = shapes
        .iter()
        .map(|(_, s)| [s.iter().copied().fold(DVec2::INFINITY, DVec2::min), s.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max)])
        .collect();
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    order.sort_unstable_by(|&a, &b| shapes[a].0.cmp(&shapes[b].0).then(boxes[a][0].x.total_cmp(&boxes[b][0].x)));
    for (at, &i) in order.iter().enumerate() {
        for &j in &order[at + 1..] {
            if shapes[j].0 != shapes[i].0 || boxes[j][0].x >= boxes[i][1].x - SAME {
                break;
            }
            if boxes[j][0].y >= boxes[i][1].y - SAME || boxes[i][0].y >= boxes[j][1].y - SAME {
                continue;
            }
            let points = |k: usize| shapes[k].1.iter().map(|p| p.to_array()).collect::<Vec<[f64; 2]>>();
            let common = points(i).overlay(&points(j), OverlayRule::Intersect, FillRule::NonZero);
            let area: f64 = common
                .iter()
                .flatten()
                .map(|c| signed_area(&c.iter().map(|p| DVec2::from_array(*p)).collect::<Vec<_>>()))
                .sum::<f64>()
                .abs();
            if area > OVERLAP {
                report.overlaps += 1;
                report.largest_overlap_mm2 = report.largest_overlap_mm2.max(area);
            }
        }
    }
}

/// Crossings of cut lines, and whether they hold what they should.
fn outlines(seen: &Seen, report: &mut Report) {
    if seen.outlines.is_empty() {
        return;
    }
    let mut segments: Vec<(usize, DVec2, DVec2)> = Vec::new();
    for (page, outline) in &seen.outlines {
        let n = outline.len();
        segments.extend((0..n).map(|k| (*page, outline[k], outline[(k + 1) % n])));
    }
    segments.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.x.min(a.2.x).total_cmp(&b.1.x.min(b.2.x))));
    for (k, &(page, a, b)) in segments.iter().enumerate() {
        for &(other, c, d) in &segments[k + 1..] {
            if other != page || c.x.min(d.x) > a.x.max(b.x) {
                break;
            }
            if c.y.min(d.y) > a.y.max(b.y) || c.y.max(d.y) < a.y.min(b.y) {
                continue;
            }
            // Ends apart from the other line by more than rounding, on both of its sides, for both.
            let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).normalize_or_zero().perp_dot(r - p);
            let apart = |x: f64, y: f64| (x > SAME && y < -SAME) || (x < -SAME && y > SAME);
            if apart(side(a, b, c), side(a, b, d)) && apart(side(c, d, a), side(c, d, b)) {
                report.crossings += 1;
            }
        }
    }
    let inside: f64 = seen.outlines.iter().map(|(_, o)| signed_area(o)).sum();
    let all: f64 = seen.facets.iter().map(|f| signed_area(&f.polygon)).chain(seen.tabs.iter().map(|(_, t)| signed_area(t))).sum();
    report.outline_area_error = Some((inside / all - 1.0).abs());
}

/// Whether an error is above a limit, or no number.
fn exceeds(error: f64, limit: f64) -> bool {
    error.is_nan() || error > limit
}

impl Report {
    fn judge(&mut self) {
        let mut failures = Vec::new();
        let mut check = |bad: bool, text: String| {
            if bad {
                failures.push(text);
            }
        };
        check(self.missing_or_double > 0, format!("{} facets are missing, double or turned", self.missing_or_double));
        check(exceeds(self.edge_length_error, EDGE_LENGTH), format!("an edge's length is off by {:e} of it", self.edge_length_error));
        check(exceeds(self.fold_angle_error_deg, ANGLE_DEG), format!("a fold is off by {:e} degrees", self.fold_angle_error_deg));
        check(exceeds(self.position_error_mm, POSITION), format!("a refolded corner is off by {:e} mm", self.position_error_mm));
        check(exceeds(self.glue_gap_mm, 2.0 * POSITION), format!("a glued edge gapes by {:e} mm", self.glue_gap_mm));
        check(self.folded_form_error_mm.is_some_and(|e| exceeds(e, POSITION)), "the folded form in the file is not the design".to_owned());
        check(self.overlaps > 0, format!("{} overlaps, the largest of {:.4} mm2", self.overlaps, self.largest_overlap_mm2));
        check(self.crossings > 0, format!("cut lines cross {} times", self.crossings));
        check(
            self.outline_area_error.is_some_and(|e| exceeds(e, 1e-6)),
            "the cut lines do not hold the facets and tabs exactly".to_owned(),
        );
        check(self.wrong_numbers > 0, format!("{} numbers at glued edges are wrong", self.wrong_numbers));
        check(self.margin_violation_mm > 1e-6, format!("something reaches {:.3} mm into the margin", self.margin_violation_mm));
        self.failures = failures;
    }

    /// The report in a few lines.
    pub fn lines(&self) -> String {
        let optional = |x: Option<f64>| x.map_or("none in the file".to_owned(), |x| format!("{x:.2e}"));
        format!(
            "{} facets in {} pieces; {} missing or double\nlargest edge length error: {:.2e} of the length\n\
             largest fold angle error: {:.2e} degrees\nlargest position error after folding: {:.2e} mm\nlargest gap at glued edges: {:.2e} mm\n\
             folded form in the file: {} mm off\noverlaps: {}; crossings of cut lines: {}; area inside the cut lines: {} off\n\
             reaches into the margin: {:.3} mm\nnumbers at glued edges: {}, {} wrong\nnarrowest facet: {:.2} mm",
            self.facets,
            self.pieces,
            self.missing_or_double,
            self.edge_length_error,
            self.fold_angle_error_deg,
            self.position_error_mm,
            self.glue_gap_mm,
            optional(self.folded_form_error_mm),
            self.overlaps,
            self.crossings,
            optional(self.outline_area_error),
            self.margin_violation_mm.max(0.0),
            self.numbered,
            self.wrong_numbers,
            self.narrowest_facet_mm
        )
    }
}
