//! `biscale render` through the binary: bad scenes, what it writes and replaces, the same bits, Ctrl-C.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use std::process::Stdio;
use support::{Folder, Said, project};

/// A scene that is right, for the material `m.toml` of [`Folder`].
const SCENE: &str = "format = 1
name = \"ball\"
[camera]
origin = [0.0, -6.0, 1.0]
target = [0.0, 0.0, 0.0]
up = [0.0, 0.0, 1.0]
fov_deg = 24.0
width = 16
height = 12
samples = 2
[[light]]
type = \"directional\"
to_light = [-0.5, -1.0, 1.0]
irradiance_rgb = [3.0, 2.0, 1.0]
[[object]]
kind = \"sphere\"
material = \"m.toml\"
center = [0.0, 0.0, 0.0]
radius = 1.0
";

const RENDER: [&str; 4] = ["render", "scene.toml", "-o", "out.png"];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE);
    folder
}

fn done(said: &Said) {
    assert_eq!(said.status, 0, "{}", said.stderr);
}

#[test]
fn bad_scenes_are_refused_with_file_line_and_field() {
    // What is wrong, the piece of the good scene, what stands there instead, and what the message must say.
    let cases: [(&str, &str, &str, &[&str]); 31] = [
        ("no camera", "[camera]", "[camara]", &["scene.toml", "no [camera]"]),
        ("a material that is missing", "m.toml", "n.toml", &["scene.toml:17", "object[0].material", "no file \"n.toml\""]),
        ("no material", "material = \"m.toml\"\n", "", &["scene.toml", "object[0]", "lacks the required key `material`"]),
        ("the camera inside of the ball", "-6.0, 1.0", "-0.5, 0.0", &["scene.toml:3", "camera.origin", "inside of object[0] (sphere)"]),
        ("a ball without size", "radius = 1.0", "radius = 0.0", &["scene.toml:19", "object[0].radius", "0.0 is out of range"]),
        ("a ball inside out", "radius = 1.0", "radius = -1.0", &["object[0].radius", "-1.0"]),
        ("a radius that is no number", "radius = 1.0", "radius = nan", &["object[0].radius", "nan is out of range"]),
        ("a place at infinity", "center = [0.0, 0.0, 0.0]", "center = [inf, 0, 0]", &["object[0].center", "inf"]),
        ("a place of two numbers", "center = [0.0, 0.0, 0.0]", "center = [0, 0]", &["object[0].center", "2 elements"]),
        ("a huge picture", "width = 16", "width = 100000", &["scene.toml:8", "camera.width", "100000", "8192"]),
        ("too many pixels", "width = 16\nheight = 12", "width = 8192\nheight = 8192", &["camera.width", "8192 x 8192 pixels"]),
        ("a picture without pixels", "height = 12", "height = 0", &["camera.height", "0"]),
        ("half a pixel", "height = 12", "height = 12.5", &["camera.height", "whole number"]),
        ("a picture without samples", "samples = 2", "samples = 0", &["camera.samples", "0"]),
        ("a view of 180 degrees", "fov_deg = 24.0", "fov_deg = 180", &["camera.fov_deg", "180"]),
        ("a camera that looks at itself", "target = [0.0, 0.0, 0.0]", "target = [0.0, -6.0, 1.0]", &["camera.target", "where it stands"]),
        ("a camera that looks along up", "up = [0.0, 0.0, 1.0]", "up = [0.0, -6.0, 1.0]", &["camera.up", "along its own up"]),
        ("no light", "[[light]]", "[[lamp]]", &["there is no light"]),
        ("a light from nowhere", "[-0.5, -1.0, 1.0]", "[0, 0, 0]", &["light[0].to_light", "no length"]),
        ("a light that darkens", "[3.0, 2.0, 1.0]", "[3.0, -2.0, 1.0]", &["light[0].irradiance_rgb", "-2.0"]),
        ("an unknown light", "\"directional\"", "\"direct\"", &["light[0].type", "\"direct\" is not known", "directional"]),
        ("a kind that is not built", "\"sphere\"", "\"torus\"", &["object[0].kind", "\"torus\"", "sphere"]),
        ("a misspelt key", "radius = 1.0", "radius = 1.0\nturn = 90", &["unknown key `turn`", "turn_deg"]),
        ("a misspelt camera key", "fov_deg", "fov", &["camera", "fov_deg"]),
        ("no object", "[[object]]", "[[objekt]]", &["there is no [[object]]"]),
        ("another format", "format = 1", "format = 2", &["scene.toml:1", "format 2 is not known"]),
        ("no TOML", "name = \"ball\"", "name = ball", &["scene.toml:2", "not valid TOML"]),
        ("a mesh that is missing", "kind = \"sphere\"", "kind = \"mesh\"\nfile = \"no.obj\"", &["object[0].file", "no file \"no.obj\""]),
        ("an environment that is missing", "[[light]]", "[environment]\nfile = \"no.hdr\"\n[[light]]", &["environment.file", "no.hdr"]),
        ("an environment of another kind", "[[light]]", "[environment]\nfile = \"m.toml\"\n[[light]]", &["m.toml", ".hdr or .exr"]),
        ("a plane along its x", "kind = \"sphere\"", "kind = \"plane\"\nsize = [1, 1]\nx_axis = [0, 0, 1]", &["x_axis", "parallel"]),
    ];
    for (what, good, bad, words) in cases {
        let folder = folder();
        assert!(SCENE.contains(good), "{what}: the good scene has no {good:?}");
        folder.write("scene.toml", SCENE.replacen(good, bad, 1));
        let before = folder.snapshot();
        for arguments in [&RENDER[..], &["check", "scene.toml"]] {
            let said = folder.run(arguments);
            assert_eq!(said.status, 2, "{what}: {}", said.stderr);
            for word in words {
                assert!(said.stderr.contains(word), "{what}: no {word:?} in {}", said.stderr);
            }
            assert!(said.stderr.starts_with("error: ") && said.stderr.lines().count() == 1, "{what}: {}", said.stderr);
            assert!(said.stdout.is_empty() && folder.snapshot() == before, "{what}: something was written");
        }
    }
}

