//! Every format, as written by the libraries that read it; and damaged files.

use super::decode::Wanted;
use super::read::parse;
use super::{read, read_heights, read_radiance, read_tint};
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

/// An uncompressed little-endian TIFF of one strip: entries of short numbers, an entry of text, and the samples.
fn made_tiff(size: [u16; 2], shorts: &[(u16, &[u16])], text: Option<(u16, &str)>, data: &[u8]) -> Vec<u8> {
    let mut entries: Vec<(u16, u16, u32, Vec<u8>)> = Vec::new();
    let short = |tag: u16, values: &[u16]| (tag, 3, values.len() as u32, values.iter().flat_map(|v| v.to_le_bytes()).collect());
    entries.extend([short(256, &size[..1]), short(257, &size[1..]), short(278, &size[1..])]);
    entries.extend([(273, 4, 1, 8_u32.to_le_bytes().to_vec()), (279, 4, 1, (data.len() as u32).to_le_bytes().to_vec())]);
    entries.retain(|(tag, ..)| shorts.iter().all(|(own, _)| own != tag));
    entries.extend(shorts.iter().map(|(tag, values)| short(*tag, values)));
    entries.extend(text.map(|(tag, text)| (tag, 2, text.len() as u32 + 1, [text.as_bytes(), b"\0"].concat())));
    entries.sort_by_key(|e| e.0);
    let directory = 8 + data.len() as u32;
    let mut after = directory + 2 + 12 * entries.len() as u32 + 4;
    let mut out =
        [b"II*\0".to_vec(), directory.to_le_bytes().to_vec(), data.to_vec(), (entries.len() as u16).to_le_bytes().to_vec()].concat();
    let mut values = Vec::new();
    for (tag, kind, count, bytes) in entries {
        out.extend(tag.to_le_bytes());
        out.extend(kind.to_le_bytes());
        out.extend(count.to_le_bytes());
        if bytes.len() <= 4 {
            out.extend(bytes.iter().copied().chain([0; 4]).take(4));
        } else {
            out.extend(after.to_le_bytes());
            after += bytes.len() as u32;
            values.extend(bytes);
        }
    }
    out.extend([0; 4]);
    out.extend(values);
    out
}

/// Grey samples of some bits, with (2) or without (1) a sign.
fn grey_tiff(bits: u16, format: u16, no_data: Option<&str>, data: &[u8]) -> Vec<u8> {
    let shorts: [(u16, &[u16]); 5] = [(258, &[bits]), (259, &[1]), (262, &[1]), (277, &[1]), (339, &[format])];
    made_tiff([3, 1], &shorts, no_data.map(|text| (42113, text)), data)
}

#[test]
fn tiffs_of_all_whole_numbers_have_the_largest_one_as_1() {
    let signed: Vec<Vec<u8>> = vec![
        [-64_i8, 0, 127].iter().flat_map(|v| v.to_le_bytes()).collect(),
        [-16_384_i16, 0, i16::MAX].iter().flat_map(|v| v.to_le_bytes()).collect(),
        [-(1 << 30), 0, i32::MAX].iter().flat_map(|v: &i32| v.to_le_bytes()).collect(),
    ];
    for (bits, data) in [8, 16, 32].into_iter().zip(&signed) {
        let raster = parse(Path::new("a.tif"), &grey_tiff(bits, 2, None, data)).unwrap();
        let [low, zero, high] = raster.channels[0][..] else { panic!("{bits}: {:?}", raster.channels) };
        assert!((low + 0.5).abs() < 0.005 && zero == 0.0 && high == 1.0 && raster.integer, "{bits}: {low} {zero} {high}");
    }
    let deep: Vec<u8> = [0_u32, 1 << 31, u32::MAX].iter().flat_map(|v| v.to_le_bytes()).collect();
    assert_eq!(parse(Path::new("a.tif"), &grey_tiff(32, 1, None, &deep)).unwrap().channels[0], [0.0, 0.5, 1.0]);
    // 1 0 1, 3 0 1 and 15 0 5: the first sample in the highest bits.
    for (bits, data, expected) in
        [(1, &[0b1010_0000_u8][..], [1.0, 0.0, 1.0]), (2, &[0b1100_0100], [1.0, 0.0, 1.0 / 3.0]), (4, &[0xf0, 0x50], [1.0, 0.0, 1.0 / 3.0])]
    {
        assert_eq!(parse(Path::new("a.tif"), &grey_tiff(bits, 1, None, data)).unwrap().channels[0], expected, "{bits} bits");
    }
}

