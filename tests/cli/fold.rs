//! `biscale fold` from end to end: what it writes folds to the design, by two independent checks.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test that meets the unexpected should panic, and says what it skips")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use std::path::PathBuf;
use std::process::Command;
use support::{Folder, Said, project};

/// The path of a sample as an argument.
fn sample(name: &str) -> String {
    project(&format!("samples/{name}")).display().to_string()
}

/// Samples and meshes, with arguments that make them of a size to fold.
fn subjects() -> Vec<(String, Vec<&'static str>)> {
    let mut all = vec![
        (sample("grooves-two-hue.toml"), vec!["--periods", "8x4", "--scale", "2"]),
        (sample("v-grooves.toml"), vec!["--scale", "10", "--periods", "16x6"]),
        (sample("pyramids.toml"), vec!["--scale", "400", "--periods", "4x4"]),
        (sample("pyramids-pentagon.toml"), vec!["--scale", "600", "--periods", "3x2"]),
        (sample("studs.toml"), vec!["--scale", "4", "--periods", "2x2"]),
        (sample("velvet-rods.toml"), vec!["--scale", "300", "--periods", "1x1", "--force"]),
        (sample("hammered.toml"), vec!["--scale", "8", "--periods", "1x1", "--max-facets", "120"]),
        (
            sample("gelsight-gold.toml"),
            vec!["--scale", "10", "--periods", "1x1", "--slope-tolerance", "12", "--max-facets", "400", "--force"],
        ),
        (project("tests/data/folds/icosahedron.obj").display().to_string(), vec!["--scale", "30"]),
    ];
    match std::env::var_os("BISCALE_DATA").map(|d| PathBuf::from(d).join("meshes")) {
        None => println!("skipped bunny, spot, teapot and fandisk: BISCALE_DATA is not set"),
        Some(meshes) => {
            for (name, scale) in [("bunny.stl", "1.5"), ("spot.obj", "100"), ("teapot.obj", "20"), ("fandisk.obj", "30")] {
                all.push((meshes.join(name).display().to_string(), vec!["--scale", scale, "--force", "--effort", "0.05"]));
            }
            for (name, scale, facets) in [("stanford-bunny.obj", "1000", "300"), ("teapot.obj", "20", "200"), ("fandisk.obj", "30", "150")]
            {
                all.push((meshes.join(name).display().to_string(), vec!["--scale", scale, "--force", "--max-facets", facets]));
            }
        }
    }
    all
}

fn fold(folder: &Folder, source: &str, out: &str, arguments: &[&str]) -> Said {
    folder.run([&["fold", source, "-o", out], arguments].concat())
}

/// The first file of an output of one page or several.
fn first(folder: &Folder, stem: &str, ending: &str) -> String {
    let one = format!("{stem}.{ending}");
    if folder.path(&one).exists() { one } else { format!("{stem}-1.{ending}") }
}

