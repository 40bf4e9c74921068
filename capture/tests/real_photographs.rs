//! Real photographs, where `BISCALE_DATA` says that they are: chessboards, `ArUco` and `AprilTag` markers, colour checkers.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test fails by panicking, and tells what it skips")]
#![cfg(feature = "opencv")]

use biscale::numerics::colour::lab;
use biscale_capture::board::Board;
use biscale_capture::colour::grey_exponent;
use biscale_capture::dictionary::{self, Dictionary};
use biscale_capture::photo::{self, Photo};
use biscale_capture::vision::calibrate::{BoardView, calibrate};
use biscale_capture::vision::{GreyImage8, board, checker, markers};
use std::path::{Path, PathBuf};

fn data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("BISCALE_DATA").map(|d| PathBuf::from(d).join(folder)).filter(|d| d.is_dir());
    if root.is_none() {
        println!("skipped: BISCALE_DATA is not set, or has no {folder}");
    }
    root
}

fn read(path: PathBuf) -> (Photo, GreyImage8) {
    let photo = photo::read(&path).unwrap_or_else(|e| panic!("{e}"));
    let gray = GreyImage8::of(&photo.picture, true);
    (photo, gray)
}

/// The numbers after `data:` of a matrix in an `OpenCV` YAML file.
fn matrix(text: &str, name: &str) -> Vec<f64> {
    let after = &text[text.find(name).unwrap()..];
    let from = after.find("data: [").unwrap() + 7;
    after[from..].split(']').next().unwrap().split(',').map(|v| v.trim().parse().unwrap()).collect()
}

#[test]
fn chessboards_give_the_published_camera_and_name_their_worst_views() {
    let Some(root) = data("markers/opencv") else { return };
    let numbers: Vec<u32> = (1..=14).filter(|k| *k != 10).collect();
    let layout = Board::chessboard(9, 6, 25.0);
    for side in ["left", "right"] {
        let views: Vec<BoardView> =
            numbers.iter().map(|k| board::detect(&read(root.join(format!("{side}{k:02}.jpg"))).1, &layout).unwrap().corners).collect();
        assert!(views.iter().all(|v| v.len() == 54), "{side}: {:?}", views.iter().map(Vec::len).collect::<Vec<_>>());
        let found = calibrate(&views, 640, 480).unwrap().unwrap();
        let dropped: Vec<u32> = numbers.iter().zip(&found.used).filter(|(_, u)| !**u).map(|(k, _)| *k).collect();
        let lens = found.lens;
        println!(
            "{side}: f {:.2} +/- {:.2}, {:.2}; c {:.2} +/- {:.2}, {:.2} +/- {:.2}; rms {:.3} px; dropped {dropped:?}; coverage {:.2}",
            lens.focal.x,
            found.sigma[0],
            lens.focal.y,
            lens.centre.x,
            found.sigma[2],
            lens.centre.y,
            found.sigma[3],
            found.rms,
            found.coverage
        );
        assert!(found.rms < 0.3, "{side}: {}", found.rms);
        if side == "left" {
            let truth = matrix(&std::fs::read_to_string(root.join("left_intrinsics.yml")).unwrap(), "camera_matrix");
            for (value, truth) in [(lens.focal.x, truth[0]), (lens.focal.y, truth[4]), (lens.centre.x, truth[2]), (lens.centre.y, truth[5])]
            {
                assert!((value / truth - 1.0).abs() < 0.01, "{value} for {truth}");
            }
        }
    }
}

