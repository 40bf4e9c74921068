//! A whole shoot of a flat cloth that lies on a `ChArUco` board: every role is there, and its truth is known.

use super::*;
use biscale_capture::dictionary::Dictionary;

/// The truth of a shoot.
pub struct FlatShoot {
    pub studio: Studio,
    /// Of all photographs but the validation.
    pub light: DVec3,
    /// Of the validation.
    pub other: DVec3,
    /// Of the close-up and of the distant photograph.
    pub poses: [(&'static str, Pose); 2],
    /// Mean reflectance of the cloth.
    pub mean: [f64; 3],
    /// Distances of the threads, mm: of warp threads across, of weft threads along.
    pub pitch: DVec2,
}

const PAGE: DVec2 = DVec2::new(360.0, 300.0);
const CLOTH: DVec2 = DVec2::new(40.0, 30.0);
const PITCH: DVec2 = DVec2::new(1.5, 1.35);
const TWILL: [&[bool]; 3] = [&[true, false, false], &[false, true, false], &[false, false, true]];

/// Middle of the mirror ball, which lies on the page.
const BALL: DVec3 = DVec3::new(147.0, 30.0, 20.0);

/// The camera of the lights' photographs.
fn far() -> Pose {
    Pose::looking_at(DVec3::new(20.0, -120.0, 450.0), DVec3::new(10.0, 0.0, 0.0), DVec3::Y)
}

/// The board of the shoot.
pub fn board() -> Board {
    Board::charuco(8, 6, 30.0, 22.0, &Dictionary::Predefined("DICT_5X5_100"), true)
}

/// Bits of `DICT_5X5_100`, as our own sheets have them.
pub fn bits(id: i32) -> Vec<bool> {
    use biscale_fabricate::wrap::aruco::is_white;
    (0..25).map(|k| is_white(id as usize, 1 + k / 5, 1 + k % 5)).collect()
}

fn twill(p: DVec2) -> [f64; 3] {
    cloth(p, &TWILL, PITCH, DVec2::new(1.3, 1.1), [0.45, 0.06, 0.05], [0.05, 0.12, 0.4])
}

impl FlatShoot {
    /// Writes photographs of this width (2/3 as high) and `shoot.toml` into a folder.
    pub fn write(folder: &Path, width: usize) -> Self {
        let at = |name: &str| folder.join(name);
        let studio = Studio::new(width, width * 2 / 3);
        let board = board();
        let print = Print::new(&board, &bits);
        let (light, other) = (DVec3::new(0.45, -0.25, 0.86).normalize(), DVec3::new(-0.5, 0.3, 0.8).normalize());
        let page = Shape::Plane(PAGE);
        // The board lies in the middle of a larger white page, whose middle is that of the sample.
        let corner = 0.5 * (PAGE - board.size);
        let printed = |p: DVec2| print.at(p - corner);
        for (k, pose) in around(13, 330.0, 45.0).into_iter().enumerate() {
            save8(&studio.photograph(&Scene::new(page, light, Box::new(printed)), &pose, 1.0), &at(&format!("board-{k}.png")));
        }
        let wide = Shape::Plane(DVec2::new(4000.0, 4000.0));
        let above = Pose::looking_at(DVec3::new(0.0, 0.0, 300.0), DVec3::ZERO, DVec3::Y);
        for (k, name) in ["flat-1.png", "flat-2.png"].iter().enumerate() {
            let studio = Studio { seed: 77 + k as u64, ..studio.clone() };
            save16(&studio.photograph(&Scene::new(wide, DVec3::Z, Box::new(|_| [0.7; 3])), &above, 1.0), &at(name));
        }
        let with_checker = |p: DVec2| checker(p - DVec2::new(90.0, 90.0), 26.0).unwrap_or(WHITE);
        let low = Pose::looking_at(DVec3::new(20.0, -90.0, 320.0), DVec3::new(10.0, 0.0, 0.0), DVec3::Y);
        save16(&studio.photograph(&Scene::new(page, light, Box::new(with_checker)), &low, 1.0), &at("checker.png"));
        let sample = |p: DVec2| {
            let q = p - 0.5 * (PAGE - CLOTH);
            if q.min(CLOTH - q).min_element() >= 0.0 { twill(q) } else { printed(p) }
        };
        let scene = || Scene::new(page, light, Box::new(sample));
        let poses = [
            ("close-up", Pose::looking_at(DVec3::new(3.0, -12.0, 140.0), DVec3::ZERO, DVec3::Y)),
            ("distant", Pose::looking_at(DVec3::new(-40.0, -150.0, 330.0), DVec3::ZERO, DVec3::Y)),
        ];
        for (name, pose) in &poses {
            save16(&studio.photograph(&scene(), pose, 0.9), &at(&format!("{name}.png")));
        }
        save16(&studio.photograph(&Scene { light: other, ..scene() }, &poses[1].1, 1.0), &at("validation.png"));
        let far = far();
        let ball = Some((BALL, BALL.z));
        save16(&studio.photograph(&Scene { ball, ..scene() }, &far, 1.0), &at("ball.png"));
        let paper = |p: DVec2| if p.distance(DVec2::new(70.0, 250.0)) < 60.0 { WHITE } else { printed(p) };
        let stick = Scene { stick: Some((DVec2::new(-110.0, 100.0), 25.0, 0.6)), ..Scene::new(page, light, Box::new(paper)) };
        save16(&studio.photograph(&stick, &far, 1.0), &at("stick.png"));
        std::fs::write(at("shoot.toml"), text()).unwrap();
        let grid = 300;
        let mut mean = [0.0; 3];
        for k in 0..grid * grid {
            let value = twill(DVec2::new((k % grid) as f64 + 0.5, (k / grid) as f64 + 0.5) * 3.0 * PITCH / grid as f64);
            for (m, v) in mean.iter_mut().zip(value) {
                *m += v / (grid * grid) as f64;
            }
        }
        Self { studio, light, other, poses, mean, pitch: PITCH }
    }
}

/// The shoot file.
pub fn text() -> String {
    let boards: Vec<String> = (0..13).map(|k| format!("\"board-{k}.png\"")).collect();
    format!(
        r#"# A twill on a board, made up: every role of a photograph is there
format = 1
name = "twill on a board"

[board]
kind = "charuco"
columns = 8
rows = 6
square_mm = 30
marker_mm = 22

[sample]
shape = "plane"
width_mm = {}
height_mm = {}
board_mm = [120, 90]

[[light]]
name = "other"
direction = [-0.5, 0.3, 0.8]
sigma_deg = 0.5

[[photo]]
role = "board"
files = [{}]

[[photo]]
role = "flat"
files = ["flat-1.png", "flat-2.png"]
seconds = [1, 1]

[[photo]]
role = "checker"
file = "checker.png"
seconds = 1

[[photo]]
role = "light"
file = "ball.png"
seconds = 1

[[photo]]
role = "light"
file = "stick.png"
seconds = 1
stick_mm = [-110, 100]
stick_height_mm = 25
stick_radius_mm = 0.6

[[photo]]
role = "close-up"
file = "close-up.png"
seconds = 0.9

[[photo]]
role = "distant"
file = "distant.png"
seconds = 0.9

[[photo]]
role = "validation"
file = "validation.png"
seconds = 1
light = "other"
"#,
        CLOTH.x,
        CLOTH.y,
        boards.join(", ")
    )
}
