//! Weave analysis on drawn cloths, whose truth is known.
#![allow(clippy::unwrap_used, reason = "a failed test says where")]
#![allow(clippy::cast_possible_wrap, reason = "small counts of threads and pixels")]
mod catalogue;
mod cloth;

use biscale::geometry::weave::Draft;
use biscale_capture::weave::{
    Analysis, Class, FindingCode, MaterialGuesses, Profile, RectifiedPhoto, TwillDirection, WeaveOptions, analyse,
};
use cloth::{Cloth, Picture};

/// A two-coloured plain cloth under light from the side.
fn base() -> Cloth {
    Cloth {
        draft: Cloth::draft_of(1, 1, 1),
        pitch: [16.0, 16.0],
        fill: [0.85, 0.85],
        flatness: 0.4,
        section: 2.0,
        colours: [[0.5, 0.1, 0.1], [0.1, 0.2, 0.5], [0.02, 0.02, 0.02]],
        gloss: 0.05,
        to_light: [0.5, 0.3, 0.8],
        ambient: 0.2,
        turn_deg: 2.0,
        gradient: [0.2, -0.1],
        noise: 0.02,
        uneven: 0.02,
        fibres: 0.1,
        blur: 0.7,
        size: [320, 320],
        seed: 1,
    }
}

fn see(picture: &Picture) -> Analysis {
    let photo = RectifiedPhoto { width: picture.width, height: picture.height, rgb: &picture.rgb, mask: None, mm_per_pixel: None };
    analyse(&photo, &WeaveOptions::default()).unwrap()
}

const ONE_COLOUR: [[f64; 3]; 3] = [[0.5, 0.45, 0.4], [0.5, 0.45, 0.4], [0.02, 0.02, 0.02]];

#[test]
fn plain_cloth_and_twills_are_named_and_measured() {
    let z = |over, under| Class::Twill { over, under, direction: TwillDirection::Z };
    let s = |over, under| Class::Twill { over, under, direction: TwillDirection::S };
    let cases = [
        (Class::Plain, base()),
        (Class::Plain, Cloth { colours: ONE_COLOUR, pitch: [10.0, 14.0], ..base() }),
        (z(2, 2), Cloth { draft: Cloth::draft_of(2, 2, 1), ..base() }),
        (s(2, 1), Cloth { draft: Cloth::draft_of(2, 1, 2), turn_deg: -3.0, ..base() }),
        (s(3, 1), Cloth { draft: Cloth::draft_of(3, 1, 3), colours: ONE_COLOUR, pitch: [10.0, 13.0], ..base() }),
        (z(1, 3), Cloth { draft: Cloth::draft_of(1, 3, 1), colours: ONE_COLOUR, ..base() }),
    ];
    for (class, cloth) in cases {
        let analysis = see(&cloth.draw());
        let weave = analysis.weave.unwrap();
        assert_eq!(weave.class, class, "confidence {}", weave.confidence);
        assert_eq!(analysis.findings, []);
        for (axis, pitch) in [(weave.warp, cloth.pitch[0]), (weave.weft, cloth.pitch[1])] {
            assert!((axis.pitch.value / pitch - 1.0).abs() < 0.01, "{class}: {:?}, drawn with {pitch}", axis.pitch);
            let other = axis.pitch_by_autocorrelation.unwrap();
            assert!((other.value / pitch - 1.0).abs() < 0.01, "{class}: {other:?} by shifts, drawn with {pitch}");
            assert!((axis.turn_deg.value - cloth.turn_deg).abs() < 0.5, "{class}: {:?}, drawn with {}", axis.turn_deg, cloth.turn_deg);
        }
    }
}