/// Rows of whole numbers of some bits, the highest first; each row begins with a byte. Numbers of whole bytes have the lowest first.
fn rows_of_bits(rows: &[&[u32]], bits: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    for row in rows {
        if bits.is_multiple_of(8) {
            bytes.extend(row.iter().flat_map(|v| v.to_le_bytes().into_iter().take(bits as usize / 8)));
            continue;
        }
        let all: Vec<u32> = row.iter().flat_map(|v| (0..bits).rev().map(move |bit| v >> bit & 1)).collect();
        bytes.extend(all.chunks(8).map(|byte| (0..8).fold(0, |sum, k| sum << 1 | byte.get(k).map_or(0, |b| *b as u8))));
    }
    bytes
}

#[test]
fn tiffs_of_bits_that_fill_no_byte_are_taken_apart() {
    for bits in [3_u16, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15, 17, 20, 24, 31] {
        let largest = (1_u32 << bits) - 1;
        let data = rows_of_bits(&[&[0, largest, 1], &[largest / 2, 2, largest - 1]], bits.into());
        let shorts = |format: u16| vec![(258, vec![bits]), (259, vec![1]), (262, vec![1]), (277, vec![1]), (339, vec![format])];
        let file = |format: u16, no_data: Option<&str>| {
            let shorts = shorts(format);
            let shorts: Vec<(u16, &[u16])> = shorts.iter().map(|(tag, values)| (*tag, &values[..])).collect();
            parse(Path::new("a.tif"), &made_tiff([3, 2], &shorts, no_data.map(|text| (42113, text)), &data)).unwrap()
        };
        let share = |v: u32| (f64::from(v) / f64::from(largest)) as f32;
        let raster = file(1, None);
        assert_eq!(raster.channels, [[0, largest, 1, largest / 2, 2, largest - 1].map(share).to_vec()], "{bits} bits");
        assert!(raster.integer && raster.width == 3 && raster.height == 2);
        // All ones are -1, one less is -2.
        let step = (1.0 / f64::from(largest / 2)) as f32;
        assert_eq!(file(2, None).channels, [vec![0.0, -step, step, 1.0, 2.0 * step, -2.0 * step]], "{bits} bits with a sign");
        // The mark of no data is a number of the file.
        let shorts = shorts(1);
        let shorts: Vec<(u16, &[u16])> = shorts.iter().map(|(tag, values)| (*tag, &values[..])).collect();
        let bad = parse(Path::new("a.tif"), &made_tiff([3, 2], &shorts, Some((42113, &largest.to_string())), &data)).unwrap_err();
        assert!(bad.problem.contains("column 1, row 0"), "{bad}");
    }
    // Colours.
    let data = rows_of_bits(&[&[4095, 0, 2048, 0, 4095, 1]], 12);
    let shorts: [(u16, &[u16]); 4] = [(258, &[12, 12, 12]), (259, &[1]), (262, &[2]), (277, &[3])];
    let raster = parse(Path::new("a.tif"), &made_tiff([2, 1], &shorts, None, &data)).unwrap();
    let share = |v: f64| (v / 4095.0) as f32;
    assert_eq!(raster.channels, [vec![1.0, 0.0], vec![0.0, 1.0], vec![share(2048.0), share(1.0)]]);
    // White as 0.
    let shorts: [(u16, &[u16]); 4] = [(258, &[12]), (259, &[1]), (262, &[0]), (277, &[1])];
    let raster = parse(Path::new("a.tif"), &made_tiff([2, 1], &shorts, None, &rows_of_bits(&[&[0, 4095]], 12))).unwrap();
    assert_eq!(raster.channels, [vec![1.0, 0.0]]);
    // Damaged files end somehow.
    let whole = made_tiff([2, 1], &shorts, None, &rows_of_bits(&[&[0, 4095]], 12));
    for cut in 0..whole.len() {
        let _ = parse(Path::new("a.tif"), &whole[..cut]);
        let mut damaged = whole.clone();
        for value in [0, 1, 127, 255] {
            damaged[cut] = value;
            let _ = parse(Path::new("a.tif"), &damaged);
        }
    }
}

