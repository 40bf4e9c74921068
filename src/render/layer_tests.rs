//! Pictures of layers, tints and normal maps, against closed forms.

use super::renderer::render_in_bands;
use super::tests::{GLOSS, GROOVES, SUN, Stage, run, with_control};
use super::{Picture, Scene, difference};
use crate::filter::Quality;
use glam::{DVec2, DVec3};
use image::{ImageBuffer, Luma, Rgb};
use std::f64::consts::PI;

impl Stage {
    /// A grey PNG of 16 bits; `value` is a share by the middle of a pixel, in 0..1 from the lower left corner.
    fn grey(&self, name: &str, [width, height]: [u32; 2], value: impl Fn(f64, f64) -> f64) {
        let image = ImageBuffer::<Luma<u16>, _>::from_fn(width, height, |x, y| {
            let (u, v) = ((f64::from(x) + 0.5) / f64::from(width), 1.0 - (f64::from(y) + 0.5) / f64::from(height));
            Luma([crate::numerics::cast::truncate_u32((65535.0 * value(u, v)).round()).try_into().unwrap()])
        });
        image.save(self.0.path().join(name)).unwrap();
    }

    /// An image of one normal, as 16 bits hold it.
    fn normal(&self, name: &str, normal: DVec3) {
        let encoded = normal.to_array().map(|n| (65535.0 * (0.5 * n + 0.5)).round());
        let pixel = Rgb(encoded.map(|v| u16::try_from(crate::numerics::cast::truncate_u32(v)).unwrap()));
        ImageBuffer::<Rgb<u16>, _>::from_pixel(1, 1, pixel).save(self.0.path().join(name)).unwrap();
    }

    /// A wall of side 4 that faces the camera, in full light.
    fn wall(&self, size: u32, rest: &str) -> Scene {
        let wall = "[[object]]\nkind = \"plane\"\nmaterial = \"flat.toml\"\nnormal = [0, -1, 0]\nsize = [4, 4]\n";
        self.scene(size, &format!("{FLASH}{wall}{rest}"))
    }
}

/// Light from where the camera is; a flat surface of albedo a that faces it has radiance a.
const FLASH: &str = "[[light]]\ntype = \"directional\"\nto_light = [0, -1, 0]\nirradiance_rgb = 3.14159265358979\n";

/// A stage with a second flat material, "red".
fn stage() -> Stage {
    let stage = Stage::new();
    stage.mesh("red", "plane.obj", "{ model = \"lambert\", albedo = [0.9, 0.1, 0.0] }");
    stage
}

fn layer(mask: &str, more: &str) -> String {
    format!("[[object.layer]]\nmaterial = \"red.toml\"\nmask = \"{mask}\"\n{more}")
}

fn close(got: [f32; 3], expected: [f64; 3], within: f64) {
    assert!((0..3).all(|c| (f64::from(got[c]) - expected[c]).abs() < within), "{got:?} and not {expected:?}");
}

#[test]
fn radiance_is_blended_linearly_and_tints_multiply_it() {
    let stage = stage();
    stage.grey("quarter.png", [1, 1], |_, _| 0.25);
    stage.grey("half.png", [1, 1], |_, _| 0.5);
    let middle = |rest: &str| run(&stage.wall(3, rest), &Quality::default()).picture.rgb[4];
    let (flat, red) = ([0.5, 0.25, 1.0], [0.9, 0.1, 0.0]);
    let mix = |a: f64, b: f64| std::array::from_fn(|c| a * flat[c] + b * red[c]);
    close(middle(""), flat, 1e-4);
    close(middle(&layer("quarter.png", "")), mix(0.75, 0.25), 1e-4);
    close(middle(&layer("quarter.png", "invert = true\n")), mix(0.25, 0.75), 1e-4);
    close(middle(&layer("half.png", "mask_encoding = \"srgb\"\n")), mix(1.0 - 0.214_041, 0.214_041), 1e-4);
    // Tints of the wall stand before its layers.
    let both = format!("tint = [1, 0.5, 0.25]\n{}", layer("half.png", "tint = 0.5\n"));
    close(middle(&both), [0.25 + 0.225, 0.0625 + 0.025, 0.125], 1e-4);
    // The later layer hides the earlier; in a sum both have their masks.
    let green = "[[object.layer]]\nmaterial = \"flat.toml\"\ntint = [0, 1, 0]\nmask = \"half.png\"\n";
    let two = layer("half.png", "") + green;
    close(middle(&two), [0.25 * 0.5 + 0.25 * 0.9, 0.25 * 0.25 + 0.25 * 0.1 + 0.5 * 0.25, 0.25], 1e-4);
    close(middle(&format!("blend = \"sum\"\n{two}")), [0.45, 0.05 + 0.125, 0.0], 1e-4);
}

