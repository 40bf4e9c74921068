//! What is done to heights before they are a surface: a plane removed, averaged to fewer nodes, made periodic; and the tile of
//! what is left.

use super::super::tile::{HeightGrid, Tile};
use crate::numerics::cast::truncate_usize;
use glam::{DVec2, DVec3};

/// Heights on a regular grid, row 0 at y = 0. Node `(i, j)` stands for the rectangle of one pixel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    pub columns: usize,
    pub rows: usize,
    pub heights: Vec<f64>,
    /// Columns and rows times the size of a pixel.
    pub period: DVec2,
}

impl Grid {
    fn at(&self, i: usize, j: usize) -> f64 {
        self.heights[j * self.columns + i]
    }

    /// Subtracts the least-squares plane and returns its slopes.
    ///
    /// On a regular grid the three unknowns decouple once x and y are measured from the middle.
    pub fn remove_plane(&mut self) -> DVec2 {
        let (columns, rows) = (self.columns, self.rows);
        let centred = |k: usize, n: usize| k as f64 - 0.5 * (n as f64 - 1.0);
        let squares = |n: usize, other: usize| (0..n).map(|k| centred(k, n).powi(2)).sum::<f64>() * other as f64;
        let (mut mean, mut x, mut y) = (0.0, 0.0, 0.0);
        for j in 0..rows {
            for i in 0..columns {
                let h = self.at(i, j);
                mean += h;
                x += h * centred(i, columns);
                y += h * centred(j, rows);
            }
        }
        mean /= (columns * rows) as f64;
        let slope = |moment: f64, squares: f64| if squares > 0.0 { moment / squares } else { 0.0 };
        let (x, y) = (slope(x, squares(columns, rows)), slope(y, squares(rows, columns)));
        for j in 0..rows {
            for i in 0..columns {
                self.heights[j * columns + i] -= mean + x * centred(i, columns) + y * centred(j, rows);
            }
        }
        DVec2::new(x, y) * DVec2::new(columns as f64, rows as f64) / self.period
    }

    /// Averages the heights so that the longer side has `longest` nodes: each new node is the mean over its own rectangle, cut pixels in
    /// proportion. The period stays.
    pub fn reduced(&self, longest: usize) -> Self {
        let now = self.columns.max(self.rows);
        let scaled = |n: usize| ((n * longest + now / 2) / now).max(1);
        let (columns, rows) = (scaled(self.columns), scaled(self.rows));
        let mut narrow = vec![0.0; columns * self.rows];
        for j in 0..self.rows {
            let row = &self.heights[j * self.columns..(j + 1) * self.columns];
            box_filter(row.len(), columns, |i| row[i], |i, h| narrow[j * columns + i] = h);
        }
        let mut heights = vec![0.0; columns * rows];
        for i in 0..columns {
            box_filter(self.rows, rows, |j| narrow[j * columns + i], |j, h| heights[j * columns + i] = h);
        }
        Self { columns, rows, heights, period: self.period }
    }

    /// Largest and rms difference between heights of opposite edges, which become neighbours.
    pub fn seam(&self) -> (f64, f64) {
        let across_x = (0..self.rows).map(|j| self.at(0, j) - self.at(self.columns - 1, j));
        let across_y = (0..self.columns).map(|i| self.at(i, 0) - self.at(i, self.rows - 1));
        largest_and_rms(across_x.chain(across_y))
    }

    /// Rms difference between neighbours inside.
    pub fn roughness(&self) -> f64 {
        let along_x = (0..self.rows).flat_map(|j| (1..self.columns).map(move |i| (i, j))).map(|(i, j)| self.at(i, j) - self.at(i - 1, j));
        let along_y = (1..self.rows).flat_map(|j| (0..self.columns).map(move |i| (i, j))).map(|(i, j)| self.at(i, j) - self.at(i, j - 1));
        largest_and_rms(along_x.chain(along_y)).1
    }

    /// RMS change of the slope from pixel to pixel over the RMS slope, in the periodic grid; 0 of a plane.
    ///
    /// White noise has √3, blurred by a Gaussian of 1 pixel 1.07, of 1.5 pixels .77, of 2 pixels .59.
    pub fn coarseness(&self) -> f64 {
        let (mut slopes, mut changes) = (0.0, 0.0);
        for j in 0..self.rows {
            for i in 0..self.columns {
                let here = self.at(i, j);
                let right = |i: usize| self.at((i + 1) % self.columns, j);
                let up = |j: usize| self.at(i, (j + 1) % self.rows);
                let (left, below) = (self.at((i + self.columns - 1) % self.columns, j), self.at(i, (j + self.rows - 1) % self.rows));
                for (next, last) in [(right(i), left), (up(j), below)] {
                    slopes += (next - here).powi(2);
                    changes += (next - 2.0 * here + last).powi(2);
                }
            }
        }
        if slopes > 0.0 { (changes / slopes).sqrt() } else { 0.0 }
    }

