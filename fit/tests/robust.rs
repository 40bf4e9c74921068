//! Fits that must not go well, and do not go wrong: odd photographs, odd bounds, odd starts.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale::error::{Error, Result};
use biscale::render::Picture;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Options, Outcome, Watcher, fit};
use biscale_fit::search::Memory;
use std::path::Path;
use support::{PERFECT, View, material, photograph, turned, with_control, write};

const GROOVES: &str = "format = 1\n[geometry]\nkind = \"grooves\"\nprofile = \"v\"\ndepth = 0.5\n[[surface]]\npart = \"left\"\n\
                       brdf = { model = \"lambert\", albedo = [0.6, 0.3, 0.1] }\n[[surface]]\npart = \"right\"\n\
                       brdf = { model = \"lambert\", albedo = [0.1, 0.3, 0.6] }\n";
const LIGHT: [f64; 3] = [0.4, -0.8, 0.3];
const VIEW: View = View { origin: [0.0, -12.0, 0.0], up: [0.0, 0.0, 1.0], fov_deg: 11.0, size: [40, 20] };

/// A photograph of the grooves, changed by `edit`.
fn picture(edit: impl Fn(u32, u32, &mut [f32; 3])) -> Picture {
    picture_under(LIGHT, edit)
}

/// The same under another light.
fn picture_under(to_light: [f64; 3], edit: impl Fn(u32, u32, &mut [f32; 3])) -> Picture {
    let on = support::On::Cylinder { height: 1.6, scale: 200.0 };
    let mut picture = photograph(&material(GROOVES), on, VIEW, to_light, 16, (&PERFECT, 0), 1);
    let width = picture.width;
    for (k, pixel) in (0..).zip(&mut picture.rgb) {
        edit(k % width, k / width, pixel);
    }
    picture
}

/// A fit file; `edit` changes its text.
fn file(edit: impl Fn(String) -> String) -> String {
    edit(format!(
        "format = 1\nmaterial = \"start.toml\"\nbounces = 0\n[camera]\norigin = [0, -12, 0]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\nfov_deg = 11\nwidth = 40\nheight = 20\n\
         [object]\nkind = \"cylinder\"\nradius = 1\nheight = 1.6\n[[photograph]]\nrole = \"distant\"\nimage = \"b.exr\"\n[photograph.light]\n\
         type = \"directional\"\nto_light = {LIGHT:?}\nirradiance_rgb = 3.14159265\n[[parameter]]\nkey = \"geometry.depth\"\nbounds = [0.1, 2.0]\n\
         [[colour]]\nkey = \"surface.left.brdf.albedo\"\n[[colour]]\nkey = \"surface.right.brdf.albedo\"\n"
    ))
}

fn try_run(folder: &Path, picture: &Picture, text: String) -> Result<Outcome> {
    std::fs::write(folder.join("start.toml"), GROOVES).unwrap();
    write(picture, &folder.join("b.exr"));
    std::fs::write(folder.join("fit.toml"), text).unwrap();
    let spec = Spec::load(&folder.join("fit.toml"))?;
    let options = Options { starts: 3, ..Options::default() };
    with_control(|control| fit(&spec, &options, &Memory::default(), Watcher::NOBODY, control))
}

fn run(picture: &Picture, edit: impl Fn(String) -> String) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let outcome = try_run(folder.path(), picture, file(edit)).unwrap();
    assert!(outcome.identified.known.iter().all(|k| k.value.is_finite() && k.sigma.is_finite()), "{:?}", outcome.identified.known);
    assert!(outcome.training.is_finite());
    outcome
}

fn value(outcome: &Outcome, name: &str) -> f64 {
    outcome.identified.known.iter().find(|k| k.name == name).unwrap().value
}

#[test]
fn from_the_far_corner_of_the_bounds_it_comes_to_the_same_place() {
    let photograph = picture(|_, _, _| {});
    let found: Vec<Outcome> = [0.1, 2.0]
        .map(|start| run(&photograph, |t| t.replace("bounds = [0.1, 2.0]", &format!("bounds = [0.1, 2.0]\nstart = {start}"))))
        .into();
    let depth = |o: &Outcome| value(o, "geometry.depth");
    let sigma = found[0].identified.known[0].sigma;
    assert!((depth(&found[0]) - depth(&found[1])).abs() < 0.05 + sigma, "{} and {}", depth(&found[0]), depth(&found[1]));
    assert!(found.iter().all(|o| o.failures.is_empty()), "{:?}", found[0].failures);
}

#[test]
fn the_fitted_material_says_the_bounces_that_it_was_fitted_with() {
    let photograph = picture(|_, _, _| {});
    // The start material says another number, which is of no account.
    for (of_fit, of_start) in [(2, 0), (1, 5), (0, 5)] {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("other.toml"), format!("bounces = {of_start}\n{GROOVES}")).unwrap();
        let text = file(|t| {
            let t = t.replace("bounces = 0", &format!("bounces = {of_fit}"));
            t.replace("start.toml", "other.toml").replace("[0.1, 2.0]", "[0.4, 0.6]")
        });
        let outcome = try_run(folder.path(), &photograph, text).unwrap();
        assert_eq!(outcome.material.bounces, of_fit, "{}", outcome.text.text());
        assert_eq!(outcome.text.text().contains("bounces"), of_fit > 0, "{}", outcome.text.text());
    }
}

