//! FLIP (Andersson et al. 2020) between a photograph and the fitted material.

use crate::common::flip::flip_errors;
use biscale::numerics::colour::srgb_byte;
use biscale_fit::photograph::image::Photograph;
use nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// Mean FLIP of the pixels that are compared, both as a screen would show them; the others are black in both.
pub fn mean_flip(photograph: &Photograph, picture: &[[f32; 3]], used: &[u32]) -> f64 {
    let (width, height) = (photograph.image.width, photograph.image.height);
    let largest = used.iter().flat_map(|&p| photograph.image.rgb[p as usize]).fold(0.0, f32::max);
    let image = |rgb: &[[f32; 3]]| {
        let mut bytes = vec![0_u8; 3 * rgb.len()];
        for &pixel in used {
            for c in 0..3 {
                let share = rgb[pixel as usize][c] / largest.max(f32::MIN_POSITIVE);
                bytes[3 * pixel as usize + c] = srgb_byte(share.into());
            }
        }
        bytes
    };
    let size = [width as usize, height as usize];
    let errors = flip_errors(size, &image(&photograph.image.rgb), &image(picture), DEFAULT_PIXELS_PER_DEGREE);
    let share = used.len() as f64 / f64::from(width * height);
    errors.mean / share.max(1e-9)
}
