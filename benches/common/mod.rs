//! What the benchmarks share: cases on the tiles of the truth tests, CPU and wall seconds, peak memory.
//!
//! CPU seconds are those of the whole process, all threads together: what a user pays for, and what can be compared between
//! programs that use different numbers of threads.

#![allow(dead_code, reason = "each benchmark uses a part of this")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

use biscale::brdf::{Brdf, Distribution};
use biscale::direction::Pair;
use biscale::filter::{Control, Effective, Quality, effective};
use biscale::material::{Material, SmallScale, Surface, Tint};
use biscale::toml_reader::Source;
use glam::DVec3;
use rustix::time::{ClockId, clock_gettime};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// What a piece of work took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// CPU seconds of all threads.
    pub cpu: f64,
    /// Wall seconds.
    pub wall: f64,
}

/// CPU seconds of the process so far.
fn cpu_seconds() -> f64 {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Does `work` and says what it took.
pub fn measure<T>(work: impl FnOnce() -> T) -> (T, Cost) {
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    let result = work();
    (result, Cost { cpu: cpu_seconds() - cpu, wall: wall.elapsed().as_secs_f64() })
}

/// Forgets the peak so far, where the system can (Linux).
pub fn reset_peak() {
    // Without it the peaks that follow include those before: larger, never smaller.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Largest resident memory since [`reset_peak`], MiB; `None` where the system does not say.
pub fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// The folder of the truth tests.
pub fn truth_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/truth")
}

/// A surface of the truth tests as its file has it, `NAME` of `NAME.toml`.
pub fn truth(name: &str) -> SmallScale {
    Material::load(&truth_folder().join(format!("{name}.toml"))).unwrap().build().unwrap()
}

/// The rows of a CSV file of the truth tests.
pub fn truth_rows(file: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(truth_folder().join(file)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

/// A tile of the truth tests, all of it covered by `brdf`.
pub fn covered(tile: &str, brdf: Brdf) -> SmallScale {
    cover(truth(&format!("{tile}.diffuse")), brdf)
}

/// A kind of geometry at its default values.
pub fn recipe(kind: &str) -> SmallScale {
    let surface = "[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n";
    let text = format!("format = 1\n[geometry]\nkind = \"{kind}\"\n{surface}");
    Material::parse(&Source { path: format!("{kind}.toml").into(), text }).unwrap().build().unwrap()
}

/// `small` with all of it covered by `brdf`.
pub fn cover(mut small: SmallScale, brdf: Brdf) -> SmallScale {
    small.surfaces = vec![whole(brdf)];
    small.surface_of_triangle.fill(0);
    small
}

/// `brdf` on all parts.
pub fn whole(brdf: Brdf) -> Surface {
    Surface { part: "*".into(), brdf, tint: Tint::Uniform([1.0; 3]), line: 0 }
}

/// A grey diffuse BRDF.
pub fn diffuse() -> Brdf {
    Brdf::Lambert { albedo: [0.5; 3] }
}

/// A grey lobe.
pub fn lobe(alpha: f64, distribution: Distribution) -> Brdf {
    Brdf::CookTorrance { diffuse: [0.0; 3], specular: [0.5; 3], alpha, distribution, f0: None }
}

/// A grey GGX lobe.
pub fn ggx(alpha: f64) -> Brdf {
    lobe(alpha, Distribution::Ggx)
}

/// `count` directions up to `theta_deg`, a Fibonacci lattice uniform in solid angle.
pub fn spread_directions(count: usize, theta_deg: f64) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let step = (1.0 - theta_deg.to_radians().cos()) / count as f64;
    let direction = |i: usize| {
        let k = i as f64 + 0.5;
        let z = 1.0 - step * k;
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * (golden * k).cos(), r * (golden * k).sin(), z).normalize()
    };
    (0..count).map(direction).collect()
}

/// `count` pairs that are uniform in projected solid angle: an additive recurrence in four dimensions.
pub fn projected_pairs(count: usize) -> Vec<Pair> {
    /// Root of x^5 = x + 1.
    const ROOT: f64 = 1.167_303_978_261_418_7;
    let number = |k: usize, d: i32| (0.5 + (k + 1) as f64 * ROOT.powi(-d)).fract();
    let direction = |square: f64, turn: f64| {
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        DVec3::new(cos, sin, 0.0) * square.sqrt() + DVec3::Z * (1.0 - square).sqrt()
    };
    (0..count).map(|k| Pair { wi: direction(number(k, 1), number(k, 2)), wo: direction(number(k, 3), number(k, 4)) }).collect()
}

/// All pairs of `directions`, the light's running fastest.
pub fn all_pairs(directions: &[DVec3]) -> Vec<Pair> {
    directions.iter().flat_map(|&wo| directions.iter().map(move |&wi| Pair { wi, wo })).collect()
}

/// Runs `small` on `pairs`.
pub fn run(small: &SmallScale, pairs: &[Pair], quality: &Quality) -> Effective {
    with_control(|control| effective(small, pairs, quality, control).unwrap())
}

/// Calls `work` with a control that never stops it.
pub fn with_control<T>(work: impl FnOnce(&Control<'_>) -> T) -> T {
    let start = Instant::now();
    let (cancel, clock) = (AtomicBool::new(false), || start.elapsed().as_secs_f64());
    work(&Control { cancel: &cancel, progress: &|_, _| {}, clock: &clock })
}

/// Milliseconds of the stages, shortest name first as the summary has them.
pub fn stages(effective: &Effective) -> String {
    let list: Vec<String> = effective.summary.stages.iter().map(|(name, ms)| format!("{name} {ms:.0}")).collect();
    list.join(", ")
}

/// Arguments after `--`, without what cargo adds.
pub fn arguments() -> Vec<String> {
    std::env::args().skip(1).filter(|a| a != "--bench").collect()
}
