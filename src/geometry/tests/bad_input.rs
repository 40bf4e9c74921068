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
    let nowhere = Path::new("");
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
        ("kind = \"mesh\"\nperiod = [1.0, 1.0]", &["geometry.file", "required"]),
        ("kind = \"mesh\"\nfile = \"a.obj\"", &["geometry.period", "required"]),
        ("kind = \"mesh\"\nfile = \"a.obj\"\nperiod = 1.0", &["geometry.period", "2 numbers"]),
        ("kind = \"mesh\"\nfile = \"missing.obj\"\nperiod = [1.0, 1.0]", &["missing.obj", "no such file"]),
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
