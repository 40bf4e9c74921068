//! Horizon angles of a height field: one march along an azimuth tells the visibility of all elevations.
//!
//! The surface is the exact triangulation of [`HeightGrid`]: along a line its height is linear between the crossings with grid
//! lines and diagonals. Over a linear piece `(h(t) - z) / t` is monotone, so the horizon's slope is the largest of its values
//! at those crossings, and of the slope of the facet itself. The march goes over as many periods as it needs: it ends where
//! even the highest point of the surface would lie below the horizon found so far, `(highest - z) / t <= slope`. Blocks of
//! cells whose highest point does are passed in one step.
//!
//! Max (1988, "Horizon mapping") tabulated such angles; here they are not interpolated.
//!
//! [`HeightGrid`]: crate::geometry::HeightGrid

use super::rays::MAX_PERIODS;
use crate::direction::MIN_COSINE;
use crate::geometry::{HeightGrid, Tile};
use crate::numerics::cast::truncate_usize;
use glam::{DVec2, DVec3};

/// Side of a block of cells, for which the highest point is kept.
const BLOCK: usize = 8;

/// Horizon angles of a periodic height field.
#[derive(Clone, Debug)]
pub struct Horizon {
    grid: HeightGrid,
    /// Highest node of each block and of its right and upper border.
    block_highest: Vec<f64>,
    /// Blocks in a row.
    block_columns: usize,
    highest: f64,
    /// Cells per unit of length.
    density: DVec2,
}

/// The cell that a march is in, along one axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Cells in one period.
    size: usize,
    /// Start of the march, within `0..=size`.
    start: f64,
    /// Cells per unit of length; its sign is the march's.
    speed: f64,
    /// Cell within the period.
    cell: usize,
    /// Cells before the period that the march is in; negative towards lower ones.
    passed: f64,
}

impl Axis {
    fn new(position: f64, speed: f64, size: usize) -> Self {
        let cells = size as f64;
        let start = position - (position / cells).floor() * cells;
        let cell = truncate_usize(start).min(size - 1);
        Self { size, start, speed, cell, passed: 0.0 }
    }

    /// Distance at which the march leaves cells `first..end`, among which it is.
    fn exit(&self, first: usize, end: usize) -> f64 {
        let border = if self.speed > 0.0 { end } else { first };
        // A direction along the other axis never leaves; 0/0 on a border would be not a number.
        if self.speed == 0.0 { f64::INFINITY } else { (self.passed + border as f64 - self.start) / self.speed }
    }

    /// Position at a distance, relative to the lower border of the cell.
    fn within(&self, t: f64) -> f64 {
        (self.start + t * self.speed - self.passed - self.cell as f64).clamp(0.0, 1.0)
    }

    /// Goes to the cell beyond `first..end`.
    fn cross(&mut self, first: usize, end: usize) {
        if self.speed > 0.0 {
            if end == self.size {
                self.passed += self.size as f64;
                self.cell = 0;
            } else {
                self.cell = end;
            }
        } else if first == 0 {
            self.passed -= self.size as f64;
            self.cell = self.size - 1;
        } else {
            self.cell = first - 1;
        }
    }

    /// Goes to the cell at a distance, which lies in `first..end` up to rounding.
    fn slide(&mut self, t: f64, first: usize, end: usize) {
        let cell = self.start + t * self.speed - self.passed;
        self.cell = truncate_usize(cell.clamp(first as f64, (end - 1) as f64));
    }

    /// The cells of the block that the march is in.
    fn block(&self) -> (usize, usize) {
        let first = self.cell / BLOCK * BLOCK;
        (first, (first + BLOCK).min(self.size))
    }
}

