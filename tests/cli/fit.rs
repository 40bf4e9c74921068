//! `biscale fit` through the binary: what it writes, what it says, and what it refuses.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use std::path::Path;
use support::Folder;

/// Grooves on a cylinder, photographed by `render`.
const TRUTH: &str = "format = 1\nname = \"truth\"\n[geometry]\nkind = \"grooves\"\nprofile = \"v\"\ndepth = 0.4\n[[surface]]\npart = \"left\"\n\
                     brdf = { model = \"lambert\", albedo = [0.6, 0.3, 0.1] }\n[[surface]]\npart = \"right\"\n\
                     brdf = { model = \"lambert\", albedo = [0.1, 0.3, 0.6] }\n";
const CAMERA: &str = "[camera]\norigin = [0, -12, 0]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\nfov_deg = 11\nwidth = 48\nheight = 24\n";
const OBJECT: &str = "kind = \"cylinder\"\nradius = 1\nheight = 1.5\n";
const LIGHTS: [&str; 2] = ["[0.4, -0.8, 0.3]", "[-0.7, -0.5, 0.2]"];

fn light(to: &str) -> String {
    format!("type = \"directional\"\nto_light = {to}\nirradiance_rgb = 3.0\n")
}

/// A folder with the photographs `b.exr` and `c.exr`, a start material, and a fit file.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("truth.toml", TRUTH);
    for (name, to) in ["b", "c"].into_iter().zip(LIGHTS) {
        folder.write("s.toml", format!("format = 1\n{CAMERA}[[light]]\n{}[[object]]\n{OBJECT}material = \"truth.toml\"\n", light(to)));
        let image = format!("{name}.exr");
        let said = folder.run(["render", "s.toml", "-o", &image, "--tolerance", "0.01", "--force"]);
        assert_eq!(said.status, 0, "{}", said.stderr);
    }
    folder.write("start.toml", TRUTH.replace("0.4", "0.3 # deep").replace("0.6, 0.3, 0.1", "0.4, 0.3, 0.2"));
    folder.write("fit.toml", fit_file());
    folder
}

