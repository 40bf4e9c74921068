//! Whole pictures against closed forms.

use super::renderer::render_in_bands;
use super::{Picture, Rendered, Scene, difference, light_sampling, render};
use crate::error::Error;
use crate::filter::{Control, Method, Quality};
use crate::toml_reader::Source;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

/// A folder with materials, in which scenes can be written.
pub(super) struct Stage(pub tempfile::TempDir);

const PLANE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

impl Stage {
    pub(super) fn new() -> Self {
        let stage = Self(tempfile::tempdir().unwrap());
        stage.write("plane.obj", PLANE);
        stage.mesh("flat", "plane.obj", "{ model = \"lambert\", albedo = [0.5, 0.25, 1.0] }");
        stage.write("quarter.obj", "v 0 0 0\nv .5 0 0\nv .5 .5 0\nv 0 .5 0\nf 1 2 3\nf 1 3 4\n");
        stage.mesh("quarter", "quarter.obj", "{ model = \"lambert\", albedo = 0.8 }");
        stage
    }

    pub(super) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    pub(super) fn mesh(&self, name: &str, mesh: &str, brdf: &str) {
        self.material(name, &format!("kind = \"mesh\"\nfile = \"{mesh}\"\nperiod = [1.0, 1.0]"), brdf);
    }

    pub(super) fn material(&self, name: &str, geometry: &str, brdf: &str) {
        self.write(&format!("{name}.toml"), &format!("format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {brdf}\n"));
    }

    /// A scene with a camera on the y axis that looks at the origin.
    pub(super) fn scene(&self, size: u32, rest: &str) -> Scene {
        let camera = "[camera]\norigin = [0, -6, 0]\ntarget = [0, 0, 0]\nfov_deg = 24\nsamples = 1";
        let (top, tables) = rest.split_once("[[").unwrap_or((rest, ""));
        let text = format!("format = 1\n{top}\n{camera}\nwidth = {size}\nheight = {size}\n[[{tables}");
        Scene::parse(&Source { path: self.0.path().join("scene.toml"), text }).unwrap()
    }
}

pub(super) const SUN: &str = "[[light]]\ntype = \"directional\"\nto_light = [-1, -2, 1.5]\nirradiance_rgb = [3, 2, 1]\n";

pub(super) fn run(scene: &Scene, quality: &Quality) -> Rendered {
    with_control(|control| render(scene, quality, control).unwrap())
}

pub(super) fn with_control<T>(work: impl FnOnce(&Control<'_>) -> T) -> T {
    let start = std::time::Instant::now();
    let (cancel, clock) = (AtomicBool::new(false), || start.elapsed().as_secs_f64());
    work(&Control { cancel: &cancel, progress: &|_, _| {}, clock: &clock })
}

/// What a sample through the middle of each pixel hits of the unit sphere.
fn sphere_normals(scene: &Scene) -> Vec<Option<DVec3>> {
    let camera = &scene.camera;
    let normal = |pixel: u32| {
        let d = camera.direction(f64::from(pixel % camera.width) + 0.5, f64::from(pixel / camera.width) + 0.5);
        let (b, c) = (camera.origin.dot(d), camera.origin.length_squared() - 1.0);
        (b * b > c).then(|| camera.origin + (-b - (b * b - c).sqrt()) * d)
    };
    (0..camera.width * camera.height).map(normal).collect()
}

#[test]
fn a_flat_diffuse_tile_on_a_sphere_is_the_closed_form() {
    let stage = Stage::new();
    let scene = stage.scene(64, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"flat.toml\"\n"));
    let picture = run(&scene, &Quality::default()).picture;
    let to_light = DVec3::new(-1.0, -2.0, 1.5).normalize();
    let (mut lit, mut dark) = (0, 0);
    for (normal, (rgb, &alpha)) in sphere_normals(&scene).into_iter().zip(picture.rgb.iter().zip(&picture.alpha)) {
        assert_eq!(alpha, if normal.is_some() { 1.0 } else { 0.0 });
        let cosine = normal.map_or(0.0, |n| n.dot(to_light).max(0.0));
        for c in 0..3 {
            let expected = [0.5, 0.25, 1.0][c] / PI * [3.0, 2.0, 1.0][c] * cosine;
            let peak = [0.5, 0.25, 1.0][c] / PI * [3.0, 2.0, 1.0][c];
            assert!((f64::from(rgb[c]) - expected).abs() < 1e-3 * expected.max(0.05 * peak), "{rgb:?} and not {expected} at {normal:?}");
        }
        if cosine > 0.0 { lit += 1 } else { dark += 1 }
    }
    assert!(lit > 800 && dark > 800, "{lit} and {dark}");
}

