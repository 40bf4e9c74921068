//! What a fit of two photographs takes, from the captured photographs to the report: `cargo bench --bench fit [-- FIT.toml ...]`.
//!
//! The whole command runs, all eight starts, photographs and report included; `samples/fit` if no file is named.

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "benchmarks print, and stop where something is wrong")]

use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn main() {
    let named: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("../samples/fit/fit.toml").display().to_string();
    let files = if named.is_empty() { vec![sample] } else { named };
    println!(
        "{:40} {:>8} {:>8} {:>8} {:>8} {:>10} {:>10} {:>10}",
        "fit", "wall s", "CPU s", "winner", "all", "ms each", "training", "validation"
    );
    for file in files {
        let folder = tempfile::tempdir().unwrap();
        let run = Command::new(env!("CARGO_BIN_EXE_biscale"))
            .args(["fit", &file, "--json", "--quiet", "-o"])
            .arg(folder.path())
            .output()
            .unwrap();
        let said: Value = serde_json::from_slice(&run.stdout).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&run.stderr)));
        let (fit, search) = (&said["fit"], &said["fit"]["search"]);
        let part = |name: &str| said["parts"][name].as_f64().unwrap_or(0.0);
        let evaluations = search["evaluations"].as_f64().unwrap();
        let percent = |v: &Value| v.as_f64().map_or("-".to_owned(), |v| format!("{:.2} %", 100.0 * v));
        println!(
            "{:40} {:8.1} {:8.1} {:8} {:8} {:10.1} {:>10} {:>10}",
            file.rsplit('/').take(2).collect::<Vec<_>>().join(" of "),
            said["seconds"].as_f64().unwrap(),
            said["cpu_seconds"].as_f64().unwrap_or(f64::NAN),
            search["starts"][0]["evaluations"],
            evaluations,
            1e3 * (part("explore") + part("refine") + part("polish")) / evaluations,
            percent(&fit["training"]["relative_rms"]),
            percent(&fit["validation"][0]["relative_rms"]),
        );
    }
}