/// Pixels that meet the same places of all threads leave bins of the fold without any.
#[test]
fn threads_that_lie_along_the_pixels_are_measured() {
    for pitch in [[10.0, 10.0], [14.0, 11.0]] {
        let cloth = Cloth { draft: Cloth::draft_of(2, 2, 1), pitch, fill: [0.74, 0.76], turn_deg: 0.0, uneven: 0.0, ..base() };
        let weave = see(&cloth.draw()).weave.unwrap();
        for (axis, (fill, pitch)) in [weave.warp, weave.weft].into_iter().zip(cloth.fill.into_iter().zip(pitch)) {
            assert!((axis.width.value / (fill * pitch) - 1.0).abs() < 0.05, "{:?}, drawn {}", axis.width, fill * pitch);
        }
    }
}

#[test]
fn threads_of_unlike_pitch_are_recognised() {
    for pitch in [[8.5, 38.0], [36.0, 8.0]] {
        let cloth = Cloth { draft: Cloth::draft_of(2, 1, 1), pitch, size: [480, 480], ..base() };
        let weave = see(&cloth.draw()).weave.unwrap();
        assert_eq!(weave.class, Class::Twill { over: 2, under: 1, direction: TwillDirection::Z });
        for (axis, pitch) in [weave.warp, weave.weft].into_iter().zip(pitch) {
            assert!((axis.pitch.value / pitch - 1.0).abs() < 0.01, "{:?}, drawn with {pitch}", axis.pitch);
        }
    }
}