#[test]
fn a_point_light_falls_off_with_the_square_and_a_ball_casts_a_round_shadow() {
    let stage = Stage::new();
    let floor = "[[object]]\nkind = \"plane\"\nmaterial = \"flat.toml\"\nnormal = [0, -1, 0]\nsize = [4, 4]\n";
    let lamp = "[[light]]\ntype = \"point\"\nposition = [0, -2, 0]\nintensity_rgb = 5\n";
    let ball = "[[object]]\nkind = \"sphere\"\nmaterial = \"flat.toml\"\nradius = 0.1\ncenter = [0, -1, 0]\n";
    let scene = stage.scene(63, &format!("{lamp}{floor}{ball}"));
    let picture = run(&scene, &Quality::default()).picture;
    for (pixel, rgb) in (0_u32..).zip(&picture.rgb) {
        let camera = &scene.camera;
        let d = camera.direction(f64::from(pixel % 63) + 0.5, f64::from(pixel / 63) + 0.5);
        let place = camera.origin - camera.origin.y / d.y * d;
        let radius = place.x.hypot(place.z);
        // The ball's tangent cone from the lamp meets the floor at 2 · tan(asin(.1)); seen from the camera the ball hides less.
        let shadow = 2.0 * (0.1_f64).asin().tan();
        let expected = if radius < shadow { 0.0 } else { 0.25 / PI * 5.0 * 2.0 / (radius * radius + 4.0).powf(1.5) };
        if (radius - shadow).abs() > 0.01 && radius > 0.13 && place.abs().max_element() < 2.0 {
            assert!((f64::from(rgb[1]) - expected).abs() < 1e-3 * expected.max(0.01), "{rgb:?} and not {expected} at {place}");
        }
    }
}

#[test]
fn a_surface_with_gaps_shows_what_lies_behind_by_its_share() {
    let stage = Stage::new();
    let light = "[[light]]\ntype = \"directional\"\nto_light = [0, -1, 0]\nirradiance_rgb = 1\n";
    let net = "[[object]]\nkind = \"plane\"\nmaterial = \"quarter.toml\"\nnormal = [0, -1, 0]\nsize = [9, 9]\nperiods_per_unit = [1, 1]\n";
    let wall = net.replace("quarter", "flat").replace("normal", "center = [0, 1, 0]\nnormal");
    let quality = Quality { tolerance: 0.02, ..Quality::default() };
    let rendered = run(&stage.scene(5, &format!("background = [2, 2, 2]\n{light}{net}")), &quality);
    let (rgb, alpha) = (rendered.picture.rgb[12], rendered.picture.alpha[12]);
    let own = 0.25 * 0.8 / PI;
    assert!((f64::from(alpha) - 0.25).abs() < 0.005, "{alpha}");
    assert!((f64::from(rgb[0]) - own - 0.75 * 2.0).abs() < 0.02, "{rgb:?}");
    assert!(rendered.notes.iter().any(|n| n.contains("a period covers about")), "{:?}", rendered.notes);
    // In front of a wall three quarters of the light reach it, and three quarters of what it sends come through.
    let rendered = run(&stage.scene(5, &format!("{light}{net}{wall}")), &quality);
    let expected = own + 0.75 * 0.75 * 0.5 / PI;
    let rgb = rendered.picture.rgb[12];
    assert!((f64::from(rgb[0]) / expected - 1.0).abs() < 0.02, "{rgb:?} and not {expected}");
    assert_eq!(rendered.picture.alpha[12], 1.0);
}

pub(super) const GROOVES: &str = "kind = \"grooves\"\nprofile = \"flat\"\nperiod = 4.0\ndepth = 2.0\nfloor_width = 2.0\ntop_width = 0.0";
pub(super) const GLOSS: &str = "{ model = \"cook-torrance\", diffuse = 0.6, specular = 0.4, alpha = 0.3 }";