#[test]
fn places_that_face_away_from_the_light_hold_the_veil() {
    let light = [0.9, -0.4, 0.2];
    let from_the_side = |t: String| t.replace(&format!("{LIGHT:?}"), &format!("{light:?}"));
    // More than is expected of a photograph of which all is lit.
    let outcome = run(&picture_under(light, |_, _, p| *p = p.map(|v| v + 0.03)), from_the_side);
    let clear = run(&picture_under(light, |_, _, _| {}), from_the_side);
    for c in ["red", "green", "blue"] {
        let (veil, none) = (value(&outcome, &format!("veil 1 {c}")), value(&clear, &format!("veil 1 {c}")));
        assert!((veil - 0.03).abs() < 0.006 && none < 0.001, "{c}: {veil}, {none}");
    }
    let off = value(&outcome, "surface.left.brdf.albedo red") / value(&clear, "surface.left.brdf.albedo red") - 1.0;
    assert!(off.abs() < 0.02, "{off}");
}

#[test]
fn a_photograph_of_something_else_fails() {
    let stripes = picture(|x, y, p| {
        let shade = 1.0 + 0.01 * (x + 41 * y) as f32 / 800.0;
        *p = if (x / 5 + y / 5) % 2 == 0 { [0.9, 0.1, 0.4] } else { [0.05, 0.6, 0.02] }.map(|v| v * shade);
    });
    let outcome = run(&stripes, |t| t);
    assert!(!outcome.failures.is_empty() && outcome.training > 0.05, "{} {:?}", outcome.training, outcome.failures);
    assert_eq!(outcome.compared.len(), 1);
}

#[test]
fn holes_and_clipped_pixels_are_left_out() {
    let good = value(&run(&picture(|_, _, _| {}), |t| t), "surface.right.brdf.albedo blue");
    let holes = picture(|x, _, p| {
        if x % 7 == 3 {
            *p = [f32::NAN; 3];
        }
    });
    assert!((value(&run(&holes, |t| t), "surface.right.brdf.albedo blue") / good - 1.0).abs() < 0.1);
    let top = picture(|_, _, _| {}).rgb.iter().map(|p| p[2]).fold(0.0, f32::max) * 0.7;
    let clipped = picture(|_, _, p| p[2] = p[2].min(top));
    let outcome = run(&clipped, |t| t);
    assert!(outcome.notes.iter().any(|n| n.contains("clipped")), "{:?}", outcome.notes);
}

#[test]
fn one_pixel_says_that_it_says_little() {
    let one = picture(|x, y, p| {
        if (x, y) != (20, 10) {
            *p = [f32::NAN; 3];
        }
    });
    let outcome = run(&one, |t| t);
    let told = |k: &biscale_fit::uncertainty::identify::Known| k.weak || k.not_identified || k.at_bound;
    let of = |kind: &str| outcome.identified.known.iter().filter(|k| k.kind == kind).all(told);
    assert!(of("parameter") && of("colour"), "{:?}", outcome.identified.known);
}

#[test]
fn no_pixel_a_light_from_behind_and_a_camera_that_looks_away_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let photograph = picture(|_, _, _| {});
    let black = picture(|_, _, p| *p = [f32::NAN; 3]);
    let behind = |t: String| t.replace("to_light = [0.4, -0.8, 0.3]", "to_light = [0, 1, 0]");
    let away = |t: String| t.replace("target = [0, 0, 0]", "target = [0, -24, 0]");
    for (picture, text) in [(&black, file(|t| t)), (&photograph, file(behind)), (&photograph, file(away))] {
        match try_run(folder.path(), picture, text) {
            Err(Error::BadInput(bad)) => assert!(bad.problem.contains("no pixel can be used"), "{bad}"),
            other => panic!("{:?}", other.map(|o| o.training)),
        }
    }
}

#[test]
fn a_wrong_camera_fails_or_is_paid_for() {
    // The camera of the fit file sees the cylinder at half its width.
    let outcome = run(&picture(|_, _, _| {}), |t| t.replace("fov_deg = 11", "fov_deg = 22"));
    assert!(!outcome.failures.is_empty(), "{}", outcome.training);
}

#[test]
fn with_equal_bounds_or_no_parameter_the_colours_are_found_all_the_same() {
    let photograph = picture(|_, _, _| {});
    let equal =
        |t: String| t.replace("bounds = [0.1, 2.0]", "bounds = [0.5, 0.5]").replace("material =", "light_sigma_deg = 0\nmaterial =");
    let none = |t: String| equal(t).replace("[[parameter]]\nkey = \"geometry.depth\"\nbounds = [0.5, 0.5]\n", "");
    for outcome in [run(&photograph, equal), run(&photograph, none)] {
        assert!((value(&outcome, "surface.left.brdf.albedo red") / 0.6 - 1.0).abs() < 0.1);
        assert!(outcome.failures.is_empty() && outcome.evaluations <= 8, "{:?}", outcome.failures);
    }
}

#[test]
fn nothing_to_find_is_a_comparison() {
    let outcome = run(&picture(|_, _, _| {}), |t| {
        let end = t.find("[[parameter]]").unwrap();
        format!("light_sigma_deg = 0\nveil = false\n{}", &t[..end])
            .replace("light_sigma_deg = 0\nveil = false\nformat = 1", "format = 1\nlight_sigma_deg = 0\nveil = false")
    });
    assert!(outcome.identified.known.is_empty() && outcome.training < 0.05, "{}", outcome.training);
}

#[test]
fn the_light_is_turned_as_its_angles_say() {
    let turned = turned([0.0, -1.0, 0.0], [90.0, 30.0]);
    assert!(turned.distance(glam::DVec3::new(0.75_f64.sqrt(), 0.0, 0.5)) < 1e-12, "{turned}");
}
