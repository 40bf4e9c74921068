//! Bidirectional texture functions against those of an independent path tracer, and against the effective BRDF that they average to.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]
#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
#[path = "support/btf_truth.rs"]
mod btf_truth;

use biscale::btf::{BtfQuestion, DirectionSet, LightFit, PlaneHeight, Ptm, ReferencePlane, ViewLights, render};
use biscale::direction::Pair;
use biscale::filter::{Control, Method, Quality, effective};
use biscale::material::Material;
use btf_truth::BtfTruth;
use glam::DVec3;
use std::path::Path;

const CASES: [(&str, &str, &str, PlaneHeight); 6] = [
    ("weave", "weave", "diffuse", PlaneHeight::Middle),
    ("weave", "weave", "ggx_0.30", PlaneHeight::Middle),
    ("weave", "weave.top", "diffuse", PlaneHeight::Top),
    ("bumpy", "bumpy", "ggx_0.30", PlaneHeight::Middle),
    ("pyramid", "pyramid", "diffuse", PlaneHeight::Middle),
    ("pyramid", "pyramid", "ggx_0.30", PlaneHeight::Middle),
];

#[test]
fn default_settings_keep_one_percent_and_claimed_errors_are_those_that_are_there() {
    for (tile, set, brdf, height) in CASES {
        let truth = BtfTruth::load(tile, set, brdf, height);
        for tolerance in [0.03, 0.01] {
            let began = std::time::Instant::now();
            let (images, summary) = truth.render(tolerance, 1);
            let off = truth.relative_rms(&images);
            let (of_means, of_texels) = truth.cover_off(&images);
            println!(
                "{set} {brdf} {tolerance}: {} samples, off {off:.4}, claimed {:.4}, cover {of_means:.5} {of_texels:.5}, filled {}, {:.1} s",
                summary.samples,
                summary.relative_rms,
                summary.filled,
                began.elapsed().as_secs_f64()
            );
            assert!(off <= tolerance, "{set} {brdf}: {off}");
            let claimed = summary.relative_rms / off;
            assert!((1.0 / 1.5..1.5).contains(&claimed), "{set} {brdf} {tolerance}: {off}, claimed {}", summary.relative_rms);
            assert!(of_means < 0.01 && of_texels < 0.02, "{set} {brdf}: {of_means} {of_texels}");
        }
    }
}

/// The mean over texels is `fbar av / (A cos(theta_o))`, by the method that knows nothing of texels.
#[test]
fn the_mean_over_texels_is_the_effective_brdf() {
    for (tile, brdf) in [("weave", "ggx_0.30"), ("rods", "diffuse"), ("bumpy", "ggx_0.30"), ("vgroove", "diffuse")] {
        let path = format!("{}/tests/data/truth/{tile}.{brdf}.toml", env!("CARGO_MANIFEST_DIR"));
        let small = Material::load(Path::new(&path)).unwrap().build().unwrap();
        // With `ALL=1` all of the 6,561 pairs.
        let set = DirectionSet::named("ubo81").unwrap().directions;
        let step = if std::env::var("ALL").is_ok() { 1 } else { 9 };
        let views: Vec<ViewLights> = set.iter().step_by(step).map(|&wo| ViewLights { wo, lights: set.clone() }).collect();
        let plane = ReferencePlane::new(&small.tile, PlaneHeight::Middle, [16, 16]);
        let question = BtfQuestion { plane, views: &views, tolerance: 0.02, seed: 3 };
        let mut means = Vec::new();
        let summary = render(&small, question, &Control::quiet(), &mut |_, images| {
            means.extend(images.means);
            Ok(())
        });
        let pairs: Vec<Pair> = views.iter().flat_map(|v| v.lights.iter().map(|&wi| Pair { wi, wo: v.wo })).collect();
        let quality = Quality { method: Method::Direct, tolerance: 0.001, seed: 11, ..Quality::default() };
        let effective = effective(&small, &pairs, &quality, &Control::quiet()).unwrap();
        let (mut within, mut largest, mut all, mut off, mut values, mut squares) = (0, 0.0_f64, 0, 0.0, 0.0, 0.0);
        for ((mean, value), pair) in means.iter().zip(&effective.values).zip(&pairs) {
            let scale = value.av / pair.wo.z;
            for c in 0..3 {
                let expected = value.fbar[c] * scale;
                let z = (mean.mean[c] - expected) / mean.error[c].hypot(value.se[c] * scale).max(1e-4 * expected + 1e-9);
                all += 1;
                squares += z * z;
                within += usize::from(z.abs() <= 3.0);
                largest = largest.max(z.abs());
                off += (mean.mean[c] - expected).powi(2);
                values += expected * expected;
            }
        }
        let rms = (squares / f64::from(all)).sqrt();
        println!("{tile} {brdf}: {:?}, {within} of {all} within 3, largest {largest:.1}, RMS {rms:.2}", summary.unwrap());
        println!("    off {:.5}", (off / values).sqrt());
        assert!((0.4..1.2).contains(&rms), "{tile} {brdf}: RMS {rms}");
        assert!(within as f64 >= 0.995 * all as f64 && (off / values).sqrt() < 0.005, "{tile} {brdf}: {within} of {all}, {largest}");
    }
}

