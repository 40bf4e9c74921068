//! From a shoot to a material, through the binary: `capture`, `new fit`, `check`, `fit`, and what takes the result.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

#[path = "../../capture/tests/support/mod.rs"]
mod studio;

use serde_json::Value;
use studio::flat_shoot::FlatShoot;
use support::Folder;

#[test]
fn a_shoot_becomes_a_material() {
    let folder = Folder::new();
    FlatShoot::write(&folder.path(""), 600);
    let run = |args: &[&str]| {
        let said = folder.run(args.iter().copied());
        assert_eq!(said.status, 0, "{args:?}: {}", said.stderr);
        said
    };
    run(&["capture", "shoot.toml", "-o", "captured"]);
    run(&["new", "fit", "captured", "fit.toml"]);
    // The cloth of the shoot is a printed picture: nothing lies under anything, and no light goes to and fro.
    folder.write("fit.toml", folder.read("fit.toml").replace("bounces = 4", "bounces = 0"));
    let checked = run(&["check", "fit.toml"]);
    assert!(checked.stdout.contains("warp_width") && checked.stdout.contains("period"), "{}", checked.stdout);
    let said = folder.run(["fit", "fit.toml", "-o", "fitted", "--starts", "3", "--quiet"]);
    // So it is no cloth from near; and from as near as the distant photograph is, its threads show one by one.
    for words in ["distant.exr is not from afar", "does not explain the close-up"] {
        assert!(said.status == 1 && said.stderr.contains(words), "{words}: {}{}", said.stdout, said.stderr);
    }
    let fit: Value = serde_json::from_str(&folder.read("fitted/fit.json")).unwrap();
    assert_eq!(fit["verdict"], "fail", "{fit}");
    let failures = fit["failures"].to_string();
    assert!(!failures.contains("does not explain the distant photographs") && !failures.contains("is not predicted"), "{failures}");
    assert!(fit["training"]["relative_rms"].as_f64().unwrap() < 0.03, "{}", fit["training"]);
    // The held-out photograph has no checker of its own.
    assert!(fit["validation"][0]["exposure"].is_number(), "{}", fit["validation"]);
    let value = |name: &str| fit["unknowns"].as_array().unwrap().iter().find(|u| u["name"] == name).unwrap()["value"].as_f64().unwrap();
    // Threads that shade themselves are darker than printed ones of the same look; which one is red and which one blue is not in doubt.
    for (name, truth) in [("surface.warp.brdf.albedo red", 0.45), ("surface.weft.brdf.albedo blue", 0.40)] {
        assert!((value(name) / truth - 1.0).abs() < 0.2, "{name}: {} for {truth}", value(name));
    }
    assert!(value("surface.warp.brdf.albedo blue") < 0.1 && value("surface.weft.brdf.albedo red") < 0.1, "{}", fit["unknowns"]);
    for file in ["report.html", "pictures.png", "evaluations.csv"] {
        assert!(folder.path("fitted").join(file).is_file(), "{file}");
    }
    // Another command takes the material.
    run(&["check", "fitted/material.toml"]);
}
