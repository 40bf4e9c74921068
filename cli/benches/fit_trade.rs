//! What optimisers and tolerances buy, over several fits and seeds: `cargo bench --bench fit_trade [-- [--seeds=3] FIT.toml ...]`.
//!
//! Runs `biscale fit FIT.toml --compare-optimizers` for each file and seed, and prints a Markdown table of the medians over all of them.
//! `samples/fit` if no file is named; name files by absolute paths.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds: u64 = arguments.iter().find_map(|a| a.strip_prefix("--seeds=")).map_or(3, |n| n.parse().unwrap());
    let named: Vec<String> = arguments.into_iter().filter(|a| !a.starts_with("--")).collect();
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../samples/fit/fit.toml").display().to_string();
    let files = if named.is_empty() { vec![sample] } else { named };
    let mut runs: Vec<Vec<Value>> = Vec::new();
    for (file, seed) in files.iter().flat_map(|f| (0..seeds).map(move |s| (f, s))) {
        let folder = tempfile::tempdir().unwrap();
        let run = Command::new(env!("CARGO_BIN_EXE_biscale"))
            .args(["fit", file, "--compare-optimizers", "--seed", &seed.to_string(), "--json", "--quiet", "-o"])
            .arg(folder.path())
            .output()
            .unwrap();
        let said: Value = serde_json::from_slice(&run.stdout).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&run.stderr)));
        runs.push(said["fit"]["compared_optimizers"].as_array().unwrap_or_else(|| panic!("{file}: {said}")).clone());
    }
    println!("{} fits, {seeds} seeds each; medians, the worst in brackets\n", files.len());
    println!("| search | winner | all | objective | training | validation |\n|---|---|---|---|---|---|");
    for (k, first) in runs[0].iter().enumerate() {
        let of = |key: &str| {
            let mut values: Vec<f64> = runs.iter().filter_map(|run| run[k][key].as_f64()).collect();
            values.sort_by(f64::total_cmp);
            (values.get(values.len() / 2).copied().unwrap_or(f64::NAN), values.last().copied().unwrap_or(f64::NAN))
        };
        let percent = |(median, worst): (f64, f64)| format!("{:.1} % ({:.1})", 100.0 * median, 100.0 * worst);
        let (objective, worst) = of("objective");
        println!(
            "| {} | {:.0} | {:.0} | {objective:.3} ({worst:.3}) | {} | {} |",
            first["what"].as_str().unwrap(),
            of("of_winner").0,
            of("evaluations").0,
            percent(of("training")),
            percent(of("validation"))
        );
    }
}