#[test]
fn bad_arguments_are_refused_before_the_work() {
    let folder = folder();
    let before = folder.snapshot();
    for (arguments, status, words) in [
        (&["render", "scene.toml"][..], 2, &["--output"][..]),
        (&["render", "scene.toml", "-o", "out.jpg"], 2, &["out.jpg", ".exr or .png"]),
        (&["render", "scene.toml", "-o", "out"], 2, &["no ending"]),
        (&["render", "scene.toml", "-o", "no/out.png"], 2, &["no folder"]),
        (&["render", "no.toml", "-o", "out.png"], 2, &["no.toml", "no such file"]),
        (&["render", "scene.toml", "-o", "out.png", "-o", "./out.png"], 2, &["./out.png", "named twice"]),
        (&["render", "m.toml", "-o", "out.png"], 2, &["m.toml", "this is a material file, not a scene file"]),
        (&["render", "scene.toml", "-o", "out.png", "--exposure", "bright"], 2, &["--exposure", "stops"]),
        (&["render", "scene.toml", "-o", "out.png", "--material", "n.toml"], 2, &["n.toml", "no such file"]),
        (&["render", "scene.toml", "-o", "out.png", "--budget", "1s"], 1, &["budget", "not supported"]),
        (&["render", "scene.toml", "-o", "out.png", "--method", "sg", "--bounces", "2"], 2, &["--bounces", "direct light only"]),
    ] {
        let said = folder.run(arguments);
        assert_eq!(said.status, status, "{arguments:?}: {}", said.stderr);
        for word in words {
            assert!(said.stderr.contains(word), "{arguments:?}: no {word:?} in {}", said.stderr);
        }
        assert!(folder.snapshot() == before, "{arguments:?}: something was written");
    }
}

#[test]
fn a_picture_is_written_in_both_formats_and_says_how_it_was_made() {
    let folder = folder();
    let said = folder.run(["render", "scene.toml", "-o", "out.png", "-o", "out.exr", "--alpha", "--json"]);
    done(&said);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    let material = &object["summary"]["materials"][0];
    assert_eq!((&object["summary"]["width"], &material["method"]), (&16.into(), &"direct".into()));
    assert!(material["relative_rms_error"].as_f64().unwrap() <= 0.005, "{material}");
    assert!(material["pairs"].as_f64() < material["full_table_pairs"].as_f64(), "{material}");
    for file in ["out.png", "out.exr"] {
        let bytes = std::fs::read(folder.path(file)).unwrap();
        for word in ["biscale render", "relative RMS error"] {
            assert!(bytes.windows(word.len()).any(|w| w == word.as_bytes()), "{file} does not say {word:?}");
        }
    }
    // What the command made it replaces; anything else it does not.
    done(&folder.run(RENDER));
    folder.write("out.png", "a picture of mine");
    assert_eq!(folder.run(RENDER).status, 2);
    assert_eq!(folder.read("out.png"), "a picture of mine");
    done(&folder.run(RENDER.iter().chain(&["--force"])));
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let folder = folder();
    for (threads, file) in [("1", "one.exr"), ("2", "two.exr"), ("5", "five.exr")] {
        done(&folder.run(["render", "scene.toml", "-o", file, "--threads", threads]));
    }
    let bytes = |file: &str| std::fs::read(folder.path(file)).unwrap();
    assert!(bytes("one.exr") == bytes("two.exr") && bytes("one.exr") == bytes("five.exr"));
}

