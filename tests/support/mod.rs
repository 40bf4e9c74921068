//! Small surfaces, directions and runs that test programs share.

pub mod truth;

use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Method, Quality, Value, effective};
use biscale::material::{Material, SmallScale};
use biscale::toml_reader::Source;
use glam::DVec3;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// A plan of the direct method that takes milliseconds.
pub const QUICK: &str = "direct:2048x1";

/// Lambert's BRDF in three different channels, as TOML.
pub const LAMBERT: &str = r#"{ model = "lambert", albedo = [0.8, 0.5, 0.2] }"#;
/// Albedo of [`LAMBERT`].
pub const ALBEDO: [f64; 3] = [0.8, 0.5, 0.2];

/// One period of the plane z = 0, as the text of an OBJ file.
pub const PLANE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

/// The text of a material with one surface all over.
pub fn text(geometry: &str, brdf: &str) -> String {
    format!("format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {brdf}\n")
}

/// Reads and builds a material whose files lie in `folder`.
pub fn build_in(folder: &Path, text: String) -> biscale::Result<SmallScale> {
    Material::parse(&Source { path: folder.join("test.toml"), text })?.build()
}

/// A surface from the lines of a `[geometry]` table and a `brdf` value.
pub fn surface(geometry: &str, brdf: &str) -> SmallScale {
    build_in(Path::new(env!("CARGO_MANIFEST_DIR")), text(geometry, brdf)).unwrap()
}

/// What becomes of an OBJ file with this text and period.
pub fn try_mesh(obj: &str, period: [f64; 2], brdf: &str) -> biscale::Result<SmallScale> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("test.obj"), obj).unwrap();
    build_in(folder.path(), text(&format!("kind = \"mesh\"\nfile = \"test.obj\"\nperiod = {period:?}"), brdf))
}

/// The surface of an OBJ file with this text and period.
pub fn mesh(obj: &str, period: [f64; 2], brdf: &str) -> SmallScale {
    try_mesh(obj, period, brdf).unwrap()
}

/// V-grooves along y.
pub fn v_groove(period: f64, depth: f64, brdf: &str) -> SmallScale {
    surface(&format!("kind = \"grooves\"\nprofile = \"v\"\nperiod = {period:e}\ndepth = {depth:e}"), brdf)
}

/// Unit vector at `theta` degrees from z in azimuth `phi`; exactly horizontal at 90.
pub fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((sin, cos), (sin_phi, cos_phi)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    DVec3::new(sin * cos_phi, sin * sin_phi, if theta == 90.0 { 0.0 } else { cos })
}

/// A pair from the angles of the light and of the viewer, degrees.
pub fn pair(theta_i: f64, phi_i: f64, theta_o: f64, phi_o: f64) -> Pair {
    Pair { wi: direction(theta_i, phi_i), wo: direction(theta_o, phi_o) }
}

/// All pairs of some directions, both ways round and with themselves.
pub fn pairs_of(angles: &[(f64, f64)]) -> Vec<Pair> {
    angles.iter().flat_map(|&(ti, pi)| angles.iter().map(move |&(to, po)| pair(ti, pi, to, po))).collect()
}

/// Pairs of five directions all over the hemisphere.
pub fn some_pairs() -> Vec<Pair> {
    pairs_of(&[(0.0, 0.0), (20.0, 30.0), (45.0, 100.0), (60.0, 250.0), (75.0, 170.0)])
}

/// Runs a method with a clock that stands still.
pub fn run(surface: &SmallScale, pairs: &[Pair], quality: &Quality) -> Effective {
    let control = Control { cancel: &AtomicBool::new(false), progress: &|_, _| {}, clock: &|| 0.0 };
    effective(surface, pairs, quality, &control).unwrap()
}

/// The direct method by a plan.
pub fn direct(surface: &SmallScale, pairs: &[Pair], plan: &str) -> Effective {
    run(surface, pairs, &Quality { method: Method::Direct, plan: Some(plan.parse().unwrap()), ..Quality::default() })
}

/// The reference method to a tolerance.
pub fn reference(surface: &SmallScale, pairs: &[Pair], tolerance: f64) -> Effective {
    run(surface, pairs, &Quality { method: Method::Reference, tolerance, ..Quality::default() })
}

/// Every number of a value.
pub fn numbers(v: &Value) -> impl Iterator<Item = f64> {
    [v.s, v.s_se, v.fbar, v.se, v.fhat].into_iter().flatten().chain([v.av])
}

/// Fails unless every number is finite and none is negative.
pub fn assert_sound(result: &Effective, pairs: &[Pair], what: &str) {
    assert_eq!(result.values.len(), pairs.len());
    assert!(result.summary.relative_rms.is_finite(), "{what}: relative RMS {}", result.summary.relative_rms);
    for (v, pair) in result.values.iter().zip(pairs) {
        assert!(numbers(v).all(|x| x.is_finite() && x >= 0.0), "{what}, {pair:?}: {v:?}");
    }
}

/// Runs the direct method by a plan, and fails unless its values are finite, not negative and reciprocal in `S` to the last bit, in
/// one list and in two.
pub fn sound_and_reciprocal(surface: &SmallScale, pairs: &[Pair], plan: &str, what: &str) -> Effective {
    let reversed: Vec<Pair> = pairs.iter().map(|p| Pair { wi: p.wo, wo: p.wi }).collect();
    let result = direct(surface, pairs, plan);
    assert_sound(&result, pairs, what);
    // Last pair first, so that directions are numbered in another order.
    let mut alone = direct(surface, &reversed.iter().rev().copied().collect::<Vec<_>>(), plan);
    alone.values.reverse();
    let together = direct(surface, &[pairs, &reversed].concat(), plan);
    for (k, (v, pair)) in result.values.iter().zip(pairs).enumerate() {
        assert_eq!(v.s, alone.values[k].s, "{what}, {pair:?}: S of the reversed list");
        assert_eq!(v.s, together.values[k].s, "{what}, {pair:?}: S in the long list");
        assert_eq!(v.s, together.values[pairs.len() + k].s, "{what}, {pair:?}: S reversed in the long list");
    }
    approximations_are_sound(surface, pairs, what);
    result
}

