//! The markers that our sheets print are those that `OpenCV` reads, and those of a file are read as they stand there.
#![allow(clippy::unwrap_used, clippy::cast_sign_loss, reason = "a test fails by panicking")]
#![cfg(feature = "opencv")]

use biscale::toml_reader::Source;
use biscale_capture::board::Board;
use biscale_capture::dictionary::Dictionary;
use biscale_capture::photo::PlanarImage;
use biscale_capture::shoot::Shoot;
use biscale_capture::vision::{GreyImage8, board, markers};
use biscale_fabricate::wrap::aruco::is_white;
use glam::DVec2;
use std::path::Path;

#[test]
fn all_hundred_markers_have_the_bits_of_opencv() {
    for id in 0..100 {
        let theirs = markers::bits(&Dictionary::Predefined("DICT_5X5_100"), id).unwrap();
        let ours: Vec<bool> = (0..25).map(|k| is_white(id as usize, 1 + k / 5, 1 + k % 5)).collect();
        assert_eq!(ours, theirs, "marker {id}");
    }
}

fn file() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data/markers/tutorial_dict.yml"))
}

/// A shoot whose board is a grid of markers.
fn shoot(board: &str) -> biscale::Result<Shoot> {
    let head = "format = 1\n[camera]\nfocal_px = 1000\n[sample]\nshape = \"plane\"\nwidth_mm = 60\nheight_mm = 40\nboard_mm = [120, 90]\n";
    // Any file will do for a photograph that is only listed.
    let photo = format!("[[photo]]\nrole = \"distant\"\nfile = \"{}\"\n", file().display());
    Shoot::parse(&Source {
        path: file().with_file_name("shoot.toml"),
        text: format!("{head}{photo}[board]\nkind = \"aruco-grid\"\n{board}"),
    })
}

#[test]
fn markers_of_a_file_are_found() {
    const PIXELS: f64 = 4.0;
    let shoot = shoot("columns = 5\nrows = 7\nmarker_mm = 16\ngap_mm = 5\ndictionary_file = \"tutorial_dict.yml\"\n").unwrap();
    let grid = shoot.board.unwrap();
    let own = grid.dictionary.clone().unwrap();
    let Dictionary::Custom(list) = &own else { panic!("{own:?}") };
    for (id, bits) in (0..).zip(&list.markers) {
        assert_eq!(&markers::bits(&own, id).unwrap(), bits, "marker {id}");
    }
    // The grid from above, with a white rim; x to the right, y up.
    let rim = DVec2::splat(10.0);
    let size = ((grid.size + 2.0 * rim) * PIXELS).as_uvec2();
    let mut picture = PlanarImage::new(size.x as usize, size.y as usize);
    for row in 0..picture.height {
        for column in 0..picture.width {
            let pixel = DVec2::new(column as f64 + 0.5, (picture.height - row) as f64 - 0.5);
            let place = pixel / PIXELS - rim;
            let black = grid.markers.iter().any(|(id, corners)| {
                let cell = (DVec2::new(1.0, -1.0) * (place - corners[0]) / 16.0 * 8.0).floor();
                let (i, j) = (cell.x as i32, cell.y as i32);
                let inside = |v: i32| (1..7).contains(&v);
                (0..8).contains(&i)
                    && (0..8).contains(&j)
                    && !(inside(i) && inside(j) && list.markers[*id as usize][(6 * (j - 1) + i - 1) as usize])
            });
            for plane in &mut picture.planes {
                plane[row * size.x as usize + column] = if black { 0.05 } else { 0.8 };
            }
        }
    }
    let gray = GreyImage8::of(&picture, true);
    let found = board::detect(&gray, &grid).unwrap();
    assert_eq!(found.markers.len(), 35);
    for (place, pixel) in &found.corners {
        let expected = (*place + rim) * PIXELS;
        let off = (*pixel + 0.5 - DVec2::new(expected.x, f64::from(size.y) - expected.y)).length();
        assert!(off < 0.2, "{place} seen at {pixel}, {off} px off");
    }
    let other = Board::grid(5, 7, 16.0, 5.0, &Dictionary::Predefined("DICT_5X5_100"), 0);
    assert!(board::detect(&gray, &other).unwrap().markers.is_empty());
}

#[test]
fn wrong_dictionaries_of_a_board_are_refused() {
    let grid = "columns = 5\nrows = 7\nmarker_mm = 16\ngap_mm = 5\n";
    for (more, word) in [
        ("dictionary = \"DICT_6X6_50\"\nfirst_id = 16\n", "marker 50"),
        ("dictionary_file = \"tutorial_dict.yml\"\nfirst_id = 1\n", "marker 35"),
        ("dictionary_file = \"tutorial_dict.yml\"\ndictionary = \"DICT_6X6_50\"\n", "keep the one"),
        ("dictionary_file = \"nowhere.yml\"\n", "nowhere.yml"),
        ("dictionary_file = \"../README.md\"\n", "README.md:3"),
    ] {
        let message = shoot(&format!("{grid}{more}")).unwrap_err().to_string();
        assert!(message.contains(word), "{more}: {message}");
    }
}
