//! Small-scale BRDFs against closed forms, and how they are read.

use super::{Brdf, Distribution, LANES, Measured, fit_names, markdown};
use crate::toml_reader::{Source, TableReader};
use glam::DVec3;
use proptest::prelude::*;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// Unit direction by polar angle and azimuth, radians.
pub(super) fn above(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

pub(super) fn sample_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/brdf/paper_white_rgb.bsdf")
}

pub(super) fn office_paper() -> Brdf {
    Brdf::Measured(Measured::read(&sample_file(), 1.0).unwrap().into())
}

/// One of every model and distribution, smooth enough for plain quadrature.
pub(super) fn every_model() -> Vec<(&'static str, Brdf)> {
    let (diffuse, specular) = ([0.1, 0.2, 0.3], [0.6, 0.5, 0.4]);
    let cook = |distribution, f0| Brdf::CookTorrance { diffuse, specular, alpha: 0.25, distribution, f0 };
    vec![
        ("lambert", Brdf::Lambert { albedo: [0.2, 0.5, 0.8] }),
        ("blinn-phong", Brdf::BlinnPhong { diffuse, specular, exponent: 40.0 }),
        ("cook-torrance ggx", cook(Distribution::Ggx, None)),
        ("cook-torrance beckmann", cook(Distribution::Beckmann, None)),
        ("cook-torrance f0", cook(Distribution::Ggx, Some([0.04, 0.5, 0.9]))),
        ("ward", Brdf::Ward { diffuse, specular, alpha: 0.25 }),
        ("measured paper", office_paper()),
        ("measured paint", Brdf::Measured(Measured::fit("gold-metallic-paint", 1.0).unwrap().into())),
    ]
}

/// Reads the text of an inline `brdf` table of a file in `folder`.
fn read_in(folder: &Path, text: &str) -> crate::Result<Brdf> {
    let source = Source { path: folder.join("m.toml"), text: format!("brdf = {text}\n") };
    let root = source.parse().unwrap();
    let top = TableReader::new(&source, "", root.get_ref(), 0);
    Brdf::read(top.table("brdf").unwrap().unwrap())
}

fn read(text: &str) -> crate::Result<Brdf> {
    read_in(Path::new(""), text)
}

fn problem(text: &str) -> String {
    match read(text) {
        Err(crate::Error::BadInput(bad)) => bad.to_string(),
        other => panic!("{text} gave {other:?}"),
    }
}

#[test]
fn every_model_has_its_closed_form() {
    // i at 30 degrees and o at 60 degrees on opposite sides: h is 15 degrees off the normal, i.h = cos 45 degrees.
    let (i, o) = (above(30_f64.to_radians(), 0.0), above(60_f64.to_radians(), PI));
    let (cos_h, tan_h) = (15_f64.to_radians().cos(), 15_f64.to_radians().tan());
    let (ci, co) = (30_f64.to_radians().cos(), 0.5_f64);
    let (d, s, a) = (0.2, 0.5, 0.3_f64);
    let g1 = |cos: f64| 2.0 / (1.0 + (1.0 + a * a * (1.0 / (cos * cos) - 1.0)).sqrt());
    let ggx = a * a / (PI * (cos_h * cos_h * (a * a - 1.0) + 1.0).powi(2)) * g1(ci) * g1(co) / (4.0 * ci * co);
    let rational = |cos: f64| {
        let c = 1.0 / (a * (1.0 / (cos * cos) - 1.0).sqrt());
        if c < 1.6 { (3.535 * c + 2.181 * c * c) / (1.0 + 2.276 * c + 2.577 * c * c) } else { 1.0 }
    };
    let beckmann = (-tan_h * tan_h / (a * a)).exp() / (PI * a * a * cos_h.powi(4)) * rational(ci) * rational(co) / (4.0 * ci * co);
    let fresnel = 0.04 + 0.96 * (1.0 - 45_f64.to_radians().cos()).powi(5);
    let ward = (-tan_h * tan_h / (a * a)).exp() / (4.0 * PI * a * a * (ci * co).sqrt());
    let (diffuse, specular, alpha) = ([d; 3], [s; 3], a);
    let cook = |distribution, f0| Brdf::CookTorrance { diffuse, specular, alpha, distribution, f0 };
    for (brdf, expected) in [
        (Brdf::Lambert { albedo: [d; 3] }, d / PI),
        (Brdf::BlinnPhong { diffuse, specular, exponent: 20.0 }, d / PI + s * 22.0 / (2.0 * PI) * cos_h.powi(20)),
        (cook(Distribution::Ggx, None), d / PI + s * ggx),
        (cook(Distribution::Beckmann, None), d / PI + s * beckmann),
        (cook(Distribution::Ggx, Some([0.04; 3])), d / PI + s * ggx * fresnel),
        (Brdf::Ward { diffuse, specular, alpha }, d / PI + s * ward),
    ] {
        // In a frame of any orientation.
        let turn = glam::DQuat::from_rotation_arc(DVec3::Z, DVec3::new(0.3, -0.8, -0.52).normalize());
        for got in brdf.eval(turn * DVec3::Z, turn * i, turn * o) {
            assert!((got - expected).abs() < 1e-12 * expected.max(1.0), "{brdf:?}: {got} not {expected}");
        }
    }
}

