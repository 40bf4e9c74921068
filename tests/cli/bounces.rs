//! Reflections after the first that a material file asks for, and who says how many there are.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::{Folder, Said};

/// Two balls side by side, each with a material of its own, in a picture of 16 columns.
const SCENE: &str = "format = 1
[camera]
origin = [0, -6, 0]
target = [0, 0, 0]
up = [0, 0, 1]
fov_deg = 40
width = 16
height = 8
samples = 1
[[light]]
type = \"directional\"
to_light = [-0.2, -1, 0.4]
irradiance_rgb = 3
[[object]]
kind = \"sphere\"
material = \"plain.toml\"
center = [-1.2, 0, 0]
radius = 1
[[object]]
kind = \"sphere\"
material = \"m.toml\"
center = [1.2, 0, 0]
radius = 1
";

/// A V-groove of 90 degrees with white walls, which light each other; `head` stands before the geometry.
fn grooves(head: &str) -> String {
    format!(
        "format = 1\n{head}[geometry]\nkind = \"grooves\"\nprofile = \"v\"\ndepth = 0.5\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.9 }}\n"
    )
}

/// `plain.toml` says nothing of bounces, `m.toml` two.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("plain.toml", grooves("name = \"plain\"\n"));
    folder.write("m.toml", grooves("name = \"walls\"\nbounces = 2 # the walls light each other\n"));
    folder.write("scene.toml", SCENE);
    folder
}

fn done(folder: &Folder, arguments: &[&str]) -> Said {
    let said = folder.run(arguments);
    assert_eq!(said.status, 0, "{arguments:?}: {}", said.stderr);
    said
}

fn json(folder: &Folder, arguments: &[&str]) -> Value {
    serde_json::from_str(&done(folder, &[arguments, &["--json"]].concat()).stdout).unwrap()
}

/// Arguments that compute values of a material.
fn eval<'a>(material: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["eval", material, "--pairs", "p.csv", "--tolerance", "0.02"], more].concat()
}

#[test]
fn eval_obeys_the_material_unless_the_option_or_a_plan_says_another_number() {
    let folder = folder();
    let values = |material: &str, more: &[&str]| done(&folder, &eval(material, more)).stdout;
    let [none, two] = ["0", "2"].map(|n| values("plain.toml", &["--bounces", n]));
    assert_ne!(none, two, "white walls light each other");
    assert_eq!(values("m.toml", &[]), two);
    assert_eq!(values("m.toml", &["--bounces", "0"]), none);
    assert_eq!(values("plain.toml", &[]), none);
    for (more, number, said_by, told) in [
        (&[][..], 2, "material", "2 reflections after the first, as the material says\n"),
        (&["--bounces", "0"], 0, "option", "direct light only, as `--bounces` says (the material: 2)\n"),
        (&["--plan", "direct:2048x1"], 0, "plan", "direct light only, as the plan says (the material: 2)\n"),
    ] {
        let said = done(&folder, &eval("m.toml", more));
        assert!(said.stderr.contains(told), "{}", said.stderr);
        let summary = &json(&folder, &eval("m.toml", more))["summary"];
        assert_eq!((&summary["bounces"], &summary["bounces_said_by"]), (&number.into(), &said_by.into()), "{summary}");
        // What the summary prints repeats the bits of it, without the option.
        let plan = summary["plan"].as_str().unwrap();
        assert_eq!(plan.contains("bounces=2"), number == 2, "{plan}");
        assert_eq!(values("m.toml", &["--plan", plan]), said.stdout);
    }
    let plain = done(&folder, &eval("plain.toml", &[]));
    assert!(!plain.stderr.contains("direct light") && !plain.stderr.contains("reflections"), "{}", plain.stderr);
}

#[test]
fn tables_hold_their_number_and_plots_tell_it() {
    let folder = folder();
    // A plan of few rays: at a tolerance the probes of a table would take a minute.
    let plan = "reference:bounces=2:first=1";
    for material in ["m.toml", "plain.toml"] {
        let summary = &json(&folder, &["bake", material, "-o", "table.exr", "--resolution", "4", "--plan", plan, "--force"])["summary"];
        assert_eq!(
            (&summary["bounces"], &summary["bounces_said_by"], &summary["plan"]),
            (&2.into(), &"plan".into(), &plan.into()),
            "{summary}"
        );
        // Rays of their own for light and viewer and for both exchanged are noise, and no sign of a surface that is not reciprocal.
        assert_eq!(summary["reciprocal"], true, "{summary}");
        let summary = &json(&folder, &["eval", "table.exr", "--pairs", "p.csv"])["summary"];
        assert_eq!((&summary["bounces"], &summary["bounces_said_by"]), (&2.into(), &"table".into()), "{summary}");
    }
    let said = done(&folder, &["plot", "m.toml", "-o", "plots", "--no-view", "--tolerance", "0.1", "--incidence", "30"]);
    assert!(said.stderr.contains("2 reflections after the first, as the material says"), "{}", said.stderr);
}

