//! The direction of a light: from a mirror ball, from the shadow of a stick, or given; several sources are put together.

use biscale::numerics::linear_algebra;
use glam::{DVec2, DVec3};

/// One estimate of a direction, in any frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionEstimate {
    /// Unit vector towards the light.
    pub direction: DVec3,
    /// Standard deviation, rad.
    pub sigma: f64,
}

/// A ball as a camera sees it: the cone of rays that touch it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallOutline {
    /// Unit direction of its middle.
    pub axis: DVec3,
    /// Half of its angular size, rad.
    pub half_angle: f64,
    /// RMS of the touching rays' angles, rad.
    pub rms: f64,
    /// Rays that it was fitted to.
    pub rays: usize,
}

/// How a ball's rim is told from other edges. Chosen, not measured; the tests below and of `capture/tests/lights.rs` hold the directions to what they need.
struct OutlineParams {
    /// Fewest directions around the ball that must agree on a cone; three determine it.
    fewest: usize,
    /// Rounds of fitting a cone to the rays that agree with it; it settles in two or three.
    rounds: usize,
    /// Agreement over the best from which on a cone counts as nearly as good.
    nearly: f64,
    /// Least standard deviation of a ray, rad: a two-hundredth of a pixel at a focal length of 5000.
    least_sigma: f64,
    /// Step of the numeric derivatives over the half angle.
    step: f64,
    /// Largest standard deviation that is stated, rad: about a quarter turn says that nothing is known.
    most_sigma: f64,
}

const OUTLINE: OutlineParams = OutlineParams { fewest: 8, rounds: 4, nearly: 0.8, least_sigma: 1e-6, step: 1e-3, most_sigma: 1.5 };

/// How the tip of a shadow is sought. Chosen, not measured.
struct ShadowParams {
    /// Light relative to paper below which a place is in the shadow: between the dark of a shadow and print.
    dark: f64,
    /// Directions this near to the stick itself are left out, degrees.
    beside_stick_deg: f64,
    /// Directions that are looked along: half a degree each.
    rays: u32,
    /// Steps from the foot at which that begins: the foot itself is dark.
    first: f64,
    /// Lighter samples in a row that end a shadow; fewer are noise, or print.
    missed: u32,
    /// Fewest steps of a shadow.
    shortest: f64,
    /// Length over the longest from which on a ray reaches the end of the shadow.
    reaches: f64,
}

const SHADOW: ShadowParams =
    ShadowParams { dark: 0.6, beside_stick_deg: 12.0, rays: 720, first: 6.0, missed: 4, shortest: 4.0, reaches: 0.93 };

