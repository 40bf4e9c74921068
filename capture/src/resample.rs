//! Photographs without distortion, seen straight on, and masks of the sample.

use crate::lens::{Lens, Pose};
use crate::photo::PlanarImage;
use crate::shoot::Shape;
use biscale::numerics::cast::truncate_usize;
use biscale::numerics::convex_hull::convex_hull;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// A picture and which of its pixels are good.
#[derive(Clone, Debug)]
pub struct Masked {
    /// Values; 0 where nothing is known.
    pub picture: PlanarImage,
    /// Whether a pixel comes from inside of the photograph and is not saturated.
    pub good: Vec<bool>,
}

/// Samples `photo` at `source(column, row)` for every pixel of a new picture; `saturated` belongs to `photo`.
fn resample(
    photo: &PlanarImage,
    saturated: &[bool],
    width: usize,
    height: usize,
    source: &(dyn Fn(DVec2) -> Option<DVec2> + Sync),
) -> Masked {
    let any = saturated.par_iter().any(|s| *s);
    let clean = |p: DVec2| {
        if !any {
            return true;
        }
        let (i, j) = (truncate_usize(p.x.round()), truncate_usize(p.y.round()));
        // All pixels that the interpolation may touch.
        let columns = i.saturating_sub(1)..=(i + 1).min(photo.width - 1);
        (j.saturating_sub(1)..=(j + 1).min(photo.height - 1)).all(|j| columns.clone().all(|i| !saturated[j * photo.width + i]))
    };
    let mut out = Masked { picture: PlanarImage::new(width, height), good: vec![false; width * height] };
    let [r, g, b] = &mut out.picture.planes;
    let lines = r.par_chunks_mut(width).zip(g.par_chunks_mut(width)).zip(b.par_chunks_mut(width)).zip(out.good.par_chunks_mut(width));
    lines.enumerate().for_each(|(row, (((r, g), b), good))| {
        for column in 0..width {
            let Some(from) = source(DVec2::new(column as f64, row as f64)) else { continue };
            let Some(value) = photo.sample(from.x, from.y) else { continue };
            [r[column], g[column], b[column]] = value;
            good[column] = clean(from);
        }
    });
    out
}

/// The photograph without its lens's distortion, of the same size and pinhole.
pub fn undistort(photo: PlanarImage, saturated: &[bool], lens: &Lens) -> Masked {
    if !lens.is_distorted() {
        let good = saturated.iter().map(|s| !s).collect();
        return Masked { picture: photo, good };
    }
    resample(&photo, saturated, photo.width, photo.height, &|pixel| Some(lens.pixel(lens.distort(lens.place(pixel)))))
}

/// Angle between normal and view, degrees, from which on a pixel of the sample is not used. Chosen: at 80 degrees a pixel covers six times as much.
const GRAZING_DEG: f64 = 80.0;

/// Which pixels of an undistorted photograph show the sample, `border` px inside of its outline (right, left, up and down of them it is seen, too), not at
/// grazing angles.
pub fn sample_mask(shape: &Shape, pose: &Pose, pinhole: &Lens, border: usize) -> Vec<bool> {
    let eye = pose.eye();
    let back = pose.rotation.transpose();
    let least = GRAZING_DEG.to_radians().cos();
    let sees = |pixel: DVec2| {
        let direction = (back * pinhole.place(pixel).extend(1.0)).normalize();
        shape.hit(eye, direction).is_some_and(|place| -place.normal.dot(direction) > least)
    };
    let (width, height) = (pinhole.width, pinhole.height);
    // Each pixel is looked at once, a border around the picture as well.
    let wide = width + 2 * border;
    let mut seen = vec![false; wide * (height + 2 * border)];
    seen.par_chunks_mut(wide).enumerate().for_each(|(row, line)| {
        for (column, inside) in line.iter_mut().enumerate() {
            *inside = sees(DVec2::new(column as f64 - border as f64, row as f64 - border as f64));
        }
    });
    let mut out = vec![false; width * height];
    out.par_chunks_mut(width).enumerate().for_each(|(row, line)| {
        for (column, inside) in line.iter_mut().enumerate() {
            let at = (row + border) * wide + column + border;
            *inside = seen[at] && seen[at - border] && seen[at + border] && seen[at - border * wide] && seen[at + border * wide];
        }
    });
    out
}

/// A close-up as seen straight on.
#[derive(Clone, Debug)]
pub struct Rectified {
    /// The picture, row 0 at the largest along-coordinate.
    pub masked: Masked,
    /// Size of a pixel, mm.
    pub mm_per_px: f64,
    /// Coordinates of its lower left corner on the sample, mm.
    pub origin: DVec2,
}

