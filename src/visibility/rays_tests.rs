use super::super::test_tiles::{direction, extruded, flat, height_field, point, rough, soup, tile, upper, v_groove};
use super::*;
use crate::numerics::random::Random;
use glam::DVec2;
use std::f64::consts::PI;

/// First hit by trying every translate that the ray can reach, with the textbook test (Möller and Trumbore 1997).
/// A ray that leaves triangle `own` does not meet it again, but may meet its translates.
fn brute_force(tile: &Tile, origin: DVec3, direction: DVec3, own: usize) -> Option<(f64, usize, bool)> {
    let (low, high) = tile.vertices.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    let reach = if direction.z > 0.0 { (high.z - origin.z) / direction.z } else { (low.z - origin.z) / direction.z };
    let end = origin + reach * direction;
    let span = |axis: usize, period: f64| {
        let (a, b) = (origin[axis].min(end[axis]), origin[axis].max(end[axis]));
        (((a - high[axis]) / period).floor() as i64, ((b - low[axis]) / period).ceil() as i64)
    };
    let (columns, rows) = (span(0, tile.period.x), span(1, tile.period.y));
    let mut best: Option<(f64, usize, bool)> = None;
    for triangle in 0..tile.triangles.len() {
        let [p, q, r] = tile.corners(triangle);
        let (a, b) = (q - p, r - p);
        let h = direction.cross(b);
        let det = a.dot(h);
        for i in columns.0..=columns.1 {
            for j in rows.0..=rows.1 {
                if (triangle, i, j) == (own, 0, 0) {
                    continue;
                }
                let s = origin - p - DVec3::new(i as f64 * tile.period.x, j as f64 * tile.period.y, 0.0);
                let u = s.dot(h) / det;
                let k = s.cross(a);
                let (v, t) = (direction.dot(k) / det, b.dot(k) / det);
                if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && best.is_none_or(|(other, ..)| t < other) {
                    best = Some((t, triangle, det > 0.0));
                }
            }
        }
    }
    best
}

#[test]
fn rays_agree_with_trying_every_translate_of_every_triangle() {
    for (seed, period, height) in
        [(1, DVec2::ONE, 1.0), (2, DVec2::new(3.0, 0.5), 0.2), (3, DVec2::new(1e-6, 2e-6), 3e-6), (4, DVec2::splat(1e6), 10.0)]
    {
        let tile = soup(period, height, 40, seed);
        let bvh = PeriodicBvh::new(&tile).unwrap();
        let mut random = Random::from_state(seed);
        let mut found = 0;
        for _ in 0..3_000 {
            let triangle = (random.unit() * 40.0) as usize;
            let origin = point(&tile, triangle, random.unit(), random.unit());
            let slant = direction(random.unit() * 1.5, random.unit() * 2.0 * PI) * period.extend(height);
            let w = if random.unit() < 0.3 { -slant } else { slant }.normalize();
            let expected = brute_force(&tile, origin, w, triangle);
            let blocked = bvh.occluded(triangle, origin, w);
            let wanted = if expected.is_some() { Occlusion::Blocked } else { Occlusion::Free };
            assert_eq!(blocked, wanted, "seed {seed}: from {origin} on {triangle} to {w}: {expected:?}");
            let hit = bvh.closest(origin, w, Some(triangle as u32));
            assert_eq!(hit.is_some(), expected.is_some(), "seed {seed}: from {origin} to {w}: {hit:?}, {expected:?}");
            if let (Some(hit), Some((distance, triangle, front))) = (hit, expected) {
                found += 1;
                assert_eq!((hit.triangle as usize, hit.front), (triangle, front), "seed {seed}: from {origin} to {w}");
                assert!((hit.distance / distance - 1.0).abs() < 1e-9, "{} instead of {distance}", hit.distance);
                let [p, q, r] = tile.corners(triangle);
                let at = p + hit.barycentric.x * (q - p) + hit.barycentric.y * (r - p);
                let off = (at - hit.position) / period.extend(f64::INFINITY);
                assert!((off - off.round()).abs().max_element() < 1e-9, "{off} periods between the place and its weights");
                let off = (origin + distance * w - hit.position) / period.extend(f64::INFINITY);
                assert!((off - off.round()).abs().max_element() < 1e-9, "{off} periods from where it should be");
            }
        }
        assert!((500..2_900).contains(&found), "{found} of 3000 rays hit: the test sees too little");
    }
}

