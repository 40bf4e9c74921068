//! The mean period of a close-up: all its periods registered, and averaged bin by bin.
//!
//! A regular surface shows the same in each of its periods. Their mean has next to no noise, every bin of it has its counterpart in the model's own
//! period, and nothing need be sorted. What differs from period to period (threads that lie askew, edges, what perspective moves, highlights
//! that wander) scatters around the mean, and counts less by as much.

use crate::photograph::image::Photograph;
use crate::photograph::params::PARAMS;
use crate::photograph::period::{Period, coordinates};
use crate::photograph::sight::Sight;
use biscale::geometry::Geometry;
use biscale::numerics::cast::truncate_usize;
use serde::Serialize;

/// All periods registered.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeanPeriod {
    /// Bins along tile x and y; 1 along a direction in which nothing changes.
    pub size: [usize; 2],
    /// Length of a period along tile x and y, where there is one: that of the lattice which makes the mean sharpest.
    pub length: [Option<f64>; 2],
    /// Mean radiance in each bin, rows of x.
    #[serde(skip)]
    pub mean: Vec<[f64; 3]>,
    /// Standard deviation of single pixels there.
    #[serde(skip)]
    pub scatter: Vec<[f64; 3]>,
    /// Pixels there.
    #[serde(skip)]
    pub count: Vec<f64>,
    /// Standard deviation of the difference from a model that is right.
    #[serde(skip)]
    pub sigma: Vec<[f64; 3]>,
}

/// How the tile of a model repeats.
#[derive(Clone, Copy, Debug)]
pub struct TilePeriod {
    /// Length of a period along tile x and y.
    pub length: [f64; 2],
    /// Along which of the two nothing changes: every shift is a period.
    pub uniform: [bool; 2],
}

/// From a point of the picture to its phase in the period, in periods along tile x and y: a matrix, one row an axis; 0 along an axis
/// without a period.
type Lattice = [[f64; 2]; 2];

/// A point of the picture, coordinates along tile x and y, and its radiance.
type Sample = ([f64; 2], [f64; 3]);

/// The points that pixels show, coordinates along tile x and y from their mean.
struct CentredPoints {
    points: Vec<[f64; 2]>,
    /// Largest coordinate.
    reach: f64,
    /// About the size of the picture along either axis: the side of a square of the same standard deviation.
    extent: [f64; 2],
}

/// Side of a square over its standard deviation along it: `sqrt(12)`, rounded up.
const SQUARE_SIDE: f64 = 3.5;

impl MeanPeriod {
    /// Of the pixels `used` with their radiance, from the period that was found in the picture; `None` where the picture does not repeat as the
    /// model's tile does, or shows too few periods or pixels.
    pub fn new(
        photograph: &Photograph,
        used: &[&Sight],
        radiance: &[[f64; 3]],
        period: [Option<Period>; 2],
        tile: TilePeriod,
    ) -> Option<Self> {
        if !repeats_as(period, tile) {
            return None;
        }
        let CentredPoints { points, reach, extent } = CentredPoints::new(photograph, used)?;
        let size = bins_of_a_period(period, extent, points.len() as f64)?;
        let stride = points.len().div_ceil(PARAMS.lattice_pixels);
        let some: Vec<Sample> = points.iter().copied().zip(radiance.iter().copied()).step_by(stride).collect();
        let lattice = sharpest_lattice(straight_lattice(period), reach, &some, size);
        Some(Self::averaged(&lattice, points.iter().copied().zip(radiance.iter().copied()), size))
    }

    /// The mean over all periods of a lattice.
    fn averaged(lattice: &Lattice, samples: impl Iterator<Item = Sample>, size: [usize; 2]) -> Self {
        let bins = size[0] * size[1];
        let (mut mean, mut scatter, mut count) = (vec![[0.0; 3]; bins], vec![[0.0; 3]; bins], vec![0.0; bins]);
        for (point, value) in samples {
            let bin = bin_of(lattice, point, size);
            count[bin] += 1.0;
            for c in 0..3 {
                mean[bin][c] += value[c];
                scatter[bin][c] += value[c] * value[c];
            }
        }
        for ((mean, scatter), &count) in mean.iter_mut().zip(&mut scatter).zip(&count) {
            for c in 0..3 {
                mean[c] /= f64::max(count, 1.0);
                scatter[c] = (scatter[c] / f64::max(count, 1.0) - mean[c] * mean[c]).max(0.0).sqrt();
            }
        }
        let sigma = model_sigma(&mean, &scatter);
        Self { size, length: lengths(lattice), mean, scatter, count, sigma }
    }
}

/// Agreement of a picture with itself along one axis, over that along the other, from which on it repeats along both. Chosen, not measured: of cloths it is 1, and grooves
/// have no period along them.
const CLEAR: f64 = 0.5;

