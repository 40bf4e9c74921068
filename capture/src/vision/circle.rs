//! A mirror ball in a photograph.

use super::{Gray, failed, whole};
use crate::edges::Grey;
use biscale::error::Result;
use glam::DVec2;
use opencv::core::{Vec3f, Vector};

/// Circles that may be balls, the likeliest first: middle and radius, px.
///
/// # Errors
/// What `OpenCV` says.
pub fn candidates(gray: &Gray) -> Result<Vec<[f64; 3]>> {
    const LOOK: f64 = 1000.0;
    let factor = (gray.width.max(gray.height) as f64 / LOOK).max(1.0);
    let small = gray.smaller(factor)?;
    let mut circles: Vector<Vec3f> = Vector::new();
    let size = gray.width.min(gray.height) as f64 / factor;
    opencv::imgproc::hough_circles(
        &small,
        &mut circles,
        opencv::imgproc::HOUGH_GRADIENT,
        1.5,
        0.05 * size,
        80.0,
        25.0,
        whole(0.02 * size),
        whole(0.45 * size),
    )
    .map_err(failed("looking for a ball"))?;
    Ok(circles
        .iter()
        .take(60)
        .map(|c| [(f64::from(c[0]) + 0.5) * factor - 0.5, (f64::from(c[1]) + 0.5) * factor - 0.5, f64::from(c[2]) * factor])
        .collect())
}

/// Rays that the rim of a ball is looked for along.
pub const RAYS: u32 = 240;

/// Places of the outline near a circle: along rays from its middle, where the light changes most.
pub fn outline(image: &impl Grey, [x, y, radius]: [f64; 3]) -> Vec<DVec2> {
    let middle = DVec2::new(x, y);
    let step = (radius / 200.0).clamp(0.25, 2.0);
    (0..RAYS)
        .filter_map(|k| {
            let direction = DVec2::from_angle(f64::from(k) / f64::from(RAYS) * std::f64::consts::TAU);
            let slope =
                |r: f64| Some((image.value(middle + (r + step) * direction)? - image.value(middle + (r - step) * direction)?).abs());
            let mut best: Option<(f64, f64)> = None;
            let mut r = 0.8 * radius;
            while r < 1.25 * radius {
                let s = slope(r)?;
                if best.is_none_or(|b| s > b.1) {
                    best = Some((r, s));
                }
                r += step;
            }
            let (r, s) = best?;
            // The top of a parabola through the neighbours.
            let (a, c) = (slope(r - step)?, slope(r + step)?);
            let bend = a - 2.0 * s + c;
            let shift = if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-1.0, 1.0) * step } else { 0.0 };
            Some(middle + (r + shift) * direction)
        })
        .collect()
}

/// The middle of the brightest spot within a circle and its radius, px; `None` if nothing stands out.
pub fn highlight(image: &impl Grey, [x, y, radius]: [f64; 3]) -> Option<(DVec2, f64)> {
    let middle = DVec2::new(x, y);
    let reach = 0.97 * radius;
    let step = (radius / 300.0).max(0.5);
    #[expect(clippy::cast_possible_truncation, reason = "a few hundred")]
    let n = (reach / step) as i32;
    let mut values = Vec::new();
    for j in -n..=n {
        for i in -n..=n {
            let d = DVec2::new(f64::from(i), f64::from(j)) * step;
            if d.length() < reach {
                values.push((middle + d, image.value(middle + d)?));
            }
        }
    }
    let top = values.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut sorted: Vec<f64> = values.iter().map(|v| v.1).collect();
    let half = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(half, f64::total_cmp).1;
    if !(top.1 > 3.0 * median.max(1e-9)) {
        return None;
    }
    // What is over half of the way up, near the top: reflections of anything else lie elsewhere.
    let level = 0.5 * (top.1 + median);
    let mut centre = top.0;
    for _ in 0..5 {
        let near = values.iter().filter(|v| v.1 > level && v.0.distance(centre) < 0.2 * radius);
        let (sum, count) = near.fold((DVec2::ZERO, 0_u32), |(s, n), v| (s + v.0, n + 1));
        centre = sum / f64::from(count.max(1));
    }
    let count = values.iter().filter(|v| v.1 > level && v.0.distance(centre) < 0.2 * radius).count() as f64;
    Some((centre, (count * step * step / std::f64::consts::PI).sqrt()))
}
