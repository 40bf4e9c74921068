//! Every code of the catalogue that a photograph can trigger, each with a made-up photograph that does.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test fails by panicking, and tells what it measured")]
#![cfg(feature = "opencv")]

mod support;

use biscale::filter::Control;
use biscale::formats::capture::{Capture, Severity};
use biscale::toml_reader::Source;
use biscale_capture::board::Board;
use biscale_capture::dictionary::Dictionary;
use biscale_capture::lens::Pose;
use biscale_capture::photo::PlanarImage;
use biscale_capture::run::{RunOptions, run};
use biscale_capture::shoot::{Shape, Shoot};
use glam::{DVec2, DVec3};
use std::sync::atomic::AtomicBool;
use support::*;

/// A folder with photographs of a white sample of 20 x 15 mm on a small board, by a camera that is known.
struct Case {
    folder: tempfile::TempDir,
    studio: Studio,
    light: DVec3,
    pose: Pose,
}

const PAGE: DVec2 = DVec2::new(220.0, 180.0);

fn board() -> Board {
    Board::charuco(5, 4, 30.0, 22.0, &Dictionary::Predefined("DICT_5X5_100"), true)
}

impl Case {
    fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
            studio: Studio { vignetting: [0.0; 3], ..Studio::new(600, 400) },
            light: DVec3::new(0.45, -0.25, 0.86).normalize(),
            pose: Pose::looking_at(DVec3::new(10.0, -60.0, 240.0), DVec3::ZERO, DVec3::Y),
        }
    }

    /// A scene with this paint; places count from the lower left corner of the board.
    fn scene<'a>(&self, paint: impl Fn(DVec2) -> [f64; 3] + Sync + 'a) -> Scene<'a> {
        let corner = 0.5 * (PAGE - board().size);
        Scene::new(Shape::Plane(PAGE), self.light, Box::new(move |p| paint(p - corner)))
    }

    fn save(&self, name: &str, picture: &PlanarImage) {
        save16(picture, &self.folder.path().join(name));
    }

    /// The usual photograph of the sample.
    fn sample(&self, seconds: f64) -> PlanarImage {
        self.studio.photograph(&self.scene(sample), &self.pose, seconds)
    }

    /// Runs a shoot of these photographs with the known camera.
    fn run(&self, photos: &str) -> Capture {
        self.run_with(&self.given(), photos, &RunOptions::default())
    }

    fn given(&self) -> String {
        let l = self.studio.lens;
        format!(
            "[camera]\nfocal_px = [{}, {}]\ncentre_px = [{}, {}]\ndistortion = {:?}\n[[light]]\ndirection = {:?}\n",
            l.focal.x,
            l.focal.y,
            l.centre.x,
            l.centre.y,
            l.distortion,
            self.light.to_array()
        )
    }

    fn run_with(&self, camera: &str, photos: &str, options: &RunOptions) -> Capture {
        let text = format!(
            "format = 1\n{camera}\n[board]\nkind = \"charuco\"\ncolumns = 5\nrows = 4\nsquare_mm = 30\nmarker_mm = 22\n[sample]\nshape = \"plane\"\n\
             width_mm = 20\nheight_mm = 15\nboard_mm = [75, 60]\n{photos}"
        );
        let shoot = Shoot::parse(&Source { path: self.folder.path().join("shoot.toml"), text }).unwrap_or_else(|e| panic!("{e}"));
        let out = self.folder.path().join("out");
        std::fs::create_dir_all(&out).unwrap();
        let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
        run(&shoot, options, &out, &control).unwrap()
    }
}

fn print() -> &'static Print {
    static PRINT: std::sync::OnceLock<Print> = std::sync::OnceLock::new();
    PRINT.get_or_init(|| Print::new(&board(), &flat_shoot::bits))
}

fn sample(p: DVec2) -> [f64; 3] {
    let q = p - 0.5 * board().size + DVec2::new(10.0, 7.5);
    if q.min(DVec2::new(20.0, 15.0) - q).min_element() >= 0.0 { [0.8; 3] } else { print().at(p) }
}

fn distant(file: &str) -> String {
    format!("[[photo]]\nrole = \"distant\"\nfile = \"{file}\"\nseconds = 1\n")
}