/// Most pixels on a side of a rectified picture: what bounds its memory to 430 MB.
const MOST: f64 = 6000.0;

/// The part of the sample that a photograph shows not too obliquely, as seen straight on, with pixels as large as the photograph's own where it looks
/// most directly. `None` if it shows nothing.
pub fn rectify(photo: &PlanarImage, saturated: &[bool], lens: &Lens, pose: &Pose, shape: &Shape) -> Option<Rectified> {
    /// Places along each axis of the photograph that are looked at.
    const STEPS: u32 = 60;
    /// Foreshortening relative to the best place from which on a place belongs to the part that is rectified. Chosen.
    const OBLIQUE: f64 = 0.75;
    /// Cosine between normal and view below which a place has no value, and fewest pixels of a side. Chosen.
    const LEAST_COSINE: f64 = 0.2;
    const LEAST_SIDE: usize = 8;
    let eye = pose.eye();
    let back = pose.rotation.transpose();
    let pinhole = lens.pinhole();
    let mut seen: Vec<(DVec2, f64, f64)> = Vec::new();
    for j in 0..=STEPS {
        for i in 0..=STEPS {
            let at = |k: u32, n: usize| f64::from(k) / f64::from(STEPS) * (n - 1) as f64;
            let Some(ray) = lens.ray(DVec2::new(at(i, lens.width), at(j, lens.height))) else { continue };
            if let Some(place) = shape.hit(eye, back * ray) {
                let view = eye - place.point;
                let facing = place.normal.dot(view.normalize());
                let depth = pose.to_camera(place.point).z;
                seen.push((place.st, facing, depth));
            }
        }
    }
    let best = seen.iter().map(|s| s.1).fold(0.0, f64::max);
    let kept = || seen.iter().filter(|s| s.1 > OBLIQUE * best);
    let (low, high) = kept().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), s| (l.min(s.0), h.max(s.0)));
    let depth = kept().map(|s| s.2).fold(f64::INFINITY, f64::min);
    let size = high - low;
    if !(size.min_element() > 0.0 && depth.is_finite()) {
        return None;
    }
    let mm_per_px = (2.0 * depth / (pinhole.focal.x + pinhole.focal.y)).max(size.max_element() / MOST);
    let (width, height) = (truncate_usize(size.x / mm_per_px), truncate_usize(size.y / mm_per_px));
    if width < LEAST_SIDE || height < LEAST_SIDE {
        return None;
    }
    let source = |pixel: DVec2| {
        let st = low + DVec2::new(pixel.x + 0.5, height as f64 - 0.5 - pixel.y) * mm_per_px;
        let place = shape.at(st, 0.0);
        if (eye - place.point).normalize().dot(place.normal) < LEAST_COSINE {
            return None;
        }
        lens.project(pose.to_camera(place.point))
    };
    Some(Rectified { masked: resample(photo, saturated, width, height, &source), mm_per_px, origin: low })
}

