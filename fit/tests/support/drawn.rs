//! Surfaces and faults drawn at random, of the sizes that people make.

use super::Faults;
use super::faulty::swapped;
use super::scene::{Draw, Scene, drawn_grooves, drawn_rods, drawn_weave};
use biscale::numerics::random::Random;
use std::fmt::Write as _;

/// A surface that is photographed with a fault.
pub struct Drawn {
    /// Kind of the surface.
    pub surface: &'static str,
    /// The surface, and what its camera does.
    pub scene: Scene,
    /// Kind of the fault.
    pub fault: &'static str,
    /// Its size, for people.
    pub size: String,
    /// Whether it multiplies all light, which no photograph tells.
    pub scales_all: bool,
    /// Words of which a cause must have one to name this fault; none where a fit names none.
    pub cause: &'static [&'static str],
    /// What the fit file says otherwise than it is.
    tables: Tables,
}

/// A fault of the fit file.
#[derive(Clone, Copy)]
enum Tables {
    Right,
    Swapped,
    Bounces(u32),
}

/// Faults, in turns; none, and the light of the close-up, twice as often.
const KINDS: [&str; 29] = [
    "none",
    "none",
    "light of the close-up",
    "light of the close-up",
    "light of the distant photograph and the held-out one",
    "all lights, by the same",
    "stray light in the close-up",
    "stray light in the distant photographs",
    "stray light in all",
    "irradiance of the close-up",
    "irradiance of the distant photographs",
    "irradiance of the held-out photograph",
    "irradiance of all",
    "vignetting",
    "falloff",
    "a lamp nearby, as the fit file says",
    "a lamp nearby",
    "field of view",
    "distortion",
    "blur",
    "noise",
    "gamma",
    "encoded",
    "8 bits, JPEG",
    "sensor full",
    "close-up turned or mirrored",
    "photographs swapped",
    "reflections",
    "structure",
];

/// The `k`-th of a seed; with its own fault, or with one of another kind.
pub fn drawn(k: u64, seed: u64, other: Option<&str>) -> Drawn {
    let (surface, scene) = match k % 5 {
        0 => ("weave", drawn_weave(k, seed)),
        1 => ("twill", twill(drawn_weave(k, seed))),
        2 | 3 => ("grooves", drawn_grooves(k, seed)),
        _ => ("rods", drawn_rods(k, seed)),
    };
    // Every kind of fault meets every kind of surface: 5 and 29 have no common divisor.
    let own = KINDS[(k % 29) as usize];
    let fault = other.map_or(own, |other| KINDS.into_iter().find(|kind| *kind == other).unwrap());
    let draw = Draw(Random::new(1_000_003 * seed + 7 * k + 1));
    let tables = Tables::Right;
    let mut drawn = Drawn { surface, scene, fault, size: String::new(), scales_all: false, cause: &[], tables };
    drawn.strike(draw);
    drawn
}

/// The same threads as a twill, and a fit that knows it.
fn twill(scene: Scene) -> Scene {
    let of = |text: &str| text.replace("kind = \"weave\"\n", "kind = \"weave\"\nweave = \"twill\"\n");
    Scene { name: format!("{}, twill", scene.name), truth: of(&scene.truth), start: of(&scene.start), ..scene }
}

impl Drawn {
    /// The tables of the fit file, with its fault.
    pub fn tables(&self, tables: String) -> String {
        match self.tables {
            Tables::Right => tables,
            Tables::Swapped => swapped(tables),
            Tables::Bounces(said) => tables.replace(&format!("bounces = {}", self.scene.bounces), &format!("bounces = {said}")),
        }
    }

