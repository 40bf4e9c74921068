//! Wrong geometry and wrong files that a material refers to, through the binary.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use support::cases::Wrong::{Arguments, Files, Geometry};
use support::cases::try_all;

#[test]
fn wrong_parameters_are_refused_by_line_and_key() {
    try_all(&[
        ("a negative depth", Geometry("kind = \"grooves\"\ndepth = -1"), 2, &["m.toml:4: geometry.depth", "-1", "from"]),
        ("a depth in words", Geometry("kind = \"grooves\"\ndepth = \"deep\""), 2, &["m.toml:4: geometry.depth", "\"deep\"", "number"]),
        ("an unknown profile", Geometry("kind = \"grooves\"\nprofile = \"w\""), 2, &["m.toml:4: geometry.profile", "\"w\""]),
        ("a misspelt key", Geometry("kind = \"grooves\"\nperoid = 1.0"), 2, &["m.toml:4: geometry.peroid", "did you mean `period`?"]),
        ("pyramids on two corners", Geometry("kind = \"pyramids\"\nsides = 2"), 2, &["m.toml:4: geometry.sides", "2", "3"]),
        ("half a corner", Geometry("kind = \"pyramids\"\nsides = 3.5"), 2, &["m.toml:4: geometry.sides", "3.5", "whole number"]),
        ("too many rods", Geometry("kind = \"rods\"\ncount = 4000000000"), 2, &["m.toml:4: geometry.count", "4000000000"]),
        ("rods of negative radius", Geometry("kind = \"rods\"\nradius = -0.1"), 2, &["m.toml:4: geometry.radius", "-0.1"]),
        ("an unknown weave", Geometry("kind = \"weave\"\nweave = \"plane\""), 2, &["m.toml:4: geometry.weave", "did you mean `plain`?"]),
        ("a draft of uneven rows", Geometry("kind = \"weave\"\ndraft = [\"10\", \"0\"]"), 2, &["m.toml:4: geometry.draft"]),
        ("a draft of letters", Geometry("kind = \"weave\"\ndraft = [\"1x\", \"01\"]"), 2, &["m.toml:4: geometry.draft", "x"]),
        ("an empty draft", Geometry("kind = \"weave\"\ndraft = []"), 2, &["m.toml:4: geometry.draft"]),
        (
            "a WIF file that is not there",
            Geometry("kind = \"weave\"\nwif = \"no.wif\""),
            2,
            &["m.toml:4: geometry.wif", "no file \"no.wif\""],
        ),
        (
            "heights without a file",
            Geometry("kind = \"height-field\"\npixel = 1.0\nheight = 1.0"),
            2,
            &["m.toml:2: geometry.file", "required"],
        ),
        (
            "heights that are not there",
            Geometry("kind = \"height-field\"\nfile = \"h.png\""),
            2,
            &["m.toml:4: geometry.file", "no file \"h.png\""],
        ),
        (
            "an unknown edge",
            Geometry("kind = \"height-field\"\nfile = \"p.csv\"\nedge = \"wrap\""),
            2,
            &["m.toml:5: geometry.edge", "wrap"],
        ),
        (
            "a mesh of an unknown ending",
            Geometry("kind = \"mesh\"\nfile = \"p.csv\"\nperiod = [1.0, 1.0]"),
            2,
            &["p.csv", ".obj, .ply or .stl"],
        ),
        ("a material of another thing", Arguments(&["check", "plane.obj"]), 2, &["plane.obj: this is an OBJ mesh"]),
        ("a crimp of kilometres", Geometry("kind = \"weave\"\ncrimp = 1e9"), 2, &["m.toml: geometry.crimp", "times the period"]),
        ("threads as thick as towers", Geometry("kind = \"weave\"\nweft_height = 1e6"), 2, &["m.toml: geometry.weft_height"]),
        ("grooves to the centre of the earth", Geometry("kind = \"grooves\"\ndepth = 1e9"), 2, &["m.toml: geometry.depth"]),
        ("deep pits", Geometry("kind = \"pyramids\"\nheight = -1e9"), 2, &["m.toml: geometry.height", "at most 2000 times"]),
        ("long rods", Geometry("kind = \"rods\"\nlength = 1e6\ncount = 1"), 2, &["m.toml: geometry.length"]),
    ]);
}

