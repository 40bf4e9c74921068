//! The photographs of a phone around a cylinder with a sheet, as JPEG with Exif, and the folders that come of them.

use super::*;
use biscale_capture::kit::PrintedBoard;
use biscale_capture::sheet::Sheet;
use std::sync::OnceLock;

/// Radius of the cylinder with its sheet, mm.
pub const OUTER: f64 = 30.1;
/// Distance of the cloth's threads, mm.
pub const PITCH: f64 = 1.1;
const HEIGHT: f64 = 60.0;
const TWILL: [&[bool]; 3] = [&[true, false, false], &[false, true, false], &[false, false, true]];

/// What a phone writes into a file.
#[derive(Clone, Debug)]
pub struct Exif {
    pub orientation: u16,
    pub seconds: (u32, u32),
    pub focal_mm: (u32, u32),
    pub focal_35: u16,
    /// Minutes after ten.
    pub minute: u32,
}

impl Exif {
    fn of(minute: u32) -> Self {
        Self { orientation: 1, seconds: (1, 50), focal_mm: (686, 100), focal_35: 26, minute }
    }

    /// As the segment APP1 of a JPEG.
    fn segment(&self) -> Vec<u8> {
        let mut data: Vec<u8> = Vec::new();
        let directory = |entries: &[(u16, u16, Vec<u8>)], start: usize| -> Vec<u8> {
            let mut head = u16::try_from(entries.len()).unwrap().to_le_bytes().to_vec();
            let mut tail: Vec<u8> = Vec::new();
            let after = start + 2 + 12 * entries.len() + 4;
            for (tag, kind, value) in entries {
                let unit = match kind {
                    3 => 2,
                    4 => 4,
                    5 => 8,
                    _ => 1,
                };
                head.extend([tag.to_le_bytes(), kind.to_le_bytes()].concat());
                head.extend(((value.len() / unit) as u32).to_le_bytes());
                if value.len() <= 4 {
                    head.extend(value.iter().copied().chain(std::iter::repeat(0)).take(4));
                } else {
                    head.extend(((after + tail.len()) as u32).to_le_bytes());
                    tail.extend(value);
                }
            }
            head.extend([0; 4]);
            head.extend(tail);
            head
        };
        let rational = |(a, b): (u32, u32)| [a.to_le_bytes(), b.to_le_bytes()].concat();
        let exif = |start| {
            let taken = format!("2026:05:01 10:{:02}:00\0", self.minute);
            directory(
                &[
                    (0x829a, 5, rational(self.seconds)),
                    (0x829d, 5, rational((178, 100))),
                    (0x8827, 3, 100_u16.to_le_bytes().to_vec()),
                    (0x9003, 2, taken.into_bytes()),
                    (0x920a, 5, rational(self.focal_mm)),
                    (0xa405, 3, self.focal_35.to_le_bytes().to_vec()),
                ],
                start,
            )
        };
        let first = |pointer: u32| {
            directory(
                &[
                    (0x0110, 2, b"Phone 7\0".to_vec()),
                    (0x0112, 3, self.orientation.to_le_bytes().to_vec()),
                    (0x8769, 4, pointer.to_le_bytes().to_vec()),
                ],
                8,
            )
        };
        let start = 8 + first(0).len();
        data.extend(b"II*\0\x08\0\0\0");
        data.extend(first(start as u32));
        data.extend(exif(start));
        let mut out = b"\xff\xe1".to_vec();
        out.extend(u16::try_from(data.len() + 8).unwrap().to_be_bytes());
        out.extend(b"Exif\0\0");
        out.extend(data);
        out
    }
}

/// A photograph of a folder.
#[derive(Clone, Debug)]
pub struct Photo {
    pub name: String,
    pub picture: image::RgbImage,
    pub exif: Option<Exif>,
}

impl Photo {
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, 94).encode_image(&self.picture).unwrap();
        if let Some(exif) = &self.exif {
            out.splice(2..2, exif.segment());
        }
        out
    }
}

/// All of a shoot, in the order that it was taken.
#[derive(Clone, Debug)]
pub struct PhoneShoot {
    pub boards: Vec<Photo>,
    /// Of a second lens, twice as long.
    pub tele_boards: Vec<Photo>,
    pub flats: Vec<Photo>,
    pub ball: Photo,
    pub close_up: Photo,
    pub tele_close_up: Photo,
    pub distant: Photo,
    /// The same view in a quarter of the time.
    pub short: Photo,
    pub validation: Photo,
    pub other_ball: Photo,
    /// Trees, clouds and a house.
    pub holiday: Photo,
    /// Of the camera, of the lamp of `distant` and of `validation`.
    pub studio: Studio,
    pub pose: Pose,
    pub lights: [DVec3; 2],
    /// The sidecar of board and sheet.
    pub sidecar: String,
}