impl Horizon {
    /// `None` for a surface that is not a height field and nothing else ([`Tile::grid`]), or whose heights are not finite.
    pub fn new(tile: &Tile) -> Option<Self> {
        let grid = tile.grid.as_ref()?;
        let (columns, rows) = (grid.columns, grid.rows);
        let highest = grid.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if columns == 0 || rows == 0 || grid.heights.len() != columns * rows || !grid.heights.iter().all(|h| h.is_finite()) {
            return None;
        }
        let (block_columns, block_rows) = (columns.div_ceil(BLOCK), rows.div_ceil(BLOCK));
        let nodes = |block: usize, size: usize| (block * BLOCK..=((block + 1) * BLOCK).min(size)).map(move |k| k % size);
        let highest_of = |i: usize, j: usize| {
            nodes(j, rows)
                .flat_map(|row| nodes(i, columns).map(move |column| row * columns + column))
                .map(|node| grid.heights[node])
                .fold(f64::NEG_INFINITY, f64::max)
        };
        Some(Self {
            block_highest: (0..block_rows).flat_map(|j| (0..block_columns).map(move |i| (i, j))).map(|(i, j)| highest_of(i, j)).collect(),
            grid: grid.clone(),
            block_columns,
            highest,
            density: DVec2::new(columns as f64, rows as f64) / tile.period,
        })
    }

    /// Tangent of the elevation of the horizon, seen from a point of the surface along an azimuth.
    ///
    /// `azimuth` is (cos, sin). A direction of that azimuth is visible, and lies above the facet, exactly when the tangent of
    /// its elevation is larger. At least [`MIN_COSINE`]: no direction below is ever evaluated. What lies more than
    /// [`MAX_PERIODS`] periods away is not seen.
    pub fn slope(&self, origin: DVec3, azimuth: (f64, f64)) -> f64 {
        let speed = DVec2::new(azimuth.0, azimuth.1) * self.density;
        let (columns, rows) = (self.grid.columns, self.grid.rows);
        let mut x = Axis::new(origin.x * self.density.x, speed.x, columns);
        let mut y = Axis::new(origin.y * self.density.y, speed.y, rows);
        let mut slope = MIN_COSINE.max(self.own_slope(&x, &y));
        let farthest = f64::from(MAX_PERIODS) / (speed.x.abs() / columns as f64 + speed.y.abs() / rows as f64);
        // The first crossing lies on the facet itself: its slope is known, and would be uncertain over a short distance.
        let mut own = true;
        let mut t = 0.0_f64;
        while self.highest - origin.z > slope * t && t < farthest {
            let (block_x, block_y) = (x.block(), y.block());
            let skip = self.block_highest[block_y.0 / BLOCK * self.block_columns + block_x.0 / BLOCK] - origin.z <= slope * t;
            let (span_x, span_y) = if skip { (block_x, block_y) } else { ((x.cell, x.cell + 1), (y.cell, y.cell + 1)) };
            let (exit_x, exit_y) = (x.exit(span_x.0, span_x.1), y.exit(span_y.0, span_y.1));
            let exit = exit_x.min(exit_y).max(t);
            if !skip {
                let [low, right, far, up] = self.corners(&x, &y);
                let mut see = |height: f64, at: f64| {
                    if !std::mem::take(&mut own) && at > 0.0 {
                        slope = slope.max((height - origin.z) / at);
                    }
                };
                // A rising diagonal is where both positions within the cell are equal, a falling one where they add up to 1.
                let (from_left, from_below) = (x.start - x.passed - x.cell as f64, y.start - y.passed - y.cell as f64);
                let (diagonal, from, to) = if HeightGrid::rises([low, right, far, up], x.cell, y.cell) {
                    ((from_below - from_left) / (x.speed - y.speed), low, far)
                } else {
                    ((1.0 - from_below - from_left) / (x.speed + y.speed), right, up)
                };
                if diagonal > t && diagonal < exit {
                    see(from + y.within(diagonal) * (to - from), diagonal);
                }
                let height = if exit_x <= exit_y {
                    let (a, b) = if x.speed > 0.0 { (right, far) } else { (low, up) };
                    a + y.within(exit) * (b - a)
                } else {
                    let (a, b) = if y.speed > 0.0 { (up, far) } else { (low, right) };
                    a + x.within(exit) * (b - a)
                };
                see(height, exit);
            }
            own = false;
            if exit_x <= exit_y {
                x.cross(span_x.0, span_x.1);
                y.slide(exit, span_y.0, span_y.1);
            } else {
                y.cross(span_y.0, span_y.1);
                x.slide(exit, span_x.0, span_x.1);
            }
            t = exit;
        }
        slope
    }