#[test]
fn schlick_runs_from_f0_along_the_normal_to_one_at_grazing() {
    let cook = |f0| Brdf::CookTorrance { diffuse: [0.0; 3], specular: [1.0; 3], alpha: 0.5, distribution: Distribution::Ggx, f0 };
    let ratio = |theta: f64| {
        let (i, o) = (above(theta, 0.0), above(theta, PI));
        cook(Some([0.04, 0.5, 1.0])).eval(DVec3::Z, i, o).map(|v| v / cook(None).eval(DVec3::Z, i, o)[0])
    };
    for (theta, expected) in [(0.0, [0.04, 0.5, 1.0]), (PI / 2.0 - 1e-9, [1.0; 3])] {
        for (got, expected) in ratio(theta).iter().zip(expected) {
            assert!((got - expected).abs() < 1e-7, "{got} not {expected} at {theta}");
        }
    }
}

#[test]
fn nothing_is_reflected_from_or_to_below_the_facet() {
    for (name, brdf) in every_model() {
        for (wi, wo) in [(DVec3::Z, -DVec3::Z), (-DVec3::Z, DVec3::Z), (DVec3::X, DVec3::Z), (DVec3::Z, DVec3::X), (DVec3::NAN, DVec3::Z)] {
            assert_eq!(brdf.eval(DVec3::Z, wi, wo), [0.0; 3], "{name} at {wi}, {wo}");
        }
    }
}

#[test]
fn grazing_and_opposite_directions_give_finite_values() {
    for alpha in [1e-3, 0.3, 1.0] {
        let (diffuse, specular) = ([0.5; 3], [0.5; 3]);
        let mut brdfs: Vec<Brdf> = every_model().into_iter().map(|(_, b)| b).collect();
        for distribution in [Distribution::Ggx, Distribution::Beckmann] {
            brdfs.push(Brdf::CookTorrance { diffuse, specular, alpha, distribution, f0: Some([0.04; 3]) });
        }
        brdfs.push(Brdf::Ward { diffuse, specular, alpha });
        brdfs.extend([0.0, 1.0, 1e6].map(|exponent| Brdf::BlinnPhong { diffuse, specular, exponent }));
        for brdf in brdfs {
            for z in [1e-4, 1e-17, 1e-300, 5e-324] {
                for (wi, wo) in [
                    (DVec3::new(1.0, 0.0, z), DVec3::new(-1.0, 0.0, z)),
                    (DVec3::new(1.0, 0.0, z), DVec3::new(1.0, 0.0, z)),
                    (DVec3::new(0.0, 1.0, z), DVec3::new(1.0, 0.0, z)),
                    (DVec3::new(1.0, 0.0, z), DVec3::Z),
                    (DVec3::Z, DVec3::new(1.0, 0.0, z)),
                ] {
                    let value = brdf.eval(DVec3::Z, wi, wo);
                    assert!(value.iter().all(|v| v.is_finite() && *v >= 0.0), "{brdf:?} at {wi}, {wo}: {value:?}");
                }
            }
        }
    }
}