fn encoded(picture: &PlanarImage) -> image::RgbImage {
    let byte = |v: f32| (255.0 * biscale::numerics::colour::linear_to_srgb(v.into())).round() as u8;
    let pixels: Vec<u8> = (0..picture.planes[0].len()).flat_map(|i| [0, 1, 2].map(|c| byte(picture.planes[c][i]))).collect();
    image::RgbImage::from_raw(picture.width as u32, picture.height as u32, pixels).unwrap()
}

/// The sheet, and its sidecar with the standard board.
fn sheet() -> (Sheet, String) {
    use biscale_fabricate::{paper::Paper, wrap};
    let object = wrap::Target::parse(&format!("cylinder:radius={},height={HEIGHT}", OUTER - 0.1)).unwrap();
    let fit = object.fit(DVec2::splat(1e4), 0.1);
    let paper = Paper { name: "a3", size: DVec2::new(420.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };
    let made = wrap::wrap(object, fit, 0.1, &[], paper, "kit").unwrap();
    let sidecar = serde_json::json!({
        "recipe": { "thickness": 0.1 },
        "board": PrintedBoard::standard(),
        "wrap": {
            "target": object, "fit": fit, "dictionary": "DICT_5X5_100", "origin_mm": made.parts[0].origin_mm, "turned": made.turned,
            "joined_size_mm": made.size.to_array(), "pages": made.parts, "markers": made.markers, "patches": made.patches,
        },
    })
    .to_string();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kit.json");
    std::fs::write(&file, &sidecar).unwrap();
    (Sheet::read(&file).unwrap(), sidecar)
}

/// The shoot; made once.
pub fn shoot() -> &'static PhoneShoot {
    static SHOOT: OnceLock<PhoneShoot> = OnceLock::new();
    SHOOT.get_or_init(made)
}

fn made() -> PhoneShoot {
    let studio = Studio { electrons: [8000.0, 4.0], ..Studio::new(720, 540) };
    let mut tele = studio.clone();
    tele.lens.focal *= 2.0;
    let board = PrintedBoard::standard().layout().unwrap();
    let print = Print::new(&board, &flat_shoot::bits);
    let page = DVec2::new(240.0, 300.0);
    let lights = [DVec3::new(0.6, 0.75, 0.35).normalize(), DVec3::new(-0.5, 0.8, 0.45).normalize()];
    let printed = |p: DVec2| print.at(p - 0.5 * (page - board.size));
    let mut minute = 0;
    let mut photo = |name: &str, picture: &PlanarImage| {
        minute += 1;
        Photo { name: name.into(), picture: encoded(picture), exif: Some(Exif::of(minute)) }
    };
    let of_board = |studio: &Studio, pose: &Pose| {
        studio.photograph(&Scene::new(Shape::Plane(page), DVec3::new(0.2, -0.1, 0.9), Box::new(printed)), pose, 0.9)
    };
    let boards =
        around(11, 380.0, 45.0).iter().enumerate().map(|(k, p)| photo(&format!("IMG_{:04}.JPG", k + 1), &of_board(&studio, p))).collect();
    let wide = Shape::Plane(DVec2::splat(4000.0));
    let above = Pose::looking_at(DVec3::new(0.0, 0.0, 300.0), DVec3::ZERO, DVec3::Y);
    let flats = (0..2)
        .map(|k| {
            let studio = Studio { seed: 77 + k, ..studio.clone() };
            photo(&format!("IMG_{:04}.JPG", 12 + k), &studio.photograph(&Scene::new(wide, DVec3::Z, Box::new(|_| [0.5; 3])), &above, 1.0))
        })
        .collect();
    let (sheet, sidecar) = sheet();
    let on_sheet = Print::new(&Board::of_sheet(&sheet), &flat_shoot::bits);
    let shape = Shape::Cylinder { radius: OUTER, height: 110.0, arc_deg: [0.0, 360.0] };
    // Places of the cylinder count from its lower rim; those of the sheet from the lower left corner of the wrapped area.
    let paint = |p: DVec2| {
        let q = p - DVec2::new(0.0, 0.5 * (110.0 - sheet.extent.y));
        if q.y > 0.0 && q.y < sheet.extent.y && q.x < sheet.extent.x {
            return cloth(q, &TWILL, DVec2::splat(PITCH), DVec2::splat(0.9 * PITCH), [0.5, 0.07, 0.06], [0.06, 0.12, 0.42]);
        }
        let page = if sheet.turned { DVec2::new(sheet.placed.x - q.y, q.x) } else { q };
        on_sheet.at(page + sheet.origin)
    };
    let scene = |light: usize| Scene::new(shape, lights[light], Box::new(paint));
    let pose = Pose::looking_at(DVec3::new(65.0, 190.0, 30.0), DVec3::ZERO, DVec3::Z);
    let with_ball = |light: usize| Scene { ball: Some((DVec3::new(47.0, -16.0, 0.0), 14.0)), ..scene(light) };
    let near = |away: f64| {
        let out = DVec3::new(0.33, 0.944, 0.0);
        Pose::looking_at((OUTER + away) * out + DVec3::new(0.0, 0.0, 30.0), OUTER * out + DVec3::new(0.0, 0.0, 30.0), DVec3::Z)
    };
    let ball = photo("IMG_0014.JPG", &studio.photograph(&with_ball(0), &pose, 0.9));
    let close_up = photo("IMG_0015.JPG", &studio.photograph(&scene(0), &near(72.0), 0.9));
    let distant = photo("IMG_0016.JPG", &studio.photograph(&scene(0), &pose, 0.9));
    let mut short = photo("IMG_0017.JPG", &studio.photograph(&scene(0), &pose, 0.225));
    short.exif = Some(Exif { seconds: (1, 200), ..Exif::of(minute_of(&short)) });
    let validation = photo("IMG_0018.JPG", &studio.photograph(&scene(1), &pose, 0.9));
    let other_ball = photo("IMG_0019.JPG", &studio.photograph(&with_ball(1), &pose, 0.9));
    let long = |photo: &mut Photo| {
        let exif = photo.exif.as_mut().unwrap();
        (exif.focal_mm, exif.focal_35) = ((900, 100), 52);
    };
    let mut tele_boards: Vec<Photo> =
        around(5, 700.0, 40.0).iter().enumerate().map(|(k, p)| photo(&format!("IMG_{:04}.JPG", 30 + k), &of_board(&tele, p))).collect();
    tele_boards.iter_mut().for_each(long);
    let mut tele_close_up = photo("IMG_0040.JPG", &tele.photograph(&scene(0), &near(144.0), 0.9));
    long(&mut tele_close_up);
    let holiday = Photo { name: "IMG_0050.JPG".into(), picture: holiday(), exif: Some(Exif::of(55)) };
    PhoneShoot {
        boards,
        tele_boards,
        flats,
        ball,
        close_up,
        tele_close_up,
        distant,
        short,
        validation,
        other_ball,
        holiday,
        studio,
        pose,
        lights,
        sidecar,
    }
}

