//! The kernels against their plain twins: sums in lanes and over clusters against a loop over facets with `Brdf::eval`.

use super::facet_sampler::{Batch, FacetSampler};
use super::sums::{Materials, PairSums, add_pairs, surface_lobes};
use super::*;
use crate::direction::Pair;
use crate::facets::{Clustering, REPLICATES, Runs};
use crate::material::{Material, SmallScale, Tint, TintImage};
use crate::toml_reader::Source;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// BRDFs of every model, rough, and so narrow that the half angle must come from differences.
const MODELS: [&str; 11] = [
    "{ model = \"lambert\", albedo = [0.8, 0.4, 0.2] }",
    "{ model = \"blinn-phong\", diffuse = 0.1, specular = 0.5, exponent = 20 }",
    "{ model = \"blinn-phong\", specular = 0.5, exponent = 1e6 }",
    "{ model = \"cook-torrance\", diffuse = 0.2, specular = [0.8, 0.4, 0.2], alpha = 0.3, f0 = 0.04 }",
    "{ model = \"cook-torrance\", specular = 0.5, alpha = 1.0 }",
    "{ model = \"cook-torrance\", specular = 0.5, alpha = 0.001 }",
    "{ model = \"cook-torrance\", specular = 0.5, alpha = 0.2, distribution = \"beckmann\" }",
    "{ model = \"cook-torrance\", specular = 0.5, alpha = 0.002, distribution = \"beckmann\" }",
    "{ model = \"ward\", diffuse = 0.1, specular = 0.5, alpha = 0.15 }",
    "{ model = \"ward\", specular = 0.5, alpha = 0.001 }",
    "{ model = \"measured\", name = \"gold-metallic-paint\" }",
];

fn surface(brdf: &str) -> SmallScale {
    let text = format!("format = 1\n[geometry]\nkind = \"pyramids\"\n[[surface]]\npart = \"*\"\nbrdf = {brdf}\n");
    Material::parse(&Source { path: "m.toml".into(), text }).unwrap().build().unwrap()
}

/// Spread directions, some pairs with the half vector on the normals of the pyramids, and some nearly there.
fn pairs(small: &SmallScale) -> Vec<Pair> {
    let spread = |k: u32| {
        let (z, phi) = (1.0 - f64::from(k) / 13.0, 2.4 * f64::from(k));
        DVec3::new(phi.cos(), phi.sin(), 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
    };
    let mut pairs: Vec<Pair> = (0..12).flat_map(|i| (0..12).map(move |o| Pair { wi: spread(i), wo: spread(o) })).collect();
    let corners = small.tile.corners(0);
    let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
    for tilt in [0.0, 1e-4, 1e-3, 0.03] {
        for k in 1..8 {
            let wi = spread(k);
            let h = (n + tilt * DVec3::X).normalize();
            pairs.push(Pair { wi, wo: 2.0 * wi.dot(h) * h - wi });
        }
    }
    pairs.retain(|p| p.wo.z > 0.0);
    pairs
}

static NEVER: AtomicBool = AtomicBool::new(false);
static CONTROL: Control<'static> = Control { cancel: &NEVER, progress: &|_, _| {}, clock: &|| 0.0 };

fn traced<'a>(small: &'a SmallScale, query: &Query, clustering: Option<&Clustering>, samples: u32) -> (FacetSampler<'a>, Batch) {
    let sampler = FacetSampler::new(small, clustering, 5, &CONTROL);
    let batch = sampler.batch(Runs::of_block(0, samples, 0, 1), &query.directions).unwrap();
    (sampler, batch)
}

