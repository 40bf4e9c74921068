//! The tables of `docs/iwasaki-2012.md`, after Iwasaki, Dobashi and Nishita 2012.
//!
//! `accuracy`: PSNR of the effective BRDF against the number of lobes, as published and improved. `tolerance`: what a tolerance of 1 % gives. `figure5`: the error of the closure of two lobes in one.
//! `gamma`: the density of visible normals against the number of its lobes. `speed`: a geometry edit and a material edit at 144 x 144 directions.
//!
//! usage: `cargo bench --bench paper_iwasaki2012 -- [accuracy|tolerance|gamma|figure5|speed]... [TILE]...`; without names all

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

mod common;

use biscale::brdf::{Brdf, Distribution, Measured};
use biscale::direction::Pair;
use biscale::filter::{Effective, LobeValue, Method, Plan, Quality, Value, prepare_lobes};
use biscale::material::SmallScale;
use biscale::numerics::cast::truncate_usize;
use biscale::sg::{Lobe, Mixture, MixtureLobe, Order, WeightedDirection, distinct};
use biscale::visibility::{Occlusion, PeriodicBvh};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// What `tolerance` asks for.
const TOLERANCE: f64 = 0.01;
const TILES: [&str; 5] = ["vgroove", "pyramid", "rods", "weave", "bumpy"];