#[test]
fn a_flat_plane_blocks_nothing_and_is_hit_from_any_elevation() {
    for (period, height) in [(DVec2::ONE, 0.0), (DVec2::new(1e-6, 1e6), -3.0), (DVec2::splat(1e6), 1e6)] {
        let tile = flat(period, height);
        let bvh = PeriodicBvh::new(&tile).unwrap();
        let mut random = Random::from_state(5);
        for elevation in [90.0, 45.0, 1.0, 0.01, 1e-3, 1e-6_f64] {
            for _ in 0..100 {
                let w = direction((90.0 - elevation).to_radians(), random.unit() * 2.0 * PI);
                let triangle = usize::from(random.unit() < 0.5);
                let origin = point(&tile, triangle, random.unit(), random.unit());
                assert_eq!(bvh.occluded(triangle, origin, w), Occlusion::Free, "{elevation} degrees over {period} at {height}");
                // Aimed at a place on the plane, from a height that it passes within one period.
                let start = origin + w * period.min_element();
                let hit = bvh.closest(start, -w, None).unwrap_or_else(|| panic!("{elevation} degrees over {period} at {height}"));
                assert!(hit.front, "{elevation} degrees");
                assert!((hit.position.z - height).abs() <= 1e-9 * height.abs(), "hit at {}", hit.position);
            }
        }
    }
}

#[test]
fn no_ray_passes_through_the_seams_of_a_closed_surface() {
    // Rays aimed exactly at vertices and edges, from above and from below.
    let tile = rough(DVec2::new(1.0, 1.5), 12, 0.3, 6);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let mut random = Random::from_state(7);
    for _ in 0..20_000 {
        let triangle = (random.unit() * tile.triangles.len() as f64) as usize;
        let [p, q, _] = tile.corners(triangle);
        let at = if random.unit() < 0.3 { p } else { p.lerp(q, random.unit()) };
        let w = upper(&mut random).with_z(0.2 + random.unit()).normalize();
        let hit = bvh.closest(at + 3.0 * w, -w, None).expect("nothing passes");
        assert!(hit.front, "the back is seen from above at {at}");
        // From below, a front face that meets a back face exactly where the ray does wins.
        assert!(bvh.closest(at - 3.0 * w, w, None).is_some(), "a ray from below passes at {at}");
    }
}

#[test]
fn a_v_groove_is_shadowed_where_geometry_says_at_any_aspect_ratio() {
    for (width, depth) in [(1.0, 0.5), (1e-6, 1e-6), (1e6, 3e5), (1.0, 1e-6), (1.0, 1e3), (1e6, 1.0)] {
        let tile = v_groove(DVec2::new(width, 0.7 * width), depth);
        let bvh = PeriodicBvh::new(&tile).unwrap();
        let mut random = Random::from_state(8);
        for _ in 0..4_000 {
            // The left wall falls from x = 0; the light comes over its ridge or from the right.
            let triangle = usize::from(random.unit() < 0.5);
            let origin = point(&tile, triangle, random.unit(), random.unit());
            let slope = (random.unit() - 0.5) * 8.0;
            let w = DVec3::new(slope * width, (random.unit() - 0.5) * width, 2.0 * depth).normalize();
            // Over the ridge at x = 0 and over the one at x = width.
            let steepness = w.z / w.x.abs();
            let clearance = if w.x < 0.0 { steepness - (-origin.z) / origin.x } else { steepness - (-origin.z) / (width - origin.x) };
            if clearance.abs() < 1e-6 * steepness {
                continue;
            }
            let wanted = if clearance > 0.0 { Occlusion::Free } else { Occlusion::Blocked };
            assert_eq!(bvh.occluded(triangle, origin, w), wanted, "{width} x {depth}: from {origin} to {w}");
        }
    }
}

