//! FLIP (Andersson et al. 2020) of images of any size: by tiles, since the one that computes it takes about 130 bytes a pixel.

use nv_flip::{FlipImageRgb8, flip};
use rayon::prelude::*;

/// Pixels along a tile without its margin. Chosen, not measured: a tile takes some 40 MB, and its margin a twelfth of its time.
const TILE: usize = 512;
/// Degrees of the viewer's field over which one pixel's error answers to others: three standard deviations of the widest filter, of the blue-yellow channel,
/// `3 √(.04 / 2π²)` (Andersson et al. 2020, table 1); those that find edges and points are narrower, `3 × .082 / 2`.
const REACH: f32 = 0.1351;

/// The errors of all pixels, in 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlipErrors {
    /// Their mean.
    pub mean: f64,
    /// The largest one.
    pub largest: f32,
}

/// FLIP between two images, sRGB of 8 bits, rows of `width` pixels, as somebody sees them who has `pixels_per_degree`.
pub fn flip_errors(size: [usize; 2], a: &[u8], b: &[u8], pixels_per_degree: f32) -> FlipErrors {
    by_tiles(size, a, b, pixels_per_degree, TILE)
}

fn by_tiles([width, height]: [usize; 2], a: &[u8], b: &[u8], pixels_per_degree: f32, side: usize) -> FlipErrors {
    // One more pixel than the filters' radius, which is rounded elsewhere.
    let margin = (REACH * pixels_per_degree).ceil() as usize + 1;
    let corners: Vec<[usize; 2]> = (0..height).step_by(side).flat_map(|y| (0..width).step_by(side).map(move |x| [x, y])).collect();
    let of_tile = |&[x, y]: &[usize; 2]| {
        let (left, top) = (x.saturating_sub(margin), y.saturating_sub(margin));
        let (right, bottom) = ((x + side + margin).min(width), (y + side + margin).min(height));
        let cut = |image: &[u8]| {
            let rows = (top..bottom).flat_map(|row| &image[3 * (row * width + left)..3 * (row * width + right)]);
            let bytes: Vec<u8> = rows.copied().collect();
            let side = |s: usize| u32::try_from(s).expect("a tile is small");
            FlipImageRgb8::with_data(side(right - left), side(bottom - top), &bytes)
        };
        let errors = flip(cut(a), cut(b), pixels_per_degree).to_vec();
        let (mut sum, mut largest) = (0.0, 0.0_f32);
        for row in y..(y + side).min(height) {
            let at = (row - top) * (right - left);
            for error in &errors[at + x - left..at + (x + side).min(width) - left] {
                sum += f64::from(*error);
                largest = largest.max(*error);
            }
        }
        (sum, largest)
    };
    // Added up in the order of the tiles: the same at any number of threads.
    let tiles: Vec<(f64, f32)> = corners.par_iter().map(of_tile).collect();
    let (sum, largest) = tiles.into_iter().fold((0.0, 0.0_f32), |(sum, most), (s, m)| (sum + s, most.max(m)));
    FlipErrors { mean: sum / (width * height).max(1) as f64, largest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nv_flip::FlipPool;

    #[test]
    fn tiles_give_what_the_whole_image_gives_whatever_reaches_over_their_edges() {
        let size = [150, 97];
        let image = |salt: u32| -> Vec<u8> {
            (0..3 * size[0] * size[1]).map(|k| (biscale::numerics::low_discrepancy::hash((k as u32 / 9) ^ salt) >> 24) as u8).collect()
        };
        let (a, b) = (image(1), image(2));
        for pixels_per_degree in [1.0, 30.0, 67.02, 500.0] {
            let whole = |image: &[u8]| FlipImageRgb8::with_data(150, 97, image);
            let errors = flip(whole(&a), whole(&b), pixels_per_degree);
            let expected = FlipPool::from_image(&errors);
            for side in [16, 40, 1000] {
                let found = by_tiles(size, &a, &b, pixels_per_degree, side);
                assert_eq!(found.largest, expected.max_value(), "{pixels_per_degree} pixels a degree, tiles of {side}");
                assert!((found.mean / f64::from(expected.mean()) - 1.0).abs() < 1e-5, "{found:?} and {}", expected.mean());
            }
            let sum: f64 = errors.to_vec().iter().map(|e| f64::from(*e)).sum();
            let found = by_tiles(size, &a, &b, pixels_per_degree, 33).mean * 14550.0;
            assert!((found / sum - 1.0).abs() < 1e-12, "{found} and {sum}");
        }
    }
}