/// Share of a pixel in which `covered` holds, by 64 x 64 points.
fn share(x: u32, y: u32, covered: &dyn Fn(f64, f64) -> bool) -> f64 {
    let points =
        (0..4096).filter(|k| covered(f64::from(x) + (f64::from(k % 64) + 0.5) / 64.0, f64::from(y) + (f64::from(k / 64) + 0.5) / 64.0));
    points.count() as f64 / 4096.0
}

#[test]
fn pixels_at_the_edge_of_a_mask_have_the_share_that_it_covers() {
    let stage = stage();
    stage.mesh("black", "plane.obj", "{ model = \"lambert\", albedo = 0.0 }");
    // A half plane, a disc, and a mask far finer than the pixels.
    let half_plane = |u: f64, v: f64| 0.37 * (u - 0.5) + 0.93 * (v - 0.5) > 0.013;
    let disc = |u: f64, v: f64| (u - 0.5).hypot(v - 0.5) < 0.31;
    for (name, covered) in [("half", &half_plane as &dyn Fn(f64, f64) -> bool), ("disc", &disc)] {
        stage.grey("mask.png", [1024, 1024], |u, v| if covered(u, v) { 1.0 } else { 0.0 });
        let rest = layer("mask.png", "").replace("red", "black");
        let mut scene = stage.wall(40, &rest);
        let camera = scene.camera;
        let at = |x: f64, y: f64| {
            let d = camera.direction(x, y);
            let place = camera.origin - camera.origin.y / d.y * d;
            DVec2::new(0.5 + place.x / 4.0, 0.5 + place.z / 4.0)
        };
        for (samples, allowed) in [(16, 0.025), (64, 0.012), (1024, 0.006)] {
            scene.camera.samples = samples;
            let picture = run(&scene, &Quality::default()).picture;
            let (mut squares, mut sum, mut edges, mut largest, mut beside) = (0.0, 0.0, 0, 0.0_f64, 0.0_f64);
            for (k, rgb) in (0_u32..).zip(&picture.rgb) {
                let expected = 1.0 - share(k % 40, k / 40, &|x, y| covered(at(x, y).x, at(x, y).y));
                let off = f64::from(rgb[2]) - expected;
                if expected > 0.0 && expected < 1.0 {
                    squares += off * off;
                    sum += off;
                    edges += 1;
                    largest = largest.max(off.abs());
                } else {
                    beside = beside.max(off.abs());
                }
            }
            let (rms, bias) = ((squares / f64::from(edges)).sqrt(), sum / f64::from(edges));
            println!("{name}, {samples} samples: RMS {rms:.4}, mean {bias:.5}, largest {largest:.3}, beside {beside:.3} at {edges} pixels");
            assert!(
                edges > 30 && rms < allowed && bias.abs() < 0.01,
                "{name}, {samples} samples: RMS {rms}, mean {bias} at {edges} pixels"
            );
        }
    }
}