fn save(picture: &Picture, path: &str) {
    let top = picture.rgb.iter().flatten().fold(0.0_f32, |a, &b| a.max(b)) * 0.7;
    let bytes: Vec<u8> = picture.rgb.iter().flat_map(|p| p.map(|v| ((v / top).clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8)).collect();
    image::save_buffer(path, &bytes, picture.width as u32, picture.height as u32, image::ColorType::Rgb8).unwrap();
}

/// A photograph of noise, or of a height profile along x.
fn drawn(size: usize, value: impl Fn(f64, f64) -> f64, noise: f64) -> Picture {
    let mut random = cloth::Random::new(5);
    let rgb = (0..size * size)
        .map(|k| {
            let light = value((k % size) as f64 + 0.5, (k / size) as f64 + 0.5) + noise * random.normal();
            [0.5, 0.4, 0.3].map(|c| (c * light).max(0.0) as f32)
        })
        .collect();
    Picture { width: size, height: size, rgb }
}

fn codes(analysis: &Analysis) -> Vec<FindingCode> {
    analysis.findings.iter().map(|f| f.code).collect()
}

/// Sharp edges that no lens has blurred have frequencies which the pixels cannot show: they come back as peaks that are of no lattice.
#[test]
fn a_cloth_of_jagged_edges_keeps_its_lattice() {
    let (pitch, width, turn) = ([12.0, 14.0], 0.85, 0.03_f64);
    let draft = Cloth::draft_of(2, 1, 1);
    let mut random = cloth::Random::new(1);
    let mut seen = Picture { width: 480, height: 400, rgb: Vec::new() };
    for k in 0..seen.width * seen.height {
        let (x, y) = ((k % seen.width) as f64, (seen.height - 1 - k / seen.width) as f64);
        let place = [(turn.cos() * x - turn.sin() * y) / pitch[0], (turn.sin() * x + turn.cos() * y) / pitch[1]].map(|p| p + 100.0);
        let [i, j] = place.map(|p| p.floor() as usize);
        let [a, b] = place.map(|p| (p - p.floor() - 0.5) * 2.0 / width);
        let over = draft[j % 3][i % 3];
        let round = |across: f64, along: f64| (0.5 + 0.5 * (1.0 - across * across).sqrt()) * (0.8 + 0.2 * (1.4 * along).cos());
        let colour = match (a.abs() < 1.0, b.abs() < 1.0) {
            (true, weft) if over || !weft => [0.5, 0.2, 0.15].map(|c| c * round(a, b)),
            (_, true) => [0.15, 0.2, 0.5].map(|c| c * round(b, a)),
            _ => [0.01; 3],
        };
        seen.rgb.push(colour.map(|c| (c + 0.01 * (c + 0.01).sqrt() * random.normal()).max(0.0) as f32));
    }
    let analysis = see(&seen);
    let weave = analysis.weave.clone().unwrap();
    assert_eq!(weave.class, Class::Twill { over: 2, under: 1, direction: TwillDirection::Z }, "{:?}", analysis.findings);
    for (axis, pitch) in [(weave.warp, pitch[0]), (weave.weft, pitch[1])] {
        assert!((axis.pitch.value / pitch - 1.0).abs() < 0.01, "{:?}, drawn with {pitch}", axis.pitch);
    }
}

#[test]
fn what_does_not_repeat_is_said_to() {
    let noise = see(&drawn(256, |_, _| 1.0, 0.2));
    assert_eq!(codes(&noise), [FindingCode::NoPeriod]);
    assert!(noise.findings[0].measured < noise.findings[0].threshold);
    assert!(noise.weave.is_none() && noise.relief.is_none());
    let flat = see(&drawn(256, |_, _| 1.0, 0.0));
    assert_eq!(codes(&flat), [FindingCode::NoPeriod]);
    // One edge, and light that falls off evenly.
    for light in [|x: f64, _: f64| if x > 200.0 { 1.2 } else { 0.4 }, |x: f64, _: f64| 0.2 + x / 400.0] {
        for noise in [0.0, 0.01] {
            let seen = see(&drawn(400, light, noise));
            assert_eq!(codes(&seen), [FindingCode::NoPeriod], "{:?}", seen.relief);
            assert!(seen.findings[0].measured < seen.findings[0].threshold && seen.relief.is_none());
        }
    }
}

#[test]
fn threads_of_few_pixels_are_undersampled() {
    let analysis = see(&Cloth { pitch: [5.0, 5.5], blur: 0.5, size: [200, 200], ..base() }.draw());
    assert!(codes(&analysis).contains(&FindingCode::Undersampled), "{:?}", analysis.findings);
    let warp = analysis.weave.unwrap().warp;
    assert!((warp.pitch.value / 5.0 - 1.0).abs() < 0.01, "the period is measured all the same: {:?}", warp.pitch);
}

/// A picture enlarged by an image program.
fn enlarged(picture: &Picture, factor: f64, filter: image::imageops::FilterType) -> Picture {
    let small =
        image::Rgb32FImage::from_raw(picture.width as u32, picture.height as u32, picture.rgb.iter().flatten().copied().collect()).unwrap();
    let size = |n: usize| (n as f64 * factor).round() as u32;
    let large = image::imageops::resize(&small, size(picture.width), size(picture.height), filter);
    Picture { width: large.width() as usize, height: large.height() as usize, rgb: large.pixels().map(|p| p.0).collect() }
}

/// More pixels are not more sight: the threads of an enlarged picture have as many pixels as before, and none are invented.
#[test]
fn an_enlarged_picture_is_taken_as_what_it_was() {
    use image::imageops::FilterType::{CatmullRom, Nearest, Triangle};
    let z = Class::Twill { over: 2, under: 2, direction: TwillDirection::Z };
    let twill = Cloth { draft: Cloth::draft_of(2, 2, 1), pitch: [9.0, 9.6], size: [240, 240], ..base() };
    for (factor, filter) in [(3.0, Nearest), (3.0, Triangle), (3.0, CatmullRom), (2.5, Triangle)] {
        let found = see(&enlarged(&twill.draw(), factor, filter));
        assert!(codes(&found).contains(&FindingCode::Undersampled), "{factor} by {filter:?}: {:?}", found.findings);
        let weave = found.weave.unwrap_or_else(|| panic!("{factor} by {filter:?}: {:?}", found.findings));
        assert_eq!(weave.class, z, "{factor} by {filter:?}");
        assert!((weave.warp.pixels / 9.0 - 1.0).abs() < 0.03, "{factor} by {filter:?}: {}", weave.warp.pixels);
        // Lengths are in pixels of the picture that was given.
        assert!((weave.warp.pitch.value / (9.0 * factor) - 1.0).abs() < 0.03, "{factor} by {filter:?}: {:?}", weave.warp.pitch);
    }
    // Threads of less than three pixels: what they are is not told, and no relief is made up.
    for draft in [Cloth::draft_of(4, 1, 2), Cloth::draft_of(2, 2, 1)] {
        let fine = Cloth { draft, pitch: [2.8, 2.9], blur: 0.5, size: [260, 260], ..base() };
        let found = see(&enlarged(&fine.draw(), 3.0, CatmullRom));
        assert!(codes(&found).contains(&FindingCode::Undersampled), "{:?}", found.findings);
        assert!(found.relief.is_none(), "{:?}", found.relief);
        if let Some(weave) = &found.weave {
            assert!(weave.warp.pixels < 8.0, "{weave:?}");
        }
    }
    // What a camera took is left as it is, threads that lie along the pixels included.
    for pitch in [[10.0, 10.0], [12.0, 12.0], [9.0, 9.0]] {
        let found = see(&Cloth { pitch, turn_deg: 0.0, uneven: 0.0, noise: 0.0, fibres: 0.0, ..base() }.draw());
        assert_eq!(codes(&found), [], "{pitch:?}: {:?}", found.findings);
    }
}

#[test]
fn grooves_are_measured_and_written() {
    let period = 23.0;
    let angle = 6.0_f64.to_radians();
    let place = |x: f64, y: f64| ((x * angle.cos() - y * angle.sin()) / period).rem_euclid(1.0);
    // Edges a pixel wide, as a lens makes them: a share of a side is what lies right of its edge.
    let step = |distance: f64| (0.5 + distance * period / 1.5).clamp(0.0, 1.0);
    let side = |p: f64, width: f64| step(p) * step(width - p) + step(p - 1.0);
    let v = see(&drawn(400, |x, y| 0.6 + 0.4 * side(place(x, y), 0.5), 0.03));
    let relief = v.relief.clone().unwrap_or_else(|| panic!("{v:?}"));
    assert!(matches!(relief.profile, Profile::V { .. }), "{relief:?}");
    assert!((relief.period[0].value / period - 1.0).abs() < 0.01, "{relief:?}");
    assert!((relief.turn_deg - 6.0).abs() < 0.5, "{relief:?}");
    let saw = see(&drawn(400, |x, y| 0.9 - 0.5 * side(place(x, y), 0.2), 0.03));
    assert!(matches!(saw.relief.clone().unwrap().profile, Profile::Sawtooth { steep } if (steep - 0.2).abs() < 0.04), "{:?}", saw.relief);
    for analysis in [v, saw] {
        builds(&analysis.material("grooves", &MaterialGuesses::default()).unwrap());
    }
}

#[test]
fn pyramids_are_no_plain_cloth() {
    let (pitch, angle) = (22.0, 3.0_f64.to_radians());
    for light in [[0.9, 0.4, 0.7, 0.55], [0.8, 0.45, 0.8, 0.45], [0.9, 0.5, 0.5, 0.5]] {
        let facet = |x: f64, y: f64| {
            let (x, y) = (x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos());
            let (u, v) = ((x / pitch).rem_euclid(1.0) - 0.5, (y / pitch).rem_euclid(1.0) - 0.5);
            // Edges a pixel wide, as a lens makes them.
            let step = |d: f64| (0.5 + d * pitch / 1.5).clamp(0.0, 1.0);
            let share = [step(u - v.abs()), step(-u - v.abs()), step(v - u.abs()), step(-v - u.abs())];
            let sum: f64 = share.iter().sum();
            share.iter().zip(light).map(|(s, l)| s * l).sum::<f64>() / sum.max(1e-9)
        };
        let found = see(&drawn(400, facet, 0.02));
        let relief = found.relief.clone().unwrap_or_else(|| panic!("{light:?}: {found:?}"));
        assert!(matches!(relief.profile, Profile::Pyramids) && found.weave.is_none(), "{light:?}: {relief:?}");
        assert!(relief.period.iter().all(|p| (p.value / pitch - 1.0).abs() < 0.01), "{light:?}: {relief:?}");
    }
}

/// A material file is read and built by the library.
fn builds(text: &str) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("measured.toml");
    std::fs::write(&path, text).unwrap();
    let material = biscale::material::Material::load(&path).unwrap_or_else(|e| panic!("{e}\n{text}"));
    material.build().unwrap_or_else(|e| panic!("{e}\n{text}")).tile.triangles.len()
}

