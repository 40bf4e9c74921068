//! Rotations of a piece that are worth trying.

use glam::DVec2;

/// A rotation: its x axis, and the box that the piece takes then.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub(super) x: DVec2,
    pub(super) low: DVec2,
    pub(super) size: DVec2,
}

impl Turn {
    /// The piece turned by the unit vector `x`.
    pub(super) fn new(hull: &[DVec2], x: DVec2) -> Self {
        let [low, high] = crate::polygon::bounds(hull.iter().map(|p| turned(*p, x)));
        Self { x, low, size: high - low }
    }

    /// Whether it lies in an area; that of a roll is as long as needed.
    pub(super) fn fits(&self, area: DVec2, roll: bool) -> bool {
        self.size.x <= area.x + ROUNDING && (roll || self.size.y <= area.y + ROUNDING)
    }
}

/// A box larger by this much still fits, mm.
const ROUNDING: f64 = 1e-9;

/// Further rotations beside those of the smallest box, in a full turn: true shapes fit each other in many ways. Chosen, not measured.
const EVEN_TURNS: usize = 16;

/// A point turned by a unit vector.
pub(super) fn turned(p: DVec2, x: DVec2) -> DVec2 {
    p.x * x + p.y * x.perp()
}

/// The turn that fits an area best: that with the least `max(width / area.x, height / area.y)` of all angles.
///
/// Between two angles at which a side of the hull lies along an axis, width and height are each the extent of one pair of corners, a sine
/// of the angle, and so concave: the least of their maximum is at an end, or where both are equal.
pub(super) fn best_fit(hull: &[DVec2], area: DVec2) -> Turn {
    let n = hull.len();
    let half = std::f64::consts::PI;
    let mut angles: Vec<f64> = (0..n)
        .flat_map(|k| {
            let along = hull[(k + 1) % n] - hull[k];
            let angle = -along.y.atan2(along.x);
            [angle, angle + 0.5 * half].map(|a| a.rem_euclid(half))
        })
        .collect();
    angles.sort_by(f64::total_cmp);
    angles.dedup();
    let mut all = angles.clone();
    for (k, &from) in angles.iter().enumerate() {
        let to = angles.get(k + 1).copied().unwrap_or(angles[0] + half);
        let middle = DVec2::from_angle(0.5 * (from + to));
        let extent = |axis: DVec2| {
            let end =
                |sign: f64| hull.iter().copied().max_by(|p, q| (sign * axis.dot(*p)).total_cmp(&(sign * axis.dot(*q)))).unwrap_or_default();
            end(1.0) - end(-1.0)
        };
        // A point turned by the angle t has x = p . (cos t, -sin t) and y = p . (sin t, cos t).
        let d = extent(DVec2::new(middle.x, -middle.y)) / area.x;
        let e = extent(DVec2::new(middle.y, middle.x)) / area.y;
        // d.x cos - d.y sin = e.x sin + e.y cos
        let t = (d.x - e.y).atan2(d.y + e.x);
        let t = from + (t - from).rem_euclid(half);
        if t < to {
            all.push(t);
        }
    }
    let worth = |t: &Turn| (t.size / area).max_element();
    let turns = all.into_iter().map(|a| Turn::new(hull, DVec2::from_angle(a)));
    turns.min_by(|a, b| worth(a).total_cmp(&worth(b))).unwrap_or_else(|| Turn::new(hull, DVec2::X))
}

/// The turns of a piece that fit, none twice: around that of the least box, and the one that fits best.
pub(super) fn turns(hull: &[DVec2], area: DVec2, roll: bool) -> Vec<Turn> {
    let n = hull.len();
    let along = |k: usize| {
        let side = (hull[(k + 1) % n] - hull[k]).normalize_or(DVec2::X);
        DVec2::new(side.x, -side.y)
    };
    let least = (0..n).map(|k| Turn::new(hull, along(k))).min_by(|a, b| (a.size.x * a.size.y).total_cmp(&(b.size.x * b.size.y)));
    let first = least.map_or(DVec2::X, |t| t.x);
    let mut out: Vec<Turn> = (0..EVEN_TURNS)
        .map(|k| {
            let angle = k as f64 * std::f64::consts::TAU / EVEN_TURNS as f64;
            Turn::new(hull, turned(first, DVec2::from_angle(angle)))
        })
        .collect();
    let page = if roll { DVec2::new(area.x, f64::MAX.sqrt()) } else { area };
    let best = best_fit(hull, page);
    out.extend([best.x, -best.x].map(|x| Turn::new(hull, x)));
    out.retain(|t| t.fits(area, roll));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_aslant_only_is_found() {
        // A bar of 100 x 1 in a square of 72: its diagonal is 101.8 long. No side along an axis fits.
        let bar = [DVec2::ZERO, DVec2::new(100.0, 0.0), DVec2::new(100.0, 1.0), DVec2::new(0.0, 1.0)];
        for angle in [0.0, 0.3, 1.0, 2.5] {
            let bar = bar.map(|p| turned(p, DVec2::from_angle(angle)));
            let best = best_fit(&bar, DVec2::splat(72.0));
            // (100 + 1) / sqrt 2
            assert!((best.size - DVec2::splat(71.417_784_9)).length() < 1e-6, "{angle}: {}", best.size);
        }
    }

    #[test]
    fn the_best_fit_is_no_worse_than_any_of_many_angles() {
        let mut random = biscale::numerics::random::Random::new(7);
        for _ in 0..200 {
            let points = (0..8).map(|_| DVec2::new(random.unit() * 3.0, random.unit())).collect();
            let hull = biscale::numerics::convex_hull::convex_hull(points);
            let area = DVec2::new(0.2 + random.unit(), 0.2 + random.unit());
            let worth = |t: Turn| (t.size / area).max_element();
            let best = worth(best_fit(&hull, area));
            for k in 0..2000 {
                let other = worth(Turn::new(&hull, DVec2::from_angle(f64::from(k) * 0.001_571)));
                assert!(best <= other + 1e-12, "{best} and {other}");
            }
        }
    }
}