/// Fails unless a code is there with a severity; gives its measured value.
#[track_caller]
fn assert_code(capture: &Capture, code: &str, severity: Severity) -> Option<f64> {
    let all: Vec<String> = capture.checks.iter().map(|c| format!("{} {:?} {:?}: {}", c.code, c.severity, c.measured, c.message)).collect();
    let found = capture.checks.iter().find(|c| c.code == code && c.severity == severity);
    found.unwrap_or_else(|| panic!("no {code} {severity:?} in\n{}", all.join("\n"))).measured
}

#[track_caller]
fn assert_clean(capture: &Capture) {
    let bad: Vec<String> = capture
        .checks
        .iter()
        .filter(|c| c.severity > Severity::Ok)
        .map(|c| format!("{} {:?}: {}", c.code, c.measured, c.message))
        .collect();
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}

#[test]
fn a_good_photograph_triggers_nothing() {
    let case = Case::new();
    case.save("a.png", &case.sample(1.0));
    let found = case.run(&distant("a.png"));
    assert_clean(&found);
    assert!(found.usable && found.photographs[0].pose.is_some());
}

#[test]
fn exposure() {
    let case = Case::new();
    case.save("bright.png", &case.sample(3.0));
    let found = case.run(&distant("bright.png"));
    assert!(assert_code(&found, "CLIPPED", Severity::Fail).unwrap() > 0.9);
    case.save("dark.png", &case.sample(0.1));
    let dark = distant("dark.png");
    assert!(assert_code(&case.run(&dark), "UNDEREXPOSED", Severity::Warn).unwrap() < 0.1);
    // Brackets of the two: neither.
    case.save("usual.png", &case.sample(1.0));
    let found = case.run("[[photo]]\nrole = \"distant\"\nfiles = [\"bright.png\", \"usual.png\"]\nseconds = [3, 1]\n");
    assert_clean(&found);
    let file = biscale::image_file::read(&case.folder.path().join("out/distant.exr")).unwrap();
    let middle = file.channels[1][200 * 600 + 300];
    let truth = 0.7 * 0.98 * 0.8 * case.light.z as f32;
    assert!((middle / truth - 1.0).abs() < 0.03, "{middle} for {truth}");
    case.save("dark.png", &case.sample(0.008));
    assert_code(&case.run(&dark), "UNDEREXPOSED", Severity::Fail);
    let unknown =
        "[[photo]]\nrole = \"distant\"\nfile = \"usual.png\"\n[[photo]]\nrole = \"validation\"\nfile = \"usual.png\"\nseconds = 1\n";
    assert_code(&case.run(unknown), "NO_EXPOSURE", Severity::Warn);
}

#[test]
fn linearity() {
    let case = Case::new();
    let usual = case.sample(1.0);
    save8(&usual, &case.folder.path().join("eight.png"));
    let found = case.run(&distant("eight.png"));
    assert_code(&found, "NOT_LINEAR", Severity::Fail);
    assert!(found.photographs.is_empty());
    let assumed = case.run_with(&case.given(), &distant("eight.png"), &RunOptions { assume_srgb: true, ..RunOptions::default() });
    assert_code(&assumed, "ASSUMED_SRGB", Severity::Warn);
    assert!(assumed.usable);
    // A curve that no file mentions: brackets and the greys of a checker tell.
    let curved = |mut p: PlanarImage| {
        for v in p.planes.iter_mut().flatten() {
            *v = v.powf(1.0 / 2.2);
        }
        p
    };
    case.save("one.png", &curved(case.sample(1.0)));
    case.save("half.png", &curved(case.sample(0.5)));
    let found = case.run("[[photo]]\nrole = \"distant\"\nfiles = [\"one.png\", \"half.png\"]\nseconds = [1, 0.5]\n");
    let off = assert_code(&found, "NOT_LINEAR", Severity::Fail).unwrap();
    assert!((off - (1.0 - 1.0 / 2.2)).abs() < 0.02, "{off}");
    let chart = case.studio.photograph(&case.scene(|p| checker(p - DVec2::new(10.0, 20.0), 19.0).unwrap_or(WHITE)), &case.pose, 1.0);
    case.save("chart.png", &curved(chart));
    assert_code(&case.run("[[photo]]\nrole = \"checker\"\nfile = \"chart.png\"\nseconds = 1\n"), "NOT_LINEAR", Severity::Fail);
}

