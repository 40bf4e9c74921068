//! `biscale btf` through the binary: what it writes, what reads that, and what is refused before the work.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::btf::{BtfFile, Ptm};
use serde_json::Value;
use support::cases::Wrong::Arguments;
use support::cases::try_all;
use support::{Folder, Said};

const LIST: &str = "# theta phi\n0 0\n30 0\n30 120\n30 240\n60 60\n60 180\n60 300\n";

fn made(folder: &Folder) -> Said {
    folder.write("seven.txt", LIST);
    folder.run([
        "btf",
        "make",
        "m.toml",
        "-o",
        "a.btf.npz",
        "--texels",
        "4x3",
        "--directions",
        "seven.txt",
        "--tolerance",
        "0.05",
        "--json",
    ])
}

#[test]
fn a_flat_diffuse_tile_is_albedo_over_pi_times_the_cosine_of_the_light_in_all_texels() {
    let folder = Folder::new();
    let said = made(&folder);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!((&object["summary"]["views"], &object["summary"]["texels"][1]), (&7.into(), &3.into()));
    let mut btf = BtfFile::open(&folder.path("a.btf.npz")).unwrap();
    assert!(btf.cover.iter().all(|c| *c == [1.0; 2]) && btf.about.material == folder.read("m.toml"));
    for view in 0..7 {
        let image = btf.view(view).unwrap();
        for (light, texels) in image.chunks_exact(12).enumerate() {
            let expected = 0.5 / std::f64::consts::PI * btf.lights[light].z;
            assert!(texels.iter().flatten().all(|&v| (f64::from(v) / expected - 1.0).abs() < 1e-3), "{view} {light}: {texels:?}");
        }
    }
}