#[test]
fn a_cloth_becomes_a_material_file_and_a_given_draft_is_kept() {
    let cloth = Cloth { draft: Cloth::draft_of(2, 2, 1), ..base() };
    let picture = cloth.draw();
    let photo = RectifiedPhoto { width: picture.width, height: picture.height, rgb: &picture.rgb, mask: None, mm_per_pixel: Some(0.02) };
    let analysis = analyse(&photo, &WeaveOptions::default()).unwrap();
    let weave = analysis.weave.clone().unwrap();
    assert!((weave.warp.pitch.value / (16.0 * 0.02) - 1.0).abs() < 0.01, "{:?}", weave.warp.pitch);
    let colour = |c: [f64; 3]| if c[0] > c[2] { "red" } else { "blue" };
    assert_eq!((colour(weave.warp.colour), colour(weave.weft.colour)), ("red", "blue"));
    assert!(builds(&analysis.material("cloth", &MaterialGuesses::default()).unwrap()) > 100);
    let given = Draft::from_fn(4, 4, |i, j| cloth.draft[j][i]);
    let known = analyse(&photo, &WeaveOptions { draft: Some(given.clone()) }).unwrap().weave.unwrap();
    assert_eq!((known.draft, known.confidence), (given, 1.0));
    // A draft that the cloth cannot have.
    let other = analyse(&photo, &WeaveOptions { draft: Some(Draft::shifted(4, 1, 2)) }).unwrap();
    assert_eq!(codes(&other), [FindingCode::AmbiguousWeave]);
}

