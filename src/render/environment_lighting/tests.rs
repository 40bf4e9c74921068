//! Scenes lit by an environment as a whole, against closed forms and sampled lights.

use super::super::scene::Scene;
use super::super::{Picture, World, difference, render};
use super::EnvironmentLit;
use super::raster::Outlines;
use crate::filter::{Control, Quality};
use crate::toml_reader::Source;
use std::fmt::Write as _;

const CAMERA: &str =
    "format = 1\n[camera]\norigin = [0.3, -5, 2]\ntarget = [0, 0, 0]\nfov_deg = 30\nwidth = 48\nheight = 36\nsamples = 1\n";
const FLAT: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

/// A scene of these objects, with a flat tile of this BRDF as `material.toml`, lit by `map.exr`, a panorama of one radiance, or by the studio of the samples.
fn scene(brdf: &str, environment: Option<[f32; 3]>, objects: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("flat.obj"), FLAT).unwrap();
    let material = format!(
        "format = 1\n[geometry]\nkind = \"mesh\"\nfile = \"flat.obj\"\nperiod = [1.0, 1.0]\n[[surface]]\npart = \"*\"\nbrdf = {{ {brdf} }}\n"
    );
    std::fs::write(path("material.toml"), material).unwrap();
    let map = match environment {
        Some(radiance) => {
            let mut picture = Picture::new(32, 16);
            picture.rgb.fill(radiance);
            picture.write_exr(std::fs::File::create(path("map.exr")).unwrap(), false, "a test").unwrap();
            path("map.exr")
        }
        None => std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/scenes/studio.hdr"),
    };
    let mut text = CAMERA.to_owned();
    write!(text, "[environment]\nfile = {:?}\nlighting = \"sg\"\nlights = 2048\n{objects}", map.display().to_string()).unwrap();
    Scene::parse(&Source { path: path("scene.toml"), text }).unwrap()
}

const BALL: &str = "[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"material.toml\"\n";
const FLOOR: &str = "[[object]]\nkind = \"plane\"\ncenter = [0, 0, -1]\nsize = [6, 6]\nmaterial = \"material.toml\"\n";

#[test]
fn a_white_world_shows_the_albedo() {
    let scene = scene("model = \"lambert\", albedo = [0.2, 0.5, 0.8]", Some([2.0; 3]), BALL);
    let lit = EnvironmentLit::new(&scene, &Quality::default(), &Control::quiet()).unwrap();
    let picture = lit.frame(&scene.camera);
    let covered: Vec<_> = picture.rgb.iter().zip(&picture.alpha).filter(|p| *p.1 > 0.0).map(|p| *p.0).collect();
    assert!(covered.len() > 100);
    for rgb in covered {
        for (value, albedo) in rgb.into_iter().zip([0.2, 0.5, 0.8]) {
            assert!((value / (2.0 * albedo) - 1.0).abs() < 0.01, "{rgb:?}");
        }
    }
}

/// Relative RMS difference of a frame from the same scene under sampled lights, over the pixels with objects.
fn difference_from_sampled(scene: &Scene, lobes: bool) -> f64 {
    let quality = Quality { tolerance: 0.05, ..Quality::default() };
    let lit = EnvironmentLit::new(scene, &quality, &Control::quiet()).unwrap();
    assert_eq!(lit.reports()[0].lobes > 0, lobes, "{:?}", lit.reports());
    let mut sampled = scene.clone();
    sampled.environment.as_mut().unwrap().lighting = super::super::Lighting::Sampled;
    let expected = render(&sampled, &quality, &Control::quiet()).unwrap().picture;
    difference(&expected.rgb, &lit.frame(&scene.camera).rgb, None).relative_rms
}

#[test]
fn a_ball_on_a_floor_is_lit_as_by_sampled_lights() {
    let rough = scene("model = \"cook-torrance\", diffuse = 0.4, specular = 0.4, alpha = 0.3", None, &format!("{BALL}{FLOOR}"));
    let off = difference_from_sampled(&rough, false);
    assert!(off < 0.1, "a rough ball: off by {off}");
}

#[test]
fn a_glossy_ball_reflects_by_lobes_as_by_sampled_lights() {
    let glossy = scene("model = \"cook-torrance\", diffuse = 0.3, specular = 0.5, alpha = 0.1", None, &format!("{BALL}{FLOOR}"));
    let off = difference_from_sampled(&glossy, true);
    assert!(off < 0.1, "a glossy ball: off by {off}");
}

#[test]
fn the_rasteriser_sees_what_rays_see() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/scenes/cup.toml");
    let mut scene = Scene::load(&path).unwrap();
    scene.camera.width = 96;
    scene.camera.height = 72;
    let close = {
        // Triangles behind the camera and across its plane.
        let mut camera = scene.camera;
        camera.origin += 0.8 * (scene.objects[0].middle() - camera.origin);
        camera
    };
    let world = World::opaque(&scene);
    for camera in [scene.camera, close] {
        let seen = Outlines::new(&world, &camera).rows(0..camera.height);
        let mut hits = 0;
        for (at, seen) in (0_u32..).zip(&seen) {
            let direction = camera.direction(f64::from(at % camera.width) + 0.5, f64::from(at / camera.width) + 0.5);
            let first = world.first(camera.origin, direction, 0.0);
            assert_eq!(seen.is_some(), first.is_some(), "pixel {at}");
            if let (Some((_, hit)), Some(first)) = (seen, first) {
                hits += 1;
                assert!((hit.distance / first.hit.distance - 1.0).abs() < 1e-9, "pixel {at}: {hit:?} and {first:?}");
            }
        }
        assert!(hits > 1000, "{hits} pixels show the cup");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_picture() {
    let scene = scene("model = \"cook-torrance\", diffuse = 0.3, specular = 0.5, alpha = 0.1", None, BALL);
    let quality = Quality { tolerance: 0.3, ..Quality::default() };
    let picture = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| EnvironmentLit::new(&scene, &quality, &Control::quiet()).unwrap().frame(&scene.camera))
    };
    assert_eq!(picture(1), picture(3));
}

#[test]
fn a_scene_without_an_environment_is_refused() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/scenes/ball.toml");
    let scene = Scene::load(&path).unwrap();
    let error = EnvironmentLit::new(&scene, &Quality::default(), &Control::quiet()).err().unwrap().to_string();
    assert!(error.contains("environment"), "{error}");
}
