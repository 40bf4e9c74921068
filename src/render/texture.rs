//! Images over texture coordinates, filtered to the footprint of a sample.
//!
//! A pyramid of box-filtered images (Williams 1983) is built in linear values. Each level halves the one below, rounded down; a pixel is
//! the mean of the area that it covers there, so that every level has the mean of the image for any size. A footprint is an ellipse:
//! pixels are averaged along its longer axis, between the two levels whose pixels are nearest to its shorter one (`McCormack` et al. 1999,
//! "Feline", with a box in the place of the Gaussian).

use crate::numerics::cast::{narrow, truncate_usize};
use glam::{DMat2, DVec2};

/// Most lookups along the longer axis of a footprint; a longer one is blurred across.
///
/// Chosen, not measured: 16 is what graphics hardware offers; on a plane it is reached where the cosine to the viewer is 1/16.
const MAX_TAPS: f64 = 16.0;

/// What an image shows outside of the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// Its border.
    Clamp,
    /// 0.
    Zero,
}

/// An image of `N` channels and its reductions.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture<const N: usize> {
    levels: Vec<Level<N>>,
    wrap: Wrap,
}

/// One image of the pyramid; row 0 lies at v = 0.
#[derive(Clone, Debug, PartialEq)]
struct Level<const N: usize> {
    width: usize,
    height: usize,
    pixels: Vec<[f32; N]>,
}

impl<const N: usize> Texture<N> {
    /// The pyramid of an image, `height` rows of `width` pixels, row 0 at v = 0; at least one pixel.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; N]>, wrap: Wrap) -> Self {
        let mut levels = vec![Level { width, height, pixels }];
        while let Some(level) = levels.last().and_then(Level::halved) {
            levels.push(level);
        }
        Self { levels, wrap }
    }

    /// Pixels across and up.
    pub fn size(&self) -> [usize; 2] {
        [self.levels[0].width, self.levels[0].height]
    }

    /// What is outside of the unit square.
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// The pixels of the image itself, row 0 at v = 0.
    pub fn pixels(&self) -> &[[f32; N]] {
        &self.levels[0].pixels
    }

    /// The mean over a footprint around `uv`, whose two vectors span it; zero vectors ask for the image itself, interpolated.
    pub fn mean(&self, uv: DVec2, footprint: [DVec2; 2]) -> [f64; N] {
        let Ellipse { longer, width, taps } = self.ellipse(footprint);
        let mut sum = [0.0; N];
        for tap in 0..taps {
            let along = (tap as f64 + 0.5) / taps as f64 - 0.5;
            let value = self.between_levels(uv + along * longer, width);
            (0..N).for_each(|c| sum[c] += value[c]);
        }
        sum.map(|v| v / taps as f64)
    }

    /// The axes of a footprint.
    fn ellipse(&self, [a, b]: [DVec2; 2]) -> Ellipse {
        let size = DVec2::new(self.levels[0].width as f64, self.levels[0].height as f64);
        let (a, b) = (a * size, b * size);
        // Squares of the semi-axes are the eigenvalues of J Jᵀ.
        let (xx, xy, yy) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        let (major, minor) = ((mean + half).sqrt(), (mean - half).max(0.0).sqrt());
        let largest = self.levels[0].width.max(self.levels[0].height) as f64;
        // A footprint of several images, or of a surface seen edge-on, is their mean, or what lies around them.
        if !(major.is_finite() && major < largest * MAX_TAPS) {
            return Ellipse { longer: DVec2::ZERO, width: f64::INFINITY, taps: 1 };
        }
        let width = minor.max(major / MAX_TAPS).max(1.0);
        let taps = truncate_usize((major / width).ceil()).max(1);
        let across = DMat2::from_cols(DVec2::new(xx - mean + half, xy), DVec2::new(xy, yy - mean + half));
        // Either column of J Jᵀ minus the smaller eigenvalue lies along the longer axis; the longer column is the precise one.
        let axis = if across.x_axis.length_squared() > across.y_axis.length_squared() { across.x_axis } else { across.y_axis };
        Ellipse { longer: axis.normalize_or_zero() * major / size, width, taps }
    }

    /// The value for a footprint as wide as `width` pixels of the image.
    fn between_levels(&self, uv: DVec2, width: f64) -> [f64; N] {
        let scale = |level: &Level<N>| {
            let of = &self.levels[0];
            (of.width as f64 / level.width as f64).max(of.height as f64 / level.height as f64)
        };
        // What lies around the image: the border of a coarse level would be a mean of much more than the border.
        let around = match self.wrap {
            Wrap::Repeat => None,
            Wrap::Clamp => Some(self.levels[0].border(uv)),
            Wrap::Zero => Some([0.0; N]),
        };
        // Beyond these nothing reaches into the image.
        let uv = if around.is_none() { uv - uv.floor() } else { uv.clamp(DVec2::splat(-1.0), DVec2::splat(2.0)) };
        let Some(finer) = self.levels.windows(2).position(|pair| scale(&pair[1]) > width) else {
            let value = self.levels[self.levels.len() - 1].interpolate(uv, around);
            let Some(around) = around else { return value };
            let [across, down] = [self.levels[0].width, self.levels[0].height].map(|size| (size as f64 / width).min(1.0));
            return std::array::from_fn(|c| around[c] + across * down * (value[c] - around[c]));
        };
        let [fine, coarse] = [finer, finer + 1].map(|k| &self.levels[k]);
        let share = (width / scale(fine)).ln() / (scale(coarse) / scale(fine)).ln();
        let value = fine.interpolate(uv, around);
        if share <= 0.0 {
            return value;
        }
        let other = coarse.interpolate(uv, around);
        std::array::from_fn(|c| value[c] + share * (other[c] - value[c]))
    }
}