#[test]
fn bad_input_is_refused() {
    let rgb = vec![[0.5_f32; 3]; 64 * 64];
    let good = RectifiedPhoto { width: 64, height: 64, rgb: &rgb, mask: None, mm_per_pixel: None };
    let nothing = vec![false; 64 * 64];
    assert_eq!(
        codes(&analyse(&RectifiedPhoto { mask: Some(&nothing), ..good }, &WeaveOptions::default()).unwrap()),
        [FindingCode::NoPeriod]
    );
    for bad in [
        RectifiedPhoto { width: 65, ..good },
        RectifiedPhoto { mask: Some(&nothing[1..]), ..good },
        RectifiedPhoto { mm_per_pixel: Some(f64::NAN), ..good },
        RectifiedPhoto { width: 32, height: 128, ..good },
    ] {
        assert!(matches!(analyse(&bad, &WeaveOptions::default()), Err(biscale::Error::BadInput(_))));
    }
    let mut broken = rgb.clone();
    broken[70][1] = f32::NAN;
    let error = analyse(&RectifiedPhoto { rgb: &broken, ..good }, &WeaveOptions::default()).unwrap_err().to_string();
    assert!(error.contains("column 6, row 1"), "{error}");
}

#[test]
fn real_fabrics_have_their_periods_and_classes() {
    let Some(folder) = std::env::var_os("BISCALE_DATA") else {
        eprintln!("skipped: BISCALE_DATA is not set");
        return;
    };
    // Pitches and repeats by hand, from the strongest peaks of a plain Fourier transform of the middle of the picture.
    let by_hand = [("twill1_R", Some(([3.56, 2.47], 4))), ("satin1_R", Some(([3.16, 2.37], 5))), ("twill2_R", None)];
    for (name, expected) in by_hand {
        let path = std::path::Path::new(&folder).join(format!("fabric_photos/{name}.png"));
        let image = image::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_rgb8();
        let rgb: Vec<[f32; 3]> = image.pixels().map(|p| p.0.map(|v| (f32::from(v) / 255.0).powf(2.2))).collect();
        let photo = RectifiedPhoto { width: 512, height: 512, rgb: &rgb, mask: None, mm_per_pixel: None };
        let analysis = analyse(&photo, &WeaveOptions::default()).unwrap();
        // Threads of two to four pixels: the repeat can be told, what is on top cannot.
        let codes = codes(&analysis);
        assert!(codes.contains(&FindingCode::Undersampled), "{name}: {:?}", analysis.findings);
        let weave = analysis.weave.unwrap();
        // The class is that of its name, or it is said that no draft explains the photograph.
        let named = match weave.class {
            Class::Twill { .. } => name.starts_with("twill"),
            Class::Satin { .. } => name.starts_with("satin"),
            _ => false,
        };
        assert!(named || codes.contains(&FindingCode::AmbiguousWeave), "{name}: {}, confidence {}", weave.class, weave.confidence);
        println!("{name}: {}, {:?} x {:?}, {} threads", weave.class, weave.warp.pitch, weave.weft.pitch, weave.draft.columns);
        if let Some((pitch, threads)) = expected {
            let found = [weave.warp.pitch.value, weave.weft.pitch.value];
            assert!((0..2).all(|k| (found[k] / pitch[k] - 1.0_f64).abs() < 0.01), "{name}: {found:?}, by hand {pitch:?}");
            assert_eq!(weave.draft.columns, threads, "{name}");
        }
    }
}