    /// Heights of a cell's corners, counter-clockwise from the lower left one.
    fn corners(&self, x: &Axis, y: &Axis) -> [f64; 4] {
        self.grid.corners(x.cell, y.cell)
    }

    /// Slope of the facet at the start of a march.
    fn own_slope(&self, x: &Axis, y: &Axis) -> f64 {
        let [low, right, far, up] = self.corners(x, y);
        let (left, below) = (x.within(0.0), y.within(0.0));
        let rises = HeightGrid::rises([low, right, far, up], x.cell, y.cell);
        let lower = if rises { left >= below } else { left + below <= 1.0 };
        let (dx, dy) = match (rises, lower) {
            (true, true) => (right - low, far - right),
            (true, false) => (far - up, up - low),
            (false, true) => (right - low, up - low),
            (false, false) => (far - up, far - right),
        };
        dx * x.speed + dy * y.speed
    }
}

#[cfg(test)]
mod tests {
    use super::super::rays::{Occlusion, PeriodicBvh};
    use super::super::test_tiles::{flat, height_field, point, rough, v_groove};
    use super::*;
    use crate::numerics::random::Random;
    use std::f64::consts::TAU;

    /// Compares horizon and rays at random points, azimuths and elevations.
    ///
    /// At a thousandth of the slope below and above the horizon they must agree in every bit, at a billionth, where single
    /// digits differ, in 99.8 %. Returns the share of the rays that are blocked.
    fn compare(tile: &Tile, count: usize, seed: u64, azimuth: impl Fn(f64) -> (f64, f64)) -> f64 {
        let horizon = Horizon::new(tile).unwrap();
        let bvh = PeriodicBvh::new(tile).unwrap();
        let mut random = Random::from_state(seed);
        let (mut all, mut blocked, mut close, mut differ) = (0.0, 0.0, 0, 0);
        for _ in 0..count {
            let triangle = (random.unit() * tile.triangles.len() as f64) as usize;
            let origin = point(tile, triangle, random.unit(), random.unit());
            let (cos, sin) = azimuth(random.unit());
            let slope = horizon.slope(origin, (cos, sin));
            let [a, b, c] = tile.corners(triangle);
            for factor in [0.3, 0.9, 0.999, 1.0 - 1e-9, 1.0 + 1e-9, 1.001, 1.1, 3.0] {
                let w = DVec3::new(cos, sin, slope * factor);
                if w.z / w.length() < MIN_COSINE {
                    continue;
                }
                let faces = (b - a).cross(c - a).dot(w) > 0.0;
                let visible = faces && bvh.occluded(triangle, origin, w) == Occlusion::Free;
                all += 1.0;
                blocked += f64::from(u8::from(!visible));
                let same = visible == (factor > 1.0);
                if (factor - 1.0).abs() < 1e-6 {
                    close += 1;
                    differ += usize::from(!same);
                } else {
                    assert!(same, "{:?}: at {factor} of the slope {slope} from {origin} along {cos}, {sin}", tile.period);
                }
            }
        }
        assert!(differ * 500 <= close, "{:?}: {differ} of {close} bits next to the horizon differ", tile.period);
        blocked / all
    }

    fn any(u: f64) -> (f64, f64) {
        let phi = u * TAU;
        (phi.cos(), phi.sin())
    }