    /// Makes the fault, of any size that people make.
    fn strike(&mut self, mut draw: Draw) {
        let plain = self.scene.faults;
        let mut size = String::new();
        let mut number = |draw: &mut Draw, low: f64, high: f64| {
            let value = draw.within(low, high);
            let _ = write!(size, "{}{value:.3}", if size.is_empty() { "" } else { " " });
            value
        };
        let mut turn = |draw: &mut Draw| [number(draw, -10.0, 10.0), number(draw, -10.0, 10.0)];
        let added = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        let mut f: Faults = plain;
        match self.fault {
            "none" => (),
            "light of the close-up" => {
                f.near_light_off_deg = added(f.near_light_off_deg, turn(&mut draw));
                self.cause = &["light of the close-up", "light of a.exr"];
            }
            "light of the distant photograph and the held-out one" => {
                let off = turn(&mut draw);
                f.light_off_deg = added(f.light_off_deg, off);
                f.near_light_off_deg = added(f.near_light_off_deg, off.map(|v| -v));
                self.cause = &["the light of"];
            }
            "all lights, by the same" => {
                f.light_off_deg = added(f.light_off_deg, turn(&mut draw));
                self.cause = &["the light of"];
            }
            "stray light in the close-up" => f.near_veil = number(&mut draw, 0.0, 0.03),
            "stray light in the distant photographs" => f.veil = number(&mut draw, 0.0, 0.03),
            "stray light in all" => {
                f.veil = number(&mut draw, 0.0, 0.03);
                f.near_veil = f.veil;
            }
            "irradiance of the close-up" => f.gain = [1.0, 1.0, number(&mut draw, 0.75, 1.25)],
            "irradiance of the distant photographs" => {
                let gain = number(&mut draw, 0.75, 1.25);
                f.gain = [gain, gain, 1.0];
            }
            "irradiance of the held-out photograph" => {
                f.gain = [1.0, number(&mut draw, 0.75, 1.25), 1.0];
                self.cause = &["irradiance of c.exr", "c.exr"];
            }
            "irradiance of all" => {
                f.gain = [number(&mut draw, 0.75, 1.25); 3];
                self.scales_all = true;
            }
            "vignetting" => f.vignetting = number(&mut draw, 0.0, 0.3),
            "falloff" => f.falloff = number(&mut draw, 0.0, 0.2),
            "a lamp nearby, as the fit file says" => f.lamp = (number(&mut draw, 2.0, 10.0), true),
            "a lamp nearby" => f.lamp = (number(&mut draw, 4.0, 20.0), false),
            "field of view" => {
                f.field_of_view = number(&mut draw, 0.9, 1.1);
                self.cause = &["angle than the file says"];
            }
            "distortion" => f.distortion = number(&mut draw, -0.03, 0.03),
            "blur" => f.blur = number(&mut draw, 1.2, 3.0),
            "noise" => {
                let factor = number(&mut draw, 3.0, 30.0);
                f.noise = f.noise.map(|n| factor * n);
            }
            "gamma" => {
                f.gamma = number(&mut draw, 0.85, 1.15);
                self.cause = &["linear"];
            }
            "encoded" => {
                f.gamma = 0.45;
                self.cause = &["encoded"];
            }
            "8 bits, JPEG" => (f.bits, f.jpeg) = (Some(8), true),
            "sensor full" => {
                f.full_at = number(&mut draw, 0.5, 0.95);
                self.cause = &["full", "overexposed"];
            }
            "close-up turned or mirrored" => {
                let quarters = (3.0 * draw.0.unit()) as u32 + 1;
                f.near_turned = if draw.0.unit() < 0.3 { (0, true) } else { (quarters, false) };
                size = format!("{:?}", f.near_turned);
                self.cause = &["turned", "mirrored", "upside down"];
            }
            "photographs swapped" => (self.tables, self.cause) = (Tables::Swapped, &["swap"]),
            "reflections" => {
                let said = if self.scene.bounces == 0 { 4 } else { 0 };
                size = format!("{said} said, {} there", self.scene.bounces);
                (self.tables, self.cause) = (Tables::Bounces(said), &["bounces"]);
            }
            "structure" => self.strike_structure(&mut draw, &mut size),
            other => unreachable!("{other}"),
        }
        (self.scene.faults, self.size) = (f, size);
    }

    /// Photographs show another structure than the fit begins with.
    fn strike_structure(&mut self, draw: &mut Draw, size: &mut String) {
        let scene = &mut self.scene;
        let weave = "kind = \"weave\"\n";
        match self.surface {
            "weave" => {
                scene.truth = scene.truth.replace(weave, "kind = \"weave\"\nweave = \"satin\"\n");
                *size = "a satin, fitted as a plain weave".to_owned();
            }
            "twill" => {
                scene.start = scene.start.replace("weave = \"twill\"\n", "");
                *size = "a twill, fitted as a plain weave".to_owned();
            }
            "rods" => {
                scene.truth = scene.truth.replace("randomness", "seed = 5\nrandomness");
                *size = "rods that stand elsewhere".to_owned();
            }
            _ => {
                scene.truth = drawn_weave((1000.0 * draw.0.unit()) as u64, 1).truth;
                *size = "a cloth, fitted as grooves".to_owned();
            }
        }
        self.cause = &["structure"];
    }
}