/// Runs both variants of `lowrank` and of `sg` with small settings, and fails unless their values are finite, not negative, and reciprocal in
/// `S` within six of their standard errors.
fn approximations_are_sound(surface: &SmallScale, pairs: &[Pair], what: &str) {
    for plan in [
        "lowrank:paper:facets=512:directions=6:rates=8x8",
        "lowrank:improved:facets=1024:normals=8",
        "sg:paper:facets=512",
        "sg:improved:facets=1024",
    ] {
        let reversed = pairs.iter().map(|p| Pair { wi: p.wo, wo: p.wi });
        let both: Vec<Pair> = pairs.iter().copied().chain(reversed).collect();
        let result = run(surface, &both, &Quality { plan: Some(plan.parse().unwrap()), ..Quality::default() });
        assert_sound(&result, &both, &format!("{plan}, {what}"));
        let (there, back) = result.values.split_at(pairs.len());
        for ((a, b), pair) in there.iter().zip(back).zip(pairs) {
            for c in 0..3 {
                let (off, sigma) = ((a.s[c] - b.s[c]).abs(), a.s_se[c].hypot(b.s_se[c]));
                assert!(
                    off <= 6.0 * sigma + 1e-12 * a.s[c],
                    "{plan}, {what}, {pair:?}: S {} and {}, standard error {sigma:e}",
                    a.s[c],
                    b.s[c]
                );
            }
        }
    }
}

/// Fails unless two results agree: at least 95 % of the values within 3 combined standard errors, all within 6, both beside rounding
/// of `rounding` of the largest value.
pub fn assert_agree(a: &Effective, b: &Effective, rounding: f64, what: &str) {
    let expected: Vec<([f64; 3], [f64; 3])> = b.values.iter().map(|v| (v.fbar, v.se)).collect();
    assert_near(a, &expected, rounding, what);
}

/// The same against values and their standard errors.
pub fn assert_near(a: &Effective, expected: &[([f64; 3], [f64; 3])], rounding: f64, what: &str) {
    let (near, all) = count_near(a, expected, rounding, what);
    assert!(near as f64 >= 0.95 * all as f64, "{what}: {near} of {all} values within 3 standard errors");
}

/// How many values lie within 3 combined standard errors, and of how many. Fails unless all lie within 6.
pub fn count_near(a: &Effective, expected: &[([f64; 3], [f64; 3])], rounding: f64, what: &str) -> (usize, usize) {
    let largest = expected.iter().flat_map(|e| e.0).fold(0.0, f64::max);
    let (mut near, mut all) = (0, 0);
    for (k, (v, (value, se))) in a.values.iter().zip(expected).enumerate() {
        for c in 0..3 {
            let (off, sigma) = ((v.fbar[c] - value[c]).abs(), v.se[c].hypot(se[c]));
            assert!(
                off <= 6.0 * sigma + rounding * largest,
                "{what}, pair {k}, channel {c}: {} for {}, off by {off:e}, standard error {sigma:e}",
                v.fbar[c],
                value[c]
            );
            near += usize::from(off <= 3.0 * sigma + rounding * largest);
            all += 1;
        }
    }
    (near, all)
}

/// Relative RMS error of `fbar` against exact values.
pub fn relative_rms(a: &Effective, exact: &[[f64; 3]]) -> f64 {
    let squares = |f: &dyn Fn(usize, usize) -> f64| (0..exact.len()).flat_map(|k| (0..3).map(move |c| f(k, c).powi(2))).sum::<f64>();
    (squares(&|k, c| a.values[k].fbar[c] - exact[k][c]) / squares(&|k, c| exact[k][c])).sqrt()
}

/// `fbar` of the Lambertian plane for a light at height `cos_i`.
pub fn flat_fbar(cos_i: f64) -> [f64; 3] {
    ALBEDO.map(|a| a / PI * cos_i)
}

/// `fbar` of Lambertian V-grooves along y for any directions, direct light only: of each wall the part below the shadow line and below the
/// line of sight is lost, `(t - s)/(t + s)` of it for a slope `t` of the direction across the groove and `s = half / depth` of the
/// wall's normal, if `t > s`.
pub fn v_groove_fbar(pair: &Pair, period: f64, depth: f64) -> [f64; 3] {
    let s = 0.5 * period / depth;
    let wall = |side: f64| {
        let cos = |w: DVec3| ((side * w.x + s * w.z) / 1.0_f64.hypot(s)).max(0.0);
        let shown = |w: DVec3| {
            let t = side * w.x / w.z;
            if t > s { 2.0 * s / (t + s) } else { 1.0 }
        };
        // A wall has sqrt(1 + 1/s²)/2 of the footprint.
        cos(pair.wi) * cos(pair.wo) * shown(pair.wi).min(shown(pair.wo)) * 0.5 * 1.0_f64.hypot(1.0 / s)
    };
    ALBEDO.map(|a| a / PI * (wall(1.0) + wall(-1.0)) / pair.wo.z)
}
