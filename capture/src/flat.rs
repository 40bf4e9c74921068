//! Falloff of light towards the corners, from a photograph of an even surface.
//!
//! ```text
//! V(r) = 1 + b r² + c r⁴ + d r⁶,    r = distance from the principal point over that of the farthest corner
//! ```

use crate::lens::farthest;
use crate::linear::LinearPhoto;
use crate::photo::PlanarImage;
use crate::shoot::FlatMethod;
use biscale::numerics::cast::{narrow, truncate_usize};
use biscale::numerics::linear_algebra;
use glam::DVec2;
use rayon::prelude::*;

/// Blocks across and down that the photograph is averaged over: of 3:2, about 200 px a side in a photograph of 24 megapixels.
const BLOCKS: [usize; 2] = [48, 32];

/// Which blocks and which falloffs are used. Chosen, not measured.
struct FalloffParams {
    /// Saturated pixels from which on a block is left out.
    most_saturated: f64,
    /// Blocks, of all, that must be left: one over this.
    fewest_part: usize,
    /// Darkest falloff that is divided by: with less, noise would become everything.
    darkest: f64,
    /// Smallest interpolated falloff that is divided by.
    least_divisor: f64,
}

const PARAMS: FalloffParams = FalloffParams { most_saturated: 0.01, fewest_part: 4, darkest: 0.05, least_divisor: 0.02 };

/// The falloff, relative to the principal point.
#[derive(Clone, Debug)]
pub struct Falloff {
    /// How it is applied.
    pub method: FlatMethod,
    /// `b, c, d`.
    pub radial: [f64; 3],
    /// Principal point, px.
    pub centre: DVec2,
    /// Distance of the farthest corner, px.
    pub farthest: f64,
    /// What a plane over the picture adds, between its opposite corners at most, relative: light that was not even.
    pub tilt: f64,
    /// RMS of what polynomial and plane leave, relative.
    pub residual: f64,
    /// Smallest value of the polynomial in the picture.
    pub darkest: f64,
    /// Means of the blocks over the value at the principal point, by channel.
    grid: [Vec<f64>; 3],
    size: [usize; 2],
}

impl Falloff {
    /// Fits one; `centre` is the principal point. `None` if too few blocks are well exposed.
    pub fn fit(photo: &LinearPhoto, centre: DVec2, method: FlatMethod) -> Option<Self> {
        let picture = &photo.picture;
        let (width, height) = (picture.width, picture.height);
        if width < BLOCKS[0] || height < BLOCKS[1] {
            return None;
        }
        let farthest = farthest(width, height, centre);
        let grid: [Vec<f64>; 3] = std::array::from_fn(|c| blocks(&picture.planes[c], width, height));
        let saturated = blocks_saturated(&photo.saturated, width, height);
        let places: Vec<DVec2> = (0..BLOCKS[0] * BLOCKS[1]).map(|k| block_centre(k, width, height)).collect();
        let green = |k: usize| (0..3).map(|c| grid[c][k]).sum::<f64>() / 3.0;
        let row = |p: DVec2| {
            let q = (p - centre) / farthest;
            let r2 = q.length_squared();
            vec![1.0, r2, r2 * r2, r2 * r2 * r2, q.x, q.y]
        };
        let used: Vec<usize> = (0..places.len()).filter(|&k| saturated[k] < PARAMS.most_saturated && green(k) > 0.0).collect();
        if used.len() < places.len() / PARAMS.fewest_part {
            return None;
        }
        let rows: Vec<Vec<f64>> = used.iter().map(|&k| row(places[k])).collect();
        let values: Vec<f64> = used.iter().map(|&k| green(k)).collect();
        let x = linear_algebra::least_squares(&rows, &values)?;
        if !(x[0] > 0.0) {
            return None;
        }
        let model = |r: &[f64]| r.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>();
        let residual = (rows.iter().zip(&values).map(|(r, v)| ((model(r) - v) / x[0]).powi(2)).sum::<f64>() / values.len() as f64).sqrt();
        let half = 0.5 * DVec2::new(width as f64, height as f64) / farthest;
        let tilt = 2.0 * (x[4].abs() * half.x + x[5].abs() * half.y) / x[0];
        let radial = [x[1] / x[0], x[2] / x[0], x[3] / x[0]];
        let at_centre: [f64; 3] = std::array::from_fn(|c| {
            let values: Vec<f64> = used.iter().map(|&k| grid[c][k]).collect();
            linear_algebra::least_squares(&rows, &values).map_or(x[0], |x| x[0].max(f64::MIN_POSITIVE))
        });
        let grid = std::array::from_fn(|c| grid[c].iter().map(|v| v / at_centre[c]).collect());
        let mut out = Self { method, radial, centre, farthest, tilt, residual, darkest: 1.0, grid, size: [width, height] };
        out.darkest = (0..=100).map(|k| out.polynomial((f64::from(k) / 100.0).powi(2))).fold(1.0, f64::min);
        (out.darkest > PARAMS.darkest).then_some(out)
    }