#[test]
fn the_independent_close_up_is_measured() {
    let Some(folder) = std::env::var_os("BISCALE_DATA") else {
        eprintln!("skipped: BISCALE_DATA is not set");
        return;
    };
    for name in ["a_closeup_direct", "a_closeup_full"] {
        use exr::prelude::*;
        let path = std::path::Path::new(&folder).join(format!("../photos/{name}.exr"));
        let image = read_first_rgba_layer_from_file(
            &path,
            |size, _| vec![vec![[0.0_f32; 3]; size.0]; size.1],
            |v: &mut Vec<Vec<[f32; 3]>>, p, (r, g, b, _): (f32, f32, f32, f32)| v[p.1][p.0] = [r, g, b],
        )
        .unwrap();
        let rgb: Vec<[f32; 3]> = image.layer_data.channel_data.pixels.concat();
        // 384 pixels see 2 tan(fov / 2) times the distance.
        let width = 2.0 * (15.822_834_469_466_f64 / 2.0).to_radians().tan() * 22.0_f64.hypot(1.0);
        let photo = RectifiedPhoto { width: 384, height: 384, rgb: &rgb, mask: None, mm_per_pixel: Some(width / 384.0) };
        let weave = analyse(&photo, &WeaveOptions::default()).unwrap().weave.unwrap();
        println!("{name}: width {:?} {:?}, drawn .42 and .34", weave.warp.width, weave.weft.width);
        assert_eq!(weave.class, Class::Plain);
        for axis in [weave.warp, weave.weft] {
            assert!((axis.pitch.value / 0.5 - 1.0).abs() < 0.01, "{name}: {:?}", axis.pitch);
            assert!(axis.turn_deg.value.abs() < 0.5, "{name}: {:?}", axis.turn_deg);
        }
        for (axis, width) in [(weave.warp, 0.42), (weave.weft, 0.34)] {
            assert!((axis.width.value / width - 1.0).abs() < 0.05, "{name}: {:?}, drawn {width}", axis.width);
            assert!((axis.width.value - width).abs() < 2.0 * axis.width.error, "{name}: {:?}, drawn {width}", axis.width);
        }
        assert!(weave.warp.colour[0] > weave.warp.colour[2] && weave.weft.colour[2] > weave.weft.colour[0], "{name}: red warp, blue weft");
    }
}

