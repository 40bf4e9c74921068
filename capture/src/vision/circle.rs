//! A mirror ball in a photograph.

use super::image::{GreyImage8, failed, whole};
use crate::edges::GreyImage;
use crate::photo::PlanarImage;
use biscale::error::Result;
use biscale::numerics::cast::{truncate_i32, truncate_usize};
use biscale::numerics::statistics::upper_median;
use glam::DVec2;
use opencv::core::{Mat, Rect, Size, Vec3f, Vector};
use std::collections::BTreeSet;

/// How balls and highlights are sought. Chosen, not measured; `capture/tests/lights.rs` holds the directions that come of it.
struct CircleParams {
    /// A highlight stands out from all but this share of a picture.
    spot_share: f64,
    /// Light of a spot, of the brightest pixel's.
    spot_level: f32,
    /// Most spots that are looked at.
    spots: usize,
    /// Radius of a circle in a piece, px, and by how much it may differ.
    radius_px: f64,
    range: f64,
    /// Side of a piece, in radii of the circle.
    side: f64,
    /// Smallest ball: over the radius of the highlight, and in px.
    smallest: (f64, f64),
    /// Circles that are taken of each piece.
    of_each: usize,
    /// Place of a highlight from the middle, in radii, at most: farther out it is no mirror image of a lamp above.
    inside: f64,
    /// `OpenCV`'s Hough transform: accumulator's pixel, least distance of circles, px, threshold of edges, votes.
    hough: [f64; 4],
    /// Step along a ray over the radius (one over this), and its range, px.
    step: (f64, [f64; 2]),
    /// Part of the radius from which on the rim is sought, and over which.
    ring: [f64; 2],
    /// Change of the light over a step that counts, of its level.
    least_change: f64,
    /// Edges along a ray that are kept, the strongest.
    edges: usize,
    /// Step at which a highlight is sampled over the radius (one over this), at least half a pixel.
    highlight_step: f64,
    /// Light of a highlight over the ball's median, at least.
    highlight: f64,
    /// Distance from the highlight's middle within which it lies, in radii.
    highlight_reach: f64,
    /// Rounds of moving to the middle.
    rounds: usize,
}

const PARAMS: CircleParams = CircleParams {
    spot_share: 0.005,
    spot_level: 0.6,
    spots: 6,
    radius_px: 60.0,
    range: 1.3,
    side: 4.4,
    smallest: (4.0, 10.0),
    of_each: 4,
    inside: 0.97,
    hough: [1.5, 8.0, 80.0, 12.0],
    step: (120.0, [0.5, 3.0]),
    ring: [0.75, 0.5],
    least_change: 0.02,
    edges: 6,
    highlight_step: 300.0,
    highlight: 3.0,
    highlight_reach: 0.2,
    rounds: 5,
};

/// Small bright spots, as the lamp makes on a mirror ball: middle and radius, px, the largest first. None if bright things are no exception in the picture.
pub fn spots(picture: &PlanarImage) -> Vec<(DVec2, f64)> {
    let [r, g, b] = &picture.planes;
    let light = |i: usize| 0.25 * r[i] + 0.5 * g[i] + 0.25 * b[i];
    let top = (0..r.len()).map(light).fold(0.0_f32, f32::max);
    let bright: Vec<usize> = (0..r.len()).filter(|&i| light(i) > PARAMS.spot_level * top).collect();
    if bright.len() as f64 > PARAMS.spot_share * r.len() as f64 {
        return Vec::new();
    }
    let mut left: BTreeSet<usize> = bright.into_iter().collect();
    let mut found = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut todo, mut sum, mut count) = (vec![first], DVec2::ZERO, 0_u32);
        while let Some(i) = todo.pop() {
            let (x, y) = (i % picture.width, i / picture.width);
            (sum, count) = (sum + DVec2::new(x as f64, y as f64), count + 1);
            for j in y.saturating_sub(1)..=(y + 1).min(picture.height - 1) {
                for i in x.saturating_sub(1)..=(x + 1).min(picture.width - 1) {
                    if left.remove(&(j * picture.width + i)) {
                        todo.push(j * picture.width + i);
                    }
                }
            }
        }
        found.push((sum / f64::from(count), (f64::from(count) / std::f64::consts::PI).sqrt()));
    }
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.truncate(PARAMS.spots);
    found
}