#[test]
fn sharpness() {
    let case = Case::new();
    for (blur, severity) in [(1.2, Severity::Warn), (2.6, Severity::Fail)] {
        let studio = Studio { blur, ..case.studio.clone() };
        case.save("soft.png", &studio.photograph(&case.scene(sample), &case.pose, 1.0));
        let spread = assert_code(&case.run(&distant("soft.png")), "BLURRY", severity).unwrap();
        // 10 to 90 % of a normal curve, and a little for the pixels.
        // With a strong blur the next cells take a part of it away.
        assert!((0.75..1.15).contains(&(spread / (2.563 * blur))), "{spread} for {blur}");
    }
}

#[test]
fn files_and_settings() {
    let case = Case::new();
    let usual = case.sample(1.0);
    case.save("a.png", &usual);
    std::fs::write(case.folder.path().join("broken.png"), &std::fs::read(case.folder.path().join("a.png")).unwrap()[..5000]).unwrap();
    let small = Studio { vignetting: [0.0; 3], ..Studio::new(300, 200) };
    case.save("small.png", &small.photograph(&case.scene(sample), &case.pose, 1.0));
    let found = case.run(&[distant("a.png"), distant("broken.png"), distant("small.png")].concat());
    assert_code(&found, "UNREADABLE", Severity::Fail);
    assert_code(&found, "WRONG_SIZE", Severity::Fail);
    assert_eq!(found.photographs.len(), 1);
    let found = case.run(&format!("{}f_number = 8\n{}f_number = 5.6\n", distant("a.png"), distant("a.png")));
    assert_code(&found, "SETTINGS_CHANGED", Severity::Fail);
}

#[test]
fn markers_of_the_sample() {
    let case = Case::new();
    case.save("paper.png", &case.studio.photograph(&case.scene(|_| WHITE), &case.pose, 1.0));
    let found = case.run(&distant("paper.png"));
    assert_code(&found, "BOARD_NOT_FOUND", Severity::Fail);
    // Of another dictionary.
    let grid = Board::grid(4, 3, 25.0, 10.0, &Dictionary::Predefined("DICT_6X6_250"), 0);
    let other = Print::new(&grid, &|id| biscale_capture::vision::markers::bits(&Dictionary::Predefined("DICT_6X6_250"), id).unwrap());
    case.save("other.png", &case.studio.photograph(&case.scene(|p| other.at(p)), &case.pose, 1.0));
    assert_code(&case.run(&distant("other.png")), "OTHER_MARKERS", Severity::Fail);
    // A page that is not flat: its marks are not where they should be.
    let wavy = |p: DVec2| sample(p + DVec2::new(2.5 * (p.y / 14.0).sin(), 2.5 * (p.x / 11.0).sin()));
    case.save("wavy.png", &case.studio.photograph(&case.scene(wavy), &case.pose, 1.0));
    assert_code(&case.run(&distant("wavy.png")), "POSE_ERROR", Severity::Fail);
    // Most markers hidden.
    let hidden = |p: DVec2| if p.x > 75.0 && !(p.x > 65.0 && p.x < 85.0 && p.y > 50.0 && p.y < 70.0) { WHITE } else { sample(p) };
    case.save("hidden.png", &case.studio.photograph(&case.scene(hidden), &case.pose, 1.0));
    assert_code(&case.run(&distant("hidden.png")), "BOARD_PARTIAL", Severity::Warn);
    // A close-up of nothing but the sample.
    let near = Pose::looking_at(DVec3::new(0.0, 0.0, 16.0), DVec3::ZERO, DVec3::Y);
    case.save("near.png", &case.studio.photograph(&case.scene(sample), &near, 1.0));
    assert_code(&case.run("[[photo]]\nrole = \"close-up\"\nfile = \"near.png\"\nseconds = 1\n"), "NO_SCALE", Severity::Warn);
}

