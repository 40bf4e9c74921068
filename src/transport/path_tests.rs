use super::*;
use crate::brdf::{Brdf, Distribution};
use crate::geometry::Tile;
use crate::material::{SmallScale, Surface, Tint, TintImage};
use crate::visibility::test_tiles::{direction, extruded, tile, v_groove};
use glam::DVec2;
use std::sync::Arc;

const WHITE: Brdf = Brdf::Lambert { albedo: [1.0, 0.5, 0.0] };

fn covered(tile: Tile, brdf: Brdf) -> SmallScale {
    let surface = Surface { part: "*".into(), brdf, tint: Tint::Uniform([1.0; 3]), line: 1 };
    SmallScale { surface_of_triangle: vec![0; tile.triangles.len()], tile, surfaces: vec![surface], bounces: 0 }
}

/// The first `paths` view rays over one period.
fn rays(small: &SmallScale, pair: Pair, events: RangeInclusive<u32>, paths: u32) -> Vec<ViewRay> {
    let scene = TransportScene::new(small).unwrap();
    let sequence = PathSequence::new(3, &[]);
    let origin = |index| (small.tile.period * DVec2::from(sequence.start(index))).extend(scene.highest());
    (0..paths).map(|index| scene.path(origin(index), pair, events.clone(), sequence, index)).collect()
}

/// The light of those that meet a front face.
fn lights(small: &SmallScale, pair: Pair, events: RangeInclusive<u32>, paths: u32) -> Vec<PathLight> {
    let front = |ray| if let ViewRay::Front(light) = ray { Some(light) } else { None };
    rays(small, pair, events, paths).into_iter().filter_map(front).collect()
}

/// Mean of a channel.
fn mean(lights: &[PathLight], channel: usize) -> f64 {
    lights.iter().map(|light| light.colour[channel]).sum::<f64>() / lights.len() as f64
}

fn oblique() -> Pair {
    Pair { wi: direction(0.5, 0.3), wo: direction(0.3, 2.0) }
}

#[test]
fn the_light_of_a_path_is_its_direct_light_and_its_interreflection() {
    // Seven events: Russian roulette ends some paths, the same ones whichever events count.
    let small = covered(v_groove(DVec2::ONE, 0.5), WHITE);
    let of = |events| lights(&small, oblique(), events, 256);
    let (all, direct, rest) = (of(1..=7), of(1..=1), of(2..=7));
    for ((all, direct), rest) in all.iter().zip(&direct).zip(&rest) {
        for c in 0..3 {
            assert!((all.colour[c] - direct.colour[c] - rest.colour[c]).abs() < 1e-12, "{all:?}: {direct:?} and {rest:?}");
        }
    }
    assert!(mean(&rest, 0) > 0.1 * mean(&direct, 0), "{} of {}", mean(&rest, 0), mean(&direct, 0));
}

#[test]
fn light_falls_from_event_to_event_the_faster_the_darker_the_surface_is() {
    let small = covered(v_groove(DVec2::ONE, 0.5), WHITE);
    let events: Vec<Vec<PathLight>> = (1..=5).map(|k| lights(&small, oblique(), k..=k, 1 << 12)).collect();
    for two in events.windows(2) {
        let [first, second] = [0, 1].map(|k| [0, 1].map(|c| mean(&two[k], c)));
        assert!(second[0] < first[0] && second[1] / first[1] < 0.6 * second[0] / first[0], "{first:?} to {second:?}");
    }
}

#[test]
fn an_image_tints_the_light_of_every_event() {
    // The right wall has no green. Light that was reflected twice has met both walls.
    let mut tile = v_groove(DVec2::ONE, 0.5);
    let uv = |p: DVec3| DVec2::new(p.x, p.y) * 0.999 + 0.0005;
    tile.uv = Some((0..tile.triangles.len()).map(|t| tile.corners(t).map(uv)).collect());
    let mut small = covered(tile, Brdf::Lambert { albedo: [0.8; 3] });
    let (white, red) = ([1.0; 3], [1.0, 0.0, 0.0]);
    small.surfaces[0].tint = Tint::Image(Arc::new(TintImage { width: 4, height: 1, pixels: vec![white, white, red, red] }));
    let pair = Pair { wi: DVec3::Z, wo: DVec3::Z };
    let (direct, twice) = (lights(&small, pair, 1..=1, 1 << 10), lights(&small, pair, 2..=2, 1 << 10));
    assert!((mean(&direct, 1) / mean(&direct, 0) - 0.5).abs() < 0.02, "{} of {}", mean(&direct, 1), mean(&direct, 0));
    assert!(mean(&twice, 0) > 0.02 && mean(&twice, 1) < 0.02 * mean(&twice, 0), "{} of {}", mean(&twice, 1), mean(&twice, 0));
}