#[test]
fn tiffs_of_odd_bits_may_have_differences_alpha_planes_and_palettes() {
    for bits in [5_u16, 12, 14, 24] {
        let largest = (1_u32 << bits) - 1;
        let share = |v: u32| (f64::from(v) / f64::from(largest)) as f32;
        let read = |size, shorts: &[(u16, &[u16])], rows: &[&[u32]]| {
            parse(Path::new("a.tif"), &made_tiff(size, shorts, None, &rows_of_bits(rows, bits.into()))).unwrap()
        };
        let difference = |a: u32, b: u32| a.wrapping_sub(b) & largest;
        // Differences begin anew with each row; that of 1 after the largest is 2.
        let rows: [&[u32]; 2] = [&[7, difference(largest, 7), 2], &[1, 0, difference(0, 1)]];
        let raster = read([3, 2], &[(258, &[bits]), (259, &[1]), (262, &[1]), (277, &[1]), (317, &[2])], &rows);
        assert_eq!(raster.channels, [[7, largest, 1, 1, 1, 0].map(share).to_vec()], "{bits} bits, differences");
        // Differences of colours, and alpha.
        let colours: [&[u32]; 1] = [&[3, 4, 5, largest, difference(1, 3), 0, difference(4, 5), difference(9, largest)]];
        let shorts: [(u16, &[u16]); 6] = [(258, &[bits; 4]), (259, &[1]), (262, &[2]), (277, &[4]), (317, &[2]), (338, &[2])];
        let raster = read([2, 1], &shorts, &colours);
        assert_eq!(raster.channels, [[3, 1], [4, 4], [5, 4]].map(|c| c.map(share).to_vec()), "{bits} bits, colours with alpha");
        assert_eq!(raster.alpha, Some([largest, 9].map(share).to_vec()));
        let raster = read([2, 1], &[(258, &[bits; 2]), (259, &[1]), (262, &[1]), (277, &[2]), (338, &[1])], &[&[1, 2, 3, 4]]);
        assert_eq!((raster.channels, raster.alpha), (vec![[1, 3].map(share).to_vec()], Some([2, 4].map(share).to_vec())));
        // One channel after the other, each of two rows.
        let planes: [&[u32]; 6] = [&[1, 2], &[3, 4], &[5, 6], &[7, 8], &[9, 10], &[11, 12]];
        let bytes = 2 * (2 * bits).div_ceil(8);
        let (places, sizes) = ([0, 1, 2].map(|plane| 8 + plane * bytes), [bytes; 3]);
        let strips: [(u16, &[u16]); 7] =
            [(258, &[bits; 3]), (259, &[1]), (262, &[2]), (273, &places), (277, &[3]), (279, &sizes), (284, &[2])];
        let raster = read([2, 2], &strips, &planes);
        assert_eq!(raster.channels, [[1, 2, 3, 4], [5, 6, 7, 8], [9, 10, 11, 12]].map(|c| c.map(share).to_vec()), "{bits} bits, planes");
    }
    let mut colours = vec![0_u16; 3 << 10];
    (colours[1000], colours[(1 << 10) + 1000], colours[(2 << 10) + 3]) = (65_535, 32_768, 65_535);
    let shorts: [(u16, &[u16]); 5] = [(258, &[10]), (259, &[1]), (262, &[3]), (277, &[1]), (320, &colours)];
    let raster = parse(Path::new("a.tif"), &made_tiff([2, 1], &shorts, None, &rows_of_bits(&[&[1000, 3]], 10))).unwrap();
    assert_eq!(raster.channels, [vec![1.0, 0.0], vec![32_768.0 / 65_535.0, 0.0], vec![0.0, 1.0]]);
    // Channels of which none is said to be a colour or alpha.
    let shorts: [(u16, &[u16]); 6] = [(258, &[16, 16]), (259, &[1]), (262, &[1]), (277, &[2]), (338, &[0]), (339, &[1, 1])];
    let bad = parse(Path::new("a.tif"), &made_tiff([1, 1], &shorts, None, &[0; 4])).unwrap_err();
    assert!(bad.problem.contains("2 channels, and does not say that they are colours") && bad.remedy.contains("gdal_translate"), "{bad}");
}