#[test]
fn calibration() {
    let case = Case::new();
    let views = |poses: &[Pose], paint: &(dyn Fn(DVec2) -> [f64; 3] + Sync)| -> String {
        let names: Vec<String> = (0..poses.len()).map(|k| format!("\"v{k}.png\"")).collect();
        for (k, pose) in poses.iter().enumerate() {
            save8(&case.studio.photograph(&case.scene(paint), pose, 1.0), &case.folder.path().join(format!("v{k}.png")));
        }
        format!("[[photo]]\nrole = \"board\"\nfiles = [{}]\n", names.join(", "))
    };
    let at = |p: DVec2| print().at(p);
    let none = RunOptions::default();
    let found = case.run_with("", &views(&around(2, 240.0, 20.0), &at), &none);
    assert_eq!(assert_code(&found, "TOO_FEW_VIEWS", Severity::Fail), Some(2.0));
    // Far away and all in the middle.
    let found = case.run_with("", &views(&around(5, 600.0, 0.0), &at), &none);
    assert_eq!(assert_code(&found, "TOO_FEW_VIEWS", Severity::Warn), Some(5.0));
    assert!(assert_code(&found, "BAD_COVERAGE", Severity::Warn).unwrap() < 0.5);
    // A part of the board; and one whose markers are smaller than described.
    let half = |p: DVec2| if p.x < 55.0 { print().at(p) } else { WHITE };
    assert_code(&case.run_with("", &views(&around(3, 240.0, 5.0), &half), &none), "BOARD_PARTIAL", Severity::Warn);
    let smaller = Print::new(&Board::charuco(5, 4, 30.0, 19.0, &Dictionary::Predefined("DICT_5X5_100"), true), &flat_shoot::bits);
    let off = assert_code(&case.run_with("", &views(&around(3, 240.0, 5.0), &|p| smaller.at(p)), &none), "SCALE_MISMATCH", Severity::Fail)
        .unwrap();
    assert!((off - 3.0 / 22.0).abs() < 0.02, "{off}");
    // A board that bends.
    let bent = |p: DVec2| print().at(p + DVec2::new(0.0, 4.0 * (p.x / 40.0).sin()));
    assert_code(&case.run_with("", &views(&around(6, 240.0, 15.0), &bent), &none), "CALIBRATION_ERROR", Severity::Fail);
}

#[test]
fn colour() {
    let case = Case::new();
    let chart = |change: &'static (dyn Fn(usize, [f64; 3]) -> [f64; 3] + Sync)| {
        let paint = move |p: DVec2| {
            let seen = checker(p - DVec2::new(10.0, 20.0), 19.0).unwrap_or(WHITE);
            let k = biscale_capture::colour::checker_rgb().iter().position(|c| *c == seen);
            k.map_or(seen, |k| change(k, seen))
        };
        case.studio.photograph(&case.scene(paint), &case.pose, 1.0)
    };
    let photo = "[[photo]]\nrole = \"checker\"\nfile = \"chart.png\"\nseconds = 1\n";
    case.save("chart.png", &chart(&|_, c| c));
    let found = case.run(photo);
    assert_clean(&found);
    assert!(found.colour.unwrap().delta_e.iter().all(|e| *e < 2.0));
    // Faded: every other colour has lost half of its saturation.
    let faded: &(dyn Fn(usize, [f64; 3]) -> [f64; 3] + Sync) = &|k, c| {
        let grey = c.iter().sum::<f64>() / 3.0;
        if k % 2 == 0 { c.map(|v| 0.4 * v + 0.6 * grey) } else { c }
    };
    case.save("chart.png", &chart(faded));
    assert!(assert_code(&case.run(photo), "CHECKER_BAD_FIT", Severity::Fail).unwrap() > 6.0);
    case.save("chart.png", &case.studio.photograph(&case.scene(|_| WHITE), &case.pose, 1.0));
    assert_code(&case.run(photo), "CHECKER_NOT_FOUND", Severity::Fail);
}

