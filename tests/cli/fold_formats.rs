//! The files of `biscale fold` as other programs would read them.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test that meets the unexpected should panic, and says what it skips")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use std::process::Command;
use support::{Folder, project};

fn pyramids(folder: &Folder, out: &str, more: &[&str]) {
    let sample = project("samples/pyramids.toml").display().to_string();
    let said = folder.run([&["fold", &sample, "-o", out, "--scale", "400", "--periods", "3x2"], more].concat());
    assert_eq!(said.status, 0, "{}", said.stderr);
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn indices(v: &Value) -> Vec<usize> {
    v.as_array().unwrap().iter().map(|x| x.as_u64().unwrap() as usize).collect()
}

#[test]
fn fold_files_keep_the_invariants_of_the_format() {
    let folder = Folder::new();
    pyramids(&folder, "p.fold", &[]);
    let file: Value = serde_json::from_str(&folder.read("p.fold")).unwrap();
    assert_eq!(file["file_spec"], 1.2);
    let flat: Vec<Vec<f64>> = file["vertices_coords"].as_array().unwrap().iter().map(numbers).collect();
    let folded: Vec<Vec<f64>> = file["file_frames"][0]["vertices_coords"].as_array().unwrap().iter().map(numbers).collect();
    assert_eq!(flat.len(), folded.len());
    let faces: Vec<Vec<usize>> = file["faces_vertices"].as_array().unwrap().iter().map(indices).collect();
    let edges: Vec<Vec<usize>> = file["edges_vertices"].as_array().unwrap().iter().map(indices).collect();
    for key in ["edges_faces", "edges_assignment", "edges_foldAngle"] {
        assert_eq!(file[key].as_array().unwrap().len(), edges.len(), "{key}");
    }
    for face in &faces {
        let area: f64 = (0..face.len())
            .map(|k| {
                let (a, b) = (&flat[face[k]], &flat[face[(k + 1) % face.len()]]);
                a[0] * b[1] - a[1] * b[0]
            })
            .sum();
        assert!(area > 0.0, "a face runs clockwise: {face:?}");
    }
    let distance = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let sub = |a: &[f64], b: &[f64]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross = |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |a: [f64; 3]| {
        let l = dot(a, a).sqrt();
        a.map(|x| x / l)
    };
    let normal = |face: &[usize]| unit(cross(sub(&folded[face[1]], &folded[face[0]]), sub(&folded[face[2]], &folded[face[0]])));
    let mut used = 0;
    for (k, ends) in edges.iter().enumerate() {
        let sides = file["edges_faces"][k].as_array().unwrap();
        let runs = |face: &[usize], a: usize, b: usize| (0..face.len()).any(|j| face[j] == a && face[(j + 1) % face.len()] == b);
        // The first face lies to the left: it runs the edge as it stands; the second one backwards.
        let left = &faces[sides[0].as_u64().unwrap() as usize];
        assert!(runs(left, ends[0], ends[1]), "edge {k}");
        assert!((distance(&flat[ends[0]], &flat[ends[1]]) - distance(&folded[ends[0]], &folded[ends[1]])).abs() < 1e-9, "edge {k}");
        let letter = file["edges_assignment"][k].as_str().unwrap();
        let angle = file["edges_foldAngle"][k].as_f64();
        match sides[1].as_u64() {
            None => assert!(letter == "B" && angle.is_none(), "edge {k}: {letter}"),
            Some(right) => {
                let right = &faces[right as usize];
                assert!(runs(right, ends[1], ends[0]), "edge {k}");
                let angle = angle.unwrap();
                assert!(matches!((letter, angle > 0.0), ("V", true) | ("M", false)), "edge {k}: {letter} {angle}");
                let (n, m) = (normal(left), normal(right));
                let along = unit(sub(&folded[ends[1]], &folded[ends[0]]));
                let seen = -dot(cross(n, m), along).atan2(dot(n, m));
                assert!((seen.to_degrees() - angle).abs() < 1e-6, "edge {k}: {} for {angle}", seen.to_degrees());
                used += 1;
            }
        }
    }
    assert!(used > 20, "{used} folds");
}

#[test]
fn origami_simulator_reads_lines_of_its_colours_only() {
    let folder = Folder::new();
    pyramids(&folder, "o.svg", &["--origami-simulator"]);
    let text = folder.read("o.svg");
    let document = roxmltree::Document::parse(&text).unwrap();
    let mut count = std::collections::BTreeMap::new();
    for line in document.descendants().filter(|n| n.tag_name().name() == "line") {
        let number = |name: &str| line.attribute(name).unwrap().parse::<f64>().unwrap();
        let length = (number("x2") - number("x1")).hypot(number("y2") - number("y1"));
        assert!(length >= 10.0 - 1e-6, "an edge of {length}");
        let colour = line.attribute("stroke").unwrap();
        let opacity = number("stroke-opacity");
        match colour {
            "#000000" | "#ffff00" => assert_eq!(opacity, 1.0),
            // The sides of a pyramid of height 6 over 20: fold angles of 2 atan(0.6) in the valleys.
            "#0000ff" => assert!((opacity - 2.0 * 0.6_f64.atan().to_degrees() / 180.0).abs() < 1e-6, "{opacity}"),
            "#ff0000" => assert!(opacity > 0.1 && opacity < 0.5, "{opacity}"),
            other => panic!("colour {other}"),
        }
        *count.entry(colour.to_owned()).or_insert(0) += 1;
    }
    assert!(count["#000000"] > 10 && count["#ff0000"] > 10 && count["#0000ff"] > 3, "{count:?}");
}

#[test]
fn dxf_has_its_layers_and_closed_outlines() {
    let folder = Folder::new();
    pyramids(&folder, "d.dxf", &["--registration", "silhouette"]);
    let text = folder.read("d-1.dxf");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len() % 2, 0, "a DXF is pairs of lines");
    let pairs: Vec<(&str, &str)> = lines.chunks(2).map(|p| (p[0].trim(), p[1].trim())).collect();
    assert!(pairs.iter().all(|(code, _)| code.parse::<u32>().is_ok()));
    assert_eq!(pairs.last(), Some(&("0", "EOF")));
    assert!(pairs.contains(&("1", "AC1009")), "R12");
    assert!(pairs.windows(2).any(|w| w == [("9", "$INSUNITS"), ("70", "4")]), "lengths are mm");
    assert!(pairs.windows(2).filter(|w| *w == [("0", "TEXT"), ("8", "TEXT")]).count() > 20, "names and numbers are there");
    for layer in ["CUT", "SCORE_M", "SCORE_V", "REG"] {
        assert!(pairs.windows(2).any(|w| w[0] == ("0", "POLYLINE") && w[1] == ("8", layer)), "nothing on {layer}");
    }
    let starts = pairs.iter().filter(|p| **p == ("0", "POLYLINE")).count();
    assert_eq!(starts, pairs.iter().filter(|p| **p == ("0", "SEQEND")).count());
}