#[test]
fn light_along_rays_that_are_given_up_is_in_doubt() {
    // Nearly along the groove, at an elevation of 1e-6: half a million periods to the ridge, and none over the line of the one before.
    let small = covered(v_groove(DVec2::ONE, 0.5), WHITE);
    let nearly_along = DVec3::new(1e-9, 1.0, 1e-6).normalize();
    let grazing = Pair { wi: nearly_along, wo: direction(0.3, 2.0) };
    let found = lights(&small, grazing, 1..=1, 64);
    assert!(found.iter().any(|light| light.colour[0] > 0.0), "{found:?}");
    // Near the ridge a ray leaves in time.
    let doubtful: f64 = found.iter().map(|light| light.doubtful[0]).sum();
    assert!(doubtful > 0.7 * found.iter().map(|light| light.colour[0]).sum::<f64>(), "{found:?}");
    assert!(lights(&small, oblique(), 1..=5, 64).iter().all(|light| light.doubtful == [0.0; 3] && light.lost == [0.0; 3]));
    // The same ray from the viewer gives up as well, or meets a wall where rounding leads it.
    let along = Pair { wi: DVec3::Z, wo: nearly_along };
    let gave_up = rays(&small, along, 1..=1, 64).iter().filter(|ray| **ray == ViewRay::GaveUp).count();
    assert!(gave_up > 0, "{gave_up}");
    // Exactly along it the same cells come again, and no ray is given up.
    let exactly = Pair { wi: DVec3::new(0.0, 1.0, 1e-6).normalize(), ..grazing };
    assert!(lights(&small, exactly, 1..=1, 64).iter().all(|light| light.doubtful == [0.0; 3]));
}

#[test]
fn a_path_that_is_given_up_between_events_tells_what_it_could_have_brought() {
    // A floor, and a small plate 10 periods above it: mirrored at a grazing angle, light passes 65,536 periods between the two.
    let floor = extruded(DVec2::ONE, &[(0.0, 0.0), (1.0, 0.0)]);
    let [a, b, c] = [DVec3::new(0.5, 0.5, 10.0), DVec3::new(0.51, 0.5, 10.0), DVec3::new(0.5, 0.51, 10.0)];
    let first = floor.vertices.len() as u32;
    let vertices = [floor.vertices, vec![a, b, c]].concat();
    let triangles = [floor.triangles, vec![[first, first + 1, first + 2]]].concat();
    let mirror =
        Brdf::CookTorrance { diffuse: [0.0; 3], specular: [0.7, 0.35, 0.0], alpha: 0.01, distribution: Distribution::Ggx, f0: None };
    let small = covered(tile(DVec2::ONE, vertices, triangles), mirror);
    let pair = Pair { wi: DVec3::Z, wo: DVec3::new(0.6, 0.8, 1e-3).normalize() };
    let found = lights(&small, pair, 2..=2, 1 << 12);
    let lost: Vec<[f64; 3]> = found.iter().map(|light| light.lost).filter(|lost| lost[0] > 0.0).collect();
    assert!(!lost.is_empty(), "none of {}", found.len());
    assert!(lost.iter().all(|lost| (lost[1] / lost[0] - 0.5).abs() < 1e-6 && lost[2] == 0.0), "{lost:?}");
}

#[test]
fn the_brightest_of_a_path_is_not_dimmed_by_the_events_before() {
    // Walls at 45 degrees, of which light from above shows albedo / pi / sqrt 2 to every direction: a wall that another one shows, too.
    let small = covered(v_groove(DVec2::ONE, 0.5), WHITE);
    let above = Pair { wi: DVec3::Z, wo: DVec3::Z };
    let expected = FRAC_1_PI * std::f64::consts::FRAC_1_SQRT_2;
    let twice: Vec<PathLight> = lights(&small, above, 2..=2, 64).into_iter().filter(|light| light.colour[0] > 0.0).collect();
    assert!(!twice.is_empty());
    for light in lights(&small, above, 1..=1, 64).iter().chain(&twice) {
        let relative = |c: usize, albedo: f64| (light.brightest[c] / (albedo * expected) - 1.0).abs();
        assert!(relative(0, 1.0) < 1e-12 && relative(1, 0.5) < 1e-12 && light.brightest[2] == 0.0, "{light:?}");
    }
    // Half of the green light is left after one event.
    assert!(twice.iter().all(|light| (light.colour[1] / light.brightest[1] - 0.5).abs() < 1e-9), "{twice:?}");
}