#[test]
fn a_palette_gives_the_colours_of_its_entries() {
    let mut colours = vec![0_u16; 3 * 16];
    (colours[2], colours[16 + 2], colours[32 + 2]) = (65_535, 32_768, 0);
    (colours[1], colours[16 + 1], colours[32 + 1]) = (0, 0, 65_535);
    let shorts: [(u16, &[u16]); 5] = [(258, &[4]), (259, &[1]), (262, &[3]), (277, &[1]), (320, &colours)];
    let raster = parse(Path::new("a.tif"), &made_tiff([3, 1], &shorts, None, &[0x21, 0x00])).unwrap();
    assert_eq!(raster.channels, [vec![1.0, 0.0, 0.0], vec![32_768.0 / 65_535.0, 0.0, 0.0], vec![0.0, 1.0, 0.0]]);
    // With alpha.
    let mut colours = vec![0_u16; 3 * 256];
    (colours[3], colours[256 + 3]) = (65_535, 65_535);
    let shorts: [(u16, &[u16]); 6] = [(258, &[8, 8]), (259, &[1]), (262, &[3]), (277, &[2]), (320, &colours), (338, &[2])];
    let raster = parse(Path::new("a.tif"), &made_tiff([3, 1], &shorts, None, &[3, 255, 0, 51, 3, 0])).unwrap();
    assert_eq!(raster.channels, [vec![1.0, 0.0, 1.0], vec![1.0, 0.0, 1.0], vec![0.0; 3]]);
    assert_eq!(raster.alpha, Some(vec![1.0, 0.2, 0.0]));
    // Places that are no whole numbers.
    let floats: Vec<u8> = [3.0_f32, f32::INFINITY, 0.5].iter().flat_map(|v| v.to_le_bytes()).collect();
    let wide = vec![0_u16; 3 << 16];
    let shorts: [(u16, &[u16]); 6] = [(258, &[32]), (259, &[1]), (262, &[3]), (277, &[1]), (320, &wide), (339, &[3])];
    let bad = parse(Path::new("a.tif"), &made_tiff([3, 1], &shorts, None, &floats)).unwrap_err();
    assert!(bad.problem.contains("by floats"), "{bad}");
    let colours = [0_u16; 48];
    let short: [(u16, &[u16]); 5] = [(258, &[4]), (259, &[1]), (262, &[3]), (277, &[1]), (320, &colours[..9])];
    let bad = parse(Path::new("a.tif"), &made_tiff([3, 1], &short, None, &[0x21, 0x00])).unwrap_err();
    assert!(bad.problem.contains("palette has not 16 colours"), "{bad}");
}

#[test]
fn grey_with_alpha_is_grey() {
    let shorts: [(u16, &[u16]); 5] = [(258, &[8, 8]), (259, &[1]), (262, &[1]), (277, &[2]), (338, &[2])];
    let raster = parse(Path::new("a.tif"), &made_tiff([3, 1], &shorts, None, &[0, 255, 51, 0, 255, 255])).unwrap();
    assert_eq!((raster.channels, raster.alpha), (vec![vec![0.0, 0.2, 1.0]], Some(vec![1.0, 0.0, 1.0])));
}

#[test]
fn pixels_without_data_are_refused_by_their_place() {
    let whole: Vec<u8> = [5_i16, 7, -9_999].iter().flat_map(|v| v.to_le_bytes()).collect();
    let floats = |last: f32| [0.5, -1.0, last].iter().flat_map(|v: &f32| v.to_le_bytes()).collect::<Vec<u8>>();
    for (bytes, name) in [
        (grey_tiff(16, 2, Some("-9999"), &whole), "whole numbers"),
        (grey_tiff(32, 3, Some("-3.4028234663852886e+38"), &floats(f32::MIN)), "floats"),
        (grey_tiff(32, 3, Some(" -9999.9 "), &floats(-9_999.9)), "floats of other digits"),
        (grey_tiff(32, 3, Some("nan"), &floats(f32::NAN)), "nan"),
        (grey_tiff(32, 3, None, &floats(f32::MIN)), "the least float without a mark"),
    ] {
        let bad = parse(Path::new("a.tif"), &bytes).expect_err(name);
        assert!(bad.problem.contains("column 2, row 0 has no value"), "{name}: {bad}");
    }
    // Without the mark -9999 is a height, and a mark that no pixel has changes nothing.
    assert!(parse(Path::new("a.tif"), &grey_tiff(16, 2, None, &whole)).is_ok());
    assert!(parse(Path::new("a.tif"), &grey_tiff(16, 2, Some("-32768"), &whole)).is_ok());
    let bad = parse(Path::new("a.tif"), &grey_tiff(16, 2, Some("none"), &whole)).unwrap_err();
    assert!(bad.problem.contains("42113"), "{bad}");
}

