//! `biscale compare` through the binary.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::{Folder, project};

/// A PNG of the samples, 128 x 128, grey.
fn with_images() -> Folder {
    let folder = Folder::new();
    folder.write("a.png", std::fs::read(project("samples/figures/waves.png")).unwrap());
    folder.write("b.png", std::fs::read(project("samples/figures/cells.png")).unwrap());
    folder
}

fn summary(folder: &Folder, arguments: &[&str]) -> Value {
    let said = folder.run(["compare", "--json"].iter().chain(arguments));
    assert_eq!(said.status, 0, "{}", said.stderr);
    serde_json::from_str::<Value>(&said.stdout).unwrap()["summary"].clone()
}

#[test]
fn an_image_equals_itself() {
    let s = summary(&with_images(), &["a.png", "a.png"]);
    assert_eq!((&s["psnr_db"], &s["relative_rms"], &s["flip_mean"]), (&Value::Null, &0.0.into(), &0.0.into()), "{s}");
}

/// A TIFF of floats, 2 x 2 pixels of one grey value.
fn grey_tiff(value: f32) -> Vec<u8> {
    // Size, 32 bits, uncompressed, black is 0, data at byte 134, one sample, 2 rows a strip, 16 bytes, floats.
    let entries = [(256, 2), (257, 2), (258, 32), (259, 1), (262, 1), (273, 134), (277, 1), (278, 2), (279, 16), (339, 3)];
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    bytes.extend(10_u16.to_le_bytes());
    for (tag, value) in entries {
        let [tag, kind] = [tag, 3_u16].map(u16::to_le_bytes);
        let [count, value] = [1, value].map(u32::to_le_bytes);
        bytes.extend([&tag[..], &kind, &count, &value].concat());
    }
    bytes.extend([0; 4]);
    bytes.extend(value.to_le_bytes().repeat(4));
    bytes
}

#[test]
fn black_images_are_identical_and_black_measures_nothing() {
    let folder = Folder::new();
    for (name, value) in [("black.tif", 0.0), ("grey.tif", 0.5), ("hole.tif", f32::NAN), ("infinite.tif", f32::INFINITY)] {
        folder.write(name, grey_tiff(value));
    }
    let said = folder.run(["compare", "black.tif", "black.tif"]);
    assert!(said.status == 0 && said.stdout.contains("identical") && !said.stdout.contains("NaN"), "{}{}", said.stdout, said.stderr);
    let said = folder.run(["compare", "black.tif", "grey.tif"]);
    assert!(said.status == 0 && said.stdout.contains("undefined") && !said.stdout.contains("inf"), "{}{}", said.stdout, said.stderr);
    assert_eq!(summary(&folder, &["black.tif", "black.tif"])["identical"], true);
    let s = summary(&folder, &["grey.tif", "black.tif"]);
    assert!(s["identical"] == false && s["psnr_db"].as_f64().unwrap().abs() < 1e-6 && s["relative_rms"] == 1.0, "{s}");
    // What is no number cannot be compared.
    for name in ["hole.tif", "infinite.tif"] {
        let said = folder.run(["compare", "grey.tif", name]);
        assert!(said.status == 2 && said.stderr.contains(name) && said.stderr.contains("column 0, row 0"), "{}", said.stderr);
    }
}

#[test]
fn radiance_pictures_are_compared_as_images_of_floats() {
    let folder = Folder::new();
    // Two rows of eight pixels, without run lengths.
    let picture =
        |header: &str, size: &str, pixel: [u8; 4]| [format!("#?RADIANCE\n{header}\n{size}\n").into_bytes(), pixel.repeat(16)].concat();
    folder.write("a.hdr", picture("", "-Y 2 +X 8", [128, 128, 128, 129]));
    folder.write("b.hdr", picture("EXPOSURE=2\n", "+Y 2 -X 8", [128, 128, 128, 128]));
    let s = summary(&folder, &["a.hdr", "b.hdr"]);
    assert!((s["relative_rms"].as_f64().unwrap() - 0.5).abs() < 1e-9 && s["values"] == "linear", "{s}");
    let said = folder.run(["compare", "a.hdr", "b.hdr"]);
    assert!(said.status == 0 && said.stderr.contains("b.hdr: the file says that its values are 2 times radiance"), "{}", said.stderr);
    folder.write("lfs.hdr", "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n");
    let said = folder.run(["compare", "a.hdr", "lfs.hdr"]);
    assert!(said.status == 2 && said.stderr.contains("lfs.hdr: the file itself is not here"), "{}", said.stderr);
}

#[test]
fn different_images_differ_and_their_panels_are_written() {
    let folder = with_images();
    let s = summary(&folder, &["a.png", "b.png", "-o", "panels.png"]);
    let number = |key: &str| s[key].as_f64().unwrap();
    assert!((3.0..20.0).contains(&number("psnr_db")) && number("relative_rms") > 0.1, "{s}");
    assert!((0.1..1.0).contains(&number("flip_mean")) && number("flip_largest") <= 1.0, "{s}");
    let bytes = std::fs::read(folder.path("panels.png")).unwrap();
    // Width and height of a PNG stand at byte 16: three images of 128 and two gaps of 4.
    assert_eq!(bytes[16..24], [0, 0, 1, 136, 0, 0, 0, 128]);
    // Its own panels the command replaces.
    summary(&folder, &["a.png", "b.png", "-o", "panels.png"]);
    folder.write("panels.png", "mine");
    assert_eq!(folder.run(["compare", "a.png", "b.png", "-o", "panels.png"]).status, 2);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = with_images();
    folder.write("small.png", std::fs::read(project("docs/gallery/towel-view.png")).unwrap());
    for (arguments, words) in [
        (&["a.png", "small.png"][..], &["small.png", "128 x 128", "same size"][..]),
        (&["a.png", "no.png"], &["no.png", "no such file"]),
        (&["a.png", "m.toml"], &["m.toml", "toml"]),
        (&["a.png", "b.png", "-o", "panels.jpg"], &["panels.jpg", ".png"]),
        (&["a.png", "b.png", "-o", "a.png"], &["a.png"]),
        (&["a.png", "b.png", "--factor", "0"], &["--factor"]),
    ] {
        let said = folder.run(["compare"].iter().chain(arguments));
        assert_eq!(said.status, 2, "{arguments:?}: {}", said.stderr);
        assert!(words.iter().all(|w| said.stderr.contains(w)), "{arguments:?}: {}", said.stderr);
    }
}
