//! Folders as phones and people leave them: each is sorted into the right roles, or refused with what is missing and how to take it.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what it measured")]
#![cfg(feature = "opencv")]

mod support;

use biscale::filter::Control;
use biscale::toml_reader::Source;
use biscale_capture::lens::Pose;
use biscale_capture::run::{RunOptions, run};
use biscale_capture::shoot::{Role, Shoot};
use biscale_capture::sort::{Sorted, sort};
use glam::{DMat3, DVec3};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use support::phone::{Photo, shoot};
use support::*;

fn sorted(folder: &Path) -> Sorted {
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    sort(folder, 0, &control).unwrap_or_else(|e| panic!("{e}"))
}

/// The roles of a sorted folder, by the names of the files: board views are counted.
fn roles(sorted: &Sorted) -> String {
    let r = &sorted.roles;
    let short = |name: String| name.trim_start_matches("IMG_00").trim_end_matches(".JPG").to_owned();
    let mut out = vec![format!("{} board", r.boards.len()), format!("{} flat", r.flats.len())];
    out.extend(r.checkers.iter().map(|c| format!("checker {}", short(c.name()))));
    out.extend(r.balls.iter().map(|b| format!("ball {} of {}", short(b.seen.name()), b.light)));
    out.extend(r.close_ups.iter().map(|c| format!("close-up {}", short(c.name()))));
    for (role, views) in [("distant", &r.distant), ("validation", &r.validation)] {
        out.extend(views.iter().map(|v| format!("{role} {}", v.files.iter().map(|f| short(f.name())).collect::<Vec<_>>().join("+"))));
    }
    out.extend(r.unknown.iter().map(|c| format!("unknown {}", short(c.name()))));
    out.join(", ")
}

fn told(sorted: &Sorted) -> String {
    let missing = sorted.missing.iter().map(|m| format!("{}{}: {}", if m.required { "! " } else { "" }, m.what, m.how));
    missing.chain(sorted.notes.iter().cloned()).collect::<Vec<_>>().join("\n")
}

/// Sorted into these roles, with nothing missing that is needed, a shoot file that is read, and these words told.
#[track_caller]
fn assert_sorted(folder: &Path, expected: &str, words: &[&str]) -> Sorted {
    let found = sorted(folder);
    assert_eq!(roles(&found), expected, "{}", told(&found));
    assert!(found.is_complete(), "{}", told(&found));
    for word in words {
        assert!(told(&found).contains(word) || found.text.contains(word), "no {word:?} in\n{}\n{}", told(&found), found.text);
    }
    let parsed = Shoot::parse(&Source { path: folder.join("shoot.toml"), text: found.text.clone() });
    let parsed = parsed.unwrap_or_else(|e| panic!("{e}\n{}", found.text));
    assert_eq!(parsed.of_role(Role::Board).map(|p| p.files.len()).sum::<usize>(), found.roles.boards.len());
    found
}

/// Refused: something that is needed is missing, and all of these words say what and how.
#[track_caller]
fn assert_refused(folder: &Path, words: &[&str]) {
    let found = sorted(folder);
    assert!(!found.is_complete(), "{}\n{}", roles(&found), told(&found));
    let required: String = found.missing.iter().filter(|m| m.required).map(|m| format!("{}: {}\n", m.what, m.how)).collect();
    for word in words {
        assert!(required.contains(word), "no {word:?} in\n{required}\n{}", roles(&found));
    }
}

const USUAL: &str = "11 board, 2 flat, ball 14 of 0, ball 19 of 1, close-up 15, distant 16, validation 18";

fn without(names: &[&str]) -> Vec<Photo> {
    shoot().usual().into_iter().filter(|p| !names.iter().any(|n| p.name.contains(n))).collect()
}

#[test]
fn as_it_was_taken() {
    let folder = shoot().folder(&shoot().usual());
    let found = assert_sorted(folder.path(), USUAL, &["a colour checker", "lit as the distant photograph", "taken 2026:05:01 10:16:00"]);
    assert!(found.assume_srgb && found.notes.is_empty(), "{}", told(&found));
}