/// Circles around a spot that may be balls, the likeliest of each size first: middle and radius, px.
///
/// Looked for in pieces of the picture of several sizes, each brought to the same size: print elsewhere in the picture has more and stronger edges than a ball.
///
/// # Errors
/// What `OpenCV` says.
pub fn around(grey: &GreyImage8, spot: DVec2, size: f64) -> Result<Vec<[f64; 3]>> {
    let what = "looking for a ball";
    let mat = grey.mat()?;
    let most = 0.5 * grey.width.min(grey.height) as f64;
    let mut radius = (PARAMS.smallest.0 * size).max(PARAMS.smallest.1);
    let mut out = Vec::new();
    while radius < most {
        let low = (spot - 0.5 * PARAMS.side * radius).max(DVec2::ZERO).floor();
        let high = (spot + 0.5 * PARAMS.side * radius).min(DVec2::new(grey.width as f64, grey.height as f64)).ceil();
        let extent = high - low;
        let window = Rect::new(truncate_i32(low.x), truncate_i32(low.y), truncate_i32(extent.x), truncate_i32(extent.y));
        let piece = Mat::roi(&mat, window).map_err(failed(what))?;
        let factor = radius / PARAMS.radius_px;
        let mut small = Mat::default();
        let size = Size::new(whole(extent.x / factor), whole(extent.y / factor));
        let method = if factor > 1.0 { opencv::imgproc::INTER_AREA } else { opencv::imgproc::INTER_LINEAR };
        opencv::imgproc::resize(&piece, &mut small, size, 0.0, 0.0, method).map_err(failed(what))?;
        let mut circles: Vector<Vec3f> = Vector::new();
        let [pixel, apart, edge, votes] = PARAMS.hough;
        let (least, largest) = (whole(PARAMS.radius_px / PARAMS.range), whole(PARAMS.radius_px * PARAMS.range));
        opencv::imgproc::hough_circles(&small, &mut circles, opencv::imgproc::HOUGH_GRADIENT, pixel, apart, edge, votes, least, largest)
            .map_err(failed(what))?;
        let scale = extent / DVec2::new(f64::from(size.width), f64::from(size.height));
        let full = circles.iter().map(|c| {
            let middle = low + (DVec2::new(c[0].into(), c[1].into()) + 0.5) * scale - 0.5;
            [middle.x, middle.y, f64::from(c[2]) * scale.x]
        });
        out.extend(full.filter(|c| spot.distance(DVec2::new(c[0], c[1])) < PARAMS.inside * c[2]).take(PARAMS.of_each));
        radius *= PARAMS.range;
    }
    Ok(out)
}

/// Rays that the rim of a ball is looked for along.
pub const RAYS: u32 = 180;

/// Places that may be the outline near a circle: along rays from its middle, where the light changes, the strongest few.
pub fn outline(image: &impl GreyImage, [x, y, radius]: [f64; 3]) -> Vec<Vec<DVec2>> {
    let middle = DVec2::new(x, y);
    let step = (radius / PARAMS.step.0).clamp(PARAMS.step.1[0], PARAMS.step.1[1]);
    let edges = |k: u32| -> Option<Vec<DVec2>> {
        let direction = DVec2::from_angle(f64::from(k) / f64::from(RAYS) * std::f64::consts::TAU);
        // A little along the rim, too, against noise.
        let side = 1.5 * step * direction.perp();
        let value = |r: f64| -> Option<f64> {
            let p = middle + r * direction;
            Some((image.value(p - side)? + image.value(p)? + image.value(p + side)?) / 3.0)
        };
        let count = truncate_usize(PARAMS.ring[1] * radius / step);
        let radius_of = |i: f64| PARAMS.ring[0] * radius + i * step;
        let values: Vec<f64> = (0..count).map(|i| value(radius_of(i as f64))).collect::<Option<_>>()?;
        let slope = |i: usize| (values[i + 1] - values[i - 1]).abs();
        let mut found: Vec<(f64, DVec2)> = Vec::new();
        for i in 2..count.saturating_sub(2) {
            let (a, s, c) = (slope(i - 1), slope(i), slope(i + 1));
            if s >= a && s > c && s > PARAMS.least_change * (values[i + 1] + values[i - 1]).abs() {
                // The top of a parabola through the neighbours.
                let bend = a - 2.0 * s + c;
                let shift = if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-1.0, 1.0) } else { 0.0 };
                found.push((s, middle + radius_of(i as f64 + shift) * direction));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.truncate(PARAMS.edges);
        Some(found.into_iter().map(|f| f.1).collect())
    };
    (0..RAYS).filter_map(edges).collect()
}

/// The middle of the brightest spot within a circle and its radius, px; `None` if nothing stands out.
pub fn highlight(image: &impl GreyImage, [x, y, radius]: [f64; 3]) -> Option<(DVec2, f64)> {
    let middle = DVec2::new(x, y);
    let reach = PARAMS.inside * radius;
    let step = (radius / PARAMS.highlight_step).max(0.5);
    let n = truncate_i32(reach / step);
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
    let median = upper_median(&mut sorted)?;
    if !(top.1 > PARAMS.highlight * median.max(1e-9)) {
        return None;
    }
    // What is over half of the way up, near the top: reflections of anything else lie elsewhere.
    let level = 0.5 * (top.1 + median);
    let mut centre = top.0;
    for _ in 0..PARAMS.rounds {
        let near = values.iter().filter(|v| v.1 > level && v.0.distance(centre) < PARAMS.highlight_reach * radius);
        let (sum, count) = near.fold((DVec2::ZERO, 0_u32), |(s, n), v| (s + v.0, n + 1));
        centre = sum / f64::from(count.max(1));
    }
    let count = values.iter().filter(|v| v.1 > level && v.0.distance(centre) < PARAMS.highlight_reach * radius).count() as f64;
    Some((centre, (count * step * step / std::f64::consts::PI).sqrt()))
}
