//! Faults of photographs and of fit files, of a size that people make.

use super::Faults;
use super::scene::Scene;

/// What went wrong.
#[derive(Clone, Copy)]
pub struct Fault {
    pub name: &'static str,
    /// Of the photographs.
    photographs: fn(Faults) -> Faults,
    /// Of the scene beside them.
    scene: fn(&mut Scene),
    /// Of the fit file.
    tables: fn(String) -> String,
    /// Whether it multiplies all light, which no photograph tells.
    pub scales_all: bool,
}

impl Fault {
    /// A scene that is photographed with this fault.
    pub fn scene(&self, scene: &Scene) -> Scene {
        let mut faulty = Scene { faults: (self.photographs)(scene.faults), ..scene.clone() };
        (self.scene)(&mut faulty);
        faulty
    }

    /// The tables of the fit file, with its fault.
    pub fn tables(&self, tables: String) -> String {
        (self.tables)(tables)
    }
}

/// One that does nothing.
const NONE: Fault = Fault { name: "none", photographs: |f| f, scene: |_| (), tables: |t| t, scales_all: false };

const fn of_photographs(name: &'static str, photographs: fn(Faults) -> Faults) -> Fault {
    Fault { name, photographs, ..NONE }
}

/// The held-out photograph and the distant one change their files.
pub fn swapped(tables: String) -> String {
    tables.replace("\"b.exr\"", "\"-\"").replace("\"c.exr\"", "\"b.exr\"").replace("\"-\"", "\"c.exr\"")
}

/// All of them.
pub const FAULTS: &[Fault] = &[
    NONE,
    of_photographs("near light 4 up", |f| Faults { near_light_off_deg: [0.0, 4.0], ..f }),
    of_photographs("near light 10 up", |f| Faults { near_light_off_deg: [0.0, 10.0], ..f }),
    of_photographs("near light 10 down", |f| Faults { near_light_off_deg: [0.0, -10.0], ..f }),
    of_photographs("near light 10 aside", |f| Faults { near_light_off_deg: [10.0, 0.0], ..f }),
    of_photographs("light 3 up", |f| Faults { light_off_deg: [0.0, 3.0], ..f }),
    of_photographs("light 6 aside", |f| Faults { light_off_deg: [6.0, 0.0], ..f }),
    of_photographs("near veil .005", |f| Faults { near_veil: 0.005, ..f }),
    of_photographs("near veil .02", |f| Faults { near_veil: 0.02, ..f }),
    of_photographs("veil .03 all", |f| Faults { near_veil: 0.03, veil: 0.03, ..f }),
    of_photographs("near gain 1.25", |f| Faults { gain: [1.0, 1.0, 1.25], ..f }),
    of_photographs("near gain .9", |f| Faults { gain: [1.0, 1.0, 0.9], ..f }),
    of_photographs("distant gain .8", |f| Faults { gain: [0.8, 0.8, 1.0], ..f }),
    of_photographs("held-out gain 1.1", |f| Faults { gain: [1.0, 1.1, 1.0], ..f }),
    Fault { scales_all: true, ..of_photographs("all gain 1.25", |f| Faults { gain: [1.25; 3], ..f }) },
    Fault { scales_all: true, ..of_photographs("all gain .5", |f| Faults { gain: [0.5; 3], ..f }) },
    of_photographs("near turned", |f| Faults { near_turned: (1, false), ..f }),
    of_photographs("near upside down", |f| Faults { near_turned: (2, false), ..f }),
    of_photographs("near mirrored", |f| Faults { near_turned: (0, true), ..f }),
    Fault { name: "no bounces said", scene: |s| s.bounces = 4, tables: |t| t.replace("bounces = 4", "bounces = 0"), ..NONE },
    of_photographs("vignetting .15", |f| Faults { vignetting: 0.15, ..f }),
    of_photographs("field of view 1.08", |f| Faults { field_of_view: 1.08, ..f }),
    of_photographs("blur 1.8", |f| Faults { blur: 1.8, ..f }),
    of_photographs("gamma 1.1", |f| Faults { gamma: 1.1, ..f }),
    of_photographs("gamma .45", |f| Faults { gamma: 0.45, ..f }),
    of_photographs("full at .7", |f| Faults { full_at: 0.7, ..f }),
    of_photographs("close-up of 96 pixels", |f| Faults { near_pixels: 96, ..f }),
    of_photographs("lamp 2 widths away, said", |f| Faults { lamp: (2.0, true), ..f }),
    of_photographs("lamp 8 widths away", |f| Faults { lamp: (8.0, false), ..f }),
    of_photographs("falloff .1", |f| Faults { falloff: 0.1, ..f }),
    Fault { name: "swapped", tables: swapped, ..NONE },
    Fault { name: "threads resolved", scene: |s| s.repeats = 24.0, ..NONE },
    Fault {
        name: "bounds too low",
        tables: |t| t,
        scene: |s| {
            s.moves = Box::leak(s.moves.replace("[0.06, 0.25]", "[0.06, 0.11]").replace("[0.05, 1.0]", "[0.05, 0.3]").into_boxed_str());
        },
        ..NONE
    },
];
