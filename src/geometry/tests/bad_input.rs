//! Wrong geometry is refused with a message that names file, field or line, value and remedy.

use super::*;
use crate::error::Error;

/// What is wrong, and what the message must contain: the field or file, the value, the remedy.
fn refuse(folder: &Path, geometry: &str, parts: &[&str]) {
    match build_in(folder, geometry) {
        Err(Error::BadInput(bad)) => {
            let message = bad.to_string();
            for part in parts {
                assert!(message.contains(part), "{geometry:?} gave {message:?}, which lacks {part:?}");
            }
            assert!(!bad.remedy.is_empty() && (bad.line.is_some() || bad.field.is_some() || bad.file.is_some()), "{message}");
        }
        Err(other) => panic!("{geometry:?} gave {other} and not bad input"),
        Ok(_) => panic!("{geometry:?} was accepted"),
    }
}

#[test]
fn wrong_procedural_parameters_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    // Parameters are read before the file's contents.
    for name in ["a.png", "a.obj", "a.tmd", "a.wif", "a.stl", "a.ply"] {
        std::fs::write(folder.path().join(name), []).unwrap();
    }
    let nowhere = folder.path();
    let cases: &[(&str, &[&str])] = &[
        ("", &["kind", "required"]),
        ("kind = \"groves\"", &["geometry.kind", "groves", "did you mean `grooves`"]),
        ("kind = \"grooves\"\nperiod = 0.0", &["test.toml:4", "geometry.period", "0.0", "0.000001"]),
        ("kind = \"grooves\"\nperiod = -1", &["geometry.period", "-1"]),
        ("kind = \"grooves\"\nperiod = nan", &["geometry.period", "nan"]),
        ("kind = \"grooves\"\nperiod = 1e7", &["geometry.period", "1e7"]),
        ("kind = \"grooves\"\nperiod = \"wide\"", &["geometry.period", "a string", "number"]),
        ("kind = \"grooves\"\ndepth = -0.1", &["geometry.depth", "-0.1"]),
        ("kind = \"grooves\"\nperoid = 1.0", &["peroid", "did you mean `period`"]),
        ("kind = \"grooves\"\nprofile = \"u\"", &["geometry.profile", "\"u\""]),
        ("kind = \"grooves\"\nfloor_width = 0.9\ntop_width = 0.2", &["geometry.floor_width", "0.9", "0.2"]),
        ("kind = \"grooves\"\nprofile = \"v\"\nfloor_width = 0.1", &["geometry.floor_width", "profile = \"flat\""]),
        ("kind = \"grooves\"\nsteep_angle_deg = 80.0", &["geometry.steep_angle_deg", "profile = \"sawtooth\""]),
        ("kind = \"grooves\"\nprofile = \"sawtooth\"\nsteep_angle_deg = 10.0", &["geometry.steep_angle_deg", "10", "at least 45.000"]),
        ("kind = \"pyramids\"\nsides = 2", &["geometry.sides", "2"]),
        ("kind = \"pyramids\"\nsides = 4.5", &["geometry.sides", "4.5", "whole"]),
        ("kind = \"pyramids\"\ntip = [0.1]", &["geometry.tip", "[0.1]", "2 numbers"]),
        ("kind = \"pyramids\"\ntip = [0.0, 3.0]", &["geometry.tip", "3.0"]),
        ("kind = \"pyramids\"\ngap = 1.0", &["geometry.gap", "1.0"]),
        ("kind = \"pyramids\"\nratio = 0.0", &["geometry.ratio", "0.0"]),
        ("kind = \"rods\"\ncount = 0", &["geometry.count", "0"]),
        ("kind = \"rods\"\ncount = 100000\nsegments = 256", &["geometry", "76600000", "fewer"]),
        ("kind = \"rods\"\nlean_deg = 60.0\nspread_deg = 30.0", &["geometry.spread_deg", "90 degrees", "85"]),
        ("kind = \"rods\"\nseed = -1", &["geometry.seed", "-1"]),
        ("kind = \"rods\"\nsegments = 2", &["geometry.segments", "2"]),
        ("kind = \"weave\"\nweave = \"jersey\"", &["geometry.weave", "jersey"]),
        ("kind = \"weave\"\nweave = \"plain\"\ndraft = [\"10\", \"01\"]", &["geometry.draft", "weave and draft"]),
        ("kind = \"weave\"\ndraft = []", &["geometry.draft", "0 and 1"]),
        ("kind = \"weave\"\ndraft = [\"10\", \"1\"]", &["geometry.draft", "one length"]),
        ("kind = \"weave\"\ndraft = [\"1x\"]", &["geometry.draft", "0 and 1"]),
        ("kind = \"weave\"\nshift = 1", &["geometry.shift", "twill"]),
        ("kind = \"weave\"\nweave = \"twill\"\nshift = 4", &["geometry.shift", "4", "1 to 3"]),
        ("kind = \"weave\"\nweave = \"satin\"\nover = 5\nunder = 1\nshift = 2", &["geometry.weave", "no satin", "divisor"]),
        ("kind = \"weave\"\nparts = \"by-colour\"", &["geometry.parts", "wif"]),
        ("kind = \"weave\"\nwarp_width = 1e6", &["geometry.warp_width", "period", "1e-6 to 1e6"]),
        ("kind = \"weave\"\nwif = \"missing.wif\"", &["missing.wif", "there is no file"]),
        ("kind = \"weave\"\nweave = \"twill\"\nover = 64\nunder = 63\nsteps = 256\nsegments = 256", &["geometry", "triangles"]),
        ("kind = \"height-field\"", &["geometry.file", "required"]),
        ("kind = \"height-field\"\nfile = \"missing.png\"", &["missing.png", "there is no file"]),
        ("kind = \"height-field\"\nfile = \"missing.tmd\"", &["missing.tmd", "there is no file"]),
        ("kind = \"height-field\"\nfile = \"a.png\"\npixel = 1.0\nwidth = 2.0", &["geometry.width", "pixel"]),
        ("kind = \"height-field\"\nfile = \"a.png\"\nblend = 0.2", &["geometry.blend", "edge = \"blend\""]),
        ("kind = \"height-field\"\nfile = \"a.png\"\nedge = \"fade\"", &["geometry.edge", "fade"]),
        ("kind = \"height-field\"\nfile = \"a.png\"\nresolution = 0", &["geometry.resolution", "0"]),
        ("kind = \"mesh\"\nperiod = [1.0, 1.0]", &["geometry.file", "required"]),
        ("kind = \"mesh\"\nfile = \"a.obj\"", &["geometry.period", "required"]),
        ("kind = \"mesh\"\nfile = \"a.obj\"\nperiod = 1.0", &["geometry.period", "2 numbers"]),
        ("kind = \"mesh\"\nfile = \"missing.obj\"\nperiod = [1.0, 1.0]", &["missing.obj", "there is no file"]),
    ];
    for (geometry, parts) in cases {
        refuse(nowhere, geometry, parts);
    }
}