#[test]
fn a_distant_ridge_blocks_a_grazing_ray_thousands_of_periods_away() {
    // Narrow fins of height 1, ten thousand periods... along x the fins repeat, so the ray runs along y, where one fin in a
    // long period stands across its way.
    let period = DVec2::new(1e-3, 10.0);
    let fin = [DVec3::new(0.0, 5.0, 0.0), DVec3::new(1e-3, 5.0, 0.0), DVec3::new(1e-3, 5.0, 1.0), DVec3::new(0.0, 5.0, 1.0)];
    let floor = [DVec3::ZERO, DVec3::new(1e-3, 0.0, 0.0), DVec3::new(1e-3, 10.0, 0.0), DVec3::new(0.0, 10.0, 0.0)];
    let corners = fin.into_iter().chain(floor).collect();
    let tile = tile(period, corners, vec![[4, 5, 6], [4, 6, 7], [0, 1, 2], [0, 2, 3]]);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let origin = DVec3::new(2e-4, 0.0, 0.0);
    // 4 units along x in the same time as 5 along y: 4,000 periods of x before the fin.
    for (rise, wanted) in [(0.999, Occlusion::Blocked), (1.001, Occlusion::Free)] {
        assert_eq!(bvh.occluded(0, origin, DVec3::new(4.0, 5.0, rise)), wanted, "rise {rise}");
    }
}

#[test]
fn at_89_99_degrees_a_ray_crosses_the_whole_height_of_the_surface() {
    // A pole of height 1 in a period of 1: a ray at 89.99 degrees climbs over it after 5,729 periods.
    let spike = |a: f64| vec![DVec3::new(0.5 - a, 0.5, 0.0), DVec3::new(0.5 + a, 0.5, 0.0), DVec3::new(0.5, 0.5, 1.0)];
    let tile = tile(DVec2::ONE, spike(1e-3), vec![[0, 1, 2]]);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let theta = 89.99_f64.to_radians();
    // Along the lattice it passes between the poles, or hits the first one.
    assert_eq!(bvh.occluded(0, DVec3::new(0.25, 0.5, 0.0), direction(theta, PI / 2.0)), Occlusion::Free);
    assert_eq!(bvh.occluded(0, DVec3::new(0.5001, 0.5, 0.0), direction(theta, PI / 2.0)), Occlusion::Blocked);
    // At a slope of 1/1000 it drifts by one period in a thousand, and meets the pole of column 1 in row 500 at height .087.
    let w = direction(theta, PI / 2.0 - 1e-3_f64.atan());
    let hit = bvh.closest(DVec3::new(0.0, 0.5, 0.0), w, Some(0)).expect("it meets a pole");
    assert!((hit.distance - 500.0).abs() < 1.5, "after {} periods", hit.distance);
    assert!((hit.position.z - 500.0 * w.z).abs() < 2e-3, "at height {}", hit.position.z);
}

#[test]
fn a_ray_that_never_leaves_is_given_up() {
    // Between the walls of a trench along y, exactly horizontal.
    let tile = extruded(DVec2::ONE, &[(0.0, 1.0), (0.2, 1.0), (0.2, 0.0), (0.8, 0.0), (0.8, 1.0), (1.0, 1.0)]);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let origin = DVec3::new(0.5, 0.5, 0.5);
    assert_eq!(bvh.occluded(4, origin, DVec3::Y), Occlusion::GaveUp);
    assert_eq!(bvh.trace(origin, DVec3::Y, None), Traced::GaveUp);
    assert_eq!(bvh.occluded(4, origin, DVec3::X), Occlusion::Blocked);
    // However many periods it needs to rise to the top: its path repeats, and nothing stands on it.
    for periods in [10.0, 65_600.0, 1e12] {
        assert_eq!(bvh.occluded(4, origin, DVec3::new(0.0, 1.0, 0.5 / periods)), Occlusion::Free);
        assert_eq!(bvh.trace(origin, DVec3::new(0.0, 1.0, 0.5 / periods), None), Traced::Left);
    }
}