#[test]
fn a_mask_finer_than_the_pixels_is_its_mean_at_one_sample() {
    let stage = stage();
    stage.grey("checks.png", [1024, 1024], |u, v| f64::from(((u * 1024.0).floor() as i32 + (v * 1024.0).floor() as i32) & 1));
    // Seen along the floor, so that footprints are long.
    let floor = "[[object]]\nkind = \"plane\"\nmaterial = \"flat.toml\"\nsize = [10, 40]\ncenter = [0, 0, -1]\n";
    let light = FLASH.replace("[0, -1, 0]", "[0, 0, 1]");
    let scene = stage.scene(32, &format!("{light}{floor}{}", layer("checks.png", "")));
    let picture = run(&scene, &Quality::default()).picture;
    let mut seen = 0;
    for (rgb, &alpha) in picture.rgb.iter().zip(&picture.alpha) {
        if alpha == 1.0 {
            seen += 1;
            close(*rgb, [0.7, 0.175, 0.5], 0.03);
        }
    }
    assert!(seen > 150, "{seen}");
}

#[test]
fn a_layer_with_gaps_opens_the_object_by_its_share() {
    let stage = stage();
    stage.grey("half.png", [1, 1], |_, _| 0.5);
    let net = "[[object.layer]]\nmaterial = \"quarter.toml\"\nmask = \"half.png\"\n";
    let open = |rest: &str| run(&stage.wall(5, rest), &Quality { tolerance: 0.02, ..Quality::default() }).picture;
    let alone = open(net);
    let covered = 0.5 + 0.5 * 0.25;
    assert!((f64::from(alone.alpha[12]) - covered).abs() < 0.005, "{}", alone.alpha[12]);
    close(alone.rgb[12], [0.25 + 0.1, 0.125 + 0.1, 0.5 + 0.1], 0.01);
    // A wall behind gets the light that passes, and shows by the same share.
    let behind = "[[object]]\nkind = \"plane\"\nmaterial = \"flat.toml\"\nnormal = [0, -1, 0]\ncenter = [0, 1, 0]\nsize = [9, 9]\n";
    let both = open(&format!("{net}{behind}"));
    let through = (1.0 - covered) * (1.0 - covered);
    close(both.rgb[12], [0.35 + 0.5 * through, 0.225 + 0.25 * through, 0.6 + through], 0.01);
    assert_eq!(both.alpha[12], 1.0);
}

#[test]
fn what_a_mask_hides_is_not_computed() {
    let stage = stage();
    stage.grey("all.png", [3, 3], |_, _| 1.0);
    stage.grey("none.png", [3, 3], |_, _| 0.0);
    let computed = |mask: &str| {
        let made = run(&stage.wall(8, &layer(mask, "")), &Quality::default()).materials;
        made.iter().map(Option::is_some).collect::<Vec<_>>()
    };
    assert_eq!(computed("all.png"), [false, true]);
    assert_eq!(computed("none.png"), [true, false]);
}

#[test]
fn a_layer_s_tile_has_a_turn_of_its_own() {
    let stage = stage();
    stage.material("gloss", GROOVES, GLOSS);
    stage.grey("all.png", [1, 1], |_, _| 1.0);
    let ball = |rest: &str| {
        let scene = stage.scene(16, &format!("{SUN}[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"gloss.toml\"\n{rest}"));
        run(&scene, &Quality { tolerance: 0.02, ..Quality::default() }).picture
    };
    let all = "[[object.layer]]\nmaterial = \"gloss.toml\"\nmask = \"all.png\"\n";
    let off = |a: &Picture, b: &Picture| difference(&a.rgb, &b.rgb, None).relative_rms;
    let (turned, along) = (ball("turn_deg = 90\n"), ball(""));
    assert!(off(&turned, &ball(&format!("{all}turn_deg = 90\n"))) < 1e-6);
    assert!(off(&turned, &ball(&format!("turn_deg = 90\n{all}"))) < 1e-6, "that of the object, if not said");
    assert!(off(&turned, &along) > 0.1);
}

