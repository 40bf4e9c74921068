//! Cloths and grooves to photograph and to fit: some by hand, and others drawn at random.

use super::question::{GROOVES_MOVE, RODS_MOVE, WEAVE_MOVES, grooves, rods, run, weave};
use super::{Faults, LIGHTS, PERFECT, REAL, material, set_under};
use biscale::numerics::random::Random;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Options, Outcome};
use biscale_fit::search::optimise::Optimiser;
use std::path::Path;

/// A surface, how it is photographed, and where its fit begins.
#[derive(Clone)]
pub struct Scene {
    pub name: String,
    pub truth: String,
    pub start: String,
    pub moves: &'static str,
    pub repeats: f64,
    pub lights: [[f64; 3]; 3],
    pub faults: Faults,
    /// Reflections after the first.
    pub bounces: u32,
}

const OTHER_LIGHTS: [[f64; 3]; 3] = [[-0.55, -0.70, 0.45], [0.80, -0.55, 0.25], [-0.30, 0.40, 0.86]];

/// Those by hand.
pub fn scenes() -> Vec<Scene> {
    let start = |segments| weave([0.38, 0.11, 0.13], [0.38, 0.11, 0.0], segments, "[0.4, 0.2, 0.2]", "[0.2, 0.2, 0.4]", 0.1, 0.2);
    let cloth = |name: &str, warp, weft, segments, red, blue, specular, alpha| Scene {
        name: String::from(name),
        truth: weave(warp, weft, segments, red, blue, specular, alpha),
        start: start(16),
        moves: WEAVE_MOVES,
        repeats: 290.0,
        lights: LIGHTS,
        faults: REAL,
        bounces: 0,
    };
    let colours =
        |scene: Scene, a: &str, b: &str| Scene { start: weave([0.38, 0.11, 0.13], [0.38, 0.11, 0.0], 16, a, b, 0.1, 0.2), ..scene };
    let guess = grooves(0.3, 0.3, 0.3, ["[0.2, 0.5, 0.3]", "[0.5, 0.5, 0.2]", "[0.5, 0.2, 0.2]"]);
    let print = |name: &str, depth, floor, top, hues| Scene {
        name: String::from(name),
        truth: grooves(depth, floor, top, hues),
        start: guess.clone(),
        moves: GROOVES_MOVE,
        repeats: 400.0,
        lights: LIGHTS,
        faults: REAL,
        bounces: 0,
    };
    let hues = ["[0.1, 0.6, 0.2]", "[0.65, 0.55, 0.1]", "[0.6, 0.1, 0.1]"];
    let (red, blue) = ("[0.45, 0.06, 0.05]", "[0.05, 0.12, 0.40]");
    vec![
        cloth("red and blue", [0.42, 0.14, 0.15], [0.34, 0.12, 0.0], 32, red, blue, 0.25, 0.3),
        cloth("eight flat sides", [0.42, 0.14, 0.15], [0.34, 0.12, 0.0], 8, red, blue, 0.25, 0.3),
        Scene { lights: OTHER_LIGHTS, ..cloth("other lights", [0.36, 0.10, 0.10], [0.44, 0.16, 0.0], 32, red, blue, 0.15, 0.4) },
        cloth("glossy rough", [0.40, 0.18, 0.12], [0.40, 0.18, 0.0], 32, red, blue, 0.5, 0.5),
        cloth("shiny", [0.44, 0.12, 0.12], [0.38, 0.12, 0.0], 32, red, blue, 0.08, 0.15),
        cloth("matte", [0.38, 0.15, 0.15], [0.38, 0.15, 0.0], 32, red, blue, 0.02, 0.5),
        colours(
            cloth("green on white", [0.42, 0.12, 0.12], [0.36, 0.14, 0.0], 32, "[0.08, 0.35, 0.10]", "[0.6, 0.58, 0.5]", 0.2, 0.3),
            "[0.2, 0.4, 0.2]",
            "[0.4, 0.4, 0.4]",
        ),
        colours(
            cloth("brown on beige", [0.46, 0.16, 0.15], [0.46, 0.10, 0.0], 32, "[0.25, 0.12, 0.05]", "[0.55, 0.45, 0.30]", 0.1, 0.35),
            "[0.3, 0.2, 0.1]",
            "[0.4, 0.4, 0.3]",
        ),
        Scene { repeats: 170.0, ..cloth("open", [0.30, 0.12, 0.10], [0.28, 0.12, 0.0], 32, red, blue, 0.25, 0.25) },
        Scene { bounces: 4, ..cloth("light between threads", [0.42, 0.14, 0.15], [0.34, 0.12, 0.0], 32, red, blue, 0.25, 0.3) },
        Scene {
            bounces: 4,
            ..colours(
                cloth(
                    "light between white threads",
                    [0.36, 0.16, 0.15],
                    [0.40, 0.14, 0.0],
                    32,
                    "[0.8, 0.78, 0.7]",
                    "[0.55, 0.15, 0.1]",
                    0.1,
                    0.35,
                ),
                "[0.5, 0.5, 0.5]",
                "[0.4, 0.2, 0.2]",
            )
        },
        Scene { faults: Faults { veil: 0.01, ..REAL }, ..cloth("a veil", [0.40, 0.12, 0.13], [0.36, 0.13, 0.0], 32, red, blue, 0.2, 0.3) },
        Scene {
            faults: Faults { exposure: 2.5, ..REAL },
            ..cloth("a close-up of unknown exposure", [0.44, 0.13, 0.14], [0.33, 0.11, 0.0], 32, red, blue, 0.2, 0.25)
        },
        Scene { faults: PERFECT, ..cloth("a perfect camera", [0.33, 0.10, 0.13], [0.41, 0.12, 0.0], 32, red, blue, 0.3, 0.35) },
        print("grooves", 0.4, 0.35, 0.25, hues),
        print("shallow grooves", 0.15, 0.25, 0.45, hues),
        print("deep grooves", 0.75, 0.45, 0.2, ["[0.5, 0.5, 0.5]", "[0.1, 0.3, 0.6]", "[0.7, 0.2, 0.1]"]),
        Scene { bounces: 4, ..print("light between grooves", 0.5, 0.4, 0.25, ["[0.7, 0.7, 0.7]", "[0.65, 0.55, 0.1]", "[0.1, 0.2, 0.6]"]) },
        Scene {
            lights: OTHER_LIGHTS,
            ..print("grooves in other lights", 0.3, 0.5, 0.3, ["[0.6, 0.1, 0.3]", "[0.2, 0.5, 0.6]", "[0.3, 0.7, 0.2]"])
        },
    ]
}