/// Fits the cone of rays that touch a ball: `d . a = 1` for `a = axis / cos(half angle)`, which is linear.
///
/// The outline of a ball in a picture is no circle, but the rays are always a cone. A ball mirrors what is right behind its rim, so the rim is faint, and
/// other edges (what it mirrors, its shadow, print) are strong: `edges` holds, for each direction around the ball, the rays of all edges that may be its rim.
/// Three far apart give a cone; the one that most directions agree with to `tolerance`, rad (the largest of nearly equal ones), is refined by those. `None` if fewer than 8 agree, or
/// the rays are of no cone.
pub fn ball_outline(edges: &[Vec<DVec3>], tolerance: f64) -> Option<BallOutline> {
    let edges: Vec<&Vec<DVec3>> = edges.iter().filter(|e| !e.is_empty()).collect();
    if edges.len() < OUTLINE.fewest {
        return None;
    }
    let cone = |rays: &[DVec3]| {
        let rows: Vec<Vec<f64>> = rays.iter().map(|d| d.to_array().to_vec()).collect();
        let a = linear_algebra::least_squares(&rows, &vec![1.0; rows.len()])?;
        let a = DVec3::new(a[0], a[1], a[2]);
        let length = a.length();
        (length > 1.0 && length.is_finite()).then(|| (a / length, (1.0 / length).acos()))
    };
    let off = |(axis, half_angle): (DVec3, f64), d: &DVec3| (axis.angle_between(*d) - half_angle).abs();
    // Of each direction the edge that is nearest to a cone, if it is near.
    let agreeing = |c: (DVec3, f64)| -> Vec<DVec3> {
        let nearest = edges.iter().filter_map(|e| e.iter().min_by(|a, b| off(c, a).total_cmp(&off(c, b))));
        nearest.filter(|d| off(c, d) <= tolerance).copied().collect()
    };
    // The same count by cosines, which is quicker.
    let count = |(axis, half_angle): (DVec3, f64)| {
        let (sin, cos) = half_angle.sin_cos();
        edges.iter().filter(|e| e.iter().any(|d| (axis.dot(*d) - cos).abs() <= tolerance * sin)).count()
    };
    let third = edges.len() / 3;
    let mut cones: Vec<(usize, (DVec3, f64))> = Vec::new();
    for k in 0..third {
        for a in edges[k] {
            for b in edges[k + third] {
                for c in edges[k + 2 * third] {
                    let Some(found) = cone(&[*a, *b, *c]) else { continue };
                    cones.push((count(found), found));
                }
            }
        }
    }
    // What the ball mirrors lies inside of its rim and looks much like one: of cones that agree with nearly as many directions, the largest.
    let most = cones.iter().map(|c| c.0).max()?;
    let nearly = cones.iter().filter(|c| c.0 as f64 >= OUTLINE.nearly * most as f64);
    let mut found = nearly.max_by(|a, b| a.1.1.total_cmp(&b.1.1))?.1;
    let mut used = Vec::new();
    for _ in 0..OUTLINE.rounds {
        used = agreeing(found);
        if used.len() < OUTLINE.fewest {
            return None;
        }
        found = cone(&used)?;
    }
    let rms = (used.iter().map(|d| off(found, d).powi(2)).sum::<f64>() / used.len() as f64).sqrt();
    Some(BallOutline { axis: found.0, half_angle: found.1, rms, rays: used.len() })
}

/// The light that makes a highlight on a mirror ball: `l = 2 (n . v) n - v` with the ball's normal `n` where the highlight is seen.
///
/// Rays are unit vectors in the camera's frame; so is the answer. `ray_sigma` is the standard deviation of the highlight's ray, rad. The ball's size does not
/// matter: distances count in its radii. `None` if the highlight's ray misses the ball.
pub fn mirror_ball(outline: &BallOutline, highlight: DVec3, ray_sigma: f64) -> Option<DirectionEstimate> {
    let direction = |axis: DVec3, half_angle: f64, ray: DVec3| {
        let distance = 1.0 / half_angle.sin();
        let middle = distance * axis;
        let along = ray.dot(middle);
        let root = along * along - (distance * distance - 1.0);
        (root > 0.0).then(|| {
            let normal = ((along - root.sqrt()) * ray - middle).normalize();
            let view = -ray;
            (2.0 * normal.dot(view) * normal - view).normalize()
        })
    };
    let l = direction(outline.axis, outline.half_angle, highlight)?;
    // What a step of each unknown does, two across the axis, one in size, two of the highlight.
    let across = outline.axis.any_orthonormal_pair();
    let fit_sigma = outline.rms.max(OUTLINE.least_sigma) / (outline.rays as f64 / 3.0).sqrt();
    let h = OUTLINE.step * outline.half_angle;
    let mut variance = 0.0;
    let mut add = |changed: Option<DVec3>, sigma: f64| {
        // A highlight at the very rim is not determined: a quarter turn stands for that.
        variance += changed.map_or(1.0, |c| (c.angle_between(l) / h * sigma).powi(2));
    };
    for step in [across.0, across.1] {
        add(direction((outline.axis + h * step).normalize(), outline.half_angle, highlight), fit_sigma);
        add(direction(outline.axis, outline.half_angle, (highlight + h * step).normalize()), ray_sigma);
    }
    add(direction(outline.axis, outline.half_angle - h, highlight), fit_sigma);
    Some(DirectionEstimate { direction: l, sigma: variance.sqrt().min(OUTLINE.most_sigma) })
}

/// The light that throws the shadow of a stick's tip: both in the sample's frame, mm; `sigma_mm` is the standard deviation of the shadow's and of the tip's place.
pub fn stick(tip: DVec3, shadow: DVec3, sigma_mm: f64) -> Option<DirectionEstimate> {
    let to = tip - shadow;
    let length = to.length();
    // Across the direction, tip and shadow err by as much each.
    (length > 1e-6 && to.z > 0.0).then(|| DirectionEstimate {
        direction: to / length,
        sigma: (std::f64::consts::SQRT_2 * sigma_mm / length).min(OUTLINE.most_sigma),
    })
}