/// Any analytic BRDF.
fn any_brdf() -> impl Strategy<Value = Brdf> {
    let colour = || [0.0..=1.0, 0.0..=1.0, 0.0..=1.0_f64];
    let alpha = || (1e-3_f64.ln()..=0.0).prop_map(f64::exp);
    prop_oneof![
        colour().prop_map(|albedo| Brdf::Lambert { albedo }),
        (colour(), colour(), prop_oneof![Just(0.0), (-3.0..13.8).prop_map(f64::exp), Just(1e6)])
            .prop_map(|(diffuse, specular, exponent)| Brdf::BlinnPhong { diffuse, specular, exponent }),
        (colour(), colour(), alpha(), any::<bool>(), proptest::option::of(colour())).prop_map(|(diffuse, specular, alpha, ggx, f0)| {
            let distribution = if ggx { Distribution::Ggx } else { Distribution::Beckmann };
            Brdf::CookTorrance { diffuse, specular, alpha, distribution, f0 }
        }),
        (colour(), colour(), alpha()).prop_map(|(diffuse, specular, alpha)| Brdf::Ward { diffuse, specular, alpha }),
    ]
}

fn any_direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0, -1.0..1.0, prop_oneof![-1.0..1.0, -1e-6..1e-6, Just(0.0)])
        .prop_map(|(x, y, z)| DVec3::new(x, y, z).try_normalize().unwrap_or(DVec3::Z))
}

