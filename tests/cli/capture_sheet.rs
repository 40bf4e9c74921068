//! The closed loop: a sheet that `biscale fold` made, rendered by `biscale render`, seen through a distorted camera, and registered by its sidecar.

#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test that meets the unexpected should panic, and tells what it measured")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

#[path = "../../capture/tests/support/mod.rs"]
mod studio;

use biscale_capture::lens::{Lens, Pose, farthest};
use biscale_capture::photo::PlanarImage;
use biscale_fabricate::wrap::aruco::is_white;
use glam::{DMat3, DVec2, DVec3};
use serde_json::Value;
use std::fmt::Write as _;
use support::Folder;

/// The page as triangles in the sample's frame: paper, and on it the black cells of the markers. `bend` takes a place of the page, mm, and a height over the
/// paper to space.
fn page(sidecar: &Value, bend: &dyn Fn(DVec2, f64) -> DVec3) -> String {
    let mut obj = String::new();
    let mut count = 0;
    let mut quad = |part: &str, low: DVec2, high: DVec2, height: f64, steps: u32| {
        let _ = writeln!(obj, "usemtl {part}");
        for k in 0..steps {
            let (a, b) = (f64::from(k) / f64::from(steps), f64::from(k + 1) / f64::from(steps));
            let (x0, x1) = (low.x + a * (high.x - low.x), low.x + b * (high.x - low.x));
            for p in [(x0, low.y), (x1, low.y), (x1, high.y), (x0, high.y)] {
                let v = bend(p.into(), height);
                let _ = writeln!(obj, "v {} {} {}", v.x, v.y, v.z);
            }
            let _ = writeln!(obj, "f {} {} {}\nf {} {} {}", count + 1, count + 2, count + 3, count + 1, count + 3, count + 4);
            count += 4;
        }
    };
    let numbers = |v: &Value| -> DVec2 { DVec2::new(v[0].as_f64().unwrap(), v[1].as_f64().unwrap()) };
    let markers = sidecar["wrap"]["markers"].as_array().unwrap();
    let corners = || markers.iter().flat_map(|m| m["corners_mm"].as_array().unwrap().iter().map(numbers));
    let (low, high) = corners().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    quad("white", low - 2.0, high + 2.0, 0.0, 200);
    for m in markers {
        let id = m["id"].as_u64().unwrap() as usize;
        let upper_left = numbers(&m["corners_mm"][0]);
        let cell = (numbers(&m["corners_mm"][1]).x - upper_left.x) / 7.0;
        for row in 0..7 {
            for column in (0..7).filter(|c| !is_white(id, row, *c)) {
                let corner = upper_left + cell * DVec2::new(column as f64, -(row as f64) - 1.0);
                quad("black", corner, corner + cell, 0.002, 3);
            }
        }
    }
    obj
}

