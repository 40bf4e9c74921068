//! A pose from the edges of markers: the last step, where corners are few and biased.
//!
//! A corner that is found by its gradients is off by some tenths of a pixel where the surface is bent or seen obliquely, and the tone curve that detection
//! works with moves the edges of dark squares inwards. Along the sides of the markers there are many more places to look at. Across each, the linear
//! light `v` goes from dark to light at
//!
//! ```text
//! s = reach - ∫ (v - dark) / (light - dark) ds,      -reach to reach
//! ```
//!
//! whatever the blur, as long as that is symmetric. The pose is fitted to the distances between these places and where the sides should be seen, on the
//! surface as it is: sides of markers on a cylinder are bent as they are.

use crate::edges::GreyImage;
use crate::lens::{Lens, Pose};
use crate::pose::{PoseEstimate, Sighting, UNKNOWNS, moved, rms};
use biscale::numerics::cast::truncate_usize;
use biscale::numerics::least_squares::{LeastSquaresParams, minimise};
use biscale::numerics::statistics::upper_median;
use glam::{DVec2, DVec3};

/// Where and how sides of markers are measured. All values are chosen, not measured; the test below holds the result to 0.03 degrees and 0.03 mm.
struct EdgeParams {
    /// Least and largest distance from a side to which the light is looked at, px: the blur of an edge must fit into the least, and the largest keeps other
    /// things out.
    reach_px: [f64; 2],
    /// The same distance in cells of the marker: its border is one wide, and so is the white around it.
    reach_cells: f64,
    /// Step across a side, px.
    step_px: f64,
    /// Places on a side, at most.
    places: f64,
    /// Least step of light over a side, of the lighter one.
    least_contrast: f64,
    /// Cosine between normal and view below which an edge is left out (75 degrees).
    least_cosine: f64,
    /// Fewest edge points that are better than corners.
    fewest: usize,
    /// Rounds; after the first one the profiles are taken at better places.
    rounds: usize,
    /// Edge points farther off than this many medians are left out, and never those below the second value, px.
    outliers: (f64, f64),
    /// The result is kept if the corners' RMS is at most this many times that of the start, and so many pixels more.
    accepted_rms: (f64, f64),
    /// Typical change of an unknown, rad and distances: for the derivatives.
    change: f64,
    /// Part of a profile's samples whose mean is the dark or the light side: one over this, ...
    end_part: usize,
    /// ... but so many samples at least.
    least_end: usize,
    /// Distance of an edge from where it is expected, over the reach, beyond which it is another edge.
    most_off: f64,
}

const PARAMS: EdgeParams = EdgeParams {
    reach_px: [2.0, 6.0],
    reach_cells: 0.8,
    step_px: 0.25,
    places: 24.0,
    least_contrast: 0.2,
    least_cosine: 0.25,
    fewest: 40,
    rounds: 3,
    outliers: (5.0, 0.2),
    accepted_rms: (1.5, 0.5),
    change: 0.1,
    end_part: 5,
    least_end: 2,
    most_off: 0.5,
};

/// A place of an edge: the point of the sample, where it is seen, and the direction across.
struct Edge {
    point: DVec3,
    pixel: DVec2,
    across: DVec2,
}

/// Markers as they are printed.
#[derive(Clone, Copy)]
pub struct PrintedMarkers<'a> {
    /// Corners of each on the print, in order around it.
    pub corners: &'a [[DVec2; 4]],
    /// Cells of a side, with the black border.
    pub cells: f64,
    /// Takes a point of the print to the sample's frame, with its outward normal.
    pub place: &'a dyn Fn(DVec2) -> (DVec3, DVec3),
}

/// Improves a pose by the sides of markers.
///
/// Returns `start` itself where too few sides are seen well, or what they say does not hold together. `rms_px` is that of `corners` for the new pose.
pub fn refine(
    start: &PoseEstimate,
    corners: &[Sighting],
    lens: &Lens,
    image: &impl GreyImage,
    markers: &PrintedMarkers<'_>,
) -> PoseEstimate {
    let mut best = start.clone();
    for _ in 0..PARAMS.rounds {
        let edges: Vec<Edge> = markers.corners.iter().flat_map(|m| edges_of_marker(m, &best.pose, lens, image, markers)).collect();
        let Some(found) = fit(&best.pose, edges, lens) else { return start.clone() };
        best = PoseEstimate { used: best.used, ..found };
    }
    let used: Vec<Sighting> = corners.iter().zip(&start.used).filter(|(_, u)| **u).map(|(s, _)| *s).collect();
    best.rms_px = rms(&best.pose, &used, lens);
    // Edges of something else would take the pose away from the corners.
    if best.rms_px < PARAMS.accepted_rms.0 * start.rms_px + PARAMS.accepted_rms.1 { best } else { start.clone() }
}

