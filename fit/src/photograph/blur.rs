//! How sharp a photograph is, from its own edges.
//!
//! A picture that is blurred once more loses little where it is soft and much where it is sharp (Zhuo and Sim 2011, "Defocus map estimation from a
//! single image", section 3): the ratio of the gradients before and after tells the blur of a step. Threads end in steps, against shadows and
//! gaps, and in slopes, where their sides turn away; the sharpest of the strong edges are steps.

use crate::photograph::image::Photograph;
use crate::photograph::params::PARAMS;
use biscale::numerics::cast::truncate_usize;
use glam::DVec3;

/// Standard deviation of the blur of a photograph whose pixels `seen` show the object, beside the extent of its pixels; `None` where there are too
/// few edges.
pub fn of_edges(photograph: &Photograph, seen: &[(u32, DVec3)]) -> Option<f64> {
    let (width, height) = (photograph.image.width as usize, photograph.image.height as usize);
    let mut grey = vec![f64::NAN; width * height];
    for &(pixel, _) in seen {
        grey[pixel as usize] = photograph.image.rgb[pixel as usize].iter().map(|v| f64::from(*v)).sum();
    }
    let soft = again(&grey, width, height);
    let mut edges: Vec<(f64, f64)> = Vec::new();
    for (stride, [last_x, last_y]) in [(1, [width - 1, height]), (width, [width, height - 1])] {
        let step = |of: &[f64], at: usize| (of[at + stride] - of[at]).abs();
        for y in 0..last_y {
            for x in 0..last_x {
                let at = y * width + x;
                let (before, after) = if stride == 1 { (x, last_x - 1 - x) } else { (y, last_y - 1 - y) };
                if before == 0 || after == 0 {
                    continue;
                }
                let here = step(&grey, at);
                // Not a number is no edge.
                if here > 0.0 && here >= step(&grey, at - stride) && here >= step(&grey, at + stride) && step(&soft, at) > 0.0 {
                    edges.push((here, here / step(&soft, at)));
                }
            }
        }
    }
    edges.sort_by(|a, b| b.0.total_cmp(&a.0));
    let share = |share: f64, of: usize| truncate_usize(share * of as f64);
    let strong = PARAMS.strong_edge * edges.get(share(PARAMS.strongest_edges, edges.len()))?.0;
    edges.truncate(edges.partition_point(|e| e.0 >= strong));
    if edges.len() < PARAMS.least_edges {
        return None;
    }
    let mut ratios: Vec<f64> = edges.into_iter().map(|e| e.1).collect();
    ratios.sort_by(f64::total_cmp);
    let ratio = ratios[share(PARAMS.sharpness_rank, ratios.len() - 1)];
    // Sharper than pixels can be is as sharp as they are; softer than the second blur can tell is as soft as that.
    let (mut low, mut high) = (0.0, 8.0);
    if ratio >= expected(low) {
        return Some(0.0);
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if expected(middle) > ratio { low = middle } else { high = middle }
    }
    Some(low)
}

/// The ratio at a step between pixels, blurred by `sigma`.
fn expected(sigma: f64) -> f64 {
    peak(sigma) / peak_after(sigma)
}

/// Difference of the two pixels on either side of a step: each is a mean over its extent.
fn peak(sigma: f64) -> f64 {
    let mean = |k: i32| blurred_step_mean(f64::from(k), sigma);
    mean(0) - mean(-1)
}

/// The same after the second blur.
fn peak_after(sigma: f64) -> f64 {
    let weights = weights();
    let reach = i32::try_from(weights.len()).expect("few") - 1;
    let at = |pixel: i32| {
        (-reach..=reach).map(|k| weights[k.unsigned_abs() as usize] * blurred_step_mean(f64::from(pixel + k), sigma)).sum::<f64>()
    };
    at(0) - at(-1)
}

/// Mean over `[from, from + 1]` of a step at 0, blurred.
fn blurred_step_mean(from: f64, sigma: f64) -> f64 {
    if sigma < 1e-6 {
        return (from + 1.0).clamp(0.0, 1.0);
    }
    // The integral of the normal distribution function.
    let integral = |x: f64| {
        let z = x / sigma;
        x * 0.5 * (1.0 + libm::erf(z / std::f64::consts::SQRT_2)) + sigma * (-0.5 * z * z).exp() / (std::f64::consts::TAU).sqrt()
    };
    integral(from + 1.0) - integral(from)
}

