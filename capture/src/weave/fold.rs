//! All repeats of a cloth, registered and averaged: one repeat without the noise.

use super::field::Field;
use super::grid::{Grid, Repeat};
use biscale::numerics::cast::{narrow, truncate_i64};

/// One repeat of the cloth in bins: for each different crossing `ky` rows of `kx`.
#[derive(Clone, Debug)]
pub(super) struct Fold {
    /// Bins from warp to warp.
    pub kx: usize,
    /// Bins from weft to weft.
    pub ky: usize,
    /// After how many threads the cloth repeats.
    pub repeat: Repeat,
    /// Mean colour over the local mean.
    pub colour: Vec<[f32; 3]>,
    /// Pixels in a bin.
    pub count: Vec<f32>,
}

impl Fold {
    /// Folds a cut by a grid whose thread coordinates are moved by `drift` at each pixel.
    pub fn of(field: &Field, grid: &Grid, kx: usize, ky: usize, drift: impl Fn(usize, usize) -> [f64; 2]) -> Self {
        let n = grid.repeat.crossings() * kx * ky;
        let mut sum = vec![[0.0_f64; 3]; n];
        let mut count = vec![0.0_f32; n];
        for row in 0..field.height {
            for column in 0..field.width {
                let pixel = row * field.width + column;
                if !field.valid[pixel] {
                    continue;
                }
                let x = field.position(column, row);
                let [ds, dt] = drift(column, row);
                let (s, t) = (grid.u.dot(x) + ds, grid.v.dot(x) + dt);
                let (i, j) = (s.floor(), t.floor());
                let bx = (((s - i) * kx as f64) as usize).min(kx - 1);
                let by = (((t - j) * ky as f64) as usize).min(ky - 1);
                let bin = (grid.repeat.place(i as i64, j as i64) * ky + by) * kx + bx;
                let value = field.ratio[pixel];
                for c in 0..3 {
                    sum[bin][c] += f64::from(value[c]);
                }
                count[bin] += 1.0;
            }
        }
        let colour = sum.iter().zip(&count).map(|(s, &c)| s.map(|v| if c > 0.0 { (v / f64::from(c)) as f32 } else { 1.0 })).collect();
        Self { kx, ky, repeat: grid.repeat, colour, count }
    }

    /// The same with every pixel spread over a share of its own sides, or over all of them where that leaves bins empty; `pitch` in pixels.
    ///
    /// Bins finer than pixels are met unevenly: by none, or by those of some crossings only, where threads lie along the pixels. Spread, each has its share of all.
    pub fn spread(&self, pitch: [f64; 2], share: f64) -> Self {
        let mut out = self.clone();
        for axis in 0..2 {
            let half = 0.5 * share * [self.kx, self.ky][axis] as f64 / pitch[axis];
            let reach = truncate_i64((half + 0.5).ceil());
            let weight = |d: i64| narrow((half + 0.5 - d.abs() as f64).clamp(0.0, 1.0).min(2.0 * half));
            let weights: Vec<(i64, f32)> = (-reach..=reach).map(|d| (d, weight(d))).filter(|w| w.1 > 0.0).collect();
            let from = out.clone();
            for crossing in 0..self.repeat.crossings() as i64 {
                let (i, j) = (crossing % self.repeat.columns, crossing / self.repeat.columns);
                for (y, x) in (0..self.ky as i64).flat_map(|y| (0..self.kx as i64).map(move |x| (y, x))) {
                    let (x, y) = (i * self.kx as i64 + x, j * self.ky as i64 + y);
                    let (mut sum, mut count) = ([0.0_f32; 3], 0.0_f32);
                    for &(d, w) in &weights {
                        let bin = if axis == 0 { self.bin(x + d, y) } else { self.bin(x, y + d) };
                        let n = from.count[bin] * w;
                        (0..3).for_each(|c| sum[c] += from.colour[bin][c] * n);
                        count += n;
                    }
                    let bin = self.bin(x, y);
                    out.count[bin] = count;
                    out.colour[bin] = if count > 0.0 { sum.map(|s| s / count) } else { [1.0; 3] };
                }
            }
        }
        if share < 1.0 && out.count.contains(&0.0) {
            let whole = self.spread(pitch, 1.0);
            for bin in (0..out.count.len()).filter(|&bin| out.count[bin] == 0.0).collect::<Vec<_>>() {
                (out.colour[bin], out.count[bin]) = (whole.colour[bin], whole.count[bin]);
            }
        }
        out
    }

    /// Bin at whole bins from the origin, wrapped around the repeat.
    pub fn bin(&self, x: i64, y: i64) -> usize {
        let (kx, ky) = (self.kx as i64, self.ky as i64);
        let crossing = self.repeat.place(x.div_euclid(kx), y.div_euclid(ky));
        (crossing * self.ky + y.rem_euclid(ky) as usize) * self.kx + x.rem_euclid(kx) as usize
    }

    /// Mean over all crossings.
    pub fn mean_cell(&self) -> Vec<[f64; 3]> {
        let size = self.kx * self.ky;
        let mut sum = vec![[0.0; 3]; size];
        let mut count = vec![0.0; size];
        for (k, (colour, &n)) in self.colour.iter().zip(&self.count).enumerate() {
            (0..3).for_each(|c| sum[k % size][c] += f64::from(colour[c] * n));
            count[k % size] += f64::from(n);
        }
        sum.iter().zip(&count).map(|(s, n)| s.map(|v| if *n > 0.0 { v / n } else { 1.0 })).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Threads of ten pixels that lie along the pixels meet ten of 32 bins.
    #[test]
    fn spread_pixels_fill_every_bin_and_keep_the_mean() {
        let repeat = Repeat { columns: 2, shift: 1, rows: 1 };
        let mut fold = Fold { kx: 32, ky: 32, repeat, colour: vec![[1.0; 3]; 2048], count: vec![0.0; 2048] };
        let value = |x: usize| 0.5 + 0.04 * x as f32;
        for k in 0..200 {
            let (x, y) = (k % 10, k / 10);
            let bin = fold.bin((x as i64 * 32 + 16) / 10, (y as i64 * 32 + 16) / 10);
            fold.count[bin] = 1.0;
            fold.colour[bin] = [value(x); 3];
        }
        let spread = fold.spread([10.0, 10.0], 1.0);
        assert!(fold.count.iter().filter(|n| **n == 0.0).count() > 1800 && spread.count.iter().all(|n| *n > 0.0));
        let mean = |f: &Fold| f.colour.iter().zip(&f.count).map(|(c, n)| c[1] * n).sum::<f32>() / f.count.iter().sum::<f32>();
        assert!((mean(&spread) - mean(&fold)).abs() < 1e-3, "{} {}", mean(&spread), mean(&fold));
        assert!(fold.spread([10.0, 10.0], 0.5).count.iter().all(|n| *n > 0.0));
        // Pixel 4 covers the bins 12.8 to 16.
        assert!((spread.colour[spread.bin(14, 14)][1] - value(4)).abs() < 0.01, "{:?}", spread.colour[spread.bin(14, 14)]);
    }
}