/// Edge points along the four sides of a marker.
fn edges_of_marker(
    corners: &[DVec2; 4],
    pose: &Pose,
    lens: &Lens,
    image: &impl GreyImage,
    &PrintedMarkers { cells, place, .. }: &PrintedMarkers<'_>,
) -> Vec<Edge> {
    let middle = corners.iter().sum::<DVec2>() / 4.0;
    let eye = pose.eye();
    let seen = |p: DVec2| {
        let (point, normal) = place(p);
        let facing = normal.dot((eye - point).normalize());
        lens.project(pose.to_camera(point)).filter(|_| facing > PARAMS.least_cosine).map(|pixel| (point, pixel))
    };
    let mut out = Vec::new();
    for k in 0..4 {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        let cell = a.distance(b) / cells;
        let outwards = (0.5 * (a + b) - middle).normalize();
        let (Some(from), Some(to)) = (seen(a), seen(b)) else { continue };
        let count = from.1.distance(to.1).min(PARAMS.places).floor();
        for i in 0..count as u32 {
            // Not within a cell of the corners.
            let t = 1.0 / cells + (1.0 - 2.0 / cells) * (f64::from(i) + 0.5) / count;
            let at = a.lerp(b, t);
            let Some((point, pixel)) = seen(at) else { continue };
            // Finite differences over a tenth of a cell.
            let (Some(next), Some(out_there)) = (seen(at + 0.1 * (b - a) / cells), seen(at + 0.1 * cell * outwards)) else { continue };
            let along = (next.1 - pixel).normalize_or_zero();
            let step = out_there.1 - pixel;
            let across = if along.perp().dot(step) < 0.0 { -along.perp() } else { along.perp() };
            let reach = (PARAMS.reach_cells * 10.0 * across.dot(step)).min(PARAMS.reach_px[1]);
            if reach >= PARAMS.reach_px[0]
                && let Some(off) = crossing(image, pixel, across, reach)
            {
                out.push(Edge { point, pixel: pixel + off * across, across });
            }
        }
    }
    out
}

/// How far from a place, along a direction, dark goes over into light.
fn crossing(image: &impl GreyImage, at: DVec2, across: DVec2, reach: f64) -> Option<f64> {
    let count = truncate_usize(2.0 * reach / PARAMS.step_px);
    let step = 2.0 * reach / count as f64;
    let values: Vec<f64> = (0..count).map(|k| image.value(at + ((k as f64 + 0.5) * step - reach) * across)).collect::<Option<_>>()?;
    let end = (count / PARAMS.end_part).max(PARAMS.least_end);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (dark, light) = (mean(&values[..end]), mean(&values[count - end..]));
    if !(light - dark > PARAMS.least_contrast * light) {
        return None;
    }
    let off = reach - values.iter().map(|v| (v - dark) / (light - dark) * step).sum::<f64>();
    (off.abs() < PARAMS.most_off * reach).then_some(off)
}