    /// Cross-fades the last nodes of each row and column into the first ones and drops the last; shortens the period by as much.
    /// Returns the largest and the rms difference of the heights that were blended.
    ///
    /// Node `i < width` becomes `w h(i) + (1 - w) h(n + i)` with n the new length: at `i = 0` it is what follows node `n - 1`, and at
    /// `i = width` the original again.
    pub fn blend(&mut self, share: f64) -> (f64, f64) {
        let mut differences: Vec<f64> = Vec::new();
        for along_x in [true, false] {
            let (length, lines) = if along_x { (self.columns, self.rows) } else { (self.rows, self.columns) };
            let width = truncate_usize((share * length as f64).round()).min(length / 2);
            if width == 0 {
                continue;
            }
            let kept = length - width;
            let (columns, rows) = if along_x { (kept, lines) } else { (lines, kept) };
            let mut heights = Vec::with_capacity(columns * rows);
            for j in 0..rows {
                for i in 0..columns {
                    let k = if along_x { i } else { j };
                    let here = self.at(i, j);
                    if k >= width {
                        heights.push(here);
                        continue;
                    }
                    let there = if along_x { self.at(i + kept, j) } else { self.at(i, j + kept) };
                    let t = k as f64 / width as f64;
                    let weight = t * t * (3.0 - 2.0 * t);
                    differences.push(here - there);
                    heights.push(weight * here + (1.0 - weight) * there);
                }
            }
            let shorter = kept as f64 / length as f64;
            self.period *= if along_x { DVec2::new(shorter, 1.0) } else { DVec2::new(1.0, shorter) };
            (self.columns, self.rows, self.heights) = (columns, rows, heights);
        }
        largest_and_rms(differences.into_iter())
    }

    /// Appends the heights in reverse, without repeating the turning nodes.
    pub fn mirrored(&self) -> Self {
        let twice = |n: usize| if n > 1 { 2 * n - 2 } else { 1 };
        let back = |k: usize, n: usize| if k < n { k } else { 2 * n - 2 - k };
        let (columns, rows) = (twice(self.columns), twice(self.rows));
        let node = |k: usize| self.at(back(k % columns, self.columns), back(k / columns, self.rows));
        let longer = |new: usize, old: usize| new as f64 / old as f64;
        let period = self.period * DVec2::new(longer(columns, self.columns), longer(rows, self.rows));
        Self { columns, rows, heights: (0..columns * rows).map(node).collect(), period }
    }
}

/// Means of `from` values over `to` equal intervals, values cut in proportion.
fn box_filter(from: usize, to: usize, value: impl Fn(usize) -> f64, mut set: impl FnMut(usize, f64)) {
    for k in 0..to {
        // In units of 1/to of a value everything is whole: interval k is from k * from to (k + 1) * from.
        let (start, end) = (k * from, (k + 1) * from);
        let sum: f64 = (start / to..end.div_ceil(to)).map(|i| value(i) * (end.min((i + 1) * to) - start.max(i * to)) as f64).sum();
        set(k, sum / from as f64);
    }
}

fn largest_and_rms(differences: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut largest, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
    for d in differences {
        largest = largest.max(d.abs());
        squares += d * d;
        count += 1.0;
    }
    (largest, if count > 0.0 { (squares / count).sqrt() } else { 0.0 })
}

