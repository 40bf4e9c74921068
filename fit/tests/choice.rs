//! Which structure and reflectance made photographs show, chosen among several: never a wrong one as certain.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

#[allow(dead_code, reason = "not every test program uses all of it")]
mod support;

use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Choice, Options, choose};
use support::question::grooves;
use support::{REAL, material, set, with_control};

/// A weave of threads .42 wide, or grooves, in a reflectance of this name.
fn truth(structure: &str, specular: f64, alpha: f64) -> String {
    if structure == "grooves" {
        return grooves(0.4, 0.35, 0.25, ["[0.1, 0.6, 0.2]", "[0.65, 0.55, 0.1]", "[0.6, 0.1, 0.1]"]);
    }
    let weave = match structure {
        "plain" => "weave = \"plain\"",
        "twill" => "weave = \"twill\"\nover = 2\nunder = 2\nshift = 1",
        _ => "weave = \"satin\"\nover = 4\nunder = 1\nshift = 2",
    };
    let brdf = |colour: &str| {
        if specular > 0.0 {
            format!("{{ model = \"cook-torrance\", diffuse = {colour}, specular = {specular}, alpha = {alpha} }}")
        } else {
            format!("{{ model = \"lambert\", albedo = {colour} }}")
        }
    };
    format!(
        "format = 1\n[geometry]\nkind = \"weave\"\n{weave}\nwarp_width = 0.42\nwarp_gap = 0.08\nwarp_height = 0.14\nweft_width = 0.36\nweft_gap = 0.14\n\
         weft_height = 0.12\nsegments = 32\n[[surface]]\npart = \"warp\"\nbrdf = {}\n[[surface]]\npart = \"weft\"\nbrdf = {}\n",
        brdf("[0.45, 0.06, 0.05]"),
        brdf("[0.05, 0.12, 0.40]")
    )
}

/// What a weave's fit begins from: a plain one without gloss.
const START: &str = "format = 1\n[geometry]\nkind = \"weave\"\nwarp_width = 0.4\nwarp_gap = 0.1\nwarp_height = 0.12\nweft_width = 0.4\nweft_gap = 0.1\n\
    weft_height = 0.12\nsegments = 16\n[[surface]]\npart = \"warp\"\nbrdf = { model = \"lambert\", albedo = [0.4, 0.2, 0.2] }\n[[surface]]\npart = \"weft\"\n\
    brdf = { model = \"lambert\", albedo = [0.2, 0.2, 0.4] }\n";

/// The choice for photographs of a truth, among candidates that the head of the fit file names.
fn chosen(truth: &str, repeats: f64, head: &str) -> Choice {
    let folder = tempfile::tempdir().unwrap();
    let tables = set(folder.path(), &material(truth), repeats, &REAL, 64).tables;
    std::fs::write(folder.path().join("start.toml"), START).unwrap();
    let text = format!("format = 1\nmaterial = \"start.toml\"\nbounces = 0\nmoves = \"all\"\nsides = [16]\n{head}\n{tables}");
    std::fs::write(folder.path().join("fit.toml"), text).unwrap();
    let spec = Spec::load(&folder.path().join("fit.toml")).unwrap();
    with_control(|control| choose(&spec, &Options { starts: 3, ..Options::default() }, control)).unwrap()
}

fn print(name: &str, choice: &Choice) {
    println!("{name}: {}; {} evaluations", choice.sentence(), choice.evaluations);
    for c in &choice.candidates {
        println!(
            "    {:18} {:?} behind {:.1?} enough {:.1?} training {:.4?} near {:.4?} held out {:.4?} numbers {} {:?}",
            c.name, c.look, c.behind, c.enough, c.training, c.close_up, c.held_out, c.numbers, c.ruled_out
        );
    }
    println!("    {:?} {:?}", choice.compared, choice.notes);
}

/// The truth is chosen, or among those that are said not to be told from the chosen one.
fn is_honest(choice: &Choice, name: &str) -> bool {
    choice.candidates[choice.chosen].name == name || choice.tied().contains(&name)
}

const WEAVES: &str = "structures = [\"plain\", \"twill\", \"satin\"]\nreflectances = [\"lambert\", \"gloss\"]";

