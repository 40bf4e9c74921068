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
pub const RAYS: u32 = 180;

/// Places that may be the outline near a circle: along rays from its middle, where the light changes, the strongest few.
pub fn outline(image: &impl Grey, [x, y, radius]: [f64; 3]) -> Vec<Vec<DVec2>> {
    /// Changes of the light over a step that count, of its level.
    const LEAST: f64 = 0.02;
    const MOST: usize = 6;
    let middle = DVec2::new(x, y);
    let step = (radius / 120.0).clamp(0.5, 3.0);
    let edges = |k: u32| -> Option<Vec<DVec2>> {
        let direction = DVec2::from_angle(f64::from(k) / f64::from(RAYS) * std::f64::consts::TAU);
        // A little along the rim, too, against noise.
        let side = 1.5 * step * direction.perp();
        let value = |r: f64| -> Option<f64> {
            let p = middle + r * direction;
            Some((image.value(p - side)? + image.value(p)? + image.value(p + side)?) / 3.0)
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred")]
        let count = (0.5 * radius / step) as usize;
        let radius_of = |i: f64| 0.75 * radius + i * step;
        let values: Vec<f64> = (0..count).map(|i| value(radius_of(i as f64))).collect::<Option<_>>()?;
        let slope = |i: usize| (values[i + 1] - values[i - 1]).abs();
        let mut found: Vec<(f64, DVec2)> = Vec::new();
        for i in 2..count.saturating_sub(2) {
            let (a, s, c) = (slope(i - 1), slope(i), slope(i + 1));
            if s >= a && s > c && s > LEAST * (values[i + 1] + values[i - 1]).abs() {
                // The top of a parabola through the neighbours.
                let bend = a - 2.0 * s + c;
                let shift = if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-1.0, 1.0) } else { 0.0 };
                found.push((s, middle + radius_of(i as f64 + shift) * direction));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(MOST);
        Some(found.into_iter().map(|f| f.1).collect())
    };
    (0..RAYS).filter_map(edges).collect()
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