/// Where the lines of a grid on the sample are seen: closed outlines of its border, px of the photograph as it was taken.
pub fn outline(shape: &Shape, pose: &Pose, lens: &Lens) -> Vec<DVec2> {
    const STEPS: u32 = 48;
    let extent = shape.extent();
    let eye = pose.eye();
    let sides = [(DVec2::ZERO, DVec2::X), (DVec2::X, DVec2::ONE), (DVec2::ONE, DVec2::Y), (DVec2::Y, DVec2::ZERO)];
    let mut out = Vec::new();
    for (a, b) in sides {
        for k in 0..STEPS {
            let place = shape.at(a.lerp(b, f64::from(k) / f64::from(STEPS)) * extent, 0.0);
            let faces = place.normal.dot(eye - place.point) > 0.0;
            if let (true, Some(pixel)) = (faces, lens.project(pose.to_camera(place.point))) {
                out.push(pixel);
            }
        }
    }
    if let Shape::Cylinder { radius, height, .. } = *shape {
        // The rims that are seen do not make an outline of their own: the convex hull of both does.
        let rim = (0..180).flat_map(|k| {
            let (sin, cos) = (f64::from(k) * 2.0).to_radians().sin_cos();
            [-0.5, 0.5].map(|z| DVec3::new(radius * cos, radius * sin, z * height))
        });
        out = convex_hull(rim.filter_map(|p| lens.project(pose.to_camera(p))).collect());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens() -> Lens {
        Lens {
            width: 300,
            height: 200,
            focal: DVec2::splat(400.0),
            centre: DVec2::new(148.0, 103.0),
            distortion: [-0.15, 0.03, 1e-3, -5e-4, 0.0],
        }
    }

    /// A photograph of a function of the sample's coordinates.
    fn photograph(lens: &Lens, pose: &Pose, shape: &Shape, value: impl Fn(DVec2) -> f64) -> PlanarImage {
        let mut picture = PlanarImage::new(lens.width, lens.height);
        for i in 0..lens.width * lens.height {
            let pixel = DVec2::new((i % lens.width) as f64, (i / lens.width) as f64);
            let ray = pose.rotation.transpose() * lens.ray(pixel).unwrap();
            let v = shape.hit(pose.eye(), ray).map_or(0.0, |p| value(p.st));
            picture.planes.iter_mut().for_each(|plane| plane[i] = v as f32);
        }
        picture
    }

    #[test]
    fn rectified_pictures_show_the_sample_in_mm() {
        let wave = |st: DVec2| 0.5 + 0.3 * (st.x / 3.0).sin() * (st.y / 4.0).cos();
        for (shape, pose) in [
            (Shape::Plane(DVec2::new(60.0, 50.0)), Pose::looking_at(DVec3::new(10.0, -20.0, 100.0), DVec3::ZERO, DVec3::Y)),
            (
                Shape::Cylinder { radius: 20.0, height: 70.0, arc_deg: [0.0, 360.0] },
                Pose::looking_at(DVec3::new(70.0, 70.0, 10.0), DVec3::ZERO, DVec3::Z),
            ),
        ] {
            let picture = photograph(&lens(), &pose, &shape, wave);
            let saturated = vec![false; picture.planes[0].len()];
            let rectified = rectify(&picture, &saturated, &lens(), &pose, &shape).unwrap();
            let (image, mm) = (&rectified.masked.picture, rectified.mm_per_px);
            let mut worst = 0.0_f64;
            for (i, good) in rectified.masked.good.iter().enumerate().filter(|g| *g.1) {
                let _ = good;
                let (column, row) = (i % image.width, i / image.width);
                let st = rectified.origin + mm * DVec2::new(column as f64 + 0.5, image.height as f64 - 0.5 - row as f64);
                // Beside the border, where the photograph goes over into black.
                let e = shape.extent();
                if st.min(e - st).min_element() > 1.5 {
                    worst = worst.max((f64::from(image.planes[0][i]) - wave(st)).abs());
                }
            }
            assert!(worst < 0.01, "{shape:?}: {worst}");
            assert!(rectified.masked.good.iter().filter(|g| **g).count() > image.planes[0].len() / 2);
        }
    }

    #[test]
    fn undistorted_photographs_are_those_of_a_pinhole() {
        let shape = Shape::Plane(DVec2::new(200.0, 200.0));
        let pose = Pose::looking_at(DVec3::new(0.0, -20.0, 100.0), DVec3::ZERO, DVec3::Y);
        let wave = |st: DVec2| 0.5 + 0.3 * (st.x / 4.0).sin() * (st.y / 4.0).cos();
        let picture = photograph(&lens(), &pose, &shape, wave);
        let truth = photograph(&lens().pinhole(), &pose, &shape, wave);
        let mut saturated = vec![false; picture.planes[0].len()];
        saturated[100 * 300 + 150] = true;
        let out = undistort(picture, &saturated, &lens());
        let good = || out.good.iter().enumerate().filter(|g| *g.1).map(|g| g.0);
        let worst = good().map(|i| (out.picture.planes[1][i] - truth.planes[1][i]).abs()).fold(0.0, f32::max);
        assert!(worst < 0.01, "{worst}");
        let bad = out.good.len() - good().count();
        assert!(bad >= 4 && !out.good[100 * 300 + 150], "{bad}");
    }

    #[test]
    fn masks_hold_the_sample_and_not_its_rim() {
        let shape = Shape::Cylinder { radius: 15.0, height: 40.0, arc_deg: [0.0, 360.0] };
        let pose = Pose::looking_at(DVec3::new(100.0, 0.0, 0.0), DVec3::ZERO, DVec3::Z);
        let pinhole = lens().pinhole();
        let mask = sample_mask(&shape, &pose, &pinhole, 2);
        let row: Vec<usize> = (0..300).filter(|&c| mask[103 * 300 + c]).collect();
        // The silhouette is at 400 * 15 / sqrt(100^2 - 15^2) = 60.7 px; 80 degrees to the view are seen a little inside of it.
        let half = (row[row.len() - 1] - row[0]) as f64 / 2.0;
        assert!(half > 55.0 && half < 60.0, "{half}");
        assert!(outline(&shape, &pose, &pinhole).len() > 20);
    }
}
