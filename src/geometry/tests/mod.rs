//! Tests of the kinds through material files: areas, closing, extremes, templates.

mod bad_input;
mod height_field;
mod procedural;
mod weave;

use super::{Geometry, KINDS, Tile, describe, params, template};
use crate::error::Result;
use crate::material::{Material, SmallScale};
use crate::toml_reader::Source;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// Builds a material file whose `[geometry]` table is `geometry`, every part Lambert; paths are relative to `folder`.
fn build_in(folder: &Path, geometry: &str) -> Result<SmallScale> {
    let text = format!("format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n");
    Material::parse(&Source { path: folder.join("test.toml"), text })?.build()
}

fn build(geometry: &str) -> Tile {
    build_in(Path::new(""), geometry).unwrap_or_else(|e| panic!("{geometry}: {e}")).tile
}

/// Twice the vector area of a triangle.
fn doubled(tile: &Tile, triangle: usize) -> DVec3 {
    let [a, b, c] = tile.corners(triangle);
    (b - a).cross(c - a)
}

/// Area of a part (of all, for "*").
fn area(tile: &Tile, part: &str) -> f64 {
    let named = |t: usize| part == "*" || tile.parts[usize::from(tile.part_of_triangle[t])] == part;
    (0..tile.triangles.len()).filter(|&t| named(t)).map(|t| 0.5 * doubled(tile, t).length()).sum()
}

/// Sum of the projected areas on z = 0, signed by the side that faces up; the footprint for a closed height field.
fn projected(tile: &Tile) -> f64 {
    (0..tile.triangles.len()).map(|t| 0.5 * doubled(tile, t).z).sum()
}

/// Edges that are not shared by exactly two triangles in opposite directions once opposite sides of the cell are identified;
/// positions within 1e-9 periods are one. Vertical edges of zero length do not occur.
fn open_edges(tile: &Tile) -> usize {
    let key = |v: u32| {
        let p = tile.vertices[v as usize];
        let scale = tile.period.extend(tile.period.max_element());
        let unit = p / scale;
        let wrap = |t: f64| ((t - t.floor()) * 1e9).round().rem_euclid(1e9) as i64;
        (wrap(unit.x), wrap(unit.y), (unit.z * 1e9).round() as i64)
    };
    let mut edges: HashMap<_, i32> = HashMap::new();
    for triangle in &tile.triangles {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            // A period-long edge has equal ends after wrapping: its direction keeps it apart.
            let along = tile.vertices[b as usize] - tile.vertices[a as usize];
            let sign = if (along.x, along.y, along.z) > (0.0, 0.0, 0.0) { 1 } else { -1 };
            let (low, high) = if sign > 0 { (key(a), key(b)) } else { (key(b), key(a)) };
            *edges.entry((low, high)).or_default() += sign;
        }
    }
    edges.values().filter(|&&count| count != 0).count()
}

fn assert_near(got: f64, expected: f64, relative: f64, what: &str) {
    let off = (got - expected).abs();
    assert!(off <= relative * expected.abs().max(f64::MIN_POSITIVE), "{what}: {got}, expected {expected}");
}

#[test]
fn every_kind_is_described_and_its_template_says_every_parameter() {
    for kind in KINDS {
        let description = describe(kind).unwrap();
        let text = template(kind).unwrap();
        for param in description.params {
            assert!(
                text.contains(&format!("\n{} = ", param.key)) || text.contains(&format!("\n# {} = ", param.key)),
                "{kind}: {}",
                param.key
            );
            assert!(text.contains(param.help) && text.contains(&param.domain()), "{kind}: {}", param.key);
        }
        assert!(text.lines().all(|l| l.len() <= 200), "{kind}: a line is too long");
    }
    assert!(describe("fur").is_none() && template("fur").is_none());
}

#[test]
fn every_template_loads_and_builds() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("surface.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    image::GrayImage::from_fn(6, 5, |x, y| image::Luma([(20 * x + 7 * y) as u8])).save(folder.path().join("heights.png")).unwrap();
    for kind in KINDS {
        let path = folder.path().join(format!("{kind}.toml"));
        std::fs::write(&path, template(kind).unwrap()).unwrap();
        let built = Material::load(&path).and_then(|m| m.build()).unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert!(!built.tile.triangles.is_empty(), "{kind}");
    }
}

#[test]
fn a_template_writes_the_defaults() {
    let of = |text: &str| Material::parse(&Source { path: "t.toml".into(), text: text.into() }).unwrap().build().unwrap().tile;
    for kind in ["grooves", "pyramids", "rods", "weave"] {
        let (written, default) = (of(&template(kind).unwrap()), build(&format!("kind = \"{kind}\"")));
        if kind != "weave" {
            assert_eq!(written, default, "{kind}");
        }
        // A third of a width is written to twelve digits.
        assert_eq!((&written.triangles, written.period), (&default.triangles, default.period), "{kind}");
        let apart = |(a, b): (&DVec3, &DVec3)| a.distance(*b) / default.period.max_element();
        assert!(written.vertices.iter().zip(&default.vertices).map(apart).all(|d| d < 1e-11), "{kind}");
    }
}

#[test]
fn every_sample_loads_and_builds_and_is_all_covered() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(
            path.is_dir() || name == "README.md" || readme.contains(&format!("`{name}`")),
            "samples/README.md does not say where {name} is from"
        );
        if path.extension().is_some_and(|e| e == "toml") && std::fs::read_to_string(&path).unwrap().contains("[geometry]") {
            let tile = Material::load(&path).and_then(|m| m.build()).unwrap_or_else(|e| panic!("{e}")).tile;
            println!("{name}: {} triangles, {} x {}, {:?}", tile.triangles.len(), tile.period.x, tile.period.y, tile.notes);
            if tile.grid.is_some() || name.contains("groove") || name.contains("stud") {
                assert_near(projected(&tile), tile.footprint(), 1e-9, &name);
            }
            count += 1;
        }
    }
    assert!(count >= 10, "{count} samples");
}

/// `docs/geometry.md` with the table of each kind's parameters at its place.
fn documented(text: &str) -> String {
    let mut out = String::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        out.push_str(line);
        out.push('\n');
        if let Some(kind) = line.strip_prefix("<!-- parameters: ").and_then(|l| l.strip_suffix(" -->")) {
            while lines.next_if(|l| l.starts_with('|')).is_some() {}
            out.push_str(&params::markdown(describe(kind).unwrap_or_else(|| panic!("{kind} is no kind")).params));
        }
    }
    out
}

#[test]
fn the_documentation_has_the_parameters_of_every_kind() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/geometry.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let wanted = documented(&text);
    if std::env::var_os("BISCALE_WRITE_DOCS").is_some() {
        std::fs::write(&path, &wanted).unwrap();
    }
    for kind in KINDS {
        assert!(text.contains(&format!("<!-- parameters: {kind} -->")), "docs/geometry.md lacks {kind}");
    }
    assert!(text == wanted, "docs/geometry.md is out of date; write it with BISCALE_WRITE_DOCS=1 cargo test -p biscale documentation");
}