#[test]
fn names_say_nothing() {
    let mut photos = shoot().usual();
    let count = photos.len();
    // Every name is that of another role, and the order by name is the other way round.
    for (k, photo) in photos.iter_mut().enumerate() {
        let word = ["close-up", "board", "distant", "flat"][k % 4];
        photo.name = format!("{:02}-{word}.jpg", count - k);
    }
    let folder = shoot().folder(&photos);
    let found = sorted(folder.path());
    assert!(found.is_complete(), "{}", told(&found));
    let r = &found.roles;
    let of = |k: usize| photos[k].name.clone();
    assert_eq!((r.boards.len(), r.flats.len(), r.balls.len()), (11, 2, 2));
    assert_eq!((r.close_ups[0].name(), r.distant[0].files[0].name(), r.validation[0].files[0].name()), (of(14), of(15), of(16)));
}

#[test]
fn orientations_of_exif_are_told_and_pixels_are_left() {
    let mut photos = shoot().usual();
    for (k, photo) in photos.iter_mut().enumerate() {
        photo.exif.as_mut().unwrap().orientation = [1, 3, 6, 8][k % 4];
    }
    let folder = shoot().folder(&photos);
    assert_sorted(folder.path(), USUAL, &["Exif orientation 6: its pixels are taken as the sensor has them"]);
}

#[test]
fn turned_pixels_are_of_the_same_lens() {
    let mut photos = shoot().usual();
    for k in [2, 5, 15] {
        photos[k].picture = image::imageops::rotate90(&photos[k].picture);
    }
    let folder = shoot().folder(&photos);
    assert_sorted(folder.path(), USUAL, &[]);
}

#[test]
fn one_kind_is_missing() {
    let how: [(&[&str], &[&str]); 5] = [
        (&["0015"], &["a close-up", "8 pixels"]),
        (&["0016", "0018"], &["a distant photograph", "from so far away"]),
        (&["0014", "0019"], &["the direction of the lamp of IMG_0016.JPG", "mirror ball"]),
        (&["000", "0010", "0011"], &["views of the calibration board", "biscale new board"]),
        (&["0003", "0004", "0005", "0006", "0007", "0008", "0009", "0010", "0011"], &["more views of the calibration board than 2"]),
    ];
    for (names, words) in how {
        let folder = shoot().folder(&without(names));
        assert_refused(folder.path(), words);
    }
}

#[test]
fn what_can_be_done_without_is_named() {
    let folder = shoot().folder(&without(&["0012", "0013", "0018", "0019"]));
    assert_sorted(
        folder.path(),
        "11 board, 0 flat, ball 14 of 0, close-up 15, distant 16",
        &["a validation photograph", "move the lamp", "a flat field", "corners come out darker"],
    );
    let folder = shoot().folder(&without(&["0001", "0002", "0003"]));
    assert_sorted(folder.path(), &USUAL.replace("11 board", "8 board"), &["more views of the calibration board than 8"]);
    // A validation photograph whose lamp nobody knows would fail: it is left out.
    let folder = shoot().folder(&without(&["0019"]));
    let found = assert_sorted(folder.path(), "11 board, 2 flat, ball 14 of 0, close-up 15, distant 16, validation 18", &["it is left out"]);
    let text = Shoot::parse(&Source { path: folder.path().join("shoot.toml"), text: found.text }).unwrap();
    assert_eq!(text.of_role(Role::Validation).count(), 0);
}