#[test]
fn one_image_is_a_picture_and_one_view_a_map_that_other_programs_relight() {
    let folder = Folder::new();
    assert_eq!(made(&folder).status, 0);
    let said = folder.run(["btf", "image", "a.btf.npz", "-o", "a.png", "--view", "3", "--light", "2", "--repeat", "5"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stderr.contains("theta 30.0, phi 240.0"), "{}", said.stderr);
    let picture = image::open(folder.path("a.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (20, 15));
    assert_eq!(folder.run(["btf", "image", "a.btf.npz", "-o", "a.exr"]).status, 0);
    let said = folder.run(["btf", "ptm", "a.btf.npz", "-o", "a.ptm", "--linear", "--exposure", "0", "--json"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    // The cosine is sqrt(1 - lx² - ly²), which a polynomial of degree two nearly is.
    assert!(object["relative_rms"].as_f64().unwrap() < 0.02 && object["relative_rms_of_file"].as_f64().unwrap() < 0.03, "{object}");
    assert_eq!(Ptm::read(&std::fs::read(folder.path("a.ptm")).unwrap()).unwrap().texels, [4, 3]);
}

#[test]
fn clusters_and_components_are_compared_and_the_smallest_result_is_a_btf_again() {
    let folder = Folder::new();
    assert_eq!(made(&folder).status, 0);
    let pca = |rest: &[&str]| {
        let said = folder.run(["btf", "pca", "a.btf.npz", "--json"].iter().chain(rest));
        assert_eq!(said.status, 0, "{}", said.stderr);
        serde_json::from_str::<Value>(&said.stdout).unwrap()
    };
    // All texels of a flat tile are alike, and all images multiples of one: one mean, or one component.
    let object = pca(&["--clusters", "1", "--components", "0,1", "--precision", "float"]);
    let error = |at: usize| object["tried"][at]["relative_rms"].as_f64().unwrap();
    assert!(error(0) < 1e-3 && error(2) > 0.1 && error(3) < 1e-3, "{object}");
    assert!(object["raw_bytes"] == 7 * 7 * 12 * 3 * 2 && object["chosen"].is_null());
    let object = pca(&["--tolerance", "0.01", "-o", "b.btf.npz"]);
    assert!(
        object["chosen"]["relative_rms_stored"].as_f64().unwrap() <= 0.01 && object["chosen"]["bytes"].as_u64().unwrap() < 7 * 7 * 12 * 6
    );
    let (mut before, mut after) = (BtfFile::open(&folder.path("a.btf.npz")).unwrap(), BtfFile::open(&folder.path("b.btf.npz")).unwrap());
    assert!(after.about.notes.iter().any(|n| n.contains("principal component")) && after.about.relative_rms >= before.about.relative_rms);
    assert!(after.cover == before.cover && after.about.material == before.about.material);
    let (a, b) = (before.view(4).unwrap(), after.view(4).unwrap());
    assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 0.02 * a + 1e-4));
    let said = folder.run(["btf", "pca", "a.btf.npz", "--clusters", "1,2", "--components", "1"]);
    assert!(said.stderr.contains("arrangement") && said.stderr.contains("texture      2"), "{}", said.stderr);
}

#[test]
fn what_cannot_be_made_or_shown_is_refused_before_the_work() {
    try_all(&[
        ("another ending", Arguments(&["btf", "make", "m.toml", "-o", "a.exr"]), 2, &["a.exr", ".npz"]),
        ("standard output", Arguments(&["btf", "make", "m.toml", "-o", "-"]), 2, &[".npz"]),
        (
            "no such set",
            Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--directions", "ubo99"]),
            2,
            &["ubo99", "--directions", "ubo81"],
        ),
        (
            "a list that is none",
            Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--lights", "m.toml"]),
            2,
            &["m.toml", "line 1", "not all numbers"],
        ),
        ("no texels", Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--texels", "0"]), 2, &["--texels", "1 to 2048"]),
        ("texels in words", Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--texels", "axb"]), 2, &["--texels", "64x32"]),
        ("a plane nowhere", Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--plane", "nan"]), 2, &["--plane", "middle"]),
        ("a plane far away", Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--plane", "1e18"]), 2, &["--plane", "periods"]),
        (
            "too much",
            Arguments(&["btf", "make", "m.toml", "-o", "a.npz", "--texels", "2048", "--directions", "ubo151"]),
            2,
            &["do not fit into memory", "fewer texels"],
        ),
        ("a material that is no BTF", Arguments(&["btf", "image", "m.toml", "-o", "a.png"]), 2, &["m.toml", "no BTF"]),
        ("no BTF at all", Arguments(&["btf", "ptm", "none.npz", "-o", "a.ptm"]), 2, &["none.npz", "no such file"]),
        ("components of no BTF", Arguments(&["btf", "pca", "m.toml"]), 2, &["m.toml", "no BTF"]),
        ("a result of another kind", Arguments(&["btf", "pca", "m.toml", "-o", "a.exr"]), 2, &["a.exr", ".npz"]),
        ("a tolerance of 0", Arguments(&["btf", "pca", "m.toml", "--tolerance", "0"]), 2, &["--tolerance", "0.000001"]),
        ("clusters in words", Arguments(&["btf", "pca", "m.toml", "--clusters", "1,few"]), 2, &["--clusters", "few"]),
        ("a picture of another kind", Arguments(&["btf", "image", "m.toml", "-o", "a.jpg"]), 2, &["a.jpg", ".png or .exr"]),
    ]);
    let folder = Folder::new();
    assert_eq!(made(&folder).status, 0);
    for (flag, number) in [("--view", "7"), ("--light", "9")] {
        let said = folder.run(["btf", "image", "a.btf.npz", "-o", "a.png", flag, number]);
        assert!(said.status == 2 && said.stderr.contains("numbered from 0") && !folder.path("a.png").exists(), "{}", said.stderr);
    }
    for (flags, words) in [
        (&["--clusters", "1,13"][..], ["--clusters", "1 to 12"]),
        (&["--clusters", "0", "--arrangement", "texture"], ["--clusters", "1 to 49"]),
        (&["--components", "300"], ["--components", "0 to 256"]),
        (&["-o", "b.npz"], ["--output", "--tolerance"]),
        (
            &["-o", "b.npz", "--tolerance", "1e-6", "--arrangement", "texture", "--clusters", "1", "--components", "0"],
            ["--tolerance", "loosen it"],
        ),
    ] {
        let said = folder.run(["btf", "pca", "a.btf.npz"].iter().chain(flags));
        let is_told = words.iter().all(|word| said.stderr.contains(word));
        assert!(said.status == 2 && is_told && !folder.path("b.npz").exists(), "{flags:?}: {}", said.stderr);
    }
    // The same command replaces what it made, and nothing else.
    assert_eq!(made(&folder).status, 0);
    folder.write("a.btf.npz", "a picture of mine");
    assert!(made(&folder).status == 2 && folder.read("a.btf.npz") == "a picture of mine");
}
