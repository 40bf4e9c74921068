//! Images whose numbers are taken as they stand: masks and normal maps.

use super::raster::Raster;
use super::read::read;
use crate::error::{BadInput, Result};
use crate::numerics::cast::narrow;
use crate::numerics::colour::srgb_to_linear;
use std::path::Path;

/// An image of `N` channels, row 0 at v = 0 (the image's bottom row).
#[derive(Clone, Debug, PartialEq)]
pub struct PlainImage<const N: usize> {
    /// Pixels across.
    pub width: usize,
    /// Pixels up.
    pub height: usize,
    /// `height` rows of `width` pixels.
    pub pixels: Vec<[f32; N]>,
}

/// Which numbers of an image are a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskChannel {
    /// Alpha where the image has it, else grey.
    Either,
    /// The only channel, or three that are equal.
    Grey,
    /// The alpha channel.
    Alpha,
}

/// How the numbers of a mask are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskEncoding {
    /// They are shares.
    Linear,
    /// They are shares through the sRGB curve.
    Srgb,
}

/// Reads shares in 0..=1.
///
/// # Errors
/// As [`read`]; an image without the channel, with colours, or with a value outside 0..1, with its pixel.
pub fn read_mask(path: &Path, channel: MaskChannel, encoding: MaskEncoding) -> Result<PlainImage<1>> {
    let Raster { width, height, channels, alpha, .. } = read(path)?;
    let bad = |problem: String, remedy: &str| BadInput::new(problem, remedy).in_file(path);
    let place = |k: usize| format!("column {}, row {}", k % width, k / width);
    let share = match (channel, alpha) {
        (MaskChannel::Alpha, None) => {
            return Err(bad("the mask has no alpha channel".to_owned(), "take its grey values, or save it with alpha").into());
        }
        (MaskChannel::Either, Some(alpha)) if alpha.iter().all(|a| *a == 1.0) && channels.iter().any(|c| c.iter().any(|v| *v != c[0])) => {
            let remedy = "write `mask_channel = \"grey\"` to take its grey values, or \"alpha\" to cover everything";
            return Err(bad("the mask's alpha is 1 everywhere, and its picture is in the grey values".to_owned(), remedy).into());
        }
        (MaskChannel::Alpha | MaskChannel::Either, Some(alpha)) => alpha,
        (MaskChannel::Grey, _) | (MaskChannel::Either, None) => {
            let coloured = (0..width * height).find(|&k| channels.iter().any(|c| c[k] != channels[0][k]));
            if let Some(k) = coloured {
                let [r, g, b] = [0, 1, 2].map(|c: usize| channels[c][k]);
                let problem = format!("the mask has colours: ({r}, {g}, {b}) in {}", place(k));
                return Err(bad(problem, "save it as grey").into());
            }
            channels.into_iter().next().unwrap_or_default()
        }
    };
    if let Some(k) = share.iter().position(|v| !(0.0..=1.0).contains(v)) {
        return Err(bad(format!("the share {} in {} is out of range", share[k], place(k)), "scale the mask to 0..1").into());
    }
    let decode = |v: f32| if encoding == MaskEncoding::Srgb { narrow(srgb_to_linear(v.into())) } else { v };
    let pixels = (0..height).rev().flat_map(|row| &share[row * width..(row + 1) * width]).map(|&v| [decode(v)]).collect();
    Ok(PlainImage { width, height, pixels })
}

/// Reads a tangent-space normal map: vectors, `2 value - 1` of red, green and blue, z over 0.
///
/// # Errors
/// As [`read`]; an image without colours, or with a vector that points below the surface, with its pixel.
pub fn read_normals(path: &Path) -> Result<PlainImage<3>> {
    let Raster { width, height, channels, .. } = read(path)?;
    let [x, y, z] = &channels[..] else {
        let problem = "the normal map has one channel";
        return Err(BadInput::new(problem, "a map of heights is none: convert it to red, green and blue").in_file(path).into());
    };
    let encoded = |k: usize| [x[k], y[k], z[k]];
    // Not a number is in no range.
    let is_outward = |k: &usize| encoded(*k).iter().all(|v| (0.0..=1.0).contains(v)) && z[*k] > 0.5;
    if let Some(k) = (0..width * height).find(|k| !is_outward(k)) {
        let [x, y, z] = encoded(k).map(|v| 2.0 * v - 1.0);
        let problem = format!("({x}, {y}, {z}) in column {}, row {} is no normal that points outward", k % width, k / width);
        let remedy = "use a map in tangent space: red, green and blue in 0..1, blue over one half";
        return Err(BadInput::new(problem, remedy).in_file(path).into());
    }
    let vector = |k: usize| encoded(k).map(|v| 2.0 * v - 1.0);
    let pixels = (0..height).rev().flat_map(|row| row * width..(row + 1) * width).map(vector).collect();
    Ok(PlainImage { width, height, pixels })
}