#[test]
fn copies_are_taken_once() {
    let s = shoot();
    let mut photos = s.usual();
    photos.push(Photo { name: "IMG_0016 (1).JPG".into(), ..s.distant.clone() });
    // Burst: the same view again, with its own noise.
    let mut again = s.close_up.clone();
    again.name = "IMG_0015b.JPG".into();
    again.picture.pixels_mut().enumerate().for_each(|(k, p)| p.0[1] = (f64::from(p.0[1]) + 2.0 * normal(k as u64)).clamp(0.0, 255.0) as u8);
    photos.push(again);
    let folder = s.folder(&photos);
    let found = sorted(folder.path());
    assert!(
        found.is_complete() && found.roles.close_ups.len() == 1 && found.roles.distant.len() == 1,
        "{}\n{}",
        roles(&found),
        told(&found)
    );
    assert!(told(&found).contains("the same bytes as") && told(&found).contains("shows the same as"), "{}", told(&found));
}

#[test]
fn copies_of_a_messenger_give_way_to_the_originals() {
    let s = shoot();
    let mut photos = s.usual();
    for (k, photo) in s.usual().iter().enumerate().filter(|(k, _)| [3, 14, 15, 16].contains(k)) {
        let small = image::imageops::resize(&photo.picture, 480, 360, image::imageops::FilterType::Triangle);
        photos.push(Photo { name: format!("IMG-20260501-WA{k:04}.jpg"), picture: small, exif: None });
    }
    let folder = s.folder(&photos);
    assert_sorted(folder.path(), USUAL, &["IMG-20260501-WA0014.jpg: a copy of IMG_0015.JPG of 480 x 360 pixels (as messengers send them)"]);
}

#[test]
fn what_a_phone_lays_beside_is_passed_over() {
    let folder = shoot().folder(&shoot().usual());
    for (name, bytes) in [
        (".DS_Store", &b"\0\0\0\x01Bud1"[..]),
        ("IMG_0015.HEIC", b"\0\0\0\x18ftypheic"),
        ("IMG_0015.AAE", b"<?xml"),
        ("IMG_0016.MOV", b"moov"),
        ("IMG_0016.DNG", b"II*\0"),
        ("Thumbs.db", b"x"),
        ("albums.json", b"{\"a\": 1}"),
    ] {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    assert_sorted(folder.path(), USUAL, &["IMG_0015.HEIC: IMG_0015.JPG lies beside it", "dcraw -4 -T -o 0 -t 0 IMG_0016.DNG"]);
}

#[test]
fn formats_that_are_not_read_are_named_with_their_conversion() {
    let folder = shoot().folder(&without(&["0015"]));
    std::fs::write(folder.path().join("IMG_0015.HEIC"), b"\0\0\0\x18ftypheic").unwrap();
    assert_refused(folder.path(), &["IMG_0015.HEIC", "heif-convert IMG_0015.HEIC IMG_0015.png", "a close-up"]);
}

#[test]
fn strangers_and_broken_files_are_left_out() {
    let s = shoot();
    let mut photos = s.usual();
    photos.push(s.holiday.clone());
    let folder = s.folder(&photos);
    let bytes = s.distant.bytes();
    std::fs::write(folder.path().join("IMG_0060.JPG"), &bytes[..bytes.len() / 30]).unwrap();
    std::fs::write(folder.path().join("IMG_0061.JPG"), b"").unwrap();
    assert_sorted(
        folder.path(),
        &format!("{USUAL}, unknown 60, unknown 50"),
        &["IMG_0050.JPG: nothing of the shoot is seen in it", "IMG_0060.JPG: nothing", "IMG_0061.JPG: not a readable JPEG"],
    );
}

#[test]
fn a_sheet_without_its_sidecar_is_told() {
    let folder = shoot().folder(&shoot().usual());
    std::fs::remove_file(folder.path().join("kit.json")).unwrap();
    assert_refused(folder.path(), &["the sidecar of the sheet", "copy the .json"]);
}

#[test]
fn another_lens_needs_its_own_board_views() {
    let s = shoot();
    let mut photos = without(&["0015"]);
    photos.push(s.tele_close_up.clone());
    let folder = s.folder(&photos);
    assert_refused(folder.path(), &["views of the calibration board through the lens of IMG_0040.JPG", "focal length 9 mm (as 52 mm"]);
    photos.extend(s.tele_boards.iter().cloned());
    let folder = s.folder(&photos);
    assert_sorted(folder.path(), "16 board, 2 flat, ball 14 of 0, ball 19 of 1, close-up 40, distant 16, validation 18", &[]);
}

#[test]
fn exposures_of_one_view_are_brackets() {
    let mut photos = shoot().usual();
    photos.push(shoot().short.clone());
    let folder = shoot().folder(&photos);
    assert_sorted(
        folder.path(),
        &USUAL.replace("distant 16", "distant 16+17"),
        &["files = [\"IMG_0016.JPG\", \"IMG_0017.JPG\"]   # brackets"],
    );
}

#[test]
fn linear_files_of_a_converter_need_no_curve() {
    let s = shoot();
    let folder = s.folder(&s.boards);
    // Sensor values with neither Exif nor a tone curve.
    for photo in s.usual().iter().skip(s.boards.len()) {
        let linear = image::ImageBuffer::<image::Rgb<u16>, _>::from_fn(photo.picture.width(), photo.picture.height(), |x, y| {
            let value = |v: u8| (65535.0 * biscale::numerics::colour::srgb_to_linear(f64::from(v) / 255.0)) as u16;
            image::Rgb(photo.picture.get_pixel(x, y).0.map(value))
        });
        linear.save(folder.path().join(photo.name.replace("JPG", "tif"))).unwrap();
    }
    let found = sorted(folder.path());
    assert_eq!(roles(&found).replace(".tif", ""), USUAL, "{}", told(&found));
    assert!(!found.assume_srgb);
}

#[test]
fn photographs_in_an_inner_folder_are_pointed_to() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("DCIM");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(inner.join("IMG_0001.JPG"), shoot().boards[0].bytes()).unwrap();
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    let message = sort(folder.path(), 0, &control).unwrap_err().to_string();
    assert!(message.contains("there are no photographs") && message.contains("DCIM"), "{message}");
}

