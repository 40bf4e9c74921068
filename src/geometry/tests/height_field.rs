//! Height fields: grid and triangles agree, files of every kind, scans made periodic; tint images over them.

use super::*;
use crate::geometry::height_field::{HeightMap, write_tmd};
use crate::material::Tint;

/// A folder with `h.png`: 8-bit, 4 x 3, columns 0, 51, 102, 153, plus 20 in the lowest row.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let image = image::GrayImage::from_fn(4, 3, |x, y| image::Luma([(51 * x + if y == 2 { 20 } else { 0 }) as u8]));
    image.save(folder.path().join("h.png")).unwrap();
    folder
}

#[test]
fn the_lowest_row_of_an_image_lies_at_y_0_and_the_grid_is_the_surface() {
    let folder = folder();
    let tile = build_in(folder.path(), "kind = \"height-field\"\nfile = \"h.png\"\npixel = 0.5\nheight = 2.55").unwrap().tile;
    assert_eq!(tile.period, DVec2::new(2.0, 1.5));
    let grid = tile.grid.as_ref().unwrap();
    assert_eq!((grid.columns, grid.rows), (4, 3));
    let expected = [0.2, 0.71, 1.22, 1.73, 0.0, 0.51, 1.02, 1.53, 0.0, 0.51, 1.02, 1.53];
    assert!(grid.heights.iter().zip(expected).all(|(got, want)| (got - want).abs() < 1e-6), "{:?}", grid.heights);
    for corner in &tile.vertices {
        let node = (*corner / DVec3::new(0.5, 0.5, 1.0)).round();
        assert_eq!(corner.z, grid.heights[(node.y as usize % 3) * 4 + node.x as usize % 4], "{corner}");
    }
    // Every triangle belongs to a cell cut along its shorter diagonal.
    for (t, uv) in tile.uv.as_ref().unwrap().iter().enumerate() {
        let corners = tile.corners(t);
        for k in 0..3 {
            assert!((corners[k].truncate() / tile.period - uv[k]).length() < 1e-12, "uv is the position over the tile");
            let [from, to] = [corners[k], corners[(k + 1) % 3]].map(|c| (c.truncate() / 0.5).round());
            let step = to - from;
            if step.x * step.y != 0.0 {
                let low = from.min(to);
                let [a, right, far, up] = grid.corners(low.x as usize, low.y as usize);
                let (own, other) = if step.x * step.y > 0.0 { (far - a, up - right) } else { (up - right, far - a) };
                assert!(own.abs() <= other.abs(), "the cell at {low} is cut along its longer diagonal");
            }
        }
    }
    assert_eq!(open_edges(&tile), 0);
    assert_near(projected(&tile), tile.footprint(), 1e-12, "projected");
    assert_eq!(tile.parts, ["surface"]);
}

#[test]
fn width_scales_the_whole_file_and_units_scale_a_scan() {
    let folder = folder();
    let tile = build_in(folder.path(), "kind = \"height-field\"\nfile = \"h.png\"\nwidth = 8.0\nheight = 1.0").unwrap().tile;
    assert_eq!(tile.period, DVec2::new(8.0, 6.0));
    let map = HeightMap { columns: 4, rows: 2, size: [2.0, 1.0], heights: (0..8).map(|k| f64::from(k) * 0.125).collect() };
    std::fs::write(folder.path().join("s.tmd"), write_tmd(&map)).unwrap();
    for (unit, factor) in [("mm", 1.0), ("um", 1e3)] {
        let text = format!(
            "format = 1\nunit = \"{unit}\"\n[geometry]\nkind = \"height-field\"\nfile = \"s.tmd\"\n[[surface]]\npart = \"surface\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n"
        );
        let tile = Material::parse(&Source { path: folder.path().join("m.toml"), text }).unwrap().build().unwrap().tile;
        assert!((tile.period - DVec2::new(2.0, 1.0) * factor).length() < 1e-9 * factor, "{unit}: {}", tile.period);
        let highest = tile.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
        assert_near(highest, 0.875 * factor, 1e-12, unit);
    }
}