#[test]
fn threads_and_bands_change_no_bit_of_layers() {
    let stage = stage();
    stage.material("gloss", GROOVES, GLOSS);
    stage.grey("spots.png", [64, 32], |u, v| 0.5 + 0.5 * (40.0 * u).sin() * (25.0 * v).cos());
    stage.normal("tilted.png", DVec3::new(0.3, 0.2, 0.9));
    let ball = "[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"gloss.toml\"\ntint = [1, 0.8, 0.6]\nnormal_map = \"tilted.png\"\n";
    let net = layer("spots.png", "mask_projection = \"planar\"\nmask_normal = [0, -1, 0]\nmask_size = [2, 1]\n").replace("red", "quarter");
    let mut scene = stage.scene(24, &format!("{SUN}{ball}{}{net}", layer("spots.png", "turn_deg = 30\n")));
    scene.camera.samples = 4;
    let quality = Quality { tolerance: 0.02, ..Quality::default() };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let expected = pool(1).install(|| run(&scene, &quality));
    assert!(expected.materials.iter().all(Option::is_some));
    let threads = pool(3).install(|| run(&scene, &quality));
    let bands = with_control(|control| render_in_bands(&scene, &quality, control, 500).unwrap());
    for (other, what) in [(threads, "threads"), (bands, "bands")] {
        assert!(other.picture == expected.picture && other.materials == expected.materials, "{what}");
    }
}

#[test]
fn a_slide_covers_what_faces_it_and_moves_with_the_mesh() {
    let stage = stage();
    stage.write("sheet.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n");
    // A quarter in the upper right of the file's own z plane.
    stage.grey("corner.png", [64, 64], |_, _| 1.0);
    let slide = layer("corner.png", "mask_projection = \"planar\"\nmask_center = [0.5, 0.5, 0]\nmask_size = [1, 1]\n");
    // Upright, its y upward, half as large.
    let sheet = |turn: &str, slide: &str| {
        format!(
            "{FLASH}[[object]]\nkind = \"mesh\"\nfile = \"sheet.obj\"\nmaterial = \"flat.toml\"\nscale = 0.5\ntwo_sided = true\nrotate_deg = {turn}\n{slide}"
        )
    };
    let red_in = |turn: &str, slide: &str| {
        let picture = run(&stage.scene(32, &sheet(turn, slide)), &Quality::default()).picture;
        let red: Vec<usize> = (0..1024).filter(|&k| picture.rgb[k][2] < 0.5 && picture.alpha[k] == 1.0).collect();
        let covered = picture.alpha.iter().filter(|&&a| a == 1.0).count();
        (red, covered)
    };
    let (red, covered) = red_in("[90, 0, 0]", &slide);
    assert!((red.len() as f64 / covered as f64 - 0.25).abs() < 0.04, "{} of {covered}", red.len());
    assert!(red.iter().all(|k| k % 32 >= 15 && k / 32 <= 16), "{red:?}");
    // A sheet has one surface: seen from behind it has the same places covered. A slide from the other side covers none.
    assert_eq!(red_in("[-90, 0, 0]", &slide).0.len(), red.len());
    assert!(red_in("[90, 0, 0]", &slide.replace("mask_size", "mask_normal = [0, 0, -1]\nmask_size")).0.is_empty());
}

#[test]
fn colours_of_vertices_and_images_are_linear_in_the_picture() {
    let stage = stage();
    let square = "v -2 -2 0 0 0 0\nv 2 -2 0 1 1 1\nv 2 2 0 1 1 1\nv -2 2 0 0 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    stage.write("square.obj", square);
    ImageBuffer::<Rgb<u8>, _>::from_fn(2, 1, |x, _| Rgb([[188, 0, 255], [255, 188, 0]][x as usize]))
        .save(stage.0.path().join("two.png"))
        .unwrap();
    let mesh = |tint: &str| {
        let mesh = "[[object]]\nkind = \"mesh\"\nfile = \"square.obj\"\nmaterial = \"flat.toml\"\nrotate_deg = [90, 0, 0]\n";
        run(&stage.scene(32, &format!("{FLASH}{mesh}{tint}")), &Quality::default()).picture
    };
    let camera = stage.wall(32, "").camera;
    let picture = mesh("tint_vertex_colors = true\n");
    for column in 2..30 {
        let d = camera.direction(f64::from(column) + 0.5, 16.5);
        let share = 0.5 - 0.25 * camera.origin.y / d.y * d.x;
        if (0.0..1.0).contains(&share) {
            close(picture.rgb[16 * 32 + column as usize], [0.5, 0.25, 1.0].map(|a| a * share), 2e-3);
        }
    }
    let picture = mesh("tint_texture = \"two.png\"\ntint_wrap = \"clamp\"\n");
    // 188 of 255 is .5029 in linear light.
    close(picture.rgb[16 * 32 + 2], [0.5 * 0.502_886, 0.0, 1.0], 1e-3);
    close(picture.rgb[16 * 32 + 29], [0.5, 0.25 * 0.502_886, 0.0], 1e-3);
}

