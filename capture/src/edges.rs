//! How sharp a photograph is: the spread of the edges of its markers.

use biscale::numerics::cast::truncate_usize;
use biscale::numerics::statistics::upper_median;
use glam::DVec2;

/// A grey picture to look up.
pub trait GreyImage {
    /// Bilinear value at a place, px; `None` outside.
    fn value(&self, place: DVec2) -> Option<f64>;
}

/// How the spread of edges is measured. Chosen, not measured; for a normal blur of 0.5 to 2 pixels the result is right within 5 % (test below).
struct SpreadParams {
    /// Profiles of a side.
    places: usize,
    /// Part of a side that is left out at each end: corners are no edges.
    ends: f64,
    /// Step of a profile, px.
    step_px: f64,
    /// Smallest cell of a marker that is looked at, px.
    least_cell_px: f64,
    /// Half length of a profile in cells of the marker, and in pixels at most.
    reach: (f64, f64),
    /// Part of a profile's samples whose mean is the dark or the light side: one over this.
    end_part: usize,
    /// Step of light, of the lighter side, below which there is no edge.
    least_contrast: f64,
}

const PARAMS: SpreadParams =
    SpreadParams { places: 16, ends: 0.15, step_px: 0.125, least_cell_px: 3.0, reach: (0.8, 8.0), end_part: 6, least_contrast: 0.1 };

/// The median distance over which an edge goes from 10 to 90 % of its step, px, over all sides of quadrilaterals; `None` if none has room for it.
///
/// `cells` is how many cells a side has: the black border is one wide, and so is the profile to each side of the edge.
pub fn spread(image: &impl GreyImage, markers: &[[DVec2; 4]], cells: f64) -> Option<f64> {
    let mut widths: Vec<f64> = Vec::new();
    for corners in markers {
        let middle = corners.iter().sum::<DVec2>() / 4.0;
        for k in 0..4 {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            let cell = a.distance(b) / cells;
            if cell < PARAMS.least_cell_px {
                continue;
            }
            let reach = (PARAMS.reach.0 * cell).min(PARAMS.reach.1);
            let along = (b - a).normalize();
            let out = if along.perp().dot(a - middle) > 0.0 { along.perp() } else { -along.perp() };
            for i in 0..PARAMS.places {
                let at = a.lerp(b, PARAMS.ends + (1.0 - 2.0 * PARAMS.ends) * i as f64 / (PARAMS.places - 1) as f64);
                widths.extend(profile_width(image, at, out, reach, PARAMS.step_px));
            }
        }
    }
    if widths.len() < PARAMS.places {
        return None;
    }
    upper_median(&mut widths)
}

/// 10 to 90 % of one profile, from dark inside to light outside.
fn profile_width(image: &impl GreyImage, at: DVec2, out: DVec2, reach: f64, step: f64) -> Option<f64> {
    let count = truncate_usize(2.0 * reach / step);
    let values: Vec<f64> = (0..=count).map(|k| image.value(at + (k as f64 * step - reach) * out)).collect::<Option<_>>()?;
    let end = (count / PARAMS.end_part).max(1);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (dark, light) = (mean(&values[..end]), mean(&values[values.len() - end..]));
    let height = light - dark;
    if !(height > PARAMS.least_contrast * light.max(f64::MIN_POSITIVE)) {
        return None;
    }
    // From the middle of the edge outwards, so that noise at the ends is not taken for it.
    let share = |k: usize| (values[k] - dark) / height;
    let middle = (1..values.len()).filter(|&k| share(k - 1) < 0.5 && share(k) >= 0.5).min_by_key(|&k| k.abs_diff(values.len() / 2))?;
    let low = (0..middle).rev().find(|&k| share(k) <= 0.1)?;
    let high = (middle..values.len()).find(|&k| share(k) >= 0.9)?;
    let crossing = |a: usize, b: usize, level: f64| a as f64 + (level - share(a)) / (share(b) - share(a));
    let (from, to) = (crossing(low, low + 1, 0.1), crossing(high - 1, high, 0.9));
    let width = (to - from) * step;
    (width.is_finite() && width > 0.0).then_some(width)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A black square of 70 px from (30, 30), blurred by a normal curve of this standard deviation (the error function by its slope).
    struct Blurred(f64);

    impl GreyImage for Blurred {
        fn value(&self, p: DVec2) -> Option<f64> {
            let step = |x: f64| {
                // Simpson's rule over the normal curve.
                let n = 200;
                let f = |t: f64| (-0.5 * t * t).exp() / std::f64::consts::TAU.sqrt();
                let (a, b) = (-6.0, (x / self.0).clamp(-6.0, 6.0));
                let h = (b - a) / f64::from(n);
                (0..=n)
                    .map(|k| {
                        f(a + h * f64::from(k))
                            * if k == 0 || k == n {
                                1.0
                            } else if k % 2 == 1 {
                                4.0
                            } else {
                                2.0
                            }
                    })
                    .sum::<f64>()
                    * h
                    / 3.0
            };
            let inside = |v: f64| step(v - 30.0) * step(100.0 - v);
            Some(0.9 - 0.85 * inside(p.x) * inside(p.y))
        }
    }

    #[test]
    fn the_spread_of_a_normal_blur_is_known() {
        let corners = [DVec2::new(30.0, 30.0), DVec2::new(100.0, 30.0), DVec2::new(100.0, 100.0), DVec2::new(30.0, 100.0)];
        for sigma in [0.5, 1.0, 2.0] {
            let found = spread(&Blurred(sigma), &[corners], 7.0).unwrap();
            // The normal curve holds 80 % within 1.2816 standard deviations.
            assert!((found / (2.563 * sigma) - 1.0).abs() < 0.05, "{sigma}: {found}");
        }
        assert!(spread(&Blurred(1.0), &[corners.map(|c| c * 0.1)], 7.0).is_none(), "too small");
        assert!(spread(&Blurred(1.0), &[], 7.0).is_none());
    }
}