fn main() {
    let arguments = common::arguments();
    let all: [(&str, fn()); 5] =
        [("accuracy", accuracy), ("tolerance", tolerance), ("gamma", gamma), ("figure5", figure_5), ("speed", speed)];
    for (name, run) in all {
        if !arguments.iter().any(|a| all.iter().any(|(name, _)| a == name)) || arguments.iter().any(|a| a == name) {
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

/// The tiles that the arguments name, or all.
fn tiles() -> Vec<&'static str> {
    let arguments = common::arguments();
    let named: Vec<&str> = TILES.into_iter().filter(|tile| arguments.iter().any(|a| a == tile)).collect();
    if named.is_empty() { TILES.to_vec() } else { named }
}

fn pairs(tile: &str) -> Vec<Pair> {
    let direction = |v: &[f64]| DVec3::from_slice(v).normalize();
    common::truth_rows(&format!("{tile}.pairs.csv")).iter().map(|r| Pair { wi: direction(&r[..3]), wo: direction(&r[3..]) }).collect()
}

fn run(small: &SmallScale, pairs: &[Pair], plan: &str) -> Effective {
    common::run(small, pairs, &Quality { plan: Some(plan.parse().unwrap()), ..Quality::default() })
}

/// Values by `direct` with a million facets, of another seed than what is compared with them.
fn truth(small: &SmallScale, pairs: &[Pair]) -> Vec<Value> {
    common::run(small, pairs, &Quality { plan: Some("direct:1048576x1".parse().unwrap()), seed: 99, ..Quality::default() }).values
}

/// `fbar` of some pairs, all channels.
fn channels(values: &[Value]) -> impl Iterator<Item = f64> {
    values.iter().flat_map(|v| v.fbar)
}

/// Sum of the squared differences over all pairs and channels of `truth`, which are the first of `got`.
fn squares(got: &[Value], truth: &[Value]) -> f64 {
    channels(got).zip(channels(truth)).map(|(g, t)| (g - t).powi(2)).sum()
}

fn psnr(got: &[Value], truth: &[Value]) -> f64 {
    let peak = channels(truth).fold(0.0, f64::max);
    10.0 * (peak * peak * channels(truth).count() as f64 / squares(got, truth)).log10()
}

/// Each cell: dB for so many amplitudes a pair, on the pairs of the truth tests; modes are those of the whole grid. The truth is `direct` with half a million
/// facets.
fn accuracy() {
    println!("| tile | BRDF | paper, J = 4 | 8 | 16 | 64 | improved, J = 4 | 8 | 16 | 64 | grid, 8 | told over true, 8 | lobes | MB, 8 |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for tile in tiles() {
        let known = pairs(tile);
        // Some of the grid's pairs, then all of them.
        let listed: Vec<Pair> = known.iter().copied().chain(grid().into_iter().step_by(41)).collect();
        let all: Vec<Pair> = listed.iter().copied().chain(grid()).collect();
        for (name, brdf) in brdfs() {
            let small = common::covered(tile, brdf);
            let truth = truth(&small, &listed);
            let (of_tests, of_grid) = truth.split_at(known.len());
            let mut cells = Vec::new();
            for lobes in [4, 8, 16, 64] {
                cells.push(format!("{:.1}", psnr(&run(&small, &known, &format!("sg:paper:lobes={lobes}")).values, of_tests)));
            }
            let mut last = String::new();
            for modes in [4, 8, 16, 64] {
                let got = run(&small, &all, &format!("sg:improved:facets=32768:lobes=4096:modes={modes}"));
                cells.push(format!("{:.1}", psnr(&got.values, of_tests)));
                if modes == 8 {
                    let energy: f64 = channels(&truth).map(|t| t * t).sum();
                    let told = got.summary.relative_rms / f64::sqrt(squares(&got.values, &truth) / energy);
                    let on_grid = psnr(&got.values[known.len()..], of_grid);
                    let lobes = got.summary.clusters;
                    // Each pair and its reverse are one; beside the amplitudes the visible projected area. Each lobe with what the modes have of it.
                    let floats = 144 * 145 / 2 * (8.min(lobes) + 1) + lobes * 8;
                    let megabytes = (floats * size_of::<f32>() + lobes * size_of::<Lobe>()) as f64 / 1e6;
                    last = format!("{on_grid:.1} | {told:.2} | {lobes} | {megabytes:.2}");
                }
            }
            println!("| {tile} | {name} | {} | {last} |", cells.join(" | "));
        }
    }
}

/// Runs to a tolerance of 1 % with five seeds, and `direct` to the same, and to the error that these have.
fn tolerance() {
    println!(
        "| tile | BRDF | dB | true error, % | told over true | kept, said to be missed, broken | lobes | amplitudes | CPU s | direct, true error, % | CPU s | direct with that error, % | CPU s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for tile in tiles() {
        let listed: Vec<Pair> = pairs(tile).into_iter().chain(grid().into_iter().step_by(41)).collect();
        for (name, brdf) in brdfs() {
            let small = common::covered(tile, brdf);
            let truth = truth(&small, &listed);
            let energy: f64 = channels(&truth).map(|t| t * t).sum();
            let error = |got: &Effective| f64::sqrt(squares(&got.values, &truth) / energy);
            let of = |method, seed, tolerance| {
                let quality = Quality { method, tolerance, seed, ..Quality::default() };
                let (got, cost) = common::measure(|| common::run(&small, &listed, &quality));
                (error(&got), got, cost.cpu)
            };
            let runs: Vec<_> = (0..5).map(|seed| of(Method::SphericalGaussian, seed, TOLERANCE)).collect();
            let (direct_error, _, direct_cost) = of(Method::Direct, 0, TOLERANCE);
            let mean = runs.iter().map(|r| r.0).sum::<f64>() / runs.len() as f64;
            let (like_error, _, like_cost) = of(Method::Direct, 0, TOLERANCE * mean / direct_error);
            let range = |of: &dyn Fn(&(f64, Effective, f64)) -> f64, digits: usize| {
                let (low, high) = runs.iter().map(of).fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)));
                format!("{low:.digits$} to {high:.digits$}")
            };
            let modes = |got: &Effective| match got.summary.plan {
                Some(Plan::SphericalGaussian(plan)) => plan.modes as f64,
                _ => f64::NAN,
            };
            println!(
                "| {tile} | {name} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.2} | {:.2} | {:.2} |",
                range(&|r| psnr(&r.1.values, &truth), 1),
                range(&|r| 100.0 * r.0, 2),
                range(&|r| r.1.summary.relative_rms / r.0, 2),
                outcomes(&runs),
                range(&|r| r.1.summary.clusters as f64, 0),
                range(&|r| modes(&r.1).min(r.1.summary.clusters as f64), 0),
                range(&|r| r.2, 2),
                100.0 * direct_error,
                direct_cost,
                100.0 * like_error,
                like_cost,
            );
        }
    }
}