#[test]
fn lights() {
    let case = Case::new();
    case.save("a.png", &case.sample(1.0));
    let tilted = Scene { tilt: DVec2::new(2e-3, 0.0), ..case.scene(sample) };
    case.save("tilted.png", &case.studio.photograph(&tilted, &case.pose, 1.0));
    let uneven = assert_code(&case.run(&distant("tilted.png")), "UNEVEN_LIGHT", Severity::Warn).unwrap();
    // Markers from 15 to 135 mm of the board: 0.2 % a mm.
    assert!((0.15..0.35).contains(&uneven), "{uneven}");
    let flat = Scene::new(Shape::Plane(DVec2::splat(2000.0)), case.light, Box::new(|_| [0.7; 3]));
    let above = Pose::looking_at(DVec3::new(0.0, 0.0, 240.0), DVec3::ZERO, DVec3::Y);
    case.save("flat.png", &case.studio.photograph(&Scene { tilt: DVec2::new(2e-3, 0.0), ..flat }, &above, 1.0));
    assert_code(&case.run("[[photo]]\nrole = \"flat\"\nfile = \"flat.png\"\nseconds = 1\n"), "UNEVEN_LIGHT", Severity::Warn);
    // A stick that says something else than the shoot file.
    let stick = Scene { stick: Some((DVec2::new(-90.0, 0.0), 20.0, 0.3)), ..case.scene(|p| if p.x < 2.0 { WHITE } else { sample(p) }) };
    // From a side, so that the stick does not hide its shadow.
    let aside = Pose::looking_at(DVec3::new(30.0, 60.0, 240.0), DVec3::ZERO, DVec3::Y);
    case.save("stick.png", &case.studio.photograph(&stick, &aside, 1.0));
    let with_stick = "[[photo]]\nrole = \"light\"\nfile = \"stick.png\"\nseconds = 1\nstick_mm = [-90, 0]\nstick_height_mm = 20\nstick_radius_mm = 0.3\n";
    let found = case.run(with_stick);
    assert!(assert_code(&found, "LIGHT_INCONSISTENT", Severity::Ok).unwrap() < 2.0);
    let turned = Case { light: (case.light + DVec3::new(0.0, 0.2, 0.0)).normalize(), ..Case::new() };
    std::fs::copy(case.folder.path().join("stick.png"), turned.folder.path().join("stick.png")).unwrap();
    assert!(assert_code(&turned.run(with_stick), "LIGHT_INCONSISTENT", Severity::Fail).unwrap() > 5.0);
    // The validation under the same light; and a light that nobody knows.
    let both = format!("{}[[photo]]\nrole = \"validation\"\nfile = \"a.png\"\nseconds = 1\n", distant("a.png"));
    assert_eq!(assert_code(&case.run(&both), "SAME_LIGHT", Severity::Warn).map(f64::round), Some(0.0));
    assert_code(&case.run(&format!("{}light = \"lamp 2\"\n", distant("a.png"))), "LIGHT_NOT_FOUND", Severity::Fail);
}

/// A cloth that fills the picture.
fn woven(pitch: f64) -> impl Fn(DVec2) -> [f64; 3] + Sync {
    const TWILL: [&[bool]; 4] =
        [&[true, true, false, false], &[false, true, true, false], &[false, false, true, true], &[true, false, false, true]];
    move |p: DVec2| cloth(p, &TWILL, DVec2::splat(pitch), DVec2::splat(0.85 * pitch), [0.5, 0.1, 0.1], [0.1, 0.15, 0.5])
}

