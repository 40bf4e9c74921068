//! The verifier reads what is printed: right patterns pass, whatever is wrong with one is found.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod surfaces;

use biscale_fabricate::drawing::Look;
use biscale_fabricate::paper::Paper;
use surfaces::{A4, forty, look, printed};

#[test]
fn a_clean_front_has_its_folds_and_texts_on_the_back_and_other_papers_pass() {
    for (k, (name, soup)) in forty().into_iter().enumerate().step_by(7) {
        let look = Look { back: true, clean_front: true, ..look() };
        let size = [glam::DVec2::splat(304.8), glam::DVec2::new(215.9, 355.6)][k % 2];
        let pattern = printed(soup, &look, Paper { size, ..A4 }, k as u64);
        assert_eq!(pattern.pages(), Vec::<String>::new(), "{name}");
        let front = &pattern.svg[0];
        assert!(!front.contains("data-number-of") && !front.contains("data-name") && !front.contains("data-angle-of"), "{name}");
        let drawn = |line: &str| line.contains("data-edge=") && !line.contains("stroke=\"none\"");
        assert!(!front.lines().any(drawn), "{name}: a fold on the front");
    }
}

#[test]
fn forty_right_patterns_of_forty_surfaces_pass() {
    let surfaces = forty();
    assert_eq!(surfaces.len(), 40);
    let mut wrong = Vec::new();
    for (k, (name, soup)) in surfaces.into_iter().enumerate() {
        // Pages of all kinds in turn.
        let look =
            Look { back: k % 3 == 1, silhouette: k % 4 == 2, colours: k % 5 != 3, angles: k % 7 != 5, numbers: k % 11 != 9, ..look() };
        let inset = if look.silhouette { 11.0 } else { 0.0 };
        let pattern = printed(soup, &look, Paper { inset, ..A4 }, k as u64);
        let (pages, data) = (pattern.pages(), pattern.data());
        if !(pages.is_empty() && data.is_empty()) {
            wrong.push(format!("{name}: {pages:#?} {data:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{} of 40\n{}", wrong.len(), wrong.join("\n"));
}
