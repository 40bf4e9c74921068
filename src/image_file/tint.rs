//! Images of colour weights.

use super::mask::PlainImage;
use super::raster::Raster;
use super::read::read;
use crate::error::{BadInput, Result};
use crate::numerics::cast::{narrow, truncate_usize};
use crate::numerics::colour::srgb_to_linear;
use glam::DVec2;
use std::path::Path;

/// An image of colour weights in 0..=1, linear RGB.
pub type TintImage = PlainImage<3>;

impl TintImage {
    /// The pixel that holds `uv`, both wrapped into the unit square.
    pub fn lookup(&self, uv: DVec2) -> [f32; 3] {
        let wrapped = uv - uv.floor();
        let pixel = |x: f64, size: usize| truncate_usize(x * size as f64).min(size - 1);
        self.pixels[pixel(wrapped.y, self.height) * self.width + pixel(wrapped.x, self.width)]
    }
}

/// Reads colour weights: whole numbers are sRGB-encoded, floats linear. All must lie in 0..1.
///
/// # Errors
/// As [`read`]; and a value outside 0..1, with its pixel.
pub fn read_tint(path: &Path) -> Result<TintImage> {
    let Raster { width, height, channels, integer, .. } = read(path)?;
    let mut pixels = Vec::with_capacity(width * height);
    // Row 0 of a tint lies at v = 0, which is the bottom of the image.
    for row in (0..height).rev() {
        for column in 0..width {
            let pixel: [f32; 3] = std::array::from_fn(|c| channels[c.min(channels.len() - 1)][row * width + column]);
            if let Some(bad) = pixel.iter().find(|v| !(0.0..=1.0).contains(*v)) {
                let problem = format!("the colour weight {bad} in column {column}, row {row} is out of range");
                return Err(BadInput::new(problem, "scale the image to 0..1").in_file(path).into());
            }
            pixels.push(if integer { pixel.map(|v| narrow(srgb_to_linear(v.into()))) } else { pixel });
        }
    }
    Ok(TintImage { width, height, pixels })
}
