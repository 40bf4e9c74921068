//! Folds that are flat to the eye are neither scored nor labelled.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

use biscale_fabricate::drawing::{Look, Mark, Style, sheets};
use biscale_fabricate::mesh::{Mesh, Tolerance, Triangles};
use biscale_fabricate::paper::Paper;
use biscale_fabricate::unfold::{Effort, Pattern, TabStyle, room, unfold};
use glam::{DVec2, DVec3};

/// Three strips of 30 x 20 mm side by side: valleys of these angles in degrees between them.
fn strips(angles: [f64; 2]) -> Mesh {
    let mut soup = Triangles::default();
    let (mut at, mut slope) = (DVec3::ZERO, 0.0_f64);
    soup.vertices.extend([at, at + DVec3::Y * 30.0]);
    for angle in [0.0, angles[0], angles[1]] {
        slope += angle.to_radians();
        at += 20.0 * DVec3::new(slope.cos(), 0.0, slope.sin());
        let k = u32::try_from(soup.vertices.len()).unwrap();
        soup.vertices.extend([at, at + DVec3::Y * 30.0]);
        soup.triangles.extend([[k - 2, k, k + 1], [k - 2, k + 1, k - 1]]);
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    let tolerance = Tolerance::of_size(soup.size());
    Mesh::new(soup, tolerance).unwrap()
}

/// Scored valleys, lines for readers only, and angles that are written.
fn drawn(mesh: &Mesh, pattern: &Pattern, paper: Paper) -> (usize, usize, usize) {
    let look = Look {
        title: String::new(),
        colours: false,
        angles: true,
        period: 0.0,
        numbers: false,
        silhouette: false,
        back: false,
        clean_front: false,
    };
    let pages = sheets(mesh, pattern, paper, &look, None, Vec::new()).unwrap().pages;
    let marks = || pages.iter().flat_map(|p| &p.items).map(|i| &i.mark);
    let lines = |wanted: Style| marks().filter(|m| matches!(m, Mark::Line { style, .. } if *style == wanted)).count();
    let angles = marks().filter(|m| matches!(m, Mark::Text { text, .. } if text.contains('°'))).count();
    (lines(Style::Valley), lines(Style::Hidden), angles)
}

#[test]
fn a_fold_of_half_a_degree_is_drawn_only_where_it_is_asked_for() {
    let mesh = strips([0.5, 30.0]);
    assert_eq!(mesh.facets.len(), 3);
    let paper = Paper { name: "a4", size: DVec2::new(210.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };
    let tabs = TabStyle::default();
    let (mut pattern, _) = unfold(&mesh, false, room(paper, tabs), tabs, Effort::default(), &|_| false).unwrap();
    assert_eq!(pattern.pieces.len(), 1);
    // The legend has a valley of its own.
    let with = drawn(&mesh, &pattern, paper);
    pattern.flat_angle = 0.1_f64.to_radians();
    let without = drawn(&mesh, &pattern, paper);
    assert_eq!((with.1, without.1), (1, 0), "the reader learns the angle");
    assert_eq!(without.0, with.0 + 1, "one valley more is scored");
}