/// A footprint as lookups.
struct Ellipse {
    /// The longer axis, in texture coordinates, from end to end.
    longer: DVec2,
    /// Width of a lookup, in pixels of the image.
    width: f64,
    /// Lookups along the longer axis.
    taps: usize,
}

impl<const N: usize> Level<N> {
    /// The image of half its size; `None` of a single pixel.
    fn halved(&self) -> Option<Self> {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        if (width, height) == (self.width, self.height) {
            return None;
        }
        let (across, down) = (areas(self.width, width), areas(self.height, height));
        let mut pixels = Vec::with_capacity(width * height);
        for rows in &down {
            for columns in &across {
                let mut sum = [0.0; N];
                for &(row, in_row) in rows {
                    for &(column, in_column) in columns {
                        let pixel = &self.pixels[row * self.width + column];
                        (0..N).for_each(|c| sum[c] += in_row * in_column * f64::from(pixel[c]));
                    }
                }
                pixels.push(sum.map(narrow));
            }
        }
        Some(Self { width, height, pixels })
    }

    /// The value of the border where it is nearest.
    fn border(&self, uv: DVec2) -> [f64; N] {
        let half = DVec2::new(0.5 / self.width as f64, 0.5 / self.height as f64);
        let mut place = uv.clamp(half, 1.0 - half);
        // From inside to the nearer of the four edges.
        let [left, below] = [place.x.min(1.0 - place.x), place.y.min(1.0 - place.y)];
        if left <= below {
            place.x = if place.x < 0.5 { half.x } else { 1.0 - half.x };
        } else {
            place.y = if place.y < 0.5 { half.y } else { 1.0 - half.y };
        }
        self.interpolate(place, Some([0.0; N]))
    }

    /// Bilinear interpolation between the middles of pixels; `around` is what lies outside of the image, `None` where it is repeated.
    fn interpolate(&self, uv: DVec2, around: Option<[f64; N]>) -> [f64; N] {
        let place = |u: f64, size: usize| {
            let x = u * size as f64 - 0.5;
            let below = x.floor();
            ([below, below + 1.0].map(|x| pixel_at(x, size, around.is_none())), x - below)
        };
        let ([left, right], x) = place(uv.x, self.width);
        let ([lower, upper], y) = place(uv.y, self.height);
        let pixel = |column: Option<usize>, row: Option<usize>| match (column, row) {
            (Some(column), Some(row)) => self.pixels[row * self.width + column].map(f64::from),
            _ => around.unwrap_or([0.0; N]),
        };
        let corners = [pixel(left, lower), pixel(right, lower), pixel(left, upper), pixel(right, upper)];
        let weights = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
        std::array::from_fn(|c| (0..4).map(|k| weights[k] * corners[k][c]).sum())
    }
}

/// The pixel that stands at a whole place along an axis; `None` where nothing does.
fn pixel_at(x: f64, size: usize, repeated: bool) -> Option<usize> {
    if repeated {
        return Some(truncate_usize(x.rem_euclid(size as f64)).min(size - 1));
    }
    (x >= 0.0 && x < size as f64).then(|| truncate_usize(x))
}