#[test]
fn wrong_mesh_files_are_refused_by_name() {
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                       property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
    let ply = |rest: &str| format!("{PLY}{rest}").into_bytes();
    let mesh = |name: &str| format!("kind = \"mesh\"\nfile = \"{name}\"\nperiod = [1.0, 1.0]");
    let case = |name: &'static str, content: Vec<u8>| Files(mesh(name), name, content);
    try_all(&[
        ("an empty OBJ", case("a.obj", Vec::new()), 2, &["a.obj", "no faces"]),
        ("an OBJ of points", case("a.obj", b"v 0 0 0\nv 1 0 0\n".to_vec()), 2, &["a.obj", "no faces"]),
        (
            "an OBJ of one line's area",
            case("a.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_vec()),
            2,
            &["a.obj", "no triangle with an area"],
        ),
        ("an OBJ with NaN", case("a.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n".to_vec()), 2, &["a.obj:2", "finite"]),
        ("an empty PLY", case("a.ply", Vec::new()), 2, &["a.ply"]),
        ("a PLY of another kind", case("a.ply", b"plyx\nformat ascii 1.0\nend_header\n".to_vec()), 2, &["a.ply:1"]),
        ("a PLY without end of the header", case("a.ply", b"ply\nformat ascii 1.0\n".to_vec()), 2, &["a.ply", "end_header"]),
        ("a PLY without its face", case("a.ply", ply("")), 2, &["a.ply"]),
        ("a PLY face of a vertex that is not there", case("a.ply", ply("3 0 1 7\n")), 2, &["a.ply:13", "no vertex 7"]),
        ("a PLY face in words", case("a.ply", ply("3 0 one 2\n")), 2, &["a.ply:13", "one"]),
        ("a PLY that promises a billion vertices", case("a.ply", PLY.replace("vertex 3", "vertex 4000000000").into_bytes()), 2, &["a.ply"]),
        ("an empty STL", case("a.stl", Vec::new()), 2, &["a.stl"]),
        ("an STL that is cut", case("a.stl", [&[0_u8; 80][..], &2_u32.to_le_bytes(), &[0; 50]].concat()), 2, &["a.stl"]),
        ("an STL that promises a billion triangles", case("a.stl", [&[0_u8; 80][..], &u32::MAX.to_le_bytes()].concat()), 2, &["a.stl"]),
        ("a text STL that is cut", case("a.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n".to_vec()), 2, &["a.stl"]),
        (
            "a text STL of words",
            case("a.stl", b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 zero 0\n".to_vec()),
            2,
            &["a.stl:4", "zero"],
        ),
    ]);
}

#[test]
fn wrong_images_and_scans_are_refused_by_name() {
    let heights = |name: &str| format!("kind = \"height-field\"\nfile = \"{name}\"\npixel = 0.1\nheight = 1.0");
    let case = |name: &'static str, content: &[u8]| Files(heights(name), name, content.to_vec());
    const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
    try_all(&[
        ("an empty PNG", case("h.png", b""), 2, &["h.png"]),
        ("a PNG that is text", case("h.png", b"not an image"), 2, &["h.png"]),
        ("a PNG that is cut", case("h.png", &[PNG, b"\0\0\0\rIHDR\0\0\0\x04"].concat()), 2, &["h.png"]),
        ("an empty TIFF", case("h.tif", b""), 2, &["h.tif"]),
        ("a TIFF that is cut", case("h.tif", b"II*\0\x08\0\0\0"), 2, &["h.tif"]),
        ("an EXR that is text", case("h.exr", b"not an image"), 2, &["h.exr"]),
        ("an EXR that is cut", case("h.exr", b"\x76\x2f\x31\x01\x02\0\0\0chan"), 2, &["h.exr"]),
        ("a scan that is text", case("h.tmd", b"not a scan"), 2, &["h.tmd"]),
        ("a scan that is cut", case("h.tmd", b"Binary TrueMap Data File v2.0\r\n\0comment\0\x04\0\0\0"), 2, &["h.tmd"]),
        ("an image of an unknown ending", case("h.bmp", b"BM"), 2, &["h.bmp", ".png"]),
    ]);
}

#[test]
fn wrong_drafts_are_refused_by_line() {
    let case = |content: &str| Files("kind = \"weave\"\nwif = \"d.wif\"".to_owned(), "d.wif", content.as_bytes().to_vec());
    try_all(&[
        ("an empty WIF", case(""), 2, &["d.wif"]),
        ("a WIF that is text", case("not a draft\n"), 2, &["d.wif"]),
        (
            "a WIF without threading",
            case("[WIF]\nVersion=1.1\n[CONTENTS]\n[WEAVING]\nShafts=2\nTreadles=2\n[WARP]\nThreads=2\n[WEFT]\nThreads=2\n"),
            2,
            &["d.wif"],
        ),
    ]);
}

#[test]
fn wrong_measured_brdfs_are_refused_by_name() {
    let brdf = |brdf: &str| {
        format!("kind = \"mesh\"\nfile = \"plane.obj\"\nperiod = [1.0, 1.0]\n[[surface]]\npart = \"low\"\nbrdf = {{ {brdf} }}")
    };
    let case =
        |name: &'static str, content: &[u8]| Files(brdf(&format!("model = \"measured\", file = \"{name}\"")), name, content.to_vec());
    let plain = |text: &str| Files(brdf(text), "unused", Vec::new());
    try_all(&[
        ("neither file nor name", plain("model = \"measured\""), 2, &["m.toml:8: surface[0].brdf", "file"]),
        (
            "file and name",
            plain("model = \"measured\", file = \"plane.obj\", name = \"gold-metallic-paint\""),
            2,
            &["m.toml:8: surface[0].brdf", "name"],
        ),
        (
            "an unknown name",
            plain("model = \"measured\", name = \"gold-metalic-paint\""),
            2,
            &["m.toml:8: surface[0].brdf.name", "gold-metallic-paint"],
        ),
        (
            "a file that is not there",
            plain("model = \"measured\", file = \"no.bsdf\""),
            2,
            &["m.toml:8: surface[0].brdf.file", "no file \"no.bsdf\""],
        ),
        ("a file of an unknown ending", plain("model = \"measured\", file = \"plane.obj\""), 2, &["plane.obj", ".binary"]),
        (
            "a scale of -1",
            plain("model = \"measured\", name = \"gold-metallic-paint\", scale = -1.0"),
            2,
            &["m.toml:8: surface[0].brdf.scale", "-1.0"],
        ),
        ("an empty MERL file", case("b.binary", b""), 2, &["b.binary"]),
        (
            "a MERL file that is cut",
            case("b.binary", &[&90_i32.to_le_bytes()[..], &90_i32.to_le_bytes(), &180_i32.to_le_bytes(), &[0; 80]].concat()),
            2,
            &["b.binary"],
        ),
        ("a MERL file of other sizes", case("b.binary", &[9, 0, 0, 0, 9, 0, 0, 0, 18, 0, 0, 0]), 2, &["b.binary"]),
        ("an empty RGL file", case("b.bsdf", b""), 2, &["b.bsdf"]),
        ("an RGL file that is text", case("b.bsdf", b"not a tensor file at all"), 2, &["b.bsdf"]),
        ("an RGL file that is cut", case("b.bsdf", b"tensor_file\0\x01\0\x09\0\0\0\x05\0theta"), 2, &["b.bsdf"]),
    ]);
}

/// A `.tmd` of 2 x 2 heights on 1 x 1 mm.
fn height_map(heights: [f32; 4]) -> Vec<u8> {
    let mut bytes = b"Binary TrueMap Data File v2.0\r\n\0\0".to_vec();
    bytes.extend([2_u32, 2].into_iter().flat_map(u32::to_le_bytes));
    bytes.extend([1.0, 1.0, 0.0, 0.0].into_iter().chain(heights).flat_map(f32::to_le_bytes));
    bytes
}

#[test]
fn heights_far_beyond_their_period_are_refused_by_check_and_eval_alike() {
    let folder = support::Folder::new();
    let material = |geometry: &str| {
        format!("format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n")
    };
    folder.write("field.toml", material("kind = \"height-field\"\nfile = \"h.tmd\""));
    folder.write("mesh.toml", material("kind = \"mesh\"\nfile = \"tall.obj\"\nperiod = [1.0, 1.0]"));
    folder.write("tall.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1e9\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n");
    let both = |file: &str| {
        let [check, eval] = [&["check", file][..], &["eval", file, "--pairs", "p.csv"]].map(|arguments| folder.run(arguments));
        assert_eq!(check.status, eval.status, "{} {}", check.stderr, eval.stderr);
        assert!(check.status == 0 || check.stderr == eval.stderr, "{} {}", check.stderr, eval.stderr);
        (check.status, check.stderr)
    };
    for (heights, words) in [
        ([0.0, 4e12, 1.0, 2.0], &["h.tmd: geometry.height", "column 1, row 0", "e12"][..]),
        ([5e20; 4], &["h.tmd: geometry.height", "column 0, row 1", "e20"]),
        ([0.0, 1e8, 1.0, 2.0], &["field.toml: geometry.height", "times the period"]),
    ] {
        folder.write("h.tmd", height_map(heights));
        let (status, said) = both("field.toml");
        assert!(status == 2 && words.iter().all(|w| said.contains(w)), "{heights:?}: {said}");
    }
    let (status, said) = both("mesh.toml");
    assert!(status == 2 && said.contains("mesh.toml: geometry.scale") && said.contains("1.000e9 times"), "{said}");
    // What is high and can be: the summit of a mountain, given above the sea.
    folder.write("h.tmd", height_map([8848.0, 8847.5, 8847.25, 8847.0]));
    assert_eq!(both("field.toml").0, 0);
}