    fn polynomial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.radial[0] + r2 * (self.radial[1] + r2 * self.radial[2]))
    }

    /// The falloff of a channel at a pixel.
    pub fn at(&self, channel: usize, pixel: DVec2) -> f64 {
        match self.method {
            FlatMethod::Radial => self.polynomial((pixel - self.centre).length_squared() / (self.farthest * self.farthest)),
            FlatMethod::Divide => self.interpolate(channel, pixel).max(PARAMS.least_divisor),
        }
    }

    /// Bilinear between the middles of blocks, continued as lines beyond the outermost.
    fn interpolate(&self, channel: usize, pixel: DVec2) -> f64 {
        let [nx, ny] = BLOCKS;
        let g =
            DVec2::new((pixel.x + 0.5) / self.size[0] as f64 * nx as f64 - 0.5, (pixel.y + 0.5) / self.size[1] as f64 * ny as f64 - 0.5);
        let low = g.floor().clamp(DVec2::ZERO, DVec2::new((nx - 2) as f64, (ny - 2) as f64));
        let f = g - low;
        let (i, j) = (truncate_usize(low.x), truncate_usize(low.y));
        let at = |i: usize, j: usize| self.grid[channel][j * nx + i];
        let (a, b) = (at(i, j) + f.x * (at(i + 1, j) - at(i, j)), at(i, j + 1) + f.x * (at(i + 1, j + 1) - at(i, j + 1)));
        a + f.y * (b - a)
    }

    /// Divides a picture of the same size by it.
    pub fn divide(&self, picture: &mut PlanarImage) {
        let width = picture.width;
        for (c, plane) in picture.planes.iter_mut().enumerate() {
            plane.par_chunks_mut(width).enumerate().for_each(|(row, line)| {
                for (column, v) in line.iter_mut().enumerate() {
                    let falloff = narrow(self.at(c, DVec2::new(column as f64, row as f64)));
                    *v /= falloff;
                }
            });
        }
    }
}

fn block_range(k: usize, count: usize, length: usize) -> std::ops::Range<usize> {
    k * length / count..(k + 1) * length / count
}

fn block_centre(k: usize, width: usize, height: usize) -> DVec2 {
    let (x, y) = (block_range(k % BLOCKS[0], BLOCKS[0], width), block_range(k / BLOCKS[0], BLOCKS[1], height));
    DVec2::new(0.5 * (x.start + x.end - 1) as f64, 0.5 * (y.start + y.end - 1) as f64)
}