impl Grid {
    /// Two triangles a cell.
    pub fn into_tile(self, notes: Vec<String>) -> Tile {
        let Self { columns, rows, heights, period } = self;
        let step = period / DVec2::new(columns as f64, rows as f64);
        let mut vertices = Vec::with_capacity((columns + 1) * (rows + 1));
        for j in 0..=rows {
            for i in 0..=columns {
                // The last node lies exactly one period after the first.
                let x = if i == columns { period.x } else { i as f64 * step.x };
                let y = if j == rows { period.y } else { j as f64 * step.y };
                vertices.push(DVec3::new(x, y, heights[(j % rows) * columns + i % columns]));
            }
        }
        let (mut triangles, mut uv) = (Vec::with_capacity(2 * columns * rows), Vec::with_capacity(2 * columns * rows));
        let share = |i: usize, j: usize| DVec2::new(i as f64 / columns as f64, j as f64 / rows as f64);
        let node = |i: usize, j: usize| u32::try_from(j * (columns + 1) + i).expect("MAX_TRIANGLES keeps the number of nodes below 2^32");
        let grid = HeightGrid { columns, rows, heights };
        for corners in grid.triangles() {
            triangles.push(corners.map(|(i, j)| node(i, j)));
            uv.push(corners.map(|(i, j)| share(i, j)));
        }
        let part_of_triangle = vec![0; triangles.len()];
        Tile { vertices, triangles, part_of_triangle, parts: vec!["surface".into()], uv: Some(uv), period, grid: Some(grid), notes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(columns: usize, rows: usize, height: impl Fn(f64, f64) -> f64) -> Grid {
        let heights = (0..rows * columns).map(|k| height((k % columns) as f64, (k / columns) as f64)).collect();
        Grid { columns, rows, heights, period: DVec2::new(columns as f64 * 0.5, rows as f64 * 0.5) }
    }

    #[test]
    fn the_plane_is_removed_and_only_the_plane() {
        let wave = |x: f64, _: f64| (x * std::f64::consts::TAU / 10.0 + 0.3).sin();
        let mut level = grid(40, 30, wave);
        let already = level.remove_plane();
        let mut tilted = grid(40, 30, |x, y| wave(x, y) + 7.0 + 0.05 * x - 0.125 * y);
        let slope = tilted.remove_plane();
        // A pixel is 0.5 wide.
        assert!((slope - already - DVec2::new(0.1, -0.25)).length() < 1e-12, "{slope}");
        assert!(tilted.heights.iter().zip(&level.heights).all(|(a, b)| (a - b).abs() < 1e-11));
    }

    #[test]
    fn averaging_keeps_the_mean_and_is_exact_for_whole_factors() {
        let fine = grid(12, 8, |x, y| x * y);
        let coarse = fine.reduced(6);
        assert_eq!((coarse.columns, coarse.rows, coarse.period), (6, 4, fine.period));
        assert_eq!(coarse.heights[0], (0.0 + 0.0 + 0.0 + 1.0) / 4.0);
        let mean = |g: &Grid| g.heights.iter().sum::<f64>() / g.heights.len() as f64;
        let odd = fine.reduced(5);
        assert_eq!((odd.columns, odd.rows), (5, 3));
        assert!((mean(&odd) - mean(&fine)).abs() < 1e-12 && (mean(&coarse) - mean(&fine)).abs() < 1e-12);
    }

    #[test]
    fn the_seam_is_what_opposite_edges_differ_by() {
        let ramp = grid(11, 5, |x, _| 0.1 * x);
        let (largest, rms) = ramp.seam();
        // 5 differences of 1 across x, 11 of 0 across y.
        assert!((largest - 1.0).abs() < 1e-12 && (rms - (5.0_f64 / 16.0).sqrt()).abs() < 1e-12, "{largest} {rms}");
        assert!((ramp.roughness() - 0.1 * (50.0_f64 / 94.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn blending_leaves_no_step_larger_than_the_ramp_needs() {
        let mut ramp = grid(100, 4, |x, _| 0.01 * x);
        let (largest, _) = ramp.blend(0.2);
        assert_eq!((ramp.columns, ramp.period.x), (80, 40.0));
        assert!((largest - 0.8).abs() < 1e-12, "{largest}");
        // The smoothstep is at most 1.5 / 20 a node steep, over a difference of .8, less the ramp itself.
        let steps = (0..80).map(|i| (ramp.at((i + 1) % 80, 1) - ramp.at(i, 1)).abs()).fold(0.0, f64::max);
        assert!(steps < 0.8 * 1.5 / 20.0, "{steps}");
        let mut periodic = grid(100, 10, |x, _| (x * std::f64::consts::TAU / 20.0).sin());
        assert!(periodic.blend(0.2).0 < 1e-12, "a wave that fits is blended with itself");
    }

    #[test]
    fn white_noise_is_coarse_and_a_resolved_wave_is_not() {
        let mut random = crate::numerics::random::Random::from_state(1);
        let noise: Vec<f64> = (0..128 * 128).map(|_| random.unit()).collect();
        let coarse = grid(128, 128, |x, y| noise[y as usize * 128 + x as usize]).coarseness();
        assert!((coarse - 3.0_f64.sqrt()).abs() < 0.03, "{coarse}");
        // A wave of 32 pixels changes its slope by 2 sin(pi/32) from pixel to pixel.
        let wave = grid(64, 64, |x, _| (x * std::f64::consts::TAU / 32.0).sin()).coarseness();
        assert!((wave - 2.0 * (std::f64::consts::PI / 32.0).sin()).abs() < 1e-6, "{wave}");
        assert_eq!(grid(8, 8, |_, _| 3.0).coarseness(), 0.0);
    }

    #[test]
    fn mirroring_has_no_seam() {
        let mirrored = grid(4, 3, |x, y| x + 10.0 * y).mirrored();
        assert_eq!((mirrored.columns, mirrored.rows, mirrored.period), (6, 4, DVec2::new(3.0, 2.0)));
        assert_eq!(mirrored.heights[..6], [0.0, 1.0, 2.0, 3.0, 2.0, 1.0]);
        assert_eq!(mirrored.heights[18], 10.0);
        assert_eq!(grid(1, 1, |_, _| 5.0).mirrored().heights, [5.0]);
    }
}
