//! `biscale capture PHOTOGRAPH`: what one photograph tells, and that no more is said.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test that meets the unexpected should panic, and tells what it measured")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

#[path = "../../capture/tests/support/mod.rs"]
mod studio;

use glam::DVec2;
use serde_json::Value;
use support::Folder;

/// A twill of threads 14 x 12 pixels apart, turned by 2 degrees, with the noise of a camera.
fn cloth(folder: &Folder, name: &str) {
    const TWILL: [&[bool]; 3] = [&[true, false, false], &[false, true, false], &[false, false, true]];
    let turn = DVec2::from_angle(2.0_f64.to_radians());
    let value = |x: f64, y: f64| {
        let place = turn.rotate(DVec2::new(x, 400.0 - y));
        studio::cloth(place, &TWILL, DVec2::new(14.0, 12.0), DVec2::new(12.0, 10.2), [0.5, 0.12, 0.1], [0.1, 0.2, 0.5])
    };
    let picture = image::RgbImage::from_fn(400, 400, |x, y| {
        let mut sum = [0.0; 3];
        for k in 0..9 {
            let (u, v) = (f64::from(k % 3) / 3.0, f64::from(k / 3) / 3.0);
            for (s, c) in sum.iter_mut().zip(value(f64::from(x) + u, f64::from(y) + v)) {
                *s += c / 9.0;
            }
        }
        let noise = studio::normal(u64::from(y) << 16 | u64::from(x));
        image::Rgb(sum.map(|c| (255.0 * biscale::numerics::colour::linear_to_srgb(c) + 1.5 * noise).round() as u8))
    });
    picture.save(folder.path(name)).unwrap();
}

#[test]
fn a_photograph_tells_ratios_and_a_material_that_is_read() {
    let folder = Folder::new();
    cloth(&folder, "cloth.png");
    let said = folder.run(["capture", "cloth.png", "-o", "seen"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    for words in [
        "weave: twill 1/2",
        "distance of the warp threads over that of the weft: 1.16",
        "not known",
        "size: a marker or a ruler",
        "seen/guess.toml",
    ] {
        assert!(said.stderr.contains(words), "no {words:?} in {}", said.stderr);
    }
    assert!(!said.stderr.contains("NaN"), "{}", said.stderr);
    assert_eq!(folder.run(["check", "seen/guess.toml"]).status, 0);
    // Its own folder is written again; someone else's is not.
    let said = folder.run(["capture", "cloth.png", "-o", "seen", "--json"]);
    let json: Value = serde_json::from_str(&said.stdout).unwrap();
    assert!(said.status == 0 && json["known"].as_array().unwrap().len() > 4, "{}", said.stdout);
    let said = folder.run(["capture", "cloth.png", "-o", "seen", "--quiet"]);
    assert!(said.status == 0 && said.stderr.is_empty(), "{}", said.stderr);
    assert!(said.stdout.starts_with("cloth.png: weave twill 1/2") && said.stdout.lines().count() == 1, "{}", said.stdout);
    // The plots of a material show its name beside a scale bar.
    assert!(folder.read("seen/guess.toml").contains("name = \"cloth, 1 mm is a pixel\""), "{}", folder.read("seen/guess.toml"));
    // Nothing that repeats is no cloth.
    image::RgbImage::from_pixel(200, 200, image::Rgb([90, 120, 90])).save(folder.path("grey.png")).unwrap();
    let said = folder.run(["capture", "grey.png", "-o", "grey"]);
    assert!(said.status == 1 && said.stderr.contains("nothing in the photograph repeats"), "{}", said.stderr);
    let said = folder.run(["capture", "grey.png", "-o", "grey", "--quiet"]);
    assert!(
        said.status == 1 && said.stdout.starts_with("grey.png: nothing is known: nothing in the photograph repeats"),
        "{}",
        said.stdout
    );
    assert_eq!((said.stdout.lines().count(), said.stderr.as_str()), (1, ""));
    folder.write("a.heic", "ftypheic");
    let said = folder.run(["capture", "a.heic", "-o", "b"]);
    assert!(said.status == 2 && said.stderr.contains("heif-convert a.heic a.png"), "{}", said.stderr);
}

#[test]
fn real_fabrics_tell_what_they_show_and_no_more() {
    let Some(data) = std::env::var_os("BISCALE_DATA") else {
        eprintln!("skipped: BISCALE_DATA is not set");
        return;
    };
    let folder = Folder::new();
    for name in ["twill1_R", "twill2_R", "satin1_R"] {
        let photo = std::path::Path::new(&data).join(format!("fabric_photos/{name}.png"));
        std::fs::copy(photo, folder.path(&format!("{name}.png"))).unwrap();
        let clock = std::time::Instant::now();
        let said = folder.run(["capture", &format!("{name}.png"), "-o", name, "--json"]);
        let seconds = clock.elapsed().as_secs_f64();
        let json: Value = serde_json::from_str(&said.stdout).unwrap();
        eprintln!("{name}: {seconds:.1} s");
        for fact in json["known"].as_array().unwrap() {
            eprintln!("  {}: {}", fact["what"], fact["value"]);
        }
        for doubt in json["doubts"].as_array().unwrap() {
            eprintln!("  doubtful: {doubt}");
        }
        assert!(seconds < 60.0, "{seconds} s");
        // Threads of 2 to 4 pixels have no widths that could be told.
        let known: Vec<&str> = json["known"].as_array().unwrap().iter().filter_map(|k| k["what"].as_str()).collect();
        assert!(known.contains(&"weave") && !known.iter().any(|k| k.starts_with("width") || k.starts_with("colour")), "{known:?}");
        assert!(json["known"][0]["value"].as_str().unwrap().contains("not certain"), "{}", json["known"]);
    }
}
