//! What `biscale fold` refuses, and how it says so: one line a mistake.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use support::Folder;

const TRIANGLE: &str = "v 0 0 0\nv 20 0 0\nv 0 20 0\nf 1 2 3\n";

const OCTAHEDRON: &str =
    "v 9 0 0\nv 0 9 0\nv -9 0 0\nv 0 -9 0\nv 0 0 9\nv 0 0 -9\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 2 1 6\nf 3 2 6\nf 4 3 6\nf 1 4 6\n";

/// Name, mesh file, further arguments, words that the message must have.
type Case = (&'static str, &'static str, &'static [&'static str], &'static [&'static str]);

const MESHES: [Case; 21] = [
    (
        "three facets at one edge",
        "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 -20 0\nv 0 0 20\nf 1 2 3\nf 2 1 4\nf 1 2 5\n",
        &[],
        &["m.obj", "three facets meet", "(10.000, 0.000, 0.000)"],
    ),
    (
        "a sheet of two sides",
        "v 0 0 0\nv 40 0 0\nv 40 20 0\nv 0 20 0\nv 20 0 10\nv 20 20 10\nf 1 5 6\nf 1 6 4\nf 5 2 3\nf 5 3 6\nf 4 6 5\nf 4 5 1\nf 6 3 2\nf 6 2 5\n",
        &[],
        &["m.obj", "no thickness", "one side"],
    ),
    (
        "a strip with one side",
        "v 6 0 0\nv 4 0 0\nv 1.25 4.3 -0.6\nv 1.85 5.21 0.6\nv -4.3 2.9 -0.95\nv -3.8 2.9 0.95\nv -4.3 -2.9 -0.95\nv -3.8 -2.9 0.95\nv 1.85 -5.21 -0.6\n\
         v 1.25 -4.3 0.6\nf 1 3 2\nf 2 3 4\nf 3 5 4\nf 4 5 6\nf 5 7 6\nf 6 7 8\nf 7 9 8\nf 8 9 10\nf 9 2 10\nf 10 2 1\n",
        &["--scale", "10"],
        &["m.obj", "one side only", "cut it"],
    ),
    ("a corner that is no number", "v 0 0 0\nv nan 0 0\nv 0 20 0\nf 1 2 3\n", &[], &["m.obj", "finite"]),
    ("an infinite corner", "v 0 0 0\nv inf 0 0\nv 0 20 0\nf 1 2 3\n", &[], &["m.obj", "finite"]),
    ("no faces", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", &[], &["m.obj", "no faces"]),
    ("all in one place", "v 3 3 3\nv 3 3 3\nv 3 3 3\nf 1 2 3\n", &[], &["large", "--scale"]),
    ("a line", "v 0 0 0\nv 20 0 0\nv 40 0 0\nf 1 2 3\n", &[], &["no triangle has an area"]),
    ("a corner that is not there", "v 0 0 0\nv 20 0 0\nf 1 2 3\n", &[], &["m.obj", ":3"]),
    ("a scale of 0", TRIANGLE, &["--scale", "0"], &["--scale", "the scale is 0", "above 0"]),
    ("a negative scale", TRIANGLE, &["--scale", "-2"], &["--scale", "the scale is -2"]),
    ("a scale that is no number", TRIANGLE, &["--scale", "nan"], &["--scale", "NaN"]),
    ("a scale beyond all measure", TRIANGLE, &["--scale", "1e300"], &["--scale", "large"]),
    ("facets too small to fold", TRIANGLE, &["--scale", "0.05"], &["--scale", "0.71 mm narrow", "--force", "0.354"]),
    ("a facet larger than the page", TRIANGLE, &["--scale", "20"], &["--page", "facet 1 is", "--split"]),
    ("a hole where none may be", TRIANGLE, &["--closed"], &["--closed", "1 holes"]),
    ("paper thicker than the facets", OCTAHEDRON, &["--paper-thickness", "20"], &["--paper-thickness", "vanishes"]),
    ("folds rounder than the facets", OCTAHEDRON, &["--paper-thickness", "0.1", "--fold-radius", "18"], &["vanishes", "--fold-radius"]),
    ("a solid of two facets", OCTAHEDRON, &["--max-facets", "2"], &["--max-facets", "could be reduced", "not to 2"]),
    (
        "three facets at one edge, to be reduced",
        "v 0 0 0\nv 20 0 0\nv 0 20 0\nv 0 -20 0\nv 0 0 20\nf 1 2 3\nf 2 1 4\nf 1 2 5\n",
        &["--max-facets", "2"],
        &["m.obj", "three facets meet"],
    ),
    ("a mesh has no periods", TRIANGLE, &["--periods", "2x2"], &["--size", "no period"]),
];

/// Name, arguments after `fold m.toml -o out.svg`, words.
type ArgumentCase = (&'static str, &'static [&'static str], &'static [&'static str]);

const ARGUMENTS: [ArgumentCase; 18] = [
    ("no paper of that name", &["--page", "b7"], &["--page", "b7", "a4"]),
    ("a roll without a width", &["--page", "roll:"], &["--page", "roll:WIDTH"]),
    ("a margin that leaves nothing", &["--margin", "80"], &["--page", "margin"]),
    ("a negative margin", &["--margin", "-1"], &["--margin"]),
    ("a size that is none", &["--size", "12"], &["--size", "120x80"]),
    ("a size of 0", &["--size", "0x80"], &["--size", "out of range"]),
    ("periods of 0", &["--periods", "0x3"], &["--periods", "8x6"]),
    ("size and periods", &["--size", "10x10", "--periods", "2x2"], &["--periods"]),
    ("too many periods", &["--periods", "9999x9999"], &["triangles", "--size"]),
    ("a target that is none", &["--on", "ball:radius=3"], &["--on", "ball", "cylinder:radius=40,height=100"]),
    ("a target without a height", &["--on", "cylinder:radius=40"], &["--on", "height"]),
    ("a target beyond all pages", &["--on", "cylinder:radius=2000,height=9000", "--scale", "99", "--force"], &["--on", "a3", "pages"]),
    ("a K factor beyond the paper", &["--k-factor", "1.5"], &["--k-factor", "0.5"]),
    ("a tab of 0", &["--tab", "0"], &["--tab"]),
    ("no facets at all", &["--max-facets", "1"], &["--max-facets", "at least 2"]),
    ("a slope tolerance of 0", &["--slope-tolerance", "0"], &["--slope-tolerance"]),
    ("an option of SVG for others", &["-o", "out.pdf", "--svg-dpi", "72"], &[]),
    ("a time without a unit", &["--time-limit", "3"], &["--time-limit", "unit"]),
];

#[test]
fn meshes_that_cannot_be_folded_are_refused_with_place_and_remedy() {
    for (name, mesh, arguments, words) in MESHES {
        let folder = Folder::new();
        folder.write("m.obj", mesh);
        let before = folder.snapshot();
        let said = folder.run([&["fold", "m.obj", "-o", "out.svg"], arguments].concat());
        assert_eq!(said.status, 2, "{name}: {}", said.stderr);
        for word in words {
            assert!(said.stderr.contains(word), "{name}: no {word:?} in {}", said.stderr);
        }
        assert_eq!(folder.snapshot(), before, "{name}: something was written");
    }
}

#[test]
fn arguments_that_cannot_be_are_refused() {
    for (name, arguments, words) in ARGUMENTS {
        let folder = Folder::new();
        let said = folder.run([&["fold", "m.toml", "-o", "out.svg"], arguments].concat());
        assert_eq!(said.status, 2, "{name}: {}", said.stderr);
        for word in words {
            assert!(said.stderr.contains(word), "{name}: no {word:?} in {}", said.stderr);
        }
        assert!(!folder.path("out.svg").exists() && !folder.path("out-1.svg").exists(), "{name}");
    }
}

#[test]
fn outputs_are_refused_that_have_no_known_ending_or_are_not_ours() {
    let folder = Folder::new();
    folder.write("m.obj", TRIANGLE);
    for (out, words) in [("out", "no ending"), ("out.doc", ".doc"), ("none/out.svg", "folder")] {
        let said = folder.run(["fold", "m.obj", "-o", out]);
        assert_eq!(said.status, 2, "{out}: {}", said.stderr);
        assert!(said.stderr.contains(words), "{out}: {}", said.stderr);
    }
    folder.write("mine.pdf", "precious");
    let said = folder.run(["fold", "m.obj", "-o", "mine.pdf"]);
    assert_eq!((said.status, folder.read("mine.pdf").as_str()), (2, "precious"), "{}", said.stderr);
    // An earlier output of the command itself is replaced.
    for _ in 0..2 {
        let said = folder.run(["fold", "m.obj", "-o", "own.pdf"]);
        assert_eq!(said.status, 0, "{}", said.stderr);
    }
}

#[test]
fn a_mesh_beyond_all_folding_is_refused_at_once() {
    // 160 x 160 bumps of two triangles each, 51,200 facets.
    let folder = Folder::new();
    let mut text = String::new();
    let n = 161;
    for j in 0..n {
        for i in 0..n {
            text.push_str(&format!("v {i} {j} {}\n", (i * i * 3 + j * j * 7 + i * j) % 5));
        }
    }
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let k = j * n + i + 1;
            text.push_str(&format!("f {k} {} {}\nf {k} {} {}\n", k + 1, k + n + 1, k + n + 1, k + n));
        }
    }
    folder.write("m.obj", text);
    let said = folder.run(["fold", "m.obj", "-o", "out.fold", "--force"]);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert!(said.stderr.contains("more than the 20000") && said.stderr.contains("--max-facets"), "{}", said.stderr);
    // Reduced, it folds.
    let said = folder.run(["fold", "m.obj", "-o", "out.fold", "--max-facets", "60", "--force"]);
    assert!(said.status == 0 && said.stderr.contains("reduced"), "{}", said.stderr);
    let said = folder.run(["fold", "--verify", "out.fold", "--against", "m.obj"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
}

#[test]
fn files_that_are_no_patterns_are_refused_by_the_verifier() {
    let folder = Folder::new();
    folder.write("m.obj", TRIANGLE);
    folder.write("a.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"/>");
    folder.write("b.svg", "<svg");
    folder.write("c.fold", "{}");
    folder.write("d.fold", "[");
    folder.write("e.pdf", "%PDF");
    for (file, word) in [
        ("a.svg", "no facet"),
        ("b.svg", "no XML"),
        ("c.fold", "facet"),
        ("d.fold", "no JSON"),
        ("e.pdf", ".pdf"),
        ("f.svg", "no such file"),
    ] {
        let said = folder.run(["fold", "--verify", file, "--against", "m.obj"]);
        assert_eq!(said.status, 2, "{file}: {}", said.stderr);
        assert!(said.stderr.contains(word), "{file}: {}", said.stderr);
    }
}

/// An octahedron by its faces, whose corners all start at 1.
fn octahedron(faces: &str) -> String {
    OCTAHEDRON[..OCTAHEDRON.find('f').unwrap()].to_owned() + faces
}

#[test]
fn meshes_that_other_programs_repair_are_repaired_with_a_note_and_fold_to_the_same_pattern() {
    let folder = Folder::new();
    folder.write("right.obj", OCTAHEDRON);
    let right = folder.run(["fold", "right.obj", "-o", "right.fold"]);
    assert!(right.status == 0 && !right.stderr.contains("turned") && !right.stderr.contains("left out"), "{}", right.stderr);
    for (name, faces, note) in [
        ("inside out", "f 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\nf 1 2 6\nf 2 3 6\nf 3 4 6\nf 4 1 6\n", "showed the inner side outside"),
        ("two faces turned", "f 1 2 5\nf 2 5 3\nf 3 4 5\nf 4 1 5\nf 2 1 6\nf 3 2 6\nf 4 3 6\nf 4 1 6\n", "turned 2 faces over"),
        ("a face twice", "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 2 1 6\nf 3 2 6\nf 4 3 6\nf 1 4 6\nf 1 2 5\n", "left out 1 faces"),
        ("a face and its back", "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 2 1 6\nf 3 2 6\nf 4 3 6\nf 1 4 6\nf 2 1 5\n", "left out 1 faces"),
    ] {
        folder.write("m.obj", octahedron(faces));
        let said = folder.run(["fold", "m.obj", "-o", "out.fold", "--force"]);
        assert!(said.status == 0 && said.stderr.contains(note), "{name}: {}", said.stderr);
        // The same folds, mountains as mountains.
        let angles = |file: &str| {
            let fold: serde_json::Value = serde_json::from_str(&folder.read(file)).unwrap();
            let mut all: Vec<String> =
                fold["edges_foldAngle"].as_array().unwrap().iter().map(|a| format!("{:.6}", a.as_f64().unwrap_or(0.0))).collect();
            all.sort();
            all
        };
        assert_eq!(angles("out.fold"), angles("right.fold"), "{name}");
        let verified = folder.run(["fold", "--verify", "out.fold", "--against", "m.obj"]);
        assert_eq!(verified.status, 0, "{name}: {}{}", verified.stdout, verified.stderr);
    }
}

#[test]
fn facets_that_pass_through_each_other_are_told_by_number_and_place() {
    let folder = Folder::new();
    folder.write("m.obj", "v 0 0 0\nv 60 0 0\nv 0 60 0\nv 15 15 -20\nv 15 15 20\nv 90 15 0\nf 1 2 3\nf 4 5 6\n");
    let said = folder.run(["fold", "m.obj", "-o", "out.svg"]);
    assert!(
        said.status == 0 && said.stderr.contains("pass through each other, 1 and 2 around (45.000, 15.000, 0.000) mm"),
        "{}",
        said.stderr
    );
}

#[test]
fn a_pattern_and_what_is_beside_it_have_the_same_bytes_each_time() {
    let folder = Folder::new();
    folder.write("m.obj", OCTAHEDRON);
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    let mut before: Option<Vec<Vec<u8>>> = None;
    for _ in 0..2 {
        let said = folder.run(["fold", "m.obj", "-o", "out.pdf"]);
        assert_eq!(said.status, 0, "{}", said.stderr);
        let now = vec![read("out.pdf"), read("out.json")];
        assert!(before.is_none_or(|before| before == now), "they depend on the clock");
        before = Some(now);
    }
}
