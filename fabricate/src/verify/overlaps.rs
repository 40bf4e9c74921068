//! Polygons that overlap, and lines to cut that cross.

use super::read_pattern::{ReadPattern, SAME, bounds, signed_area};
use super::report::{OVERLAP, VerifyReport};
use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

/// Areas of pairs of polygons on one page whose boxes meet.
pub(super) fn overlaps(seen: &ReadPattern, report: &mut VerifyReport) {
    let shapes: Vec<(usize, &[DVec2])> = seen
        .facets
        .iter()
        .map(|f| (f.page, f.polygon.as_slice()))
        .chain(seen.tabs.iter().map(|t| (t.page, t.polygon.as_slice())))
        .collect();
    let boxes: Vec<[DVec2; 2]> = shapes.iter().map(|(_, s)| bounds(s)).collect();
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
pub(super) fn outlines(seen: &ReadPattern, report: &mut VerifyReport) {
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
    let all: f64 = seen.facets.iter().map(|f| signed_area(&f.polygon)).chain(seen.tabs.iter().map(|t| signed_area(&t.polygon))).sum();
    report.outline_area_error = Some((inside / all - 1.0).abs());
}