/// Of runs with their true errors: how many keep the tolerance, how many say that they miss it, and how many miss it and do not say so.
fn outcomes(runs: &[(f64, Effective, f64)]) -> String {
    let said = |r: &&(f64, Effective, f64)| r.1.summary.notes.iter().any(|note| note.contains("is not met"));
    let (kept, missed): (Vec<_>, Vec<_>) = runs.iter().partition(|r| r.0 <= TOLERANCE);
    let said = missed.iter().filter(|r| said(r)).count();
    format!("{}, {said}, {}", kept.len(), missed.len() - said)
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

/// Cells across the disc on which [`gamma`] compares densities, and points of the surface that it looks at, about.
const CELLS: usize = 33;
const POINTS: usize = 1 << 17;

/// RMS difference of the density of normals that are seen from straight above and its lobes, over cells of equal solid angle: Lambert's equal-area map of the
/// hemisphere to a disc, 33 square cells across, turned by 20 degrees so that no normal of the tiles lies between two. In percent of the density's largest cell, and of its own RMS.
fn gamma() {
    let orders = [1, 4, 5, 8, 16, 64, 512];
    let head: Vec<String> = orders.iter().map(|j| format!("J = {j}")).collect();
    println!("| tile | normals | {} |", head.join(" | "));
    println!("|---|---|{}", "---|".repeat(orders.len()));
    for tile in tiles() {
        let small = common::covered(tile, common::lobe(0.3, Distribution::Ggx));
        let seen = distinct(&seen_from_above(&small));
        let found = by_cells(&seen);
        let peak = found.iter().copied().fold(0.0, f64::max);
        let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / (PI / 4.0 * values.len() as f64)).sqrt();
        let errors = orders.map(|order| {
            let of_lobes = by_cells(&points_of(&Mixture::fit(&seen, Order::Fixed(order))));
            let off: Vec<f64> = of_lobes.iter().zip(&found).map(|(lobes, found)| lobes - found).collect();
            format!("{:.2}, {:.1}", 100.0 * rms(&off) / peak, 100.0 * rms(&off) / rms(&found))
        });
        println!("| {tile} | {} | {} |", seen.len(), errors.join(" | "));
    }
}