#[test]
fn every_sample_and_mesh_folds_to_its_design_without_an_overlap() {
    let folder = Folder::new();
    let mut patterns = Vec::new();
    for (k, (source, arguments)) in subjects().iter().enumerate() {
        let (svg, pattern) = (format!("s{k}.svg"), format!("f{k}.fold"));
        for out in [&svg, &pattern] {
            let said = fold(&folder, source, out, arguments);
            assert_eq!(said.status, 0, "{source}: {}", said.stderr);
        }
        for file in [first(&folder, &format!("s{k}"), "svg"), pattern.clone()] {
            let said = folder.run(["fold", "--verify", &file, "--against", source, "--json"]);
            let report: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
            assert!(said.status == 0 && report["ok"] == true, "{source} as {file}: {}", said.stdout);
            let report = &report["report"];
            assert!(report["edge_length_error"].as_f64().unwrap() <= 1e-6 && report["position_error_mm"].as_f64().unwrap() <= 1e-4);
            assert!(report["overlaps"] == 0 && report["crossings"] == 0 && report["missing_or_double"] == 0, "{source}: {report}");
        }
        patterns.push(folder.path(&pattern));
    }
    // The same by other people's geometry.
    let python = project("target/validate-venv/bin/python");
    if !python.exists() {
        println!("skipped validate.py: scripts/setup.sh test installs what it uses");
        return;
    }
    let output = Command::new(python).arg(project("fabricate/validate.py")).args(&patterns).output().unwrap();
    assert!(output.status.success(), "{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), patterns.len());
}

#[test]
fn validate_py_finds_what_is_wrong() {
    let python = project("target/validate-venv/bin/python");
    if !python.exists() {
        println!("skipped: scripts/setup.sh test installs what validate.py uses");
        return;
    }
    let folder = Folder::new();
    assert_eq!(fold(&folder, &sample("pyramids.toml"), "p.fold", &["--scale", "400", "--periods", "2x2"]).status, 0);
    let good: serde_json::Value = serde_json::from_str(&folder.read("p.fold")).unwrap();
    let run = |value: &serde_json::Value| {
        folder.write("bad.fold", value.to_string());
        Command::new(&python).arg(project("fabricate/validate.py")).arg(folder.path("bad.fold")).output().unwrap()
    };
    assert!(run(&good).status.success());
    let mut angle = good.clone();
    let fold = angle["edges_assignment"].as_array().unwrap().iter().position(|a| a == "M").unwrap();
    angle["edges_foldAngle"][fold] = (-20.0).into();
    let overlap = overlapping(&good);
    let mut volume = good.clone();
    volume["biscale:recipe"]["design_volume_mm3"] = (good["biscale:recipe"]["design_volume_mm3"].as_f64().unwrap() * 1.01).into();
    for (name, value, word) in [("angle", angle, "differs"), ("overlap", overlap, "overlap"), ("volume", volume, "volume")] {
        let output = run(&value);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(1) && said.contains(word), "{name}: {said}");
    }
}

/// A pattern with a corner that belongs to one face only moved into a face that shares none with that one, so that both still run counter-clockwise.
fn overlapping(good: &serde_json::Value) -> serde_json::Value {
    let faces: Vec<Vec<usize>> = serde_json::from_value(good["faces_vertices"].clone()).unwrap();
    let at: Vec<[f64; 2]> = serde_json::from_value(good["vertices_coords"].clone()).unwrap();
    let mut bad = good.clone();
    for (k, face) in faces.iter().enumerate() {
        let own = |v: &usize| faces.iter().filter(|f| f.contains(v)).count() == 1;
        let Some(corner) = face.iter().position(own) else { continue };
        for other in faces.iter().enumerate().filter(|(l, f)| *l != k && !f.iter().any(|v| face.contains(v))).map(|(_, f)| f) {
            let middle = [0, 1].map(|c| other.iter().map(|&v| at[v][c]).sum::<f64>() / other.len() as f64);
            let (a, b) = (at[face[(corner + 1) % 3]], at[face[(corner + 2) % 3]]);
            if (b[0] - a[0]) * (middle[1] - a[1]) - (b[1] - a[1]) * (middle[0] - a[0]) > 1.0 {
                bad["vertices_coords"][face[corner]] = middle.to_vec().into();
                return bad;
            }
        }
    }
    panic!("no corner of one face only can be moved");
}

