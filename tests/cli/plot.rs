//! `biscale plot` through the binary: pictures that are whole, the same every time, and never in the place of others.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::cases::Wrong::Arguments;
use support::cases::try_all;
use support::{Folder, Said};

const PICTURES: [&str; 4] = ["m-polar.svg", "m-polar.png", "m-view.svg", "m-view.png"];
/// Few and rough: what is tested is not the values.
const QUICK: [&str; 6] = ["plot", "m.toml", "-o", "out", "--tolerance", "0.1"];

fn done(said: &Said) {
    assert_eq!(said.status, 0, "{}", said.stderr);
}

fn bytes(folder: &Folder, name: &str) -> Vec<u8> {
    std::fs::read(folder.path(&format!("out/{name}"))).unwrap()
}

/// Width and height of a PNG.
fn png(bytes: &[u8]) -> (u32, u32) {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

#[test]
fn four_whole_pictures_are_made_and_named() {
    let folder = Folder::new();
    let said = folder.run(QUICK.iter().chain(&["--json"]));
    done(&said);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    let files: Vec<&str> = object["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    assert_eq!(files, PICTURES.map(|p| format!("out/{p}")));
    for name in PICTURES {
        let bytes = bytes(&folder, name);
        if name.ends_with(".png") {
            let (width, height) = png(&bytes);
            assert!(width >= 1000 && height >= 800, "{name}: {width} x {height}");
        } else {
            let text = String::from_utf8(bytes).unwrap();
            assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"), "{name} is not whole");
            assert!(text.contains(">plane</text>"), "{name} does not name the material");
            assert!(!text.contains("NaN") && !text.contains("inf"), "{name} has a number that is none");
        }
    }
    let polar = String::from_utf8(bytes(&folder, "m-polar.svg")).unwrap();
    for words in ["light at 0°", "light at 30°", "light at 60°", "(1/sr)", "facets", "relative RMS error", "tandard error"] {
        assert!(polar.contains(words), "the plot lacks {words:?}");
    }
    let view = String::from_utf8(bytes(&folder, "m-view.svg")).unwrap();
    assert!(view.contains(" mm</text>") && view.contains("data:image/png;base64,iVBORw0KGgo"), "no scale bar or no picture");
}

#[test]
fn the_same_material_makes_the_same_bytes_at_any_thread_count() {
    let folder = Folder::new();
    let all = |threads: &str| {
        done(&folder.run(QUICK.iter().chain(&["--threads", threads])));
        PICTURES.map(|name| bytes(&folder, name))
    };
    assert!(all("1") == all("3"), "the pictures differ");
}

#[test]
fn a_baked_table_is_plotted_without_a_view() {
    let folder = Folder::new();
    done(&folder.run(["bake", "m.toml", "-o", "m.exr", "--resolution", "4", "--quiet"]));
    let said = folder.run(["plot", "m.exr", "-o", "out"]);
    done(&said);
    assert!(said.stderr.contains("no geometry"), "{}", said.stderr);
    assert!(String::from_utf8(bytes(&folder, PICTURES[0])).unwrap().contains("baked table of 4 rings"));
    assert!(!folder.path("out/m-view.png").exists());
}

#[test]
fn incidences_azimuth_quantity_and_periods_can_be_chosen() {
    let folder = Folder::new();
    let options = ["--incidence", "45,75", "--azimuth", "30", "--quantity", "fbar", "--periods", "2"];
    done(&folder.run(QUICK.iter().chain(&options)));
    let polar = String::from_utf8(bytes(&folder, PICTURES[0])).unwrap();
    for words in ["light at 45°", "light at 75°", "azimuth 30°", "times cosine"] {
        assert!(polar.contains(words), "the plot lacks {words:?}");
    }
    assert!(String::from_utf8(bytes(&folder, PICTURES[2])).unwrap().contains("2 × 2 periods"));
}

#[test]
fn pictures_are_replaced_by_their_command_and_others_only_by_force() {
    let folder = Folder::new();
    done(&folder.run(QUICK));
    done(&folder.run(QUICK));
    folder.write("out/m-polar.png", "a picture of mine");
    let said = folder.run(QUICK);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert!(said.stderr.contains("m-polar.png"), "{}", said.stderr);
    assert_eq!(folder.read("out/m-polar.png"), "a picture of mine");
    done(&folder.run(QUICK.iter().chain(&["--force"])));
}

#[test]
fn wrong_plots_are_refused_and_leave_nothing() {
    try_all(&[
        ("no output", Arguments(&["plot", "m.toml"]), 2, &["--output"]),
        ("a file for a folder", Arguments(&["plot", "m.toml", "-o", "p.csv"]), 2, &["p.csv", "no folder"]),
        ("a material that is not there", Arguments(&["plot", "no.toml", "-o", "out"]), 2, &["no.toml", "no such file"]),
        ("an incidence below the horizon", Arguments(&["plot", "m.toml", "-o", "out", "--incidence", "95"]), 2, &["--incidence", "89.9"]),
        ("an incidence that is no number", Arguments(&["plot", "m.toml", "-o", "out", "--incidence", "steep"]), 2, &["--incidence"]),
        ("too many incidences", Arguments(&["plot", "m.toml", "-o", "out", "--incidence", "0,1,2,3,4,5,6"]), 2, &["--incidence", "7", "6"]),
        ("an azimuth that is none", Arguments(&["plot", "m.toml", "-o", "out", "--azimuth", "nan"]), 2, &["--azimuth"]),
        ("no periods", Arguments(&["plot", "m.toml", "-o", "out", "--periods", "0"]), 2, &["--periods"]),
    ]);
    let folder = Folder::new();
    folder.write("cut.exr", b"\x76\x2f\x31\x01\x02\0\0\0chan");
    let said = folder.run(["plot", "cut.exr", "-o", "out"]);
    assert!(said.status == 2 && said.stderr.contains("cut.exr") && said.stderr.contains("OpenEXR"), "{}", said.stderr);
}

#[test]
fn a_failed_plot_takes_its_new_folder_away() {
    let folder = Folder::new();
    let before = folder.snapshot();
    let said = folder.run(["plot", "m.toml", "-o", "out", "--method", "sg", "--bounces", "2"]);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert!(folder.snapshot() == before, "the folder changed");
}

#[test]
fn several_materials_are_drawn_into_one_plot() {
    let folder = Folder::new();
    folder.write("n.toml", support::MATERIAL.replace("plane\"\n\n", "snow\"\n\n").replace("0.5", "0.9"));
    let said = folder.run(["plot", "m.toml", "n.toml", "-o", "out", "--tolerance", "0.1"]);
    done(&said);
    assert!(said.stderr.contains("wrote out/m-and-n-polar.svg") && !folder.path("out/m-and-n-view.png").exists(), "{}", said.stderr);
    let polar = String::from_utf8(bytes(&folder, "m-and-n-polar.svg")).unwrap();
    assert!(polar.contains(">plane, snow</text>") && polar.contains("snow: method direct"), "the plot names both");
    let said = folder.run(["plot", "m.toml", "no.toml", "-o", "out"]);
    assert!(said.status == 2 && said.stderr.contains("no.toml"), "{}", said.stderr);
}