#[test]
fn what_close_ups_show_and_what_they_do_not() {
    let case = Case::new();
    let near = Pose::looking_at(DVec3::new(3.0, -10.0, 100.0), DVec3::ZERO, DVec3::Y);
    let photo = "[[photo]]\nrole = \"close-up\"\nfile = \"near.png\"\nseconds = 1\n";
    let seen = |paint: &(dyn Fn(DVec2) -> [f64; 3] + Sync), studio: &Studio, options: &RunOptions| {
        case.save("near.png", &studio.photograph(&case.scene(paint), &near, 1.0));
        case.run_with(&case.given(), photo, options)
    };
    let (plain, none) = (case.studio.clone(), RunOptions::default());
    let scale = plain.lens.focal.x / near.eye().length();
    // As a camera's sensor sees it, too: one colour a pixel, the others between.
    for studio in [plain.clone(), Studio { mosaic: true, ..plain.clone() }] {
        let found = seen(&woven(1.5), &studio, &none);
        let weave =
            found.close_up.as_ref().unwrap().weave.as_ref().unwrap_or_else(|| panic!("mosaic {}: {:?}", studio.mosaic, found.checks));
        assert_eq!(weave["class_name"], "twill 2/2 Z", "{weave}");
        // Without a marker in view lengths are in pixels, and that is said.
        let pitch = weave["warp"]["pitch"]["value"].as_f64().unwrap();
        assert!((pitch / (1.5 * scale) - 1.0).abs() < 0.01, "{pitch} px");
        assert_code(&found, "NO_SCALE", Severity::Warn);
    }
    // Threads of 4 pixels; no threads; and a draft that this cloth cannot have.
    let pixels = assert_code(&seen(&woven(0.55), &plain, &none), "UNDERSAMPLED", Severity::Warn).unwrap();
    assert!((pixels - 0.55 * scale).abs() < 0.1, "{pixels}");
    let found = seen(&|_| [0.6; 3], &plain, &none);
    assert_code(&found, "NO_PERIOD", Severity::Fail);
    assert!(!found.usable && found.material.is_none());
    let other = RunOptions { draft: Some(biscale::geometry::weave::Draft::shifted(4, 1, 2)), ..RunOptions::default() };
    assert_code(&seen(&woven(1.5), &plain, &other), "AMBIGUOUS_WEAVE", Severity::Warn);
}

#[test]
fn a_mosaicked_photograph_is_registered_as_well() {
    let case = Case::new();
    let studio = Studio { mosaic: true, ..case.studio.clone() };
    case.save("a.png", &studio.photograph(&case.scene(sample), &case.pose, 1.0));
    let found = case.run(&distant("a.png"));
    assert_clean(&found);
    let pose = found.photographs[0].pose.as_ref().unwrap();
    let got = Pose { rotation: glam::DMat3::from_cols_array_2d(&pose.rotation).transpose(), translation: pose.translation_mm.into() };
    let (shift, turn) = (got.translation.distance(case.pose.translation), got.angle_to(&case.pose).to_degrees());
    assert!(shift < 0.2 && turn < 0.2, "{shift} mm, {turn} degrees");
}