#[test]
fn the_verifier_finds_what_is_wrong() {
    let folder = Folder::new();
    let material = sample("pyramids.toml");
    assert_eq!(fold(&folder, &material, "p.svg", &["--scale", "400", "--periods", "2x2"]).status, 0);
    let page = folder.read("p-1.svg");
    let lines: Vec<&str> = page.lines().collect();
    let facets: Vec<usize> = (0..lines.len()).filter(|&k| lines[k].contains("data-facet=")).collect();
    let scores: Vec<usize> = (0..lines.len()).filter(|&k| lines[k].contains("data-edge=")).collect();
    let without = |k: usize| [&lines[..k], &lines[k + 1..]].concat().join("\n");
    let with = |k: usize, line: &str| [&lines[..k], &[line], &lines[k + 1..]].concat().join("\n");
    let attribute = |line: &str, name: &str| line.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap().to_owned();
    let points = attribute(lines[facets[3]], "points");
    let (x, rest) = points.split_once(',').unwrap();
    let moved = format!("{:.8},{rest}", x.parse::<f64>().unwrap() + 0.01);
    let angle = attribute(lines[scores[2]], "data-angle");
    let other = attribute(lines[facets[0]], "points");
    let cases = [
        ("a facet missing", without(facets[2]), "missing"),
        ("a facet twice", with(facets[2], &[lines[facets[2]], lines[facets[2]]].join("\n")), "double"),
        ("a corner moved by 0.01 mm", with(facets[3], &lines[facets[3]].replace(&points, &moved)), "length"),
        (
            "an angle off by 0.01 degrees",
            with(scores[2], &lines[scores[2]].replace(&angle, &format!("{}", angle.parse::<f64>().unwrap() + 0.01))),
            "fold is off",
        ),
        ("a fold line missing", without(scores[2]), "fold is off"),
        ("a facet on another one", with(facets[4], &lines[facets[4]].replace(&attribute(lines[facets[4]], "points"), &other)), "overlaps"),
        ("something in the margin", page.replace("<g id=\"print\"", "<polygon points=\"1,1 9,1 9,9\"/><g id=\"print\""), "margin"),
    ];
    for (name, text, word) in cases {
        folder.write("bad-1.svg", &text);
        let said = folder.run(["fold", "--verify", "bad-1.svg", "--against", &material]);
        assert!(said.status == 1 && said.stderr.contains("wrong: ") && said.stderr.contains(word), "{name}: {}", said.stderr);
    }
    // Without a word but its verdict.
    for (file, status, verdict) in [("p-1.svg", 0, "the pattern folds to the design\n"), ("bad-1.svg", 1, "the pattern is not right\n")] {
        let said = folder.run(["fold", "--verify", file, "--against", &material, "--quiet"]);
        assert_eq!((said.status, said.stdout.as_str()), (status, verdict), "{file}: {}", said.stderr);
        assert_eq!(said.stderr.is_empty(), status == 0, "{file}: {}", said.stderr);
    }
    // Another design than the one that the file was made from.
    let said = folder.run(["fold", "--verify", "p-1.svg", "--against", &sample("pyramids-pentagon.toml")]);
    assert!(said.status != 0, "{}", said.stderr);
}

#[test]
fn the_same_seed_gives_the_same_bytes_at_any_number_of_threads() {
    let folder = Folder::new();
    let bumps = sample("hammered.toml");
    let arguments = ["--scale", "8", "--periods", "1x1", "--max-facets", "120", "--effort", "0.3", "--force"];
    for (out, more) in [("a.fold", ["--threads", "1"]), ("b.fold", ["--threads", "2"]), ("c.fold", ["--seed", "5"])] {
        let said = fold(&folder, &bumps, out, &[&arguments[..], &more].concat());
        assert_eq!(said.status, 0, "{}", said.stderr);
    }
    assert_eq!(folder.read("a.fold"), folder.read("b.fold"));
    assert_ne!(folder.read("a.fold"), folder.read("c.fold"), "another seed searches elsewhere");
}

#[test]
fn a_time_limit_ends_the_search_and_says_so() {
    let folder = Folder::new();
    let arguments = ["--scale", "8", "--periods", "1x1", "--max-facets", "300", "--effort", "5000", "--time-limit", "300ms", "--force"];
    let begin = std::time::Instant::now();
    let said = fold(&folder, &sample("hammered.toml"), "a.fold", &arguments);
    assert!(said.status == 0 && said.stderr.contains("stopped by the time limit"), "{}", said.stderr);
    assert!(begin.elapsed().as_secs() < 60, "{:?}", begin.elapsed());
    let said = folder.run(["fold", "--verify", "a.fold", "--against", &sample("hammered.toml")]);
    assert_eq!(said.status, 0, "{}", said.stderr);
}

#[test]
fn thick_paper_and_split_facets_fold_to_what_their_recipe_says() {
    let folder = Folder::new();
    for (source, arguments) in [
        (sample("pyramids.toml"), &["--scale", "400", "--periods", "3x3", "--paper-thickness", "0.3"][..]),
        (sample("grooves-two-hue.toml"), &["--scale", "5", "--periods", "2x20", "--split", "--paper-thickness", "0.2"]),
        (project("tests/data/folds/icosahedron.obj").display().to_string(), &["--scale", "120", "--split"]),
    ] {
        let said = fold(&folder, &source, "t.svg", &[arguments, &["--force"]].concat());
        assert_eq!(said.status, 0, "{source}: {}", said.stderr);
        let said = folder.run(["fold", "--verify", "t-1.svg", "--against", &source]);
        assert_eq!(said.status, 0, "{source}: {}", said.stderr);
        for (path, _) in folder.snapshot() {
            if path.file_name().unwrap().to_string_lossy().starts_with("t") {
                std::fs::remove_file(path).unwrap();
            }
        }
    }
}