proptest! {
    #[test]
    fn values_are_finite_not_negative_and_reciprocal(brdf in any_brdf(), n in any_direction(), i in any_direction(), o in any_direction()) {
        let (forth, back) = (brdf.eval(n, i, o), brdf.eval(n, o, i));
        prop_assert!(forth.iter().all(|v| v.is_finite() && *v >= 0.0), "{forth:?}");
        prop_assert_eq!(forth, back);
    }

    #[test]
    fn measured_values_are_finite_and_not_negative_in_both_precisions(n in any_direction(), i in any_direction(), o in any_direction()) {
        for brdf in [office_paper(), Brdf::Measured(Measured::fit("chrome", 1.0).unwrap().into())] {
            let value = brdf.eval(n, i, o);
            prop_assert!(value.iter().all(|v| v.is_finite() && *v >= 0.0), "{value:?}");
            let Brdf::Measured(measured) = brdf else { unreachable!() };
            let value = measured.eval_lanes(&n.as_vec3().to_array().map(|x| [x; LANES]), i.as_vec3(), o.as_vec3());
            prop_assert!(value.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{value:?}");
        }
    }
}

#[test]
fn tables_are_read_with_their_defaults() {
    assert_eq!(read("{ model = \"lambert\", albedo = [0.1, 0.7, 0.2] }").unwrap(), Brdf::Lambert { albedo: [0.1, 0.7, 0.2] });
    assert_eq!(
        read("{ model = \"cook-torrance\", specular = 0.5, alpha = 0.2 }").unwrap(),
        Brdf::CookTorrance { diffuse: [0.0; 3], specular: [0.5; 3], alpha: 0.2, distribution: Distribution::Ggx, f0: None }
    );
    assert_eq!(
        read("{ model = \"cook-torrance\", diffuse = 0.1, specular = 0.5, alpha = 0.2, distribution = \"beckmann\", f0 = 0.04 }").unwrap(),
        Brdf::CookTorrance { diffuse: [0.1; 3], specular: [0.5; 3], alpha: 0.2, distribution: Distribution::Beckmann, f0: Some([0.04; 3]) }
    );
    assert_eq!(
        read("{ model = \"blinn-phong\", specular = 1, exponent = 1000000 }").unwrap(),
        Brdf::BlinnPhong { diffuse: [0.0; 3], specular: [1.0; 3], exponent: 1e6 }
    );
    assert_eq!(
        read("{ model = \"ward\", specular = 0.3, alpha = 0.001 }").unwrap(),
        Brdf::Ward { diffuse: [0.0; 3], specular: [0.3; 3], alpha: 1e-3 }
    );
    let twice = read("{ model = \"measured\", name = \"gold-metallic-paint\", scale = 2 }").unwrap();
    assert_eq!(twice, Brdf::Measured(Measured::fit("gold-metallic-paint", 2.0).unwrap().into()));
}

#[test]
fn wrong_tables_are_refused_with_field_value_and_remedy() {
    for (text, words) in [
        ("{ albedo = 0.5 }", "lacks the required key `model`"),
        ("{ model = \"lambart\", albedo = 0.5 }", "did you mean `lambert`?"),
        ("{ model = \"lambert\" }", "lacks the required key `albedo`"),
        ("{ model = \"lambert\", albedo = 1.5 }", "1.5 is out of range; write a number from 0 to 1"),
        ("{ model = \"lambert\", albedo = nan }", "nan is out of range"),
        ("{ model = \"lambert\", albedo = [0.5, 0.5] }", "has 2 elements"),
        ("{ model = \"lambert\", albedo = 0.5, alpha = 0.2 }", "unknown key `alpha`"),
        ("{ model = \"cook-torrance\", specular = 0.5 }", "lacks the required key `alpha`"),
        ("{ model = \"cook-torrance\", specular = 0.5, alpha = 0.0009 }", "0.0009 is out of range"),
        ("{ model = \"cook-torrance\", specular = 0.5, alpha = 0.2, distribution = \"gxx\" }", "did you mean `ggx`?"),
        ("{ model = \"blinn-phong\", specular = 0.5, exponent = 1e7 }", "1e7 is out of range"),
        ("{ model = \"ward\", alpha = 0.1 }", "lacks the required key `specular`"),
        ("{ model = \"measured\" }", "neither `file` nor `name`"),
        ("{ model = \"measured\", file = \"a.bsdf\", name = \"chrome\" }", "both `file` and `name`"),
        ("{ model = \"measured\", file = \"a.bsdf\" }", "m.toml:1: brdf.file: there is no file \"a.bsdf\""),
        ("{ model = \"measured\", name = \"chrome\", scale = -1 }", "-1 is out of range"),
        ("{ model = \"measured\", name = \"gold-metalic-paint\" }", "brdf.name: there is no built-in fit"),
    ] {
        let message = problem(text);
        assert!(message.contains(words) && message.starts_with("m.toml:1: brdf"), "{text} gave: {message}");
    }
    let message = problem("{ model = \"measured\", name = \"gold-metalic-paint\" }");
    assert!(message.contains("the nearest are `gold-metallic-paint`, `gold-metallic-paint2`"), "{message}");
    let message = problem("{ model = \"measured\", name = \"Gold Paint\" }");
    assert!(message.contains("the nearest are `gold-paint`"), "{message}");
}

#[test]
fn a_measured_file_is_found_beside_the_material_file_and_its_mistakes_are_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(sample_file(), folder.path().join("paper.bsdf")).unwrap();
    let Ok(Brdf::Measured(paper)) = read_in(folder.path(), "{ model = \"measured\", file = \"paper.bsdf\" }") else { panic!("not read") };
    assert_eq!(paper.description, "White A4 paper (160 gsm)");
    for (name, bytes, words) in [
        ("short.binary", &[90, 0, 0, 0][..], "short.binary: dimensions: the file has only 4 bytes"),
        ("other.bsdf", b"PNG", "other.bsdf: this is not an RGL tensor file"),
        ("table.csv", b"1,2", "table.csv: the ending \"csv\" is not one of a measured BRDF"),
    ] {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let message = read_in(folder.path(), &format!("{{ model = \"measured\", file = \"{name}\" }}")).expect_err(name).to_string();
        assert!(message.contains(words), "{name} gave: {message}");
    }
    std::fs::create_dir(folder.path().join("folder.bsdf")).unwrap();
    let message = read_in(folder.path(), "{ model = \"measured\", file = \"folder.bsdf\" }").expect_err("a folder").to_string();
    assert!(message.contains("\"folder.bsdf\" is a folder"), "{message}");
}

#[test]
fn the_documentation_has_every_parameter_and_every_fit() {
    let docs = include_str!("../../docs/brdf.md");
    let generated = markdown();
    assert!(docs.contains(&generated), "docs/brdf.md lacks this text:\n{generated}");
    let names = fit_names().collect::<Vec<_>>().join(", ");
    assert!(docs.contains(&names), "docs/brdf.md lacks this line:\n{names}");
}
