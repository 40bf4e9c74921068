//! The markers that our sheets print are those that `OpenCV` reads.
#![allow(clippy::unwrap_used, clippy::cast_sign_loss, reason = "a test fails by panicking")]
#![cfg(feature = "opencv")]

use biscale_capture::vision::markers;
use biscale_fabricate::aruco::is_white;

#[test]
fn all_hundred_markers_have_the_bits_of_opencv() {
    for id in 0..100 {
        let theirs = markers::bits("DICT_5X5_100", id).unwrap();
        let ours: Vec<bool> = (0..25).map(|k| is_white(id as usize, 1 + k / 5, 1 + k % 5)).collect();
        assert_eq!(ours, theirs, "marker {id}");
    }
}