#[test]
fn a_weave_becomes_strips_that_go_over_and_under_as_its_draft_says() {
    let folder = Folder::new();
    for (name, arguments) in
        [("shot-silk.toml", ["--scale", "60", "--periods", "3x2"]), ("towel.toml", ["--scale", "10", "--periods", "1x1"])]
    {
        let said = fold(&folder, &sample(name), "w.svg", &[&arguments[..], &["--force"]].concat());
        assert_eq!(said.status, 0, "{name}: {}", said.stderr);
        let file = first(&folder, "w", "svg");
        let said = folder.run(["fold", "--verify", &file, "--against", &sample(name)]);
        assert!(said.status == 0 && said.stdout.ends_with("weave to the design\n"), "{name}: {}", said.stdout);
        let text = folder.read(&file);
        folder.write("bad.svg", text.replacen("data-over=\"1\"", "data-over=\"0\"", 1));
        // The same by other people's geometry, without the design.
        let python = project("target/validate-venv/bin/python");
        if python.exists() {
            let validate =
                |file: &str| Command::new(&python).arg(project("fabricate/validate.py")).arg(folder.path(file)).output().unwrap();
            let good = validate(&file);
            assert!(good.status.success(), "{name}: {}", String::from_utf8_lossy(&good.stderr));
            // The other pages are the same.
            let bad_first = if file.ends_with("-1.svg") { "bad-1.svg" } else { "bad.svg" };
            folder.write(bad_first, text.replacen("data-over=\"1\"", "data-over=\"0\"", 1));
            for page in 2..9 {
                if folder.path(&format!("w-{page}.svg")).exists() {
                    std::fs::copy(folder.path(&format!("w-{page}.svg")), folder.path(&format!("bad-{page}.svg"))).unwrap();
                }
            }
            let bad = validate(bad_first);
            let said = String::from_utf8_lossy(&bad.stderr);
            assert!(bad.status.code() == Some(1) && said.contains("both strips lie over or both under"), "{name}: {said}");
        } else {
            println!("skipped validate.py: scripts/setup.sh test installs what it uses");
        }
        let said = folder.run(["fold", "--verify", "bad.svg", "--against", &sample(name)]);
        assert!(said.status == 1 && said.stderr.contains("draft"), "{name}: {}", said.stderr);
        for (path, _) in folder.snapshot() {
            if path.extension().is_some_and(|e| e == "svg") {
                std::fs::remove_file(path).unwrap();
            }
        }
    }
}

#[test]
fn a_wrap_sheet_tells_where_its_markers_are() {
    let folder = Folder::new();
    let said = fold(
        &folder,
        &sample("grooves-two-hue.toml"),
        "w.svg",
        &["--on", "cylinder:radius=15,height=100", "--paper-thickness", "0.1", "--force"],
    );
    assert_eq!(said.status, 0, "{}", said.stderr);
    let sidecar: serde_json::Value = serde_json::from_str(&folder.read("w.json")).unwrap();
    let wrap = &sidecar["wrap"];
    // 2 pi 15.1 / 4 = 23.72 periods: 24 of 3.9532 mm.
    assert_eq!(wrap["fit"]["around"], 24);
    assert!((wrap["fit"]["pitch_mm"].as_f64().unwrap() - std::f64::consts::TAU * 15.1 / 24.0).abs() < 1e-9);
    assert_eq!(wrap["dictionary"], "DICT_5X5_100");
    let page = folder.read("w-1.svg");
    let document = roxmltree::Document::parse(&page).unwrap();
    for marker in wrap["markers"].as_array().unwrap() {
        let id = marker["id"].to_string();
        let drawn = document.descendants().find(|n| n.attribute("data-marker") == Some(&id)).expect("every marker is drawn");
        let points: Vec<f64> = drawn.attribute("points").unwrap().split([' ', ',']).map(|v| v.parse().unwrap()).collect();
        let corner = &marker["corners_mm"][3];
        assert!((points[0] - corner[0].as_f64().unwrap()).abs() < 1e-6, "marker {id}");
        assert!((297.0 - points[1] - corner[1].as_f64().unwrap()).abs() < 1e-6, "marker {id}");
    }
    let kinds: Vec<&str> = wrap["patches"].as_array().unwrap().iter().map(|p| p["kind"].as_str().unwrap()).collect();
    assert!(kinds.contains(&"design") && kinds.contains(&"grey") && kinds.contains(&"white"), "{kinds:?}");
    let lines = document.descendants().filter(|n| n.has_attribute("data-period")).count();
    assert_eq!(lines, 25, "24 periods and the first line again at the seam");
}