#[test]
fn another_material_takes_the_place_of_the_first() {
    let folder = folder();
    folder.write("bright.toml", folder.read("m.toml").replace("0.5", "1.0"));
    done(&folder.run(["render", "scene.toml", "-o", "a.exr"]));
    done(&folder.run(["render", "scene.toml", "-o", "b.exr", "--material", "bright.toml"]));
    let said = folder.run(["compare", "b.exr", "a.exr", "--json"]);
    done(&said);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert!((object["summary"]["relative_rms"].as_f64().unwrap() - 0.5).abs() < 1e-3, "{object}");
}

#[test]
fn check_and_new_know_scenes() {
    let folder = folder();
    let said = folder.run(["check", "scene.toml", "m.toml"]);
    done(&said);
    for word in ["scene.toml: ok", "16 x 12 pixels of 2 samples", "1 directional", "object[0] (sphere)", "plane (m.toml)", "m.toml: ok"] {
        assert!(said.stdout.contains(word), "no {word:?} in {}", said.stdout);
    }
    // Half of the ball is another material.
    image::GrayImage::from_fn(2, 1, |x, _| image::Luma([if x == 0 { 0 } else { 255 }])).save(folder.path("half.png")).unwrap();
    folder.write("layers.toml", format!("{SCENE}tint = 0.5\n[[object.layer]]\nmaterial = \"m.toml\"\nmask = \"half.png\"\n"));
    let said = folder.run(["check", "layers.toml"]);
    done(&said);
    for words in ["plane (m.toml), times tint", "over: plane (m.toml), mask of 2 x 1 pixels, uv"] {
        assert!(said.stdout.contains(words), "no {words:?} in {}", said.stdout);
    }
    let said = folder.run(["check", "layers.toml", "--json"]);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert!(said.stdout.contains("\"mask\":[2,1]") && said.stdout.contains("\"blend\":\"over\""), "{object}");
    // A scene names a material: the one command that writes it is told, and with it the scene is good.
    let said = folder.run(["new", "scene", "new.toml"]);
    assert!(said.stderr.contains("`biscale new grooves material.toml` writes the material that it names"), "{}", said.stderr);
    done(&folder.run(["new", "grooves", "material.toml"]));
    let said = folder.run(["check", "new.toml"]);
    assert_eq!((said.status, said.stdout.contains("object[1] (plane)")), (0, true), "{}", said.stderr);
}