fn weights() -> Vec<f64> {
    let weights: Vec<f64> = (0..=3).map(|k| (-0.5 * (f64::from(k) / PARAMS.second_blur).powi(2)).exp()).collect();
    let total = 2.0 * weights.iter().sum::<f64>() - weights[0];
    weights.into_iter().map(|w| w / total).collect()
}

/// Blurs along x and y; what is not a number spreads.
fn again(grey: &[f64], width: usize, height: usize) -> Vec<f64> {
    let weights = weights();
    let mut picture = grey.to_vec();
    for (count, stride, lines, line) in [(width, 1, height, width), (height, width, width, 1)] {
        let old = picture.clone();
        for l in 0..lines {
            for k in 0..count {
                let at = |j: usize| old[l * line + j.min(count - 1) * stride];
                let sum: f64 = (1..weights.len()).map(|j| weights[j] * (at(k.saturating_sub(j)) + at(k + j))).sum();
                picture[l * line + k * stride] = weights[0] * at(k) + sum;
            }
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photograph::image::{Image, Pinhole, Role};
    use biscale::numerics::low_discrepancy::gaussian;
    use biscale::render::{Camera, Light, Object};
    use biscale::toml_reader::{Source, TableReader};

    const SIZE: usize = 128;

    /// A photograph of bars 11 pixels wide that lie askew, blurred by `sigma`, with noise of that standard deviation; every pixel is a mean over its extent.
    fn bars(sigma: f64, noise: f64) -> (Photograph, Vec<(u32, DVec3)>) {
        let text = "[object]\nkind = \"plane\"\nsize = [1, 1]\n[camera]\norigin = [0, 0, 9]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_deg = 10\n\
                    width = 128\nheight = 128\n[light]\ntype = \"directional\"\nto_light = [0, 0, 1]\nirradiance_rgb = 1\n";
        let source = Source { path: "t.toml".into(), text: text.to_owned() };
        let root = source.parse().unwrap();
        let top = TableReader::new(&source, "", root.get_ref(), 0);
        let table = |key| top.table(key).unwrap().unwrap();
        let value = |x: usize, y: usize| -> f64 {
            let across = x as f64 + 0.37 * y as f64;
            let mean = |edge: f64| blurred_step_mean(across - edge, sigma);
            (0..40).map(|k| f64::from(1 - 2 * (k % 2)) * mean(11.0 * f64::from(k))).sum::<f64>()
        };
        let rgb = (0..SIZE * SIZE).map(|k| [(0.2 + 0.5 * value(k % SIZE, k / SIZE) + noise * gaussian(5, k as u64)) as f32; 3]).collect();
        let photograph = Photograph {
            file: "t.exr".into(),
            role: Role::CloseUp,
            image: Image { width: SIZE as u32, height: SIZE as u32, rgb, notes: Vec::new() },
            camera: Pinhole::of(&Camera::read(table("camera")).unwrap()),
            light: Light::read(table("light")).unwrap(),
            light_sigma_deg: 0.0,
            exposure_known: true,
            stated_irradiance_sigma: None,
            object: Object::read_bare(table("object")).unwrap(),
            noise: None,
        };
        let seen = (0..(SIZE * SIZE) as u32).map(|pixel| (pixel, DVec3::ZERO)).collect();
        (photograph, seen)
    }

    #[test]
    fn the_blur_of_bars_is_found_with_and_without_noise() {
        for sigma in [0.4, 0.7, 1.2, 2.0] {
            for noise in [0.0, 0.003] {
                let (photograph, seen) = bars(sigma, noise);
                let found = of_edges(&photograph, &seen).unwrap();
                // Bars that lie askew are seen along rows and columns, where they are as soft or softer.
                assert!((found / sigma - 1.0).abs() < 0.25, "{found} for {sigma}, noise {noise}");
            }
        }
    }

    #[test]
    fn what_is_sharp_has_next_to_no_blur_and_what_has_no_edges_has_no_answer() {
        let (sharp, seen) = bars(0.0, 0.0);
        assert!(of_edges(&sharp, &seen).unwrap() < 0.25);
        let (mut flat, seen) = bars(0.7, 0.0);
        flat.image.rgb.fill([0.3; 3]);
        assert_eq!(of_edges(&flat, &seen), None);
        assert_eq!(of_edges(&sharp, &[]), None);
    }

    #[test]
    fn a_second_blur_loses_less_the_softer_a_step_is() {
        let ratios: Vec<f64> = [0.0, 0.3, 0.7, 1.5, 4.0].into_iter().map(expected).collect();
        assert!(ratios.windows(2).all(|w| w[0] > w[1]) && ratios[4] > 1.0, "{ratios:?}");
    }
}