#[test]
fn a_material_of_new_weave_and_the_template_of_new_fit_make_a_question() {
    let folder = tempfile::tempdir().unwrap();
    let samples = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../samples/fit"));
    for name in ["close-up.exr", "distant.exr", "validation.exr"] {
        std::fs::copy(samples.join(name), folder.path().join(name)).unwrap();
    }
    let load = |text: String, start: &str| {
        std::fs::write(folder.path().join("start.toml"), start).unwrap();
        std::fs::write(folder.path().join("fit.toml"), text).unwrap();
        Spec::load(&folder.path().join("fit.toml"))
    };
    let template = biscale_fit::fit_file::template::BY_HAND.to_owned();
    for kind in ["weave", "grooves", "rods"] {
        let spec = load(template.clone(), &biscale::geometry::template(kind).unwrap()).unwrap();
        assert!(!spec.parameters.is_empty() && !spec.colours.is_empty() && spec.candidates.is_empty(), "{kind}");
    }
    let weave = biscale::geometry::template("weave").unwrap();
    // The lines that it offers, and a file of another kind.
    let all = template.replace("# structures =", "structures =").replace("# reflectances =", "reflectances =");
    std::fs::write(folder.path().join("velvet.toml"), biscale::geometry::template("rods").unwrap()).unwrap();
    let velvet = "\n[[candidate]]\nname = \"velvet\"\nmaterial = \"velvet.toml\"\n";
    let spec = load(format!("{all}{velvet}"), &weave).unwrap();
    let names: Vec<String> = biscale_fit::run::candidates(&spec).into_iter().map(|c| c.name).collect();
    assert!(names.len() == 11 && names[0] == "plain, lambert" && names[10] == "velvet", "{names:?}");
    for (text, words) in [
        (all.replace("\"sateen\"", "\"satan\""), "satin"),
        (format!("{all}{velvet}{velvet}"), "velvet"),
        (format!("{all}\n[[candidate]]\nname = \"none\"\n"), "material"),
    ] {
        let error = load(text, &weave).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
#[ignore = "a minute and more"]
fn a_glossy_twill_is_told_from_plain_weave_and_satin_and_from_a_matte_one() {
    let choice = chosen(&truth("twill", 0.25, 0.3), 150.0, "structures = [\"twill\", \"satin\"]\nreflectances = [\"lambert\", \"gloss\"]");
    print("twill", &choice);
    assert_eq!((&*choice.candidates[choice.chosen].name, choice.tied().len()), ("twill, gloss", 0));
    assert_eq!(choice.failure(), None);
}

/// `SCENE=twill` chooses some.
#[test]
#[ignore = "minutes: many scenes"]
fn no_choice_is_wrong_and_certain() {
    let only = std::env::var("SCENE").ok();
    let (mut right, mut honest, mut all) = (0, 0, 0);
    for structure in ["plain", "twill", "satin", "grooves"] {
        for (specular, alpha) in [(0.0, 0.3), (0.002, 0.3), (0.05, 0.3), (0.25, 0.3)] {
            if structure == "grooves" && specular > 0.0 || only.as_ref().is_some_and(|o| !o.split(';').any(|o| o == structure)) {
                continue;
            }
            let kinds = if structure == "grooves" { WEAVES.replace("\"satin\"", "\"satin\", \"grooves\"") } else { WEAVES.to_owned() };
            let repeats = if structure == "grooves" { 400.0 } else { 150.0 };
            let began = std::time::Instant::now();
            let choice = chosen(&truth(structure, specular, alpha), repeats, &kinds);
            let name = format!("{structure}, {}", if specular > 0.0 { "gloss" } else { "lambert" });
            print(&format!("{name} {specular} ({:.0} s)", began.elapsed().as_secs_f64()), &choice);
            all += 1;
            right += usize::from(choice.candidates[choice.chosen].name == name);
            let is_honest = is_honest(&choice, &name);
            honest += usize::from(is_honest);
            if !is_honest {
                println!("    WRONG AND CERTAIN");
            }
        }
    }
    println!("{right} of {all} chosen right, {honest} right or told as one that cannot be told apart");
    assert_eq!(honest, all);
}