fn minute_of(photo: &Photo) -> u32 {
    photo.exif.as_ref().map_or(0, |e| e.minute)
}

/// A sky with clouds, hills, trees and a house.
fn holiday() -> image::RgbImage {
    image::RgbImage::from_fn(720, 540, |x, y| {
        let (u, v) = (f64::from(x), f64::from(y));
        let noise = |s: f64, k: u64| normal(((u / s) as u64) << 24 | ((v / s) as u64) << 4 | k);
        let hill = 300.0 + 60.0 * (u / 130.0).sin() + 20.0 * (u / 37.0).sin();
        let c = if v > hill {
            let leaf = 0.5 + 0.12 * noise(3.0, 1) + 0.1 * noise(11.0, 2);
            [60.0 * leaf, 130.0 * leaf, 40.0 * leaf]
        } else {
            let cloud = ((u / 90.0).sin() * (v / 60.0 + u / 200.0).cos()).max(0.0);
            [110.0 + 120.0 * cloud, 160.0 + 80.0 * cloud, 230.0]
        };
        let house = (400.0..560.0).contains(&u) && (260.0..430.0).contains(&v);
        let c = if house { [190.0, 120.0 + 0.1 * v, 90.0] } else { c };
        image::Rgb(c.map(|c| (c + 4.0 * noise(1.0, 3)).clamp(0.0, 255.0) as u8))
    })
}

impl PhoneShoot {
    /// Everything that a capture wants but a checker.
    pub fn usual(&self) -> Vec<Photo> {
        let mut out = self.boards.clone();
        out.extend(self.flats.iter().cloned());
        out.extend([&self.ball, &self.close_up, &self.distant, &self.validation, &self.other_ball].map(Clone::clone));
        out
    }

    /// Writes photographs and the sidecar into a new folder.
    pub fn folder(&self, photos: &[Photo]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for photo in photos {
            std::fs::write(folder.path().join(&photo.name), photo.bytes()).unwrap();
        }
        std::fs::write(folder.path().join("kit.json"), &self.sidecar).unwrap();
        folder
    }
}