/// What a picture that repeats has other than a tile: that is no matter of numbers that a search moves. `None` where it repeats as the tile does,
/// or along no axis that says so.
pub fn other_periods(period: [Option<Period>; 2], tile: TilePeriod) -> Option<String> {
    let name = |k: usize| ["x", "y"][k];
    let turned = |k: usize| period[k].is_some() && tile.uniform[k] && period[1 - k].is_none();
    if let Some(k) = (0..2).find(|&k| turned(k)) {
        return Some(format!(
            "the close-up repeats along {}, where the material does not change, and not along {}: turn the photograph by 90 degrees, or the camera's `up`",
            name(k),
            name(1 - k)
        ));
    }
    // Only one of them says so that is as clear as that along the axis where the material does change.
    let clear = |k: usize| period[k].zip(period[1 - k]).is_some_and(|(own, other)| own.agreement >= CLEAR * other.agreement);
    if let Some(k) = (0..2).find(|&k| tile.uniform[k] && !tile.uniform[1 - k] && clear(k)) {
        return Some(format!(
            "the close-up repeats along {} too, where the material does not change: it shows another structure; start with another material, or \
             name `structures` that the photographs choose from",
            name(k)
        ));
    }
    match period {
        [Some(x), Some(y)] if !tile.uniform.contains(&true) && !repeats_as(period, tile) => Some(format!(
            "the close-up's period along x is {:.3} times that along y, the material's {:.3} times: give the start material periods of this ratio, or \
             turn the photograph",
            x.length / y.length,
            tile.length[0] / tile.length[1]
        )),
        _ => None,
    }
}

/// Whether periods of a picture are those of a tile: along the same axes, in about the same ratio.
fn repeats_as(period: [Option<Period>; 2], tile: TilePeriod) -> bool {
    let same_axes = (0..2).all(|k| period[k].is_some() != tile.uniform[k]);
    let same_ratio = if let [Some(x), Some(y)] = period {
        ((x.length / y.length) / (tile.length[0] / tile.length[1]) - 1.0).abs() <= PARAMS.period_ratio
    } else {
        true
    };
    same_axes && same_ratio
}

impl CentredPoints {
    /// Of pixels; `None` where the object has no coordinates along tile x and y.
    fn new(photograph: &Photograph, used: &[&Sight]) -> Option<Self> {
        let points = used.iter().map(|s| coordinates(photograph, s.position)).collect::<Option<Vec<_>>>()?;
        let n = points.len() as f64;
        let middle: [f64; 2] = std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
        let points: Vec<[f64; 2]> = points.iter().map(|p| std::array::from_fn(|k| p[k] - middle[k])).collect();
        let reach = points.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        let extent = std::array::from_fn(|k| SQUARE_SIDE * (points.iter().map(|p| p[k] * p[k]).sum::<f64>() / n).sqrt());
        Some(Self { points, reach, extent })
    }
}

/// Bins along x and y, about one a pixel, of a picture of this `extent` with so many `pixels`; `None` where it shows too few periods or pixels.
fn bins_of_a_period(period: [Option<Period>; 2], extent: [f64; 2], pixels: f64) -> Option<[usize; 2]> {
    let mut size = [1; 2];
    for k in 0..2 {
        let Some(found) = period[k] else { continue };
        // Pixels along a period, from how many there are on all of the surface.
        let area = extent[0] * extent[1];
        let along = found.length / (area / pixels).sqrt();
        size[k] = truncate_usize(along.min(PARAMS.most_bins as f64));
        if extent[k] < PARAMS.least_periods * found.length || size[k] < PARAMS.least_bins {
            return None;
        }
    }
    (pixels >= PARAMS.least_pixels * (size[0] * size[1]) as f64).then_some(size)
}

/// The lattice of periods along tile x and y themselves.
fn straight_lattice(period: [Option<Period>; 2]) -> Lattice {
    std::array::from_fn(|k| {
        let mut row = [0.0; 2];
        row[k] = period[k].map_or(0.0, |p| 1.0 / p.length);
        row
    })
}

/// [`MeanPeriod::sigma`]: what a right model leaves out, and a share of the scatter from period to period.
fn model_sigma(mean: &[[f64; 3]], scatter: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let bright = mean.iter().flatten().fold(0.0_f64, |m, v| m.max(*v)).max(1e-9);
    let sigma =
        |mean: f64, scatter: f64| (PARAMS.model_sigma * mean.hypot(PARAMS.dark_share * bright)).hypot(PARAMS.scatter_sigma * scatter);
    mean.iter().zip(scatter).map(|(m, s)| std::array::from_fn(|c| sigma(m[c], s[c]))).collect()
}

/// Along which directions the surface of a geometry does not change.
pub fn uniform(geometry: &Geometry) -> [bool; 2] {
    [false, matches!(geometry, Geometry::Grooves(_))]
}

/// How long the steps of a lattice are.
fn lengths(lattice: &Lattice) -> [Option<f64>; 2] {
    let [[a, b], [c, d]] = *lattice;
    let size = |row: [f64; 2]| row[0].hypot(row[1]);
    match [size(lattice[0]) > 0.0, size(lattice[1]) > 0.0] {
        [true, true] => {
            // The columns of the inverse: from a point to the same one a period on.
            let det = (a * d - b * c).abs();
            [Some(size([d, c]) / det), Some(size([b, a]) / det)]
        }
        is => [0, 1].map(|k| is[k].then(|| 1.0 / size(lattice[k]))),
    }
}