#[test]
fn edges_are_reported_blended_or_mirrored() {
    let folder = folder();
    let build = |extra: &str| {
        build_in(folder.path(), &format!("kind = \"height-field\"\nfile = \"h.png\"\npixel = 1.0\nheight = 5.0\n{extra}")).unwrap().tile
    };
    let note = |tile: &Tile| tile.notes.join("; ");
    let plain = build("");
    assert!(note(&plain).contains("jump by up to 3.000e0"), "{}", note(&plain));
    let mirrored = build("edge = \"mirror\"");
    assert_eq!(mirrored.period, DVec2::new(6.0, 4.0));
    assert!(note(&mirrored).contains("mirrored"), "{}", note(&mirrored));
    let blended = build("edge = \"blend\"\nblend = 0.25");
    assert_eq!(blended.period, DVec2::new(3.0, 2.0));
    assert!(note(&blended).contains("differ by up to 3.000e0"), "{}", note(&blended));
    let level = build("detrend = true");
    assert!(note(&level).contains("rises by 1.000e0 along x"), "{}", note(&level));
    let reduced = build("resolution = 2");
    assert!(note(&reduced).contains("4 x 3 heights averaged to 2 x 2"), "{}", note(&reduced));
    assert_eq!(reduced.period, plain.period);
    for tile in [plain, mirrored, blended, level, reduced] {
        assert_eq!(open_edges(&tile), 0, "{}", note(&tile));
    }
}

#[test]
fn float_images_hold_heights_as_they_are() {
    let folder = folder();
    let mut encoder = tiff::encoder::TiffEncoder::new(std::fs::File::create(folder.path().join("h.tif")).unwrap()).unwrap();
    encoder.write_image::<tiff::encoder::colortype::Gray32Float>(2, 2, &[0.5, -1.25, 3.0, 0.0]).unwrap();
    let tile = build_in(folder.path(), "kind = \"height-field\"\nfile = \"h.tif\"\npixel = 1.0").unwrap().tile;
    assert_eq!(tile.grid.unwrap().heights, [3.0, 0.0, 0.5, -1.25]);
}

#[test]
fn height_fields_survive_the_extremes() {
    let folder = folder();
    for period in [1e-6, 1.0, 1e6] {
        for aspect in [0.0, 1e-6, 1e3] {
            let geometry =
                format!("kind = \"height-field\"\nfile = \"h.png\"\nwidth = {period:e}\nheight = {:e}\nresolution = 2000", aspect * period);
            match build_in(folder.path(), &geometry) {
                Ok(built) => {
                    assert_eq!(built.tile.triangles.len(), 24, "{geometry}: {:?}", built.tile.notes);
                    assert_near(projected(&built.tile), built.tile.footprint(), 1e-9, &geometry);
                }
                // 4 x 3 pixels: a width of 1e-6 is 0.75e-6 high, which is below the smallest period.
                Err(error) => assert!(period == 1e-6 && error.to_string().contains("0.00000075"), "{geometry}: {error}"),
            }
        }
    }
}

#[test]
fn a_tint_image_is_read_for_geometry_with_uv_and_refused_for_other() {
    let folder = folder();
    image::RgbImage::from_raw(1, 2, vec![255, 0, 0, 0, 0, 255]).unwrap().save(folder.path().join("t.png")).unwrap();
    let load = |geometry: &str, tint: &str| {
        let text = format!(
            "format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\ntint = {tint}\n"
        );
        Material::parse(&Source { path: folder.path().join("m.toml"), text }).and_then(|m| m.build())
    };
    let field = "kind = \"height-field\"\nfile = \"h.png\"\npixel = 1.0\nheight = 1.0";
    let built = load(field, "\"t.png\"").unwrap();
    let Tint::Image(image) = &built.surfaces[0].tint else { panic!("an image") };
    assert_eq!((image.lookup(DVec2::new(0.5, 0.25)), image.lookup(DVec2::new(0.5, 0.75))), ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]));
    for (geometry, tint, part) in [
        ("kind = \"grooves\"", "\"t.png\"", "no uv"),
        (field, "\"missing.png\"", "missing.png"),
        (field, "\"m.jpeg\"", "m.jpeg"),
        (field, "true", "surface[0].tint"),
        (field, "1.5", "surface[0].tint"),
    ] {
        let message = load(geometry, tint).unwrap_err().to_string();
        assert!(message.contains(part), "{tint} over {geometry} gave {message}");
    }
}

#[test]
fn the_real_scan_has_the_size_its_scanner_says() {
    let Some(root) = std::env::var_os("BISCALE_DATA") else {
        println!("skipped: BISCALE_DATA is not set");
        return;
    };
    let file = Path::new(&root).join("microgeom/gelsight_groove/heightmap.tmd");
    let geometry = format!("kind = \"height-field\"\nfile = '{}'\ndetrend = true\nedge = \"blend\"\nresolution = 128", file.display());
    let tile = build_in(Path::new(""), &geometry).unwrap().tile;
    // scan.yaml: 0.027458113509339 mm a pixel; 616 x 514 nodes reduced to 128 x 107, of which 13 and 11 are blended away.
    let expected = DVec2::new(616.0 * 115.0 / 128.0, 514.0 * 96.0 / 107.0) * 0.027_458_113_509_339;
    assert!((tile.period / expected - 1.0).abs().max_element() < 1e-6, "{} instead of {expected}", tile.period);
}