/// The sums by a loop over facets.
fn by_loop(small: &SmallScale, sampler: &FacetSampler<'_>, batch: &Batch, query: &Query) -> Vec<PairSums> {
    let facets = &batch.facets;
    let one = |&[i, o]: &[u32; 2]| {
        let (wi, wo) = (query.directions[i as usize], query.directions[o as usize]);
        let mut sums = [[0.0; 3]; REPLICATES];
        for (f, &t) in facets.triangle.iter().enumerate() {
            let sees = |d: u32| batch.bits.row(d as usize)[f / 64] >> (f % 64) & 1 == 1;
            if sees(i) && sees(o) {
                let s = &small.surfaces[usize::from(sampler.surface.surface[t as usize])];
                let n = sampler.surface.normals[t as usize];
                let fr = s.brdf.eval(n, wi, wo);
                for c in 0..3 {
                    let tint = match &s.tint {
                        Tint::Uniform(tint) => tint[c],
                        Tint::Image(_) => f64::from(facets.tint.as_ref().unwrap()[c][f]),
                    };
                    sums[f % REPLICATES][c] += f64::from(facets.weight[f]) * tint * fr[c] * n.dot(wi).max(0.0) * n.dot(wo).max(0.0);
                }
            }
        }
        sums
    };
    query.pairs.iter().map(one).collect()
}

/// Asserts that sums agree to `relative` of the value and `absolute` of the largest.
fn assert_agree(got: &[PairSums], expected: &[PairSums], relative: f64, absolute: f64, what: &str) {
    let largest = expected.iter().flatten().flatten().fold(0.0_f64, |a, &b| a.max(b));
    assert!(largest > 0.0, "{what}: nothing to compare");
    for (k, (got, expected)) in got.iter().flatten().flatten().zip(expected.iter().flatten().flatten()).enumerate() {
        let bound = relative * expected + absolute * largest;
        assert!((got - expected).abs() <= bound, "{what}, value {k}: {got} for {expected}, largest {largest}");
    }
}

fn sums(small: &SmallScale, sampler: &FacetSampler<'_>, batch: &Batch, query: &Query, by_clusters: bool) -> Vec<PairSums> {
    let lobes = surface_lobes(&small.surfaces);
    let mut sums = vec![[[0.0; 3]; REPLICATES]; query.pairs.len()];
    add_pairs(batch, query, &query.tasks(), &Materials::new(&sampler.surface.groups, &lobes, by_clusters), &mut sums);
    sums
}

#[test]
fn sums_in_lanes_are_those_of_a_loop_over_facets() {
    for model in MODELS {
        let small = surface(model);
        let query = Query::new(&pairs(&small), false);
        let (sampler, batch) = traced(&small, &query, None, 1024);
        let expected = by_loop(&small, &sampler, &batch, &query);
        // Normals in f32 are off by 6e-8, which a lobe of roughness 1e-3 sees as 1e-4 of its width; exponent 1e6 is as narrow.
        assert_agree(&sums(&small, &sampler, &batch, &query, false), &expected, 1e-3, 1e-5, model);
    }
}

#[test]
fn sums_over_clusters_of_equal_normals_are_those_of_a_loop_over_facets() {
    for model in MODELS {
        let small = surface(model);
        let query = Query::new(&pairs(&small), false);
        let (sampler, batch) = traced(&small, &query, Some(&Clustering { spread: vec![0.0], most: 64 }), 1024);
        assert!(sampler.is_clustered() && sampler.surface.groups.len() == 4, "{} groups", sampler.surface.groups.len());
        let expected = by_loop(&small, &sampler, &batch, &query);
        assert_agree(&sums(&small, &sampler, &batch, &query, true), &expected, 1e-3, 1e-5, model);
    }
}

#[test]
fn a_tint_image_weighs_each_facet() {
    for model in MODELS {
        let mut small = surface(model);
        let image = TintImage { width: 2, height: 1, pixels: vec![[0.1, 0.5, 1.0], [1.0, 0.0, 0.3]] };
        small.surfaces[0].tint = Tint::Image(Arc::new(image));
        small.tile.uv =
            Some(small.tile.triangles.iter().map(|t| t.map(|v| small.tile.vertices[v as usize].truncate() / small.tile.period)).collect());
        let query = Query::new(&pairs(&small), false);
        let (sampler, batch) = traced(&small, &query, None, 1024);
        let expected = by_loop(&small, &sampler, &batch, &query);
        assert_agree(&sums(&small, &sampler, &batch, &query, false), &expected, 1e-3, 1e-5, model);
    }
}