#[test]
fn the_preview_tells_that_sharper_folds_change_less() {
    let folder = Folder::new();
    let change = |radius: &str| {
        let arguments = ["--periods", "4x4", "--scale", "2", "--preview", "--fold-radius", radius, "--json", "--force"];
        let said = fold(&folder, &sample("grooves-two-hue.toml"), "p.pdf", &arguments);
        assert_eq!(said.status, 0, "{}", said.stderr);
        let value: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
        value["summary"]["preview"]["relative_rms"].as_f64().unwrap()
    };
    let (little, much) = (change("0.3"), change("1.2"));
    assert!(little > 0.005 && much > 1.5 * little, "{little} {much}");
}

const POSTS: &str = "format = 1\nname = \"posts\"\nunit = \"mm\"\n[geometry]\nkind = \"rods\"\nperiod = 40.0\ncount = 4\nradius = 6.0\nlength = 20.0\n\
    length_spread = 0.0\nspread_deg = 0.0\nrandomness = 0.0\nsegments = 6\n[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.9 }\n";

#[test]
fn parts_of_one_shape_are_unfolded_once_and_printed_as_often_as_they_are_needed() {
    let folder = Folder::new();
    folder.write("posts.toml", POSTS);
    for out in ["p.svg", "p.fold"] {
        assert_eq!(fold(&folder, "posts.toml", out, &["--periods", "2x2"]).status, 0);
    }
    let sidecar: serde_json::Value = serde_json::from_str(&folder.read("p.json")).unwrap();
    let pieces = sidecar["pieces"].as_array().unwrap();
    let posts: Vec<_> = pieces.iter().filter(|p| p["copies"] == 16).collect();
    assert_eq!((pieces.len(), posts.len()), (17, 16), "16 posts and their ground");
    assert!(posts.iter().enumerate().all(|(k, p)| p["piece"] == posts[0]["piece"] && p["copy"] == k + 1), "{posts:?}");
    assert_eq!(sidecar["order"].as_array().unwrap().len(), 2, "copies are told once");
    for file in ["p-1.svg", "p.fold"] {
        let said = folder.run(["fold", "--verify", file, "--against", "posts.toml", "--json"]);
        let report: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
        assert!(said.status == 0 && report["report"]["numbered"] == 96, "{file}: {report}");
    }
    let python = project("target/validate-venv/bin/python");
    if python.exists() {
        let said = Command::new(python).arg(project("fabricate/validate.py")).arg(folder.path("p.fold")).output().unwrap();
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    }
    let page = folder.read("p-1.svg");
    assert!(page.contains(">1 (x16)</text>"));
    // One number changed: the sides of an edge differ then.
    let at = page.find("data-number-of=").unwrap();
    let end = at + page[at..].find("</text>").unwrap();
    folder.write("q-1.svg", format!("{}77{}", &page[..end], &page[end..]));
    std::fs::copy(folder.path("p-2.svg"), folder.path("q-2.svg")).unwrap();
    let said = folder.run(["fold", "--verify", "q-1.svg", "--against", "posts.toml"]);
    assert!(said.status == 1 && said.stderr.contains("1 numbers at glued edges are wrong"), "{}", said.stderr);
}