#[test]
fn all_markers_of_the_aruco_and_charuco_photographs_are_found() {
    let Some(root) = data("markers/opencv") else { return };
    let (_, gray) = read(root.join("singlemarkersoriginal.jpg"));
    let ids: Vec<i32> = markers::detect(&gray, &Dictionary::Predefined("DICT_6X6_250")).unwrap().iter().map(|m| m.0).collect();
    assert_eq!(ids, [23, 40, 62, 98, 124, 203]);
    // A grid of 5 x 7 markers of a dictionary that was made for it: they are of none of OpenCV's own, and none may be misread as one of those. The
    // dictionaries of a thousand hold something like one of 35 by chance.
    let (_, gray) = read(root.join("gboriginal.png"));
    for name in dictionary::names() {
        let count = markers::detect(&gray, &Dictionary::Predefined(name)).unwrap().len();
        println!("gboriginal: {count} markers of {name}");
        assert!(count <= if name.ends_with("_1000") { 2 } else { 0 }, "{count} of {name}");
    }
    let own = Dictionary::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data/markers/tutorial_dict.yml"))).unwrap();
    let grid = Board::grid(5, 7, 40.0, 10.0, &own, 0);
    let found = board::detect(&gray, &grid).unwrap();
    let ids: Vec<i32> = found.markers.iter().map(|m| m.0).collect();
    assert_eq!(ids, (0..35).collect::<Vec<i32>>(), "all 35 are seen");
    println!("gboriginal: 35 of 35 markers of its own dictionary, {} corners", found.corners.len());
    assert_eq!(found.corners.len(), 140);
    let (_, gray) = read(root.join("choriginal.jpg"));
    let charuco = Board::charuco(5, 7, 40.0, 20.0, &Dictionary::Predefined("DICT_6X6_250"), true);
    let found = board::detect(&gray, &charuco).unwrap();
    println!("choriginal: {} markers, {} corners, marker scale {:?}", found.markers.len(), found.corners.len(), found.marker_scale);
    assert_eq!((found.markers.len(), found.corners.len()), (17, 24));
}

#[test]
fn april_tags_are_told_from_ours() {
    let Some(root) = data("markers/apriltag") else { return };
    for entry in std::fs::read_dir(root).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "jpg") {
            continue;
        }
        let name = path.display().to_string();
        let (_, gray) = read(path);
        assert!(markers::detect(&gray, &Dictionary::Predefined("DICT_5X5_100")).unwrap().is_empty(), "{name}");
        let other = markers::other_family(&gray, Some(&Dictionary::Predefined("DICT_5X5_100"))).unwrap();
        println!("{name}: {other:?}");
        assert!(other.is_some_and(|(family, count)| family == "AprilTag 36h11" && count > 0), "{name}");
    }
}

#[test]
fn a_colour_checker_is_found_where_it_is_or_refused() {
    let Some(root) = data("colorcard") else { return };
    // What a person sees in them: a whole, plain checker; or one that is cut off, covered or drawn over.
    for (name, whole) in [
        ("source1_img.png", true),
        ("target_img.png", true),
        ("seedhead-rgb.jpg", true),
        ("tilted_color_card.jpg", true),
        ("multiple_color_card.jpg", true),
        ("find_color_card.jpg", false),
        ("partial_card_rgb.png", false),
    ] {
        let (photo, _) = read(root.join(name));
        let mut picture = photo.picture;
        // They are pictures for the screen.
        for v in picture.planes.iter_mut().flatten() {
            *v = biscale::numerics::colour::srgb_to_linear((*v).into()) as f32;
        }
        let saturated = vec![false; picture.planes[0].len()];
        let found = checker::find(&picture, &saturated, None, None).unwrap().filter(|c| c.correction.mean_delta_e() < 25.0);
        match &found {
            Some(c) => println!(
                "{name}: mean Delta E {:.1}, worst {:.1}, grey exponent {:?}; first patch at {:?}, last at {:?}",
                c.correction.mean_delta_e(),
                c.correction.worst_delta_e(),
                grey_exponent(&c.measured),
                c.centres[0],
                c.centres[23]
            ),
            None => println!("{name}: no checker"),
        }
        if let Some(c) = found {
            // The rule of `run`: refused for its bad fit.
            let refused = c.correction.mean_delta_e() > 3.0 && c.correction.worst_delta_e() > 6.0;
            assert!(whole || refused, "{name} has no whole checker");
            // Of a whole one, corrected: white brighter than black, red redder than green.
            let patch = |k: usize| lab((c.correction.matrix * glam::DVec3::from(c.measured[k])).into());
            assert!(!whole || (patch(18)[0] > patch(23)[0] + 20.0 && patch(14)[1] > patch(13)[1] + 20.0), "{name}");
        }
    }
}