/// A sheet of ours for an object, as sidecar in a folder, and what is printed on it by places of the page.
fn our_sheet(folder: &std::path::Path, object: &str) -> (biscale_capture::sheet::Sheet, impl Fn(DVec2) -> [f64; 3] + Sync + use<>) {
    use biscale_fabricate::{paper::Paper, wrap};
    let colours = [[0.6, 0.05, 0.05], [0.05, 0.5, 0.1], [0.05, 0.1, 0.6]];
    let object = wrap::Target::parse(object).unwrap();
    let fit = object.fit(DVec2::splat(5.0), 0.1);
    let paper = Paper { name: "p", size: DVec2::new(420.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };
    let made = wrap::wrap(object, fit, 0.1, &colours, paper, "t").unwrap();
    assert!(!made.turned && made.pages.len() == 1);
    let sidecar = serde_json::json!({
        "recipe": { "thickness": 0.1 },
        "wrap": {
            "target": object, "fit": fit, "dictionary": "DICT_5X5_100", "origin_mm": made.parts[0].origin_mm, "turned": made.turned,
            "joined_size_mm": made.size.to_array(), "pages": made.parts, "markers": made.markers, "patches": made.patches,
        },
    });
    let file = folder.join("sheet.json");
    std::fs::write(&file, sidecar.to_string()).unwrap();
    let sheet = biscale_capture::sheet::Sheet::read(&file).unwrap();
    let print = Print::new(&Board::of_sheet(&sheet), &flat_shoot::bits);
    let patches = sheet.patches.clone();
    let paint = move |page: DVec2| {
        let on = patches.iter().find(|p| {
            let [low, high] = p.rectangle_mm.map(DVec2::from);
            page.cmpge(low).all() && page.cmplt(high).all()
        });
        on.map_or_else(|| print.at(page), |p| p.linear_rgb)
    };
    (sheet, paint)
}

fn capture_of_sheet(folder: &std::path::Path, studio: &Studio) -> Capture {
    let l = studio.lens;
    let text = format!(
        "format = 1\n[camera]\nfocal_px = [{}, {}]\ncentre_px = [{}, {}]\ndistortion = {:?}\n[sample]\nsheet = \"sheet.json\"\n[[light]]\n\
         direction = [0.45, -0.25, 0.86]\n[[photo]]\nrole = \"distant\"\nfile = \"a.png\"\nseconds = 1\n",
        l.focal.x, l.focal.y, l.centre.x, l.centre.y, l.distortion
    );
    let shoot = Shoot::parse(&Source { path: folder.join("shoot.toml"), text }).unwrap_or_else(|e| panic!("{e}"));
    let out = folder.join("out");
    std::fs::create_dir_all(&out).unwrap();
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    run(&shoot, &RunOptions::default(), &out, &control).unwrap()
}

#[test]
fn the_patches_of_our_own_sheet_tell_colours() {
    const COLOUR: [f64; 3] = [0.5, 0.2, 0.1];
    let case = Case::new();
    let (sheet, paint) = our_sheet(case.folder.path(), "plane:width=60,height=50");
    let extent = sheet.extent;
    let page = move |p: DVec2| {
        let on = p - 0.5 * PAGE + 0.5 * extent;
        if on.min(extent - on).min_element() >= 0.0 { COLOUR } else { paint(on + sheet.origin) }
    };
    let pose = Pose::looking_at(DVec3::new(10.0, -30.0, 250.0), DVec3::new(0.0, -12.0, 0.0), DVec3::Y);
    let scene = Scene::new(Shape::Plane(PAGE), case.light, Box::new(page));
    case.save("a.png", &case.studio.photograph(&scene, &pose, 1.0));
    let found = capture_of_sheet(case.folder.path(), &case.studio);
    let colour = found.colour.as_ref().unwrap();
    assert_eq!(colour.source, "sheet");
    assert!(colour.delta_e.len() >= 10 && colour.delta_e.iter().all(|e| *e < 2.0), "{:?}", colour.delta_e);
    let image = biscale::image_file::read(&case.folder.path().join("out/distant.exr")).unwrap();
    let lens = case.studio.lens;
    let middle = lens.pinhole().project(pose.to_camera(DVec3::ZERO)).unwrap().round();
    let at = middle.y as usize * lens.width + middle.x as usize;
    for (c, truth) in COLOUR.iter().enumerate() {
        let mean = [at - 1, at, at + 1].map(|i| f64::from(image.channels[c][i])).iter().sum::<f64>() / 3.0;
        assert!((mean / truth - 1.0).abs() < 0.05, "channel {c}: {mean} for {truth}");
    }
}

#[test]
fn a_sheet_printed_too_small_for_its_cylinder_is_told() {
    let case = Case::new();
    let (sheet, paint) = our_sheet(case.folder.path(), "cylinder:radius=30,height=60");
    let outer = 30.1;
    for (scale, severity) in [(1.0, Severity::Ok), (0.95, Severity::Fail)] {
        let (paint, origin, height) = (&paint, sheet.origin, sheet.extent.y);
        let shape = Shape::Cylinder { radius: outer, height: 110.0, arc_deg: [0.0, 360.0] };
        // Places of the cylinder count from its lower rim.
        let page = move |p: DVec2| paint((p - DVec2::new(0.0, 55.0)) / scale + DVec2::new(0.0, 0.5 * height) + origin);
        let pose = Pose::looking_at(DVec3::new(60.0, 160.0, 30.0), DVec3::ZERO, DVec3::Z);
        let scene = Scene::new(shape, DVec3::new(0.5, 0.7, 0.5), Box::new(page));
        let studio = Studio { vignetting: [0.0; 3], ..Studio::new(900, 900) };
        case.save("a.png", &studio.photograph(&scene, &pose, 1.0));
        let found = capture_of_sheet(case.folder.path(), &studio);
        let off = assert_code(&found, "SCALE_MISMATCH", severity).unwrap();
        assert!(if scale == 1.0 { off < 0.005 } else { off > 0.02 }, "{off} for {scale}");
    }
}