/// For each of `few` equal parts of a line of `many` pixels the pixels that it covers, with their shares of the part.
fn areas(many: usize, few: usize) -> Vec<Vec<(usize, f64)>> {
    let part = |k: usize| {
        // In units of a pixel over `few`: whole numbers, so that the shares are exact.
        let (begin, end) = (k * many, (k + 1) * many);
        let covered = |pixel: usize| end.min((pixel + 1) * few) - begin.max(pixel * few);
        (begin / few..end.div_ceil(few)).map(|pixel| (pixel, covered(pixel) as f64 / many as f64)).collect()
    };
    (0..few).map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stripes(width: usize, height: usize, wrap: Wrap) -> Texture<1> {
        let pixels = (0..width * height).map(|k| [if (k % width).is_multiple_of(2) { 1.0 } else { 0.0 }]).collect();
        Texture::new(width, height, pixels, wrap)
    }

    #[test]
    fn a_frame_of_one_pixel_is_all_that_a_clamped_image_has_around_it() {
        let size = 16;
        let framed = (0..size * size)
            .map(|k| [f32::from(u8::from((1..size - 1).contains(&(k % size)) && (1..size - 1).contains(&(k / size))))])
            .collect();
        let texture = Texture::new(size, size, framed, Wrap::Clamp);
        for footprint in [0.0, 0.1, 0.5, 2.0, 50.0, 1e9] {
            let axes = [DVec2::new(footprint, 0.0), DVec2::new(0.0, footprint)];
            // A footprint's own half reaches into the image no more.
            let [far] = texture.mean(DVec2::new(3.5 + footprint, 0.5), axes);
            assert!(far.abs() < 1e-12, "{footprint}: {far}");
            // Of a footprint of many images the image is a small part.
            let [middle] = texture.mean(DVec2::splat(0.5), axes);
            let share = (14.0_f64 / 16.0 / footprint.max(14.0 / 16.0)).powi(2);
            assert!((middle - share).abs() < 0.25, "{footprint}: {middle} for about {share}");
        }
    }

    #[test]
    fn every_level_has_the_mean_of_the_image_at_any_size() {
        for (width, height) in [(8, 8), (7, 5), (1, 9), (13, 2), (100, 37)] {
            let pixels: Vec<[f32; 2]> = (0..width * height).map(|k| [(k * k % 17) as f32, (k % 5) as f32]).collect();
            let mean = |pixels: &[[f32; 2]]| -> [f64; 2] {
                std::array::from_fn(|c| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels.len() as f64)
            };
            let expected = mean(&pixels);
            let texture = Texture::new(width, height, pixels, Wrap::Clamp);
            let last = texture.levels.last().unwrap();
            assert_eq!((last.width, last.height), (1, 1));
            for level in &texture.levels {
                let got = mean(&level.pixels);
                assert!(
                    (0..2).all(|c| (got[c] - expected[c]).abs() < 1e-5),
                    "{got:?} and not {expected:?} at {} x {}",
                    level.width,
                    level.height
                );
            }
        }
    }

    #[test]
    fn a_pixel_s_middle_has_its_value_and_stripes_are_grey_from_afar() {
        let texture = stripes(16, 16, Wrap::Repeat);
        assert_eq!(texture.mean(DVec2::new(2.5 / 16.0, 0.3), [DVec2::ZERO; 2]), [1.0]);
        assert_eq!(texture.mean(DVec2::new(3.5 / 16.0, 0.3), [DVec2::ZERO; 2]), [0.0]);
        for k in 0..40 {
            let uv = DVec2::new(f64::from(k) / 39.0, 0.4);
            let [value] = texture.mean(uv, [DVec2::X * 0.25, DVec2::Y * 0.25]);
            assert!((value - 0.5).abs() < 1e-6, "{value}");
        }
    }

    #[test]
    fn a_long_footprint_is_blurred_along_itself_only() {
        // Stripes across x: a footprint along the stripes keeps them, one across does not, turned or not.
        let texture = stripes(64, 64, Wrap::Repeat);
        let (thin, long) = (1.0 / 64.0, 10.0 / 64.0);
        let at = DVec2::new(8.5 / 64.0, 0.37);
        for swap in [false, true] {
            let footprint = |a: DVec2, b: DVec2| if swap { [b, a] } else { [a, b] };
            let [kept] = texture.mean(at, footprint(DVec2::X * thin, DVec2::Y * long));
            let [lost] = texture.mean(at, footprint(DVec2::X * long, DVec2::Y * thin));
            assert!(kept > 0.99 && (lost - 0.5).abs() < 0.01, "{kept} and {lost}");
        }
    }

    #[test]
    fn outside_of_the_unit_square_is_what_the_wrap_says() {
        let value = |wrap: Wrap, x: f64| Texture::new(2, 1, vec![[0.25_f32], [1.0]], wrap).mean(DVec2::new(x, 0.5), [DVec2::ZERO; 2])[0];
        for (wrap, left, right) in [(Wrap::Repeat, 1.0, 0.25), (Wrap::Clamp, 0.25, 1.0), (Wrap::Zero, 0.0, 0.0)] {
            assert_eq!((value(wrap, -0.25), value(wrap, 1.25)), (left, right), "{wrap:?}");
        }
        // Between the last pixel and nothing.
        assert!((value(Wrap::Zero, 1.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn extreme_places_and_footprints_give_the_mean_or_a_pixel() {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Zero] {
            let texture = stripes(5, 3, wrap);
            for uv in [DVec2::ZERO, DVec2::ONE, DVec2::splat(1e300), DVec2::new(-1e18, 0.5)] {
                for step in [0.0, 1e-300, 1.0, 1e6, 1e300, f64::INFINITY, f64::NAN] {
                    let [value] = texture.mean(uv, [DVec2::new(step, 0.0), DVec2::new(step, step)]);
                    assert!((0.0..=1.0).contains(&value), "{value} at {uv} over {step}, {wrap:?}");
                }
            }
        }
    }
}
