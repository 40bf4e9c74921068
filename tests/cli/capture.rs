//! `biscale capture` through the binary: a whole shoot, what it says, and what it leaves.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

#[path = "../../capture/tests/support/mod.rs"]
mod studio;

use serde_json::Value;
use studio::flat_shoot::FlatShoot;
use support::Folder;

#[test]
fn a_shoot_is_checked_captured_and_repeated() {
    let folder = Folder::new();
    FlatShoot::write(&folder.path(""), 600);
    let said = folder.run(["check", "shoot.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stdout.contains("13 board") && said.stdout.contains("calibrated from the board views"), "{}", said.stdout);
    let said = folder.run(["capture", "shoot.toml", "-o", "out"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stderr.contains("camera (calibrated)") && said.stderr.contains("report.html"), "{}", said.stderr);
    for file in
        ["capture.json", "report.html", "distant.exr", "distant-mask.png", "close-up.exr", "close-up-rectified.exr", "validation.exr"]
    {
        assert!(folder.path("out").join(file).is_file(), "{file}");
    }
    assert_draft_is_drawn(&folder.read("out/report.html"));
    let first = folder.snapshot();
    // Its own folder is written again, with the same bytes, at another number of threads.
    let said = folder.run(["capture", "shoot.toml", "-o", "out", "--json", "--threads", "1"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let json: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(json["usable"], true);
    let again = folder.snapshot();
    let changed: Vec<_> = first.iter().filter(|(path, bytes)| again.get(*path) != Some(*bytes)).map(|(path, _)| path).collect();
    assert!(changed.is_empty() && again.len() == first.len(), "other bytes in {changed:?}");
    // Someone else's is not.
    std::fs::create_dir(folder.path("mine")).unwrap();
    folder.write("mine/notes.txt", "precious");
    let said = folder.run(["capture", "shoot.toml", "-o", "mine"]);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert!(said.stderr.contains("--force") && folder.read("mine/notes.txt") == "precious");
}

/// The draft of the twill in the report, as a picture: dark where the warp is on top and light elsewhere, whatever the page's style says of lines.
fn assert_draft_is_drawn(html: &str) {
    use resvg::{tiny_skia, usvg};
    let between = |text: &str, from: &str, to: &str| text.split_once(from).unwrap().1.split_once(to).unwrap().0.to_owned();
    let style = between(html, "<style>", "</style>");
    let inner = between(html, "<svg class=\"plain\" viewBox=\"0 0 3 3\"", "</svg>");
    let (_, cells) = inner.split_once('>').unwrap();
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plain\" viewBox=\"0 0 3 3\" width=\"60\" height=\"60\"><style>{style}</style>{cells}</svg>"
    );
    let tree = usvg::Tree::from_str(&svg, &usvg::Options::default()).unwrap();
    let mut canvas = tiny_skia::Pixmap::new(60, 60).unwrap();
    resvg::render(&tree, tiny_skia::Transform::identity(), &mut canvas.as_mut());
    let dark: Vec<bool> = (0..9).map(|k| canvas.pixel(20 * (k % 3) + 10, 20 * (k / 3) + 10).unwrap().red() < 128).collect();
    // One warp on top in each row and each column.
    assert!((0..3).all(|j| dark[3 * j..3 * j + 3].iter().filter(|d| **d).count() == 1), "{dark:?}");
    assert!((0..3).all(|i| (0..3).filter(|j| dark[3 * j + i]).count() == 1), "{dark:?}");
}

#[test]
fn a_failed_check_ends_with_status_1_and_a_report() {
    let folder = Folder::new();
    folder.write("broken.png", b"\x89PNG\r\n\x1a\n");
    image::RgbImage::from_pixel(64, 64, image::Rgb([90, 90, 90])).save(folder.path("eight.png")).unwrap();
    let shoot = "format = 1\n[sample]\nshape = \"plane\"\nwidth_mm = 9\nheight_mm = 9\n[[photo]]\nrole = \"close-up\"\nfile = \"broken.png\"\n\
                 [[photo]]\nrole = \"distant\"\nfile = \"eight.png\"\n";
    folder.write("shoot.toml", shoot);
    let said = folder.run(["capture", "shoot.toml", "-o", "out"]);
    assert_eq!(said.status, 1, "{}", said.stderr);
    for word in ["error: UNREADABLE: broken.png", "error: NOT_LINEAR: eight.png", "--assume-srgb"] {
        assert!(said.stderr.contains(word), "no {word:?} in {}", said.stderr);
    }
    let json: Value = serde_json::from_str(&folder.read("out/capture.json")).unwrap();
    assert_eq!(json["usable"], false);
    assert!(folder.read("out/report.html").contains("UNREADABLE"));
    let said = folder.run(["capture", "shoot.toml", "-o", "out", "--quiet"]);
    assert!(said.status == 1 && said.stdout.starts_with("not usable: ") && said.stdout.lines().count() == 1, "{}", said.stdout);
}

#[test]
fn a_wrong_shoot_file_is_refused_and_nothing_is_written() {
    let folder = Folder::new();
    for (text, word) in [
        ("format = 1\n", "sample"),
        ("format = 1\n[sample]\nshape = \"cube\"\n", "plane"),
        (
            "format = 1\n[sample]\nshape = \"plane\"\nwidth_mm = 9\nheight_mm = 9\n[[photo]]\nrole = \"distand\"\nfile = \"x.png\"\n",
            "not known here",
        ),
        (
            "format = 1\n[sample]\nshape = \"plane\"\nwidth_mm = 9\nheight_mm = 9\n[[photo]]\nrole = \"distant\"\nfile = \"x.png\"\n",
            "there is no file",
        ),
        ("format = 1\n[sample]\nshape = \"plane\"\nwidth_mm = 9\nheight_mm = 9\nsheet = \"m.toml\"\n", "no sidecar"),
    ] {
        folder.write("shoot.toml", text);
        let before = folder.snapshot();
        let said = folder.run(["capture", "shoot.toml", "-o", "out"]);
        assert_eq!(said.status, 2, "{text}: {}", said.stderr);
        assert!(
            said.stderr.contains(word) && said.stderr.contains("shoot.toml") | said.stderr.contains("m.toml"),
            "{text}: {}",
            said.stderr
        );
        assert!(folder.snapshot() == before, "{text}: something was written");
    }
}

#[test]
fn check_opens_the_photographs() {
    let folder = Folder::new();
    let grey = |name: &str, w, h| image::RgbImage::from_pixel(w, h, image::Rgb([90, 90, 90])).save(folder.path(name)).unwrap();
    grey("a.png", 300, 200);
    grey("b.png", 320, 200);
    folder.write("c.heic", "ftypheic");
    folder.write("d.png", "no picture");
    let shoot = |camera: &str, file: &str| {
        format!(
            "format = 1\n{camera}[sample]\nshape = \"plane\"\nwidth_mm = 9\nheight_mm = 9\n[[photo]]\nrole = \"distant\"\nfile = \"a.png\"\n[[photo]]\nrole = \"validation\"\n\
             file = \"{file}\"\n"
        )
    };
    for (text, status, words) in [
        (shoot("[camera]\nfocal_px = 400\n", "a.png"), 0, &["shoot.toml: ok", "--assume-srgb"][..]),
        (shoot("[camera]\nfocal_px = 107\n", "a.png"), 0, &["readable, but doubtful", "a field of view of 109 degrees"]),
        (shoot("[camera]\nfocal_px = 400\n", "b.png"), 2, &["b.png is 320 x 200 pixels", "300 x 200 pixels"]),
        (shoot("", "c.heic"), 2, &["c.heic", "heif-convert c.heic c.png"]),
        (shoot("", "d.png"), 2, &["d.png"]),
    ] {
        folder.write("shoot.toml", &text);
        let said = folder.run(["check", "shoot.toml"]);
        assert_eq!(said.status, status, "{text}: {}{}", said.stdout, said.stderr);
        let told = format!("{}{}", said.stdout, said.stderr);
        assert!(words.iter().all(|word| told.contains(word)), "{words:?}: {told}");
    }
}
