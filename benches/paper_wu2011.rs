//! The tables of Wu et al. 2011 that are about precision, made again: `docs/wu-2011.md`.
//!
//! `table3`: the compressed `M` of the paper's materials. `figure11`: what is lost with few vectors of `N`. `table4`: the published method against
//! the reference on five scenes. `figure7`: the best fit of a Lambertian and a Cook-Torrance lobe to shot silk.
//!
//! usage: `cargo bench --bench paper_wu2011 -- [table3|figure11|table4|figure7]...`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::brdf::{Brdf, Distribution, Measured};
use biscale::filter::low_rank::map::Projection;
use biscale::filter::low_rank::precomputed::{Precomputed, Settings};
use biscale::filter::{Effective, LARGEST_MAPS, LowRankPlan, MatrixCache, Method, Quality, Variant};
use biscale::material::{Material, SmallScale};
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;

/// Material, and of the paper's table 3: rows, columns, rank, size before and after in MB, seconds.
const TABLE_3: [(&str, usize, usize, usize, f64, f64, f64); 11] = [
    ("Lambertian", 8_778, 448, 7, 30.0, 0.23, 22.0),
    ("Ward .3", 161_596, 3_768, 37, 4_645.49, 22.81, 1_573.5),
    ("Cook-Torrance .5", 46_056, 1_512, 17, 531.29, 2.99, 262.8),
    ("Cook-Torrance .2", 1_725_153, 6_442, 70, 84_788.78, 460.67, 93_409.3),
    ("pearl-paint", 49_141, 2_042, 40, 765.58, 7.5, 681.3),
    ("silver-paint", 161_596, 3_768, 61, 4_645.49, 37.6, 4_276.5),
    ("silver-metallic-paint2", 283_128, 6_442, 94, 13_915.33, 101.52, 10_172.2),
    ("gold-metallic-paint", 453_628, 6_442, 93, 22_295.16, 160.93, 15_282.9),
    ("blue-metallic-paint", 453_628, 6_442, 95, 22_295.16, 164.39, 20_835.7),
    ("special-walnut-224", 935_028, 4_250, 50, 30_318.21, 178.34, 38_016.3),
    ("white-diffuse-bball", 49_141, 626, 10, 234.7, 1.87, 1_138.9),
];

/// Scene of the paper's table 4, the sample nearest to it, seconds of the paper's ground truth and of its method, and its PSNR in dB.
const TABLE_4: [(&str, &str, f64, f64, f64); 5] = [
    ("plate", "fig5b", 10_410.3, 2.43, 17.36),
    ("teapot", "fig8b", 7_668.7, 1.30, 19.27),
    ("pillow", "fig7b", 2_242.2, 1.63, 20.01),
    ("cup", "fig4b", 2_992.1, 0.75, 18.86),
    ("skirt", "fig6b", 6_430.8, 2.14, 22.66),
];

fn main() {
    let arguments = common::arguments();
    let all: [(&str, fn()); 4] = [("table3", table_3), ("figure11", figure_11), ("table4", table_4), ("figure7", figure_7)];
    for (name, run) in all {
        if arguments.is_empty() || arguments.iter().any(|a| a == name) {
            println!("\n{name}");
            run();
        }
    }
}

fn material(name: &str) -> Brdf {
    let cook_torrance = |alpha| common::lobe(alpha, Distribution::Beckmann);
    match name {
        "Lambertian" => common::diffuse(),
        "Ward .3" => Brdf::Ward { diffuse: [0.0; 3], specular: [0.5; 3], alpha: 0.3 },
        "Cook-Torrance .5" => cook_torrance(0.5),
        "Cook-Torrance .2" => cook_torrance(0.2),
        measured => Brdf::Measured(Arc::new(Measured::fit(measured, 1.0).unwrap())),
    }
}

fn table_3() {
    println!(
        "| material | rows | columns | MB | kept MB | rate | rank | energy | CPU s | missed by directions, normals | paper: rows | columns | rank | kept MB | s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let LowRankPlan::Paper { directions, energy, .. } = LowRankPlan::PAPER else {
        unreachable!("the paper's plan is of the paper's variant")
    };
    for (name, rows, columns, rank, _, kept, seconds) in TABLE_3 {
        let brdf = material(name);
        let settings = Settings {
            projection: Projection::Paraboloid,
            least_directions: directions,
            largest: LARGEST_MAPS,
            energy: energy[1],
            seed: 1,
        };
        let (m, cost) = common::measure(|| Precomputed::compute(&brdf, &settings, &|_| Ok(())).unwrap());
        println!(
            "| {name} | {} | {} | {:.1} | {:.2} | {:.0}:1 | {} | {:.1} % | {:.1} | {:.1} %, {:.1} %{} | {rows} | {columns} | {rank} | {kept} | {seconds} |",
            m.pairs.rows(),
            m.normals.directions.len(),
            m.whole_bytes() as f64 / 1e6,
            m.bytes() as f64 / 1e6,
            m.whole_bytes() as f64 / m.bytes() as f64,
            m.rank(),
            100.0 * m.energy,
            cost.cpu,
            100.0 * m.rates.missed_by_directions,
            100.0 * m.rates.missed_by_normals,
            if m.rates.insufficient() { " (clamped)" } else { "" }
        );
    }
}