#[test]
fn a_normal_map_turns_the_normal_and_lets_no_light_through_the_surface() {
    let stage = stage();
    let tilted = DVec3::new(0.6, 0.0, 0.8);
    stage.normal("right.png", tilted);
    let light = |to: [f64; 3]| format!("[[light]]\ntype = \"directional\"\nto_light = {to:?}\nirradiance_rgb = 3.14159265358979\n");
    let middle = |to: [f64; 3], more: &str| {
        let wall = "[[object]]\nkind = \"plane\"\nmaterial = \"flat.toml\"\nnormal = [0, -1, 0]\nx_axis = [1, 0, 0]\nsize = [4, 4]\n";
        run(&stage.scene(3, &format!("{}{wall}{more}", light(to))), &Quality::default()).picture.rgb[4]
    };
    let map = "normal_map = \"right.png\"\n";
    // On this wall u is to the right and the normal is -y.
    for to in [[0.0, -1.0, 0.0], [1.0, -1.0, 0.3], [-0.5, -1.0, 0.0]] {
        let unit = DVec3::from(to).normalize();
        let cosine = unit.dot(DVec3::new(0.6, -0.8, 0.0)).max(0.0);
        close(middle(to, map), [0.5, 0.25, 1.0].map(|a| a * cosine), 1e-3);
        close(middle(to, &format!("{map}normal_strength = 0\n")), [0.5, 0.25, 1.0].map(|a| a * -unit.y), 1e-3);
    }
    // From behind the wall, over the horizon of the turned normal.
    close(middle([1.0, 0.2, 0.0], map), [0.0; 3], 1e-9);
    // In front of the wall, under the turned horizon.
    close(middle([-1.0, -0.2, 0.0], map), [0.0; 3], 1e-9);
}

#[test]
fn a_white_environment_outshines_a_white_ball_with_a_rough_normal_map() {
    let stage = stage();
    stage.mesh("white", "plane.obj", "{ model = \"lambert\", albedo = 1.0 }");
    let mut white = Picture::new(8, 4);
    white.rgb.fill([1.0; 3]);
    white.write_exr(&mut std::fs::File::create(stage.0.path().join("white.exr")).unwrap(), false, "").unwrap();
    let rough = ImageBuffer::<Rgb<u8>, _>::from_fn(16, 16, |x, y| Rgb([(x * 97 % 256) as u8, (y * 151 % 256) as u8, 170]));
    rough.save(stage.0.path().join("rough.png")).unwrap();
    let rest = "[[object]]\nkind = \"sphere\"\nradius = 1\nmaterial = \"white.toml\"\nnormal_map = \"rough.png\"\nnormal_strength = 2\n\
                [environment]\nfile = \"white.exr\"\nlights = 256\n";
    let scene = stage.scene(16, rest);
    const RUNS: u64 = 8;
    let runs: Vec<_> = (0..RUNS).map(|seed| run(&scene, &Quality { seed, ..Quality::default() }).picture.rgb).collect();
    let mut brightest = 0.0_f64;
    for pixel in 0..256 {
        let values: Vec<f64> = runs.iter().map(|r| r[pixel][0].into()).collect();
        let mean = values.iter().sum::<f64>() / RUNS as f64;
        let error = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (RUNS * (RUNS - 1)) as f64).sqrt();
        assert!(mean <= 1.0 + 3.0 * error, "{mean} with a standard error of {error} at pixel {pixel}");
        brightest = brightest.max(mean);
    }
    assert!(brightest > 0.5 && brightest < 1.05 * PI, "{brightest}");
}
