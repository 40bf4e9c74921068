//! The tables of `docs/iwasaki-2012.md`, after Iwasaki, Dobashi and Nishita 2012.
//!
//! `accuracy`: PSNR of the effective BRDF against the number of lobes, as published and improved. `figure5`: the error of the closure of two lobes in one.
//! `speed`: a geometry edit and a material edit at 144 x 144 directions.
//!
//! usage: `cargo bench --bench paper_iwasaki2012 -- [accuracy|figure5|speed]...`

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::brdf::{Brdf, Distribution, Measured};
use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Quality, effective};
use biscale::material::SmallScale;
use biscale::sg::Lobe;
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];

fn main() {
    let arguments = common::arguments();
    let all: [(&str, fn()); 3] = [("accuracy", accuracy), ("figure5", figure_5), ("speed", speed)];
    for (name, run) in all {
        if arguments.is_empty() || arguments.iter().any(|a| a == name) {
            println!("\n{name}");
            run();
        }
    }
}

/// The paper's Blinn-Phong exponent, both roughnesses of the truth set, and a measured metal.
fn brdfs() -> [(&'static str, Brdf); 4] {
    [
        ("Blinn-Phong 512", Brdf::BlinnPhong { diffuse: [0.0; 3], specular: [0.8; 3], exponent: 512.0 }),
        ("GGX .3", common::lobe(0.3, Distribution::Ggx)),
        ("GGX .05", common::lobe(0.05, Distribution::Ggx)),
        ("alum-bronze, fit", Brdf::Measured(Arc::new(Measured::fit("alum-bronze", 1.0).unwrap()))),
    ]
}

fn pairs(tile: &str) -> Vec<Pair> {
    let direction = |v: &[f64]| DVec3::from_slice(v).normalize();
    common::truth_rows(&format!("{tile}.pairs.csv")).iter().map(|r| Pair { wi: direction(&r[..3]), wo: direction(&r[3..]) }).collect()
}

fn run(small: &SmallScale, pairs: &[Pair], plan: &str) -> Effective {
    let start = Instant::now();
    let clock = move || start.elapsed().as_secs_f64();
    let cancel = AtomicBool::new(false);
    let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &clock };
    effective(small, pairs, &Quality { plan: Some(plan.parse().unwrap()), ..Quality::default() }, &control).unwrap()
}

fn psnr(got: &Effective, truth: &Effective) -> f64 {
    let channels = || got.values.iter().zip(&truth.values).flat_map(|(g, t)| (0..3).map(move |c| (g.fbar[c], t.fbar[c])));
    let peak = channels().map(|(_, t)| t).fold(0.0, f64::max);
    let squares: f64 = channels().map(|(g, t)| (g - t).powi(2)).sum();
    10.0 * (peak * peak * channels().count() as f64 / squares).log10()
}

/// Each cell: dB for so many amplitudes a pair. The truth is `direct` with half a million facets.
fn accuracy() {
    println!(
        "| tile | BRDF | paper, J = 4 | 8 | 16 | 64 | improved, J = 4 | 8 | 16 | 64 | improved 8, error told over true | MB at 144 x 144 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for tile in TILES {
        let pairs = pairs(tile);
        for (name, brdf) in brdfs() {
            let small = common::covered(tile, brdf);
            let truth = run(&small, &pairs, "direct:524288x1");
            let mut cells = Vec::new();
            for lobes in [4, 8, 16, 64] {
                cells.push(format!("{:.1}", psnr(&run(&small, &pairs, &format!("sg:paper:lobes={lobes}")), &truth)));
            }
            let mut told = 0.0;
            for groups in [4, 8, 16, 64] {
                let got = run(&small, &pairs, &format!("sg:improved:facets=32768:lobes={}:groups={groups}", (16 * groups).min(512)));
                cells.push(format!("{:.1}", psnr(&got, &truth)));
                if groups == 8 {
                    let (mut difference, mut energy) = (0.0, 0.0);
                    for (g, t) in got.values.iter().zip(&truth.values) {
                        (0..3).for_each(|c| difference += (g.fbar[c] - t.fbar[c]).powi(2));
                        (0..3).for_each(|c| energy += t.fbar[c].powi(2));
                    }
                    told = got.summary.relative_rms / f64::sqrt(difference / energy);
                }
            }
            // Each pair and its reverse are one; an amplitude is two colours in f32.
            let megabytes = (144 * 145 / 2 * 8 * 24) as f64 / 1e6;
            println!("| {tile} | {name} | {} | {told:.2} | {megabytes:.2} |", cells.join(" | "));
        }
    }
}