#[test]
fn rays_whose_path_repeats_agree_with_trying_every_translate() {
    for (seed, period) in [(5, DVec2::ONE), (6, DVec2::new(3.0, 0.5))] {
        let tile = soup(period, 1.0, 2, seed);
        let bvh = PeriodicBvh::new(&tile).unwrap();
        let mut random = Random::from_state(seed);
        let mut found = [0; 2];
        for _ in 0..200 {
            let triangle = (random.unit() * 2.0) as usize;
            let origin = point(&tile, triangle, random.unit(), random.unit());
            // Along rows, columns, and slopes of up to four cells; up to 2,000 of them.
            let mut cells = || ((random.unit() * 9.0).floor() - 4.0).clamp(-4.0, 4.0);
            let (x, y) = (cells(), cells());
            if (x, y) == (0.0, 0.0) {
                continue;
            }
            let rise = 10_f64.powf(0.5 - 3.8 * random.unit());
            let w = DVec3::new(x * period.x, y * period.y, rise).normalize();
            let expected = brute_force(&tile, origin, w, triangle);
            let hit = bvh.closest(origin, w, Some(triangle as u32));
            assert_eq!(hit.map(|h| h.triangle as usize), expected.map(|e| e.1), "seed {seed}: from {origin} on {triangle} to {w}");
            assert_eq!(bvh.occluded(triangle, origin, w) == Occlusion::Blocked, expected.is_some());
            if let (Some(hit), Some((distance, ..))) = (hit, expected) {
                assert!((hit.distance / distance - 1.0).abs() < 1e-6, "{} for {distance}", hit.distance);
            }
            found[usize::from(expected.is_some())] += 1;
        }
        assert!(found[0] > 10 && found[1] > 100, "{found:?}");
    }
}

#[test]
fn a_vertical_wall_on_the_border_of_the_cell_blocks_from_both_sides() {
    let tile = extruded(DVec2::ONE, &[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0)]);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let mut random = Random::from_state(9);
    for _ in 0..1_000 {
        let origin = DVec3::new(random.unit(), random.unit(), 0.0);
        let rise = random.unit() * 0.9;
        let right = DVec3::new(1.0 - origin.x, random.unit(), rise);
        assert_eq!(bvh.occluded(0, origin, right), Occlusion::Blocked, "from {origin} to the right");
        let left = DVec3::new(-origin.x, random.unit(), rise.max(origin.x));
        assert_eq!(bvh.occluded(0, origin, left), Occlusion::Blocked, "from {origin} to the left");
        // From the wall itself over the next slope, and back under its own.
        let origin = DVec3::new(1.0, random.unit(), 0.5 + 0.5 * random.unit());
        assert_eq!(bvh.occluded(2, origin, DVec3::new(1.0, random.unit(), 1.1)), Occlusion::Free, "from the wall at {origin}");
        assert_eq!(bvh.occluded(2, origin, DVec3::new(-1.0, random.unit(), 1.1)), Occlusion::Blocked, "back from {origin}");
    }
}

#[test]
fn faces_in_the_plane_of_the_origin_do_not_block_it_even_at_grazing_angles() {
    // Flat areas between steps: coplanar neighbours, a duplicate of every triangle, and each also from below.
    let mut tile = height_field(DVec2::new(1.0, 1.0), 8, 8, |i, j| if (i / 4 + j / 4) % 2 == 0 { 0.0 } else { -0.3 });
    let twice: Vec<_> = tile.triangles.iter().flat_map(|&[a, b, c]| [[a, b, c], [a, b, c], [a, c, b]]).collect();
    tile.triangles = twice;
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let mut random = Random::from_state(10);
    let flat_top: Vec<usize> = (0..tile.triangles.len()).filter(|&t| tile.corners(t).iter().all(|p| p.z == 0.0)).collect();
    for _ in 0..20_000 {
        let triangle = flat_top[(random.unit() * flat_top.len() as f64) as usize];
        let origin = point(&tile, triangle, random.unit(), random.unit());
        let w = direction(PI / 2.0 - 10.0_f64.powf(-6.0 * random.unit()), random.unit() * 2.0 * PI);
        assert_eq!(bvh.occluded(triangle, origin, w), Occlusion::Free, "from {origin} to {w}");
        let hit = bvh.closest(origin + w, -w, None).expect("the way back");
        assert!(hit.front, "of two faces in one place the front one is seen");
    }
}

