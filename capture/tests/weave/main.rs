//! Weave analysis on drawn cloths, whose truth is known.
#![allow(clippy::unwrap_used, reason = "a failed test says where")]
mod catalogue;
mod cloth;

use biscale_capture::weave::{Analysis, Class, Direction, Options, Photo, analyse};
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
    let photo = Photo { width: picture.width, height: picture.height, rgb: &picture.rgb, mask: None, mm_per_pixel: None };
    analyse(&photo, &Options::default()).unwrap()
}

const ONE_COLOUR: [[f64; 3]; 3] = [[0.5, 0.45, 0.4], [0.5, 0.45, 0.4], [0.02, 0.02, 0.02]];

#[test]
fn plain_cloth_and_twills_are_named_and_measured() {
    let z = |over, under| Class::Twill { over, under, direction: Direction::Z };
    let s = |over, under| Class::Twill { over, under, direction: Direction::S };
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

fn save(picture: &Picture, path: &str) {
    let top = picture.rgb.iter().flatten().fold(0.0_f32, |a, &b| a.max(b)) * 0.7;
    let bytes: Vec<u8> = picture.rgb.iter().flat_map(|p| p.map(|v| ((v / top).clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8)).collect();
    image::save_buffer(path, &bytes, picture.width as u32, picture.height as u32, image::ColorType::Rgb8).unwrap();
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
    let mut random = cloth::Random(seed);
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
#[ignore = "a table for a person"]
fn table_of_random_cloths() {
    let seed = std::env::var("SEED").map_or(1, |s| s.parse().unwrap());
    let count = std::env::var("COUNT").map_or(40, |s| s.parse().unwrap());
    let mut wrong = 0;
    let mut widths: Vec<f64> = Vec::new();
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
            found.turn_deg.unwrap() - cloth.turn_deg,
            cloth.fill,
            fill[0],
            fill[1],
            weave.colour_difference,
            seconds,
            found.findings.iter().map(|f| f.code).collect::<Vec<_>>()
        );
    }
    widths.sort_by(f64::total_cmp);
    if !widths.is_empty() {
        println!("{wrong} of {count} wrong; widths: median {:.1} %, 90 % {:.1} %", widths[widths.len() / 2], widths[widths.len() * 9 / 10]);
    }
}