#[test]
fn the_sample_scenes_and_figures_are_good() {
    for (name, least) in [("samples/scenes", 9), ("samples/scenes/chess", 4), ("samples/scenes/gallery", 9), ("samples/figures", 21)] {
        let entries = std::fs::read_dir(project(name)).unwrap().map(|e| e.unwrap().path());
        let files: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
        assert!(files.len() >= least, "{} files in {name}", files.len());
        let said = Folder::new().run(std::iter::once("check".as_ref()).chain(files.iter().map(|f| f.as_os_str())));
        done(&said);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn progress_is_shown_and_ctrl_c_leaves_no_picture() {
    use std::io::{BufRead, BufReader, Read};
    let folder = folder();
    let large = SCENE.replace("width = 16\nheight = 12\nsamples = 2", "width = 1024\nheight = 1024\nsamples = 64");
    let material = project("samples/towel.toml");
    folder.write("scene.toml", large);
    let before = folder.snapshot();
    let mut child = folder
        .command(RENDER.iter().map(AsRef::as_ref).chain(["--material".as_ref(), material.as_os_str()]))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert!(line.contains(" % after "), "no progress: {line:?}");
    let kill = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest}");
    assert!(folder.snapshot() == before, "something was left");
}

#[test]
fn the_exposure_is_chosen_by_the_picture_and_cut_pixels_are_told() {
    let folder = folder();
    let shown = |arguments: &[&str]| -> (f64, f64, String) {
        let said = folder.run(RENDER.iter().chain(arguments).chain(&["--json"]));
        done(&said);
        let object: Value = serde_json::from_str(&said.stdout).unwrap();
        let shown = &object["summary"]["shown"];
        (shown["exposure"].as_f64().unwrap(), shown["clipped"].as_f64().unwrap(), object["summary"]["notes"].to_string())
    };
    let (stops, clipped, notes) = shown(&["--exposure", "6"]);
    assert!(stops == 6.0 && clipped > 0.05 && notes.contains("`--exposure auto` would take"), "{clipped}: {notes}");
    let (auto, clipped, notes) = shown(&["--exposure", "auto"]);
    assert!(auto < 6.0 && clipped <= 0.01 && !notes.contains("brighter than white"), "{auto}, {clipped}: {notes}");
    // A scene may ask for it, and the command line has the last word.
    folder.write("scene.toml", SCENE.replace("format = 1", "format = 1\nexposure = \"auto\""));
    assert_eq!(shown(&[]).0, auto);
    assert_eq!(shown(&["--exposure", "1.5"]).0, 1.5);
    folder.write("scene.toml", SCENE.replace("format = 1", "format = 1\nexposure = 99"));
    let said = folder.run(RENDER);
    assert!(said.status == 2 && said.stderr.contains("scene.toml:2: exposure"), "{}", said.stderr);
}

#[test]
fn the_error_of_the_lights_of_an_environment_is_told_and_chooses_their_number() {
    let folder = folder();
    std::fs::copy(project("samples/scenes/studio.hdr"), folder.path("studio.hdr")).unwrap();
    let sampling = |lights: &str| -> Value {
        let light = SCENE.find("[[light]]").unwrap()..SCENE.find("[[object]]").unwrap();
        folder.write("scene.toml", SCENE.replace(&SCENE[light], &format!("[environment]\nfile = \"studio.hdr\"\n{lights}")));
        let said = folder.run(RENDER.iter().chain(&["--json", "--tolerance", "0.03"]));
        done(&said);
        let object: Value = serde_json::from_str(&said.stdout).unwrap();
        object["summary"]["light_sampling"].clone()
    };
    let error = |sampling: &Value| sampling["error_of_lights"].as_f64().unwrap();
    let (few, many, chosen) = (sampling("lights = 8\n"), sampling("lights = 128\n"), sampling(""));
    assert!(few["lights"] == 8 && few["chosen"] == false && error(&few) > 2.0 * error(&many), "{few} {many}");
    let lights = chosen["lights"].as_u64().unwrap();
    assert!(chosen["chosen"] == true && (32..=128).contains(&lights), "{chosen}");
    assert!(lights == 128 || 1.5 * error(&chosen) <= 0.03, "{chosen}");
}

#[test]
fn a_plan_fixes_the_values_of_a_picture_in_the_light_of_a_whole_environment() {
    let folder = folder();
    std::fs::copy(project("samples/scenes/studio.hdr"), folder.path("studio.hdr")).unwrap();
    let light = SCENE.find("[[light]]").unwrap()..SCENE.find("[[object]]").unwrap();
    folder.write("scene.toml", SCENE.replace(&SCENE[light], "[environment]\nfile = \"studio.hdr\"\n"));
    let render = |plan: &str, threads: &str| -> (String, Vec<u8>) {
        let arguments = [
            "render",
            "scene.toml",
            "-o",
            "out.exr",
            "--lighting",
            "sg",
            "--tolerance",
            "0.5",
            "--json",
            "--threads",
            threads,
            "--plan",
            plan,
        ];
        let said = folder.run(arguments);
        done(&said);
        let object: Value = serde_json::from_str(&said.stdout).unwrap();
        let response = &object["summary"]["environment"]["responses"][0];
        (response["plan"].as_str().unwrap().to_owned(), std::fs::read(folder.path("out.exr")).unwrap())
    };
    let (plan, picture) = render("direct:64x1", "1");
    assert_eq!(plan, "direct:64x1");
    assert!(render(&plan, "2").1 == picture, "the same plan gives other bits at two threads");
    let (lobes, _) = render("sg:improved:facets=512:lobes=2:modes=2", "1");
    assert!(lobes.starts_with("sg:improved:facets=512:lobes=2:modes=2"), "{lobes}");
}