/// The pose that explains edges best. `rms_px` is that of the distances from the edges, and nothing is in `used`.
fn fit(start: &Pose, mut edges: Vec<Edge>, lens: &Lens) -> Option<PoseEstimate> {
    let scale = start.translation.length().max(1.0);
    let of = |p: &[f64]| moved(start, scale, p);
    let residuals = |pose: &Pose, edges: &[Edge]| -> Vec<f64> {
        edges.iter().map(|e| lens.project(pose.to_camera(e.point)).map_or(f64::NAN, |p| (p - e.pixel).dot(e.across))).collect()
    };
    for last in [false, true] {
        if edges.len() < PARAMS.fewest {
            return None;
        }
        let fit = minimise(&[0.0; UNKNOWNS], &[PARAMS.change; UNKNOWNS], &|p| residuals(&of(p), &edges), LeastSquaresParams::default())
            .finite()?;
        let pose = of(&fit.parameters);
        if last {
            let variance = fit.cost / (edges.len() - UNKNOWNS) as f64;
            let covariance = fit.covariance?;
            let sigma = |k: usize| (variance * covariance[k * (UNKNOWNS + 1)]).sqrt();
            return Some(PoseEstimate {
                pose,
                sigma_turn: DVec3::new(sigma(0), sigma(1), sigma(2)),
                sigma_shift: scale * DVec3::new(sigma(3), sigma(4), sigma(5)),
                rms_px: (fit.cost / edges.len() as f64).sqrt(),
                used: Vec::new(),
                outcome: fit.outcome,
            });
        }
        // What lies far off is no side of a marker.
        let off: Vec<f64> = residuals(&pose, &edges).iter().map(|r| r.abs()).collect();
        let mut sorted = off.clone();
        let limit = (PARAMS.outliers.0 * upper_median(&mut sorted)?).max(PARAMS.outliers.1);
        let mut keep = off.iter().map(|o| *o <= limit);
        edges.retain(|_| keep.next() == Some(true));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens {
        width: 900,
        height: 640,
        focal: DVec2::new(1150.0, 1148.0),
        centre: DVec2::new(455.0, 314.0),
        distortion: [-0.14, 0.06, 1e-3, -7e-4, 0.0],
    };
    const RADIUS: f64 = 30.0;

    /// Black squares of 14 mm on a white cylinder, every 20 mm around and along, each pixel the mean of what it sees.
    struct Print(Pose);

    impl Print {
        fn markers() -> Vec<[DVec2; 4]> {
            let low = (0..9).flat_map(|i| (0..3).map(move |j| DVec2::new(20.0 * f64::from(i), 20.0 * f64::from(j) - 27.0)));
            low.map(|l| [(0.0, 14.0), (14.0, 14.0), (14.0, 0.0), (0.0, 0.0)].map(|d| l + DVec2::from(d))).collect()
        }
        fn place(p: DVec2) -> (DVec3, DVec3) {
            let (sin, cos) = (p.x / RADIUS).sin_cos();
            let normal = DVec3::new(cos, sin, 0.0);
            (RADIUS * normal + p.y * DVec3::Z, normal)
        }
    }

    impl GreyImage for Print {
        fn value(&self, p: DVec2) -> Option<f64> {
            let shape = crate::shoot::Shape::Cylinder { radius: RADIUS, height: 80.0, arc_deg: [0.0, 360.0] };
            let eye = self.0.eye();
            let sample = |dx: i32, dy: i32| {
                let d = DVec2::new(f64::from(dx), f64::from(dy)) / 4.0;
                let Some(hit) = LENS.ray(p + d).and_then(|ray| shape.hit(eye, self.0.rotation.transpose() * ray)) else { return 0.3 };
                let (x, y) = (RADIUS * hit.point.y.atan2(hit.point.x).rem_euclid(std::f64::consts::TAU), hit.point.z + 27.0);
                let inside = x < 180.0 && x.rem_euclid(20.0) < 14.0 && (0.0..60.0).contains(&y) && y.rem_euclid(20.0) < 14.0;
                if inside { 0.04 } else { 0.8 }
            };
            Some((-3..=3).flat_map(|dx| (-3..=3).map(move |dy| (dx, dy))).map(|(dx, dy)| sample(dx, dy)).sum::<f64>() / 49.0)
        }
    }

    #[test]
    fn a_pose_around_a_cylinder_is_improved_to_hundredths_of_a_degree() {
        let truth = Pose::looking_at(DVec3::new(120.0, 190.0, 40.0), DVec3::ZERO, DVec3::Z);
        let rough = truth.moved(DVec3::new(0.003, -0.004, 0.003), DVec3::new(0.1, -0.1, 0.3));
        let start = PoseEstimate { rms_px: 2.0, ..PoseEstimate::given(rough) };
        let corners = Print::markers();
        let markers = PrintedMarkers { corners: &corners, cells: 7.0, place: &Print::place };
        let found = refine(&start, &[], &LENS, &Print(truth), &markers);
        // Without corners there is nothing to compare with: the pose is kept only if it can be judged.
        assert_eq!(found.pose, start.pose);
        let corners: Vec<Sighting> = Print::markers()
            .iter()
            .flatten()
            .filter_map(|&c| {
                let (point, normal) = Print::place(c);
                let seen = normal.dot(truth.eye() - point) > 0.0;
                seen.then(|| Sighting { point, pixel: LENS.project(truth.to_camera(point)).unwrap() })
            })
            .collect();
        let start = PoseEstimate { used: vec![true; corners.len()], ..start };
        let found = refine(&start, &corners, &LENS, &Print(truth), &markers);
        let (turn, shift) = (found.pose.angle_to(&truth).to_degrees(), found.pose.translation.distance(truth.translation));
        assert!(turn < 0.03 && shift < 0.03 && found.rms_px < 0.1, "{turn} degrees, {shift} mm, {} px", found.rms_px);
        assert!(rough.angle_to(&truth).to_degrees() > 0.3, "the start was off");
    }
}