/// From the folder to measurements: the shoot file is run as it was written.
#[test]
fn what_was_sorted_is_measured() {
    let s = shoot();
    let folder = s.folder(&s.usual());
    let found = sorted(folder.path());
    let shoot = Shoot::parse(&Source { path: folder.path().join("shoot.toml"), text: found.text }).unwrap();
    let out = folder.path().join("out");
    std::fs::create_dir_all(&out).unwrap();
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    let capture = run(&shoot, &RunOptions { assume_srgb: true, ..RunOptions::default() }, &out, &control).unwrap();
    for c in capture.checks.iter().filter(|c| c.severity > biscale::formats::capture::Severity::Ok) {
        eprintln!("{:?} {} {:?} {:?}: {}", c.severity, c.code, c.photograph, c.measured, c.message);
    }
    assert!(capture.usable);
    let pose = capture.photographs.iter().find(|p| p.role == "distant").unwrap().pose.as_ref().unwrap();
    let got = Pose { rotation: DMat3::from_cols_array_2d(&pose.rotation).transpose(), translation: pose.translation_mm.into() };
    let (shift, turn) = (got.translation.distance(s.pose.translation), got.angle_to(&s.pose).to_degrees());
    eprintln!("distant off by {shift:.3} mm, {turn:.3} degrees");
    assert!(shift < 1.0 && turn < 0.5, "{shift} mm, {turn} degrees");
    for (name, truth) in ["light", "other"].iter().zip(s.lights) {
        let light = capture.lights.iter().find(|l| l.name == *name).unwrap();
        let off = DVec3::from(light.direction).angle_between(truth).to_degrees();
        eprintln!("{name} off by {off:.2} degrees");
        assert!(off < 3.0, "{name} off by {off} degrees");
    }
    let weave = capture.close_up.unwrap().weave.unwrap();
    let pitch = weave["warp"]["pitch"]["value"].as_f64().unwrap();
    eprintln!("pitch {pitch} mm for {}", phone::PITCH);
    assert!((pitch / phone::PITCH - 1.0).abs() < 0.02, "{weave}");
}