/// How one random cloth was understood.
struct Outcome {
    class: Class,
    cloth: Cloth,
    found: Analysis,
    seconds: f64,
}

/// The picture of a cloth, kept in the folder that CACHE names, if it does.
fn cached(cloth: &Cloth) -> Picture {
    let Ok(folder) = std::env::var("CACHE") else { return cloth.draw() };
    let path = format!("{folder}/{:x}-{}-{}", cloth.seed, cloth.size[0], cloth.size[1]);
    let [width, height] = cloth.size;
    if let Ok(bytes) = std::fs::read(&path) {
        let values: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        return Picture { width, height, rgb: values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect() };
    }
    let picture = cloth.draw();
    std::fs::write(&path, picture.rgb.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    picture
}

fn try_catalogue(count: usize, seed: u64, only: Option<usize>) -> Vec<Outcome> {
    let mut random = cloth::Random::new(seed);
    let cloths: Vec<(Class, Cloth)> = (0..count).map(|k| catalogue::random_cloth(k, &mut random)).collect();
    cloths
        .into_iter()
        .enumerate()
        .filter(|(k, _)| only.is_none_or(|o| o == *k))
        .map(|(_, (class, cloth))| {
            let picture = cached(&cloth);
            let clock = std::time::Instant::now();
            let found = see(&picture);
            Outcome { class, cloth, found, seconds: clock.elapsed().as_secs_f64() }
        })
        .collect()
}

#[test]
fn random_cloths_of_all_classes_are_named() {
    let outcomes = try_catalogue(catalogue::KINDS, 3, None);
    let wrong: Vec<String> = outcomes
        .iter()
        .filter(|o| o.found.weave.as_ref().map(|w| w.class) != Some(o.class))
        .map(|o| format!("{} taken for {:?}", o.class, o.found.weave.as_ref().map(|w| w.class)))
        .collect();
    assert!(wrong.len() <= 1, "{wrong:?}");
    // What is said of widths is true: of those that holes tell, and of all, nine of ten within two standard errors.
    let (mut told, mut true_to, mut sure, mut sure_true, mut near) = (0, 0, 0, 0, 0);
    for outcome in outcomes {
        let Some(weave) = outcome.found.weave.filter(|w| w.class == outcome.class) else { continue };
        for (axis, pitch) in [(weave.warp, outcome.cloth.pitch[0]), (weave.weft, outcome.cloth.pitch[1])] {
            assert!((axis.pitch.value / pitch - 1.0).abs() < 0.01, "{}: {:?}, drawn with {pitch}", outcome.class, axis.pitch);
            assert!((axis.turn_deg.value - outcome.cloth.turn_deg).abs() < 0.5, "{}: {:?}", outcome.class, axis.turn_deg);
        }
        for (k, axis) in [weave.warp, weave.weft].iter().enumerate() {
            let off = axis.width.value - outcome.cloth.fill[k] * outcome.cloth.pitch[k];
            let within = off.abs() <= 2.0 * axis.width.error;
            (told, true_to) = (told + 1, true_to + usize::from(within));
            if axis.width.error < 0.05 * axis.width.value {
                (sure, sure_true) = (sure + 1, sure_true + usize::from(within));
                near += usize::from(off.abs() < 0.05 * outcome.cloth.fill[k] * outcome.cloth.pitch[k]);
            }
        }
    }
    println!("widths: {true_to} of {told} within two standard errors; of those below 5 %: {sure_true} of {sure}, {near} within 5 %");
    // Where holes tell them, nine of ten are within 5 %.
    assert!(10 * near >= 9 * sure, "{near} of {sure} within 5 %");
    assert!(10 * true_to >= 9 * told && 10 * sure_true >= 9 * sure && 4 * sure >= 3 * told, "{true_to} of {told}, {sure_true} of {sure}");
}

#[test]
#[ignore = "a table for a person"]
fn table_of_random_cloths() {
    let seed = std::env::var("SEED").map_or(1, |s| s.parse().unwrap());
    let count = std::env::var("COUNT").map_or(40, |s| s.parse().unwrap());
    let mut wrong = 0;
    let mut widths: Vec<f64> = Vec::new();
    // Off by, and the standard error that is stated, of the width.
    let mut stated: Vec<(f64, f64)> = Vec::new();
    let only: Option<usize> = std::env::var("ONLY").ok().map(|s| s.parse().unwrap());
    for (k, outcome) in try_catalogue(count, seed, only).into_iter().enumerate() {
        let k = only.unwrap_or(k);
        let Outcome { class, cloth, found, seconds } = outcome;
        if let Ok(folder) = std::env::var("PICTURES") {
            println!("{cloth:?}");
            save(&cached(&cloth), &format!("{folder}/{k}.png"));
        }
        let Some(weave) = found.weave else {
            println!("{k} {class}: nothing {:?} {:.1?}", found.findings.iter().map(|f| f.code).collect::<Vec<_>>(), cloth.pitch);
            wrong += 1;
            continue;
        };
        let right = weave.class == class;
        wrong += usize::from(!right);
        let off = |a: f64, b: f64| 100.0 * (a / b - 1.0);
        let fill =
            [off(weave.warp.width.value, cloth.fill[0] * cloth.pitch[0]), off(weave.weft.width.value, cloth.fill[1] * cloth.pitch[1])];
        if right {
            widths.extend(fill.map(f64::abs));
            for (axis, fill) in [weave.warp, weave.weft].iter().zip(fill) {
                stated.push((fill.abs(), 100.0 * axis.width.error / axis.width.value));
            }
        }
        println!(
            "{k} {}{class} -> {} conf {:.2} unexplained {:.3} pitch {:.1?} off {:.2} {:.2} % turn off {:.2} {:.2} tensor {:.2} width {:.2?} off {:.1} {:.1} % dE {:.0} {:.2} s {:?}",
            if right { "" } else { "WRONG " },
            weave.class,
            weave.confidence,
            weave.unexplained,
            cloth.pitch,
            off(weave.warp.pitch.value, cloth.pitch[0]),
            off(weave.weft.pitch.value, cloth.pitch[1]),
            weave.warp.turn_deg.value - cloth.turn_deg,
            weave.weft.turn_deg.value - cloth.turn_deg,
            found.edge_turn_deg.unwrap() - cloth.turn_deg,
            cloth.fill,
            fill[0],
            fill[1],
            weave.colour_difference,
            seconds,
            found.findings.iter().map(|f| f.code).collect::<Vec<_>>()
        );
    }
    let quantiles = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values.get((values.len() as f64 * share) as usize).copied().unwrap_or(f64::NAN);
        format!("{} widths: median {:.1} %, 90 % {:.1} %", values.len(), at(0.5), at(0.9))
    };
    println!("{wrong} of {count} wrong; {}", quantiles(widths));
    let few = |w: usize| 100 * w <= 3 * count;
    println!("with a stated error below 5 %: {}", quantiles(stated.iter().filter(|s| s.1 < 5.0).map(|s| s.0).collect()));
    println!("with a larger one: {}", quantiles(stated.iter().filter(|s| s.1 >= 5.0).map(|s| s.0).collect()));
    let true_to = stated.iter().filter(|s| s.0 <= 2.0 * s.1).count();
    println!("{:.1} % of the widths lie within two stated standard errors", 100.0 * true_to as f64 / stated.len().max(1) as f64);
    assert!(count < 140 || few(wrong), "more than 3 % of the classes are wrong");
}