#[test]
fn a_point_whose_face_continues_in_the_next_cell_is_not_blocked_by_it() {
    // One inclined plane cut at the border, origins on and near the border.
    let tile = extruded(DVec2::ONE, &[(0.5, 0.0), (1.5, 0.4), (1.5, 0.0)]);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let mut random = Random::from_state(11);
    for x in [1.0, 1.0 - 1e-16, 1.0 + 1e-15, 1.0 - 1e-12, 1.0 - 1e-9, 1.0 + 1e-7] {
        for _ in 0..1_000 {
            let origin = DVec3::new(x, random.unit(), 0.4 * (x - 0.5));
            let triangle = usize::from(random.unit() < 0.5);
            let lift = 10.0_f64.powf(-4.0 * random.unit());
            let w = DVec3::new(1.0, random.unit() - 0.5, 0.4 + lift);
            assert_eq!(bvh.occluded(triangle, origin, w), Occlusion::Free, "from {origin} to {w}");
        }
    }
}

#[test]
fn translates_of_a_triangle_block_it() {
    // Shingles: each overlaps the next one, of which it is a translate.
    let tile =
        tile(DVec2::ONE, vec![DVec3::ZERO, DVec3::new(2.5, 0.0, 1.0), DVec3::new(2.5, 1.0, 1.0), DVec3::Y], vec![[0, 1, 2], [0, 2, 3]]);
    let bvh = PeriodicBvh::new(&tile).unwrap();
    let under = DVec3::new(0.5, 0.5, 0.2);
    assert_eq!(bvh.occluded(0, under, DVec3::Z), Occlusion::Blocked, "two others lie above its lower end");
    let under = DVec3::new(2.2, 0.5, 0.88);
    assert_eq!(bvh.occluded(0, under, DVec3::NEG_Z), Occlusion::Blocked);
    assert_eq!(bvh.occluded(0, under, DVec3::Z), Occlusion::Free);
    let hit = bvh.closest(DVec3::new(0.2, 0.5, 2.0), DVec3::NEG_Z, None).unwrap();
    assert!((hit.position.z - 2.2 / 2.5).abs() < 1e-12, "the shingle that started two cells before lies on top: {hit:?}");
}

#[test]
fn empty_and_degenerate_tiles_block_nothing() {
    let nothing = tile(DVec2::ONE, Vec::new(), Vec::new());
    let line = tile(DVec2::ONE, vec![DVec3::ZERO, DVec3::X, DVec3::new(2.0, 0.0, 0.0)], vec![[0, 1, 2]]);
    let bad = tile(DVec2::ONE, vec![DVec3::ZERO, DVec3::X, DVec3::NAN], vec![[0, 1, 2]]);
    for tile in [nothing, line, bad] {
        let bvh = PeriodicBvh::new(&tile).unwrap();
        assert_eq!(bvh.occluded(0, DVec3::ZERO, DVec3::new(0.1, 0.2, 0.3)), Occlusion::Free);
        assert_eq!(bvh.closest(DVec3::Z, DVec3::new(0.1, 0.2, -0.3), None), None);
    }
    let needle =
        tile(DVec2::ONE, vec![DVec3::new(0.0, 0.5, 0.5), DVec3::new(1.0, 0.5, 0.5), DVec3::new(0.5, 0.5 + 1e-6, 0.5)], vec![[0, 1, 2]]);
    let bvh = PeriodicBvh::new(&needle).unwrap();
    assert!(bvh.closest(DVec3::new(0.5, 0.5 + 5e-7, 1.0), DVec3::NEG_Z, None).is_some());
    assert!(bvh.closest(DVec3::new(0.5, 0.5 - 5e-7, 1.0), DVec3::NEG_Z, None).is_none());
}

#[test]
fn a_period_far_smaller_than_the_mesh_is_refused() {
    let tile = flat(DVec2::ONE, 0.0);
    let error = PeriodicBvh::new(&Tile { period: DVec2::splat(1e-4), ..tile }).unwrap_err().to_string();
    assert!(error.contains("period"), "{error}");
}
