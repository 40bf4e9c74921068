//! Time of one evaluation of measured BRDFs at random directions: `cargo bench --bench measured [-- MERL.binary]`; `eval_lanes` does several
//! normals at once, all of them like the z axis, or spread over 50 degrees about it, as those of a rough height field are.
//!
//! Random directions are the worst case for the caches. The time is CPU time of this thread where Linux tells it, else wall
//! time; on a busy machine both include what neighbours do to the caches.

#![allow(clippy::print_stdout, reason = "a benchmark reports on stdout")]

use biscale::brdf::{LANES, Measured};
use glam::Vec3;
use std::path::Path;
use std::time::Instant;

/// Pairs of directions: 2.4 MB, like a small table of them.
const PAIRS: u32 = 100_000;
const ROUNDS: u32 = 5;

/// Nanoseconds that this thread has run, or `None` where the system does not say.
fn cpu_ns() -> Option<f64> {
    std::fs::read_to_string("/proc/thread-self/schedstat").ok()?.split(' ').next()?.parse().ok()
}

/// The least time of one of `count` calls, in ns, over all rounds.
fn least_ns(count: u32, mut run: impl FnMut()) -> f64 {
    let time = |run: &mut dyn FnMut()| {
        let (wall, cpu) = (Instant::now(), cpu_ns());
        run();
        match (cpu, cpu_ns()) {
            (Some(from), Some(to)) => to - from,
            _ => wall.elapsed().as_secs_f64() * 1e9,
        }
    };
    (0..ROUNDS).map(|_| time(&mut run)).fold(f64::INFINITY, f64::min) / f64::from(count)
}

/// A direction of the upper hemisphere by an additive sequence.
fn direction(k: u32, step_z: f64, step_phi: f64) -> Vec3 {
    let (z, phi) = (0.02 + 0.97 * (f64::from(k) * step_z).fract(), (f64::from(k) * step_phi).fract() * std::f64::consts::TAU);
    let radius = (1.0 - z * z).sqrt();
    glam::DVec3::new(radius * phi.cos(), radius * phi.sin(), z).as_vec3()
}

fn main() {
    let pairs: Vec<(Vec3, Vec3)> =
        (0..PAIRS).map(|k| (direction(k, 0.819_172_5, 0.671_043_6), direction(k, 0.549_700_5, 0.450_312_3))).collect();
    let paper = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/brdf/paper_white_rgb.bsdf");
    let mut tables = vec![
        Measured::fit("gold-metallic-paint", 1.0).expect("a built-in name"),
        Measured::read(&paper, 1.0).expect("a sample of the project"),
    ];
    for file in std::env::args().skip(1).filter(|a| !a.starts_with('-')) {
        match Measured::read(Path::new(&file), 1.0) {
            Ok(table) => tables.push(table),
            Err(error) => println!("{error}"),
        }
    }
    for table in &tables {
        let mut sum = 0.0;
        let mut lanes = |normals: [Vec3; LANES]| {
            let normals = [0, 1, 2].map(|c| normals.map(|n| n[c]));
            let time = least_ns(PAIRS, || {
                for &(wi, wo) in &pairs {
                    let values = table.eval_lanes(&normals, wi, wo);
                    sum += f64::from(values[1].iter().sum::<f32>()) / LANES as f64;
                }
            });
            time / LANES as f64
        };
        let alike = lanes(std::array::from_fn(|l| Vec3::new(1e-3 * l as f32, 0.0, 1.0).normalize()));
        // A golden spiral.
        let spread = lanes(std::array::from_fn(|l| {
            let (sin, cos) = (2.399_963 * l as f32).sin_cos();
            let radius = (50.0_f32.to_radians() * (l as f32 / LANES as f32).sqrt()).tan();
            Vec3::new(radius * cos, radius * sin, 1.0).normalize()
        }));
        let slow = least_ns(PAIRS, || {
            for &(wi, wo) in &pairs {
                sum += table.eval(glam::DVec3::Z, wi.as_dvec3(), wo.as_dvec3())[1];
            }
        });
        println!(
            "{}: eval_lanes {alike:.1} ns a normal (spread {spread:.1} ns), eval {slow:.0} ns (mean fr {:.3})",
            table.label,
            sum / f64::from(3 * ROUNDS * PAIRS)
        );
    }
}