/// As many as asked for, from a seed: three cloths for each print, of any widths, heights, colours, gloss, lights and cameras that a person may meet. What each fit begins with is
/// the same for all, but for its colours: these are the true ones, nearer to grey.
pub fn drawn(count: u64, seed: u64) -> Vec<Scene> {
    (0..count).map(|k| if k % 4 == 3 { drawn_grooves(k, seed) } else { drawn_weave(k, seed) }).collect()
}

/// Numbers at random.
pub struct Draw(pub Random);

impl Draw {
    /// Between two bounds, uniform.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }

    /// Between two bounds, uniform in the logarithm.
    pub fn log(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    /// Colours of which no two are alike.
    fn colours(&mut self, count: usize) -> Vec<[f64; 3]> {
        loop {
            let all: Vec<[f64; 3]> = (0..count)
                .map(|_| {
                    let bright = self.within(0.25, 0.75);
                    let hue: [f64; 3] = std::array::from_fn(|_| self.within(0.1, 1.0));
                    let top = hue.iter().copied().fold(0.0, f64::max);
                    hue.map(|v| bright * v / top)
                })
                .collect();
            let chroma = |c: [f64; 3]| c.map(|v| v / c.iter().sum::<f64>());
            let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (chroma(a)[c] - chroma(b)[c]).powi(2)).sum::<f64>().sqrt();
            if (0..count).all(|a| (0..a).all(|b| apart(all[a], all[b]) > 0.15)) {
                return all;
            }
        }
    }

    /// To the light, from its azimuth against the camera and its elevation, degrees.
    fn light(&mut self, azimuth: [f64; 2], elevation: [f64; 2]) -> [f64; 3] {
        let side = if self.0.unit() < 0.5 { -1.0 } else { 1.0 };
        let (a, e) = (side * self.within(azimuth[0], azimuth[1]), self.within(elevation[0], elevation[1]));
        let (a, e) = (a.to_radians(), e.to_radians());
        [e.cos() * a.sin(), -e.cos() * a.cos(), e.sin()]
    }

    fn lights(&mut self) -> [[f64; 3]; 3] {
        loop {
            let [a, b] = [0; 2].map(|_| self.light([15.0, 70.0], [5.0, 35.0]));
            let cosine: f64 = (0..3).map(|c| a[c] * b[c]).sum();
            if cosine < 30_f64.to_radians().cos() {
                return [a, b, self.light([0.0, 180.0], [45.0, 75.0])];
            }
        }
    }

    fn bounces(&mut self) -> u32 {
        if self.0.unit() < 0.5 { 4 } else { 0 }
    }

    fn faults(&mut self) -> Faults {
        let noise = self.log(0.3, 3.0);
        Faults {
            light_off_deg: [0; 2].map(|_| self.within(-0.5, 0.5)),
            blur: self.within(0.4, 1.2),
            vignetting: self.within(0.0, 0.02),
            noise: REAL.noise.map(|n| noise * n),
            ..REAL
        }
    }
}

fn text(colour: [f64; 3]) -> String {
    format!("[{:.3}, {:.3}, {:.3}]", colour[0], colour[1], colour[2])
}

