use super::*;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::toml_reader::Source;

const TEXT: &str = "format = 1\n[geometry]\nkind = \"grooves\"\nperiod = 2.0\nfloor_width = 0.5\n[[surface]]\npart = \"floor\"\n\
                    brdf = { model = \"lambert\", albedo = 0.5 }\n[[surface]]\npart = \"*\"\n\
                    brdf = { model = \"cook-torrance\", specular = 0.1, alpha = 0.2 }\n";

fn values(text: &str) -> MaterialValues {
    MaterialValues::parse(&Source { path: "m.toml".into(), text: text.to_owned() }).unwrap()
}

/// Everything of a material that numbers can change.
fn shown(material: &Material) -> String {
    format!("{:?} {:?}", material.geometry, material.surfaces)
}

#[test]
fn a_set_number_gives_the_material_that_a_file_with_it_gives() {
    for (key, old, new, value) in [
        ("geometry.period", "period = 2.0", "period = 3.25", 3.25),
        ("geometry.floor_width", "floor_width = 0.5", "floor_width = 0.1", 0.1),
        ("surface.floor.brdf.albedo", "albedo = 0.5", "albedo = 0.7", 0.7),
        ("surface.*.brdf.alpha", "alpha = 0.2", "alpha = 0.3000000000000001", 0.300_000_000_000_000_1),
        ("surface.*.brdf.f0", "alpha = 0.2", "alpha = 0.2, f0 = 0.04", 0.04),
    ] {
        let mut set = values(TEXT);
        set.set(set.number_key(key).unwrap(), value).unwrap();
        let written = values(&TEXT.replace(old, new));
        assert_eq!(shown(&set.material().unwrap()), shown(&written.material().unwrap()), "{key}");
    }
    // A default that follows the period moves with it; one that the file gives does not.
    let mut set = values(TEXT);
    set.set(set.number_key("geometry.period").unwrap(), 4.0).unwrap();
    let Geometry::Grooves(grooves) = set.material().unwrap().geometry else { panic!("grooves") };
    assert_eq!(grooves.depth, 2.0);
}

#[test]
fn what_a_file_is_refused_for_a_set_number_is_refused_for() {
    let mut set = values(TEXT);
    let number = |key: &str| values(TEXT).number_key(key).unwrap();
    for (key, value) in [("geometry.depth", -0.1), ("surface.*.brdf.alpha", 0.0), ("surface.*.tint", 1.5), ("geometry.depth", f64::NAN)] {
        let bad = set.set(number(key), value).unwrap_err();
        assert!(bad.problem.contains("out of range"), "{key}: {bad:?}");
    }
    // In range by itself, and too wide for the period.
    set.set(number("geometry.floor_width"), 1.9).unwrap();
    let Err(Error::BadInput(bad)) = set.material() else { panic!("too wide") };
    assert!(bad.line == Some(5) && bad.field.as_deref() == Some("geometry.floor_width"), "{bad:?}");
}

#[test]
fn a_key_that_names_no_number_is_told() {
    for (key, word) in [
        ("depth", "geometry.KEY"),
        ("geometry.dept", "`depth`"),
        ("geometry.profile", "no number"),
        ("surface.flour.brdf.albedo", "`floor`"),
        ("surface.floor.model", "names no number"),
        ("surface.*.brdf.distribution", "no number"),
        ("surface.*.brdf.albedo", "unknown key"),
    ] {
        let bad = values(TEXT).number_key(key).unwrap_err();
        assert!(format!("{} {}", bad.problem, bad.remedy).contains(word), "{key}: {bad:?}");
    }
}

#[test]
fn a_measured_table_keeps_its_data_under_another_factor() {
    let text = TEXT.replace("model = \"lambert\", albedo = 0.5", "model = \"measured\", name = \"gold-paint\"");
    let mut set = values(&text);
    set.set(set.number_key("surface.floor.brdf.scale").unwrap(), 0.5).unwrap();
    let Brdf::Measured(measured) = &set.surfaces[0].brdf else { panic!("measured") };
    assert_eq!(**measured, crate::brdf::Measured::fit("gold-paint", 0.5).unwrap());
}
