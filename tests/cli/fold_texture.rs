//! `biscale fold` of designs whose colours change within a facet.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use std::path::Path;
use support::Folder;

fn write_png(path: &Path, width: u32, height: u32, colour: png::ColorType, bytes: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), width, height);
    encoder.set_color(colour);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(bytes).unwrap();
}

/// Width, height and colours of a page.
fn read_png(path: &Path) -> (usize, usize, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    (info.width as usize, info.height as usize, bytes[..info.buffer_size()].chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
}

/// Sixteen colours that are told apart, sRGB, row 0 at the top of the image.
fn tint(x: usize, y: usize) -> [u8; 3] {
    [[40, 100, 160, 220][x], [220, 160, 100, 40][y], if (x + y).is_multiple_of(2) { 60 } else { 200 }]
}

const PLATE: &str = "format = 1\nname = \"plate\"\nunit = \"mm\"\n[geometry]\nkind = \"height-field\"\nfile = \"h.png\"\nwidth = 80.0\nheight = HEIGHT\n\
    [[surface]]\npart = \"surface\"\nbrdf = { model = \"lambert\", albedo = 1.0 }\ntint = \"t.png\"\n";

fn plate(folder: &Folder, height: &str, heights: &[u8; 64]) {
    folder.write("plate.toml", PLATE.replace("HEIGHT", height));
    write_png(&folder.path("h.png"), 8, 8, png::ColorType::Grayscale, heights);
    let colours: Vec<u8> = (0..4).flat_map(|y| (0..4).flat_map(move |x| tint(x, y))).collect();
    write_png(&folder.path("t.png"), 4, 4, png::ColorType::Rgb, &colours);
}

#[test]
fn a_tint_image_is_printed_within_its_facet_and_a_millimetre_beyond() {
    let folder = Folder::new();
    plate(&folder, "1.0", &[0; 64]);
    let said = folder.run(["fold", "plate.toml", "-o", "p.png", "--periods", "1x1", "--no-numbers"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let sidecar: serde_json::Value = serde_json::from_str(&folder.read("p.json")).unwrap();
    assert_eq!(sidecar["summary"]["facets"], 1, "colours do not cut what is flat");
    let corner = |key: &str| [0, 1].map(|k| sidecar["pieces"][0][key][k].as_f64().unwrap());
    let (low, high) = (corner("low_mm"), corner("high_mm"));
    assert!((high[0] - low[0] - 80.0).abs() < 1e-6 && (high[1] - low[1] - 80.0).abs() < 1e-6);
    let (w, h, page) = read_png(&folder.path("p-1.png"));
    let at = |x: f64, y: f64| page[(h as f64 - 1.0 - (y / 25.4 * 200.0)).round() as usize * w + (x / 25.4 * 200.0) as usize];
    let near = |a: [u8; 3], b: [u8; 3]| (0..3).all(|c| a[c].abs_diff(b[c]) <= 2);
    // The piece may lie in any of four ways.
    let cell = |turn: usize, i: usize, j: usize| match turn {
        0 => (i, 3 - j),
        1 => (j, i),
        2 => (3 - i, j),
        _ => (3 - j, 3 - i),
    };
    let matches = |turn: usize, shift: f64| {
        (0..16).all(|k| {
            let (i, j) = (k % 4, k / 4);
            let (x, y) = cell(turn, i, j);
            let inside = |low: f64, k: usize| low + 20.0 * k as f64 + 3.0;
            let (px, py) = (inside(low[0], i) + shift, inside(low[1], j) + shift);
            near(at(px, py), tint(x, y))
        })
    };
    let turn = (0..4).find(|&t| matches(t, 0.0)).expect("every colour is where it belongs");
    assert!(matches(turn, 14.0), "up to the cells' other ends");
    // Beyond the edge, away from the lines there: the colour of the border for 1 mm, then paper.
    for (i, y) in [(0, 5.0), (1, 25.0), (2, 45.0), (3, 65.0)] {
        let (x, j) = cell(turn, 0, i);
        assert!(near(at(low[0] - 0.75, low[1] + y), tint(x, j)), "bleed at {y}: {:?}", at(low[0] - 0.75, low[1] + y));
        assert_eq!(at(low[0] - 1.3, low[1] + y), [255; 3], "beyond the bleed at {y}");
    }
}

#[test]
fn textured_patterns_fold_to_their_design_and_keep_their_margins() {
    let folder = Folder::new();
    let heights: [u8; 64] = std::array::from_fn(|k| if (k / 8) % 4 < 2 { 0 } else { 200 });
    plate(&folder, "20.0", &heights);
    for out in ["p.svg", "p.pdf"] {
        let said = folder.run(["fold", "plate.toml", "-o", out, "--periods", "2x1", "--page", "a3"]);
        assert_eq!(said.status, 0, "{}", said.stderr);
    }
    let said = folder.run(["fold", "--verify", "p-1.svg", "--against", "plate.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let text = folder.read("p-1.svg");
    assert!(text.contains("<image") && text.contains("data:image/png;base64,"));
    let pdf = std::fs::read(folder.path("p.pdf")).unwrap();
    let has = |text: &[u8]| pdf.windows(text.len()).any(|w| w == text);
    assert!(has(b"/Subtype/Image") || has(b"/Subtype /Image"), "the PDF holds the colours");
    // A picture in the margin is found.
    folder.write("q.svg", text.replacen("<g id=\"print\"", "<image x=\"1\" y=\"1\" width=\"5\" height=\"5\"/><g id=\"print\"", 1));
    let said = folder.run(["fold", "--verify", "q.svg", "--against", "plate.toml"]);
    assert!(said.status == 1 && said.stderr.contains("margin"), "{}", said.stderr);
}

#[test]
fn a_mesh_with_texture_coordinates_is_painted_by_them() {
    // Two squares at a right angle; u runs along x, v along the profile.
    let folder = Folder::new();
    folder.write(
        "m.obj",
        "v 0 0 0\nv 60 0 0\nv 0 30 0\nv 60 30 0\nv 0 30 30\nv 60 30 30\nvt 0 0\nvt 1 0\nvt 0 0.5\nvt 1 0.5\nvt 0 1\nvt 1 1\n\
         f 1/1 2/2 4/4\nf 1/1 4/4 3/3\nf 3/3 4/4 6/6\nf 3/3 6/6 5/5\n",
    );
    folder.write(
        "m.toml",
        "format = 1\nname = \"step\"\nunit = \"mm\"\n[geometry]\nkind = \"mesh\"\nfile = \"m.obj\"\nperiod = [60.0, 30.0]\n\
         [[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 1.0 }\ntint = \"t.png\"\n",
    );
    // Lower half (v below 0.5, the lower rows) red left and green right, upper half blue and white-ish.
    write_png(&folder.path("t.png"), 2, 2, png::ColorType::Rgb, &[30, 30, 220, 200, 200, 200, 220, 30, 30, 30, 220, 30]);
    let said = folder.run(["fold", "m.toml", "-o", "m.png", "--periods", "1x1", "--no-numbers", "--no-angles"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let (_, _, page) = read_png(&folder.path("m-1.png"));
    // Each colour covers 30 x 30 mm, and some bleed.
    for colour in [[220, 30, 30], [30, 220, 30], [30, 30, 220], [200, 200, 200_u8]] {
        let dots = page.iter().filter(|p| (0..3).all(|c| p[c].abs_diff(colour[c]) <= 2)).count();
        let area = dots as f64 * (25.4_f64 / 200.0).powi(2);
        assert!((850.0..1000.0).contains(&area), "{colour:?}: {area} mm2");
    }
}