#[test]
fn wrong_meshes_are_refused_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, parts) in [
        ("empty.obj", "", &["empty.obj", "no faces"] as &[&str]),
        ("points.obj", "v 0 0 0\np 1\n", &["points.obj", "no faces"]),
        ("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n", &["nan.obj:2", "NaN"]),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", &["flat.obj", "no triangle with an area"]),
        ("beyond.obj", "v 0 0 0\nf 1 2 3\n", &["beyond.obj:2", "no vertex 2"]),
        ("cut.ply", "ply\nformat ascii 1.0\n", &["cut.ply", "end_header"]),
        ("short.stl", "hello", &["short.stl", "5 bytes"]),
        ("mesh.fbx", "", &["mesh.fbx", "\"fbx\"", ".obj"]),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
        refuse(folder.path(), &format!("kind = \"mesh\"\nfile = \"{name}\"\nperiod = [1.0, 1.0]"), parts);
    }
}

#[test]
fn wrong_height_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    image::RgbImage::from_fn(2, 2, |x, _| image::Rgb([100 * x as u8, 0, 0])).save(at("red.png")).unwrap();
    image::GrayImage::new(4, 4).save(at("grey.png")).unwrap();
    std::fs::write(at("text.png"), "hello").unwrap();
    std::fs::write(at("text.tmd"), "hello").unwrap();
    std::fs::write(at("heights.csv"), "1,2,3").unwrap();
    for (file, extra, parts) in [
        ("red.png", "pixel = 1.0\nheight = 1.0", &["red.png", "coloured", "grey"] as &[&str]),
        ("grey.png", "pixel = 1.0", &["grey.png", "geometry.height", "white over black"]),
        ("grey.png", "height = 1.0", &["grey.png", "geometry.pixel"]),
        ("grey.png", "height = 1.0\npixel = 1e6", &["grey.png", "4000000 x 4000000", "1e6"]),
        ("text.png", "height = 1.0\npixel = 1.0", &["text.png", "not a readable PNG"]),
        ("text.tmd", "", &["text.tmd", "TrueMap"]),
        ("heights.csv", "height = 1.0\npixel = 1.0", &["heights.csv", "\"csv\"", ".png"]),
    ] {
        refuse(folder.path(), &format!("kind = \"height-field\"\nfile = \"{file}\"\n{extra}"), parts);
    }
}