    #[test]
    fn horizon_and_rays_agree_to_a_billionth_of_the_slope() {
        for (period, nodes, amplitude, seed) in [
            (DVec2::ONE, 12, 0.3, 1),
            (DVec2::new(3.0, 1.0), 9, 1e-3, 2),
            (DVec2::splat(1e-6), 16, 1e-6, 3),
            (DVec2::new(1e6, 2e6), 11, 3e5, 4),
            (DVec2::ONE, 33, 0.05, 5),
            (DVec2::ONE, 5, 20.0, 6),
        ] {
            let blocked = compare(&rough(period, nodes, amplitude, seed), 4_000, seed, any);
            assert!((0.3..0.7).contains(&blocked), "{period}: {blocked} of the rays blocked");
        }
    }

    #[test]
    fn a_grid_that_is_no_multiple_of_the_blocks_and_one_of_a_single_row_agree_with_rays_too() {
        for (columns, rows) in [(17, 3), (8, 1), (1, 9), (1, 1), (2, 2), (40, 7)] {
            let mut random = Random::from_state(7);
            let heights: Vec<f64> = (0..columns * rows).map(|_| random.unit()).collect();
            let tile = height_field(DVec2::new(1.0, 0.8), columns, rows, |i, j| heights[j * columns + i]);
            compare(&tile, 2_000, 8, any);
        }
    }

    #[test]
    fn azimuths_along_grid_lines_and_diagonals_agree_with_rays() {
        let tile = rough(DVec2::ONE, 10, 0.4, 9);
        let half = 0.5_f64.sqrt();
        for azimuth in
            [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (half, half), (-half, half), (-half, -half), (half, -half), (1.0, -0.0)]
        {
            compare(&tile, 1_000, 10, |_| azimuth);
        }
    }

    #[test]
    fn the_bottom_of_a_groove_sees_its_ridges() {
        // Ridges of height 1 at x = 0 and 4, the floor at 0 in between: nodes every 1.
        let tile = height_field(DVec2::new(4.0, 1.0), 4, 1, |i, _| if i == 0 { 1.0 } else { 0.0 });
        let horizon = Horizon::new(&tile).unwrap();
        let at = |x: f64| DVec3::new(x, 0.3, 0.0);
        for (x, azimuth, expected) in [(2.0, (1.0, 0.0), 0.5), (1.5, (1.0, 0.0), 0.4), (2.5, (-1.0, 0.0), 0.4), (2.0, (0.6, 0.8), 0.3)] {
            let slope = horizon.slope(at(x), azimuth);
            assert!((slope - expected).abs() < 1e-12, "{slope} at {x}, {azimuth:?}");
        }
        assert_eq!(horizon.slope(at(2.0), (0.0, 1.0)), MIN_COSINE, "along the groove");
        assert_eq!(horizon.slope(DVec3::new(4.0, 0.0, 1.0), (1.0, 0.0)), MIN_COSINE, "from the ridge");
    }

    #[test]
    fn a_ridge_thousands_of_periods_away_stands_on_the_horizon() {
        // One spike a period, seen along a line that drifts by a thousandth of a period in each: the nodes' height field is 0
        // elsewhere. The march passes 400 spikes at a distance before it crosses the side of one.
        let tile = height_field(DVec2::ONE, 1000, 8, |i, j| if i == 500 && j == 4 { 1.0 } else { 0.0 });
        let blocked = compare(&tile, 300, 11, |u| {
            let drift = 1e-3 * (1.0 + u);
            (drift / drift.hypot(1.0), 1.0 / drift.hypot(1.0))
        });
        assert!(blocked > 0.3, "{blocked} of the rays blocked");
    }

    #[test]
    fn surfaces_without_a_grid_have_no_horizon() {
        assert!(Horizon::new(&flat(DVec2::ONE, 0.0)).is_none());
        assert!(Horizon::new(&v_groove(DVec2::ONE, 0.5)).is_none());
        let mut tile = rough(DVec2::ONE, 4, 1.0, 1);
        tile.grid.as_mut().unwrap().heights[3] = f64::NAN;
        assert!(Horizon::new(&tile).is_none());
    }
}