/// Renders the page from an eye and records it through a lens, as 16-bit PNG.
fn photograph(folder: &Folder, lens: &Lens, pose: &Pose, name: &str) {
    let (eye, target) = (pose.eye(), pose.to_sample(DVec3::Z * 100.0));
    let up = -(pose.rotation.transpose() * DVec3::Y);
    // A pinhole that sees more than the lens does, and finer.
    let (width, height) = (2 * lens.width, 2 * lens.height);
    let fov = 2.0 * (0.56 * lens.width as f64 / lens.focal.x).atan().to_degrees();
    let scene = format!(
        "format = 1\nbackground = [0.1, 0.1, 0.1]\n[camera]\norigin = {:?}\ntarget = {:?}\nup = {:?}\nfov_deg = {fov}\nwidth = {width}\nheight = {height}\nsamples = 4\n\
         [[light]]\ntype = \"directional\"\nto_light = {:?}\nirradiance_rgb = [3.14, 3.14, 3.14]\n[[object]]\nkind = \"mesh\"\nfile = \"page.obj\"\n\
         material = \"white.toml\"\n[[object.part]]\nname = \"black\"\nmaterial = \"black.toml\"\n",
        eye.to_array(),
        target.to_array(),
        up.to_array(),
        (eye + DVec3::new(30.0, 40.0, 50.0)).normalize().to_array()
    );
    folder.write("scene.toml", scene);
    let said = folder.run(["render", "scene.toml", "-o", "page.exr", "--force", "--tolerance", "0.05"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let raster = biscale::image_file::read(&folder.path("page.exr")).unwrap();
    let planes: [Vec<f32>; 3] = raster.channels.try_into().unwrap();
    let ideal = PlanarImage { width, height, planes };
    let f = 0.5 * width as f64 / (0.5 * fov.to_radians()).tan();
    let far = farthest(lens.width, lens.height, lens.centre);
    let mut out = PlanarImage::new(lens.width, lens.height);
    for i in 0..lens.width * lens.height {
        let pixel = DVec2::new((i % lens.width) as f64, (i / lens.width) as f64);
        // Four samples a pixel: the ideal picture is twice as fine.
        let mut sum = [0.0; 3];
        for d in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
            let p = lens.undistort(lens.place(pixel + DVec2::from(d))).unwrap();
            let at = f * p + 0.5 * DVec2::new((width - 1) as f64, (height - 1) as f64);
            let value = ideal.sample(at.x, at.y).expect("the pinhole sees more");
            sum.iter_mut().zip(value).for_each(|(s, v)| *s += 0.25 * v);
        }
        let r2 = (pixel - lens.centre).length_squared() / (far * far);
        for (c, plane) in out.planes.iter_mut().enumerate() {
            let light = f64::from(sum[c]) * 0.8 * (1.0 - 0.25 * r2);
            plane[i] = (light + (light / 20_000.0).sqrt() * studio::normal((3 * i + c) as u64)) as f32;
        }
    }
    studio::save16(&out, &folder.path(name));
}

fn check(on: &str, poses: &[Pose], bend: &dyn Fn(DVec2, DVec2, f64) -> DVec3) {
    let folder = Folder::new();
    let grooves = concat!(env!("CARGO_MANIFEST_DIR"), "/../samples/grooves-two-hue.toml");
    let said = folder.run(["fold", grooves, "-o", "sheet.pdf", "--on", on, "--page", "a3", "--paper-thickness", "0.1"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let sidecar: Value = serde_json::from_str(&folder.read("sheet.json")).unwrap();
    let origin = DVec2::new(sidecar["wrap"]["origin_mm"][0].as_f64().unwrap(), sidecar["wrap"]["origin_mm"][1].as_f64().unwrap());
    folder.write("page.obj", page(&sidecar, &|p, h| bend(p - origin, p, h)));
    for (name, albedo) in [("white", 0.85), ("black", 0.04)] {
        let text = format!(
            "format = 1\n[geometry]\nkind = \"mesh\"\nfile = \"plane.obj\"\nperiod = [1.0, 1.0]\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = {albedo} }}\n"
        );
        folder.write(&format!("{name}.toml"), text);
    }
    let lens = Lens {
        width: 900,
        height: 640,
        focal: DVec2::new(1150.0, 1148.0),
        centre: DVec2::new(455.0, 314.0),
        distortion: [-0.14, 0.06, 1e-3, -7e-4, 0.0],
    };
    let mut photos = String::new();
    for (k, pose) in poses.iter().enumerate() {
        photograph(&folder, &lens, pose, &format!("photo-{k}.png"));
        let _ = write!(photos, "[[photo]]\nrole = \"distant\"\nfile = \"photo-{k}.png\"\nseconds = 1\n");
    }
    let shoot = format!(
        "format = 1\n[camera]\nfocal_px = [{}, {}]\ncentre_px = [{}, {}]\ndistortion = {:?}\n[sample]\nsheet = \"sheet.json\"\n[[light]]\ndirection = [0.3, 0.4, 0.9]\n{photos}",
        lens.focal.x, lens.focal.y, lens.centre.x, lens.centre.y, lens.distortion
    );
    folder.write("shoot.toml", shoot);
    let said = folder.run(["capture", "shoot.toml", "-o", "out", "--json"]);
    let json: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!(said.status, 0, "{}\n{}", said.stderr, json["checks"]);
    for (photo, truth) in json["photographs"].as_array().unwrap().iter().zip(poses) {
        let pose = &photo["pose"];
        let vector = |v: &Value| DVec3::new(v[0].as_f64().unwrap(), v[1].as_f64().unwrap(), v[2].as_f64().unwrap());
        let rows = [0, 1, 2].map(|k| vector(&pose["rotation"][k]).to_array());
        let found = Pose { rotation: DMat3::from_cols_array_2d(&rows).transpose(), translation: vector(&pose["translation_mm"]) };
        let (shift, turn) = (found.translation.distance(truth.translation), found.angle_to(truth).to_degrees());
        eprintln!("{on}: origin off by {shift:.4} mm, {turn:.4} degrees; {} corners, {} px RMS", pose["points"], pose["rms_px"]);
        assert!(shift < 0.2 && turn < 0.2, "{on}: {shift} mm, {turn} degrees: {pose}");
    }
}

#[test]
fn a_flat_sheet_is_registered_within_a_fifth_of_a_millimetre() {
    let at = |eye: [f64; 3]| Pose::looking_at(eye.into(), DVec3::new(5.0, 0.0, 0.0), DVec3::Y);
    let half = 0.5 * DVec2::new(100.0, 80.0);
    check("plane:width=100,height=80", &[at([20.0, -90.0, 240.0]), at([-60.0, 30.0, 260.0])], &|p, _, h| (p - half).extend(h));
}

#[test]
fn a_sheet_around_a_cylinder_is_registered_within_a_fifth_of_a_millimetre() {
    let (outer, height) = (30.1, 70.0);
    let bend = |p: DVec2, _: DVec2, h: f64| {
        let (sin, cos) = (p.x / outer).sin_cos();
        DVec3::new((outer + h) * cos, (outer + h) * sin, p.y - 0.5 * height)
    };
    let at = |degrees: f64, z: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Pose::looking_at(DVec3::new(230.0 * cos, 230.0 * sin, z), DVec3::ZERO, DVec3::Z)
    };
    check("cylinder:radius=30,height=70", &[at(60.0, 40.0), at(125.0, -30.0)], &bend);
}