/// Columns of dark pixels of the longest dark run in the rows of the lowest tenth of a picture, and the picture's size.
fn bar(file: &std::path::Path) -> (usize, usize, usize, Vec<[usize; 2]>) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(file).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let (w, h) = (info.width as usize, info.height as usize);
    let channels = info.buffer_size() / (w * h);
    let dark = |x: usize, y: usize| bytes[(y * w + x) * channels] < 128;
    let mut best = 0;
    let mut outside = Vec::new();
    for y in 0..h {
        let mut run = 0;
        for x in 0..w {
            if bytes[(y * w + x) * channels] < 250 {
                outside.push([x, y]);
            }
            run = if dark(x, y) { run + 1 } else { 0 };
            if y > h * 9 / 10 {
                best = best.max(run);
            }
        }
    }
    (best, w, h, outside)
}

#[test]
fn the_bar_measures_100_mm_and_nothing_stands_in_the_margin() {
    let folder = Folder::new();
    pyramids(&folder, "p.pdf", &[]);
    pyramids(&folder, "p.png", &[]);
    let mut pictures = vec![(folder.path("p-1.png"), 200.0)];
    // At 508 dots an inch a dot is 0.05 mm.
    match Command::new("pdftoppm").args(["-r", "508", "-png", "p.pdf", "q"]).current_dir(folder.path("")).status() {
        Ok(status) if status.success() => pictures.extend([(folder.path("q-1.png"), 508.0), (folder.path("q-2.png"), 508.0)]),
        _ => println!("skipped the PDF's pixels: there is no pdftoppm"),
    }
    let info = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(folder.path("p-1.png")).unwrap())).read_info().unwrap();
    let dots = info.info().pixel_dims.unwrap();
    assert!(dots.xppu == 7874 && dots.yppu == 7874 && dots.unit == png::Unit::Meter, "200 dots an inch are 7874 to the metre: {dots:?}");
    for (k, (file, dpi)) in pictures.iter().enumerate() {
        let (length, w, h, ink) = bar(file);
        let mm = 25.4 / dpi;
        assert!((w as f64 * mm - 210.0).abs() < 0.2 && (h as f64 * mm - 297.0).abs() < 0.2, "{file:?} is {w} x {h}");
        if k < 2 {
            assert!((length as f64 * mm - 100.0).abs() < 0.1 + mm, "{file:?}: the bar is {} mm", length as f64 * mm);
        }
        let margin = (10.0 / mm).floor() as usize - 1;
        let inside = |[x, y]: &[usize; 2]| *x >= margin && *y >= margin && *x < w - margin && *y < h - margin;
        assert!(ink.iter().all(inside), "{file:?}: ink in the margin at {:?}", ink.iter().find(|p| !inside(p)));
    }
    // The font is embedded, and there are no pictures: lines stay lines.
    let pdf = std::fs::read(folder.path("p.pdf")).unwrap();
    let has = |text: &[u8]| pdf.windows(text.len()).any(|w| w == text);
    assert!(has(b"/FontFile2") || has(b"/FontFile3"), "no embedded font");
    assert!(!has(b"/Subtype/Image") && !has(b"/Subtype /Image"), "a page holds a bitmap");
}