/// Largest error of the closure over all angles, as the paper prints it: of lobes with an integral of 1.
fn figure_5() {
    println!("| sharpness | largest error | share of the peak |");
    println!("|---|---|---|");
    for [a, b] in [[10.0, 10.0], [10.0, 100.0], [40.0, 512.0], [100.0, 1000.0], [1e3, 1e3], [1e4, 1e5]] {
        let worst = (0..=1800)
            .map(|k| {
                let (sin, cos) = (f64::from(k) / 1800.0 * PI).sin_cos();
                #[expect(clippy::cast_possible_truncation, reason = "lobes are in f32")]
                let (x, y) = (Lobe::density(Vec3::Z, a as f32), Lobe::density(Vec3::new(sin as f32, 0.0, cos as f32), b as f32));
                f64::from((x.product_closure(&y).eval(x.axis) - x.product_integral(&y)).abs())
            })
            .fold(0.0, f64::max);
        let peak = a * b / (2.0 * PI * (a + b));
        println!("| {a}, {b} | {worst:.1e} | {:.1e} |", worst / peak);
    }
}

/// A grid of 12 x 12 directions, and all its pairs.
fn grid() -> Vec<Pair> {
    let directions: Vec<DVec3> = (0..144)
        .map(|k| {
            let (row, column) = (f64::from(k / 12) + 0.5, f64::from(k % 12) + 0.5);
            let z = row / 12.0;
            let azimuth = TAU * column / 12.0;
            DVec3::new((1.0 - z * z).sqrt() * azimuth.cos(), (1.0 - z * z).sqrt() * azimuth.sin(), z)
        })
        .collect();
    directions.iter().flat_map(|&wi| directions.iter().map(move |&wo| Pair { wi, wo })).collect()
}

/// Milliseconds of each stage, the least of five runs: what the machine does when nothing else runs.
fn speed() {
    println!(
        "| surface | lobes, groups | geometry edit, ms | per s | of it visibility | lobes | amplitudes | BRDF edit, ms | CPU s of all |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let pairs = grid();
    for tile in TILES {
        let small = common::covered(tile, common::lobe(0.3, Distribution::Ggx));
        for (lobes, groups) in [(8, 8), (32, 8), (128, 8)] {
            let plan = format!("sg:improved:facets=4096:lobes={lobes}:groups={groups}");
            let mut best: Option<([f64; 5], f64)> = None;
            for _ in 0..5 {
                let (got, cost) = common::measure(|| run(&small, &pairs, &plan));
                let stages: [f64; 5] = std::array::from_fn(|k| got.summary.stages[k].1);
                if best.is_none_or(|(b, _)| stages.iter().sum::<f64>() < b.iter().sum()) {
                    best = Some((stages, cost.cpu));
                }
            }
            let ([facets, visibility, fit, amplitudes, integrals], cpu) = best.unwrap();
            let geometry = facets + visibility + fit + amplitudes;
            println!(
                "| {tile} | {lobes}, {groups} | {geometry:.1} | {:.0} | {visibility:.1} | {fit:.1} | {amplitudes:.1} | {integrals:.1} | {cpu:.3} |",
                1e3 / geometry
            );
        }
    }
}
