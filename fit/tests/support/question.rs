//! Materials, fit files and fits of the tests.

use super::with_control;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Options, Outcome, Watcher, fit};
use biscale_fit::search::Memory;
use biscale_fit::uncertainty::identify::Known;
use std::path::Path;

/// A plain weave; width, height and crimp of its warp, width and height of its weft.
pub fn weave(warp: [f64; 3], weft: [f64; 3], segments: u32, red: &str, blue: &str, specular: f64, alpha: f64) -> String {
    format!(
        "format = 1\n[geometry]\nkind = \"weave\"\nwarp_width = {}\nwarp_gap = {}\nwarp_height = {}\nweft_width = {}\nweft_gap = {}\n\
         weft_height = {}\ncrimp = {}\nsegments = {segments}\n[[surface]]\npart = \"warp\"\nbrdf = {{ model = \"cook-torrance\", diffuse = {red}, \
         specular = {specular}, alpha = {alpha} }}\n[[surface]]\npart = \"weft\"\nbrdf = {{ model = \"cook-torrance\", diffuse = {blue}, \
         specular = {specular}, alpha = {alpha} }}\n",
        warp[0],
        0.5 - warp[0],
        warp[1],
        weft[0],
        0.5 - weft[0],
        weft[1],
        warp[2],
    )
}

/// What moves in a weave.
pub const WEAVE_MOVES: &str = r#"
[[parameter]]
key = "geometry.warp_width"
bounds = [0.25, 0.49]
rest = { key = "geometry.warp_gap", sum = 0.5 }
[[parameter]]
key = "geometry.weft_width"
bounds = [0.25, 0.49]
rest = { key = "geometry.weft_gap", sum = 0.5 }
[[parameter]]
key = "geometry.warp_height"
bounds = [0.06, 0.25]
[[parameter]]
key = "geometry.weft_height"
bounds = [0.06, 0.25]
[[parameter]]
key = "geometry.crimp"
bounds = [0.05, 0.3]
[[parameter]]
key = "surface.warp.brdf.alpha"
bounds = [0.08, 0.8]
log = true
same = ["surface.weft.brdf.alpha"]
[[colour]]
key = "surface.warp.brdf.diffuse"
[[colour]]
key = "surface.weft.brdf.diffuse"
[[colour]]
key = "surface.warp.brdf.specular"
[[colour]]
key = "surface.weft.brdf.specular"
"#;

/// Grooves with a flat floor and flat tops.
pub fn grooves(depth: f64, floor: f64, top: f64, [f, s, t]: [&str; 3]) -> String {
    format!(
        "format = 1\n[geometry]\nkind = \"grooves\"\nperiod = 1.0\ndepth = {depth}\nfloor_width = {floor}\ntop_width = {top}\n\
         [[surface]]\npart = \"floor\"\nbrdf = {{ model = \"lambert\", albedo = {f} }}\n[[surface]]\npart = \"sides\"\n\
         brdf = {{ model = \"lambert\", albedo = {s} }}\n[[surface]]\npart = \"tops\"\nbrdf = {{ model = \"lambert\", albedo = {t} }}\n"
    )
}

/// What moves in grooves.
pub const GROOVES_MOVE: &str = "\n[[parameter]]\nkey = \"geometry.depth\"\nbounds = [0.05, 1.0]\n[[parameter]]\nkey = \"geometry.floor_width\"\nbounds = [0.1, 0.6]\n\
     [[parameter]]\nkey = \"geometry.top_width\"\nbounds = [0.1, 0.6]\n[[colour]]\nkey = \"surface.floor.brdf.albedo\"\n\
     [[colour]]\nkey = \"surface.sides.brdf.albedo\"\n[[colour]]\nkey = \"surface.tops.brdf.albedo\"\n";

/// Rods on the ground: radius, length and lean.
pub fn rods([radius, length, lean]: [f64; 3], [of_rods, of_ground]: [&str; 2]) -> String {
    format!(
        "format = 1\n[geometry]\nkind = \"rods\"\nperiod = 1.0\ncount = 16\nradius = {radius}\nlength = {length}\nlean_deg = {lean}\nspread_deg = 10\n\
         randomness = 0.5\n[[surface]]\npart = \"rods\"\nbrdf = {{ model = \"lambert\", albedo = {of_rods} }}\n[[surface]]\npart = \"ground\"\n\
         brdf = {{ model = \"lambert\", albedo = {of_ground} }}\n"
    )
}

/// What moves in rods.
pub const RODS_MOVE: &str = "\n[[parameter]]\nkey = \"geometry.radius\"\nbounds = [0.03, 0.12]\n[[parameter]]\nkey = \"geometry.length\"\nbounds = [0.1, 0.7]\n\
     [[parameter]]\nkey = \"geometry.lean_deg\"\nbounds = [0, 45]\n[[colour]]\nkey = \"surface.rods.brdf.albedo\"\n[[colour]]\nkey = \"surface.ground.brdf.albedo\"\n";

/// Writes start material and fit file, and fits.
pub fn run(folder: &Path, tables: &str, start: &str, moves: &str, options: &Options) -> Outcome {
    std::fs::write(folder.join("start.toml"), start).unwrap();
    // The camera of the tests sees direct light, if nothing else is said.
    let bounces = if tables.contains("bounces =") { "" } else { "bounces = 0\n" };
    std::fs::write(folder.join("fit.toml"), format!("format = 1\nmaterial = \"start.toml\"\n{bounces}{tables}{moves}")).unwrap();
    let spec = Spec::load(&folder.join("fit.toml")).unwrap();
    with_control(|control| fit(&spec, options, &Memory::default(), Watcher::NOBODY, control)).unwrap()
}

/// What was found for one unknown.
pub fn known<'a>(outcome: &'a Outcome, name: &str) -> &'a Known {
    outcome.identified.known.iter().find(|k| k.name == name).unwrap_or_else(|| panic!("no unknown {name}"))
}

/// Figures, for those who ask for them with --nocapture.
#[allow(clippy::print_stdout, reason = "what it is for")]
pub fn print(outcome: &Outcome) {
    for k in &outcome.identified.known {
        println!("{} = {:.4} +/- {:.4}{}", k.name, k.value, k.sigma, if k.not_identified { " not identified" } else { "" });
    }
    let period = outcome.close_up.as_ref().map(|c| c.period.map(|p| p.map(|p| p.length)));
    println!("period {period:.4?}, height and doubt {:?}", outcome.starts[0].registration);
    println!("training {:.4}, objective {:.3}, {} evaluations", outcome.training, outcome.objective, outcome.evaluations);
    for (v, _) in &outcome.validations {
        println!("validation {:.4}, ratio {:.2}, {:?}", v.relative_rms, v.ratio, v.verdict);
    }
}