/// A ball of `n` rings of `2 n` corners, dented so that its shape is no one's, as OBJ.
fn dented_ball(n: u32) -> String {
    let mut text = String::new();
    let m = 2 * n;
    for i in 0..=n {
        for j in 0..m {
            let (theta, phi) = (std::f64::consts::PI * f64::from(i) / f64::from(n), std::f64::consts::TAU * f64::from(j) / f64::from(m));
            let r = 30.0 + 5.0 * (3.0 * phi).sin() * theta.sin().powi(3);
            text.push_str(&format!("v {} {} {}\n", r * theta.sin() * phi.cos(), r * theta.sin() * phi.sin(), r * theta.cos()));
        }
    }
    for i in 0..n {
        for j in 0..m {
            let at = |i: u32, j: u32| i * m + j % m + 1;
            text.push_str(&format!("f {} {} {}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1)));
            text.push_str(&format!("f {} {} {}\n", at(i, j), at(i + 1, j + 1), at(i, j + 1)));
        }
    }
    text
}

#[test]
fn a_closed_mesh_is_reduced_and_stays_closed() {
    let folder = Folder::new();
    folder.write("ball.obj", dented_ball(30));
    let slope = |said: &Said| {
        let at = said.stderr.find("their normals are off by ").expect("the error is told") + 25;
        said.stderr[at..].split(' ').next().unwrap().parse::<f64>().unwrap()
    };
    let said = fold(&folder, "ball.obj", "b.fold", &["--max-facets", "120", "--closed", "--force"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let coarse = slope(&said);
    let said = folder.run(["fold", "--verify", "b.fold", "--against", "ball.obj"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    // As many facets as a slope needs: more for a smaller one.
    let said = fold(&folder, "ball.obj", "c.fold", &["--slope-tolerance", "8", "--closed", "--force", "--effort", "0.1"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(slope(&said) <= 8.0 && coarse > 8.0, "{} {coarse}", slope(&said));
    let facets = serde_json::from_str::<serde_json::Value>(&folder.read("c.json")).unwrap()["summary"]["facets"].as_u64().unwrap();
    assert!(facets > 120 && facets < 1500, "{facets}");
    // Both at once cannot be had.
    let said = fold(&folder, "ball.obj", "d.fold", &["--slope-tolerance", "8", "--max-facets", "120", "--force"]);
    assert!(said.status == 2 && said.stderr.contains("--slope-tolerance") && !folder.path("d.fold").exists(), "{}", said.stderr);
}

#[test]
fn a_wrap_sheet_larger_than_the_page_is_printed_in_parts() {
    let folder = Folder::new();
    let source = sample("v-grooves.toml");
    let arguments = ["--scale", "10", "--on", "cylinder:radius=70,height=90", "--paper-thickness", "0.1", "--force", "--effort", "0.1"];
    let said = fold(&folder, &source, "w.svg", &arguments);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let sidecar: serde_json::Value = serde_json::from_str(&folder.read("w.json")).unwrap();
    let wrap = &sidecar["wrap"];
    let parts = wrap["pages"].as_array().unwrap();
    assert!(parts.len() > 1, "{wrap}");
    for marker in wrap["markers"].as_array().unwrap() {
        let page = folder.read(&format!("w-{}.svg", marker["page"]));
        assert!(page.contains(&format!("data-marker=\"{}\"", marker["id"])), "{marker}");
    }
    // The pieces follow the parts of the sheet.
    assert!(sidecar["pieces"].as_array().unwrap().iter().all(|p| p["page"].as_u64().unwrap() > parts.len() as u64));
    let said = folder.run(["fold", "--verify", "w-1.svg", "--against", &source]);
    assert_eq!(said.status, 0, "{}", said.stderr);
}

#[test]
fn the_preview_of_a_weave_compares_flat_strips_with_round_threads() {
    let folder = Folder::new();
    let change = |thickness: &str| {
        let arguments = ["--scale", "60", "--periods", "2x2", "--preview", "--paper-thickness", thickness, "--json", "--force"];
        let said = fold(&folder, &sample("shot-silk.toml"), "s.pdf", &arguments);
        assert_eq!(said.status, 0, "{}", said.stderr);
        let value: serde_json::Value = serde_json::from_str(&said.stdout).unwrap();
        assert_eq!(value["summary"]["preview"]["crafted"], "strips");
        value["summary"]["preview"]["relative_rms"].as_f64().unwrap()
    };
    let thin = change("0.1");
    assert!(thin > 0.05 && thin < 2.0, "{thin}: flat strips are no round threads");
    // What overhangs and is no weave is refused, with the reason.
    let said = fold(&folder, &sample("velvet-rods.toml"), "v.pdf", &["--scale", "300", "--periods", "1x1", "--preview", "--force"]);
    assert!(said.status == 2 && said.stderr.contains("no height over the plane"), "{}", said.stderr);
    let said = fold(&folder, &sample("shot-silk.toml"), "t.pdf", &["--scale", "60", "--preview", "--paper-thickness", "9", "--force"]);
    assert!(said.status == 2 && said.stderr.contains("crimp") && !folder.path("t.pdf").exists(), "{}", said.stderr);
}