fn fit_file() -> String {
    let photograph = |role: &str, image: &str, to: &str| {
        format!("[[photograph]]\nrole = \"{role}\"\nimage = \"{image}\"\n[photograph.light]\n{}", light(to))
    };
    format!(
        "format = 1\nname = \"fitted\"\nmaterial = \"start.toml\"\nbounces = 0\nlight_sigma_deg = 0\n{CAMERA}[object]\n{OBJECT}{}{}\
         [[parameter]]\nkey = \"geometry.depth\"\nbounds = [0.1, 1.0]\n[[colour]]\nkey = \"surface.left.brdf.albedo\"\n\
         [[colour]]\nkey = \"surface.right.brdf.albedo\"\n",
        photograph("distant", "b.exr", LIGHTS[0]),
        photograph("validation", "c.exr", LIGHTS[1])
    )
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

fn value(result: &Value, name: &str) -> f64 {
    result["unknowns"].as_array().unwrap().iter().find(|u| u["name"] == name).unwrap()["value"].as_f64().unwrap()
}

#[test]
fn a_fit_of_the_models_own_picture_finds_what_it_was_made_of_at_any_thread_count_and_when_it_is_resumed() {
    let folder = folder();
    let check = folder.run(["check", "fit.toml"]);
    assert!(check.status == 0 && check.stdout.contains("geometry.depth"), "{}{}", check.stdout, check.stderr);
    let said = folder.run(["fit", "fit.toml", "-o", "out", "--starts", "3", "--threads", "1"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stdout.starts_with("PASS: training error") && said.stderr.contains("geometry.depth"), "{}", said.stderr);
    let result = json(&folder.path("out/fit.json"));
    assert_eq!(result["verdict"], "pass");
    assert!((value(&result, "geometry.depth") / 0.4 - 1.0).abs() < 0.03, "{result}");
    assert!((value(&result, "surface.left.brdf.albedo red") / 0.6 - 1.0).abs() < 0.03, "{result}");
    // The fitted material is one, keeps its comments, and looks as the photograph.
    let material = std::fs::read_to_string(folder.path("out/material.toml")).unwrap();
    assert!(material.contains("# deep") && material.contains("name = \"fitted\""), "{material}");
    folder.write(
        "s.toml",
        format!("format = 1\n{CAMERA}[[light]]\n{}[[object]]\n{OBJECT}material = \"out/material.toml\"\n", light(LIGHTS[1])),
    );
    let said = folder.run(["render", "s.toml", "-o", "again.exr", "--tolerance", "0.01"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let compared = folder.run(["compare", "c.exr", "again.exr", "--json"]);
    let difference: Value = serde_json::from_str(&compared.stdout).unwrap();
    assert!(difference["summary"]["relative_rms"].as_f64().unwrap() < 0.03, "{difference}");
    let report = std::fs::read_to_string(folder.path("out/report.html")).unwrap();
    // The surface that was found, and two photographs.
    assert!(report.matches("data:image/png;base64,").count() == 3 && !report.contains("src=\"http"), "{}", report.len());
    // Once more on two threads, and half of it again from the evaluations of the first.
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    let said = folder.run(["fit", "fit.toml", "-o", "two", "--starts", "3", "--threads", "2", "--quiet"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let trace = String::from_utf8(read("out/evaluations.csv")).unwrap();
    let half: Vec<&str> = trace.lines().take(trace.lines().count() / 2).collect();
    std::fs::create_dir(folder.path("three")).unwrap();
    folder.write("three/evaluations.csv", half.join("\n") + "\n");
    let said = folder.run(["fit", "fit.toml", "-o", "three", "--starts", "3", "--resume", "--quiet"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    for name in ["fit.json", "material.toml", "evaluations.csv", "report.html", "pictures.png"] {
        assert!(read(&format!("out/{name}")) == read(&format!("two/{name}")), "{name} depends on threads");
        assert!(read(&format!("out/{name}")) == read(&format!("three/{name}")), "{name} depends on the resumption");
    }
    // The evaluations of another question are refused, and nothing is replaced that is not ours.
    let said = folder.run(["fit", "fit.toml", "-o", "out", "--starts", "4", "--resume"]);
    assert!(said.status == 2 && said.stderr.contains("another fit file"), "{}", said.stderr);
    folder.write("three/report.html", "mine");
    let said = folder.run(["fit", "fit.toml", "-o", "three", "--starts", "3", "--resume"]);
    assert!(said.status == 2 && said.stderr.contains("--force"), "{}", said.stderr);
}

#[test]
fn a_held_out_photograph_of_unknown_exposure_is_scaled_and_says_by_how_much() {
    let folder = folder();
    let (fitted, held_out) = fit_file().split_once("role = \"validation\"").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    // Its light was 1.5 times as bright as the file believes.
    let guessed = held_out.replacen("irradiance_rgb = 3.0", "irradiance_rgb = 2.0", 1);
    for (known, passes) in [("", false), ("exposure_known = false\n", true)] {
        folder.write("guess.toml", format!("{fitted}role = \"validation\"\n{known}{guessed}"));
        let said = folder.run(["fit", "guess.toml", "-o", "out", "--starts", "2", "--force"]);
        assert_eq!(said.status, i32::from(!passes), "{known}: {}", said.stderr);
        let result = json(&folder.path("out/fit.json"));
        let validation = &result["validation"][0];
        assert_eq!(validation["verdict"], if passes { "pass" } else { "fail" }, "{validation}");
        if passes {
            assert!((validation["exposure"].as_f64().unwrap() / 1.5 - 1.0).abs() < 0.03, "{validation}");
            assert!(result["notes"].to_string().contains("it was scaled to fit"), "{}", result["notes"]);
        } else {
            assert!(validation["exposure"].is_null(), "{validation}");
        }
    }
}

#[test]
fn quiet_prints_the_verdict_and_why_a_fit_failed() {
    let folder = folder();
    let said = folder.run(["fit", "fit.toml", "-o", "out", "--starts", "2", "--quiet"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stdout.starts_with("PASS: training error") && said.stdout.lines().count() == 1, "{}", said.stdout);
    assert_eq!(said.stderr, "");
    // A light three times as bright as it was.
    let (fitted, held_out) = fit_file().split_once("role = \"validation\"").map(|(a, b)| (a.to_owned(), b.to_owned())).unwrap();
    folder.write(
        "bright.toml",
        format!("{fitted}role = \"validation\"{}", held_out.replacen("irradiance_rgb = 3.0", "irradiance_rgb = 9.0", 1)),
    );
    let said = folder.run(["fit", "bright.toml", "-o", "bright", "--starts", "2", "--quiet"]);
    assert_eq!(said.status, 1, "{}", said.stderr);
    assert!(said.stdout.starts_with("FAIL: training error") && said.stdout.lines().count() == 1, "{}", said.stdout);
    assert!(!said.stderr.is_empty() && said.stderr.lines().all(|line| line.starts_with("failure: ")), "{}", said.stderr);
}

#[test]
fn a_run_that_begins_anew_keeps_the_evaluations_of_an_earlier_one() {
    let folder = folder();
    let run = |starts: &str, more: &[&str]| {
        let said = folder.run([&["fit", "fit.toml", "-o", "out", "--starts", starts], more].concat());
        assert_eq!(said.status, 0, "{}", said.stderr);
        said.stderr
    };
    let kept = |number: u32| folder.path(&format!("out/evaluations-{number}.csv"));
    run("2", &[]);
    let first = folder.read("out/evaluations.csv");
    // The same once more: nothing is lost.
    assert!(!run("2", &[]).contains("evaluations"), "nothing to tell");
    assert!(folder.read("out/evaluations.csv") == first && !kept(1).exists());
    let said = run("3", &[]);
    assert!(said.contains("evaluations-1.csv") && said.contains("--resume"), "{said}");
    assert_eq!(folder.read("out/evaluations-1.csv"), first);
    // What is kept goes on, and is never replaced.
    std::fs::create_dir(folder.path("again")).unwrap();
    folder.write("again/evaluations.csv", &first);
    assert_eq!(folder.run(["fit", "fit.toml", "-o", "again", "--starts", "2", "--resume"]).status, 0);
    run("4", &["--json"]);
    assert!(kept(2).exists() && folder.read("out/evaluations-1.csv") == first);
    run("2", &["--force"]);
    assert!(!kept(3).exists(), "--force keeps none");
}

/// That two folders hold the same outcome.
fn assert_same(folder: &Folder, a: &str, b: &str) {
    let read = |folder_name: &str, name: &str| std::fs::read(folder.path(folder_name).join(name)).unwrap();
    let differs = |name: &&str| read(a, name) != read(b, name);
    let different: Vec<&str> = OUTPUTS.into_iter().filter(differs).collect();
    assert!(different.is_empty(), "{different:?} of {a} and {b} differ");
}

/// What a fit writes.
const OUTPUTS: [&str; 5] = ["fit.json", "material.toml", "evaluations.csv", "report.html", "pictures.png"];

/// Evaluations of a trace.
fn evaluations(path: &Path) -> usize {
    std::fs::read_to_string(path).unwrap().lines().count() - 2
}

#[test]
fn a_time_limit_is_that_of_the_whole_fit_and_what_did_not_fit_is_named_and_made_when_it_is_resumed() {
    let folder = folder();
    let said = folder.run(["fit", "fit.toml", "-o", "whole", "--starts", "64"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let begun = std::time::Instant::now();
    let said = folder.run(["fit", "fit.toml", "-o", "out", "--starts", "64", "--time-limit", "100ms"]);
    // Once the photographs are read, what cannot be left out takes .1 s. Machines that are busy are slow.
    assert!(begun.elapsed().as_secs_f64() < 2.0, "{:?}", begun.elapsed());
    assert!(said.status == 0 || said.status == 1, "{}", said.stderr);
    assert!(said.stderr.contains("time limit") && said.stderr.contains("left out"), "{}", said.stderr);
    let result = json(&folder.path("out/fit.json"));
    let search = &result["search"];
    assert_eq!(search["ended_early"], "time-limit");
    // No unknown has a standard deviation that was not computed, and no photograph a verdict.
    let left_out = result["left_out"].as_array().unwrap();
    let lacks = |part: &str| left_out.iter().any(|l| l == part);
    assert!(lacks("profiles") && result["notes"].to_string().contains("left out"), "{left_out:?}");
    assert_eq!(result["unknowns"][0]["sigma"].is_null(), lacks("standard deviations"), "{result}");
    assert_eq!(result["validation"].as_array().unwrap().is_empty(), lacks("validation"), "{result}");
    assert!(!lacks("validation") || result["verdict"] != "pass", "{result}");
    // The starts add up to what was evaluated.
    let of_starts: u64 = search["starts"].as_array().unwrap().iter().map(|s| s["evaluations"].as_u64().unwrap()).sum();
    assert_eq!(search["evaluations"].as_u64().unwrap(), of_starts, "{search}");
    // "--resume goes on".
    let said = folder.run(["fit", "fit.toml", "-o", "out", "--starts", "64", "--resume", "--quiet"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert_same(&folder, "whole", "out");
}

#[cfg(target_os = "linux")]
#[test]
fn a_search_that_is_killed_goes_on_from_what_it_had_evaluated_and_ends_as_if_it_had_not_been() {
    let folder = folder();
    let arguments = |out: &'static str| ["fit", "fit.toml", "-o", out, "--starts", "256", "--quiet", "--threads", "1"];
    let said = folder.run(arguments("whole"));
    assert_eq!(said.status, 0, "{}", said.stderr);
    let mut child = folder.command(arguments("out")).spawn().unwrap();
    let trace = folder.path("out/evaluations.csv");
    while !trace.exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it wrote any evaluations");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // As if it had been killed while it wrote: a temporary file of its number that nobody holds.
    let host: String = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap().chars().filter(char::is_ascii_alphanumeric).collect();
    let half = format!("out/.biscale-{host}-{}-abcdef.part", child.id());
    folder.write(&half, "half");
    let kept = evaluations(&trace);
    assert!(kept > 0 && kept < evaluations(&folder.path("whole/evaluations.csv")), "{kept}");
    let said = folder.run(arguments("out").into_iter().chain(["--resume"]));
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert_same(&folder, "whole", "out");
    assert!(!folder.path(&half).exists());
}

#[test]
fn what_cannot_be_fitted_is_told_by_file_line_and_field() {
    let folder = folder();
    let before = folder.snapshot();
    for (old, new, words) in [
        ("role = \"distant\"", "role = \"near\"", &["bad.toml:", "photograph[0].role", "distant"][..]),
        ("geometry.depth", "geometry.dept", &["parameter[0].key", "`depth`"]),
        ("geometry.depth", "surface.left.brdf.alpha", &["parameter[0].key"]),
        ("surface.left.brdf.albedo", "surface.middle.brdf.albedo", &["colour[0].key", "left"]),
        ("surface.left.brdf.albedo", "surface.left.tint", &["colour[0].key"]),
        ("[0.1, 1.0]", "[1.0, 0.1]", &["parameter[0].bounds"]),
        ("[0.1, 1.0]", "[0.5, 1.0]", &["parameter[0].bounds", "starts at 0.3"]),
        ("width = 48", "width = 47", &["photograph[0].image", "47"]),
        ("\"b.exr\"", "\"d.exr\"", &["photograph[0].image"]),
        ("\"b.exr\"", "\"start.toml\"", &["start.toml"]),
        ("role = \"distant\"", "role = \"validation\"", &["no photograph to fit"]),
        ("origin = [0, -12, 0]", "origin = [0, 12, 0]", &["no pixel can be used", "light"]),
        ("target = [0, 0, 0]", "target = [0, -24, 0]", &["no pixel can be used", "camera"]),
        ("material = \"start.toml\"", "material = \"fit.toml\"", &["fit.toml"]),
        ("key = \"surface.right.brdf.albedo\"", "key = \"surface.left.brdf.albedo\"", &["moved twice"]),
    ] {
        assert!(fit_file().contains(old), "{old}");
        folder.write("bad.toml", fit_file().replace(old, new));
        let said = folder.run(["fit", "bad.toml", "-o", "out"]);
        assert_eq!(said.status, 2, "{old} -> {new}: {}", said.stderr);
        assert!(words.iter().all(|w| said.stderr.contains(w)), "{old} -> {new}: {}", said.stderr);
    }
    std::fs::remove_file(folder.path("bad.toml")).unwrap();
    assert!(folder.snapshot() == before, "something was written");
}

#[test]
fn new_fit_writes_a_template_and_refuses_a_folder_that_is_no_capture() {
    let folder = folder();
    let said = folder.run(["new", "fit", "mine.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let text = std::fs::read_to_string(folder.path("mine.toml")).unwrap();
    assert!(text.contains("[[photograph]]") && text.contains("[[parameter]]") && text.contains("[[colour]]"));
    std::fs::create_dir(folder.path("captured")).unwrap();
    let said = folder.run(["new", "fit", "captured", "other.toml"]);
    assert!(said.status == 2 && said.stderr.contains("capture.json"), "{}", said.stderr);
}

#[test]
fn photographs_choose_between_structures_and_say_what_they_cannot_tell_apart() {
    let folder = folder();
    let text = fit_file();
    // All that may move is what each structure has.
    let tables = text.find("[[parameter]]").unwrap();
    let named = "moves = \"all\"\nstructures = [\"grooves\", \"v-grooves\"]\nreflectances = [\"lambert\", \"gloss\"]\n[camera]";
    folder.write("choice.toml", text[..tables].replacen("[camera]", named, 1));
    let said = folder.run(["fit", "choice.toml", "-o", "chosen", "--starts", "2"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stdout.contains("\"v-grooves, lambert\" of 4 candidates"), "{}", said.stdout);
    let choice = &json(&folder.path("chosen/fit.json"))["choice"]["of"];
    let candidates = choice["candidates"].as_array().unwrap();
    let of = |name: &str| candidates.iter().find(|c| c["name"] == name).unwrap();
    assert_eq!(of("v-grooves, gloss")["tied"], true, "a gloss of nothing is no other material: {choice}");
    assert!(of("grooves, lambert")["tied"] == false && of("grooves, gloss")["tied"] == false, "{choice}");
    assert!(std::fs::read_to_string(folder.path("chosen/material.toml")).unwrap().contains("profile = \"v\""));
}