fn sample(name: &str) -> SmallScale {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("samples/figures/{name}.toml"));
    Material::load(&path).unwrap().build().unwrap()
}

/// PSNR in dB and relative RMS difference of `fbar`.
fn compared(truth: &Effective, got: &Effective) -> (f64, f64) {
    let (mut squares, mut energy, mut peak, mut count) = (0.0, 0.0, 0.0_f64, 0.0);
    for (a, b) in truth.values.iter().zip(&got.values) {
        for c in 0..3 {
            squares += (a.fbar[c] - b.fbar[c]).powi(2);
            energy += a.fbar[c].powi(2);
            peak = peak.max(a.fbar[c]);
            count += 1.0;
        }
    }
    (10.0 * (peak * peak * count / squares).log10(), (squares / energy).sqrt())
}

fn plan(text: String) -> Quality {
    Quality { plan: Some(text.parse().expect("a plan")), ..Quality::default() }
}

fn figure_11() {
    println!("| sample | kept of N's power | vectors of N | PSNR dB | relative RMS |\n|---|---|---|---|---|");
    for name in ["fig4c", "fig5b"] {
        let mut small = sample(name);
        // A wide lobe, so that M's part of the error is small.
        let rough = material("Cook-Torrance .5");
        small.surfaces.iter_mut().for_each(|s| s.brdf = rough.clone());
        let pairs = common::projected_pairs(512);
        let truth = common::run(&small, &pairs, &Quality { method: Method::Reference, tolerance: 0.01, ..Quality::default() });
        for kept in [0.2, 0.5, 0.8, 0.9, 0.95, 0.98, 0.995, 0.9985, 0.9999] {
            let got = common::run(&small, &pairs, &plan(format!("lowrank:paper:energy={kept},0.98")));
            let ranks: Vec<String> = got.summary.low_rank.iter().map(|f| f.n_rank.to_string()).collect();
            let (psnr, rms) = compared(&truth, &got);
            println!("| {name} | {:.2} % | {} | {psnr:.1} | {:.1} % |", 100.0 * kept, ranks.join(", "), 100.0 * rms);
        }
    }
}