#[test]
fn a_white_environment_is_nowhere_outshone_within_three_standard_errors() {
    let stage = Stage::new();
    stage.material("white", GROOVES, "{ model = \"lambert\", albedo = 1.0 }");
    stage.material("gloss", GROOVES, GLOSS);
    let mut white = Picture::new(8, 4);
    white.rgb.fill([1.0; 3]);
    let mut file = std::fs::File::create(stage.0.path().join("white.exr")).unwrap();
    white.write_exr(&mut file, false, "").unwrap();
    let environment =
        "[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"NAME.toml\"\n[environment]\nfile = \"white.exr\"\nlights = 256\n";
    const RUNS: u64 = 8;
    for name in ["white", "gloss"] {
        let scene = stage.scene(16, &environment.replace("NAME", name));
        let quality = |seed| Quality { tolerance: 0.02, seed, ..Quality::default() };
        let runs: Vec<Vec<[f32; 3]>> = (0..RUNS).map(|seed| run(&scene, &quality(seed)).picture.rgb).collect();
        let mut brightest = 0.0_f64;
        for pixel in 0..runs[0].len() {
            let values: Vec<f64> = runs.iter().map(|r| r[pixel][0].into()).collect();
            let mean = values.iter().sum::<f64>() / RUNS as f64;
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            let error = (squares / (RUNS * (RUNS - 1)) as f64).sqrt();
            assert!(mean <= 1.0 + 3.0 * error, "{name}: {mean} with a standard error of {error} at pixel {pixel}");
            brightest = brightest.max(mean);
        }
        assert!(brightest > 0.6, "{name}: only {brightest}");
    }
}

#[test]
fn lights_that_stand_for_an_environment_are_judged_in_direct_light() {
    let stage = Stage::new();
    stage.material("white", GROOVES, "{ model = \"lambert\", albedo = 1.0 }");
    let mut half = Picture::new(8, 4);
    half.rgb.iter_mut().enumerate().filter(|(k, _)| k % 8 < 4).for_each(|(_, pixel)| *pixel = [1.0; 3]);
    let mut file = std::fs::File::create(stage.0.path().join("half.exr")).unwrap();
    half.write_exr(&mut file, false, "").unwrap();
    let ball = "[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"white.toml\"\n[environment]\nfile = \"half.exr\"\nlights = 16\n";
    let mut scene = stage.scene(8, ball);
    let quality = Quality { tolerance: 0.1, ..Quality::default() };
    let mut sampling = |bounces| {
        scene.materials[0].small.bounces = bounces;
        with_control(|control| light_sampling(&scene, &quality, control).unwrap().unwrap())
    };
    let direct = sampling(0);
    assert!(direct.relative_rms > 0.001, "{direct:?}");
    assert_eq!(sampling(2), direct);
}

#[test]
fn direct_and_reference_agree_within_the_tolerance() {
    let stage = Stage::new();
    stage.material("gloss", GROOVES, GLOSS);
    let scene = stage.scene(16, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"gloss.toml\"\n"));
    let tolerance = 0.02;
    let quality = |method| Quality { method, tolerance, ..Quality::default() };
    let (direct, reference) = (run(&scene, &quality(Method::Direct)), run(&scene, &quality(Method::Reference)));
    for (rendered, method) in [(&direct, "direct"), (&reference, "reference")] {
        let made = rendered.materials[0].as_ref().unwrap();
        assert!(made.method == method && made.relative_rms() <= tolerance, "{made:?}");
    }
    let off = difference(&reference.picture.rgb, &direct.picture.rgb, None).relative_rms;
    assert!(off <= tolerance, "{off}");
}

#[test]
fn a_picture_is_no_farther_off_than_it_says() {
    let stage = Stage::new();
    stage.material("gloss", GROOVES, "{ model = \"cook-torrance\", diffuse = 0.2, specular = 0.8, alpha = 0.15 }");
    let scene = stage.scene(48, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"gloss.toml\"\n"));
    let at = |tolerance| run(&scene, &Quality { tolerance, ..Quality::default() });
    let (coarse, fine) = (at(0.05), at(0.003));
    let said = coarse.materials[0].as_ref().unwrap().relative_rms();
    let off = difference(&fine.picture.rgb, &coarse.picture.rgb, None).relative_rms;
    // 256 of the picture's pairs stand for all of them.
    assert!(said <= 0.05 && off < 1.5 * said && off > 0.2 * said, "{off}, and it says {said}");
}

