//! All repeats of a cloth laid over one another: what one repeat looks like, with the noise averaged out.

use super::field::Field;
use super::grid::{Grid, Repeat};

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