/// A first guess of a colour.
fn greyer(colour: [f64; 3]) -> String {
    text(colour.map(|v| 0.2 + 0.4 * v))
}

/// A cloth.
pub fn drawn_weave(k: u64, seed: u64) -> Scene {
    let mut draw = Draw(Random::new(1000 * seed + k));
    let [warp, weft] = [0; 2].map(|_| [draw.within(0.28, 0.47), draw.within(0.08, 0.19)]);
    let crimp = (0.5 * (warp[1] + weft[1]) * draw.within(0.8, 1.3)).clamp(0.06, 0.25);
    let colours = draw.colours(2);
    let (specular, alpha) = (draw.log(0.02, 0.4), draw.log(0.13, 0.6));
    let segments = if draw.0.unit() < 0.25 { 8 } else { 32 };
    let [a, b] = [text(colours[0]), text(colours[1])];
    Scene {
        name: format!("drawn {seed}.{k}, a cloth"),
        truth: weave([warp[0], warp[1], crimp], [weft[0], weft[1], 0.0], segments, &a, &b, specular, alpha),
        start: weave([0.38, 0.11, 0.13], [0.38, 0.11, 0.0], 16, &greyer(colours[0]), &greyer(colours[1]), 0.1, 0.2),
        moves: WEAVE_MOVES,
        repeats: draw.within(170.0, 400.0).round(),
        lights: draw.lights(),
        faults: draw.faults(),
        bounces: draw.bounces(),
    }
}

/// A print of grooves.
pub fn drawn_grooves(k: u64, seed: u64) -> Scene {
    let mut draw = Draw(Random::new(1000 * seed + k));
    let (depth, floor) = (draw.log(0.12, 0.8), draw.within(0.2, 0.5));
    let top = draw.within(0.15, (0.85 - floor).min(0.5));
    let colours = draw.colours(3);
    let [f, s, t] = [0, 1, 2].map(|k| text(colours[k]));
    let [gf, gs, gt] = [0, 1, 2].map(|k| greyer(colours[k]));
    Scene {
        name: format!("drawn {seed}.{k}, grooves"),
        truth: grooves(depth, floor, top, [&f, &s, &t]),
        start: grooves(0.3, 0.3, 0.3, [&gf, &gs, &gt]),
        moves: GROOVES_MOVE,
        repeats: draw.within(200.0, 500.0).round(),
        lights: draw.lights(),
        faults: draw.faults(),
        bounces: draw.bounces(),
    }
}

/// Rods on the ground, whose places the fit file knows.
pub fn drawn_rods(k: u64, seed: u64) -> Scene {
    let mut draw = Draw(Random::new(1000 * seed + k));
    let (radius, length, lean) = (draw.within(0.05, 0.09), draw.log(0.15, 0.5), draw.within(5.0, 30.0));
    let colours = draw.colours(2);
    let [rods_colour, ground] = [0, 1].map(|k| text(colours[k]));
    let [gr, gg] = [0, 1].map(|k| greyer(colours[k]));
    Scene {
        name: format!("drawn {seed}.{k}, rods"),
        truth: rods([radius, length, lean], [&rods_colour, &ground]),
        start: rods([0.07, 0.3, 15.0], [&gr, &gg]),
        moves: RODS_MOVE,
        repeats: draw.within(200.0, 500.0).round(),
        lights: draw.lights(),
        faults: draw.faults(),
        bounces: draw.bounces(),
    }
}

/// Photographs a scene, and says what a fit file must of the photographs.
pub fn photographed(scene: &Scene, folder: &Path) -> String {
    let set = set_under(folder, &material(&scene.truth), scene.repeats, scene.lights, (&scene.faults, scene.bounces), 64);
    format!("bounces = {}\n{}", scene.bounces, set.tables)
}

/// Writes start material and fit file of a scene that was photographed.
pub fn written(scene: &Scene, folder: &Path, tables: &str) -> Spec {
    std::fs::write(folder.join("start.toml"), &scene.start).unwrap();
    let text = format!("format = 1\nmaterial = \"start.toml\"\n{tables}{}", scene.moves);
    std::fs::write(folder.join("fit.toml"), text).unwrap();
    Spec::load(&folder.join("fit.toml")).unwrap()
}

/// Photographs a scene and fits it.
pub fn fit_scene(scene: &Scene, folder: &Path, seed: u64) -> (Outcome, Spec) {
    let tables = photographed(scene, folder);
    let name = std::env::var("OPTIMIZER");
    let optimiser = Optimiser::ALL.into_iter().find(|o| name.as_deref() == Ok(o.name())).unwrap_or_default();
    let outcome = run(folder, &tables, &scene.start, scene.moves, &Options { seed, optimiser, ..Options::default() });
    (outcome, Spec::load(&folder.join("fit.toml")).unwrap())
}