#[test]
fn svg_sizes_are_in_mm_or_in_pixels_as_asked() {
    let folder = Folder::new();
    pyramids(&folder, "a.svg", &[]);
    pyramids(&folder, "b.svg", &["--svg-dpi", "72", "--page", "letter-landscape", "--back"]);
    let text = folder.read("a-1.svg");
    let a = roxmltree::Document::parse(&text).unwrap();
    let root = a.root_element();
    assert_eq!((root.attribute("width"), root.attribute("viewBox")), (Some("210mm"), Some("0 0 210 297")));
    let layers: Vec<&str> = root.children().filter_map(|n| n.attribute("id")).collect();
    assert_eq!(layers, ["print", "score", "cut", "registration"]);
    let text = folder.read("b-1.svg");
    let b = roxmltree::Document::parse(&text).unwrap();
    let width: f64 = b.root_element().attribute("width").unwrap().parse().unwrap();
    assert!((width - 11.0 * 72.0).abs() < 1e-6, "{width}");
    // The back is mirrored: a valley seen from behind is a mountain.
    let back = folder.read("b-2.svg");
    let front = folder.read("b-1.svg");
    let count = |text: &str, dash: &str| text.matches(&format!("stroke-dasharray=\"{dash}\"")).count();
    assert!(count(&back, "1.6 1.1") > 20 && count(&front, "3 0.9 0.5 0.9") > 20);
}

#[test]
fn a_cutter_gets_the_layers_that_it_asks_for_and_folds_as_rows_of_cuts() {
    let folder = Folder::new();
    pyramids(&folder, "c.svg", &["--only", "cut"]);
    let text = folder.read("c.svg");
    assert!(text.contains("data-loop=") && !text.contains("data-edge=") && !text.contains("<text"), "cut lines alone, on one page");
    pyramids(&folder, "s.dxf", &["--only", "score", "--perforate", "2,1"]);
    let rows = folder.read("s.dxf").matches("\nPOLYLINE\n").count();
    pyramids(&folder, "f.dxf", &["--only", "score"]);
    let folds = folder.read("f.dxf").matches("\nPOLYLINE\n").count();
    assert!(folds > 20 && rows > 3 * folds, "{rows} cuts of {folds} folds");
    let sample = project("samples/pyramids.toml").display().to_string();
    let said = folder.run(["fold", &sample, "-o", "x.svg", "--perforate", "2"]);
    assert!(said.status == 2 && said.stderr.contains("--perforate"), "{}", said.stderr);
}

#[test]
fn papers_tabs_and_fronts_are_as_asked_for_and_pass() {
    let folder = Folder::new();
    let sample = project("samples/pyramids.toml").display().to_string();
    for (out, more) in [("a.svg", &["--page", "12x12in", "--no-tabs"][..]), ("b.svg", &["--page", "legal", "--back", "--clean-front"])] {
        pyramids(&folder, out, more);
        let first = out.replace('.', "-1.");
        let said = folder.run(["fold", "--verify", &first, "--against", &sample]);
        assert_eq!(said.status, 0, "{out}: {}", said.stderr);
    }
    assert!(!folder.read("a-1.svg").contains("data-tab-of"));
    assert!(folder.read("a-1.svg").contains("width=\"304.8mm\""));
    assert!(!folder.read("b-1.svg").contains("data-number-of") && folder.read("b-2.svg").contains("data-number-of"));
}
