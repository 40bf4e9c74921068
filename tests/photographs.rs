//! Rendered pictures against photographs by an independent renderer, of threads that are really there (`tests/data/photos/README.md`).

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

use biscale::filter::{Control, Quality};
use biscale::render::{Light, Scene, render};
use glam::DVec3;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Columns that are averaged: a single one is 1.1 periods wide, and shows which thread it caught.
const WINDOW: usize = 9;
/// Least cosines to the light and to the viewer: nearer to the terminator the shadows are as long as the cylinder bends.
const LEAST: [f64; 2] = [0.3, 0.2];

#[test]
fn a_woven_cylinder_looks_as_it_was_photographed() {
    let folder = Path::new("tests/data/photos");
    let text = std::fs::read_to_string(folder.join("columns.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|l| l.split(',').collect()).collect();
    let cancel = AtomicBool::new(false);
    let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
    // Largest deviation of a mean of columns, and of the mean of all of them.
    for (photo, largest, overall) in [("b", 0.02, 0.005), ("c", 0.05, 0.01)] {
        let scene = Scene::load(&folder.join(format!("{photo}.toml"))).unwrap();
        let picture = render(&scene, &Quality::default(), &control).unwrap().picture;
        let photographed: Vec<[f64; 3]> =
            rows.iter().filter(|r| r[0] == photo).map(|r| std::array::from_fn(|c| r[2 + c].parse().unwrap())).collect();
        let (width, height) = (picture.width as usize, picture.height as usize);
        assert_eq!(photographed.len(), width);
        let column = |x: usize, c: usize| (0..height).map(|y| f64::from(picture.rgb[y * width + x][c])).sum::<f64>() / height as f64;
        let Light::Directional { to_light, .. } = scene.lights[0] else { panic!("one directional light") };
        let used = |x: usize| {
            let d = scene.camera.direction(x as f64 + 0.5, 0.5 * height as f64);
            let (b, c) = (scene.camera.origin.dot(d), scene.camera.origin.length_squared() - 1.0);
            let normal: DVec3 = if b * b > c { scene.camera.origin + (-b - (b * b - c).sqrt()) * d } else { return false };
            normal.dot(to_light) > LEAST[0] && -normal.dot(d) > LEAST[1]
        };
        let (mut windows, mut sum) = (0, [0.0; 3]);
        for start in (0..=width - WINDOW).filter(|&s| (s..s + WINDOW).all(used)) {
            windows += 1;
            for c in 0..3 {
                let mean = |value: &dyn Fn(usize) -> f64| (start..start + WINDOW).map(value).sum::<f64>();
                let ratio = mean(&|x| column(x, c)) / mean(&|x| photographed[x][c]);
                assert!((ratio - 1.0).abs() < largest, "{photo}: {ratio} in channel {c} of the columns from {start}");
                sum[c] += ratio;
            }
        }
        let means = sum.map(|s| s / f64::from(windows));
        println!("photograph {photo}: {windows} windows, mean ratios {means:.4?}");
        assert!(windows > 30 && means.iter().all(|m| (m - 1.0).abs() < overall), "{photo}: {means:?} over {windows} windows");
    }
}