#[test]
fn a_turned_tile_is_the_tile_turned() {
    let stage = Stage::new();
    // A ridge along y, and the same along x: turned by 90 degrees, counter-clockwise.
    let sides = |text: &str| format!("{text}usemtl left\nf 1 2 3 4\nusemtl right\nf 2 5 6 3\n");
    stage.write("along-y.obj", &sides("v 0 0 0\nv .5 0 .4\nv .5 1 .4\nv 0 1 0\nv 1 0 0\nv 1 1 0\n"));
    stage.write("along-x.obj", &sides("v 1 0 0\nv 1 .5 .4\nv 0 .5 .4\nv 0 0 0\nv 1 1 0\nv 0 1 0\n"));
    for name in ["along-x", "along-y"] {
        let surface =
            |part: &str, albedo: &str| format!("[[surface]]\npart = \"{part}\"\nbrdf = {{ model = \"lambert\", albedo = {albedo} }}\n");
        let geometry = format!("format = 1\n[geometry]\nkind = \"mesh\"\nfile = \"{name}.obj\"\nperiod = [1, 1]\n");
        stage.write(&format!("{name}.toml"), &(geometry + &surface("left", "[1, 0, 0]") + &surface("right", "[0, 0, 1]")));
    }
    let ball = |name: &str, turn: &str| {
        let scene = stage.scene(24, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"{name}.toml\"\n{turn}"));
        run(&scene, &Quality { tolerance: 0.01, ..Quality::default() }).picture.rgb
    };
    let turned = ball("along-y", "turn_deg = 90\n");
    let off = difference(&ball("along-x", ""), &turned, None).relative_rms;
    let other = difference(&ball("along-y", ""), &turned, None).relative_rms;
    assert!(off < 0.01 && other > 0.1, "{off} from the turned tile, {other} from the other");
}

#[test]
fn bands_and_threads_change_no_bit() {
    let stage = Stage::new();
    stage.material("gloss", GROOVES, GLOSS);
    let object = "[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"gloss.toml\"\n[[object]]\nkind = \"plane\"\nsize = [4, 4]\ncenter = [0, 0, -1]\nmaterial = \"flat.toml\"\n";
    let mut scene = stage.scene(24, &format!("{SUN}{object}"));
    scene.camera.samples = 4;
    let quality = Quality { tolerance: 0.02, ..Quality::default() };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let expected = pool(1).install(|| run(&scene, &quality));
    let threads = pool(3).install(|| run(&scene, &quality));
    let bands = with_control(|control| render_in_bands(&scene, &quality, control, 500).unwrap());
    for (other, what) in [(threads, "threads"), (bands, "bands")] {
        assert!(other.picture == expected.picture && other.materials == expected.materials, "{what}");
    }
}

#[test]
fn a_budget_is_refused() {
    let stage = Stage::new();
    let scene = stage.scene(4, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"flat.toml\"\n"));
    let quality = Quality { budget: Some(1.0), ..Quality::default() };
    let error = with_control(|control| render(&scene, &quality, control).unwrap_err());
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
}

#[test]
fn a_plan_fixes_how_the_values_of_every_material_are_made() {
    let stage = Stage::new();
    let scene = stage.scene(4, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"flat.toml\"\n"));
    let planless = Quality { tolerance: 0.05, ..Quality::default() };
    let expected = run(&scene, &planless);
    for (plan, method) in [("direct:512x1", "direct"), ("sg:paper:facets=1024:lobes=1", "sg")] {
        let quality = Quality { plan: Some(plan.parse().unwrap()), ..planless.clone() };
        let rendered = run(&scene, &quality);
        let made = rendered.materials[0].as_ref().unwrap();
        assert_eq!((made.method, made.plan.parse().ok()), (method, quality.plan), "{plan}");
        // A flat diffuse surface looks the same by either method.
        for (got, wanted) in rendered.picture.rgb.iter().flatten().zip(expected.picture.rgb.iter().flatten()) {
            assert!((got - wanted).abs() <= 0.05 * wanted, "{plan}: {got}, not {wanted}");
        }
    }
}

#[test]
fn more_lights_of_a_row_than_can_be_counted_are_refused() {
    let stage = Stage::new();
    let mut scene = stage.scene(4, &format!("{}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"flat.toml\"\n", SUN.repeat(20)));
    (scene.camera.width, scene.camera.samples) = (8192, 1024);
    let error = with_control(|control| render(&scene, &Quality::default(), control).unwrap_err()).to_string();
    assert!(error.contains("a row of 8192 pixels with 1024 samples under 20 lights") && error.contains("at most 134217727"), "{error}");
}
