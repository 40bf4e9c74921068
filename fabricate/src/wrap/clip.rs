//! Segments within rectangles.

use glam::DVec2;

/// The part of a segment within a rectangle (Liang and Barsky 1984), if it is longer than a dot.
pub(super) fn clip_segment([a, b]: [DVec2; 2], [low, high]: [DVec2; 2]) -> Option<[DVec2; 2]> {
    let along = b - a;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (p, d, l, h) in [(a.x, along.x, low.x, high.x), (a.y, along.y, low.y, high.y)] {
        if d.abs() < 1e-12 {
            if p < l - 1e-9 || p > h + 1e-9 {
                return None;
            }
            continue;
        }
        let (s, t) = ((l - p) / d, (h - p) / d);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    ((to - from) * along.length() > 0.1).then(|| [a + from * along, a + to * along])
}
