//! Periods by the autocorrelation: a second way to the numbers that the spectrum gives.

use super::spectrum::Spectrum;
use glam::{DMat2, DVec2};

/// How peaks of the autocorrelation are located. Chosen on drawn cloths (see [`super`]).
struct AutocorrelationParams {
    /// Most repeats of a vector that are looked at.
    reach: i32,
    /// Distance of a peak from where the spectrum expects it, over the shortest repeat, at most.
    search: f64,
    /// Shorter side of the cut over the farthest shift that is looked at: beyond it little of the cut overlaps itself.
    farthest_part: f64,
    /// Autocorrelation below which a peak is noise.
    least: f64,
    /// Fewest peaks that two vectors are fitted to.
    fewest: usize,
    /// Least standard deviation of a peak's place along an axis, in pixels: what a parabola between pixels leaves.
    least_deviation: f64,
}

const PARAMS: AutocorrelationParams =
    AutocorrelationParams { reach: 12, search: 0.2, farthest_part: 3.0, least: 0.05, fewest: 3, least_deviation: 0.02 };

/// A peak of the autocorrelation: whole multiples of the expected vectors, its place in pixels, and its height as weight.
type ShiftPeak = ([f64; 2], DVec2, f64);

/// The vectors after which a cut repeats, near the vectors `expected` (one or two, in pixels), and the standard error of their components.
///
/// Peaks of the autocorrelation are located between pixels by parabolas, and the vectors fitted to all within a third of the cut.
pub(super) fn repeats(spectrum: &Spectrum, expected: &[DVec2]) -> Option<(Vec<DVec2>, f64)> {
    let peaks = located(spectrum, expected);
    let (mut mm, mut mn, mut nn, mut mp, mut np) = (0.0, 0.0, 0.0, DVec2::ZERO, DVec2::ZERO);
    for &([m, n], p, weight) in &peaks {
        (mm, mn, nn) = (mm + weight * m * m, mn + weight * m * n, nn + weight * n * n);
        (mp, np) = (mp + p * weight * m, np + p * weight * n);
    }
    let basis: Vec<DVec2> = if expected.len() == 1 {
        if mm <= 0.0 {
            return None;
        }
        vec![mp / mm]
    } else {
        let matrix = DMat2::from_cols(DVec2::new(mm, mn), DVec2::new(mn, nn));
        if peaks.len() < PARAMS.fewest || matrix.determinant().abs() < NO_INFORMATION {
            return None;
        }
        let inverse = matrix.inverse();
        let x = inverse * DVec2::new(mp.x, np.x);
        let y = inverse * DVec2::new(mp.y, np.y);
        vec![DVec2::new(x.x, y.x), DVec2::new(x.y, y.y)]
    };
    let value = |[m, n]: [f64; 2]| basis[0] * m + basis.get(1).map_or(DVec2::ZERO, |b| *b * n);
    let weights: f64 = peaks.iter().map(|u| u.2).sum();
    let squares: f64 = peaks.iter().map(|&(whole, p, weight)| weight * (value(whole) - p).length_squared()).sum();
    let freedom = (peaks.len() as f64 - basis.len() as f64).max(1.0);
    let variance = (squares / weights * peaks.len() as f64 / freedom / 2.0).max(PARAMS.least_deviation * PARAMS.least_deviation);
    let information = mm.min(if expected.len() == 1 { mm } else { nn }) / weights * peaks.len() as f64;
    Some((basis, (variance / information.max(NO_INFORMATION)).sqrt()))
}

/// Sums of weights and squared whole numbers below this are rounding.
const NO_INFORMATION: f64 = 1e-9;

/// The peaks of the autocorrelation near whole multiples of the expected vectors.
fn located(spectrum: &Spectrum, expected: &[DVec2]) -> Vec<ShiftPeak> {
    let values = spectrum.autocorrelation();
    let (w, h) = (spectrum.width as i64, spectrum.height as i64);
    let at = |x: i64, y: i64| f64::from(values[(y.rem_euclid(h) * w + x.rem_euclid(w)) as usize]);
    let shortest = expected.iter().map(|e| e.length()).fold(f64::INFINITY, f64::min);
    let radius = ((PARAMS.search * shortest).ceil() as i64).max(1);
    let farthest = w.min(h) as f64 / PARAMS.farthest_part;
    let mut peaks: Vec<ShiftPeak> = Vec::new();
    for m in 0..=PARAMS.reach {
        for n in -PARAMS.reach..=PARAMS.reach {
            if (m == 0 && n <= 0) || (expected.len() == 1 && n != 0) {
                continue;
            }
            let whole = [f64::from(m), f64::from(n)];
            let near = expected[0] * whole[0] + expected.get(1).map_or(DVec2::ZERO, |e| *e * whole[1]);
            if near.length() > farthest {
                continue;
            }
            let (x0, y0) = (near.x.round() as i64, near.y.round() as i64);
            let around = (-radius..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (x0 + dx, y0 + dy)));
            let Some((x, y)) = around.max_by(|a, b| at(a.0, a.1).total_cmp(&at(b.0, b.1))) else { continue };
            let here = at(x, y);
            if here <= PARAMS.least || (x - x0).abs() == radius || (y - y0).abs() == radius {
                continue;
            }
            let offset = |before: f64, after: f64| {
                let bend = before - 2.0 * here + after;
                if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
            };
            let peak = DVec2::new(x as f64 + offset(at(x - 1, y), at(x + 1, y)), y as f64 + offset(at(x, y - 1), at(x, y + 1)));
            peaks.push((whole, peak, here));
        }
    }
    peaks
}