fn table_4() {
    println!(
        "| scene | sample | reference, CPU s a 1,000 pairs | M, CPU s once | lowrank, CPU s | pairs of M | reference over lowrank | PSNR dB | improved, PSNR dB | paper: rate | PSNR dB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let pairs = common::projected_pairs(1000);
    let folder = tempfile::tempdir().unwrap();
    let cache = MatrixCache { folder: folder.path().to_path_buf(), max_bytes: 8 << 30 };
    for (scene, name, truth_s, ours_s, paper_psnr) in TABLE_4 {
        let small = sample(name);
        let (truth, truth_cost) =
            common::measure(|| common::run(&small, &pairs, &Quality { method: Method::Reference, tolerance: 0.01, ..Quality::default() }));
        let quality = Quality {
            cache: Some(cache.clone()),
            ..plan(format!("lowrank:paper:facets=8000:rates={}x{}", LARGEST_MAPS.directions, LARGEST_MAPS.normals))
        };
        let (_, first) = common::measure(|| common::run(&small, &pairs[..1], &quality));
        let (got, cost) = common::measure(|| common::run(&small, &pairs, &quality));
        let (psnr, _) = compared(&truth, &got);
        let improved = Quality { method: Method::LowRank, variant: Some(Variant::Improved), tolerance: 0.01, ..Quality::default() };
        let (better, _) = compared(&truth, &common::run(&small, &pairs, &improved));
        let rows = got.summary.low_rank.iter().map(|f| f.m_size[0]).max().unwrap();
        println!(
            "| {scene} | {name} | {:.1} | {:.1} | {:.2} | {rows} | {:.0}:1 | {psnr:.1} | {better:.1} | {:.0}:1 | {paper_psnr} |",
            truth_cost.cpu,
            first.cpu,
            cost.cpu,
            truth_cost.cpu * rows as f64 / 1000.0 / cost.cpu,
            truth_s / ours_s
        );
    }
}

/// Least squares with two columns and coefficients of at least 0.
fn two_columns(a: &[f64], b: &[f64], y: &[f64]) -> [f64; 2] {
    let dot = |x: &[f64], z: &[f64]| x.iter().zip(z).map(|(x, z)| x * z).sum::<f64>();
    let (aa, ab, bb, ay, by) = (dot(a, a), dot(a, b), dot(b, b), dot(a, y), dot(b, y));
    let det = aa * bb - ab * ab;
    let both = [(ay * bb - by * ab) / det, (by * aa - ay * ab) / det];
    if both[0] >= 0.0 && both[1] >= 0.0 {
        return both;
    }
    // One of them is 0: the better of the two.
    let (only_a, only_b) = ((ay / aa).max(0.0), (by / bb).max(0.0));
    if only_a * (2.0 * ay - only_a * aa) >= only_b * (2.0 * by - only_b * bb) { [only_a, 0.0] } else { [0.0, only_b] }
}

fn figure_7() {
    println!(
        "| sample | alpha | diffuse | specular | relative RMS of the fit | of a grey fit | hue: spread of red over blue | of the fit |\n|---|---|---|---|---|---|---|---|"
    );
    let pairs = common::projected_pairs(2000);
    for name in ["figures/fig7a", "figures/fig7b", "shot-silk"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("samples/{name}.toml"));
        let small = Material::load(&path).unwrap().build().unwrap();
        let silk = common::run(&small, &pairs, &Quality { tolerance: 0.01, ..Quality::default() });
        let of = |brdf: &Brdf| -> Vec<f64> { pairs.iter().map(|p| brdf.eval(DVec3::Z, p.wi, p.wo)[0] * p.wi.z).collect() };
        let diffuse = of(&Brdf::Lambert { albedo: [1.0; 3] });
        let fit = |alpha: f64| {
            let specular =
                of(&Brdf::CookTorrance { diffuse: [0.0; 3], specular: [1.0; 3], alpha, distribution: Distribution::Beckmann, f0: None });
            let mut squares = 0.0;
            let colours = [0, 1, 2].map(|c| {
                let y: Vec<f64> = silk.values.iter().map(|v| v.fbar[c]).collect();
                let found = two_columns(&diffuse, &specular, &y);
                squares += y.iter().zip(&diffuse).zip(&specular).map(|((y, d), s)| (y - found[0] * d - found[1] * s).powi(2)).sum::<f64>();
                found
            });
            (squares, alpha, colours, specular)
        };
        let best = (1..=100).map(|k| fit(f64::from(k) / 100.0)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        let energy: f64 = silk.values.iter().flat_map(|v| v.fbar).map(|x| x * x).sum();
        let (_, alpha, colours, specular) = &best;
        // How far apart hues are: standard deviation of the logarithm of red over blue, over pairs, in proportion to light.
        let spread = |value: &dyn Fn(usize) -> [f64; 3]| {
            let (mut w, mut m, mut s) = (0.0, 0.0, 0.0);
            for k in 0..pairs.len() {
                let [r, g, b] = value(k);
                if r > 0.0 && b > 0.0 {
                    let (weight, x) = (r + g + b, (r / b).ln());
                    w += weight;
                    m += weight * x;
                    s += weight * x * x;
                }
            }
            (s / w - (m / w).powi(2)).max(0.0).sqrt()
        };
        let fitted = |k: usize| [0, 1, 2].map(|c: usize| colours[c][0] * diffuse[k] + colours[c][1] * specular[k]);
        let show = |which: usize| colours.map(|c| format!("{:.3}", c[which])).join(", ");
        // The same colour everywhere, brightness right: what hue alone is worth.
        let mean: [f64; 3] = [0, 1, 2].map(|c: usize| silk.values.iter().map(|v| v.fbar[c]).sum());
        let sum: f64 = mean.iter().sum();
        let grey: f64 = silk
            .values
            .iter()
            .flat_map(|v| {
                let all: f64 = v.fbar.iter().sum();
                (0..3).map(move |c| v.fbar[c] - all * mean[c] / sum)
            })
            .map(|d| d * d)
            .sum();
        println!(
            "| {name} | {alpha:.2} | {} | {} | {:.1} % | {:.1} % | {:.3} | {:.3} |",
            show(0),
            show(1),
            100.0 * (best.0 / energy).sqrt(),
            100.0 * (grey / energy).sqrt(),
            spread(&|k| silk.values[k].fbar),
            spread(&fitted)
        );
    }
}