#[test]
fn wide_clusters_of_a_smooth_surface_err_by_little_and_less_than_mean_normals_would() {
    let text = "format = 1\n[geometry]\nkind = \"mesh\"\nfile = \"bumpy.obj\"\nperiod = [1.0, 1.0]\n[[surface]]\npart = \"*\"\n\
                brdf = { model = \"cook-torrance\", specular = 1.0, alpha = 0.1 }\n";
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/truth/m.toml");
    let small = Material::parse(&Source { path, text: text.into() }).unwrap().build().unwrap();
    let query = Query::new(&pairs(&small), false);
    let (sampler, batch) = traced(&small, &query, Some(&Clustering { spread: vec![0.04], most: 8000 }), 1 << 16);
    let relative = |got: &[PairSums], expected: &[PairSums]| {
        let total = |s: &PairSums| s.iter().map(|set| set[0]).sum::<f64>();
        let difference: f64 = got.iter().zip(expected).map(|(a, b)| (total(a) - total(b)).powi(2)).sum();
        (difference / expected.iter().map(|s| total(s).powi(2)).sum::<f64>()).sqrt()
    };
    let expected = sums(&small, &sampler, &batch, &query, false);
    let widened = relative(&sums(&small, &sampler, &batch, &query, true), &expected);
    let mut narrow = sampler.surface.groups.clone();
    for group in &mut narrow {
        group.cluster.as_mut().unwrap().covariance = [0.0; 3];
    }
    let lobes = surface_lobes(&small.surfaces);
    let mut by_means = vec![[[0.0; 3]; REPLICATES]; query.pairs.len()];
    add_pairs(&batch, &query, &query.tasks(), &Materials::new(&narrow, &lobes, true), &mut by_means);
    let by_means = relative(&by_means, &expected);
    // Slopes spread by .4 of the roughness: far beyond what the direct method accepts.
    assert!(widened < 0.1 && widened < 0.7 * by_means, "widened {widened}, mean normals {by_means}");
}

#[test]
fn an_edit_to_a_table_that_is_not_reciprocal_looks_both_ways_round() {
    let small = surface("{ model = \"lambert\", albedo = 0.5 }");
    let pairs = pairs(&small);
    let quality = Quality { tolerance: 0.02, ..Quality::default() };
    let (prepared, _) = prepare(&small, &pairs, &quality, &CONTROL).unwrap();
    let mut edited = small;
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/brdf/paper_white_rgb.bsdf");
    edited.surfaces[0].brdf = crate::brdf::Brdf::Measured(crate::brdf::Measured::read(&file, 1.0).unwrap().into());
    let (values, _) = prepared.evaluate(&edited.surfaces, &CONTROL).unwrap();
    let (whole, _) = prepare(&edited, &pairs, &quality, &CONTROL).map(|(p, e)| (e.values, p)).unwrap();
    let apart = |a: &Value, b: &Value| (a.fbar[0] - b.fbar[0]).abs() / (a.fbar[0] + b.fbar[0] + 0.05);
    let worst = values.iter().zip(&whole).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst}");
    // The pairs of 12 x 12 directions: where S is not the same both ways round.
    let s = |i: usize, o: usize| values[12 * i + o].s[0];
    let asymmetric = (0..12).flat_map(|i| (0..i).map(move |o| (i, o))).filter(|&(i, o)| (s(i, o) / s(o, i) - 1.0).abs() > 1e-3).count();
    assert!(asymmetric > 10, "{asymmetric}");
}

#[test]
fn black_lobes_are_left_out() {
    let small = surface("{ model = \"cook-torrance\", diffuse = 0, specular = 0, alpha = 0.3 }");
    assert!(lobes(&small.surfaces[0].brdf, [1.0; 3]).is_empty());
    let small = surface("{ model = \"cook-torrance\", diffuse = 0.5, specular = 0.5, alpha = 0.3 }");
    assert_eq!(lobes(&small.surfaces[0].brdf, [0.0; 3]).len(), 0);
    assert!((lobes(&small.surfaces[0].brdf, [1.0; 3])[0].colour[0] - 0.5 / PI).abs() < 1e-15);
}