fn over_blocks(width: usize, height: usize, mean: impl Fn(usize) -> f64 + Sync) -> Vec<f64> {
    (0..BLOCKS[0] * BLOCKS[1])
        .into_par_iter()
        .map(|k| {
            let (x, y) = (block_range(k % BLOCKS[0], BLOCKS[0], width), block_range(k / BLOCKS[0], BLOCKS[1], height));
            let count = (x.len() * y.len()) as f64;
            y.flat_map(|row| x.clone().map(move |column| row * width + column)).map(&mean).sum::<f64>() / count
        })
        .collect()
}

fn blocks(plane: &[f32], width: usize, height: usize) -> Vec<f64> {
    over_blocks(width, height, |i| f64::from(plane[i]))
}

fn blocks_saturated(saturated: &[bool], width: usize, height: usize) -> Vec<f64> {
    over_blocks(width, height, |i| f64::from(u8::from(saturated[i])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An even surface behind a lens with this falloff, with a tilt of the light and a little noise.
    fn flat(tilt: f32) -> (LinearPhoto, DVec2, impl Fn(DVec2) -> f64) {
        let (width, height, centre) = (600, 400, DVec2::new(310.0, 190.0));
        let far = farthest(width, height, centre);
        let truth = move |p: DVec2| {
            let r2 = (p - centre).length_squared() / (far * far);
            1.0 - 0.3 * r2 - 0.1 * r2 * r2 + 0.05 * r2 * r2 * r2
        };
        let mut picture = PlanarImage::new(width, height);
        let mut state = 1_u32;
        for i in 0..width * height {
            let p = DVec2::new((i % width) as f64, (i / width) as f64);
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = 0.01 * (f64::from(state >> 8) / f64::from(1_u32 << 24) - 0.5);
            for (c, plane) in picture.planes.iter_mut().enumerate() {
                plane[i] = ((0.3 + 0.1 * c as f64) * (truth(p) + noise) * (1.0 + f64::from(tilt) * (p.x / 600.0 - 0.5))) as f32;
            }
        }
        (LinearPhoto { saturated: vec![false; width * height], picture, divisor: 1.0 }, centre, truth)
    }

    #[test]
    fn the_falloff_is_found_within_a_percent_by_both_methods() {
        let (photo, centre, truth) = flat(0.0);
        for method in [FlatMethod::Radial, FlatMethod::Divide] {
            let fit = Falloff::fit(&photo, centre, method).unwrap();
            for p in [(0.0, 0.0), (599.0, 399.0), (310.0, 190.0), (10.0, 200.0), (450.0, 7.0)] {
                let off = fit.at(1, p.into()) / truth(p.into()) - 1.0;
                assert!(off.abs() < 0.01, "{method:?} at {p:?}: {off}");
            }
            assert!(fit.tilt < 0.01 && fit.residual < 0.005, "{} {}", fit.tilt, fit.residual);
            let mut picture = photo.picture.clone();
            fit.divide(&mut picture);
            let mean = picture.planes[2].iter().map(|v| f64::from(*v)).sum::<f64>() / picture.planes[2].len() as f64;
            assert!((mean - 0.5).abs() < 0.002, "{mean}");
        }
    }

    #[test]
    fn light_from_one_side_is_told_from_falloff() {
        let (photo, centre, truth) = flat(0.2);
        let fit = Falloff::fit(&photo, centre, FlatMethod::Radial).unwrap();
        assert!((0.15..0.25).contains(&fit.tilt), "{}", fit.tilt);
        assert!((fit.at(0, DVec2::ZERO) / truth(DVec2::ZERO) - 1.0).abs() < 0.03);
    }

    #[test]
    fn a_saturated_or_tiny_photograph_is_not_used() {
        let (mut photo, centre, _) = flat(0.0);
        photo.saturated.fill(true);
        assert!(Falloff::fit(&photo, centre, FlatMethod::Radial).is_none());
        let tiny = LinearPhoto { picture: PlanarImage::new(10, 10), saturated: vec![false; 100], divisor: 1.0 };
        assert!(Falloff::fit(&tiny, centre, FlatMethod::Radial).is_none());
    }
}