/// Normals of points that are seen from straight above, each with the area that is seen.
fn seen_from_above(small: &SmallScale) -> Vec<WeightedDirection> {
    let tile = &small.tile;
    let bvh = PeriodicBvh::new(tile).unwrap();
    let points = POINTS.div_ceil(tile.triangles.len());
    let of_triangle = |t: usize| {
        let [a, b, c] = tile.corners(t);
        let cross = (b - a).cross(c - a);
        (0..points).filter_map(move |k| (cross.z > 0.0).then_some((k, a, b, c, cross)))
    };
    let mut seen = Vec::new();
    for t in 0..tile.triangles.len() {
        for (k, a, b, c, cross) in of_triangle(t) {
            // Points of a lattice of the golden section, folded into the triangle.
            let (u, v) = ((0.5 + 0.754_877_666 * k as f64).fract(), (0.5 + 0.569_840_29 * k as f64).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            if bvh.occluded(t, a + u * (b - a) + v * (c - a), DVec3::Z) != Occlusion::Blocked {
                seen.push(WeightedDirection { direction: cross.normalize(), weight: 0.5 * cross.z / points as f64 });
            }
        }
    }
    seen
}

/// The shares of the weight of all directions that lie in each cell; what is below the horizon lies in none.
fn by_cells(directions: &[WeightedDirection]) -> Vec<f64> {
    let whole: f64 = directions.iter().map(|d| d.weight).sum();
    let mut cells = vec![0.0; CELLS * CELLS];
    for &WeightedDirection { direction, weight } in directions.iter().filter(|d| d.direction.z >= 0.0) {
        let radius = (1.0 - direction.z).max(0.0).sqrt() / direction.truncate().length().max(1e-300);
        let place = DVec2::from_angle(20_f64.to_radians()).rotate(direction.truncate() * radius);
        let cell = |x: f64| truncate_usize(((x + 1.0) * 0.5 * CELLS as f64).clamp(0.0, CELLS as f64 - 1.0));
        cells[CELLS * cell(place.y) + cell(place.x)] += weight / whole;
    }
    cells
}

/// Points that lie as a mixture does, at least 1,024 a lobe: a density of a thousand wide and narrow lobes, without steps that miss the narrow ones.
fn points_of(mixture: &Mixture) -> Vec<WeightedDirection> {
    let count = (POINTS / mixture.lobes.len().max(1)).max(1024);
    let of_lobe = |lobe: &MixtureLobe| {
        let MixtureLobe { axis, sharpness, share } = *lobe;
        let (x, y) = axis.any_orthonormal_pair();
        let point = move |k: usize| {
            // The cosine to the axis of a share of a density exp(sharpness cos).
            let u = (k as f64 + 0.5) / count as f64;
            let away = -(u + (1.0 - u) * (-2.0 * sharpness).exp()).ln() / sharpness;
            let (sin, cos) = (TAU * (0.618_033_988_749 * k as f64).fract()).sin_cos();
            let radius = (away * (2.0 - away)).max(0.0).sqrt();
            WeightedDirection { direction: axis * (1.0 - away) + radius * (cos * x + sin * y), weight: share / count as f64 }
        };
        (0..count).map(point)
    };
    mixture.lobes.iter().flat_map(of_lobe).collect()
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

/// CPU milliseconds of all threads, the least of five: a geometry edit prepares lobes and amplitudes; a BRDF edit evaluates from them alone, or from sums for each
/// sharpness, which are made once for a geometry. With dB of the values from these sums against those from lobes one by one, for the BRDFs of [`brdfs`].
fn speed() {
    println!(
        "| surface | lobes | geometry edit, CPU ms | BRDF edit from lobes, CPU ms | sums, CPU ms | BRDF edit from sums, CPU ms | measured BRDF, CPU ms | MB | MB with sums | dB |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let pairs = grid();
    let least = |of: &dyn Fn()| (0..5).map(|_| common::measure(of).1.cpu).fold(f64::INFINITY, f64::min);
    for tile in tiles() {
        let small = common::covered(tile, common::lobe(0.3, Distribution::Ggx));
        for lobes in [8, 32, 128] {
            let plan = format!("sg:improved:facets=4096:lobes={lobes}:modes=8").parse().unwrap();
            let prepare = || common::with_control(|c| prepare_lobes(&small, &pairs, &plan, 0, c).unwrap());
            let geometry = least(&|| drop(prepare()));
            let prepared = prepare();
            let edit = least(&|| drop(common::with_control(|c| prepared.evaluate(&small.surfaces, c).unwrap())));
            let bytes = prepared.bytes();
            let covers = brdfs().map(|(_, brdf)| common::covered(tile, brdf));
            let from_lobes = covers.each_ref().map(|s| common::with_control(|c| prepared.evaluate(&s.surfaces, c).unwrap()));
            let (responses, cost) = common::measure(|| common::with_control(|c| prepared.into_responses(c).unwrap()));
            let from_sums = |small: &SmallScale| common::with_control(|c| responses.evaluate(&small.surfaces, c).unwrap());
            let of_sums = least(&|| drop(from_sums(&small)));
            let of_measured = least(&|| drop(from_sums(&covers[3])));
            let decibels = from_lobes.iter().zip(&covers).map(|(expected, small)| {
                let (got, expected) =
                    [&from_sums(small), expected].map(|v| v.iter().flat_map(LobeValue::fbar).collect::<Vec<f64>>()).into();
                let peak = expected.iter().copied().fold(0.0, f64::max);
                let squares: f64 = got.iter().zip(&expected).map(|(g, e)| (g - e).powi(2)).sum();
                format!("{:.0}", 10.0 * (peak * peak * expected.len() as f64 / squares).log10())
            });
            println!(
                "| {tile} | to {lobes} | {:.0} | {:.1} | {:.0} | {:.1} | {:.1} | {:.2} | {:.2} | {} |",
                1e3 * geometry,
                1e3 * edit,
                1e3 * cost.cpu,
                1e3 * of_sums,
                1e3 * of_measured,
                bytes as f64 / 1e6,
                responses.bytes() as f64 / 1e6,
                decibels.collect::<Vec<_>>().join(", ")
            );
        }
    }
}