#[test]
fn channels_one_after_the_other_are_called_so() {
    let shorts: [(u16, &[u16]); 8] =
        [(258, &[8, 8, 8]), (259, &[1]), (262, &[2]), (273, &[8, 11, 14]), (277, &[3]), (279, &[3, 3, 3]), (284, &[2]), (339, &[1, 1, 1])];
    let bad = parse(Path::new("a.tif"), &made_tiff([3, 1], &shorts, None, &[0; 9])).unwrap_err();
    assert!(bad.problem.contains("one after the other"), "{bad}");
}

/// An EXR of two layers: grey, 2 x 1 at (1, 1) of a display window of 4 x 2, and one with Z.
fn windowed_exr(with_height: bool) -> Vec<u8> {
    use exr::prelude::*;
    let layer = |name: &str, channel: &str, first: f32| {
        let samples = FlatSamples::F32(vec![first, first + 1.0]);
        let channels = AnyChannels::sort([AnyChannel::new(channel, samples)].into_iter().collect());
        let attributes = LayerAttributes { layer_position: Vec2(1, 1), ..LayerAttributes::named(name) };
        Layer::new((2, 1), attributes, Encoding::UNCOMPRESSED, channels)
    };
    let mut layers = Layers::new();
    layers.push(layer("light", "Y", 1.0));
    if with_height {
        layers.push(layer("depth", "Z", 7.0));
    }
    let image = Image { attributes: ImageAttributes::new(IntegerBounds::from_dimensions((4, 2))), layer_data: layers };
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn an_exr_is_laid_into_its_display_window_and_lends_its_heights() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("w.exr");
    std::fs::write(&path, windowed_exr(true)).unwrap();
    // Light is black where there are no data, as the format says.
    let (light, _) = read_radiance(&path).unwrap();
    assert_eq!((light.width, light.height, &light.channels[0][..]), (4, 2, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 0.0][..]));
    // A height or colour that is not there is refused.
    for message in [read_heights(&path).unwrap_err().to_string(), read(&path).unwrap_err().to_string()] {
        assert!(message.contains("column 0, row 0 has no value"), "{message}");
    }
    let wanted = |wanted| crate::image_file::decode::exr(&windowed_exr(true), wanted).unwrap().channels[0][5];
    assert_eq!((wanted(Wanted::Heights), wanted(Wanted::Colour)), (7.0, 1.0));
    assert_eq!(crate::image_file::decode::exr(&windowed_exr(false), Wanted::Heights).unwrap().channels[0][6], 2.0);
}

#[test]
fn radiance_files_signed_rgbe_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("l.hdr");
    let body = b"FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x40\x20\x81";
    std::fs::write(&path, [b"#?RGBE\n", &body[..]].concat()).unwrap();
    assert_eq!(read_radiance(&path).unwrap().0.channels, [vec![1.0], vec![0.5], vec![0.25]]);
}

#[test]
fn radiance_slightly_below_0_is_0_with_a_note_and_far_below_refused() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("l.exr");
    let write = |dark: f32| {
        let channels = SpecificChannels::rgb(move |p: Vec2<usize>| if p.x() == 1 { (dark, 0.0, 0.0) } else { (10.0, 10.0, 10.0) });
        Image::from_channels((3, 2), channels).write().to_file(&path).unwrap();
        read_radiance(&path)
    };
    let (light, note) = write(-0.1).unwrap();
    assert_eq!(light.channels[0], [10.0, 0.0, 10.0, 10.0, 0.0, 10.0]);
    let note = note.unwrap();
    assert!(note.starts_with("2 values below 0, the first in column 1, row 0"), "{note}");
    assert_eq!(write(0.0).unwrap().1, None);
    let message = write(-5.0).unwrap_err().to_string();
    assert!(message.contains("column 1, row 0 is negative") && message.contains("% of the light"), "{message}");
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