#[test]
fn each_material_of_a_scene_obeys_its_own() {
    let folder = folder();
    let render = |output: &str, more: &[&str]| {
        let render = ["render", "scene.toml", "-o", output, "--tolerance", "0.1"];
        let summary = json(&folder, &[&render[..], more].concat())["summary"].take();
        (summary, biscale::image_file::read(&folder.path(output)).unwrap().channels)
    };
    let (summary, own) = render("own.exr", &[]);
    let of = |name: &str| summary["materials"].as_array().unwrap().iter().find(|m| m["material"] == name).unwrap().clone();
    let (plain, walls) = (of("plain"), of("walls"));
    assert_eq!((&plain["method"], &plain["bounces"], &plain["bounces_said_by"]), (&"direct".into(), &0.into(), &"default".into()));
    assert_eq!((&walls["method"], &walls["bounces"], &walls["bounces_said_by"]), (&"reference".into(), &2.into(), &"material".into()));
    let [none, two] = ["0", "2"].map(|n| render(&format!("{n}.exr"), &["--bounces", n]).1);
    let half = |picture: &[Vec<f32>], right: bool| -> Vec<f32> {
        picture.iter().flatten().enumerate().filter(|(k, _)| (k % 16 >= 8) == right).map(|(_, v)| *v).collect()
    };
    assert_eq!(half(&own, false), half(&none, false), "the left ball is lit directly");
    assert_eq!(half(&own, true), half(&two, true), "the right one has two reflections more");
    assert_ne!(half(&own, true), half(&none, true));
    let check = done(&folder, &["check", "scene.toml"]).stdout;
    assert!(check.contains("plain: method direct") && check.contains("walls: method reference"), "{check}");
}

#[test]
fn a_method_without_them_is_refused_with_the_key_the_file_and_the_remedy() {
    let folder = folder();
    for method in ["direct", "lowrank", "sg"] {
        let commands: [&[&str]; 5] = [
            &["eval", "m.toml", "--pairs", "p.csv"],
            &["bake", "m.toml", "-o", "out.exr"],
            &["plot", "m.toml", "-o", "out"],
            &["render", "scene.toml", "-o", "out.png"],
            &["check", "m.toml", "scene.toml"],
        ];
        for command in commands {
            let said = folder.run([command, &["--method", method]].concat());
            assert_eq!(said.status, 2, "{command:?}: {}", said.stderr);
            for piece in ["m.toml: ", "`bounces = 2`", &format!("`--method {method}`"), "`--bounces 0`", "`--method reference`"] {
                assert!(said.stderr.contains(piece), "{command:?} without {piece}: {}", said.stderr);
            }
        }
        assert_eq!(folder.run(["check", "m.toml", "scene.toml", "--method", method, "--bounces", "0"]).status, 0);
    }
    assert!(!folder.path("out.exr").exists() && !folder.path("out.png").exists());
}

#[test]
fn a_number_out_of_range_and_a_key_in_the_wrong_table_are_refused_by_their_line() {
    let folder = folder();
    for (text, pieces) in [
        (grooves("bounces = 65\n"), ["b.toml:2", "bounces", "64"]),
        (grooves("bounces = -1\n"), ["b.toml:2", "bounces", "-1"]),
        (grooves("bounces = 1.5\n"), ["b.toml:2", "bounces", "whole number"]),
        (grooves("").replace("depth = 0.5", "depth = 0.5\nbounces = 2"), ["b.toml:6", "bounces", "geometry"]),
    ] {
        folder.write("b.toml", &text);
        let said = folder.run(["check", "b.toml"]);
        assert!(said.status == 2 && pieces.iter().all(|p| said.stderr.contains(p)), "{pieces:?}: {}", said.stderr);
    }
}

#[test]
fn a_study_says_that_it_is_one_of_direct_light() {
    let folder = folder();
    let study =
        ["study", "m.toml", "-o", "out", "--quick", "--no-pictures", "--methods", "direct", "--truth-time", "1s", "--pairs", "p.csv"];
    let said = done(&folder, &study);
    assert!(said.stderr.contains("direct light only; the `bounces = 2` of the material"), "{}", said.stderr);
    let records = folder.read("out/study.csv");
    assert!(!records.contains("bounces=2") && records.lines().filter(|l| l.contains(",done,")).count() > 3, "{records}");
    assert!(folder.read("out/report.html").contains("light: direct light only"));
}