#[test]
fn the_bits_are_the_same_at_any_number_of_threads() {
    let truth = BtfTruth::load("weave", "weave", "ggx_0.30", PlaneHeight::Middle);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| truth.render(0.05, 5))
    };
    assert_eq!(with(1), with(3));
}

/// Fits by numpy of the same data: `tests/data/truth_btf/README.md`.
#[test]
fn polynomials_are_as_near_to_the_data_as_those_of_another_program() {
    let (lights, slots) = btf_truth::slots();
    let fit = LightFit::new(&lights).unwrap();
    for (s, singular) in
        fit.singular_values.iter().zip([7.0945854394, 3.6831367518, 3.6831367518, 2.334406003476, 1.6506743151, 1.2513034088])
    {
        assert!((s - singular).abs() < 1e-6, "{:?}", fit.singular_values);
    }
    for (images, [rgb, luminance]) in slots.iter().zip([[0.4773664765396, 0.4773743174790], [0.5515042064669, 0.5525076925917]]) {
        let of_rgb = Ptm::fit_rgb(&fit, [24, 24], images).relative_rms(&lights, images);
        let of_luminance = Ptm::fit_luminance(&fit, [24, 24], images).relative_rms(&lights, images);
        assert!((of_rgb - rgb).abs() < 1e-5 && (of_luminance - luminance).abs() < 1e-5, "{of_rgb} {of_luminance}");
    }
}

/// Twelve photographs and the file that Hewlett-Packard's fitter made of them: `tests/data/ptm_8x5`.
#[test]
fn a_file_of_the_first_fitter_is_read_and_matched() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ptm_8x5");
    let theirs = Ptm::read(&std::fs::read(folder.join("reference_8x5.ptm")).unwrap()).unwrap();
    assert_eq!(theirs.texels, [8, 5]);
    let list = std::fs::read_to_string(folder.join("reference_8x5.lp")).unwrap();
    let (mut lights, mut images) = (Vec::new(), Vec::new());
    for line in list.lines().skip(1).filter(|l| !l.trim().is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        lights.push(DVec3::from_slice(&words[1..].iter().map(|w| w.parse().unwrap()).collect::<Vec<f64>>()));
        let image = image::open(folder.join(words[0])).unwrap().to_rgb8();
        images.extend(image.pixels().map(|p| p.0.map(|v| f32::from(v) / 255.0)));
    }
    let of_theirs = theirs.relative_rms(&lights, &images);
    let fit = LightFit::new(&lights).unwrap();
    let ours = Ptm::fit_luminance(&fit, [8, 5], &images);
    let mut bytes = Vec::new();
    ours.write(&mut bytes).unwrap();
    let of_ours = Ptm::read(&bytes).unwrap().relative_rms(&lights, &images);
    println!("theirs {of_theirs}, ours {} and {of_ours} from its file", ours.relative_rms(&lights, &images));
    assert!(of_theirs < 0.011 && of_ours <= of_theirs, "{of_theirs} {of_ours}");
}
