//! Every format, as written by the libraries that read it; and damaged files.

use super::read::parse;
use super::read_tint;
use proptest::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// A 3 x 2 grey PNG of 16 bits: 0, 1, 2 thousandths on top, then 65535.
fn grey_png() -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, vec![0_u16, 1000, 2000, 65535, 65535, 65535]).unwrap();
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

fn float_tiff() -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut out).unwrap();
    encoder.write_image::<tiff::encoder::colortype::Gray32Float>(3, 2, &[0.5, -1.25, 3.0, 0.0, 1e-3, 7.0]).unwrap();
    out.into_inner()
}

fn colour_exr() -> Vec<u8> {
    use exr::prelude::*;
    let mut out = Cursor::new(Vec::new());
    let channels = SpecificChannels::rgb(|p: Vec2<usize>| (p.x() as f32 / 4.0, p.y() as f32 / 2.0, 0.25_f32));
    Image::from_channels((3, 2), channels).write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn every_format_is_read_with_row_0_on_top() {
    let png = parse(Path::new("a.png"), &grey_png()).unwrap();
    assert_eq!((png.width, png.height, png.integer), (3, 2, true));
    assert_eq!(png.channels, [vec![0.0, 1000.0 / 65535.0, 2000.0 / 65535.0, 1.0, 1.0, 1.0]]);
    let tiff = parse(Path::new("a.TIFF"), &float_tiff()).unwrap();
    assert_eq!((tiff.integer, tiff.channels), (false, vec![vec![0.5, -1.25, 3.0, 0.0, 1e-3, 7.0]]));
    let exr = parse(Path::new("a.exr"), &colour_exr()).unwrap();
    assert_eq!(exr.channels, [vec![0.0, 0.25, 0.5, 0.0, 0.25, 0.5], vec![0.0, 0.0, 0.0, 0.5, 0.5, 0.5], vec![0.25; 6]]);
}

#[test]
fn tints_are_linear_with_row_0_at_the_bottom() {
    let folder = tempfile::tempdir().unwrap();
    let (png, exr) = (folder.path().join("t.png"), folder.path().join("t.exr"));
    image::RgbImage::from_raw(1, 2, vec![255, 188, 0, 10, 20, 30]).unwrap().save(&png).unwrap();
    std::fs::write(&exr, colour_exr()).unwrap();
    let tint = read_tint(&png).unwrap();
    // sRGB 188 is linear 0.5029.
    let top = tint.pixels[1];
    assert!(top[0] == 1.0 && (top[1] - 0.5029).abs() < 1e-4 && top[2] == 0.0, "{top:?}");
    assert_eq!(read_tint(&exr).unwrap().pixels[0], [0.0, 0.5, 0.25]);
}

#[test]
fn a_tint_outside_0_to_1_is_refused_with_its_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.tif");
    std::fs::write(&path, float_tiff()).unwrap();
    let message = read_tint(&path).unwrap_err().to_string();
    assert!(message.contains("t.tif") && message.contains("0 to 1") | message.contains("0..1") && message.contains("row 1"), "{message}");
}

#[test]
fn wrong_files_are_refused() {
    for (name, bytes) in [("a.png", grey_png()), ("a.tif", float_tiff()), ("a.exr", colour_exr())] {
        assert!(parse(Path::new(name), &bytes[..bytes.len() / 2]).is_err(), "half of {name}");
        assert!(parse(Path::new(name), b"").is_err() && parse(Path::new(name), b"hello").is_err(), "{name}");
    }
    assert!(parse(Path::new("a.webp"), b"").unwrap_err().problem.contains("webp"));
    // A PNG header that announces 4e9 x 4e9 pixels.
    let mut png = grey_png();
    png[16..24].fill(0x7f);
    assert!(parse(Path::new("a.png"), &png).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_images_never_panic(
        which in 0_usize..3,
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        whole in any::<bool>(),
    ) {
        let (name, mut bytes) = [("a.png", grey_png()), ("a.tif", float_tiff()), ("a.exr", colour_exr())][which].clone();
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if !whole {
            bytes.truncate(cut.index(bytes.len()));
        }
        let _ = parse(Path::new(name), &bytes);
    }
}
