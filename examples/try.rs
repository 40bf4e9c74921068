use biscale::direction::Pair;
use biscale::filter::{Control, Quality, effective};
use biscale::material::Material;
use glam::DVec3;
use std::sync::atomic::AtomicBool;
fn csv(path: &str) -> Vec<Vec<f64>> {
    std::fs::read_to_string(path).unwrap().lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}
fn main() {
    let tol: f64 = std::env::args().nth(1).unwrap().parse().unwrap();
    let seeds: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let filter = std::env::args().nth(3).unwrap_or_default();
    let t0 = std::time::Instant::now();
    let clock = || t0.elapsed().as_secs_f64();
    let cancel = AtomicBool::new(false);
    let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &clock };
    for tile in ["vgroove", "pyramid", "rods", "weave", "bumpy"] {
        for brdf in ["diffuse", "ggx_0.30", "ggx_0.05"] {
            let name = format!("{tile}.{brdf}");
            if !name.contains(&filter) {
                continue;
            }
            let dir = "tests/data/truth";
            let small = Material::load(format!("{dir}/{name}.toml").as_ref()).unwrap().build().unwrap();
            let pairs: Vec<Pair> = csv(&format!("{dir}/{tile}.pairs.csv"))
                .iter()
                .map(|r| Pair { wi: DVec3::new(r[0], r[1], r[2]).normalize(), wo: DVec3::new(r[3], r[4], r[5]).normalize() })
                .collect();
            let truth = csv(&format!("{dir}/{name}.expected.csv"));
            let peak = truth.iter().flat_map(|r| &r[..3]).fold(0.0_f64, |a, &b| a.max(b));
            let (mut within, mut total, mut worst, mut true_ms, mut est_ms) = (0, 0, 1.0_f64, 0.0, 0.0);
            let mut psnrs = vec![];
            let mut last = None;
            let mut avr: f64 = 0.0;
            for seed in 0..seeds {
                let e = effective(&small, &pairs, &Quality { tolerance: tol, seed, ..Quality::default() }, &control).unwrap();
                let (mut w, mut n, mut sq, mut en, mut tsq) = (0, 0, 0.0, 0.0, 0.0);
                for (v, t) in e.values.iter().zip(&truth) {
                    avr = avr.max((v.av - t[6]).abs());
                    for c in 0..3 {
                        let d = v.fbar[c] - t[c];
                        let tse = t[3 + c].max(1e-4 * t[c] + 1e-8);
                        if d.abs() <= 3.0 * v.se[c].hypot(tse) {
                            w += 1;
                        }
                        n += 1;
                        sq += d * d;
                        tsq += tse * tse;
                        en += t[c] * t[c];
                    }
                }
                within += w;
                total += n;
                worst = worst.min(w as f64 / n as f64);
                psnrs.push(10.0 * (peak * peak * n as f64 / sq).log10());
                true_ms += (sq - tsq).max(0.0) / en;
                est_ms += e.summary.relative_rms.powi(2);
                last = Some(e);
            }
            let e = last.unwrap();
            let min = psnrs.iter().copied().fold(f64::INFINITY, f64::min);
            println!(
                "{name:18} N {:8} true rms {:.5} est {:.5} psnr min {min:.1} within {:.3} worst {worst:.3} av {avr:.4} {:?}",
                e.summary.facets,
                (true_ms / seeds as f64).sqrt(),
                (est_ms / seeds as f64).sqrt(),
                within as f64 / total as f64,
                e.summary.stages.iter().map(|s| s.1.round()).collect::<Vec<_>>()
            );
        }
    }
}