/// The bin of the mean period that a point of the picture falls into.
fn bin_of(lattice: &Lattice, p: [f64; 2], size: [usize; 2]) -> usize {
    let along = |k: usize| {
        let phase = lattice[k][0] * p[0] + lattice[k][1] * p[1];
        let at = truncate_usize((phase - phase.floor()) * size[k] as f64);
        at.min(size[k] - 1)
    };
    along(1) * size[0] + along(0)
}

/// How much the mean period differs from bin to bin: the sharper, the better the lattice.
fn contrast(lattice: &Lattice, samples: &[Sample], size: [usize; 2]) -> f64 {
    let mut sums = vec![([0.0; 3], 0.0); size[0] * size[1]];
    for (p, v) in samples {
        let (sum, count) = &mut sums[bin_of(lattice, *p, size)];
        (0..3).for_each(|c| sum[c] += v[c]);
        *count += 1.0;
    }
    sums.iter().filter(|s| s.1 > 0.0).map(|(sum, count)| sum.iter().map(|v| v * v).sum::<f64>() / count).sum()
}

/// The lattice that makes the mean period sharpest, near the one to start from: its periods are those of a picture that may lie a little askew.
fn sharpest_lattice(start: Lattice, reach: f64, samples: &[Sample], size: [usize; 2]) -> Lattice {
    let mut best = start;
    let mut sharpest = contrast(&best, samples, size);
    let moves: Vec<(usize, usize)> = (0..2).filter(|&k| size[k] > 1).flat_map(|k| [(k, 0), (k, 1)]).collect();
    let mut step = PARAMS.widest_lattice_step;
    while step >= PARAMS.narrowest_lattice_step {
        let mut moved = false;
        for &(k, j) in &moves {
            for side in [-1.0, 1.0] {
                let mut lattice = best;
                lattice[k][j] += side * step / reach;
                if ((lattice[k][j] - start[k][j]) * reach).abs() > PARAMS.lattice_reach {
                    continue;
                }
                let found = contrast(&lattice, samples, size);
                if found > sharpest {
                    (best, sharpest, moved) = (lattice, found, true);
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Pixels of a picture six periods wide, whose lattice is this.
    fn pixels(lattice: &Lattice) -> Vec<([f64; 2], [f64; 3])> {
        let at = |k: usize| {
            let p = [(k % 150) as f64 / 25.0 - 3.0, (k / 150) as f64 / 25.0 - 3.0];
            let [x, y] = [0, 1].map(|k| TAU * (lattice[k][0] * p[0] + lattice[k][1] * p[1]));
            (p, [1.0 + 0.5 * x.sin(), 1.0 + 0.4 * y.cos() * x.sin(), 1.0 + 0.3 * (y + 1.0).sin()])
        };
        (0..150 * 150).map(at).collect()
    }

    #[test]
    fn a_lattice_that_is_a_little_askew_is_found_from_periods_that_are_a_little_wrong() {
        let truth = [[0.995, 0.012], [-0.008, 1.006]];
        let found = sharpest_lattice([[1.0, 0.0], [0.0, 1.0]], 3.0, &pixels(&truth), [24, 24]);
        for (found, truth) in found.iter().flatten().zip(truth.iter().flatten()) {
            assert!((found - truth).abs() < 1.5e-3, "{found:?} for {truth:?}");
        }
    }

    #[test]
    fn a_cloth_is_no_print_of_grooves() {
        let period = |agreement| Some(Period { length: 1.0, sigma: 0.01, agreement });
        let grooves = TilePeriod { length: [1.0, 1.0], uniform: [false, true] };
        let said = |agreement| other_periods([period(0.99), period(agreement)], grooves);
        assert!(said(0.98).is_some_and(|said| said.contains("along y too")), "{:?}", said(0.98));
        assert_eq!((said(0.2), other_periods([period(0.99), None], grooves)), (None, None));
        assert_eq!(other_periods([period(0.99), period(0.98)], TilePeriod { uniform: [false; 2], ..grooves }), None);
    }

    #[test]
    fn a_direction_in_which_nothing_changes_stays_without_a_period() {
        let truth = [[1.01, 0.01], [0.0, 0.0]];
        let found = sharpest_lattice([[1.0, 0.0], [0.0, 0.0]], 3.0, &pixels(&truth), [24, 1]);
        assert_eq!(found[1], [0.0; 2]);
        let [along, across] = lengths(&found);
        assert!((along.unwrap() * 1.01_f64.hypot(0.01) - 1.0).abs() < 1e-3 && across.is_none(), "{along:?}");
    }

    #[test]
    fn steps_of_a_lattice_are_those_of_its_inverse() {
        let (sin, cos) = 0.2_f64.sin_cos();
        let [x, y] = lengths(&[[cos / 2.0, sin / 2.0], [-sin / 3.0, cos / 3.0]]).map(Option::unwrap);
        assert!((x - 2.0).abs() < 1e-12 && (y - 3.0).abs() < 1e-12, "{x} {y}");
    }
}