/// Several estimates put together by their weights, and the largest angle between two of them, rad. `None` without any.
pub fn combine(estimates: &[DirectionEstimate]) -> Option<(DirectionEstimate, f64)> {
    let weight = |e: &DirectionEstimate| 1.0 / e.sigma.max(OUTLINE.least_sigma).powi(2);
    let sum: DVec3 = estimates.iter().map(|e| weight(e) * e.direction).sum();
    let total: f64 = estimates.iter().map(weight).sum();
    let direction = sum.try_normalize()?;
    let mut apart = 0.0_f64;
    for (i, a) in estimates.iter().enumerate() {
        for b in &estimates[..i] {
            apart = apart.max(a.direction.angle_between(b.direction));
        }
    }
    // Where they disagree by more than they say, the disagreement is the better measure.
    let sigma = total.sqrt().recip().max(0.5 * apart);
    Some((DirectionEstimate { direction, sigma }, apart))
}

/// Where a ray from `eye` meets the plane `z = height`.
pub fn on_plane(eye: DVec3, direction: DVec3, height: f64) -> Option<DVec3> {
    let t = (height - eye.z) / direction.z;
    (t > 0.0 && t.is_finite()).then(|| eye + t * direction)
}

/// The tip of the shadow that a stick throws, in a plane around its foot: `light_at(place)` is the light at a place, relative to paper in the light.
///
/// Looks along rays from the foot, in steps of `step` to `reach`, mm, for the longest dark line that is not the stick itself as the camera sees it: directions
/// near to `stick_itself` are left out. `None` if no line is dark, or the longest one
/// leaves the picture, where `light_at` is `None`.
pub fn shadow_tip(foot: DVec2, stick_itself: DVec2, reach: f64, step: f64, light_at: &dyn Fn(DVec2) -> Option<f64>) -> Option<DVec2> {
    let start = SHADOW.first * step;
    let run = |direction: DVec2| {
        let mut last = 0.0;
        let (mut missed, mut at, mut leaves) = (0, start, false);
        while at < reach && missed < SHADOW.missed {
            match light_at(foot + at * direction) {
                Some(light) if light < SHADOW.dark => (last, missed) = (at, 0),
                Some(_) => missed += 1,
                None => {
                    leaves = true;
                    break;
                }
            }
            at += step;
        }
        (last, leaves)
    };
    let away = |d: DVec2| stick_itself.length() < 1e-9 || d.angle_to(stick_itself).abs().to_degrees() > SHADOW.beside_stick_deg;
    let runs: Vec<((f64, bool), DVec2)> = (0..SHADOW.rays)
        .map(|k| DVec2::from_angle(f64::from(k) / f64::from(SHADOW.rays) * std::f64::consts::TAU))
        .map(|d| (if away(d) { run(d) } else { (0.0, false) }, d))
        .collect();
    let longest = runs.iter().map(|r| r.0.0).fold(0.0, f64::max);
    // A shadow that leaves the picture has its tip elsewhere.
    let leaves = runs.iter().any(|r| r.0.1 && r.0.0 > SHADOW.reaches * longest);
    if leaves || longest < start + SHADOW.shortest * step {
        return None;
    }
    // The middle of the rays that reach the end of the shadow, which is as wide as the stick.
    let sum: DVec2 = runs.iter().filter(|r| r.0.0 > SHADOW.reaches * longest).map(|r| r.1).sum();
    Some(foot + (longest + 0.5 * step) * sum.try_normalize()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays that touch a ball, and where its highlight is seen for a light, found by search and not by the formula.
    fn ball(middle: DVec3, radius: f64, light: DVec3) -> (Vec<Vec<DVec3>>, DVec3) {
        let axis = middle.normalize();
        let (x, y) = axis.any_orthonormal_pair();
        let half = (radius / middle.length()).asin();
        let rays = (0..90)
            .map(|k| f64::from(k) * 4.0_f64.to_radians())
            .map(|t| vec![half.cos() * axis + half.sin() * (t.cos() * x + t.sin() * y)])
            .collect();
        // Half way between the light and the camera: iterate the normal, for the camera sees it from near.
        let mut normal = (light - axis).normalize();
        for _ in 0..200 {
            let view = -(middle + radius * normal).normalize();
            normal = (light + view).normalize();
        }
        (rays, (middle + radius * normal).normalize())
    }

    #[test]
    fn a_mirror_ball_shows_the_light_s_direction() {
        for light in [DVec3::new(0.3, -0.5, -0.8), DVec3::new(-0.9, 0.1, 0.1), DVec3::new(0.0, -0.2, -1.0)] {
            let light = light.normalize();
            let (rays, highlight) = ball(DVec3::new(40.0, -20.0, 400.0), 12.0, light);
            let outline = ball_outline(&rays, 1e-3).unwrap();
            assert!((outline.half_angle - (12.0 / outline_distance()).asin()).abs() < 1e-9);
            let found = mirror_ball(&outline, highlight, 1e-4).unwrap();
            assert!(found.direction.angle_between(light) < 1e-6, "{light}: {found:?}");
            assert!(found.sigma > 1e-4 && found.sigma < 0.1, "{}", found.sigma);
        }
    }

    fn outline_distance() -> f64 {
        DVec3::new(40.0, -20.0, 400.0).length()
    }

    #[test]
    fn other_edges_than_the_ball_s_are_left_out() {
        let (mut rays, highlight) = ball(DVec3::new(0.0, 0.0, 300.0), 12.0, -DVec3::Z);
        for (k, ray) in rays.iter_mut().enumerate() {
            let beside = (ray[0] + DVec3::new(0.02, 0.0, 0.0)).normalize();
            match k {
                0..12 => *ray = vec![beside],
                12..40 => ray.insert(0, beside),
                _ => {}
            }
        }
        let outline = ball_outline(&rays, 1e-3).unwrap();
        let off = mirror_ball(&outline, highlight, 1e-4).unwrap().direction.angle_between(-DVec3::Z);
        assert!(outline.rays < 90 && off < 1e-3, "{} rays, {off} rad", outline.rays);
        assert!(ball_outline(&rays[..5], 1e-3).is_none());
        assert!(mirror_ball(&outline, DVec3::X, 1e-4).is_none(), "beside the ball");
    }

    #[test]
    fn a_stick_s_shadow_points_to_the_light_and_is_found() {
        let light = DVec3::new(0.5, 0.2, 0.8).normalize();
        let tip = DVec3::new(10.0, 5.0, 30.0);
        let shadow = tip - light * (30.0 / light.z);
        assert!(stick(tip, shadow, 0.1).unwrap().direction.angle_between(light) < 1e-12);
        assert!(stick(shadow, tip, 0.1).is_none());
        let foot = tip.truncate();
        let along = (shadow.truncate() - foot).normalize();
        let length = (shadow.truncate() - foot).length();
        let light_at = |p: DVec2| {
            let q = p - foot;
            let (t, across) = (q.dot(along), q.perp_dot(along));
            let in_shadow = t > 0.0 && t < length && across.abs() < 0.5;
            let on_stick = q.y.abs() < 0.5 && q.x < 0.0 && q.x > -60.0;
            Some(if in_shadow {
                0.2
            } else if on_stick {
                0.1
            } else {
                1.0
            })
        };
        let found = shadow_tip(foot, -DVec2::X, 80.0, 0.1, &light_at).unwrap();
        assert!(found.distance(shadow.truncate()) < 0.3, "{found} for {shadow}");
        assert!(shadow_tip(foot, -DVec2::X, 80.0, 0.1, &|_| Some(1.0)).is_none());
    }

    #[test]
    fn sources_are_weighed_and_their_disagreement_is_told() {
        let e = |degrees: f64, sigma| DirectionEstimate {
            direction: DVec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()),
            sigma,
        };
        let (both, apart) = combine(&[e(0.0, 0.001), e(10.0, 0.1)]).unwrap();
        assert!((apart.to_degrees() - 10.0).abs() < 1e-9 && both.direction.x < 0.01 && both.sigma >= 0.5 * apart);
        assert!(combine(&[]).is_none());
    }
}
