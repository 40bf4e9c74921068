//! Rays whose path through the cells repeats: along a row of cells or across them at a simple slope.
//!
//! A nearly horizontal ray along a groove passes thousands of cells before it has risen out of it, always over the same line of the cell and each time a little
//! higher. What stands on that line is looked up once: up to the height where the next of it begins nothing can block the ray, and these cells are left out.

use glam::DVec3;

/// Largest number of columns or rows after which a path is looked at for repeating itself.
const MOST_CELLS: u32 = 4;
/// Deviation from a simple slope that a path may have; how far it drifts is kept in mind.
const ROUNDING: f64 = 1e-12;
/// What stands so far beside the line, in units of the cell, counts as standing on it.
const BESIDE: f64 = 1e-6;
/// What ends so little above the ray, or begins so little, counts as if it did not.
const ABOVE: f64 = 1e-9;

/// A path that rises and repeats itself after some cells, in the units of the cell.
pub struct RepeatingPath {
    /// Columns and rows after which it does.
    pub cells: [f64; 2],
    /// Length of one repeat.
    pub length: f64,
    /// How much it rises.
    pub rise: f64,
    /// Repeats over which it stays on its line, but for what counts as on it.
    pub straight: f64,
    /// `line · (x, y)` is a whole number more than `offset` on the path.
    line: [f64; 2],
    offset: f64,
}

impl RepeatingPath {
    /// The path of a ray, if it is one.
    pub fn new(start: DVec3, direction: DVec3) -> Option<Self> {
        let horizontal = direction.truncate().abs().max_element();
        if !(direction.z > 0.0 && horizontal > 0.0) {
            return None;
        }
        let slopes =
            (0..=MOST_CELLS).flat_map(|x| (0..=MOST_CELLS).map(move |y| [f64::from(x), f64::from(y)])).filter(|&[x, y]| x + y > 0.0);
        // The first that fits is the shortest: multiples of a slope stand behind it.
        let [x, y] = slopes.into_iter().find(|&[x, y]| (direction.x.abs() * y - direction.y.abs() * x).abs() <= ROUNDING * horizontal)?;
        let cells = [x * direction.x.signum(), y * direction.y.signum()];
        let line = [cells[1], -cells[0]];
        let length = if x > 0.0 { x / direction.x.abs() } else { y / direction.y.abs() };
        let drift = length * (line[0] * direction.x + line[1] * direction.y).abs();
        let straight = 0.5 * BESIDE / drift;
        Some(Self { cells, length, rise: length * direction.z, straight, line, offset: line[0] * start.x + line[1] * start.y })
    }

    /// The lowest height from `z` on at which one of some triangles stands on the path; infinite where none does.
    pub fn next_height(&self, triangles: impl Iterator<Item = [DVec3; 3]>, z: f64) -> f64 {
        let mut next = f64::INFINITY;
        for corners in triangles {
            if corners[0].z.max(corners[1].z).max(corners[2].z) < z - ABOVE {
                continue;
            }
            // Where the path lies these are whole numbers.
            let across = corners.map(|p| self.line[0] * p.x + self.line[1] * p.y - self.offset);
            let (low, high) = (across[0].min(across[1]).min(across[2]) - BESIDE, across[0].max(across[1]).max(across[2]) + BESIDE);
            let mut whole = low.ceil();
            while whole <= high {
                if let Some([bottom, top]) = heights(&corners, &across, whole)
                    && top >= z - ABOVE
                {
                    next = next.min((bottom - ABOVE).max(z));
                }
                whole += 1.0;
            }
        }
        next
    }
}

/// Lowest and highest point of a triangle between `at` less and more [`BESIDE`], by what its corners have `across`.
fn heights(corners: &[DVec3; 3], across: &[f64; 3], at: f64) -> Option<[f64; 2]> {
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    let mut add = |z: f64| range = [range[0].min(z), range[1].max(z)];
    for k in 0..3 {
        let (a, b) = (across[k], across[(k + 1) % 3]);
        if (a - at).abs() <= BESIDE {
            add(corners[k].z);
        }
        for side in [at - BESIDE, at + BESIDE] {
            if (a < side) != (b < side) {
                add(corners[k].z + (side - a) / (b - a) * (corners[(k + 1) % 3].z - corners[k].z));
            }
        }
    }
    (range[0] <= range[1]).then_some(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_along_rows_and_simple_slopes_repeat_and_others_do_not() {
        let cells =
            |x: f64, y: f64, z: f64| RepeatingPath::new(DVec3::new(0.2, 0.3, 0.1), DVec3::new(x, y, z).normalize()).map(|p| p.cells);
        assert_eq!(cells(0.0, 1.0, 1e-4), Some([0.0, 1.0]));
        assert_eq!(cells(-3.0, 0.0, 1e-4), Some([-1.0, 0.0]));
        assert_eq!(cells(2.0, -2.0, 1e-4), Some([1.0, -1.0]));
        assert_eq!(cells(-1.0, 3.0, 1e-4), Some([-1.0, 3.0]));
        assert_eq!(cells(0.3, 0.4, 1e-4), Some([3.0, 4.0]));
        assert_eq!(cells(1.0, 1e-6, 1e-4), None);
        assert_eq!(cells(0.0, 1.0, -1e-4), None);
        assert_eq!(cells(0.0, 0.0, 1.0), None);
    }

    #[test]
    fn the_next_height_is_that_of_what_stands_on_the_line() {
        let path = RepeatingPath::new(DVec3::new(0.5, 0.0, 0.1), DVec3::new(1.0, 1.0, 1e-4).normalize()).unwrap();
        assert!((path.length - f64::sqrt(2.0)).abs() < 1e-6 && (path.rise - 1e-4).abs() < 1e-9);
        let around = |x: f64, y: f64, z: f64| [DVec3::new(x - 0.01, y, z), DVec3::new(x + 0.01, y, z), DVec3::new(x, y + 0.01, z + 0.1)];
        // x - y is .5 less or more a whole number on the path.
        let on_the_line = around(0.25, 0.75, 0.4);
        let next = |triangles: &[[DVec3; 3]], z: f64| path.next_height(triangles.iter().copied(), z);
        assert!((next(&[on_the_line], 0.2) - 0.4).abs() < 1e-6);
        assert!((next(&[on_the_line], 0.45) - 0.45).abs() < 1e-6, "within it nothing is left out");
        assert_eq!(next(&[on_the_line], 0.6), f64::INFINITY);
        assert_eq!(next(&[around(0.25, 0.25, 0.4)], 0.2), f64::INFINITY);
        assert!((next(&[around(0.75, 0.25, 0.9), on_the_line, around(0.5, 0.0, 0.3)], 0.2) - 0.3).abs() < 1e-6);
    }
}
